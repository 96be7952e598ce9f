//! Programs: the shaders of a pipeline and what passes between them.

use std::sync::Arc;

use crate::api::bindings::BindingKind;
use crate::api::shader::geometry::Geometry;
use crate::api::shader::stages::{FragmentStage, VertexStage};
use crate::api::shader::varying::Varying;

/// The shaders of a pipeline and what passes between them.
#[derive(Clone)]
pub struct Program {
    /// Name in errors and captures, and stem of the WGSL twin.
    pub name: &'static str,
    /// Vertex stage.
    pub vertex: Arc<dyn VertexStage>,
    /// Geometry stage, if any.
    pub geometry: Option<Geometry>,
    /// Fragment stage; without it only depth, stencil and counters change.
    pub fragment: Option<Arc<dyn FragmentStage>>,
    /// What reaches the fragment stage.
    pub varyings: Vec<Varying>,
    /// What the stages read, by binding number.
    pub bindings: Vec<BindingKind>,
    /// Whether the fragment stage may discard.
    pub may_discard: bool,
    /// Whether the fragment stage writes `frag_depth`.
    pub writes_depth: bool,
    /// The same program in WGSL, with the entry points `vs` and `fs`. Where there is a geometry stage there is no `vs`: its primitives are
    /// given to `fs` as they are streamed out.
    pub wgsl: Option<&'static str>,
    /// The twin's pipeline-overridable constants: what the Rust shaders hold as fields.
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
