//! Scene files from outside: the shipped scenes, every class of error with its exact place, every setting, and mutated files.

use std::fs;
use std::path::{Path, PathBuf};

use nephroid::caustics::TECHNIQUES;
use nephroid::caustics::caustic_volumes::CausticVolumes;
use nephroid::scene::{self, Scene, SceneError};

use crate::support::{self, Rng};

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
    TECHNIQUES.parse(text, "test.ron", Path::new(""))
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

/// Checks that each edit gives one error, whose message is `test.ron:line:column: rest` with the mark's line and column.
#[track_caller]
fn refuse_edits(edits: &[(&str, &str, &str)]) {
    refuse_texts(edits.iter().map(|(from, to, rest)| (edited(from, to), *rest)));
}

/// Checks that each text gives one error, with the place and the rest of the message that stand beside it.
#[track_caller]
fn refuse_texts<'a>(texts: impl IntoIterator<Item = ((String, (usize, usize)), &'a str)>) {
    let mut wrong = Vec::new();
    for ((text, (line, column)), rest) in texts {
        let expected = format!("test.ron:{line}:{column}: {rest}");
        let seen = parse(&text).map_or_else(|error| error.to_string(), |_| "no error".to_owned());
        if seen != expected {
            wrong.push(format!("expected {expected}\n  but saw {seen}"));
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn full_scene_is_valid() {
    let scene = parse(FULL).unwrap();
    assert_eq!((scene.title.as_str(), scene.lights.len(), scene.objects.len()), ("ünïcödé", 4, 6));
    assert_eq!(scene.techniques.get::<CausticVolumes>().grid, Some((128, 64)));
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
    assert_eq!(scene.techniques, scene::TechniqueSettings::new(&TECHNIQUES.known_settings()));
    assert!(scene.water.is_none() && scene.lights.is_empty() && scene.objects.is_empty());
}

#[test]
fn errors_of_syntax_name_the_place() {
    refuse_texts([
        (("".to_owned(), (1, 1)), "found the end of the file, expected a value"),
        (("Scene(\n  title: \"x\n".to_owned(), (2, 10)), "found a string that is never closed, expected `\"` before the end of the file"),
        (("Scene(\n  lights: [ // ]\n  ".to_owned(), (2, 11)), "found `[` that is never closed, expected `]` before the end of the file"),
    ]);
    refuse_edits(&[
        ("time_s: 2.5,", "time_s: 2.5 ¦;", "found `;`, expected `,` or `)`"),
        ("(100, 100, 100)),", "(100, 100, 100)¦],", "found `]`, expected `,` or `)`"),
        ("inner_deg: 10, outer", "inner_deg: 10 ¦outer", "found `outer_deg`, expected `,` or `)`"),
        ("title: ", "title: ¦, ", "found `,`, expected a value"),
    ]);
}

#[test]
fn errors_of_nesting_name_the_first_bracket_too_many() {
    refuse_texts([
        (("(".repeat(1 << 20), (1, 49)), "found `(`, expected at most 48 brackets inside each other"),
        (("[(a:".repeat(1 << 18), (1, 97)), "found `[`, expected at most 48 brackets inside each other"),
    ]);
}

#[test]
fn errors_of_names_name_the_field_and_what_was_perhaps_meant() {
    refuse_edits(&[
        (
            "fov_deg: 60",
            "¦fov_degg: 60",
            "found unknown field `camera.fov_degg` (did you mean `fov_deg`?), \
         expected one of: position, target, up, fov_deg, near_m, far_m",
        ),
        (
            "time_s: 2.5",
            "¦when: 2.5",
            "found unknown field `when`, \
         expected one of: title, image, camera, lights, environment, water, medium, smoke, objects, motion, tone, time_s, techniques, trace",
        ),
        (
            "Dielectric(ior: 1.5",
            "Dielectric(¦iro: 1.5",
            "found unknown field `objects[2].material.iro` (did you mean `ior`?), expected one of: ior, abbe, absorption",
        ),
        (
            "UvSphere(radius_m: 0.5)",
            "UvSphere(¦radius: 0.5)",
            "found unknown field `objects[1].shape.radius` (did you mean `radius_m`?), expected one of: radius_m, slices, stacks",
        ),
        ("white: 4,", "white: 4, ¦white: 5,", "tone.white: found a second `white`, expected each field once"),
        ("medium: Custom", "¦title: \"again\", medium: Custom", "title: found a second `title`, expected each field once"),
    ]);
}

#[test]
fn errors_of_missing_fields_name_the_value_that_lacks_them() {
    refuse_texts([(("Scene(title: \"x\")".to_owned(), (1, 1)), "scene: found no field `camera`, expected it to be given")]);
    refuse_edits(&[
        ("Directional(aim: Along(0, -1, 0.5), ", "¦Directional(", "lights[1]: found no field `aim`, expected it to be given"),
        ("(shape: Cuboid(size_m: (1, 2, 3)), ", "¦(", "objects[2]: found no field `shape`, expected it to be given"),
    ]);
}

#[test]
fn errors_of_type_name_the_value_and_what_it_should_be() {
    refuse_edits(&[
        ("width: 64", "width: ¦\"64\"", "image.width: found `\"64\"`, expected a whole number"),
        ("width: 64", "width: ¦6.5", "image.width: found `6.5`, expected a whole number"),
        ("width: 64", "width: ¦-1", "image.width: found `-1`, expected a whole number from 0 to 4294967295"),
        (
            "width: 64",
            "width: ¦99999999999999999999",
            "image.width: found `99999999999999999999`, expected a whole number from 0 to 4294967295",
        ),
        ("fov_deg: 60", "fov_deg: ¦wide", "camera.fov_deg: found `wide`, expected a number"),
        ("title: \"ünïcödé\"", "title: ¦5", "title: found `5`, expected a text in double quotes"),
        ("lights: [\n", "lights: ¦7, medium: Vacuum, xs: [\n", "lights: found `7`, expected a list in [square brackets]"),
        ("zenith: (1, 2, 3)", "zenith: ¦[1, 2, 3]", "environment.zenith: found `[1, 2, 3]`, expected values in (parentheses)"),
        ("zenith: (1, 2, 3)", "zenith: ¦(1, 2)", "environment.zenith: found `(1, 2)`, expected a sequence of 3 f32 values"),
        ("zenith: (1, 2, 3)", "zenith: (1, 2, 3, ¦4)", "environment.zenith[3]: found `4`, expected no more values"),
        ("zenith: (1, 2, 3)", "zenith: (1, ¦true, 3)", "environment.zenith[1]: found `true`, expected a number"),
        (
            "zenith: (1, 2, 3)",
            "zenith: ¦(x: 1, y: 2, z: 3)",
            "environment.zenith: found `(x: 1, y: 2, z: 3)`, expected values without names",
        ),
        ("(width: 64, height: 48)", "(¦64, 48)", "image: found `64`, expected the name of a field and a colon before it"),
        (
            "medium: Custom(",
            "medium: ¦Costal, xs: (",
            "medium: found `Costal`, expected one of: Vacuum, Clear, Pool, Coastal, Custom (did you mean `Coastal`?)",
        ),
        (
            "Mirror(reflectance: (0.9, 0.9, 0.9))",
            "¦Mirrror()",
            "objects[1].material: found `Mirrror()`, expected one of: Diffuse, Mirror, Dielectric (did you mean `Mirror`?)",
        ),
        (
            "radiometry: Paper",
            "radiometry: ¦paper",
            "techniques.caustic_volumes.radiometry: found `paper`, expected one of: Paper, Physical (did you mean `Paper`?)",
        ),
        ("seed: 3", "seed: ¦(3)", "objects[0].material.albedo.seed: found `(3)`, expected a whole number"),
        ("seed: 3", "seed: ¦3e2", "objects[0].material.albedo.seed: found `3e2`, expected a whole number"),
        ("grid: (128, 64)", "grid: (128, ¦6.4)", "techniques.caustic_volumes.grid[1]: found `6.4`, expected a whole number"),
        ("Mesh(\"meshes/thing.ply\")", "Mesh(¦7)", "objects[4].shape: found `7`, expected a text in double quotes"),
    ]);
}

#[test]
fn errors_of_range_name_the_value_and_its_range() {
    refuse_edits(&[
        ("width: 64", "width: ¦0", "image.width: found 0, expected a whole number from 1 to 16384"),
        ("height: 48", "height: ¦16385", "image.height: found 16385, expected a whole number from 1 to 16384"),
        (
            "position: (0.0, 3.0, 4.0)",
            "position: (0.0, ¦NaN, 4.0)",
            "camera.position[1]: found NaN, expected a number from -1000000 to 1000000 m",
        ),
        (
            "position: (0.0, 3.0, 4.0)",
            "position: (0.0, 3.0, ¦1e39)",
            "camera.position[2]: found inf, expected a number from -1000000 to 1000000 m",
        ),
        (
            "target: (0, 0, 0)",
            "target: ¦(0, 3, 4)",
            "camera.target: found (0, 3, 4), the camera's position, expected another point than the position",
        ),
        ("up: (0, 1, 0)", "up: ¦(0, 0, 0)", "camera.up: found (0, 0, 0), expected a direction whose length is from 1e-6 to 1e6"),
        (
            "up: (0, 1, 0)",
            "up: ¦(0, 6, 8)",
            "camera.up: found (0, 6, 8), which is along the view, expected a direction that is not along target − position",
        ),
        ("fov_deg: 60", "fov_deg: ¦0.5", "camera.fov_deg: found 0.5, expected a number from 1 to 170 degrees"),
        ("fov_deg: 60", "fov_deg: ¦171", "camera.fov_deg: found 171, expected a number from 1 to 170 degrees"),
        ("near_m: 0.1", "near_m: ¦0", "camera.near_m: found 0, expected a number from 0.0001 to 1000000 m"),
        ("near_m: 0.1, far_m: 50", "near_m: 50, far_m: ¦50", "camera.far_m: found 50, expected a distance above near_m = 50 m"),
        ("far_m: 50", "far_m: ¦-inf", "camera.far_m: found -inf, expected a number above 0, at most 1000000 m"),
        ("elevation_deg: 50", "elevation_deg: ¦90.5", "lights[0].aim.elevation_deg: found 90.5, expected a number from -90 to 90 degrees"),
        ("azimuth_deg: 30", "azimuth_deg: ¦-400", "lights[0].aim.azimuth_deg: found -400, expected a number from -360 to 360 degrees"),
        ("(900, 850, 800)", "(900, ¦-850, 800)", "lights[0].irradiance[1]: found -850, expected a number from 0 to 1000000000000 W/m²"),
        ("Along(0, -1, 0.5)", "¦Along(0, 0, 0)", "lights[1].aim: found (0, 0, 0), expected a direction whose length is from 1e-6 to 1e6"),
        ("Along(0, -1, 0.5)", "Along(0, ¦NaN, 0.5)", "lights[1].aim[1]: found NaN, expected a number from -1000000 to 1000000 m"),
        (
            "direction: (0, -1, 0)",
            "direction: ¦(0, 0, 0)",
            "lights[3].direction: found (0, 0, 0), expected a direction whose length is from 1e-6 to 1e6",
        ),
        ("inner_deg: 10", "inner_deg: ¦21", "lights[3].inner_deg: found 21, expected a number from 0 to 20 degrees (outer_deg)"),
        ("outer_deg: 20", "outer_deg: ¦90", "lights[3].outer_deg: found 90, expected a number above 0, at most 89 degrees"),
        (
            "horizon: (4, 5, 6)",
            "horizon: (¦-4, 5, 6)",
            "environment.horizon[0]: found -4, expected a number from 0 to 1000000000000 W/(m² sr)",
        ),
        (
            "angular_radius_deg: 0.3",
            "angular_radius_deg: ¦0",
            "environment.sun_disc.angular_radius_deg: found 0, expected a number from 0.01 to 45 degrees",
        ),
        (
            "ambient_irradiance: (7, 8, 9)",
            "ambient_irradiance: (7, 8, ¦-9)",
            "environment.ambient_irradiance[2]: found -9, expected a number from 0 to 1000000000000 W/m²",
        ),
        ("sigma_a: (0.1, 0.2, 0.3)", "sigma_a: (0.1, ¦-0.2, 0.3)", "medium.sigma_a[1]: found -0.2, expected a number from 0 to 1000 1/m"),
        (
            "sigma_s: (0.01, 0.01, 0.01)",
            "sigma_s: (¦NaN, 0.01, 0.01)",
            "medium.sigma_s[0]: found NaN, expected a number from 0 to 1000 1/m",
        ),
        ("g: 0.8", "g: ¦1", "medium.g: found 1, expected a number above -1 and below 1"),
        ("g: 0.8", "g: ¦-1.0", "medium.g: found -1, expected a number above -1 and below 1"),
        (
            "Grid(size_m: (4, 4))",
            "Grid(size_m: ¦(4, -4))",
            "objects[0].shape.size_m: found -4, expected above 0 and at most 10000 (metres)",
        ),
        ("Grid(size_m: (4, 4))", "Grid(cells: (4, ¦0))", "objects[0].shape.cells[1]: found 0, expected a whole number from 1 to 4096"),
        (
            "UvSphere(radius_m: 0.5)",
            "UvSphere(radius_m: ¦0)",
            "objects[1].shape.radius_m: found 0, expected above 0 and at most 10000 (metres)",
        ),
        ("tube_radius_m: 0.1", "tube_radius_m: ¦0.5", "objects[3].shape.tube_radius_m: found 0.5, expected below radius_m, 0.5"),
        (
            "Mesh(\"meshes/thing.ply\")",
            "Mesh(¦\"thing.stl\")",
            "objects[4].shape.Mesh: found \"thing.stl\", expected a file whose name ends in one of: .ply, .obj, .gltf, .glb",
        ),
        (
            "Mesh(\"meshes/thing.ply\")",
            "Mesh(¦\"/thing.ply\")",
            "objects[4].shape.Mesh: found \"/thing.ply\", expected a path relative to the scene file, its parts separated by `/`",
        ),
        (
            "size_m: (0.2, 0.2)",
            "size_m: (¦0, 0.2)",
            "objects[0].material.albedo.size_m[0]: found 0, expected a number above 0, at most 1000000 m",
        ),
        (
            "colours: [(0.1, 0.5, 0.9), (0.2, 0.6, 0.9)]",
            "colours: ¦[]",
            "objects[0].material.albedo.colours: found 0 elements, expected from 1 to 8 elements",
        ),
        ("(0.2, 0.6, 0.9)]", "(0.2, ¦1.6, 0.9)]", "objects[0].material.albedo.colours[1][1]: found 1.6, expected a number from 0 to 1"),
        (
            "grout_width_m: 0.01",
            "grout_width_m: ¦0.3",
            "objects[0].material.albedo.grout_width_m: found 0.3, expected a number from 0 to 0.2 m (the smaller side of a tile)",
        ),
        ("variation: 0.1", "variation: ¦-0.1", "objects[0].material.albedo.variation: found -0.1, expected a number from 0 to 1"),
        (
            "rotate_deg: (0, 45, 0)",
            "rotate_deg: (0, ¦361, 0)",
            "objects[1].transform.rotate_deg[1]: found 361, expected a number from -360 to 360 degrees",
        ),
        (
            "scale: (1, -1, 1)",
            "scale: (1, ¦0, 1)",
            "objects[1].transform.scale[1]: found 0, expected a number of magnitude from 1e-6 to 1e6",
        ),
        (
            "translate: (0, 1, 0)",
            "translate: (0, 1, ¦-2e6)",
            "objects[1].transform.translate[2]: found -2000000, expected a number from -1000000 to 1000000 m",
        ),
        (
            "reflectance: (0.9, 0.9, 0.9)",
            "reflectance: (0.9, 0.9, ¦1.1)",
            "objects[1].material.reflectance[2]: found 1.1, expected a number from 0 to 1",
        ),
        ("ior: 1.5", "ior: ¦0.99", "objects[2].material.ior: found 0.99, expected a number from 1 to 4"),
        (
            "absorption: (0, 0, 0)",
            "absorption: (0, ¦-1, 0)",
            "objects[2].material.absorption[1]: found -1, expected a number from 0 to 1000 1/m",
        ),
        (
            "Checker(size_m: 0.5)",
            "Checker(size_m: ¦-0.5)",
            "objects[3].material.albedo.size_m: found -0.5, expected a number above 0, at most 1000000 m",
        ),
        ("octaves: 4", "octaves: ¦9", "objects[4].material.albedo.octaves: found 9, expected a whole number from 1 to 8"),
        ("Solid(0.5, 0.5, 0.5)", "Solid(0.5, 0.5, ¦2)", "objects[5].material.albedo[2]: found 2, expected a number from 0 to 1"),
        ("exposure_ev: -3", "exposure_ev: ¦41", "tone.exposure_ev: found 41, expected a number from -40 to 40 stops"),
        ("shoulder: 0.3", "shoulder: ¦1", "tone.shoulder: found 1, expected a number from 0 to 0.99"),
        ("white: 4", "white: ¦0.5", "tone.white: found 0.5, expected a number from 1 to 1000000"),
        ("desaturation: 0.1", "desaturation: ¦-1", "tone.desaturation: found -1, expected a number from 0 to 10"),
        ("time_s: 2.5", "time_s: ¦-1", "time_s: found -1, expected a number from 0 to 86400 s"),
        ("grid: (128, 64)", "grid: (¦1, 64)", "techniques.caustic_volumes.grid[0]: found 1, expected a whole number from 2 to 4096"),
        ("samples: 2", "samples: ¦0", "techniques.caustic_volumes.samples: found 0, expected a whole number from 1 to 8"),
        (
            "samples: 2",
            "shadow_map_size: ¦8",
            "techniques.caustic_volumes.shadow_map_size: found 8, expected a whole number from 16 to 16384",
        ),
        ("samples: 2", "negligible_light: ¦0.6", "techniques.caustic_volumes.negligible_light: found 0.6, expected a number from 0 to 0.5"),
        (
            "samples: 2",
            "depth_below_floor: ¦-0.1",
            "techniques.caustic_volumes.depth_below_floor: found -0.1, expected a number from 0 to 1000 of the depth",
        ),
    ]);
}

#[test]
fn errors_of_values_left_to_their_default_name_the_value_around_them() {
    // far_m is not written, and its default of 100 m is below near_m.
    refuse_edits(&[(
        "camera: Perspective(position: (0.0, 3.0, 4.0), target: (0, 0, 0), up: (0, 1, 0), fov_deg: 60, near_m: 0.1, far_m: 50)",
        "camera: ¦Perspective(position: (0.0, 3.0, 4.0), target: (0, 0, 0), near_m: 100)",
        "camera.far_m: found 100, expected a distance above near_m = 100 m",
    )]);
}

#[test]
fn errors_of_water_name_its_values() {
    let edits = [
        ("water: (ior: ¦5)", "water.ior: found 5.0, expected 0.25 ..= 4"),
        ("water: (grid: ¦(1, 64))", "water.grid: found (1, 64), expected 2 ..= 4096 vertices along x and z"),
        (
            "water: Water(¦modl: Flat)",
            "found unknown field `water.modl` (did you mean `model`?), expected one of: center_m, size_m, level_m, ior, abbe, grid, model",
        ),
        ("water: (model: Waves([(), (), (wavelength_m: ¦NaN)]))", "water.model[2].wavelength_m: found NaN, expected 0.00001 ..= 100000 m"),
        ("water: (model: PipeFluid(drops: [(), (radius_m: ¦-1)]))", "water.model.drops[1].radius_m: found -1.0, expected 0.0001 ..= 100 m"),
        ("water: (model: FftOcean(resolution: ¦100))", "water.model.resolution: found 100, expected a power of two, 4 ..= 2048"),
        ("water: (model: CircularCosine(ripples: (octaves: ¦0)))", "water.model.ripples.octaves: found 0, expected 1 ..= 12"),
        ("water: (model: Tilted(slope: (0, 0), ¦tilt: 1))", "found unknown field `water.model.tilt`, expected one of: slope"),
        (
            "water: (model: ¦Wave([]))",
            "water.model: found `Wave([])`, \
             expected one of: Flat, Tilted, Waves, CircularCosine, AxisCosine, PipeFluid, FftOcean (did you mean `Waves`?)",
        ),
    ];
    let edits: Vec<_> = edits.iter().map(|(to, rest)| ("medium: Custom", format!("{to}, medium: Custom"), *rest)).collect();
    refuse_edits(&edits.iter().map(|(from, to, rest)| (*from, to.as_str(), *rest)).collect::<Vec<_>>());
    refuse_edits(&[(
        "time_s: 2.5",
        "water: (model: PipeFluid()), time_s: ¦4000",
        "time_s: found 4000.0, expected for a simulated fluid, from 0 to an hour or four million steps",
    )]);
}

#[test]
fn errors_of_files_name_the_file() {
    let missing = TECHNIQUES.load(Path::new("no/such/scene.ron")).unwrap_err();
    assert!(matches!(&missing, SceneError::Read { file, .. } if file == "no/such/scene.ron"), "{missing}");
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(TECHNIQUES.load(folder.path()).unwrap_err(), SceneError::Read { .. }), "a folder is no scene");

    let file = folder.path().join("large.ron");
    fs::write(&file, vec![b' '; scene::MAX_FILE_BYTES as usize + 1]).unwrap();
    assert!(matches!(TECHNIQUES.load(&file).unwrap_err(), SceneError::TooLarge { limit: scene::MAX_FILE_BYTES, .. }));
    let error = TECHNIQUES.parse(&" ".repeat(scene::MAX_FILE_BYTES as usize + 1), "x", Path::new("")).unwrap_err();
    assert!(matches!(error, SceneError::TooLarge { .. }));

    let error = TECHNIQUES.parse_bytes(b"Scene(\n  title: \"\xc3\xa4\xff\")", "latin.ron", Path::new("")).unwrap_err();
    assert_eq!(error.to_string(), "latin.ron:2:12: found byte 0xff, expected UTF-8 text");
}

#[test]
fn errors_of_meshes_name_the_object_in_the_scene_file_and_the_place_in_the_mesh_file() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("meshes")).unwrap();
    let file = folder.path().join("meshes/thing.ply");
    let (_, (line, column)) = edited("shape: Mesh(", "shape: ¦Mesh(");
    let scene = TECHNIQUES.parse(FULL, "test.ron", folder.path()).unwrap();
    let place = format!("test.ron:{line}:{column}: objects[4].shape: ");
    let message = scene.mesh(4).unwrap_err().to_string();
    assert!(message.starts_with(&place) && message.contains("thing.ply: "), "{message}");

    fs::write(&file, "ply\nformat ascii 1.0\nelement vertex many\n").unwrap();
    let message = scene.mesh(4).unwrap_err().to_string();
    assert!(message.starts_with(&place) && message.contains("thing.ply:3"), "{message}");

    fs::write(
        &file,
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    )
    .unwrap();
    for (index, object) in scene.objects.iter().enumerate() {
        assert!(scene.mesh(index).unwrap().triangle_count() > 0, "{}", object.display_name(index));
    }
    assert_eq!(scene.mesh(4).unwrap().triangle_count(), 1);
}

