//! From linear radiance to display codes: tone map, sRGB curve, 8-bit rounding.
//!
//! The three steps, in order, for one pixel:
//!
//! 1. [`ToneMap::apply`]: exposure, then a curve that leaves values below the shoulder unchanged and compresses highlights towards white;
//! 2. [`srgb_encode`]: the transfer function of IEC 61966-2-1;
//! 3. [`quantize_8bit`]: `code = ⌊255·v + ½⌋`, so code `k` stands for the values nearest to `k/255`; halves are rounded up. No dither.
//!
//! Pictures take the last two steps together, by the table of [`srgb_code`].
//!
//! Road not taken: the usual filmic curves (ACES fits, the Khronos PBR neutral map) reach 0.95 of white at about twice diffuse white. A caustic is
//! brighter than the plain floor by a factor of 2 to 20, and all of its structure is in that range: these curves would show it as flat white. The
//! shoulder here is longer: 2, 4 and 8 times diffuse white become codes 231, 243 and 250.

use std::sync::LazyLock;

/// Tone map for pictures with strong highlights: linear below a shoulder, extended Reinhard above it. Hue is preserved, saturation decreases.
///
/// With `c = max(0, exposure·rgb)`, `p = max(c)`, `s = shoulder`, `t = (p−s)/(1−s)`, `w = (white−s)/(1−s)`:
/// ```text
/// q   = p                                        where p ≤ s
/// q   = min(1, s + (1−s)·t·(1 + t/w²)/(1 + t))   where p > s       [Reinhard 2002 eq. 4, joined to the line at s]
/// g   = 1 − 1/(desaturation·(p−q) + 1)                             [Khronos PBR neutral]
/// out = c·(q/p)·(1−g) + q·g
/// ```
/// Value and slope are continuous at the shoulder, `p = white` gives exactly 1, and `q` never falls as `p` rises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMap {
    /// Factor on linear radiance, above 0. Default: 1.
    pub exposure: f32,
    /// Brightest value that is shown unchanged, in `0..1`; clamped to `0..=0.99`. Default: 0.3.
    pub shoulder: f32,
    /// Exposed value that becomes display white, above 1; clamped to at least 1. Default: 16.
    pub white: f32,
    /// How fast compressed highlights lose saturation; 0 for not at all. Default: 0.15.
    pub desaturation: f32,
}

impl Default for ToneMap {
    fn default() -> Self {
        Self { exposure: 1.0, shoulder: 0.3, white: 16.0, desaturation: 0.15 }
    }
}

/// Exposed values above this give the same white; keeps infinity out of the arithmetic.
const BRIGHTEST: f32 = 1.0e9;

impl ToneMap {
    /// The default curve with a factor of `2^stops` on radiance.
    #[must_use]
    pub fn with_stops(stops: f32) -> Self {
        Self { exposure: libm::exp2f(stops), ..Self::default() }
    }

    /// Maps one linear RGB radiance to linear display RGB in `0..=1`. NaN and negative channels become 0, infinity becomes white.
    #[must_use]
    pub fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        let shoulder = self.shoulder.clamp(0.0, 0.99);
        let exposed = rgb.map(|channel| clamp_or_zero(channel * self.exposure, BRIGHTEST));
        let peak = exposed[0].max(exposed[1]).max(exposed[2]);
        if peak <= shoulder {
            return exposed;
        }
        let range = 1.0 - shoulder;
        let above = (peak - shoulder) / range;
        let white = (self.white.max(1.0) - shoulder) / range;
        let shown = (shoulder + range * above * (1.0 + above / (white * white)) / (1.0 + above)).min(1.0);
        let grey = 1.0 - 1.0 / (self.desaturation.max(0.0) * (peak - shown) + 1.0);
        let scale = shown / peak;
        // Rounding may leave the sum slightly above 1.
        exposed.map(|channel| (channel * scale * (1.0 - grey) + shown * grey).min(1.0))
    }
}

/// `value` in `0..=most`; 0 for NaN.
fn clamp_or_zero(value: f32, most: f32) -> f32 {
    if value > 0.0 { value.min(most) } else { 0.0 }
}

