//! All measures of the difference between two pictures, by name.
//!
//! One table, [`MEASURES`], lists them; bounds, tables and figures of the command line are made from it.

use crate::metrics::{
    DEFAULT_PIXELS_PER_DEGREE, Exposures, MetricError, Pair, RidgeSettings, Variances, bias, energy_ratio, flip_hdr, flip_ldr, luminance,
    mae, mse, psnr, quantile, rel_mse, ridge_error, ssim, z_test,
};

/// The offset ε of relMSE, as a share of the reference's mean luminance: it keeps relMSE finite where the reference is dark.
pub const REL_MSE_FLOOR: f64 = 0.01;

/// Probability that the z-test rejects a value of a picture without any error.
pub const Z_TEST_LEVEL: f64 = 0.01;

/// Quantile of the reference's luminance that becomes white for measures that need values from 0 to 1; it is also the peak of PSNR.
const WHITE_QUANTILE: f64 = 0.99;

/// Which values of a measure are good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    /// Small values.
    Less,
    /// Large values.
    More,
    /// Values near 1.
    One,
    /// Values near 0, of either sign.
    Zero,
}

/// A measure by which pictures are compared.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Name in bounds, tables and JSON.
    pub name: &'static str,
    /// Description in one line.
    pub summary: &'static str,
    /// Which values are good.
    pub better: Better,
}

/// All measures, in the order of tables.
pub const MEASURES: &[Measure] = &[
    Measure { name: "energy_ratio", summary: "light of the test over that of the reference", better: Better::One },
    Measure { name: "bias", summary: "mean difference, over the mean of the reference", better: Better::Zero },
    Measure { name: "mae", summary: "mean absolute difference, over the mean of the reference", better: Better::Less },
    Measure { name: "mse", summary: "mean squared difference, in the square of the unit", better: Better::Less },
    Measure {
        name: "rel_mse",
        summary: "mean of the squared difference over the square of the reference and a hundredth of its mean",
        better: Better::Less,
    },
    Measure { name: "rel_mse_net", summary: "the same, less what the noise of the reference adds", better: Better::Less },
    Measure { name: "psnr", summary: "peak signal to noise in dB, the peak being the reference's 99 % quantile", better: Better::More },
    Measure { name: "ssim", summary: "structural similarity, shown with the 99 % quantile as white", better: Better::More },
    Measure { name: "flip", summary: "mean FLIP: over all exposures for radiometric pictures, else as shown", better: Better::Less },
    Measure { name: "ridge_px", summary: "mean distance between bright ridges, in pixels", better: Better::Less },
    Measure { name: "ridge_p95_px", summary: "95 % quantile of that distance, in pixels", better: Better::Less },
    Measure {
        name: "z_rejected",
        summary: "share of values that noise does not explain, at a family-wise level of 1 %",
        better: Better::Less,
    },
];

/// The measure with this name.
#[must_use]
pub fn measure(name: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.name == name)
}

impl Measure {
    /// Whether a value keeps a bound: its distance from the best value is at most `bound`, or, if more is better, the value is at least `bound`.
    #[must_use]
    pub fn is_within(&self, value: f64, bound: f64) -> bool {
        match self.better {
            Better::Less => value <= bound,
            Better::More => value >= bound,
            Better::One => (value - 1.0).abs() <= bound,
            Better::Zero => value.abs() <= bound,
        }
    }
}

/// The pictures to compare, and what is known about them.
#[derive(Clone, Copy, Debug)]
pub struct Judged<'a> {
    /// The pictures.
    pub pair: Pair<'a>,
    /// Area of the surface that each pixel shows, m²; `None` for equal areas.
    pub areas_m2: Option<&'a [f32]>,
    /// Variance of the reference's means; `None` for a reference without noise.
    pub variance: Option<&'a [[f32; 3]]>,
    /// Whether the values are display values from 0 to 1; otherwise they are linear light.
    pub display: bool,
}

/// The value of a measure, or the reason why there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Name of the measure.
    pub name: &'static str,
    /// Its value.
    pub value: Result<f64, MetricError>,
}

