//! Scene files from outside: the shipped scenes, every class of error with its exact place, every setting, and mutated files.

use std::fs;
use std::path::{Path, PathBuf};

use nephroid::scene::{self, Scene, SceneError};

/// A scene with something of every kind, at `$` places that the tests replace. Comments and odd spacing are on purpose.
const FULL: &str = r#"// A comment: with (brackets] and "quotes
Scene(
    title: "ünïcödé",
    image: (width: 64, height: 48),
    camera: Perspective(position: (0.0, 3.0, 4.0), target: (0, 0, 0), up: (0, 1, 0), fov_deg: 60, near_m: 0.1, far_m: 50),
    lights: [
        Directional(aim: Sun(azimuth_deg: 30, elevation_deg: 50), irradiance: (900, 850, 800)),
        Directional(aim: Along(0, -1, 0.5), irradiance: (1, 1, 1)),
        Point(position: (1, 2, 3), intensity: (5, 5, 5)), /* between /* nested */ */
        Spot(position: (1, 2, 3), direction: (0, -1, 0), intensity: (5, 5, 5), inner_deg: 10, outer_deg: 20),
    ],
    environment: (zenith: (1, 2, 3), horizon: (4, 5, 6), ground: (0.5, 0.5, 0.5),
        sun_disc: (angular_radius_deg: 0.3, radiance: (100, 100, 100)), ambient_irradiance: (7, 8, 9)),
    medium: Custom(sigma_a: (0.1, 0.2, 0.3), sigma_s: (0.01, 0.01, 0.01), g: 0.8),
    objects: [
        (
            name: "floor",
            shape: Grid(size_m: (4, 4)),
            material: Diffuse(albedo: Tiles(size_m: (0.2, 0.2), colours: [(0.1, 0.5, 0.9), (0.2, 0.6, 0.9)],
                grout: (0.6, 0.6, 0.6), grout_width_m: 0.01, variation: 0.1, seed: 3)),
        ),
        (
            name: "ball",
            shape: UvSphere(radius_m: 0.5),
            transform: (translate: (0, 1, 0), rotate_deg: (0, 45, 0), scale: (1, -1, 1)),
            material: Mirror(reflectance: (0.9, 0.9, 0.9)),
        ),
        (shape: Cuboid(size_m: (1, 2, 3)), material: Dielectric(ior: 1.5, absorption: (0, 0, 0))),
        (shape: Torus(radius_m: 0.5, tube_radius_m: 0.1), material: Diffuse(albedo: Checker(size_m: 0.5))),
        (shape: Mesh("meshes/thing.ply"), material: Diffuse(albedo: Noise(low: (0, 0, 0), high: (1, 1, 1), octaves: 4))),
        (shape: Cylinder(), material: Diffuse(albedo: Solid(0.5, 0.5, 0.5))),
    ],
    tone: (exposure_ev: -3, shoulder: 0.3, white: 4, desaturation: 0.1),
    time_s: 2.5,
    techniques: (caustic_volumes: (radiometry: Paper, grid: (128, 64), eye_refraction: VirtualPlane, faces: Back, samples: 2)),
)
"#;

fn parse(text: &str) -> Result<Scene, SceneError> {
    scene::parse(text, "test.ron", Path::new(""))
}

/// Replaces `from`, which must occur exactly once in [`FULL`], by `to`; returns the text and the position of the mark `¦` in it.
fn edited(from: &str, to: &str) -> (String, (usize, usize)) {
    assert_eq!(FULL.matches(from).count(), 1, "`{from}` must occur once");
    marked(&FULL.replace(from, to))
}

/// The text without its mark `¦`, and the line and column of the mark.
fn marked(text: &str) -> (String, (usize, usize)) {
    let offset = text.find('¦').expect("a mark says where the error is expected");
    let line = text[..offset].matches('\n').count() + 1;
    let column = text[..offset].chars().rev().take_while(|&c| c != '\n').count() + 1;
    (text.replacen('¦', "", 1), (line, column))
}

