//! The rooms of the pipeline's crate: a file uses files of its own room or of those before it, and no files use each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The folders of the crate, each of which may use those before it.
const ROOMS: [&str; 8] = ["api", "primitive", "vendor", "geometry", "tile", "run", "frame", "canvas"];

/// By file (`tile::raster`), the files of the crate that it uses.
type Uses = BTreeMap<String, BTreeSet<String>>;

/// The source without its unit tests and comments.
fn code_of(source: &str) -> String {
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Every `crate::a::b::c` in the code, as `a::b::c`; paths through `super` and names of the crate's root are refused.
fn paths(file: &str, code: &str) -> Vec<String> {
    assert!(!code.contains("super::"), "{file}: paths within the crate start at `crate::`");
    let path = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_' || *c == ':').collect::<String>();
    code.split("crate::").skip(1).map(path).collect()
}

/// The file that a path leads into: the longest start of it that is a file.
fn file_of<'p>(files: &BTreeMap<String, String>, path: &'p str) -> Option<&'p str> {
    let ends = path.match_indices("::").map(|(at, _)| at).chain([path.len()]);
    ends.map(|end| &path[..end]).filter(|start| files.contains_key(*start)).last()
}

/// Reads the crate's files: `tile/raster.rs` becomes `tile::raster`. Files that only list others (`mod.rs`, `lib.rs`) are left out.
fn read(folder: &Path, name: &str, files: &mut BTreeMap<String, String>) {
    let mut entries: Vec<_> = fs::read_dir(folder).expect("the folder is there").map(|entry| entry.expect("readable").path()).collect();
    entries.sort();
    for path in entries {
        let stem = path.file_stem().expect("named").to_string_lossy().into_owned();
        let name = if name.is_empty() { stem.clone() } else { format!("{name}::{stem}") };
        if path.is_dir() {
            read(&path, &name, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") && stem != "mod" && stem != "lib" {
            files.insert(name, code_of(&fs::read_to_string(&path).expect("readable")));
        }
    }
}

/// Which files each file uses, and what is wrong with that: paths that lead nowhere, or into a later room.
fn uses(files: &BTreeMap<String, String>) -> (Uses, Vec<String>) {
    let room = |file: &str| ROOMS.iter().position(|room| file.split("::").next() == Some(room));
    let (mut uses, mut wrong) = (Uses::new(), Vec::new());
    for (file, code) in files {
        let mut used = BTreeSet::new();
        for path in paths(file, code) {
            match file_of(files, &path) {
                Some(target) if room(target) > room(file) => wrong.push(format!("{file} uses {target}, which is in a later room")),
                Some(target) if target != file => drop(used.insert(target.to_owned())),
                Some(_) => {}
                None => wrong.push(format!("{file} uses crate::{path}, which is in no file of a room")),
            }
        }
        uses.insert(file.clone(), used);
    }
    (uses, wrong)
}

/// A circle of files, if there is one: files that are used by no file left are taken away until nothing changes.
fn circle(uses: &Uses) -> BTreeSet<String> {
    let mut left: BTreeSet<String> = uses.keys().cloned().collect();
    loop {
        let is_used = |file: &String| left.iter().any(|other| uses[other].contains(file));
        let used: BTreeSet<String> = left.iter().filter(|file| is_used(file)).cloned().collect();
        if used.len() == left.len() {
            return left;
        }
        left = used;
    }
}

#[test]
fn files_use_earlier_rooms_and_never_each_other_in_a_circle() {
    let mut files = BTreeMap::new();
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../src/pipeline"), "", &mut files);
    assert!(files.len() > 50, "only {} files were found", files.len());
    let (uses, wrong) = uses(&files);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(circle(&uses), BTreeSet::new(), "these files use each other in a circle");
}

#[test]
fn a_circle_and_a_later_room_are_found() {
    let files = |sources: &[(&str, &str)]| sources.iter().map(|(file, code)| ((*file).to_owned(), code_of(code))).collect();
    let (line, wrong) =
        uses(&files(&[("api::a", "use crate::api::b::B;"), ("api::b", ""), ("tile::c", "crate::api::a::f(); // crate::x")]));
    assert_eq!((wrong, circle(&line)), (Vec::new(), BTreeSet::new()));
    let (round, _) =
        uses(&files(&[("api::a", "use crate::api::b::B;"), ("api::b", "use crate::api::c::C;"), ("api::c", "crate::api::a::f()")]));
    assert_eq!(circle(&round).len(), 3);
    let (_, wrong) = uses(&files(&[("api::a", "use crate::tile::b::B; use crate::Root;"), ("tile::b", "")]));
    assert_eq!(wrong.len(), 2, "{wrong:?}");
}