/// Linear light in `0..=1` to the sRGB signal in `0..=1` (IEC 61966-2-1); values outside are clamped, NaN is 0.
///
/// `v = 12.92·l` up to `l = 0.0031308`, `v = 1.055·l^(1/2.4) − 0.055` above.
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    let linear = clamp_or_zero(linear, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

/// The sRGB signal in `0..=1` to linear light in `0..=1`, the inverse of [`srgb_encode`]; values outside are clamped, NaN is 0.
#[must_use]
pub fn srgb_decode(signal: f32) -> f32 {
    let signal = clamp_or_zero(signal, 1.0);
    if signal <= 0.040_45 { signal / 12.92 } else { libm::powf((signal + 0.055) / 1.055, 2.4) }
}

/// `⌊255·v + ½⌋` of a value clamped to `0..=1`; NaN is 0.
#[must_use]
pub fn quantize_8bit(value: f32) -> u8 {
    // The clamp has brought the value into range, so the cast only drops the fraction.
    (clamp_or_zero(value, 1.0) * 255.0 + 0.5) as u8
}

/// The 8-bit sRGB code of linear light: `quantize_8bit(srgb_encode(linear))`, from a table instead of a power.
#[must_use]
pub fn srgb_code(linear: f32) -> u8 {
    static STEPS: LazyLock<CodeSteps> = LazyLock::new(CodeSteps::new);
    STEPS.code(linear)
}

/// The step function from linear light to codes: the position of each step, and the last step before each interval of floats.
///
/// An interval holds the floats with one sign, exponent and upper seven bits of the mantissa. The curve is so flat that no interval holds two steps.
struct CodeSteps {
    /// Code of the interval's least number.
    codes: Vec<u8>,
    /// Least number with a larger code; beyond the interval if the interval has no step.
    steps: Vec<f32>,
}

impl CodeSteps {
    /// Number of low bits that floats of an interval differ in.
    const SHIFT: u32 = 16;
    /// First interval with a step in it or after it; numbers below have code 0.
    const FIRST: u32 = 0x3900_0000 >> Self::SHIFT;
    /// The interval of 1.
    const LAST: u32 = 0x3f80_0000 >> Self::SHIFT;

    fn new() -> Self {
        let code = |bits: u32| quantize_8bit(srgb_encode(f32::from_bits(bits)));
        let (mut codes, mut steps) = (Vec::new(), Vec::new());
        for interval in Self::FIRST..=Self::LAST {
            let (first, end) = (interval << Self::SHIFT, (interval + 1) << Self::SHIFT);
            let (mut below, mut above) = (first, end);
            while above - below > 1 {
                let middle = below + (above - below) / 2;
                *(if code(middle) > code(first) { &mut above } else { &mut below }) = middle;
            }
            codes.push(code(first));
            steps.push(f32::from_bits(above));
        }
        Self { codes, steps }
    }

    fn code(&self, linear: f32) -> u8 {
        let linear = clamp_or_zero(linear, 1.0);
        let interval = linear.to_bits() >> Self::SHIFT;
        let Some(index) = interval.checked_sub(Self::FIRST) else { return 0 };
        let (code, step) = (self.codes[index as usize], self.steps[index as usize]);
        if linear >= step { code + 1 } else { code }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the table with the formula for all floats with these bits.
    fn compare_codes(bits: impl IntoIterator<Item = u32>) {
        for value in bits.into_iter().map(f32::from_bits) {
            assert_eq!(srgb_code(value), quantize_8bit(srgb_encode(value)), "of {value}");
        }
    }

    #[test]
    fn codes_by_table_are_those_of_the_formula_about_every_step_and_interval() {
        let edges = (CodeSteps::FIRST..=CodeSteps::LAST + 1).map(|interval| interval << CodeSteps::SHIFT);
        let steps = CodeSteps::new().steps.into_iter().map(f32::to_bits);
        // The power is off by less than 1e-7: codes that far from a step cannot be wrong.
        edges.chain(steps).for_each(|bits| compare_codes(bits - 300..bits + 300));
        compare_codes((0..0x3f80_0000).step_by(4099));
        for broken in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, -1.0, 2.0, f32::MAX, f32::MIN_POSITIVE] {
            compare_codes([broken.to_bits()]);
        }
    }

    #[test]
    #[ignore = "every float from 0 to 1: a minute"]
    fn codes_by_table_are_those_of_the_formula() {
        compare_codes(0..=0x3f80_0000);
    }

    /// Display value of a grey of brightness `value`.
    fn grey(tone: &ToneMap, value: f32) -> f32 {
        tone.apply([value; 3])[0]
    }

    #[test]
    fn tone_is_the_identity_below_the_shoulder() {
        let tone = ToneMap::default();
        for rgb in [[0.0; 3], [0.3, 0.1, 0.0], [0.05, 0.2999, 0.3]] {
            assert_eq!(tone.apply(rgb), rgb);
        }
        assert_eq!(ToneMap { exposure: 0.5, ..tone }.apply([0.4, 0.2, 0.1]), [0.2, 0.1, 0.05]);
    }

    #[test]
    fn tone_is_continuous_with_its_slope_at_the_shoulder() {
        let tone = ToneMap::default();
        let step = 1.0e-3;
        let slope = (grey(&tone, tone.shoulder + step) - grey(&tone, tone.shoulder)) / step;
        // Second derivative of the Reinhard part is -2/(1-s) at the joint, so the slope is 1 - step/(1-s).
        assert!((slope - (1.0 - step / 0.7)).abs() < 1.0e-3, "slope {slope}");
    }

    #[test]
    fn tone_reaches_one_at_white_and_never_falls() {
        let tone = ToneMap::default();
        assert!((grey(&tone, 16.0) - 1.0).abs() < 1.0e-6);
        assert!(grey(&tone, 15.0) < 1.0);
        let mut last = 0.0;
        for i in 0..4000 {
            let shown = grey(&tone, i as f32 * 0.005);
            assert!(shown >= last && shown <= 1.0, "{shown} after {last} at {i}");
            last = shown;
        }
    }

    #[test]
    fn tone_keeps_hue_order_and_fades_saturation() {
        let tone = ToneMap::default();
        let saturation = |scale: f32| {
            let out = tone.apply([0.1 * scale, 0.5 * scale, scale]);
            assert!(out[0] < out[1] && out[1] < out[2], "{out:?}");
            1.0 - out[0] / out[2]
        };
        assert!(saturation(0.2) > 0.899 && saturation(2.0) < 0.85 && saturation(12.0) < saturation(4.0));
    }

    #[test]
    fn tone_of_broken_values_is_defined() {
        let tone = ToneMap::default();
        assert_eq!(tone.apply([f32::NAN, -1.0, f32::NEG_INFINITY]), [0.0; 3]);
        assert_eq!(tone.apply([f32::INFINITY; 3]), [1.0; 3]);
        assert_eq!(tone.apply([f32::NAN, 0.25, -0.0]), [0.0, 0.25, 0.0]);
        assert!(tone.apply([f32::INFINITY, 0.0, 1.0]).iter().all(|channel| (0.0..=1.0).contains(channel)));
    }

    #[test]
    fn highlights_up_to_eight_times_white_stay_apart() {
        let code = |value: f32| quantize_8bit(srgb_encode(grey(&ToneMap::default(), value)));
        assert_eq!([1.0, 2.0, 4.0, 8.0, 16.0].map(code), [211, 231, 243, 250, 255]);
    }

    #[test]
    fn srgb_matches_the_standard() {
        // IEC 61966-2-1: mid grey 0.5 linear is signal 0.735357, and signal 0.5 is linear 0.214041.
        assert!((srgb_encode(0.5) - 0.735_357).abs() < 1.0e-6);
        assert!((srgb_decode(0.5) - 0.214_041).abs() < 1.0e-6);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1.0e-6 && srgb_encode(7.0) == srgb_encode(1.0));
        assert_eq!([srgb_encode(0.0), srgb_encode(-1.0), srgb_encode(f32::NAN)], [0.0; 3]);
    }

    #[test]
    fn every_code_survives_decoding_and_encoding() {
        for code in 0..=255_u8 {
            assert_eq!(quantize_8bit(srgb_encode(srgb_decode(f32::from(code) / 255.0))), code);
        }
    }

    #[test]
    fn quantisation_rounds_halves_up() {
        for code in 0..255_u16 {
            let half = (f32::from(code) + 0.5) / 255.0;
            assert_eq!(quantize_8bit(half - 1.0e-6), code as u8, "below the half of {code}");
            assert_eq!(quantize_8bit(half + 1.0e-6), code as u8 + 1, "above the half of {code}");
        }
        assert_eq!(quantize_8bit(0.5), 128);
    }
}
