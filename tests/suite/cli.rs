//! The program as a user meets it: exit codes, what goes to which stream, and what is left on disk.

use std::fs;

use crate::support::program::{files_below, nephroid, refuse};

/// Runs the program in an empty folder; it must be refused. The message.
fn refusal(arguments: &[&str]) -> String {
    refuse(tempfile::tempdir().unwrap().path(), arguments)
}

#[test]
fn help_and_version_go_to_stdout_and_succeed() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (vec!["--help"], "Usage: nephroid <COMMAND>"),
        (vec!["--version"], concat!("nephroid ", env!("CARGO_PKG_VERSION"))),
        (vec!["render", "--help"], "caustic_irradiance"),
        (vec!["list", "--help"], "techniques"),
    ] {
        let output = nephroid(folder.path()).args(&arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        assert!(String::from_utf8(output.stdout).unwrap().contains(expected), "{arguments:?}");
        assert!(output.stderr.is_empty(), "{arguments:?}");
    }
}

/// Without a driver a comparison is not run, and that is an error: it must never look like one that passed.
#[test]
fn comparisons_without_a_driver_are_not_run() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = nephroid(folder.path()).env("VK_DRIVER_FILES", "/no/such/driver.json").args(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    for arguments in [&["crosscheck", "--conformance"][..], &["crosscheck", "scene.ron"], &["crosscheck", "--all", "--json"]] {
        assert!(run(arguments).contains("not run: "), "{arguments:?}");
    }
    let scene = crate::support::path("scenes/analytic/flat_water.ron");
    let render = run(&["render", scene.to_str().unwrap(), "--backend", "wgpu", "-o", "a.png"]);
    let missing = if cfg!(feature = "wgpu") { "no Vulkan adapter" } else { "this build has no drivers" };
    assert!(run(&["list", "adapters"]).contains(missing) && render.contains(missing), "{render}");
    assert_eq!(files_below(folder.path()), Vec::<String>::new());
    assert!(refusal(&["render", "a.ron", "--adapter", "llvmpipe"]).contains("add --backend wgpu"));
}

#[test]
fn usage_errors_exit_with_2() {
    for (arguments, expected) in [
        (&[][..], "a command is missing\n\n"),
        (&["paint"], "unrecognized subcommand 'paint'"),
        (&["render"], "SCENE"),
        (&["render", "a.ron", "--size", "0x1"], "expected WIDTHxHEIGHT"),
        (&["render", "a.ron", "--size", "99999x1"], "expected WIDTHxHEIGHT"),
        (&["render", "a.ron", "--set", "novalue"], "expected KEY=VALUE"),
        (&["render", "a.ron", "--time", "-1"], "from 0 to 86400"),
        (&["render", "a.ron", "--threads", "0"], "0 is not in 1..=1024"),
        (&["render", "a.ron", "--memory-limit", "0"], "0 is not in 1.."),
        (&["render", "a.ron", "--radiometry", "magic"], "paper, physical"),
        (&["render", "a.ron", "--layers", "color,,depth"], "expected names"),
        (&["render", "a.ron", "--unknown"], "--unknown"),
        (&["list"], "a command is missing\n\n"),
        (&["list", "cats"], "unrecognized subcommand 'cats'"),
    ] {
        let message = refusal(arguments);
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
}

#[test]
fn tables_with_models_name_the_one_that_is_missing() {
    let message = refusal(&["tables", "--paper", "splatting", "--models", "nowhere"]);
    assert!(message.starts_with("a model cannot be read: nowhere/dragon_250k.ply: "), "{message}");
    let message = refusal(&["tables", "--paper", "light-volumes", "--table", "hits"]);
    assert!(message.starts_with("--table names a table of another paper"), "{message}");
    let message = refusal(&["tables", "--paper", "light-volumes", "--models", "."]);
    assert!(message.ends_with("use --paper splatting"), "{message}");
}

#[test]
fn contradictions_are_refused_before_anything_is_read() {
    for (arguments, expected) in [
        (&["render", "absent.ron", "-o", "a.gif"][..], "cannot tell from its name what to write to a.gif; a file ends in .png or .exr"),
        (&["render", "absent.ron", "-o", "a.png", "-o", "a.png"], "-o names a.png twice"),
        (&["render", "absent.ron", "--layers", "depth,depth", "-o", "a.exr"], "--layers names `depth` twice, again at place 2"),
        (&["render", "absent.ron", "--technique", "magic"], "there is no technique `magic`; the techniques are:"),
    ] {
        let message = refusal(arguments);
        assert!(message.starts_with(expected), "{arguments:?}: {message}");
    }
}

#[test]
fn scenes_are_listed_as_text_and_as_json() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("scenes/analytic")).unwrap();
    fs::write(folder.path().join("scenes/pool.ron"), "// A pool at noon.\n()").unwrap();
    fs::write(folder.path().join("scenes/analytic/flat.ron"), "// Flat water.\n()").unwrap();
    let list = |arguments: &[&str]| {
        let output = nephroid(folder.path()).args(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(list(&["list", "scenes"]), "scenes/analytic/flat.ron  Flat water.\nscenes/pool.ron           A pool at noon.\n");
    assert_eq!(list(&["list", "scenes", "scenes/analytic"]), "scenes/analytic/flat.ron  Flat water.\n");
    let lines: serde_json::Value = serde_json::from_str(&list(&["list", "scenes", "--json"])).unwrap();
    assert_eq!(lines[1], serde_json::json!({ "path": "scenes/pool.ron", "summary": "A pool at noon." }));
}

#[test]
fn listing_a_missing_folder_is_an_error() {
    assert!(refusal(&["list", "scenes"]).starts_with("cannot list the folder scenes: "));
}

#[test]
fn a_closed_pipe_is_not_an_error() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    // More than a pipe buffers, so that writing must meet the closed end.
    let summary = "x".repeat(4000);
    for index in 0..100 {
        fs::write(folder.path().join(format!("scenes/{index}.ron")), format!("// {summary}\n()")).unwrap();
    }
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("nephroid"))
        .args(["list", "scenes"])
        .current_dir(folder.path())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), String::from_utf8(output.stderr).unwrap()), (Some(0), String::new()));
}
