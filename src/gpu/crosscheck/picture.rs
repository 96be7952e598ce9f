//! A picture of expected values, actual values and their difference, side by side.

use super::{Difference, relative};
use nephroid_image::{Layer, LayerError, ToneMap};
use nephroid_pipeline::{FormatInfo, Surface};

/// Columns between the three parts.
const GAP: u32 = 4;

/// Draws two versions of an attachment: the software GPU's values, the driver's values, and the relative error.
///
/// Values are scaled so that twice the expected mean is white. Errors are blue up to `tolerance` and red beyond it, with a brightness that grows with
/// the logarithm of the error from 1e-7 to 1. Pixels with equal bits are black. Write the picture with [`plain_tone`].
///
/// # Errors
/// If the picture is too large for a layer.
pub fn side_by_side(
    info: FormatInfo,
    [expected, actual]: [&Surface; 2],
    difference: &Difference,
    tolerance: f64,
) -> Result<Layer, LayerError> {
    let (width, height) = (expected.width, expected.height);
    // Of depth and stencil, the one that differs is shown.
    let stencil = info.channels == 0 || difference.first.is_some_and(|p| p.channel == info.channels);
    let value = |s: &Surface, x: u32, y: u32, channel: usize| match stencil {
        true => f32::from(s.stencil_at(x, y)),
        false => s.get(x, y, channel.min(info.channels - 1)),
    };
    let mut sum = 0.0;
    for y in 0..height {
        for x in 0..width {
            let v = f64::from(value(expected, x, y, 0));
            sum += if v.is_finite() { v.abs() } else { 0.0 };
        }
    }
    let mean = (sum / (f64::from(width) * f64::from(height))).max(1.0e-12);
    let colors = if info.channels >= 3 { [0, 1, 2] } else { [0, 0, 0] };
    let shown = |s: &Surface, x, y| colors.map(|channel| (f64::from(value(s, x, y, channel)).abs() / (2.0 * mean)).min(1.0) as f32);
    let whole = 3 * width + 2 * GAP;
    let mut pixels = Vec::with_capacity(whole as usize * height as usize);
    for y in 0..height {
        pixels.extend((0..width).map(|x| shown(expected, x, y)));
        pixels.extend((0..GAP).map(|_| [1.0; 3]));
        pixels.extend((0..width).map(|x| shown(actual, x, y)));
        pixels.extend((0..GAP).map(|_| [1.0; 3]));
        pixels.extend((0..width).map(|x| {
            let channels = (0..info.channels).map(|c| relative(value(expected, x, y, c), value(actual, x, y, c), mean));
            let stencil = f64::from(u8::from(info.stencil && expected.stencil_at(x, y) != actual.stencil_at(x, y)));
            let error = channels.fold(stencil, f64::max);
            let bright = if error > 0.0 { ((libm::log10(error.min(1.0)) + 7.0) / 7.0).clamp(0.1, 1.0) as f32 } else { 0.0 };
            // A frame marks the pixel that the report names.
            let named = difference.first.is_some_and(|p| p.x.abs_diff(x).max(p.y.abs_diff(y)) == 3);
            match error <= tolerance {
                _ if named => [0.0, 1.0, 0.0],
                true => [0.0, bright * 0.1, bright * 0.5],
                false => [1.0, bright * 0.5, bright * 0.2],
            }
        }));
    }
    Layer::from_pixels("difference", whole, height, &pixels)
}

/// A tone map that shows values from 0 to 1 unchanged.
#[must_use]
pub fn plain_tone() -> ToneMap {
    ToneMap { exposure: 1.0, shoulder: 0.99, white: 1.0, desaturation: 0.0 }
}
