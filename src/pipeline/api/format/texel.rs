//! Texels as the bytes of their format, little endian.

use crate::api::format::facts::{ChannelKind, FormatInfo};
use crate::api::format::integer::{extended, sint, uint};
use crate::api::format::nan::one_nan;
use crate::api::format::normalized::{snorm8, snorm8_value, unorm, unorm8};
use crate::api::format::quantize::fraction_bits;
use crate::api::format::shared_exponent;
use crate::api::format::small_float::{f16_to_f32, f32_to_f16, f32_to_ufloat, ufloat_to_f32};
use crate::api::format::srgb::{linear_to_srgb8, srgb8_to_linear};
use crate::api::rules::F16Rounding;

/// Position of a channel in the encoded order.
fn place(info: FormatInfo, channel: usize) -> usize {
    if info.blue_first && channel < 3 { 2 - channel } else { channel }
}

/// First bit of each channel of 10, 10, 10 and 2 bits.
const SHIFT_10: [u32; 4] = [0, 10, 20, 30];
/// First bit of each channel of 11, 11 and 10 bits.
const SHIFT_11: [u32; 3] = [0, 11, 22];

/// All channels packed into one 32-bit number; `None` for formats that are not packed.
fn packed(kind: ChannelKind, stored: &[f32; 4]) -> Option<u32> {
    let merged = |of: &dyn Fn(usize) -> u32| (0..4).fold(0, |bits, channel| bits | of(channel) << SHIFT_10[channel]);
    match kind {
        ChannelKind::Unorm10 => Some(merged(&|channel| unorm(stored[channel], kind.channel_bits(channel)))),
        ChannelKind::Uint(10) => Some(merged(&|channel| uint(stored[channel], kind.channel_bits(channel)))),
        ChannelKind::Ufloat11 => Some((0..3).fold(0, |bits, channel| {
            let code = f32_to_ufloat(stored[channel], fraction_bits(channel), F16Rounding::NearestEven);
            bits | u32::from(code) << SHIFT_11[channel]
        })),
        ChannelKind::SharedExponent => Some(shared_exponent::pack([stored[0], stored[1], stored[2]])),
        _ => None,
    }
}

/// The inverse of [`packed`].
fn unpacked(kind: ChannelKind, bits: u32) -> [f32; 4] {
    let code = |channel: usize| bits >> SHIFT_10[channel] & if channel == 3 { 3 } else { 1023 };
    match kind {
        ChannelKind::Unorm10 => std::array::from_fn(|channel| code(channel) as f32 / if channel == 3 { 3.0 } else { 1023.0 }),
        ChannelKind::Uint(_) => std::array::from_fn(|channel| f32::from_bits(code(channel))),
        ChannelKind::Ufloat11 => {
            let channel = |i: usize| ufloat_to_f32((bits >> SHIFT_11[i]) as u16 & if i == 2 { 0x3ff } else { 0x7ff }, fraction_bits(i));
            [channel(0), channel(1), channel(2), 0.0]
        }
        _ => {
            let [r, g, b] = shared_exponent::unpack(bits);
            [r, g, b, 0.0]
        }
    }
}

/// Appends the bytes of one texel, little endian. `stored` has one number per channel, in the order of planes.
#[inline]
pub fn encode_texel(info: FormatInfo, stored: &[f32], bytes: &mut Vec<u8>) {
    // Most of what is read: no code, no packing, no other order.
    if info.kind == ChannelKind::Float32 && stored.len() >= info.channels {
        stored[..info.channels].iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
        return;
    }
    encode_code(info, stored, bytes);
}

/// [`encode_texel`] of any format.
fn encode_code(info: FormatInfo, stored: &[f32], bytes: &mut Vec<u8>) {
    let mut texel = [0.0; 4];
    let channels = info.channels.min(stored.len());
    texel[..channels].copy_from_slice(&stored[..channels]);
    if let Some(bits) = packed(info.kind, &texel) {
        bytes.extend(bits.to_le_bytes());
        return;
    }
    for at in 0..info.channels {
        let channel = place(info, at);
        let value = texel[channel];
        match info.kind {
            ChannelKind::Unorm8 => bytes.push(unorm8(value)),
            ChannelKind::Srgb8 if channel == 3 => bytes.push(unorm8(value)),
            ChannelKind::Srgb8 => bytes.push(linear_to_srgb8(value)),
            ChannelKind::Snorm8 => bytes.push(snorm8(value) as u8),
            ChannelKind::Float16 => bytes.extend(f32_to_f16(value, F16Rounding::NearestEven).to_le_bytes()),
            ChannelKind::Uint(bits) => bytes.extend(&uint(value, bits).to_le_bytes()[..bits as usize / 8]),
            ChannelKind::Sint(bits) => bytes.extend(&sint(value, bits).to_le_bytes()[..bits as usize / 8]),
            ChannelKind::UnormDepth(16) => bytes.extend((value.round_ties_even() as u16).to_le_bytes()),
            ChannelKind::UnormDepth(_) => bytes.extend((value.round_ties_even() as u32).to_le_bytes()),
            ChannelKind::Float32 | ChannelKind::Unorm10 | ChannelKind::Ufloat11 | ChannelKind::SharedExponent => {
                bytes.extend(value.to_le_bytes());
            }
        }
    }
}

