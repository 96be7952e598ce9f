//! Simulated water: a biquadratic patch through every 3x3 samples of the model.
//!
//! A fluid of columns is a biquadratic spline whose pieces end between columns. Samples at these ends and at the middles reproduce it exactly, up to
//! rounding. A sum of thousands of waves is reproduced to third order in the distance of the samples.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::V3;
use nephroid_scene::water::HeightField;

use super::{Heights, normal_of_slope};

/// A surface of biquadratic patches.
pub(super) struct Patches {
    columns: usize,
    /// Number of patches along x and z.
    counts: [f32; 2],
    origin: [f32; 2],
    inverse_size: [f32; 2],
    heights: Vec<f32>,
}

impl Patches {
    /// Patches through samples of a surface whose mean level is 0. The number of samples along each side is odd and at least 3.
    pub fn new(field: &HeightField) -> Self {
        let size = field.spacing_m * 2.0;
        Self {
            columns: field.columns as usize,
            counts: [((field.columns - 1) / 2) as f32, ((field.rows - 1) / 2) as f32],
            origin: field.origin_ws.to_array(),
            inverse_size: [1.0 / size.x, 1.0 / size.y],
            heights: field.heights_ws.clone(),
        }
    }

    /// Bounds on the magnitudes of height and slope. A quadratic through three values at 0, ½ and 1 has Bézier ordinates `a, 2b − (a + c)/2, c`: it
    /// lies between the least and the greatest of them, and its slope lies between twice their differences.
    pub fn bounds(&self) -> (f64, f64) {
        let rows = self.heights.len() / self.columns;
        let (mut rise, mut slope) = (0.0_f64, [0.0_f64; 2]);
        let h = |x: usize, z: usize| f64::from(self.heights[z * self.columns + x]);
        for z in (0..rows - 2).step_by(2) {
            for x in (0..self.columns - 2).step_by(2) {
                let ordinates = |a: f64, b: f64, c: f64| [a, 2.0 * b - 0.5 * (a + c), c];
                let along_x: [[f64; 3]; 3] = std::array::from_fn(|k| ordinates(h(x, z + k), h(x + 1, z + k), h(x + 2, z + k)));
                // net[i][k]: Bézier ordinates along z, of the columns of ordinates along x.
                let net: [[f64; 3]; 3] = std::array::from_fn(|i| ordinates(along_x[0][i], along_x[1][i], along_x[2][i]));
                for i in 0..3 {
                    for k in 0..3 {
                        rise = rise.max(net[i][k].abs());
                        if i < 2 {
                            slope[0] = slope[0].max(2.0 * (net[i + 1][k] - net[i][k]).abs());
                        }
                        if k < 2 {
                            slope[1] = slope[1].max(2.0 * (net[i][k + 1] - net[i][k]).abs());
                        }
                    }
                }
            }
        }
        let (x, z) = (slope[0] * f64::from(self.inverse_size[0]), slope[1] * f64::from(self.inverse_size[1]));
        (rise, (x * x + z * z).sqrt())
    }

    /// The nine heights of each point's patch, gathered, and the position of the points in their patches, in 0..2 along each side.
    #[inline(always)]
    fn gather<L: Lanes>(&self, x: L, z: L) -> ([[L; 3]; 3], L, L) {
        let u = ((x - self.origin[0]) * self.inverse_size[0]).clamp(0.0, self.counts[0]);
        let v = ((z - self.origin[1]) * self.inverse_size[1]).clamp(0.0, self.counts[1]);
        let column = Lanes::min(u.floor(), u.like(self.counts[0] - 1.0));
        let row = Lanes::min(v.floor(), v.like(self.counts[1] - 1.0));
        let (columns, rows) = (column.to_i32(), row.to_i32());
        let mut lanes = [[[0.0_f32; 16]; 3]; 3];
        for lane in 0..L::LEN {
            let first = 2 * (rows[lane] as usize * self.columns + columns[lane] as usize);
            for (k, lanes) in lanes.iter_mut().enumerate() {
                let samples = &self.heights[first + k * self.columns..][..3];
                for i in 0..3 {
                    lanes[i][lane] = samples[i];
                }
            }
        }
        let mut heights = [[x; 3]; 3];
        for k in 0..3 {
            for i in 0..3 {
                heights[k][i] = L::load(x.token(), &lanes[k][i]);
            }
        }
        (heights, (u - column) * 2.0, (v - row) * 2.0)
    }
}

/// Weights of the quadratic through values at 0, 1 and 2, and of its derivative.
#[inline(always)]
fn weights<L: Lanes>(s: L) -> ([L; 3], [L; 3]) {
    let (a, c) = (s - 1.0, s - 2.0);
    ([a * c * 0.5, -(s * c), s * a * 0.5], [s - 1.5, -(s * 2.0) + 2.0, s - 0.5])
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Heights for Patches {
    #[inline(always)]
    fn rise_and_slope<L: Lanes>(&self, x: L, z: L) -> (L, L, L) {
        let (h, s, t) = self.gather(x, z);
        let ((ws, ds), (wt, dt)) = (weights(s), weights(t));
        let along = [dot(h[0], ws), dot(h[1], ws), dot(h[2], ws)];
        let steep = [dot(h[0], ds), dot(h[1], ds), dot(h[2], ds)];
        let (per_x, per_z) = (2.0 * self.inverse_size[0], 2.0 * self.inverse_size[1]);
        (dot(along, wt), dot(steep, wt) * per_x, dot(along, dt) * per_z)
    }

    #[inline(always)]
    fn normal<L: Lanes>(&self, x: L, z: L) -> V3<L> {
        let (_, slope_x, slope_z) = self.rise_and_slope(x, z);
        normal_of_slope(slope_x, slope_z)
    }
}
