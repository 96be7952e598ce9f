//! Shapes with flat faces: box and grid.

use glam::{UVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Check, ShapeError};
use crate::geom::Mesh;

/// A box centred on the origin, each face with its own vertices and flat normals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cuboid {
    /// Lengths of the sides in metres, above 0. Default: (1, 1, 1).
    pub size_m: Vec3,
}

impl Default for Cuboid {
    fn default() -> Self {
        Self { size_m: Vec3::ONE }
    }
}

impl Cuboid {
    /// Builds the mesh: 24 vertices, 12 triangles.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Cuboid");
        self.size_m.to_array().into_iter().try_for_each(|side| check.length("size_m", side))?;
        let mut mesh = Mesh::default();
        // Right and up of each face, seen from outside; their cross product faces out.
        let faces = [
            (Vec3::NEG_Z, Vec3::Y),
            (Vec3::Z, Vec3::Y),
            (Vec3::X, Vec3::NEG_Z),
            (Vec3::X, Vec3::Z),
            (Vec3::X, Vec3::Y),
            (Vec3::NEG_X, Vec3::Y),
        ];
        for (right, up) in faces {
            let normal = right.cross(up);
            let corner = |s: f32, t: f32| {
                let p = (right * s + up * t + normal) * self.size_m * 0.5;
                (p, Vec2::new(p.dot(right), p.dot(up)))
            };
            let quad = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(s, t)| {
                let (p, uv) = corner(s, t);
                mesh.push_vertex(p, normal, Some(uv))
            });
            mesh.push_quad(quad);
        }
        Ok(mesh)
    }
}

/// A rectangle in the plane `y = 0`, facing up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Grid {
    /// Lengths along x and z in metres, above 0. Default: (1, 1).
    pub size_m: Vec2,
    /// Number of cells along x and z, 1 to 4096. Default: (1, 1).
    pub cells: UVec2,
}

impl Default for Grid {
    fn default() -> Self {
        Self { size_m: Vec2::ONE, cells: UVec2::ONE }
    }
}

impl Grid {
    /// Builds the mesh: `(cells.x + 1)(cells.y + 1)` vertices, x fastest.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Grid");
        self.size_m.to_array().into_iter().try_for_each(|side| check.length("size_m", side))?;
        self.cells.to_array().into_iter().try_for_each(|count| check.count("cells", count, 1..=4096))?;
        Ok(height_grid(self.size_m, self.cells, |_| (0.0, Vec3::Y)))
    }
}

/// A centred grid over x and z whose height and normal at `(x, z)` are given; texture coordinates `(x, −z)`, up on the texture being north.
pub(super) fn height_grid(size_m: Vec2, cells: UVec2, height: impl Fn(Vec2) -> (f32, Vec3)) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=cells.y {
        for column in 0..=cells.x {
            let xz = (Vec2::new(column as f32 / cells.x as f32, row as f32 / cells.y as f32) - 0.5) * size_m;
            let (y, normal) = height(xz);
            mesh.push_vertex(Vec3::new(xz.x, y, xz.y), normal, Some(Vec2::new(xz.x, -xz.y)));
        }
    }
    let stride = cells.x + 1;
    for row in 0..cells.y {
        for column in 0..cells.x {
            let a = row * stride + column;
            mesh.push_quad([a, a + stride, a + stride + 1, a + 1]);
        }
    }
    mesh
}
