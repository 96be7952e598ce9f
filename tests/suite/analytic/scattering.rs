//! Light scattered once: T10, T11.

use glam::Vec3;
use nephroid::scene::{Aim, Camera, Image, Light, Medium, Scene};

use super::traced::{Probe, Sensor, measure, measure_to, scene, set};
use super::truths::optics;
use super::truths::scatter::{Slab, henyey_greenstein};

/// Coefficients by channel: σ_s and σ_t.
const SIGMA: [[f64; 2]; 3] = [[0.4, 0.5], [0.2, 0.5], [0.05, 0.4]];

/// The shipped scene with a picture of a few pixels, one above the other.
fn slab(rows: u32, g: f32) -> Scene {
    let mut scene = scene("slab.ron");
    scene.image = Image { width: 1, height: rows };
    scene.medium = Medium { g, ..scene.medium };
    scene
}

/// A piece of view in the water: from a depth, along a unit vector (x, y), for a length; and the light there.
struct View {
    depth: f64,
    along: [f64; 2],
    length: f64,
    /// Unit vector of the light in the water.
    light: [f64; 2],
    /// Irradiance across that light.
    irradiance: f64,
    /// Radiance at the eye over radiance at the start of the piece.
    passed: f64,
}

impl View {
    fn radiance(&self, g: f64) -> [f64; 3] {
        let cosine = -(self.light[0] * self.along[0] + self.light[1] * self.along[1]);
        SIGMA.map(|[sigma_s, sigma_t]| {
            let slab = Slab {
                sigma_s,
                sigma_t,
                irradiance: self.irradiance,
                phase: henyey_greenstein(cosine, g),
                light_path: self.depth / -self.light[1],
                light_path_per_m: -self.along[1] / -self.light[1],
                length: self.length,
            };
            self.passed * slab.radiance()
        })
    }
}

/// Parts of a pixel's side over which a truth is averaged: views go through all of a pixel.
const PARTS: u32 = 16;

/// Probes of some rows, from the view at a place of the picture: row and place across, both with parts of pixels.
fn truth(rows: &[u32], g: f64, view: impl Fn(f64, f64) -> View) -> Vec<Probe> {
    let part = |k: u32| (f64::from(k) + 0.5) / f64::from(PARTS);
    let probe = |&row: &u32| {
        let mut truth = [0.0; 3];
        for (down, right) in (0..PARTS * PARTS).map(|k| (part(k / PARTS), part(k % PARTS))) {
            let radiance = view(f64::from(row) + down, right).radiance(g);
            truth = std::array::from_fn(|c| truth[c] + radiance[c] / f64::from(PARTS * PARTS));
        }
        Probe { column: 0, row, truth }
    };
    rows.iter().map(probe).collect()
}

#[test]
fn diver_sees_lit_water_by_the_slab_formula() {
    let rows = 4;
    let scene = slab(rows, 0.5);
    let depth = |row: f64| 0.5 + row / f64::from(rows);
    // From the near plane on.
    let view = |row: f64, _: f64| View {
        depth: depth(row),
        along: [1.0, 0.0],
        length: 2.0 - 1.0e-4,
        light: [0.0, -1.0],
        irradiance: optics::transmittance(0.0, 1.333),
        passed: 1.0,
    };
    let seen = measure(&scene, Sensor::Volume, &truth(&[0, 1, 2, 3], 0.5, view));
    seen.agrees();
    seen.refuses("no absorption on the way to the eye", |_, truth| truth * 1.5);
    seen.refuses("a way in that is not absorbed", |i, truth| truth * libm::exp(SIGMA[i % 3][1] * depth((i / 3) as f64 + 0.5)));
    seen.refuses("light that scatters evenly", |_, truth| truth / henyey_greenstein(0.0, 0.5) * henyey_greenstein(0.0, 0.0));
}

#[test]
fn view_from_above_is_refracted_and_loses_its_share() {
    // The sun and the eye 40° and 30° off the vertical, on one side and on the other, through a surface that bends both. (Not both along
    // one line: a beam of light along the view is a point to it.)
    let n = 1.333;
    for &(sun_deg, eye_deg) in &[(0.0_f64, 20.0_f64), (40.0, 30.0), (40.0, -30.0)] {
        let mut scene = slab(1, 0.5);
        scene.objects.remove(0);
        scene.lights =
            vec![Light::Directional { aim: Aim::Sun { azimuth_deg: 0.0, elevation_deg: 90.0 - sun_deg as f32 }, irradiance: Vec3::ONE }];
        let (sun, eye) = (sun_deg.to_radians(), eye_deg.to_radians());
        let (sin, cos) = libm::sincos(eye);
        scene.camera = Camera::Orthographic {
            position: Vec3::new(3.0 * sin as f32, 3.0 * cos as f32, 0.0),
            target: Vec3::ZERO,
            up: Vec3::Z,
            height_m: 0.1,
            near_m: 0.1,
            far_m: 20.0,
        };
        let inside = |angle: f64| optics::refraction_angle(angle.abs(), n).expect("from air") * angle.signum();
        let (sun_in, eye_in) = (inside(sun), inside(eye));
        let view = |_: f64, _: f64| View {
            depth: 0.0,
            along: [-libm::sin(eye_in), -libm::cos(eye_in)],
            length: 2.0 / libm::cos(eye_in),
            // The sun is towards +x.
            light: [-libm::sin(sun_in), -libm::cos(sun_in)],
            irradiance: optics::transmittance(sun, n) * libm::cos(sun) / libm::cos(sun_in),
            // Radiance is spread over n² less solid angle in water.
            passed: optics::transmittance(eye, n) / (n * n),
        };
        let seen = measure(&scene, Sensor::Volume, &truth(&[0], 0.5, view));
        seen.agrees();
        seen.refuses("radiance that is not spread", |_, truth| truth * n * n);
    }
}

