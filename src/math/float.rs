//! Elementary functions with the same bits everywhere: on every machine, at every SIMD level, one lane or sixteen.
//!
//! The wide functions ([`exp`], [`exp2`], [`sin_cos`], [`sin`], [`cos`]) use only the operations of [`Lanes`], which IEEE 754 rounds exactly; they
//! have no table and no branch. The slow functions ([`ln`], [`log2`], [`pow`], [`acos`], [`atan2`]) call `libm` lane by lane. Code that runs per
//! fragment should need only the wide ones.
//!
//! Polynomial coefficients are minimax fits of the relative error (Lawson's iteration at 25 digits), rounded to `f32`. Error bounds are
//! in ulp of the exact result and are checked against 64-bit `libm` over dense sweeps in the tests.
//!
//! Road not taken: a fused multiply-add would save one or two roundings and a third of the instructions of [`exp`], but hardware without it would
//! give other bits.

use std::f32::consts::{FRAC_2_PI, LN_2, LOG2_E};

use super::lanes::Lanes;

#[cfg(test)]
mod tests;

/// Largest argument of [`exp`] with a finite result: above it the result is `+∞`.
pub const EXP_MAX: f32 = 88.722_83;
/// Smallest argument of [`exp`] whose result is a normal number; below it the result is zero.
pub const EXP_MIN: f32 = -87.336_54;

/// `ln 2` in two parts: nine bits, so that `k·LN_2_HIGH` is exact for every `k` met here, and the rest.
const LN_2_HIGH: f32 = 0.693_359_4;
const LN_2_LOW: f32 = -2.121_944_4e-4;

/// `eʳ·2ᵏ` for `r` in `[−0.3466, 0.3466]`, up to `0.6975` for the largest exponent, and integral `k` in `−126..=127`.
///
/// `eʳ = 1 + (r + r²·P(r))`; the fit is 2.7e-8 in the first range and, by a sixfold weight, 1.4e-7 in the extension.
#[inline(always)]
fn exp_scaled<L: Lanes>(r: L, k: L) -> L {
    let p = ((((r * 1.573_677e-3 + 8.355_012e-3) * r + 4.163_151e-2) * r + 0.166_666_37) * r + 0.500_001_55) * (r * r) + r + 1.0;
    p * k.exp2_int()
}

/// Exponential `eˣ`.
///
/// Within 2 ulp for `x` in `[EXP_MIN, 88]` and within 3 ulp from there to [`EXP_MAX`]. Saturates outside: `+∞` above [`EXP_MAX`], zero below [`EXP_MIN`]
/// (results that would be subnormal are flushed). NaN stays NaN; `exp(±0) = 1` exactly.
#[inline(always)]
pub fn exp<L: Lanes>(x: L) -> L {
    // `x` is the second operand because `min` returns the second operand if either is NaN.
    let x = Lanes::min(x.like(88.73), x);
    // k stays at 127 where it would round to 128, because 2^128 is not finite; r grows instead, up to 0.6975.
    let k = Lanes::min(x.like(127.0), (x * LOG2_E).round_ties_even());
    let r = x - k * LN_2_HIGH - k * LN_2_LOW;
    L::select(x.lt(x.like(EXP_MIN)), x.like(0.0), exp_scaled(r, k))
}

/// Power of two `2ˣ`.
///
/// Within 2 ulp for `x` in `[−126, 127.5]` and within 4 ulp up to 128; exact for integers. Saturates outside: `+∞` from 128, zero below −126
/// (results that would be subnormal are flushed). NaN stays NaN.
#[inline(always)]
pub fn exp2<L: Lanes>(x: L) -> L {
    let x = Lanes::min(x.like(128.0), x);
    let k = Lanes::min(x.like(127.0), x.round_ties_even());
    // 128 leaves r = ln 2, for which the polynomial may end slightly below 2, so the overflow is selected explicitly.
    let scaled = L::select(x.ge(x.like(128.0)), x.like(f32::INFINITY), exp_scaled((x - k) * LN_2, k));
    L::select(x.lt(x.like(-126.0)), x.like(0.0), scaled)
}

