//! The geometry phase: one chunk of primitives from index fetch to bins. Chunks are independent and run in parallel.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use nephroid_math::level::{baseline, wide_dispatch};

use crate::api::observer::Observer;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::resolved::PrimitiveClass;
use crate::api::statistics::PipelineStatistics;
use crate::geometry::chunk_output::{ChunkContext, ChunkOutput, Scratch};
use crate::geometry::emitter::Emitter;
use crate::geometry::geometry_stage::run_geometry_stage;
use crate::geometry::plan::Part;
use crate::geometry::repeat::most_demanding;
use crate::geometry::small::Ids;
use crate::geometry::stream_out::stream_out;
use crate::geometry::vertex_stage::{gather_vertices, shade_vertices};
use crate::geometry::viewport::ViewTransform;

/// Runs the geometry phase of a chunk.
pub(crate) fn process_chunk(context: &ChunkContext<'_>, parts: &[Part], out: &mut ChunkOutput, mut observer: Option<&mut dyn Observer>) {
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
    // Each repetition counts as if the stages had run for it.
    let own = std::mem::replace(&mut out.statistics, earlier);
    (0..=repetitions).for_each(|_| out.statistics.add(&own));
}

/// The stages from shaded vertices to binned tile primitives.
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
