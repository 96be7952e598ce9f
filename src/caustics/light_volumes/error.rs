//! Errors of light-volumes: meshes that make more beams than can be drawn one by one.

use crate::RenderError;

/// More beams than can be drawn one by one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LightVolumesError {
    /// The water mesh makes them.
    #[error(
        "light-volumes draws each beam by itself: a grid of {columns}x{rows} makes {triangles} of them, at most {limit} are allowed; lower `light_volumes.grid`"
    )]
    TooManyBeams {
        /// Columns of vertices of the water mesh.
        columns: u32,
        /// Rows of vertices of the water mesh.
        rows: u32,
        /// Triangles of the water mesh.
        triangles: u64,
        /// Most beams allowed.
        limit: u64,
    },
    /// A mirror or a body of glass makes them.
    #[error("light-volumes draws each beam by itself: `{object}` makes more than {limit} of them; raise `light_volumes.generator_edge`")]
    TooManyGenerators {
        /// Name of the object.
        object: String,
        /// Most beams allowed.
        limit: u64,
    },
}

impl From<LightVolumesError> for RenderError {
    fn from(error: LightVolumesError) -> Self {
        Self::of_technique(error)
    }
}
