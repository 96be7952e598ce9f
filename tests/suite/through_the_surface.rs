//! What the eye sees through the water's surface, and in it: every pixel's radiance against the equation of its ray.
//!
//! The receivers are a floor and a wall with squares of two colours in even light, so that a pixel tells which point it shows. Nothing here is drawn: each ray is
//! met with the formula of the water by bisection, refracted or moved as the method says, and met with the planes.

use std::path::Path;

use glam::{DVec2, DVec3};
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::scene::water::Formula;
use nephroid::scene::{Camera, Scene};

const SIZE: (u32, u32) = (96, 64);
const IOR: f64 = 1.333;
const EXTINCTION: [f64; 3] = [0.35, 0.12, 0.06];
const SCATTERING: [f64; 3] = [0.05, 0.06, 0.03];
const AMBIENT: [f64; 3] = [100.0, 120.0, 150.0];
const EVEN: [f64; 3] = [0.8, 0.6, 0.4];
const ODD: [f64; 3] = [0.2, 0.3, 0.1];
const SQUARE_M: f64 = 0.8;
const FLOOR_M: f64 = -1.2;
const WALL_M: f64 = -2.0;

/// A basin without a light, whose water has this model, in the eye of this camera.
fn scene(model: &str, camera: &str, eye_refraction: &str) -> Scene {
    let absorption: Vec<f64> = EXTINCTION.iter().zip(SCATTERING).map(|(t, s)| t - s).collect();
    let squares = format!("Diffuse(albedo: Checker(size_m: {SQUARE_M}, even: {}, odd: {}))", triple(&EVEN), triple(&ODD));
    let text = format!(
        "Scene(
            image: (width: {}, height: {}),
            camera: {camera},
            lights: [],
            environment: (zenith: (20, 40, 80), horizon: (90, 100, 110), ground: (5, 5, 5), ambient_irradiance: {}),
            water: (size_m: (12, 12), level_m: 0, ior: {IOR}, grid: (257, 257), model: {model}),
            medium: Custom(sigma_a: {}, sigma_s: {}),
            objects: [
                (name: \"floor\", shape: Grid(size_m: (12, 12)), transform: (translate: (0, {FLOOR_M}, 0)), material: {squares}),
                (name: \"wall\", shape: Grid(size_m: (12, 4)), transform: (rotate_deg: (90, 0, 0), translate: (0, -2.05, {WALL_M})), material: {squares}),
            ],
            techniques: (caustic_volumes: (eye_refraction: {eye_refraction})),
        )",
        SIZE.0,
        SIZE.1,
        triple(&AMBIENT),
        triple(&absorption),
        triple(&SCATTERING),
    );
    TECHNIQUES.parse(&text, "basin", Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

fn triple(v: &[f64]) -> String {
    format!("({}, {}, {})", v[0], v[1], v[2])
}

/// The picture's radiance, pixel by pixel.
fn picture(scene: &Scene) -> Vec<[f64; 3]> {
    let options = RenderOptions { technique: "caustic-volumes".into(), layers: Some(vec!["color".into()]), ..RenderOptions::default() };
    let layers = Renderer::new(scene, &options).expect("device").render(scene, None).expect("frame").layers;
    let planes = layers.get("color").expect("asked for").planes();
    (0..planes[0].pixels().len()).map(|k| [0, 1, 2].map(|c| f64::from(planes[c].pixels()[k]))).collect()
}

/// A ray of the eye: a point on it, the eye's or the near plane's, and its unit direction.
#[derive(Clone, Copy)]
struct Ray {
    from: DVec3,
    along: DVec3,
}

/// Through a place in the picture, px.
fn ray(scene: &Scene, (x, y): (f64, f64)) -> Ray {
    let (width, height) = (f64::from(SIZE.0), f64::from(SIZE.1));
    let world_from_clip = scene.camera.clip_from_world(SIZE.0 as f32 / SIZE.1 as f32).as_dmat4().inverse();
    let at = |depth| world_from_clip.project_point3(DVec3::new(2.0 * x / width - 1.0, 1.0 - 2.0 * y / height, depth));
    let from = at(0.0);
    Ray { from, along: (at(1.0) - from).normalize() }
}

/// Where a ray first meets the water, and the normal there, up.
fn surface(water: &Formula, ray: Ray) -> Option<(DVec3, DVec3)> {
    let height = |p: DVec3| {
        let (height, slope) = water.height_and_slope(p.x as f32, p.z as f32);
        (f64::from(height), DVec3::new(f64::from(-slope.x), 1.0, f64::from(-slope.y)).normalize())
    };
    let above = |t: f64| {
        let p = ray.from + ray.along * t;
        p.y - height(p).0
    };
    // The waves are lower than this.
    let [a, b] = [-0.1, 0.1].map(|y| ((y - ray.from.y) / ray.along.y).max(0.0));
    let (start, end) = (a.min(b), a.max(b).min(20.0));
    let side = above(start);
    let step = (end - start) / 200.0;
    let first = (1..=200).map(|k| start + f64::from(k) * step).find(|&t| above(t) * side <= 0.0)?;
    let (mut near, mut far) = (first - step, first);
    for _ in 0..40 {
        let middle = 0.5 * (near + far);
        if above(middle) * side > 0.0 { near = middle } else { far = middle }
    }
    let p = ray.from + ray.along * far;
    (p.x.abs() < 5.9 && p.z.abs() < 5.9).then(|| (p, height(p).1))
}

/// What a ray in the water meets: the point, and which square of which plane.
fn receiver(ray: Ray) -> Option<(DVec3, [i64; 3])> {
    let square = |v: DVec2| [(v.x / SQUARE_M).floor() as i64, (v.y / SQUARE_M).floor() as i64];
    let reach = |to: f64| ray.from + ray.along * to;
    let wall = reach((WALL_M - ray.from.z) / ray.along.z);
    if ray.along.z < 0.0 && ray.from.z > WALL_M && wall.y < -0.05 && wall.y > FLOOR_M && wall.x.abs() < 6.0 {
        let [x, y] = square(DVec2::new(wall.x, wall.y));
        return Some((wall, [1, x, y]));
    }
    let floor = reach((FLOOR_M - ray.from.y) / ray.along.y);
    let [x, z] = square(DVec2::new(floor.x, floor.z));
    (ray.along.y < 0.0 && floor.x.abs() < 6.0 && floor.z.abs() < 6.0).then_some((floor, [0, x, z]))
}

fn refracted(d: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let cos = -d.dot(n);
    let squared = 1.0 - eta * eta * (1.0 - cos * cos);
    (squared >= 0.0).then(|| d * eta + n * (eta * cos - squared.sqrt()))
}

/// Fresnel's equations for light that is not polarized, from the cosines on both sides.
fn reflectance(cos_i: f64, cos_t: f64, n_i: f64, n_t: f64) -> f64 {
    let s = (n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t);
    let p = (n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t);
    0.5 * (s * s + p * p)
}

/// Radiance that `distance` metres of water leave of another, and add to it.
fn through_water(radiance: f64, distance: f64, channel: usize) -> f64 {
    let left = libm::exp(-EXTINCTION[channel] * distance);
    let scattered = SCATTERING[channel] / EXTINCTION[channel] * AMBIENT[channel] / (4.0 * std::f64::consts::PI);
    radiance * left + scattered * (1.0 - left)
}

/// Radiance of a point of the floor or the wall: albedo times what the depth leaves of the ambient light.
fn shaded((point, [_, a, b]): (DVec3, [i64; 3]), channel: usize) -> f64 {
    let albedo = if (a + b).rem_euclid(2) == 0 { EVEN } else { ODD };
    albedo[channel] * AMBIENT[channel] * libm::exp(EXTINCTION[channel] * point.y) / std::f64::consts::PI
}

/// How the eye looks through the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Method {
    Snell,
    VirtualPlane,
}

/// Radiance along a ray of an eye above the water, and the square that it shows.
fn from_above(scene: &Scene, water: &Formula, ray: Ray, method: Method, ior: f64) -> Option<([f64; 3], [i64; 3])> {
    let (s, n) = surface(water, ray)?;
    let inside = refracted(ray.along, n, 1.0 / ior)?;
    let (seen, spread) = match method {
        Method::Snell => (receiver(Ray { from: s, along: inside })?, 1.0 / (ior * ior)),
        // The surface's point, moved vertically onto the mean level, as the eye sees the receiver behind it; an eye infinitely far away looks the same way
        // everywhere.
        Method::VirtualPlane => {
            let on_plane = DVec3::new(s.x, 0.0, s.z);
            let along = if matches!(scene.camera, Camera::Perspective { .. }) {
                (on_plane - scene.camera.position_ws().as_dvec3()).normalize()
            } else {
                ray.along
            };
            (receiver(Ray { from: on_plane, along })?, 1.0)
        }
    };
    let r = reflectance(-ray.along.dot(n), -inside.dot(n), 1.0, ior);
    let mirrored = ray.along - n * (2.0 * ray.along.dot(n));
    let sky = scene.environment.sky_radiance(mirrored.as_vec3()).as_dvec3().to_array();
    let distance = seen.0.distance(s);
    let radiance = [0, 1, 2].map(|c| (1.0 - r) * spread * through_water(shaded(seen, c), distance, c) + r * sky[c]);
    Some((radiance, seen.1))
}

/// Radiance along a ray of an eye in the water, and the square that it shows: `[2, 0, 0]` for the sky, `[2, 1, 0]` for what the surface reflects totally.
fn from_below(scene: &Scene, water: &Formula, ray: Ray, ior: f64) -> Option<([f64; 3], [i64; 3])> {
    let met = surface(water, ray);
    if let Some(seen) = receiver(ray).filter(|seen| met.is_none_or(|(s, _)| s.distance(ray.from) > seen.0.distance(ray.from))) {
        let distance = seen.0.distance(scene.camera.position_ws().as_dvec3());
        return Some(([0, 1, 2].map(|c| through_water(shaded(seen, c), distance, c)), seen.1));
    }
    let (s, n) = met?;
    let distance = s.distance(scene.camera.position_ws().as_dvec3());
    let glow = |c| through_water(0.0, f64::INFINITY, c);
    let Some(outside) = refracted(ray.along, -n, ior) else {
        return Some(([0, 1, 2].map(|c| through_water(glow(c), distance, c)), [2, 1, 0]));
    };
    let r = reflectance(ray.along.dot(n), outside.dot(n), ior, 1.0);
    let sky = scene.environment.sky_radiance(outside.as_vec3()).as_dvec3().to_array();
    Some(([0, 1, 2].map(|c| through_water((1.0 - r) * ior * ior * sky[c] + r * glow(c), distance, c)), [2, 0, 0]))
}

/// Pixels that the picture shows wrong, and all that were compared: those around which the eye sees one square alone, away from the picture's edge.
fn wrong(drawn: &[[f64; 3]], tolerance: f64, truth: impl Fn((f64, f64)) -> Option<([f64; 3], [i64; 3])>) -> (usize, usize) {
    let (mut wrong, mut compared) = (0, 0);
    for y in (4..SIZE.1 - 4).step_by(2) {
        for x in 4..SIZE.0 - 4 {
            let middle = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some((expected, square)) = truth(middle) else { continue };
            let around = [(-2.0, 0.0), (2.0, 0.0), (0.0, -2.0), (0.0, 2.0), (-1.5, -1.5), (1.5, -1.5), (-1.5, 1.5), (1.5, 1.5)];
            if around.iter().any(|(dx, dy)| truth((middle.0 + dx, middle.1 + dy)).is_none_or(|seen| seen.1 != square)) {
                continue;
            }
            compared += 1;
            let seen = drawn[(y * SIZE.0 + x) as usize];
            wrong += usize::from((0..3).any(|c| (seen[c] - expected[c]).abs() > tolerance * expected[c]));
        }
    }
    (wrong, compared)
}

const OBLIQUE: &str = "Perspective(position: (0.3, 1.6, 2.6), target: (0.1, -0.6, -0.6), fov_deg: 50)";
const FROM_ABOVE: &str = "Perspective(position: (0.2, 3.2, 0.5), target: (0, -1, 0), up: (0, 0, -1), fov_deg: 45)";
const PARALLEL: &str = "Orthographic(position: (0, 3, 2.5), target: (0, -0.6, 0), height_m: 2.6, near_m: 0.1, far_m: 30)";
const WAVES: &str = "Waves([(amplitude_m: 0.02, wavelength_m: 1.7, direction_deg: 35, motion: Steady)])";

fn looks_through(method: Method, water_model: &str, camera: &str, tolerance: f64, most: f64) {
    let setting = if method == Method::Snell { "Snell" } else { "VirtualPlane" };
    let scene = scene(water_model, camera, setting);
    let water = &scene.water.as_ref().and_then(|water| water.formula(scene.time_s)).expect("a formula");
    let drawn = picture(&scene);
    let judged = |method, ior| wrong(&drawn, tolerance, |at| from_above(&scene, water, ray(&scene, at), method, ior));
    let (bad, all) = judged(method, IOR);
    assert!(all > 600 && (bad as f64) < most * all as f64, "{method:?}, {water_model}, {camera}: {bad} of {all}");
    // Neither the other method's picture nor that of another liquid.
    let other = if method == Method::Snell { Method::VirtualPlane } else { Method::Snell };
    for (method, ior) in [(other, IOR), (method, 1.25)] {
        let (bad, all) = judged(method, ior);
        assert!(bad * 4 > all, "{method:?} at an index of {ior} would pass as well: {bad} of {all}");
    }
}

#[test]
fn an_eye_above_sees_through_the_surface_along_refracted_rays() {
    for camera in [OBLIQUE, FROM_ABOVE, PARALLEL] {
        looks_through(Method::Snell, "Flat", camera, 0.015, 0.001);
        looks_through(Method::Snell, "Tilted(slope: (0.03, -0.02))", camera, 0.015, 0.01);
        looks_through(Method::Snell, WAVES, camera, 0.02, 0.02);
    }
}

#[test]
fn the_virtual_plane_shows_what_lies_behind_the_levelled_surface() {
    for camera in [OBLIQUE, FROM_ABOVE, PARALLEL] {
        looks_through(Method::VirtualPlane, "Flat", camera, 0.005, 0.001);
        looks_through(Method::VirtualPlane, WAVES, camera, 0.01, 0.02);
    }
}

#[test]
fn an_eye_in_the_water_sees_the_sky_in_snells_window_and_receivers_straight() {
    let up = "Perspective(position: (0.2, -0.9, 0.5), target: (0.1, 0, -0.1), fov_deg: 110)";
    let ahead = "Perspective(position: (0.2, -0.5, 1.8), target: (0, -0.75, -2), fov_deg: 60)";
    for (camera, model, tolerance) in [(up, "Flat", 0.005), (up, WAVES, 0.02), (ahead, "Flat", 0.005), (ahead, WAVES, 0.02)] {
        let scene = scene(model, camera, "Snell");
        let water = &scene.water.as_ref().and_then(|water| water.formula(scene.time_s)).expect("a formula");
        let drawn = picture(&scene);
        let judged = |ior| wrong(&drawn, tolerance, |at| from_below(&scene, water, ray(&scene, at), ior));
        let (bad, all) = judged(IOR);
        assert!(all > 600 && bad * 100 < all, "{camera}, {model}: {bad} of {all}");
        if camera == up {
            let (bad, all) = judged(1.25);
            assert!(bad * 4 > all, "another index would pass as well: {bad} of {all}");
        }
    }
}
