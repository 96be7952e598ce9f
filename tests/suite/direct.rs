//! The ground truth's layers of light that met neither water nor mirrors nor glass: what lamps send straight to surfaces and into media.

use std::path::Path;

use glam::Vec3;
use nephroid::scene::{self, Light, Scene, spot_falloff};
use nephroid::trace::{Measured, Tracer};

use crate::support::traces::options;

/// A floor seen from straight above, a mirror out of sight (without which there is nothing to trace), and what else is given.
fn floor(size: u32, height_m: f32, more: &str) -> Scene {
    let text = format!(
        "(image: (width: {size}, height: {size}), \
         camera: Orthographic(position: (0, 5, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: {height_m}, near_m: 0.1, far_m: 20), \
         {more})"
    );
    scene::parse(&text, "direct", Path::new(""), &[]).expect("the scene is valid")
}

const FLOOR: &str =
    "(shape: Grid(size_m: (8, 8))), (shape: Grid(size_m: (0.1, 0.1)), transform: (translate: (1.4, 0.01, 0)), material: Mirror())";

fn measure(scene: &Scene, volume: bool, batches: u32) -> Tracer {
    let mut tracer = Tracer::new(scene, &options(true, volume)).expect("the scene can be traced");
    for _ in 0..batches {
        tracer.run_batch();
    }
    tracer
}

fn direct(scene: &Scene) -> Measured {
    measure(scene, false, 8).direct().expect("there are pixels")
}

/// Mean over parts of a pixel of a function of the floor's x and z.
fn over_pixel(size: u32, height_m: f64, column: u32, row: u32, value: impl Fn(f64, f64) -> f64) -> f64 {
    let at = |k: u32, part: u32| ((f64::from(k) + (f64::from(part) + 0.5) / 16.0) / f64::from(size) - 0.5) * height_m;
    (0..256).map(|k| value(at(column, k % 16), at(row, k / 16))).sum::<f64>() / 256.0
}

fn compare(measured: &Measured, height_m: f64, what: &str, value: impl Fn(f64, f64) -> f64) {
    let size = measured.columns;
    let (mut worst, mut sums) = (0.0_f64, [0.0; 2]);
    for (column, row) in (0..size * size).map(|k| (k % size, k / size)) {
        let truth = over_pixel(size, height_m, column, row, &value);
        let (mean, error) = (measured.mean(column, row)[1], measured.standard_error(column, row)[1]);
        assert!(measured.is_valid(column, row) && error <= 0.2 * truth, "({column}, {row}): {mean} ± {error}");
        worst = worst.max((mean - truth).abs() / (error + 2.0e-5 * truth));
        sums = [sums[0] + mean, sums[1] + truth];
    }
    // From eight places of a pixel the error itself is known to a quarter.
    assert!(worst < 14.0, "{what}: off by {worst} standard errors");
    assert!((sums[0] / sums[1] - 1.0).abs() < 2.0e-3, "{what}: {} of the light", sums[0] / sums[1]);
}

#[test]
fn lamps_light_by_inverse_square_and_cosine() {
    let lamp = Vec3::new(0.4, 1.5, -0.3);
    let scene = floor(
        24,
        2.4,
        &format!("lights: [Point(position: ({}, {}, {}), intensity: (3, 5, 7))], objects: [{FLOOR}]", lamp.x, lamp.y, lamp.z),
    );
    let truth = |x: f64, z: f64| {
        let (dx, dz, h) = (x - f64::from(lamp.x), z - f64::from(lamp.z), f64::from(lamp.y));
        let square = dx * dx + dz * dz + h * h;
        5.0 * h / (square * square.sqrt())
    };
    let measured = direct(&scene);
    compare(&measured, 2.4, "a lamp", truth);
    let linear = std::panic::catch_unwind(|| compare(&measured, 2.4, "a lamp", |x, z| truth(x, z) * 1.01));
    assert!(linear.is_err(), "the comparison does not notice a hundredth");
    let [r, g, b] = measured.mean(3, 20);
    assert!((r / g - 0.6).abs() < 1e-6 && (b / g - 1.4).abs() < 1e-6, "({r}, {g}, {b})");
}

