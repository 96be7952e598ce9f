//! `nephroid render` as a user meets it: what is written, what is printed, and that nothing is left when it fails.

use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::Duration;

use nephroid::image::{self, STANDARD_LAYERS};

use crate::support::program::{self, SMALL_SCENE, files_below as files};

/// A folder with a small scene in it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    fs::write(folder.path().join("small.ron"), SMALL_SCENE).expect("the folder is writable");
    folder
}

fn render<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    [&["render"], arguments].concat()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    program::run(folder, &render(arguments))
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    program::succeed(folder, &render(arguments))
}

/// Runs with arguments that must be refused, in one line.
fn refuse(arguments: &[&str]) -> String {
    let message = program::refuse(folder().path(), &render(arguments));
    assert_eq!(message.lines().count(), 1, "{arguments:?}: {message}");
    message
}

#[test]
fn both_files_are_written_to_out_by_default() {
    let folder = folder();
    let text = succeed(folder.path(), &["small.ron", "--size", "64x48"]);
    assert_eq!(files(folder.path()), ["out/small.exr", "out/small.png", "small.ron"]);
    assert!(
        text.starts_with("small.ron: ") && text.contains("64x48") && text.contains("out/small.png") && text.contains("energy"),
        "{text}"
    );

    let layers = image::read(&folder.path().join("out/small.exr")).expect("the EXR is valid").layers;
    // All that caustic volumes have, in the table's order: no light scattered in the water, no stencil.
    let absent = ["volume", "godrays", "stencil_count"];
    let expected: Vec<_> = STANDARD_LAYERS.iter().filter(|layer| !absent.contains(&layer.name)).collect();
    assert!(layers.names().eq(expected.iter().map(|layer| layer.name)));
    for (layer, standard) in layers.iter().zip(expected) {
        assert_eq!((layer.width(), layer.height(), layer.channel_count()), (64, 48, standard.channels), "{}", standard.name);
    }
    let picture = image::read(&folder.path().join("out/small.png")).expect("the PNG is valid").layers;
    let color = picture.get("color").expect("a PNG is the layer color");
    assert_eq!((color.width(), color.height(), color.channel_count()), (64, 48, 3));
    assert!(color.planes()[1].pixels().iter().any(|value| *value > 0.0), "the picture is black");
}

