//! A test whether differences are larger than noise explains.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::pair::{MetricError, Pair};

/// Variances of the pictures' values, row-major, in the square of their unit.
///
/// For a renderer that averages `n` samples per pixel, this is the sample variance over `n`: the variance of the mean, not of one sample.
#[derive(Clone, Copy, Debug)]
pub struct Variances<'a> {
    /// Variance of each value of the reference, at least 0.
    pub reference: &'a [[f32; 3]],
    /// Variance of each value of the test, at least 0; `None` if it has no noise.
    pub test: Option<&'a [[f32; 3]]>,
}

/// Result of [`z_test()`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// Number of values tested: three per pixel that counts.
    pub tested: usize,
    /// Number of values that differ from the reference by more than chance explains.
    pub rejected: usize,
    /// Largest `|z|` that passes, in standard deviations.
    pub threshold: f64,
    /// Column, row and channel of the value with the largest `|z|`; the first one if there are several.
    pub worst: (u32, u32, usize),
    /// The `z` of that value: above 0 if the test is too bright, infinite if values without variance differ.
    pub worst_z: f64,
}

impl ZTest {
    /// Whether no value was rejected.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.rejected == 0
    }
}

/// Tests, value by value, whether reference and test are equal except for noise.
///
/// If they are, `z = (x − r)/√(var_r + var_x)` is standard normal. A value is rejected if `|z|` exceeds the two-sided quantile of the level
/// `1 − (1 − α)^(1/n)` [Šidák 1967], where `n` is the number of values. Of pictures without a systematic error, the share `α` (in `0..1`, such as
/// 0.01) has at least one rejection if values are independent, and at most that share if they are correlated, as the channels of one path are. Values
/// without variance must be equal; otherwise they are rejected.
///
/// The level is per picture, so the test finds single wrong pixels; to find a shift far below the noise of every pixel, use [`super::energy_ratio`].
/// The noise must be normal: average enough samples per pixel for the central limit theorem to hold, or bright outliers will be rejected.
///
/// # Errors
/// If `alpha` is out of range, a list has the wrong length, or a variance is negative or not finite.
pub fn z_test(pair: &Pair, variances: &Variances, alpha: f64) -> Result<ZTest, MetricError> {
    if !(alpha > 0.0 && alpha < 1.0) {
        return Err(MetricError::BadParameter { name: "alpha", value: alpha, allowed: "it must lie between 0 and 1" });
    }
    let is_variance = |value: f32| value >= 0.0 && value.is_finite();
    for (list, pixels) in [("reference's variance", Some(variances.reference)), ("test's variance", variances.test)] {
        if let Some(pixels) = pixels {
            pair.check_count(list, pixels.len())?;
            pair.check_values(list, pixels, is_variance, "it must be at least 0 and finite")?;
        }
    }
    let tested = 3 * pair.count();
    // 1 − (1 − α)^(1/n), without the cancellation.
    let level = -libm::expm1(libm::log1p(-alpha) / tested as f64);
    let threshold = two_sided_quantile(level)?;
    let mut result = ZTest { tested, rejected: 0, threshold, worst: (0, 0, 0), worst_z: 0.0 };
    let mut worst = -1.0;
    for (index, (reference, test)) in pair.indices().zip(pair.pixels()) {
        for channel in 0..3 {
            let difference = f64::from(test[channel]) - f64::from(reference[channel]);
            let own = variances.test.map_or(0.0, |pixels| f64::from(pixels[index][channel]));
            let z = match f64::from(variances.reference[index][channel]) + own {
                _ if difference == 0.0 => 0.0,
                variance => difference / variance.sqrt(),
            };
            result.rejected += usize::from(z.abs() > threshold);
            if z.abs() > worst {
                worst = z.abs();
                let (x, y) = pair.position(index);
                (result.worst, result.worst_z) = ((x, y, channel), z);
            }
        }
    }
    Ok(result)
}

