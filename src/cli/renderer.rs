//! The one place where the command line meets the scene and the techniques.

use std::path::PathBuf;

use crate::caustics::{self, RenderOptions, Renderer};
use crate::cli::args::{ImageSize, Setting};
use crate::cli::render::Radiometry;
use crate::image::{LayerSet, ToneMap};
use crate::scene;

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
    let line = |t: &&dyn caustics::Technique| Technique { name: t.name(), summary: t.summary(), paper: t.paper() };
    caustics::TECHNIQUES.iter().map(line).collect()
}

/// All keys that `--set` knows.
pub fn settings() -> Vec<SettingLine> {
    scene::SETTINGS
        .iter()
        .map(|s| SettingLine { key: s.key.to_owned(), default: s.default.to_owned(), summary: format!("{} ({})", s.doc, s.allowed) })
        .collect()
}

/// Loads the scene, applies the overrides and renders.
pub fn render(request: &Request) -> anyhow::Result<Rendering> {
    let mut scene = scene::load(&request.scene)?;
    if let Some(size) = request.size {
        scene.set("image.width", &size.width.to_string())?;
        scene.set("image.height", &size.height.to_string())?;
    }
    if let Some(time_s) = request.time_s {
        scene.set("time_s", &time_s.to_string())?;
    }
    if let Some(radiometry) = request.radiometry {
        let value = match radiometry {
            Radiometry::Paper => "paper",
            Radiometry::Physical => "physical",
        };
        scene.set("caustic_volumes.radiometry", value)?;
    }
    for setting in &request.settings {
        scene.set(&setting.key, &setting.value)?;
    }
    let mut options =
        RenderOptions { memory_limit_bytes: request.memory_limit_bytes, layers: request.layers.clone(), ..RenderOptions::default() };
    options.device.threads = Some(rayon::current_num_threads());
    if let Some(technique) = &request.technique {
        options.technique.clone_from(technique);
    }
    let rendered = Renderer::new(&scene, &options)?.render(&scene, None)?;
    let tone = ToneMap {
        exposure: scene.tone.exposure(),
        shoulder: scene.tone.shoulder,
        white: scene.tone.white,
        desaturation: scene.tone.desaturation,
    };
    Ok(Rendering { technique: options.technique, layers: rendered.layers, tone, counters: rendered.counters, audit: rendered.audit })
}
