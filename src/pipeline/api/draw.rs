//! Draws: a pipeline, its bindings and buffers, and a range of vertices and instances.

use std::ops::Range;

use crate::api::bindings::Bindings;
use crate::api::buffer::Buffer;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::state::{IndexFormat, PixelRect, Viewport};

/// A bound index buffer.
#[derive(Clone, Copy, Debug)]
pub struct IndexBuffer<'a> {
    /// The bytes.
    pub buffer: &'a Buffer,
    /// 16 or 32 bits.
    pub format: IndexFormat,
    /// Byte offset of the first index, a multiple of the index size.
    pub offset: usize,
}

impl IndexBuffer<'_> {
    /// Indices in the buffer, from the offset on.
    #[must_use]
    pub fn len(&self) -> usize {
        self.buffer.len().saturating_sub(self.offset) / self.format.byte_size() as usize
    }
    /// True if there are no indices.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The index at a place. Validation has checked the draw's range.
    #[inline]
    pub(crate) fn get(&self, at: usize) -> u32 {
        let bytes = self.buffer.bytes();
        match self.format {
            IndexFormat::Uint16 => {
                let at = self.offset + at * 2;
                u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]))
            }
            IndexFormat::Uint32 => {
                let at = self.offset + at * 4;
                u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
            }
        }
    }
    pub(crate) fn restart(&self) -> u32 {
        match self.format {
            IndexFormat::Uint16 => 0xffff,
            IndexFormat::Uint32 => u32::MAX,
        }
    }
}

/// A bound vertex buffer.
#[derive(Clone, Copy, Debug)]
pub struct VertexBuffer<'a> {
    /// The bytes.
    pub buffer: &'a Buffer,
    /// Byte offset of element 0.
    pub offset: usize,
}

/// Draws per parallel task, for passes with many draws.
pub(crate) const DRAWS_PER_TASK: usize = 4096;

/// One draw of a pass.
#[derive(Clone, Debug)]
pub struct Draw<'a> {
    /// Program and fixed state.
    pub pipeline: &'a RenderPipeline,
    /// Resources that the shaders read.
    pub bindings: Bindings<'a>,
    /// Vertex buffers, by slot of the pipeline's layouts.
    pub vertex_buffers: &'a [VertexBuffer<'a>],
    /// Index buffer; `None` for a draw without indices.
    pub index: Option<IndexBuffer<'a>>,
    /// Vertices; for an indexed draw, the range of the index buffer.
    pub vertices: Range<u32>,
    /// Added to every index.
    pub base_vertex: i32,
    /// Instances, from `instance_index` = start on.
    pub instances: Range<u32>,
    /// Viewport: the transform from clip space to pixels and depth.
    pub viewport: Viewport,
    /// Scissor: the pixels that may change.
    pub scissor: PixelRect,
    /// Stencil reference; only the low 8 bits are used.
    pub stencil_reference: u32,
    /// Blend constant.
    pub blend_constant: [f32; 4],
    /// Occlusion query that counts this draw's fragments.
    pub query: Option<u32>,
    /// Stream-out target that this draw's primitives are appended to.
    pub stream_out: Option<u32>,
}

impl<'a> Draw<'a> {
    /// A draw of `elements` vertices with viewport and scissor over the whole target.
    #[must_use]
    pub fn new(pipeline: &'a RenderPipeline, bindings: Bindings<'a>, vertices: Range<u32>, size: (u32, u32)) -> Self {
        Self {
            pipeline,
            bindings,
            vertex_buffers: &[],
            index: None,
            vertices,
            base_vertex: 0,
            instances: 0..1,
            viewport: Viewport::full(size.0, size.1),
            scissor: PixelRect::full(size.0, size.1),
            stencil_reference: 0,
            blend_constant: [0.0; 4],
            query: None,
            stream_out: None,
        }
    }
}
