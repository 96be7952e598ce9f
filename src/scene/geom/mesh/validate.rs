//! The contract of a mesh, checked once where one comes in from outside.

use glam::Vec3;
use thiserror::Error;

use super::Mesh;

/// How far the squared length of a normal may be from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

/// What is wrong with a mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshError {
    /// A vertex array has another length than the positions.
    #[error("{array} has {seen} entries, but there are {vertex_count} vertices")]
    LengthMismatch {
        /// Name of the array.
        array: &'static str,
        /// Its length.
        seen: usize,
        /// Number of positions.
        vertex_count: usize,
    },
    /// The index list does not divide into triangles.
    #[error("{seen} indices: must be a multiple of 3")]
    PartialTriangle {
        /// Length of the index list.
        seen: usize,
    },
    /// The mesh has no triangles.
    #[error("the mesh has no triangles: at least 1 is needed")]
    NoTriangles,
    /// A triangle uses a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {seen}: must be below {vertex_count}")]
    IndexOutOfRange {
        /// Number of the triangle.
        triangle: usize,
        /// The vertex number.
        seen: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("{array} {vertex} is {value}: must be finite")]
    NotFinite {
        /// Name of the array.
        array: &'static str,
        /// Number of the vertex.
        vertex: usize,
        /// Its value, as text, so that NaN equals itself.
        value: String,
    },
    /// A normal has a length other than 1.
    #[error("normal {vertex} has length {length}: must be 1")]
    NotUnit {
        /// Number of the vertex.
        vertex: usize,
        /// Length of its normal.
        length: f32,
    },
}

impl Mesh {
    /// Checks everything the rest of the library takes for granted: array lengths, vertex numbers, finite coordinates, unit normals.
    ///
    /// # Errors
    /// The first breach found.
    pub fn validate(&self) -> Result<(), MeshError> {
        let vertex_count = self.positions.len();
        if self.normals.len() != vertex_count {
            return Err(MeshError::LengthMismatch { array: "normals", seen: self.normals.len(), vertex_count });
        }
        if !self.uvs.is_empty() && self.uvs.len() != vertex_count {
            return Err(MeshError::LengthMismatch { array: "uvs", seen: self.uvs.len(), vertex_count });
        }
        if !self.indices.len().is_multiple_of(3) {
            return Err(MeshError::PartialTriangle { seen: self.indices.len() });
        }
        if self.indices.is_empty() {
            return Err(MeshError::NoTriangles);
        }
        if let Some((at, &seen)) = self.indices.iter().enumerate().find(|(_, i)| **i as usize >= vertex_count) {
            return Err(MeshError::IndexOutOfRange { triangle: at / 3, seen, vertex_count });
        }
        let not_finite = |array, vertex, value: String| Err(MeshError::NotFinite { array, vertex, value });
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return not_finite("position", vertex, self.positions[vertex].to_string());
        }
        if let Some(vertex) = self.uvs.iter().position(|uv| !uv.is_finite()) {
            return not_finite("uv", vertex, self.uvs[vertex].to_string());
        }
        if let Some(vertex) = self.normals.iter().position(|n| !n.is_finite()) {
            return not_finite("normal", vertex, self.normals[vertex].to_string());
        }
        let off_unit = |n: &Vec3| (n.length_squared() - 1.0).abs() > UNIT_TOLERANCE;
        match self.normals.iter().position(off_unit) {
            Some(vertex) => Err(MeshError::NotUnit { vertex, length: self.normals[vertex].length() }),
            None => Ok(()),
        }
    }
}
