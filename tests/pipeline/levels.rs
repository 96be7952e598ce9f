//! Levels of detail that a fragment's own quad gives.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, v2, v4};
use nephroid_pipeline::sampler::{AddressMode, FilterMode, Sampler, level_of_detail, sample_grad};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::TextureFormat;
use nephroid_pipeline::{Binding, BindingKind, Bindings, Coordinates, Device, Draw, FragmentPlace, Texture, TextureDescriptor};

use super::passes::*;

/// Side of texture and target: at scale 1 a pixel is a texel.
const SIDE: u32 = 64;
const SIZE: (u32, u32) = (SIDE, SIDE);

/// The coordinates as they are.
struct Same;

impl Coordinates for Same {
    #[inline(always)]
    fn coordinates<L: Lanes>(&self, place: &FragmentPlace<'_, L>) -> V2<L> {
        place.varying2(0)
    }
}

/// Coordinates from the position alone: u = x²/2048, whose derivative between the pixels at 2k and 2k + 1 is (4k + 2)/2048.
struct Squares;

impl Coordinates for Squares {
    #[inline(always)]
    fn coordinates<L: Lanes>(&self, place: &FragmentPlace<'_, L>) -> V2<L> {
        let at = place.position();
        v2(at.x * at.x / 2048.0, at.y * 0.0)
    }
}

/// Implicit, explicit and computed coordinates, and a bias of 1; then the squares.
struct Ways;

impl FragmentShader for Ways {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let (texture, sampler) = (bindings.texture(1), bindings.sampler(2));
        let (ddx, ddy) = (v2(input.ddx(0), input.ddx(1)), v2(input.ddy(0), input.ddy(1)));
        let implicit = input.sample(texture, &sampler, 0, 0);
        let explicit = sample_grad(texture, &sampler, input.varying2(0), 0, ddx, ddy);
        let computed = input.sample_computed(texture, &sampler, &Same, 0);
        let biased = input.sample_bias(texture, &sampler, 0, 0, implicit.x.like(1.0));
        output.color[0] = v4(implicit.x, explicit.x, computed.x, biased.x);
        let squares = input.sample_computed(texture, &sampler, &Squares, 0);
        output.color[1] = v4(squares.x, level_of_detail(texture, ddx, ddy), ddx.x, ddy.x);
    }
}

/// The same, for blocks that primitives share.
struct Joined;

impl FragmentShader for Joined {
    const MERGES_FRAGMENTS: bool = true;
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        Ways.fragment(bindings, input, output);
    }
}

/// A texture of seven levels by a function of level and place.
fn chain(value: impl Fn(u32, u32, u32) -> f32) -> Texture {
    let desc = TextureDescriptor { mip_level_count: 7, ..TextureDescriptor::d2("chain", SIDE, SIDE, TextureFormat::R32Float) };
    let mut texture = Texture::new(desc).expect("valid");
    for level in 0..7 {
        let side = SIDE >> level;
        for (x, y) in (0..side * side).map(|i| (i % side, i / side)) {
            texture.set_texel(level, 0, x, y, [value(level, x, y), 0.0, 0.0, 0.0]);
        }
    }
    texture
}

/// Draws triangles whose first two numbers are coordinates. Two targets: see [`Ways`].
fn drawn(device: &Device, fragment: impl FragmentShader + 'static, texture: &Texture, sampler: Sampler, triangles: &[Vertex]) -> Canvas {
    let program = Program {
        bindings: vec![BindingKind::Storage(32), BindingKind::Texture, BindingKind::Sampler],
        ..pull_program(fragment, Interpolation::Perspective)
    };
    let pipeline = pipeline(program, |desc| desc.targets = vec![target(TextureFormat::Rgba32Float); 2]);
    let vertices = Vertices::new(triangles);
    let entries = [vertices.entries()[0], Binding::Texture(texture.view()), Binding::Sampler(sampler)];
    let mut canvas = Canvas::new(SIZE, &[Some(TextureFormat::Rgba32Float); 2], None);
    canvas.clear = [-1.0; 4];
    canvas.run_on(device, vec![Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, SIZE)], None);
    canvas
}

