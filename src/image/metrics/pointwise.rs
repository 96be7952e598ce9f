//! Measures that compare each pixel alone.
//!
//! All are means over the pixels that count and over the three channels, in 64 bits and in index order. `x` is the test, `r` the reference.

use super::pair::{MetricError, Pair};

/// Offset of [`rel_mse`] in `pbrt` (version 4, `util/image.cpp`), for pictures whose values are about 1.
pub const REL_MSE_EPSILON: f64 = 0.01;

/// Mean of `f(x, r)` over pixels and channels.
fn mean(pair: &Pair, f: impl Fn(f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for (reference, test) in pair.pixels() {
        for channel in 0..3 {
            sum += f(f64::from(test[channel]), f64::from(reference[channel]));
        }
    }
    sum / (3.0 * pair.count() as f64)
}

/// Mean squared error `mean((x − r)²)`, in the square of the pictures' unit; 0 for equal pictures, else above 0.
#[must_use]
pub fn mse(pair: &Pair) -> f64 {
    mean(pair, |x, r| (x - r) * (x - r))
}

/// Mean absolute error `mean(|x − r|)`, in the pictures' unit, at least 0.
#[must_use]
pub fn mae(pair: &Pair) -> f64 {
    mean(pair, |x, r| (x - r).abs())
}

/// Mean signed error `mean(x − r)`, in the pictures' unit: above 0 where the test is too bright.
#[must_use]
pub fn bias(pair: &Pair) -> f64 {
    mean(pair, |x, r| x - r)
}

/// Relative mean squared error `mean((x − r)²/(r + ε)²)`, a pure number, at least 0.
///
/// `epsilon`, in the pictures' unit and above 0, limits the weight of dark pixels. [`REL_MSE_EPSILON`] suits pictures with values around 1. An
/// irradiance in W/m2 needs an `epsilon` in proportion, such as 1 % of the reference's mean; the result is then independent of the unit.
///
/// # Errors
/// If `epsilon` is not above 0, or a reference value is negative, because `r + ε` might then be zero.
pub fn rel_mse(pair: &Pair, epsilon: f64) -> Result<f64, MetricError> {
    if !(epsilon > 0.0 && epsilon.is_finite()) {
        return Err(MetricError::BadParameter { name: "epsilon", value: epsilon, allowed: "it must be above 0 and finite" });
    }
    pair.check_values("reference", pair.reference(), |value| value >= 0.0, "a relative error needs values of at least 0")?;
    Ok(mean(pair, |x, r| (x - r) * (x - r) / ((r + epsilon) * (r + epsilon))))
}

/// Peak signal-to-noise ratio `10·log₁₀(peak²/mse)`, in decibels; `+∞` for equal pictures.
///
/// `peak`, in the pictures' unit and above 0, is the value of a full signal: 1 for pictures in `0..=1`. A high dynamic range has no natural peak, so
/// state the one used.
///
/// # Errors
/// If `peak` is not above 0.
pub fn psnr(pair: &Pair, peak: f64) -> Result<f64, MetricError> {
    if !(peak > 0.0 && peak.is_finite()) {
        return Err(MetricError::BadParameter { name: "peak", value: peak, allowed: "it must be above 0 and finite" });
    }
    Ok(10.0 * libm::log10(peak * peak / mse(pair)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: [[f32; 3]; 2] = [[1.0, 2.0, 4.0], [0.0, 1.0, 1.0]];
    const TEST: [[f32; 3]; 2] = [[1.5, 2.0, 3.0], [0.0, 1.0, 1.0]];

    #[test]
    fn errors_are_what_a_hand_computes() {
        let pair = Pair::new(2, 1, &REFERENCE, &TEST).unwrap();
        assert_eq!(mse(&pair), (0.25 + 1.0) / 6.0);
        assert_eq!(mae(&pair), 1.5 / 6.0);
        assert_eq!(bias(&pair), -0.5 / 6.0);
        let relative = (0.25 / (1.01 * 1.01) + 1.0 / (4.01 * 4.01)) / 6.0;
        assert!((rel_mse(&pair, REL_MSE_EPSILON).unwrap() - relative).abs() < 1.0e-15);
        assert!((psnr(&pair, 4.0).unwrap() - 10.0 * libm::log10(16.0 * 6.0 / 1.25)).abs() < 1.0e-12);
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let pair = Pair::new(2, 1, &REFERENCE, &REFERENCE).unwrap();
        assert_eq!([mse(&pair), mae(&pair), bias(&pair), rel_mse(&pair, 0.01).unwrap()], [0.0; 4]);
        assert_eq!(psnr(&pair, 1.0).unwrap(), f64::INFINITY);
    }

    #[test]
    fn swapping_the_pictures_turns_the_bias_and_changes_the_relative_error() {
        let (pair, swapped) = (Pair::new(2, 1, &REFERENCE, &TEST).unwrap(), Pair::new(2, 1, &TEST, &REFERENCE).unwrap());
        assert_eq!(bias(&swapped), -bias(&pair));
        assert_ne!(rel_mse(&swapped, 0.01).unwrap(), rel_mse(&pair, 0.01).unwrap());
    }

    #[test]
    fn one_channel_one_pixel_or_one_place_off_is_seen() {
        let mut channel = REFERENCE;
        channel[1][2] += 1.0e-3;
        let mut moved = REFERENCE;
        moved.swap(0, 1);
        for test in [channel, moved] {
            let pair = Pair::new(2, 1, &REFERENCE, &test).unwrap();
            assert!(mse(&pair) > 1.0e-7 && mae(&pair) > 1.0e-4 && rel_mse(&pair, 0.01).unwrap() > 1.0e-7);
        }
    }

    #[test]
    fn the_mask_decides_what_counts() {
        let mut test = TEST;
        test[1] = [f32::NAN; 3];
        let pair = Pair::with_mask(2, 1, &REFERENCE, &test, Some(&[true, false])).unwrap();
        assert_eq!(mse(&pair), 1.25 / 3.0);
        assert!(Pair::new(2, 1, &REFERENCE, &test).is_err());
    }

    #[test]
    fn a_relative_error_does_not_depend_on_the_unit_if_its_offset_follows() {
        let scale = |pixels: [[f32; 3]; 2]| pixels.map(|pixel| pixel.map(|value| value * 1024.0));
        let (reference, test) = (scale(REFERENCE), scale(TEST));
        let (small, large) = (Pair::new(2, 1, &REFERENCE, &TEST).unwrap(), Pair::new(2, 1, &reference, &test).unwrap());
        assert!((rel_mse(&small, 0.01).unwrap() - rel_mse(&large, 10.24).unwrap()).abs() < 1.0e-12);
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        let pair = Pair::new(2, 1, &REFERENCE, &TEST).unwrap();
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(rel_mse(&pair, value), Err(MetricError::BadParameter { name: "epsilon", .. })));
            assert!(matches!(psnr(&pair, value), Err(MetricError::BadParameter { name: "peak", .. })));
        }
        let negative = [[-0.01, 0.0, 0.0]; 2];
        assert!(matches!(rel_mse(&Pair::new(2, 1, &negative, &TEST).unwrap(), 0.01), Err(MetricError::BadValue { .. })));
    }
}
