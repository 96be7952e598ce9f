//! The ground truth keeps its promises: the same bits on any number of threads and at any SIMD level, before and after an interruption; no
//! light made or lost; pixels that measure what the plane measures.

use std::path::Path;

use nephroid::scene::{self, MeasuringPlane, Medium, Scene};
use nephroid::trace::{Points, TraceError, TraceOptions, Tracer};

use glam::Vec3;

use crate::support::traces::{everything, options, run_on};
use crate::support::{scene as load, with_coarse_parts};

fn small(name: &str, width: u32, height: u32) -> Scene {
    crate::support::scene_of_size(name, (width, height))
}

#[test]
fn a_run_goes_on_to_the_same_bits() {
    let scene = everything();
    for volume in [false, true] {
        let whole = run_on(2, &scene, &options(true, volume), 2);
        let part = run_on(2, &scene, &options(true, volume), 1);
        let mut tracer = Tracer::new(&scene, &options(true, volume)).expect("the scene can be traced");
        tracer.restore(&part).expect("the state is good");
        tracer.run(tracer.batch_photons());
        assert!(tracer.state() == whole, "going on gives other bits, volume {volume}");
    }
}

/// A batch that is given up, whenever that is, has not been.
#[test]
fn a_batch_that_is_given_up_leaves_no_trace() {
    let scene = everything();
    let whole = run_on(2, &scene, &options(true, true), 2);
    let mut tracer = Tracer::new(&scene, &options(true, true)).expect("the scene can be traced");
    tracer.run_batch();
    let before = tracer.state();
    let mut given_up = 0;
    for patience in 0..100 {
        let asked = std::sync::atomic::AtomicU32::new(0);
        if tracer.run_batch_until(&|| asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= patience) {
            break;
        }
        given_up += 1;
        assert!(tracer.state() == before, "given up after {patience} questions, the batch has left something");
    }
    // Photons of each of three colours, and light straight from the lights.
    assert!((4..100).contains(&given_up), "the batch was given up {given_up} times");
    assert!(tracer.state() == whole, "the batch after those that were given up is another one");
}

/// A pixel is the mean of its quarters, from above the water and to a diver: nothing is lost or counted twice between pixels.
#[test]
fn light_in_media_is_the_same_in_smaller_pixels() {
    for diver in [false, true] {
        let measure = |size: u32| {
            let mut scene = small("analytic/sine_water.ron", size, size);
            scene.medium = Medium { sigma_a: Vec3::splat(0.1), sigma_s: Vec3::splat(0.3), g: 0.3 };
            scene.set("camera.height_m", "0.2").expect("the setting exists");
            scene.water.as_mut().expect("there is water").size_m = glam::Vec2::splat(0.6);
            // Not along the light: views that go the way of the light meet it at its foci.
            let (from, to) = if diver { ("-0.4,-0.2,0.45", "0.1,-0.35,-0.1") } else { ("0.9,3,0.5", "0,0,0") };
            scene.set("camera.position", from).expect("the setting exists");
            scene.set("camera.target", to).expect("the setting exists");
            let mut tracer = Tracer::new(&scene, &options(false, true)).expect("the scene can be traced");
            for _ in 0..16 {
                tracer.run_batch();
            }
            tracer.volume().expect("it was asked for")
        };
        let (large, small) = (measure(4), measure(8));
        let worst = |factor: f64| {
            let z = |k: u32| {
                let (column, row) = (k % 4, k / 4);
                let quarters = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (2 * column + x, 2 * row + y));
                let mean = quarters.iter().map(|&(x, y)| small.mean(x, y)[1]).sum::<f64>() / 4.0;
                let error = quarters
                    .iter()
                    .map(|&(x, y)| small.standard_error(x, y)[1] / 4.0)
                    .fold(large.standard_error(column, row)[1], libm::hypot);
                (large.mean(column, row)[1] - factor * mean).abs() / (error + 1.0e-3 * mean)
            };
            (0..16).map(z).fold(0.0, f64::max)
        };
        assert!(large.mean.iter().filter(|mean| mean[1] > 0.0).count() > 8, "there is hardly any light");
        assert!(worst(1.0) < 4.5, "diver {diver}: smaller pixels are off by {} standard errors", worst(1.0));
        assert!(worst(1.05) > 4.5, "diver {diver}: the check cannot tell a twentieth");
    }
}

