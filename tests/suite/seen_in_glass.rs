//! What the eye sees in mirrors and glass, against rays in 64 bits: plane mirrors, slabs, balls, and glass that is none.

mod rays;
mod truth;

use glam::{UVec2, Vec2, Vec3};
use nephroid::caustics::caustic_volumes::CausticVolumes;
use nephroid::caustics::light_volumes::LightVolumes;
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::geom::shapes::{Cuboid, Grid, UvSphere};
use nephroid::image::LayerSet;
use nephroid::scene::{Albedo, Environment, Material, Object, Scene, Shape, Transform};

use crate::support;
use rays::Rays;
use truth::{Eye, Optic, World};

const SIZE: (u32, u32) = (320, 180);

/// The floor's pattern: waves some ten pixels wide, so that a picture moved by a pixel differs.
fn floor() -> Albedo {
    Albedo::Noise { low: Vec3::splat(0.1), high: Vec3::new(0.9, 0.7, 0.5), scale_m: 0.12, octaves: 2, seed: 3 }
}

/// A floor of 8 m in even light from everywhere, and one object on it.
fn scene(shape: Shape, translate: Vec3, rotate_deg: Vec3, material: Material) -> Scene {
    let mut scene = support::scene_of_size("ball.ron", SIZE);
    scene.lights.clear();
    // Receivers as bright as the sky, so that neither hides what is wrong in the other.
    scene.environment = Environment { sun_disc: None, ambient_irradiance: Vec3::splat(400.0), ..scene.environment };
    let ground = Object {
        name: "floor".into(),
        shape: Shape::Grid(Grid { size_m: Vec2::splat(8.0), cells: UVec2::ONE }),
        transform: Transform::default(),
        material: Material::Diffuse { albedo: floor() },
    };
    let transform = Transform { translate, rotate_deg, scale: Vec3::ONE };
    scene.objects = vec![ground, Object { name: "object".into(), shape, transform, material }];
    scene.techniques.edit::<CausticVolumes>().samples = 1;
    scene.techniques.edit::<LightVolumes>().samples = 1;
    scene
}

fn glass(ior: f32, absorption: Vec3) -> Material {
    Material::Dielectric { ior, abbe: None, absorption }
}

fn render(scene: &Scene, technique: &str) -> LayerSet {
    let options = RenderOptions { technique: technique.into(), ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("device").render(scene, None).expect("frame").layers
}

/// Three channels of a layer, rows top down.
fn layer(layers: &LayerSet, name: &str) -> Vec<Vec3> {
    let planes = layers.get(name).expect("a standard layer").planes();
    (0..planes[0].pixels().len()).map(|k| Vec3::from_array([0, 1, 2].map(|c| planes[c].pixels()[k]))).collect()
}

fn picture(scene: &Scene) -> Vec<Vec3> {
    layer(&render(scene, "caustic-volumes"), "color")
}

/// How far a picture is from rays, where these meet the object and what they show is in the view of the surroundings: number of pixels compared, mean
/// absolute error over mean, and the share of pixels that are off by more than a tenth.
fn error(scene: &Scene, picture: &[Vec3], optic: &dyn Optic) -> (usize, f64, f64) {
    let eye = Eye::new(scene);
    let world = World { albedo: floor(), half_m: 4.0, environment: scene.environment };
    let (mut count, mut off, mut sum, mut wrong) = (0, 0.0, 0.0, 0);
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let (origin, direction) = eye.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some(parts) = optic.follow(origin, direction) else { continue };
            // The view is four times as wide as the picture; all there is to see is in it.
            if !parts.iter().all(|part| world.hit(part).is_none_or(|hit| eye.sees(hit, 3.9))) {
                continue;
            }
            let expected = parts.iter().map(|part| world.radiance(part)).sum::<glam::DVec3>();
            let error = (picture[(y * SIZE.0 + x) as usize].as_dvec3() - expected).abs().element_sum();
            (count, off, sum) = (count + 1, off + error, sum + expected.element_sum());
            wrong += usize::from(error > 0.1 * expected.element_sum());
        }
    }
    (count, off / sum, wrong as f64 / count as f64)
}

#[test]
fn a_mirror_shows_the_mirrored_floor_point_by_point() {
    // An upright wall, turned about the vertical.
    let size = Vec3::new(0.9, 0.7, 0.02);
    let (centre, turn) = (Vec3::new(-0.1, 0.36, -0.3), 12.0);
    let reflectance = Vec3::new(0.9, 0.8, 0.7);
    let scene = scene(Shape::Cuboid(Cuboid { size_m: size }), centre, Vec3::new(0.0, turn, 0.0), Material::Mirror { reflectance });
    let shown = picture(&scene);
    let mirror = |turn: f32| truth::Wall { size, centre, turn_deg: turn, reflectance };
    let (count, off, wrong) = error(&scene, &shown, &mirror(turn));
    // A mirror turned by two more degrees shows another part of the floor.
    let (_, other, _) = error(&scene, &shown, &mirror(turn + 2.0));
    println!("{count} pixels, error {off}, {wrong} off; of a turned mirror {other}");
    assert!(count > 4000 && off < 0.01 && wrong < 0.005 && other > 5.0 * off, "{count} {off} {wrong} {other}");
}

