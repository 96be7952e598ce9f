//! The scenes of this repository with mirrors, glass or water, and what is measured on them.

use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;

use crate::caustics::splatting::Splatting;
use crate::caustics::{RenderOptions, Rendered, Renderer, Techniques};
use crate::cli::truth::{self, Truth};
use crate::report::Verdict;
use crate::scene::Scene;

/// Names of the scenes, without `.ron`.
const SCENES: [&str; 9] = ["ring", "bowl", "ball", "companions", "glass", "knots", "figure", "tablecloth", "pool"];

/// Width and height of the pictures.
const SIZE: (u32, u32) = (480, 270);

/// Samples along a side of a pixel.
const SAMPLES: u32 = 2;

/// What a row or a column of a table changes in the settings.
pub type Change = fn(&mut Splatting);

/// Photons of the ground truth.
const PHOTONS: u64 = 16_000_000;

/// A scene at the size of the tables, with default settings but for samples.
///
/// # Errors
/// If it cannot be loaded.
fn load(techniques: Techniques, folder: &Path, name: &str) -> anyhow::Result<Scene> {
    let mut scene = techniques.load(&folder.join(format!("{name}.ron")))?;
    (scene.image.width, scene.image.height) = SIZE;
    *scene.techniques.edit::<Splatting>() = Splatting { samples: SAMPLES, ..Splatting::default() };
    Ok(scene)
}

/// All scenes: none is measured before all are read.
///
/// # Errors
/// If one cannot be loaded.
pub fn load_all(techniques: Techniques, folder: &Path) -> anyhow::Result<Vec<(&'static str, Scene)>> {
    SCENES.into_iter().map(|name| Ok((name, load(techniques, folder, name)?))).collect()
}

/// A scene with these settings.
pub fn with(scene: &Scene, settings: Splatting) -> Scene {
    let mut scene = scene.clone();
    *scene.techniques.edit::<Splatting>() = settings;
    scene
}

/// Renders these layers.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn render(scene: &Scene, layers: &[&str]) -> anyhow::Result<Rendered> {
    let layers = Some(layers.iter().map(|name| (*name).to_owned()).collect());
    let options = RenderOptions { technique: "splatting".to_owned(), layers, ..RenderOptions::default() };
    Ok(Renderer::new(scene, &options)?.render(scene, None)?)
}

/// Median time of a frame, s, of so many.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn frame_s(scene: &Scene, frames: u32) -> anyhow::Result<f64> {
    let options = RenderOptions { technique: "splatting".to_owned(), ..RenderOptions::default() };
    let mut renderer = Renderer::new(scene, &options)?;
    let mut times = Vec::new();
    for frame in 0..=frames {
        let start = Instant::now();
        renderer.run(scene, None)?;
        // The first one warms up.
        if frame > 0 {
            times.push(start.elapsed().as_secs_f64());
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// The ground truth where a scene's picture shows receivers.
///
/// # Errors
/// If the scene cannot be rendered or traced.
pub fn truth_of(scene: &Scene) -> anyhow::Result<Truth> {
    let points = truth::points(&render(scene, &truth::LAYERS)?.layers).context("the picture has no layers")?;
    Truth::new(scene, points, PHOTONS, 0, |_| ())
}

/// All measures of a scene's picture, and how long it took to draw and to read back, s.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn judged(scene: &Scene, truth: &Truth) -> anyhow::Result<(Vec<Verdict>, f64)> {
    let start = Instant::now();
    let rendered = render(scene, &["caustic_irradiance"])?;
    let seconds = start.elapsed().as_secs_f64();
    let (test, reference) = (rendered.layers.get("caustic_irradiance").context("no caustics")?.rgb(), truth.reference());
    Ok((truth.judge(truth.pair(&reference, &test)?), seconds))
}

/// Value of a measure; `None` where it has none.
pub fn value(verdicts: &[Verdict], name: &str) -> Option<f64> {
    verdicts.iter().find(|verdict| verdict.name == name)?.value.as_ref().ok().copied()
}

/// A number in a table, with so many digits.
pub fn cell(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| crate::report::number(value, digits))
}