/// Checks that the edit gives one error, whose message is `test.ron:line:column: rest` with the mark's line and column.
#[track_caller]
fn refuse(from: &str, to: &str, rest: &str) {
    let (text, (line, column)) = edited(from, to);
    refuse_text(&text, line, column, rest);
}

#[track_caller]
fn refuse_text(text: &str, line: usize, column: usize, rest: &str) {
    let error = parse(text).expect_err("the text has an error");
    assert_eq!(error.to_string(), format!("test.ron:{line}:{column}: {rest}"));
}

#[test]
fn full_scene_is_valid() {
    let scene = parse(FULL).unwrap();
    assert_eq!((scene.title.as_str(), scene.lights.len(), scene.objects.len()), ("ünïcödé", 4, 6));
    assert_eq!(scene.techniques.caustic_volumes.grid, Some((128, 64)));
    assert_eq!(scene.medium.g, 0.8);
}

#[test]
fn scene_survives_a_round_trip_through_serde() {
    let scene = parse(FULL).unwrap();
    let options = ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME | ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES);
    let text = options.to_string_pretty(&scene, ron::ser::PrettyConfig::new()).unwrap();
    let mut again = parse(&text).unwrap();
    again.source = scene.source.clone();
    assert_eq!(again, scene);
}

#[test]
fn smallest_scene_is_all_defaults() {
    let scene = parse("(camera: Orthographic(position: (0, 5, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 2))").unwrap();
    assert_eq!((scene.image.width, scene.image.height), (1280, 720));
    assert_eq!(scene.medium, scene::Medium::CLEAR);
    assert_eq!(scene.techniques, scene::TechniqueSettings::default());
    assert!(scene.water.is_none() && scene.lights.is_empty() && scene.objects.is_empty());
}

#[test]
fn errors_of_syntax_name_the_place() {
    refuse_text("", 1, 1, "found the end of the file, expected a value");
    refuse_text("Scene(\n  title: \"x\n", 2, 10, "found a string that is never closed, expected `\"` before the end of the file");
    refuse_text("Scene(\n  lights: [ // ]\n  ", 2, 11, "found `[` that is never closed, expected `]` before the end of the file");
    refuse("time_s: 2.5,", "time_s: 2.5 ¦;", "found `;`, expected `,` or `)`");
    refuse("(100, 100, 100)),", "(100, 100, 100)¦],", "found `]`, expected `,` or `)`");
    refuse("inner_deg: 10,", "inner_deg: 10¦", "found `outer_deg`, expected `,` or `)`");
    refuse("title: ", "title: ¦, ", "found `,`, expected a value");
}

#[test]
fn errors_of_nesting_name_the_first_bracket_too_many() {
    refuse_text(&"(".repeat(1 << 20), 1, 49, "found `(`, expected at most 48 brackets inside each other");
    refuse_text(&"[(a:".repeat(1 << 18), 1, 97, "found `[`, expected at most 48 brackets inside each other");
}

#[test]
fn errors_of_names_name_the_field_and_what_was_perhaps_meant() {
    refuse(
        "fov_deg: 60",
        "¦fov_degg: 60",
        "found unknown field `camera.Perspective.fov_degg` (did you mean `fov_deg`?), \
         expected one of: position, target, up, fov_deg, near_m, far_m",
    );
    refuse(
        "time_s: 2.5",
        "¦when: 2.5",
        "found unknown field `when`, \
         expected one of: title, image, camera, lights, environment, water, medium, objects, tone, time_s, techniques",
    );
    refuse(
        "Dielectric(ior: 1.5",
        "Dielectric(¦iro: 1.5",
        "found unknown field `objects[2].material.Dielectric.iro` (did you mean `ior`?), expected one of: ior, absorption",
    );
    refuse("white: 4,", "white: 4, ¦white: 5,", "tone.white: found a second `white`, expected each field once");
    refuse("medium: Custom", "¦title: \"again\", medium: Custom", "title: found a second `title`, expected each field once");
    refuse("aim: Along(0, -1, 0.5), ", "¦", "SKIP");
}