#[test]
fn states_of_other_runs_and_damaged_ones_are_refused() {
    let scene = small("analytic/sine_water.ron", 16, 9);
    let state = run_on(2, &scene, &options(true, false), 1);
    let refusal = |scene: &Scene, options: &TraceOptions, state: &[u8]| {
        let mut tracer = Tracer::new(scene, options).expect("the scene can be traced");
        let before = tracer.state();
        let error = tracer.restore(state).expect_err("the state was accepted");
        assert!(tracer.state() == before, "a refused state changed the run");
        error
    };
    let other_seed = TraceOptions { seed: 8, ..options(true, false) };
    assert!(matches!(refusal(&scene, &other_seed, &state), TraceError::OtherState { .. }));
    let mut other_scene = scene.clone();
    other_scene.set("water.ior", "1.34").expect("the setting exists");
    assert!(matches!(refusal(&other_scene, &options(true, false), &state), TraceError::OtherState { .. }));
    for damage in [state[..40].to_vec(), state[..state.len() - 8].to_vec(), {
        let mut flipped = state.clone();
        let last = flipped.len() - 5;
        flipped[last] ^= 4;
        flipped
    }] {
        assert!(matches!(refusal(&scene, &options(true, false), &damage), TraceError::BadState(_)));
    }
    assert!(matches!(refusal(&scene, &options(true, false), b"nonsense"), TraceError::BadState(_)));
}

#[test]
fn every_watt_has_one_end() {
    for scene in [everything(), with_coarse_parts(small("pool.ron", 16, 9)), small("glass.ron", 16, 9)] {
        let mut tracer = Tracer::new(&scene, &options(false, false)).expect("the scene can be traced");
        tracer.run(200_000);
        let audit = tracer.audit();
        assert!(audit.imbalance().abs() < 1e-9, "{}: imbalance {:e}", scene.title, audit.imbalance());
        // What photons carry is what the areas of the lights' cells say, but for the rounding of 32-bit fluxes.
        let (sent, expected) = (audit.emitted / tracer.batches() as f64, tracer.emitted_w());
        assert!((sent / expected - 1.0).abs() < 1e-5, "{}: {sent} W of {expected} W", scene.title);
        assert!(audit.landed > 0.0 && audit.left > 0.0);
        let odd = audit.unexpected_sides as f64 / audit.events as f64;
        assert!(odd < 1e-4, "{}: {odd} of the surfaces were met from the wrong side", scene.title);
    }
}

/// Flat water seen from straight above: all pixels and all texels of a plane in the floor have the value of truth T1.
#[test]
fn pixels_and_plane_measure_the_same_light() {
    let mut scene = small("analytic/flat_water.ron", 16, 16);
    // Facing up: z x = y.
    scene.trace.plane = Some(MeasuringPlane { corner: Vec3::new(-1.0, -1.0, -1.0), u: Vec3::Z * 2.0, v: Vec3::X * 2.0, texels: (16, 16) });
    let mut tracer = Tracer::new(&scene, &options(true, false)).expect("the scene can be traced");
    tracer.run(4_000_000);
    let expected = 0.847_461;
    for measured in [tracer.plane().expect("there is a plane"), tracer.pixels().expect("there are pixels")] {
        let mut sum = 0.0;
        for row in 0..16 {
            for column in 0..16 {
                assert!(measured.is_valid(column, row));
                let (mean, error) = (measured.mean(column, row)[1], measured.standard_error(column, row)[1]);
                assert!((mean - expected).abs() < 4.5 * error, "({column}, {row}): {mean} ± {error}");
                assert!(error < 0.03 * expected);
                sum += mean / 256.0;
            }
        }
        assert!((sum / expected - 1.0).abs() < 2e-3, "the mean is {sum}, expected {expected}");
        assert!((sum / (expected * 1.01) - 1.0).abs() > 2e-3, "the check cannot tell one percent");
    }
}

