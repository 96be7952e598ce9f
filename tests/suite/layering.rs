//! What Cargo cannot see of the layers in `docs/architecture.md`, enforced on the source text.
//!
//! Between crates Cargo holds them, as long as the manifests do: [`CRATES`]. Inside of a crate, a path that starts with `crate::`, or with enough
//! `super::` to leave its room, must lead to a lower room: [`ROOMS`]. Below the command line nothing may touch the clock, the environment, the
//! terminal, processes or threads, and only [`READS_FILES`] open files. Comments, strings and attributes of rustdoc are not looked at.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support;

/// The crates, lowest first, each with the other crates of the project that it may depend on.
const CRATES: &[(&str, &[&str])] = &[
    ("math", &[]),
    ("pipeline", &["math"]),
    ("image", &["math"]),
    ("scene", &["math"]),
    // The ground truth must not share a mistake with what it judges.
    ("trace", &["math", "scene"]),
    ("caustics", &["math", "pipeline", "image", "scene"]),
    ("gpu", &["math", "pipeline", "image"]),
];

/// A folder of `src` with rules of its own.
struct Room {
    folder: &'static str,
    /// Inside of a crate, a room uses lower ones only.
    level: u32,
}

const fn room(folder: &'static str, level: u32) -> Room {
    Room { folder, level }
}

/// The rooms. A file in none of them fails the test.
const ROOMS: &[Room] = &[
    room("math", 0),
    room("pipeline", 0),
    room("pipeline/frame", 1),
    room("image", 0),
    room("image/metrics", 1),
    room("image/report", 2),
    room("scene", 1),
    room("scene/geom", 0),
    room("trace", 0),
    room("caustics", 1),
    room("caustics/passes", 0),
    room("gpu", 0),
    room("cli", 0),
];

/// Parts of `std` that only [`OUTERMOST`] may use, outside of tests.
const OUTSIDE_WORLD: &[&str] = &["std::env", "std::net", "std::process", "std::thread", "std::time"];

/// Macros that print; only [`OUTERMOST`] may use them.
const PRINTING: &[&str] = &["print", "println", "eprint", "eprintln"];

/// Knows the terminal, the clock and the environment.
const OUTERMOST: &str = "cli";

/// May open files.
const READS_FILES: &[&str] = &["image", "scene", "cli"];

#[test]
fn rooms_use_only_lower_rooms() {
    let root = support::path("src");
    let mut breaches = Vec::new();
    let mut file_count = 0;
    for path in rust_files(&root) {
        let relative = path.strip_prefix(&root).expect("file is below src").to_owned();
        let source = fs::read_to_string(&path).expect("source file is readable text");
        breaches.extend(check(&relative, &source));
        file_count += 1;
    }
    assert!(file_count > 10, "only {file_count} files were found below {}", root.display());
    assert!(breaches.is_empty(), "{} breaches:\n{}", breaches.len(), breaches.join("\n"));
}

#[test]
fn manifests_name_only_the_crates_of_the_table() {
    for (name, allowed) in CRATES {
        let manifest = fs::read_to_string(support::path("src").join(name).join("Cargo.toml")).expect("every crate has a manifest");
        assert_eq!(undue_dependencies(&manifest, allowed), Vec::<String>::new(), "{name}");
    }
    assert_eq!(undue_dependencies("[dependencies]\nnephroid-scene.workspace = true\nglam = \"1\"\n", &["math"]), ["scene"]);
    assert_eq!(undue_dependencies("[dev-dependencies]\nnephroid-scene.workspace = true\n", &["math"]), Vec::<String>::new());
}

/// Crates of the project below `[dependencies]` of a manifest that are not in a list.
fn undue_dependencies(manifest: &str, allowed: &[&str]) -> Vec<String> {
    let section = manifest.split_once("[dependencies]").map_or("", |(_, rest)| rest);
    let lines = section.lines().skip(1).take_while(|line| !line.starts_with('['));
    let names = lines.filter_map(|line| line.strip_prefix("nephroid-")?.split(['.', ' ', '=']).next());
    names.filter(|name| !allowed.contains(name)).map(str::to_owned).collect()
}

/// The room of a path below `src`, which is the innermost folder of [`ROOMS`] around it, or itself one.
fn room_of(path: &str) -> Option<&'static Room> {
    let inside = |room: &&Room| path == room.folder || path.strip_prefix(room.folder).is_some_and(|rest| rest.starts_with('/'));
    ROOMS.iter().filter(inside).max_by_key(|room| room.folder.len())
}