#[test]
fn json_tells_files_layers_energy_and_counters() {
    let folder = folder();
    let text = succeed(folder.path(), &["small.ron", "--size", "32x24", "--json", "--threads", "2", "-o", "a.exr"]);
    let report: serde_json::Value = serde_json::from_str(&text).expect("the result is JSON");
    assert_eq!(report["scene"], "small.ron");
    assert_eq!(report["technique"], "caustic-volumes");
    assert_eq!(report["files"], serde_json::json!(["a.exr"]));
    assert_eq!(report["layers"][0], serde_json::json!({ "name": "color", "width": 32, "height": 24, "channels": 3 }));
    assert_eq!(report["threads"], 2);
    assert!(report["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0));
    assert!(
        report["counters"].as_object().is_some_and(|counters| !counters.is_empty() && counters.values().all(serde_json::Value::is_u64))
    );
    assert!(report["energy_w"].as_object().is_some_and(|energy| !energy.is_empty() && energy.values().all(serde_json::Value::is_f64)));
    assert_eq!(files(folder.path()), ["a.exr", "small.ron"]);
}

#[test]
fn chosen_layers_are_the_only_ones_written() {
    let folder = folder();
    succeed(folder.path(), &["small.ron", "--size", "16x16", "--layers", "depth,caustic_irradiance", "-o", "a.exr"]);
    let layers = image::read(&folder.path().join("a.exr")).expect("the EXR is valid").layers;
    let mut names: Vec<_> = layers.names().collect();
    names.sort_unstable();
    assert_eq!(names, ["caustic_irradiance", "depth"]);
}

#[test]
fn files_do_not_depend_on_the_number_of_threads_or_the_run() {
    let bytes = |threads: &str| {
        let folder = folder();
        succeed(folder.path(), &["small.ron", "--size", "80x60", "--threads", threads]);
        ["out/small.png", "out/small.exr"].map(|name| fs::read(folder.path().join(name)).expect("the file was written"))
    };
    let one = bytes("1");
    assert!(one == bytes("1") && one == bytes("2") && one == bytes("7"));
}

#[test]
fn flags_change_the_scene_and_the_last_setting_wins() {
    let render = |arguments: &[&str]| {
        let folder = folder();
        succeed(folder.path(), &[&["small.ron", "-o", "a.exr"], arguments].concat());
        fs::read(folder.path().join("a.exr")).expect("the file was written")
    };
    let small = render(&["--size", "24x16"]);
    assert_eq!(render(&["--set", "image.width=24", "--set", "image.height=16"]), small);
    assert_eq!(render(&["--size", "99x99", "--set", "image.width=24", "--set", "image.height=5", "--set", "image.height=16"]), small);
    assert_ne!(render(&["--size", "24x16", "--time", "1.25"]), small);
    assert_eq!(render(&["--size", "24x16", "--time", "1.25"]), render(&["--size", "24x16", "--set", "time_s=1.25"]));
    let paper = render(&["--size", "24x16", "--radiometry", "paper"]);
    assert_eq!(render(&["--size", "24x16", "--set", "caustic-volumes.radiometry=paper"]), paper);
}

/// Each frame of a sequence has the bytes of a render of that moment alone.
#[test]
fn a_sequence_is_numbered_and_its_frames_are_those_of_their_moments() {
    let folder = folder();
    let text = fs::read_to_string(folder.path().join("small.ron")).expect("the scene is there");
    let moving =
        text.replacen("lights:", "motion: [(of: LightPosition(0), course: Keys([(0, (0.4, 1, 0)), (1, (-0.4, -0.2, 0.1))]))], lights:", 1);
    let lamp = "lights: [Point(position: (0, 1, 0), intensity: (9, 9, 9))],";
    let rest = moving.split_once("lights:").expect("the scene has lights").1;
    let end = rest.find("],").expect("the lights end") + 2;
    fs::write(folder.path().join("moving.ron"), moving.replacen(&format!("lights:{}", &rest[..end]), lamp, 1))
        .expect("the folder is writable");

    let size = ["moving.ron", "--size", "48x32"];
    succeed(folder.path(), &[&size[..], &["--frames", "3", "--frame-s", "0.5", "-o", "all.exr"]].concat());
    assert_eq!(files(folder.path()), ["all.0000.exr", "all.0001.exr", "all.0002.exr", "moving.ron", "small.ron"]);
    let mut seen = Vec::new();
    for (k, time) in ["0", "0.5", "1"].into_iter().enumerate() {
        succeed(folder.path(), &[&size[..], &["--time", time, "-o", "one.exr"]].concat());
        let bytes = |name: &str| fs::read(folder.path().join(name)).expect("it was written");
        let one = bytes("one.exr");
        assert!(one == bytes(&format!("all.000{k}.exr")), "frame {k} is not that of {time} s");
        assert!(!seen.contains(&one), "nothing moved until {time} s");
        seen.push(one);
    }
    for wrong in [
        &["--frames", "0"][..],
        &["--frame-s", "0.5"],
        &["--frames", "2", "--frame-s=-1"],
        &["--frames", "2", "--frame-s", "nan"],
        &["--frame-s", "1e40", "--frames", "2"],
    ] {
        let message = program::refuse(folder.path(), &[&["render"], &size[..], wrong].concat());
        assert!(message.contains(wrong[0]) || message.contains("--frame-s"), "{wrong:?}: {message}");
    }
}

/// Without a technique's name, the one is taken that draws most of the scene; what a named one does not draw is said in one line, and in the JSON.
#[test]
fn the_default_technique_follows_the_scene_and_what_is_not_drawn_is_said() {
    let folder = folder();
    let ball = "Scene(camera: Perspective(position: (0, 2, 3), target: (0, 0, 0)), lights: [Directional(aim: Along((0, -1, 0)), irradiance: (1, 1, 1))], objects: [
        (shape: UvSphere(radius_m: 0.4, slices: 32, stacks: 16), transform: (translate: (0, 0.6, 0)), material: Dielectric(ior: 1.5)), (shape: Grid(size_m: (4, 4)))])";
    fs::write(folder.path().join("ball.ron"), ball).expect("the folder is writable");
    let size = ["ball.ron", "--size", "32x24", "--json", "-o", "a.exr"];
    let report = |arguments: &[&str]| -> (serde_json::Value, String) {
        let output = run(folder.path(), arguments);
        assert!(output.status.success(), "{arguments:?}");
        (serde_json::from_slice(&output.stdout).expect("JSON"), String::from_utf8(output.stderr).expect("text"))
    };
    let (json, said) = report(&size);
    assert_eq!((json["technique"].as_str(), &json["not_drawn"], said.as_str()), (Some("splatting"), &serde_json::json!([]), ""));
    let red = |name: &str| {
        let layers = image::read(&folder.path().join(name)).expect("a picture").layers;
        layers.get("caustic_irradiance").expect("the layer").planes()[0].pixels().iter().copied().fold(0.0, f32::max)
    };
    assert!(red("a.exr") > 1.0, "no caustic below the ball: {}", red("a.exr"));

    let (json, said) = report(&[&size[..], &["--technique", "caustic-volumes"]].concat());
    assert_eq!(json["not_drawn"], serde_json::json!(["caustics of mirrors and glass"]));
    assert_eq!(said, "nephroid: ball.ron: caustic-volumes does not draw caustics of mirrors and glass\n");
    let (json, said) = report(&["small.ron", "--size", "32x24", "--json", "-o", "b.exr"]);
    assert_eq!((json["technique"].as_str(), &json["not_drawn"], said.as_str()), (Some("caustic-volumes"), &serde_json::json!([]), ""));
}

