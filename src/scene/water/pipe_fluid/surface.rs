//! The smooth surface over the columns: a biquadratic B-spline.

use glam::{DVec2, Vec2};

use super::super::height_field::{HeightField, Layout};
use super::solver::PipeFluid;

/// What three neighbouring columns contribute at one coordinate: the first of them (−1 stands for the mirrored one), weights, and weights of the derivative per cell.
#[derive(Clone, Copy, Debug)]
struct Taps {
    indices: [usize; 3],
    value: [f64; 3],
    derivative: [f64; 3],
}

impl Taps {
    /// Quadratic B-spline at `u` cells from the rim, between `count` columns whose middles are at `i + ½`; the ends are mirrored.
    ///
    /// With `f ∈ [−½, ½]` the distance from the nearest middle: `½(½ − f)²`, `¾ − f²`, `½(½ + f)²`. On an edge between columns that is their mean.
    fn new(u: f64, count: usize) -> Self {
        let u = u.clamp(0.0, count as f64);
        let middle = (u as usize).min(count - 1);
        let f = u - middle as f64 - 0.5;
        Self {
            indices: [middle.saturating_sub(1), middle, (middle + 1).min(count - 1)],
            value: [0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)],
            derivative: [f - 0.5, -2.0 * f, f + 0.5],
        }
    }
}

impl PipeFluid {
    /// The surface on a grid of vertices; beyond the rim it goes on level from the rim.
    pub(in super::super) fn sample(&self, layout: &Layout) -> HeightField {
        let heights = self.cell_heights_m();
        let grid = &self.grid;
        let taps_x: Vec<Taps> = (0..layout.columns)
            .map(|column| Taps::new((f64::from(layout.x_ws(column)) - grid.min_ws.x) / grid.cell_m.x, grid.columns))
            .collect();
        let taps_z: Vec<Taps> =
            (0..layout.rows).map(|row| Taps::new((f64::from(layout.z_ws(row)) - grid.min_ws.y) / grid.cell_m.y, grid.rows)).collect();

        // Columns of the spline are combined once per row of vertices, then along the row.
        let mut combined = vec![(0.0, 0.0); grid.columns];
        let mut combined_row = u32::MAX;
        layout.sample(|column, row| {
            if combined_row != row {
                combined_row = row;
                let z = &taps_z[row as usize];
                for (i, out) in combined.iter_mut().enumerate() {
                    let h = z.indices.map(|j| heights[j * grid.columns + i]);
                    *out = (dot(h, z.value), dot(h, z.derivative));
                }
            }
            let x = &taps_x[column as usize];
            let (values, slopes) = (x.indices.map(|i| combined[i].0), x.indices.map(|i| combined[i].1));
            let slope = DVec2::new(dot(values, x.derivative), dot(slopes, x.value)) / grid.cell_m;
            ((self.level_m() + dot(values, x.value)) as f32, Vec2::new(slope.x as f32, slope.y as f32))
        })
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