/// The `z ≥ 0` that a standard normal variable exceeds in magnitude with the probability `level`, in `0..=1`: `erfc(z/√2) = level`.
///
/// Newton's iteration on `ln erfc(z/√2) − ln level`, which is concave in `z`: from the upper bound `√(−2 ln level)` it descends to the root without
/// ever passing it, at any distance. Relative error below 1e-13 for levels down to 1e-300.
///
/// # Errors
/// If `level` is not in `0..=1`, or is 0, for which the quantile is infinite.
pub fn two_sided_quantile(level: f64) -> Result<f64, MetricError> {
    if !(level > 0.0 && level <= 1.0) {
        return Err(MetricError::BadParameter { name: "level", value: level, allowed: "it must be above 0 and at most 1" });
    }
    let mut z = (-2.0 * libm::log(level)).sqrt();
    for _ in 0..MAX_STEPS {
        let tail = libm::erfc(z * FRAC_1_SQRT_2);
        // d/dz erfc(z/√2) = −√(2/π)·exp(−z²/2)
        let step = libm::log(tail / level) * tail / ((2.0 / PI).sqrt() * libm::exp(-0.5 * z * z));
        z += step;
        if step.abs() <= 1.0e-15 * z {
            break;
        }
    }
    Ok(z.max(0.0))
}

