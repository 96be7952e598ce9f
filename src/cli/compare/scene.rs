//! Comparison of techniques with the ground truth of a scene.
//!
//! The ground truth is measured at exactly the points that a technique has drawn, so the comparison concerns light transport alone. How accurately a
//! technique finds the points that the eye sees is a separate measure, `view_px`.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use glam::Vec3;

use super::pictures;
use super::table::{Column, Results};
use crate::caustics::account::account as picture_account;
use crate::caustics::{RenderOptions, Rendered, Renderer, Techniques};
use crate::cli::args::{ImageSize, SettingArgument};
use crate::cli::progress::Progress;
use crate::cli::truth::{self, Truth};
use crate::cli::{files, renderer};
use crate::image::LayerSet;
use crate::metrics::quantile;
use crate::pipeline::{Device, DeviceOptions};
use crate::report::number;
use crate::scene::Scene;
use crate::trace::{self, TraceOptions, camera_points};

/// Photons of the ground truth if no number is given.
pub const DEFAULT_PHOTONS: u64 = 50_000_000;

/// The scene and the techniques to compare.
#[derive(Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// All known techniques.
    pub known: Techniques,
    /// Names of the techniques to compare.
    pub techniques: Vec<&'static str>,
    /// Photons of the ground truth.
    pub photons: u64,
    /// Seed of the ground truth.
    pub seed: u32,
    /// Overrides the scene's image size.
    pub size: Option<ImageSize>,
    /// Overrides the scene's time, in seconds.
    pub time_s: Option<f32>,
    /// Further overrides of the scene.
    pub settings: Vec<SettingArgument>,
    /// Most memory that the comparison may take, bytes.
    pub memory_limit_bytes: u64,
}

/// The memory of a comparison: of the ground truth, of the figure, and of a technique's picture.
fn check_memory(scene: &Scene, request: &Request) -> anyhow::Result<()> {
    let pixels = u64::from(scene.image.width) * u64::from(scene.image.height);
    let device = Device::new(DeviceOptions { threads: Some(1), ..DeviceOptions::default() })?;
    let mut account = trace::account(scene, &TraceOptions { camera: true, ..TraceOptions::default() });
    account.add("measures", pixels * pictures::PIXEL_BYTES, "image.width or image.height");
    let known = |name: &&str| request.known.find(name);
    for technique in request.techniques.iter().map(known).collect::<Result<Vec<_>, _>>()? {
        let mut with = account.clone();
        with.parts.extend(picture_account(technique, scene, &device, &truth::LAYERS).parts);
        with.check(request.memory_limit_bytes).with_context(|| format!("{} with {}", request.scene.display(), technique.name()))?;
    }
    Ok(())
}

