//! Light that meets glass and water, or a mirror and water, in turn: T16. What it does at one must not depend on what it did at the other.

use glam::Vec3;
use nephroid::geom::shapes::{Cuboid, Grid};
use nephroid::scene::{Aim, Light, Material, MeasuringPlane, Object, Scene, Shape, Transform};

use super::traced::{Probe, Seen, Sensor, level_plane, measure_to, scene};
use super::truths::optics;

/// Angles of incidence, degrees.
const ANGLES_DEG: [f64; 5] = [0.0, 30.0, 45.0, 60.0, 75.0];

/// Relative standard error. One number for two choices in a row changed what passes by 1.3 % in upright light, by 5 % at 60°, by a quarter at 75°.
const PRECISION: f64 = 0.0025;

/// Refractive index of the sheet over the water.
const OVER: f64 = 1.5;

/// Refractive index of the sheet under water: more, so that its own reflections are strong enough to be noticed.
const UNDER: f64 = 2.4;

/// Refractive index of the water.
const WATER: f64 = 1.333;

/// Still water in the level y = 0 over a floor at −0.2 m, lit at `angle_deg` from the vertical. Nothing but what a test adds is in it.
fn still_water(angle_deg: f64) -> Scene {
    let mut scene = scene("flat_water.ron");
    let angle = angle_deg.to_radians();
    let direction = Vec3::new(-libm::sin(angle) as f32, -libm::cos(angle) as f32, 0.0);
    scene.lights = vec![Light::Directional { aim: Aim::Along(direction), irradiance: Vec3::ONE }];
    scene.water.as_mut().expect("the scene has water").size_m = glam::Vec2::splat(2.4);
    scene.objects[0].transform.translate = Vec3::new(0.0, -0.2, 0.0);
    scene
}

fn object(shape: Shape, material: Material, transform: Transform) -> Object {
    Object { name: String::new(), shape, transform, material }
}

/// A level sheet of glass, a centimetre thick. Where a test measures, light has come from the middle of it: at 75° it moves 0.19 m from
/// one reflection between sheet and water to the next, of which the fourth has less than a ten thousandth of the light left.
fn sheet(ior: f64, middle_y: f32) -> Object {
    let glass = Material::Dielectric { ior: ior as f32, abbe: None, absorption: Vec3::ZERO };
    let shape = Shape::Cuboid(Cuboid { size_m: Vec3::new(3.0, 0.01, 3.0) });
    object(shape, glass, Transform { translate: Vec3::new(0.0, middle_y, 0.0), ..Transform::default() })
}

/// A square of 0.9 m at a height, that measures what comes from above, or from below.
fn square(y: f64, from_below: bool) -> MeasuringPlane {
    let plane = level_plane(y, [-0.45, 0.45], [-0.45, 0.45], (1, 1));
    if from_below { MeasuringPlane { u: plane.v, v: plane.u, ..plane } } else { plane }
}

/// Irradiance of the one texel of a plane.
fn irradiance(mut scene: Scene, plane: MeasuringPlane, precision: f64, truth: f64) -> Seen {
    scene.trace.plane = Some(plane);
    measure_to(precision, &scene, Sensor::Plane, &[Probe::white(0, 0, truth)])
}

#[test]
fn glass_and_then_water_pass_what_the_series_says() {
    for &angle_deg in &ANGLES_DEG {
        let mut scene = still_water(angle_deg);
        scene.objects.push(sheet(OVER, 0.03));
        let angle = angle_deg.to_radians();
        let stack = optics::SheetOverWater::new(angle, OVER, WATER);
        let seen = irradiance(scene, square(-0.1, false), PRECISION, libm::cos(angle) * stack.entered());
        seen.agrees();
        seen.refuses("glass that has light pass on to the water undiminished", |_, truth| truth / (1.0 - stack.water));
        seen.refuses("light reflected at the top of the glass alone", |_, truth| {
            truth / stack.entered() * (1.0 - optics::reflectance(angle, OVER)) * (1.0 - stack.water)
        });
    }
}

