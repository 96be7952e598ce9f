//! Repeated draws: draws with the primitives of the draw before them, under other state. They are set up once and rasterized for each draw.
//!
//! Stencil volumes come in such pairs, a hundred thousand of them in a pass: one draw that counts, and one that shades where the count is not zero.
//! Every tile keeps the tile primitives of a repeated draw until the next draw begins, and walks them again for each repetition.

use std::sync::Arc;

use crate::api::bindings::Bindings;
use crate::api::draw::Draw;
use crate::api::render_pipeline::RenderPipeline;

/// Most primitives of a draw that can be repeated: they must fit into one chunk.
pub(crate) const MOST_PRIMITIVES: u64 = 256;

/// Whether two draws have the same tile primitives and differ only in what is done with their fragments.
pub(crate) fn repeats(a: &Draw<'_>, b: &Draw<'_>) -> bool {
    same_draw(a, b) && (std::ptr::eq(a.pipeline, b.pipeline) || same_setup(a.pipeline, b.pipeline))
}

fn same_draw(a: &Draw<'_>, b: &Draw<'_>) -> bool {
    let index = match (&a.index, &b.index) {
        (Some(a), Some(b)) => std::ptr::eq(a.buffer, b.buffer) && a.format == b.format && a.offset == b.offset,
        (None, None) => true,
        _ => false,
    };
    let mut buffers = a.vertex_buffers.iter().zip(b.vertex_buffers);
    a.vertices == b.vertices
        && index
        && a.base_vertex == b.base_vertex
        && a.instances == b.instances
        && a.instances.len() == 1
        && Bindings::are_same(&a.bindings, &b.bindings)
        && a.vertex_buffers.len() == b.vertex_buffers.len()
        && buffers.all(|(a, b)| std::ptr::eq(a.buffer, b.buffer) && a.offset == b.offset)
        && a.viewport == b.viewport
        && a.scissor == b.scissor
        && a.stream_out.is_none()
        && b.stream_out.is_none()
}

/// Whether two pipelines make the same tile primitives from the same vertices, as far as both need them.
fn same_setup(a: &RenderPipeline, b: &RenderPipeline) -> bool {
    let depth = |p: &RenderPipeline| p.desc.depth_stencil.as_ref().map(|d| (d.format, d.bias));
    Arc::ptr_eq(&a.desc.program, &b.desc.program)
        && a.desc.primitive == b.desc.primitive
        && a.desc.vertex_buffers == b.desc.vertex_buffers
        && !a.desc.rasterizer_discard
        && !b.desc.rasterizer_discard
        && depth(a) == depth(b)
        && a.rules == b.rules
}

/// By draw: how many of the following draws repeat it. A repetition has 0.
pub(crate) fn repetitions(draws: &[Draw<'_>], primitives: impl Fn(usize) -> u64) -> Vec<u32> {
    let mut counts = vec![0; draws.len()];
    let mut first = 0;
    for next in 1..draws.len() {
        if primitives(first) <= MOST_PRIMITIVES && repeats(&draws[first], &draws[next]) {
            counts[first] += 1;
        } else {
            first = next;
        }
    }
    counts
}

/// The pipeline, among those of a draw and its repetitions, whose tile primitives serve all of them.
pub(crate) fn most_demanding<'a>(draws: &'a [Draw<'a>]) -> &'a RenderPipeline {
    let demand = |p: &&RenderPipeline| (p.fragment.attributes, p.depth.tests_depth());
    draws[1..].iter().map(|draw| draw.pipeline).fold(draws[0].pipeline, |most, p| if demand(&p) > demand(&most) { p } else { most })
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::api::pipeline_descriptor::RenderPipelineDescriptor;
    use crate::api::shader::{FragmentInput, FragmentOutput, FragmentShader, Program, VertexInput, VertexOutput, VertexShader};
    use crate::state::{
        CompareFunction, DepthBiasState, DepthStencilState, Face, PrimitiveState, RasterRules, StencilState, TextureFormat, Viewport,
    };
    use nephroid_math::lanes::Lanes;

    struct Nowhere;

    impl VertexShader for Nowhere {
        fn vertex<L: Lanes>(&self, _bindings: &Bindings<'_>, _input: &VertexInput<'_, L>, _output: &mut VertexOutput<L>) {}
    }

    impl FragmentShader for Nowhere {
        fn fragment<L: Lanes>(&self, _bindings: &Bindings<'_>, _input: &FragmentInput<'_, L>, _output: &mut FragmentOutput<L>) {}
    }

    fn program() -> Arc<Program> {
        Arc::new(Program::new("nowhere", Nowhere, Nowhere))
    }

    fn pipeline(program: &Arc<Program>, compare: CompareFunction, cull_mode: Option<Face>) -> RenderPipeline {
        let depth = DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(false),
            depth_compare: Some(compare),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        };
        let desc = RenderPipelineDescriptor {
            depth_stencil: Some(depth),
            primitive: PrimitiveState { cull_mode, ..PrimitiveState::default() },
            ..RenderPipelineDescriptor::new("test", program.clone())
        };
        RenderPipeline::new(desc, RasterRules::REFERENCE).expect("a valid pipeline")
    }

    fn draw(pipeline: &RenderPipeline, vertices: Range<u32>) -> Draw<'_> {
        Draw::new(pipeline, Bindings::new(&[], 0), vertices, (64, 64))
    }

    fn counts(draws: &[Draw<'_>]) -> Vec<u32> {
        repetitions(draws, |draw| u64::from(draws[draw].vertices.end - draws[draw].vertices.start) / 3)
    }

    #[test]
    fn draws_that_differ_in_tests_or_constants_alone_repeat_the_first() {
        let shared = program();
        let [less, greater] = [CompareFunction::Less, CompareFunction::Greater].map(|compare| pipeline(&shared, compare, None));
        let other = Draw { stencil_reference: 7, blend_constant: [1.0; 4], query: Some(0), ..draw(&greater, 0..6) };
        assert_eq!(counts(&[draw(&less, 0..6), other.clone(), draw(&less, 0..6), draw(&less, 6..12), other]), [2, 0, 0, 0, 0]);
        assert_eq!(counts(&[]), [0; 0]);
    }

    #[test]
    fn draws_with_primitives_of_their_own_repeat_nothing() {
        let shared = program();
        let plain = pipeline(&shared, CompareFunction::Less, None);
        let first = || draw(&plain, 0..6);
        let (culled, foreign) =
            (pipeline(&shared, CompareFunction::Less, Some(Face::Back)), pipeline(&program(), CompareFunction::Less, None));
        let others = [
            Draw { pipeline: &culled, ..first() },
            Draw { pipeline: &foreign, ..first() },
            Draw { bindings: Bindings::new(&[], 256), ..first() },
            Draw { vertices: 0..3, ..first() },
            Draw { base_vertex: 1, ..first() },
            Draw { instances: 1..2, ..first() },
            Draw { viewport: Viewport::full(32, 64), ..first() },
            Draw { scissor: crate::state::PixelRect::full(32, 64), ..first() },
            Draw { stream_out: Some(0), ..first() },
        ];
        for other in others {
            assert_eq!(counts(&[first(), other.clone()]), [0, 0], "{other:?}");
        }
        let instanced = || Draw { instances: 0..2, ..first() };
        assert_eq!(counts(&[instanced(), instanced()]), [0, 0], "two instances do not stay together");
        let large = MOST_PRIMITIVES as u32 * 3 + 3;
        assert_eq!(counts(&[draw(&plain, 0..large), draw(&plain, 0..large)]), [0, 0], "too large for one chunk");
    }
}
