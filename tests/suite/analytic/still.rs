//! Plane surfaces: T1, T2, T15.

use glam::Vec3;
use nephroid::scene::{Aim, Light, Scene, Shape};

use super::traced::{Probe, Sensor, level_plane, measure, measure_to, probes, scene, set};
use super::truths::optics;

fn lit_from(scene: &mut Scene, azimuth_deg: f32, elevation_deg: f32) {
    scene.lights = vec![Light::Directional { aim: Aim::Sun { azimuth_deg, elevation_deg }, irradiance: Vec3::ONE }];
}

/// Sixteen texels over what the scene's own plane measures.
fn coarse(scene: &mut Scene) {
    scene.trace.plane.as_mut().expect("the scene has a plane").texels = (4, 4);
}

fn everywhere(truth: [f64; 3]) -> Vec<Probe> {
    (0..16).map(|i| Probe { column: i % 4, row: i / 4, truth }).collect()
}

#[test]
fn still_water_lights_its_floor_evenly() {
    for &angle_deg in &[0.0_f32, 30.0, 45.0, 60.0, 75.0] {
        let mut scene = scene("flat_water.ron");
        coarse(&mut scene);
        lit_from(&mut scene, 30.0, 90.0 - angle_deg);
        let angle = f64::from(angle_deg).to_radians();
        let truth = |angle: f64, ior: f64| optics::still_water(angle, ior, 0.0, 1.0);
        // Glass and water differ by a few percent only; with so few texels that takes no time even in debug builds.
        let seen = measure_to(0.004, &scene, Sensor::Plane, &everywhere([truth(angle, 1.333); 3]));
        seen.agrees();
        if angle_deg > 0.0 {
            seen.refuses("a missing cosine", |_, truth| truth / libm::cos(angle));
        }
        if angle_deg == 75.0 {
            seen.refuses("glass in place of water", |_, _| truth(angle, 1.5));
        }
        seen.refuses("a missing transmittance", |_, truth| truth / optics::transmittance(angle, 1.333));
    }
}

#[test]
fn still_water_absorbs_along_the_slanting_way() {
    let mut scene = scene("flat_water.ron");
    coarse(&mut scene);
    lit_from(&mut scene, 30.0, 30.0);
    set(&mut scene, "medium.sigma_a", "0.5,0.2,0");
    set(&mut scene, "medium.sigma_s", "0.1,0.1,0.3");
    let angle = 60.0_f64.to_radians();
    let truth = [0.6, 0.3, 0.3000001].map(|sigma_t| optics::still_water(angle, 1.333, sigma_t, 1.0));
    let seen = measure(&scene, Sensor::Plane, &everywhere(truth));
    seen.agrees();
    let upright = [0.6_f64, 0.3, 0.3].map(|sigma_t| libm::exp(-sigma_t) * optics::still_water(angle, 1.333, 0.0, 1.0));
    seen.refuses("the depth in place of the way", |i, _| upright[i % 3]);
}

#[test]
fn leaning_water_lights_its_floor_evenly() {
    for &elevation_deg in &[90.0_f32, 60.0, 45.0, 35.0] {
        let mut scene = scene("wedge.ron");
        coarse(&mut scene);
        lit_from(&mut scene, 30.0, elevation_deg);
        let light = optics::sunlight(30.0_f64.to_radians(), f64::from(elevation_deg).to_radians());
        let slope = [0.25, f64::from(0.1_f32)];
        let seen = measure(&scene, Sensor::Plane, &everywhere([optics::leaning_water(light, slope, 1.333); 3]));
        seen.agrees();
        let (_, angle, inside) = optics::leaning_refraction(light, slope, 1.333);
        if elevation_deg < 90.0 {
            seen.refuses("a receiver that faces the refracted ray", |_, _| {
                optics::transmittance(angle, 1.333) * libm::cos(angle) / libm::cos(inside)
            });
            seen.refuses("a surface that leans the other way", |_, _| optics::leaning_water(light, slope.map(|s| -s), 1.333));
        }
    }
}

#[test]
fn equal_indices_make_no_pattern() {
    let truth = libm::sin(60.0_f64.to_radians());
    let mut both = scene("matched.ron");
    both.trace.plane.as_mut().expect("the scene has a plane").texels = (8, 8);
    let all: Vec<Probe> = (0..64).map(|i| Probe::white(i % 8, i / 8, truth)).collect();
    // In debug builds, too, or two per cent would not be noticed.
    let seen = measure_to(0.005, &both, Sensor::Plane, &all);
    seen.agrees();
    seen.refuses("a reflection at the surface", |_, truth| truth * 0.98);

    // In air, light that has not met the body does not count: only what would be its shadow is lit.
    let mut body = both;
    body.water = None;
    body.objects[0].shape = Shape::UvSphere(nephroid::geom::shapes::UvSphere { radius_m: 0.5, slices: 128, stacks: 64 });
    // The light that passes the body's middle meets the floor 0.8 m below, shifted by 0.8 m / tan 60° away from the sun.
    let shift = 0.8 / libm::tan(60.0_f64.to_radians());
    let (x, z) = (-shift * libm::cos(30.0_f64.to_radians()), -shift * libm::sin(30.0_f64.to_radians()));
    let plane = level_plane(-1.5, [x - 0.3, x + 0.3], [z - 0.3, z + 0.3], (2, 2));
    body.trace.plane = Some(plane);
    let seen = measure(&body, Sensor::Plane, &probes(&plane, 0.0, |_, _| truth));
    seen.agrees();
    seen.refuses("a missing cosine", |_, _| 1.0);
}