#[test]
fn water_and_then_glass_pass_what_the_series_says() {
    for &angle_deg in &ANGLES_DEG {
        let mut scene = still_water(angle_deg);
        scene.objects.push(sheet(UNDER, -0.03));
        let angle = angle_deg.to_radians();
        let truth = libm::cos(angle) * optics::sheet_under_water(angle, UNDER, WATER);
        let seen = irradiance(scene, square(-0.1, false), PRECISION, truth);
        seen.agrees();
        let inside = optics::refraction_angle(angle, WATER).expect("light comes from the thinner side");
        seen.refuses("a sheet in air", |_, _| {
            libm::cos(angle) * optics::transmittance(angle, WATER) * (1.0 - optics::sheet_reflectance(inside, UNDER))
        });
    }
}

/// What one number for two choices in a row would spoil most: whether light that glass has let pass is reflected by the water after it.
/// Down through the gap between them goes D, up goes U, on into the water goes W; the choices are independent if `U = R D` and
/// `W = (1 − R) D` with the water's reflectance R.
#[test]
fn choices_at_glass_and_then_at_water_are_independent() {
    for angle_deg in [0.0_f64, 75.0] {
        let angle = angle_deg.to_radians();
        let stack = optics::SheetOverWater::new(angle, OVER, WATER);
        let at = |plane: MeasuringPlane, precision: f64, truth: f64| {
            let mut scene = still_water(angle_deg);
            scene.objects.push(sheet(OVER, 0.03));
            let seen = irradiance(scene, plane, precision, libm::cos(angle) * truth);
            let comparison = &seen.comparisons[0];
            (comparison.mean, comparison.standard_error)
        };
        let (down, down_error) = at(square(0.0125, false), 2.0 * PRECISION, stack.down());
        // In upright light two per cent go up.
        let (up, up_error) = at(square(0.0125, true), 5.0 * PRECISION, stack.up());
        let (entered, entered_error) = at(square(-0.1, false), 2.0 * PRECISION, stack.entered());
        for (what, joint, error, share) in [("reflected", up, up_error, stack.water), ("passed", entered, entered_error, 1.0 - stack.water)]
        {
            let product = down * share;
            // Errors of the two may go together, at worst fully. Four of them is what one of ten comparisons exceeds with a chance of 1e-3.
            let bound = 4.0 * (error + share * down_error);
            assert!(
                (joint - product).abs() < bound,
                "{angle_deg}°, passed by glass and {what} by water: {joint:.6} ± {error:.6}, product {product:.6} ± {:.6}",
                share * down_error
            );
        }
        assert!((up - 1.2 * down * stack.water).abs() > 4.0 * (up_error + stack.water * down_error), "the check cannot tell a fifth");
    }
}

/// A mirror sends level light on to the water: it takes its share without a choice, so nothing can be drawn twice.
#[test]
fn mirror_and_then_water_pass_their_product() {
    const REFLECTANCE: f32 = 0.8;
    const HEIGHT: f64 = 2.0;
    for &angle_deg in &ANGLES_DEG {
        let angle = angle_deg.to_radians();
        let mut scene = still_water(90.0);
        scene.lights = vec![Light::Directional { aim: Aim::Along(Vec3::NEG_X), irradiance: Vec3::ONE }];
        // Its normal halves the angle between the light, along −x, and what it is to become: (−sin θ, −cos θ, 0). Light that the water
        // reflects passes beside it.
        let tilt_deg = libm::atan2(1.0 - libm::sin(angle), libm::cos(angle)).to_degrees();
        scene.objects.push(object(
            Shape::Grid(Grid { size_m: glam::Vec2::splat(2.0), ..Grid::default() }),
            Material::Mirror { reflectance: Vec3::splat(REFLECTANCE) },
            Transform {
                translate: Vec3::new((HEIGHT * libm::tan(angle)) as f32, HEIGHT as f32, 0.0),
                rotate_deg: Vec3::new(0.0, 0.0, tilt_deg as f32),
                ..Transform::default()
            },
        ));
        let truth = f64::from(REFLECTANCE) * libm::cos(angle) * optics::transmittance(angle, WATER);
        let plane = level_plane(-0.1, [-0.2, 0.1], [-0.3, 0.3], (1, 1));
        let seen = irradiance(scene, plane, PRECISION, truth);
        seen.agrees();
        seen.refuses("a perfect mirror", |_, truth| truth / f64::from(REFLECTANCE));
        seen.refuses("water that reflects nothing", |_, truth| truth / optics::transmittance(angle, WATER));
    }
}
