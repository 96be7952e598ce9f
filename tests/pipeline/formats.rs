//! Targets and textures of every format: what is written, rounded, blended, read and refused.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{v2, v4};
use nephroid_pipeline::sampler::{AddressMode, Sampler, load, sample_level};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::{Color, ColorTargetState, ColorWrites, F16Rounding, RasterRules, TextureFormat};
use nephroid_pipeline::{
    Binding, BindingKind, Bindings, ChannelKind, Draw, FORMATS, FormatInfo, RenderPipeline, RenderPipelineDescriptor, Texture,
    TextureDescriptor, decode_texel, f32_to_ufloat, format_info, ufloat_to_f32,
};

use super::passes::*;

fn facts(format: TextureFormat) -> FormatInfo {
    format_info(format).expect("listed")
}

fn colors() -> impl Iterator<Item = TextureFormat> {
    FORMATS.into_iter().filter(|format| !facts(*format).depth && !facts(*format).stencil)
}

fn fullscreen(color: [f32; 4]) -> [Vertex; 3] {
    [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| vertex([x, y, 0.5, 1.0], color))
}

/// Integers at the ends of every width, and some that look like not-a-number, infinity, zero or denormal floats.
const INTEGERS: [u32; 16] = [0, 1, 3, 4, 127, 128, 255, 256, 1023, 1024, 32768, 65536, 0x7f80_0001, 0xffff_ff80, 0xffff_8000, 0x8000_0000];

/// The pixel's number as an integer of [`INTEGERS`], the next ones in the other channels.
struct WriteIntegers;

impl FragmentShader for WriteIntegers {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let channel = |c: usize| (input.position.x - 0.5).map(|x| f32::from_bits(INTEGERS[(x as usize + c) % INTEGERS.len()]));
        output.color[0] = v4(channel(0), channel(1), channel(2), channel(3));
    }
}

/// What an integer becomes in so many bits: D3D's rule, written out with wide integers.
fn clamped(kind: ChannelKind, channel: usize, pattern: u32) -> u32 {
    let bits = kind.channel_bits(channel);
    match kind {
        ChannelKind::Sint(_) => i64::from(pattern as i32).clamp(-(1i64 << (bits - 1)), (1i64 << (bits - 1)) - 1) as u32,
        _ => u64::from(pattern).min((1u64 << bits) - 1) as u32,
    }
}

#[test]
fn integer_targets_keep_what_fits_and_clamp_the_rest() {
    for format in colors().filter(|format| facts(*format).kind.is_integer()) {
        let info = facts(format);
        let pipeline = pipeline(plain_program(WriteIntegers), |desc| desc.targets = vec![target(format)]);
        for device in [device(), scalar_device()] {
            let mut canvas = Canvas::single((16, 3), format);
            canvas.clear = [5.0, 2.0, 1.0e12, -1.0e12];
            canvas.run_on(device, Vec::new(), None);
            for channel in 0..info.channels {
                let cleared = [5, 2, u32::MAX, i32::MIN as u32][channel];
                let expected = match (info.kind, channel) {
                    (ChannelKind::Sint(_), 2) => clamped(info.kind, channel, i32::MAX as u32),
                    (ChannelKind::Uint(_), 3) => 0,
                    _ => clamped(info.kind, channel, cleared),
                };
                assert_eq!(canvas.pixel(0, 3, 2)[channel].to_bits(), expected, "{format:?}, channel {channel}, cleared");
            }
            draw_on(device, &mut canvas, &pipeline, &fullscreen([0.0; 4]));
            let bytes = canvas.bytes();
            for (pixel, texel) in bytes.chunks_exact(info.bytes).enumerate() {
                let decoded = decode_texel(info, texel);
                for channel in 0..info.channels {
                    let expected = clamped(info.kind, channel, INTEGERS[(pixel % 16 + channel) % INTEGERS.len()]);
                    assert_eq!(decoded[channel].to_bits(), expected, "{format:?}, pixel {pixel}, channel {channel}");
                    assert_eq!(canvas.pixel(0, (pixel % 16) as u32, (pixel / 16) as u32)[channel].to_bits(), expected, "the plane");
                }
            }
        }
    }
}

