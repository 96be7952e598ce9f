//! The water surface as techniques see it: heights and normals on an evenly spaced grid.

use glam::{Vec2, Vec3};

/// A surface `y = h(x, z)` sampled on an evenly spaced grid of vertices.
///
/// Vertex `(column, row)` has index `row · columns + column`; columns run along +x, rows along +z.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Number of vertices along x, at least 2.
    pub columns: u32,
    /// Number of vertices along z, at least 2.
    pub rows: u32,
    /// World (x, z) of vertex (0, 0), in metres.
    pub origin_ws: Vec2,
    /// Distance between neighbouring vertices along x and z, in metres.
    pub spacing_m: Vec2,
    /// World y of every vertex, in metres.
    pub heights_ws: Vec<f32>,
    /// Unit normal of the surface at every vertex; y is positive.
    pub normals_ws: Vec<Vec3>,
}

/// Where the vertices of a height field are, without their heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layout {
    pub columns: u32,
    pub rows: u32,
    pub origin_ws: Vec2,
    pub spacing_m: Vec2,
}

impl Layout {
    /// World x of a column of vertices.
    pub fn x_ws(&self, column: u32) -> f32 {
        self.origin_ws.x + self.spacing_m.x * column as f32
    }

    /// World z of a row of vertices.
    pub fn z_ws(&self, row: u32) -> f32 {
        self.origin_ws.y + self.spacing_m.y * row as f32
    }

    /// Samples `height_and_slope(column, row)`, which gives the world y and `(∂h/∂x, ∂h/∂z)`, at every vertex.
    pub fn sample(&self, mut height_and_slope: impl FnMut(u32, u32) -> (f32, Vec2)) -> HeightField {
        let count = self.columns as usize * self.rows as usize;
        let mut heights_ws = Vec::with_capacity(count);
        let mut normals_ws = Vec::with_capacity(count);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (height, slope) = height_and_slope(column, row);
                heights_ws.push(height);
                normals_ws.push(normal_from_slope(slope));
            }
        }
        HeightField { columns: self.columns, rows: self.rows, origin_ws: self.origin_ws, spacing_m: self.spacing_m, heights_ws, normals_ws }
    }
}

/// Unit normal `(−∂h/∂x, 1, −∂h/∂z)/|…|` of a surface `y = h(x, z)` with the given slope.
#[must_use]
pub fn normal_from_slope(slope: Vec2) -> Vec3 {
    let scale = 1.0 / (1.0 + slope.x * slope.x + slope.y * slope.y).sqrt();
    Vec3::new(-slope.x * scale, scale, -slope.y * scale)
}

impl HeightField {
    /// A field from heights alone: normals by central differences, one-sided on the border.
    ///
    /// `None` unless there are at least 2×2 vertices, as many heights as vertices, and a positive spacing.
    #[must_use]
    pub fn from_heights(columns: u32, rows: u32, origin_ws: Vec2, spacing_m: Vec2, heights_ws: Vec<f32>) -> Option<Self> {
        let valid = columns >= 2 && rows >= 2 && columns as u64 * rows as u64 == heights_ws.len() as u64;
        if !valid || !spacing_m.cmpgt(Vec2::ZERO).all() {
            return None;
        }
        let height = |column: u32, row: u32| heights_ws[row as usize * columns as usize + column as usize];
        let layout = Layout { columns, rows, origin_ws, spacing_m };
        let field = layout.sample(|column, row| {
            let (west, east) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            let (north, south) = (row.saturating_sub(1), (row + 1).min(rows - 1));
            let slope_x = (height(east, row) - height(west, row)) / ((east - west) as f32 * spacing_m.x);
            let slope_z = (height(column, south) - height(column, north)) / ((south - north) as f32 * spacing_m.y);
            (height(column, row), Vec2::new(slope_x, slope_z))
        });
        Some(field)
    }

    /// World position of a vertex. Panics if there is none with these indices.
    #[must_use]
    pub fn position_ws(&self, column: u32, row: u32) -> Vec3 {
        let layout = self.layout();
        Vec3::new(layout.x_ws(column), self.heights_ws[self.index(column, row)], layout.z_ws(row))
    }