/// Beside water no technique draws caustics of mirrors and glass, wherever they are; each says so, and the layer has none.
#[test]
fn what_mirrors_and_glass_lack_beside_water_is_said_by_name() {
    let folder = folder();
    let mirror = "Mirror(reflectance: (0.9, 0.9, 0.9))";
    let glass = "Dielectric(ior: 1.5)";
    for (name, height, material) in
        [("mirror_in", -0.6, mirror), ("glass_in", -0.6, glass), ("glass_over", 0.6, glass), ("mirror_over", 0.6, mirror)]
    {
        let scene = format!(
            "Scene(camera: Perspective(position: (0, 2, 3), target: (0, 0, 0)), lights: [Directional(aim: Along((0, -1, 0)), irradiance: (1, 1, 1))],
            water: (size_m: (2, 2), grid: (9, 9), model: Flat), medium: Vacuum, objects: [
            (shape: UvSphere(radius_m: 0.3, slices: 32, stacks: 16), transform: (translate: (0, {height}, 0)), material: {material}),
            (shape: Grid(size_m: (4, 4)), transform: (translate: (0, -1, 0)))])"
        );
        fs::write(folder.path().join(format!("{name}.ron")), scene).expect("the folder is writable");
        for technique in ["caustic-volumes", "light-volumes", "splatting"] {
            let file = format!("{name}.ron");
            let lacks = "caustics of mirrors and glass in a scene with water";
            let said = format!("nephroid: {file}: {technique} does not draw {lacks}\n");
            let render =
                ["render", &file, "--size", "48x36", "--json", "--technique", technique, "--layers", "caustic_irradiance", "-o", "a.exr"];
            let compare = ["compare", &file, "--size", "16x12", "--photons", "1k", "--json", "--techniques", technique, "-o", "a.png"];
            for arguments in [&render[..], &compare] {
                let output = program::run(folder.path(), arguments);
                assert_eq!(String::from_utf8(output.stderr).expect("text"), said, "{arguments:?}");
                let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
                if arguments[0] == "render" {
                    assert_eq!(json["not_drawn"], serde_json::json!([lacks]), "{json}");
                    let off = json["imbalance"].as_f64().expect("a number");
                    assert!(off < 1.0e-5 && json["energy_w"]["landed"].as_f64().is_some_and(|watts| watts > 0.0), "{json}");
                } else {
                    assert_eq!(json["results"][0]["not_drawn"], serde_json::json!([lacks]), "{json}");
                }
            }
            // Flat water lights the floor evenly; a ball that gathered light would make it brighter than what enters.
            let layers = image::read(&folder.path().join("a.exr")).expect("a picture").layers;
            let light = layers.get("caustic_irradiance").expect("the layer").planes()[0].pixels();
            let brightest = light.iter().copied().fold(0.0, f32::max);
            assert!(brightest > 0.9 && brightest < 1.02, "{name}, {technique}: {brightest}");
        }
    }
}

