//! Files that a verb writes: names, formats and the default folder.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};

/// Folder of the files if no `-o` is given.
pub const DEFAULT_FOLDER: &str = "out";

/// Format of an output file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A picture for looking at.
    Png,
    /// Layers for measuring.
    Exr,
}

/// One file to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Path of the file.
    pub path: PathBuf,
    /// Format of the file.
    pub format: Format,
}

impl Output {
    /// The file of one of `count` frames, with its number before the ending; of a single frame the file itself.
    pub fn of_frame(&self, number: u32, count: u32) -> Self {
        if count == 1 {
            return self.clone();
        }
        let digits = (count - 1).to_string().len().max(4);
        let ending = self.path.extension().unwrap_or_default().to_string_lossy().into_owned();
        Self { path: self.path.with_extension(format!("{number:0digits$}.{ending}")), format: self.format }
    }
}

/// `out/STEM.png` and `out/STEM.exr`, where STEM is the scene's name followed by `suffix`.
///
/// # Errors
/// If the path has no file name.
pub fn default_outputs(scene: &Path, suffix: &str) -> anyhow::Result<Vec<Output>> {
    let stem = scene.file_stem().with_context(|| format!("{} does not name a scene file", scene.display()))?;
    let output = |extension: &str, format| {
        let mut name = stem.to_owned();
        name.push(suffix);
        name.push(extension);
        Output { path: Path::new(DEFAULT_FOLDER).join(name), format }
    };
    Ok(vec![output(".png", Format::Png), output(".exr", Format::Exr)])
}

/// The files given by `-o`. Extensions must be known, and no file may be named twice.
///
/// # Errors
/// If an extension is unknown or a file is named twice.
pub fn chosen_outputs(paths: Vec<PathBuf>) -> anyhow::Result<Vec<Output>> {
    let mut outputs: Vec<Output> = Vec::new();
    for path in paths {
        let extension = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let format = match extension.as_deref() {
            Some("png") => Format::Png,
            Some("exr") => Format::Exr,
            _ => bail!("cannot tell from its name what to write to {}; a file ends in .png or .exr", path.display()),
        };
        ensure!(outputs.iter().all(|output| output.path != path), "-o names {} twice", path.display());
        outputs.push(Output { path, format });
    }
    Ok(outputs)
}

/// Creates the default folder if it does not exist.
///
/// # Errors
/// If the folder cannot be created.
pub fn make_default_folder() -> anyhow::Result<()> {
    fs::create_dir_all(DEFAULT_FOLDER).with_context(|| format!("cannot make the folder {DEFAULT_FOLDER}"))
}