#[test]
fn integer_targets_honour_write_masks_and_coverage() {
    let format = TextureFormat::Rgba8Uint;
    let masked = |mask| Some(ColorTargetState { format, blend: None, write_mask: mask });
    let pipeline = pipeline(pull_program(FlatColor, Interpolation::Flat), |desc| {
        desc.targets = vec![masked(ColorWrites::RED | ColorWrites::ALPHA)];
    });
    let mut canvas = Canvas::single((8, 8), format);
    canvas.clear = [1.0, 2.0, 3.0, 4.0];
    // The left half of the target.
    let color = [10, 20, 30, 300].map(f32::from_bits);
    let left = [[-1.0, -1.0], [0.0, -1.0], [-1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [0.0, 1.0]];
    draw(&mut canvas, &pipeline, &left.map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], color)));
    assert_eq!(canvas.pixel(0, 3, 5).map(f32::to_bits), [10, 2, 3, 255]);
    assert_eq!(canvas.pixel(0, 4, 5).map(f32::to_bits), [1, 2, 3, 4]);
}

/// Reads a texture at the pixel by [`load`], and through a linear sampler.
struct Read;

impl FragmentShader for Read {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let texture = bindings.texture(1);
        let (x, y) = (input.position.x, input.position.y);
        output.color[0] = load(texture, x - 0.5, y - 0.5, 0, 0);
        let uv = v2((x + 0.25) / texture.level_size(0).0 as f32, y / texture.level_size(0).1 as f32);
        output.color[1] = sample_level(texture, &Sampler::linear(AddressMode::ClampToEdge), uv, 0, x.like(0.0));
    }
}

#[test]
fn textures_of_every_format_reach_shaders_as_their_bytes_say() {
    const SIZE: (u32, u32) = (70, 9);
    let mut rng = Rng(31);
    for format in colors() {
        let info = facts(format);
        let mut texture = Texture::new(TextureDescriptor::d2("t", SIZE.0, SIZE.1, format)).expect("valid");
        let bytes: Vec<u8> = (0..SIZE.0 as usize * SIZE.1 as usize * info.bytes).map(|_| rng.next() as u8).collect();
        texture.write_bytes(0, 0, &bytes).expect("the right length");
        let wide = if info.kind.is_integer() { TextureFormat::Rgba32Uint } else { TextureFormat::Rgba32Float };
        let program = Program { bindings: vec![BindingKind::Storage(32), BindingKind::Texture], ..plain_program(Read) };
        let pipeline = pipeline(program, |desc| desc.targets = vec![target(wide); 2]);
        let vertices = Vertices::new(&fullscreen([0.0; 4]));
        for device in [device(), scalar_device()] {
            let entries = [vertices.entries()[0], Binding::Texture(texture.view())];
            let mut canvas = Canvas::new(SIZE, &[Some(wide); 2], None);
            canvas.run_on(device, vec![Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, SIZE)], None);
            for (pixel, texel) in bytes.chunks_exact(info.bytes).enumerate() {
                let (x, y) = (pixel as u32 % SIZE.0, pixel as u32 / SIZE.0);
                let mut expected = decode_texel(info, texel);
                if info.channels < 4 {
                    expected[info.channels..].fill(0.0);
                    expected[3] = if info.kind.is_integer() { f32::from_bits(1) } else { 1.0 };
                }
                let seen = canvas.pixel(0, x, y);
                for channel in 0..4 {
                    let (seen, expected) = (seen[channel], expected[channel]);
                    assert!(seen.to_bits() == expected.to_bits(), "{format:?} at ({x}, {y}), channel {channel}: {seen} not {expected}");
                }
                // A quarter of a texel to the right of its centre, an integer is still that of the texel.
                if info.kind.is_integer() {
                    assert_eq!(canvas.pixel(1, x, y).map(f32::to_bits), expected.map(f32::to_bits), "{format:?} at ({x}, {y})");
                }
            }
        }
    }
}

