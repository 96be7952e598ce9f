//! Integers of 8, 10, 16 and 32 bits, kept in planes of f32 as the bit patterns of 32-bit integers.
//!
//! Numbers out of a narrower target's range are clamped to it, as in Direct3D (data conversion rules, integer conversion) and OpenGL. Vulkan leaves
//! the result undefined (Vulkan-Docs issue 830), and WebGPU does not say.

/// An unsigned pattern clamped to `bits` bits.
#[inline]
pub(crate) fn uint(pattern: f32, bits: u32) -> u32 {
    pattern.to_bits().min(u32::MAX >> (32 - bits))
}

/// A signed pattern clamped to `bits` bits.
#[inline]
pub(crate) fn sint(pattern: f32, bits: u32) -> i32 {
    (pattern.to_bits() as i32).clamp(i32::MIN >> (32 - bits), i32::MAX >> (32 - bits))
}

/// Sign extension: the 32-bit pattern of the signed integer in the lowest `bits` bits of `code`.
#[inline]
pub(crate) fn extended(code: u32, bits: u32) -> f32 {
    f32::from_bits(((code << (32 - bits)) as i32 >> (32 - bits)) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_clamp_to_their_width() {
        let u = |v: u32, bits| uint(f32::from_bits(v), bits);
        let s = |v: i32, bits| sint(f32::from_bits(v as u32), bits);
        for (bits, greatest) in [(2, 3), (8, 255), (10, 1023), (16, 65535), (32, u32::MAX)] {
            for value in [0, 1, 3, 254, 255, 256, 1023, 1024, 65535, 65536, 0x7f80_0001, 0x7fff_ffff, 0xffc0_0000, u32::MAX] {
                assert_eq!(u(value, bits), value.min(greatest), "{value} in {bits} bits");
            }
        }
        for (bits, least, greatest) in [(8, -128, 127), (16, -32768, 32767), (32, i32::MIN, i32::MAX)] {
            for value in [0, -1, 1, 127, 128, -128, -129, 32767, 32768, -32768, -32769, i32::MIN, i32::MAX] {
                assert_eq!(s(value, bits), value.clamp(least, greatest), "{value} in {bits} bits");
            }
        }
    }

    #[test]
    fn signs_are_extended() {
        for code in 0..=u8::MAX {
            assert_eq!(extended(u32::from(code), 8).to_bits() as i32, i32::from(code as i8));
        }
        for code in 0..=u16::MAX {
            assert_eq!(extended(u32::from(code), 16).to_bits() as i32, i32::from(code as i16));
        }
        assert_eq!(extended(0x8000_0000, 32).to_bits(), 0x8000_0000);
    }
}