#[test]
fn phase_function_shows_in_views_of_all_angles() {
    // Without refraction: a fan of views from a diver, up to the surface and down to the floor, with the sun 45° high in the plane of the fan.
    // Six of many rows, the middles of six wide ones.
    let rows = 18;
    let probed = [1, 4, 7, 10, 13, 16];
    for &g in &[-0.5_f32, 0.85, 0.5] {
        let mut scene = slab(rows, g);
        scene.objects.remove(0);
        set(&mut scene, "water.ior", 1.0);
        scene.lights = vec![Light::Directional { aim: Aim::Sun { azimuth_deg: 0.0, elevation_deg: 45.0 }, irradiance: Vec3::ONE }];
        scene.camera = Camera::Perspective {
            position: Vec3::new(0.0, -1.0, 0.0),
            target: Vec3::new(1.0, -1.0, 0.0),
            up: Vec3::Y,
            fov_deg: 150.0,
            near_m: 1.0e-4,
            far_m: 20.0,
        };
        let light = [-libm::cos(45.0_f64.to_radians()), -libm::sin(45.0_f64.to_radians())];
        let edge = libm::tan(75.0_f64.to_radians());
        let view = |row: f64, right: f64| {
            let (up, aside) = (edge * (1.0 - 2.0 * row / f64::from(rows)), edge * (2.0 * right - 1.0) / f64::from(rows));
            let length = libm::sqrt(1.0 + up * up + aside * aside);
            // From the near plane to one metre above or below the eye.
            let start = 1.0e-4 * up;
            View {
                depth: 1.0 - start,
                along: [1.0 / length, up / length],
                length: (1.0 - start.abs()) * length / up.abs(),
                light,
                irradiance: 1.0,
                passed: 1.0,
            }
        };
        let truths = |g: f64| truth(&probed, g, view);
        let seen = measure(&scene, Sensor::Volume, &truths(f64::from(g)));
        seen.agrees();
        if g != 0.0 {
            let mirrored = truths(-f64::from(g));
            seen.refuses("the sign of g", |i, _| mirrored[i / 3].truth[i % 3]);
        }
        let other = truths(f64::from(g) + 0.05);
        seen.refuses("another g", |i, _| other[i / 3].truth[i % 3]);
    }
}

/// V4: a lamp that sends a cone of light into water, seen at right angles to its axis. Flat water of index 1 bends nothing, so that the light is that of
/// a point; but it has met the water, so that it is the volume's. With the distance h from the lamp, φ the angle at the lamp and its light I:
/// `L = σ_s I/h ∫ p(−sin φ) exp(−σ_t h (1/cos φ + tan φ − tan φ_a)) dφ`.
#[test]
fn cones_of_light_scatter_what_their_integral_says() {
    for (g, expected) in [(0.0, 0.004_877_60), (0.6, 0.002_159_56), (0.85, 0.000_670_229)] {
        let mut scene = slab(1, g);
        scene.objects.clear();
        set(&mut scene, "water.ior", 1.0);
        scene.medium = Medium { sigma_a: Vec3::splat(0.1), sigma_s: Vec3::splat(0.3), g };
        // The lamp is a hair above the water.
        scene.lights = vec![Light::Spot {
            position: Vec3::new(0.0, 1.0e-5, 0.0),
            direction: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            inner_deg: 20.0,
            outer_deg: 20.0,
        }];
        // The eye is where the view enters the cone, so that nothing is lost before.
        let half = 1.5 * libm::tan(20.0_f64.to_radians()) as f32;
        scene.camera = Camera::Orthographic {
            position: Vec3::new(-half - 1.0e-4, -1.5, 0.0),
            target: Vec3::new(1.0, -1.5, 0.0),
            up: Vec3::Y,
            height_m: 2.0e-2,
            near_m: 1.0e-4,
            far_m: 20.0,
        };
        let seen = measure_to(0.015, &scene, Sensor::Volume, &[Probe::white(0, 0, expected)]);
        seen.agrees();
        seen.refuses("a tenth", |_, truth| truth * 1.1);
    }
}