#[test]
fn blue_first_is_an_order_of_bytes_alone() {
    let formats = [(TextureFormat::Rgba8Unorm, TextureFormat::Bgra8Unorm), (TextureFormat::Rgba8UnormSrgb, TextureFormat::Bgra8UnormSrgb)];
    for (red_first, blue_first) in formats {
        let drawn = [red_first, blue_first].map(|format| {
            let pipeline = pipeline(pull_program(VaryingColor, Interpolation::Linear), |desc| desc.targets = vec![additive(format)]);
            let mut canvas = Canvas::single((17, 5), format);
            canvas.clear = [0.125, 0.25, 0.0, 0.5];
            let mut corners = fullscreen([0.5, 0.2, 0.9, 0.25]);
            corners[1][4..].copy_from_slice(&[0.0, 1.0, 0.3, 0.6]);
            draw(&mut canvas, &pipeline, &corners);
            canvas
        });
        for channel in 0..4 {
            assert_eq!(drawn[0].channel(0, channel), drawn[1].channel(0, channel), "planes are the same");
        }
        let [red, blue] = drawn.map(|canvas| canvas.bytes());
        assert_ne!(red, blue);
        let swapped: Vec<u8> = blue.chunks_exact(4).flat_map(|texel| [texel[2], texel[1], texel[0], texel[3]]).collect();
        assert_eq!(red, swapped);
    }
}

/// One fragment added to a clear value; what the pixel holds, under some rules.
fn added(format: TextureFormat, rules: RasterRules, clear: [f64; 4], color: [f32; 4]) -> [f32; 4] {
    let pipeline = pipeline_with(pull_program(FlatColor, Interpolation::Flat), rules, |desc| desc.targets = vec![additive(format)]);
    let mut canvas = Canvas::single((5, 3), format);
    canvas.clear = clear;
    draw(&mut canvas, &pipeline, &fullscreen(color));
    canvas.pixel(0, 4, 2)
}

#[test]
fn packed_floats_round_after_every_blend_by_the_rules() {
    let format = TextureFormat::Rg11b10Ufloat;
    let reference = RasterRules::REFERENCE;
    let truncating = RasterRules { f16_rounding: F16Rounding::TowardZero, ..reference };
    // Steps above 1 are 1/64 for red and green and 1/32 for blue: 1 + 0.75 steps, 1 + 1.25 steps, 1 + 1.5 steps.
    let color = [0.75 / 64.0, 1.25 / 64.0, 1.5 / 32.0, 0.0];
    assert_eq!(added(format, reference, [1.0; 4], color)[..3], [1.0 + 1.0 / 64.0, 1.0 + 1.0 / 64.0, 1.0 + 2.0 / 32.0]);
    assert_eq!(added(format, truncating, [1.0; 4], color)[..3], [1.0, 1.0 + 1.0 / 64.0, 1.0 + 1.0 / 32.0]);
    // Nothing below zero; beyond the greatest number infinity or that number.
    assert_eq!(added(format, reference, [1.0; 4], [-2.0, -1.0, 70000.0, 0.0])[..3], [0.0, 0.0, f32::INFINITY]);
    assert_eq!(added(format, truncating, [1.0; 4], [-0.5, 1.0e9, 70000.0, 0.0])[..3], [0.5, 65024.0, 64512.0]);
    let nan = added(format, reference, [1.0; 4], [f32::NAN, 0.0, 0.0, 0.0]);
    assert!(nan[0].is_nan() && nan[1] == 1.0, "{nan:?}");
    // Against the conversion itself, at random.
    let mut rng = Rng(77);
    for _ in 0..200 {
        let color: [f32; 4] = std::array::from_fn(|_| rng.f32(-1.0, 4.0));
        for rules in [reference, truncating] {
            let round = |v: f32, bits| ufloat_to_f32(f32_to_ufloat(v, bits, rules.f16_rounding), bits);
            let expected = [(0, 6), (1, 6), (2, 5)].map(|(channel, bits)| round(color[channel] + round(0.3, bits), bits));
            assert_eq!(added(format, rules, [f64::from(0.3f32); 4], color)[..3], expected);
        }
    }
}

#[test]
fn ten_bit_colours_round_to_their_steps_and_clamp() {
    let format = TextureFormat::Rgb10a2Unorm;
    let seen = added(format, RasterRules::REFERENCE, [0.0; 4], [0.5, 100.49 / 1023.0, 100.51 / 1023.0, 0.49]);
    assert_eq!(seen, [512.0 / 1023.0, 100.0 / 1023.0, 101.0 / 1023.0, 1.0 / 3.0]);
    // The source is clamped before it is blended: 0.5 + 1, not 0.5 + 3; and −1 is 0.
    assert_eq!(added(format, RasterRules::REFERENCE, [0.5, 0.5, 0.0, 1.0], [3.0, -1.0, f32::NAN, 1.0]), [1.0, 512.0 / 1023.0, 0.0, 1.0]);
}