/// One triangle over the target; u and v go from 0 to these numbers across it.
fn plane(u: f32, v: f32) -> [Vertex; 3] {
    [[-1.0, 1.0], [3.0, 1.0], [-1.0, -3.0]]
        .map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [(x + 1.0) * 0.5 * u, (1.0 - y) * 0.5 * v, 0.0, 0.0]))
}

fn repeating(mipmap_filter: FilterMode) -> Sampler {
    Sampler { address_mode: [AddressMode::Repeat; 3], mipmap_filter, ..Sampler::default() }
}

fn all_are(canvas: &Canvas, channel: usize, expected: f32, tolerance: f32, what: &str) {
    let seen = canvas.channel(0, channel);
    let worst = seen.iter().copied().fold(expected, |worst, v| if (v - expected).abs() > (worst - expected).abs() { v } else { worst });
    assert!((worst - expected).abs() <= tolerance, "{what}: {worst}, not {expected}");
}

#[test]
fn minification_by_a_power_of_two_selects_its_level() {
    let texture = chain(|level, _, _| level as f32);
    let linear = repeating(FilterMode::Linear);
    for device in [device(), scalar_device()] {
        for k in 0..=6u8 {
            let scale = f32::from(1u8 << k);
            // Powers of two are exact from the corners to the logarithm: the one level, with no share of the next.
            let canvas = drawn(device, Ways, &texture, linear, &plane(scale, scale));
            all_are(&canvas, 0, k.into(), 0.0, "minified");
            // The longer side of the footprint decides.
            for (u, v) in [(scale, 1.0), (0.5, scale)] {
                all_are(&drawn(device, Ways, &texture, linear, &plane(u, v)), 0, k.into(), 0.0, "stretched");
            }
            // Half-way, both levels have half a share.
            let between = scale * std::f32::consts::SQRT_2;
            let expected = (f32::from(k) + 0.5).min(6.0);
            all_are(&drawn(device, Ways, &texture, linear, &plane(between, between)), 0, expected, 5.0e-5, "between");
            // A nearest filter between levels changes there.
            let nearest = repeating(FilterMode::Nearest);
            for (share, level) in [(1.40, k), (1.43, (k + 1).min(6))] {
                let canvas = drawn(device, Ways, &texture, nearest, &plane(scale * share, scale * share));
                all_are(&canvas, 0, level.into(), 0.0, "nearest level");
            }
        }
        // Magnified, whatever little: level 0.
        all_are(&drawn(device, Ways, &texture, linear, &plane(0.01, 0.3)), 0, 0.0, 0.0, "magnified");
        all_are(&drawn(device, Ways, &texture, linear, &plane(0.0, 0.0)), 0, 0.0, 0.0, "without slope");
    }
}

#[test]
fn a_checker_goes_grey_from_the_first_level_on() {
    let mut texture = chain(|_, x, y| ((x + y) % 2) as f32);
    texture.generate_mips();
    for device in [device(), scalar_device()] {
        let sampler = repeating(FilterMode::Linear);
        let fine = drawn(device, Ways, &texture, sampler, &plane(1.0, 1.0));
        for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
            assert_eq!(fine.pixel(0, x, y)[0], ((x + y) % 2) as f32, "a pixel is a texel");
        }
        all_are(&drawn(device, Ways, &texture, sampler, &plane(2.0, 2.0)), 0, 0.5, 0.0, "grey");
        // A quarter of the way to grey: texels at 0.125 and 0.875.
        let scale = libm::exp2f(0.25);
        let seen = drawn(device, Ways, &texture, sampler, &plane(scale, scale)).channel(0, 0);
        assert!(seen.iter().all(|v| (v - 0.125).abs() < 1.0e-4 || (v - 0.875).abs() < 1.0e-4), "{seen:?}");
    }
}