#[test]
fn parallel_light_has_its_cosine_and_spots_their_falloff() {
    let sun = floor(
        8,
        1.0,
        &format!("lights: [Directional(aim: Sun(azimuth_deg: 30, elevation_deg: 30), irradiance: (2, 2, 2))], objects: [{FLOOR}]"),
    );
    compare(&direct(&sun), 1.0, "the sun", |_, _| 1.0);
    // Inside of the cone the falloff is the scene's: a smoothstep of the cosine between both angles.
    let spot = floor(
        24,
        1.2,
        &format!(
            "lights: [Spot(position: (0, 2, 0), direction: (0, -1, 0), intensity: (4, 4, 4), inner_deg: 5, outer_deg: 40)], objects: [{FLOOR}]"
        ),
    );
    let Light::Spot { inner_deg, outer_deg, .. } = spot.lights[0] else { panic!("it is a spot") };
    let truth = |x: f64, z: f64| {
        let square = x * x + z * z + 4.0;
        let cos = 2.0 / square.sqrt();
        4.0 * cos / square * f64::from(spot_falloff(cos as f32, inner_deg, outer_deg))
    };
    compare(&direct(&spot), 1.2, "a spot", truth);
}

/// The lamp is 2 m over the floor and the edge of a board 1 m, at x = 0.1: the shadow's edge is at x = 0.2.
#[test]
fn edges_of_shadows_are_exact() {
    let text = "lights: [Point(position: (0, 2, 0), intensity: (1, 1, 1))], objects: [
        (shape: Grid(size_m: (8, 8))),
        (shape: Cuboid(size_m: (0.6, 0.001, 4)), transform: (translate: (0.4, 1.0005, 0))),
        (shape: Grid(size_m: (0.1, 0.1)), transform: (translate: (20, 9, 20)), material: Mirror()),
    ]";
    let mut scene = floor(512, 0.4, text);
    // Seen from below the board.
    scene.set("camera.position", "0,0.9,0").expect("the setting exists");
    scene.image.height = 1;
    scene.set("camera.height_m", &(0.4_f32 / 512.0).to_string()).expect("the setting exists");
    let measured = direct(&scene);
    // Pixels are 0.4 m / 512 wide, from x = −0.2 on; the edge is beyond the last one: look from another place.
    scene.set("camera.position", "0.2,0.9,0").expect("the setting exists");
    scene.set("camera.target", "0.2,0,0").expect("the setting exists");
    let shifted = direct(&scene);
    assert!((0..512).all(|column| measured.mean(column, 0)[0] > 0.0));
    for column in 0..512 {
        let light = shifted.mean(column, 0)[0];
        // The edge is at the middle of the picture, between columns 255 and 256.
        if column < 255 {
            let x = 0.2 + (f64::from(column) + 0.5 - 256.0) * 0.4 / 512.0;
            let truth = 2.0 / ((x * x + 4.0) * (x * x + 4.0).sqrt());
            assert!((light / truth - 1.0).abs() < 1e-3, "column {column}: {light}, expected {truth}");
        } else if column > 256 {
            assert_eq!(light, 0.0, "column {column} is lit");
        }
    }
}

/// V3 of a layer of smoke 2 m thick, lit from straight above by light that met nothing, seen from above at 30° from the vertical.
#[test]
fn smoke_scatters_direct_light_by_the_slab_formula() {
    for (g, expected) in [(0.0, 0.026_278_3), (0.6, 0.004_525_53)] {
        let (sin, cos) = libm::sincos(30.0_f64.to_radians());
        let text = format!(
            "(image: (width: 2, height: 2), \
             camera: Orthographic(position: ({}, {}, 0), target: (0, 0, 0), height_m: 0.1, near_m: 0.1, far_m: 40), \
             lights: [Directional(aim: Along(0, -1, 0), irradiance: (1, 1, 1))], \
             smoke: (min: (-20, -2, -20), max: (20, 0, 20), sigma_a: (0.1, 0.1, 0.1), sigma_s: (0.3, 0.3, 0.3), g: {g}), \
             objects: [(shape: Grid(size_m: (0.1, 0.1)), transform: (translate: (50, 9, 50)), material: Mirror())])",
            5.0 * sin,
            5.0 * cos
        );
        let scene = scene::parse(&text, "slab", Path::new(""), &[]).expect("the scene is valid");
        let seen = measure(&scene, true, 200).direct_volume().expect("it was asked for");
        for (column, row) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (mean, error) = (seen.mean(column, row)[0], seen.standard_error(column, row)[0]);
            assert!(error < 0.01 * expected && (mean - expected).abs() < 4.0 * error, "g {g}: {mean} ± {error}, expected {expected}");
            assert!((mean - 1.04 * expected).abs() > 4.0 * error, "the check is too coarse");
        }
    }
}

