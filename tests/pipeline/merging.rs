//! Primitives that share a block may be shaded together; what comes out must be what each gives alone.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying};
use nephroid_pipeline::state::{CompareFunction, RasterRules, TextureFormat};
use nephroid_pipeline::{BindingKind, Bindings, Device, Draw, PassOutput, RenderPipeline, RenderPipelineDescriptor};

use super::depth_stencil::depth_state;
use super::passes::*;

const SIZE: (u32, u32) = (150, 90);

/// Everything that differs from primitive to primitive without being one number for all of it.
struct Everything<const JOINS: bool>;

impl<const JOINS: bool> FragmentShader for Everything<JOINS> {
    const MERGES_FRAGMENTS: bool = JOINS;

    #[inline(always)]
    fn fragment<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let c = input.varying3(0);
        let p = input.position;
        let sign = if input.front_facing { 1.0 } else { -1.0 };
        output.color[0] = v4(c.x, c.y * sign, c.z, input.ddx(0));
        output.color[1] = v4(input.ddy(1), p.z, p.w, p.x + p.y * 1024.0);
        output.keep = c.x.gt(c.x.like(0.05));
        output.depth = p.z * 0.5 + c.y * 0.25;
    }
}

#[derive(Clone, Copy, Debug)]
struct Case {
    mode: Interpolation,
    discards: bool,
    writes_depth: bool,
    blends: bool,
    compare: CompareFunction,
}

fn pipeline<const JOINS: bool>(case: Case, rules: RasterRules) -> RenderPipeline {
    let program = Program {
        bindings: vec![BindingKind::Storage(32)],
        varyings: vec![Varying { name: "color", components: 3, interpolation: case.mode }],
        may_discard: case.discards,
        writes_depth: case.writes_depth,
        ..Program::new("everything", Pull { scalars: 3 }, Everything::<JOINS>)
    };
    let target = if case.blends { additive } else { target };
    let desc = RenderPipelineDescriptor {
        depth_stencil: Some(depth_state(TextureFormat::Depth32Float, case.compare, true)),
        targets: vec![target(TextureFormat::Rgba32Float); 2],
        ..RenderPipelineDescriptor::new("everything", Arc::new(program))
    };
    RenderPipeline::new(desc, rules).expect("a valid pipeline")
}

/// A crumpled sheet of triangles of a few pixels, some of them over others, and some large ones.
fn sheet(rng: &mut Rng) -> Vec<Vertex> {
    let (columns, rows) = (60, 40);
    let corner = |rng: &mut Rng, i: usize, j: usize| {
        let at = [(i as f64 / columns as f64) * 170.0 - 10.0, (j as f64 / rows as f64) * 110.0 - 10.0];
        let [x, y, z, w] = clip_from_px(SIZE, at.map(|c| c + rng.real(-2.0, 2.0)), rng.f32(0.1, 0.9));
        // Depths apart, so that perspective matters.
        let far = rng.f32(1.0, 3.0);
        vertex([x * far, y * far, z * far, w * far], [0; 4].map(|_| rng.f32(0.0, 1.0)))
    };
    let corners: Vec<Vertex> = (0..(columns + 1) * (rows + 1)).map(|k| corner(rng, k % (columns + 1), k / (columns + 1))).collect();
    let mut vertices = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let at = |di: usize, dj: usize| corners[(j + dj) * (columns + 1) + i + di];
            vertices.extend([at(0, 0), at(1, 0), at(0, 1), at(1, 0), at(1, 1), at(0, 1)]);
        }
        if j % 10 == 0 {
            let any = |rng: &mut Rng| corners[rng.int(0..corners.len() as i64) as usize];
            vertices.extend([any(rng), any(rng), any(rng)]);
        }
    }
    vertices
}

fn run(device: &Device, pipeline: &RenderPipeline, vertices: &Vertices) -> (Vec<u8>, PassOutput) {
    let entries = vertices.entries();
    let mut canvas = Canvas::new(SIZE, &[Some(TextureFormat::Rgba32Float); 2], Some(TextureFormat::Depth32Float));
    canvas.clear_depth = 0.4;
    let output = canvas.run_on(device, vec![Draw::new(pipeline, Bindings::new(&entries, 0), 0..vertices.count, SIZE)], None);
    (canvas.bytes(), output)
}

#[test]
fn blocks_shaded_for_all_their_primitives_equal_blocks_shaded_for_each() {
    let mut rng = Rng(191);
    let mut shaded = 0;
    for round in 0..sized(48, 16) {
        let case = Case {
            mode: [Interpolation::Perspective, Interpolation::Linear, Interpolation::Flat][round % 3],
            discards: round % 2 == 1,
            writes_depth: round % 4 >= 2,
            blends: round % 8 >= 4,
            compare: [CompareFunction::Less, CompareFunction::Always, CompareFunction::GreaterEqual][rng.int(0..3) as usize],
        };
        let rules = [RasterRules::REFERENCE, RasterRules::LAVAPIPE, RasterRules::SWIFTSHADER][rng.int(0..3) as usize];
        let vertices = Vertices::new(&sheet(&mut rng));
        let apart = run(device(), &pipeline::<false>(case, rules), &vertices);
        let joined = pipeline::<true>(case, rules);
        assert!(run(device(), &joined, &vertices) == apart, "sixteen lanes, round {round}: {case:?}");
        assert!(run(scalar_device(), &joined, &vertices) == apart, "one lane, round {round}: {case:?}");
        shaded += apart.1.statistics.fragment_shader_invocations;
        // Another sheet must not look the same.
        assert!(run(device(), &joined, &Vertices::new(&sheet(&mut rng))).0 != apart.0, "nothing is seen, round {round}: {case:?}");
    }
    println!("joined blocks: {shaded} fragments");
    assert!(shaded > 100_000);
}
