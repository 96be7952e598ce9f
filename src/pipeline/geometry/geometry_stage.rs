//! The geometry stage: runs the geometry shader on the primitives of a part.

use crate::api::bindings::Bindings;
use crate::api::draw::Draw;
use crate::api::observer::Observer;
use crate::api::shader::geometry::{GeometryInput, GeometryOutput, StageVertex};
use crate::api::state::GeometryTopology;
use crate::api::statistics::PipelineStatistics;
use crate::geometry::assemble::vertices_per_primitive;
use crate::geometry::chunk_output::Scratch;
use crate::geometry::plan::Part;

/// Replaces the part's vertices and primitives by those that the geometry shader emits.
pub(crate) fn run_geometry_stage(
    draw: &Draw<'_>,
    part: &Part,
    scratch: &mut Scratch,
    statistics: &mut PipelineStatistics,
    observer: &mut Option<&mut dyn Observer>,
) {
    let pipeline = draw.pipeline;
    let Some(geometry) = &pipeline.desc.program.geometry else { return };
    let per_primitive = vertices_per_primitive(pipeline.desc.primitive.topology);
    let bindings: &Bindings<'_> = &draw.bindings;
    scratch.emitted.clear();
    scratch.emitted_varyings.clear();
    scratch.emitted_from.clear();
    let mut outputs = std::mem::take(&mut scratch.emitted_primitives);
    outputs.clear();
    for (i, primitive) in scratch.primitives.iter().enumerate() {
        let vertices = primitive.map(|v| {
            let v = v as usize;
            StageVertex {
                position: scratch.clip.get(v),
                point_size: scratch.clip.point_size(v),
                varyings: &scratch.varyings[v * pipeline.vertex_scalars..(v + 1) * pipeline.vertex_scalars],
            }
        });
        let primitive_id = part.first + i as u32;
        let input = GeometryInput { vertices: &vertices[..per_primitive], primitive_id, instance_index: part.instance };
        scratch.strips.clear();
        let first = scratch.emitted.len();
        let mut output = GeometryOutput {
            vertices: &mut scratch.emitted,
            varyings: &mut scratch.emitted_varyings,
            strips: &mut scratch.strips,
            strip_start: first,
            scalars: pipeline.interpolation.len(),
            budget: geometry.max_vertices,
        };
        geometry.shader.geometry(bindings, &input, &mut output);
        output.end_primitive();
        let mut start = first as u32;
        for &length in &scratch.strips {
            match geometry.output {
                GeometryTopology::Points => outputs.extend((start..start + length).map(|v| [v; 3])),
                GeometryTopology::LineStrip => outputs.extend((1..length).map(|k| [start + k - 1, start + k, start + k])),
                GeometryTopology::TriangleStrip => outputs.extend((2..length).map(|k| {
                    let v = start + k - 2;
                    if k & 1 == 0 { [v, v + 1, v + 2] } else { [v, v + 2, v + 1] }
                })),
            }
            start += length;
        }
        scratch.emitted_from.resize(outputs.len(), primitive_id);
        if let Some(observer) = observer.as_deref_mut() {
            observer.geometry(part.draw, primitive_id, &scratch.emitted.positions_from(first), &scratch.strips);
        }
    }
    statistics.geometry_shader_invocations += scratch.primitives.len() as u64;
    statistics.geometry_shader_primitives += outputs.len() as u64;
    scratch.emitted_primitives = std::mem::replace(&mut scratch.primitives, outputs);
    std::mem::swap(&mut scratch.clip, &mut scratch.emitted);
    std::mem::swap(&mut scratch.varyings, &mut scratch.emitted_varyings);
}