/// A triangle as a PLY.
const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// A scene reaches its own folder and those beside it. The error names the scene, the place in it and the rule, and nothing that the mesh holds.
#[test]
fn meshes_out_of_reach_are_refused_unopened() {
    let project = tempfile::tempdir().unwrap();
    let project = project.path().join("a/b");
    let scenes = project.join("scenes");
    for folder in [scenes.join("deep"), project.join("meshes")] {
        fs::create_dir_all(folder).unwrap();
    }
    for file in ["scenes/here.ply", "scenes/deep/there.ply", "meshes/beside.ply"] {
        fs::write(project.join(file), TRIANGLE).unwrap();
    }
    for file in ["above.ply", "../farther.ply"] {
        fs::write(project.join(file), "hush").unwrap();
    }
    let text = |mesh: &str| {
        let mesh = mesh.replace('\\', "\\\\");
        format!("(camera: Perspective(position: (0, 3, 4), target: (0, 0, 0)), objects: [(shape: Mesh(\"{mesh}\"))])")
    };
    let read = |mesh: &str| {
        let scene = TECHNIQUES.parse(&text(mesh), "reach.ron", &scenes)?;
        scene.mesh(0).map(|mesh| mesh.triangle_count())
    };
    let refused = |mesh: &str, rule: &str| {
        let message = read(mesh).unwrap_err().to_string();
        assert!(
            message.starts_with("reach.ron:1:") && message.contains("objects[0].shape") && message.ends_with(rule),
            "{mesh}: {message}"
        );
        assert!(!message.contains("hush"), "{mesh}: {message}");
    };
    for mesh in ["here.ply", "deep/there.ply", "deep/../here.ply", "../meshes/beside.ply", "../scenes/here.ply"] {
        assert_eq!(read(mesh), Ok(1), "{mesh}");
    }
    let reach = "a path to a file below the scene's folder or below a folder beside it";
    for mesh in [
        "../above.ply",
        "../../farther.ply",
        "deep/../../above.ply",
        "../meshes/../above.ply",
        "../../b/meshes/beside.ply",
        "../x/../../y.ply",
    ] {
        refused(mesh, reach);
    }
    let farther = project.parent().unwrap().join("farther.ply");
    let farther = farther.to_str().unwrap();
    let portable = "a path relative to the scene file, its parts separated by `/`";
    for mesh in [farther, &format!("file://{farther}"), "..\\above.ply", "deep\\..\\..\\above.ply", "C:above.ply", "//host/above.ply"] {
        refused(mesh, portable);
    }
    // A path is no URI: nothing is decoded.
    assert!(read("%2e%2e/above.ply").unwrap_err().to_string().contains("%2e%2e/above.ply: "));

    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        for (target, link) in [
            (farther, "scenes/absolute.ply"),
            ("../above.ply", "scenes/up.ply"),
            ("../scenes/up.ply", "meshes/again.ply"),
            ("../..", "scenes/out"),
            ("/dev", "devices"),
            ("/dev/zero", "scenes/zero.ply"),
        ] {
            symlink(target, project.join(link)).unwrap();
        }
        let rule = "which a link leads out of reach, is not supported: must lead to a file below the scene's folder or below a folder beside it, links included";
        for mesh in ["absolute.ply", "up.ply", "../meshes/again.ply", "out/farther.ply", "zero.ply"] {
            refused(mesh, rule);
        }
        symlink("../meshes/beside.ply", scenes.join("link.ply")).unwrap();
        assert_eq!(read("link.ply"), Ok(1));
        let made = std::process::Command::new("mkfifo").arg(scenes.join("pipe.ply")).status().unwrap();
        assert!(made.success());
        refused("pipe.ply", "pipe.ply: not a regular file");
    }
}

