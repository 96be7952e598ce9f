//! The seam for techniques: one folder and one line of a table, and nothing else knows a technique's name.

use std::fs;
use std::path::{Path, PathBuf};

use nephroid::caustics::{Feature, RenderOptions, Renderer, TECHNIQUES, Technique};
use nephroid::cli;

use crate::support::program::SMALL_SCENE;
use crate::support::{self, OWN, scene_of_size, techniques, with_coarse_parts};

/// Where results and the history are.
const NOT_SOURCE: &[&str] = &[".git", "target", "out", "artifacts", "shared"];

/// Files that are text.
const TEXT: &[&str] = &["rs", "wgsl", "md", "toml", "ron", "txt", "lock"];

/// What knows techniques by name though it is none: what a paper's own tables are, the pages that tell of them, and tests of one technique.
const ABOUT_ONE: &[&str] = &["src/cli/tables"];

/// Folders in which nothing but the techniques' own may know one by name.
const GENERIC: &[&str] = &["src", "tests/bits", "tests/support"];

/// All text files below a folder, sorted; folders named in `left_out` are not looked at.
fn text_files(folder: &Path, left_out: &[PathBuf]) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).expect("the folder is readable").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let mut files = Vec::new();
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if NOT_SOURCE.contains(&name.as_str()) || left_out.contains(&path) {
            continue;
        }
        if path.is_dir() {
            files.extend(text_files(&path, left_out));
        } else if path.extension().is_some_and(|e| TEXT.iter().any(|text| e == *text)) || name == "run" {
            files.push(path);
        }
    }
    files
}

/// The spellings of a technique's name: as in `--technique`, as a module, and as a type.
fn spellings(technique: &dyn Technique) -> [String; 3] {
    [technique.name().to_owned(), technique.settings().key().to_owned(), technique.settings().type_name().to_owned()]
}

/// Lines that have a technique's name, as `file:line: text`.
fn lines_that_name(technique: &dyn Technique, files: &[PathBuf]) -> Vec<String> {
    let root = support::path("");
    let mut found = Vec::new();
    for file in files {
        let text = fs::read_to_string(file).expect("the file is text");
        let spellings = spellings(technique);
        for (number, line) in text.lines().enumerate().filter(|(_, line)| spellings.iter().any(|name| line.contains(name.as_str()))) {
            found.push(format!("{}:{}: {}", file.strip_prefix(&root).unwrap_or(file).display(), number + 1, line.trim()));
        }
    }
    found
}

#[test]
fn a_technique_of_the_tests_is_one_folder_and_one_line() {
    assert!(!OWN.is_empty());
    for &technique in OWN.iter() {
        let folder = support::own_folder(technique).expect("a technique has a folder");
        let files = text_files(&support::path(""), &[folder]);
        assert!(files.len() > 300, "{}", files.len());
        let lines = lines_that_name(technique, &files);
        assert_eq!(lines.len(), 1, "{lines:#?}");
        assert!(
            lines[0].starts_with("tests/support/mod.rs:") && lines[0].ends_with(&format!("{},", technique.settings().key())),
            "{lines:?}"
        );
    }
}

#[test]
fn techniques_of_the_library_are_known_by_their_folder_and_one_line() {
    for &technique in TECHNIQUES.iter() {
        let folder = support::path("src/caustics").join(technique.settings().key());
        assert!(folder.is_dir(), "{}", folder.display());
        let mut left_out: Vec<PathBuf> = ABOUT_ONE.iter().map(|folder| support::path(folder)).collect();
        // Hashes are committed under the names of what they are of.
        left_out.extend([folder, support::path("tests/bits/hashes.txt")]);
        let files: Vec<PathBuf> = GENERIC.iter().flat_map(|folder| text_files(&support::path(folder), &left_out)).collect();
        let lines = lines_that_name(technique, &files);
        assert_eq!(lines.len(), 1, "{lines:#?}");
        assert!(lines[0].starts_with("src/caustics/lib.rs:"), "{lines:?}");
    }
}

#[test]
fn names_are_noticed_in_any_spelling() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.rs");
    let technique = OWN[0];
    for (text, count) in [("nothing", 0), (technique.name(), 1), ("use x::Y;\n", 0)] {
        fs::write(&file, text).expect("a file");
        assert_eq!(lines_that_name(technique, &text_files(folder.path(), &[])).len(), count, "{text}");
    }
    for name in spellings(technique) {
        fs::write(&file, format!("// one\n// {name}\n")).expect("a file");
        assert_eq!(lines_that_name(technique, &text_files(folder.path(), &[])).len(), 1, "{name}");
    }
}

