//! 8-bit sRGB PNG: files for looking at.
//!
//! In: one float layer, linear. Out: the bytes of a PNG with an `sRGB` chunk and no other metadata. Equal layers give equal bytes on any number of
//! threads (`stream` describes how threads share the compression). Colours pass through [`ToneMap`], the sRGB curve and 8-bit rounding, all defined
//! in [`crate::tone`]. Decoding accepts any PNG (palette, 1 to 16 bits, interlaced) and gives display-referred linear light in `0..=1`; the tone map
//! is not undone.

mod stream;

use std::io::Cursor;

use rayon::prelude::*;

use crate::tone::{ToneMap, quantize_8bit, srgb_code, srgb_decode};
use crate::{Image, Layer, LayerError, SizeError};

/// Name of the layer that [`decode`] returns.
pub const DECODED_NAME: &str = "color";

/// The first bytes of every PNG.
pub const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Most bytes that one byte of a deflate stream can expand to (258 bytes from two bits), rounded up.
const MAX_EXPANSION: u64 = 1040;

/// Most bytes of the stream in one chunk of a file; the format allows twice as many.
const MAX_CHUNK_BYTES: usize = 1 << 30;

/// Why a PNG cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// A layer of two channels; a PNG has grey, RGB or RGBA.
    #[error("layer `{name}` has 2 channels; a PNG takes 1 (grey), 3 (RGB) or 4 (RGBA)")]
    TwoChannels {
        /// Name of the layer.
        name: String,
    },
    /// The encoder refused the picture.
    #[error("the picture cannot be encoded as PNG")]
    Encode(#[from] png::EncodingError),
    /// The file is not a PNG, or is damaged.
    #[error("not a valid PNG")]
    Decode(#[from] png::DecodingError),
    /// The header declares more pixels than the bytes of the file can hold.
    #[error("the PNG declares {width}x{height} pixels, more than its {file_bytes} bytes can hold")]
    Implausible {
        /// Width declared, in pixels.
        width: u32,
        /// Height declared, in pixels.
        height: u32,
        /// Length of the file.
        file_bytes: usize,
    },
    /// The pixels do not form an image.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// The pixels do not form a layer.
    #[error(transparent)]
    Layer(#[from] LayerError),
}

/// Encodes a layer of 1 (grey), 3 (RGB) or 4 channels (RGBA; alpha is straight and stays linear) as an 8-bit PNG.
///
/// # Errors
/// If the layer has 2 channels, or the encoder refuses the picture.
pub fn encode(layer: &Layer, tone: &ToneMap) -> Result<Vec<u8>, PngError> {
    let color = match layer.channel_count() {
        1 => png::ColorType::Grayscale,
        3 => png::ColorType::Rgb,
        4 => png::ColorType::Rgba,
        _ => return Err(PngError::TwoChannels { name: layer.name().to_owned() }),
    };
    let codes = codes(layer, tone)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, layer.width(), layer.height());
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    for part in stream::compress(&codes, layer.channel_count()).chunks(MAX_CHUNK_BYTES) {
        writer.write_chunk(png::chunk::IDAT, part)?;
    }
    writer.finish()?;
    Ok(bytes)
}

/// The display codes of a layer, `channel_count` bytes per pixel, interleaved: an image wider by that factor.
fn codes(layer: &Layer, tone: &ToneMap) -> Result<Image<u8>, PngError> {
    let (width, channels) = (layer.width() as usize, layer.channel_count());
    let too_wide = SizeError::TooLarge { width: layer.width(), height: layer.height(), bytes_per_pixel: channels };
    let row_bytes = u32::try_from(width * channels).map_err(|_| too_wide)?;
    let mut codes = Image::filled(row_bytes, layer.height(), 0_u8)?;
    let planes: Vec<&[f32]> = layer.planes().iter().map(Image::pixels).collect();
    let shown = |rgb: [f32; 3]| tone.apply(rgb).map(srgb_code);
    codes.pixels_mut().par_chunks_exact_mut(row_bytes as usize).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
            let at = y * width + x;
            if channels == 1 {
                pixel[0] = shown([planes[0][at]; 3])[0];
            } else {
                pixel[..3].copy_from_slice(&shown([planes[0][at], planes[1][at], planes[2][at]]));
            }
            if channels == 4 {
                pixel[3] = quantize_8bit(planes[3][at]);
            }
        }
    });
    Ok(codes)
}