/// All breaches of one source file, given its path below `src`.
fn check(relative: &Path, source: &str) -> Vec<String> {
    let Some((crate_name, here)) = module_path(relative) else {
        return Vec::new();
    };
    let Some(room) = room_of(&relative.with_extension("").to_string_lossy().replace('\\', "/")) else {
        return vec![format!("{}: in no room", relative.display())];
    };
    let mut breaches = Vec::new();
    let mut breach = |line: usize, what: String| breaches.push(format!("{}:{line}: {what}", relative.display()));
    for used in paths(source, &here) {
        match (used.root, used.segments.first().map(String::as_str)) {
            (Root::Crate, first) => {
                // The command line is a module of the crate whose root re-exports all others.
                let target =
                    if crate_name == OUTERMOST { room } else { room_of(&format!("{crate_name}/{}", first.unwrap_or(""))).unwrap_or(room) };
                if target.folder != room.folder && target.level >= room.level {
                    breach(used.line, format!("`{}` must not use `{}`, which is not below it", room.folder, target.folder));
                }
            }
            (Root::Std, _) if used.in_test => {}
            (Root::Std, _) => {
                let path = format!("std::{}", used.segments.join("::"));
                let starts_with = |part: &str| path == part || path.strip_prefix(part).is_some_and(|rest| rest.starts_with("::"));
                let terminal = path.starts_with("std::io::std");
                if crate_name != OUTERMOST && (terminal || OUTSIDE_WORLD.iter().any(|part| starts_with(part))) {
                    breach(used.line, format!("`{}` must not use `{path}`", room.folder));
                }
                if starts_with("std::fs") && !READS_FILES.contains(&room.folder) {
                    breach(used.line, format!("`{}` must not open files (`{path}`)", room.folder));
                }
            }
            (Root::Macro, Some(name)) if PRINTING.contains(&name) && crate_name != OUTERMOST && !used.in_test => {
                breach(used.line, format!("`{}` must not print (`{name}!`)", room.folder));
            }
            (Root::Macro, _) => {}
        }
    }
    breaches
}

/// The crate of a file below `src` (the command line counts as one) and its module there; `None` for the facade and the binary.
fn module_path(relative: &Path) -> Option<(String, Vec<String>)> {
    let mut names: Vec<String> = relative.with_extension("").iter().map(|name| name.to_string_lossy().into_owned()).collect();
    if names.len() == 1 {
        return None;
    }
    let crate_name = names.remove(0);
    if names.last().is_some_and(|name| name == "mod" || name == "lib") {
        names.pop();
    }
    // `x_tests.rs` is the module `tests` inside `x`.
    if let Some(stem) = names.last().and_then(|name| name.strip_suffix("_tests")).map(str::to_owned) {
        names.pop();
        names.extend([stem, "tests".to_owned()]);
    }
    Some((crate_name, names))
}

/// What a path starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Root {
    Crate,
    Std,
    Macro,
}

/// One path used by a source file.
#[derive(Debug, PartialEq, Eq)]
struct UsedPath {
    root: Root,
    /// What follows the root; empty for the root itself.
    segments: Vec<String>,
    line: usize,
    in_test: bool,
}

