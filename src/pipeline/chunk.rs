//! The geometry phase: one chunk of primitives from index fetch to bins. Chunks are independent and run in parallel.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use nephroid_math::level::{baseline, wide_dispatch};

use super::assemble::Assembly;
use super::bindings::Bindings;
use super::bins::Bins;
use super::emit::Emitter;
use super::fetch::fetch_attributes;
use super::observer::Observer;
use super::pass::Draw;
use super::plan::Part;
use super::render_pipeline::{PrimitiveClass, RenderPipeline};
use super::repeat::most_demanding;
use super::shader::{Execution, GeometryInput, GeometryOutput, PrimitiveAttributes, StageVertex, VertexBatch};
use super::small::Ids;
use super::state::{GeometryTopology, PixelRect};
use super::statistics::PipelineStatistics;
use super::vertices::{ClipVertices, WindowVertices};
use super::viewport::ViewTransform;

/// What the geometry phase needs to know of the pass.
pub(super) struct ChunkContext<'a> {
    pub draws: &'a [Draw<'a>],
    pub assemblies: &'a [Assembly],
    /// By draw: how many of those that follow repeat it.
    pub repetitions: &'a [u32],
    pub execution: Execution,
    pub target: PixelRect,
    pub tiles_x: usize,
    pub tile_count: usize,
}

/// What a part streamed out.
pub(super) struct Streamed {
    pub draw: u32,
    /// Its vertices as floats.
    pub data: Vec<f32>,
    /// If they are points: their sizes.
    pub sizes: Vec<f32>,
}

/// What a chunk hands to the tiles, and its own scratch. Kept between frames, because fresh pages are dear.
#[derive(Default)]
pub(super) struct ChunkOutput {
    pub bins: Bins,
    pub attributes: Vec<PrimitiveAttributes>,
    pub varyings: Vec<f32>,
    pub statistics: PipelineStatistics,
    /// Streamed primitives in order.
    pub stream: Vec<Streamed>,
    /// Records made so far.
    pub sequence: u32,
    scratch: Scratch,
}

impl ChunkOutput {
    /// Bytes that stay until the tiles have run.
    pub fn bytes(&self) -> usize {
        self.bins.bytes() + self.attributes.len() * size_of::<PrimitiveAttributes>() + self.varyings.len() * 4
    }
}

/// Vertices of one part on their way through the stages.
#[derive(Default)]
struct Scratch {
    vertex_index: Vec<u32>,
    primitives: Vec<[u32; 3]>,
    attributes: Vec<f32>,
    clip: ClipVertices,
    varyings: Vec<f32>,
    emitted: ClipVertices,
    emitted_varyings: Vec<f32>,
    emitted_primitives: Vec<[u32; 3]>,
    strips: Vec<u32>,
    emitted_from: Vec<u32>,
    window: WindowVertices,
    /// Index to vertex of the part: direct-mapped.
    cache: Vec<CacheEntry>,
    /// Number of the part that cache entries must have been made for.
    cache_part: u32,
}

#[derive(Clone, Copy, Default)]
struct CacheEntry {
    index: u32,
    slot: u32,
    part: u32,
}

/// Entries of the vertex cache. Two indices that collide are shaded twice; the result is the same.
const CACHE: usize = 4096;

/// Runs a chunk.
pub(super) fn process_chunk(context: &ChunkContext<'_>, parts: &[Part], out: &mut ChunkOutput, mut observer: Option<&mut dyn Observer>) {
    out.bins.reset(context.tiles_x, context.tile_count);
    out.attributes.clear();
    out.varyings.clear();
    out.stream.clear();
    out.statistics = PipelineStatistics::default();
    out.sequence = 0;
    let mut scratch = std::mem::take(&mut out.scratch);
    wide_dispatch!(
        context.execution.level,
        simd => process_parts(simd, context, parts, out, &mut scratch, &mut observer),
        process_parts(baseline(), context, parts, out, &mut scratch, &mut observer)
    );
    out.scratch = scratch;
}

#[simd]
fn process_parts<S: Simd>(
    simd: S,
    context: &ChunkContext<'_>,
    parts: &[Part],
    out: &mut ChunkOutput,
    scratch: &mut Scratch,
    observer: &mut Option<&mut dyn Observer>,
) {
    for part in parts {
        process_part(simd, context, part, out, scratch, observer);
    }
}

#[inline(always)]
fn process_part<S: Simd>(
    simd: S,
    context: &ChunkContext<'_>,
    part: &Part,
    out: &mut ChunkOutput,
    scratch: &mut Scratch,
    observer: &mut Option<&mut dyn Observer>,
) {
    let draw = &context.draws[part.draw as usize];
    let repetitions = context.repetitions[part.draw as usize];
    let pipeline = most_demanding(&context.draws[part.draw as usize..][..1 + repetitions as usize]);
    let assembly = &context.assemblies[part.draw as usize];
    let earlier = std::mem::take(&mut out.statistics);
    gather_vertices(draw, assembly, part, scratch);
    shade_vertices(context, draw, part, scratch, &mut out.statistics);
    if let Some(observer) = observer.as_deref_mut() {
        let s = &*scratch;
        observer.vertices(part.draw, part.instance, &s.vertex_index, &s.clip.positions_from(0), &s.varyings, pipeline.vertex_scalars);
    }
    if pipeline.desc.program.geometry.is_some() {
        run_geometry_stage(draw, part, scratch, &mut out.statistics, observer);
    }
    if draw.stream_out.is_some() {
        stream_out(pipeline, part.draw, scratch, out);
    }
    if !pipeline.desc.rasterizer_discard {
        rasterize(simd, context, part, pipeline, out, scratch, observer);
    }
    // Repetitions count as if they had run.
    let own = std::mem::replace(&mut out.statistics, earlier);
    (0..=repetitions).for_each(|_| out.statistics.add(&own));
}

