//! FLIP of pictures of high dynamic range.

use std::ops::RangeInclusive;

use super::ldr::{Flip, checked_filters, map};
use crate::metrics::pair::{MetricError, Pair};

/// Coefficients of the tone mapper: a fit of the ACES curve by K. Narkowicz with its exposure of 0.6 removed, `(a·c² + b·c)/(d·c² + e·c + f)`.
const ACES: [f32; 5] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// Display value of the largest luminance at the darkest exposure, and of the median luminance at the brightest (AN21).
const BRIGHT: f32 = 0.85;
/// Exposures whose power of two is a normal number.
const STOPS: RangeInclusive<f32> = -126.0..=126.0;
/// Largest number of exposures: more stops have no meaning.
const MAX_EXPOSURES: u32 = 1000;

/// The exposures of [`flip_hdr`], evenly spaced in stops (factors of two).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// First exposure, in stops, −126 to 126.
    pub start: f32,
    /// Last exposure, in stops, `start` to 126.
    pub stop: f32,
    /// Number of exposures, 2 to 1000.
    pub count: u32,
}

impl Exposures {
    /// The authors' exposures for a reference (AN21): from the one that shows the largest luminance at 0.85 to the one that shows the median
    /// luminance at 0.85.
    ///
    /// Only pixels that count are used. There is about one exposure per stop, and at least two. The median of an even number of pixels is the upper
    /// one.
    ///
    /// # Errors
    /// If the median is not above 0, for example because more than half of the picture is black. Mask the black part, or state the exposures.
    pub fn of(pair: &Pair) -> Result<Self, MetricError> {
        let luminance = |rgb: [f32; 3]| 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
        let mut luminances: Vec<f32> = pair.pixels().map(|(reference, _)| luminance(reference)).collect();
        luminances.sort_unstable_by(f32::total_cmp);
        let (median, largest) = (luminances[luminances.len() / 2], luminances[luminances.len() - 1]);
        if median <= 0.0 {
            return Err(MetricError::NoExposures { median, largest });
        }
        let shown = bright_input();
        let (start, stop) = (libm::log2f(shown / largest), libm::log2f(shown / median));
        Ok(Self { start, stop, count: (stop - start).ceil().max(2.0) as u32 })
    }

    /// Exposure `index` of `count`, in stops.
    fn at(&self, index: u32) -> f32 {
        let step = (self.stop - self.start) / (self.count - 1) as f32;
        self.start + index as f32 * step
    }

    fn check(&self) -> Result<(), MetricError> {
        let bad = |name, value, allowed| Err(MetricError::BadParameter { name, value, allowed });
        if !STOPS.contains(&self.start) {
            return bad("the first exposure", f64::from(self.start), "it must be in -126..=126 stops");
        }
        if !(STOPS.contains(&self.stop) && self.stop >= self.start) {
            return bad("the last exposure", f64::from(self.stop), "it must be in -126..=126 stops and not below the first");
        }
        if !(2..=MAX_EXPOSURES).contains(&self.count) {
            return bad("the number of exposures", f64::from(self.count), "it must be in 2..=1000");
        }
        Ok(())
    }
}

/// FLIP of two pictures of linear RGB of any brightness, in any unit (AN21): the largest [`super::flip_ldr`] over `exposures`, pixel by pixel.
///
/// Each exposure is a factor of `2^stops`, followed by the ACES tone mapper and a clamp. With [`Exposures::of`] the unit of the pictures does not
/// matter. The time is that of [`super::flip_ldr`] times the number of exposures. The remaining arguments are those of [`super::flip_ldr`].
///
/// # Errors
/// If a value is negative, `pixels_per_degree` is not in `1..=10000`, or the exposures fall, go beyond 126 stops or are not 2 to 1000.
pub fn flip_hdr(pair: &Pair, pixels_per_degree: f32, exposures: &Exposures) -> Result<Flip, MetricError> {
    let filters = checked_filters(pixels_per_degree)?;
    exposures.check()?;
    for (list, pixels) in [("reference", pair.reference()), ("test", pair.test())] {
        pair.check_values(list, pixels, |value| value >= 0.0, "it must be at least 0")?;
    }
    let mut largest = vec![0.0_f32; pair.reference().len()];
    for index in 0..exposures.count {
        let factor = libm::exp2f(exposures.at(index));
        let shown = map(pair, &filters, |rgb| rgb.map(|channel| tone_mapped(channel * factor)));
        for (largest, value) in largest.iter_mut().zip(shown) {
            *largest = largest.max(value);
        }
    }
    Flip::new(pair, largest)
}

/// The tone mapper, clamped to `0..=1`. Infinity, which an exposure may cause by overflow, becomes white.
fn tone_mapped(value: f32) -> f32 {
    let [a, b, d, e, f] = ACES;
    let square = value * value;
    if square == f32::INFINITY {
        return 1.0;
    }
    ((square * a + value * b) / (square * d + value * e + f)).clamp(0.0, 1.0)
}

/// The input that the unclamped tone mapper maps to [`BRIGHT`]: the positive root of `(a − t·d)·c² + (b − t·e)·c − t·f = 0`.
fn bright_input() -> f32 {
    let [a, b, d, e, f] = ACES;
    let (a, b, c) = (a - BRIGHT * d, b - BRIGHT * e, -BRIGHT * f);
    let middle = -0.5 * (b / a);
    middle + (middle * middle - c / a).sqrt()
}
