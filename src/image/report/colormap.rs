//! The colours of signed differences.

use crate::tone::{quantize_8bit, srgb_encode};

/// Lightness of zero in Oklab: nearly white, so that a panel stands out from a white page.
const NEUTRAL_LIGHTNESS: f64 = 0.97;
/// Lightness of both ends.
const END_LIGHTNESS: f64 = 0.42;
/// Chroma of both ends; within sRGB at their hues.
const END_CHROMA: f64 = 0.16;
/// Hue of −1, in degrees: blue.
const LOW_HUE_DEG: f64 = 260.0;
/// Hue of +1, in degrees: red.
const HIGH_HUE_DEG: f64 = 27.0;

/// The 8-bit sRGB colour of a signed number: blue at −1, nearly white at 0, red at +1; clamped outside, and neutral for NaN.
/// Straight lines in Oklab [B. Ottosson, "A perceptual color space for image processing", 2020]: equal steps of the number look equally large, and
/// numbers of equal magnitude look equally dark.
/// large, and equal magnitudes of either sign equally dark.
#[must_use]
pub fn diverging(value: f64) -> [u8; 3] {
    let strength = if value.is_nan() { 0.0 } else { value.abs().min(1.0) };
    let hue = if value < 0.0 { LOW_HUE_DEG } else { HIGH_HUE_DEG };
    let (sine, cosine) = libm::sincos(hue.to_radians());
    let chroma = END_CHROMA * strength;
    let lightness = NEUTRAL_LIGHTNESS + (END_LIGHTNESS - NEUTRAL_LIGHTNESS) * strength;
    linear_from_oklab([lightness, chroma * cosine, chroma * sine]).map(|channel| quantize_8bit(srgb_encode(channel as f32)))
}

/// Oklab to linear RGB with the primaries of BT.709; components are outside of `0..=1` if the colour is out of gamut.
fn linear_from_oklab([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    let cube = |x: f64| x * x * x;
    let l = cube(lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
    let m = cube(lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
    let s = cube(lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oklab(value: f64) -> [f64; 3] {
        let strength = value.abs();
        let (sine, cosine) = libm::sincos((if value < 0.0 { LOW_HUE_DEG } else { HIGH_HUE_DEG }).to_radians());
        [NEUTRAL_LIGHTNESS + (END_LIGHTNESS - NEUTRAL_LIGHTNESS) * strength, END_CHROMA * strength * cosine, END_CHROMA * strength * sine]
    }

    #[test]
    fn zero_is_neutral_and_signs_have_their_colours() {
        let [r, g, b] = diverging(0.0);
        assert!(r == g && g == b && r > 240, "{r} {g} {b}");
        assert_eq!(diverging(f64::NAN), diverging(0.0));
        let ([low_r, _, low_b], [high_r, _, high_b]) = (diverging(-1.0), diverging(1.0));
        assert!(low_b > low_r + 60 && high_r > high_b + 60);
        assert_eq!((diverging(-7.0), diverging(f64::INFINITY)), (diverging(-1.0), diverging(1.0)));
    }

    #[test]
    fn every_colour_is_within_srgb() {
        for step in -100..=100 {
            let linear = linear_from_oklab(oklab(f64::from(step) / 100.0));
            assert!(linear.iter().all(|channel| (-1.0e-6..=1.0).contains(channel)), "{step}: {linear:?}");
        }
    }

    #[test]
    fn the_map_darkens_evenly_away_from_zero() {
        let brightness = |value: f64| diverging(value).map(f64::from).iter().sum::<f64>();
        for sign in [-1.0, 1.0] {
            for step in 0..20 {
                assert!(brightness(sign * f64::from(step + 1) / 20.0) < brightness(sign * f64::from(step) / 20.0));
            }
        }
    }
}