/// Points given from outside measure the same as the camera's own, away from the border.
#[test]
fn given_points_measure_like_the_camera() {
    let scene = small("analytic/flat_water.ron", 16, 16);
    let own = Tracer::new(&scene, &options(true, false)).expect("the scene can be traced");
    let seen = own.pixel_points().expect("there are pixels");
    let points = Points {
        columns: 16,
        rows: 16,
        positions: seen.iter().map(|p| p.map(|p| p.0)).collect(),
        normals: seen.iter().map(|p| p.map_or(Vec3::Y, |p| p.1)).collect(),
    };
    let mut given = Tracer::new(&scene, &TraceOptions { points: Some(points), ..options(false, false) }).expect("the scene can be traced");
    given.run(2_000_000);
    let measured = given.pixels().expect("there are pixels");
    let mut sum = 0.0;
    for row in 0..16 {
        for column in 0..16 {
            let inner = (1..15).contains(&column) && (1..15).contains(&row);
            assert_eq!(measured.is_valid(column, row), inner, "({column}, {row})");
            sum += if inner { measured.mean(column, row)[0] / 196.0 } else { 0.0 };
        }
    }
    assert!((sum / 0.847_461 - 1.0).abs() < 3e-3, "{sum}");
}

/// A mesh of few triangles is told from the exact surface, one of many is not.
#[test]
fn a_fine_mesh_is_the_exact_surface() {
    let plane = MeasuringPlane { corner: Vec3::new(-0.4, -2.0, -0.5), u: Vec3::Z, v: Vec3::X * 0.8, texels: (1, 16) };
    let measure = |grid: Option<(u32, u32)>| {
        let mut scene = load("analytic/sine_water.ron");
        scene.trace.plane = Some(plane);
        scene.trace.grid = grid;
        let mut tracer = Tracer::new(&scene, &options(false, false)).expect("the scene can be traced");
        tracer.run(3_000_000);
        tracer.plane().expect("there is a plane")
    };
    let exact = measure(None);
    let worst = |other: &nephroid::trace::Measured| {
        let z = |row: u32| {
            let (a, b) = (exact.mean(0, row)[0], other.mean(0, row)[0]);
            let (ea, eb) = (exact.standard_error(0, row)[0], other.standard_error(0, row)[0]);
            (a - b).abs() / (ea * ea + eb * eb).sqrt()
        };
        (0..16).map(z).fold(0.0, f64::max)
    };
    let (fine, coarse) = (worst(&measure(Some((2049, 2)))), worst(&measure(Some((17, 2)))));
    assert!(fine < 4.0, "2049 vertices differ by {fine} standard errors");
    assert!(coarse > 6.0, "17 vertices differ by {coarse} standard errors only");
}

