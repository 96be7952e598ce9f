//! Shortcuts against the general path, and the observer's story against the attachments.
//!
//! An occlusion query or an observer forces the general path; bytes and counters must not change.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::{
    CompareFunction, DepthBiasState, DepthStencilState, Face, FrontFace, PixelRect, PrimitiveState, PrimitiveTopology, StencilFaceState,
    StencilOperation, StencilState, TextureFormat,
};
use nephroid_pipeline::{
    Bindings, Device, Draw, FragmentEvent, FragmentOutcome, Observer, PassOutput, PrimitiveEvent, PrimitiveOutcome, RenderPipeline,
};

use super::depth_stencil::depth_state;
use super::passes::*;
use super::sprites::SizedPull;

const SIZE: (u32, u32) = (150, 90);

/// Triangles of all sizes with depth, some behind each other, some clipped.
fn triangles(rng: &mut Rng, count: usize) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let reach = [1.5, 6.0, 20.0, 70.0, 400.0][rng.int(0..5) as usize];
        let centre = [rng.real(0.0, f64::from(SIZE.0)), rng.real(0.0, f64::from(SIZE.1))];
        let color = [0; 4].map(|_| rng.f32(-1.0, 1.0));
        let z = rng.f32(-0.05, 1.0);
        for _ in 0..3 {
            let p = centre.map(|c| c + rng.real(-reach, reach));
            vertices.push(vertex(clip_from_px(SIZE, p, z + rng.f32(-0.1, 0.1)), color));
        }
    }
    vertices
}

/// How a pass is run.
#[derive(Clone, Copy, PartialEq)]
enum Force {
    Nothing,
    Query,
}

fn run(
    device: &Device,
    pipelines: &[&RenderPipeline],
    format: Option<TextureFormat>,
    depth: Option<TextureFormat>,
    vertices: &[Vertex],
    force: Force,
    observer: Option<&mut dyn Observer>,
) -> (Vec<u8>, PassOutput, Canvas) {
    let vertices = Vertices::new(vertices);
    let entries = vertices.entries();
    let formats = [format];
    let mut canvas = Canvas::new(SIZE, if format.is_some() { &formats } else { &[] }, depth);
    canvas.clear_depth = 0.7;
    canvas.clear_stencil = 3;
    canvas.queries = 1;
    let share = vertices.count / 3 / pipelines.len() as u32 * 3;
    let draws = pipelines.iter().enumerate().map(|(i, pipeline)| {
        let elements = i as u32 * share..(i as u32 + 1) * share;
        Draw {
            query: (force == Force::Query).then_some(0),
            stencil_reference: 9,
            ..Draw::new(pipeline, Bindings::new(&entries, 0), elements, SIZE)
        }
    });
    let output = canvas.run_on(device, draws.collect(), observer);
    (canvas.bytes(), output, canvas)
}

/// Every state that has a shortcut, and neighbours that have none.
fn states() -> Vec<(String, RenderPipeline, Option<TextureFormat>, Option<TextureFormat>)> {
    let mut list = Vec::new();
    let depth32 = TextureFormat::Depth32Float;
    let compares = [
        None,
        Some((CompareFunction::Less, false)),
        Some((CompareFunction::Less, true)),
        Some((CompareFunction::LessEqual, false)),
        Some((CompareFunction::LessEqual, true)),
        Some((CompareFunction::Greater, true)),
        Some((CompareFunction::Always, true)),
        Some((CompareFunction::Always, false)),
    ];
    for format in [TextureFormat::R32Float, TextureFormat::Rg32Float, TextureFormat::Rgba32Float, TextureFormat::R16Float] {
        for compare in compares {
            for varyings in [false, true] {
                let program = if varyings { pull_program(FlatColor, Interpolation::Flat) } else { plain_program(Ones) };
                let pipeline = pipeline(program, |desc| {
                    desc.targets = vec![additive(format)];
                    desc.depth_stencil = compare.map(|(compare, write)| depth_state(depth32, compare, write));
                });
                let name = format!("add to {format:?}, depth {compare:?}, varyings: {varyings}");
                list.push((name, pipeline, Some(format), compare.map(|_| depth32)));
            }
        }
    }
    let operations = [
        StencilOperation::IncrementWrap,
        StencilOperation::DecrementWrap,
        StencilOperation::IncrementClamp,
        StencilOperation::Invert,
        StencilOperation::Replace,
        StencilOperation::Zero,
        StencilOperation::Keep,
    ];
    for compare in [CompareFunction::Always, CompareFunction::Less, CompareFunction::LessEqual, CompareFunction::GreaterEqual] {
        for (i, front) in operations.into_iter().enumerate() {
            let format = TextureFormat::Depth32FloatStencil8;
            let face = |i: usize| StencilFaceState {
                compare: CompareFunction::Always,
                fail_op: StencilOperation::Zero,
                depth_fail_op: operations[(i + 3) % 7],
                pass_op: operations[i % 7],
            };
            let stencil =
                StencilState { front: face(i), back: face(i + 1), read_mask: 0xff, write_mask: if i % 2 == 0 { 0xff } else { 0x3c } };
            let state = DepthStencilState { stencil, ..depth_state(format, compare, false) };
            let pipeline = pipeline(depth_only_program(), |desc| desc.depth_stencil = Some(state));
            list.push((format!("stencil {front:?}, depth {compare:?}"), pipeline, None, Some(format)));
        }
    }
    for format in [TextureFormat::Depth32Float, TextureFormat::Depth16Unorm, TextureFormat::Depth32FloatStencil8] {
        for compare in [CompareFunction::Less, CompareFunction::LessEqual, CompareFunction::Greater] {
            for cull_mode in [None, Some(Face::Back)] {
                let pipeline = pipeline(depth_only_program(), |desc| {
                    desc.depth_stencil = Some(depth_state(format, compare, true));
                    desc.primitive = PrimitiveState { cull_mode, ..PrimitiveState::default() };
                });
                list.push((format!("depth only {format:?} {compare:?}"), pipeline, None, Some(format)));
            }
        }
    }
    list
}

