//! Multi-layer OpenEXR: files for measuring.
//!
//! In: a [`LayerSet`](crate::LayerSet). Out: a multi-part file, one part per layer in the order of the set, each part with exactly the layer's name.
//! Values are 32-bit floats with ZIP compression over 16 scan lines, so every bit pattern is preserved, NaN payloads included. Viewers without
//! support for parts show the first one. Channels are `Y`, `X Y`, `R G B` or `R G B A`, which viewers show as grey, vectors and colours.
//!
//! Equal layers give equal bytes: blocks are compressed in parallel but written in order, and neither time nor machine is recorded.
//!
//! The reader also accepts files of other renderers: half floats, tiles, and the older convention of one part whose channels have the layer as a
//! prefix (`diffuse.R`). A part without a name is the layer `color`. Lossy compression and integer channels are refused, and the error names them.

mod read;
mod write;

pub use read::decode;
pub(crate) use read::measure;
pub use write::encode;

use crate::{LayerError, SizeError};

/// The first bytes of every EXR.
pub const SIGNATURE: &[u8] = &[0x76, 0x2f, 0x31, 0x01];

/// Name of the layer for channels without a named part or prefix.
pub const UNNAMED: &str = "color";

/// Why an EXR cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ExrError {
    /// There is no layer; an EXR has at least one.
    #[error("there is no layer to write")]
    NoLayers,
    /// A layer is too large; coordinates of an EXR are signed 32-bit numbers.
    #[error("layer `{name}` is {width}x{height} pixels; an EXR holds at most 2147483647 in each direction")]
    TooLarge {
        /// Name of the layer.
        name: String,
        /// Its width, in pixels.
        width: u32,
        /// Its height, in pixels.
        height: u32,
    },
    /// The header declares more pixels than the bytes of the file can hold.
    #[error("the EXR declares {declared_bytes} bytes of pixels, more than its {file_bytes} bytes can hold")]
    Implausible {
        /// Bytes of all pixels of all parts.
        declared_bytes: u128,
        /// Length of the file.
        file_bytes: usize,
    },
    /// The pixels have lossy compression, which is not suitable for measuring.
    #[error("layer `{name}` is compressed as {found}; uncompressed, RLE, ZIP and PIZ are read, which lose nothing")]
    UnsupportedCompression {
        /// Name of the part, empty if it has none.
        name: String,
        /// Name of the compression.
        found: String,
    },
    /// The channel is stored in a form that layers do not have.
    #[error("channel `{channel}` is {found}; only full-resolution half and float channels are read")]
    UnsupportedChannel {
        /// Name of the channel in the file.
        channel: String,
        /// The form.
        found: &'static str,
    },
    /// Blocks of pixels are missing, duplicate, or outside of the image.
    #[error("layer `{name}` does not have every pixel exactly once")]
    WrongPixels {
        /// Name of the part, empty if it has none.
        name: String,
    },
    /// The file is damaged, or uses a part of the format that is not supported.
    #[error("not a valid EXR")]
    Codec(#[from] exr::error::Error),
    /// The pixels do not form an image.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// The channels do not form layers.
    #[error(transparent)]
    Layer(#[from] LayerError),
}

#[cfg(test)]
mod tests;
