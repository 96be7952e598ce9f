//! Light scattered once: T10, T11.

use glam::Vec3;
use nephroid::scene::{Aim, Camera, Image, Light, Medium, Scene};

use super::traced::{Probe, Sensor, measure, scene, set};
use super::truths::optics;
use super::truths::scatter::{Slab, henyey_greenstein};

/// Coefficients by channel: σ_s and σ_t.
const SIGMA: [[f64; 2]; 3] = [[0.4, 0.5], [0.2, 0.5], [0.05, 0.4]];

/// The shipped scene with a picture of a few pixels, one above the other, and wide beams: light is even, and every ray then meets many. What a
/// beam is spread over is level here, since views and light lie in one upright plane, so that it blurs nothing.
fn slab(rows: u32, g: f32) -> Scene {
    let mut scene = scene("slab.ron");
    scene.image = Image { width: 1, height: rows };
    scene.medium = Medium { g, ..scene.medium };
    set(&mut scene, "trace.beam_width_m", 0.5);
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

fn truth(views: &[View], g: f64) -> Vec<Probe> {
    views.iter().enumerate().map(|(row, view)| Probe { column: 0, row: row as u32, truth: view.radiance(g) }).collect()
}

#[test]
fn diver_sees_lit_water_by_the_slab_formula() {
    let rows = 4;
    let scene = slab(rows, 0.5);
    // Pixels are seen through their middles, from the near plane on.
    let views: Vec<View> = (0..rows)
        .map(|row| View {
            depth: 0.5 + (f64::from(row) + 0.5) / f64::from(rows),
            along: [1.0, 0.0],
            length: 2.0 - 1.0e-4,
            light: [0.0, -1.0],
            irradiance: optics::transmittance(0.0, 1.333),
            passed: 1.0,
        })
        .collect();
    let seen = measure(&scene, Sensor::Volume, &truth(&views, 0.5));
    seen.agrees();
    seen.refuses("no absorption on the way to the eye", |_, truth| truth * 1.5);
    seen.refuses("a way in that is not absorbed", |i, truth| truth * libm::exp(SIGMA[i % 3][1] * views[i / 3].depth));
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
        let view = View {
            depth: 0.0,
            along: [-libm::sin(eye_in), -libm::cos(eye_in)],
            length: 2.0 / libm::cos(eye_in),
            // The sun is towards +x.
            light: [-libm::sin(sun_in), -libm::cos(sun_in)],
            irradiance: optics::transmittance(sun, n) * libm::cos(sun) / libm::cos(sun_in),
            // Radiance is spread over n² less solid angle in water.
            passed: optics::transmittance(eye, n) / (n * n),
        };
        let seen = measure(&scene, Sensor::Volume, &truth(&[view], 0.5));
        seen.agrees();
        seen.refuses("radiance that is not spread", |_, truth| truth * n * n);
    }
}

#[test]
fn phase_function_shows_in_views_of_all_angles() {
    // Without refraction: a fan of views from a diver, up to the surface and down to the floor, with the sun 45° high in the plane of the fan.
    let rows = 6;
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
        let views: Vec<View> = (0..rows)
            .map(|row| {
                let up = libm::tan(75.0_f64.to_radians()) * (1.0 - 2.0 * (f64::from(row) + 0.5) / f64::from(rows));
                let length = libm::hypot(1.0, up);
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
            })
            .collect();
        let seen = measure(&scene, Sensor::Volume, &truth(&views, f64::from(g)));
        seen.agrees();
        if g != 0.0 {
            let mirrored = truth(&views, -f64::from(g));
            seen.refuses("the sign of g", |i, _| mirrored[i / 3].truth[i % 3]);
        }
        let other = truth(&views, f64::from(g) + 0.05);
        seen.refuses("another g", |i, _| other[i / 3].truth[i % 3]);
    }
}