#[test]
fn limits_hold_on_counts() {
    let camera = "camera: Perspective(position: (0, 3, 4), target: (0, 0, 0))";
    let lights = |count: usize| format!("({camera}, lights: [{}])", "Point(position: (0, 0, 0), intensity: (1, 1, 1)),".repeat(count));
    assert_eq!(parse(&lights(16)).unwrap().lights.len(), 16);
    let error = parse(&lights(17)).unwrap_err().to_string();
    assert!(error.ends_with("lights: found 17 elements, expected from 0 to 16 elements"), "{error}");

    let objects = |count: usize, shape: &str| format!("({camera}, objects: [{}])", format!("(shape: {shape}),").repeat(count));
    assert_eq!(parse(&objects(0, "")).unwrap().objects.len(), 0);
    assert_eq!(parse(&objects(scene::MAX_OBJECTS, "Cuboid()")).unwrap().objects.len(), scene::MAX_OBJECTS);
    let error = parse(&objects(scene::MAX_OBJECTS + 1, "Cuboid()")).unwrap_err().to_string();
    assert!(error.contains("objects: ") && error.ends_with("expected a list of at most 4096 objects"), "{error}");
    let error = parse(&objects(3, "Terrain(cells: (4096, 4096))")).unwrap_err().to_string();
    assert!(error.contains("objects[1].shape: found a shape that brings the scene to 67108864 triangles"), "{error}");
}