#[test]
fn a_slab_shifts_what_is_behind_it() {
    let size = Vec3::new(0.9, 0.12, 0.7);
    let centre = Vec3::new(-0.1, 0.2, 0.0);
    let absorption = Vec3::new(1.0, 3.0, 6.0);
    let scene = scene(Shape::Cuboid(Cuboid { size_m: size }), centre, Vec3::ZERO, glass(1.5, absorption));
    let shown = picture(&scene);
    let slab = |ior: f64, absorption: Vec3| truth::Slab { size, centre, ior, absorption };
    let (count, off, wrong) = error(&scene, &shown, &slab(1.5, absorption));
    let (_, other, _) = error(&scene, &shown, &slab(1.4, absorption));
    let (_, clear, _) = error(&scene, &shown, &slab(1.5, absorption * 0.9));
    println!("{count} pixels, error {off}, {wrong} off; of other glass {other}, of clearer glass {clear}");
    assert!(count > 4000 && off < 0.01 && wrong < 0.005, "{count} {off} {wrong}");
    assert!(other > 5.0 * off && clear > 3.0 * off, "{off} {other} {clear}");
}

#[test]
fn a_ball_turns_the_picture_over() {
    let centre = Vec3::new(0.0, 0.31, 0.0);
    let shape = || Shape::UvSphere(UvSphere { radius_m: 0.3, slices: 256, stacks: 128 });
    let scene = scene(shape(), centre, Vec3::ZERO, glass(1.46, Vec3::ZERO));
    let shown = picture(&scene);
    let ball = |ior: f64| truth::Ball { radius: 0.3, centre, ior };
    let (count, off, wrong) = error(&scene, &shown, &ball(1.46));
    let (_, other, _) = error(&scene, &shown, &ball(1.5));
    println!("{count} pixels, error {off}, {wrong} off; of other glass {other}");
    assert!(count > 4000 && off < 0.015 && wrong < 0.015 && other > 5.0 * off, "{count} {off} {wrong} {other}");
}

#[test]
fn glass_that_does_not_refract_is_not_seen() {
    let mut with = support::scene_of_size("ball.ron", SIZE);
    with.techniques.edit::<CausticVolumes>().surface_shadows = false;
    with.techniques.edit::<CausticVolumes>().samples = 1;
    let ball = with.objects.iter().position(|object| object.name == "ball").expect("there is a ball");
    with.objects[ball].material = glass(1.0, Vec3::ZERO);
    let mut without = with.clone();
    without.objects.remove(ball);
    let plain = picture(&without);
    let furthest = |picture: &[Vec3]| {
        let off = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element() / b.max_element();
        picture.iter().zip(&plain).map(off).fold(0.0, f32::max)
    };
    let same = furthest(&picture(&with));
    with.objects[ball].material = glass(1.02, Vec3::ZERO);
    let other = furthest(&picture(&with));
    println!("{same} {other}");
    assert!(same < 2.0e-3 && other > 0.1, "{same} {other}");
}

#[test]
fn absorption_darkens_by_the_length_of_the_way() {
    let shape = || Shape::Cuboid(Cuboid { size_m: Vec3::new(2.0, 0.1, 2.0) });
    let of = |absorption| picture(&scene(shape(), Vec3::new(0.0, 0.2, 0.0), Vec3::ZERO, glass(1.0, absorption)));
    let (clear, dark) = (of(Vec3::ZERO), of(Vec3::new(2.0, 4.0, 8.0)));
    let eye = Eye::new(&scene(shape(), Vec3::ZERO, Vec3::ZERO, glass(1.0, Vec3::ZERO)));
    for (x, y) in [(160, 90), (120, 60), (200, 120)] {
        let (_, direction) = eye.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let way = 0.1 / -direction.y;
        let k = (y * SIZE.0 + x) as usize;
        for (channel, sigma) in [2.0, 4.0, 8.0].into_iter().enumerate() {
            let left = f64::from(dark[k][channel] / clear[k][channel]);
            assert!((left / libm::exp(-sigma * way) - 1.0).abs() < 1.0e-3, "{x} {y} {channel}: {left}");
            assert!((left / libm::exp(-sigma * 1.05 * way) - 1.0).abs() > 1.0e-3, "a longer way is noticed");
        }
    }
}

