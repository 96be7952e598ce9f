//! The filters of FLIP: contrast sensitivity of the eye, and detectors of edges and points.

use rayon::prelude::*;

/// Number of planes per row in [`Filtered`]: the output of the horizontal filters, which the vertical filters read.
const PLANES: usize = 7;
/// Pixels filtered at a time: this many accumulators fit the registers.
const BLOCK: usize = 16;

/// One-dimensional weights, each of odd length, for one resolution.
pub(super) struct Filters {
    /// Contrast sensitivity to lightness, to red against green, and, as two Gaussians to be added, to blue against yellow; all of one length.
    spatial: [Vec<f32>; 4],
    /// A Gaussian and its first and second derivative; all of one length.
    feature: [Vec<f32>; 3],
}

impl Filters {
    /// Filters for a display with this many pixels per degree of visual angle.
    ///
    /// Contrast sensitivity in space is `a·√(π/b)·exp(−π²·d²/b)` with `d` in degrees [AN20 §4.1], cut off at three standard deviations of the widest
    /// Gaussian. Where two Gaussians are added, each direction gets the square root of the factor, so that the product of both directions has the
    /// factor.
    pub(super) fn new(pixels_per_degree: f32) -> Self {
        use std::f32::consts::PI;
        let pi2 = PI * PI;
        let widest = 0.04_f32;
        let radius = (3.0 * (widest / (2.0 * pi2)).sqrt() * pixels_per_degree).ceil() as i32;
        let step = 1.0 / pixels_per_degree;
        let gaussian = |factor: f32, b: f32| -> Vec<f32> {
            let at = |tap: i32| {
                let degrees = tap as f32 * step;
                factor * libm::expf(-pi2 * (degrees * degrees) / b)
            };
            (-radius..=radius).map(at).collect()
        };
        let root = |a: f32, b: f32| gaussian((a * (PI / b).sqrt()).sqrt(), b);
        let whole = |a: f32, b: f32| {
            let weights = gaussian(a * (PI / b).sqrt(), b);
            let scale = 1.0 / sum(&weights);
            scaled(&weights, scale)
        };
        let (first, second) = (root(34.1, 0.04), root(13.5, 0.025));
        let both = 1.0 / (sum(&first) * sum(&first) + sum(&second) * sum(&second)).sqrt();
        let spatial = [whole(1.0, 0.0047), whole(1.0, 0.0053), scaled(&first, both), scaled(&second, both)];
        Self { spatial, feature: feature_weights(pixels_per_degree) }
    }

    fn spatial_radius(&self) -> usize {
        self.spatial[0].len() / 2
    }

    fn feature_radius(&self) -> usize {
        self.feature[0].len() / 2
    }
}

/// A Gaussian of half the width `w = 0.082°` of a detected edge, and its first two derivatives [AN20 §4.2].
///
/// The Gaussian sums to 1; of each derivative the positive weights sum to 1 and the negative ones to −1.
fn feature_weights(pixels_per_degree: f32) -> [Vec<f32>; 3] {
    let sigma_px = 0.5 * 0.082 * pixels_per_degree;
    let radius = (3.0 * sigma_px).ceil() as i32;
    let taps = || (-radius..=radius).map(|tap| tap as f32);
    let g = |x: f32| libm::expf(-(x * x) / (2.0 * sigma_px * sigma_px));
    let gaussian: Vec<f32> = taps().map(g).collect();
    let first: Vec<f32> = taps().map(|x| -x * g(x)).collect();
    let second: Vec<f32> = taps().map(|x| (x * x / (sigma_px * sigma_px) - 1.0) * g(x)).collect();
    let total = sum(&gaussian);
    [gaussian.iter().map(|weight| weight / total).collect(), balanced(&first), balanced(&second)]
}

/// Sum in the order of the list.
fn sum(weights: &[f32]) -> f32 {
    let mut sum = 0.0;
    weights.iter().for_each(|weight| sum += weight);
    sum
}

fn scaled(weights: &[f32], by: f32) -> Vec<f32> {
    weights.iter().map(|weight| weight * by).collect()
}

