//! Two versions of one attachment, pixel by pixel.

use crate::pipeline::{ChannelKind, FormatInfo, Surface};

/// How far two attachments are apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels with any bit that differs; not-a-number equals not-a-number, and −0 equals 0.
    pub differing: u64,
    /// Pixels beyond the tolerance.
    pub outliers: u64,
    /// Outliers whose value lies, within the tolerance, between those that the other version has next to the pixel: an edge that moved.
    pub at_edges: u64,
    /// Greatest distance in units in the last place, outliers included. Integers: their difference.
    pub max_ulp: u64,
    /// Greatest relative error of the pixels within the tolerance.
    pub max_relative: f64,
    /// The worst pixel, if any differs.
    pub worst: Option<Pixel>,
    /// The first outlier in reading order that is not at an edge; if there is none, the first outlier.
    pub first: Option<Pixel>,
}

/// A pixel with its two values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// The channel that differs most; the stencil comes after all channels.
    pub channel: usize,
    /// The software GPU's value.
    pub expected: f32,
    /// The driver's value.
    pub actual: f32,
    /// [`relative`] error.
    pub error: f64,
}

/// `|a − b| / max(|a|, |b|, scale)`; infinite where one is not finite and the other differs.
#[must_use]
pub fn relative(a: f32, b: f32, scale: f64) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0.0;
    }
    if !a.is_finite() || !b.is_finite() {
        return f64::INFINITY;
    }
    let (a, b) = (f64::from(a), f64::from(b));
    (a - b).abs() / a.abs().max(b.abs()).max(scale)
}

/// Distance in units in the last place.
#[must_use]
pub fn ulps(a: f32, b: f32) -> u64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0;
    }
    let ordered = |v: f32| {
        let bits = i64::from(v.to_bits() & 0x7fff_ffff);
        if v.is_sign_negative() { -bits } else { bits }
    };
    ordered(a).abs_diff(ordered(b))
}

/// Compares two surfaces of one format. `tolerance` is a relative error, 0 for bit equality; `scale` is the magnitude, as a share of the
/// channel's mean, below which errors count as absolute ones.
#[must_use]
pub fn compare(info: FormatInfo, expected: &Surface, actual: &Surface, tolerance: f64) -> Difference {
    let scales: Vec<f64> = (0..info.channels).map(|channel| mean_magnitude(expected, channel)).collect();
    let mut difference =
        Difference { pixels: 0, differing: 0, outliers: 0, at_edges: 0, max_ulp: 0, max_relative: 0.0, worst: None, first: None };
    let mut first_unexplained = None;
    for y in 0..expected.height {
        for x in 0..expected.width {
            difference.pixels += 1;
            let mut pixel: Option<Pixel> = None;
            for (channel, &scale) in scales.iter().enumerate() {
                let (a, b) = (expected.get(x, y, channel), actual.get(x, y, channel));
                let (ulp, error) = match info.kind {
                    ChannelKind::Uint32 => {
                        (u64::from(a.to_bits().abs_diff(b.to_bits())), if a.to_bits() == b.to_bits() { 0.0 } else { 1.0 })
                    }
                    // One step of a normalized format is its unit in the last place.
                    ChannelKind::UnormDepth(_) => ((f64::from(a) - f64::from(b)).abs() as u64, relative(a, b, scale)),
                    _ => (ulps(a, b), relative(a, b, scale)),
                };
                if ulp == 0 {
                    continue;
                }
                difference.max_ulp = difference.max_ulp.max(ulp);
                if pixel.is_none_or(|p| error > p.error) {
                    pixel = Some(Pixel { x, y, channel, expected: a, actual: b, error });
                }
            }
            if info.stencil && expected.stencil_at(x, y) != actual.stencil_at(x, y) {
                let [a, b] = [expected, actual].map(|s| f32::from(s.stencil_at(x, y)));
                difference.max_ulp = difference.max_ulp.max((a - b).abs() as u64);
                pixel = Some(Pixel { x, y, channel: info.channels, expected: a, actual: b, error: 1.0 });
            }
            let Some(pixel) = pixel else { continue };
            difference.differing += 1;
            if difference.worst.is_none_or(|w| pixel.error > w.error) {
                difference.worst = Some(pixel);
            }
            if pixel.error <= tolerance {
                difference.max_relative = difference.max_relative.max(pixel.error);
                continue;
            }
            difference.outliers += 1;
            difference.first = difference.first.or(Some(pixel));
            if is_at_edge(info, &scales, expected, actual, &pixel, tolerance) {
                difference.at_edges += 1;
            } else {
                first_unexplained = first_unexplained.or(Some(pixel));
            }
        }
    }
    difference.first = first_unexplained.or(difference.first);
    difference
}

impl Difference {
    /// Outliers that no moved edge explains.
    #[must_use]
    pub fn unexplained(&self) -> u64 {
        self.outliers - self.at_edges
    }
}

/// Mean of |v| over the finite values of a channel that are not zero.
fn mean_magnitude(surface: &Surface, channel: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u64);
    for y in 0..surface.height {
        for x in 0..surface.width {
            let v = surface.get(x, y, channel);
            if v.is_finite() && v != 0.0 {
                sum += f64::from(v.abs());
                count += 1;
            }
        }
    }
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// Whether what the driver has at a pixel lies, in every channel, in the range of what the software GPU has in the 3x3 pixels around it.
fn is_at_edge(info: FormatInfo, scales: &[f64], expected: &Surface, actual: &Surface, pixel: &Pixel, tolerance: f64) -> bool {
    if info.stencil && pixel.channel == info.channels {
        return false;
    }
    (0..info.channels).all(|channel| {
        let value = actual.get(pixel.x, pixel.y, channel);
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for y in pixel.y.saturating_sub(1)..(pixel.y + 2).min(expected.height) {
            for x in pixel.x.saturating_sub(1)..(pixel.x + 2).min(expected.width) {
                let neighbour = expected.get(x, y, channel);
                low = low.min(neighbour);
                high = high.max(neighbour);
            }
        }
        (low..=high).contains(&value) || relative(value, low, scales[channel]).min(relative(value, high, scales[channel])) <= tolerance
    })
}
