//! The transform against `rustfft` and the definition, and the statistics of the sea.

use std::f64::consts::TAU;

use glam::Vec2;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use super::super::{HeightField, Water, WaterModel};
use super::*;

fn sea(settings: OceanSettings) -> Water {
    let patch = settings.patch_m;
    Water { size_m: Vec2::splat(patch), center_m: Vec2::splat(0.5 * patch), model: WaterModel::FftOcean(settings), ..Water::default() }
}

/// A surface with its vertices on the points of the transform.
fn on_points(settings: &OceanSettings, time_s: f32) -> HeightField {
    let water = sea(settings.clone());
    assert_eq!(water.validate(), Ok(()));
    water.surface_with_grid(settings.resolution + 1, settings.resolution + 1, time_s)
}

fn variance(field: &HeightField) -> f64 {
    let side = field.columns - 1;
    let points = (0..side).flat_map(|row| (0..side).map(move |column| (column, row)));
    points.map(|(column, row)| f64::from(field.heights_ws[field.index(column, row)])).map(|h| h * h).sum::<f64>() / f64::from(side * side)
}

#[test]
fn fft_agrees_with_rustfft() {
    for size in [4_usize, 8, 32, 256] {
        let data: Vec<Complex> = (0..size * size)
            .map(|i| {
                let [re, im] = normal_pair(3, 4, i as u32).map(f64::from);
                Complex { re, im }
            })
            .collect();
        let mut got = data.clone();
        Fft::new(size).inverse_2d(&mut got);

        let plan = FftPlanner::new().plan_fft_inverse(size);
        let mut rows: Vec<Complex64> = data.iter().map(|c| Complex64::new(c.re, c.im)).collect();
        plan.process(&mut rows);
        let mut columns: Vec<Complex64> = (0..size * size).map(|i| rows[i % size * size + i / size]).collect();
        plan.process(&mut columns);
        for (i, value) in got.iter().enumerate() {
            let expected = columns[i % size * size + i / size];
            let error = (value.re - expected.re).abs().max((value.im - expected.im).abs());
            assert!(error < 1e-12 * size as f64, "size {size}, point {i}: off by {error}");
        }
    }
}

#[test]
fn heights_are_real() {
    let mut ocean = FftOcean::new(&OceanSettings { resolution: 64, ..OceanSettings::default() });
    ocean.transform(3.7);
    let largest = ocean.heights.iter().map(|c| c.re.abs()).fold(0.0, f64::max);
    let imaginary = ocean.heights.iter().map(|c| c.im.abs()).fold(0.0, f64::max);
    assert!(largest > 1e-3 && imaginary < 1e-13 * largest.max(1.0), "heights to {largest} m, imaginary parts to {imaginary} m");
}

#[test]
fn surface_is_the_sum_of_its_waves() {
    let settings = OceanSettings { resolution: 16, patch_m: 5.0, depth_m: Some(0.7), ..OceanSettings::default() };
    let ocean = FftOcean::new(&settings);
    let (time, field) = (2.5_f64, on_points(&settings, 2.5));
    for (column, row) in [(0, 0), (3, 5), (15, 8), (16, 16)] {
        let p = field.position_ws(column, row);
        let (mut height, mut slope) = (0.0, [0.0, 0.0]);
        for wave in &ocean.waves {
            // Twice the wave that travels along k stands for itself and its conjugate partner at −k.
            let phase = wave.k[0] * f64::from(p.x) + wave.k[1] * f64::from(p.z) - wave.omega * time;
            let (s, c) = libm::sincos(phase);
            height += 2.0 * (wave.forth.re * c - wave.forth.im * s);
            for (axis, slope) in slope.iter_mut().enumerate() {
                *slope -= 2.0 * wave.k[axis] * (wave.forth.re * s + wave.forth.im * c);
            }
        }
        assert!((f64::from(p.y) - height).abs() < 1e-7, "{} instead of {height}", p.y);
        let normal = super::super::normal_from_slope(Vec2::new(slope[0] as f32, slope[1] as f32));
        assert!((field.normals_ws[field.index(column, row)] - normal).length() < 1e-5);
    }
}

#[test]
fn variance_is_that_of_the_spectrum() {
    // A surface has thousands of waves, but the few longest carry most energy: the mean over seeds converges with their number.
    for spectrum in [Spectrum::default(), Spectrum::Jonswap { fetch_m: 5000.0, gamma: 3.3 }] {
        let settings = |seed| OceanSettings { resolution: 64, patch_m: 60.0, seed, spectrum, ..OceanSettings::default() };
        let expected = settings(0).expected_variance_m2();
        let count = 60;
        let mean = (0..count).map(|seed| variance(&on_points(&settings(seed), 1.0))).sum::<f64>() / f64::from(count);
        assert!((mean / expected - 1.0).abs() < 0.08, "{spectrum:?}: {mean} m², expected {expected} m²");
    }
}

#[test]
fn expected_variance_converges_to_the_integral_of_the_spectrum() {
    for (spectrum, depth_m) in [
        (Spectrum::default(), None),
        (Spectrum::Jonswap { fetch_m: 5000.0, gamma: 3.3 }, None),
        (Spectrum::Jonswap { fetch_m: 5000.0, gamma: 3.3 }, Some(0.8)),
    ] {
        let settings = OceanSettings { resolution: 512, patch_m: 80.0, depth_m, spectrum, ..OceanSettings::default() };
        let sea = Sea::new(&settings);
        // Midpoint rule in ln k, up to the highest frequency of the patch.
        let (low, high) = (1e-3_f64, TAU / 80.0 * 255.0);
        let steps = 100_000;
        let width = libm::log(high / low) / f64::from(steps);
        let integral: f64 = (0..steps).map(|i| low * libm::exp((f64::from(i) + 0.5) * width)).map(|k| sea.density_m3(k) * k * width).sum();
        let got = settings.expected_variance_m2();
        assert!((got / integral - 1.0).abs() < 0.02, "{spectrum:?} {depth_m:?}: sum {got} m², integral {integral} m²");
    }
}

