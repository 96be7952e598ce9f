//! What fragment shaders are given: position, facing, primitive index, interpolated and flat varyings, derivatives
//! (`shader_io/fragment_builtins.spec.ts`), against interpolation in f64.

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::{TextureFormat, Viewport};
use nephroid_pipeline::{Bindings, Device, Draw};

use super::passes::*;
use super::reference::{Fill, covers, snap};

/// Which input a shader writes out.
#[derive(Clone, Copy, Debug)]
enum Show {
    Position,
    Varyings,
    Derivatives,
    Ids,
}

impl FragmentShader for Show {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let splat = |v: f32| L::splat(input.token, v);
        output.color[0] = match self {
            Self::Position => input.position,
            Self::Varyings => v4(input.varying(0), input.varying(1), input.varying(2), input.varying(3)),
            Self::Derivatives => v4(input.ddx(0), input.ddy(0), input.ddx(1), input.ddy(1)),
            Self::Ids => {
                v4(splat(input.primitive_id as f32), splat(if input.front_facing { 1.0 } else { 0.0 }), splat(input.flat(2)), splat(1.0))
            }
        };
    }
}

/// Distance in units in the last place; 0 and −0 are one number.
fn ulps(a: f32, b: f32) -> u32 {
    let place = |v: f32| if v.is_sign_negative() { -i64::from(v.to_bits() & 0x7fff_ffff) } else { i64::from(v.to_bits()) };
    if a.is_nan() || b.is_nan() { u32::MAX } else { place(a).abs_diff(place(b)).min(u64::from(u32::MAX)) as u32 }
}

fn show(device: &Device, what: Show, interpolation: Interpolation, size: (u32, u32), vertices: &[Vertex], viewport: Viewport) -> Canvas {
    let format = TextureFormat::Rgba32Float;
    let pipeline = pipeline(pull_program(what, interpolation), |desc| desc.targets = vec![target(format)]);
    let vertices = Vertices::new(vertices);
    let entries = vertices.entries();
    let mut canvas = Canvas::single(size, format);
    canvas.clear = [f64::from(UNTOUCHED); 4];
    let draw = Draw { viewport, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, size) };
    canvas.run_on(device, vec![draw], None);
    canvas
}

const UNTOUCHED: f32 = -12345.0;

/// f64 weights of a triangle's vertices at a pixel centre, from snapped positions: on the screen, and in perspective; and 1/w.
fn weights(size: (u32, u32), clip: [[f32; 4]; 3], x: u32, y: u32) -> ([f64; 3], [f64; 3], f64) {
    let p = clip.map(|c| snap(size, c).map(|v| v as f64 / 256.0));
    let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let area = cross(p[0], p[1], p[2]);
    let linear = [cross(p[1], p[2], at) / area, cross(p[2], p[0], at) / area, cross(p[0], p[1], at) / area];
    let over_w: [f64; 3] = std::array::from_fn(|i| linear[i] / f64::from(clip[i][3]));
    let inv_w = over_w.iter().sum::<f64>();
    (linear, over_w.map(|v| v / inv_w), inv_w)
}

/// The suite's clip triangle, with w made explicit.
const TRIANGLE: [[f32; 4]; 3] = [[0.333, 0.333, 0.333, 0.333], [1.0, -3.0, 0.25, 1.0], [-1.5, 0.5, 0.25, 0.5]];
const DATA: [[f32; 4]; 3] = [[1.0, 2.0, 3.0, 4.0], [1.5, 2.0, 5.0, 40.0], [1.75, 2.0, 3.5, 4.5]];

fn suite_vertices() -> Vec<Vertex> {
    (0..3).map(|i| vertex(TRIANGLE[i], DATA[i])).collect()
}

