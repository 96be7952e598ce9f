//! Descriptions of pipelines.

use std::sync::Arc;

use crate::api::resolved::PrimitiveClass;
use crate::api::shader::program::Program;
use crate::api::state::{ColorTargetState, DepthStencilState, GeometryTopology, PrimitiveState, VertexBufferLayout};

/// Largest width of lines and size of points, pixels.
pub const MAX_POINT_SIZE: f32 = 1024.0;

/// Description of a pipeline.
///
/// WebGPU: [`GPURenderPipelineDescriptor`](https://www.w3.org/TR/webgpu/#dictdef-gpurenderpipelinedescriptor), with the geometry stage inside the
/// program, and line width and stream-out beside it.
#[derive(Clone, Debug)]
pub struct RenderPipelineDescriptor {
    /// Name in errors and captures.
    pub label: String,
    /// The shaders, with what they read and what passes between them.
    pub program: Arc<Program>,
    /// How vertices become primitives. Default: triangle list, counter-clockwise front, no culling.
    pub primitive: PrimitiveState,
    /// Depth and stencil state; `None` for passes without a depth-stencil attachment. Default: none.
    pub depth_stencil: Option<DepthStencilState>,
    /// One state per colour attachment of the pass; `None` for a target that is not written. Default: none.
    pub targets: Vec<Option<ColorTargetState>>,
    /// Layouts of the vertex buffers. Default: none; the vertex shader reads storage buffers by vertex index.
    pub vertex_buffers: Vec<VertexBufferLayout>,
    /// Width of lines in pixels, above 0, at most [`MAX_POINT_SIZE`]. Default: 1.
    pub line_width: f32,
    /// Stop after stream-out: nothing is rasterized. Default: false.
    pub rasterizer_discard: bool,
}

impl RenderPipelineDescriptor {
    /// A pipeline in which every state has its default.
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

    /// The class of primitives that is rasterized: that of the geometry stage, or without one that of the topology.
    pub(crate) fn rasterized(&self) -> PrimitiveClass {
        match self.program.geometry.as_ref().map(|g| g.output) {
            Some(GeometryTopology::Points) => PrimitiveClass::Points,
            Some(GeometryTopology::LineStrip) => PrimitiveClass::Lines,
            Some(GeometryTopology::TriangleStrip) => PrimitiveClass::Triangles,
            None => PrimitiveClass::of(self.primitive.topology),
        }
    }
}
