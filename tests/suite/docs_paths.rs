//! Every path named in the README and in `docs/` exists, so that the documentation cannot outlive what it describes.
//!
//! A path is a link target, or a word in code (inline or fenced) that ends in `/`, has a known extension, or starts with a top-level folder.
//! Words in code are looked up from the root of the repository, then from `src/`; link targets from the folder of their document.
//! `out/` is where results go, and globs and placeholders name no file: these are passed over.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Endings that make a word in code a path.
const EXTENSIONS: &[&str] = &["rs", "ron", "md", "toml", "wgsl", "png", "exr", "ply", "obj", "glb", "gltf", "html"];

/// Folders whose name at the start makes a word in code a path.
const TOP_LEVEL: &[&str] = &["src", "scenes", "tests", "benches", "docs", "fuzz", ".ci"];

/// Results of the program: not part of the repository.
const RESULTS: &str = "out/";

#[test]
fn every_path_in_the_documentation_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut documents = markdown_files(&root.join("docs"));
    documents.insert(root.join("README.md"));
    let mut checked = 0;
    let mut missing = Vec::new();
    for document in documents {
        let text = fs::read_to_string(&document).unwrap_or_else(|error| panic!("cannot read {}: {error}", document.display()));
        let (count, wrong) = check(root, &document, &text);
        checked += count;
        missing.extend(wrong);
    }
    assert!(checked > 10, "only {checked} paths were found, so little was tested");
    assert!(missing.is_empty(), "{} wrong paths:\n{}", missing.len(), missing.join("\n"));
}

/// The number of paths that a document names, and a line for each that is wrong.
fn check(root: &Path, document: &Path, text: &str) -> (usize, Vec<String>) {
    let mut checked = 0;
    let mut wrong = Vec::new();
    let mut fenced = false;
    for (index, line) in text.lines().enumerate() {
        let mut report = |path: &str, problem: &str| {
            let name = document.strip_prefix(root).unwrap_or(document).display();
            wrong.push(format!("{name}:{}: `{path}` {problem}", index + 1));
        };
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
            continue;
        }
        let words: Vec<&str> =
            if fenced { line.split_whitespace().collect() } else { code_spans(line).into_iter().flat_map(str::split_whitespace).collect() };
        for path in words.into_iter().map(trim_punctuation).flat_map(expand_braces) {
            if path.starts_with('/') && path.len() > 1 && Path::new(&path).components().count() > 2 {
                report(&path, "belongs to one machine");
            } else if is_path(&path) {
                checked += 1;
                if !root.join(&path).exists() && !root.join("src").join(&path).exists() {
                    report(&path, "does not exist");
                }
            }
        }
        let targets = if fenced { Vec::new() } else { link_targets(line) };
        for target in targets {
            checked += 1;
            let folder = document.parent().expect("a document lies in a folder");
            if !folder.join(target.split('#').next().unwrap_or_default()).exists() {
                report(target, "does not exist");
            }
        }
    }
    (checked, wrong)
}

/// Whether a word in code names a file or folder of the repository.
fn is_path(word: &str) -> bool {
    let plain = !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
    if !plain || word.starts_with(RESULTS) || word.starts_with('/') || word.starts_with('-') || word.contains("..") {
        return false;
    }
    let first = word.split('/').next().unwrap_or_default();
    let known_ending =
        Path::new(word).extension().and_then(|extension| extension.to_str()).is_some_and(|extension| EXTENSIONS.contains(&extension));
    // `FILE.png` is a placeholder, `README.md` is not.
    let stem = Path::new(word).file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
    let placeholder = !word.ends_with(".md") && stem.chars().any(char::is_alphabetic) && stem.chars().all(|c| !c.is_ascii_lowercase());
    let folder = word.ends_with('/') && word.len() > 1;
    !placeholder && (known_ending || folder || (word.contains('/') && TOP_LEVEL.contains(&first)))
}

/// Takes away what surrounds a word: quotes, brackets, and the stop at the end of a sentence.
fn trim_punctuation(word: &str) -> &str {
    word.trim_matches(|c: char| "()[]\"',;:".contains(c)).trim_end_matches('.')
}

/// `a/{b,c}.rs` is `a/b.rs` and `a/c.rs`.
fn expand_braces(word: &str) -> Vec<String> {
    let parts = word.split_once('{').and_then(|(before, rest)| rest.split_once('}').map(|(middle, after)| (before, middle, after)));
    match parts {
        Some((before, middle, after)) => {
            middle.split(',').flat_map(|choice| expand_braces(&format!("{before}{}{after}", choice.trim()))).collect()
        }
        None => vec![word.to_owned()],
    }
}

/// The inline code of a line.
fn code_spans(line: &str) -> Vec<&str> {
    line.split('`').skip(1).step_by(2).collect()
}

/// The targets of links and pictures of a line, as far as they are files.
fn link_targets(line: &str) -> Vec<&str> {
    let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://") && !target.starts_with('#') && !target.starts_with("mailto:")).collect()
}

/// All Markdown files below a folder.
fn markdown_files(folder: &Path) -> BTreeSet<PathBuf> {
    let mut files = BTreeSet::new();
    for entry in fs::read_dir(folder).expect("folder is readable") {
        let path = entry.expect("folder entry is readable").path();
        if path.is_dir() {
            files.append(&mut markdown_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "md") {
            files.insert(path);
        }
    }
    files
}

/// What the test says of a made-up document in `docs/`.
fn verdict(text: &str) -> (usize, Vec<String>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    check(root, &root.join("docs/made_up.md"), text)
}

#[test]
fn missing_paths_are_found() {
    for text in [
        "See `src/math/absent.rs`.",
        "See `absent/lanes.rs`.",
        "See `math/absent/`.",
        "See `math/{lanes,absent}.rs`.",
        "```\ncargo run -- render scenes/absent.ron\n```",
        "A [link](absent.md).",
        "![picture](absent.png)",
        "In `/home/someone/nephroid`.",
        "Run `.ci/absent`.",
    ] {
        assert_eq!(verdict(text).1.len(), 1, "{text}");
    }
    assert_eq!(verdict("One.\nTwo `src/absent.rs`.").1, ["docs/made_up.md:2: `src/absent.rs` does not exist"]);
}

#[test]
fn existing_paths_and_other_words_pass() {
    for (text, count) in [
        ("See `src/math/lanes.rs`, `math/lanes.rs` and `math/`.", 3),
        ("See `math/{lanes,vector}.rs`.", 2),
        ("A [link](../Cargo.toml), [web](https://example.org/absent.md), [here](#part).", 1),
        ("```\ncargo test --release && cargo test   # Cargo.toml\n```", 1),
        ("Not `a/b`, `out/pool.png`, `x / y`, `W/m2`, `FILE.png`, `*.rs`, `wgpu::Tile`, `1/2` or src/absent.rs.", 0),
    ] {
        assert_eq!(verdict(text), (count, Vec::new()), "{text}");
    }
}