#[test]
fn bad_input_is_one_message_and_leaves_nothing() {
    for (arguments, expected) in [
        (&["absent.ron"][..], "absent.ron: cannot be read"),
        (&["."], ". does not name a scene file"),
        (&["small.ron", "--set", "no.such.key=1"], "cannot apply --set: unknown setting `no.such.key`"),
        (&["small.ron", "--set", "image.width=0"], "cannot apply --set: setting `image.width`"),
        (&["small.ron", "--layers", "color,nonsense"], "nonsense"),
        (&["small.ron", "--size", "8192x8192", "--memory-limit", "1"], "more than the limit of 1 MiB"),
        (&["small.ron", "-o", "no/such/folder/a.png"], "cannot write no/such/folder/a.png"),
    ] {
        let message = refuse(arguments);
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
}

#[test]
fn an_older_file_survives_a_failed_render() {
    let folder = folder();
    fs::write(folder.path().join("a.png"), b"older").expect("the folder is writable");
    let output = run(folder.path(), &["small.ron", "-o", "a.png", "--layers", "color,nonsense"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read(folder.path().join("a.png")).expect("the file is still there"), b"older");
    assert_eq!(files(folder.path()), ["a.png", "small.ron"]);
}

#[test]
fn a_folder_in_the_place_of_a_file_is_refused() {
    let folder = folder();
    fs::create_dir(folder.path().join("a.exr")).expect("the folder is writable");
    let output = run(folder.path(), &["small.ron", "-o", "a.exr"]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8(output.stderr).expect("errors are text");
    assert!(stderr.starts_with("nephroid: cannot write a.exr: "), "{stderr}");
    assert_eq!(files(folder.path()), ["small.ron"]);
}

/// Interrupted at many moments, the program ends with 130 and leaves whole files or none.
#[cfg(unix)]
#[test]
fn interrupts_leave_no_half_written_file() {
    let mut interrupted = 0;
    for wait_ms in [5, 20, 60, 150, 300, 500, 800, 1200] {
        let folder = folder();
        let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("nephroid"))
            .args(["render", "small.ron", "--size", "1600x1200"])
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(Duration::from_millis(wait_ms));
        let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
        let status = child.wait().expect("the program ends");
        if killed.success() && status.code() != Some(0) {
            interrupted += 1;
            // Before the handler is installed the signal itself ends the program, which has no exit code then.
            assert!([None, Some(130)].contains(&status.code()), "after {wait_ms} ms: {status}");
        }
        for name in files(folder.path()).iter().filter(|name| *name != "small.ron") {
            assert!(["out/small.png", "out/small.exr"].contains(&name.as_str()), "after {wait_ms} ms: {name} was left");
            image::read(&folder.path().join(name)).unwrap_or_else(|error| panic!("after {wait_ms} ms: {name}: {error}"));
        }
    }
    assert!(interrupted > 0, "the render always ended before it could be interrupted");
}
