//! Scene files: from bytes to a valid [`Scene`], or to one error that names the file, the line and the column.
//!
//! Four steps, each of which stops at its first error: the brackets of the whole text ([`Tree::parse`]), the types and names of the
//! fields ([`read`]), those of the techniques' settings, by the tables that the caller knows, the ranges of the values ([`Scene::validate`]). An error of the last carries a path such as
//! `lights[1].irradiance`, which is then looked up in the text.
//!
//! Memory: the text (at most [`MAX_FILE_BYTES`]), the places of its values (12 times the text, for one that is all lists of digits), at
//! most `MAX_OBJECTS` objects, and lists that are a small multiple of their text. Nothing is allocated by a number that the file merely
//! states. Mesh files are not opened here.

use std::io::Read;
use std::path::Path as FilePath;

use super::description::Scene;
use super::names::nearest;
use super::scene_file::SceneFile;
use super::settings::{Settings, TechniqueSettings};
use super::text::read::{Misfit, Problem, read, read_with};
use super::text::tree::Tree;
use super::text::{Path, Position, Step, excerpt};

/// Largest scene file that is read, bytes.
pub const MAX_FILE_BYTES: u64 = 16 << 20;

/// Why a scene could not be loaded. Every message about a place in the file begins with `file:line:column`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SceneError {
    /// The file could not be read.
    #[error("{file}: cannot be read: {cause}")]
    Read {
        /// The file.
        file: String,
        /// What the operating system says.
        cause: String,
    },
    /// The file is larger than [`MAX_FILE_BYTES`].
    #[error("{file}: is larger than {limit} bytes, the most that a scene file may have")]
    TooLarge {
        /// The file.
        file: String,
        /// The most bytes allowed.
        limit: u64,
    },
    /// The file is not text.
    #[error("{file}:{at}: found byte 0x{byte:02x}, expected UTF-8 text")]
    NotUtf8 {
        /// The file.
        file: String,
        /// Where the text ends.
        at: Position,
        /// The first byte that is no text.
        byte: u8,
    },
    /// Brackets, quotes, commas or colons do not fit together.
    #[error("{file}:{at}: found {found}, expected {expected}")]
    Syntax {
        /// The file.
        file: String,
        /// Where.
        at: Position,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
    },
    /// A field that does not exist.
    #[error("{file}:{at}: found unknown field `{path}`{}, expected one of: {}", did_you_mean(.nearest), .allowed.join(", "))]
    UnknownField {
        /// The file.
        file: String,
        /// Where the field's name stands.
        at: Position,
        /// The field.
        path: Path,
        /// The fields that exist.
        allowed: Vec<String>,
        /// The existing field nearest in spelling, if one is near.
        nearest: Option<String>,
    },
    /// A value of the wrong type or outside of its range, or a field that is missing or given twice.
    #[error("{file}:{at}: {path}: found {found}, expected {expected}")]
    Value {
        /// The file.
        file: String,
        /// Where the value stands, or the value that lacks it.
        at: Position,
        /// Which value.
        path: Path,
        /// The value seen.
        found: String,
        /// The values allowed.
        expected: String,
    },
    /// An object's mesh could not be built or read.
    #[error("{file}:{at}: {path}: {cause}")]
    Mesh {
        /// The scene file.
        file: String,
        /// Where the object's shape stands in it.
        at: Position,
        /// Which object.
        path: Path,
        /// What is wrong, with the mesh file's name and line where it has them.
        cause: String,
    },
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default()
}

