//! What can be wrong with a mesh file, and where.

use std::{fmt, path::PathBuf};

use thiserror::Error;

/// A mesh file could not be read.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}{at}: {problem}", file.display())]
pub struct MeshFileError {
    /// The file, as it was named.
    pub file: PathBuf,
    /// Where in it.
    pub at: Place,
    /// What is wrong.
    pub problem: MeshFileProblem,
}

/// A place in a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, from 1.
    Line(u64),
    /// A line and column of a text file, from 1.
    LineColumn(u64, u64),
    /// A distance from the start of a binary file, in bytes.
    Byte(u64),
    /// A named part, such as `meshes[0].primitives[1]`.
    Item(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
            Self::LineColumn(line, column) => write!(f, ":{line}:{column}"),
            Self::Byte(offset) => write!(f, ", byte {offset}"),
            Self::Item(item) => write!(f, ", {item}"),
        }
    }
}

/// What is wrong with a mesh file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshFileProblem {
    /// The file system refused.
    #[error("{message}")]
    Io {
        /// What it said.
        message: String,
    },
    /// The name does not tell a known format.
    #[error("unknown mesh format {seen:?}: must be one of \"ply\", \"obj\", \"gltf\", \"glb\"")]
    UnknownFormat {
        /// The extension, in lower case.
        seen: String,
    },
    /// Something else was expected.
    #[error("expected {expected}, saw {seen}")]
    Syntax {
        /// What may stand here.
        expected: String,
        /// What stands here.
        seen: String,
    },
    /// There are fewer bytes than promised.
    #[error("{what} needs {needed} bytes, but only {present} are there: the file is truncated or the count is wrong")]
    Truncated {
        /// What was promised.
        what: String,
        /// Bytes it takes, at least.
        needed: u64,
        /// Bytes there are.
        present: u64,
    },
    /// A limit is exceeded.
    #[error("{seen} {what}: at most {limit} are allowed")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much was seen, at least.
        seen: u64,
        /// The limit.
        limit: u64,
    },
    /// A number is infinite or not a number.
    #[error("{what} is {seen}: must be finite")]
    NotFinite {
        /// Which number.
        what: String,
        /// Its value, as text.
        seen: String,
    },
    /// Something refers to what does not exist.
    #[error("{what} is {seen}: must be {allowed}")]
    OutOfRange {
        /// Which number.
        what: String,
        /// Its value.
        seen: i64,
        /// Values it may have.
        allowed: String,
    },
    /// The file uses a feature that is not supported.
    #[error("{feature} is not supported: {allowed}")]
    Unsupported {
        /// The feature.
        feature: String,
        /// What is supported instead.
        allowed: String,
    },
    /// The file holds no triangle.
    #[error("no triangles: at least 1 is needed")]
    NoTriangles,
}

/// A problem and its place, before the name of the file is known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    pub at: Place,
    pub problem: MeshFileProblem,
}

impl Fault {
    pub(super) fn syntax(at: Place, expected: impl Into<String>, seen: impl Into<String>) -> Self {
        Self { at, problem: MeshFileProblem::Syntax { expected: expected.into(), seen: seen.into() } }
    }

    pub(super) fn truncated(at: Place, what: impl Into<String>, needed: u64, present: u64) -> Self {
        Self { at, problem: MeshFileProblem::Truncated { what: what.into(), needed, present } }
    }

    pub(super) fn not_finite(at: Place, what: impl Into<String>, seen: impl fmt::Display) -> Self {
        Self { at, problem: MeshFileProblem::NotFinite { what: what.into(), seen: seen.to_string() } }
    }

    pub(super) fn out_of_range(at: Place, what: impl Into<String>, seen: i64, allowed: impl Into<String>) -> Self {
        Self { at, problem: MeshFileProblem::OutOfRange { what: what.into(), seen, allowed: allowed.into() } }
    }

    pub(super) fn unsupported(at: Place, feature: impl Into<String>, allowed: impl Into<String>) -> Self {
        Self { at, problem: MeshFileProblem::Unsupported { feature: feature.into(), allowed: allowed.into() } }
    }
}

/// Part of the input as quoted text for a message, cut to a readable length.
pub(super) fn quote(bytes: &[u8]) -> String {
    const LENGTH: usize = 40;
    let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(LENGTH)]).into_owned();
    if bytes.len() > LENGTH { format!("{shown:?}...") } else { format!("{shown:?}") }
}