/// Compares by every measure that applies. Measures of noise need a reference with a variance.
#[must_use]
pub fn judge(judged: &Judged<'_>) -> Vec<Verdict> {
    let pair = &judged.pair;
    let count = pair.count() as f64;
    let mean = pair.pixels().map(|(r, _)| luminance(r)).sum::<f64>() / count;
    let epsilon = (mean * REL_MSE_FLOOR).max(f64::MIN_POSITIVE);
    let mut luminances: Vec<f64> = pair.pixels().map(|(r, _)| luminance(r)).collect();
    let white = quantile(&mut luminances, WHITE_QUANTILE).filter(|&white| white > 0.0).unwrap_or(1.0);
    let ones;
    let areas = match judged.areas_m2 {
        Some(areas) => areas,
        None => {
            ones = vec![1.0; pair.reference().len()];
            &ones
        }
    };
    let ridge = ridge_error(pair, &RidgeSettings::default());
    let relative = |value: f64| if mean > 0.0 { value / mean } else { value };
    let mut verdicts = vec![
        Verdict { name: "energy_ratio", value: energy_ratio(pair, areas).map(|ratio| ratio.total) },
        Verdict { name: "bias", value: Ok(relative(bias(pair))) },
        Verdict { name: "mae", value: Ok(relative(mae(pair))) },
        Verdict { name: "mse", value: Ok(mse(pair)) },
        Verdict { name: "rel_mse", value: rel_mse(pair, epsilon) },
    ];
    if let Some(variance) = judged.variance {
        verdicts.push(Verdict { name: "rel_mse_net", value: rel_mse(pair, epsilon).map(|value| value - noise(pair, variance, epsilon)) });
    }
    verdicts.push(Verdict { name: "psnr", value: psnr(pair, if judged.display { 1.0 } else { white }) });
    verdicts.push(Verdict { name: "ssim", value: shown(judged, white, ssim) });
    verdicts.push(Verdict { name: "flip", value: flip(judged) });
    verdicts.push(Verdict { name: "ridge_px", value: ridge.clone().map(|ridge| ridge.mean_px) });
    verdicts.push(Verdict { name: "ridge_p95_px", value: ridge.map(|ridge| ridge.p95_px) });
    if let Some(variance) = judged.variance {
        let test = z_test(pair, &Variances { reference: variance, test: None }, Z_TEST_LEVEL);
        verdicts.push(Verdict { name: "z_rejected", value: test.map(|test| test.rejected as f64 / test.tested as f64) });
    }
    verdicts
}

/// The part of [`rel_mse`] that noise of this variance causes.
fn noise(pair: &Pair<'_>, variance: &[[f32; 3]], epsilon: f64) -> f64 {
    let sum: f64 = pair
        .indices()
        .map(|index| {
            let channel = |c: usize| {
                let scale = f64::from(pair.reference()[index][c]) + epsilon;
                f64::from(variance[index][c]) / (scale * scale)
            };
            channel(0) + channel(1) + channel(2)
        })
        .sum();
    sum / (3.0 * pair.count() as f64)
}

/// A measure of display values: unchanged, or linear light scaled to 0..1 with one exposure.
fn shown(judged: &Judged<'_>, white: f64, value: impl Fn(&Pair<'_>) -> Result<f64, MetricError>) -> Result<f64, MetricError> {
    let pair = &judged.pair;
    if judged.display {
        return value(pair);
    }
    let scale = (1.0 / white) as f32;
    let show = |pixels: &[[f32; 3]]| pixels.iter().map(|rgb| rgb.map(|c| (c * scale).clamp(0.0, 1.0))).collect::<Vec<_>>();
    let (reference, test) = (show(pair.reference()), show(pair.test()));
    let mask: Vec<bool> = (0..reference.len()).map(|index| pair.counts(index)).collect();
    value(&Pair::with_mask(pair.width(), pair.height(), &reference, &test, Some(&mask))?)
}

fn flip(judged: &Judged<'_>) -> Result<f64, MetricError> {
    let pair = &judged.pair;
    let flip = if judged.display {
        flip_ldr(pair, DEFAULT_PIXELS_PER_DEGREE)
    } else {
        flip_hdr(pair, DEFAULT_PIXELS_PER_DEGREE, &Exposures::of(pair)?)
    };
    Ok(flip?.mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_get_the_best_of_every_measure() {
        let picture: Vec<[f32; 3]> = (0..64 * 48).map(|k| [0.2 + 0.1 * ((k % 64) as f32 * 0.3).abs().fract(); 3]).collect();
        let pair = Pair::new(64, 48, &picture, &picture).unwrap();
        let variance = vec![[1.0e-6; 3]; picture.len()];
        let verdicts = judge(&Judged { pair, areas_m2: None, variance: Some(&variance), display: false });
        let value = |name: &str| verdicts.iter().find(|v| v.name == name).unwrap().value.clone();
        for name in ["bias", "mae", "mse", "rel_mse", "flip", "z_rejected"] {
            assert_eq!(value(name), Ok(0.0), "{name}");
        }
        assert_eq!(value("energy_ratio"), Ok(1.0));
        assert!((value("ssim").unwrap() - 1.0).abs() < 1e-12);
        assert!(value("rel_mse_net").unwrap() < 0.0, "noise was not taken off");
    }

    #[test]
    fn a_darker_picture_is_told_by_every_measure_of_size() {
        let reference: Vec<[f32; 3]> = (0..32 * 32).map(|k| [0.5 + 0.4 * ((k % 7) as f32 / 7.0); 3]).collect();
        let test: Vec<[f32; 3]> = reference.iter().map(|rgb| rgb.map(|c| c * 0.9)).collect();
        let pair = Pair::new(32, 32, &reference, &test).unwrap();
        let verdicts = judge(&Judged { pair, areas_m2: None, variance: None, display: false });
        let value = |name: &str| verdicts.iter().find(|v| v.name == name).unwrap().value.clone().unwrap();
        assert!((value("energy_ratio") - 0.9).abs() < 1e-6);
        assert!((value("bias") + 0.1).abs() < 1e-6);
        assert!(value("rel_mse") > 0.009 && value("rel_mse") < 0.0101);
        assert!(verdicts.iter().all(|v| v.name != "z_rejected"), "no variance, no test of noise");
        assert!(!measure("energy_ratio").unwrap().is_within(value("energy_ratio"), 0.05));
        assert!(measure("energy_ratio").unwrap().is_within(value("energy_ratio"), 0.11));
    }
}