#[test]
fn jonswap_in_frequency_and_wave_number_hold_the_same_energy() {
    // ∫S(k)dk = ∫S(ω)dω; without enhancement the latter is α·g²/(5·ω_p⁴).
    let settings = OceanSettings { spectrum: Spectrum::Jonswap { fetch_m: 5000.0, gamma: 1.0 }, ..OceanSettings::default() };
    let sea = Sea::new(&settings);
    let g = super::super::GRAVITY_M_PER_S2;
    let alpha = 0.076 * libm::pow(g * 5000.0 / 16.0, -0.22);
    let peak = 22.0 * libm::cbrt(g * g / (4.0 * 5000.0));
    let steps = 200_000;
    let width = libm::log(1e6_f64) / f64::from(steps);
    let integral: f64 = (0..steps).map(|i| 1e-2 * libm::exp((f64::from(i) + 0.5) * width)).map(|k| sea.density_m3(k) * k * width).sum();
    let expected = alpha * g * g / (5.0 * peak * peak * peak * peak);
    assert!((integral / expected - 1.0).abs() < 1e-3, "{integral} m², expected {expected} m²");
}

#[test]
fn spreading_integrates_to_one() {
    for spreading in [0.0, 1.0, 4.5, 100.0] {
        let sea = Sea::new(&OceanSettings { spreading, wind_direction_deg: 0.0, ..OceanSettings::default() });
        let steps = 10_000;
        let sum: f64 = (0..steps)
            .map(|i| TAU * f64::from(i) / f64::from(steps))
            .map(libm::sincos)
            .map(|(s, c)| sea.density_m4([2.0 * c, 2.0 * s]) * 2.0 / sea.density_m3(2.0))
            .sum();
        assert!((sum * TAU / f64::from(steps) - 1.0).abs() < 1e-6, "s = {spreading}");
    }
}

#[test]
fn waves_travel_with_the_wind() {
    // A narrow sea moves along the wind: over a short time the surface is its old self, shifted downwind.
    let settings = OceanSettings { wind_direction_deg: 0.0, spreading: 60.0, resolution: 64, patch_m: 10.0, ..OceanSettings::default() };
    let (before, after) = (on_points(&settings, 0.0), on_points(&settings, 0.1));
    let correlation = |shift: u32| -> f64 {
        let points = (0..64).flat_map(|row| (0..64).map(move |column| (column, row)));
        points.map(|(c, r)| f64::from(before.heights_ws[before.index(c, r)] * after.heights_ws[after.index((c + shift) % 64, r)])).sum()
    };
    assert!(correlation(1) > correlation(0) && correlation(1) > correlation(63));
}

#[test]
fn surface_tiles_and_repeats() {
    let settings = OceanSettings { resolution: 32, loop_s: Some(6.0), ..OceanSettings::default() };
    let field = on_points(&settings, 1.0);
    for i in 0..=32 {
        assert_eq!(field.heights_ws[field.index(0, i)], field.heights_ws[field.index(32, i)]);
        assert_eq!(field.heights_ws[field.index(i, 0)], field.heights_ws[field.index(i, 32)]);
    }
    let later = on_points(&settings, 7.0);
    for (a, b) in field.heights_ws.iter().zip(&later.heights_ws) {
        assert!((a - b).abs() < 1e-6);
    }
}

#[test]
fn higher_resolution_keeps_the_waves() {
    // A smooth sea, so that 64 points resolve all of it: at 128 every other point is the same.
    let settings = |resolution| OceanSettings { resolution, shortest_wave_m: 4.0, ..OceanSettings::default() };
    let (coarse, fine) = (on_points(&settings(64), 2.0), on_points(&settings(128), 2.0));
    for row in 0..64 {
        for column in 0..64 {
            let (a, b) = (coarse.heights_ws[coarse.index(column, row)], fine.heights_ws[fine.index(2 * column, 2 * row)]);
            assert!((a - b).abs() < 1e-5, "{a} and {b}");
        }
    }
}

#[test]
fn normals_match_finite_differences() {
    let settings = OceanSettings { resolution: 64, shortest_wave_m: 3.0, ..OceanSettings::default() };
    let field = sea(settings).surface_with_grid(513, 513, 0.5);
    let differences =
        HeightField::from_heights(field.columns, field.rows, field.origin_ws, field.spacing_m, field.heights_ws.clone()).unwrap();
    for row in 1..512 {
        for column in 1..512 {
            let i = field.index(column, row);
            assert!((field.normals_ws[i] - differences.normals_ws[i]).length() < 5e-3);
        }
    }
}

#[test]
#[ignore = "a measurement: run in release with --nocapture"]
fn transform_cost() {
    for resolution in [128, 256, 512] {
        let mut ocean = FftOcean::new(&OceanSettings { resolution, ..OceanSettings::default() });
        let start = std::time::Instant::now();
        for i in 0..10 {
            ocean.transform(f64::from(i));
        }
        println!("{resolution}x{resolution}: {:.2} ms per transform", start.elapsed().as_secs_f64() * 100.0);
    }
}