#[test]
fn position_and_varyings_to_four_ulps() {
    let mut greatest = 0;
    let mut fragments = 0;
    for size in [(4, 4), (16, 16)] {
        for (near, far) in [(0.0, 1.0), (0.25, 0.75)] {
            let viewport = Viewport { min_depth: near, max_depth: far, ..Viewport::full(size.0, size.1) };
            for device in [device(), scalar_device()] {
                let position = show(device, Show::Position, Interpolation::Perspective, size, &suite_vertices(), viewport);
                let perspective = show(device, Show::Varyings, Interpolation::Perspective, size, &suite_vertices(), viewport);
                let linear = show(device, Show::Varyings, Interpolation::Linear, size, &suite_vertices(), viewport);
                let flat = show(device, Show::Varyings, Interpolation::Flat, size, &suite_vertices(), viewport);
                for y in 0..size.1 {
                    for x in 0..size.0 {
                        let sample = [i64::from(x) * 256 + 128, i64::from(y) * 256 + 128];
                        let seen = position.pixel(0, x, y);
                        if !covers(TRIANGLE.map(|c| snap(size, c)), sample, Fill::TopLeft) {
                            assert_eq!(seen, [UNTOUCHED; 4], "pixel ({x}, {y}) is not covered");
                            continue;
                        }
                        fragments += 1;
                        let (on_screen, in_space, inv_w) = weights(size, TRIANGLE, x, y);
                        let z: f64 = (0..3).map(|i| on_screen[i] * f64::from(TRIANGLE[i][2]) / f64::from(TRIANGLE[i][3])).sum();
                        let z = f64::from(near) + z * f64::from(far - near);
                        let expected = [f64::from(x) + 0.5, f64::from(y) + 0.5, z, inv_w].map(|v| v as f32);
                        let mut check = |name: &str, seen: f32, expected: f32| {
                            let distance = ulps(seen, expected);
                            greatest = greatest.max(distance);
                            assert!(distance <= 4, "{name} at ({x}, {y}) of {size:?}: {seen}, expected {expected}, {distance} ulps");
                        };
                        for (name, (seen, expected)) in ["x", "y", "z", "1/w"].into_iter().zip(seen.into_iter().zip(expected)) {
                            check(name, seen, expected);
                        }
                        for (name, canvas, weights) in [("perspective", &perspective, in_space), ("linear", &linear, on_screen)] {
                            for (c, seen) in canvas.pixel(0, x, y).into_iter().enumerate() {
                                let expected: f64 = (0..3).map(|i| weights[i] * f64::from(DATA[i][c])).sum();
                                check(name, seen, expected as f32);
                            }
                        }
                        assert_eq!(flat.pixel(0, x, y), DATA[0], "flat varyings are the first vertex's");
                        assert_eq!(perspective.pixel(0, x, y)[1], 2.0, "a constant stays exactly constant");
                    }
                }
            }
        }
    }
    println!("position and varyings: {fragments} fragments, at most {greatest} ulps");
    assert!(fragments > 300);
}

