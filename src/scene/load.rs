//! Scene files: from bytes to a valid [`Scene`], or to one error that names the file, the line and the column.
//!
//! Three steps, each of which stops at its first error: the brackets of the whole text ([`text::check`]), the types and names of the
//! fields (`ron` and serde), the ranges of the values ([`Scene::validate`]). An error of the last two carries a path such as
//! `lights[1].irradiance`, which is then looked up in the text.
//!
//! Memory: the text (at most [`MAX_FILE_BYTES`]), at most `MAX_OBJECTS` objects and 16 lights, and lists of colours, which are no
//! larger than their text. Nothing is allocated by a number that the file merely states. Mesh files are not opened here.

use std::io::Read;
use std::path::Path as FilePath;

use ron::extensions::Extensions;
use serde::Deserialize;
use serde_path_to_error::{Segment, Track};

use super::description::Scene;
use super::names::nearest;
use super::source::Source;
use super::text::{self, Path, Position, Step};

/// Largest scene file that is read, bytes.
pub const MAX_FILE_BYTES: u64 = 16 << 20;

/// Why there is no scene. Every message begins with `file:line:column`, where there is a place to name.
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
        /// What stands there.
        found: String,
        /// What could stand there.
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
        /// The fields there are.
        allowed: Vec<String>,
        /// The one among them that was perhaps meant.
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

/// Reads and validates the scene file `file`; mesh files are looked up beside it.
pub fn load(file: &FilePath) -> Result<Scene, SceneError> {
    let name = file.display().to_string();
    let cannot_read = |cause: std::io::Error| SceneError::Read { file: name.clone(), cause: cause.to_string() };
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(file).map_err(cannot_read)?;
    // One byte more than allowed: a file that grows, or a device without an end, is cut here as well.
    opened.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(cannot_read)?;
    parse_bytes(&bytes, &name, file.parent().unwrap_or(FilePath::new("")))
}

/// Reads and validates a scene from the bytes of a file; see [`parse`].
pub fn parse_bytes(bytes: &[u8], file: &str, base_dir: &FilePath) -> Result<Scene, SceneError> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneError::TooLarge { file: file.to_owned(), limit: MAX_FILE_BYTES });
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => parse(text, file, base_dir),
        Err(error) => {
            let (valid, rest) = bytes.split_at(error.valid_up_to());
            let at = Position::of(&String::from_utf8_lossy(valid), valid.len());
            Err(SceneError::NotUtf8 { file: file.to_owned(), at, byte: rest.first().copied().unwrap_or_default() })
        }
    }
}

/// Reads and validates a scene from a text. `file` is the name that errors print, `base_dir` the folder of its mesh files.
pub fn parse(text: &str, file: &str, base_dir: &FilePath) -> Result<Scene, SceneError> {
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneError::TooLarge { file: file.to_owned(), limit: MAX_FILE_BYTES });
    }
    let syntax = |offset, found, expected| SceneError::Syntax { file: file.to_owned(), at: Position::of(text, offset), found, expected };
    text::check(text).map_err(|error| syntax(error.offset, error.found, error.expected))?;
    let mut scene = deserialize(text, file)?;
    scene.source = Source::new(file, base_dir, text);
    scene.validate().map_err(|invalid| scene.source.value_error(invalid))?;
    Ok(scene)
}

