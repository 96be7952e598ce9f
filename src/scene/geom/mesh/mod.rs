//! Triangle meshes: vertex arrays and an index list.
//!
//! One index serves all vertex attributes, as on a GPU, so a corner with two normals or two texture coordinates is two vertices
//! at one place. Whatever depends on the surface (smooth normals, closedness) therefore looks at *places*: vertices with equal
//! coordinates are one place. Split by idea: `normals` (smooth, creased, flat), `topology` (edges, volume, welding), `curvature`, `edit`
//! (transform, merge, compact), `validate`.

mod curvature;
mod edit;
mod normals;
mod topology;
mod validate;

use glam::{Vec2, Vec3};

pub use curvature::Curvature;
pub(crate) use normals::direction;
pub use topology::EdgeReport;
pub use validate::MeshError;

use super::Aabb;

/// A triangle mesh in metres.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vectors pointing out of the surface, one per vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per vertex; or empty.
    pub uvs: Vec<Vec2>,
    /// Three vertex numbers per triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// Vertex numbers of each triangle.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + '_ {
        self.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])
    }

    /// Corner positions of a triangle. Panics on a vertex number that does not exist; see [`Mesh::validate`].
    #[must_use]
    pub fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }

    /// The smallest box around all vertices, used or not; [`Aabb::EMPTY`] without any.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.positions.iter().copied())
    }

    /// Number of bytes of the vertex and index arrays.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        size_of_val(&*self.positions) + size_of_val(&*self.normals) + size_of_val(&*self.uvs) + size_of_val(&*self.indices)
    }

    /// Appends a vertex and returns its number. Pass texture coordinates for all vertices of a mesh or for none.
    pub(crate) fn push_vertex(&mut self, position: Vec3, normal: Vec3, uv: Option<Vec2>) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.extend(uv);
        index
    }

    /// Appends a triangle unless two of its corners are at the same place.
    pub(crate) fn push_triangle(&mut self, triangle: [u32; 3]) {
        let [a, b, c] = self.corners(triangle);
        if a != b && b != c && c != a {
            self.indices.extend(triangle);
        }
    }

    /// Appends the quad `a b c d`, cut along its shorter diagonal, leaving out collapsed halves.
    pub(crate) fn push_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let p = |i: u32| self.positions[i as usize];
        let (ac, bd) = (p(a).distance_squared(p(c)), p(b).distance_squared(p(d)));
        // The half at a collapsed side must vanish, not the diagonal.
        if bd < ac && p(a) != p(b) && p(b) != p(c) && p(c) != p(d) && p(d) != p(a) {
            self.push_triangle([a, b, d]);
            self.push_triangle([b, c, d]);
        } else {
            self.push_triangle([a, b, c]);
            self.push_triangle([a, c, d]);
        }
    }
}

#[cfg(test)]
mod tests;
