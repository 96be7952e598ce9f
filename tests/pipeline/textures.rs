//! Texture reads: filters, address modes, mip levels, cubes, volumes, comparison, loads, and reading what an earlier pass drew.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v2, v3, v4};
use nephroid_pipeline::sampler::{
    AddressMode, FilterMode, Sampler, load, sample_3d, sample_compare, sample_cube, sample_grad, sample_level,
};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying};
use nephroid_pipeline::state::{CompareFunction, TextureFormat};
use nephroid_pipeline::{Binding, BindingKind, Bindings, Draw, Texture, TextureDescriptor, TextureShape};

use super::passes::*;

fn texture(width: u32, height: u32, values: impl Fn(u32, u32) -> f32) -> Texture {
    let mut texture = Texture::new(TextureDescriptor::d2("t", width, height, TextureFormat::R32Float)).expect("valid");
    for y in 0..height {
        for x in 0..width {
            texture.set_texel(0, 0, x, y, [values(x, y), 0.0, 0.0, 0.0]);
        }
    }
    texture
}

fn sample(texture: &Texture, sampler: &Sampler, u: f32, v: f32, lod: f32) -> f32 {
    sample_level::<f32>(&texture.view(), sampler, v2(u, v), 0, lod).x
}

fn modes(mode: AddressMode, filter: FilterMode) -> Sampler {
    Sampler { address_mode: [mode; 3], mag_filter: filter, min_filter: filter, ..Sampler::default() }
}

#[test]
fn nearest_and_address_modes() {
    let t = texture(4, 2, |x, y| (10 * y + x) as f32);
    // Texel column for u from −1.125 in steps of a quarter, per mode.
    let columns = |mode: AddressMode| -> Vec<u32> {
        (-5..10).map(|i| (sample(&t, &modes(mode, FilterMode::Nearest), i as f32 * 0.25 + 0.125, 0.25, 0.0)) as u32).collect()
    };
    assert_eq!(columns(AddressMode::ClampToEdge), [0, 0, 0, 0, 0, 0, 1, 2, 3, 3, 3, 3, 3, 3, 3]);
    assert_eq!(columns(AddressMode::Repeat), [3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1]);
    assert_eq!(columns(AddressMode::MirrorRepeat), [3, 3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0, 0, 1]);
    // A texel owns its left edge.
    assert_eq!(sample(&t, &modes(AddressMode::ClampToEdge, FilterMode::Nearest), 0.5, 0.25, 0.0), 2.0);
    assert_eq!(sample(&t, &modes(AddressMode::ClampToEdge, FilterMode::Nearest), 0.0, 0.75, 0.0), 10.0);
}

#[test]
fn linear_is_the_bilinear_formula() {
    let mut rng = Rng(701);
    let values: Vec<f32> = (0..35).map(|_| rng.f32(-1.0, 1.0)).collect();
    let t = texture(7, 5, |x, y| values[(y * 7 + x) as usize]);
    for mode in [AddressMode::ClampToEdge, AddressMode::Repeat, AddressMode::MirrorRepeat] {
        let wrap = |i: i64, n: i64| match mode {
            AddressMode::Repeat => i.rem_euclid(n),
            AddressMode::MirrorRepeat => {
                let m = i.rem_euclid(2 * n);
                m.min(2 * n - 1 - m)
            }
            _ => i.clamp(0, n - 1),
        };
        for _ in 0..2_000 {
            let (u, v) = (rng.f32(-2.0, 3.0), rng.f32(-2.0, 3.0));
            let (x, y) = (f64::from(u) * 7.0 - 0.5, f64::from(v) * 5.0 - 0.5);
            let mut expected = 0.0;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (fx, fy) = (x - x.floor(), y - y.floor());
                let weight = (if dx == 1 { fx } else { 1.0 - fx }) * (if dy == 1 { fy } else { 1.0 - fy });
                let texel = wrap(y.floor() as i64 + dy, 5) * 7 + wrap(x.floor() as i64 + dx, 7);
                expected += weight * f64::from(values[texel as usize]);
            }
            let seen = sample(&t, &modes(mode, FilterMode::Linear), u, v, 0.0);
            assert!((f64::from(seen) - expected).abs() < 1.0e-5, "{mode:?} at ({u}, {v}): {seen}, expected {expected}");
        }
    }
    // A formula with the weights exchanged is told apart.
    let seen = sample(&t, &modes(AddressMode::ClampToEdge, FilterMode::Linear), 0.3, 0.3, 0.0);
    let other = sample(&t, &modes(AddressMode::ClampToEdge, FilterMode::Linear), 0.4, 0.3, 0.0);
    assert!((seen - other).abs() > 1.0e-5);
}

