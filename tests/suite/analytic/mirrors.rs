//! Upright mirrors: T7, T8.

use glam::Vec3;
use nephroid::scene::Material;

use super::traced::{Probe, Sensor, level_plane, measure, measure_to, noise, probes, scene};
use super::truths::ring::{Cardioid, Nephroid};

fn ring() -> Nephroid {
    Nephroid { elevation: 45.0_f64.to_radians(), height: 0.8, reflectance: 1.0 }
}

fn light_on_the_rim() -> Cardioid {
    Cardioid { light_height: 1.2, height: 0.6, reflectance: 1.0 }
}

#[test]
fn ring_lights_its_floor_with_a_nephroid() {
    let ring = ring();
    let mut scene = scene("mirror_ring.ron");
    // Within the radius that light reflected twice does not reach.
    let plane = level_plane(0.0, [-0.84, -0.12], [-0.36, 0.36], (8, 8));
    assert!(libm::hypot(0.84, 0.36) < ring.clean_radius());
    scene.trace.plane = Some(plane);
    let truths = probes(&plane, 0.5, |x, z| ring.mean(x, z));
    assert!(truths.len() > 30, "{}", truths.len());
    let seen = measure(&scene, Sensor::Plane, &truths);
    seen.agrees();
    let wrong = |other: Nephroid| probes(&plane, -1.0, move |x, z| other.mean(x, z));
    let at = |i: usize| (truths[i].row * 8 + truths[i].column) as usize;
    let steeper = wrong(Nephroid { elevation: 46.0_f64.to_radians(), ..ring });
    seen.refuses("a sun that is one degree higher", |i, _| steeper[at(i)].truth[0]);
    seen.refuses("a receiver that faces the sun", |_, truth| truth / libm::sin(ring.elevation));
    let turned = |i: usize| (truths[i].row * 8 + 7 - truths[i].column) as usize;
    seen.refuses("the sun on the other side", |i, _| steeper[turned(i)].truth[0]);
}

#[test]
fn nephroid_has_its_cusp_half_way_to_the_mirror() {
    // Fine texels along the axis, over the cusp.
    let ring = ring();
    let mut scene = scene("mirror_ring.ron");
    let plane = level_plane(0.0, [-0.62, -0.38], [-0.02, 0.02], (6, 1));
    scene.trace.plane = Some(plane);
    let truths = probes(&plane, 0.0, |x, z| ring.mean(x, z));
    let seen = measure_to(2.0 * noise(), &scene, Sensor::Plane, &truths);
    seen.agrees();
    let shifted = probes(&plane, 0.0, |x, z| ring.mean(x.map(|x| x + 0.01), z));
    seen.refuses("a cusp one centimetre off", |i, _| shifted[i].truth[0]);
}

#[test]
fn mirrors_colour_light_by_their_reflectance() {
    let ring = ring();
    let mut scene = scene("mirror_ring.ron");
    scene.objects[0].material = Material::Mirror { reflectance: Vec3::new(1.0, 0.75, 0.5) };
    let plane = level_plane(0.0, [-0.8, -0.2], [-0.3, 0.3], (1, 1));
    scene.trace.plane = Some(plane);
    let truth = ring.mean([-0.8, -0.2], [-0.3, 0.3]);
    let seen = measure(&scene, Sensor::Plane, &[Probe { column: 0, row: 0, truth: [truth, 0.75 * truth, 0.5 * truth] }]);
    seen.agrees();
    seen.refuses("two reflections", |i, truth| truth * [1.0, 0.75, 0.5][i]);
}

#[test]
fn light_on_the_rim_makes_a_cardioid() {
    let ring = light_on_the_rim();
    let mut scene = scene("cardioid.ron");
    let plane = level_plane(0.0, [-0.9, 0.3], [-0.6, 0.6], (6, 6));
    scene.trace.plane = Some(plane);
    let truths = probes(&plane, 0.08, |x, z| ring.mean(x, z));
    assert!(truths.len() > 20, "{}", truths.len());
    let seen = measure(&scene, Sensor::Plane, &truths);
    seen.agrees();
    let at = |i: usize| (truths[i].row * 6 + truths[i].column) as usize;
    let higher = probes(&plane, -1.0, |x, z| Cardioid { light_height: 1.23, ..ring }.mean(x, z));
    seen.refuses("a light three centimetres higher", |i, _| higher[at(i)].truth[0]);
    let nephroid = probes(&plane, -1.0, |x, z| 0.2 * self::ring().mean(x, z));
    seen.refuses("a nephroid", |i, _| nephroid[at(i)].truth[0]);
}

#[test]
fn cardioid_has_its_cusp_a_third_beyond_the_axis() {
    let ring = light_on_the_rim();
    let mut scene = scene("cardioid.ron");
    let plane = level_plane(0.0, [-0.48, -0.18], [-0.025, 0.025], (6, 1));
    scene.trace.plane = Some(plane);
    let truths = probes(&plane, 0.0, |x, z| ring.mean(x, z));
    let seen = measure_to(2.0 * noise(), &scene, Sensor::Plane, &truths);
    seen.agrees();
    let shifted = probes(&plane, 0.0, |x, z| ring.mean(x.map(|x| x + 0.01), z));
    seen.refuses("a cusp one centimetre off", |i, _| shifted[i].truth[0]);
}
