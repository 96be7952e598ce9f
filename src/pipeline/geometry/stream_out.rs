//! Stream-out: writes the primitives of a part, vertex by vertex.

use crate::api::format::nan::one_nan;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::resolved::PrimitiveClass;
use crate::api::shader::varying::Interpolation;
use crate::geometry::chunk_output::{ChunkOutput, Scratch, Streamed};

/// Appends the part's primitives, vertex by vertex.
pub(crate) fn stream_out(pipeline: &RenderPipeline, draw: u32, scratch: &Scratch, out: &mut ChunkOutput) {
    let scalars = pipeline.interpolation.len();
    let corners = pipeline.rasterized.corners();
    let mut data = Vec::with_capacity(scratch.primitives.len() * corners * pipeline.stream_floats());
    for primitive in &scratch.primitives {
        for &vertex in &primitive[..corners] {
            let v = vertex as usize;
            data.extend(scratch.clip.get(v).map(one_nan));
            let varyings = &scratch.varyings[v * scalars..(v + 1) * scalars];
            // The bits of a flat varying may be those of an integer, so its NaNs are kept.
            let stored = |(&value, mode)| if mode == &Interpolation::Flat { value } else { one_nan(value) };
            data.extend(varyings.iter().zip(&pipeline.interpolation).map(stored));
        }
    }
    let sizes = match pipeline.rasterized {
        PrimitiveClass::Points => scratch.primitives.iter().map(|p| scratch.clip.point_size(p[0] as usize)).collect(),
        _ => Vec::new(),
    };
    out.stream.push(Streamed { draw, data, sizes });
}