#[test]
fn varyings_of_random_triangles() {
    let mut rng = Rng(601);
    let size = (100, 60);
    let (mut greatest, mut fragments) = (0.0f64, 0u64);
    for _ in 0..sized(3_000, 300) {
        let clip: [[f32; 4]; 3] = [(); 3].map(|()| {
            let w = libm::exp(rng.real(-2.0, 2.0)) as f32;
            let p = [rng.real(0.0, 100.0), rng.real(0.0, 60.0)];
            clip_from_px(size, p, rng.f32(0.1, 0.9)).map(|c| c * w)
        });
        let data = [(); 3].map(|()| [0; 4].map(|_| rng.f32(1.0, 2.0)));
        let p = clip.map(|c| snap(size, c));
        let area = ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0])).abs();
        let side = |i: usize, j: usize| (((p[i][0] - p[j][0]).pow(2) + (p[i][1] - p[j][1]).pow(2)) as f64).sqrt();
        // Slivers lose digits in any arithmetic: at least eight pixels high over every side.
        if (area as f64) < 8.0 * 256.0 * side(0, 1).max(side(1, 2)).max(side(2, 0)) {
            continue;
        }
        let vertices: Vec<Vertex> = (0..3).map(|i| vertex(clip[i], data[i])).collect();
        let canvas = show(device(), Show::Varyings, Interpolation::Perspective, size, &vertices, Viewport::full(100, 60));
        for y in 0..60 {
            for x in 0..100 {
                let seen = canvas.pixel(0, x, y);
                if seen[0] == UNTOUCHED {
                    continue;
                }
                let (_, in_space, _) = weights(size, clip, x, y);
                for c in 0..4 {
                    let expected: f64 = (0..3).map(|i| in_space[i] * f64::from(data[i][c])).sum();
                    let error = (f64::from(seen[c]) - expected).abs() / expected;
                    greatest = greatest.max(error);
                    assert!(error < 2.0e-5, "{clip:?}, pixel ({x}, {y}): {}, expected {expected}", seen[c]);
                }
                fragments += 1;
            }
        }
    }
    println!("varyings of random triangles: {fragments} fragments, greatest relative error {greatest:e}");
}

#[test]
fn derivatives_are_differences_of_the_quad() {
    let size = (16, 16);
    for interpolation in [Interpolation::Linear, Interpolation::Perspective] {
        for device in [device(), scalar_device()] {
            let values = show(device, Show::Varyings, interpolation, size, &suite_vertices(), Viewport::full(16, 16));
            let slopes = show(device, Show::Derivatives, interpolation, size, &suite_vertices(), Viewport::full(16, 16));
            let mut compared = 0;
            for y in 0..16 {
                for x in 0..16 {
                    let slope = slopes.pixel(0, x, y);
                    if slope[0] == UNTOUCHED {
                        continue;
                    }
                    // Where the neighbour of the quad is covered, the derivative is exactly the difference of what was drawn.
                    let pairs = [(0, [x & !1, y], [x | 1, y]), (1, [x, y & !1], [x, y | 1])];
                    for (axis, low, high) in pairs {
                        let (a, b) = (values.pixel(0, low[0], low[1]), values.pixel(0, high[0], high[1]));
                        if a[0] == UNTOUCHED || b[0] == UNTOUCHED {
                            continue;
                        }
                        assert_eq!(slope[axis], b[0] - a[0], "axis {axis} at ({x}, {y})");
                        compared += 1;
                    }
                    // Screen-linear varyings have one slope.
                    if interpolation == Interpolation::Linear {
                        let (w0, _, _) = weights(size, TRIANGLE, x, y);
                        let (w1, _, _) = weights(size, TRIANGLE, x + 1, y);
                        let expected: f64 = (0..3).map(|i| (w1[i] - w0[i]) * f64::from(DATA[i][0])).sum();
                        assert!((f64::from(slope[0]) - expected).abs() < 1.0e-6, "({x}, {y}): {} and {expected}", slope[0]);
                    }
                }
            }
            assert!(compared > 20, "{compared}");
        }
    }
}