/// Compares every technique with the ground truth.
///
/// # Errors
/// If the scene cannot be loaded, traced or rendered, or a figure cannot be written.
pub fn compare(request: &Request, picture: Option<&Path>) -> anyhow::Result<Results> {
    let scene = renderer::load_settled(request.known, &request.scene, request.size, request.time_s, &request.settings)?;
    check_memory(&scene, request)?;
    if picture.is_none() {
        files::make_default_folder()?;
    }
    let seen = camera_points(&scene)?;
    let mut truths: Vec<Truth> = Vec::new();
    let mut results = Results { reference: String::new(), facts: Vec::new(), bodies_turned: 0, columns: Vec::new(), files: Vec::new() };
    let progress = Progress::new(request.techniques.len() as u64 * request.photons / 1000);
    for (number, technique) in request.techniques.iter().enumerate() {
        let options = RenderOptions {
            technique: (*technique).to_owned(),
            techniques: request.known,
            layers: Some(truth::LAYERS.map(str::to_owned).to_vec()),
            memory_limit_bytes: request.memory_limit_bytes,
            ..RenderOptions::default()
        };
        let Rendered { layers: rendered, counters, .. } = Renderer::new(&scene, &options)?.render(&scene, None)?;
        results.bodies_turned = results.bodies_turned.max(renderer::turned(&counters));
        let points = truth::points(&rendered).context("a technique did not draw its layers")?;
        let known = truths.iter().position(|truth| truth.points.positions == points.positions && truth.points.normals == points.normals);
        let index = match known {
            Some(index) => index,
            None => {
                let told = |photons| progress.reach((number as u64 * request.photons + photons) / 1000);
                truths.push(Truth::new(&scene, points, request.photons, request.seed, told)?);
                truths.len() - 1
            }
        };
        let path = picture_path(picture, request, technique);
        let column = judge_technique(technique, &scene, &rendered, &truths[index], &seen, &path)?;
        let not_drawn = renderer::not_drawn(request.known.find(technique)?, &scene);
        renderer::warn(&request.scene, technique, &not_drawn);
        results.files.push(path.display().to_string());
        results.columns.push(Column { not_drawn: Some(not_drawn), ..column });
    }
    drop(progress);
    renderer::warn_of_turned(&request.scene, results.bodies_turned);
    if let Some(truth) = truths.first() {
        results.reference = format!("ground truth of {}", request.scene.display());
        let valid = truth.irradiance.valid.as_ref().map_or(0, |valid| valid.iter().filter(|v| **v).count());
        results.facts = vec![
            ("photons".to_owned(), truth.photons.to_string()),
            ("noise".to_owned(), format!("{} %", number_of(truth.noise * 100.0))),
            ("pixels".to_owned(), format!("{valid} of {}", truth.points.positions.len())),
        ];
    }
    Ok(results)
}

fn number_of(value: f64) -> String {
    number(value, 3)
}

/// `FILE.png`, with the technique's name inserted if there are several; by default in `out/`.
fn picture_path(picture: Option<&Path>, request: &Request, technique: &str) -> PathBuf {
    match picture {
        Some(path) if request.techniques.len() == 1 => path.to_owned(),
        Some(path) => path.with_extension(format!("{technique}.png")),
        None => {
            let stem = request.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Path::new(files::DEFAULT_FOLDER).join(format!("{stem}.{technique}.compare.png"))
        }
    }
}

fn judge_technique(
    technique: &str,
    scene: &Scene,
    layers: &LayerSet,
    truth: &Truth,
    seen: &[Option<Vec3>],
    path: &Path,
) -> anyhow::Result<Column> {
    let layer = layers.get("caustic_irradiance").context("the technique has no caustic irradiance")?;
    let (test, reference) = (layer.rgb(), truth.reference());
    let pair = truth.pair(&reference, &test)?;
    let verdicts = truth.judge(pair);
    let mut facts = Vec::new();
    let mut off: Vec<f64> = (0..reference.len()).filter(|&k| pair.counts(k)).filter_map(|k| truth.view_error_px(seen, k)).collect();
    for (name, share) in [("view_px, median", 0.5), ("view_px, 95 % quantile", 0.95)] {
        if let Some(value) = quantile(&mut off, share) {
            facts.push((name.to_owned(), number_of(value)));
        }
    }
    let title = if scene.title.is_empty() { "Caustic irradiance".to_owned() } else { format!("{}: caustic irradiance", scene.title) };
    pictures::draw(path, &title, pair, ("Ground truth", technique), "W/m²", &verdicts)?;
    let direct = match layers.get("direct") {
        Some(layer) => Some(truth.judge_direct(&layer.rgb())?),
        None => None,
    };
    let scatters =
        scene.water.is_some() && scene.medium.sigma_s != Vec3::ZERO || scene.smoke.is_some_and(|smoke| smoke.sigma_s != Vec3::ZERO);
    if scatters {
        facts.push(("light scattered in media".to_owned(), "not compared".to_owned()));
    }
    Ok(Column { name: technique.to_owned(), verdicts, direct, facts, not_drawn: None })
}