#[test]
fn shortcuts_equal_the_general_path() {
    struct Nothing;
    impl Observer for Nothing {}
    let mut rng = Rng(1001);
    let (mut count, mut total) = (0, 0);
    for (name, pipeline, format, depth) in states() {
        for round in 0..sized(40, 2) {
            let vertices = triangles(&mut rng, sized(250, 120));
            let (fast, fast_output, _) = run(device(), &[&pipeline], format, depth, &vertices, Force::Nothing, None);
            let (general, general_output, _) = run(device(), &[&pipeline], format, depth, &vertices, Force::Query, None);
            assert!(fast == general, "{name}: bytes differ between shortcut and query, round {round}");
            assert_eq!(fast_output.statistics, general_output.statistics, "{name}");
            assert_eq!(general_output.queries, [general_output.statistics.fragments_passed], "{name}");
            if round % 8 == 0 {
                let (observed, output, _) = run(device(), &[&pipeline], format, depth, &vertices, Force::Nothing, Some(&mut Nothing));
                assert!(fast == observed, "{name}: bytes differ under an observer, round {round}");
                assert_eq!(fast_output.statistics, output.statistics, "{name}");
                let (scalar, output, _) = run(scalar_device(), &[&pipeline], format, depth, &vertices, Force::Nothing, None);
                assert!(fast == scalar, "{name}: bytes differ on the scalar device, round {round}");
                assert_eq!(fast_output.statistics, output.statistics, "{name}");
            }
            count += 1;
            total += vertices.len() / 3;
        }
    }
    println!("shortcuts: {count} passes, {total} triangles, bytes and counters equal");
}

/// Sets up nothing sixteen at a time and rejects nothing by coarse depth: the long way for everything.
struct LongWay;

impl Observer for LongWay {}

/// A canvas with depth drawn into it, so that each block of it is different.
fn canvas_with_depth(rng: &mut Rng, format: TextureFormat) -> Canvas {
    let depth = TextureFormat::Depth32FloatStencil8;
    let mut canvas = Canvas::new(SIZE, &[Some(format)], Some(depth));
    let writer = pipeline(plain_program(Ones), |desc| {
        desc.targets = vec![additive(format)];
        desc.depth_stencil = Some(depth_state(depth, CompareFunction::LessEqual, true));
    });
    let vertices = Vertices::new(&triangles(rng, 60));
    let entries = vertices.entries();
    canvas.run(vec![Draw::new(&writer, Bindings::new(&entries, 0), 0..vertices.count, SIZE)]);
    canvas.load = true;
    canvas
}