#[test]
fn bias_comes_before_the_clamps() {
    let texture = chain(|level, _, _| level as f32);
    for device in [device(), scalar_device()] {
        let linear = repeating(FilterMode::Linear);
        let canvas = drawn(device, Ways, &texture, linear, &plane(4.0, 4.0));
        all_are(&canvas, 0, 2.0, 0.0, "without bias");
        all_are(&canvas, 3, 3.0, 0.0, "with a bias of 1");
        // Level 2 becomes 3 and then the greatest allowed; level 0 becomes 1 and then the least allowed.
        let clamped = Sampler { lod_min_clamp: 1.5, lod_max_clamp: 2.25, ..linear };
        let canvas = drawn(device, Ways, &texture, clamped, &plane(4.0, 4.0));
        all_are(&canvas, 0, 2.0, 0.0, "inside of the clamps");
        all_are(&canvas, 3, 2.25, 0.0, "clamped above");
        let canvas = drawn(device, Ways, &texture, clamped, &plane(1.0, 1.0));
        all_are(&canvas, 0, 1.5, 0.0, "clamped below");
        all_are(&canvas, 3, 1.5, 0.0, "1 is below 1.5, too");
    }
}

#[test]
fn computed_coordinates_have_the_derivatives_of_their_quad() {
    let texture = chain(|level, _, _| level as f32);
    for device in [device(), scalar_device()] {
        let canvas = drawn(device, Ways, &texture, repeating(FilterMode::Linear), &plane(1.0, 1.0));
        for x in 0..SIDE {
            // (x₁² − x₀²)/2048 per pixel with x₁ − x₀ = 1 and x₀ + x₁ = 2·(2k + 1), times 64 texels.
            let texels = f64::from(4 * (x / 2) + 2) / 32.0;
            let expected = libm::log2(texels).clamp(0.0, 6.0);
            let seen = f64::from(canvas.pixel(1, x, 17)[0]);
            assert!((seen - expected).abs() < 1.0e-5, "column {x}: {seen}, not {expected}");
        }
    }
}

/// Triangles anywhere, in perspective, small ones among them: quads are cut by edges, and blocks are shared.
fn triangles() -> Vec<Vertex> {
    let mut rng = Rng(91);
    let mut list = Vec::new();
    for number in 0..400 {
        let centre = [rng.real(0.0, 64.0), rng.real(0.0, 64.0)];
        let reach = if number % 3 == 0 { 40.0 } else { 3.0 };
        for _ in 0..3 {
            let at = [centre[0] + rng.real(-reach, reach), centre[1] + rng.real(-reach, reach)];
            let w = rng.f32(0.5, 3.0);
            let [x, y, z, _] = clip_from_px(SIZE, at, 0.5);
            list.push(vertex([x * w, y * w, z * w, w], [rng.f32(-2.0, 6.0), rng.f32(-2.0, 6.0), 0.0, 0.0]));
        }
    }
    list
}

#[test]
fn all_ways_and_widths_give_the_same_bits() {
    let mut rng = Rng(3);
    let texels: Vec<f32> = (0..SIDE * SIDE).map(|_| rng.f32(0.0, 1.0)).collect();
    let mut texture = chain(|_, x, y| texels[(y * SIDE + x) as usize]);
    texture.generate_mips();
    let sampler = Sampler::linear(AddressMode::MirrorRepeat);
    let list = triangles();
    let definition = drawn(scalar_device(), Ways, &texture, sampler, &list);
    let [implicit, explicit, computed] = [0, 1, 2].map(|c| definition.channel(0, c));
    assert_eq!(first_difference(SIDE, &implicit, &explicit), None, "sample and sample_grad");
    assert_eq!(first_difference(SIDE, &implicit, &computed), None, "varyings and computed coordinates");
    // The levels are of all kinds, and a texture without them would look otherwise.
    let levels = definition.channel(1, 1);
    let [least, greatest] = [levels.iter().copied().fold(9.0, f32::min), levels.iter().copied().fold(-9.0, f32::max)];
    assert!(greatest - least > 3.0, "levels from {least} to {greatest}");
    assert!(difference_count(&implicit, &definition.channel(0, 3)) > 500, "a bias shows");
    for canvas in [
        drawn(device(), Ways, &texture, sampler, &list),
        drawn(scalar_device(), Joined, &texture, sampler, &list),
        drawn(device(), Joined, &texture, sampler, &list),
    ] {
        assert_eq!(canvas.bytes(), definition.bytes());
    }
}
