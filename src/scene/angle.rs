//! Sines and cosines of angles in degrees, exact where a scene means them to be exact.

/// Sine and cosine of an angle in degrees, `(sin, cos)`.
///
/// The angle is first brought into ±45° by whole quarter turns, which is exact in `f64`, so that multiples of 90° give exactly 0 and ±1:
/// a sun at an elevation of 90° shines straight down, not 4e-8 beside it. Not finite in, NaN out.
#[must_use]
pub fn sin_cos_deg(angle_deg: f32) -> (f32, f32) {
    let angle_deg = f64::from(angle_deg);
    let quarter_turns = libm::round(angle_deg / 90.0);
    let rest_rad = (angle_deg - 90.0 * quarter_turns).to_radians();
    let (sin, cos) = libm::sincos(rest_rad);
    let (sin, cos) = match libm::fmod(quarter_turns, 4.0) {
        1.0 | -3.0 => (cos, -sin),
        2.0 | -2.0 => (-sin, -cos),
        3.0 | -1.0 => (-cos, sin),
        _ => (sin, cos),
    };
    // Adding zero turns −0 into +0.
    ((sin + 0.0) as f32, (cos + 0.0) as f32)
}

/// Angle in degrees of the vector (x, y), from −180° to 180°; 0 for the zero vector.
#[must_use]
pub fn atan2_deg(y: f32, x: f32) -> f32 {
    libm::atan2(f64::from(y), f64::from(x)).to_degrees() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_cos_deg_is_exact_at_quarter_turns() {
        for (angle, expected) in
            [(0.0, (0.0, 1.0)), (90.0, (1.0, 0.0)), (180.0, (0.0, -1.0)), (270.0, (-1.0, 0.0)), (-90.0, (-1.0, 0.0)), (450.0, (1.0, 0.0))]
        {
            assert_eq!(sin_cos_deg(angle), expected, "{angle}°");
        }
        assert_eq!(sin_cos_deg(30.0).0, 0.5);
        assert_eq!(sin_cos_deg(60.0).1, 0.5);
        assert_eq!(sin_cos_deg(-210.0).0, 0.5);
    }

    #[test]
    fn sin_cos_deg_agrees_with_the_unreduced_functions() {
        for step in -720..=720 {
            let angle = step as f32 * 0.75;
            let (sin, cos) = sin_cos_deg(angle);
            let rad = f64::from(angle).to_radians();
            assert!((f64::from(sin) - libm::sin(rad)).abs() < 1e-7 && (f64::from(cos) - libm::cos(rad)).abs() < 1e-7, "{angle}°");
        }
        assert!(sin_cos_deg(f32::INFINITY).0.is_nan());
    }

    #[test]
    fn atan2_deg_inverts_sin_cos_deg() {
        for angle in [-179.0, -90.0, -45.0, 0.0, 12.5, 90.0, 180.0] {
            let (sin, cos) = sin_cos_deg(angle);
            assert!((atan2_deg(sin, cos) - angle).abs() < 1e-4);
        }
    }
}
