//! Finds ridges by the curvature of the smoothed luminance.

use crate::metrics::filter::{gaussian, separable, surroundings_count};
use crate::metrics::pair::{MetricError, Pair, Which, luminance};
use crate::metrics::quantile::quantile;

/// Which lines count as bright ridges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RidgeSettings {
    /// Standard deviation of the Gaussian that smooths the luminance first, in pixels, in `0.5..=50`: about the half-width of the lines to find.
    /// Default: 1.5.
    pub sigma_px: f64,
    /// Share of each picture's pixels, in `0..=1`, that must be darker than a ridge after smoothing. Default: 0.8.
    pub luminance_quantile: f64,
    /// Least contrast `−σ²·λ/L` of a ridge, at least 0: its curvature relative to its luminance. A line of half-width `w` on black has the contrast
    /// `σ²/(σ² + w²)`, so lines up to ten times as wide as `σ` are found; noise of one per cent per pixel stays below 0.005. Default: 0.01.
    pub min_contrast: f64,
}

impl Default for RidgeSettings {
    fn default() -> Self {
        Self { sigma_px: 1.5, luminance_quantile: 0.8, min_contrast: 0.01 }
    }
}

impl RidgeSettings {
    /// Returns an error if a setting is out of range.
    pub(super) fn check(&self) -> Result<(), MetricError> {
        let bad = |name, value, allowed| Err(MetricError::BadParameter { name, value, allowed });
        if !(0.5..=50.0).contains(&self.sigma_px) {
            return bad("the smoothing of ridges", self.sigma_px, "it must be 0.5 to 50 pixels");
        }
        if !(0.0..=1.0).contains(&self.luminance_quantile) {
            return bad("the luminance quantile of ridges", self.luminance_quantile, "it must be in 0..=1");
        }
        if !(self.min_contrast >= 0.0 && self.min_contrast.is_finite()) {
            return bad("the least contrast of ridges", self.min_contrast, "it must be at least 0 and finite");
        }
        Ok(())
    }
}

/// A point on a ridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RidgePoint {
    /// Position in pixels from the centre of the first pixel, y down.
    pub position: [f64; 2],
    /// Unit vector along the ridge.
    pub along: [f64; 2],
    /// Row of the pixel that holds the point.
    pub row: u32,
}

/// The points on bright ridges of one picture of a pair, in row-major order of their pixels, at most one per pixel.
///
/// Where the Hessian of the smoothed luminance `L` has its largest eigenvalue in magnitude, `λ < 0`, with the unit eigenvector `n`, the Taylor
/// series of `L` along `n` has its maximum at `t·n`, `t = −(∇L·n)/λ` [Steger, "An Unbiased Detector of Curvilinear Structures", PAMI 20(2),
/// 1998, eq. 21]. That is one step of Newton's method, which misses the crest of a line of half-width 1.6 by up to 0.07 pixels. A step of the secant
/// method after it, with the gradient interpolated between pixels, reduces the error to 0.01. If the maximum is inside the pixel, the pixel has a
/// ridge point there, provided that it is bright and curved enough for `settings`. Pixels closer to a border, or to a pixel that does not count, than
/// the filter's radius (four standard deviations) have none: any continuation beyond would bend the ridges.
pub(super) fn ridge_points(pair: &Pair, which: Which, settings: &RidgeSettings) -> Vec<RidgePoint> {
    let width = pair.width() as usize;
    let pixels = pair.picture(which);
    let values: Vec<f64> = (0..pixels.len()).map(|index| if pair.counts(index) { luminance(pixels[index]) } else { 0.0 }).collect();

    let radius = (4.0 * settings.sigma_px).ceil() as usize;
    let [g, d, dd] = derivatives(settings.sigma_px, radius);
    let filtered = |along_x: &[f64], along_y: &[f64]| separable(&values, width, along_x, along_y);
    let smooth = filtered(&g, &g);
    let (lx, ly) = (filtered(&d, &g), filtered(&g, &d));
    let (lxx, lxy, lyy) = (filtered(&dd, &g), filtered(&d, &d), filtered(&g, &dd));

    let whole = surroundings_count(pair, radius);
    let mut luminances: Vec<f64> = (0..smooth.len()).filter(|&index| whole[index]).map(|index| smooth[index]).collect();
    let Some(darkest) = quantile(&mut luminances, settings.luminance_quantile) else {
        return Vec::new();
    };
    let mut points = Vec::new();
    for index in (0..smooth.len()).filter(|&index| whole[index]) {
        let (lambda, across) = sharpest(lxx[index], lxy[index], lyy[index]);
        let is_ridge = smooth[index] > 0.0
            && smooth[index] >= darkest
            && -lambda * settings.sigma_px * settings.sigma_px > settings.min_contrast * smooth[index];
        if !is_ridge {
            continue;
        }
        let slope = lx[index] * across[0] + ly[index] * across[1];
        let step = -slope / lambda;
        if step.abs() > 1.0 {
            continue;
        }
        let ahead = across.map(|component| step * component);
        let slope_ahead = interpolated(&lx, width, index, ahead) * across[0] + interpolated(&ly, width, index, ahead) * across[1];
        let t = if slope == slope_ahead { step } else { step * slope / (slope - slope_ahead) };
        let offset = across.map(|component| t * component);
        if offset[0].abs() <= 0.5 && offset[1].abs() <= 0.5 {
            let (x, y) = pair.position(index);
            let position = [f64::from(x) + offset[0], f64::from(y) + offset[1]];
            points.push(RidgePoint { position, along: [-across[1], across[0]], row: y });
        }
    }
    points
}

