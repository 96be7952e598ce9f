//! Texture formats: how many planes a format has, what a stored number can be, and the bytes it is.
//!
//! A texture holds decoded f32 planes (`texture.rs`), red, green, blue and alpha whatever the order of the bytes. Integers are kept as the bit
//! patterns of 32-bit integers, which no arithmetic on floats may touch. `facts` says what each format is and may be used for; [`Quantizer`]
//! rounds what a shader wrote to a number that the format can hold; [`encode_texel`] and [`decode_texel`] turn such numbers into the format's
//! bytes and back without loss. The rules of one kind of number are in one file each. `docs/formats.md` is the table for readers.

pub(crate) mod depth;
pub(crate) mod facts;
pub(crate) mod integer;
pub(crate) mod nan;
pub(crate) mod normalized;
pub(crate) mod quantize;
pub(crate) mod shared_exponent;
pub(crate) mod small_float;
pub(crate) mod srgb;
pub(crate) mod texel;

pub use depth::{depth_value, quantize_depth};
pub use facts::{ChannelKind, FORMATS, FormatInfo, SUPPORTED_FORMATS, format_info, format_name};
pub use quantize::Quantizer;
pub use small_float::{f16_to_f32, f32_to_f16, f32_to_ufloat, ufloat_to_f32};
pub use srgb::{linear_to_srgb8, srgb8_to_linear};
pub use texel::{decode_texel, encode_texel};
