//! The one place where the command line meets the scene and the techniques.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;

use crate::caustics::{RenderOptions, Renderer, Technique, Techniques};
use crate::cli::args::{ImageSize, SettingArgument};
use crate::cli::drivers;
use crate::cli::render::RadiometryArgument;
use crate::image::{LayerSet, ToneMap};
use crate::scene::{Scene, Setting};

/// What to render, all flags resolved.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// The techniques there are.
    pub techniques: Techniques,
    /// Name of the technique, one of [`Self::techniques`]; `None` for the first.
    pub technique: Option<String>,
    /// Overrides the scene's choice.
    pub radiometry: Option<RadiometryArgument>,
    /// Overrides the scene's image size.
    pub size: Option<ImageSize>,
    /// Overrides the scene's time, in seconds.
    pub time_s: Option<f32>,
    /// Further overrides, applied last and in order.
    pub settings: Vec<SettingArgument>,
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
    pub default: Cow<'static, str>,
    /// Unit of the value.
    pub unit: &'static str,
    /// The values allowed.
    pub allowed: Cow<'static, str>,
    /// What it sets.
    pub doc: &'static str,
}

/// What `list techniques` shows: techniques in the order of their table; the first is the default.
pub fn technique_lines(techniques: Techniques) -> Vec<TechniqueLine> {
    let line =
        |technique: &&dyn Technique| TechniqueLine { name: technique.name(), summary: technique.summary(), paper: technique.paper() };
    techniques.iter().map(line).collect()
}

/// What `list settings` shows: all keys that `--set` knows, in the order of their tables.
pub fn setting_lines(techniques: Techniques) -> Vec<SettingLine> {
    let line = |setting: Setting| SettingLine {
        key: setting.key,
        default: setting.default,
        unit: setting.unit,
        allowed: setting.allowed,
        doc: setting.doc,
    };
    techniques.settings().into_iter().map(line).collect()
}

/// A scene that is ready to be rendered.
#[derive(Debug)]
pub struct PreparedScene {
    technique: &'static str,
    scene: Scene,
}

/// Finds the technique, loads the scene and applies the overrides: flags first, then `--set` in the order given, so that the last word wins.
pub fn prepare(request: &Request) -> anyhow::Result<PreparedScene> {
    let technique = match &request.technique {
        Some(name) => request.techniques.find(name)?.name(),
        None => request.techniques.first().context("no technique is built in")?.name(),
    };
    let radiometry = request.radiometry.map(|radiometry| (technique, radiometry));
    let scene = load(request.techniques, &request.scene, radiometry, request.size, request.time_s, &request.settings)?;
    Ok(PreparedScene { technique, scene })
}

/// Loads a scene and applies overrides in this order.
pub fn load(
    techniques: Techniques,
    path: &Path,
    radiometry: Option<(&str, RadiometryArgument)>,
    size: Option<ImageSize>,
    time_s: Option<f32>,
    settings: &[SettingArgument],
) -> anyhow::Result<Scene> {
    let mut scene = techniques.load(path)?;
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
    for SettingArgument { key, value } in settings {
        scene.set(key, value).context("cannot apply --set")?;
    }
    Ok(scene)
}

/// Renders, with as many threads as the current rayon pool has; on a driver if one is asked for, by name or any.
pub fn render(request: &Request, prepared: &PreparedScene, driver: Option<Option<&str>>) -> anyhow::Result<Rendering> {
    let PreparedScene { technique, scene } = prepared;
    let mut options = RenderOptions {
        technique: (*technique).to_owned(),
        techniques: request.techniques,
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
