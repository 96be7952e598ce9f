//! Sine waves: T3, T4 and T9's integrals.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::Vec3;
use nephroid::scene::{MeasuringPlane, Scene};

use super::traced::{Probe, Sensor, fine, level_plane, measure, measure_to, probes, scene, set};
use super::truths::optics;
use super::truths::water::{Crossed, Sine};

/// The sine wave over a level floor far below all that is measured, in place of the ramp.
pub fn sine_over_deep_floor() -> Scene {
    let mut scene = scene("sine_water.ron");
    let floor = &mut scene.objects[0].transform;
    (floor.translate, floor.rotate_deg) = (Vec3::new(0.0, -9.0, 0.0), Vec3::ZERO);
    scene
}

/// A row of texels across the waves on the level y, long in z, along which nothing changes.
fn row(y: f64, x: [f64; 2], columns: u32) -> MeasuringPlane {
    level_plane(y, x, [-2.5, 2.5], (columns, 1))
}

/// `y` as the plane has it, in 32 bits.
fn level_of(plane: &MeasuringPlane) -> f64 {
    f64::from(plane.corner.y)
}

#[test]
fn sine_wave_has_the_whole_curve_before_at_and_behind_its_focus() {
    let wave = Sine::SHIPPED;
    for &part in &[0.3, 1.0, 1.3] {
        let mut scene = sine_over_deep_floor();
        let plane = row(
            wave.level(part * wave.focus_depth()),
            // The focus is inside of a texel, where rounding does not move light across an edge.
            [-0.62, 0.62],
            31,
        );
        let y = level_of(&plane);
        scene.trace.plane = Some(plane);
        let seen = measure_to(fine(), &scene, Sensor::Plane, &probes(&plane, 0.0, |x, _| wave.mean(x[0], x[1], y)));
        seen.agrees();
        let wrong = Sine { ior: 1.36, ..wave };
        let truths = probes(&plane, 0.0, |x, _| wrong.mean(x[0], x[1], y));
        seen.refuses("two per cent more refractive index", |i, _| truths[i].truth[0]);
        let upside_down = Sine { amplitude: -wave.amplitude, ..wave };
        let truths = probes(&plane, 0.0, |x, _| upside_down.mean(x[0], x[1], y));
        seen.refuses("troughs in place of crests", |i, _| truths[i].truth[0]);
    }
}

#[test]
fn sine_wave_is_brightest_under_its_crest_by_the_paraxial_law() {
    let wave = Sine::SHIPPED;
    for &part in &[0.25, 0.75] {
        let mut scene = sine_over_deep_floor();
        let depth = part * wave.focus_depth();
        let plane = row(wave.level(depth), [-0.003, 0.003], 1);
        scene.trace.plane = Some(plane);
        // The texel is narrow enough to be a point, which the exact curve says, too.
        let truth = optics::transmittance(0.0, 1.333) / (1.0 - part);
        assert!((wave.mean(-0.003, 0.003, level_of(&plane)) / truth - 1.0).abs() < 0.01, "a narrow texel is a point");
        let truth = wave.mean(-0.003, 0.003, level_of(&plane));
        let seen = measure_to(fine(), &scene, Sensor::Plane, &[Probe::white(0, 0, truth)]);
        seen.agrees();
        let off = 1.0 / (1.0 - 0.95 * part) * (1.0 - part);
        seen.refuses("a focus that is five per cent deeper", |_, truth| truth * off * if part < 0.5 { 0.98 } else { 1.0 });
    }
}

#[test]
fn ramp_measures_the_section_with_its_own_cosine() {
    // The scene's plane, which lies in the ramp: a sloping receiver takes cos 45° of the light that goes straight down.
    let wave = Sine::SHIPPED;
    let mut scene = scene("sine_water.ron");
    let plane = scene.trace.plane.as_mut().expect("the scene has a plane");
    plane.texels = (8, 8);
    let (corner, u, v) = (plane.corner.as_dvec3(), plane.u.as_dvec3(), plane.v.as_dvec3());
    let mut all = Vec::new();
    for row in 0..8 {
        for column in 0..8 {
            let x = [0, 1].map(|end| corner.x + u.x * f64::from(column + end) / 8.0);
            let y = |at: f64| corner.y + v.y * (f64::from(row) + at) / 8.0;
            let mean = super::truths::integrate(0.0, 1.0, 1, |at| wave.mean(x[0], x[1], y(at)));
            all.push(Probe::white(column, row, mean * FRAC_1_SQRT_2));
        }
    }
    let seen = measure(&scene, Sensor::Plane, &all);
    seen.agrees();
    seen.refuses("a level receiver", |_, truth| truth / FRAC_1_SQRT_2);
}

