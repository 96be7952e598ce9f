//! Small floats with 5 exponent bits: binary16 with a sign, and the 11- and 10-bit floats without one.
//!
//! Value of exponent `e` and fraction `f` of `F` bits: `2^(e − 15)·(1 + f/2^F)`; `e = 0`: `2^−14·f/2^F`; `e = 31`: infinity, or not-a-number where
//! `f` is not 0 [D3D11.3 §3.1.7; Khronos Data Format 1.3 §10].

use crate::api::format::nan::one_nan;
use crate::api::rules::F16Rounding;

/// Exponent and fraction of a small float of this many fraction bits, from a binary32 without its sign.
#[inline]
fn pack(magnitude: u32, fraction_bits: u32, rounding: F16Rounding) -> u16 {
    let infinity = 0x1f << fraction_bits;
    if magnitude > 0x7f80_0000 {
        return (infinity | 1 << (fraction_bits - 1)) as u16;
    }
    if magnitude == 0x7f80_0000 {
        return infinity as u16;
    }
    let exponent = (magnitude >> 23) as i32 - 127;
    // Shift the 24-bit significand to the target's unit in the last place; below 2^-14 fewer fraction bits are left.
    let dropped = 23 - fraction_bits as i32;
    let shift = if exponent >= -14 { dropped } else { (dropped + (-14 - exponent)).min(31) } as u32;
    let significand = if magnitude >= 0x0080_0000 { (magnitude & 0x007f_ffff) | 0x0080_0000 } else { magnitude };
    let truncated = significand >> shift;
    let remainder = significand & ((1 << shift) - 1);
    let half = 1u32 << (shift - 1);
    let round_up = rounding == F16Rounding::NearestEven && (remainder > half || (remainder == half && truncated & 1 == 1));
    // A carry out of the fraction moves into the exponent, which is what rounding up to the next binade means.
    let base = if exponent >= -14 { (((exponent + 14) as u32) << fraction_bits) + truncated } else { truncated };
    let rounded = base + u32::from(round_up);
    let limit = if rounding == F16Rounding::TowardZero { infinity - 1 } else { infinity };
    rounded.min(limit) as u16
}

/// The bits of a binary32, without its sign, of exponent and fraction of a small float.
#[inline]
fn unpack(bits: u16, fraction_bits: u32) -> u32 {
    let exponent = u32::from(bits) >> fraction_bits & 0x1f;
    let fraction = u32::from(bits) & ((1 << fraction_bits) - 1);
    match exponent {
        0 => (fraction as f32 * f32::from_bits((127 - 14 - fraction_bits) << 23)).to_bits(),
        0x1f => 0x7f80_0000 | (fraction << (23 - fraction_bits)),
        _ => ((exponent + 112) << 23) | (fraction << (23 - fraction_bits)),
    }
}

/// binary32 to binary16. NaN becomes the quiet NaN without sign.
#[must_use]
pub fn f32_to_f16(value: f32, rounding: F16Rounding) -> u16 {
    let bits = one_nan(value).to_bits();
    ((bits >> 16) & 0x8000) as u16 | pack(bits & 0x7fff_ffff, 10, rounding)
}

/// binary16 to binary32, exact; NaN becomes the quiet NaN without sign.
#[must_use]
pub fn f16_to_f32(half: u16) -> f32 {
    one_nan(f32::from_bits(u32::from(half & 0x8000) << 16 | unpack(half, 10)))
}

/// binary32 to a float of 5 exponent bits, 6 or 5 fraction bits and no sign. Negative numbers and −∞ become 0; NaN of either sign becomes the quiet
/// NaN [D3D11.3 §3.2.2].
#[must_use]
pub fn f32_to_ufloat(value: f32, fraction_bits: u32, rounding: F16Rounding) -> u16 {
    if value < 0.0 {
        return 0;
    }
    pack(value.to_bits() & 0x7fff_ffff, fraction_bits, rounding)
}

