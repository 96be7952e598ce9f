//! Texture formats: how many planes a format has, what a stored number can be, and the bytes it is.
//!
//! A texture holds decoded f32 planes (`texture.rs`). [`Quantizer`] rounds what a shader wrote to a number that the format
//! can hold; [`encode_texel`] and [`decode_texel`] turn such numbers into the format's bytes and back without loss.

use crate::api::rules::{F16Rounding, UnormDepth};
use crate::api::state::TextureFormat;

/// How the planes of a format are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormatInfo {
    /// Colour or depth planes, 0 to 4.
    pub channels: usize,
    /// What numbers a plane can hold.
    pub kind: ChannelKind,
    /// Whether there is a stencil plane.
    pub stencil: bool,
    /// Whether the planes are depth.
    pub depth: bool,
    /// Bytes of a texel's colour or depth when encoded.
    pub bytes: usize,
}

/// What numbers a plane can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelKind {
    /// `n/255`.
    Unorm8,
    /// `n/255` encoded by the sRGB curve; alpha stays linear.
    Srgb8,
    /// IEEE 754 binary16.
    Float16,
    /// IEEE 754 binary32.
    Float32,
    /// 32-bit unsigned integers, kept as bit patterns.
    Uint32,
    /// `n/(2^bits − 1)`, kept as the integer `n`, which f32 holds exactly.
    UnormDepth(u32),
}

/// What we can render to or sample, or `None` for a format that is not supported.
#[must_use]
pub fn format_info(format: TextureFormat) -> Option<FormatInfo> {
    use ChannelKind::*;
    let color = |channels, kind, bytes| FormatInfo { channels, kind, stencil: false, depth: false, bytes };
    let depth = |kind, stencil, bytes| FormatInfo { channels: 1, kind, stencil, depth: true, bytes };
    Some(match format {
        TextureFormat::R8Unorm => color(1, Unorm8, 1),
        TextureFormat::Rg8Unorm => color(2, Unorm8, 2),
        TextureFormat::Rgba8Unorm => color(4, Unorm8, 4),
        TextureFormat::Rgba8UnormSrgb => color(4, Srgb8, 4),
        TextureFormat::R16Float => color(1, Float16, 2),
        TextureFormat::Rg16Float => color(2, Float16, 4),
        TextureFormat::Rgba16Float => color(4, Float16, 8),
        TextureFormat::R32Float => color(1, Float32, 4),
        TextureFormat::Rg32Float => color(2, Float32, 8),
        TextureFormat::Rgba32Float => color(4, Float32, 16),
        TextureFormat::R32Uint => color(1, Uint32, 4),
        TextureFormat::Depth16Unorm => depth(UnormDepth(16), false, 2),
        TextureFormat::Depth24Plus => depth(UnormDepth(24), false, 4),
        TextureFormat::Depth24PlusStencil8 => depth(UnormDepth(24), true, 4),
        TextureFormat::Depth32Float => depth(Float32, false, 4),
        TextureFormat::Depth32FloatStencil8 => depth(Float32, true, 4),
        TextureFormat::Stencil8 => FormatInfo { channels: 0, kind: Unorm8, stencil: true, depth: false, bytes: 0 },
        _ => return None,
    })
}

/// Names of the supported formats, for error messages.
pub const SUPPORTED_FORMATS: &str = "r8unorm rg8unorm rgba8unorm rgba8unorm-srgb r16float rg16float rgba16float r32float rg32float \
     rgba32float r32uint depth16unorm depth24plus depth24plus-stencil8 depth32float depth32float-stencil8 stencil8";

/// Rounds numbers to what a colour format can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantizer {
    /// f32 and integers: nothing to do.
    Exact,
    /// Clamp to 0..=1, `floor(v·255 + 0.5)/255`; NaN becomes 0 [D3D11.3 §3.2.3.6].
    Unorm8,
    /// The same on the sRGB curve for colour, linear for alpha.
    Srgb8,
    /// To binary16.
    Float16(F16Rounding),
}

impl Quantizer {
    /// The quantizer of a colour format under these rules.
    #[must_use]
    pub fn new(kind: ChannelKind, f16: F16Rounding) -> Self {
        match kind {
            ChannelKind::Unorm8 => Self::Unorm8,
            ChannelKind::Srgb8 => Self::Srgb8,
            ChannelKind::Float16 => Self::Float16(f16),
            ChannelKind::Float32 | ChannelKind::Uint32 | ChannelKind::UnormDepth(_) => Self::Exact,
        }
    }

    /// Rounds one number; `channel` 3 is alpha.
    #[must_use]
    pub fn apply(self, value: f32, channel: usize) -> f32 {
        match self {
            Self::Exact => value,
            Self::Unorm8 => f32::from(unorm8(value)) / 255.0,
            Self::Srgb8 if channel == 3 => f32::from(unorm8(value)) / 255.0,
            Self::Srgb8 => srgb8_to_linear(linear_to_srgb8(value)),
            Self::Float16(rounding) => f16_to_f32(f32_to_f16(value, rounding)),
        }
    }
}