/// `π/2` in three parts of 8, 11 and 24 bits: the first two give exact products for quotients of up to 13 bits.
const HALF_PI_HIGH: f32 = 1.570_312_5;
const HALF_PI_MID: f32 = 4.837_513e-4;
const HALF_PI_LOW: f32 = 7.549_79e-8;

/// Sine and cosine of `x` radians together, at little more than the cost of one.
///
/// The argument is reduced by the nearest multiple of `π/2` in three parts (Cody & Waite 1980), valid for `|x| ≤ 1e4`. In this range the absolute
/// error is below 1e-7 for both; for `|x| ≤ 100` and a result above 1e-3 in magnitude, the error is within 2 ulp. Beyond 1e4 the error grows with
/// `|x|`, but the results stay in `[−1, 1]`. `sin(±0) = +0`. NaN and infinities give NaN.
#[inline(always)]
pub fn sin_cos<L: Lanes>(x: L) -> (L, L) {
    let q = (x * FRAC_2_PI).round_ties_even();
    let r = x - q * HALF_PI_HIGH - q * HALF_PI_MID - q * HALF_PI_LOW;
    // This bound changes only arguments out of range, and is written so that NaN passes.
    let r = Lanes::max(r.like(-0.7863), Lanes::min(r.like(0.7863), r));
    let r2 = r * r;
    let sine = ((r2 * -1.951_487_2e-4 + 8.332_158e-3) * r2 - 0.166_666_55) * (r2 * r) + r;
    let cosine = ((r2 * 2.443_270_4e-5 - 1.388_731_2e-3) * r2 + 4.166_664_6e-2) * (r2 * r2) + (r2 * -0.5 + 1.0);

    // Quadrant 0..=3: odd ones swap the two, then sine is negative in 2 and 3 and cosine in 1 and 2.
    let quadrant = q - (q * 0.25).floor() * 4.0;
    let one = x.like(1.0);
    let two = x.like(2.0);
    let swap = quadrant.equals(one) | quadrant.equals(x.like(3.0));
    let (s, c) = (L::select(swap, cosine, sine), L::select(swap, sine, cosine));
    let s = L::select(quadrant.ge(two), -s, s);
    let c = L::select(quadrant.equals(one) | quadrant.equals(two), -c, c);
    (s, c)
}

/// Sine of `x` radians; see [`sin_cos`].
#[inline(always)]
pub fn sin<L: Lanes>(x: L) -> L {
    sin_cos(x).0
}

/// Cosine of `x` radians; see [`sin_cos`].
#[inline(always)]
pub fn cos<L: Lanes>(x: L) -> L {
    sin_cos(x).1
}

/// Natural logarithm. Slow: lane by lane through `libm`.
///
/// Within 1 ulp. Zero gives `−∞`, negative numbers NaN.
#[inline]
pub fn ln<L: Lanes>(x: L) -> L {
    x.map(libm::logf)
}

/// Logarithm to base two. Slow: lane by lane through `libm`.
///
/// Within 1 ulp. Zero gives `−∞`, negative numbers NaN.
#[inline]
pub fn log2<L: Lanes>(x: L) -> L {
    x.map(libm::log2f)
}

/// `xʸ`. Slow: lane by lane through `libm`.
///
/// Within 1 ulp, with the special cases of C's `powf`: `x⁰ = 1` even for NaN, negative `x` needs an integral `y` or gives NaN.
#[inline]
pub fn pow<L: Lanes>(x: L, y: L) -> L {
    L::from_fn(x.token(), |i| libm::powf(x.lane(i), y.lane(i)))
}

/// Angle in `[0, π]` radians whose cosine is `x`. Slow: lane by lane through `libm`.
///
/// Within 1 ulp. NaN outside `[−1, 1]`: clamp a dot product first.
#[inline]
pub fn acos<L: Lanes>(x: L) -> L {
    x.map(libm::acosf)
}

/// Angle in `[−π, π]` radians of the point `(x, y)`, anticlockwise from +x. Slow: lane by lane through `libm`.
///
/// Within 1.1 ulp. The origin gives zero or `±π`, by the signs of its zeros, as C's `atan2f` does.
#[inline]
pub fn atan2<L: Lanes>(y: L, x: L) -> L {
    L::from_fn(y.token(), |i| libm::atan2f(y.lane(i), x.lane(i)))
}