fn mipped() -> Texture {
    let desc = TextureDescriptor { mip_level_count: 4, ..TextureDescriptor::d2("mips", 8, 8, TextureFormat::R32Float) };
    let mut t = Texture::new(desc).expect("valid");
    for level in 0..4 {
        let size = 8 >> level;
        for at in 0..size * size {
            t.set_texel(level, 0, at % size, at / size, [100.0 * level as f32, 0.0, 0.0, 0.0]);
        }
    }
    t
}

#[test]
fn mip_levels() {
    let t = mipped();
    let nearest = Sampler::default();
    let linear = Sampler { mipmap_filter: FilterMode::Linear, ..nearest };
    for (lod, level, blend) in [
        (-1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.25, 0.0, 25.0),
        (0.75, 100.0, 75.0),
        (1.0, 100.0, 100.0),
        (2.5, 300.0, 250.0),
        (9.0, 300.0, 300.0),
    ] {
        assert_eq!(sample(&t, &nearest, 0.5, 0.5, lod), level, "lod {lod}");
        assert_eq!(sample(&t, &linear, 0.5, 0.5, lod), blend, "lod {lod}");
    }
    let clamped = Sampler { lod_min_clamp: 1.0, lod_max_clamp: 1.5, ..linear };
    assert_eq!(sample(&t, &clamped, 0.5, 0.5, 0.0), 100.0);
    assert_eq!(sample(&t, &clamped, 0.5, 0.5, 3.0), 150.0);
    // Two texels per pixel is level 1, four is level 2; anisotropic footprints take the longer side.
    let grad = |dx: f32, dy: f32| sample_grad::<f32>(&t.view(), &linear, v2(0.5, 0.5), 0, v2(dx, 0.0), v2(0.0, dy)).x;
    assert_eq!(grad(2.0 / 8.0, 2.0 / 8.0), 100.0);
    assert_eq!(grad(4.0 / 8.0, 1.0 / 8.0), 200.0);
    assert_eq!(grad(0.0, 0.0), 0.0);
}

#[test]
fn generated_mips_are_averages() {
    let desc = TextureDescriptor { mip_level_count: 3, ..TextureDescriptor::d2("mips", 4, 4, TextureFormat::R32Float) };
    let mut t = Texture::new(desc).expect("valid");
    for at in 0..16 {
        t.set_texel(0, 0, at % 4, at / 4, [at as f32, 0.0, 0.0, 0.0]);
    }
    t.generate_mips();
    assert_eq!(t.read_channel(1, 0, 0), [2.5, 4.5, 10.5, 12.5]);
    assert_eq!(t.read_channel(2, 0, 0), [7.5]);
}

