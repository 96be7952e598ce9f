//! Depth and stencil state: the vectors of the WebGPU conformance suite (`rendering/{depth,depth_bias,depth_clip_clamp,stencil}.spec.ts`) as
//! tables, through every path that the pipeline has for them.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::{
    CompareFunction, DepthBiasState, DepthStencilState, PrimitiveState, PrimitiveTopology, StencilFaceState, StencilOperation,
    StencilState, TextureFormat, Viewport,
};
use nephroid_pipeline::{Bindings, Draw};

use super::passes::*;
use CompareFunction::{Always, Equal, Greater, GreaterEqual, Less, LessEqual, Never, NotEqual};

const DEPTH_FORMATS: [TextureFormat; 5] = [
    TextureFormat::Depth16Unorm,
    TextureFormat::Depth24Plus,
    TextureFormat::Depth24PlusStencil8,
    TextureFormat::Depth32Float,
    TextureFormat::Depth32FloatStencil8,
];

const STENCIL_FORMATS: [TextureFormat; 3] =
    [TextureFormat::Stencil8, TextureFormat::Depth24PlusStencil8, TextureFormat::Depth32FloatStencil8];

pub fn depth_state(format: TextureFormat, compare: CompareFunction, write: bool) -> DepthStencilState {
    DepthStencilState {
        format,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}

/// How a draw reaches the tests: one point or one triangle over the target; through the shading queue, per primitive, or without colour.
#[derive(Clone, Copy, Debug)]
enum Route {
    Point,
    Triangle,
    Additive,
    NoColor,
    /// Depth from the fragment stage: tested late.
    WrittenDepth,
    /// A shader that may discard: tested late where it writes.
    MayDiscard,
}

const ROUTES: [Route; 6] = [Route::Point, Route::Triangle, Route::Additive, Route::NoColor, Route::WrittenDepth, Route::MayDiscard];

/// Writes the flat colour, and its fourth number as depth.
struct DepthFromAlpha;

impl FragmentShader for DepthFromAlpha {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let f = |scalar| L::splat(input.token, input.flat(scalar));
        output.color[0] = v4(f(0), f(1), f(2), f(3));
        output.depth = f(3);
    }
}

impl Route {
    fn program(self) -> Program {
        match self {
            Self::Point | Self::Triangle => pull_program(VaryingColor, Interpolation::Perspective),
            Self::Additive => pull_program(FlatColor, Interpolation::Flat),
            Self::NoColor => depth_only_program(),
            Self::WrittenDepth => Program { writes_depth: true, ..pull_program(DepthFromAlpha, Interpolation::Flat) },
            Self::MayDiscard => Program { may_discard: true, ..pull_program(VaryingColor, Interpolation::Linear) },
        }
    }
}

/// One step of a case: state, colour, depth, stencil reference.
#[derive(Clone)]
struct Step {
    state: DepthStencilState,
    red: f32,
    depth: f32,
    reference: u32,
}

/// Runs steps as draws of one pass on a 1x1 target; the red that is left, depth and stencil.
fn run_steps(route: Route, steps: &[Step], clear_depth: f32, clear_stencil: u32) -> (f32, f32, u8) {
    let format = steps[0].state.format;
    let color = TextureFormat::R32Float;
    let has_color = !matches!(route, Route::NoColor);
    let pipelines: Vec<_> = steps
        .iter()
        .map(|step| {
            pipeline(route.program(), |desc| {
                desc.depth_stencil = Some(step.state.clone());
                if has_color {
                    desc.targets = vec![if matches!(route, Route::Additive) { additive(color) } else { target(color) }];
                }
                if matches!(route, Route::Point) {
                    desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
                }
            })
        })
        .collect();
    let formats = [Some(color)];
    let mut canvas = Canvas::new((1, 1), if has_color { &formats } else { &[] }, Some(format));
    canvas.clear_depth = clear_depth;
    canvas.clear_stencil = clear_stencil;
    let buffers: Vec<Vertices> = steps
        .iter()
        .map(|step| {
            let data = [step.red, 0.0, 0.0, step.depth];
            let corner = |x, y| {
                // Depth from the shader: the primitive itself lies elsewhere in the range.
                let z = if matches!(route, Route::WrittenDepth) { 0.3 } else { step.depth };
                vertex([x, y, z, 1.0], data)
            };
            match route {
                Route::Point => Vertices::new(&[corner(0.0, 0.0)]),
                _ => Vertices::new(&[corner(-1.0, -1.0), corner(3.0, -1.0), corner(-1.0, 3.0)]),
            }
        })
        .collect();
    let entries: Vec<_> = buffers.iter().map(Vertices::entries).collect();
    let draws = steps.iter().zip(&pipelines).zip(buffers.iter().zip(&entries)).map(|((step, pipeline), (buffer, entries))| Draw {
        stencil_reference: step.reference,
        ..Draw::new(pipeline, Bindings::new(entries, 0), 0..buffer.count, (1, 1))
    });
    canvas.run(draws.collect());
    let red = if has_color { canvas.pixel(0, 0, 0)[0] } else { 0.0 };
    let depth = if format == TextureFormat::Stencil8 { 0.0 } else { canvas.depths()[0] };
    (red, depth, canvas.stencils()[0])
}