    /// World y of the surface over world (x, z), on the triangles of [`Self::triangle_indices`]; beside the field, that of its nearest edge.
    #[must_use]
    pub fn height_at(&self, x_ws: f32, z_ws: f32) -> f32 {
        let last = Vec2::new((self.columns - 1) as f32, (self.rows - 1) as f32);
        let place = ((Vec2::new(x_ws, z_ws) - self.origin_ws) / self.spacing_m).clamp(Vec2::ZERO, last);
        let corner = place.floor().min(last - 1.0);
        let part = place - corner;
        let (column, row) = (corner.x as u32, corner.y as u32);
        let height = |dx: u32, dz: u32| self.heights_ws[self.index(column + dx, row + dz)];
        // The triangle's corners are (0, 0) or (1, 1), and both others.
        let far = part.x + part.y > 1.0;
        let base = if far { height(1, 1) } else { height(0, 0) };
        let along = if far { Vec2::new(1.0 - part.y, 1.0 - part.x) } else { part };
        base + along.x * (height(1, 0) - base) + along.y * (height(0, 1) - base)
    }

    /// World (x, z) of the corners with the smallest and the largest coordinates, in metres.
    #[must_use]
    pub fn corners_ws(&self) -> [Vec2; 2] {
        let last = Vec2::new((self.columns - 1) as f32, (self.rows - 1) as f32);
        [self.origin_ws, self.origin_ws + self.spacing_m * last]
    }

    /// The part of the surface over a rectangle of world (x, z), with as many vertices. Heights are those of the triangles, normals are interpolated.
    #[must_use]
    pub fn resampled(&self, min_ws: Vec2, max_ws: Vec2) -> Self {
        let spacing_m = (max_ws - min_ws) / Vec2::new((self.columns - 1) as f32, (self.rows - 1) as f32);
        let layout = Layout { columns: self.columns, rows: self.rows, origin_ws: min_ws, spacing_m };
        let mut part = layout.sample(|column, row| (self.height_at(layout.x_ws(column), layout.z_ws(row)), Vec2::ZERO));
        for row in 0..self.rows {
            for column in 0..self.columns {
                let index = part.index(column, row);
                part.normals_ws[index] = self.normal_at(layout.x_ws(column), layout.z_ws(row));
            }
        }
        part
    }

    /// Unit normal over world (x, z), between the normals of the four vertices around.
    #[must_use]
    pub fn normal_at(&self, x_ws: f32, z_ws: f32) -> Vec3 {
        let last = Vec2::new((self.columns - 1) as f32, (self.rows - 1) as f32);
        let place = ((Vec2::new(x_ws, z_ws) - self.origin_ws) / self.spacing_m).clamp(Vec2::ZERO, last);
        let corner = place.floor().min(last - 1.0);
        let part = place - corner;
        let normal = |dx: u32, dz: u32| self.normals_ws[self.index(corner.x as u32 + dx, corner.y as u32 + dz)];
        let along = |dz: u32| normal(0, dz).lerp(normal(1, dz), part.x);
        along(0).lerp(along(1), part.y).normalize()
    }

    /// Whether the surface is above a world-space point, so that the point is under water.
    #[must_use]
    pub fn is_above(&self, p_ws: Vec3) -> bool {
        let [first, last] = self.corners_ws();
        let at = Vec2::new(p_ws.x, p_ws.z);
        let inside = at.cmpge(first).all() && at.cmple(last).all();
        inside && p_ws.y < self.height_at(p_ws.x, p_ws.z)
    }

    /// The surface mirrored at the plane y = 0, as seen by light that comes from below.
    #[must_use]
    pub fn upside_down(&self) -> Self {
        let heights_ws = self.heights_ws.iter().map(|height| -height).collect();
        let normals_ws = self.normals_ws.iter().map(|n| Vec3::new(-n.x, n.y, -n.z)).collect();
        Self { heights_ws, normals_ws, ..*self }
    }

