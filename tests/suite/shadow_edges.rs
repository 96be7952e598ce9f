//! Shadows of objects in the direct light of suns, spots and lamps: as large as geometry says, with the default shadow map.

use std::path::Path;

use nephroid::caustics::TECHNIQUES;
use nephroid::scene::{Light, Scene};

use crate::waterside::Seen;

const SIZE: u32 = 200;
/// Width of the picture and of the floor, m.
const WIDTH_M: f64 = 4.0;
/// Height of the plate over the floor, and half of its side, m.
const PLATE_M: (f64, f64) = (0.5, 0.4);

/// A dry floor seen from straight above, parallel, through a thin plate's own picture; the plate is at the height of the camera's near plane, and so not seen.
fn scene(light: &str) -> Scene {
    let text = format!(
        "Scene(
            image: (width: {SIZE}, height: {SIZE}),
            camera: Orthographic(position: (0, 0.45, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: {WIDTH_M}, near_m: 0.01, far_m: 10),
            lights: [{light}],
            environment: (ambient_irradiance: (0, 0, 0)),
            objects: [
                (name: \"floor\", shape: Grid(size_m: (8, 8)), material: Diffuse(albedo: Solid(0.5, 0.5, 0.5))),
                (name: \"plate\", shape: Grid(size_m: ({side}, {side})), transform: (translate: (0.1, {height}, -0.05)),
                 material: Diffuse(albedo: Solid(0.5, 0.5, 0.5))),
            ],
        )",
        side = 2.0 * PLATE_M.1,
        height = PLATE_M.0,
    );
    TECHNIQUES.parse(&text, "plate", Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

/// Irradiance of the floor at a place, without the plate, and whether the plate is before the light.
fn at(light: &Light, x: f64, z: f64) -> (f64, bool) {
    let incident = light.incident(glam::Vec3::new(x as f32, 0.0, z as f32));
    let d = incident.direction_ws.as_dvec3();
    let back = PLATE_M.0 / -d.y;
    let (px, pz) = (x - d.x * back - 0.1, z - d.z * back + 0.05);
    (f64::from(incident.irradiance.x) * -d.y, px.abs() < PLATE_M.1 && pz.abs() < PLATE_M.1)
}

/// Light that the plate takes away from the floor, drawn and true, of a full picture without it, W.
fn taken(light: &str, technique: &str) -> (f64, f64) {
    let scene = scene(light);
    let seen = Seen::of(&scene, technique);
    let pixel = WIDTH_M / f64::from(SIZE);
    let (mut drawn, mut expected) = (0.0, 0.0);
    for (k, drawn_here) in seen.direct.iter().enumerate() {
        let (column, row) = (k as u32 % SIZE, k as u32 / SIZE);
        // An eighth of a pixel: the floor's pixels at the edge are partly in shadow, and drawn by their middles.
        for part in 0..64 {
            let place = |n: u32, part: u32| (f64::from(n) + (f64::from(part) + 0.5) / 8.0) * pixel - 0.5 * WIDTH_M;
            let (e, dark) = at(&scene.lights[0], place(column, part % 8), place(row, part / 8));
            expected += if dark { e / 64.0 } else { 0.0 };
        }
        let (e, _) =
            at(&scene.lights[0], (f64::from(column) + 0.5) * pixel - 0.5 * WIDTH_M, (f64::from(row) + 0.5) * pixel - 0.5 * WIDTH_M);
        // Away from the shadow both are the same up to what a pixel's middle is off the mean.
        if e - drawn_here > 0.01 * e {
            drawn += e - drawn_here;
        }
    }
    (drawn * pixel * pixel, expected * pixel * pixel)
}

#[test]
fn shadows_are_as_large_as_what_casts_them() {
    let lights = [
        "Directional(aim: Sun(azimuth_deg: 25, elevation_deg: 78), irradiance: (1, 1, 1))",
        "Directional(aim: Sun(azimuth_deg: 200, elevation_deg: 35), irradiance: (1, 1, 1))",
        "Spot(position: (0.6, 1.6, 0.5), direction: (-0.3, -1, -0.25), inner_deg: 50, outer_deg: 60, intensity: (10, 10, 10))",
        "Point(position: (0.6, 1.6, 0.5), intensity: (10, 10, 10))",
    ];
    for light in lights {
        let (drawn, expected) = taken(light, "caustic-volumes");
        println!("{light}: {drawn} W in place of {expected} W, {}", drawn / expected);
        assert!((drawn / expected - 1.0).abs() < 3.0e-3, "{light}: the plate takes {drawn} W in place of {expected} W");
    }
}