/// Scales the positive weights to sum to 1 and the negative ones to sum to −1.
fn balanced(weights: &[f32]) -> Vec<f32> {
    let (mut positive, mut negative) = (0.0, 0.0);
    for &weight in weights {
        *if weight > 0.0 { &mut positive } else { &mut negative } += weight.abs();
    }
    weights.iter().map(|&weight| weight / if weight > 0.0 { positive } else { negative }).collect()
}

/// Results of all filters at one pixel.
#[derive(Clone, Copy, Default)]
pub(super) struct Seen {
    /// Filtered colour, YCxCz.
    pub opponent: [f32; 3],
    /// Magnitude of the gradient of lightness, in `0..=1`.
    pub edge: f32,
    /// Magnitude of the second derivatives of lightness.
    pub point: f32,
}

/// A picture after the horizontal half of all filters.
pub(super) struct Filtered<'a> {
    filters: &'a Filters,
    width: usize,
    height: usize,
    /// Planes of each row: Y, Cx, the two parts of Cz; lightness smoothed, its first derivative, its second derivative.
    rows: Vec<f32>,
}

impl<'a> Filtered<'a> {
    /// Filters along x. `opponent` gives the YCxCz of a pixel by its index.
    pub(super) fn new(filters: &'a Filters, width: usize, height: usize, opponent: impl Fn(usize) -> [f32; 3] + Sync) -> Self {
        let mut rows = vec![0.0; PLANES * width * height];
        rows.par_chunks_exact_mut(PLANES * width).enumerate().for_each(|(y, row)| {
            let pixels: Vec<[f32; 3]> = (0..width).map(|x| opponent(y * width + x)).collect();
            let source = |f: &dyn Fn([f32; 3]) -> f32, radius: usize| -> Vec<f32> {
                let at = |x: usize| f(pixels[x.saturating_sub(radius).min(width - 1)]);
                (0..width + 2 * radius).map(at).collect()
            };
            let radius = filters.spatial_radius();
            let channels = [0, 1, 2].map(|channel| source(&|pixel| pixel[channel], radius));
            // Lightness in 0..=1: the authors corrected the paper's division by 100 to one by 116.
            let lightness = source(&|pixel| pixel[0] * (1.0 / 116.0) + 16.0 / 116.0, filters.feature_radius());
            let mut planes = row.chunks_exact_mut(width);
            for (weights, channel) in filters.spatial.iter().zip([0, 1, 2, 2]) {
                filter_row(weights, |tap| &channels[channel][tap..], planes.next().expect("seven planes"));
            }
            for weights in &filters.feature {
                filter_row(weights, |tap| &lightness[tap..], planes.next().expect("seven planes"));
            }
        });
        Self { filters, width, height, rows }
    }

    /// Filters row `y` along y. `scratch` is overwritten.
    pub(super) fn row(&self, y: usize, scratch: &mut Scratch, seen: &mut [Seen]) {
        let width = self.width;
        let from = |plane: usize, radius: usize| {
            move |tap: usize| {
                let row = (y + tap).saturating_sub(radius).min(self.height - 1);
                &self.rows[(row * PLANES + plane) * width..][..width]
            }
        };
        let [g, d, dd] = &self.filters.feature;
        let spatial = self.filters.spatial.iter().enumerate().map(|(plane, weights)| (plane, weights, self.filters.spatial_radius()));
        // The derivative along x, smoothed along y; then the other way round.
        let feature = [(5, g), (6, g), (4, d), (4, dd)].map(|(plane, weights)| (plane, weights, self.filters.feature_radius()));
        for ((plane, weights, radius), out) in spatial.chain(feature).zip(scratch.planes.chunks_exact_mut(width)) {
            filter_row(weights, from(plane, radius), out);
        }
        let plane = |index: usize| &scratch.planes[index * width..][..width];
        let [y, cx, cz1, cz2] = [plane(0), plane(1), plane(2), plane(3)];
        let [dx, ddx, dy, ddy] = [plane(4), plane(5), plane(6), plane(7)];
        for (x, seen) in seen.iter_mut().enumerate() {
            *seen = Seen {
                opponent: [y[x], cx[x], cz1[x] + cz2[x]],
                edge: (dx[x] * dx[x] + dy[x] * dy[x]).sqrt(),
                point: (ddx[x] * ddx[x] + ddy[x] * ddy[x]).sqrt(),
            };
        }
    }
}