/// Iterations after which [`two_sided_quantile`] stops; six are always enough.
const MAX_STEPS: u32 = 50;

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_math::rng::normal_pair;

    const SIDE: u32 = 40;

    /// A normal number for each channel of each pixel.
    fn normals(seed: u32) -> Vec<[f32; 3]> {
        (0..SIDE * SIDE)
            .map(|i| {
                let [a, b] = normal_pair(seed, 0, i);
                [a, b, normal_pair(seed, 1, i)[0]]
            })
            .collect()
    }

    /// Mean 100 with the standard deviation `sigma`, and its variance.
    fn noisy(seed: u32, mean: f32, sigma: f32) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let pixels = normals(seed).iter().map(|pixel| pixel.map(|n| mean + sigma * n)).collect();
        (pixels, vec![[sigma * sigma; 3]; (SIDE * SIDE) as usize])
    }

    fn run(reference: &[[f32; 3]], test: &[[f32; 3]], variances: &Variances, alpha: f64) -> ZTest {
        z_test(&Pair::new(SIDE, SIDE, reference, test).unwrap(), variances, alpha).unwrap()
    }

    #[test]
    fn quantiles_agree_with_tables() {
        // From 60-digit arithmetic.
        for (level, z) in QUANTILES {
            let error = (two_sided_quantile(level).unwrap() / z - 1.0).abs();
            assert!(error < 1.0e-13, "level {level:e}: off by {error:e}");
        }
        assert_eq!(two_sided_quantile(1.0).unwrap(), 0.0);
        for level in [0.0, -0.1, 1.1, f64::NAN] {
            assert!(matches!(two_sided_quantile(level), Err(MetricError::BadParameter { name: "level", .. })));
        }
    }

    #[test]
    fn noise_passes() {
        let (reference, variance) = noisy(1, 100.0, 2.0);
        let (test, test_variance) = noisy(2, 100.0, 1.0);
        let result = run(&reference, &test, &Variances { reference: &variance, test: Some(&test_variance) }, 0.01);
        assert!(result.passes(), "{result:?}");
        assert_eq!(result.tested, 4800);
        assert!((2.5..5.0).contains(&result.worst_z.abs()));
    }

    #[test]
    fn understated_variance_fails() {
        let (reference, variance) = noisy(1, 100.0, 2.0);
        let (test, _) = noisy(2, 100.0, 2.0);
        assert!(!run(&reference, &test, &Variances { reference: &variance, test: None }, 0.01).passes());
    }

    #[test]
    fn one_wrong_value_fails_and_is_named() {
        let (mut test, variance) = noisy(1, 100.0, 2.0);
        let reference = vec![[100.0; 3]; test.len()];
        test[7 * SIDE as usize + 5][1] = 100.0 - 8.0 * 2.0;
        let result = run(&reference, &test, &Variances { reference: &variance, test: None }, 0.01);
        assert_eq!((result.rejected, result.worst), (1, (5, 7, 1)));
        assert!((result.worst_z + 8.0).abs() < 1.0e-6);
    }

    #[test]
    fn a_systematic_shift_fails() {
        let (test, variance) = noisy(3, 101.0, 0.1);
        let reference = vec![[100.0; 3]; test.len()];
        let result = run(&reference, &test, &Variances { reference: &variance, test: None }, 0.01);
        assert!(result.rejected > 4700, "{result:?}");
    }

    #[test]
    fn a_moved_picture_fails() {
        let ramp: Vec<[f32; 3]> = (0..SIDE * SIDE).map(|i| [(i % SIDE) as f32; 3]).collect();
        let mut moved = ramp.clone();
        moved.rotate_right(1);
        let variance = vec![[0.01; 3]; ramp.len()];
        assert!(!run(&ramp, &moved, &Variances { reference: &variance, test: None }, 0.01).passes());
    }

    #[test]
    fn the_share_of_false_alarms_is_alpha() {
        let alpha = 0.2;
        let reference = vec![[0.0; 3]; (SIDE * SIDE) as usize];
        let variance = vec![[1.0; 3]; reference.len()];
        let failed =
            (0..200).filter(|&seed| !run(&reference, &normals(seed), &Variances { reference: &variance, test: None }, alpha).passes());
        let failed = failed.count() as f64;
        // Binomial: 40 expected, standard deviation √(200·0.2·0.8) = 5.7.
        assert!((failed - 40.0).abs() < 3.0 * 5.7, "{failed} of 200");
    }

    #[test]
    fn values_without_variance_must_be_equal() {
        let (grey, none) = (vec![[0.5; 3]; 1600], vec![[0.0; 3]; 1600]);
        let equal = run(&grey, &grey, &Variances { reference: &none, test: Some(&none) }, 0.01);
        assert!(equal.passes() && equal.worst_z == 0.0);
        let mut test = grey.clone();
        test[1599][2] = 0.5 - f32::EPSILON;
        let result = run(&grey, &test, &Variances { reference: &none, test: None }, 0.01);
        assert_eq!((result.rejected, result.worst, result.worst_z), (1, (39, 39, 2), f64::NEG_INFINITY));
    }

    #[test]
    fn bad_input_is_refused() {
        let grey = [[0.5; 3]; 4];
        let pair = Pair::new(2, 2, &grey, &grey).unwrap();
        let good = Variances { reference: &grey, test: None };
        for alpha in [0.0, 1.0, f64::NAN] {
            assert!(matches!(z_test(&pair, &good, alpha), Err(MetricError::BadParameter { name: "alpha", .. })));
        }
        for broken in [f32::NAN, f32::INFINITY, -1.0e-9] {
            let mut variance = grey;
            variance[2][0] = broken;
            assert!(matches!(
                z_test(&pair, &Variances { reference: &variance, test: None }, 0.1),
                Err(MetricError::BadValue { x: 0, y: 1, .. })
            ));
            assert!(z_test(&pair, &Variances { reference: &grey, test: Some(&variance) }, 0.1).is_err());
        }
        assert!(matches!(
            z_test(&pair, &Variances { reference: &grey[..3], test: None }, 0.1),
            Err(MetricError::WrongCount { found: 3, .. })
        ));
    }

    const QUANTILES: [(f64, f64); 7] = [
        (0.9, 0.125_661_346_855_074_01),
        (0.3173, 1.000_021_713_322_999_1),
        (0.05, 1.959_963_984_540_054_2),
        (1.0e-6, 4.891_638_475_698_59),
        (1.0e-12, 7.130_506_848_171_325),
        (1.0e-30, 11.523_883_577_380_25),
        (1.0e-300, 37.065_787_880_772_13),
    ];
}
