//! What drivers make of texels of every format, and of levels of detail: the same textures read by the same shaders on both sides.

use std::sync::Arc;

use nephroid::frame::{BindEntry, ColorAttachment, Draw, Frame, Pass};
use nephroid::frame::{Contents, pipelines, run_frame_pass};
use nephroid::gpu::crosscheck::relative;
use nephroid::gpu::{Family, Gpu, GpuFrame, Vertices, adapters};
use nephroid::math::lanes::Lanes;
use nephroid::math::rng::uniform3;
use nephroid::math::vector::{V2, v2, v4};
use nephroid::pipeline::sampler::{AddressMode, FilterMode, Sampler, load};
use nephroid::pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid::pipeline::state::{Color, ColorTargetState, ColorWrites, TextureFormat};
use nephroid::pipeline::{
    BindingKind, Bindings, ChannelKind, Coordinates, Device, DeviceOptions, FORMATS, FragmentPlace, LoadOp, RenderPipelineDescriptor,
    Texture, TextureDescriptor, format_info,
};

/// Side of textures and targets.
const SIDE: u32 = 64;

/// One triangle over the whole target; `uv` goes from 0 to `scale` across it.
struct Fullscreen {
    scale: f32,
}

impl VertexShader for Fullscreen {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let x = input.per_vertex(|i| if i == 1 { 3.0 } else { -1.0 });
        let y = input.per_vertex(|i| if i == 2 { 3.0 } else { -1.0 });
        output.position = v4(x, y, x.like(0.5), x.like(1.0));
        output.varyings[0] = (x + 1.0) * (0.5 * self.scale);
        output.varyings[1] = (-y + 1.0) * (0.5 * self.scale);
    }
}

const VERTEX_TWIN: &str = "
override scale: f32;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    let at = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return Varyings(vec4<f32>(at, 0.5, 1.0), vec2<f32>(at.x + 1.0, 1.0 - at.y) * (0.5 * scale));
}
";

/// The texel at the fragment's own pixel.
struct Load;

impl FragmentShader for Load {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = load(bindings.texture(0), input.position.x - 0.5, input.position.y - 0.5, 0, 0);
    }
}

/// The texture at the coordinates, at the level that the quad gives.
struct Sampled;

impl FragmentShader for Sampled {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = input.sample(bindings.texture(0), &bindings.sampler(1), 0, 0);
    }
}

/// The same at coordinates that grow with the square of the distance: derivatives of what a shader computes.
struct SampledSquares;

struct Squares;

impl Coordinates for Squares {
    #[inline(always)]
    fn coordinates<L: Lanes>(&self, place: &FragmentPlace<'_, L>) -> V2<L> {
        let uv = place.varying2(0);
        v2(uv.x * uv.x, uv.y)
    }
}

impl FragmentShader for SampledSquares {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = input.sample_computed(bindings.texture(0), &bindings.sampler(1), &Squares, 0);
    }
}

/// The fragment twins, by what they return and what they do.
macro_rules! twin {
    (load, $scalar:literal) => {
        concat!(
            "@group(0) @binding(0) var texels: texture_2d<",
            $scalar,
            ">;\n@fragment\nfn fs(in: Varyings) -> @location(0) vec4<",
            $scalar,
            "> {\n    return textureLoad(texels, vec2<i32>(in.position.xy), 0);\n}\n"
        )
    };
    (sample, $uv:literal) => {
        concat!(
            "@group(0) @binding(0) var texels: texture_2d<f32>;\n@group(0) @binding(1) var sampling: sampler;\n@fragment\n",
            "fn fs(in: Varyings) -> @location(0) vec4<f32> {\n    return textureSample(texels, sampling, ",
            $uv,
            ");\n}\n"
        )
    };
}

fn program(fragment: impl FragmentShader + 'static, twin: &'static str, bindings: Vec<BindingKind>, scale: f32) -> Program {
    let source: &'static str = Box::leak(format!("{VERTEX_TWIN}{twin}").into_boxed_str());
    Program {
        varyings: vec![Varying { name: "uv", components: 2, interpolation: Interpolation::Perspective }],
        bindings,
        wgsl: Some(source),
        wgsl_constants: vec![("scale", scale.into())],
        ..Program::new("formats", Fullscreen { scale }, fragment)
    }
}

