//! Compares two versions of one attachment, pixel by pixel.

use serde::Serialize;

use super::light::{distance, greatest_share};
use nephroid_image::metrics::bounds::Measured;
use nephroid_pipeline::{ChannelKind, FormatInfo, Surface};

/// The difference between two versions of an attachment, drawn from equal inputs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels with any differing bit; NaN equals NaN, and −0 equals 0.
    pub differing: u64,
    /// Pixels beyond the tolerance.
    pub outliers: u64,
    /// Outliers at an edge that moved: within the tolerance, the driver's value lies in the range of the other version's 3x3 pixels around the pixel.
    pub at_edges: u64,
    /// Other outliers that the software GPU draws itself if everything is moved by at most one unit of the grid that vertices snap to: within the
    /// tolerance, the driver's value lies in the range of the values drawn so.
    pub moved: u64,
    /// Greatest difference in units in the last place, outliers included; for integers, in integers.
    pub max_ulp: u64,
    /// Greatest relative error of the pixels within the tolerance.
    pub max_relative: f64,
    /// Greatest relative error of the outliers that neither an edge nor a move explains.
    pub worst_unexplained: f64,
    /// Share of the light in which the outliers differ: the sum of their absolute differences over the sum of all magnitudes, of the channel where it is
    /// greatest.
    pub light: f64,
    /// The worst pixel, if any differs.
    pub worst: Option<Pixel>,
    /// The first outlier in reading order that nothing explains; if there is none, the first outlier.
    pub first: Option<Pixel>,
}

/// A pixel with both values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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

/// Difference of two numbers in units in the last place.
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

/// Share of the greatest channel's scale that every channel's scale has at least. The heights of a floor at 0 are nothing but rounding errors.
const LEAST_SCALE: f64 = 1.0e-3;

/// Raises the scales of a vector's components to [`LEAST_SCALE`] of the greatest.
pub(super) fn raise_scales(scales: &mut [f64]) {
    let least = scales.iter().fold(0.0, |greatest: f64, &scale| greatest.max(scale)) * LEAST_SCALE;
    for scale in scales {
        *scale = scale.max(least);
    }
}

/// An outlier that is not at an edge, with the range of values that the software GPU draws there.
#[derive(Clone, Debug)]
pub(super) struct Open {
    pub pixel: Pixel,
    /// By channel; the stencil comes after all channels.
    ranges: Vec<[f32; 2]>,
}

/// A comparison whose outliers off the edges are not explained yet.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What is known so far.
    pub difference: Difference,
    pub(super) open: Vec<Open>,
    scales: Vec<f64>,
    info: FormatInfo,
    tolerance: f64,
}

/// Compares two surfaces of one format. `tolerance` is a [`relative`] error, 0 for equal bits. Its scale is each channel's mean magnitude, so that
/// values near zero need no better absolute accuracy than the rest of the picture; it is at least a thousandth of the greatest channel's.
#[must_use]
pub fn compare(info: FormatInfo, expected: &Surface, actual: &Surface, tolerance: f64) -> Comparison {
    let mut scales: Vec<f64> = (0..info.channels).map(|channel| mean_magnitude(expected, channel)).collect();
    raise_scales(&mut scales);
    let mut difference = Difference {
        pixels: 0,
        differing: 0,
        outliers: 0,
        at_edges: 0,
        moved: 0,
        max_ulp: 0,
        max_relative: 0.0,
        worst_unexplained: 0.0,
        light: 0.0,
        worst: None,
        first: None,
    };
    let mut open = Vec::new();
    let mut outlying = vec![0.0; info.channels];
    for y in 0..expected.height {
        for x in 0..expected.width {
            difference.pixels += 1;
            let Some((pixel, ulp)) = compare_pixel(info, &scales, expected, actual, (x, y)) else { continue };
            difference.max_ulp = difference.max_ulp.max(ulp);
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
            for (channel, sum) in outlying.iter_mut().enumerate() {
                *sum += distance(info, expected, actual, (x, y), channel);
            }
            if is_at_edge(info, &scales, expected, actual, &pixel, tolerance) {
                difference.at_edges += 1;
            } else {
                let ranges = (0..=info.channels).map(|channel| [value_at(info, expected, (x, y), channel); 2]).collect();
                open.push(Open { pixel, ranges });
            }
        }
    }
    difference.light = greatest_share(info, &outlying, expected);
    let mut comparison = Comparison { difference, open, scales, info, tolerance };
    comparison.settle();
    comparison
}