#[test]
fn cube_faces_by_the_specification() {
    let desc =
        TextureDescriptor { depth_or_layers: 6, shape: TextureShape::Cube, ..TextureDescriptor::d2("cube", 4, 4, TextureFormat::R32Float) };
    let mut t = Texture::new(desc).expect("valid");
    for layer in 0..6 {
        for at in 0..16 {
            t.set_texel(0, layer, at % 4, at / 4, [(100 * layer + 10 * (at / 4) + at % 4) as f32, 0.0, 0.0, 0.0]);
        }
    }
    let sampler = Sampler::default();
    let read = |d: [f32; 3]| sample_cube::<f32>(&t.view(), &sampler, v3(d[0], d[1], d[2]), 0.0).x;
    // Direction of each face's right and down, from the table of face coordinates [Vulkan spec, cube map face selection].
    type Face = ([f32; 3], [f32; 3], [f32; 3]);
    let faces: [Face; 6] = [
        ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]),
        ([-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]),
        ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ([0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
        ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ([0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
    ];
    for (layer, (major, right, down)) in faces.into_iter().enumerate() {
        for row in 0..4 {
            for column in 0..4 {
                let at = |texel: i32| (texel as f32 + 0.5) / 2.0 - 1.0;
                for length in [0.1, 1.0, 30.0] {
                    let d = std::array::from_fn(|i| (major[i] + right[i] * at(column) + down[i] * at(row)) * length);
                    assert_eq!(read(d), (100 * layer as i32 + 10 * row + column) as f32, "face {layer}, direction {d:?}");
                }
            }
        }
    }
}

#[test]
fn volumes() {
    let desc =
        TextureDescriptor { depth_or_layers: 3, shape: TextureShape::D3, ..TextureDescriptor::d2("volume", 2, 2, TextureFormat::R32Float) };
    let mut t = Texture::new(desc).expect("valid");
    for slice in 0..3 {
        for at in 0..4 {
            t.set_texel(0, slice, at % 2, at / 2, [(100 * slice + at) as f32, 0.0, 0.0, 0.0]);
        }
    }
    let read = |sampler: &Sampler, p: V3<f32>| sample_3d::<f32>(&t.view(), sampler, p, 0.0).x;
    let nearest = Sampler::default();
    assert_eq!(read(&nearest, v3(0.25, 0.25, 0.5)), 100.0);
    assert_eq!(read(&nearest, v3(0.75, 0.75, 0.9)), 203.0);
    let linear = Sampler::linear(AddressMode::ClampToEdge);
    assert_eq!(read(&linear, v3(0.5, 0.5, 0.5)), 101.5);
    assert!((read(&linear, v3(0.5, 0.5, 1.0 / 3.0)) - 51.5).abs() < 1.0e-4);
    let repeat = Sampler { address_mode: [AddressMode::Repeat; 3], ..nearest };
    assert_eq!(read(&repeat, v3(0.25, 0.25, 1.1)), 0.0);
}

#[test]
fn comparison_counts_texels() {
    let t = texture(4, 4, |x, _| x as f32 * 0.25);
    for (function, expected) in [
        (CompareFunction::Less, [0.0, 0.0, 1.0]),
        (CompareFunction::LessEqual, [0.0, 1.0, 1.0]),
        (CompareFunction::Greater, [1.0, 0.0, 0.0]),
        (CompareFunction::GreaterEqual, [1.0, 1.0, 0.0]),
        (CompareFunction::Equal, [0.0, 1.0, 0.0]),
        (CompareFunction::NotEqual, [1.0, 0.0, 1.0]),
        (CompareFunction::Never, [0.0; 3]),
        (CompareFunction::Always, [1.0; 3]),
    ] {
        let sampler = Sampler { compare: Some(function), ..Sampler::default() };
        let seen = [0.375, 0.625, 0.875].map(|u| sample_compare::<f32>(&t.view(), &sampler, v2(u, 0.5), 0, 0.5));
        assert_eq!(seen, expected, "{function:?}: reference 0.5 against 0.25, 0.5, 0.75");
    }
    // Percentage-closer: the share of the four texels, weighted as colours would be.
    let pcf = Sampler::comparison(CompareFunction::Less);
    assert_eq!(sample_compare::<f32>(&t.view(), &pcf, v2(0.75, 0.5), 0, 0.6), 0.5f32 + 0.0);
    assert_eq!(sample_compare::<f32>(&t.view(), &pcf, v2(0.6875, 0.5), 0, 0.6), 0.25);
    // A unorm texture clamps the reference: 2 is 1, which 1 equals.
    let mut depth = Texture::new(TextureDescriptor::d2("d", 2, 2, TextureFormat::Depth16Unorm)).expect("valid");
    depth.write_bytes(0, 0, &[0xff; 8]).expect("eight bytes");
    let equal = Sampler { compare: Some(CompareFunction::LessEqual), ..Sampler::default() };
    assert_eq!(sample_compare::<f32>(&depth.view(), &equal, v2(0.5, 0.5), 0, 2.0), 1.0);
}

#[test]
fn loads_outside_give_zero() {
    let t = texture(3, 3, |x, y| 1.0 + (3 * y + x) as f32);
    for (x, y, expected) in [(0.0, 0.0, 1.0), (2.0, 2.0, 9.0), (3.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0e9, 0.0), (f32::NAN, 0.0, 0.0)] {
        assert_eq!(load::<f32>(&t.view(), x, y, 0, 0).x, expected, "({x}, {y})");
    }
}

/// Copies a texture by four ways of reading it.
struct Copy;

impl FragmentShader for Copy {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let t = bindings.texture(1);
        let (w, h) = (t.level_size(0).0 as f32, t.level_size(0).1 as f32);
        let (x, y) = (input.position.x, input.position.y);
        let uv = v2(x / w, y / h);
        let zero = L::splat(input.token, 0.0);
        let sampled = sample_level(t, &bindings.sampler(2), uv, 0, zero);
        let graded =
            sample_grad(t, &bindings.sampler(2), input.varying2(0), 0, v2(input.ddx(0), input.ddx(1)), v2(input.ddy(0), input.ddy(1)));
        output.color[0] = v4(sampled.x, graded.x, load(t, x - 0.5, y - 0.5, 0, 0).x, input.texel_here(t, 0));
    }
}

#[test]
fn passes_read_what_passes_drew() {
    let size = (70, 45);
    // First pass: random triangles into one channel.
    let mut rng = Rng(702);
    let first = pipeline(pull_program(VaryingColor, Interpolation::Flat), |desc| desc.targets = vec![additive(TextureFormat::R32Float)]);
    let triangles: Vec<Vertex> =
        (0..300).map(|_| vertex(clip_from_px(size, [rng.real(0.0, 70.0), rng.real(0.0, 45.0)], 0.5), [rng.f32(0.0, 1.0); 4])).collect();
    let mut source = Canvas::single(size, TextureFormat::R32Float);
    draw(&mut source, &first, &triangles);
    let drawn = source.channel(0, 0);
    assert!(drawn.iter().any(|v| *v > 1.0));
    // Second pass: read it back in every way.
    let program = Program {
        bindings: vec![BindingKind::Storage(32), BindingKind::Texture, BindingKind::Sampler],
        varyings: vec![Varying { name: "uv", components: 4, interpolation: Interpolation::Perspective }],
        ..pull_program(Copy, Interpolation::Perspective)
    };
    let second = pipeline(program, |desc| desc.targets = vec![target(TextureFormat::Rgba32Float)]);
    // u and v run from 0 to 1 over the target.
    let corners = [[-1.0, 1.0], [-1.0, -3.0], [3.0, 1.0]]
        .map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [(x + 1.0) / 2.0, (1.0 - y) / 2.0, 0.0, 0.0]));
    let vertices = Vertices::new(&corners);
    for device in [device(), scalar_device()] {
        let texture = source.color[0].as_ref().expect("drawn");
        let entries = [vertices.entries()[0], Binding::Texture(texture.view()), Binding::Sampler(Sampler::default())];
        let mut canvas = Canvas::single(size, TextureFormat::Rgba32Float);
        canvas.run_on(device, vec![Draw::new(&second, Bindings::new(&entries, 0), 0..3, size)], None);
        for channel in 0..4 {
            assert_eq!(first_difference(size.0, &drawn, &canvas.channel(0, channel)), None, "way {channel} of reading a texture");
        }
    }
}
