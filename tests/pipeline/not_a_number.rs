//! Not-a-number is stored in one bit pattern, whatever sign and payload it was computed with.

use nephroid_math::level::wide_levels;
use nephroid_pipeline::shader::{Interpolation, Program};
use nephroid_pipeline::state::TextureFormat;
use nephroid_pipeline::{Bindings, Device, DeviceOptions, Draw, Texture, TextureDescriptor};

use crate::passes::{Canvas, FlatColor, VaryingColor, Vertices, additive, pipeline, pull_program, target, vertex};

/// The one pattern.
const NAN: u32 = 0x7fc0_0000;

/// NaNs of both signs, with payloads, signalling and quiet.
const PATTERNS: [u32; 5] = [NAN, 0xffc0_0000, 0x7fa0_1234, 0xffff_ffff, 0x7f80_0001];

#[test]
fn drawing_stores_one_not_a_number_at_every_level() {
    let corners = [[-1.0, 1.0], [-1.0, -3.0], [3.0, 1.0_f32]];
    let size = (8, 8);
    // The shortcut that adds one colour, the queue, and the queue with planes in which infinities have no difference.
    let programs: [fn() -> Program; 3] = [
        || pull_program(FlatColor, Interpolation::Flat),
        || pull_program(VaryingColor, Interpolation::Flat),
        || pull_program(VaryingColor, Interpolation::Perspective),
    ];
    for (name, level) in wide_levels() {
        let device =
            Device::new(DeviceOptions { threads: Some(1), level: Some(level), ..DeviceOptions::default() }).expect("threads start");
        for (number, pattern) in (0..3).flat_map(|number| PATTERNS.map(|pattern| (number, pattern))) {
            let nan = f32::from_bits(pattern);
            let vertices = Vertices::new(&corners.map(|[x, y]| vertex([x, y, 0.5, 1.0], [nan, 1.0, f32::INFINITY, -nan])));
            for (adds, expected) in [(false, [NAN, 0x3f80_0000, 0x7f80_0000, NAN]), (true, [NAN, 0x4040_0000, NAN, NAN])] {
                let state = if adds { additive } else { target };
                let pipeline = pipeline(programs[number](), |desc| desc.targets = vec![state(TextureFormat::Rgba32Float)]);
                let mut canvas = Canvas::single(size, TextureFormat::Rgba32Float);
                canvas.clear = [2.0, 2.0, f64::NEG_INFINITY, 2.0];
                canvas.run_on(&device, vec![Draw::new(&pipeline, Bindings::new(&vertices.entries(), 0), 0..3, size)], None);
                for (channel, expected) in expected.into_iter().enumerate().filter(|(channel, _)| *channel != 2 || number != 2) {
                    let title = format!("{name}, program {number}, {pattern:08x}, adds: {adds}, channel {channel}");
                    assert!(canvas.channel(0, channel).iter().all(|v| v.to_bits() == expected), "{title}");
                }
            }
        }
    }
}

#[test]
fn bytes_and_texels_are_stored_with_one_not_a_number() {
    let f32s: Vec<u8> = PATTERNS.iter().flat_map(|bits| bits.to_le_bytes()).collect();
    let mut texture = Texture::new(TextureDescriptor::d2("t", 5, 1, TextureFormat::R32Float)).expect("valid");
    texture.write_bytes(0, 0, &f32s).expect("five texels");
    assert_eq!(texture.read_bytes(0, 0), NAN.to_le_bytes().repeat(5));
    for (x, pattern) in PATTERNS.into_iter().enumerate() {
        texture.set_texel(0, 0, x as u32, 0, [f32::from_bits(pattern), 0.0, 0.0, 0.0]);
    }
    assert_eq!(texture.read_bytes(0, 0), NAN.to_le_bytes().repeat(5));
    let halves: Vec<u8> = [0x7e00_u16, 0xfe00, 0x7c01, 0xffff].iter().flat_map(|bits| bits.to_le_bytes()).collect();
    let mut texture = Texture::new(TextureDescriptor::d2("t", 4, 1, TextureFormat::R16Float)).expect("valid");
    texture.write_bytes(0, 0, &halves).expect("four texels");
    assert_eq!(texture.read_bytes(0, 0), 0x7e00_u16.to_le_bytes().repeat(4));
}

/// The bits of an integer are not a number, even where they look like a float that is none.
#[test]
fn integers_keep_their_bits() {
    let bytes: Vec<u8> = PATTERNS.iter().flat_map(|bits| bits.to_le_bytes()).collect();
    let mut texture = Texture::new(TextureDescriptor::d2("t", 5, 1, TextureFormat::R32Uint)).expect("valid");
    texture.write_bytes(0, 0, &bytes).expect("five texels");
    assert_eq!(texture.read_bytes(0, 0), bytes);
}
