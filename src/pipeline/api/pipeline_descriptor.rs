//! What a pipeline is made from.

use std::sync::Arc;

use crate::api::resolved::PrimitiveClass;
use crate::api::shader::program::Program;
use crate::api::state::{ColorTargetState, DepthStencilState, GeometryTopology, PrimitiveState, VertexBufferLayout};

/// Widest line and largest point, in pixels.
pub const MAX_POINT_SIZE: f32 = 1024.0;

/// What a pipeline is made from.
///
/// WebGPU: [`GPURenderPipelineDescriptor`](https://www.w3.org/TR/webgpu/#dictdef-gpurenderpipelinedescriptor), with the geometry stage inside the
/// program, and line width and stream-out beside it.
#[derive(Clone, Debug)]
pub struct RenderPipelineDescriptor {
    /// Name in errors and captures.
    pub label: String,
    /// The shaders.
    pub program: Arc<Program>,
    /// How vertices become primitives. Default: triangle list, counter-clockwise front, no culling.
    pub primitive: PrimitiveState,
    /// Depth and stencil; `None` without such an attachment. Default: none.
    pub depth_stencil: Option<DepthStencilState>,
    /// One per colour attachment of the pass; `None` for a hole. Default: none.
    pub targets: Vec<Option<ColorTargetState>>,
    /// How vertex buffers are read. Default: none; the vertex shader reads storage by vertex index.
    pub vertex_buffers: Vec<VertexBufferLayout>,
    /// Width of lines in pixels, 0 < width <= 1024. Default: 1.
    pub line_width: f32,
    /// Stop after stream-out: nothing is rasterized. Default: false.
    pub rasterizer_discard: bool,
}

impl RenderPipelineDescriptor {
    /// A pipeline with default state.
    #[must_use]
    pub fn new(label: impl Into<String>, program: Arc<Program>) -> Self {
        Self {
            label: label.into(),
            program,
            primitive: PrimitiveState::default(),
            depth_stencil: None,
            targets: Vec::new(),
            vertex_buffers: Vec::new(),
            line_width: 1.0,
            rasterizer_discard: false,
        }
    }

    /// Points, lines or triangles, after the geometry stage.
    pub(crate) fn rasterized(&self) -> PrimitiveClass {
        match self.program.geometry.as_ref().map(|g| g.output) {
            Some(GeometryTopology::Points) => PrimitiveClass::Points,
            Some(GeometryTopology::LineStrip) => PrimitiveClass::Lines,
            Some(GeometryTopology::TriangleStrip) => PrimitiveClass::Triangles,
            None => PrimitiveClass::of(self.primitive.topology),
        }
    }
}
