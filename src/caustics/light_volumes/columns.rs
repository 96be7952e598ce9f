//! Receiver columns: a grid over a box of receivers; each cell stores the slabs in which it has receivers.
//!
//! With the box alone, a beam over a sloping floor is drawn between the floor's least and greatest height. With columns it is drawn between the
//! planes around the part of the floor that the beam meets.

use glam::{Vec2, Vec3};

use crate::Receivers;

use super::boxes::{ReceiverBox, margin};
use super::hierarchy::{Rect, Span};
use super::slices::{Slabs, Slices};

/// Columns along the longest side of the bounds of all boxes.
const COLUMNS: f32 = 48.0;

/// Most columns along a side of one box.
const MOST: u32 = 48;

/// A box of receivers, divided into columns, between the slicing planes.
#[derive(Clone, Debug)]
pub struct ReceiverColumns {
    /// Number of the box.
    pub number: usize,
    /// The box seen from above.
    pub rect: Rect,
    /// Least and greatest height, m.
    pub y: [f32; 2],
    /// Slabs in which any of its columns has receivers.
    pub slabs: Slabs,
    columns: Vec<Slabs>,
    size: (u32, u32),
    /// Columns per metre.
    per_metre: Vec2,
}

/// The slabs of a set of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColumnSlabs {
    /// Slabs in which at least one column has receivers.
    pub any: Slabs,
    /// Slabs in which every column has receivers.
    pub every: Slabs,
}

/// The columns of all boxes that reach below the water's level.
#[must_use]
pub fn receiver_columns(boxes: &[ReceiverBox], receivers: &Receivers, slices: &Slices, span: Span) -> Vec<ReceiverColumns> {
    let longest = boxes.iter().map(|b| b.bounds.size().x.max(b.bounds.size().z)).fold(0.0, f32::max);
    let columns = |(number, b): (usize, &ReceiverBox)| ReceiverColumns {
        number,
        ..ReceiverColumns::new(b, receivers, slices, span, longest / COLUMNS)
    };
    boxes.iter().enumerate().map(columns).filter(|columns| columns.slabs != 0 && columns.y[0] <= columns.y[1]).collect()
}

impl ReceiverColumns {
    fn new(of: &ReceiverBox, receivers: &Receivers, slices: &Slices, span: Span, column_m: f32) -> Self {
        let bounds = of.bounds;
        let rect = Rect { min: Vec2::new(bounds.min.x, bounds.min.z), max: Vec2::new(bounds.max.x, bounds.max.z) };
        let side = |length: f32| ((length / column_m).ceil() as u32).clamp(1, MOST);
        let extent = rect.max - rect.min;
        let size = (side(extent.x), side(extent.y));
        let per_metre = Vec2::new(size.0 as f32, size.1 as f32) / extent;
        let y = [bounds.min.y.max(span.bottom_y), bounds.max.y];
        let columns = vec![0; (size.0 * size.1) as usize];
        let mut grid = Self { number: 0, rect, y, slabs: 0, columns, size, per_metre };
        let margin = margin(receivers);
        for triangle in of.positions(receivers) {
            grid.add(triangle, margin, slices);
        }
        grid.slabs = grid.columns.iter().fold(0, |all, column| all | column);
        grid
    }

    /// Adds a triangle to the columns that it touches, each with the heights of the triangle's part inside.
    fn add(&mut self, triangle: [Vec3; 3], margin: f32, slices: &Slices) {
        let low = triangle[0].min(triangle[1]).min(triangle[2]) - margin;
        let high = triangle[0].max(triangle[1]).max(triangle[2]) + margin;
        let ([x0, x1], [z0, z1]) = self.columns_under(Rect { min: Vec2::new(low.x, low.z), max: Vec2::new(high.x, high.z) });
        let one = x0 == x1 && z0 == z1;
        for z in z0..=z1 {
            for x in x0..=x1 {
                let heights = if one { Some([low.y, high.y]) } else { self.heights_in(triangle, margin, x, z) };
                if let Some([low, high]) = heights {
                    self.columns[(z * self.size.0 + x) as usize] |= slices.between(low, high);
                }
            }
        }
    }

    /// Least and greatest height of the part of a triangle inside a column; `None` if there is no such part.
    fn heights_in(&self, triangle: [Vec3; 3], margin: f32, x: u32, z: u32) -> Option<[f32; 2]> {
        let cell = Vec2::ONE / self.per_metre;
        let min = self.rect.min + cell * Vec2::new(x as f32, z as f32) - margin;
        let max = min + cell + 2.0 * margin;
        let mut polygon = triangle.to_vec();
        for (axis, side, sign) in [(0, min.x, 1.0), (0, max.x, -1.0), (2, min.y, 1.0), (2, max.y, -1.0)] {
            let inside = |p: Vec3| (p[axis] - side) * sign;
            let mut cut = Vec::with_capacity(8);
            for (i, &p) in polygon.iter().enumerate() {
                let q = polygon[(i + 1) % polygon.len()];
                let (a, b) = (inside(p), inside(q));
                if a >= 0.0 {
                    cut.push(p);
                }
                if (a >= 0.0) != (b >= 0.0) {
                    cut.push(p + (q - p) * (a / (a - b)));
                }
            }
            polygon = cut;
        }
        let heights = || polygon.iter().map(|p| p.y);
        (!polygon.is_empty())
            .then(|| [heights().fold(f32::INFINITY, f32::min) - margin, heights().fold(f32::NEG_INFINITY, f32::max) + margin])
    }

    /// First and last column, along x and along z, that a rectangle covers; the nearest columns if it lies outside of the box.
    #[inline(always)]
    fn columns_under(&self, rect: Rect) -> ([u32; 2], [u32; 2]) {
        let (low, high) = ((rect.min - self.rect.min) * self.per_metre, (rect.max - self.rect.min) * self.per_metre);
        let (last_x, last_z) = (self.size.0 - 1, self.size.1 - 1);
        ([(low.x as u32).min(last_x), (high.x as u32).min(last_x)], [(low.y as u32).min(last_z), (high.y as u32).min(last_z)])
    }

    /// Slabs of the columns that a rectangle covers.
    #[inline(always)]
    pub fn under(&self, rect: Rect) -> ColumnSlabs {
        let ([x0, x1], [z0, z1]) = self.columns_under(rect);
        let mut common = ColumnSlabs { any: 0, every: Slabs::MAX };
        for z in z0..=z1 {
            for column in &self.columns[(z * self.size.0 + x0) as usize..=(z * self.size.0 + x1) as usize] {
                common.any |= column;
                common.every &= column;
            }
        }
        common
    }
}
