//! Sprites with a separable kernel: what is added is the product of both factors, and the fast path equals the general one.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v4};
use nephroid_pipeline::shader::{Axis, Interpolation, Program, Separable, SeparableShader};
use nephroid_pipeline::state::{CompareFunction, PixelRect, PrimitiveState, PrimitiveTopology, TextureFormat};
use nephroid_pipeline::{Bindings, Draw, Observer, RenderPipeline};

use super::depth_stencil::depth_state;
use super::passes::*;
use super::reference::snap;
use super::sprites::SizedPull;

const SIZE: (u32, u32) = (150, 90);

/// A kernel whose eight channels all differ: around the point at the first two varyings, scaled by the third.
struct Kernel;

impl SeparableShader for Kernel {
    const TARGETS: usize = 2;

    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; 8]) {
        let t = at - flat[axis as usize];
        // Zero from six pixels on, so that there are blocks of zeros.
        let near = t.abs().lt(t.like(6.0));
        let bell = L::select(near, t.like(1.0) / (t * t + 1.0), t.like(0.0));
        let scale = if axis == Axis::X { flat[2] } else { 1.0 };
        values[0] = v4(bell * scale, t.like(1.0), t, at * 0.25);
        values[1] = v4(t.like(scale), bell * bell, -bell, L::select(near, (at - 40.0).sqrt(), t.like(0.0)));
    }
}

/// What [`Kernel`] gives at a pixel, one number at a time.
fn expected(flat: [f32; 3], x: i32, y: i32) -> [f32; 8] {
    let at = [x, y].map(|pixel| pixel as f32 + 0.5);
    let t = [at[0] - flat[0], at[1] - flat[1]];
    let bell = t.map(|t| if t.abs() < 6.0 { 1.0 / (t * t + 1.0) } else { 0.0 });
    let root = |axis: usize| if t[axis].abs() < 6.0 { (at[axis] - 40.0).sqrt() } else { 0.0 };
    [
        bell[0] * flat[2] * bell[1],
        1.0,
        t[0] * t[1],
        at[0] * 0.25 * (at[1] * 0.25),
        flat[2],
        bell[0] * bell[0] * (bell[1] * bell[1]),
        bell[0] * bell[1],
        root(0) * root(1),
    ]
}

fn splats(formats: &[Option<TextureFormat>], compare: Option<CompareFunction>, mode: Interpolation) -> RenderPipeline {
    let program = Program { vertex: Arc::new(SizedPull), ..pull_program(Separable(Kernel), mode) };
    pipeline(program, |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
        desc.targets = formats.iter().map(|format| format.and_then(additive)).collect();
        desc.depth_stencil = compare.map(|compare| depth_state(TextureFormat::Depth32Float, compare, false));
    })
}

/// Points of all sizes, around pixel centres, corners and anywhere, some outside of the target.
fn points(rng: &mut Rng, count: usize) -> Vec<Vertex> {
    (0..count)
        .map(|_| {
            let step = [1.0 / 4096.0, 0.5, 1.0 / 256.0][rng.int(0..3) as usize];
            let p = [rng.real(-20.0, 170.0), rng.real(-20.0, 110.0)].map(|v| (v / step).floor() * step);
            let diameter = [0.3, 1.0, 3.0, 7.0, 15.0, 33.3, 63.9, 64.0, 90.0][rng.int(0..9) as usize];
            let flat = [p[0] as f32, p[1] as f32, rng.f32(-2.0, 2.0), diameter];
            vertex(clip_from_px(SIZE, p, rng.f32(0.0, 1.0)), flat)
        })
        .collect()
}

struct Nothing;
impl Observer for Nothing {}

fn run(
    device: &nephroid_pipeline::Device,
    pipeline: &RenderPipeline,
    formats: &[Option<TextureFormat>],
    vertices: &[Vertex],
    (query, clear): (bool, f64),
    observer: Option<&mut dyn Observer>,
) -> (Canvas, nephroid_pipeline::PassOutput) {
    let vertices = Vertices::new(vertices);
    let entries = vertices.entries();
    let mut canvas = Canvas::new(SIZE, formats, pipeline.desc().depth_stencil.as_ref().map(|state| state.format));
    canvas.clear_depth = 0.6;
    canvas.queries = 1;
    canvas.clear = [clear; 4];
    let scissor = PixelRect { x0: 3, y0: 2, x1: 147, y1: 85 };
    let draw = Draw { scissor, query: query.then_some(0), ..Draw::new(pipeline, Bindings::new(&entries, 0), 0..vertices.count, SIZE) };
    let output = canvas.run_on(device, vec![draw], observer);
    (canvas, output)
}