/// Not halfway between two numbers of a 16-bit target.
const MIDDLE: f32 = 0.5001;

/// Function, and whether a fragment passes in front of, at and behind what is stored.
const COMPARE: [(CompareFunction, [bool; 3]); 8] = [
    (Never, [false, false, false]),
    (Less, [true, false, false]),
    (LessEqual, [true, true, false]),
    (Equal, [false, true, false]),
    (NotEqual, [true, false, true]),
    (GreaterEqual, [false, true, true]),
    (Greater, [false, false, true]),
    (Always, [true, true, true]),
];

#[test]
fn depth_compare_functions() {
    for format in DEPTH_FORMATS {
        for route in ROUTES {
            for (compare, passes) in COMPARE {
                for (clear, pass) in [1.0, MIDDLE, 0.0].into_iter().zip(passes) {
                    for write in [false, true] {
                        let step = Step { state: depth_state(format, compare, write), red: 1.0, depth: MIDDLE, reference: 0 };
                        let (red, depth, _) = run_steps(route, &[step], clear, 0);
                        let what = format!("{format:?} {route:?} {compare:?} against {clear}, write: {write}");
                        if !matches!(route, Route::NoColor) {
                            assert_eq!(red, if pass { 1.0 } else { 0.0 }, "{what}");
                        }
                        let expected = if pass && write { MIDDLE } else { clear };
                        let step = if format == TextureFormat::Depth16Unorm { 0.5 / 65535.0 } else { 0.6 / 16_777_215.0 };
                        assert!((depth - expected).abs() <= step, "{what}: depth {depth}, expected {expected}");
                    }
                }
            }
        }
    }
}

const WHITE: f32 = 1.0;
const RED: f32 = 2.0;
const GREEN: f32 = 4.0;

#[test]
fn depth_disabled_last_draw_wins() {
    let state = depth_state(TextureFormat::Depth24PlusStencil8, Always, false);
    let draws = [(WHITE, 0.0), (RED, 0.5), (GREEN, 1.0)];
    for order in [[0, 1, 2], [1, 0, 2], [1, 2, 0], [2, 1, 0], [0, 2, 1], [2, 0, 1]] {
        let steps = order.map(|i: usize| Step { state: state.clone(), red: draws[i].0, depth: draws[i].1, reference: 0 });
        for route in [Route::Point, Route::Triangle] {
            assert_eq!(run_steps(route, &steps, 1.0, 0).0, draws[order[2]].0, "{order:?}");
        }
    }
}

#[test]
fn depth_write_disabled() {
    let format = TextureFormat::Depth24PlusStencil8;
    for (write, last_depth, expected) in [(false, 0.0, RED), (true, 0.0, GREEN), (false, 1.0, GREEN), (true, 1.0, RED)] {
        let steps = [
            Step { state: depth_state(format, Always, true), red: WHITE, depth: 1.0, reference: 0 },
            Step { state: depth_state(format, Always, write), red: RED, depth: 0.0, reference: 0 },
            Step { state: depth_state(format, Equal, false), red: GREEN, depth: last_depth, reference: 0 },
        ];
        for route in [Route::Point, Route::Triangle, Route::WrittenDepth, Route::MayDiscard] {
            assert_eq!(run_steps(route, &steps, 0.3, 0).0, expected, "{route:?}, write: {write}, last depth {last_depth}");
        }
    }
}

