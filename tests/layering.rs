//! A module uses only lower layers: the table of `docs/architecture.md`, enforced on the source text.
//!
//! Every path that starts with `crate::`, or with enough `super::` to leave its top-level module, must lead to a lower layer. Below the
//! command line, nothing may touch the clock, the environment, the terminal, processes or threads, and only [`READS_FILES`] open files.
//! Comments, strings and attributes of rustdoc are not looked at.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A top-level module and what it may use.
struct Module {
    name: &'static str,
    /// It uses modules of lower layers only.
    layer: u32,
    /// Lower modules that it must not use all the same.
    never: &'static [&'static str],
}

const fn module(name: &'static str, layer: u32) -> Module {
    Module { name, layer, never: &[] }
}

/// The layers, lowest first. A folder of `src` that is not in here fails the test.
const MODULES: &[Module] = &[
    module("math", 0),
    module("image", 1),
    module("geom", 1),
    module("pipeline", 2),
    module("metrics", 2),
    module("frame", 3),
    module("scene", 3),
    module("passes", 4),
    // The ground truth must not share a mistake with what it judges.
    Module { name: "trace", layer: 4, never: &["pipeline", "frame"] },
    module("caustics", 5),
    module("gpu", 6),
    module("inspect", 6),
    module("report", 6),
    module("cli", 7),
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
fn modules_use_only_lower_layers() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
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

/// All breaches of one source file, given its path below `src`.
fn check(relative: &Path, source: &str) -> Vec<String> {
    let Some(here) = module_path(relative) else {
        return Vec::new();
    };
    let Some(module) = MODULES.iter().find(|module| module.name == here[0]) else {
        return vec![format!("{}: module `{}` is in no layer", relative.display(), here[0])];
    };
    let mut breaches = Vec::new();
    let mut breach = |line: usize, what: String| breaches.push(format!("{}:{line}: {what}", relative.display()));
    for used in paths(source, &here) {
        match (used.root, used.segments.first().map(String::as_str)) {
            (Root::Crate, None | Some("*")) => breach(used.line, "uses the root of the crate as a whole".to_owned()),
            (Root::Crate, Some(target)) => {
                let Some(target) = MODULES.iter().find(|module| module.name == target) else {
                    breach(used.line, format!("`{target}` is in no layer"));
                    continue;
                };
                if target.name != module.name && (target.layer >= module.layer || module.never.contains(&target.name)) {
                    breach(
                        used.line,
                        format!("`{}` (layer {}) must not use `{}` (layer {})", module.name, module.layer, target.name, target.layer),
                    );
                }
            }
            (Root::Std, _) if used.in_test => {}
            (Root::Std, _) => {
                let path = format!("std::{}", used.segments.join("::"));
                let starts_with = |part: &str| path == part || path.strip_prefix(part).is_some_and(|rest| rest.starts_with("::"));
                let terminal = path.starts_with("std::io::std");
                if module.name != OUTERMOST && (terminal || OUTSIDE_WORLD.iter().any(|part| starts_with(part))) {
                    breach(used.line, format!("`{}` must not use `{path}`", module.name));
                }
                if starts_with("std::fs") && !READS_FILES.contains(&module.name) {
                    breach(used.line, format!("`{}` must not open files (`{path}`)", module.name));
                }
            }
            (Root::Macro, Some(name)) if PRINTING.contains(&name) && module.name != OUTERMOST && !used.in_test => {
                breach(used.line, format!("`{}` must not print (`{name}!`)", module.name));
            }
            (Root::Macro, _) => {}
        }
    }
    breaches
}

/// The module of a file below `src`, from the top-level module down; `None` for the crate root and the binary.
fn module_path(relative: &Path) -> Option<Vec<String>> {
    let mut names: Vec<String> = relative.with_extension("").iter().map(|name| name.to_string_lossy().into_owned()).collect();
    if names.len() == 1 && ["lib", "main"].contains(&names[0].as_str()) {
        return None;
    }
    if names.last().is_some_and(|name| name == "mod") {
        names.pop();
    }
    // `x_tests.rs` is the module `tests` inside `x`.
    if let Some(stem) = names.last().and_then(|name| name.strip_suffix("_tests")).map(str::to_owned) {
        names.pop();
        names.extend([stem, "tests".to_owned()]);
    }
    Some(names)
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
        ("math/a.rs", "use crate::pipeline::Tile;"),
        ("math/a.rs", "pub use crate :: scene;"),
        ("image/a.rs", "use crate::{math::V2, geom::Mesh};"),
        ("image/a.rs", "use crate::{\n    math::{lanes::{self, Lanes}},\n    frame as f,\n};"),
        ("geom/mod.rs", "fn f() -> crate::caustics::Kind { todo() }"),
        ("pipeline/raster/line.rs", "use super::super::super::scene::Light;"),
        ("pipeline/raster/line.rs", "mod tests { use super::super::super::super::frame; }"),
        ("pipeline/mod.rs", "use super::frame::Pass;"),
        ("scene/a.rs", "use crate::frame::Pass;"),
        ("trace/a.rs", "use crate::frame::Pass;"),
        ("caustics/splatting/mod.rs", "impl crate::cli::Verb for X {}"),
        ("math/a.rs", "use crate::*;"),
        ("math/a.rs", "use crate as c;"),
        ("math/a.rs", "use crate::{self as c};"),
        ("math/a.rs", "use super::super::*;"),
        ("math/a_tests.rs", "use super::super::super::pipeline;"),
        ("math/a.rs", "use crate::nowhere::X;"),
        ("nowhere/a.rs", ""),
        ("math/a.rs", "/* crate::math */ const A: char = '\"'; use crate::cli; const B: char = '\"';"),
    ] {
        assert_eq!(breach_count(file, source), 1, "{file}: {source}");
    }
}

#[test]
fn downward_uses_are_allowed() {
    for (file, source) in [
        ("pipeline/a.rs", "use crate::{math::{lanes::Lanes, vector::*}, image::Image, geom, pipeline::state};"),
        ("pipeline/raster/line.rs", "use super::super::state; use super::setup;"),
        ("pipeline/raster/line.rs", "mod tests { use super::*; use super::super::super::state; }"),
        ("pipeline/raster_tests.rs", "use super::super::state;"),
        ("pipeline/a.rs", "pub(crate) struct A; pub(in crate::pipeline) struct B;"),
        ("cli/render.rs", "use crate::caustics::TECHNIQUES; use std::time::Instant; fn f() { println!(\"a\") }"),
        (
            "math/a.rs",
            "// use crate::cli;\n/* crate::cli /* crate::cli */ */ /// crate::cli\nconst A: &str = \"crate::cli \\\" crate::cli\";",
        ),
        (
            "math/a.rs",
            "const A: &str = r#\"crate::cli \" crate::cli\"#; const B: &[u8] = b\"crate::cli\"; fn f<'a>(x: &'a str, c: char) -> bool { c == '\\'' }",
        ),
        ("lib.rs", "pub mod cli; use crate::cli;"),
        ("scene/load.rs", "use std::fs::File; use std::collections::BTreeMap; use std::io::Read;"),
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
    let source = "//! Doc.\n\nuse crate::math::V2;\nconst A: &str = \"two\nlines\";\nuse crate::scene::Light;\n";
    assert_eq!(check(Path::new("pipeline/a.rs"), source), ["pipeline/a.rs:6: `pipeline` (layer 2) must not use `scene` (layer 3)"]);
}