impl Comparison {
    /// Takes into account what the software GPU draws if everything is moved: each range then contains the moved surface's value.
    pub(super) fn widen(&mut self, moved: &Surface) {
        for Open { pixel, ranges } in &mut self.open {
            for (channel, [low, high]) in ranges.iter_mut().enumerate() {
                let value = value_at(self.info, moved, (pixel.x, pixel.y), channel);
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
    }

    /// Closes the outliers whose values lie in their ranges: these are moved. `actual` is the driver's surface.
    pub(super) fn close_moved(&mut self, actual: &Surface) {
        let before = self.open.len();
        let (info, scales, tolerance) = (self.info, &self.scales, self.tolerance);
        self.open.retain(|Open { pixel, ranges }| {
            let is_within = |channel: usize, &[low, high]: &[f32; 2]| {
                let value = value_at(info, actual, (pixel.x, pixel.y), channel);
                let scale = scales.get(channel).copied().unwrap_or(1.0);
                (low..=high).contains(&value) || relative(value, low, scale).min(relative(value, high, scale)) <= tolerance
            };
            !ranges.iter().enumerate().all(|(channel, range)| is_within(channel, range))
        });
        self.difference.moved += (before - self.open.len()) as u64;
        self.settle();
    }

    /// Derives what depends on the outliers that are still open.
    fn settle(&mut self) {
        let first = self.open.first().map(|open| open.pixel);
        self.difference.first = first.or(self.difference.first);
        self.difference.worst_unexplained = self.open.iter().map(|open| open.pixel.error).fold(0.0, f64::max);
    }
}

/// The pixel with the channel that differs most, and its greatest difference in units in the last place; `None` if all bits are equal.
fn compare_pixel(info: FormatInfo, scales: &[f64], expected: &Surface, actual: &Surface, (x, y): (u32, u32)) -> Option<(Pixel, u64)> {
    let mut worst: Option<Pixel> = None;
    let mut max_ulp = 0;
    for (channel, &scale) in scales.iter().enumerate() {
        let (a, b) = (expected.get(x, y, channel), actual.get(x, y, channel));
        let (ulp, error) = match info.kind {
            ChannelKind::Uint(_) => (u64::from(a.to_bits().abs_diff(b.to_bits())), if a.to_bits() == b.to_bits() { 0.0 } else { 1.0 }),
            ChannelKind::Sint(_) => {
                let [a, b] = [a, b].map(|v| v.to_bits() as i32);
                (u64::from(a.abs_diff(b)), if a == b { 0.0 } else { 1.0 })
            }
            // For normalized formats, one step is the unit in the last place.
            ChannelKind::UnormDepth(_) => ((f64::from(a) - f64::from(b)).abs() as u64, relative(a, b, scale)),
            _ => (ulps(a, b), relative(a, b, scale)),
        };
        if ulp == 0 {
            continue;
        }
        max_ulp = max_ulp.max(ulp);
        if worst.is_none_or(|p| error > p.error) {
            worst = Some(Pixel { x, y, channel, expected: a, actual: b, error });
        }
    }
    if info.stencil && expected.stencil_at(x, y) != actual.stencil_at(x, y) {
        let [a, b] = [expected, actual].map(|s| f32::from(s.stencil_at(x, y)));
        max_ulp = max_ulp.max((a - b).abs() as u64);
        worst = Some(Pixel { x, y, channel: info.channels, expected: a, actual: b, error: 1.0 });
    }
    worst.map(|pixel| (pixel, max_ulp))
}

/// A channel's number at a pixel; the stencil comes after all channels, and is 0 where there is none.
pub(super) fn value_at(info: FormatInfo, surface: &Surface, (x, y): (u32, u32), channel: usize) -> f32 {
    if channel < info.channels {
        as_number(info, surface.get(x, y, channel))
    } else if info.stencil {
        f32::from(surface.stencil_at(x, y))
    } else {
        0.0
    }
}

impl Difference {
    /// Number of outliers that neither an edge nor a move explains.
    #[must_use]
    pub fn unexplained(&self) -> u64 {
        self.outliers - self.at_edges - self.moved
    }

    /// What is held against a bound.
    #[must_use]
    pub fn measured(&self) -> Measured {
        let Self { pixels, outliers, worst_unexplained: worst, light, .. } = *self;
        Measured { pixels, outliers, unexplained: self.unexplained(), worst, light }
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

/// The number that a plane stores. Integers are stored as bit patterns.
fn as_number(info: FormatInfo, value: f32) -> f32 {
    match info.kind {
        ChannelKind::Uint(_) => value.to_bits() as f32,
        ChannelKind::Sint(_) => value.to_bits() as i32 as f32,
        _ => value,
    }
}

/// Whether the driver's value at a pixel lies, in every channel, in the range of the software GPU's values in the 3x3 pixels around it.
fn is_at_edge(info: FormatInfo, scales: &[f64], expected: &Surface, actual: &Surface, pixel: &Pixel, tolerance: f64) -> bool {
    if info.stencil && pixel.channel == info.channels {
        return false;
    }
    (0..info.channels).all(|channel| {
        let number = |surface: &Surface, x, y| as_number(info, surface.get(x, y, channel));
        let value = number(actual, pixel.x, pixel.y);
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for y in pixel.y.saturating_sub(1)..(pixel.y + 2).min(expected.height) {
            for x in pixel.x.saturating_sub(1)..(pixel.x + 2).min(expected.width) {
                let neighbour = number(expected, x, y);
                low = low.min(neighbour);
                high = high.max(neighbour);
            }
        }
        (low..=high).contains(&value) || relative(value, low, scales[channel]).min(relative(value, high, scales[channel])) <= tolerance
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nephroid_pipeline::state::TextureFormat;
    use nephroid_pipeline::{Texture, TextureDescriptor};

    /// An 8x8 picture of one format with these numbers in channel 0, row by row.
    pub(in crate::crosscheck) fn picture(format: TextureFormat, value: impl Fn(u32, u32) -> f32) -> Texture {
        let mut texture = Texture::new(TextureDescriptor::d2("t", 8, 8, format)).unwrap();
        for (x, y) in (0..64).map(|i| (i % 8, i / 8)) {
            texture.set_texel(0, 0, x, y, [value(x, y), 0.0, 0.0, 0.0]);
        }
        texture
    }

    pub(in crate::crosscheck) fn compared(a: &Texture, b: &Texture, tolerance: f64) -> Difference {
        compare(a.info(), a.surface(0, 0), b.surface(0, 0), tolerance).difference
    }

    #[test]
    fn equal_pictures_do_not_differ_and_zeros_have_no_sign() {
        let a = picture(TextureFormat::R32Float, |x, _| x as f32);
        let b = picture(TextureFormat::R32Float, |x, _| if x == 0 { -0.0 } else { x as f32 });
        let d = compared(&a, &b, 0.0);
        assert_eq!((d.pixels, d.differing, d.outliers, d.max_ulp, d.worst), (64, 0, 0, 0, None));
    }

    #[test]
    fn a_last_place_counts_and_is_within_a_tolerance() {
        let a = picture(TextureFormat::R32Float, |_, _| 1.0);
        let b = picture(TextureFormat::R32Float, |x, y| if (x, y) == (3, 5) { 1.0 + f32::EPSILON } else { 1.0 });
        let exact = compared(&a, &b, 0.0);
        assert_eq!((exact.differing, exact.outliers, exact.max_ulp), (1, 1, 1));
        assert_eq!(exact.first.map(|p| (p.x, p.y)), Some((3, 5)));
        let loose = compared(&a, &b, 1.0e-6);
        assert_eq!((loose.differing, loose.outliers), (1, 0));
        assert!(loose.max_relative > 1.0e-7);
    }

    #[test]
    fn a_channel_of_rounding_errors_is_held_against_the_others() {
        let with = |small: f32| {
            let mut picture = picture(TextureFormat::Rgba32Float, |_, _| 1.0);
            picture.set_texel(0, 0, 3, 3, [1.0, small, 1.0, 1.0]);
            picture
        };
        assert_eq!(compared(&with(1.0e-8), &with(-1.0e-8), 1.0e-4).outliers, 0);
        assert_eq!(compared(&with(1.0e-6), &with(-1.0e-6), 1.0e-4).outliers, 1);
    }

    #[test]
    fn a_moved_edge_is_explained_and_a_wrong_value_is_not() {
        let a = picture(TextureFormat::R32Float, |x, _| if x < 4 { 1.0 } else { 5.0 });
        let moved = picture(TextureFormat::R32Float, |x, _| if x < 5 { 1.0 } else { 5.0 });
        let d = compared(&a, &moved, 1.0e-4);
        assert_eq!((d.outliers, d.unexplained()), (8, 0));
        let wrong = picture(TextureFormat::R32Float, |x, y| if (x, y) == (6, 6) { 9.0 } else { a.surface(0, 0).get(x, y, 0) });
        let d = compared(&a, &wrong, 1.0e-4);
        assert_eq!((d.outliers, d.unexplained()), (1, 1));
    }

    /// The driver has a value that neither the pixel nor its neighbours have: the software GPU must reach it when it draws everything moved.
    #[test]
    fn what_moves_within_a_unit_is_explained_and_no_more() {
        let spike = |value: f32| picture(TextureFormat::R32Float, move |x, y| if (x, y) == (6, 6) { value } else { 1.0 });
        let (a, b) = (spike(1.0), spike(9.0));
        let explained = |moved: &[f32]| {
            let mut comparison = compare(a.info(), a.surface(0, 0), b.surface(0, 0), 1.0e-4);
            moved.iter().for_each(|&value| comparison.widen(spike(value).surface(0, 0)));
            comparison.close_moved(b.surface(0, 0));
            comparison.difference
        };
        let beyond = explained(&[0.5, 10.0]);
        assert_eq!((beyond.outliers, beyond.moved, beyond.unexplained(), beyond.worst_unexplained), (1, 1, 0, 0.0));
        let short = explained(&[0.5, 8.9]);
        assert_eq!((short.outliers, short.moved, short.unexplained()), (1, 0, 1));
        assert!((short.worst_unexplained - 8.0 / 9.0).abs() < 1.0e-12);
        assert_eq!(short.first.map(|p| (p.x, p.y)), Some((6, 6)));
        let within_tolerance = explained(&[8.9995]);
        assert_eq!((within_tolerance.moved, within_tolerance.unexplained()), (1, 0));
    }

    #[test]
    fn not_a_number_and_infinity_are_outliers() {
        let a = picture(TextureFormat::R32Float, |_, _| 1.0);
        for bad in [f32::NAN, f32::INFINITY] {
            let b = picture(TextureFormat::R32Float, |x, _| if x == 7 { bad } else { 1.0 });
            assert_eq!(compared(&a, &b, 0.5).outliers, 8);
            assert_eq!(compared(&b, &b, 0.0).differing, 0);
        }
    }

    #[test]
    fn integers_and_stencil_compare_as_integers() {
        let a = picture(TextureFormat::R32Uint, |_, _| f32::from_bits(7));
        let b = picture(TextureFormat::R32Uint, |x, _| f32::from_bits(if x == 1 { 9 } else { 7 }));
        let d = compared(&a, &b, 0.0);
        assert_eq!((d.outliers, d.max_ulp), (8, 2));
        // As floats, −1 is not a number and 2^31 is −0.
        let [minus_one, least] = [-1i32, i32::MIN].map(|v| picture(TextureFormat::R32Sint, |_, _| f32::from_bits(v as u32)));
        let zero = picture(TextureFormat::R32Sint, |_, _| 0.0);
        assert_eq!([&minus_one, &least].map(|other| compared(&zero, other, 0.5).max_ulp), [1, 1 << 31]);
        assert_eq!(compared(&minus_one, &minus_one, 0.0).differing, 0);
        let mut stencil = Texture::new(TextureDescriptor::d2("s", 8, 8, TextureFormat::Stencil8)).unwrap();
        let zeros = stencil.clone();
        stencil.set_stencil(0, 0, 2, 3, 255);
        let d = compared(&zeros, &stencil, 0.5);
        assert_eq!((d.outliers, d.max_ulp, d.unexplained()), (1, 255, 1));
    }
}
