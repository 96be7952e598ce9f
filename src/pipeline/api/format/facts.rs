//! The table of formats: planes, bytes, and how each format may be used.

use crate::api::state::TextureFormat;

/// How the planes of a format are stored, and how the format may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormatInfo {
    /// Number of colour or depth planes, 0 to 4.
    pub channels: usize,
    /// The numbers that a plane can hold.
    pub kind: ChannelKind,
    /// Whether there is a stencil plane.
    pub stencil: bool,
    /// Whether the planes are depth.
    pub depth: bool,
    /// Bytes of a texel's colour or depth in the format's own encoding.
    pub bytes: usize,
    /// Whether the encoded order is blue, green, red, alpha. Planes are always in the order red, green, blue, alpha.
    pub blue_first: bool,
    /// Whether passes can draw to the format.
    pub renderable: bool,
    /// Whether pipelines can blend into it.
    pub blendable: bool,
}

/// The numbers that a plane can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelKind {
    /// `n/255`.
    Unorm8,
    /// `n/1023` for colour and `n/3` for alpha, packed into 32 bits.
    Unorm10,
    /// `max(n/127, −1)`, `n` from −128 to 127.
    Snorm8,
    /// `n/255` encoded by the sRGB curve; alpha stays linear.
    Srgb8,
    /// IEEE 754 binary16.
    Float16,
    /// Floats without sign, of 5 exponent bits and 6, 6 and 5 fraction bits, packed into 32 bits.
    Ufloat11,
    /// `n·2^(e − 24)` with 9 bits for each `n` and one 5-bit `e` for all three, packed into 32 bits.
    SharedExponent,
    /// IEEE 754 binary32.
    Float32,
    /// Unsigned integers of this many bits, kept as bit patterns. 10 means 10 bits per colour channel and 2 for alpha, packed into 32 bits.
    Uint(u32),
    /// Signed integers of this many bits, kept as bit patterns, the sign extended to 32 bits.
    Sint(u32),
    /// `n/(2^bits − 1)`, kept as the integer `n`, which f32 holds exactly.
    UnormDepth(u32),
}

impl ChannelKind {
    /// Whether planes hold bit patterns of 32-bit integers. Float arithmetic must not touch them: some patterns are NaNs.
    #[must_use]
    pub const fn is_integer(self) -> bool {
        matches!(self, Self::Uint(_) | Self::Sint(_))
    }

    /// Whether blending clamps the source colour and the blend constant to 0..=1 [D3D11.3 §17.5].
    #[must_use]
    pub const fn clamps_blending(self) -> bool {
        matches!(self, Self::Unorm8 | Self::Unorm10 | Self::Srgb8)
    }

    /// Bits of an integer, a normalized or a depth channel; `channel` 3 is alpha. 0 for floats.
    #[must_use]
    pub const fn channel_bits(self, channel: usize) -> u32 {
        match self {
            Self::Unorm8 | Self::Snorm8 | Self::Srgb8 => 8,
            Self::Unorm10 | Self::Uint(10) => {
                if channel == 3 {
                    2
                } else {
                    10
                }
            }
            Self::Uint(bits) | Self::Sint(bits) | Self::UnormDepth(bits) => bits,
            Self::Float16 | Self::Ufloat11 | Self::SharedExponent | Self::Float32 => 0,
        }
    }

    /// Alpha that a shader reads where the format has no alpha: 1.0, or the bits of the integer 1 [WebGPU §texture views].
    #[must_use]
    pub const fn missing_alpha(self) -> f32 {
        if self.is_integer() { f32::from_bits(1) } else { 1.0 }
    }
}

const fn color(channels: usize, kind: ChannelKind, bytes: usize) -> FormatInfo {
    let blendable = !kind.is_integer();
    FormatInfo { channels, kind, stencil: false, depth: false, bytes, blue_first: false, renderable: true, blendable }
}

const fn texture_only(channels: usize, kind: ChannelKind, bytes: usize) -> FormatInfo {
    FormatInfo { renderable: false, blendable: false, ..color(channels, kind, bytes) }
}

const fn blue_first(kind: ChannelKind) -> FormatInfo {
    FormatInfo { blue_first: true, ..color(4, kind, 4) }
}

