//! The interface between the command line and scenes and techniques.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;

use crate::caustics::{BODIES_TURNED, Feature, RenderOptions, Rendered, Renderer, Technique, Techniques};
use crate::cli::args::{ImageSize, SettingArgument};
use crate::cli::render::RadiometryArgument;
use crate::cli::{drivers, output};
use crate::image::{LayerSet, ToneMap};
use crate::scene::{Scene, Setting};

/// The resolved request of a render.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// All known techniques.
    pub techniques: Techniques,
    /// Name of the technique, one of [`Self::techniques`]; `None` for the one that draws most of the scene.
    pub technique: Option<String>,
    /// Overrides the scene's radiometry.
    pub radiometry: Option<RadiometryArgument>,
    /// Overrides the scene's image size.
    pub size: Option<ImageSize>,
    /// Overrides the scene's time, in seconds.
    pub time_s: Option<f32>,
    /// Further overrides, applied last and in order.
    pub settings: Vec<SettingArgument>,
    /// Names of the wanted layers; `None` for all.
    pub layers: Option<Vec<String>>,
    /// Largest memory of the frame, bytes.
    pub memory_limit_bytes: u64,
}

/// The results of a render.
#[derive(Debug)]
pub struct Rendering {
    /// Name of the technique that was used.
    pub technique: &'static str,
    /// The wanted layers.
    pub layers: LayerSet,
    /// Tone map for the layer `color`.
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
    /// Description in one line.
    pub summary: &'static str,
    /// The paper that the technique implements.
    pub paper: &'static str,
}

/// One line of `list settings`.
#[derive(Debug, Serialize)]
pub struct SettingLine {
    /// The key for `--set`.
    pub key: &'static str,
    /// Value in a scene that does not set it.
    pub default: Cow<'static, str>,
    /// Unit of the value.
    pub unit: &'static str,
    /// The values allowed.
    pub allowed: Cow<'static, str>,
    /// Description of the setting.
    pub doc: &'static str,
}

/// The lines of `list techniques`, in the order of the table; the first is the default.
pub fn technique_lines(techniques: Techniques) -> Vec<TechniqueLine> {
    let line =
        |technique: &&dyn Technique| TechniqueLine { name: technique.name(), summary: technique.summary(), paper: technique.paper() };
    techniques.iter().map(line).collect()
}

/// The lines of `list settings`: all keys of `--set`, in the order of their tables.
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

/// A scene with all overrides, and its technique.
#[derive(Debug)]
pub struct PreparedScene {
    /// Name of the technique.
    pub technique: &'static str,
    scene: Scene,
    /// What the technique does not draw, in words.
    pub not_drawn: Vec<&'static str>,
}

/// Finds the technique, loads the scene and applies the overrides: flags first, then `--set` in the given order, so that the last one wins. Without a
/// name the technique is the one that draws most of the scene.
///
/// # Errors
/// If the technique is unknown, the scene cannot be loaded, or an override is not allowed.
pub fn prepare(request: &Request) -> anyhow::Result<PreparedScene> {
    let asked = request.technique.as_ref().map(|name| request.techniques.find(name)).transpose()?;
    let mut scene = load(request.techniques, &request.scene, request.size, request.time_s, &request.settings)?;
    let technique = asked.or_else(|| request.techniques.for_scene(&scene)).context("no technique is built in")?;
    let key = format!("{}.radiometry", technique.name());
    if let Some(radiometry) = request.radiometry.filter(|_| request.settings.iter().all(|setting| setting.key != key)) {
        scene.set(&key, radiometry.name()).context("cannot apply --radiometry")?;
    }
    Ok(PreparedScene { technique: technique.name(), not_drawn: not_drawn(technique, &scene), scene })
}

