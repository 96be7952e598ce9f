//! The one place where the command line meets the scene and the techniques.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;

use crate::caustics::{self, RenderOptions, Renderer};
use crate::cli::args::{ImageSize, Setting};
use crate::cli::drivers;
use crate::cli::render::Radiometry;
use crate::image::{LayerSet, ToneMap};
use crate::scene::{self, SETTINGS, Scene};

/// What to render, all flags resolved.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// Name of the technique, one of [`techniques`]; `None` for the first.
    pub technique: Option<String>,
    /// Overrides the scene's choice.
    pub radiometry: Option<Radiometry>,
    /// Overrides the scene's image size.
    pub size: Option<ImageSize>,
    /// Overrides the scene's time, in seconds.
    pub time_s: Option<f32>,
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
    pub technique: &'static str,
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
#[derive(Debug, Serialize)]
pub struct TechniqueLine {
    /// Name on the command line.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// The paper it comes from.
    pub paper: &'static str,
}

/// One line of `list settings`.
#[derive(Debug, Serialize)]
pub struct SettingLine {
    /// The key for `--set`.
    pub key: &'static str,
    /// The value of a scene that does not mention it.
    pub default: &'static str,
    /// Unit of the value.
    pub unit: &'static str,
    /// The values allowed.
    pub allowed: &'static str,
    /// What it sets.
    pub doc: &'static str,
}

/// All techniques, in the order of their table; the first is the default.
pub fn techniques() -> Vec<TechniqueLine> {
    let line = |technique: &&dyn caustics::Technique| TechniqueLine {
        name: technique.name(),
        summary: technique.summary(),
        paper: technique.paper(),
    };
    caustics::TECHNIQUES.iter().map(line).collect()
}

/// All keys that `--set` knows, in the order of their table.
pub fn settings() -> Vec<SettingLine> {
    let line = |setting: &scene::Setting| SettingLine {
        key: setting.key,
        default: setting.default,
        unit: setting.unit,
        allowed: setting.allowed,
        doc: setting.doc,
    };
    SETTINGS.iter().map(line).collect()
}

/// A scene that is ready to be rendered.
#[derive(Debug)]
pub struct Prepared {
    technique: &'static str,
    scene: Scene,
}

/// Finds the technique, loads the scene and applies the overrides: flags first, then `--set` in the order given, so that the last word wins.
pub fn prepare(request: &Request) -> anyhow::Result<Prepared> {
    let technique = match &request.technique {
        Some(name) => caustics::technique(name)?.name(),
        None => caustics::TECHNIQUES.first().context("no technique is built in")?.name(),
    };
    let radiometry = request.radiometry.map(|radiometry| (technique, radiometry));
    let scene = load(&request.scene, radiometry, request.size, request.time_s, &request.settings)?;
    Ok(Prepared { technique, scene })
}

/// Loads a scene and applies overrides in this order.
pub fn load(
    path: &Path,
    radiometry: Option<(&str, Radiometry)>,
    size: Option<ImageSize>,
    time_s: Option<f32>,
    settings: &[Setting],
) -> anyhow::Result<Scene> {
    let mut scene = scene::load(path)?;
    if let Some((technique, radiometry)) = radiometry {
        scene.set(&format!("{technique}.radiometry"), radiometry.name()).context("cannot apply --radiometry")?;
    }
    if let Some(ImageSize { width, height }) = size {
        scene.set("image.width", &width.to_string()).context("cannot apply --size")?;
        scene.set("image.height", &height.to_string()).context("cannot apply --size")?;
    }
    if let Some(time_s) = time_s {
        scene.set("time_s", &time_s.to_string()).context("cannot apply --time")?;
    }
    for Setting { key, value } in settings {
        scene.set(key, value).context("cannot apply --set")?;
    }
    Ok(scene)
}

/// Renders, with as many threads as the current rayon pool has; on a driver if one is asked for, by name or any.
pub fn render(request: &Request, prepared: &Prepared, driver: Option<Option<&str>>) -> anyhow::Result<Rendering> {
    let Prepared { technique, scene } = prepared;
    let mut options = RenderOptions {
        technique: (*technique).to_owned(),
        memory_limit_bytes: request.memory_limit_bytes,
        layers: request.layers.clone(),
        ..RenderOptions::default()
    };
    options.device.threads = Some(rayon::current_num_threads());
    let mut renderer = match driver {
        None => Renderer::new(scene, &options)?,
        Some(name) => Renderer::with_executor(scene, &options, drivers::executor(name, options.device, options.memory_limit_bytes)?)?,
    };
    let rendered = renderer.render(scene, None)?;
    Ok(Rendering { technique, layers: rendered.layers, tone: tone_map(scene), counters: rendered.counters, audit: rendered.audit })
}

/// How the scene wants its picture shown.
fn tone_map(scene: &Scene) -> ToneMap {
    let tone = &scene.tone;
    ToneMap { exposure: tone.exposure(), shoulder: tone.shoulder, white: tone.white, desaturation: tone.desaturation }
}
