//! `caustic-volumes` against the closed forms of `tests/suite/analytic/truths`, as far as its model reaches: leaning water (T2), energy (T3), the
//! whole curve of a sine wave and of two crossed ones (T4), and matched indices (T15). Flat water (T1) and the focus are in
//! `tests/suite/caustic_volumes.rs`; `docs/analytic.md` lists all.
//!
//! A beam spreads its flux evenly over its cross-section, so where light varies the technique is a staircase whose steps are beams. Its error is
//! bounded here on meshes that are finer and finer, and must shrink with them.

use std::path::Path;

use glam::Vec3;
use nephroid::caustics::caustic_volumes::CausticVolumes;
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::scene::{Aim, Light, Scene};
use rayon::prelude::*;

use crate::analytic::truths::optics;
use crate::analytic::truths::water::{Crossed, Sine};
use crate::support;

/// Largest relative error where light is even.
const EVEN: f64 = 1.0e-4;

/// A scene, with one sample per pixel: irradiance is compared at points.
fn scene(name: &str, size: u32) -> Scene {
    let mut scene = support::scene_of_size(&format!("analytic/{name}"), (size, size));
    scene.techniques.edit::<CausticVolumes>().samples = 1;
    scene
}

/// Red caustic irradiance, rows top down.
fn irradiance(scene: &Scene) -> Vec<f64> {
    let options = RenderOptions { layers: Some(vec!["caustic_irradiance".into()]), ..RenderOptions::default() };
    let rendered = Renderer::new(scene, &options).expect("device").render(scene, None).expect("frame");
    let layer = rendered.layers.get("caustic_irradiance").expect("asked for");
    layer.planes()[0].pixels().iter().map(|&value| f64::from(value)).collect()
}

/// World (x, z) of the middle of a pixel of a picture that shows −1 to 1 along both, seen from above with −z up.
fn place(index: usize, size: u32) -> (f64, f64) {
    let at = |i: usize| (i as f64 + 0.5) * 2.0 / f64::from(size) - 1.0;
    (at(index % size as usize), at(index / size as usize))
}

/// The truth at every pixel.
fn truths(size: u32, truth: impl Fn(f64, f64) -> Option<f64> + Sync) -> Vec<Option<f64>> {
    let places = (0..(size * size) as usize).into_par_iter().map(|index| place(index, size));
    places.map(|(x, z)| truth(x, z)).collect()
}

/// Root of the mean square of relative errors at the places that have a truth, and how many those are.
fn error(values: &[f64], truths: &[Option<f64>]) -> (f64, usize) {
    let (mut sum, mut count) = (0.0, 0);
    for (value, truth) in values.iter().zip(truths) {
        if let Some(truth) = truth {
            sum += (value / truth - 1.0) * (value / truth - 1.0);
            count += 1;
        }
    }
    ((sum / count as f64).sqrt(), count)
}

/// Checks that errors on meshes, each twice as fine as the one before, stay under a bound for the first, and halve within a quarter.
#[track_caller]
fn shrinks(errors: &[f64], first: f64) {
    println!("relative errors: {errors:?}");
    assert!(errors[0] < first, "{errors:?}");
    assert!(errors.windows(2).all(|pair| pair[1] < 0.625 * pair[0]), "{errors:?}");
}

#[test]
fn leaning_water_lights_every_texel_by_t2() {
    for elevation_deg in [90.0_f32, 60.0, 45.0, 35.0] {
        let mut scene = scene("wedge.ron", 128);
        scene.lights = vec![Light::Directional { aim: Aim::Sun { azimuth_deg: 30.0, elevation_deg }, irradiance: Vec3::ONE }];
        let values = irradiance(&scene);
        let light = optics::sunlight(30.0_f64.to_radians(), f64::from(elevation_deg).to_radians());
        let worst = |truth: f64| values.iter().map(|v| (v / truth - 1.0).abs()).fold(0.0, f64::max);
        let error = worst(optics::leaning_water(light, [0.25, 0.1], 1.333));
        println!("{elevation_deg} degrees: worst relative error {error:e}");
        assert!(error < EVEN, "{elevation_deg} degrees: {error:e}");
        // The comparison can fail: on level water the same light does otherwise.
        assert!(worst(optics::leaning_water(light, [0.0, 0.0], 1.333)) > 10.0 * EVEN);
    }
}

#[test]
fn sine_wave_follows_the_whole_curve_away_from_folds() {
    let wave = Sine::SHIPPED;
    let size = 64;
    // The ramp: y = (a − f) − z. Truths are for a level receiver; the ramp takes cos 45° of them.
    let truth = |wave: Sine, x: f64, z: f64| {
        let y = f64::from(-5.049_862_5_f32) - z;
        // A crest is at every whole x. Folds, and the focus, are kept at a distance of two hundredths of a period.
        let from_crest = (x - x.round()).abs();
        let kept = if z < 0.0 { z < -0.2 } else { z > 0.2 && (from_crest - wave.fold(y).unwrap_or(0.0)).abs() > 0.02 };
        kept.then(|| wave.irradiance(x, y) * std::f64::consts::FRAC_1_SQRT_2)
    };
    let here = truths(size, |x, z| truth(wave, x, z));
    let mut errors = Vec::new();
    for columns in [129, 257, 513] {
        let mut scene = scene("sine_water.ron", size);
        scene.techniques.edit::<CausticVolumes>().grid = Some((columns, 2));
        let values = irradiance(&scene);
        let (rms, count) = error(&values, &here);
        assert!(count > 2000, "{count}");
        errors.push(rms);
        if columns == 513 {
            // The comparison can fail.
            let wrong = truths(size, |x, z| truth(wave, x, z).and(truth(Sine { ior: 1.36, ..wave }, x, z)));
            let (wrong, _) = error(&values, &wrong);
            assert!(wrong > 4.0 * rms, "{wrong} against {rms}");
        }
    }
    shrinks(&errors, 0.05);
}

