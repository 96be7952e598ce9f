//! Rounding of shader output to the numbers that a colour target can hold.

use crate::api::format::facts::{ChannelKind, FormatInfo};
use crate::api::format::integer::{sint, uint};
use crate::api::format::nan::one_nan;
use crate::api::format::normalized::{unorm, unorm8};
use crate::api::format::small_float::{f16_to_f32, f32_to_f16, f32_to_ufloat, ufloat_to_f32};
use crate::api::format::srgb::{linear_to_srgb8, srgb8_to_linear};
use crate::api::rules::F16Rounding;
use crate::api::state::Color;

/// Rounds numbers to those that a colour target can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantizer {
    /// No rounding: 32-bit integers, and formats that cannot be drawn to.
    Exact,
    /// 32-bit floats: only NaNs change, to the one bit pattern that textures store.
    Float32,
    /// Clamp to 0..=1, `⌊v·255 + 0.5⌋/255`; NaN becomes 0 [D3D11.3 §3.2.3.6].
    Unorm8,
    /// As `Unorm8`, in steps of 1/1023 for colour and 1/3 for alpha.
    Unorm10,
    /// As `Unorm8`, on the sRGB curve for colour, linear for alpha.
    Srgb8,
    /// Rounded to binary16.
    Float16(F16Rounding),
    /// Rounded to floats of 11, 11 and 10 bits without a sign; negative numbers become 0.
    Ufloat11(F16Rounding),
    /// Bit patterns clamped to unsigned integers of this many bits (10: alpha of 2 bits).
    Uint(u32),
    /// Bit patterns clamped to signed integers of this many bits.
    Sint(u32),
}

impl Quantizer {
    /// The quantizer of a colour format under these rules.
    #[must_use]
    pub fn new(kind: ChannelKind, f16: F16Rounding) -> Self {
        match kind {
            ChannelKind::Unorm8 => Self::Unorm8,
            ChannelKind::Unorm10 => Self::Unorm10,
            ChannelKind::Srgb8 => Self::Srgb8,
            ChannelKind::Float16 => Self::Float16(f16),
            ChannelKind::Ufloat11 => Self::Ufloat11(f16),
            ChannelKind::Float32 => Self::Float32,
            ChannelKind::Uint(32) | ChannelKind::Sint(32) => Self::Exact,
            ChannelKind::Uint(bits) => Self::Uint(bits),
            ChannelKind::Sint(bits) => Self::Sint(bits),
            ChannelKind::Snorm8 | ChannelKind::SharedExponent | ChannelKind::UnormDepth(_) => Self::Exact,
        }
    }

    /// Rounds one number; `channel` 3 is alpha.
    #[must_use]
    pub fn apply(self, value: f32, channel: usize) -> f32 {
        match self {
            Self::Exact => value,
            Self::Float32 => one_nan(value),
            Self::Unorm8 => f32::from(unorm8(value)) / 255.0,
            Self::Unorm10 if channel == 3 => unorm(value, 2) as f32 / 3.0,
            Self::Unorm10 => unorm(value, 10) as f32 / 1023.0,
            Self::Srgb8 if channel == 3 => f32::from(unorm8(value)) / 255.0,
            Self::Srgb8 => srgb8_to_linear(linear_to_srgb8(value)),
            Self::Float16(rounding) => f16_to_f32(f32_to_f16(value, rounding)),
            Self::Ufloat11(rounding) => {
                let fraction_bits = fraction_bits(channel);
                ufloat_to_f32(f32_to_ufloat(value, fraction_bits, rounding), fraction_bits)
            }
            Self::Uint(bits) => f32::from_bits(uint(value, ChannelKind::Uint(bits).channel_bits(channel))),
            Self::Sint(bits) => f32::from_bits(sint(value, bits) as u32),
        }
    }
}

/// Fraction bits of a channel of `rg11b10ufloat`.
#[inline]
pub(crate) fn fraction_bits(channel: usize) -> u32 {
    if channel == 2 { 5 } else { 6 }
}