/// Light from above goes down through smoke, is sent back up by a mirror, and is seen from the side. At height y it carries
/// `E e^(−τ(column)) e^(−τ(0..y))`, and the eye gets `∫ σ_s ρ p(90°) · that · e^(−τ(to the eye)) ds`.
#[test]
fn smoke_of_any_density_scatters_what_quadrature_says() {
    for density in ["Uniform", "Noise(scale_m: 0.6, octaves: 2, threshold: -0.6, cells: (12, 12, 12), seed: 3)"] {
        let text = format!(
            "(image: (width: 4, height: 4), \
             camera: Orthographic(position: (0, 0.5, 3), target: (0, 0.5, 0), height_m: 0.6, near_m: 0.1, far_m: 9), \
             lights: [Directional(aim: Along(0, -1, 0), irradiance: (1, 1, 1))], \
             smoke: (min: (-0.5, 0, -0.5), max: (0.5, 1, 0.5), sigma_a: (0.3, 0.3, 0.3), sigma_s: (0.8, 0.8, 0.8), g: 0.3, density: {density}), \
             objects: [(shape: Grid(size_m: (1.2, 1.2)), transform: (translate: (0, -0.01, 0)), material: Mirror(reflectance: (1, 1, 1)))])"
        );
        let scene = scene::parse(&text, "smoke", Path::new(""), &[]).expect("the scene is valid");
        let smoke = scene.smoke.expect("there is smoke");
        let grid = smoke.density_grid();
        let density = |p: [f64; 3]| {
            let corners = grid.corners.map(|c| c as usize);
            let mut sum = 0.0;
            let cell: [(usize, f64); 3] = std::array::from_fn(|k| {
                let at = ((p[k] - f64::from(smoke.min[k])) * (corners[k] - 1) as f64).clamp(0.0, (corners[k] - 1) as f64);
                let cell = (at as usize).min(corners[k] - 2);
                (cell, at - cell as f64)
            });
            for corner in 0..8_usize {
                let pick = |k: usize| {
                    let up = corner >> k & 1;
                    (cell[k].0 + up, if up == 1 { cell[k].1 } else { 1.0 - cell[k].1 })
                };
                let ((x, wx), (y, wy), (z, wz)) = (pick(0), pick(1), pick(2));
                sum += f64::from(grid.values[(z * corners[1] + y) * corners[0] + x]) * wx * wy * wz;
            }
            sum
        };
        const STEPS: usize = 96;
        let middle = |k: usize| (k as f64 + 0.5) / STEPS as f64;
        let phase = (1.0 - 0.3_f64 * 0.3) / (4.0 * std::f64::consts::PI * (1.0 + 0.3 * 0.3_f64) * (1.0 + 0.3 * 0.3_f64).sqrt());
        let radiance = |x: f64, y: f64| {
            let (mut to_eye, mut sum) = (0.0, 0.0);
            for k in 0..STEPS {
                let z = 0.5 - middle(k);
                let here = density([x, y, z]);
                let column: f64 = (0..STEPS).map(|j| density([x, middle(j), z]) / STEPS as f64).sum();
                let below: f64 = (0..STEPS).map(|j| density([x, y * middle(j), z]) * y / STEPS as f64).sum();
                to_eye += 0.5 * here / STEPS as f64;
                sum += 0.8 * here * phase * libm::exp(-1.1 * (column + below + to_eye)) / STEPS as f64;
                to_eye += 0.5 * here / STEPS as f64;
            }
            sum
        };
        let mut tracer = Tracer::new(&scene, &options(false, true)).expect("the scene can be traced");
        tracer.run(3_000_000);
        let seen = tracer.volume().expect("it was asked for");
        let mut pixels = Vec::new();
        for row in 0..4 {
            for column in 0..4 {
                // Views go through all of a pixel.
                let part = |k: u32| (f64::from(k) + 0.5) / 4.0 - 0.5;
                let at = |k: u32| {
                    let (dx, dy) = (0.15 * part(k % 4), 0.15 * part(k / 4));
                    radiance(-0.225 + 0.15 * f64::from(column) + dx, 0.725 - 0.15 * f64::from(row) + dy)
                };
                let truth = (0..16).map(at).sum::<f64>() / 16.0;
                let (mean, error) = (seen.mean(column, row)[0], seen.standard_error(column, row)[0]);
                assert!(error < 0.02 * mean, "({column}, {row}): {mean} ± {error}");
                pixels.push((mean, error, truth));
            }
        }
        let off = |&(mean, error, truth): &(f64, f64, f64), factor: f64| (mean - factor * truth).abs() / (error + 2.0e-3 * mean);
        let worst = |factor: f64| pixels.iter().map(|pixel| off(pixel, factor)).fold(0.0, f64::max);
        assert!(worst(1.0) < 4.0, "off by {} errors", worst(1.0));
        assert!(worst(1.1) > 4.0, "the check cannot tell a tenth");
    }
}

#[test]
fn scenes_without_caustics_are_told() {
    let dry = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), lights: [Point(position: (0, 2, 0), intensity: (1, 1, 1))], \
               objects: [(shape: Grid())])";
    let dark = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), water: ())";
    for text in [dry, dark] {
        let scene = scene::parse(text, "dull", Path::new(""), &[]).expect("the scene is valid");
        assert!(matches!(Tracer::new(&scene, &options(true, false)), Err(TraceError::NothingSpecular)), "{text}");
    }
}
