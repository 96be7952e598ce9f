//! Draws: checks their bindings, targets, viewport, scissor, ranges and buffers.
//!
//! A pass may have a hundred thousand draws, so nothing here allocates unless a draw is refused.

use std::ops::Range;

use crate::api::check::binding::BindingProblem;
use crate::api::check::vertex_buffer::VERTEX_ALIGNMENT;
use crate::api::draw::Draw;
use crate::api::pass::Pass;
use crate::api::state::{IndexFormat, PixelRect, TextureFormat, VertexStepMode, Viewport};

/// Why a draw is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawProblem {
    /// The bindings do not match the program.
    #[error(transparent)]
    Binding(BindingProblem),
    /// The pipeline's format of a colour target differs from the pass's, or only one of the two has this target.
    #[error("target {target} is {attached:?}, the pipeline writes {expected:?}")]
    ColorAttachment {
        /// The target's number.
        target: usize,
        /// The pass's format.
        attached: Option<TextureFormat>,
        /// The pipeline's format.
        expected: Option<TextureFormat>,
    },
    /// The pipeline's depth-stencil format differs from the pass's, or only one of the two has such an attachment.
    #[error("depth-stencil attachment is {attached:?}, the pipeline expects {expected:?}")]
    DepthStencil {
        /// The pass's format.
        attached: Option<TextureFormat>,
        /// The pipeline's format.
        expected: Option<TextureFormat>,
    },
    /// A viewport with a size above 32768, a negative size, or a number that is not finite.
    #[error("viewport {viewport:?}: sizes must be in 0..=32768 and all numbers finite")]
    ViewportSize {
        /// The viewport seen.
        viewport: Viewport,
    },
    /// A viewport whose left or top edge is out of range.
    #[error("viewport origin ({x}, {y}) is outside -32768..=32767")]
    ViewportOrigin {
        /// The left edge seen.
        x: f32,
        /// The top edge seen.
        y: f32,
    },
    /// A viewport whose right or bottom edge is out of range.
    #[error("viewport {viewport:?} reaches beyond 32767")]
    ViewportEnd {
        /// The viewport seen.
        viewport: Viewport,
    },
    /// A viewport whose depth range is reversed or reaches beyond 0..=1.
    #[error("viewport depth {min_depth}..{max_depth}: needs 0 <= min <= max <= 1")]
    ViewportDepth {
        /// The least depth seen.
        min_depth: f32,
        /// The greatest depth seen.
        max_depth: f32,
    },
    /// A scissor that reaches beyond the attachments.
    #[error("scissor {scissor:?} is not inside the target of {size:?} pixels")]
    Scissor {
        /// The scissor seen.
        scissor: PixelRect,
        /// Width and height of the attachments.
        size: (u32, u32),
    },
    /// A range that ends before it starts.
    #[error("vertices {vertices:?} or instances {instances:?} end before they start")]
    Range {
        /// Vertices or indices.
        vertices: Range<u32>,
        /// Instances.
        instances: Range<u32>,
    },
    /// The byte offset of the index buffer is not a multiple of the index size.
    #[error("indices begin at byte {offset}, which is not a multiple of {format:?}'s size")]
    IndexOffset {
        /// The offset seen.
        offset: usize,
        /// The indices' format.
        format: IndexFormat,
    },
    /// A range of indices beyond the end of the buffer.
    #[error("indices {indices:?} of a buffer that holds {count}")]
    IndexRange {
        /// The indices drawn.
        indices: Range<u32>,
        /// Indices in the buffer, from the offset on.
        count: usize,
    },
    /// An indexed strip whose index format differs from the pipeline's `strip_index_format`.
    #[error("an indexed strip needs strip_index_format {bound:?}, not {pipeline:?}")]
    StripIndexFormat {
        /// The format of the indices bound.
        bound: IndexFormat,
        /// The pipeline's format.
        pipeline: Option<IndexFormat>,
    },
    /// Fewer vertex buffers than the pipeline reads.
    #[error("{bound} vertex buffers bound, the pipeline reads {expected}")]
    VertexBufferCount {
        /// The buffers seen.
        bound: usize,
        /// Buffers that the pipeline reads.
        expected: usize,
    },
    /// A vertex buffer whose offset is not aligned.
    #[error("vertex buffer {slot} begins at byte {offset}, which is not a multiple of {VERTEX_ALIGNMENT}")]
    VertexBufferOffset {
        /// The buffer's slot.
        slot: usize,
        /// The offset seen.
        offset: usize,
    },
    /// A vertex buffer with fewer bytes than the draw reads.
    #[error("vertex buffer {slot} has {bytes} bytes, the draw reads {expected}")]
    VertexBufferSize {
        /// The buffer's slot.
        slot: usize,
        /// Bytes of the buffer.
        bytes: usize,
        /// One past the last byte that the draw reads.
        expected: u64,
    },
    /// The number of a query beyond the pass's queries.
    #[error("query {query} of {count}")]
    Query {
        /// The query seen.
        query: u32,
        /// Queries of the pass.
        count: usize,
    },
    /// The number of a stream-out target beyond the pass's targets.
    #[error("stream-out target {target} of {count}")]
    StreamOut {
        /// The target seen.
        target: u32,
        /// Stream-out targets of the pass.
        count: usize,
    },
}