/// All paths of a source text that lead to the crate root or to `std`, and all macro calls. `here` is the module of the file.
fn paths(source: &str, here: &[String]) -> Vec<UsedPath> {
    let tokens = tokens(source);
    let text = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let mut found = Vec::new();
    // Modules opened by `mod name {`, with the depth of braces outside of them.
    let mut inner: Vec<(String, usize)> = Vec::new();
    let mut depth = 0;
    let mut at = 0;
    while at < tokens.len() {
        match text(at) {
            "{" => depth += 1,
            "}" => {
                depth -= 1;
                if inner.last().is_some_and(|(_, outside)| *outside == depth) {
                    inner.pop();
                }
            }
            "mod" if text(at + 2) == "{" => inner.push((text(at + 1).to_owned(), depth)),
            // A path in the middle of another, such as the `self` of `a::{self, b}`, belongs to the latter.
            "crate" | "super" | "self" | "std" if ["::", "as"].contains(&text(at + 1)) && (at == 0 || text(at - 1) != "::") => {
                let mut module: Vec<&str> = here.iter().map(String::as_str).chain(inner.iter().map(|(name, _)| name.as_str())).collect();
                let in_test = module.contains(&"tests");
                let line = tokens[at].line;
                let root = if text(at) == "std" { Root::Std } else { Root::Crate };
                let mut start = at + 1;
                match text(at) {
                    "crate" | "std" => module.clear(),
                    "super" => {
                        module.pop();
                    }
                    _ => {}
                }
                while text(start) == "::" && text(start + 1) == "super" {
                    module.pop();
                    start += 2;
                }
                let prefix: Vec<String> = module.iter().map(|name| (*name).to_owned()).collect();
                let mut leaves = Vec::new();
                tree(&tokens, start, &prefix, &mut leaves);
                found.extend(leaves.into_iter().map(|segments| UsedPath { root, segments, line, in_test }));
            }
            name if text(at + 1) == "!" && text(at + 2) != "=" && name.starts_with(|c: char| c.is_alphabetic()) => {
                let in_test = here.iter().chain(inner.iter().map(|(name, _)| name)).any(|name| name == "tests");
                found.push(UsedPath { root: Root::Macro, segments: vec![name.to_owned()], line: tokens[at].line, in_test });
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// Expands the rest of a path, groups in braces included, from the `::` at `at`; returns where it ends.
fn tree(tokens: &[Token], mut at: usize, prefix: &[String], leaves: &mut Vec<Vec<String>>) -> usize {
    let text = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let mut path = prefix.to_vec();
    while text(at) == "::" {
        at += 1;
        match text(at) {
            "{" => {
                at += 1;
                while !["}", ""].contains(&text(at)) {
                    let mut member = path.clone();
                    if text(at) != "self" {
                        member.push(text(at).to_owned());
                    }
                    at = tree(tokens, at + 1, &member, leaves);
                    while !["}", ",", ""].contains(&text(at)) {
                        at += 1;
                    }
                    if text(at) == "," {
                        at += 1;
                    }
                }
                return at + 1;
            }
            // Generic arguments of a path in an expression.
            "<" => break,
            segment => {
                path.push(segment.to_owned());
                at += 1;
            }
        }
    }
    leaves.push(path);
    at
}

/// A word or a punctuation mark, and its line from 1.
struct Token {
    text: String,
    line: usize,
}

/// Splits a source text into words and punctuation; comments, strings, characters and lifetimes are left out.
fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let at = |index: usize| chars.get(index).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    let (mut index, mut line) = (0, 1);
    while index < chars.len() {
        let start = index;
        let mut end = index + 1;
        let mut text = String::new();
        match at(index) {
            '/' if at(index + 1) == '/' => {
                while end < chars.len() && at(end) != '\n' {
                    end += 1;
                }
            }
            '/' if at(index + 1) == '*' => {
                let mut nesting = 1;
                end = index + 2;
                while end < chars.len() && nesting > 0 {
                    match (at(end), at(end + 1)) {
                        ('/', '*') => (nesting, end) = (nesting + 1, end + 2),
                        ('*', '/') => (nesting, end) = (nesting - 1, end + 2),
                        _ => end += 1,
                    }
                }
            }
            '"' => end = end_of_string(&chars, index, 0, true),
            '\'' => {
                // A character ends in a quote, a lifetime does not.
                if at(index + 1) == '\\' {
                    end = index + 3;
                    while end < chars.len() && at(end) != '\'' {
                        end += 1;
                    }
                    end += 1;
                } else if at(index + 2) == '\'' {
                    end = index + 3;
                } else {
                    while is_word(at(end)) {
                        end += 1;
                    }
                }
            }
            c if is_word(c) => {
                while is_word(at(end)) {
                    end += 1;
                }
                let word: String = chars[index..end].iter().collect();
                let hashes = chars[end.min(chars.len())..].iter().take_while(|c| **c == '#').count();
                if ["r", "br", "cr"].contains(&word.as_str()) && at(end + hashes) == '"' {
                    end = end_of_string(&chars, end + hashes, hashes, false);
                } else if ["b", "c"].contains(&word.as_str()) && at(end) == '"' {
                    end = end_of_string(&chars, end, 0, true);
                } else {
                    text = word;
                }
            }
            ':' if at(index + 1) == ':' => {
                end = index + 2;
                text = "::".to_owned();
            }
            c if c.is_whitespace() => {}
            c => text = c.to_string(),
        }
        end = end.min(chars.len());
        if !text.is_empty() {
            tokens.push(Token { text, line });
        }
        line += chars[start..end].iter().filter(|c| **c == '\n').count();
        index = end;
    }
    tokens
}

/// Where the string that opens at `quote` ends, one past its last mark.
fn end_of_string(chars: &[char], quote: usize, hashes: usize, escapes: bool) -> usize {
    let mut index = quote + 1;
    while index < chars.len() {
        if escapes && chars[index] == '\\' {
            index += 2;
        } else if chars[index] == '"' && chars[index + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes {
            return index + 1 + hashes;
        } else {
            index += 1;
        }
    }
    chars.len()
}

/// All Rust files below a folder, sorted.
fn rust_files(folder: &Path) -> BTreeSet<PathBuf> {
    let mut files = BTreeSet::new();
    for entry in fs::read_dir(folder).expect("folder is readable") {
        let path = entry.expect("folder entry is readable").path();
        if path.is_dir() {
            files.append(&mut rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.insert(path);
        }
    }
    files
}

/// Number of breaches in a made-up file.
fn breach_count(relative: &str, source: &str) -> usize {
    check(Path::new(relative), source).len()
}

#[test]
fn upward_and_sideways_uses_are_breaches() {
    for (file, source) in [
        ("pipeline/a.rs", "use crate::frame::Pass;"),
        ("pipeline/raster/line.rs", "use super::super::frame::Pass;"),
        ("pipeline/raster/line.rs", "mod tests { use super::super::super::frame; }"),
        ("pipeline/lib.rs", "use self::frame::Pass;"),
        ("pipeline/a.rs", "use crate::{\n    state::{self, Color},\n    frame as f,\n};"),
        ("image/a.rs", "fn f() -> crate::metrics::Pair { todo() }"),
        ("image/metrics/a.rs", "pub use crate :: report;"),
        ("image/metrics/mod.rs", "use super::report::Figure;"),
        ("scene/geom/mesh/a.rs", "use crate::Scene;"),
        ("scene/geom/mesh/a.rs", "use super::super::super::*;"),
        ("scene/geom/mesh/a.rs", "use crate::*;"),
        ("scene/geom/a_tests.rs", "use super::super::super::Light;"),
        ("caustics/passes/a.rs", "impl crate::Technique for X {}"),
        ("caustics/passes/a.rs", "/* crate::passes */ const A: char = '\"'; use crate::stage; const B: char = '\"';"),
        ("nowhere/a.rs", ""),
    ] {
        assert_eq!(breach_count(file, source), 1, "{file}: {source}");
    }
}

#[test]
fn downward_uses_are_allowed() {
    for (file, source) in [
        ("pipeline/frame/a.rs", "use crate::{state::{Color, self}, Device}; use super::description::Frame;"),
        ("pipeline/raster/line.rs", "use super::super::state; use super::setup;"),
        ("pipeline/raster/line.rs", "mod tests { use super::*; use super::super::super::state; }"),
        ("pipeline/raster_tests.rs", "use super::super::state;"),
        ("image/report/a.rs", "use crate::metrics::Pair; use crate::png;"),
        ("scene/load.rs", "use crate::geom::Mesh; use std::fs::File; use std::collections::BTreeMap; use std::io::Read;"),
        ("caustics/a.rs", "use crate::passes::light;"),
        ("cli/render.rs", "use crate::caustics::TECHNIQUES; use std::time::Instant; fn f() { println!(\"a\") }"),
        (
            "scene/geom/a.rs",
            "// use crate::Scene;\n/* crate::Scene /* crate::Scene */ */ /// crate::Scene\nconst A: &str = \"crate::S \\\" crate::S\";",
        ),
        (
            "scene/geom/a.rs",
            "const A: &str = r#\"crate::S \" crate::S\"#; const B: &[u8] = b\"crate::S\"; fn f<'a>(x: &'a str, c: char) -> bool { c == '\\'' }",
        ),
        ("lib.rs", "pub mod cli; use crate::cli;"),
    ] {
        assert_eq!(check(Path::new(file), source), Vec::<String>::new(), "{file}: {source}");
    }
}

#[test]
fn the_outside_world_is_for_the_command_line() {
    for source in [
        "use std::time::Instant;",
        "use std::{env, mem};",
        "fn f() { std::process::exit(1) }",
        "use std::thread;",
        "use std::io::{Read, stdout};",
        "use std::fs::File;",
        "fn f() { println!(\"x\") }",
    ] {
        assert_eq!(breach_count("pipeline/a.rs", source), 1, "{source}");
        assert_eq!(breach_count("cli/a.rs", source), 0, "{source}");
        assert_eq!(breach_count("pipeline/a.rs", &format!("mod tests {{ {source} }}")), 0, "{source}");
    }
}

#[test]
fn breaches_are_told_with_their_line() {
    let source = "//! Doc.\n\nuse crate::state::Color;\nconst A: &str = \"two\nlines\";\nuse crate::frame::Frame;\n";
    assert_eq!(
        check(Path::new("pipeline/a.rs"), source),
        ["pipeline/a.rs:6: `pipeline` must not use `pipeline/frame`, which is not below it"]
    );
}