const fn depth(kind: ChannelKind, stencil: bool, bytes: usize) -> FormatInfo {
    FormatInfo { stencil, depth: true, blendable: false, ..color(1, kind, bytes) }
}

use ChannelKind::*;
use TextureFormat as F;

/// All formats with their WebGPU names [WebGPU §26.1.1, texture format capabilities; `wgpu-types`, `guaranteed_format_features`].
///
/// Two facts that WebGPU ties to optional features always hold here: 32-bit floats can be blended and filtered (`float32-blendable`,
/// `float32-filterable`), and `rg11b10ufloat` can be drawn to (`rg11b10ufloat-renderable`). Drawing to `snorm` needs `texture-formats-tier1` and is
/// not supported.
const TABLE: &[(TextureFormat, &str, FormatInfo)] = &[
    (F::R8Unorm, "r8unorm", color(1, Unorm8, 1)),
    (F::R8Snorm, "r8snorm", texture_only(1, Snorm8, 1)),
    (F::R8Uint, "r8uint", color(1, Uint(8), 1)),
    (F::R8Sint, "r8sint", color(1, Sint(8), 1)),
    (F::Rg8Unorm, "rg8unorm", color(2, Unorm8, 2)),
    (F::Rg8Snorm, "rg8snorm", texture_only(2, Snorm8, 2)),
    (F::Rg8Uint, "rg8uint", color(2, Uint(8), 2)),
    (F::Rg8Sint, "rg8sint", color(2, Sint(8), 2)),
    (F::Rgba8Unorm, "rgba8unorm", color(4, Unorm8, 4)),
    (F::Rgba8UnormSrgb, "rgba8unorm-srgb", color(4, Srgb8, 4)),
    (F::Rgba8Snorm, "rgba8snorm", texture_only(4, Snorm8, 4)),
    (F::Rgba8Uint, "rgba8uint", color(4, Uint(8), 4)),
    (F::Rgba8Sint, "rgba8sint", color(4, Sint(8), 4)),
    (F::Bgra8Unorm, "bgra8unorm", blue_first(Unorm8)),
    (F::Bgra8UnormSrgb, "bgra8unorm-srgb", blue_first(Srgb8)),
    (F::R16Uint, "r16uint", color(1, Uint(16), 2)),
    (F::R16Sint, "r16sint", color(1, Sint(16), 2)),
    (F::R16Float, "r16float", color(1, Float16, 2)),
    (F::Rg16Uint, "rg16uint", color(2, Uint(16), 4)),
    (F::Rg16Sint, "rg16sint", color(2, Sint(16), 4)),
    (F::Rg16Float, "rg16float", color(2, Float16, 4)),
    (F::Rgba16Uint, "rgba16uint", color(4, Uint(16), 8)),
    (F::Rgba16Sint, "rgba16sint", color(4, Sint(16), 8)),
    (F::Rgba16Float, "rgba16float", color(4, Float16, 8)),
    (F::R32Uint, "r32uint", color(1, Uint(32), 4)),
    (F::R32Sint, "r32sint", color(1, Sint(32), 4)),
    (F::R32Float, "r32float", color(1, Float32, 4)),
    (F::Rg32Uint, "rg32uint", color(2, Uint(32), 8)),
    (F::Rg32Sint, "rg32sint", color(2, Sint(32), 8)),
    (F::Rg32Float, "rg32float", color(2, Float32, 8)),
    (F::Rgba32Uint, "rgba32uint", color(4, Uint(32), 16)),
    (F::Rgba32Sint, "rgba32sint", color(4, Sint(32), 16)),
    (F::Rgba32Float, "rgba32float", color(4, Float32, 16)),
    (F::Rgb10a2Unorm, "rgb10a2unorm", color(4, Unorm10, 4)),
    (F::Rgb10a2Uint, "rgb10a2uint", color(4, Uint(10), 4)),
    (F::Rg11b10Ufloat, "rg11b10ufloat", color(3, Ufloat11, 4)),
    (F::Rgb9e5Ufloat, "rgb9e5ufloat", texture_only(3, SharedExponent, 4)),
    (F::Depth16Unorm, "depth16unorm", depth(UnormDepth(16), false, 2)),
    (F::Depth24Plus, "depth24plus", depth(UnormDepth(24), false, 4)),
    (F::Depth24PlusStencil8, "depth24plus-stencil8", depth(UnormDepth(24), true, 4)),
    (F::Depth32Float, "depth32float", depth(Float32, false, 4)),
    (F::Depth32FloatStencil8, "depth32float-stencil8", depth(Float32, true, 4)),
    (F::Stencil8, "stencil8", FormatInfo { stencil: true, blendable: false, ..color(0, Unorm8, 0) }),
];