/// Draws with `contents` as the first binding on both sides; what the software GPU and the driver have in the target.
fn draw_on_both(gpu: &Gpu, device: &Device, contents: &Texture, sampler: Option<Sampler>, program: Program) -> [Texture; 2] {
    let mut frame = Frame { rules: gpu.adapter().family().candidates()[0].1, ..Frame::default() };
    let texture = frame.texture(contents.desc().clone());
    let format = match contents.info().kind {
        ChannelKind::Uint(_) => TextureFormat::Rgba32Uint,
        ChannelKind::Sint(_) => TextureFormat::Rgba32Sint,
        _ => TextureFormat::Rgba32Float,
    };
    let target = frame.texture(TextureDescriptor::d2("target", SIDE, SIDE, format));
    let group = frame.bind_group([BindEntry::texture(texture)].into_iter().chain(sampler.map(BindEntry::Sampler)).collect());
    let pipeline = frame.pipeline(RenderPipelineDescriptor {
        targets: vec![Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL })],
        ..RenderPipelineDescriptor::new("formats", Arc::new(program))
    });
    frame.passes.push(Pass {
        label: "formats".into(),
        color: vec![Some(ColorAttachment { view: target.into(), load: LoadOp::Clear(Color { r: 9.0, g: 9.0, b: 9.0, a: 9.0 }) })],
        draws: vec![Draw::new(pipeline, group, 0..3)],
        ..Pass::default()
    });
    let mut expected = Contents::initial(&frame).expect("valid textures");
    expected.textures[texture.index()] = contents.clone();
    let mut actual = expected.clone();
    run_frame_pass(device, &frame, &pipelines(&frame).expect("valid"), &frame.passes[0], &mut expected, None).expect("valid");
    let mut on_gpu = GpuFrame::new(gpu, &frame).expect("the driver can hold it");
    on_gpu.upload(texture, contents).expect("the driver takes the texture");
    let ready = on_gpu.prepare(0, 0..1, Vertices::Shaded, device, &actual).expect("the driver can draw it");
    on_gpu.run([&ready]).expect("the driver draws");
    on_gpu.download(target.into(), &mut actual.textures[target.index()]).expect("the driver hands it back");
    [expected, actual].map(|mut contents| contents.textures.swap_remove(target.index()))
}

fn on_drivers(check: impl Fn(&Gpu, &Device)) {
    let all = adapters();
    if all.is_empty() {
        assert!(std::env::var_os("NEPHROID_REQUIRE_ADAPTER").is_none(), "an adapter is required, and there is none");
        eprintln!("not run: there is no Vulkan adapter");
    }
    let device = Device::new(DeviceOptions::default()).expect("threads start");
    for adapter in all {
        check(&Gpu::open(adapter).expect("the driver opens"), &device);
    }
}

/// Greatest [`relative`] error of four channels, relative to no less than `scale`, and whether any bit differs.
fn difference(expected: &Texture, actual: &Texture, scale: f64) -> (f64, bool) {
    let (e, a) = (expected.surface(0, 0), actual.surface(0, 0));
    let mut greatest = 0.0f64;
    let mut differs = false;
    for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
        for channel in 0..4 {
            let (e, a) = (e.get(x, y, channel), a.get(x, y, channel));
            let is_nan = !expected.info().kind.is_integer() && e.is_nan() && a.is_nan();
            differs |= e.to_bits() != a.to_bits() && !is_nan;
            greatest = greatest.max(relative(e, a, scale));
        }
    }
    (greatest, differs)
}

/// A texture of random bytes: every code of narrow channels, any bits of wide ones.
fn random_texels(format: TextureFormat) -> Texture {
    let mut texture = Texture::new(TextureDescriptor::d2("texels", SIDE, SIDE, format)).expect("valid");
    let info = texture.info();
    let count = (SIDE * SIDE) as usize * info.bytes;
    let mut bytes: Vec<u8> =
        (0..count).map(|i| (uniform3(11, info.bytes as u32 * 8 + info.channels as u32, i as u32)[0] * 256.0) as u8).collect();
    // The ends of every range.
    bytes[..info.bytes].fill(0);
    bytes[info.bytes..2 * info.bytes].fill(0xff);
    bytes[2 * info.bytes..3 * info.bytes].fill(0x80);
    bytes[3 * info.bytes..4 * info.bytes].fill(0x7f);
    texture.write_bytes(0, 0, &bytes).expect("the right length");
    texture
}

/// llvmpipe and SwiftShader multiply by the reciprocal of the greatest code; we divide.
const RECIPROCAL: f64 = 1.3e-7;
/// Drivers approximate the sRGB curve: less than half a step of 1/255 away.
const CURVE: f64 = 0.5 / 255.0;