#[test]
fn coarse_depth_rejects_nothing_that_passes() {
    let format = TextureFormat::Rgba32Float;
    let mut rng = Rng(1004);
    let orders = [CompareFunction::Less, CompareFunction::LessEqual, CompareFunction::Greater, CompareFunction::GreaterEqual];
    let (mut passed, mut total) = (0, 0);
    for round in 0..sized(60, 8) {
        let canvas = canvas_with_depth(&mut rng, format);
        let vertices = Vertices::new(&triangles(&mut rng, 400));
        let entries = vertices.entries();
        for compare in orders {
            let count = StencilFaceState { pass_op: StencilOperation::IncrementWrap, ..StencilFaceState::IGNORE };
            let stencil = StencilState { front: count, back: count, read_mask: 0xff, write_mask: 0xff };
            let state = depth_state(TextureFormat::Depth32FloatStencil8, compare, false);
            let shaded = pipeline(pull_program(VaryingColor, Interpolation::Perspective), |desc| {
                desc.targets = vec![additive(format)];
                desc.depth_stencil = Some(state.clone());
                desc.primitive.unclipped_depth = round % 2 == 1;
            });
            let counted = pipeline(plain_program(Ones), |desc| {
                desc.targets = vec![additive(format)];
                desc.depth_stencil = Some(DepthStencilState { stencil: stencil.clone(), ..state.clone() });
            });
            let half = vertices.count / 6 * 3;
            let run = |observer: Option<&mut dyn Observer>| {
                let mut canvas = canvas.clone();
                let output = canvas.run_on(
                    device(),
                    vec![
                        Draw::new(&shaded, Bindings::new(&entries, 0), 0..half, SIZE),
                        Draw::new(&counted, Bindings::new(&entries, 0), half..vertices.count, SIZE),
                    ],
                    observer,
                );
                (canvas.bytes(), output.statistics)
            };
            let (fast, observed) = (run(None), run(Some(&mut LongWay)));
            assert!(fast.0 == observed.0, "{compare:?}: bytes differ, round {round}");
            assert_eq!(fast.1, observed.1, "{compare:?}");
            passed += fast.1.fragments_passed;
            total += vertices.count / 3;
        }
    }
    assert!(passed > 0);
    println!("coarse depth: {total} triangles, {passed} fragments passed, bytes and counters equal");
}

#[test]
fn small_primitives_equal_the_long_way() {
    let format = TextureFormat::Rgba32Float;
    let mut rng = Rng(1005);
    let mut total = 0;
    for round in 0..sized(150, 12) {
        let mut canvas = canvas_with_depth(&mut rng, format);
        let mut list = Vec::new();
        for _ in 0..600 {
            // Sizes on both sides of the 64 pixels that are the limit, some of them exactly on it.
            let reach = [0.6, 3.0, 12.0, 31.9, 32.0, 33.0, 90.0][rng.int(0..7) as usize];
            let centre = [rng.real(-20.0, 170.0), rng.real(-20.0, 110.0)];
            let on_grid = rng.chance(3);
            for _ in 0..3 {
                let p = centre.map(|c| c + rng.real(-reach, reach)).map(|c| if on_grid { (c * 16.0).round_ties_even() / 16.0 } else { c });
                let w = [0.5, 1.0, 4.0][rng.int(0..3) as usize];
                let clip = clip_from_px(SIZE, p, rng.f32(-0.02, 1.02)).map(|c| c * w);
                let diameter = [-1.0, 0.3, 1.0, 3.0, 20.0, 63.9, 64.0, 65.0, 200.0, f32::NAN][rng.int(0..10) as usize];
                list.push(vertex(clip, [rng.f32(-1.0, 1.0), rng.f32(-1.0, 1.0), rng.f32(-1.0, 1.0), diameter]));
            }
        }
        let vertices = Vertices::new(&list);
        let entries = vertices.entries();
        let points = round % 3 == 2;
        let mut program = pull_program(VaryingColor, [Interpolation::Perspective, Interpolation::Linear][round % 2]);
        if points {
            program.vertex = std::sync::Arc::new(SizedPull);
        }
        let pipeline = pipeline(program, |desc| {
            desc.targets = vec![additive(format)];
            let mut state = depth_state(TextureFormat::Depth32FloatStencil8, CompareFunction::LessEqual, true);
            if !points && round % 4 == 0 {
                state.bias = DepthBiasState { constant: 40, slope_scale: 1.5, clamp: 0.0 };
            }
            desc.depth_stencil = Some(state);
            desc.primitive.cull_mode = [None, Some(Face::Front), Some(Face::Back)][round % 3];
            desc.primitive.front_face = if round % 2 == 0 { FrontFace::Ccw } else { FrontFace::Cw };
            if points {
                desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
            }
        });
        let scissor = PixelRect { x0: 5, y0: 3, x1: 140, y1: 71 };
        let draw = || Draw { scissor, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, SIZE) };
        let mut long = canvas.clone();
        let fast_output = canvas.run_on(device(), vec![draw()], None);
        let long_output = long.run_on(device(), vec![draw()], Some(&mut LongWay));
        assert!(canvas.bytes() == long.bytes(), "bytes differ, round {round}");
        assert_eq!(fast_output.statistics, long_output.statistics, "round {round}");
        total += if points { vertices.count } else { vertices.count / 3 };
    }
    println!("small primitives: {total}, bytes and counters equal");
}

