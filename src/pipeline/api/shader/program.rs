//! Programs: the shaders of a pipeline, their varyings and bindings.

use std::sync::Arc;

use crate::api::bindings::BindingKind;
use crate::api::shader::geometry::Geometry;
use crate::api::shader::stages::{FragmentStage, VertexStage};
use crate::api::shader::varying::Varying;

/// The shaders of a pipeline, their varyings and bindings.
#[derive(Clone)]
pub struct Program {
    /// Name in errors and captures, and stem of the WGSL twin.
    pub name: &'static str,
    /// Vertex stage.
    pub vertex: Arc<dyn VertexStage>,
    /// Geometry stage, if any.
    pub geometry: Option<Geometry>,
    /// Fragment stage. Without one, a draw changes only depth, stencil and counters.
    pub fragment: Option<Arc<dyn FragmentStage>>,
    /// Varyings of the last stage before rasterization, which the fragment stage reads.
    pub varyings: Vec<Varying>,
    /// Resources that the stages read, by binding number.
    pub bindings: Vec<BindingKind>,
    /// Whether the fragment stage may discard.
    pub may_discard: bool,
    /// Whether the fragment stage writes `frag_depth`.
    pub writes_depth: bool,
    /// The same program in WGSL, with entry points `vs` and `fs`. A program with a geometry stage has no `vs`: a driver gets the streamed-out
    /// primitives and runs `fs` on them.
    pub wgsl: Option<&'static str>,
    /// The pipeline-overridable constants of the WGSL program, by name: the values that the Rust shaders hold as fields.
    pub wgsl_constants: Vec<(&'static str, f64)>,
}

impl Program {
    /// A program of a vertex and a fragment shader without bindings or varyings; set the other fields as needed.
    #[must_use]
    pub fn new(name: &'static str, vertex: impl VertexStage + 'static, fragment: impl FragmentStage + 'static) -> Self {
        Self {
            name,
            vertex: Arc::new(vertex),
            geometry: None,
            fragment: Some(Arc::new(fragment)),
            varyings: Vec::new(),
            bindings: Vec::new(),
            may_discard: false,
            writes_depth: false,
            wgsl: None,
            wgsl_constants: Vec::new(),
        }
    }
}

impl std::fmt::Debug for Program {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Program").field("name", &self.name).finish_non_exhaustive()
    }
}