/// Turns names and types into fields; ranges are still unchecked.
fn deserialize(text: &str, file: &str) -> Result<Scene, SceneError> {
    // `water: (...)` for `water: Some((...))`, and `Torus(radius_m: 1)` for `Torus((radius_m: 1))`.
    let extensions = Extensions::IMPLICIT_SOME | Extensions::UNWRAP_VARIANT_NEWTYPES;
    let options = ron::Options::default().with_default_extension(extensions);
    let unplaced = |error: ron::error::SpannedError| SceneError::Syntax {
        file: file.to_owned(),
        at: Position { line: error.span.end.line, column: error.span.end.col },
        found: "something that RON does not allow".to_owned(),
        expected: expected_by(&error.code),
    };
    let mut deserializer = ron::Deserializer::from_str_with_options(text, &options).map_err(unplaced)?;
    let mut track = Track::new();
    let result = Scene::deserialize(serde_path_to_error::Deserializer::new(&mut deserializer, &mut track));
    let error = match result {
        Ok(scene) => return deserializer.end().map(|()| scene).map_err(|code| unplaced(deserializer.span_error(code))),
        Err(error) => error,
    };

    // Brackets and commas fit together, so `ron` stops before the end of a bracket only where it read a part of a value (the 6 of a 6.5
    // that should be a whole number) or has read all that there may be.
    if let ron::Error::ExpectedComma | ron::Error::ExpectedStructLikeEnd | ron::Error::ExpectedArrayEnd | ron::Error::ExpectedOptionEnd =
        error
    {
        let stop = deserializer.span_error(error.clone()).span.end;
        let offset = text::offset_of(text, Position { line: stop.line, column: stop.col });
        if let Some((path, value)) = text::find_at(text, offset) {
            let partly_read = offset > value.start;
            return Err(SceneError::Value {
                file: file.to_owned(),
                at: Position::of(text, value.start),
                path,
                found: format!("`{}`", text::excerpt(text, value)),
                expected: if partly_read { "a whole number" } else { "no more values" }.to_owned(),
            });
        }
    }

    let (mut steps, mut shown) = (Vec::new(), Vec::new());
    for segment in &track.path() {
        let step = match segment {
            Segment::Seq { index } => Step::Index(*index),
            Segment::Map { key } => Step::Name(key.clone()),
            Segment::Enum { variant } => Step::Name(variant.clone()),
            Segment::Unknown => break,
        };
        // The names of variants lead to the place, but say nothing that the place does not.
        if !matches!(segment, Segment::Enum { .. }) {
            shown.push(step.clone());
        }
        steps.push(step);
    }
    let (mut full_path, mut path) = (Path(steps), Path(shown));
    let Some(place) = text::find(text, &full_path) else {
        return Err(unplaced(deserializer.span_error(error)));
    };
    let file = file.to_owned();
    let at = |offset| Position::of(text, offset);
    let seen = text::excerpt(text, place.value.clone());
    Err(match error {
        ron::Error::NoSuchStructField { expected, found, .. } => SceneError::UnknownField {
            file,
            at: at(place.name.unwrap_or(place.value).start),
            nearest: nearest(&found, expected.iter().copied()).map(str::to_owned),
            path,
            allowed: expected.iter().map(|&name| name.to_owned()).collect(),
        },
        ron::Error::MissingStructField { field, .. } => SceneError::Value {
            file,
            at: at(place.value.start),
            path,
            found: format!("no field `{field}`"),
            expected: "it to be given".to_owned(),
        },
        ron::Error::DuplicateStructField { field, .. } => {
            full_path.0.push(Step::Name(field.to_owned()));
            path.0.push(Step::Name(field.to_owned()));
            let second = text::find_all(text, &full_path).into_iter().nth(1).unwrap_or(place);
            let at = at(second.name.unwrap_or(second.value).start);
            SceneError::Value { file, at, path, found: format!("a second `{field}`"), expected: "each field once".to_owned() }
        }
        other => SceneError::Value { file, at: at(place.value.start), path, found: format!("`{seen}`"), expected: expected_by(&other) },
    })
}

/// What `ron` or serde would have accepted, as the end of "expected ...".
fn expected_by(error: &ron::Error) -> String {
    match error {
        ron::Error::NoSuchEnumVariant { expected, found, .. } => {
            let hint = nearest(found, expected.iter().copied()).map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default();
            format!("one of: {}{hint}", expected.join(", "))
        }
        ron::Error::InvalidValueForType { expected, .. } | ron::Error::ExpectedDifferentLength { expected, .. } => expected.clone(),
        ron::Error::ExpectedFloat => "a number".to_owned(),
        ron::Error::ExpectedInteger | ron::Error::InvalidIntegerDigit { base: 10, .. } => "a whole number".to_owned(),
        ron::Error::IntegerOutOfBounds => "a whole number from 0 to 4294967295".to_owned(),
        ron::Error::InvalidIntegerDigit { base, .. } => format!("a whole number in base {base}"),
        ron::Error::ExpectedBoolean => "true or false".to_owned(),
        ron::Error::ExpectedString => "a text in double quotes".to_owned(),
        ron::Error::ExpectedArray => "a list in [square brackets]".to_owned(),
        ron::Error::ExpectedStructLike | ron::Error::ExpectedNamedStructLike(_) => "values in (parentheses)".to_owned(),
        ron::Error::ExpectedIdentifier => "a name".to_owned(),
        ron::Error::ExpectedDifferentStructName { expected, .. } => format!("`{expected}` or no name before the parenthesis"),
        other => {
            let message = other.to_string();
            message.strip_prefix("Expected ").or(message.strip_prefix("expected ")).unwrap_or(&message).to_owned()
        }
    }
}
