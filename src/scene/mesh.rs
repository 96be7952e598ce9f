//! From an object's description to its mesh.

use std::path::Path as FilePath;

use glam::Vec3;

use crate::geom::Mesh;
use crate::geom::shapes::ShapeError;

use super::check::At;
use super::description::Scene;
use super::load::SceneError;
use super::material::Material;
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

/// Largest coordinate of a placed mesh, m: beyond it, areas and volumes are no longer numbers.
const MAX_COORDINATE_M: f32 = 1e9;

/// An object's mesh in world space.
#[derive(Clone, Debug)]
pub struct PlacedMesh {
    /// The mesh; that of glass is closed, and its triangles face out.
    pub mesh: Mesh,
    /// Whether its triangles faced in, and were turned over.
    pub turned: bool,
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
        object.mesh(&self.source.base_dir).map_err(|error| self.unfit(index, error.to_string()))
    }

    /// The mesh of object `index`, in world space, fit for light: whoever follows light takes meshes from here, so that all refuse the same ones. Glass
    /// that faces in is turned over.
    ///
    /// # Errors
    /// As [`Self::mesh`]; if a coordinate is too large; if glass is not closed or its triangles disagree about the outside.
    pub fn placed_mesh(&self, index: usize) -> Result<PlacedMesh, SceneError> {
        let Some(object) = self.objects.get(index) else { return Ok(PlacedMesh { mesh: Mesh::default(), turned: false }) };
        let mut mesh = self.mesh(index)?.transformed(object.transform.world_from_object());
        let reasonable = |p: &Vec3| p.abs().max_element() <= MAX_COORDINATE_M;
        if let Some(p) = mesh.positions.iter().find(|p| !reasonable(p)) {
            let cause = format!(
                "{} has a vertex at ({}, {}, {}), expected coordinates of -1e9 ..= 1e9 m",
                object.display_name(index),
                p.x,
                p.y,
                p.z
            );
            return Err(self.unfit(index, cause));
        }
        if !matches!(object.material, Material::Dielectric { .. }) {
            return Ok(PlacedMesh { mesh, turned: false });
        }
        let report = mesh.edge_report();
        if !report.is_closed() {
            let cause = format!(
                "{} is glass, but its mesh is open: {} edges have one triangle only, {} have more than two, {} join triangles of opposite \
                 orientation; a closed mesh is needed",
                object.display_name(index),
                report.border_count,
                report.non_manifold_count,
                report.inconsistent_count,
            );
            return Err(self.unfit(index, cause));
        }
        let turned = mesh.signed_volume() < 0.0;
        if turned {
            mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
            mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        }
        Ok(PlacedMesh { mesh, turned })
    }

    fn unfit(&self, index: usize, cause: String) -> SceneError {
        self.source.mesh_error(At::ROOT.field("objects").index(index).field("shape").path(), cause)
    }
}
