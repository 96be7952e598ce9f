//! Multi-layer OpenEXR: the file to measure.
//!
//! In: a [`LayerSet`]. Out: a multi-part file, one part per layer in the order of the set, each part named exactly as the layer; 32-bit
//! floats, ZIP over 16 scan lines, so every bit pattern comes back, NaN payloads included. Viewers that know no parts show the first.
//! Channels are `Y`, `X Y`, `R G B` or `R G B A`, which is how viewers know grey, vectors and colours.
//!
//! Equal layers give equal bytes: blocks are compressed in parallel but written in order, and no time or machine is recorded.
//!
//! The reader also takes what other renderers write: half floats, tiles, and the older convention of one part whose channels carry the
//! layer as a prefix (`diffuse.R`). A part without a name is the layer `color`.

use std::io::Cursor;

use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::{AnyChannel, FlatSamples};
use exr::math::Vec2;
use exr::meta::attribute::{ChannelDescription, IntegerBounds, LineOrder, SampleType, Text};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{Compression, SmallVec};
use rayon::prelude::*;

use crate::image::{Image, Layer, LayerError, LayerSet, SizeError};

/// The first bytes of every EXR.
pub const SIGNATURE: &[u8] = &[0x76, 0x2f, 0x31, 0x01];

/// Name given to channels that belong to no named part or prefix.
pub const UNNAMED: &str = "color";

/// Blocks compressed at a time: enough to keep the threads busy, few enough to bound memory (16 scan lines each).
const BATCH: usize = 64;

/// Most bytes that one byte of a file can become: above the 1032 of deflate, the strongest compression the reader knows.
const MAX_EXPANSION: u128 = 2048;

/// Why an EXR cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ExrError {
    /// An EXR holds at least one layer.
    #[error("there is no layer to write")]
    NoLayers,
    /// Coordinates of an EXR are signed 32-bit numbers.
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
    /// The channel is stored in a way that layers do not have.
    #[error("channel `{channel}` is {found}; only full-resolution half and float channels are read")]
    UnsupportedChannel {
        /// Name of the channel in the file.
        channel: String,
        /// How it is stored.
        found: &'static str,
    },
    /// The file is damaged, or uses a part of the format that is not supported.
    #[error("not a valid EXR")]
    Codec(#[from] exr::error::Error),
    /// The pixels do not make an image.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// The channels do not make layers.
    #[error(transparent)]
    Layer(#[from] LayerError),
}

/// Names of the channels, by their number, in the order of the planes.
const CHANNEL_NAMES: [&[&str]; 4] = [&["Y"], &["X", "Y"], &["R", "G", "B"], &["R", "G", "B", "A"]];

/// Planes of a layer with their channel names, in the alphabetical order that the format demands.
fn sorted_channels(layer: &Layer) -> Vec<(&'static str, &Image<f32>)> {
    let mut channels: Vec<_> = CHANNEL_NAMES[layer.channel_count() - 1].iter().copied().zip(layer.planes()).collect();
    channels.sort_unstable_by_key(|(name, _)| *name);
    channels
}

/// Encodes all layers, losslessly. The display window of the file is the size of the first layer.
pub fn encode(layers: &LayerSet) -> Result<Vec<u8>, ExrError> {
    let first = layers.iter().next().ok_or(ExrError::NoLayers)?;
    let display_window = IntegerBounds::from_dimensions(exr_size(first)?);
    let headers =
        layers.iter().map(|layer| Ok(header(layer)?.with_display_window(display_window))).collect::<Result<SmallVec<_>, ExrError>>()?;
    let planes: Vec<_> = layers.iter().map(sorted_channels).collect();

    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, headers, true, |meta, writer| {
        let blocks: Vec<(usize, BlockIndex)> = meta.enumerate_ordered_header_block_indices().collect();
        for batch in blocks.chunks(BATCH) {
            let chunks: Vec<_> = batch
                .par_iter()
                .map(|&(index_in_header, index)| {
                    let block = UncompressedBlock { index, data: block_bytes(&planes[index.layer], index) };
                    (index_in_header, block.compress_to_chunk(&meta.headers))
                })
                .collect();
            for (index_in_header, chunk) in chunks {
                exr::block::writer::ChunksWriter::write_chunk(writer, index_in_header, chunk?)?;
            }
        }
        Ok(())
    })?;
    Ok(bytes.into_inner())
}

/// The size of a layer, if the format can express it.
fn exr_size(layer: &Layer) -> Result<Vec2<usize>, ExrError> {
    let (width, height) = (layer.width(), layer.height());
    if i32::try_from(width).is_err() || i32::try_from(height).is_err() {
        return Err(ExrError::TooLarge { name: layer.name().to_owned(), width, height });
    }
    Ok(Vec2(width as usize, height as usize))
}

/// The header of one part.
fn header(layer: &Layer) -> Result<Header, ExrError> {
    let channels = sorted_channels(layer).iter().map(|(name, _)| ChannelDescription::named(*name, SampleType::F32)).collect();
    Ok(Header::new(Text::from(layer.name()), exr_size(layer)?, channels).with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    ))
}

