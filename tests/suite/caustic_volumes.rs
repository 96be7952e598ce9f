//! `caustic-volumes` against analytic truth: flat water (T1), energy (T3), the focus of a sine wave (T4), matched indices (T15), and the
//! factor between the two radiometries. Numbers T1 and so on are those of `docs/analytic.md`.

use std::path::Path;

use glam::Vec3;
use nephroid::caustics::caustic_volumes::{CausticVolumes, Faces};
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::scene::{Aim, Camera, Light, Medium, Radiometry, Scene};

use crate::support;

const ANGLES_DEG: [f32; 5] = [0.0, 30.0, 45.0, 60.0, 75.0];
/// Largest relative error of an interior floor texel.
const T1_BOUND: f64 = 1.0e-4;

/// A scene, with one sample per pixel: irradiance is compared at points.
fn scene(name: &str) -> Scene {
    let mut scene = support::scene(&format!("analytic/{name}"));
    scene.techniques.edit::<CausticVolumes>().samples = 1;
    scene
}

/// Red caustic irradiance, rows top down.
fn irradiance(scene: &Scene) -> (u32, Vec<f32>) {
    let options = RenderOptions { layers: Some(vec!["caustic_irradiance".into()]), ..RenderOptions::default() };
    let rendered = Renderer::new(scene, &options).expect("device").render(scene, None).expect("frame");
    let layer = rendered.layers.get("caustic_irradiance").expect("asked for");
    (layer.width(), layer.planes()[0].pixels().to_vec())
}

fn flat_water(angle_deg: f32, radiometry: Radiometry, medium: Medium) -> Scene {
    let mut scene = scene("flat_water.ron");
    scene.lights = vec![Light::Directional { aim: Aim::Sun { azimuth_deg: 30.0, elevation_deg: 90.0 - angle_deg }, irradiance: Vec3::ONE }];
    scene.medium = medium;
    scene.techniques.edit::<CausticVolumes>().radiometry = radiometry;
    scene
}

/// Snell and Fresnel in f64: cosine of the refracted angle, and transmittance.
fn flat_truth(angle_deg: f32) -> (f64, f64, f64) {
    let (sin_i, cos_i) = (libm::sin(f64::from(angle_deg).to_radians()), libm::cos(f64::from(angle_deg).to_radians()));
    let n = 1.333;
    let cos_t = (1.0 - (sin_i / n) * (sin_i / n)).sqrt();
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    (cos_i, cos_t, 1.0 - 0.5 * (s * s + p * p))
}