/// V4: a spot in smoke, seen at right angles to its axis 1.5 m from it; and half of it in the shadow of a board.
#[test]
fn smoke_scatters_the_light_of_spots() {
    let scene = |board: &str| {
        let text = format!(
            "(image: (width: 1, height: 1), \
             camera: Orthographic(position: (-0.5459553, 0, 0), target: (1, 0, 0), height_m: 0.001, near_m: 0.0001, far_m: 40), \
             lights: [Spot(position: (0, 1.5, 0), direction: (0, -1, 0), intensity: (1, 1, 1), inner_deg: 20, outer_deg: 20)], \
             smoke: (min: (-5, -5, -5), max: (5, 5, 5), sigma_a: (0.1, 0.1, 0.1), sigma_s: (0.3, 0.3, 0.3), g: 0.6), \
             objects: [{board} (shape: Grid(size_m: (0.1, 0.1)), transform: (translate: (0.5, -4, 0)), material: Mirror())])"
        );
        let scene = scene::parse(&text, "cone", Path::new(""), &[]).expect("the scene is valid");
        let seen = measure(&scene, true, 400).direct_volume().expect("it was asked for");
        (seen.mean(0, 0)[0], seen.standard_error(0, 0)[0])
    };
    let expected = 0.002_159_56;
    let (mean, error) = scene("");
    assert!(error < 0.01 * expected && (mean - expected).abs() < 4.0 * error, "{mean} ± {error}, expected {expected}");
    // The half away from the eye: the integral of V4 from 0 to 20°.
    let steps = 4000;
    let phase = |cos: f64| 0.64 / (4.0 * std::f64::consts::PI * (1.36 - 1.2 * cos) * (1.36 - 1.2 * cos).sqrt());
    let half = 20.0_f64.to_radians();
    let at = |k: i32| {
        let angle = half * (f64::from(k) + 0.5) / f64::from(steps);
        let way = 1.5 / libm::cos(angle) + 1.5 * (libm::tan(angle) + libm::tan(half));
        phase(-libm::sin(angle)) * libm::exp(-0.4 * way)
    };
    let far_half = 0.3 / 1.5 * (0..steps).map(at).sum::<f64>() * half / f64::from(steps);
    let (mean, error) = scene("(shape: Cuboid(size_m: (1, 0.001, 1)), transform: (translate: (-0.5, 1, 0))),");
    assert!(error < 0.02 * far_half && (mean - far_half).abs() < 4.0 * error, "{mean} ± {error}, expected {far_half}");
}

/// A lamp in water lights its floor straight through what absorbs; the sun does not, and what the lamp sends through the surface is not direct.
#[test]
fn water_ends_direct_light_and_absorbs_it() {
    let text = "(image: (width: 4, height: 4), \
         camera: Orthographic(position: (0, -0.2, 0), target: (0, -1, 0), up: (0, 0, -1), height_m: 0.01, near_m: 0.01, far_m: 20), \
         lights: [Directional(aim: Along(0, -1, 0), irradiance: (9, 9, 9)), Point(position: (0, -0.1, 0), intensity: (2, 2, 2))], \
         water: (size_m: (8, 8), model: Flat), medium: Custom(sigma_a: (0.5, 0.5, 0.5), sigma_s: (0, 0, 0), g: 0), \
         objects: [(shape: Grid(size_m: (8, 8)), transform: (translate: (0, -1.1, 0)))])";
    let scene = scene::parse(text, "lamp", Path::new(""), &[]).expect("the scene is valid");
    let measured = direct(&scene);
    let expected = 2.0 * libm::exp(-0.5);
    assert!((measured.mean(1, 1)[0] / expected - 1.0).abs() < 1e-4, "{}, expected {expected}", measured.mean(1, 1)[0]);
    let mut dry = scene;
    dry.lights.truncate(1);
    assert_eq!(direct(&dry).mean(1, 1)[0], 0.0, "the sun shines through water without meeting it");
}
