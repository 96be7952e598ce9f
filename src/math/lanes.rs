//! The number type of shaders and other hot code: generic over the number of lanes.
//!
//! A shader is written once over `L: Lanes`. With `L = f32` it reads like the paper's equation and is the definition; with sixteen lanes it processes
//! a 4x4 pixel block or sixteen vertices at a time. Both give the same bits, at every SIMD level:
//!
//! - only operations that IEEE 754 rounds exactly are offered (`+ - * /`, square root, rounding to an integer);
//! - there is no fused multiply-add, because hardware without it would round differently;
//! - `min` and `max` are a comparison and a select, so their results for NaN are the same everywhere;
//! - conversions to integers saturate, as Rust's `as` and WGSL's value conversions do; the processors' own instructions differ out of range;
//! - branches become masks and [`Lanes::select`].
//!
//! Generic code over lanes must be inlined into a function that is compiled for the level, or every operation becomes a call. Mark such functions
//! `#[inline(always)]`. Do not use closures that take or return lanes (nor `array::map`, which takes one): closures cannot be marked so.
//!
//! `math::float` builds elementary functions (exponential, sine, ...) from these operations.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use fearless_simd::{Select, Simd, SimdBase, SimdCvtFloat, SimdCvtTruncate, SimdFloat, SimdMask, f32x16, i32x16, mask32x16, u32x16};

#[cfg(test)]
mod tests;

