//! Pipeline state: the types of `wgpu-types`, and the few that WebGPU lacks.

pub use wgpu_types::{
    BlendComponent, BlendFactor, BlendOperation, BlendState, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState,
    DepthStencilState, Face, FrontFace, IndexFormat, LoadOp, PolygonMode, PrimitiveState, PrimitiveTopology, StencilFaceState,
    StencilOperation, StencilState, TextureFormat, VertexAttribute, VertexFormat, VertexStepMode,
};

/// Blending that adds: `1·source + 1·destination`.
pub const ADD: BlendComponent =
    BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Add };

/// [`ADD`] for colour and alpha: every fragment adds its output to the pixel.
pub const ADDITIVE: BlendState = BlendState { color: ADD, alpha: ADD };

/// Depth state that tests with `compare` and writes the depth of fragments that pass; no stencil, no bias.
#[must_use]
pub fn depth_test(format: TextureFormat, compare: CompareFunction) -> DepthStencilState {
    DepthStencilState {
        format,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}

/// Most colour targets of a pass. WebGPU's `maxColorAttachments` default.
pub const MAX_COLOR_TARGETS: usize = 8;

/// Most scalars that a vertex passes to the next stage, besides position and point size (16 vectors of four).
pub const MAX_VARYINGS: usize = 64;

/// The region of the framebuffer and the depth range that a draw is mapped to. `x`, `y` and the size are in pixels, y down.
///
/// WebGPU: [`setViewport`](https://www.w3.org/TR/webgpu/#dom-gpurenderpassencoder-setviewport).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Left edge in pixels. Default: 0.
    pub x: f32,
    /// Top edge in pixels. Default: 0.
    pub y: f32,
    /// Width in pixels. Default: the target's.
    pub width: f32,
    /// Height in pixels. Default: the target's.
    pub height: f32,
    /// Depth that clip `z = 0` maps to, in 0..=1. Default: 0.
    pub min_depth: f32,
    /// Depth that clip `z = w` maps to, in 0..=1. Default: 1.
    pub max_depth: f32,
}

impl Viewport {
    /// The whole of a target of this size, full depth range.
    #[must_use]
    pub fn full(width: u32, height: u32) -> Self {
        Self::of(PixelRect::full(width, height))
    }
    /// A rectangle of pixels, full depth range.
    #[must_use]
    pub fn of(part: PixelRect) -> Self {
        let (width, height) = ((part.x1 - part.x0) as f32, (part.y1 - part.y0) as f32);
        Self { x: part.x0 as f32, y: part.y0 as f32, width, height, min_depth: 0.0, max_depth: 1.0 }
    }
}

/// A half-open rectangle of pixels, y down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl PixelRect {
    /// The whole of a target of this size.
    #[must_use]
    pub fn full(width: u32, height: u32) -> Self {
        Self::at([0, 0], width, height)
    }
    /// The rectangle with this corner and size.
    #[must_use]
    pub fn at([x0, y0]: [u32; 2], width: u32, height: u32) -> Self {
        Self { x0, y0, x1: x0 + width, y1: y0 + height }
    }
    /// The pixels that are in both rectangles.
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        let x0 = self.x0.max(other.x0);
        let y0 = self.y0.max(other.y0);
        Self { x0, y0, x1: self.x1.min(other.x1).max(x0), y1: self.y1.min(other.y1).max(y0) }
    }
}

/// How a draw reads one vertex buffer.
///
/// WebGPU: [`GPUVertexBufferLayout`](https://www.w3.org/TR/webgpu/#dictdef-gpuvertexbufferlayout).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VertexBufferLayout {
    /// Bytes from one element to the next.
    pub array_stride: u64,
    /// Advance per vertex or per instance. Default: per vertex.
    pub step_mode: VertexStepMode,
    /// The attributes read from each element; `shader_location` is the index in `VertexInput::attributes`.
    pub attributes: Vec<VertexAttribute>,
}

impl VertexBufferLayout {
    /// A layout with one element per vertex and these attributes without gaps: the first at byte 0 and shader location 0, the others following it.
    #[must_use]
    pub fn packed(formats: &[VertexFormat]) -> Self {
        let mut array_stride = 0;
        let mut attributes = Vec::with_capacity(formats.len());
        for (shader_location, &format) in (0..).zip(formats) {
            attributes.push(VertexAttribute { format, offset: array_stride, shader_location });
            array_stride += format.size();
        }
        Self { array_stride, step_mode: VertexStepMode::Vertex, attributes }
    }
}

/// The kind of primitives that a geometry stage emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GeometryTopology {
    /// Every vertex is a point.
    Points,
    /// A connected line until the strip is ended.
    LineStrip,
    /// A triangle strip until the strip is ended; winding alternates as in WebGPU's strips.
    TriangleStrip,
}
