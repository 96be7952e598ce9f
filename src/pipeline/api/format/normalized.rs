//! Integers that stand for 0..=1 or −1..=1.

/// `⌊clamp(v, 0, 1)·255 + 0.5⌋`; NaN becomes 0 [D3D11.3 §3.2.3.6].
#[inline]
pub(crate) fn unorm8(value: f32) -> u8 {
    // The cast saturates and sends NaN to zero.
    (value * 255.0 + 0.5).floor() as u8
}

/// `⌊clamp(v, 0, 1)·(2^bits − 1) + 0.5⌋` without rounding on the way; NaN becomes 0. At most 16 bits.
#[inline]
pub(crate) fn unorm(value: f32, bits: u32) -> u32 {
    let greatest = (1u32 << bits) - 1;
    ((f64::from(value) * f64::from(greatest) + 0.5).floor() as u32).min(greatest)
}

/// `clamp(v, −1, 1)·127` rounded to nearest, ties away from zero; NaN becomes 0 [D3D11.3 §3.2.3.4].
#[inline]
pub(crate) fn snorm8(value: f32) -> i8 {
    let scaled = value.clamp(-1.0, 1.0) * 127.0;
    // The cast rounds toward zero and sends NaN to zero.
    (scaled + f32::copysign(0.5, scaled)) as i8
}

/// `max(n/127, −1)`: −128 and −127 both are −1 [D3D11.3 §3.2.3.3; Vulkan, conversion from normalized fixed-point].
#[inline]
pub(crate) fn snorm8_value(code: i8) -> f32 {
    (f32::from(code) / 127.0).max(-1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values next to `x` below and above.
    fn around(x: f64) -> [f32; 2] {
        let nearest = x as f32;
        if f64::from(nearest) < x { [nearest, nearest.next_up()] } else { [nearest.next_down(), nearest] }
    }

    #[test]
    fn unorm_codes_round_trip_and_change_half_way() {
        for bits in [2, 8, 10, 16] {
            let greatest = (1u32 << bits) - 1;
            for code in 0..=greatest {
                assert_eq!(unorm(code as f32 / greatest as f32, bits), code, "{bits} bits");
                if code < greatest {
                    let [below, above] = around((f64::from(code) + 0.5) / f64::from(greatest));
                    assert_eq!([unorm(below, bits), unorm(above, bits)], [code, code + 1], "{bits} bits, above {code}");
                }
            }
            for (value, expected) in [(-1.0, 0), (f32::NAN, 0), (f32::NEG_INFINITY, 0), (1.5, greatest), (f32::INFINITY, greatest)] {
                assert_eq!(unorm(value, bits), expected, "{value} in {bits} bits");
            }
        }
    }

    #[test]
    fn unorm8_rounds_half_up_and_clamps() {
        let table = [(-1.0, 0), (f32::NAN, 0), (1.5, 255), (0.5 / 255.0, 1), (0.49 / 255.0, 0), (f32::INFINITY, 255)];
        for (value, code) in table {
            assert_eq!(unorm8(value), code, "{value}");
        }
        for code in 0..=255u8 {
            assert_eq!(unorm8(f32::from(code) / 255.0), code);
        }
    }

    #[test]
    fn snorm_codes_round_trip_and_change_half_way() {
        assert_eq!([snorm8_value(-128), snorm8_value(-127), snorm8_value(0), snorm8_value(127)], [-1.0, -1.0, 0.0, 1.0]);
        assert_eq!(snorm8_value(64), 64.0 / 127.0);
        for code in -127..=127i8 {
            assert_eq!(snorm8(snorm8_value(code)), code);
            assert_eq!(snorm8_value(-code), -snorm8_value(code), "the codes are symmetric");
        }
        for code in 0..127i8 {
            let half_way = (f64::from(code) + 0.5) / 127.0;
            let (below, above) = ((half_way * 0.999_999) as f32, (half_way * 1.000_001) as f32);
            assert_eq!([snorm8(below), snorm8(above), snorm8(-below), snorm8(-above)], [code, code + 1, -code, -code - 1]);
        }
        for (value, code) in [(f32::NAN, 0), (-0.0, 0), (2.0, 127), (-2.0, -127), (f32::INFINITY, 127), (f32::NEG_INFINITY, -127)] {
            assert_eq!(snorm8(value), code, "{value}");
        }
        // Exactly half-way goes away from zero: 0.5/127 is no f32, but 0.5·127 = 63.5 is exact.
        assert_eq!([snorm8(0.5), snorm8(-0.5)], [64, -64]);
    }
}
