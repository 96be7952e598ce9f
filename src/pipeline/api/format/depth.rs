//! Conversion of depth to the values that a depth format can hold.

use crate::api::format::facts::ChannelKind;
use crate::api::rules::UnormDepth;

/// Depth of a fragment as the format stores it: unchanged for floats, the integer `floor(z·(2^bits − 1) + 0.5)` for normalized formats.
#[must_use]
pub fn quantize_depth(kind: ChannelKind, z: f32) -> f32 {
    quantize_depth_by(UnormDepth::NearestUp, kind, z)
}

/// [`quantize_depth`] under a rule of [`UnormDepth`].
#[inline(always)]
pub(crate) fn quantize_depth_by(rule: UnormDepth, kind: ChannelKind, z: f32) -> f32 {
    let ChannelKind::UnormDepth(bits) = kind else { return z };
    let greatest = ((1u32 << bits) - 1) as f32;
    match rule {
        UnormDepth::NearestUp => (f64::from(z) * f64::from(greatest) + 0.5).floor() as f32,
        // 24 bits have no room for the addition that rounds to multiples.
        UnormDepth::Scaled if bits < 24 => {
            let steps = (1u32 << bits) as f32;
            (z * (greatest / steps) * steps).round_ties_even()
        }
        UnormDepth::Scaled | UnormDepth::NearestEven => (z * greatest).round_ties_even(),
    }
}

/// The inverse of [`quantize_depth`]: depth in 0..=1 from the stored number.
#[must_use]
pub fn depth_value(kind: ChannelKind, stored: f32) -> f32 {
    match kind {
        ChannelKind::UnormDepth(bits) => (f64::from(stored) / f64::from((1u32 << bits) - 1)) as f32,
        _ => stored,
    }
}