/// Lanes of [`f32`] that are computed together: `f32` itself (one lane) or [`f32x16`] (sixteen).
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
    + Neg<Output = Self>
{
    /// One truth value per lane.
    type Mask: Mask;
    /// Proof that the machine can run this width; needed to make lanes from constants.
    type Token: Copy;
    /// Number of lanes.
    const LEN: usize;

    /// The same number in every lane.
    fn splat(token: Self::Token, value: f32) -> Self;
    /// Lane `i` is `f(i)`; `f` is called once per lane in rising order.
    fn from_fn(token: Self::Token, f: impl FnMut(usize) -> f32) -> Self;
    /// The first [`Self::LEN`] numbers of a slice. Panics if it is shorter.
    fn load(token: Self::Token, slice: &[f32]) -> Self;
    /// Writes the lanes to the first [`Self::LEN`] places of a slice. Panics if it is shorter.
    fn store(self, slice: &mut [f32]);
    /// The token with which this value was made.
    fn token(self) -> Self::Token;
    /// The number in lane `index`. To read all lanes, [`Self::to_array`] is faster.
    fn lane(self, index: usize) -> f32;
    /// Lane `i` in place `i`; places beyond [`Self::LEN`] are 0.
    fn to_array(self) -> [f32; 16];
    /// Each lane rounded toward zero, then clamped to `−2^31..=2^31 − 1`; NaN becomes 0. This is Rust's `as i32`, and WGSL's conversion, which leaves
    /// NaN open [WGSL §15.7.6, floating point conversion]. Places beyond [`Self::LEN`] are 0.
    fn to_i32(self) -> [i32; 16];
    /// Each lane rounded toward zero, then clamped to `0..=2^32 − 1`; NaN becomes 0, as by Rust's `as u32`. Places beyond [`Self::LEN`] are 0.
    fn to_u32(self) -> [u32; 16];

    /// `mask ? if_true : if_false`, lane by lane.
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;
    /// `self < other` (false where either is NaN).
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other` (false where either is NaN).
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other` (false where either is NaN).
    fn equals(self, other: Self) -> Self::Mask;

    /// Square root, rounded to nearest; NaN below zero.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Magnitude.
    #[must_use]
    fn abs(self) -> Self;
    /// Largest integer not above `self`.
    #[must_use]
    fn floor(self) -> Self;
    /// Nearest integer, ties to even.
    #[must_use]
    fn round_ties_even(self) -> Self;
    /// `2^self` for integral `self` in `−126..=127`. Other arguments give other numbers, with the same bits at every level.
    #[must_use]
    fn exp2_int(self) -> Self;

    /// The same number in every lane, at the width of `self`.
    #[inline(always)]
    #[must_use]
    fn like(self, value: f32) -> Self {
        Self::splat(self.token(), value)
    }
    /// `self > other` (false where either is NaN).
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other` (false where either is NaN).
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `self < other ? self : other`: the second operand where either is NaN.
    #[inline(always)]
    #[must_use]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    /// `self > other ? self : other`: the second operand where either is NaN.
    #[inline(always)]
    #[must_use]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    /// `min(max(self, low), high)`; NaN becomes `low`.
    #[inline(always)]
    #[must_use]
    fn clamp(self, low: f32, high: f32) -> Self {
        Lanes::min(Lanes::max(self, self.like(low)), self.like(high))
    }
    /// Applies `f` to each lane separately, for functions without a wide form.
    #[inline(always)]
    #[must_use]
    fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        let lanes = self.to_array();
        Self::from_fn(self.token(), |i| f(lanes[i]))
    }
}

/// One truth value per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// True if any lane is true.
    fn any(self) -> bool;
    /// True if every lane is true.
    fn all(self) -> bool;
    /// Lane `i` as bit `i`.
    fn bits(self) -> u32;
}

impl Mask for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

/// `1.5·2^23 + 127`: added to an integer, it leaves the integer plus the exponent bias of f32 in the sum's lowest bits. No integer conversion is
/// needed, whose result out of range would differ between processors.
const EXPONENT_BIAS: f32 = 12_583_039.0;

impl Lanes for f32 {
    type Mask = bool;
    type Token = ();
    const LEN: usize = 1;

    #[inline(always)]
    fn splat((): (), value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn from_fn((): (), mut f: impl FnMut(usize) -> f32) -> Self {
        f(0)
    }
    #[inline(always)]
    fn load((): (), slice: &[f32]) -> Self {
        slice[0]
    }
    #[inline(always)]
    fn store(self, slice: &mut [f32]) {
        slice[0] = self;
    }
    #[inline(always)]
    fn token(self) {}
    #[inline(always)]
    fn lane(self, _index: usize) -> f32 {
        self
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        let mut lanes = [0.0; 16];
        lanes[0] = self;
        lanes
    }
    #[inline(always)]
    fn to_i32(self) -> [i32; 16] {
        let mut lanes = [0; 16];
        lanes[0] = self as i32;
        lanes
    }
    #[inline(always)]
    fn to_u32(self) -> [u32; 16] {
        let mut lanes = [0; 16];
        lanes[0] = self as u32;
        lanes
    }
    #[inline(always)]
    fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
        if mask { if_true } else { if_false }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn equals(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32::floor(self)
    }
    #[inline(always)]
    fn round_ties_even(self) -> Self {
        f32::round_ties_even(self)
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        f32::from_bits((self + EXPONENT_BIAS).to_bits() << 23)
    }
}

impl<S: Simd> Mask for mask32x16<S> {
    #[inline(always)]
    fn any(self) -> bool {
        SimdMask::any_true(self)
    }
    #[inline(always)]
    fn all(self) -> bool {
        SimdMask::all_true(self)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        SimdMask::to_bitmask(self) as u32
    }
}

/// Whether the level's minimum and maximum instructions have the bits of a comparison and a select: they return the second operand if either is NaN
/// or both are zero. True for vectors of x86, false for scalar code and for other processors.
#[inline(always)]
fn has_this_minimum<S: Simd>(lanes: f32x16<S>) -> bool {
    cfg!(any(target_arch = "x86", target_arch = "x86_64")) && !lanes.token().level().is_fallback()
}

impl<S: Simd> Lanes for f32x16<S> {
    type Mask = mask32x16<S>;
    type Token = S;
    const LEN: usize = 16;

    #[inline(always)]
    fn splat(token: S, value: f32) -> Self {
        SimdBase::splat(token, value)
    }
    #[inline(always)]
    fn from_fn(token: S, mut f: impl FnMut(usize) -> f32) -> Self {
        let mut lanes = [0.0; 16];
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f(i);
        }
        SimdBase::load_array(token, lanes)
    }
    #[inline(always)]
    fn load(token: S, slice: &[f32]) -> Self {
        SimdBase::from_slice(token, &slice[..16])
    }
    #[inline(always)]
    fn store(self, slice: &mut [f32]) {
        SimdBase::store_slice(&self, &mut slice[..16]);
    }
    #[inline(always)]
    fn token(self) -> S {
        fearless_simd::ExtractToken::token(&self)
    }
    #[inline(always)]
    fn lane(self, index: usize) -> f32 {
        SimdBase::as_array(&self)[index]
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        self.into()
    }
    #[inline(always)]
    fn to_i32(self) -> [i32; 16] {
        i32x16::truncate_from_precise(self).into()
    }
    #[inline(always)]
    fn to_u32(self) -> [u32; 16] {
        u32x16::truncate_from_precise(self).into()
    }
    #[inline(always)]
    fn select(mask: mask32x16<S>, if_true: Self, if_false: Self) -> Self {
        Select::select(mask, if_true, if_false)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if has_this_minimum(self) { SimdBase::min(self, other) } else { Self::select(self.lt(other), self, other) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if has_this_minimum(self) { SimdBase::max(self, other) } else { Self::select(other.lt(self), self, other) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> mask32x16<S> {
        SimdBase::simd_lt(self, other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> mask32x16<S> {
        SimdBase::simd_le(self, other)
    }
    #[inline(always)]
    fn equals(self, other: Self) -> mask32x16<S> {
        SimdBase::simd_eq(self, other)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        SimdBase::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        SimdFloat::floor(self)
    }
    #[inline(always)]
    fn round_ties_even(self) -> Self {
        SimdFloat::round_ties_even(self)
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        let biased: u32x16<S> = fearless_simd::Bytes::bitcast(self + EXPONENT_BIAS);
        fearless_simd::Bytes::bitcast(biased << 23)
    }
}

/// Integers to lanes; exact below 2^24 in magnitude.
#[inline(always)]
pub fn lanes_from_i32<S: Simd>(ints: i32x16<S>) -> f32x16<S> {
    f32x16::float_from(ints)
}
