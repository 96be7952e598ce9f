//! Laws at folds and cusps: T9.

use glam::Vec2;
use nephroid::scene::{MeasuringPlane, Scene};
use nephroid::trace::{TraceOptions, Tracer};

use super::traced::{Probe, Sensor, level_plane, measure, measure_to, noise, probes};
use super::truths::water::Sine;
use super::waves::sine_over_deep_floor;
use crate::support::sized;

/// The middle of the crest alone, from which all light near `x = 0` comes: fewer photons are wasted.
fn one_crest() -> Scene {
    let mut scene = sine_over_deep_floor();
    scene.water.as_mut().expect("the scene has water").size_m = Vec2::splat(0.6);
    scene
}

/// A row of texels on the level y below that crest, along which nothing changes in z.
fn row(y: f64, x: [f64; 2], columns: u32) -> MeasuringPlane {
    level_plane(y, x, [-0.25, 0.25], (columns, 1))
}

/// Slope of the straight line through points, by least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut xy, mut xx) = (0.0, 0.0);
    for (x, y) in points {
        xy += (x - mx) * (y - my);
        xx += (x - mx) * (x - mx);
    }
    xy / xx
}

#[test]
fn texels_at_a_fold_grow_as_the_root_of_the_resolution() {
    let wave = Sine::SHIPPED;
    let y = f64::from(wave.level(1.3 * wave.focus_depth()) as f32);
    let fold = wave.fold(y).expect("behind the focus");
    // The third sheet, which has no fold here.
    let third = wave.irradiance(fold + 1.0e-9, y);
    let (mut seen_points, mut true_points) = (Vec::new(), Vec::new());
    for width in [0.0032, 0.0016, 0.0008] {
        let mut scene = one_crest();
        // A texel that ends a little behind the fold: exactly at it, where light is densest, rounding would decide what counts.
        let plane = row(y, [fold - width, fold + 0.05 * width], 1);
        scene.trace.plane = Some(plane);
        let truths = probes(&plane, 0.0, |x, _| wave.mean(x[0], x[1], y));
        let seen = measure(&scene, Sensor::Plane, &truths);
        seen.agrees();
        seen.refuses("the value in the middle of the texel in place of its mean", |_, _| wave.irradiance(fold - 0.5 * width, y));
        seen_points.push((libm::log(width), libm::log(seen.comparisons[0].mean - third)));
        true_points.push((libm::log(width), libm::log(truths[0].truth[0] - third)));
        // C w^(-1/2), integrated over the texel.
        let law = 2.0 / 1.05 * wave.fold_strength(y).expect("behind the focus") / width.sqrt();
        assert!(((truths[0].truth[0] - third) / law - 1.0).abs() < 3.0 * width.sqrt(), "{} against {law}", truths[0].truth[0] - third);
    }
    let (seen, exact) = (slope(&seen_points), slope(&true_points));
    println!("fold: slope {seen}, exact at these widths {exact}, in the limit -0.5");
    // Three points over two octaves, each within a few times its noise.
    assert!((seen - exact).abs() < 3.0 * noise(), "{seen} against {exact}");
    assert!((seen + 0.5).abs() < 0.05 + 3.0 * noise(), "{seen}");
}

#[test]
fn a_cusp_opens_as_the_power_of_three_halves() {
    let wave = Sine::SHIPPED;
    let (mut seen_points, mut true_points) = (Vec::new(), Vec::new());
    for part in [0.05_f64, 0.1, 0.2, 0.4] {
        let y = f64::from(wave.level((1.0 + part) * wave.focus_depth()) as f32);
        let fold = wave.fold(y).expect("behind the focus");
        let mut scene = one_crest();
        // What the law says to first order, (2 ε)^(3/2) / (3 k), is enough to lay the texels.
        let first = libm::pow(2.0 * part, 1.5) / (3.0 * wave.wave_number);
        let columns = 60;
        scene.trace.plane = Some(row(y, [0.3 * first, 1.5 * first], columns));
        let mut tracer = Tracer::new(&scene, &TraceOptions { seed: 1, ..TraceOptions::default() }).expect("the scene is good");
        tracer.run(sized(1 << 20, 1 << 19));
        let measured = tracer.plane().expect("the scene has a plane");
        let mean = |column: u32| measured.mean(column, 0)[0];
        // The steepest fall of light is at the fold: inside it is unbounded, outside it is one sheet.
        let edge = (0..columns - 1).max_by(|&a, &b| (mean(a) - mean(a + 1)).total_cmp(&(mean(b) - mean(b + 1)))).expect("columns");
        let texel = 1.2 * first / f64::from(columns);
        let seen = 0.3 * first + texel * f64::from(edge + 1);
        assert!((seen - fold).abs() <= 1.01 * texel, "at {part}: fold seen at {seen}, truth {fold}, texel {texel}");
        seen_points.push((libm::log(part), libm::log(seen)));
        true_points.push((libm::log(part), libm::log(fold)));
    }
    let (seen, exact) = (slope(&seen_points), slope(&true_points));
    println!("cusp: slope {seen}, exact at these depths {exact}, in the limit 1.5");
    // A texel is two per cent of the width.
    assert!((seen - exact).abs() < 0.03, "{seen} against {exact}");
    assert!((seen - 1.5).abs() < 0.1, "{seen}");
}

#[test]
fn texels_across_both_folds_hold_all_the_light() {
    // Every texel of a fine row, with the folds in it, is the integral of the closed form.
    let wave = Sine::SHIPPED;
    let y = f64::from(wave.level(1.3 * wave.focus_depth()) as f32);
    let mut scene = one_crest();
    let plane = row(y, [-0.04, 0.04], 20);
    scene.trace.plane = Some(plane);
    let truths: Vec<Probe> = probes(&plane, 1.0, |x, _| wave.mean(x[0], x[1], y));
    assert!(truths.len() > 9, "{}", truths.len());
    let seen = measure_to(2.0 * noise(), &scene, Sensor::Plane, &truths);
    seen.agrees();
    let shifted = probes(&plane, 0.0, |x, _| wave.mean(x[0] - 5.0e-4, x[1] - 5.0e-4, y));
    seen.refuses("folds that are half a millimetre off", |i, _| shifted[truths[i].column as usize].truth[0]);
}