/// Draws with and without shortcuts that alternate keep their order.
#[test]
fn shortcuts_and_general_draws_interleave() {
    let format = TextureFormat::R32Float;
    let fast = pipeline(pull_program(FlatColor, Interpolation::Flat), |desc| desc.targets = vec![additive(format)]);
    let slow = pipeline(pull_program(VaryingColor, Interpolation::Flat), |desc| desc.targets = vec![target(format)]);
    let mut rng = Rng(1002);
    for _ in 0..sized(20, 3) {
        let vertices = triangles(&mut rng, 900);
        let pipelines = [&fast, &slow, &fast, &fast, &slow, &slow, &fast, &slow, &fast];
        let a = run(device(), &pipelines, Some(format), None, &vertices, Force::Nothing, None).0;
        let b = run(device(), &pipelines, Some(format), None, &vertices, Force::Query, None).0;
        let c = run(scalar_device(), &pipelines, Some(format), None, &vertices, Force::Query, None).0;
        assert!(a == b && a == c);
    }
}

#[test]
fn byte_comparison_notices_one_more_triangle() {
    let (_, pipeline, format, depth) = states().swap_remove(0);
    let vertices = triangles(&mut Rng(1003), 50);
    let all = run(device(), &[&pipeline], format, depth, &vertices, Force::Nothing, None).0;
    let fewer = run(device(), &[&pipeline], format, depth, &vertices[..vertices.len() - 3], Force::Query, None).0;
    assert!(all != fewer);
}

/// Replays what an observer is told.
struct Replay {
    color: Vec<[f32; 4]>,
    stencil: Vec<u8>,
    passed: u64,
    outcomes: [u64; 4],
    primitives: [u64; 5],
    vertices: u64,
    problems: Vec<String>,
}

impl Replay {
    fn new(stencil: u8) -> Self {
        let pixels = (SIZE.0 * SIZE.1) as usize;
        Self {
            color: vec![[0.0; 4]; pixels],
            stencil: vec![stencil; pixels],
            passed: 0,
            outcomes: [0; 4],
            primitives: [0; 5],
            vertices: 0,
            problems: Vec::new(),
        }
    }
}

impl Observer for Replay {
    fn vertices(&mut self, _: u32, _: u32, indices: &[u32], positions: &[[f32; 4]], varyings: &[f32], scalars: usize) {
        self.vertices += indices.len() as u64;
        if positions.len() != indices.len() || varyings.len() != indices.len() * scalars {
            self.problems.push("vertices, positions and varyings of different lengths".into());
        }
    }
    fn primitive(&mut self, event: PrimitiveEvent) {
        let kind = match event.outcome {
            PrimitiveOutcome::Rejected => 0,
            PrimitiveOutcome::Culled => 1,
            PrimitiveOutcome::ZeroArea => 2,
            PrimitiveOutcome::NoSamples => 3,
            PrimitiveOutcome::Rasterized { .. } => 4,
        };
        self.primitives[kind] += 1;
    }
    fn fragment(&mut self, event: FragmentEvent) {
        let at = (event.y * SIZE.0 + event.x) as usize;
        let kind = match event.outcome {
            FragmentOutcome::StencilFailed => 0,
            FragmentOutcome::DepthFailed => 1,
            FragmentOutcome::Discarded => 2,
            FragmentOutcome::Passed => 3,
        };
        self.outcomes[kind] += 1;
        if event.stencil_before != self.stencil[at] {
            self.problems.push(format!("{event:?}: stencil was {}", self.stencil[at]));
        }
        if event.color_before != self.color[at] {
            self.problems.push(format!("{event:?}: colour was {:?}", self.color[at]));
        }
        if event.outcome == FragmentOutcome::Passed {
            self.passed += 1;
        } else if event.color_after != event.color_before {
            self.problems.push(format!("{event:?}: a fragment that did not pass changed the colour"));
        }
        self.stencil[at] = event.stencil_after;
        self.color[at] = event.color_after;
    }
}

/// Discards a quarter of the pixels.
struct Sieve;