#[test]
fn crossed_waves_gather_light_along_both_axes() {
    let crossed = Crossed::SHIPPED;
    let f = crossed.wave.focus_depth();
    for &part in &[0.25, 0.75] {
        let mut scene = scene("crossed_sines.ron");
        // Around a crest and a quarter of a period to either side.
        let plane = level_plane(crossed.level(part * f), [-0.04, 0.2], [-0.04, 0.2], (3, 3));
        scene.trace.plane = Some(plane);
        let y = level_of(&plane);
        let truth = |x: [f64; 2], z: [f64; 2]| crossed.mean(0.5 * (x[0] + x[1]), 0.5 * (z[0] + z[1]), x[1] - x[0], y);
        let seen = measure_to(fine(), &scene, Sensor::Plane, &probes(&plane, 0.5, truth));
        seen.agrees();
        let one_axis = crossed.under_crest(part * f) * (1.0 - part);
        let crest = seen.comparisons.iter().position(|c| c.place.starts_with("column 0, row 2")).expect("the crest is tested");
        seen.refuses("light gathered along one axis only", |i, truth| if i == crest { one_axis } else { truth });
        let wrong = Crossed { wave: Sine { ior: 1.36, ..crossed.wave } };
        let truths = probes(&plane, 0.0, |x, z| wrong.mean(0.5 * (x[0] + x[1]), 0.5 * (z[0] + z[1]), x[1] - x[0], y));
        let wanted = probes(&plane, 0.5, truth);
        let place = |i: usize| truths.iter().find(|t| (t.column, t.row) == (wanted[i].column, wanted[i].row)).expect("all texels");
        seen.refuses("two per cent more refractive index", |i, _| place(i).truth[0]);
    }
}

#[test]
fn crossed_waves_show_the_paraxial_value_under_a_crest() {
    let crossed = Crossed::SHIPPED;
    let mut scene = scene("crossed_sines.ron");
    let depth = 0.5 * crossed.wave.focus_depth();
    let plane = level_plane(crossed.level(depth), [-0.02, 0.02], [-0.02, 0.02], (1, 1));
    scene.trace.plane = Some(plane);
    assert!((crossed.mean(0.0, 0.0, 0.04, level_of(&plane)) / crossed.under_crest(depth) - 1.0).abs() < 0.03, "a small texel is a point");
    let truth = crossed.mean(0.0, 0.0, 0.04, level_of(&plane));
    let seen = measure_to(super::traced::noise() * 2.0, &scene, Sensor::Plane, &[Probe::white(0, 0, truth)]);
    seen.agrees();
    seen.refuses("light gathered along one axis only", |_, truth| truth.sqrt());
}

#[test]
fn waves_make_and_lose_no_light() {
    // T3: over whole periods, before and behind the focus, as much lands as enters.
    for &(name, part, reach) in
        &[("sine_water.ron", 0.5, 1.0), ("sine_water.ron", 1.3, 1.0), ("crossed_sines.ron", 0.7, 0.5), ("crossed_sines.ron", 1.5, 0.5)]
    {
        let crossed = name.starts_with("crossed");
        let mut scene = if crossed { scene(name) } else { sine_over_deep_floor() };
        let (wave, top) = if crossed { (Crossed::SHIPPED.wave, 0.08) } else { (Sine::SHIPPED, 0.02) };
        if crossed {
            scene.objects[0].transform.translate = Vec3::new(0.0, -6.0, 0.0);
        }
        let plane = level_plane(top - part * wave.focus_depth(), [-reach, reach], [-reach, reach], (1, 1));
        scene.trace.plane = Some(plane);
        let truth = if crossed { Crossed::SHIPPED.mean_of_period() } else { super::truths::integrate(0.0, 1.0, 8, |x| wave.entering(x)) };
        let seen = measure_to(0.001, &scene, Sensor::Plane, &[Probe::white(0, 0, truth)]);
        seen.agrees();
        seen.refuses("one per cent more light", |_, truth| truth * 1.01);
    }
}

#[test]
fn absorbing_waves_dim_by_the_way_through_the_water() {
    // Under the crest before the focus, all light has come straight down.
    let wave = Sine::SHIPPED;
    let mut scene = sine_over_deep_floor();
    set(&mut scene, "medium.sigma_a", "0.3,0.1,0.05");
    let depth = 0.5 * wave.focus_depth();
    let plane = row(wave.level(depth), [-0.01, 0.01], 1);
    scene.trace.plane = Some(plane);
    let clear = wave.mean(-0.01, 0.01, level_of(&plane));
    let truth = [0.3, 0.1, 0.05].map(|sigma: f64| clear * libm::exp(-sigma * depth));
    let seen = measure(&scene, Sensor::Plane, &[Probe { column: 0, row: 0, truth }]);
    seen.agrees();
    seen.refuses("clear water", |_, _| clear);
}