/// `floor(clamp(v, 0, 1)·255 + 0.5)`; NaN becomes 0.
fn unorm8(value: f32) -> u8 {
    // The cast saturates and sends NaN to zero.
    (value * 255.0 + 0.5).floor() as u8
}

/// Decoded values of the 256 sRGB codes, and the linear values where the nearest code changes.
struct SrgbTables {
    linear: [f32; 256],
    threshold: [f32; 255],
}

fn srgb_tables() -> &'static SrgbTables {
    static TABLES: std::sync::OnceLock<SrgbTables> = std::sync::OnceLock::new();
    TABLES.get_or_init(|| {
        // IEC 61966-2-1.
        let decode = |s: f64| if s <= 0.04045 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) };
        SrgbTables {
            linear: std::array::from_fn(|n| decode(n as f64 / 255.0) as f32),
            threshold: std::array::from_fn(|n| decode((n as f64 + 0.5) / 255.0) as f32),
        }
    })
}

/// The sRGB code whose curve value is nearest to that of `linear`; NaN and negatives give 0.
#[must_use]
pub fn linear_to_srgb8(linear: f32) -> u8 {
    srgb_tables().threshold.partition_point(|&t| linear >= t) as u8
}

/// The linear value of an sRGB code [IEC 61966-2-1].
#[must_use]
pub fn srgb8_to_linear(code: u8) -> f32 {
    srgb_tables().linear[usize::from(code)]
}

/// binary32 to binary16. NaN keeps its sign and becomes the quiet NaN.
#[must_use]
pub fn f32_to_f16(value: f32, rounding: F16Rounding) -> u16 {
    let bits = value.to_bits();
    let sign = ((bits >> 16) & 0x8000) as u16;
    let magnitude = bits & 0x7fff_ffff;
    if magnitude > 0x7f80_0000 {
        return sign | 0x7e00;
    }
    if magnitude == 0x7f80_0000 {
        return sign | 0x7c00;
    }
    let exponent = (magnitude >> 23) as i32 - 127;
    // Shift the 24-bit significand to the target's unit in the last place; 10 fraction bits, fewer below 2^-14.
    let shift = if exponent >= -14 { 13 } else { (13 + (-14 - exponent)).min(31) } as u32;
    let significand = if magnitude >= 0x0080_0000 { (magnitude & 0x007f_ffff) | 0x0080_0000 } else { magnitude };
    let truncated = significand >> shift;
    let remainder = significand & ((1 << shift) - 1);
    let half = 1u32 << (shift - 1);
    let round_up = rounding == F16Rounding::NearestEven && (remainder > half || (remainder == half && truncated & 1 == 1));
    // A carry out of the fraction moves into the exponent, which is what rounding up to the next binade means.
    let base = if exponent >= -14 { (((exponent + 14) as u32) << 10) + truncated } else { truncated };
    let rounded = base + u32::from(round_up);
    let limit = if rounding == F16Rounding::TowardZero { 0x7bff } else { 0x7c00 };
    sign | rounded.min(limit) as u16
}

/// binary16 to binary32, exact.
#[must_use]
pub fn f16_to_f32(half: u16) -> f32 {
    let sign = u32::from(half & 0x8000) << 16;
    let exponent = u32::from(half >> 10) & 0x1f;
    let fraction = u32::from(half & 0x3ff);
    let magnitude = match exponent {
        0 => (fraction as f32 * f32::from_bits(0x3380_0000)).to_bits(), // fraction · 2^-24
        0x1f => 0x7f80_0000 | (fraction << 13),
        _ => ((exponent + 112) << 23) | (fraction << 13),
    };
    f32::from_bits(sign | magnitude)
}

/// Depth of a fragment as the target stores it: itself, or the integer `floor(z·(2^bits − 1) + 0.5)`.
#[must_use]
pub fn quantize_depth(kind: ChannelKind, z: f32) -> f32 {
    quantize_depth_by(UnormDepth::NearestUp, kind, z)
}

/// [`quantize_depth`] by a rule.
#[inline(always)]
pub(crate) fn quantize_depth_by(rule: UnormDepth, kind: ChannelKind, z: f32) -> f32 {
    let ChannelKind::UnormDepth(bits) = kind else { return z };
    let greatest = ((1u32 << bits) - 1) as f32;
    match rule {
        UnormDepth::NearestUp => (f64::from(z) * f64::from(greatest) + 0.5).floor() as f32,
        // 24 bits have no room for the addition that rounds to multiples.
        UnormDepth::Scaled if bits < 24 => {
            let steps = (1u32 << bits) as f32;
            (z * (greatest / steps) * steps).round_ties_even()
        }
        UnormDepth::Scaled | UnormDepth::NearestEven => (z * greatest).round_ties_even(),
    }
}