/// What a technique says that it draws has light in its layer, and what it says that it does not draw has none.
#[test]
fn features_are_drawn_where_a_technique_covers_them() {
    for (name, feature) in [("analytic/flat_water.ron", Feature::WaterCaustics), ("ring.ron", Feature::SpecularCaustics)] {
        for &technique in TECHNIQUES.iter() {
            let mut scene = with_coarse_parts(scene_of_size(name, (48, 36)));
            scene.techniques.coarsen();
            technique.coarsen(&mut scene);
            assert!(feature.is_asked_by(&scene), "{name}");
            assert_eq!(technique.lacks(&scene).contains(&feature), !technique.covers(feature), "{name}");
            let layers = Some(vec!["caustic_irradiance".to_owned()]);
            let options = RenderOptions { technique: technique.name().to_owned(), layers, ..RenderOptions::default() };
            let rendered = Renderer::new(&scene, &options).expect("a renderer").render(&scene, None).expect("a picture");
            let layer = rendered.layers.get("caustic_irradiance").expect("the layer was asked for");
            let lit = layer.planes()[0].pixels().iter().any(|&e| e > 0.0);
            assert_eq!(lit, technique.covers(feature), "{}, {name}", technique.name());
        }
    }
}

#[test]
fn scenes_ask_for_what_they_have() {
    let asked = |objects: &str, rest: &str| {
        let text = format!(
            "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), objects: [{objects}], \
             lights: [Directional(aim: Along(0, -1, 0), irradiance: (1, 1, 1))], {rest})"
        );
        let scene = techniques().parse(&text, "asked", Path::new("")).unwrap_or_else(|error| panic!("{error}"));
        Feature::ALL.into_iter().filter(|feature| feature.is_asked_by(&scene)).collect::<Vec<_>>()
    };
    let (ball, glass) = ("(shape: UvSphere())", "(shape: UvSphere(), material: Dielectric(abbe: 59))");
    let mirror = "(shape: UvSphere(), material: Mirror())";
    let (water, smoke) = ("water: (model: AxisCosine())", "smoke: (min: (-1, 0, -1), max: (1, 1, 1), sigma_s: (1, 1, 1))");
    assert_eq!(asked(ball, ""), []);
    assert_eq!(asked(ball, water), [Feature::WaterCaustics]);
    assert_eq!(asked(mirror, ""), [Feature::SpecularCaustics]);
    assert_eq!(asked(glass, ""), [Feature::SpecularCaustics, Feature::Dispersion]);
    assert_eq!(asked(mirror, water), [Feature::WaterCaustics, Feature::SpecularCausticsBesideWater]);
    assert_eq!(asked(ball, smoke), [Feature::Smoke]);
}

/// The program itself, run in this process with the tests' own techniques added.
#[test]
fn the_command_line_takes_a_table_of_techniques() {
    let folder = tempfile::tempdir().expect("a folder");
    let technique = OWN[0];
    let (scene, picture) = (folder.path().join("small.ron"), folder.path().join("small.png"));
    fs::write(&scene, SMALL_SCENE).expect("the scene is written");
    let row = &technique.settings().rows()[0];
    let setting = format!("{}={}", row.key, (row.field)(technique.settings()).expect("a row of its own table").text());
    let words = ["nephroid", "render", &scene.display().to_string(), "--technique", technique.name(), "--size", "24x16", "--set", &setting]
        .map(std::ffi::OsString::from)
        .into_iter()
        .chain(["-o".into(), picture.clone().into_os_string()]);
    let words: Vec<_> = words.collect();
    let command = || match cli::parse(words.clone()) {
        Ok(cli::Parsed::Command(command)) => command,
        other => panic!("{other:?}"),
    };
    let refused = cli::run(command(), TECHNIQUES).expect_err("the library has no such technique").to_string();
    assert!(refused.contains(&format!("there is no technique `{}`", technique.name())), "{refused}");
    assert_eq!(cli::run(command(), techniques()).expect("it renders"), cli::Outcome::Done);
    assert!(fs::metadata(&picture).expect("the picture is there").len() > 100);
}
