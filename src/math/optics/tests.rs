//! Published and derived values, and identities that hold for any argument.

use super::*;
use crate::float::sin_cos;

const WATER: f32 = 1.333;

fn close(got: f32, expected: f32, tolerance: f32) {
    assert!((got - expected).abs() <= tolerance, "got {got}, expected {expected} ± {tolerance}");
}

fn cos_deg(angle: f32) -> f32 {
    sin_cos(angle.to_radians()).1
}

/// A ray going down at `angle_rad` from the vertical, onto the plane y = 0.
fn down_at(angle_rad: f32) -> V3<f32> {
    let (s, c) = sin_cos(angle_rad);
    v3(s, -c, 0.0)
}

const UP: V3<f32> = V3 { x: 0.0, y: 1.0, z: 0.0 };

#[test]
fn fresnel_transmittance_of_water() {
    for (angle, expected) in [(0.0, 0.979_627), (30.0, 0.978_564), (45.0, 0.972_102), (60.0, 0.940_309), (75.0, 0.787_622)] {
        close(fresnel_transmittance(cos_deg(angle), 1.0, WATER), expected, 1e-6);
    }
}

#[test]
fn irradiance_under_flat_water() {
    // Below flat, clear water a beam of perpendicular irradiance 1 leaves cosθᵢ·T(θᵢ) on every horizontal plane.
    for (angle, expected) in [(0.0, 0.979_627), (30.0, 0.847_461), (45.0, 0.687_380), (60.0, 0.470_155), (75.0, 0.203_852)] {
        let c = cos_deg(angle);
        close(c * fresnel_transmittance(c, 1.0, WATER), expected, 1e-6);
    }
}

#[test]
fn fresnel_limits() {
    let normal = (WATER - 1.0) / (WATER + 1.0);
    close(fresnel_reflectance(1.0_f32, 1.0, WATER), normal * normal, 1e-7);
    close(fresnel_reflectance(0.0_f32, 1.0, WATER), 1.0, 1e-6);
    assert_eq!(fresnel_reflectance(0.1_f32, WATER, 1.0), 1.0, "total reflection");
    for c in [0.0_f32, 0.3, 1.0] {
        assert_eq!(fresnel_reflectance(c, WATER, WATER), 0.0);
    }
}

#[test]
fn fresnel_is_the_same_both_ways() {
    for i in 1..90 {
        let (s, c) = sin_cos((i as f32).to_radians());
        let c_t = (1.0 - (s / WATER) * (s / WATER)).sqrt();
        close(fresnel_reflectance(c, 1.0, WATER), fresnel_reflectance(c_t, WATER, 1.0), 2e-5);
    }
}

#[test]
fn fresnel_is_zero_for_one_polarisation_at_brewsters_angle() {
    // tan θ_B = n: the parallel part vanishes, leaving half the square of (n²−1)/(n²+1).
    let c = 1.0 / (1.0 + WATER * WATER).sqrt();
    let s = (WATER * WATER - 1.0) / (WATER * WATER + 1.0);
    close(fresnel_reflectance(c, 1.0, WATER), 0.5 * s * s, 1e-6);
}

#[test]
fn schlick_stays_near_fresnel() {
    for i in 0..=1000 {
        let c = i as f32 / 1000.0;
        close(schlick_reflectance(c, 1.0, WATER), fresnel_reflectance(c, 1.0, WATER), 0.0625);
        close(schlick_reflectance(c, WATER, 1.0), fresnel_reflectance(c, WATER, 1.0), 0.0625);
    }
    assert_eq!(schlick_reflectance(0.2_f32, WATER, 1.0), 1.0);
}

#[test]
fn refract_obeys_snell_and_keeps_unit_length() {
    for i in 0..90 {
        let angle = (i as f32).to_radians();
        let (t, passes) = refract(down_at(angle), UP, 1.0 / WATER);
        assert!(passes);
        close(t.x * WATER, sin_cos(angle).0, 1e-6);
        close(t.length(), 1.0, 2e-7);
        assert!(t.y < 0.0 && t.z == 0.0);
    }
}

#[test]
fn refract_back_is_the_identity() {
    for i in 0..85 {
        let d = down_at((i as f32).to_radians());
        let (t, _) = refract(d, UP, 1.0 / WATER);
        let (back, passes) = refract(t, UP, WATER);
        assert!(passes);
        close(back.x, d.x, 5e-6);
        close(back.y, d.y, 2e-5);
    }
}

#[test]
fn refract_stops_at_the_critical_angle() {
    let critical = critical_angle_rad(WATER, 1.0).unwrap();
    close(critical.to_degrees(), 48.606_6, 1e-3);
    close(critical_cosine(WATER, 1.0).unwrap(), sin_cos(critical).1, 1e-6);
    assert!(refract(down_at(critical - 1e-3), UP, WATER).1);
    let (t, passes) = refract(down_at(critical + 1e-3), UP, WATER);
    assert!(!passes && t.x.is_finite() && t.y.is_finite());
    assert!(!refract(v3(f32::NAN, -1.0, 0.0), UP, WATER).1);
    for (n1, n2) in [(1.0, WATER), (1.0, 1.0), (f32::NAN, 1.0), (1.0, -1.0)] {
        assert_eq!((critical_angle_rad(n1, n2), critical_cosine(n1, n2)), (None, None));
    }
}