/// The pixels of one block as the format lays them out: row by row, channel by channel.
fn block_bytes(channels: &[(&str, &Image<f32>)], index: BlockIndex) -> Vec<u8> {
    let (x, y) = (index.pixel_position.x(), index.pixel_position.y());
    let mut data = Vec::with_capacity(index.pixel_size.area() * channels.len() * size_of::<f32>());
    for row in y..y + index.pixel_size.y() {
        for (_, plane) in channels {
            let start = row * plane.width() as usize + x;
            data.extend_from_slice(bytemuck::cast_slice(&plane.pixels()[start..start + index.pixel_size.x()]));
        }
    }
    data
}

/// Decodes all layers of an EXR; half floats become floats, positions of data windows are dropped.
///
/// A declared size that the bytes present cannot fill is refused before memory is taken for it.
pub fn decode(bytes: &[u8]) -> Result<LayerSet, ExrError> {
    check_plausible(&MetaData::read_from_buffered(Cursor::new(bytes), true)?, bytes.len())?;
    let picture = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .pedantic()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))?;

    // Group the channels of all parts by layer, in order of appearance.
    let mut groups: Vec<(String, Vec<NamedPlane>)> = Vec::new();
    for part in picture.layer_data {
        let (width, height) = (part.size.width(), part.size.height());
        let part_name = part.attributes.layer_name.map(|name| name.to_string());
        for channel in part.channel_data.list {
            let full_name = channel.name.to_string();
            let (layer_name, channel_name) = split_name(part_name.as_deref(), &full_name);
            let plane = Image::from_vec(u32_size(width), u32_size(height), floats(channel, &full_name)?)?;
            match groups.iter_mut().find(|(name, _)| *name == layer_name) {
                Some((_, channels)) => channels.push((channel_name, plane)),
                None => groups.push((layer_name, vec![(channel_name, plane)])),
            }
        }
    }

    let mut layers = LayerSet::new();
    for (name, mut channels) in groups {
        channels.sort_by(|(a, _), (b, _)| (channel_rank(a), a).cmp(&(channel_rank(b), b)));
        layers.push(Layer::new(name, channels.into_iter().map(|(_, plane)| plane).collect())?)?;
    }
    Ok(layers)
}

/// A channel's own name, without the layer, and its numbers.
type NamedPlane = (String, Image<f32>);

/// Refuses headers whose pixels cannot be in a file of this length.
fn check_plausible(meta: &MetaData, file_bytes: usize) -> Result<(), ExrError> {
    let header_bytes = |header: &Header| {
        let samples = header.layer_size.width() as u128 * header.layer_size.height() as u128;
        header
            .channels
            .list
            .iter()
            .map(|channel| samples.saturating_mul(channel.sample_type.bytes_per_sample() as u128))
            .fold(0, u128::saturating_add)
    };
    let declared_bytes = meta.headers.iter().map(header_bytes).fold(0, u128::saturating_add);
    if declared_bytes > file_bytes as u128 * MAX_EXPANSION {
        return Err(ExrError::Implausible { declared_bytes, file_bytes });
    }
    Ok(())
}

/// Sizes of an EXR are 31-bit; a larger one cannot come out of the decoder, and would be refused as a wrong pixel count.
fn u32_size(size: usize) -> u32 {
    u32::try_from(size).unwrap_or(u32::MAX)
}

/// The numbers of a channel as floats.
fn floats(channel: AnyChannel<FlatSamples>, name: &str) -> Result<Vec<f32>, ExrError> {
    let unsupported = |found| Err(ExrError::UnsupportedChannel { channel: name.to_owned(), found });
    if channel.sampling != Vec2(1, 1) {
        return unsupported("subsampled");
    }
    match channel.sample_data {
        FlatSamples::F32(samples) => Ok(samples),
        FlatSamples::F16(samples) => Ok(samples.into_iter().map(f32::from).collect()),
        FlatSamples::U32(_) => unsupported("of 32-bit integers"),
    }
}

/// Layer and channel that a channel of a part belongs to: `(Some("normal"), "X")` and `(None, "normal.X")` are the same.
fn split_name(part: Option<&str>, channel: &str) -> (String, String) {
    let (prefix, last) = channel.rsplit_once('.').map_or((None, channel), |(prefix, last)| (Some(prefix), last));
    let layer = match (part, prefix) {
        (None, None) => UNNAMED.to_owned(),
        (Some(name), None) | (None, Some(name)) => name.to_owned(),
        (Some(part), Some(prefix)) if part == prefix => part.to_owned(),
        (Some(part), Some(prefix)) => format!("{part}.{prefix}"),
    };
    (layer, last.to_owned())
}

/// Place of a channel among its fellows; unknown names follow in alphabetical order.
fn channel_rank(name: &str) -> usize {
    const RANKS: [&[&str]; 4] = [&["R", "X", "U"], &["G", "Y", "V"], &["B", "Z"], &["A", "W"]];
    RANKS.iter().position(|names| names.contains(&name)).unwrap_or(RANKS.len())
}

#[cfg(test)]
#[path = "openexr_tests.rs"]
mod tests;