#[test]
fn depth_test_fail() {
    let format = TextureFormat::Depth24PlusStencil8;
    // 2 is beyond the far plane.
    for (second, last, expected) in [(1.0, 2.0, WHITE), (0.0, 2.0, RED), (2.0, 0.9, GREEN)] {
        let steps = [
            Step { state: depth_state(format, Always, true), red: WHITE, depth: 1.0, reference: 0 },
            Step { state: depth_state(format, Less, true), red: RED, depth: second, reference: 0 },
            Step { state: depth_state(format, Less, true), red: GREEN, depth: last, reference: 0 },
        ];
        for route in [Route::Point, Route::Triangle] {
            assert_eq!(run_steps(route, &steps, 0.3, 0).0, expected, "{route:?}: {second}, {last}");
        }
    }
}

#[test]
fn reverse_depth() {
    // Four instances at 0.2, 0.3, -0.1 and 1.1; the last two are outside the view.
    for (compare, clear, expected) in [(Less, 1.0, WHITE), (Greater, 0.0, RED)] {
        let state = depth_state(TextureFormat::Depth32Float, compare, true);
        let steps = [(WHITE, 0.2), (RED, 0.3), (GREEN, -0.1), (GREEN, 1.1)].map(|(red, depth)| Step {
            state: state.clone(),
            red,
            depth,
            reference: 0,
        });
        for route in [Route::Point, Route::Triangle] {
            assert_eq!(run_steps(route, &steps, clear, 0).0, expected, "{route:?} {compare:?}");
        }
    }
}

/// A quad over a 1x1 target, flat at z = 0.25, or tilted from 0 at the bottom to 0.5 at the top; the depth that is stored.
fn biased_quad(format: TextureFormat, tilted: bool, bias: DepthBiasState, compare: CompareFunction, clear: f32, color: bool) -> f32 {
    let (bottom, top) = if tilted { (0.0, 0.5) } else { (0.25, 0.25) };
    let corner = |x: f32, y: f32| vertex([x, y, if y < 0.0 { bottom } else { top }, 1.0], [1.0; 4]);
    let (a, b, c, d) = (corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0));
    let state = DepthStencilState { bias, ..depth_state(format, compare, true) };
    let program = if color { plain_program(Ones) } else { depth_only_program() };
    let pipeline = pipeline(program, |desc| {
        desc.depth_stencil = Some(state);
        if color {
            desc.targets = vec![target(TextureFormat::Rgba8Unorm)];
        }
    });
    let mut canvas = Canvas::new((1, 1), if color { &[Some(TextureFormat::Rgba8Unorm)] } else { &[] }, Some(format));
    canvas.clear_depth = clear;
    draw(&mut canvas, &pipeline, &[a, b, c, c, b, d]);
    canvas.depths()[0]
}

#[test]
fn depth_bias_float() {
    // Flat at 0.25 the bias unit is 2^(-2-23), so 8388608 of them are 0.25.
    let quarter = 8_388_608;
    let table = [
        (false, quarter, 0.0, 0.0, 0.5),
        (false, quarter, 0.0, 0.125, 0.375),
        (false, -quarter, 0.0, 0.125, 0.0),
        (false, -quarter, 0.0, -0.125, 0.125),
        (true, 0, 0.0, 0.0, 0.25),
        (true, 0, 1.0, 0.0, 0.75),
        (true, 0, -0.5, 0.0, 0.0),
    ];
    for (tilted, constant, slope_scale, clamp, expected) in table {
        for color in [false, true] {
            let bias = DepthBiasState { constant, slope_scale, clamp };
            let seen = biased_quad(TextureFormat::Depth32Float, tilted, bias, Always, 0.0, color);
            assert_eq!(seen, expected, "tilted: {tilted}, {bias:?}");
        }
    }
}

#[test]
fn depth_bias_unorm() {
    // The suite's three vectors say pass or fail against 0.4; the stored depth says more.
    let unit24 = 16_777_215.0;
    let table = [(false, 8_388_608, 0.0, 0.0, Some(0.75)), (true, 8_388_608, 1.0, 0.0, Some(1.0)), (false, 8_388_608, 0.0, 0.1, None)];
    for format in [TextureFormat::Depth24Plus, TextureFormat::Depth24PlusStencil8] {
        for (tilted, constant, slope_scale, clamp, expected) in table {
            let bias = DepthBiasState { constant, slope_scale, clamp };
            let seen = biased_quad(format, tilted, bias, Greater, 0.4, true);
            let expected: f32 = expected.unwrap_or(0.4);
            assert!((seen - expected).abs() <= 1.5 / unit24, "{format:?}, tilted: {tilted}, {bias:?}: {seen}, expected {expected}");
        }
    }
    // One unit of a 16-bit target is one step of what is stored.
    let flat = biased_quad(TextureFormat::Depth16Unorm, false, DepthBiasState::default(), Always, 0.0, false);
    for constant in [-3, 1, 100] {
        let bias = DepthBiasState { constant, ..DepthBiasState::default() };
        let seen = biased_quad(TextureFormat::Depth16Unorm, false, bias, Always, 0.0, false);
        assert_eq!(((seen - flat) * 65535.0).round(), constant as f32);
    }
}

