//! FLIP of pictures in `0..=1`, and the parts that FLIP of high dynamic range shares with it.

use rayon::prelude::*;

use super::color::{hunt_lab_from_rgb, hyab, opponent_from_rgb, rgb_from_opponent};
use super::filter::{Filtered, Filters, Scratch, Seen};
use crate::Image;
use crate::metrics::pair::{MetricError, Pair};
use crate::metrics::quantile::quantile;

/// Exponent of colour differences [AN20 §4.1].
const COLOR_EXPONENT: f32 = 0.7;
/// Share of the largest colour difference that is mapped to [`REMAPPED`] [AN20 §4.1].
const KNEE: f32 = 0.4;
/// Value that [`KNEE`] is mapped to.
const REMAPPED: f32 = 0.95;

/// Pixels per degree of visual angle, seen from 0.7 m, of a screen 0.7 m and 3840 pixels wide: the authors' default, about 67.02.
pub const DEFAULT_PIXELS_PER_DEGREE: f32 = 67.020_645;

/// Pixels per degree of visual angle at the middle of a screen: `distance·pixels/width·π/180`.
///
/// `distance_m` from the eye to the screen and `screen_width_m` in metres, `screen_width_px` in pixels.
#[must_use]
pub fn pixels_per_degree(distance_m: f32, screen_width_px: f32, screen_width_m: f32) -> f32 {
    distance_m * (screen_width_px / screen_width_m) * (std::f32::consts::PI / 180.0)
}

/// A map of visible differences.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean over the pixels that count, in `0..=1`: the number to report.
    pub mean: f64,
    /// Difference per pixel in `0..=1`; 0 for equal pixels and for pixels that do not count.
    pub map: Image<f32>,
}

impl Flip {
    /// From the differences of all pixels of the pair.
    pub(super) fn new(pair: &Pair, mut map: Vec<f32>) -> Result<Self, MetricError> {
        let mut sum = 0.0;
        for (index, value) in map.iter_mut().enumerate() {
            if pair.counts(index) {
                sum += f64::from(*value);
            } else {
                *value = 0.0;
            }
        }
        let (width, height) = (pair.width(), pair.height());
        let found = map.len();
        let map = Image::from_vec(width, height, map).map_err(|_| MetricError::WrongCount { list: "map", width, height, found })?;
        Ok(Self { mean: sum / pair.count() as f64, map })
    }

    /// The difference below which the share `q` (in `0..=1`) of the pixels that count lies; `None` if `q` is out of range.
    #[must_use]
    pub fn quantile(&self, pair: &Pair, q: f64) -> Option<f64> {
        let mut values: Vec<f64> = pair.indices().map(|index| f64::from(self.map.pixels()[index])).collect();
        quantile(&mut values, q)
    }
}

/// FLIP of two pictures whose linear RGB lies in `0..=1` and is displayed unchanged; values outside are clamped.
///
/// `pixels_per_degree` tells how large the pixels appear, such as [`DEFAULT_PIXELS_PER_DEGREE`]. A filter has about `0.27·pixels_per_degree` columns
/// and rows; beyond their borders the pictures are continued by the values at the border. With a mask, both pictures are black outside of it: this is
/// no difference, but the border of the mask is an edge in both. The same pair gives the same map on any number of threads.
///
/// Memory: about 60 bytes per pixel. The result is symmetric in the two pictures.
///
/// # Errors
/// If `pixels_per_degree` is not in `1..=10000`.
pub fn flip_ldr(pair: &Pair, pixels_per_degree: f32) -> Result<Flip, MetricError> {
    let filters = checked_filters(pixels_per_degree)?;
    let display = |rgb: [f32; 3]| rgb.map(|channel| channel.clamp(0.0, 1.0));
    Flip::new(pair, map(pair, &filters, display))
}

/// Filters for a resolution that is in range.
pub(super) fn checked_filters(pixels_per_degree: f32) -> Result<Filters, MetricError> {
    if !(1.0..=10_000.0).contains(&pixels_per_degree) {
        let allowed = "it must be in 1..=10000";
        return Err(MetricError::BadParameter { name: "the number of pixels per degree", value: f64::from(pixels_per_degree), allowed });
    }
    Ok(Filters::new(pixels_per_degree))
}

/// Differences per pixel of two pictures, each shown through `display`, whose results lie in `0..=1`.
pub(super) fn map(pair: &Pair, filters: &Filters, display: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Vec<f32> {
    let (width, height) = (pair.width() as usize, pair.height() as usize);
    let opponent =
        |pixels: &[[f32; 3]], index: usize| opponent_from_rgb(if pair.counts(index) { display(pixels[index]) } else { [0.0; 3] });
    let reference = Filtered::new(filters, width, height, |index| opponent(pair.reference(), index));
    let test = Filtered::new(filters, width, height, |index| opponent(pair.test(), index));
    let largest = largest_color_difference();
    let mut map = vec![0.0; width * height];
    map.par_chunks_exact_mut(width).enumerate().for_each_init(
        || (Scratch::new(width), vec![Seen::default(); width], vec![Seen::default(); width]),
        |(scratch, seen_reference, seen_test), (y, row)| {
            reference.row(y, scratch, seen_reference);
            test.row(y, scratch, seen_test);
            for ((difference, r), x) in row.iter_mut().zip(&*seen_reference).zip(&*seen_test) {
                *difference = combine(color_difference(r.opponent, x.opponent, largest), feature_difference(r, x));
            }
        },
    );
    map
}

/// The largest possible colour difference before remapping, that between pure green and pure blue [AN20 §4.1].
fn largest_color_difference() -> f32 {
    libm::powf(hyab(hunt_lab_from_rgb([0.0, 1.0, 0.0]), hunt_lab_from_rgb([0.0, 0.0, 1.0])), COLOR_EXPONENT)
}

/// Difference of two filtered colours, in `0..=1` [AN20 §4.1].
fn color_difference(reference: [f32; 3], test: [f32; 3], largest: f32) -> f32 {
    let lab = |opponent| hunt_lab_from_rgb(rgb_from_opponent(opponent));
    let difference = libm::powf(hyab(lab(reference), lab(test)), COLOR_EXPONENT);
    let knee = KNEE * largest;
    if difference < knee { difference * (REMAPPED / knee) } else { REMAPPED + (difference - knee) / (largest - knee) * (1.0 - REMAPPED) }
}

/// Difference of edges or of points, whichever is larger, in `0..=1`: `√(max(Δedge, Δpoint)/√2)` [AN20 §4.2].
fn feature_difference(reference: &Seen, test: &Seen) -> f32 {
    let (edge, point) = ((reference.edge - test.edge).abs(), (reference.point - test.point).abs());
    (std::f32::consts::FRAC_1_SQRT_2 * edge.max(point)).sqrt()
}

/// `ΔE = ΔE_c^(1 − ΔE_f)` (AN20): a difference in features amplifies the difference in colour.
fn combine(color: f32, feature: f32) -> f32 {
    libm::powf(color, 1.0 - feature)
}