#[test]
fn pipelines_refuse_what_webgpu_refuses() {
    let made = |state: ColorTargetState| {
        let mut desc = RenderPipelineDescriptor::new("p", Arc::new(pull_program(FlatColor, Interpolation::Flat)));
        desc.targets = vec![Some(state)];
        RenderPipeline::new(desc, RasterRules::REFERENCE)
    };
    for format in FORMATS {
        let info = facts(format);
        let plain = made(target(format).expect("a target"));
        let blended = made(additive(format).expect("a target"));
        assert_eq!(plain.is_ok(), info.renderable && !info.depth && !info.stencil, "{format:?}");
        assert_eq!(blended.is_ok(), info.blendable, "{format:?}");
        if let Err(error) = &blended {
            assert!(error.to_string().contains(&format!("{format:?}")), "{error}");
        }
    }
    let message = |format| made(additive(format).expect("a target")).expect_err("refused").to_string();
    assert!(message(TextureFormat::Rgba8Snorm).contains("cannot be a colour target"), "{}", message(TextureFormat::Rgba8Snorm));
    assert!(message(TextureFormat::Rg16Sint).contains("cannot be blended"), "{}", message(TextureFormat::Rg16Sint));
    assert!(message(TextureFormat::Bc1RgbaUnorm).contains("supported"), "{}", message(TextureFormat::Bc1RgbaUnorm));
}

#[test]
fn generated_mips_hold_numbers_of_the_format() {
    let mut rng = Rng(5);
    for format in colors() {
        let info = facts(format);
        let desc = TextureDescriptor { mip_level_count: 3, ..TextureDescriptor::d2("mips", 5, 4, format) };
        let mut texture = Texture::new(desc).expect("valid");
        let bytes: Vec<u8> = (0..20 * info.bytes).map(|_| (rng.next() & 0x3f) as u8).collect();
        texture.write_bytes(0, 0, &bytes).expect("the right length");
        texture.generate_mips();
        for level in 1..3 {
            let stored = texture.read_bytes(level, 0);
            let planes: Vec<_> = (0..info.channels).map(|c| texture.read_channel(level, 0, c)).collect();
            texture.write_bytes(level, 0, &stored).expect("the right length");
            for (channel, before) in planes.iter().enumerate() {
                let after = texture.read_channel(level, 0, channel);
                assert!(before.iter().zip(&after).all(|(a, b)| a.to_bits() == b.to_bits()), "{format:?}, level {level}");
            }
        }
        if info.kind.is_integer() {
            assert_eq!(texture.texel(1, 0, 1, 1)[0].to_bits(), texture.texel(0, 0, 2, 2)[0].to_bits(), "{format:?}");
        }
    }
    // By hand: the mean of 0, 10, 20 and 31 is 15.25 steps of 1/255.
    let desc = TextureDescriptor { mip_level_count: 2, ..TextureDescriptor::d2("mips", 2, 2, TextureFormat::R8Unorm) };
    let mut texture = Texture::new(desc).expect("valid");
    texture.write_bytes(0, 0, &[0, 10, 20, 31]).expect("four bytes");
    texture.generate_mips();
    assert_eq!(texture.read_bytes(1, 0), [15]);
}

#[test]
fn clears_of_packed_targets_round() {
    let mut canvas = Canvas::single((3, 3), TextureFormat::Rg11b10Ufloat);
    canvas.clear = [0.1, -1.0, 0.1, 0.0];
    canvas.run(Vec::new());
    let nearest = |bits| ufloat_to_f32(f32_to_ufloat(0.1, bits, F16Rounding::NearestEven), bits);
    assert_eq!(canvas.pixel(0, 1, 1)[..3], [nearest(6), 0.0, nearest(5)]);
    let color = Color { r: 0.1, g: -1.0, b: 0.1, a: 0.0 };
    assert_eq!(facts(TextureFormat::Rg11b10Ufloat).clear_value(color, F16Rounding::NearestEven)[..3], [nearest(6), 0.0, nearest(5)]);
}