/// Why a draw is refused, or `None`. `size` is width and height of the pass's attachments.
pub(crate) fn problem(pass: &Pass<'_>, draw: &Draw<'_>, size: (u32, u32)) -> Option<DrawProblem> {
    let bindings = draw.bindings.mismatch(&draw.pipeline.desc.program.bindings);
    bindings
        .map(DrawProblem::Binding)
        .or_else(|| attachment_problem(pass, draw))
        .or_else(|| viewport_problem(&draw.viewport))
        .or_else(|| scissor_problem(draw.scissor, size))
        .or_else(|| element_problem(draw))
        .or_else(|| vertex_buffer_problem(draw))
        .or_else(|| target_number_problem(pass, draw))
}

fn attachment_problem(pass: &Pass<'_>, draw: &Draw<'_>) -> Option<DrawProblem> {
    let desc = &draw.pipeline.desc;
    if desc.rasterizer_discard {
        return None;
    }
    for target in 0..pass.color.len().max(desc.targets.len()) {
        let attached = pass.color.get(target).and_then(|a| a.as_ref()).map(|a| a.view.format());
        let expected = desc.targets.get(target).and_then(|t| t.as_ref()).map(|t| t.format);
        if attached != expected {
            return Some(DrawProblem::ColorAttachment { target, attached, expected });
        }
    }
    let attached = pass.depth_stencil.as_ref().map(|a| a.view.format());
    let expected = desc.depth_stencil.as_ref().map(|d| d.format);
    (attached != expected).then_some(DrawProblem::DepthStencil { attached, expected })
}

fn viewport_problem(viewport: &Viewport) -> Option<DrawProblem> {
    let v = *viewport;
    let numbers = [v.x, v.y, v.width, v.height, v.min_depth, v.max_depth];
    if !numbers.iter().all(|n| n.is_finite()) || !(0.0..=32768.0).contains(&v.width) || !(0.0..=32768.0).contains(&v.height) {
        return Some(DrawProblem::ViewportSize { viewport: v });
    }
    if !(-32768.0..=32767.0).contains(&v.x) || !(-32768.0..=32767.0).contains(&v.y) {
        return Some(DrawProblem::ViewportOrigin { x: v.x, y: v.y });
    }
    if v.x + v.width > 32767.0 || v.y + v.height > 32767.0 {
        return Some(DrawProblem::ViewportEnd { viewport: v });
    }
    let in_order = (0.0..=1.0).contains(&v.min_depth) && (0.0..=1.0).contains(&v.max_depth) && v.min_depth <= v.max_depth;
    (!in_order).then_some(DrawProblem::ViewportDepth { min_depth: v.min_depth, max_depth: v.max_depth })
}

fn scissor_problem(s: PixelRect, size: (u32, u32)) -> Option<DrawProblem> {
    let inside = s.x0 <= s.x1 && s.y0 <= s.y1 && s.x1 <= size.0 && s.y1 <= size.1;
    (!inside).then_some(DrawProblem::Scissor { scissor: s, size })
}

fn element_problem(draw: &Draw<'_>) -> Option<DrawProblem> {
    let (vertices, instances) = (&draw.vertices, &draw.instances);
    if vertices.start > vertices.end || instances.start > instances.end {
        return Some(DrawProblem::Range { vertices: vertices.clone(), instances: instances.clone() });
    }
    let index = draw.index.as_ref()?;
    if !index.offset.is_multiple_of(index.format.byte_size() as usize) {
        return Some(DrawProblem::IndexOffset { offset: index.offset, format: index.format });
    }
    if vertices.end as usize > index.len() {
        return Some(DrawProblem::IndexRange { indices: vertices.clone(), count: index.len() });
    }
    let primitive = &draw.pipeline.desc.primitive;
    let fits = !primitive.topology.is_strip() || primitive.strip_index_format == Some(index.format);
    (!fits).then_some(DrawProblem::StripIndexFormat { bound: index.format, pipeline: primitive.strip_index_format })
}

fn vertex_buffer_problem(draw: &Draw<'_>) -> Option<DrawProblem> {
    let layouts = &draw.pipeline.desc.vertex_buffers;
    if draw.vertex_buffers.len() < layouts.len() {
        return Some(DrawProblem::VertexBufferCount { bound: draw.vertex_buffers.len(), expected: layouts.len() });
    }
    layouts.iter().zip(draw.vertex_buffers).enumerate().find_map(|(slot, (layout, bound))| {
        let (offset, bytes) = (bound.offset, bound.buffer.len());
        if !(offset as u64).is_multiple_of(VERTEX_ALIGNMENT) {
            return Some(DrawProblem::VertexBufferOffset { slot, offset });
        }
        let range = if layout.step_mode == VertexStepMode::Instance { &draw.instances } else { &draw.vertices };
        if (layout.step_mode == VertexStepMode::Vertex && draw.index.is_some()) || range.is_empty() {
            return None; // Fetch checks the bounds of indices.
        }
        let reach = layout.attributes.iter().map(|a| a.offset + a.format.size()).max().unwrap_or(0);
        let expected = (u64::from(range.end - 1) * layout.array_stride + reach).saturating_add(offset as u64);
        (expected > bytes as u64).then_some(DrawProblem::VertexBufferSize { slot, bytes, expected })
    })
}

/// Why the numbers of a draw's query and stream-out target are refused, or `None`.
fn target_number_problem(pass: &Pass<'_>, draw: &Draw<'_>) -> Option<DrawProblem> {
    if let Some(query) = draw.query.filter(|&query| query as usize >= pass.query_count) {
        return Some(DrawProblem::Query { query, count: pass.query_count });
    }
    let count = pass.stream_out.len();
    draw.stream_out.filter(|&target| target as usize >= count).map(|target| DrawProblem::StreamOut { target, count })
}
