//! `nephroid trace` and `nephroid compare` as a user meets them: what they write and print, what bad input is told, and that an interrupted run
//! goes on to the same bytes.

use std::fs;
use std::path::Path;

use nephroid::image::{self, Layer, LayerSet, ToneMap, openexr, png};

use crate::support::program::{self, SMALL_SCENE, run, succeed};

/// A folder with a small scene of few pixels in it: a batch has at least as many photons.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let scene = SMALL_SCENE.replacen("Scene(", "Scene(image: (width: 160, height: 90),", 1);
    fs::write(folder.path().join("small.ron"), scene).expect("the folder is writable");
    folder
}

/// Exit code, standard output and standard error.
fn told(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = run(folder, arguments);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("output is text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn refuse(arguments: &[&str]) -> String {
    program::refuse(folder().path(), arguments)
}

#[test]
fn a_trace_writes_means_and_errors() {
    let folder = folder();
    let text = succeed(folder.path(), &["trace", "small.ron", "--photons", "200k", "-o", "a.exr", "-o", "a.png"]);
    for word in ["262144 photons", "photons/s", "noise", "landed", "emitted"] {
        assert!(text.contains(word), "{text}");
    }
    let layers = image::read(&folder.path().join("a.exr")).expect("the file is readable").layers;
    for name in [
        "caustic_irradiance",
        "caustic_irradiance_error",
        "caustic_irradiance_valid",
        "direct_irradiance",
        "direct_irradiance_error",
        "direct_irradiance_valid",
        "position",
        "normal",
    ] {
        assert!(layers.get(name).is_some(), "{name} is missing");
    }
    assert!(image::read(&folder.path().join("a.png")).is_ok());
    assert!(!folder.path().join("a.exr.state").exists(), "a finished run needs no state");
}

#[test]
fn results_do_not_depend_on_threads_and_the_seed_counts() {
    let folder = folder();
    let run = |threads: &str, seed: &str, file: &str| {
        succeed(folder.path(), &["trace", "small.ron", "--photons", "100k", "--threads", threads, "--seed", seed, "-o", file]);
        fs::read(folder.path().join(file)).expect("the file is readable")
    };
    let expected = run("1", "3", "a.exr");
    assert!(run("2", "3", "b.exr") == expected && run("7", "3", "c.exr") == expected, "threads change the result");
    assert!(run("2", "4", "d.exr") != expected, "the seed does not");
}

#[test]
fn volume_and_json_are_there_when_asked_for() {
    let folder = folder();
    let text = succeed(
        folder.path(),
        &["trace", "small.ron", "--photons", "1", "--volume", "--set", "medium.preset=Pool", "-o", "v.exr", "--json"],
    );
    let json: serde_json::Value = serde_json::from_str(&text).expect("the output is JSON");
    assert_eq!(json["finished"], true);
    assert!(json["imbalance"].as_f64().expect("a number").abs() < 1e-9);
    assert!(json["energy_w"]["scattered"].as_f64().expect("a number") > 0.0);
    let layers = image::read(&folder.path().join("v.exr")).expect("the file is readable").layers;
    assert!(json["photons_per_s"].as_f64().expect("a number") > 0.0);
    for name in ["caustic_irradiance", "godrays"] {
        assert!(json["noise"][name].as_f64().expect("a number") > 0.0, "{name}: {text}");
    }
    assert!(layers.get("direct_godrays").is_some());
    let light: f32 = layers.get("godrays").expect("the layer was asked for").planes()[0].pixels().iter().sum();
    assert!(light > 0.0 && light.is_finite());
}

#[test]
fn bad_input_is_told_in_one_message() {
    for (arguments, part) in [
        (&["trace", "small.ron", "--photons", "0"][..], "whole number from 1"),
        (&["trace", "small.ron", "--error", "2"], "above 0, at most 1"),
        (&["trace", "small.ron", "--time-limit", "0"], "above 0"),
        (&["trace", "absent.ron"], "absent.ron"),
        (&["trace", "small.ron", "-o", "a.jpg"], ".png or .exr"),
        (&["trace", "small.ron", "--resume", "-o", "a.exr"], "a.exr.state"),
        (&["trace", "small.ron", "--set", "water.ior=0.1", "-o", "a.exr"], "expected"),
        (&["trace", "small.ron", "--set", "medium.sigma_a=-1", "-o", "a.exr"], "sigma_a"),
        (&["trace", "small.ron", "--set", "trace.max_events=0", "-o", "a.exr"], "max_events"),
        (&["compare", "small.ron", "--techniques", "none"], "there is no technique `none`"),
        (&["compare", "small.ron", "--photons", "0"], "whole number from 1"),
        (&["compare", "absent.exr", "small.exr"], "absent.exr"),
    ] {
        let stderr = refuse(arguments);
        assert!(stderr.contains(part), "{arguments:?}: {stderr}");
    }
}

#[test]
fn a_time_limit_is_kept_or_told_to_be_too_short() {
    let folder = folder();
    let text = succeed(folder.path(), &["trace", "small.ron", "--time-limit", "4", "-o", "a.exr", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&text).expect("the output is JSON");
    let seconds = json["seconds"].as_f64().expect("a number");
    assert!(seconds < 4.4 && seconds > 2.0 && json["batches"].as_u64() >= Some(2), "{text}");
    let (code, _, stderr) = told(folder.path(), &["trace", "small.ron", "--time-limit", "0.001", "-o", "b.exr"]);
    assert_eq!(code, Some(2));
    assert!(stderr.contains("--time-limit 0.001 is too short") && stderr.contains("--resume"), "{stderr}");
    assert!(folder.path().join("b.exr.state").exists() && !folder.path().join("b.exr").exists());
    succeed(folder.path(), &["trace", "small.ron", "--photons", "1", "--resume", "-o", "b.exr"]);
}

#[test]
fn a_state_of_another_run_is_refused() {
    let folder = folder();
    fs::write(folder.path().join("a.exr.state"), b"not a state").expect("the folder is writable");
    let (code, _, stderr) = told(folder.path(), &["trace", "small.ron", "--resume", "-o", "a.exr"]);
    assert_eq!(code, Some(2));
    assert!(stderr.contains("cannot go on from a.exr.state"), "{stderr}");
    assert!(folder.path().join("a.exr.state").exists() && !folder.path().join("a.exr").exists());
}

#[cfg(unix)]
#[test]
fn an_interrupted_trace_goes_on_to_the_same_bytes() {
    use std::process::Command as Process;
    use std::time::{Duration, Instant};

    let folder = folder();
    let start = |photons: &str, file: &str, more: &[&str]| {
        Process::new(assert_cmd::cargo::cargo_bin!("nephroid"))
            .current_dir(folder.path())
            .args(["trace", "small.ron", "--photons", photons, "-o", file])
            .args(more)
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("the program runs")
    };
    // Long enough that it cannot have finished.
    let mut child = start("100G", "a.exr", &[]);
    std::thread::sleep(Duration::from_secs(1));
    let killed = Process::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill exists");
    assert!(killed.success());
    let asked = Instant::now();
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert!(asked.elapsed() < Duration::from_secs(60), "it took {:?} to stop", asked.elapsed());
    assert!(folder.path().join("a.exr").exists(), "what there was is not kept");
    let kept = fs::read(folder.path().join("a.exr.state")).expect("the state is kept");
    // The number of batches, after 16 bytes of name and 8 of digest.
    let batches = u64::from_le_bytes(kept[24..32].try_into().expect("eight bytes"));
    let photons = ((batches + 3) * (1 << 16)).to_string();
    assert_eq!(start(&photons, "a.exr", &["--resume"]).wait().expect("it ends").code(), Some(0));
    assert_eq!(start(&photons, "b.exr", &[]).wait().expect("it ends").code(), Some(0));
    let read = |name: &str| fs::read(folder.path().join(name)).expect("the file is there");
    assert!(read("a.exr") == read("b.exr"), "going on gives other bytes");
    assert!(!folder.path().join("a.exr.state").exists());
}

#[test]
fn two_pictures_are_compared_and_bounds_are_kept_or_told() {
    let folder = folder();
    for (seed, file) in [("1", "a.exr"), ("2", "b.exr")] {
        succeed(folder.path(), &["trace", "small.ron", "--photons", "2M", "--seed", seed, "-o", file]);
    }
    let text =
        succeed(folder.path(), &["compare", "a.exr", "b.exr", "-o", "ab.png", "--bound", "energy_ratio=0.01", "--bound", "bias=0.01"]);
    for word in ["caustic_irradiance", "energy_ratio", "rel_mse_net", "flip", "ab.png"] {
        assert!(text.contains(word), "{text}");
    }
    assert!(image::read(&folder.path().join("ab.png")).is_ok());
    let (code, stdout, stderr) = told(folder.path(), &["compare", "a.exr", "b.exr", "--bound", "mae=0.0000001"]);
    assert_eq!((code, stderr.as_str()), (Some(1), ""));
    assert!(stdout.contains("exceeded: b.exr: mae is"), "{stdout}");
    let same = succeed(folder.path(), &["compare", "a.exr", "a.exr", "--json", "--bound", "mse=0"]);
    let json: serde_json::Value = serde_json::from_str(&same).expect("the output is JSON");
    assert_eq!((&json["agrees"], &json["results"][0]["mse"]), (&true.into(), &0.0.into()));
}

#[test]
fn pictures_that_do_not_match_are_refused() {
    let folder = folder();
    succeed(folder.path(), &["trace", "small.ron", "--photons", "1", "-o", "a.exr", "-o", "a.png"]);
    succeed(folder.path(), &["trace", "small.ron", "--photons", "1", "--size", "8x8", "-o", "b.exr"]);
    for (arguments, part) in [
        (["compare", "a.exr", "b.exr", "--layer", "position"], "both must have the same size"),
        (["compare", "a.exr", "a.png", "--layer", "color"], "a.png is a PNG, which holds display values"),
        (["compare", "a.png", "a.png", "--layer", "color"], "--layer is for two EXR files"),
        (["compare", "a.exr", "a.exr", "--layer", "shine"], "has no layer `shine`; it has: caustic_irradiance"),
    ] {
        let (code, _, stderr) = told(folder.path(), &arguments);
        assert!(code == Some(2) && stderr.contains(part), "{arguments:?}: {stderr}");
    }
}

/// A picture far brighter than a display, of stripes this many pixels wide.
fn stripes(name: &str, width: usize) -> Layer {
    let pixels: Vec<[f32; 3]> = (0..24 * 24).map(|index| [if (index % 24 / width).is_multiple_of(2) { 10.0 } else { 90.0 }; 3]).collect();
    Layer::from_pixels(name, 24, 24, &pixels).expect("the picture is valid")
}

/// Writes layers as an EXR.
fn write_exr(folder: &Path, name: &str, all: &[Layer]) {
    let mut layers = LayerSet::new();
    for layer in all {
        layers.push(layer.clone()).expect("the layers are valid");
    }
    fs::write(folder.join(name), openexr::encode(&layers).expect("the layers can be encoded")).expect("the folder is writable");
}

/// Two EXR files that a display shows alike, white all over, and that have the one layer of a PNG. What they are, their signature says.
#[test]
fn files_are_compared_as_what_their_signature_says() {
    let folder = folder();
    let (folder, depth) = (folder.path(), stripes("depth", 1));
    let (a, b) = (stripes("color", 3), stripes("color", 4));
    write_exr(folder, "a.exr", std::slice::from_ref(&a));
    write_exr(folder, "b.exr", std::slice::from_ref(&b));
    write_exr(folder, "a_two.exr", &[a.clone(), depth.clone()]);
    write_exr(folder, "b_two.exr", &[b.clone(), depth]);
    write_exr(folder, "b_exr.png", std::slice::from_ref(&b));
    let white = ToneMap { white: 1.0, ..ToneMap::default() };
    for (name, layer) in [("a.png", &a), ("b.png", &b), ("b_png.exr", &b)] {
        fs::write(folder.join(name), png::encode(layer, &white).expect("the picture can be encoded")).unwrap();
    }
    fs::write(folder.join("scene.exr"), SMALL_SCENE).unwrap();
    fs::write(folder.join("empty.png"), "").unwrap();

    let flip = |reference: &str, test: &str| {
        let (code, stdout, stderr) = told(folder, &["compare", reference, test, "--json", "--bound", "flip=0.01"]);
        let json: serde_json::Value = serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{reference} {test}: {error}: {stderr}"));
        (code, json["results"][0]["flip"].as_f64().expect("FLIP is a number"))
    };
    let (code, right) = flip("a_two.exr", "b_two.exr");
    assert!(code == Some(1) && right > 0.1, "FLIP of pictures that differ is {right}, exit code {code:?}");
    for (reference, test) in [("a.exr", "b.exr"), ("a.exr", "b_two.exr"), ("a_two.exr", "b.exr"), ("a.exr", "b_exr.png")] {
        assert_eq!(flip(reference, test), (Some(1), right), "{reference} against {test}");
    }
    let (code, swapped) = flip("b_exr.png", "a.exr");
    assert!(code == Some(1) && swapped > 0.1, "the other way around FLIP is {swapped}, exit code {code:?}");
    // As PNGs, they are the same.
    assert_eq!(flip("a.png", "b.png"), (Some(0), 0.0));
    assert_eq!(flip("a.png", "b_png.exr"), (Some(0), 0.0));

    for (png, exr) in [("a.png", "b.exr"), ("a.png", "b_two.exr"), ("a.png", "b_exr.png"), ("b_png.exr", "a.exr")] {
        let (png_is, exr_is) =
            (format!("{png} is a PNG, which holds display values"), format!("{exr} is an EXR, which holds linear values"));
        for (arguments, message) in [([png, exr], format!("{png_is}, {exr_is}")), ([exr, png], format!("{exr_is}, {png_is}"))] {
            let (code, stdout, stderr) = told(folder, &["compare", arguments[0], arguments[1], "--bound", "flip=0.01"]);
            let expected = format!("nephroid: {message}: compare two files of one kind\n");
            assert_eq!((code, stdout.as_str(), stderr), (Some(2), "", expected), "{arguments:?}");
        }
    }
    for (other, seen) in [("scene.exr", "starts with"), ("empty.png", "is empty")] {
        for arguments in [["compare", other, "a.exr"], ["compare", "a.png", other]] {
            let (code, stdout, stderr) = told(folder, &arguments);
            let start = format!("nephroid: {other} is neither a PNG nor an EXR: it {seen}");
            assert!(code == Some(2) && stdout.is_empty() && stderr.starts_with(&start), "{arguments:?}: {stderr}");
            assert!(stderr.ends_with("a PNG starts with 89 50 4e 47 0d 0a 1a 0a, an EXR with 76 2f 31 01\n"), "{stderr}");
        }
    }
}

#[test]
fn techniques_are_compared_with_the_truth_of_a_scene() {
    let folder = folder();
    let text = succeed(
        folder.path(),
        &[
            "compare",
            "small.ron",
            "--techniques",
            "all",
            "--photons",
            "2M",
            "--size",
            "64x48",
            "--bound",
            "energy_ratio=0.2",
            "-o",
            "c.png",
        ],
    );
    for word in ["ground truth of small.ron", "energy_ratio", "view_px", "c.caustic-volumes.png", "c.light-volumes.png"] {
        assert!(text.contains(word), "{text}");
    }
    let paper = [
        "compare",
        "small.ron",
        "--photons",
        "1M",
        "--set",
        "caustic_volumes.radiometry=paper",
        "--bound",
        "energy_ratio=0.01",
        "-o",
        "p.png",
    ];
    let (code, stdout, _) = told(folder.path(), &paper);
    assert_eq!(code, Some(1), "the paper's equation conserves energy: {stdout}");
}