/// Decodes one texel from `bytes` to four channels in the order of planes. `bytes` must have the format's length.
#[must_use]
pub fn decode_texel(info: FormatInfo, bytes: &[u8]) -> [f32; 4] {
    // Reads the little-endian number of `length` bytes, up to four, that starts at byte `at`.
    let number = |at: usize, length: usize| {
        let mut four = [0; 4];
        four[..length].copy_from_slice(&bytes[at..at + length]);
        u32::from_le_bytes(four)
    };
    if matches!(info.kind, ChannelKind::Unorm10 | ChannelKind::Uint(10) | ChannelKind::Ufloat11 | ChannelKind::SharedExponent) {
        return unpacked(info.kind, number(0, 4));
    }
    let mut out = [0.0; 4];
    let length = info.bytes.checked_div(info.channels).unwrap_or(0);
    for at in 0..info.channels {
        let channel = place(info, at);
        let code = number(at * length, length);
        out[channel] = match info.kind {
            ChannelKind::Unorm8 => code as f32 / 255.0,
            ChannelKind::Srgb8 if channel == 3 => code as f32 / 255.0,
            ChannelKind::Srgb8 => srgb8_to_linear(code as u8),
            ChannelKind::Snorm8 => snorm8_value(code as i8),
            ChannelKind::Float16 => f16_to_f32(code as u16),
            ChannelKind::Sint(bits) => extended(code, bits),
            ChannelKind::UnormDepth(_) => code as f32,
            ChannelKind::Float32 => one_nan(f32::from_bits(code)),
            ChannelKind::Uint(_) => f32::from_bits(code),
            ChannelKind::Unorm10 | ChannelKind::Ufloat11 | ChannelKind::SharedExponent => f32::from_bits(code),
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{FORMATS, format_info};
    use super::*;
    use crate::state::TextureFormat as F;

    fn bytes_of(format: F, stored: [f32; 4]) -> Vec<u8> {
        let mut bytes = Vec::new();
        encode_texel(format_info(format).expect("listed"), &stored, &mut bytes);
        bytes
    }

    /// Layouts by hand: the order of channels, the order of bytes, and where packed fields start.
    #[test]
    fn bytes_are_laid_out_as_webgpu_says() {
        let ints = |v: [i32; 4]| v.map(|v| f32::from_bits(v as u32));
        for (format, stored, expected) in [
            (F::Rgba8Unorm, [1.0, 0.2, 0.4, 0.6], vec![255, 51, 102, 153]),
            (F::Bgra8Unorm, [1.0, 0.2, 0.4, 0.6], vec![102, 51, 255, 153]),
            (F::Bgra8UnormSrgb, [1.0, 0.0, 0.215_860_5, 0.6], vec![128, 0, 255, 153]),
            (F::Rg8Snorm, [-1.0, 1.0, 0.0, 0.0], vec![0x81, 0x7f]),
            (F::Rgba8Uint, ints([1, 2, 300, 255]), vec![1, 2, 255, 255]),
            (F::Rgba8Sint, ints([1, -1, -300, 300]), vec![1, 0xff, 0x80, 0x7f]),
            (F::Rg16Uint, ints([0x1234, 0x12345, 0, 0]), vec![0x34, 0x12, 0xff, 0xff]),
            (F::Rg16Sint, ints([-2, -40000, 0, 0]), vec![0xfe, 0xff, 0x00, 0x80]),
            (F::Rg32Sint, ints([-2, 0x0102_0304, 0, 0]), vec![0xfe, 0xff, 0xff, 0xff, 4, 3, 2, 1]),
            // 1023 | 512 << 10 | 0 << 20 | 2 << 30
            (F::Rgb10a2Unorm, [1.0, 0.5, 0.0, 0.7], 0x8008_03ff_u32.to_le_bytes().to_vec()),
            (F::Rgb10a2Uint, ints([1, 2, 3, 1]), (1u32 | 2 << 10 | 3 << 20 | 1 << 30).to_le_bytes().to_vec()),
            // 1.0: exponent 15, fraction 0; 0.5: exponent 14.
            (F::Rg11b10Ufloat, [1.0, 0.5, 1.0, 0.0], (15u32 << 6 | 14 << 6 << 11 | 15 << 5 << 22).to_le_bytes().to_vec()),
            // 256·2^(16 − 24) = 1.
            (F::Rgb9e5Ufloat, [1.0, 0.5, 0.25, 0.0], (256u32 | 128 << 9 | 64 << 18 | 16 << 27).to_le_bytes().to_vec()),
        ] {
            assert_eq!(bytes_of(format, stored), expected, "{format:?}");
        }
    }

    /// Every code of every channel of up to 16 bits, decoded and encoded again; wider ones at random.
    #[test]
    fn texels_round_trip() {
        for format in FORMATS {
            let info = format_info(format).expect("listed");
            let mut texels: Vec<Vec<u8>> = (0..=u16::MAX)
                .map(|n| {
                    let mixed = u32::from(n).wrapping_mul(2_654_435_761) >> 16;
                    let [a, b] = n.to_le_bytes();
                    let [c, d, ..] = mixed.to_le_bytes();
                    [a, b, c, d, d, a, c, b, b, c, a, d, c, d, b, a][..info.bytes].to_vec()
                })
                .collect();
            if info.kind == ChannelKind::UnormDepth(24) {
                texels.iter_mut().for_each(|bytes| bytes[3] = 0);
            }
            for bytes in texels {
                let decoded = decode_texel(info, &bytes);
                let mut again = Vec::new();
                encode_texel(info, &decoded[..info.channels], &mut again);
                let other = decode_texel(info, &again);
                for channel in 0..info.channels {
                    // Several codes may stand for one number (−1, NaN, numbers with a shared exponent): the number is kept, not the code.
                    let (a, b) = (decoded[channel], other[channel]);
                    assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "{format:?} {bytes:02x?}: {a} and {b}");
                }
                let unique = !matches!(info.kind, ChannelKind::SharedExponent | ChannelKind::Snorm8)
                    && !decoded.iter().any(|v| v.is_nan() && !info.kind.is_integer());
                assert!(!unique || again == bytes, "{format:?}: {bytes:02x?} became {again:02x?}");
            }
        }
    }
}
