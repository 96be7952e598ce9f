//! Index fetch, vertex reuse and the vertex stage of a part.

use crate::api::draw::Draw;
use crate::api::shader::stages::VertexBatch;
use crate::api::statistics::PipelineStatistics;
use crate::geometry::assemble::{Assembly, vertices_per_primitive};
use crate::geometry::chunk_output::{CacheEntry, ChunkContext, Scratch};
use crate::geometry::fetch::fetch_attributes;
use crate::geometry::plan::Part;

/// Entries of the vertex cache. Vertices whose indices collide are shaded again, with the same result.
const CACHE: usize = 4096;

/// Lists each vertex of the part's primitives once, and the primitives as indices into that list.
pub(crate) fn gather_vertices(draw: &Draw<'_>, assembly: &Assembly, part: &Part, scratch: &mut Scratch) {
    scratch.vertex_index.clear();
    scratch.primitives.clear();
    let first_element = draw.vertices.start;
    let ids = part.first..part.first + part.count;
    match (&draw.index, assembly) {
        (None, Assembly::Regular { topology, .. }) => {
            // Indices are consecutive: no cache is needed.
            let start = assembly.places(part.first)[0];
            let last = assembly.places(part.first + part.count - 1);
            let per_primitive = vertices_per_primitive(*topology);
            let end = last[..per_primitive].iter().max().map_or(start, |e| e + 1);
            scratch.vertex_index.extend((start..end).map(|e| first_element + e));
            scratch.primitives.extend(ids.map(|id| assembly.places(id).map(|e| e.wrapping_sub(start))));
            if per_primitive == 2 {
                scratch.primitives.iter_mut().for_each(|p| p[2] = p[1]);
            }
        }
        _ => {
            scratch.cache.resize(CACHE, CacheEntry::default());
            scratch.cache_part = scratch.cache_part.wrapping_add(1);
            if scratch.cache_part == 0 {
                scratch.cache.fill(CacheEntry::default());
                scratch.cache_part = 1;
            }
            let per_primitive = vertices_per_primitive(draw.pipeline.desc.primitive.topology);
            for id in ids {
                let elements = assembly.places(id);
                let mut primitive = [0; 3];
                for corner in 0..per_primitive {
                    let element = first_element + elements[corner];
                    let vertex = match &draw.index {
                        Some(index) => index.get(element as usize).wrapping_add_signed(draw.base_vertex),
                        None => element,
                    };
                    let entry = &mut scratch.cache[vertex as usize % CACHE];
                    if entry.part != scratch.cache_part || entry.index != vertex {
                        *entry = CacheEntry { index: vertex, slot: scratch.vertex_index.len() as u32, part: scratch.cache_part };
                        scratch.vertex_index.push(vertex);
                    }
                    primitive[corner] = entry.slot;
                }
                for corner in per_primitive..3 {
                    primitive[corner] = primitive[per_primitive - 1];
                }
                scratch.primitives.push(primitive);
            }
        }
    }
}

pub(crate) fn shade_vertices(
    context: &ChunkContext<'_>,
    draw: &Draw<'_>,
    part: &Part,
    scratch: &mut Scratch,
    statistics: &mut PipelineStatistics,
) {
    let pipeline = draw.pipeline;
    let count = scratch.vertex_index.len();
    fetch_attributes(
        &pipeline.desc.vertex_buffers,
        draw.vertex_buffers,
        pipeline.locations,
        &scratch.vertex_index,
        part.instance,
        &mut scratch.attributes,
    );
    scratch.clip.resize(count);
    scratch.varyings.resize(count * pipeline.vertex_scalars, 0.0);
    let mut batch = VertexBatch {
        vertex_index: &scratch.vertex_index,
        instance_index: part.instance,
        attributes: &scratch.attributes,
        locations: pipeline.locations,
        scalars: pipeline.vertex_scalars,
        vertices: &mut scratch.clip,
        varyings: &mut scratch.varyings,
    };
    pipeline.desc.program.vertex.run(context.execution, &draw.bindings, &mut batch);
    statistics.vertex_shader_invocations += count as u64;
}
