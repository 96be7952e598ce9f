//! Encodes layers to the bytes of an EXR.

use std::io::Cursor;

use exr::block::writer::ChunksWriter as _;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, IntegerBounds, LineOrder, SampleType, Text};
use exr::meta::header::Header;
use exr::prelude::{Compression, SmallVec};
use rayon::prelude::*;

use super::ExrError;
use crate::{Image, Layer, LayerSet};

/// Blocks compressed at a time: enough to occupy the threads, few enough to bound memory (16 scan lines each).
const BATCH: usize = 64;

/// Names of the channels in the order of the planes, by number of channels.
const CHANNEL_NAMES: [&[&str]; 4] = [&["Y"], &["X", "Y"], &["R", "G", "B"], &["R", "G", "B", "A"]];

/// The planes of a layer with their channel names, in the alphabetical order that the format requires.
fn sorted_channels(layer: &Layer) -> Vec<(&'static str, &Image<f32>)> {
    let mut channels: Vec<_> = CHANNEL_NAMES[layer.channel_count() - 1].iter().copied().zip(layer.planes()).collect();
    channels.sort_unstable_by_key(|(name, _)| *name);
    channels
}

/// Encodes all layers without loss. The display window of the file is the size of the first layer.
///
/// # Errors
/// If there is no layer, or one is too large for the format.
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
                writer.write_chunk(index_in_header, chunk?)?;
            }
        }
        Ok(())
    })?;
    Ok(bytes.into_inner())
}

/// The size of a layer, if the format can represent it.
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

/// The pixels of one block in the format's layout: row by row, channel by channel.
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