/// Writes its position's depth as colour and the fourth number as depth.
struct SeesDepth {
    writes: bool,
}

impl FragmentShader for SeesDepth {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let one = L::splat(input.token, 1.0);
        output.color[0] = v4(input.position.z, one, one, one);
        if self.writes {
            output.depth = L::splat(input.token, input.flat(3));
        }
    }
}

#[test]
fn depth_clamp_and_clip() {
    const DEPTHS: [f32; 8] = [-1.0, -0.5, 0.0, 0.25, 0.75, 1.0, 1.5, 2.0];
    const RANGE: (f32, f32) = (0.25, 0.75);
    let size = (64, 1);
    for format in DEPTH_FORMATS {
        for unclipped_depth in [false, true] {
            for writes_depth in [false, true] {
                for triangles in [false, true] {
                    for compare in [Always, NotEqual] {
                        let program = Program { writes_depth, ..pull_program(SeesDepth { writes: writes_depth }, Interpolation::Flat) };
                        let pipeline = pipeline(program, |desc| {
                            let topology = if triangles { PrimitiveTopology::TriangleList } else { PrimitiveTopology::PointList };
                            desc.primitive = PrimitiveState { topology, unclipped_depth, ..PrimitiveState::default() };
                            desc.depth_stencil = Some(depth_state(format, compare, true));
                            desc.targets = vec![target(TextureFormat::Rg32Float)];
                        });
                        let mut canvas = Canvas::new(size, &[Some(TextureFormat::Rg32Float)], Some(format));
                        canvas.clear_depth = 0.5;
                        let mut vertices = Vec::new();
                        for i in 0..64 {
                            let data = [0.0, 0.0, 0.0, DEPTHS[i % 8]];
                            let at = |x: f64, y: f64| vertex(clip_from_px(size, [i as f64 + x, y], DEPTHS[i / 8]), data);
                            if triangles {
                                vertices.extend([at(0.1, 0.1), at(0.9, 0.1), at(0.5, 0.95)]);
                            } else {
                                vertices.push(at(0.5, 0.5));
                            }
                        }
                        let vertices = Vertices::new(&vertices);
                        let entries = vertices.entries();
                        let viewport = Viewport { min_depth: RANGE.0, max_depth: RANGE.1, ..Viewport::full(64, 1) };
                        let draw = Draw { viewport, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, size) };
                        canvas.run(vec![draw]);
                        let depths = canvas.depths();
                        for i in 0..64 {
                            let what = format!("{format:?}, unclipped: {unclipped_depth}, frag_depth: {writes_depth}, point {i}");
                            let (vertex_z, fragment_z) = (DEPTHS[i / 8], DEPTHS[i % 8]);
                            let clipped = !unclipped_depth && !(0.0..=1.0).contains(&vertex_z);
                            let position_z = RANGE.0 + vertex_z * (RANGE.1 - RANGE.0);
                            let [seen_z, drawn, ..] = canvas.pixel(0, i as u32, 0);
                            let written = if writes_depth { fragment_z } else { position_z }.clamp(RANGE.0, RANGE.1);
                            // Equal to the clear value only where that is the fragment's own depth.
                            assert_eq!(drawn, if clipped { 0.0 } else { 1.0 }, "{what}");
                            if !clipped {
                                assert!((seen_z - position_z).abs() < 1.0e-5, "{what}: shader saw {seen_z}, expected {position_z}");
                            }
                            let expected = if clipped { 0.5 } else { written };
                            assert!((depths[i] - expected).abs() < 1.0e-5, "{what}: stored {}, expected {expected}", depths[i]);
                        }
                    }
                }
            }
        }
    }
}

fn face(compare: CompareFunction, fail: StencilOperation, depth_fail: StencilOperation, pass: StencilOperation) -> StencilFaceState {
    StencilFaceState { compare, fail_op: fail, depth_fail_op: depth_fail, pass_op: pass }
}