/// All shipped scenes.
fn shipped() -> Vec<PathBuf> {
    support::shipped_scenes().iter().map(|name| support::path("scenes").join(name)).collect()
}

#[test]
fn shipped_scenes_are_valid_and_say_what_they_exercise() {
    let shipped = shipped();
    let analytic =
        ["cap", "cardioid", "crossed_sines", "flat_water", "glass_ball", "matched", "mirror_ring", "sine_water", "slab", "wedge"];
    let mut wanted: Vec<String> = analytic.iter().map(|name| format!("analytic/{name}.ron")).collect();
    let others = [
        "ball",
        "bath",
        "bowl",
        "columns",
        "companions",
        "courtyard",
        "figure",
        "glass",
        "jetty",
        "knots",
        "lido",
        "pool",
        "pots",
        "ring",
        "sinking_lamp",
        "tablecloth",
    ];
    wanted.extend(others.iter().map(|name| format!("{name}.ron")));
    assert_eq!(support::shipped_scenes(), wanted);
    for path in &shipped {
        let scene = TECHNIQUES.load(path).unwrap_or_else(|error| panic!("{error}"));
        assert!(!scene.title.is_empty() && !scene.lights.is_empty(), "{}", path.display());
        let specular = scene.water.is_some() || scene.objects.iter().any(|o| !matches!(o.material, scene::Material::Diffuse { .. }));
        assert!(specular, "{} has nothing that makes a caustic", path.display());
        let text = fs::read_to_string(path).unwrap();
        for wanted in ["// Exercises:", "// Analytic answer:"] {
            assert!(text.lines().any(|line| line.starts_with(wanted)), "{} lacks `{wanted}`", path.display());
        }
        for (index, object) in scene.objects.iter().enumerate() {
            assert!(!object.name.is_empty(), "object {index} of {} has no name", path.display());
            let mesh = scene.mesh(index).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(mesh.validate(), Ok(()), "{} of {}", object.name, path.display());
        }
    }
}

