//! Shares of the light: differences weighed by the sum of what a picture shows.

use super::compare::{raise_scales, value_at};
use nephroid_pipeline::{FormatInfo, Surface};

/// The share of the light in which two surfaces differ: the sum of all absolute differences over the sum of all magnitudes, of the channel where it is
/// greatest.
#[must_use]
pub fn drift(info: FormatInfo, expected: &Surface, actual: &Surface) -> f64 {
    let mut sums = vec![0.0; info.channels];
    for (x, y) in (0..expected.height).flat_map(|y| (0..expected.width).map(move |x| (x, y))) {
        for (channel, sum) in sums.iter_mut().enumerate() {
            *sum += distance(info, expected, actual, (x, y), channel);
        }
    }
    greatest_share(info, &sums, expected)
}

/// Distance of a channel's two numbers; infinite where one is not finite and the other differs.
pub(super) fn distance(info: FormatInfo, expected: &Surface, actual: &Surface, at: (u32, u32), channel: usize) -> f64 {
    let [a, b] = [expected, actual].map(|surface| value_at(info, surface, at, channel));
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0.0;
    }
    if a.is_finite() && b.is_finite() { (f64::from(a) - f64::from(b)).abs() } else { f64::INFINITY }
}

/// The greatest of these sums, each over the sum of its channel's magnitudes, which counts as a thousandth of the greatest channel's at least.
pub(super) fn greatest_share(info: FormatInfo, sums: &[f64], of: &Surface) -> f64 {
    let mut wholes = vec![0.0; sums.len()];
    for (x, y) in (0..of.height).flat_map(|y| (0..of.width).map(move |x| (x, y))) {
        for (channel, whole) in wholes.iter_mut().enumerate() {
            let value = value_at(info, of, (x, y), channel);
            *whole += if value.is_finite() { f64::from(value.abs()) } else { 0.0 };
        }
    }
    raise_scales(&mut wholes);
    let share = |(&sum, whole): (&f64, f64)| if sum > 0.0 { sum / whole.max(f64::MIN_POSITIVE) } else { 0.0 };
    sums.iter().zip(wholes).map(share).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crosscheck::compare::tests::{compared, picture};
    use nephroid_pipeline::state::TextureFormat;

    #[test]
    fn outliers_are_weighed_and_so_is_the_whole_difference() {
        let a = picture(TextureFormat::R32Float, |_, _| 1.0);
        let b = picture(TextureFormat::R32Float, |x, y| match (x, y) {
            (3, 5) => 1.5,
            (1, 1) => 0.75,
            (2, 2) => 1.0 + f32::EPSILON,
            _ => 1.0,
        });
        assert_eq!(compared(&a, &b, 1.0e-4).light, 0.75 / 64.0);
        assert_eq!(compared(&a, &b, 0.3).light, 0.5 / 64.0);
        let whole = drift(a.info(), a.surface(0, 0), b.surface(0, 0));
        assert_eq!(whole, (0.75 + f64::from(f32::EPSILON)) / 64.0);
        let bad = picture(TextureFormat::R32Float, |x, _| if x == 7 { f32::NAN } else { 1.0 });
        assert_eq!(compared(&a, &bad, 0.5).light, f64::INFINITY);
        assert_eq!(drift(bad.info(), bad.surface(0, 0), bad.surface(0, 0)), 0.0);
    }
}
