//! Ridges whose place is known.

use super::*;
use crate::metrics::pair::{MetricError, Pair, Which};
use nephroid_math::rng::normal_pair;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 72;

/// A picture of `f(x, y)`, in pixels from the centre of the first one.
fn picture(f: impl Fn(f64, f64) -> f64) -> Vec<[f32; 3]> {
    (0..WIDTH * HEIGHT).map(|i| [f(f64::from(i % WIDTH), f64::from(i / WIDTH)) as f32; 3]).collect()
}

/// A bright line on a floor of brightness 0.2: the profile of a Gaussian of half-width `w`, `distance` away.
fn line(distance: f64, w: f64) -> f64 {
    0.2 + libm::exp(-0.5 * distance * distance / (w * w))
}

/// A straight line through the middle at `angle` to the x axis, moved sideways by `shift`.
fn slanted(angle: f64, shift: f64) -> Vec<[f32; 3]> {
    let (sine, cosine) = libm::sincos(angle);
    picture(|x, y| line((y - 35.3) * cosine - (x - 47.1) * sine - shift, 1.6))
}

fn measure(reference: &[[f32; 3]], test: &[[f32; 3]]) -> Result<RidgeError, MetricError> {
    ridge_error(&Pair::new(WIDTH, HEIGHT, reference, test).unwrap(), &RidgeSettings::default())
}

#[test]
fn a_shift_is_measured_at_every_angle() {
    for angle in [0.0, 0.3, std::f64::consts::FRAC_PI_4, 1.2, std::f64::consts::FRAC_PI_2, 2.5] {
        for shift in [0.0, 0.1, 0.5, 1.0, 3.0] {
            let error = measure(&slanted(angle, 0.0), &slanted(angle, shift)).unwrap();
            for seen in [error.mean_px, error.p95_px, error.missing_px, error.spurious_px] {
                assert!((seen - shift).abs() < 0.03, "{shift} px at {angle} rad: {error:?}");
            }
        }
    }
}

#[test]
fn a_turned_line_is_measured() {
    // Distances along a line that turns about its middle grow linearly to half the length times the sine.
    let error = measure(&slanted(0.0, 0.0), &slanted(0.1, 0.0)).unwrap();
    let expected = 0.25 * (95.0 - 12.0) * libm::sin(0.1);
    assert!((error.mean_px - expected).abs() < 0.1, "{error:?}, expected {expected}");
}

#[test]
fn a_shifted_circle_is_measured() {
    let circle = |cx: f64| picture(|x, y| line(((x - cx) * (x - cx) + (y - 36.0) * (y - 36.0)).sqrt() - 24.0, 1.2));
    let error = measure(&circle(47.0), &circle(50.0)).unwrap();
    // The distance from a circle to one that is moved by d is about d·|cos φ|, whose mean is 2d/π.
    assert!((error.mean_px - 6.0 / std::f64::consts::PI).abs() < 0.1, "{error:?}");
    assert!((error.p95_px - 3.0).abs() < 0.1, "{error:?}");
}

#[test]
fn brightness_does_not_matter() {
    let reference = slanted(0.3, 0.0);
    let dimmed: Vec<[f32; 3]> = slanted(0.3, 1.0).iter().map(|pixel| pixel.map(|value| 0.125 * value)).collect();
    assert!((measure(&reference, &dimmed).unwrap().mean_px - 1.0).abs() < 0.05);
}

#[test]
fn missing_and_spurious_ridges_are_told_apart() {
    let one = picture(|x, _| line(x - 20.0, 1.5));
    let two = picture(|x, _| line(x - 20.0, 1.5).max(line(x - 60.0, 1.5)));
    let error = measure(&two, &one).unwrap();
    assert!((error.missing_px - 20.0).abs() < 0.1 && error.spurious_px < 0.01, "{error:?}");
    let error = measure(&one, &two).unwrap();
    assert!((error.spurious_px - 20.0).abs() < 0.1 && error.missing_px < 0.01, "{error:?}");
    assert_eq!((error.reference_count, error.test_count), (60, 120));
}

#[test]
fn noise_makes_no_ridges() {
    let clean = slanted(0.3, 0.0);
    let noise = |i: usize| normal_pair(4, 0, i as u32)[0];
    let noisy: Vec<[f32; 3]> = clean.iter().enumerate().map(|(i, p)| p.map(|value| value * (1.0 + 0.01 * noise(i)))).collect();
    let error = measure(&clean, &noisy).unwrap();
    assert!(error.mean_px < 0.1 && error.p95_px < 0.2, "{error:?}");
}

#[test]
fn pictures_without_ridges_are_refused() {
    let (black, grey) = (picture(|_, _| 0.0), picture(|_, _| 0.5));
    let (edge, valley) = (picture(|x, _| if x < 40.0 { 0.2 } else { 1.0 }), picture(|x, _| 1.5 - line(x - 40.0, 1.5)));
    let good = slanted(0.3, 0.0);
    for empty in [&black, &grey, &edge, &valley] {
        assert_eq!(measure(empty, &good), Err(MetricError::NoRidge { picture: Which::Reference }));
        assert_eq!(measure(&good, empty), Err(MetricError::NoRidge { picture: Which::Test }));
    }
}

#[test]
fn what_does_not_count_has_no_ridges() {
    let one = picture(|x, _| line(x - 20.0, 1.5));
    let mut two = picture(|x, _| line(x - 20.0, 1.5).max(line(x - 60.0, 1.5)));
    let mask: Vec<bool> = (0..WIDTH * HEIGHT).map(|i| i % WIDTH < 40).collect();
    two[50] = [f32::NAN; 3];
    let pair = Pair::with_mask(WIDTH, HEIGHT, &one, &two, Some(&mask)).unwrap();
    let error = ridge_error(&pair, &RidgeSettings::default()).unwrap();
    assert!(error.mean_px < 1.0e-9, "{error:?}");
}

#[test]
fn settings_out_of_range_are_refused() {
    let good = slanted(0.3, 0.0);
    let pair = Pair::new(WIDTH, HEIGHT, &good, &good).unwrap();
    let default = RidgeSettings::default();
    for settings in [
        RidgeSettings { sigma_px: 0.4, ..default },
        RidgeSettings { sigma_px: f64::NAN, ..default },
        RidgeSettings { luminance_quantile: 1.1, ..default },
        RidgeSettings { min_contrast: -0.1, ..default },
    ] {
        assert!(matches!(ridge_error(&pair, &settings), Err(MetricError::BadParameter { .. })), "{settings:?}");
    }
}