#[test]
fn crossed_waves_gather_light_along_both_axes() {
    let crossed = Crossed::SHIPPED;
    let size = 63;
    let y = f64::from(-1.821_198_4_f32);
    let truths: Vec<f64> = (0..(size * size) as usize).map(|i| place(i, size)).map(|(x, z)| crossed.irradiance(x, z, y)).collect();
    let mut errors = Vec::new();
    let mut crest = Vec::new();
    for grid in [65, 129, 257] {
        let mut scene = scene("crossed_sines.ron", size);
        scene.techniques.edit::<CausticVolumes>().grid = Some((grid, grid));
        let values = irradiance(&scene);
        let pairs = values.iter().zip(&truths);
        errors.push((pairs.map(|(v, t)| (v / t - 1.0) * (v / t - 1.0)).sum::<f64>() / values.len() as f64).sqrt());
        // The middle of the picture is under a crest.
        crest.push((values[values.len() / 2] / crossed.under_crest(0.75 * crossed.wave.focus_depth()) - 1.0).abs());
    }
    println!("under the crest: {crest:?}");
    shrinks(&errors, 0.1);
    assert!(crest[2] < 0.02, "{crest:?}");
}

#[test]
fn crossed_waves_conserve_energy() {
    // Two whole periods along both axes, at the shipped depth before the focus and at one behind it. Pixels sample points, and behind the focus
    // an eighth of the light is in beams that are narrower than those of 512 x 512 pixels: they see 0.97 of it, or 1.01, as sizes go.
    let crossed = Crossed::SHIPPED;
    for (depth, size, bound) in [(0.75, 512, 1.0e-3), (1.5, support::sized(2999, 1999), support::sized(8.0e-3, 5.0e-3))] {
        let mut scene = scene("crossed_sines.ron", size);
        scene.techniques.edit::<CausticVolumes>().grid = Some((257, 257));
        scene.objects[0].transform.translate.y = crossed.level(depth * crossed.wave.focus_depth()) as f32;
        let values = irradiance(&scene);
        let ratio = values.iter().sum::<f64>() / values.len() as f64 / crossed.mean_of_period();
        println!("at {depth} f, landed over entered: {ratio}");
        assert!((ratio - 1.0).abs() < bound, "at {depth} f: {ratio}");
    }
}

/// T3 with a board over one of two periods, before the focus: vertices in its shadow remove their share of the light, and no more. The planes through the
/// troughs are planes of symmetry that no light crosses. The board's sides are between two columns of vertices, and so is the edge of what they interpolate.
#[test]
fn shadowed_vertices_remove_their_share() {
    let crossed = Crossed::SHIPPED;
    let mut scene = scene("crossed_sines.ron", 512);
    scene.techniques.edit::<CausticVolumes>().grid = Some((257, 257));
    let cell = 4.0 / 256.0;
    let board = format!(
        "(shape: Grid(size_m: ({}, 8)), transform: (translate: (0, 2.7, 0)), material: Diffuse(albedo: Solid(0.5, 0.5, 0.5)))",
        1.0 + cell
    );
    let text = format!(
        "Scene(camera: Orthographic(position: (0, 3, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 2), lights: [], objects: [{board}])"
    );
    let board = TECHNIQUES.parse(&text, "board", Path::new("")).unwrap_or_else(|error| panic!("{error}")).objects.remove(0);
    // Above the camera's near plane, where it is not seen.
    scene.objects.push(board);
    let values = irradiance(&scene);
    let ratio = values.iter().sum::<f64>() / values.len() as f64 / crossed.mean_of_period();
    let lit = 1.0 - (1.0 + cell) / 2.0;
    println!("of all light, {ratio} in place of {lit}");
    assert!((ratio / lit - 1.0).abs() < 5.0e-3, "{ratio} of the light in place of {lit}");
    let dark = (0..values.len()).filter(|&k| place(k, 512).0.abs() < 0.5 - 2.0 * cell);
    assert!(dark.clone().count() > 1000 && dark.map(|k| values[k]).all(|value| value == 0.0), "there is light in the shadow");
}

#[test]
fn matched_indices_give_no_pattern_under_waves() {
    let mut scene = scene("matched.ron", 128);
    // The technique has no light through bodies: what stands in its way casts a shadow.
    scene.objects.remove(0);
    let values = irradiance(&scene);
    let worst = values.iter().map(|v| (v / libm::sin(60.0_f64.to_radians()) - 1.0).abs()).fold(0.0, f64::max);
    println!("worst relative error {worst:e}");
    assert!(worst < EVEN, "{worst:e}");
}
