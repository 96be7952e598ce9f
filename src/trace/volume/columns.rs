//! Smoke on the way to the eye, tabulated: integrals of its density along views that are a few pixels apart.

use rayon::prelude::*;

use nephroid_scene::geom::Ray;

use super::super::eye::Eye;
use super::super::media::SmokeBox;

/// Distance between tabulated places, in cells of the smoke: across views and along them.
const SPACING: f32 = 0.5;

/// Most pixels between tabulated views.
const MAX_PIXELS: u32 = 8;

/// Most values of a table: more would not fit into the account of memory.
pub(in super::super) const MOST_VALUES: u64 = 1 << 26;

/// Integrals of the density along views, linear between tabulated places.
pub(super) struct Columns {
    /// Pixels between tabulated views.
    pixels: f32,
    columns: usize,
    /// The first tabulated distance from the starts of the views, m; tabulated distances per metre; how many there are.
    start: f32,
    per_m: f32,
    count: usize,
    /// By row, column and distance, m.
    values: Vec<f32>,
}

impl Columns {
    /// Tabulates smoke. `None` if a pixel is too large for it, half a cell wide or more where the smoke is farthest away; or if the table would have more than
    /// [`MOST_VALUES`].
    pub fn new(eye: &Eye<'_>, smoke: &SmokeBox) -> Option<Self> {
        let projection = eye.projection();
        let farthest = smoke.bounds().corners().iter().map(|corner| corner.as_dvec3().distance(projection.eye)).fold(0.0, f64::max);
        let footprint = projection.area.sqrt() * if projection.parallel { 1.0 } else { farthest };
        let step = SPACING * smoke.cell_size();
        let pixels = ((f64::from(step) / footprint) as u32).min(MAX_PIXELS);
        if pixels == 0 {
            return None;
        }
        let columns = eye.columns().div_ceil(pixels) + 1;
        let rows = eye.rows().div_ceil(pixels) + 1;
        let at = |index: u32| {
            let (x, y) = (index % columns * pixels, index / columns * pixels);
            let (origin, direction) = eye.ray(f64::from(x), f64::from(y));
            Ray { origin, direction }
        };
        let spans: Vec<_> = (0..columns * rows).filter_map(|index| smoke.span(at(index), f32::INFINITY)).collect();
        let start = spans.iter().map(|span| span.0).fold(f32::INFINITY, f32::min);
        let end = spans.iter().map(|span| span.1).fold(0.0, f32::max);
        let count = if spans.is_empty() { 2 } else { ((end - start) / step).ceil() as usize + 2 };
        if u64::from(columns) * u64::from(rows) * count as u64 > MOST_VALUES {
            return None;
        }
        let along = |index: u32| {
            let view = at(index);
            let mut sum = 0.0;
            (0..count)
                .map(|k| {
                    if k > 0 {
                        sum += smoke.column(view, start + (k - 1) as f32 * step, start + k as f32 * step);
                    }
                    sum
                })
                .collect::<Vec<f32>>()
        };
        let values = (0..columns * rows).into_par_iter().flat_map_iter(along).collect();
        Some(Self { pixels: pixels as f32, columns: columns as usize, start, per_m: 1.0 / step, count, values })
    }

    /// The integral along the view through a place of the picture, in pixels, up to a distance from its start, m.
    pub fn at(&self, x: f32, y: f32, distance: f32) -> f32 {
        let (x, y, z) = (x / self.pixels, y / self.pixels, (distance - self.start) * self.per_m);
        if z <= 0.0 {
            return 0.0;
        }
        let (i, j) = ((x as usize).min(self.columns - 2), y as usize);
        let k = (z as usize).min(self.count - 2);
        let (x, y, z) = (x - i as f32, y - j as f32, (z - k as f32).min(1.0));
        let along = |i: usize, j: usize| {
            let first = (j * self.columns + i) * self.count + k;
            self.values[first] + (self.values[first + 1] - self.values[first]) * z
        };
        let across = |j: usize| {
            let left = along(i, j);
            left + (along(i + 1, j) - left) * x
        };
        let above = across(j);
        above + (across(j + 1) - above) * y
    }
}