#[test]
fn texels_of_every_format_reach_shaders_alike() {
    on_drivers(|gpu, device| {
        for format in FORMATS {
            let info = format_info(format).expect("listed");
            if info.depth || info.stencil {
                continue;
            }
            let contents = random_texels(format);
            let twin = match info.kind {
                ChannelKind::Uint(_) => twin!(load, "u32"),
                ChannelKind::Sint(_) => twin!(load, "i32"),
                _ => twin!(load, "f32"),
            };
            let [expected, actual] = draw_on_both(gpu, device, &contents, None, program(Load, twin, vec![BindingKind::Texture], 1.0));
            let scale = if info.kind == ChannelKind::Srgb8 { 1.0 } else { 0.0 };
            let (error, differs) = difference(&expected, &actual, scale);
            let bound = match info.kind {
                ChannelKind::Unorm8 | ChannelKind::Unorm10 | ChannelKind::Snorm8 => Some(RECIPROCAL),
                ChannelKind::Srgb8 => Some(CURVE),
                _ => None,
            };
            let holds = bound.map_or(!differs, |bound| error <= bound);
            assert!(holds, "{format:?} on {}: relative error {error:e}", gpu.adapter().title());
            // What was read is what was written, not the clear value or zeros.
            let first = |y: u32| expected.surface(0, 0).get(1, y, 0).to_bits();
            assert!((0..SIDE).any(|y| first(y) != first(0)), "{format:?}");
        }
    });
}

/// Levels of one number each: what is read is the level.
fn levels() -> Texture {
    let desc = TextureDescriptor { mip_level_count: 7, ..TextureDescriptor::d2("levels", SIDE, SIDE, TextureFormat::R32Float) };
    let mut texture = Texture::new(desc).expect("valid");
    for level in 0..7 {
        let side = SIDE >> level;
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            texture.set_texel(level, 0, x, y, [level as f32, 0.0, 0.0, 0.0]);
        }
    }
    texture
}

#[test]
fn implicit_levels_of_detail_agree() {
    let nearest = Sampler { address_mode: [AddressMode::Repeat; 3], ..Sampler::default() };
    let linear = Sampler { mipmap_filter: FilterMode::Linear, ..nearest };
    on_drivers(|gpu, device| {
        if gpu.adapter().family() == Family::Other {
            return;
        }
        let contents = levels();
        let bindings = || vec![BindingKind::Texture, BindingKind::Sampler];
        for step in 0..14u8 {
            // A quarter of a level away from where the nearest level changes.
            let scale = libm::exp2f(f32::from(step) * 0.5 + 0.25);
            let draw = |sampler| {
                let program = program(Sampled, twin!(sample, "in.uv"), bindings(), scale);
                draw_on_both(gpu, device, &contents, Some(sampler), program)
            };
            let [expected, actual] = draw(nearest);
            let level = (f32::from(step) * 0.5 + 0.25).round_ties_even().min(6.0);
            assert!(expected.read_channel(0, 0, 0).iter().all(|v| *v == level), "{scale}: not level {level}");
            assert!(!difference(&expected, &actual, 0.0).1, "{scale} on {}", gpu.adapter().title());
            let [expected, actual] = draw(linear);
            let worst =
                expected.read_channel(0, 0, 0).iter().zip(actual.read_channel(0, 0, 0)).map(|(e, a)| (e - a).abs()).fold(0.0, f32::max);
            assert!(worst <= LEVEL, "{scale} on {}: {worst}", gpu.adapter().title());
        }
        // Derivatives of computed coordinates: the level grows across the target; nearest levels switch in the same columns, but for one.
        let program = program(SampledSquares, twin!(sample, "vec2<f32>(in.uv.x * in.uv.x, in.uv.y)"), bindings(), 4.0);
        let [expected, actual] = draw_on_both(gpu, device, &contents, Some(nearest), program);
        let [e, a] = [&expected, &actual].map(|t| t.read_channel(0, 0, 0));
        assert!(e.contains(&2.0) && e.contains(&4.0), "{e:?}");
        let differing = e.iter().zip(&a).filter(|(e, a)| e != a).count();
        assert!(differing <= (4 * SIDE) as usize, "{differing} pixels on {}", gpu.adapter().title());
    });
}

/// Drivers approximate the logarithm: levels are off by so much.
const LEVEL: f32 = 0.05;