fn stencil_state(format: TextureFormat, face: StencilFaceState, read_mask: u32, write_mask: u32) -> DepthStencilState {
    let has_depth = format != TextureFormat::Stencil8;
    DepthStencilState {
        format,
        depth_write_enabled: has_depth.then_some(false),
        depth_compare: has_depth.then_some(Always),
        stencil: StencilState { front: face, back: face, read_mask, write_mask },
        bias: DepthBiasState::default(),
    }
}

use StencilOperation::{DecrementClamp, DecrementWrap, IncrementClamp, IncrementWrap, Invert, Keep, Replace, Zero};

#[test]
fn stencil_compare_functions() {
    for format in STENCIL_FORMATS {
        for route in [Route::Point, Route::Triangle, Route::Additive, Route::MayDiscard] {
            for (compare, passes) in COMPARE {
                // Stored 1; references 0, 1 and 2 are below, equal and above.
                for (reference, pass) in [0, 1, 2].into_iter().zip(passes) {
                    let steps = [
                        Step {
                            state: stencil_state(format, face(Always, Keep, Keep, Replace), 255, 255),
                            red: WHITE,
                            depth: 0.0,
                            reference: 1,
                        },
                        Step { state: stencil_state(format, face(compare, Keep, Keep, Keep), 255, 255), red: GREEN, depth: 0.0, reference },
                    ];
                    let (red, _, stencil) = run_steps(route, &steps, 1.0, 77);
                    let on_pass = if matches!(route, Route::Additive) { WHITE + GREEN } else { GREEN };
                    assert_eq!(red, if pass { on_pass } else { WHITE }, "{format:?} {route:?} {compare:?}, reference {reference}");
                    assert_eq!(stencil, 1);
                }
            }
        }
    }
}

/// Operation, value before, value after; the reference is 3.
const OPERATIONS: [(StencilOperation, u32, u8); 14] = [
    (Keep, 1, 1),
    (Zero, 1, 0),
    (Replace, 1, 3),
    (Invert, 0xf0, 0x0f),
    (IncrementClamp, 1, 2),
    (IncrementClamp, 0xff, 0xff),
    (IncrementWrap, 1, 2),
    (IncrementWrap, 0xff, 0),
    (DecrementClamp, 1, 0),
    (DecrementClamp, 0, 0),
    (DecrementWrap, 2, 1),
    (DecrementWrap, 1, 0),
    (DecrementWrap, 0, 0xff),
    (Invert, 0, 0xff),
];

#[test]
fn stencil_operations() {
    for format in STENCIL_FORMATS {
        // A format without depth takes none from a shader, either.
        let takes_depth = format != TextureFormat::Stencil8;
        for route in ROUTES.into_iter().filter(|route| takes_depth || !matches!(route, Route::WrittenDepth)) {
            for (operation, before, after) in OPERATIONS {
                for which in ["fail", "depth fail", "pass"] {
                    let state = match which {
                        "fail" => stencil_state(format, face(Never, operation, Keep, Keep), 255, 255),
                        "pass" => stencil_state(format, face(Always, Keep, Keep, operation), 255, 255),
                        _ if format == TextureFormat::Stencil8 => continue,
                        _ => DepthStencilState {
                            depth_compare: Some(Less),
                            ..stencil_state(format, face(Always, Keep, operation, Keep), 255, 255)
                        },
                    };
                    let (red, _, stencil) = run_steps(route, &[Step { state, red: 1.0, depth: 0.75, reference: 3 }], 0.5, before);
                    assert_eq!(stencil, after, "{format:?} {route:?} {which} {operation:?} of {before}");
                    let drawn = which == "pass" && !matches!(route, Route::NoColor);
                    assert_eq!(red, if drawn { 1.0 } else { 0.0 }, "{format:?} {route:?} {which} {operation:?}: colour");
                }
            }
        }
    }
}

#[test]
fn stencil_read_and_write_masks() {
    // Base 3 through the write mask, then equality through the read mask, as in the suite; and the other six bits.
    for format in STENCIL_FORMATS {
        for (write_mask, read_mask, reference, pass) in [
            (1, 2, 1, true),
            (1, 2, 2, false),
            (2, 1, 1, false),
            (2, 2, 2, true),
            (3, 2, 1, false),
            (3, 2, 2, true),
            (1, 1, 3, true),
            (0xff, 1, 3, true),
        ] {
            let steps = [
                Step {
                    state: stencil_state(format, face(Always, Keep, Keep, Replace), 255, write_mask),
                    red: WHITE,
                    depth: 0.0,
                    reference: 3,
                },
                Step { state: stencil_state(format, face(Equal, Keep, Keep, Keep), read_mask, 255), red: GREEN, depth: 0.0, reference },
            ];
            let (red, _, stencil) = run_steps(Route::Triangle, &steps, 1.0, 0xf0);
            assert_eq!(u32::from(stencil), 0xf0 & !write_mask | 3 & write_mask, "write mask {write_mask}");
            assert_eq!(red, if pass { GREEN } else { WHITE }, "write {write_mask}, read {read_mask}, reference {reference}");
        }
    }
}

