//! Decodes the bytes of an EXR to layers, from any program.
//!
//! The crate `exr` reads headers and chunks and decompresses them. The positions of pixels are computed here, so no number of the file is used as an
//! index or a size before it is checked.

use std::io::Cursor;

use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::block::reader::Reader;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{ChannelDescription, SampleType};
use exr::meta::header::Header;
use exr::prelude::Compression;
use half::f16;

use super::{ExrError, UNNAMED};
use crate::{Image, Layer, LayerSet};

/// Most bytes that one byte of a file can expand to: above 1032 for deflate, the strongest compression that is read.
const MAX_EXPANSION: u128 = 2048;

/// The planes of one part, while they are filled.
struct Part {
    name: Option<String>,
    planes: Vec<Image<f32>>,
    /// Number of samples filled so far, over all planes.
    filled: u64,
}

/// The name of a channel without its layer, and its plane.
type NamedPlane = (String, Image<f32>);

/// Decodes all layers of an EXR. Half floats become floats, offsets of data windows are ignored, and only the largest mip level is read.
///
/// A declared size that the file cannot fill is refused before memory is allocated.
///
/// # Errors
/// If the bytes are not an EXR, are damaged, or need a feature that is not read.
pub fn decode(bytes: &[u8]) -> Result<LayerSet, ExrError> {
    let reader = Reader::read_from_buffered(Cursor::new(bytes), true)?;
    let meta = reader.meta_data().clone();
    check_plausible(&meta, bytes.len())?;
    let mut parts = meta.headers.iter().map(empty_part).collect::<Result<Vec<_>, _>>()?;
    for chunk in reader.all_chunks(true)? {
        fill(&mut parts, chunk?, &meta)?;
    }
    for part in &parts {
        let wanted: u64 = part.planes.iter().map(|plane| plane.pixels().len() as u64).sum();
        if part.filled != wanted {
            return Err(ExrError::WrongPixels { name: part.name.clone().unwrap_or_default() });
        }
    }
    group(parts, &meta)
}

/// Pixels of the largest layer, and samples of all, by the headers of an EXR.
pub(crate) fn measure(start: impl std::io::Read) -> Result<(u64, u64), ExrError> {
    let meta = MetaData::read_from_buffered(start, true)?;
    let pixels = |header: &Header| header.layer_size.width() as u64 * header.layer_size.height() as u64;
    let samples =
        meta.headers.iter().fold(0_u64, |sum, header| sum.saturating_add(pixels(header).saturating_mul(header.channels.list.len() as u64)));
    Ok((meta.headers.iter().map(pixels).max().unwrap_or(0), samples))
}

/// Returns an error for headers whose pixels cannot be in a file of this length.
fn check_plausible(meta: &MetaData, file_bytes: usize) -> Result<(), ExrError> {
    let mut declared_bytes = 0_u128;
    for header in &meta.headers {
        let samples = header.layer_size.width() as u128 * header.layer_size.height() as u128;
        for channel in &header.channels.list {
            declared_bytes = declared_bytes.saturating_add(samples.saturating_mul(channel.sample_type.bytes_per_sample() as u128));
        }
    }
    if declared_bytes > file_bytes as u128 * MAX_EXPANSION {
        return Err(ExrError::Implausible { declared_bytes, file_bytes });
    }
    Ok(())
}

/// Checks that a part can be read, and allocates its planes.
fn empty_part(header: &Header) -> Result<Part, ExrError> {
    let name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
    if !matches!(
        header.compression,
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ
    ) {
        return Err(ExrError::UnsupportedCompression { name: name.unwrap_or_default(), found: header.compression.to_string() });
    }
    // The header's own check refuses larger sizes. If one passed, the image would be refused as too large.
    let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let (width, height) = (side(header.layer_size.width()), side(header.layer_size.height()));
    let plane = |channel: &ChannelDescription| {
        let unsupported = |found| Err(ExrError::UnsupportedChannel { channel: channel.name.to_string(), found });
        if channel.sampling != Vec2(1, 1) {
            return unsupported("subsampled");
        }
        if channel.sample_type == SampleType::U32 {
            return unsupported("of 32-bit integers");
        }
        Ok(Image::filled(width, height, 0.0)?)
    };
    let planes = header.channels.list.iter().map(plane).collect::<Result<_, _>>()?;
    Ok(Part { name, planes, filled: 0 })
}

/// Decompresses one chunk into the planes of its part.
fn fill(parts: &mut [Part], chunk: Chunk, meta: &MetaData) -> Result<(), ExrError> {
    let block = UncompressedBlock::decompress_chunk(chunk, meta, true)?;
    let (Some(part), Some(header)) = (parts.get_mut(block.index.layer), meta.headers.get(block.index.layer)) else {
        return Err(ExrError::WrongPixels { name: String::new() });
    };
    if block.index.level != Vec2(0, 0) {
        return Ok(());
    }
    let Vec2(x, y) = block.index.pixel_position;
    let Vec2(width, height) = block.index.pixel_size;
    let mut data = block.data.as_slice();
    for row in y..y.saturating_add(height) {
        for (plane, channel) in part.planes.iter_mut().zip(&header.channels.list) {
            let bytes = data.split_off(..width.saturating_mul(channel.sample_type.bytes_per_sample()));
            let target = plane.rows_mut().nth(row).and_then(|pixels| pixels.get_mut(x..x.checked_add(width)?));
            let (Some(bytes), Some(target)) = (bytes, target) else {
                return Err(ExrError::WrongPixels { name: part.name.clone().unwrap_or_default() });
            };
            if channel.sample_type == SampleType::F16 {
                for (value, bytes) in target.iter_mut().zip(bytes.as_chunks().0) {
                    *value = f16::from_ne_bytes(*bytes).to_f32();
                }
            } else {
                for (value, bytes) in target.iter_mut().zip(bytes.as_chunks().0) {
                    *value = f32::from_ne_bytes(*bytes);
                }
            }
            part.filled += width as u64;
        }
    }
    Ok(())
}

/// Groups the channels of all parts into layers, in order of appearance.
fn group(parts: Vec<Part>, meta: &MetaData) -> Result<LayerSet, ExrError> {
    let mut groups: Vec<(String, Vec<NamedPlane>)> = Vec::new();
    for (part, header) in parts.into_iter().zip(&meta.headers) {
        for (plane, channel) in part.planes.into_iter().zip(&header.channels.list) {
            let (layer_name, channel_name) = split_name(part.name.as_deref(), &channel.name.to_string());
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

/// The layer and channel names of a channel of a part: `(Some("normal"), "X")` and `(None, "normal.X")` are the same.
pub(super) fn split_name(part: Option<&str>, channel: &str) -> (String, String) {
    let (prefix, last) = channel.rsplit_once('.').map_or((None, channel), |(prefix, last)| (Some(prefix), last));
    let layer = match (part, prefix) {
        (None, None) => UNNAMED.to_owned(),
        (Some(name), None) | (None, Some(name)) => name.to_owned(),
        (Some(part), Some(prefix)) if part == prefix => part.to_owned(),
        (Some(part), Some(prefix)) => format!("{part}.{prefix}"),
    };
    (layer, last.to_owned())
}

/// Rank of a channel in its layer; unknown names follow in alphabetical order.
fn channel_rank(name: &str) -> usize {
    const RANKS: [&[&str]; 4] = [&["R", "X", "U"], &["G", "Y", "V"], &["B", "Z"], &["A", "W"]];
    RANKS.iter().position(|names| names.contains(&name)).unwrap_or(RANKS.len())
}