#[test]
fn light_lands_behind_glass_but_not_on_it() {
    let mut scene = support::scene_of_size("ball.ron", SIZE);
    for technique in TECHNIQUES.iter() {
        // A sample per pixel: a mean would have a share of the table along the outline.
        let key = |name: &str| format!("{}.{name}", technique.settings().key());
        scene.set(&key("samples"), "1").expect("every technique has samples");
        scene.set(&key("shadow_map_size"), "512").expect("every technique has shadow maps");
        let layers = render(&scene, technique.name());
        let (direct, caustic) = (layer(&layers, "direct"), layer(&layers, "caustic_irradiance"));
        let position = layer(&layers, "position");
        let on_ball: Vec<usize> = (0..position.len()).filter(|&k| (position[k] - Vec3::new(0.0, 0.302, 0.0)).length() < 0.3001).collect();
        assert!(on_ball.len() > 1000, "the ball is seen");
        assert!(on_ball.iter().all(|&k| direct[k] == Vec3::ZERO && caustic[k] == Vec3::ZERO), "{}", technique.name());
        assert!(direct.iter().any(|&e| e.x > 100.0), "the table is lit");
    }
}

/// How far the surfaces of mirrors and glass are from rays that follow every reflection and refraction: mean absolute error over mean.
fn error_of_scene(scene: &Scene, picture: &[Vec3]) -> f64 {
    let (eye, rays) = (Eye::new(scene), Rays::new(scene));
    let (mut off, mut sum) = (0.0, 0.0);
    for k in 0..SIZE.0 * SIZE.1 {
        let (origin, direction) = eye.ray(f64::from(k % SIZE.0) + 0.5, f64::from(k / SIZE.0) + 0.5);
        if let (expected, true) = rays.look(origin, direction) {
            off += (picture[k as usize].as_dvec3() - expected).abs().element_sum();
            sum += expected.element_sum();
        }
    }
    off / sum
}

#[test]
fn shipped_scenes_look_like_rays() {
    // Largest error: along outlines, and in the knot, whose parts are seen through each other.
    for (name, bound) in [("ball.ron", 0.03), ("ring.ron", 0.03), ("glass.ron", 0.07)] {
        let mut scene = support::scene_of_size(name, SIZE);
        scene.lights.clear();
        scene.environment.sun_disc = None;
        scene.environment.ambient_irradiance = Vec3::splat(400.0);
        scene.techniques.edit::<CausticVolumes>().samples = 1;
        let off = error_of_scene(&scene, &picture(&scene));
        // Without the objects the same pixels show the table.
        let mut without = scene.clone();
        without.objects.retain(|object| matches!(object.material, Material::Diffuse { .. }));
        let other = error_of_scene(&scene, &picture(&without));
        println!("{name}: error {off}, without mirrors and glass {other}");
        assert!(off < bound && other > 2.0 * off, "{name}: {off} {other}");
    }
}

#[test]
fn water_beside_glass_looks_as_without_it() {
    let mut without = support::with_coarse_parts(support::scene_of_size("pool.ron", (160, 90)));
    without.techniques.edit::<CausticVolumes>().surface_shadows = false;
    without.techniques.edit::<CausticVolumes>().samples = 1;
    let water = without.water.clone().expect("a pool");
    let middle = (water.min_ws() + water.max_ws()) * 0.5;
    let (centre, radius_m) = (Vec3::new(middle.x, water.level_m + 0.5, middle.y), 0.25);
    let mut with = without.clone();
    with.objects.push(Object {
        name: "ball".into(),
        shape: Shape::UvSphere(UvSphere { radius_m, slices: 64, stacks: 32 }),
        transform: Transform { translate: centre, ..Transform::default() },
        material: glass(1.5, Vec3::ZERO),
    });
    let (plain, layers) = (picture(&without), render(&with, "caustic-volumes"));
    let (shown, position) = (layer(&layers, "color"), layer(&layers, "position"));
    assert!(shown.iter().all(|color| color.is_finite()));
    let is_on_ball = |k: &usize| (position[*k] - centre).length() < radius_m * 1.01;
    let differs = |k: &usize| (shown[*k] - plain[*k]).abs().max_element() > 1.0e-3 * plain[*k].max_element();
    let beside: Vec<usize> = (0..shown.len()).filter(|k| !is_on_ball(k)).collect();
    let (on_ball, changed) = (shown.len() - beside.len(), beside.iter().filter(|k| differs(k)).count());
    println!("{on_ball} pixels on the ball, {changed} of {} others differ", beside.len());
    // Water next to the outline refracts towards pixels of the ball.
    assert!(on_ball > 50 && changed < on_ball, "{on_ball} {changed}");
    assert!((0..shown.len()).filter(is_on_ball).filter(differs).count() > on_ball / 2, "the ball is seen");
}