/// What a scene contains and a technique does not draw, in words.
pub fn not_drawn(technique: &'static dyn Technique, scene: &Scene) -> Vec<&'static str> {
    technique.lacks(scene).into_iter().map(Feature::words).collect()
}

/// Says on the standard error what a picture lacks; nothing if it lacks nothing.
pub fn warn(scene: &Path, technique: &str, not_drawn: &[&str]) {
    if !not_drawn.is_empty() {
        output::note(&format!("{}: {technique} does not draw {}", scene.display(), not_drawn.join(", ")));
    }
}

/// Number of bodies of glass that were turned over, from the counters of a frame.
pub fn turned(counters: &[(String, u64)]) -> u64 {
    counters.iter().find(|(name, _)| name == BODIES_TURNED).map_or(0, |(_, count)| *count)
}

/// Says on the standard error that bodies of glass were turned over; nothing if none was.
pub fn warn_of_turned(scene: &Path, count: u64) {
    if count > 0 {
        output::note(&format!("{}: bodies of glass whose triangles face in were turned over: {count}", scene.display()));
    }
}

/// Loads a scene and applies overrides in the order of the arguments.
///
/// # Errors
/// If the scene cannot be loaded, or an override is not allowed.
pub fn load(
    techniques: Techniques,
    path: &Path,
    size: Option<ImageSize>,
    time_s: Option<f32>,
    settings: &[SettingArgument],
) -> anyhow::Result<Scene> {
    let mut scene = techniques.load(path)?;
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

/// [`load`], and then the scene as it is computed with ([`Scene::settled`]): for verbs that take places from one computation to another.
///
/// # Errors
/// As [`load`].
pub fn load_settled(
    techniques: Techniques,
    path: &Path,
    size: Option<ImageSize>,
    time_s: Option<f32>,
    settings: &[SettingArgument],
) -> anyhow::Result<Scene> {
    Ok(load(techniques, path, size, time_s, settings)?.settled()?.into_owned())
}

/// Renders moments of a scene, with the threads that it was made in.
pub struct Frames<'a> {
    prepared: &'a PreparedScene,
    renderer: Renderer,
}

impl<'a> Frames<'a> {
    /// With the threads of the current rayon pool, or on a driver if `driver` is given (by name, or the first).
    ///
    /// # Errors
    /// If the scene cannot be prepared.
    pub fn new(request: &Request, prepared: &'a PreparedScene, driver: Option<Option<&str>>) -> anyhow::Result<Self> {
        let PreparedScene { technique, scene, .. } = prepared;
        let mut options = RenderOptions {
            technique: (*technique).to_owned(),
            techniques: request.techniques,
            memory_limit_bytes: request.memory_limit_bytes,
            layers: request.layers.clone(),
            ..RenderOptions::default()
        };
        options.device.threads = Some(rayon::current_num_threads());
        let renderer = match driver {
            None => Renderer::new(scene, &options)?,
            Some(name) => Renderer::with_executor(scene, &options, drivers::executor(name, options.device, options.memory_limit_bytes)?)?,
        };
        Ok(Self { prepared, renderer })
    }

    /// Renders the moment `after_s` seconds after the scene's own.
    ///
    /// # Errors
    /// If the scene has no such moment, the frame cannot be built or run, or a layer is unknown.
    pub fn render(&mut self, after_s: f32) -> anyhow::Result<Rendering> {
        let PreparedScene { technique, scene, .. } = self.prepared;
        let mut scene = Cow::Borrowed(scene);
        if after_s > 0.0 {
            let time_s = scene.time_s + after_s;
            scene.to_mut().set("time_s", &time_s.to_string()).context("cannot go on to the next frame")?;
        }
        let Rendered { layers, counters, audit, .. } = self.renderer.render(&scene, None)?;
        Ok(Rendering { technique, layers, tone: tone_map(&scene), counters, audit })
    }
}

/// The scene's tone map.
fn tone_map(scene: &Scene) -> ToneMap {
    let tone = &scene.tone;
    ToneMap { exposure: tone.exposure(), shoulder: tone.shoulder, white: tone.white, desaturation: tone.desaturation }
}
