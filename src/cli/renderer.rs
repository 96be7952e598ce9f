//! The one place where the command line meets the scene and the techniques.

use std::path::{Path, PathBuf};

use crate::cli::args::{ImageSize, Setting};
use crate::cli::render::Radiometry;
use crate::image::{LayerSet, ToneMap};

/// What to render, all flags resolved.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// Name of the technique; `None` for the first of the table.
    pub technique: Option<String>,
    /// Overrides the scene's choice.
    pub radiometry: Option<Radiometry>,
    /// Overrides the scene's image size.
    pub size: Option<ImageSize>,
    /// Overrides the scene's time, in seconds.
    pub time_s: Option<f64>,
    /// Further overrides, applied last and in order.
    pub settings: Vec<Setting>,
    /// Names of the layers to return; `None` for all.
    pub layers: Option<Vec<String>>,
    /// Memory that the frame may take.
    pub memory_limit_bytes: u64,
}

/// What came out.
#[derive(Debug)]
pub struct Rendering {
    /// Name of the technique that was used.
    pub technique: String,
    /// The layers asked for.
    pub layers: LayerSet,
    /// How the layer `color` is to be shown.
    pub tone: ToneMap,
    /// Counters of the frame, in the order of the frame.
    pub counters: Vec<(String, u64)>,
    /// Energy audit, in watts.
    pub audit: Vec<(String, f64)>,
}

/// One line of `list techniques`.
#[derive(Debug, serde::Serialize)]
pub struct Technique {
    /// Name on the command line.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// The paper it comes from.
    pub paper: &'static str,
}

/// One line of `list settings`.
#[derive(Debug, serde::Serialize)]
pub struct SettingLine {
    /// The key for `--set`.
    pub key: String,
    /// The default value, as a scene file would write it.
    pub default: String,
    /// Meaning, unit and range.
    pub summary: String,
}

/// All techniques, in the order of their table.
pub fn techniques() -> Vec<Technique> {
    Vec::new()
}

/// All keys that `--set` knows.
pub fn settings() -> Vec<SettingLine> {
    Vec::new()
}

/// Loads the scene, applies the overrides and renders, on the threads of the current rayon pool.
pub fn render(request: &Request) -> anyhow::Result<Rendering> {
    anyhow::bail!("no technique can render {} yet", Path::new(&request.scene).display())
}