/// The inverse of [`quantize_depth`]: what reading the depth gives, in 0..=1.
#[must_use]
pub fn depth_value(kind: ChannelKind, stored: f32) -> f32 {
    match kind {
        ChannelKind::UnormDepth(bits) => (f64::from(stored) / f64::from((1u32 << bits) - 1)) as f32,
        _ => stored,
    }
}

/// Appends the bytes of one texel (`stored` has the format's channels), little endian.
pub fn encode_texel(info: FormatInfo, stored: &[f32], bytes: &mut Vec<u8>) {
    for (channel, &value) in stored.iter().enumerate().take(info.channels) {
        match info.kind {
            ChannelKind::Unorm8 => bytes.push(unorm8(value)),
            ChannelKind::Srgb8 if channel == 3 => bytes.push(unorm8(value)),
            ChannelKind::Srgb8 => bytes.push(linear_to_srgb8(value)),
            ChannelKind::Float16 => bytes.extend(f32_to_f16(value, F16Rounding::NearestEven).to_le_bytes()),
            ChannelKind::Float32 => bytes.extend(value.to_le_bytes()),
            ChannelKind::Uint32 => bytes.extend(value.to_bits().to_le_bytes()),
            ChannelKind::UnormDepth(16) => bytes.extend((value as u16).to_le_bytes()),
            ChannelKind::UnormDepth(_) => bytes.extend((value as u32).to_le_bytes()),
        }
    }
}

/// Reads one texel from the format's bytes into decoded channels. `bytes` has the format's length.
#[must_use]
pub fn decode_texel(info: FormatInfo, bytes: &[u8]) -> [f32; 4] {
    let mut out = [0.0; 4];
    for (channel, slot) in out.iter_mut().enumerate().take(info.channels) {
        *slot = match info.kind {
            ChannelKind::Unorm8 => f32::from(bytes[channel]) / 255.0,
            ChannelKind::Srgb8 if channel == 3 => f32::from(bytes[channel]) / 255.0,
            ChannelKind::Srgb8 => srgb8_to_linear(bytes[channel]),
            ChannelKind::Float16 => f16_to_f32(u16::from_le_bytes([bytes[2 * channel], bytes[2 * channel + 1]])),
            ChannelKind::Float32 | ChannelKind::Uint32 => {
                let at = 4 * channel;
                f32::from_bits(u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
            }
            ChannelKind::UnormDepth(16) => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            ChannelKind::UnormDepth(_) => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f16_round_trip_every_pattern() {
        for half in 0..=u16::MAX {
            let value = f16_to_f32(half);
            if value.is_nan() {
                assert!(f16_to_f32(f32_to_f16(value, F16Rounding::NearestEven)).is_nan());
                continue;
            }
            for rounding in [F16Rounding::NearestEven, F16Rounding::TowardZero] {
                assert_eq!(f32_to_f16(value, rounding), half, "{half:#x} = {value}");
            }
        }
    }

    #[test]
    fn f16_nearest_matches_half_crate() {
        for i in 0..2_000_000u32 {
            let value = f32::from_bits(i.wrapping_mul(2_654_435_761));
            if value.is_nan() {
                continue;
            }
            assert_eq!(f32_to_f16(value, F16Rounding::NearestEven), half::f16::from_f32_const(value).to_bits(), "{value:e}");
        }
    }

    #[test]
    fn f16_toward_zero_never_grows() {
        for i in 0..2_000_000u32 {
            let value = f32::from_bits(i.wrapping_mul(2_246_822_519));
            if value.is_nan() || value.is_infinite() {
                continue;
            }
            let down = f16_to_f32(f32_to_f16(value, F16Rounding::TowardZero));
            assert!(down.abs() <= value.abs());
            let next = f16_to_f32((f32_to_f16(value.abs(), F16Rounding::TowardZero) + 1).min(0x7c00));
            assert!(next > value.abs(), "{value:e} {down:e} {next:e}");
        }
    }

    #[test]
    fn srgb_codes_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(linear_to_srgb8(srgb8_to_linear(code)), code);
        }
        assert_eq!(linear_to_srgb8(f32::NAN), 0);
        assert_eq!(linear_to_srgb8(2.0), 255);
    }

    #[test]
    fn unorm_rounds_half_up_and_clamps() {
        let q = Quantizer::Unorm8;
        assert_eq!(q.apply(-1.0, 0), 0.0);
        assert_eq!(q.apply(f32::NAN, 0), 0.0);
        assert_eq!(q.apply(1.5, 0), 1.0);
        assert_eq!(q.apply(0.5 / 255.0, 0), 1.0 / 255.0);
        assert_eq!(q.apply(0.49 / 255.0, 0), 0.0);
    }
}
