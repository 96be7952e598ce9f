//! Accuracy against 64-bit `libm`, special values, and equal bits at every width and level.

use fearless_simd::{Simd, f32x16};

use super::*;
use crate::level::{wide_dispatch, wide_levels};

/// `|got − exact|` in units of the last place of `exact` as an `f32` (of the smallest normal number below it).
fn ulps(got: f32, exact: f64) -> f64 {
    let exponent = libm::ilogb(exact).max(-126);
    (f64::from(got) - exact).abs() / libm::ldexp(1.0, exponent - 23)
}

/// Largest error in ulp over `count + 1` evenly spaced arguments.
fn worst(low: f32, high: f32, count: u32, got: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
    (0..=count).map(|i| low + (high - low) * (i as f32 / count as f32)).map(|x| ulps(got(x), exact(f64::from(x)))).fold(0.0, f64::max)
}

#[test]
fn exp_is_within_two_ulp_where_it_is_used() {
    assert!(worst(EXP_MIN, 88.0, 4_000_000, exp, libm::exp) <= 2.0);
    assert!(worst(-1.0, 1.0, 4_000_000, exp, libm::exp) <= 2.0);
    assert!(worst(-1e-3, 1e-3, 100_000, exp, libm::exp) <= 2.0);
    assert!(worst(88.0, EXP_MAX, 1_000_000, exp, libm::exp) <= 3.0);
}

#[test]
fn exp_saturates_and_keeps_nan() {
    assert_eq!(exp(0.0_f32), 1.0);
    assert_eq!(exp(-0.0_f32), 1.0);
    assert!(exp(EXP_MAX).is_finite());
    assert_eq!(exp(EXP_MAX.next_up()), f32::INFINITY);
    assert!(exp(EXP_MIN) >= f32::MIN_POSITIVE);
    assert_eq!(exp(EXP_MIN.next_down()), 0.0);
    for x in [89.0, 1e3, 1e30, f32::MAX, f32::INFINITY] {
        assert_eq!(exp(x), f32::INFINITY, "{x}");
        assert_eq!(exp(-x), 0.0, "{x}");
    }
    assert!(exp(f32::NAN).is_nan());
}

#[test]
fn exp2_is_within_two_ulp_and_exact_at_integers() {
    assert!(worst(-126.0, 127.5, 4_000_000, exp2, libm::exp2) <= 2.0);
    assert!(worst(127.5, 127.999_99, 1_000_000, exp2, libm::exp2) <= 4.0);
    for k in -126..=127 {
        assert_eq!(f64::from(exp2(k as f32)), libm::ldexp(1.0, k));
    }
    assert_eq!(exp2(128.0_f32), f32::INFINITY);
    assert!(exp2(128.0_f32.next_down()).is_finite());
    assert_eq!(exp2(f32::INFINITY), f32::INFINITY);
    assert_eq!(exp2((-126.0_f32).next_down()), 0.0);
    assert_eq!(exp2(f32::NEG_INFINITY), 0.0);
    assert!(exp2(f32::NAN).is_nan());
}

#[test]
fn sine_and_cosine_are_within_their_bounds() {
    let mut relative: f64 = 0.0;
    let mut absolute: f64 = 0.0;
    for i in 0..=8_000_000 {
        let x = (i as f32 / 8_000_000.0 - 0.5) * 2e4;
        let (s, c) = sin_cos(x);
        for (got, exact) in [(s, libm::sin(f64::from(x))), (c, libm::cos(f64::from(x)))] {
            absolute = absolute.max((f64::from(got) - exact).abs());
        }
        let x = x * 0.01;
        let (s, c) = sin_cos(x);
        for (got, exact) in [(s, libm::sin(f64::from(x))), (c, libm::cos(f64::from(x)))] {
            if exact.abs() > 1e-3 {
                relative = relative.max(ulps(got, exact));
            }
        }
    }
    assert!(absolute < 1e-7, "absolute error {absolute}");
    assert!(relative <= 2.0, "{relative} ulp");
}

#[test]
fn sine_and_cosine_of_special_values() {
    assert_eq!(sin(0.0_f32).to_bits(), 0.0_f32.to_bits());
    assert_eq!(sin(-0.0_f32).to_bits(), 0.0_f32.to_bits());
    assert_eq!(cos(0.0_f32), 1.0);
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(sin(x).is_nan() && cos(x).is_nan(), "{x}");
    }
    for x in [1e5, -1e7, 3e12, 1e30, f32::MAX] {
        assert!(sin(x).abs() <= 1.0 && cos(x).abs() <= 1.0, "{x}");
    }
}

#[test]
fn slow_functions_agree_with_their_64_bit_forms() {
    assert!(worst(1e-6, 1e3, 200_000, ln, libm::log) <= 1.0);
    assert!(worst(1e-6, 1e3, 200_000, log2, libm::log2) <= 1.0);
    assert!(worst(1e-6, 30.0, 200_000, |x| pow(x, 2.4), |x| libm::pow(x, f64::from(2.4_f32))) <= 1.0);
    assert!(worst(-1.0, 1.0, 200_000, acos, libm::acos) <= 1.0);
    assert!(worst(-30.0, 30.0, 200_001, |x| atan2(x, -1.5), |x| libm::atan2(x, -1.5)) <= 1.1);
}

/// Arguments that reach every branch and rounding: sweeps, powers of two, neighbours of the limits, and special values.
fn arguments() -> Vec<f32> {
    let mut xs: Vec<f32> = (0..200_000).map(|i| (i as f32 - 100_000.0) * 1.7e-3).collect();
    xs.extend((0..100_000).map(|i| (i as f32 - 50_000.0) * 0.2));
    for exponent in -149..128 {
        let x = libm::ldexpf(1.0, exponent);
        xs.extend([x, -x, x.next_up(), -x.next_up()]);
    }
    for limit in [EXP_MAX, EXP_MIN, 88.73, 128.0, -126.0, 127.5] {
        xs.extend([limit, limit.next_up(), limit.next_down()]);
    }
    xs.extend([0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::MAX, f32::MIN]);
    xs.resize(xs.len().next_multiple_of(16), 0.5);
    xs
}

/// All functions of one argument, in a fixed order.
#[inline(always)]
fn all_functions<L: Lanes>(x: L) -> [L; 8] {
    let (s, c) = sin_cos(x);
    [exp(x), exp2(x), s, c, ln(x), acos(x), pow(x.abs(), x.like(0.7)), atan2(x, x.like(2.0))]
}

#[inline(always)]
fn wide<S: Simd>(simd: S, xs: &[f32]) -> Vec<[f32; 8]> {
    let mut results = Vec::new();
    for block in xs.chunks_exact(16) {
        let values = all_functions(f32x16::load(simd, block));
        results.extend((0..16).map(|i| values.map(|v| v.lane(i))));
    }
    results
}

#[test]
fn functions_have_the_same_bits_at_every_level() {
    // Which NaN comes out is left to the hardware.
    fn canonical(x: f32) -> u32 {
        if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
    }
    let xs = arguments();
    for (name, level) in wide_levels() {
        let results = wide_dispatch!(
            level,
            simd => simd.vectorize(#[inline(always)] || wide(simd, &xs)),
            wide(crate::level::baseline(), &xs)
        );
        for (x, got) in xs.iter().zip(results) {
            assert_eq!(all_functions(*x).map(canonical), got.map(canonical), "argument {x} at level {name}");
        }
    }
}