    /// World positions of all vertices, in index order.
    #[must_use]
    pub fn positions_ws(&self) -> Vec<Vec3> {
        (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| self.position_ws(column, row))).collect()
    }

    /// Index of a vertex.
    #[must_use]
    pub fn index(&self, column: u32, row: u32) -> usize {
        row as usize * self.columns as usize + column as usize
    }

    /// Two triangles per cell, anticlockwise seen from above: `(00, 01, 10)` and `(10, 01, 11)`, digits being column and row offsets.
    ///
    /// All cells are cut along the same diagonal, row by row.
    #[must_use]
    pub fn triangle_indices(&self) -> Vec<u32> {
        let mut indices = Vec::with_capacity(6 * (self.columns as usize - 1) * (self.rows as usize - 1));
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let corner = row * self.columns + column;
                let below = corner + self.columns;
                indices.extend([corner, below, corner + 1, corner + 1, below, below + 1]);
            }
        }
        indices
    }

    /// Lowest and highest world y of the vertices.
    #[must_use]
    pub fn height_range_ws(&self) -> (f32, f32) {
        self.heights_ws.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &h| (low.min(h), high.max(h)))
    }

    fn layout(&self) -> Layout {
        Layout { columns: self.columns, rows: self.rows, origin_ws: self.origin_ws, spacing_m: self.spacing_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> HeightField {
        let heights = (0..12).map(|i| 1.0 + 0.5 * (i % 4) as f32 - 0.25 * (i / 4) as f32).collect();
        HeightField::from_heights(4, 3, Vec2::new(-1.0, 2.0), Vec2::new(0.5, 0.25), heights).unwrap()
    }

    #[test]
    fn positions_follow_columns_then_rows() {
        let field = plane();
        assert_eq!(field.position_ws(3, 2), Vec3::new(0.5, 2.0, 2.5));
        assert_eq!(field.positions_ws()[11], field.position_ws(3, 2));
        assert_eq!(field.height_range_ws(), (0.5, 2.5));
    }

    #[test]
    fn differences_of_a_plane_are_exact_up_to_the_border() {
        // h = 1 + x − z in world units of the plane above: slopes 1 and −1.
        let expected = normal_from_slope(Vec2::new(1.0, -1.0));
        assert!(plane().normals_ws.iter().all(|n| (*n - expected).length() < 1e-6));
    }

    #[test]
    fn triangles_face_up_and_cover_every_cell() {
        let field = plane();
        let (positions, indices) = (field.positions_ws(), field.triangle_indices());
        assert_eq!(indices.len(), 6 * 3 * 2);
        let mut area = 0.0;
        for t in indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| positions[i as usize]);
            let up = (b - a).cross(c - a).y;
            assert!(up > 0.0);
            area += 0.5 * up;
        }
        assert!((area - 1.5 * 0.5).abs() < 1e-6);
    }

    #[test]
    fn heights_between_vertices_are_those_of_the_triangles() {
        // One cell, folded along its diagonal: 1 m at the corner (1, 1), 0 elsewhere.
        let field = HeightField::from_heights(2, 2, Vec2::new(2.0, -1.0), Vec2::new(2.0, 1.0), vec![0.0, 0.0, 0.0, 1.0]).unwrap();
        for (x, z, expected) in [(2.0, -1.0, 0.0), (3.0, -0.5, 0.0), (4.0, 0.0, 1.0), (3.5, -0.25, 0.5), (2.5, -0.9, 0.0), (9.0, 9.0, 1.0)]
        {
            assert!((field.height_at(x, z) - expected).abs() < 1e-6, "{} at ({x}, {z})", field.height_at(x, z));
        }
        assert!(field.is_above(Vec3::new(3.5, 0.4, -0.25)) && !field.is_above(Vec3::new(3.5, 0.6, -0.25)));
        assert!(!field.is_above(Vec3::new(4.1, -1.0, -0.25)), "beside the water");
        // A plane keeps its height everywhere.
        let plane = plane();
        for (x, z) in [(-0.9, 2.1), (-0.3, 2.4), (0.2, 2.3)] {
            assert!((plane.height_at(x, z) - (1.0 + (x + 1.0) - (z - 2.0))).abs() < 1e-6);
        }
    }

    #[test]
    fn bad_sizes_are_refused() {
        for (columns, rows, count) in [(1, 4, 4), (4, 1, 4), (2, 2, 3), (u32::MAX, u32::MAX, 1)] {
            assert_eq!(HeightField::from_heights(columns, rows, Vec2::ZERO, Vec2::ONE, vec![0.0; count]), None);
        }
        assert_eq!(HeightField::from_heights(2, 2, Vec2::ZERO, Vec2::new(1.0, f32::NAN), vec![0.0; 4]), None);
    }
}
