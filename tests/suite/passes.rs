//! The passes that techniques share, each by itself against what is known of it by analysis, and all of them on devices that differ.

mod compose;
mod filter;
mod light_buffer;

use nephroid::frame::{CpuExecutor, Executor as _, Frame, TextureId};
use nephroid::math::level::wide_levels;
use nephroid::pipeline::shader::ShaderWidth;
use nephroid::pipeline::{Device, DeviceOptions, Texture};

use crate::support::shared_passes;

/// An executor on two threads and the best level.
fn executor() -> CpuExecutor {
    executor_with(DeviceOptions { threads: Some(2), ..DeviceOptions::default() })
}

fn executor_with(options: DeviceOptions) -> CpuExecutor {
    CpuExecutor::new(Device::new(options).expect("threads start"), 1 << 30)
}

/// Runs a frame and returns one of its textures.
fn texture_of(frame: &Frame, id: TextureId) -> Texture {
    executor().run(frame, None).expect("the frame runs").texture(id).clone()
}

/// The greatest difference between what a texture has and what it should have, `expected(x, y)`, over the texels of `columns` and `rows`.
fn worst(texture: &Texture, (columns, rows): (std::ops::Range<u32>, std::ops::Range<u32>), expected: impl Fn(u32, u32) -> [f64; 4]) -> f64 {
    let surface = texture.surface(0, 0);
    let mut worst = 0.0;
    for y in rows {
        for x in columns.clone() {
            for (channel, expected) in expected(x, y).into_iter().enumerate().take(surface.channels) {
                let difference = (f64::from(surface.get(x, y, channel)) - expected).abs();
                // Not a number is as wrong as can be.
                worst = if difference <= worst {
                    worst
                } else if difference.is_nan() {
                    f64::INFINITY
                } else {
                    difference
                };
            }
        }
    }
    worst
}

#[test]
fn the_worst_difference_sees_one_texel_one_channel_and_not_a_number() {
    let mut frame = Frame::default();
    let format = nephroid::pipeline::state::TextureFormat::Rgba32Float;
    let id = shared_passes::texture(&mut frame, "ones", (5, 4), format, &[1.0; 80]);
    let mut texture = texture_of(&frame, id);
    let all = || (0..5, 0..4);
    assert_eq!(worst(&texture, all(), |_, _| [1.0; 4]), 0.0);
    let [r, g, b, _] = texture.texel(0, 0, 4, 3);
    texture.set_texel(0, 0, 4, 3, [r, g, b, 1.5]);
    assert_eq!(worst(&texture, all(), |_, _| [1.0; 4]), 0.5);
    let [_, g, b, a] = texture.texel(0, 0, 0, 0);
    texture.set_texel(0, 0, 0, 0, [f32::NAN, g, b, a]);
    assert_eq!(worst(&texture, all(), |_, _| [1.0; 4]), f64::INFINITY);
}

#[test]
fn all_passes_have_the_same_bytes_on_one_thread_and_more_at_every_level_wide_or_scalar() {
    let frame = shared_passes::frame();
    let bytes = |options: DeviceOptions| -> Vec<Vec<u8>> {
        let mut executor = executor_with(options);
        let output = executor.run(&frame, None).expect("the frame runs");
        output.contents.textures.iter().map(|texture| texture.read_bytes(0, 0)).collect()
    };
    let scalar =
        bytes(DeviceOptions { threads: Some(1), level: Some(wide_levels()[0].1), width: ShaderWidth::One, ..DeviceOptions::default() });
    assert!(frame.textures.len() > 10 && scalar.iter().all(|bytes| bytes.iter().any(|b| *b != bytes[0])));
    let others = wide_levels().into_iter().zip([2, 1, 3].into_iter().cycle());
    let mut others: Vec<_> = others
        .map(|((name, level), threads)| (name, DeviceOptions { threads: Some(threads), level: Some(level), ..DeviceOptions::default() }))
        .collect();
    others.push(("scalar shaders, wide tiles", DeviceOptions { threads: Some(2), width: ShaderWidth::One, ..DeviceOptions::default() }));
    for (name, options) in others {
        for (number, (expected, found)) in scalar.iter().zip(bytes(options)).enumerate() {
            assert!(*expected == found, "{name}: `{}` differs", frame.textures[number].desc.label);
        }
    }
}