#[test]
fn stencil_reference_uses_eight_bits() {
    let state = stencil_state(TextureFormat::Stencil8, face(Always, Keep, Keep, Replace), 255, 255);
    let step = Step { state, red: 1.0, depth: 0.0, reference: 0xabcd_ef12 };
    assert_eq!(run_steps(Route::NoColor, &[step], 1.0, 0).2, 0x12);
    // Without a reference set it is 0.
    let state = stencil_state(TextureFormat::Stencil8, face(Equal, Keep, Keep, Invert), 255, 255);
    assert_eq!(run_steps(Route::NoColor, &[Step { state, red: 1.0, depth: 0.0, reference: 0 }], 1.0, 0).2, 0xff);
}

#[test]
fn stencil_accumulates_bit_planes() {
    // Each draw owns one bit; together they spell the number.
    let format = TextureFormat::Depth24PlusStencil8;
    for wanted in [0u32, 0x01, 0x5a, 0xa5, 0xff] {
        let steps: Vec<Step> = (0..8)
            .map(|bit| Step {
                state: stencil_state(format, face(Always, Keep, Keep, if wanted >> bit & 1 == 1 { Replace } else { Zero }), 255, 1 << bit),
                red: 1.0,
                depth: 0.0,
                reference: 0xff,
            })
            .collect();
        for route in ROUTES {
            assert_eq!(u32::from(run_steps(route, &steps, 1.0, 0x3c).2), wanted, "{route:?}");
        }
    }
}

#[test]
fn stencil_faces_are_separate() {
    // Two triangles side by side, wound oppositely; each face has operations of its own.
    let format = TextureFormat::Depth32FloatStencil8;
    let left = [[-1.0, 1.0], [-1.0, -3.0], [0.0, 1.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.75, 1.0], [1.0; 4]));
    let right = [[0.0, 1.0], [1.0, 1.0], [1.0, -3.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.75, 1.0], [1.0; 4]));
    let vertices: Vec<Vertex> = left.into_iter().chain(right).collect();
    for (depth_compare, clear) in [(Always, 0.5), (Less, 0.5)] {
        for program in [depth_only_program(), Program { may_discard: true, ..plain_program(Ones) }] {
            let state = DepthStencilState {
                depth_compare: Some(depth_compare),
                stencil: StencilState {
                    front: face(Always, Keep, Replace, IncrementWrap),
                    back: face(NotEqual, Invert, Zero, DecrementWrap),
                    read_mask: 255,
                    write_mask: 255,
                },
                ..stencil_state(format, face(Always, Keep, Keep, Keep), 255, 255)
            };
            let discards = program.may_discard;
            let pipeline = pipeline(program, |desc| desc.depth_stencil = Some(state));
            let vertices = Vertices::new(&vertices);
            let entries = vertices.entries();
            for (reference, clear_stencil) in [(7, 100), (100, 100)] {
                let mut canvas = Canvas::new((8, 8), &[], Some(format));
                canvas.clear_depth = clear;
                canvas.clear_stencil = clear_stencil;
                let draw = Draw { stencil_reference: reference, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..6, (8, 8)) };
                canvas.run(vec![draw]);
                let stencil = canvas.stencils();
                // Left goes down its left side: counter-clockwise on the screen, the front. Pixel (0, 1) and (7, 1).
                let (front, back) = (stencil[8], stencil[15]);
                let depth_passes = depth_compare == Always;
                assert_eq!(front, if depth_passes { 101 } else { reference as u8 }, "front, {depth_compare:?}, discards: {discards}");
                let expected = match (reference == clear_stencil, depth_passes) {
                    (true, _) => !100,
                    (false, true) => 99,
                    (false, false) => 0,
                };
                assert_eq!(back, expected, "back, {depth_compare:?}, reference {reference}, discards: {discards}");
            }
        }
    }
}