impl FormatInfo {
    /// The value of a colour target of this format after a clear: each component rounded as drawing rounds it. Integers are rounded toward zero and
    /// clamped to the format's range; NaN becomes 0.
    #[must_use]
    pub fn clear_value(&self, color: Color, f16: F16Rounding) -> [f32; 4] {
        let quantizer = Quantizer::new(self.kind, f16);
        let components = [color.r, color.g, color.b, color.a];
        std::array::from_fn(|channel| {
            let value = match self.kind {
                ChannelKind::Uint(_) => f32::from_bits(components[channel] as u32),
                ChannelKind::Sint(_) => f32::from_bits(components[channel] as i32 as u32),
                _ => components[channel] as f32,
            };
            quantizer.apply(value, channel)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FORMATS, decode_texel, encode_texel, format_info};
    use super::*;

    /// The bytes of a target hold exactly the quantized numbers, and encoding without quantizing rounds in the same way.
    #[test]
    fn quantized_numbers_are_what_the_bytes_hold() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state
        };
        for format in FORMATS {
            let info = format_info(format).expect("listed");
            if info.depth || info.stencil || !info.renderable {
                continue;
            }
            let quantizer = Quantizer::new(info.kind, F16Rounding::NearestEven);
            for number in 0..20_000 {
                let value: [f32; 4] = std::array::from_fn(|_| {
                    // Any bits at all, and numbers about as large as colours are.
                    if number % 2 == 0 { f32::from_bits(next()) } else { (next() >> 8) as f32 * (3.0 / 16_777_216.0) - 1.0 }
                });
                let stored: [f32; 4] = std::array::from_fn(|channel| quantizer.apply(value[channel], channel));
                let decoded = [stored, value].map(|v| {
                    let mut bytes = Vec::new();
                    encode_texel(info, &v, &mut bytes);
                    assert_eq!(bytes.len(), info.bytes);
                    decode_texel(info, &bytes)
                });
                for channel in 0..info.channels {
                    let bits = stored[channel].to_bits();
                    assert_eq!(decoded[0][channel].to_bits(), bits, "{format:?}: {value:?} stored as {stored:?}");
                    assert_eq!(decoded[1][channel].to_bits(), bits, "{format:?}: {value:?} stored as {stored:?}");
                    assert_eq!(quantizer.apply(stored[channel], channel).to_bits(), bits, "{format:?}: quantized again");
                }
            }
        }
    }

    #[test]
    fn clears_are_rounded_and_clamped() {
        let clear = |format, color: [f64; 4]| {
            let [r, g, b, a] = color;
            format_info(format).expect("listed").clear_value(Color { r, g, b, a }, F16Rounding::NearestEven)
        };
        let unsigned = |format, color| clear(format, color).map(f32::to_bits);
        let signed = |format, color| clear(format, color).map(|v| v.to_bits() as i32);
        use crate::state::TextureFormat as F;
        assert_eq!(unsigned(F::Rgba8Uint, [1.9, 255.0, 256.0, -1.0]), [1, 255, 255, 0]);
        assert_eq!(signed(F::Rgba8Sint, [-1.9, -129.0, 128.0, f64::NAN]), [-1, -128, 127, 0]);
        assert_eq!(unsigned(F::Rgba32Uint, [4.0e9, 1.0e12, 0.0, 7.0]), [4_000_000_000, u32::MAX, 0, 7]);
        assert_eq!(signed(F::Rgba32Sint, [-2.2e9, 2.2e9, -1.0, 7.0]), [i32::MIN, i32::MAX, -1, 7]);
        assert_eq!(unsigned(F::Rgb10a2Uint, [1024.0, 1023.0, 3.0, 4.0]), [1023, 1023, 3, 3]);
        assert_eq!(clear(F::Rgb10a2Unorm, [0.5, 1.0, 2.0, 0.5]), [512.0 / 1023.0, 1.0, 1.0, 2.0 / 3.0]);
        assert_eq!(clear(F::Rg11b10Ufloat, [-1.0, 1.0, 1.0e6, 0.0])[..3], [0.0, 1.0, f32::INFINITY]);
        assert_eq!(clear(F::Bgra8Unorm, [1.0, 0.0, 0.2, 1.0]), [1.0, 0.0, 51.0 / 255.0, 1.0]);
    }
}
