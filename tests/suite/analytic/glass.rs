//! Balls of glass: T5, T6.

use super::traced::{Probe, Sensor, level_plane, measure, measure_to, noise, probes, scene};
use super::truths::optics;
use super::truths::sphere::{Ball, Cap, Rings};

/// The truth of the one texel of a square around the axis.
fn square(rings: &impl Rings, half: f64) -> Probe {
    Probe::white(0, 0, rings.mean([-half, half], [-half, half]))
}

#[test]
fn cap_gathers_light_inside_of_the_glass() {
    for &z in &[0.5, 0.3] {
        let cap = Cap { ior: 2.5, behind_center: z };
        let mut scene = scene("cap.ron");
        let plane = level_plane(-z, [-0.025, 0.175], [-0.025, 0.175], (4, 4));
        scene.trace.plane = Some(plane);
        let truths = probes(&plane, 4.0, |x, z| cap.mean(x, z));
        let seen = measure(&scene, Sensor::Plane, &truths);
        seen.agrees();
        let other = Cap { ior: 2.45, ..cap };
        let wrong = probes(&plane, 0.0, |x, z| other.mean(x, z));
        seen.refuses("two per cent less refractive index", |i, _| wrong[(truths[i].row * 4 + truths[i].column) as usize].truth[0]);
        seen.refuses("a missing transmittance", |_, truth| truth / optics::transmittance(0.0, 2.5));
    }
}

#[test]
fn cap_shows_the_paraxial_value_on_its_axis() {
    let cap = Cap { ior: 2.5, behind_center: 0.3 };
    let mut scene = scene("cap.ron");
    scene.trace.plane = Some(level_plane(-0.3, [-0.02, 0.02], [-0.02, 0.02], (1, 1)));
    let truth = square(&cap, 0.02);
    assert!((truth.truth[0] / cap.on_axis() - 1.0).abs() < 2.0e-3, "{truth:?} {}", cap.on_axis());
    let seen = measure_to(2.0 * noise(), &scene, Sensor::Plane, &[truth]);
    seen.agrees();
    seen.refuses("light gathered along one axis only", |_, truth| truth.sqrt());
}

#[test]
fn ball_focuses_through_both_of_its_surfaces() {
    for &z in &[1.2, 1.8, 1.35] {
        let ball = Ball { ior: 1.5, behind_center: z };
        let mut scene = scene("glass_ball.ron");
        // The floor is at 1.8, where the plane lies in it; before that it floats.
        let plane = level_plane(-z, [-0.1, 0.5], [-0.1, 0.5], (3, 3));
        scene.trace.plane = Some(plane);
        let truths = probes(&plane, 0.6, |x, z| ball.mean(x, z));
        let seen = measure(&scene, Sensor::Plane, &truths);
        seen.agrees();
        let at = |i: usize| (truths[i].row * 3 + truths[i].column) as usize;
        let other = Ball { ior: 1.53, ..ball };
        let wrong = probes(&plane, 0.0, |x, z| other.mean(x, z));
        seen.refuses("two per cent more refractive index", |i, _| wrong[at(i)].truth[0]);
        seen.refuses("light that passes only one surface", |_, truth| truth / 0.96);
    }
}

#[test]
fn ball_gathers_as_much_light_in_squares_of_any_size() {
    for &(z, half) in &[(1.2, 0.05), (1.35, 0.8), (1.5, 0.03), (1.8, 2.0)] {
        let ball = Ball { ior: 1.5, behind_center: z };
        let mut scene = scene("glass_ball.ron");
        scene.trace.plane = Some(level_plane(-z, [-half, half], [-half, half], (1, 1)));
        let seen = measure(&scene, Sensor::Plane, &[square(&ball, half)]);
        seen.agrees();
        let wrong = square(&Ball { behind_center: z + 0.04, ..ball }, half).truth[0];
        let t = optics::transmittance(0.0, 1.5);
        seen.refuses("another distance, or another transmittance", |_, truth| if half > 0.2 { truth / t } else { wrong });
    }
}

#[test]
fn ball_shows_the_paraxial_value_behind_its_focus() {
    let ball = Ball { ior: 1.5, behind_center: 1.8 };
    let mut scene = scene("glass_ball.ron");
    scene.trace.plane = Some(level_plane(-1.8, [-0.02, 0.02], [-0.02, 0.02], (1, 1)));
    let truth = square(&ball, 0.02);
    assert!((truth.truth[0] / ball.on_axis() - 1.0).abs() < 0.06, "{truth:?} {}", ball.on_axis());
    let seen = measure_to(2.0 * noise(), &scene, Sensor::Plane, &[truth]);
    seen.agrees();
    // The formula that a search finds first: f = (n - 1) R / (2n).
    let wrong = 0.9216 / ((1.0 - 1.8 * 6.0) * (1.0 - 1.8 * 6.0));
    seen.refuses("a focus at (n - 1) R / 2n", |_, _| wrong);
}

#[test]
fn light_reflected_inside_of_the_ball_counts() {
    // Far from the axis, light that is reflected inside twice is a good part of it.
    let ball = Ball { ior: 1.5, behind_center: 1.2 };
    let mut scene = scene("glass_ball.ron");
    let ([x0, x1], half) = ([0.6, 0.95], 0.7);
    scene.trace.plane = Some(level_plane(-1.2, [x0, x1], [-half, half], (1, 1)));
    let truth = ball.mean([x0, x1], [-half, half]);
    // In debug builds, too: a fifth of the light is at stake.
    let seen = measure_to(0.015, &scene, Sensor::Plane, &[Probe::white(0, 0, truth)]);
    seen.agrees();
    let straight =
        super::truths::integrate(x0, x1, 1, |x| super::truths::integrate(-half, half, 2, |z| ball.irradiance(libm::hypot(x, z), 1..2)))
            / ((x1 - x0) * 2.0 * half);
    assert!(straight < 0.9 * truth, "{straight} {truth}");
    seen.refuses("no light reflected inside", |_, _| straight);
}
