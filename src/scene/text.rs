//! The text of a scene file: what stands where, and what it says.
//!
//! `Tree::parse` follows brackets, quotes, comments and commas once over the whole text, to a depth of at most [`MAX_DEPTH`], and keeps the
//! place of every value: 24 bytes for each, and a text has at most one value per two bytes. `read` turns the tree into a serde type, so
//! that every error names the very value it is about; numbers and strings are read by the crate `ron`. A [`Path`] such as
//! `lights[1].irradiance` leads from the outermost value to the one it names, and so to its [`Position`].

pub(crate) mod read;
pub(crate) mod tree;
mod walk;

use std::fmt;
use std::ops::Range;

/// Deepest nesting of brackets accepted; the deepest place of a valid scene is nested 10 brackets deep, constructors included.
pub const MAX_DEPTH: usize = 48;

/// Longest excerpt of the text quoted by an error, in characters.
const MAX_EXCERPT: usize = 48;

/// A place in a text: both numbers start at 1, columns are counted in characters (not bytes, not cells).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Position {
    /// The position of byte `offset` of `text`; an offset past the end gives the end.
    #[must_use]
    pub fn of(text: &str, offset: usize) -> Self {
        let mut end = offset.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &text[..end];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Self { line: before.bytes().filter(|&b| b == b'\n').count() + 1, column: before[line_start..].chars().count() + 1 }
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// One step from a value to a value inside it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// A field by its name, or the name of an enum variant, which stays at the same value.
    Name(String),
    /// An element of a list or tuple, from 0.
    Index(usize),
}

/// The way from the scene to one of its values, printed as `objects[3].shape.radius_m`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path(pub Vec<Step>);

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("scene");
        }
        for (index, step) in self.0.iter().enumerate() {
            match step {
                Step::Name(name) if index == 0 => f.write_str(name)?,
                Step::Name(name) => write!(f, ".{name}")?,
                Step::Index(element) => write!(f, "[{element}]")?,
            }
        }
        Ok(())
    }
}

/// A bracket, comma or quote that is missing or too many.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SyntaxError {
    /// Byte offset of what was found.
    pub offset: usize,
    /// What stands there.
    pub found: String,
    /// What could have stood there.
    pub expected: String,
}

/// At most [`MAX_EXCERPT`] characters of the first line of `text[range]`, to be quoted in an error.
pub(crate) fn excerpt(text: &str, range: Range<usize>) -> String {
    let slice = text.get(range).unwrap_or_default();
    let first_line = slice.lines().next().unwrap_or_default().trim_end();
    let mut short: String = first_line.chars().take(MAX_EXCERPT).collect();
    if short.len() < slice.trim_end().len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
#[path = "text_tests.rs"]
mod tests;
