//! The sRGB curve in 8 bits [IEC 61966-2-1].

/// Decoded values of the 256 sRGB codes, and the linear thresholds between neighbouring codes.
struct SrgbTables {
    linear: [f32; 256],
    threshold: [f32; 255],
}

fn srgb_tables() -> &'static SrgbTables {
    static TABLES: std::sync::OnceLock<SrgbTables> = std::sync::OnceLock::new();
    TABLES.get_or_init(|| {
        let decode = |s: f64| if s <= 0.04045 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) };
        SrgbTables {
            linear: std::array::from_fn(|n| decode(n as f64 / 255.0) as f32),
            threshold: std::array::from_fn(|n| decode((n as f64 + 0.5) / 255.0) as f32),
        }
    })
}

/// The sRGB code nearest to the encoded value of `linear`; NaN and negative numbers give 0.
#[must_use]
pub fn linear_to_srgb8(linear: f32) -> u8 {
    srgb_tables().threshold.partition_point(|&t| linear >= t) as u8
}

/// The linear value of an sRGB code [IEC 61966-2-1].
#[must_use]
pub fn srgb8_to_linear(code: u8) -> f32 {
    srgb_tables().linear[usize::from(code)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_codes_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(linear_to_srgb8(srgb8_to_linear(code)), code);
        }
        assert_eq!(linear_to_srgb8(f32::NAN), 0);
        assert_eq!(linear_to_srgb8(2.0), 255);
    }
}
