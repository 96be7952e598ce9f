//! The pixels of a PNG as a zlib stream, made in parallel.
//!
//! Rows are cut into bands of about [`BAND_BYTES`]; the cut depends on the size of the picture alone. Each band is filtered and compressed
//! separately. A deflate stream may be flushed to a whole byte anywhere, so the compressed bands in sequence form one stream. A band cannot refer to
//! the one before it: files are about half a percent larger than with one stream.

use miniz_oxide::deflate::core::{CompressorOxide, TDEFLFlush, TDEFLStatus, compress_to_output, create_comp_flags_from_zip_params};
use rayon::prelude::*;

use crate::Image;

/// Bytes of a band before compression: four windows of deflate, and enough bands to occupy the threads.
const BAND_BYTES: usize = 128 << 10;

/// Compression level, 0 to 9.
const LEVEL: i32 = 6;

/// Header of a zlib stream: deflate with a window of 32 KiB, default level.
const ZLIB_HEADER: [u8; 2] = [0x78, 0x9c];

/// Modulus of the Adler-32 checksum.
const ADLER_MODULUS: u32 = 65521;

/// The zlib stream of a picture: each row of codes with its filter byte, `pixel_bytes` bytes a pixel.
pub(super) fn compress(codes: &Image<u8>, pixel_bytes: usize) -> Vec<u8> {
    let row_bytes = codes.width() as usize;
    let band_rows = (BAND_BYTES / (row_bytes + 1)).max(1);
    let pixels = codes.pixels();
    let last = (codes.height() as usize - 1) / band_rows;
    let bands: Vec<(Vec<u8>, Adler)> = pixels
        .par_chunks(band_rows * row_bytes)
        .enumerate()
        .map(|(band, rows)| {
            let before = (band * band_rows * row_bytes).checked_sub(row_bytes).map(|start| &pixels[start..start + row_bytes]);
            let filtered = filter_rows(rows, before, row_bytes, pixel_bytes);
            let flush = if band == last { TDEFLFlush::Finish } else { TDEFLFlush::Sync };
            (deflate(&filtered, flush), Adler::of(&filtered))
        })
        .collect();
    let mut stream = ZLIB_HEADER.to_vec();
    let mut sum = Adler::of(&[]);
    for (compressed, band_sum) in bands {
        stream.extend(compressed);
        sum = sum.then(band_sum);
    }
    stream.extend((sum.b << 16 | sum.a).to_be_bytes());
    stream
}

/// A band as a piece of a raw deflate stream, up to a whole byte.
fn deflate(bytes: &[u8], flush: TDEFLFlush) -> Vec<u8> {
    // A window of 0 bits means no zlib header; the header belongs before the first band only.
    let mut compressor = CompressorOxide::new(create_comp_flags_from_zip_params(LEVEL, 0, 0));
    let mut compressed = Vec::with_capacity(bytes.len() / 2);
    let (status, read) = compress_to_output(&mut compressor, bytes, flush, |part| {
        compressed.extend_from_slice(part);
        true
    });
    debug_assert!(matches!(status, TDEFLStatus::Okay | TDEFLStatus::Done) && read == bytes.len(), "a callback never refuses bytes");
    compressed
}

/// Rows with their filter bytes; `before` is the row above the first.
fn filter_rows(rows: &[u8], before: Option<&[u8]>, row_bytes: usize, pixel_bytes: usize) -> Vec<u8> {
    let zeros = vec![0; row_bytes];
    let mut above = before.unwrap_or(&zeros);
    let mut filtered = Vec::with_capacity(rows.len() + rows.len() / row_bytes);
    let (mut best, mut tried) = (vec![0; row_bytes], vec![0; row_bytes]);
    for row in rows.chunks_exact(row_bytes) {
        let (mut best_cost, mut best_filter) = (u64::MAX, 0);
        for filter in FILTERS {
            filter.apply(row, above, pixel_bytes, &mut tried);
            let cost = cost(&tried);
            if cost < best_cost {
                (best_cost, best_filter) = (cost, filter as u8);
                std::mem::swap(&mut best, &mut tried);
            }
        }
        filtered.push(best_filter);
        filtered.extend_from_slice(&best);
        above = row;
    }
    filtered
}

/// Sum of the magnitudes of the bytes as signed numbers. The row with the least sum usually compresses best [PNG 12.7].
fn cost(row: &[u8]) -> u64 {
    // Partial sums fit 16 bits, so that they can be vectorized.
    row.chunks(128).map(|part| u64::from(part.iter().map(|&byte| u16::from((byte as i8).unsigned_abs())).sum::<u16>())).sum()
}

