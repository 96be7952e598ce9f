//! Draws that repeat the one before under other state are set up once; bytes and counters must be those of draws on their own.
//!
//! An observer keeps the pipeline from it: it sees every draw go through all stages.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::{
    ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, PixelRect, RasterRules, StencilFaceState,
    StencilOperation, StencilState, TextureFormat,
};
use nephroid_pipeline::{BindingKind, Bindings, Device, Draw, Observer, PassOutput, RenderPipeline, RenderPipelineDescriptor};

use super::passes::*;

const SIZE: (u32, u32) = (150, 90);

/// The interpolated colour.
struct Smooth;

impl FragmentShader for Smooth {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let c = input.varying3(0);
        output.color[0] = v4(c.x, c.y, c.z, input.position.z);
    }
}

fn program() -> Arc<Program> {
    let color = nephroid_pipeline::shader::Varying { name: "color", components: 3, interpolation: Interpolation::Perspective };
    Arc::new(Program {
        bindings: vec![BindingKind::Storage(32)],
        varyings: vec![color],
        ..Program::new("smooth", Pull { scalars: 3 }, Smooth)
    })
}

fn random_face(rng: &mut Rng) -> StencilFaceState {
    use CompareFunction::*;
    use StencilOperation::*;
    let operations = [Keep, Keep, IncrementWrap, DecrementWrap, Replace, Invert, Zero];
    let mut operation = || operations[rng.int(0..7) as usize];
    let (fail_op, depth_fail_op, pass_op) = (operation(), operation(), operation());
    StencilFaceState { compare: [Always, Equal, NotEqual, Less][rng.int(0..4) as usize], fail_op, depth_fail_op, pass_op }
}

/// Pipelines of one program that differ in what they test and write.
fn pipelines(rng: &mut Rng, rules: RasterRules) -> Vec<RenderPipeline> {
    let shared = program();
    let random = |rng: &mut Rng| {
        let (front, back) = (random_face(rng), random_face(rng));
        let counts = StencilState { front, back, read_mask: 0xff, write_mask: 0xff };
        let depth = DepthStencilState {
            format: TextureFormat::Depth32FloatStencil8,
            depth_write_enabled: Some(rng.int(0..4) == 0),
            depth_compare: Some([CompareFunction::Always, CompareFunction::Less, CompareFunction::GreaterEqual][rng.int(0..3) as usize]),
            stencil: if rng.int(0..4) == 0 { StencilState::default() } else { counts },
            bias: DepthBiasState::default(),
        };
        let write_mask = if rng.int(0..2) == 0 { ColorWrites::empty() } else { ColorWrites::ALL };
        let color = additive(TextureFormat::Rgba32Float).map(|state| ColorTargetState { write_mask, ..state });
        let desc = RenderPipelineDescriptor {
            depth_stencil: Some(depth),
            targets: vec![color],
            ..RenderPipelineDescriptor::new("random", shared.clone())
        };
        RenderPipeline::new(desc, rules).expect("a valid pipeline")
    };
    (0..6).map(|_| random(rng)).collect()
}

/// Small bunches of triangles, some large, some clipped.
fn bunches(rng: &mut Rng, count: usize) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let reach = [3.0, 12.0, 40.0, 300.0][rng.int(0..4) as usize];
        let centre = [rng.real(0.0, f64::from(SIZE.0)), rng.real(0.0, f64::from(SIZE.1))];
        for _ in 0..3 {
            let p = centre.map(|c| c + rng.real(-reach, reach));
            let color = [0; 4].map(|_| rng.f32(0.0, 1.0));
            vertices.push(vertex(clip_from_px(SIZE, p, rng.f32(-0.1, 1.1)), color));
        }
    }
    vertices
}

/// Sees nothing.
struct Blind;

impl Observer for Blind {}

fn run(device: &Device, draws: &[Draw<'_>], observer: Option<&mut dyn Observer>) -> (Vec<u8>, PassOutput) {
    let mut canvas = Canvas::new(SIZE, &[Some(TextureFormat::Rgba32Float)], Some(TextureFormat::Depth32FloatStencil8));
    (canvas.clear_depth, canvas.clear_stencil, canvas.queries) = (0.6, 3, 2);
    let output = canvas.run_on(device, draws.to_vec(), observer);
    (canvas.bytes(), PassOutput { waves: 0, ..output })
}

#[test]
fn repeated_draws_leave_the_bytes_and_counters_of_draws_on_their_own() {
    let mut rng = Rng(181);
    let (mut repeated, mut passed) = (0, 0);
    for round in 0..sized(60, 12) {
        let rules = [RasterRules::REFERENCE, RasterRules::LAVAPIPE, RasterRules::SWIFTSHADER][round % 3];
        let pipelines = pipelines(&mut rng, rules);
        let vertices = Vertices::new(&bunches(&mut rng, 600));
        let entries = vertices.entries();
        let mut draws: Vec<Draw<'_>> = Vec::new();
        for bunch in 0..60 {
            let elements = bunch * 30..bunch * 30 + 30;
            for _ in 0..1 + rng.int(0..3) {
                let cut = PixelRect { x0: 20, y0: 10, x1: 130, y1: 80 };
                let plain = Draw::new(&pipelines[rng.int(0..6) as usize], Bindings::new(&entries, 0), elements.clone(), SIZE);
                let draw = Draw {
                    stencil_reference: rng.int(0..6) as u32,
                    query: [None, None, None, Some(0), Some(1)][rng.int(0..5) as usize],
                    // Sometimes not a repetition after all.
                    scissor: if rng.int(0..5) == 0 { cut } else { plain.scissor },
                    ..plain
                };
                repeated += usize::from(draws.last().is_some_and(|last| last.vertices == draw.vertices && last.scissor == draw.scissor));
                draws.push(draw);
            }
        }
        let alone = run(device(), &draws, Some(&mut Blind));
        passed += alone.1.statistics.fragments_passed;
        for other in [device(), scalar_device()] {
            assert!(run(other, &draws, None) == alone, "round {round}");
        }
        // The check must see a draw that is left out, or one that comes at the wrong place.
        if round < 3 {
            assert!(run(device(), &draws[..draws.len() / 2], None).0 != alone.0, "half of the draws left out");
        }
    }
    println!("repetitions: {repeated} draws, {passed} fragments");
    assert!(repeated > 100 && passed > 10_000, "{repeated} draws, {passed} fragments");
}
