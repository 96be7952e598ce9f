//! From an object's description to its mesh.

use std::path::Path as FilePath;

use crate::geom::Mesh;
use crate::geom::shapes::ShapeError;

use super::check::At;
use super::description::Scene;
use super::load::SceneError;
use super::mesh_file::{MeshFileError, MeshLimits, read_named_mesh};
use super::object::Object;
use super::shape::Shape;

/// Why the mesh of an object could not be built or read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObjectError {
    /// A field of the procedural shape is out of its range.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The mesh file could not be read; the message names it, and the place in it.
    #[error(transparent)]
    File(#[from] MeshFileError),
}

impl Object {
    /// The object's mesh in object space: built, or read from its file, which lies below `base_dir`, the scene's folder, or below a folder
    /// beside that; other files are not opened.
    pub fn mesh(&self, base_dir: &FilePath) -> Result<Mesh, ObjectError> {
        if let Shape::Mesh(path) = &self.shape {
            return Ok(read_named_mesh(base_dir, path, &MeshLimits::default())?);
        }
        Ok(self.shape.build().transpose()?.unwrap_or_default())
    }
}

/// Bytes of a triangle in a mesh file, at least: a binary one has 12 of indices and half a vertex.
const FILE_BYTES_PER_TRIANGLE: u64 = 18;

impl Scene {
    /// About how many triangles object `index` has, without making or reading it: one from a file as many as the file's length holds.
    #[must_use]
    pub fn triangle_estimate(&self, index: usize) -> u64 {
        match self.objects.get(index).map(|object| &object.shape) {
            Some(Shape::Mesh(path)) => {
                std::fs::metadata(self.source.base_dir.join(path)).map_or(0, |file| file.len() / FILE_BYTES_PER_TRIANGLE)
            }
            Some(shape) => shape.triangle_estimate(),
            None => 0,
        }
    }

    /// The mesh of object `index`, in object space. An error names the place of the object's shape in the scene file.
    ///
    /// An index past the last object gives an empty mesh.
    pub fn mesh(&self, index: usize) -> Result<Mesh, SceneError> {
        let Some(object) = self.objects.get(index) else { return Ok(Mesh::default()) };
        object.mesh(&self.source.base_dir).map_err(|error| {
            let objects = At::ROOT.field("objects");
            self.source.mesh_error(objects.index(index).field("shape").path(), error.to_string())
        })
    }
}