/// Reads and validates the scene file `file`; mesh files are looked up beside it. `techniques` are the settings that it may have for
/// techniques, none for a reader that knows no technique.
pub fn load(file: &FilePath, techniques: &[&'static dyn Settings]) -> Result<Scene, SceneError> {
    let name = file.display().to_string();
    let cannot_read = |cause: std::io::Error| SceneError::Read { file: name.clone(), cause: cause.to_string() };
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(file).map_err(cannot_read)?;
    // One byte more than allowed: a file that grows, or a device without an end, is cut here as well.
    opened.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(cannot_read)?;
    parse_bytes(&bytes, &name, file.parent().unwrap_or(FilePath::new("")), techniques)
}

/// Reads and validates a scene from the bytes of a file; see [`parse`].
pub fn parse_bytes(bytes: &[u8], file: &str, base_dir: &FilePath, techniques: &[&'static dyn Settings]) -> Result<Scene, SceneError> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneError::TooLarge { file: file.to_owned(), limit: MAX_FILE_BYTES });
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => parse(text, file, base_dir, techniques),
        Err(error) => {
            let (valid, rest) = bytes.split_at(error.valid_up_to());
            let at = Position::of(&String::from_utf8_lossy(valid), valid.len());
            Err(SceneError::NotUtf8 { file: file.to_owned(), at, byte: rest.first().copied().unwrap_or_default() })
        }
    }
}

/// Reads and validates a scene from a text. `file` is the name that errors print, `base_dir` the folder of its mesh files;
/// `techniques` as in [`load`].
pub fn parse(text: &str, file: &str, base_dir: &FilePath, techniques: &[&'static dyn Settings]) -> Result<Scene, SceneError> {
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneError::TooLarge { file: file.to_owned(), limit: MAX_FILE_BYTES });
    }
    let syntax = |at, found, expected| SceneError::Syntax { file: file.to_owned(), at, found, expected };
    let tree = Tree::parse(text).map_err(|error| syntax(Position::of(text, error.offset), error.found, error.expected))?;
    let extensions = ron::Deserializer::from_str(tree.header()).map(|header| header.extensions()).map_err(|error| {
        let at = Position { line: error.span.end.line, column: error.span.end.col };
        syntax(at, "an attribute that RON does not have".to_owned(), "`#![enable(...)]` with RON's extensions".to_owned())
    })?;
    let mut scene: Scene = read(&tree, extensions).map_err(|misfit| scene_error(&tree, misfit, file))?;
    scene.techniques = TechniqueSettings::new(techniques);
    let (node, steps) = tree.find(&Path(vec![Step::Name("techniques".to_owned())]));
    if steps == 1 {
        read_with(&tree, extensions, node, |value| scene.techniques.read(value)).map_err(|misfit| scene_error(&tree, misfit, file))?;
    }
    scene.source = SceneFile::new(file, base_dir, text);
    scene.validate().map_err(|invalid| scene.source.value_error(invalid))?;
    Ok(scene)
}

/// A value of the wrong type, or a name that does not fit, as an error of `file`.
fn scene_error(tree: &Tree<'_>, Misfit { node, problem }: Misfit, file: &str) -> SceneError {
    let at = |offset| Position::of(tree.text, offset);
    let (value, name) = (tree.value(node), tree.start(node));
    let quoted = |node| format!("`{}`", excerpt(tree.text, tree.value(node)));
    let (offset, found, expected) = match problem {
        Problem::UnknownField { found, allowed } => {
            return SceneError::UnknownField {
                file: file.to_owned(),
                at: at(name),
                path: tree.path_to(node),
                nearest: nearest(&found, allowed.iter().copied()).map(str::to_owned),
                allowed: allowed.iter().map(|&name| name.to_owned()).collect(),
            };
        }
        Problem::MissingField(field) => (value.start, format!("no field `{field}`"), "it to be given".to_owned()),
        Problem::DuplicateField(field) => (name, format!("a second `{field}`"), "each field once".to_owned()),
        Problem::Unnamed(item) => (tree.start(item), quoted(item), "the name of a field and a colon before it".to_owned()),
        Problem::Expected(expected) => (value.start, quoted(node), expected),
    };
    SceneError::Value { file: file.to_owned(), at: at(offset), path: tree.path_to(node), found, expected }
}