/// The inverse of [`f32_to_ufloat`], exact; NaN becomes the quiet NaN.
#[must_use]
pub fn ufloat_to_f32(bits: u16, fraction_bits: u32) -> f32 {
    one_nan(f32::from_bits(unpack(bits, fraction_bits)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [F16Rounding; 2] = [F16Rounding::NearestEven, F16Rounding::TowardZero];

    #[test]
    fn f16_round_trip_every_pattern() {
        for half in 0..=u16::MAX {
            let value = f16_to_f32(half);
            if value.is_nan() {
                assert!(f16_to_f32(f32_to_f16(value, F16Rounding::NearestEven)).is_nan());
                continue;
            }
            for rounding in BOTH {
                assert_eq!(f32_to_f16(value, rounding), half, "{half:#x} = {value}");
            }
        }
    }

    #[test]
    fn f16_nearest_matches_half_crate() {
        for i in 0..2_000_000u32 {
            let value = f32::from_bits(i.wrapping_mul(2_654_435_761));
            if value.is_nan() {
                continue;
            }
            assert_eq!(f32_to_f16(value, F16Rounding::NearestEven), half::f16::from_f32_const(value).to_bits(), "{value:e}");
        }
    }

    #[test]
    fn f16_toward_zero_never_grows() {
        for i in 0..2_000_000u32 {
            let value = f32::from_bits(i.wrapping_mul(2_246_822_519));
            if value.is_nan() || value.is_infinite() {
                continue;
            }
            let down = f16_to_f32(f32_to_f16(value, F16Rounding::TowardZero));
            assert!(down.abs() <= value.abs());
            let next = f16_to_f32((f32_to_f16(value.abs(), F16Rounding::TowardZero) + 1).min(0x7c00));
            assert!(next > value.abs(), "{value:e} {down:e} {next:e}");
        }
    }

    /// The value by the definition, in f64.
    fn defined(bits: u16, fraction_bits: u32) -> f64 {
        let (exponent, fraction) = (i32::from(bits >> fraction_bits), f64::from(bits & ((1 << fraction_bits) - 1)));
        let share = fraction / f64::from(1u32 << fraction_bits);
        match exponent {
            0 => libm::exp2(-14.0) * share,
            31 if fraction == 0.0 => f64::INFINITY,
            31 => f64::NAN,
            _ => libm::exp2(f64::from(exponent - 15)) * (1.0 + share),
        }
    }

    #[test]
    fn ufloat_every_code_is_the_defined_number_and_round_trips() {
        for fraction_bits in [6, 5] {
            for bits in 0..1u16 << (5 + fraction_bits) {
                let value = ufloat_to_f32(bits, fraction_bits);
                let expected = defined(bits, fraction_bits);
                if expected.is_nan() {
                    let nan = 0x1f << fraction_bits | 1 << (fraction_bits - 1);
                    assert!(value.is_nan());
                    assert_eq!(BOTH.map(|r| f32_to_ufloat(value, fraction_bits, r)), [nan; 2]);
                } else {
                    assert_eq!(f64::from(value), expected, "{bits:#x}");
                    assert_eq!(BOTH.map(|r| f32_to_ufloat(value, fraction_bits, r)), [bits; 2], "{bits:#x} = {value}");
                }
            }
        }
    }

    /// Between every two neighbours: toward zero keeps the lower one, to nearest changes half-way, where the even code wins.
    #[test]
    fn ufloat_rounds_as_it_says_between_all_neighbours() {
        for fraction_bits in [6u32, 5] {
            let infinity = 0x1f << fraction_bits;
            for bits in 0..infinity - 1 {
                let (low, high) = (defined(bits, fraction_bits), defined(bits + 1, fraction_bits));
                let tie = ((low + high) / 2.0) as f32;
                assert_eq!(f64::from(tie), (low + high) / 2.0, "half-way is exact in f32");
                let code = |value: f32, rounding| f32_to_ufloat(value, fraction_bits, rounding);
                let to_zero = [tie.next_down(), tie, tie.next_up(), (high as f32).next_down()].map(|v| code(v, F16Rounding::TowardZero));
                assert_eq!(to_zero, [bits; 4]);
                let even = if bits & 1 == 0 { bits } else { bits + 1 };
                let nearest = [tie.next_down(), tie, tie.next_up()].map(|v| code(v, F16Rounding::NearestEven));
                assert_eq!(nearest, [bits, even, bits + 1]);
            }
        }
    }

    #[test]
    fn ufloat_special_values() {
        // Greatest finite numbers [Khronos Data Format §10]: 65024 and 64512.
        for (fraction_bits, greatest) in [(6u32, 65024.0), (5, 64512.0)] {
            let infinity = 0x1f << fraction_bits;
            assert_eq!(ufloat_to_f32(infinity - 1, fraction_bits), greatest);
            for value in [-0.0, -1.0, -1.0e-40, f32::MIN, f32::NEG_INFINITY] {
                assert_eq!(BOTH.map(|r| f32_to_ufloat(value, fraction_bits, r)), [0; 2], "{value}");
            }
            for value in [65536.0, 1.0e30, f32::MAX] {
                assert_eq!(BOTH.map(|r| f32_to_ufloat(value, fraction_bits, r)), [infinity, infinity - 1], "{value}");
            }
            assert_eq!(BOTH.map(|r| f32_to_ufloat(f32::INFINITY, fraction_bits, r)), [infinity; 2]);
            for nan in [f32::NAN, -f32::NAN, f32::from_bits(0x7f80_0001), f32::from_bits(0xffff_ffff)] {
                assert_eq!(BOTH.map(|r| f32_to_ufloat(nan, fraction_bits, r)), [infinity | 1 << (fraction_bits - 1); 2]);
            }
        }
    }
}