#[test]
fn primitive_index_and_facing() {
    let size = (60, 20);
    // Thirty quads of two triangles, the second of each turned over; two instances, the second drawn over the first.
    let mut vertices = Vec::new();
    for quad in 0..30 {
        let (x, y) = (f64::from(quad % 15) * 4.0, f64::from(quad / 15) * 10.0);
        let corner = |dx: f64, dy: f64, id: f32| vertex(clip_from_px(size, [x + dx, y + dy], 0.5), [0.0, 0.0, id, 0.0]);
        let id = (2 * quad) as f32;
        vertices.extend([corner(0.0, 0.0, id), corner(0.0, 10.0, -1.0), corner(4.0, 0.0, -1.0)]);
        let id = id + 1.0;
        vertices.extend([corner(4.0, 0.0, id), corner(4.0, 10.0, -1.0), corner(0.0, 10.0, -1.0)]);
    }
    for device in [device(), scalar_device()] {
        let format = TextureFormat::Rgba32Float;
        let pipeline = pipeline(pull_program(Show::Ids, Interpolation::Flat), |desc| desc.targets = vec![target(format)]);
        let vertices = Vertices::new(&vertices);
        let entries = vertices.entries();
        let mut canvas = Canvas::single(size, format);
        let draw = Draw { instances: 3..5, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..180, size) };
        canvas.run_on(device, vec![draw], None);
        for y in 0..20 {
            for x in 0..60 {
                let [id, front, flat, drawn] = canvas.pixel(0, x, y);
                assert_eq!(drawn, 1.0);
                let quad = y / 10 * 15 + x / 4;
                assert_eq!(id as u32 / 2, quad, "primitive index counts from 0 in every instance");
                assert_eq!(id, flat, "and agrees with the provoking vertex");
                assert_eq!(front, if (id as u32).is_multiple_of(2) { 1.0 } else { 0.0 });
            }
        }
    }
}

/// Discards where the first varying is below a half; and by lane.
struct Holes;

impl FragmentShader for Holes {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let x = input.position.x - 0.5;
        let odd = (x - (x * 0.5).floor() * 2.0).gt(L::splat(input.token, 0.5));
        let one = L::splat(input.token, 1.0);
        output.color[0] = v4(one, one, one, one);
        output.keep = output.keep & odd;
        if !odd.any() {
            output.color[0] = v4(-one, -one, -one, -one);
        }
    }
}

#[test]
fn discarded_fragments_leave_nothing() {
    use nephroid_pipeline::state::{CompareFunction, StencilFaceState, StencilOperation, StencilState};
    for device in [device(), scalar_device()] {
        let program = Program { may_discard: true, ..plain_program(Holes) };
        let format = TextureFormat::Depth32FloatStencil8;
        let pipeline = pipeline(program, |desc| {
            let mut state = super::depth_stencil::depth_state(format, CompareFunction::Less, true);
            let face =
                StencilFaceState { pass_op: StencilOperation::IncrementWrap, compare: CompareFunction::Always, ..StencilFaceState::IGNORE };
            state.stencil = StencilState { front: face, back: face, read_mask: 255, write_mask: 255 };
            desc.depth_stencil = Some(state);
            desc.targets = vec![additive(TextureFormat::R32Float)];
        });
        let triangle = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4]));
        let vertices = Vertices::new(&triangle);
        let entries = vertices.entries();
        let mut canvas = Canvas::new((37, 9), &[Some(TextureFormat::R32Float)], Some(format));
        canvas.queries = 1;
        let draw = Draw { query: Some(0), ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, (37, 9)) };
        let output = canvas.run_on(device, vec![draw], None);
        assert_eq!(output.queries, [18 * 9]);
        assert_eq!(output.statistics.fragments_passed, 18 * 9);
        assert_eq!(output.statistics.fragment_shader_invocations, 37 * 9);
        for y in 0..9 {
            for x in 0..37 {
                let at = (y * 37 + x) as usize;
                let kept = x % 2 == 1;
                assert_eq!(canvas.pixel(0, x, y)[0], if kept { 1.0 } else { 0.0 });
                assert_eq!(canvas.depths()[at], if kept { 0.5 } else { 1.0 });
                assert_eq!(canvas.stencils()[at], u8::from(kept));
            }
        }
    }
}

#[test]
fn ulp_distance_is_a_distance() {
    assert_eq!(ulps(1.0, 1.0 + f32::EPSILON), 1);
    assert_eq!(ulps(0.0, -0.0), 0);
    assert_eq!(ulps(f32::from_bits(1), -f32::from_bits(1)), 2);
    assert_eq!(ulps(f32::NAN, f32::NAN), u32::MAX);
    assert!(ulps(1.0, 1.000_001) > 4, "a difference in the sixth digit must be noticed");
}
