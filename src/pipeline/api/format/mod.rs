//! Texture formats: the planes of each format, the numbers that a plane can hold, and the bytes of a texel.
//!
//! A texture holds decoded f32 planes (`texture.rs`) in the order red, green, blue, alpha, whatever the order of the bytes is. Integers are kept as
//! the bit patterns of 32-bit integers; float arithmetic must not touch them. `facts` is the table of formats; [`Quantizer`] rounds a shader's output
//! to a number that the format can hold; [`encode_texel`] and [`decode_texel`] convert such numbers to the format's bytes and back without loss. Each
//! kind of number has a file of its own. `docs/formats.md` is the table for readers.

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