/// How a row is predicted, with the format's numbers. Type 0, no prediction, is almost never best for a rendered picture.
#[derive(Clone, Copy)]
enum Filter {
    /// From the pixel on the left.
    Sub = 1,
    /// From the pixel above.
    Up = 2,
    /// From the mean of both.
    Average = 3,
    /// From left, above or above left, whichever is nearest to left + above − above left.
    Paeth = 4,
}

/// The filters that are tried. Of equally good ones the first is taken.
const FILTERS: [Filter; 4] = [Filter::Paeth, Filter::Average, Filter::Sub, Filter::Up];

impl Filter {
    /// Writes the differences of a row from its prediction. Pixels outside of the picture are zero.
    fn apply(self, row: &[u8], above: &[u8], pixel_bytes: usize, out: &mut [u8]) {
        match self {
            Self::Sub => predict(row, above, pixel_bytes, out, |left, _, _| left),
            Self::Up => predict(row, above, pixel_bytes, out, |_, up, _| up),
            Self::Average => predict(row, above, pixel_bytes, out, |left, up, _| ((u16::from(left) + u16::from(up)) / 2) as u8),
            Self::Paeth => predict(row, above, pixel_bytes, out, paeth),
        }
    }
}

/// `out = row − prediction(left, above, above left)`, byte by byte.
#[inline(always)]
fn predict(row: &[u8], above: &[u8], pixel_bytes: usize, out: &mut [u8], prediction: impl Fn(u8, u8, u8) -> u8) {
    let first = pixel_bytes.min(row.len());
    for i in 0..first {
        out[i] = row[i].wrapping_sub(prediction(0, above[i], 0));
    }
    let lefts = row.iter().zip(above);
    for ((out, (&byte, &up)), (&left, &up_left)) in out[first..].iter_mut().zip(row[first..].iter().zip(&above[first..])).zip(lefts) {
        *out = byte.wrapping_sub(prediction(left, up, up_left));
    }
}

/// Paeth's predictor. For equal distances, left precedes above, and above precedes above left.
#[inline(always)]
fn paeth(left: u8, up: u8, up_left: u8) -> u8 {
    let (a, b, c) = (i16::from(left), i16::from(up), i16::from(up_left));
    let (to_left, to_up, to_up_left) = ((b - c).abs(), (a - c).abs(), (a + b - 2 * c).abs());
    let nearest_of_up = if to_up <= to_up_left { up } else { up_left };
    if to_left <= to_up && to_left <= to_up_left { left } else { nearest_of_up }
}

/// The Adler-32 checksum of some bytes, with their number. The checksums of two pieces can be combined to that of the whole.
#[derive(Clone, Copy)]
struct Adler {
    a: u32,
    b: u32,
    length: u64,
}

impl Adler {
    fn of(bytes: &[u8]) -> Self {
        let (mut a, mut b) = (1_u32, 0_u32);
        // The largest number of bytes for which neither sum can overflow.
        for part in bytes.chunks(5552) {
            for &byte in part {
                a += u32::from(byte);
                b += a;
            }
            a %= ADLER_MODULUS;
            b %= ADLER_MODULUS;
        }
        Self { a, b, length: bytes.len() as u64 }
    }

    /// The checksum of these bytes followed by the next ones: `a = a₁ + a₂ − 1`, `b = b₁ + b₂ + n₂·(a₁ − 1)`.
    fn then(self, next: Self) -> Self {
        let modulus = u64::from(ADLER_MODULUS);
        let before = u64::from(self.a) + modulus - 1;
        Self {
            a: ((before + u64::from(next.a)) % modulus) as u32,
            b: ((u64::from(self.b) + u64::from(next.b) + (next.length % modulus) * (before % modulus)) % modulus) as u32,
            length: self.length + next.length,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_of_pieces_is_that_of_the_whole() {
        // The value for "Wikipedia" is in RFC 1950's literature.
        let known = Adler::of(b"Wikipedia");
        assert_eq!(known.b << 16 | known.a, 0x11E6_0398);
        let bytes: Vec<u8> = (0..300_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let whole = Adler::of(&bytes);
        for cut in [0, 1, 5552, 65_521, 299_999, 300_000] {
            let joined = Adler::of(&bytes[..cut]).then(Adler::of(&bytes[cut..]));
            assert_eq!((joined.a, joined.b), (whole.a, whole.b), "cut at {cut}");
        }
    }

    #[test]
    fn prediction_breaks_ties_as_the_format_says() {
        assert_eq!([paeth(1, 1, 1), paeth(10, 20, 20), paeth(10, 20, 10), paeth(0, 9, 4), paeth(8, 0, 4)], [1, 10, 20, 4, 4]);
    }
}