#[test]
fn shipped_scenes_take_every_setting_they_report() {
    for path in shipped() {
        let scene = TECHNIQUES.load(&path).unwrap();
        for setting in scene.settings() {
            if let Some(value) = setting.get(&scene) {
                let mut changed = scene.clone();
                changed.set(setting.key, &value).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
                assert_eq!(setting.get(&changed), Some(value), "{} of {}", setting.key, path.display());
            }
        }
    }
}

#[test]
fn mutated_scenes_never_panic_and_every_error_has_a_place() {
    let pieces: [&[u8]; 24] = [
        b"(",
        b")",
        b"[",
        b"]",
        b"{",
        b"}",
        b",",
        b":",
        b"\"",
        b"'",
        b"//",
        b"/*",
        b"*/",
        b"NaN",
        b"-1",
        b"1e39",
        b"0",
        b"Some(",
        b"None",
        b"r#\"",
        b"\\",
        b"4294967295",
        b"#![",
        b"\xff",
    ];
    let mut seeds = vec![FULL.as_bytes().to_vec()];
    seeds.extend(shipped().iter().map(|path| fs::read(path).unwrap()));
    let mut rng = Rng(1);
    let (mut accepted, mut refused) = (0, 0);
    for round in 0..6000 {
        let mut bytes = seeds[round % seeds.len()].clone();
        for _ in 0..=rng.below(3) {
            let at = rng.below(bytes.len());
            match rng.below(5) {
                0 => bytes.truncate(at.max(1)),
                1 => drop(bytes.drain(at..(at + 1 + rng.below(12)).min(bytes.len()))),
                2 => bytes[at] = rng.below(256) as u8,
                3 => drop(bytes.splice(at..at, pieces[rng.below(pieces.len())].iter().copied())),
                _ => {
                    let end = (at + rng.below(80)).min(bytes.len());
                    let copy = bytes[at..end].to_vec();
                    let to = rng.below(bytes.len());
                    drop(bytes.splice(to..to, copy));
                }
            }
            if bytes.is_empty() {
                bytes.push(b' ');
            }
        }
        match TECHNIQUES.parse_bytes(&bytes, "m", Path::new("")) {
            Ok(scene) => {
                assert_eq!(scene.validate(), Ok(()));
                accepted += 1;
            }
            Err(error) => {
                let message = error.to_string();
                let mut place = message.strip_prefix("m:").unwrap().splitn(3, ':');
                let line: usize = place.next().unwrap().parse().unwrap_or_else(|_| panic!("{message}"));
                let column: usize = place.next().unwrap().parse().unwrap_or_else(|_| panic!("{message}"));
                let lines = String::from_utf8_lossy(&bytes).split('\n').count();
                assert!((1..=lines).contains(&line) && column >= 1, "{message}");
                refused += 1;
            }
        }
    }
    assert!(accepted > 200 && refused > 2000, "{accepted} accepted, {refused} refused: the mutations are too tame or too wild");
}

#[test]
fn corpus_of_the_fuzz_target_never_panics() {
    let corpus = support::path("fuzz/corpus/scene");
    let mut count = 0;
    for entry in fs::read_dir(corpus).unwrap() {
        let path = entry.unwrap().path();
        let valid = TECHNIQUES.parse_bytes(&fs::read(&path).unwrap(), "corpus", Path::new("")).is_ok();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        assert_eq!(valid, name.starts_with("valid"), "{name}");
        count += 1;
    }
    assert!(count >= 12, "{count}");
}