/// The value of a plane at an offset of at most one pixel from a pixel that is not at the border, linear between pixels.
fn interpolated(plane: &[f64], width: usize, index: usize, [dx, dy]: [f64; 2]) -> f64 {
    let column = if dx < 0.0 { index - 1 } else { index + 1 };
    let row = |at: usize| if dy < 0.0 { at - width } else { at + width };
    let (x, y) = (dx.abs(), dy.abs());
    (1.0 - y) * ((1.0 - x) * plane[index] + x * plane[column]) + y * ((1.0 - x) * plane[row(index)] + x * plane[row(column)])
}

/// Weights of a Gaussian and of its first two derivatives, for correlation: exact for parabolas.
///
/// Sampled derivatives of a Gaussian are wrong by a factor and a constant. These are scaled so that `Σ w = 1`, `Σ i·w′ = 1`, `Σ w″ = 0`,
/// `Σ i²·w″ = 2`.
fn derivatives(sigma_px: f64, radius: usize) -> [Vec<f64>; 3] {
    let weights = gaussian(sigma_px, radius);
    let taps: Vec<f64> = (0..weights.len()).map(|tap| tap as f64 - radius as f64).collect();
    let moment = |power: i32| -> f64 {
        let term = |(tap, weight): (&f64, &f64)| (0..power).fold(*weight, |product, _| product * tap);
        taps.iter().zip(&weights).map(term).sum()
    };
    let (second, fourth) = (moment(2), moment(4));
    let first = taps.iter().zip(&weights).map(|(tap, weight)| tap * weight / second).collect();
    let scale = 2.0 / (fourth - second * second);
    let curved = taps.iter().zip(&weights).map(|(tap, weight)| (tap * tap - second) * weight * scale).collect();
    [weights, first, curved]
}

/// The eigenvalue of largest magnitude of a symmetric 2x2 matrix, and its unit eigenvector; for a multiple of the identity, an arbitrary unit vector.
fn sharpest(xx: f64, xy: f64, yy: f64) -> (f64, [f64; 2]) {
    let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = (half * half + xy * xy).sqrt();
    let lambda = if middle > 0.0 { middle + radius } else { middle - radius };
    // (A − λ)·v = 0; of the two rows, the one with the larger entries is more accurate.
    let rows = [[xy, lambda - xx], [lambda - yy, xy]];
    let [first, second] = rows.map(|[a, b]| a * a + b * b);
    let (v, length2) = if first > second { (rows[0], first) } else { (rows[1], second) };
    if length2 > 0.0 { (lambda, v.map(|component| component / length2.sqrt())) } else { (lambda, [1.0, 0.0]) }
}