/// Greatest relative deviation from a value.
fn worst(values: &[f32], truth: f64) -> f64 {
    values.iter().map(|&v| (f64::from(v) / truth - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn flat_water_lights_every_texel_by_t1() {
    for angle in ANGLES_DEG {
        let (_, values) = irradiance(&flat_water(angle, Radiometry::Physical, Medium::VACUUM));
        let (cos_i, _, transmittance) = flat_truth(angle);
        let error = worst(&values, cos_i * transmittance);
        assert!(error < T1_BOUND, "{angle} degrees: worst relative error {error:e}");
        // The comparison can fail: a half per cent is seen.
        assert!(worst(&values, cos_i * transmittance * 1.005) > T1_BOUND);
    }
}

#[test]
fn flat_water_absorbs_by_beer_and_lambert() {
    let medium = Medium { sigma_a: Vec3::new(0.3, 0.1, 0.0), sigma_s: Vec3::new(0.1, 0.0, 0.0), g: 0.0 };
    for angle in ANGLES_DEG {
        let mut scene = flat_water(angle, Radiometry::Physical, medium);
        scene.techniques.edit::<CausticVolumes>().negligible_light = 0.0;
        let (_, values) = irradiance(&scene);
        let (cos_i, cos_t, transmittance) = flat_truth(angle);
        let truth = cos_i * transmittance * libm::exp(-0.4 / cos_t);
        assert!(worst(&values, truth) < T1_BOUND, "{angle} degrees: {:e}", worst(&values, truth));
    }
}

#[test]
fn paper_radiometry_differs_by_one_over_the_cosine() {
    for angle in ANGLES_DEG {
        let (_, paper) = irradiance(&flat_water(angle, Radiometry::Paper, Medium::VACUUM));
        let (_, physical) = irradiance(&flat_water(angle, Radiometry::Physical, Medium::VACUUM));
        let (cos_i, cos_t, _) = flat_truth(angle);
        // Checklist E1's gap cos θt / cos θi, times the N·L = cos θt that this paper leaves out.
        let predicted = (cos_t / cos_i) / cos_t;
        for (a, b) in paper.iter().zip(&physical) {
            assert!((f64::from(a / b) / predicted - 1.0).abs() < 2.0 * T1_BOUND, "{angle} degrees: {} against {predicted}", a / b);
        }
    }
}

#[test]
fn both_faces_of_the_volumes_give_the_same_light() {
    use Faces;
    let mut scene = flat_water(45.0, Radiometry::Physical, Medium::VACUUM);
    scene.techniques.edit::<CausticVolumes>().faces = Faces::Front;
    let (_, front) = irradiance(&scene);
    scene.techniques.edit::<CausticVolumes>().faces = Faces::Back;
    let (_, back) = irradiance(&scene);
    assert_eq!(front, back);
}

#[test]
fn wavy_water_conserves_energy() {
    // A whole period of a wave over a floor that the picture sees all of: what enters through a period lands on a period.
    let mut scene = scene("sine_water.ron");
    scene.objects = self::scene("flat_water.ron").objects;
    scene.image.width = 1024;
    scene.image.height = 1024;
    let (width, values) = irradiance(&scene);
    let landed: f64 = values.iter().map(|&v| f64::from(v)).sum::<f64>() / f64::from(width * width);
    // Flux through one period per area: the mean of T over the wave, which differs from T(0) by less than the wave's slope to the fourth.
    let mean = landed / flat_truth(0.0).2;
    println!("landed over entered: {mean}");
    assert!((mean - 1.0).abs() < 1.0e-4, "{mean}");
}

/// Where `1/E` on the crest's axis, a straight line in depth before the focus, reaches zero; metres beyond the predicted focus.
fn focus_error_m(width: u32, values: &[f32]) -> f64 {
    // The ramp's depth below the crest is f + z, with z = (row + 0.5)·2/width − 1. Least squares of 1/E over z in −0.9..−0.2.
    let (mut n, mut sz, mut sy, mut szz, mut szy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let middle = width as usize / 2;
    for row in 0..width as usize {
        let z = (row as f64 + 0.5) * 2.0 / f64::from(width) - 1.0;
        if !(-0.9..-0.2).contains(&z) {
            continue;
        }
        let y = 1.0 / f64::from(values[row * width as usize + middle]);
        n += 1.0;
        sz += z;
        sy += y;
        szz += z * z;
        szy += z * y;
    }
    let slope = (n * szy - sz * sy) / (n * szz - sz * sz);
    let offset = (sy - slope * sz) / n;
    -offset / slope
}

#[test]
fn sine_wave_focuses_at_the_predicted_depth() {
    let mut scene = scene("sine_water.ron");
    // An odd width puts a column of texel centres exactly below the crest; beside it the cusp bends the line.
    (scene.image.width, scene.image.height) = (513, 513);
    let (width, values) = irradiance(&scene);
    let texel = 2.0 / f64::from(width);
    let error = focus_error_m(width, &values);
    println!("the focus is {error} m from theory; a texel is {texel} m");
    assert!(error.abs() <= texel, "the focus is {error} m from where theory has it; a texel is {texel} m");
    // The comparison can fail: two per cent of refractive index move the focus by many texels.
    scene.water.as_mut().expect("water").ior = 1.36;
    let (width, values) = irradiance(&scene);
    assert!(focus_error_m(width, &values).abs() > 10.0 * texel);
}

#[test]
fn matched_indices_give_no_pattern() {
    let mut scene = scene("sine_water.ron");
    scene.objects = self::scene("flat_water.ron").objects;
    scene.water.as_mut().expect("water").ior = 1.0;
    let (_, values) = irradiance(&scene);
    assert!(worst(&values, 1.0) < T1_BOUND, "{:e}", worst(&values, 1.0));
}

/// Straight down on a level floor: every point lies equally deep, however far away it is; and what the `position` layer shows lies there.
#[test]
fn depth_is_along_the_view_axis_in_metres() {
    let mut scene = scene("flat_water.ron");
    (scene.image.width, scene.image.height) = (16, 16);
    let (position, target, up) = (Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, Vec3::NEG_Z);
    scene.camera = Camera::Perspective { position, target, up, fov_deg: 60.0, near_m: 0.1, far_m: 100.0 };
    let layers = ["depth", "position"].map(str::to_owned).to_vec();
    let options = RenderOptions { layers: Some(layers), ..RenderOptions::default() };
    let rendered = Renderer::new(&scene, &options).expect("device").render(&scene, None).expect("frame").layers;
    let planes = |name: &str| rendered.get(name).expect("asked for").planes().to_vec();
    let (depth, place) = (planes("depth"), planes("position"));
    let at = |k: usize| Vec3::from_array([0, 1, 2].map(|c: usize| place[c].pixels()[k]));
    for (k, depth) in depth[0].pixels().iter().enumerate() {
        assert!((depth - 4.0).abs() < 1.0e-4, "pixel {k}: {depth} m deep, not 4 m");
    }
    // The comparison can fail: in the corner the distance is another.
    assert!(at(0).distance(position) > 4.2, "{}", at(0));
}

/// Rippled water focuses light to lines much thinner than a pixel. A pixel gets their mean, so that a picture is like one of four times its size, made smaller.
#[test]
fn rippled_water_has_no_fireflies() {
    let variants = [
        "AxisCosine(ripples: (amplitude_m: 0.04, feature_m: 0.4))",
        "AxisCosine(ripples: (amplitude_m: 0.02, feature_m: 0.2))",
        "AxisCosine()",
        "CircularCosine()",
    ];
    for model in variants {
        let text = format!(
            "Scene(image: (width: 160, height: 160),
            camera: Orthographic(position: (0, 3, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 0.625, near_m: 0.5, far_m: 10),
            lights: [Directional(aim: Sun(azimuth_deg: 30, elevation_deg: 60), irradiance: (1, 1, 1))],
            water: (size_m: (4, 4), grid: (257, 257), model: {model}), medium: Vacuum,
            objects: [(shape: Grid(size_m: (8, 8)), transform: (translate: (0, -1, 0)))],
            techniques: (caustic_volumes: (samples: 1)))"
        );
        let light = |times: u32| {
            let mut scene = TECHNIQUES.parse(&text, "ripples", Path::new("")).expect("a scene");
            (scene.image.width, scene.image.height) = (160 * times, 160 * times);
            let (_, red) = irradiance(&scene);
            let (side, times) = (160 * times as usize, times as usize);
            let mean = |k: usize| {
                let (x, y) = (k % 160 * times, k / 160 * times);
                (0..times * times).map(|n| f64::from(red[(y + n / times) * side + x + n % times])).sum::<f64>() / (times * times) as f64
            };
            (0..160 * 160).map(mean).collect::<Vec<_>>()
        };
        let (one, four) = (light(1), light(4));
        let most = |light: &[f64]| light.iter().copied().fold(0.0, f64::max);
        let mean = |f: &dyn Fn(usize) -> f64| (0..one.len()).map(f).sum::<f64>() / one.len() as f64;
        let (a, b) = (mean(&|k| one[k]), mean(&|k| four[k]));
        let (aa, bb) = (mean(&|k| (one[k] - a) * (one[k] - a)), mean(&|k| (four[k] - b) * (four[k] - b)));
        let correlation = mean(&|k| (one[k] - a) * (four[k] - b)) / (aa * bb).sqrt();
        assert!(correlation > 0.83 && most(&one) < 1.5 * most(&four) && (a / b - 1.0).abs() < 0.01, "{model}: {correlation}");
    }
}