const ONE: TextureFormat = TextureFormat::R32Float;
const TWO: TextureFormat = TextureFormat::Rg32Float;
const FOUR: TextureFormat = TextureFormat::Rgba32Float;

#[test]
fn fast_splats_equal_the_general_path() {
    let mut rng = Rng(1101);
    let targets: [&[Option<TextureFormat>]; 8] = [
        &[Some(ONE)],
        &[Some(TWO)],
        &[Some(FOUR)],
        &[Some(FOUR), Some(FOUR)],
        &[Some(ONE), Some(FOUR)],
        &[None, Some(TWO)],
        // Neighbours without a fast path: a format that rounds, and varyings that vary.
        &[Some(TextureFormat::Rgba16Float)],
        &[Some(FOUR), Some(TextureFormat::R16Float)],
    ];
    let mut total = 0;
    for formats in targets {
        for compare in [None, Some(CompareFunction::Less), Some(CompareFunction::LessEqual), Some(CompareFunction::Greater)] {
            for mode in [Interpolation::Flat, Interpolation::Linear] {
                let pipeline = splats(formats, compare, mode);
                for round in 0..sized(20, 3) {
                    let vertices = points(&mut rng, sized(300, 120));
                    // −0.0 becomes +0.0 where +0.0 is added.
                    let clear = [0.0, -0.0, 1.5][round % 3];
                    let what = format!("{formats:?}, depth {compare:?}, {mode:?}, round {round}");
                    let (fast, fast_output) = run(device(), &pipeline, formats, &vertices, (false, clear), None);
                    let (general, output) = run(device(), &pipeline, formats, &vertices, (true, clear), None);
                    assert!(fast.bytes() == general.bytes(), "{what}: bytes differ between shortcut and query");
                    assert_eq!(fast_output.statistics, output.statistics, "{what}");
                    let (observed, output) = run(device(), &pipeline, formats, &vertices, (false, clear), Some(&mut Nothing));
                    assert!(fast.bytes() == observed.bytes(), "{what}: bytes differ under an observer");
                    assert_eq!(fast_output.statistics, output.statistics, "{what}");
                    let (scalar, output) = run(scalar_device(), &pipeline, formats, &vertices, (false, clear), None);
                    assert!(fast.bytes() == scalar.bytes(), "{what}: bytes differ on the scalar device");
                    assert_eq!(fast_output.statistics, output.statistics, "{what}");
                    total += vertices.len();
                }
            }
        }
    }
    println!("splats: {total}, bytes and counters equal");
}

/// Every pixel of every sprite, in the order of the draw, by the rule of half-open squares.
fn by_hand(vertices: &[Vertex]) -> Vec<[f32; 8]> {
    let mut sums = vec![[0.0_f32; 8]; (SIZE.0 * SIZE.1) as usize];
    for v in vertices {
        let centre = snap(SIZE, [v[0], v[1], v[2], v[3]]);
        let half = (f64::from(v[7]) * 128.0).round_ties_even() as i64;
        let inside = |axis: usize, c: i64| c * 256 + 128 >= centre[axis] - half && c * 256 + 128 < centre[axis] + half;
        for y in (2..85).filter(|&y| inside(1, y)) {
            for x in (3..147).filter(|&x| inside(0, x)) {
                let values = expected([v[4], v[5], v[6]], x as i32, y as i32);
                let sum = &mut sums[(y * i64::from(SIZE.0) + x) as usize];
                for (sum, value) in sum.iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
    }
    sums
}

#[test]
fn splats_add_the_product_of_their_factors() {
    let formats = [Some(FOUR), Some(FOUR)];
    let vertices = points(&mut Rng(1102), 150);
    let (canvas, _) = run(device(), &splats(&formats, None, Interpolation::Flat), &formats, &vertices, (false, 0.0), None);
    let sums = by_hand(&vertices);
    assert!(sums.iter().any(|sum| sum[7].is_nan()), "roots of negative numbers are part of the test");
    for channel in 0..8 {
        let seen = canvas.channel(channel / 4, channel % 4);
        for (index, (seen, sum)) in seen.iter().zip(&sums).enumerate() {
            let same = seen.to_bits() == sum[channel].to_bits() || (seen.is_nan() && sum[channel].is_nan());
            assert!(same, "channel {channel}, pixel {index}: {seen}, by hand {}", sum[channel]);
        }
    }
    // One sprite less is noticed.
    let fewer = by_hand(&vertices[1..]);
    assert!(fewer.iter().zip(&sums).any(|(fewer, all)| fewer[1] != all[1]));
}
