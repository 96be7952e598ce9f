//! Lanes at every level against one lane: minima, conversions, powers of two.

use super::*;
use crate::level::{wide_dispatch, wide_levels};

/// NaN and both zeros beside ordinary numbers, so that processors' own minima and maxima are held to the definition.
#[test]
fn minimum_and_maximum_give_the_second_operand_where_a_comparison_is_false() {
    const VALUES: [f32; 7] = [f32::NAN, -0.0, 0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY];
    #[inline(always)]
    fn both<S: Simd>(simd: S, a: f32, b: f32) -> [[f32; 16]; 2] {
        let (a, b): (f32x16<S>, f32x16<S>) = (Lanes::splat(simd, a), Lanes::splat(simd, b));
        [Lanes::to_array(Lanes::min(a, b)), Lanes::to_array(Lanes::max(a, b))]
    }
    for (name, level) in wide_levels() {
        for a in VALUES {
            for b in VALUES {
                let expected = [Lanes::min(a, b), Lanes::max(a, b)];
                let found = wide_dispatch!(
                    level,
                    simd => simd.vectorize(#[inline(always)] || both(simd, a, b)),
                    both(crate::level::baseline(), a, b)
                );
                for (found, expected) in found.iter().zip(expected) {
                    assert!(found.iter().all(|v| v.to_bits() == expected.to_bits()), "{a} and {b} at {name}: {found:?}, not {expected}");
                }
            }
        }
    }
}

/// Numbers around every bound of both ranges, and how WGSL's saturating conversions see them.
#[test]
fn conversions_to_integers_saturate_at_every_level() {
    const VALUES: [(f32, i32, u32); 20] = [
        (0.0, 0, 0),
        (-0.0, 0, 0),
        (0.999_999_94, 0, 0),
        (-0.999_999_94, 0, 0),
        (1.0, 1, 1),
        (-1.0, -1, 0),
        (-1.5, -1, 0),
        (2.5, 2, 2),
        (16_777_217.0, 16_777_216, 16_777_216),
        (2_147_483_520.0, 2_147_483_520, 2_147_483_520),
        (2_147_483_648.0, i32::MAX, 2_147_483_648),
        (-2_147_483_648.0, i32::MIN, 0),
        (-2_147_483_904.0, i32::MIN, 0),
        (4_294_967_040.0, i32::MAX, 4_294_967_040),
        (4_294_967_296.0, i32::MAX, u32::MAX),
        (4.29e9, i32::MAX, 4_289_999_872),
        (f32::INFINITY, i32::MAX, u32::MAX),
        (f32::NEG_INFINITY, i32::MIN, 0),
        (f32::NAN, 0, 0),
        (-f32::NAN, 0, 0),
    ];
    #[inline(always)]
    fn both<S: Simd>(simd: S, value: f32) -> ([i32; 16], [u32; 16]) {
        // One lane alone is out of range, then all: some conversions take another way if all lanes are in range.
        let lanes = <f32x16<S> as Lanes>::from_fn(simd, |i| if i % 3 == 0 { value } else { 7.0 });
        (Lanes::to_i32(lanes), Lanes::to_u32(lanes))
    }
    for (value, signed, unsigned) in VALUES {
        assert_eq!((Lanes::to_i32(value)[0], Lanes::to_u32(value)[0]), (signed, unsigned), "{value}, one lane");
        for (name, level) in crate::level::available_levels() {
            let found = fearless_simd::dispatch!(level, simd => simd.vectorize(#[inline(always)] || both(simd, value)));
            for lane in 0..16 {
                let expected = if lane % 3 == 0 { (signed, unsigned) } else { (7, 7) };
                assert_eq!((found.0[lane], found.1[lane]), expected, "{value} in lane {lane} at {name}");
            }
        }
    }
}

#[test]
fn exp2_int_is_a_power_of_two_and_the_same_everywhere_beyond() {
    #[inline(always)]
    fn wide<S: Simd>(simd: S, value: f32) -> [f32; 16] {
        Lanes::to_array(<f32x16<S> as Lanes>::splat(simd, value).exp2_int())
    }
    for k in -126..=127 {
        assert_eq!(f64::from(Lanes::exp2_int(k as f32)), libm::exp2(f64::from(k)), "2^{k}");
    }
    for value in (-130..=130).map(|k| k as f32).chain([0.5, -3.25, 1.0e9, -1.0e20, 4.29e9, f32::INFINITY]) {
        let expected = Lanes::exp2_int(value).to_bits();
        for (name, level) in wide_levels() {
            let found = wide_dispatch!(
                level,
                simd => simd.vectorize(#[inline(always)] || wide(simd, value)),
                wide(crate::level::baseline(), value)
            );
            assert!(found.iter().all(|v| v.to_bits() == expected), "{value} at {name}: {found:?}");
        }
    }
}
