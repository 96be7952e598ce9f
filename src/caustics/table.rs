//! Tables of techniques: the library's own, and those of other programs.

use std::ops::Deref;
use std::path::Path;

use nephroid_scene::{Scene, SceneError, Setting, Settings};

use super::bounds::{self, PassBounds};
use super::layout::{self, Layout};
use super::{RenderError, Technique};

/// Techniques, the default one first.
#[derive(Clone, Copy)]
pub struct Techniques(pub &'static [&'static dyn Technique]);

impl std::fmt::Debug for Techniques {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

impl Deref for Techniques {
    type Target = [&'static dyn Technique];

    fn deref(&self) -> &Self::Target {
        self.0
    }
}

impl Techniques {
    /// All names, in the order of the table.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|technique| technique.name())
    }

    /// Finds a technique by name.
    ///
    /// # Errors
    /// [`RenderError::UnknownTechnique`].
    pub fn find(self, name: &str) -> Result<&'static dyn Technique, RenderError> {
        let found = self.0.iter().find(|technique| technique.name() == name).copied();
        let known = || self.names().collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| RenderError::UnknownTechnique { seen: name.to_owned(), known: known() })
    }

    /// The technique that draws most of what a scene contains; of several, the first in the table. `None` for an empty table.
    #[must_use]
    pub fn for_scene(self, scene: &Scene) -> Option<&'static dyn Technique> {
        self.0.iter().copied().min_by_key(|technique| technique.lacks(scene).len())
    }

    /// The settings tables that a scene file for these techniques may use.
    #[must_use]
    pub fn known_settings(self) -> Vec<&'static dyn Settings> {
        self.0.iter().map(|technique| technique.settings()).collect()
    }

    /// All keys of `--set`.
    #[must_use]
    pub fn settings(self) -> Vec<Setting> {
        nephroid_scene::settings(self.known_settings())
    }

    /// Reads a scene file: [`nephroid_scene::load`] with the settings of these techniques.
    ///
    /// # Errors
    /// If the file cannot be read or is not valid.
    pub fn load(self, file: &Path) -> Result<Scene, SceneError> {
        nephroid_scene::load(file, &self.known_settings())
    }

    /// Reads a scene from text: [`nephroid_scene::parse`] with the settings of these techniques.
    ///
    /// # Errors
    /// If the text is not valid.
    pub fn parse(self, text: &str, file: &str, base_dir: &Path) -> Result<Scene, SceneError> {
        nephroid_scene::parse(text, file, base_dir, &self.known_settings())
    }

    /// Reads a scene from bytes: [`nephroid_scene::parse_bytes`] with the settings of these techniques.
    ///
    /// # Errors
    /// If the bytes are not UTF-8 or not a valid scene.
    pub fn parse_bytes(self, bytes: &[u8], file: &str, base_dir: &Path) -> Result<Scene, SceneError> {
        nephroid_scene::parse_bytes(bytes, file, base_dir, &self.known_settings())
    }

    /// Bounds on the difference between a driver and the software GPU in frames of a technique, by pass: the technique's own, then those of shared
    /// passes. The first row that fits a pass holds, so a technique can have bounds of its own for a shared pass.
    #[must_use]
    pub fn bounds(self, technique: &str) -> Vec<PassBounds> {
        let own = self.0.iter().filter(|row| row.name() == technique).flat_map(|row| row.bounds());
        own.chain(bounds::SHARED).copied().collect()
    }

    /// Structs that programs share with their WGSL twins: those of shared passes, then those of the techniques.
    #[must_use]
    pub fn layouts(self) -> Vec<Layout> {
        layout::shared().into_iter().chain(self.0.iter().flat_map(|technique| technique.layouts())).collect()
    }
}

/// Declares techniques: each name is a module beside this line, and the module's constant `TECHNIQUE` becomes a row of the table.
///
/// `rustfmt` does not format modules that a macro declares; `.ci/run` passes their files to it.
#[macro_export]
macro_rules! techniques {
    ($(#[$meta:meta])* $vis:vis const $table:ident = [$($module:ident),+ $(,)?];) => {
        $(pub mod $module;)+

        $(#[$meta])*
        $vis const $table: $crate::Techniques = $crate::Techniques(&[$($module::TECHNIQUE),+]);
    };
}
