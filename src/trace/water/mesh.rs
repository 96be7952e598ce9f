//! The water surface of techniques: a triangle mesh over a regular grid, with a normal at every vertex.
//!
//! Light meets the flat triangles and is refracted at normals interpolated over them. Results differ from those of the exact surface because of the
//! mesh alone, and from those of a technique on the same mesh because of the technique alone.

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::water::HeightField;

use super::Heights;

/// A surface of two triangles per cell, cut as [`HeightField::triangle_indices`] cuts them.
pub(super) struct MeshSurface {
    columns: usize,
    /// Number of cells along x and z.
    counts: [f32; 2],
    origin: [f32; 2],
    inverse_spacing: [f32; 2],
    heights: Vec<f32>,
    normals: Vec<glam::Vec3>,
}

/// The cell of a point and its barycentric position in one of the cell's triangles.
struct Place<L: Lanes> {
    /// Index of vertex (0, 0) of the cell, per lane.
    first: [usize; 16],
    /// Lanes in the triangle at vertex (0, 0); the others are in the one at vertex (1, 1).
    near: L::Mask,
    /// Weight of vertex (1, 0) in the near triangle, of (0, 1) in the far one.
    a: L,
    /// Weight of vertex (0, 1) in the near triangle, of (1, 0) in the far one.
    b: L,
}

impl MeshSurface {
    /// From a height field whose mean level is 0.
    pub fn new(field: &HeightField) -> Self {
        Self {
            columns: field.columns as usize,
            counts: [(field.columns - 1) as f32, (field.rows - 1) as f32],
            origin: field.origin_ws.to_array(),
            inverse_spacing: [1.0 / field.spacing_m.x, 1.0 / field.spacing_m.y],
            heights: field.heights_ws.clone(),
            normals: field.normals_ws.clone(),
        }
    }

    /// Bounds on the magnitudes of height and slope.
    pub fn bounds(&self) -> (f64, f64) {
        let rise = self.heights.iter().fold(0.0, |most: f64, &h| most.max(f64::from(h.abs())));
        let rows = self.heights.len() / self.columns;
        let (mut x, mut z) = (0.0_f64, 0.0_f64);
        let h = |column: usize, row: usize| f64::from(self.heights[row * self.columns + column]);
        for row in 0..rows {
            for column in 0..self.columns {
                if column + 1 < self.columns {
                    x = x.max((h(column + 1, row) - h(column, row)).abs());
                }
                if row + 1 < rows {
                    z = z.max((h(column, row + 1) - h(column, row)).abs());
                }
            }
        }
        let (x, z) = (x * f64::from(self.inverse_spacing[0]), z * f64::from(self.inverse_spacing[1]));
        (rise, (x * x + z * z).sqrt())
    }

    #[inline(always)]
    fn place<L: Lanes>(&self, x: L, z: L) -> Place<L> {
        let u = ((x - self.origin[0]) * self.inverse_spacing[0]).clamp(0.0, self.counts[0]);
        let v = ((z - self.origin[1]) * self.inverse_spacing[1]).clamp(0.0, self.counts[1]);
        let column = Lanes::min(u.floor(), u.like(self.counts[0] - 1.0));
        let row = Lanes::min(v.floor(), v.like(self.counts[1] - 1.0));
        let (columns, rows) = (column.to_i32(), row.to_i32());
        let mut first = [0; 16];
        for lane in 0..L::LEN {
            first[lane] = rows[lane] as usize * self.columns + columns[lane] as usize;
        }
        let (fu, fv) = (u - column, v - row);
        let near = (fu + fv).le(fu.like(1.0));
        Place { first, near, a: L::select(near, fu, -fu + 1.0), b: L::select(near, fv, -fv + 1.0) }
    }

    /// Values at the corner from which a position is measured, and at the other two.
    #[inline(always)]
    fn gather<L: Lanes>(&self, place: &Place<L>, token: L::Token, value: impl Fn(usize) -> f32) -> [L; 3] {
        let near = place.near.bits();
        let mut lanes = [[0.0_f32; 16]; 3];
        for lane in 0..L::LEN {
            let first = place.first[lane];
            let (east, south, corner) = (first + 1, first + self.columns, first + self.columns + 1);
            let at = if near >> lane & 1 == 1 { [first, east, south] } else { [corner, south, east] };
            for (k, lanes) in lanes.iter_mut().enumerate() {
                lanes[lane] = value(at[k]);
            }
        }
        [L::load(token, &lanes[0]), L::load(token, &lanes[1]), L::load(token, &lanes[2])]
    }
}

impl Heights for MeshSurface {
    #[inline(always)]
    fn rise_and_slope<L: Lanes>(&self, x: L, z: L) -> (L, L, L) {
        let place = self.place(x, z);
        let [corner, a, b] = self.gather(&place, x.token(), |index| self.heights[index]);
        let (da, db) = (a - corner, b - corner);
        let rise = corner + da * place.a + db * place.b;
        // In the far triangle, weights increase against x and z.
        let sign = L::select(place.near, x.like(1.0), x.like(-1.0));
        (rise, da * sign * self.inverse_spacing[0], db * sign * self.inverse_spacing[1])
    }

    #[inline(always)]
    fn normal<L: Lanes>(&self, x: L, z: L) -> V3<L> {
        let place = self.place(x, z);
        let nx = self.gather(&place, x.token(), |index| self.normals[index].x);
        let ny = self.gather(&place, x.token(), |index| self.normals[index].y);
        let nz = self.gather(&place, x.token(), |index| self.normals[index].z);
        let c = -(place.a + place.b) + 1.0;
        v3(
            nx[0] * c + nx[1] * place.a + nx[2] * place.b,
            ny[0] * c + ny[1] * place.a + ny[2] * place.b,
            nz[0] * c + nz[1] * place.a + nz[2] * place.b,
        )
        .normalize()
    }
}
