//! Where a scene came from, so that an error found long after loading still names a place in its file.

use std::fmt;
use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use super::check::Invalid;
use super::load::SceneError;
use super::text::tree::Tree;
use super::text::{Path, Position};

/// The file that a scene was read from: its name, its folder and its text.
#[derive(Clone, PartialEq, Eq)]
pub struct SceneFile {
    /// The file's name, as errors print it.
    pub file: String,
    /// The folder that mesh files are looked up in.
    pub base_dir: PathBuf,
    /// The file's text; empty for a scene that was not read from a file.
    text: Arc<str>,
}

impl Default for SceneFile {
    /// The source of a scene that was not read from a file.
    fn default() -> Self {
        Self { file: "scene".to_owned(), base_dir: PathBuf::new(), text: Arc::from("") }
    }
}

impl SceneFile {
    /// The source of a scene with this `text`, to be called `file` by errors.
    #[must_use]
    pub fn new(file: &str, base_dir: &FilePath, text: &str) -> Self {
        Self { file: file.to_owned(), base_dir: base_dir.to_owned(), text: Arc::from(text) }
    }

    /// Where the value that `path` names is written, or else the innermost value around it; the start of the file if there is none.
    #[must_use]
    pub fn position(&self, path: &Path) -> Position {
        let start = Tree::parse(&self.text).map_or(0, |tree| tree.value(tree.find(path).0).start);
        Position::of(&self.text, start)
    }

    /// `invalid` as an error of this file.
    #[must_use]
    pub fn value_error(&self, invalid: Invalid) -> SceneError {
        let Invalid { path, found, expected } = invalid;
        SceneError::Value { file: self.file.clone(), at: self.position(&path), path, found, expected }
    }

    /// The error that the mesh of the object at `path` could not be built or read because of `cause`.
    #[must_use]
    pub fn mesh_error(&self, path: Path, cause: String) -> SceneError {
        SceneError::Mesh { file: self.file.clone(), at: self.position(&path), path, cause }
    }
}

impl fmt::Debug for SceneFile {
    /// Without the text, which would bury everything else.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SceneFile").field("file", &self.file).field("base_dir", &self.base_dir).finish_non_exhaustive()
    }
}