/// Scratch buffers for one row of [`Filtered::row`].
pub(super) struct Scratch {
    planes: Vec<f32>,
}

impl Scratch {
    /// Scratch buffers for rows of `width` pixels.
    pub(super) fn new(width: usize) -> Self {
        Self { planes: vec![0.0; 8 * width] }
    }
}

/// `out[x] = Σ weights[tap]·source(tap)[x]`, summed in the order of the taps; each source is at least as long as `out`.
fn filter_row<'s>(weights: &[f32], source: impl Fn(usize) -> &'s [f32], out: &mut [f32]) {
    let sources: Vec<&[f32]> = (0..weights.len()).map(source).collect();
    let whole = out.len() / BLOCK * BLOCK;
    for start in (0..whole).step_by(BLOCK) {
        let mut sums = [0.0; BLOCK];
        for (weight, source) in weights.iter().zip(&sources) {
            for (sum, value) in sums.iter_mut().zip(&source[start..start + BLOCK]) {
                *sum += weight * value;
            }
        }
        out[start..start + BLOCK].copy_from_slice(&sums);
    }
    for x in whole..out.len() {
        let mut sum = 0.0;
        for (weight, source) in weights.iter().zip(&sources) {
            sum += weight * source[x];
        }
        out[x] = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_keep_a_constant_and_derivatives_drop_it() {
        for pixels_per_degree in [10.0, 67.02, 200.0] {
            let filters = Filters::new(pixels_per_degree);
            let sums = filters.spatial.each_ref().map(|weights| sum(weights));
            assert!((sums[0] - 1.0).abs() < 1.0e-5 && (sums[1] - 1.0).abs() < 1.0e-5);
            assert!((sums[2] * sums[2] + sums[3] * sums[3] - 1.0).abs() < 1.0e-5);
            let [g, d, dd] = filters.feature.each_ref().map(|weights| sum(weights));
            assert!((g - 1.0).abs() < 1.0e-5 && d.abs() < 1.0e-5 && dd.abs() < 1.0e-5);
        }
    }

    #[test]
    fn a_constant_picture_is_seen_as_it_is() {
        let filters = Filters::new(30.0);
        let filtered = Filtered::new(&filters, 19, 3, |_| [40.0, -7.0, 11.0]);
        let mut seen = vec![Seen::default(); 19];
        filtered.row(1, &mut Scratch::new(19), &mut seen);
        for Seen { opponent, edge, point } in seen {
            assert!((0..3).all(|i| (opponent[i] - [40.0, -7.0, 11.0][i]).abs() < 1.0e-4), "{opponent:?}");
            assert!(edge < 1.0e-6 && point < 1.0e-6);
        }
    }

    #[test]
    fn edges_and_points_are_told_apart() {
        let filters = Filters::new(67.0);
        let lightness = |value: f32| [116.0 * value - 16.0, 0.0, 0.0];
        let row = |at: &(dyn Fn(usize) -> f32 + Sync)| {
            let filtered = Filtered::new(&filters, 41, 1, |x| lightness(at(x)));
            let mut seen = vec![Seen::default(); 41];
            filtered.row(0, &mut Scratch::new(41), &mut seen);
            seen[20]
        };
        let step = row(&|x| if x < 20 { 0.0 } else { 1.0 });
        let line = row(&|x| if (19..=21).contains(&x) { 1.0 } else { 0.0 });
        assert!(step.edge > 0.9 && line.edge < 1.0e-6, "{} {}", step.edge, line.edge);
        assert!(line.point > 0.4, "{}", line.point);
    }
}
