//! `rgb9e5ufloat`: three 9-bit integers and one exponent [EXT_texture_shared_exponent; Vulkan, shared exponent to RGB].

/// Exponent bias.
const BIAS: i32 = 15;
/// Bits of an integer.
const BITS: i32 = 9;
/// Greatest number: `(2^9 − 1)·2^(31 − 15 − 9)`.
const GREATEST: f32 = 65408.0;

/// `2^k` for `k` in −126..=127.
fn power(k: i32) -> f32 {
    f32::from_bits(((k + 127) as u32) << 23)
}

/// Packs three numbers: red in the lowest 9 bits, the exponent in the highest 5. Negative numbers and NaN become 0, numbers that are too large become
/// the largest one.
pub(crate) fn pack(rgb: [f32; 3]) -> u32 {
    let clamped = rgb.map(|v| if v > 0.0 { v.min(GREATEST) } else { 0.0 });
    let most = clamped[0].max(clamped[1]).max(clamped[2]);
    // ⌊log2⌋ is the exponent field; subnormal numbers are far below the least exponent.
    let floor_log2 = (most.to_bits() >> 23) as i32 - 127;
    let mut exponent = floor_log2.max(-BIAS - 1) + 1 + BIAS;
    // ⌊v/2^(e − 15 − 9) + 0.5⌋, exact: v has 24 bits, and the division moves the exponent.
    let rounded = |v: f32, exponent: i32| (f64::from(v) * f64::from(power(BIAS + BITS - exponent)) + 0.5).floor() as u32;
    if rounded(most, exponent) == 1 << BITS {
        exponent += 1;
    }
    let [r, g, b] = clamped.map(|v| rounded(v, exponent));
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The three numbers, exact.
pub(crate) fn unpack(bits: u32) -> [f32; 3] {
    let scale = power((bits >> 27) as i32 - BIAS - BITS);
    [0, 9, 18].map(|shift| (bits >> shift & 0x1ff) as f32 * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_the_defined_numbers() {
        for exponent in 0..32u32 {
            for n in 0..512u32 {
                let expected = f64::from(n) * libm::exp2(f64::from(exponent) - 24.0);
                for (channel, shift) in [0, 9, 18].into_iter().enumerate() {
                    let value = unpack(n << shift | exponent << 27);
                    let mut only = [0.0; 3];
                    only[channel] = expected;
                    assert_eq!(value.map(f64::from), only);
                    // Packed again, the value is the same, if with another exponent.
                    assert_eq!(unpack(pack(value)), value);
                }
            }
        }
    }

    #[test]
    fn the_largest_channel_sets_the_exponent_and_the_others_round() {
        // 1 = 256·2^-8: the step is 2^-8 for all channels.
        assert_eq!(unpack(pack([1.0, 0.3, 0.001])), [1.0, 77.0 / 256.0, 0.0]);
        assert_eq!(unpack(pack([1.0, 0.5 / 256.0, 0.499 / 256.0])), [1.0, 1.0 / 256.0, 0.0]);
        // 511.6/512 would round to 512: the exponent rises.
        assert_eq!(unpack(pack([511.6 / 512.0, 0.0, 0.0])), [1.0, 0.0, 0.0]);
        assert_eq!(unpack(pack([f32::NAN, -1.0, f32::INFINITY])), [0.0, 0.0, 65408.0]);
        assert_eq!(unpack(pack([1.0e9, 65000.0, 0.0])), [65408.0, 65024.0, 0.0]);
        assert_eq!(pack([0.0; 3]), 0);
        assert_eq!(unpack(pack([libm::exp2f(-24.0), libm::exp2f(-26.0), 0.0])), [libm::exp2f(-24.0), 0.0, 0.0]);
    }
}