impl FragmentShader for Sieve {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let quarter = |v: L| (v * 0.5) - (v * 0.5).floor();
        let (x, y) = (quarter(input.position.x - 0.5), quarter(input.position.y - 0.5));
        output.keep = output.keep & (x + y).gt(L::splat(input.token, 0.25));
        output.color[0] = v4(input.varying(0), input.varying(1), input.varying(2), input.varying(3));
    }
}

#[test]
fn observer_tells_what_happened() {
    let mut rng = Rng(1004);
    let mut stencil_failures = 0;
    let format = TextureFormat::Depth32FloatStencil8;
    let face = |compare, fail_op, depth_fail_op, pass_op| StencilFaceState { compare, fail_op, depth_fail_op, pass_op };
    for discards in [false, true] {
        for compare in [CompareFunction::Always, CompareFunction::Less] {
            for cull_mode in [None, Some(Face::Back)] {
                let program = if discards {
                    Program { may_discard: true, ..pull_program(Sieve, Interpolation::Flat) }
                } else {
                    pull_program(VaryingColor, Interpolation::Perspective)
                };
                let pipeline = pipeline(program, |desc| {
                    desc.targets = vec![additive(TextureFormat::Rgba32Float)];
                    let mut state = depth_state(format, compare, true);
                    state.stencil = StencilState {
                        front: face(
                            CompareFunction::NotEqual,
                            StencilOperation::Invert,
                            StencilOperation::IncrementWrap,
                            StencilOperation::IncrementWrap,
                        ),
                        back: face(
                            CompareFunction::Always,
                            StencilOperation::Keep,
                            StencilOperation::Zero,
                            StencilOperation::DecrementWrap,
                        ),
                        read_mask: 0x0f,
                        write_mask: 0xff,
                    };
                    desc.depth_stencil = Some(state);
                    desc.primitive = PrimitiveState { cull_mode, ..PrimitiveState::default() };
                });
                let vertices = triangles(&mut rng, sized(600, 200));
                let mut replay = Replay::new(3);
                let (bytes, output, canvas) = run(
                    device(),
                    &[&pipeline],
                    Some(TextureFormat::Rgba32Float),
                    Some(format),
                    &vertices,
                    Force::Nothing,
                    Some(&mut replay),
                );
                let what = format!("discards: {discards}, {compare:?}, {cull_mode:?}");
                assert!(replay.problems.is_empty(), "{what}: {} problems, first {}", replay.problems.len(), replay.problems[0]);
                let unobserved =
                    run(device(), &[&pipeline], Some(TextureFormat::Rgba32Float), Some(format), &vertices, Force::Nothing, None);
                assert!(bytes == unobserved.0, "{what}: an observer changed the bytes");
                assert_eq!(output, unobserved.1, "{what}");
                for c in 0..4 {
                    let told: Vec<f32> = replay.color.iter().map(|p| p[c]).collect();
                    assert_eq!(first_difference(SIZE.0, &told, &canvas.channel(0, c)), None, "{what}: last colours told, channel {c}");
                }
                assert_eq!(first_difference(SIZE.0, &replay.stencil, &canvas.stencils()), None, "{what}: last stencil told");
                let s = output.statistics;
                assert_eq!(replay.passed, s.fragments_passed, "{what}");
                assert_eq!(replay.vertices, s.vertex_shader_invocations, "{what}");
                let [rejected, culled, zero, without, rasterized] = replay.primitives;
                assert_eq!(
                    [rejected, culled, zero, without],
                    [s.primitives_rejected, s.primitives_culled, s.primitives_zero_area, s.primitives_without_samples],
                    "{what}"
                );
                assert_eq!(rasterized + culled + zero + without, s.clipper_primitives_out, "{what}");
                assert_eq!(replay.outcomes[2] > 0, discards, "{what}");
                let depth_tested = compare == CompareFunction::Less;
                assert_eq!(replay.outcomes[1] > 0, depth_tested, "{what}");
                stencil_failures += replay.outcomes[0];
            }
        }
    }
    assert!(stencil_failures > 1_000, "the stencil test must fail somewhere, {stencil_failures}");
}

#[test]
fn replay_notices_a_wrong_stencil() {
    let mut replay = Replay::new(3);
    replay.fragment(FragmentEvent {
        draw: 0,
        primitive_id: 0,
        x: 1,
        y: 1,
        depth: 0.5,
        outcome: FragmentOutcome::Passed,
        stencil_before: 4,
        stencil_after: 5,
        shader_color: [0.0; 4],
        color_before: [0.0; 4],
        color_after: [1.0; 4],
    });
    assert_eq!(replay.problems.len(), 1);
}