#[test]
fn index_ratios_of_lanes_obey_the_same_laws() {
    for i in 0..90 {
        let d = down_at((i as f32).to_radians());
        for (n1, n2) in [(1.0, WATER), (WATER, 1.0), (1.0, 1.52), (1.0, 1.0)] {
            let eta = n1 / n2;
            let ((plain, exists), (by_lane, exists_by_lane)) = (refract(d, UP, eta), refract_by(d, UP, eta));
            assert_eq!((plain.x, plain.y, plain.z, exists), (by_lane.x, by_lane.y, by_lane.z, exists_by_lane));
            close(fresnel_reflectance_by(-d.y, eta), fresnel_reflectance(-d.y, n1, n2), 2e-6);
            assert!(eta == 1.0 || (fresnel_reflectance_by(-d.y, eta * 1.01) - fresnel_reflectance(-d.y, n1, n2)).abs() > 2e-5 || !exists);
        }
    }
    assert_eq!(fresnel_reflectance_by(0.1_f32, WATER), 1.0, "total reflection");
    assert_eq!(fresnel_reflectance_by(0.0_f32, 1.0), 0.0, "no interface");
}

#[test]
fn reflect_keeps_the_tangential_part() {
    let d = down_at(0.4);
    let r = reflect(d, UP);
    assert_eq!((r.x, r.y), (d.x, -d.y));
    assert_eq!(reflect(d, -UP), r);
}

#[test]
fn beer_lambert_values() {
    close(beer_lambert(0.13_f32, 10.0), 0.272_531_8, 1e-7);
    let rgb = beer_lambert_rgb(Vec3::new(0.0, 0.1, 1e9), 2.0_f32);
    assert_eq!(rgb.x, 1.0);
    close(rgb.y, 0.818_730_8, 1e-7);
    assert_eq!(rgb.z, 0.0);
}

/// (∫p dω, ∫p·cosθ dω) by the midpoint rule over `cosθ`.
fn moments(phase: impl Fn(f32) -> f32) -> (f64, f64) {
    let count = 200_000;
    let (mut total, mut cosine) = (0.0, 0.0);
    for i in 0..count {
        let c = (f64::from(i) + 0.5) / f64::from(count) * 2.0 - 1.0;
        let p = f64::from(phase(c as f32)) * std::f64::consts::TAU * 2.0 / f64::from(count);
        total += p;
        cosine += p * c;
    }
    (total, cosine)
}

#[test]
fn henyey_greenstein_integrates_to_one_with_mean_cosine_g() {
    for g in [-0.6_f32, 0.0, 0.3, 0.5, 0.75, 0.9] {
        let (total, cosine) = moments(|c| henyey_greenstein(c, g));
        assert!((total - 1.0).abs() < 1e-4, "g = {g}: {total}");
        assert!((cosine - f64::from(g)).abs() < 1e-4, "g = {g}: {cosine}");
    }
    assert_eq!(henyey_greenstein(0.3_f32, 0.0), ISOTROPIC_PHASE);
    close(henyey_greenstein(1.0_f32, 0.9), 15.12, 0.01);
}

#[test]
fn schlick_phase_integrates_to_one_with_its_own_mean_cosine() {
    for (g, expected) in [(0.5_f32, 0.532), (0.75, 0.817), (0.9, 0.971)] {
        let (total, cosine) = moments(|c| schlick_phase(c, schlick_k(g)));
        assert!((total - 1.0).abs() < 2e-4, "g = {g}: {total}");
        assert!((cosine - expected).abs() < 1e-3, "g = {g}: {cosine}");
    }
    close(schlick_phase(1.0_f32, schlick_k(0.9)), 26.7, 0.1);
}

#[test]
fn an_index_ratio_in_each_lane_gives_what_one_for_all_gives() {
    for (n1, n2) in [(1.0_f32, WATER), (WATER, 1.0), (1.0, 1.5), (1.5, 1.46), (1.0, 1.0)] {
        for angle in [0.0_f32, 10.0, 41.0, 48.0, 60.0, 89.0] {
            let d = down_at(angle.to_radians());
            let ((with, passes), (by, by_passes)) = (refract(d, UP, n1 / n2), refract_by(d, UP, n1 / n2));
            assert_eq!((with, passes), (by, by_passes));
            let c = cos_deg(angle);
            close(fresnel_reflectance_by(c, n1 / n2), fresnel_reflectance(c, n1, n2), 2.0e-6);
        }
    }
    // Another ratio is another share.
    assert!(fresnel_reflectance_by(0.5_f32, 1.0 / 1.5) > fresnel_reflectance(0.5_f32, 1.0, 1.4) + 1.0e-3);
    assert_eq!(fresnel_reflectance_by(0.3_f32, 1.5), 1.0, "total reflection");
}
