//! Layouts of vertex buffers.

use crate::api::state::VertexBufferLayout;

/// Most vertex buffers that a pipeline may read. WebGPU's `maxVertexBuffers` default.
pub const MAX_VERTEX_BUFFERS: usize = 8;

/// One past the largest shader location. WebGPU's `maxVertexAttributes` default.
pub const MAX_VERTEX_ATTRIBUTES: u32 = 16;

/// Most bytes from one element of a vertex buffer to the next. WebGPU's `maxVertexBufferArrayStride` default.
pub const MAX_ARRAY_STRIDE: u64 = 2048;

/// Alignment of strides and offsets of vertex buffers, bytes [WebGPU, `GPUVertexBufferLayout` validation].
pub const VERTEX_ALIGNMENT: u64 = 4;

/// Why the layout of a vertex buffer is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VertexBufferProblem {
    /// A stride that is too large or not a multiple of four.
    #[error("stride {array_stride}; allowed: multiples of {VERTEX_ALIGNMENT} up to {MAX_ARRAY_STRIDE}")]
    ArrayStride {
        /// The stride seen.
        array_stride: u64,
    },
    /// An attribute that ends beyond the stride.
    #[error("attribute at byte {offset} does not fit {allowed} bytes")]
    AttributeSize {
        /// Where the attribute begins.
        offset: u64,
        /// The stride; the largest one allowed if the stride is 0.
        allowed: u64,
    },
    /// An attribute whose offset is not aligned.
    #[error("attribute at byte {offset}, which is not a multiple of {alignment}")]
    AttributeOffset {
        /// Where the attribute begins.
        offset: u64,
        /// The alignment, bytes: the format's size, at most four.
        alignment: u64,
    },
    /// A shader location beyond the largest.
    #[error("shader location {shader_location}; allowed: 0..{MAX_VERTEX_ATTRIBUTES}")]
    ShaderLocation {
        /// The location seen.
        shader_location: u32,
    },
    /// Two attributes with one shader location.
    #[error("shader location {shader_location} is given twice")]
    ShaderLocationTwice {
        /// The location seen.
        shader_location: u32,
    },
}

/// The slot of the first layout that is refused, and why; `None` if all are accepted.
pub(crate) fn problem(layouts: &[VertexBufferLayout]) -> Option<(usize, VertexBufferProblem)> {
    // Bit = location.
    let mut given = 0u32;
    layouts.iter().enumerate().find_map(|(slot, layout)| Some((slot, layout_problem(layout, &mut given)?)))
}

fn layout_problem(layout: &VertexBufferLayout, given: &mut u32) -> Option<VertexBufferProblem> {
    let array_stride = layout.array_stride;
    if array_stride > MAX_ARRAY_STRIDE || !array_stride.is_multiple_of(VERTEX_ALIGNMENT) {
        return Some(VertexBufferProblem::ArrayStride { array_stride });
    }
    let allowed = if array_stride == 0 { MAX_ARRAY_STRIDE } else { array_stride };
    layout.attributes.iter().find_map(|attribute| {
        let (offset, size, shader_location) = (attribute.offset, attribute.format.size(), attribute.shader_location);
        if offset.saturating_add(size) > allowed {
            return Some(VertexBufferProblem::AttributeSize { offset, allowed });
        }
        let alignment = size.min(VERTEX_ALIGNMENT);
        if !offset.is_multiple_of(alignment) {
            return Some(VertexBufferProblem::AttributeOffset { offset, alignment });
        }
        if shader_location >= MAX_VERTEX_ATTRIBUTES {
            return Some(VertexBufferProblem::ShaderLocation { shader_location });
        }
        let twice = *given >> shader_location & 1 == 1;
        *given |= 1 << shader_location;
        twice.then_some(VertexBufferProblem::ShaderLocationTwice { shader_location })
    })
}