/// Bytes from a PNG's start to the end of its size.
pub(crate) const HEADER_BYTES: usize = 24;

/// Number of pixels that the first [`HEADER_BYTES`] of a PNG declare; 0 where they do not, which decoding will refuse.
pub(crate) fn declared_pixels(start: &[u8]) -> u64 {
    let number = |at: usize| start.get(at..at + 4).map_or(0, |b| u64::from(u32::from_be_bytes([b[0], b[1], b[2], b[3]])));
    number(16) * number(20)
}

/// Decodes any PNG to a layer named [`DECODED_NAME`]: 1 (grey), 2 (grey and alpha), 3 or 4 channels, linear light, alpha as stored.
///
/// A declared size that the file cannot fill is refused before memory is allocated.
///
/// # Errors
/// If the bytes are not a PNG or are damaged.
pub fn decode(bytes: &[u8]) -> Result<Layer, PngError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info()?;
    let (width, height) = reader.info().size();
    let implausible = PngError::Implausible { width, height, file_bytes: bytes.len() };
    // The stream must give at least one bit per pixel.
    if u64::from(width) * u64::from(height) / 8 > bytes.len() as u64 * MAX_EXPANSION {
        return Err(implausible);
    }
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    let Some(buffer_bytes) = reader.output_buffer_size() else {
        return Err(implausible);
    };
    let buffer_width =
        u32::try_from(buffer_bytes / height as usize).map_err(|_| PngError::Implausible { width, height, file_bytes: bytes.len() })?;
    let mut buffer = Image::filled(buffer_width, height, 0_u8)?;
    reader.next_frame(buffer.pixels_mut())?;
    reader.finish()?;

    let sample: Box<dyn Fn(usize) -> f32> = match depth {
        png::BitDepth::Sixteen => {
            Box::new(|at| f32::from(u16::from_be_bytes([buffer.pixels()[2 * at], buffer.pixels()[2 * at + 1]])) / 65535.0)
        }
        _ => Box::new(|at| f32::from(buffer.pixels()[at]) / 255.0),
    };
    let has_alpha = channels % 2 == 0;
    let plane = |channel: usize| {
        Image::from_fn(width, height, |x, y| {
            let value = sample((y as usize * width as usize + x as usize) * channels + channel);
            if has_alpha && channel + 1 == channels { value } else { srgb_decode(value) }
        })
    };
    let planes = (0..channels).map(plane).collect::<Result<_, _>>()?;
    Ok(Layer::new(DECODED_NAME, planes)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tone::srgb_encode;

    /// A tone map that changes nothing in `0..=1`: with `white` at 1 the shoulder is a straight line to 1 as well.
    const IDENTITY: ToneMap = ToneMap { exposure: 1.0, shoulder: 0.99, white: 1.0, desaturation: 0.0 };

    fn ramp(channels: usize) -> Layer {
        let plane = |channel: u32| Image::from_fn(16, 16, |x, y| srgb_decode(((16 * y + x + 37 * channel) % 256) as f32 / 255.0)).unwrap();
        Layer::new("color", (0..channels as u32).map(plane).collect()).unwrap()
    }

    #[test]
    fn codes_survive_writing_and_reading() {
        for channels in [1, 3] {
            let layer = ramp(channels);
            let decoded = decode(&encode(&layer, &IDENTITY).unwrap()).unwrap();
            for (plane, expected) in decoded.planes().iter().zip(layer.planes()) {
                assert_eq!(plane, expected, "{channels} channels");
            }
        }
    }

    #[test]
    fn alpha_is_neither_tone_mapped_nor_curved() {
        let layer = Layer::from_pixels("color", 1, 1, &[[0.0, 0.5, 90.0, 128.0 / 255.0]]).unwrap();
        let decoded = decode(&encode(&layer, &ToneMap::default()).unwrap()).unwrap();
        assert_eq!(decoded.planes()[3].pixels(), [128.0 / 255.0]);
    }

    #[test]
    fn tone_map_and_curve_are_applied_in_order() {
        let tone = ToneMap::default();
        let rgb = [3.0, 1.0, 0.25];
        let layer = Layer::from_pixels("color", 1, 1, &[rgb]).unwrap();
        let decoded = decode(&encode(&layer, &tone).unwrap()).unwrap();
        for (plane, shown) in decoded.planes().iter().zip(tone.apply(rgb)) {
            assert_eq!(plane.pixels()[0], srgb_decode(f32::from(quantize_8bit(srgb_encode(shown))) / 255.0));
        }
    }

    #[test]
    fn broken_numbers_become_black_or_white() {
        let layer = Layer::from_pixels("color", 2, 1, &[[f32::NAN, -1.0, f32::NEG_INFINITY], [f32::INFINITY; 3]]).unwrap();
        let decoded = decode(&encode(&layer, &ToneMap::default()).unwrap()).unwrap();
        assert!(decoded.planes().iter().all(|plane| plane.pixels() == [0.0, 1.0]));
    }

    #[test]
    fn two_channels_are_refused() {
        let layer = Layer::from_pixels("uv", 1, 1, &[[0.0, 1.0]]).unwrap();
        assert!(matches!(encode(&layer, &IDENTITY), Err(PngError::TwoChannels { name }) if name == "uv"));
    }

    #[test]
    fn bytes_do_not_depend_on_the_number_of_threads() {
        // Large enough for several bands.
        let plane = |channel: u32| Image::from_fn(500, 400, |x, y| ((x * 7 + y * 3 + channel * 11) % 97) as f32 / 60.0).unwrap();
        let layer = Layer::new("color", (0..3).map(plane).collect()).unwrap();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| encode(&layer, &ToneMap::default()).unwrap())
        };
        assert!(with(1) == with(2) && with(1) == with(7));
    }

    #[test]
    fn pictures_of_several_bands_and_of_any_width_survive() {
        for (width, height, channels) in [(1, 300_000, 1), (131_073, 3, 1), (517, 301, 3), (400, 250, 4)] {
            let code = |x: u32, y: u32, channel: u32| (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503) ^ (channel * 77)) >> 11;
            let value = |code: u32| srgb_decode(f32::from(code as u8) / 255.0);
            let plane = |channel: u32| {
                Image::from_fn(width, height, |x, y| {
                    let code = code(x, y, channel);
                    if channel == 3 { f32::from(code as u8) / 255.0 } else { value(code) }
                })
            };
            let layer = Layer::new(DECODED_NAME, (0..channels).map(|channel| plane(channel).unwrap()).collect()).unwrap();
            assert!(decode(&encode(&layer, &IDENTITY).unwrap()).unwrap() == layer, "{width}x{height}, {channels} channels");
        }
    }

    #[test]
    fn sixteen_bit_and_palette_files_are_read() {
        let mut wide = Vec::new();
        let mut encoder = png::Encoder::new(&mut wide, 1, 1);
        encoder.set_color(png::ColorType::GrayscaleAlpha);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(&[0xff, 0xff, 0x80, 0x00]).unwrap();
        let layer = decode(&wide).unwrap();
        assert_eq!((layer.planes()[0].pixels()[0], layer.planes()[1].pixels()[0]), (1.0, 32768.0 / 65535.0));

        let mut indexed = Vec::new();
        let mut encoder = png::Encoder::new(&mut indexed, 2, 1);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::One);
        encoder.set_palette(vec![0, 0, 0, 255, 0, 255]);
        encoder.write_header().unwrap().write_image_data(&[0b0100_0000]).unwrap();
        let layer = decode(&indexed).unwrap();
        assert_eq!(layer.planes().iter().map(|plane| plane.pixels()[1]).collect::<Vec<_>>(), [1.0, 0.0, 1.0]);
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = encode(&ramp(3), &IDENTITY).unwrap();
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "the first {length} of {} bytes were accepted", bytes.len());
        }
    }

    #[test]
    fn a_declared_size_beyond_the_bytes_is_refused() {
        let mut huge = Vec::new();
        drop(png::Encoder::new(&mut huge, 1 << 12, 1 << 30).write_header().unwrap());
        // The encoder's own end marker follows; give it a data chunk so that the header is what fails.
        let idat = b"\0\0\0\0IDAT\x35\xaf\x06\x1e";
        let header_end = 8 + 25;
        huge.splice(header_end..header_end, idat.iter().copied());
        assert!(matches!(decode(&huge), Err(PngError::Implausible { width: 4096, .. })), "{:?}", decode(&huge));
    }
}