/// From shaded vertices to records.
#[inline(always)]
fn rasterize<S: Simd>(
    simd: S,
    context: &ChunkContext<'_>,
    part: &Part,
    pipeline: &RenderPipeline,
    out: &mut ChunkOutput,
    scratch: &mut Scratch,
    observer: &mut Option<&mut dyn Observer>,
) {
    let draw = &context.draws[part.draw as usize];
    let view = ViewTransform::new(&draw.viewport, pipeline.rules, pipeline.desc.primitive.unclipped_depth);
    scratch.window.transform(simd, &view, &scratch.clip);
    let varying_base = out.varyings.len() as u32;
    if pipeline.fragment.attributes {
        out.varyings.extend_from_slice(&scratch.varyings);
    }
    let mut emitter = Emitter {
        draw: part.draw,
        instance: part.instance,
        pipeline,
        view,
        scissor: draw.scissor.intersect(context.target).intersect(view.pixels()),
        varying_base,
        clip: &scratch.clip,
        window: &scratch.window,
        out,
        observer: observer.as_deref_mut().map(|o| o as &mut dyn Observer),
    };
    let has_ids = pipeline.desc.program.geometry.is_some();
    let ids = if has_ids { Ids::Listed(&scratch.emitted_from) } else { Ids::From(part.first) };
    match pipeline.rasterized {
        PrimitiveClass::Triangles => emitter.triangles(simd, &scratch.primitives, ids),
        PrimitiveClass::Lines => scratch.primitives.iter().enumerate().for_each(|(i, p)| emitter.line([p[0], p[1]], ids.get(i))),
        PrimitiveClass::Points => emitter.points(simd, &scratch.primitives, ids),
    }
}

/// Lists the vertices that the part's primitives use, each once, and the primitives in terms of that list.
fn gather_vertices(draw: &Draw<'_>, assembly: &Assembly, part: &Part, scratch: &mut Scratch) {
    scratch.vertex_index.clear();
    scratch.primitives.clear();
    let first_element = draw.elements.start;
    let ids = part.first..part.first + part.count;
    match (&draw.index, assembly) {
        (None, Assembly::Regular { topology, .. }) => {
            // Elements are consecutive: no cache needed.
            let start = assembly.elements(part.first)[0];
            let last = assembly.elements(part.first + part.count - 1);
            let per_primitive = super::assemble::vertices_per_primitive(*topology);
            let end = last[..per_primitive].iter().max().map_or(start, |e| e + 1);
            scratch.vertex_index.extend((start..end).map(|e| first_element + e));
            scratch.primitives.extend(ids.map(|id| assembly.elements(id).map(|e| e.wrapping_sub(start))));
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
            let per_primitive = super::assemble::vertices_per_primitive(draw.pipeline.desc.primitive.topology);
            for id in ids {
                let elements = assembly.elements(id);
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

fn shade_vertices(context: &ChunkContext<'_>, draw: &Draw<'_>, part: &Part, scratch: &mut Scratch, statistics: &mut PipelineStatistics) {
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

/// Replaces the part's vertices and primitives by what the geometry shader makes of them.
fn run_geometry_stage(
    draw: &Draw<'_>,
    part: &Part,
    scratch: &mut Scratch,
    statistics: &mut PipelineStatistics,
    observer: &mut Option<&mut dyn Observer>,
) {
    let pipeline = draw.pipeline;
    let Some(geometry) = &pipeline.desc.program.geometry else { return };
    let per_primitive = super::assemble::vertices_per_primitive(pipeline.desc.primitive.topology);
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

/// Appends the part's primitives, vertex by vertex.
fn stream_out(pipeline: &RenderPipeline, draw: u32, scratch: &Scratch, out: &mut ChunkOutput) {
    let scalars = pipeline.interpolation.len();
    let corners = pipeline.rasterized.corners();
    let mut data = Vec::with_capacity(scratch.primitives.len() * corners * pipeline.stream_floats());
    for primitive in &scratch.primitives {
        for &vertex in &primitive[..corners] {
            let v = vertex as usize;
            data.extend_from_slice(&scratch.clip.get(v));
            data.extend_from_slice(&scratch.varyings[v * scalars..(v + 1) * scalars]);
        }
    }
    let sizes = match pipeline.rasterized {
        PrimitiveClass::Points => scratch.primitives.iter().map(|p| scratch.clip.point_size(p[0] as usize)).collect(),
        _ => Vec::new(),
    };
    out.stream.push(Streamed { draw, data, sizes });
}