/// Every supported format.
pub const FORMATS: [TextureFormat; TABLE.len()] = {
    let mut formats = [TextureFormat::R8Unorm; TABLE.len()];
    let mut i = 0;
    while i < TABLE.len() {
        formats[i] = TABLE[i].0;
        i += 1;
    }
    formats
};

/// Names of the supported formats, for error messages.
pub const SUPPORTED_FORMATS: &str = "r8unorm r8snorm r8uint r8sint rg8unorm rg8snorm rg8uint rg8sint rgba8unorm rgba8unorm-srgb rgba8snorm \
     rgba8uint rgba8sint bgra8unorm bgra8unorm-srgb r16uint r16sint r16float rg16uint rg16sint rg16float rgba16uint rgba16sint rgba16float \
     r32uint r32sint r32float rg32uint rg32sint rg32float rgba32uint rgba32sint rgba32float rgb10a2unorm rgb10a2uint rg11b10ufloat \
     rgb9e5ufloat depth16unorm depth24plus depth24plus-stencil8 depth32float depth32float-stencil8 stencil8";

/// The facts of a format; `None` if the format is not supported.
#[must_use]
pub fn format_info(format: TextureFormat) -> Option<FormatInfo> {
    TABLE.iter().find(|row| row.0 == format).map(|row| row.2)
}

/// WebGPU's name of a supported format.
#[must_use]
pub fn format_name(format: TextureFormat) -> Option<&'static str> {
    TABLE.iter().find(|row| row.0 == format).map(|row| row.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu_types::{Features, TextureFormatFeatureFlags, TextureUsages};

    #[test]
    fn names_are_listed_for_errors_and_every_format_is_there_once() {
        let names: Vec<_> = TABLE.iter().map(|row| row.1).collect();
        assert_eq!(names.join(" "), SUPPORTED_FORMATS);
        for (number, format) in FORMATS.into_iter().enumerate() {
            assert!(!FORMATS[..number].contains(&format), "{format:?} is there twice");
            // The name is the one that wgpu's own serialization gives.
            let spelled: String = format!("{format:?}").to_lowercase();
            assert_eq!(names[number].replace('-', ""), spelled);
        }
    }

    /// The types of wgpu say independently what WebGPU allows.
    #[test]
    fn uses_are_those_of_webgpu_with_three_features() {
        let features = Features::FLOAT32_BLENDABLE | Features::FLOAT32_FILTERABLE | Features::RG11B10UFLOAT_RENDERABLE;
        for (format, name, info) in TABLE {
            let allowed = format.guaranteed_format_features(features);
            assert_eq!(info.renderable, allowed.allowed_usages.contains(TextureUsages::RENDER_ATTACHMENT), "{name}");
            let blendable = allowed.flags.contains(TextureFormatFeatureFlags::BLENDABLE) && info.renderable && !info.depth;
            assert_eq!(info.blendable, blendable, "{name}");
            assert_eq!(info.stencil, format.has_stencil_aspect(), "{name}");
            assert_eq!(info.depth, format.has_depth_aspect(), "{name}");
            if !info.depth && !info.stencil {
                assert_eq!(info.channels, usize::from(format.components()), "{name}");
                assert_eq!(format.block_copy_size(None), Some(info.bytes as u32), "{name}");
            }
        }
    }

    #[test]
    fn bits_of_channels_fill_the_bytes() {
        for (_, name, info) in TABLE.iter().filter(|row| !row.2.depth && !row.2.stencil) {
            let bits: u32 = (0..info.channels).map(|channel| info.kind.channel_bits(channel)).sum();
            assert!(bits == 0 || bits == 8 * info.bytes as u32, "{name}: {bits}");
        }
    }
}
