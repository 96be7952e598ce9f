//! `nephroid render`: renders a scene file to a picture and its layers.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context as _, bail, ensure};
use clap::ValueEnum;
use serde::Serialize;

use crate::caustics::Techniques;
use crate::caustics::audit::imbalance;
use crate::cli::args::{self, ImageSize, SettingArgument};
use crate::cli::files::{self, Format, Output};
use crate::cli::progress::Progress;
use crate::cli::renderer::{self, Frames, Rendering, Request};
use crate::cli::{interrupt, output};
use crate::image::{LayerSet, STANDARD_LAYERS, file, openexr, png};

/// The layer that a PNG contains.
const PICTURE_LAYER: &str = "color";

/// The arguments as typed.
#[derive(Debug, clap::Args)]
#[command(after_long_help = layers_help())]
pub struct LowArgs {
    /// The scene file (RON)
    scene: PathBuf,

    /// How caustics are computed; `nephroid list techniques` shows the names [default: the one that draws most of the scene]
    #[arg(long, value_name = "NAME")]
    technique: Option<String>,

    /// The published equation to the letter, or its energy-conserving form [default: the scene's]
    #[arg(long, value_name = "KIND")]
    radiometry: Option<RadiometryArgument>,

    /// Change a value of the scene or a setting of the technique; may be repeated, the last one wins
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = args::setting)]
    settings: Vec<SettingArgument>,

    /// Image size in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = args::image_size)]
    size: Option<ImageSize>,

    /// The moment shown, in seconds since the water was started [default: the scene's]
    #[arg(long, value_name = "SECONDS", value_parser = args::seconds, allow_hyphen_values = true)]
    time: Option<f32>,

    /// Number of frames to render, one after the other; files are numbered, as in out/pool.0007.png
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,

    /// With --frames: seconds from one frame to the next [default: a twenty-fourth]
    #[arg(long, value_name = "SECONDS", value_parser = args::seconds)]
    frame_s: Option<f32>,

    /// Layers to render, separated by commas [default: all]
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = args::layer_name)]
    layers: Option<Vec<String>>,

    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(args::MAX_THREADS)))]
    threads: Option<u16>,

    /// Who draws: the software GPU, or a Vulkan driver (in builds with the feature `wgpu`)
    #[arg(long, value_name = "KIND", default_value = "cpu")]
    backend: Backend,

    /// With --backend wgpu: part of the name of the adapter; `nephroid list adapters` shows them [default: the first of them]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,

    #[command(flatten)]
    memory_limit: args::MemoryLimit,

    /// File to write, .png for the picture or .exr for the layers; may be repeated [default: both, in out/]
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,

    /// Print counters and the energy audit as JSON
    #[arg(long)]
    json: bool,
}

/// Who draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// The software GPU
    Cpu,
    /// A Vulkan driver
    Wgpu,
}

/// How light is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RadiometryArgument {
    /// The published equation, to the letter
    Paper,
    /// Conserved: no light is made or lost
    Physical,
}

impl RadiometryArgument {
    /// The name in `--set`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Physical => "physical",
        }
    }
}

/// The table of layers, shown below the flags.
fn layers_help() -> String {
    let rows: Vec<_> = STANDARD_LAYERS.iter().map(|layer| ["", layer.name, layer.unit, layer.summary]).collect();
    format!("Layers (intermediate attachments go by PASS/NAME):\n{}", output::columns(&rows))
}

/// The resolved arguments: every default filled in, every contradiction refused.
#[derive(Debug)]
pub struct HiArgs {
    request: Request,
    /// The driver, by name or any; `None` for the software GPU.
    driver: Option<Option<String>>,
    outputs: Vec<Output>,
    /// Whether the outputs are in the default folder, which is created if necessary.
    default_folder: bool,
    thread_count: usize,
    /// Number of frames, and seconds from one to the next.
    frames: (u32, f32),
    json: bool,
}

impl HiArgs {
    /// Resolves the arguments. Reads nothing and writes nothing.
    ///
    /// # Errors
    /// If flags contradict each other, a technique or file format is unknown, or a layer is named twice.
    pub fn resolve(low: LowArgs, techniques: Techniques) -> anyhow::Result<Self> {
        let default_folder = low.outputs.is_empty();
        let outputs = if default_folder { files::default_outputs(&low.scene, "")? } else { files::chosen_outputs(low.outputs)? };
        if let Some(layers) = &low.layers {
            if let Some((index, name)) = layers.iter().enumerate().find(|(index, name)| layers[..*index].contains(name)) {
                bail!("--layers names `{name}` twice, again at place {}", index + 1);
            }
            if let Some(png) = outputs.iter().find(|output| output.format == Format::Png) {
                ensure!(
                    layers.iter().any(|name| name == PICTURE_LAYER),
                    "{} shows the layer `{PICTURE_LAYER}`, which --layers leaves out; add it, or choose an .exr with -o",
                    png.path.display()
                );
            }
        }
        // If only pictures are written, the other layers are not needed.
        let pictures_only = outputs.iter().all(|output| output.format == Format::Png);
        let layers = low.layers.or_else(|| pictures_only.then(|| vec![PICTURE_LAYER.to_owned()]));
        if let Some(name) = &low.technique {
            let known: Vec<_> = techniques.names().collect();
            ensure!(known.contains(&name.as_str()), "there is no technique `{name}`; the techniques are: {}", known.join(", "));
        }
        ensure!(
            low.adapter.is_none() || low.backend == Backend::Wgpu,
            "--adapter names a driver, but --backend cpu draws without one; add --backend wgpu"
        );
        ensure!(low.frame_s.is_none() || low.frames > 1, "--frame-s is the time between frames; say how many with --frames");
        Ok(Self {
            driver: (low.backend == Backend::Wgpu).then_some(low.adapter),
            request: Request {
                scene: low.scene,
                techniques,
                technique: low.technique,
                radiometry: low.radiometry,
                size: low.size,
                time_s: low.time,
                settings: low.settings,
                layers,
                memory_limit_bytes: low.memory_limit.bytes(),
            },
            outputs,
            default_folder,
            // For rayon, 0 means one thread per core.
            thread_count: low.threads.map_or(0, usize::from),
            frames: (low.frames, low.frame_s.unwrap_or(1.0 / 24.0)),
            json: low.json,
        })
    }
}

/// The output of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    scene: String,
    technique: &'static str,
    /// What the scene contains and the technique does not draw.
    not_drawn: &'a [&'static str],
    /// Bodies of glass whose triangles faced in, and were turned over.
    bodies_turned: u64,
    files: Vec<String>,
    layers: Vec<LayerReport<'a>>,
    threads: usize,
    seconds: f64,
    energy_w: serde_json::Map<String, serde_json::Value>,
    /// How far the sums of the audit are from closing, as a share of the light.
    imbalance: f64,
    counters: serde_json::Map<String, serde_json::Value>,
}

/// One layer in the report.
#[derive(Serialize)]
struct LayerReport<'a> {
    name: &'a str,
    width: u32,
    height: u32,
    channels: usize,
}

/// Renders, writes every file, and prints a report.
///
/// # Errors
/// If the scene cannot be loaded or rendered, or a file cannot be written.
pub fn run(args: &HiArgs) -> anyhow::Result<()> {
    interrupt::install()?;
    let start = Instant::now();
    let prepared = renderer::prepare(&args.request)?;
    if args.default_folder {
        files::make_default_folder()?;
    }
    // A render takes long, so a folder that cannot be written to is found before it starts.
    interrupt::uninterrupted(|| args.outputs.iter().try_for_each(|output| file::check_writable(&output.path)))?;

    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.thread_count).build().context("cannot start the threads")?;
    let (count, step_s) = args.frames;
    let progress = Progress::new(u64::from(count) * (1 + args.outputs.len() as u64));
    let mut reports = Vec::new();
    let mut text = String::new();
    let mut turned = 0;
    pool.install(|| -> anyhow::Result<()> {
        let mut frames = Frames::new(&args.request, &prepared, args.driver.as_ref().map(Option::as_deref))?;
        let mut start = start;
        for number in 0..count {
            progress.step(format!("rendering {}", args.request.scene.display()));
            let rendering = frames.render(number as f32 * step_s)?;
            progress.done();
            if number == 0 {
                turned = renderer::turned(&rendering.counters);
            }
            let outputs: Vec<Output> = args.outputs.iter().map(|output| output.of_frame(number, count)).collect();
            write_all(&rendering, &outputs, &progress)?;
            let seconds = start.elapsed().as_secs_f64();
            start = Instant::now();
            if args.json {
                let report = report(args, &rendering, &outputs, (&prepared.not_drawn, pool.current_num_threads(), seconds));
                reports.push(serde_json::to_value(report)?);
            } else {
                text.push_str(&summary(args, &rendering, &outputs, seconds));
            }
        }
        Ok(())
    })?;
    drop(progress);
    renderer::warn(&args.request.scene, prepared.technique, &prepared.not_drawn);
    renderer::warn_of_turned(&args.request.scene, turned);
    match (args.json, count) {
        (false, _) => output::text(&text)?,
        (true, 1) => output::json(&reports[0])?,
        (true, _) => output::json(&reports)?,
    }
    Ok(())
}

/// Writes all files, each while the next one is encoded: writing takes a large part of the time that encoding takes.
fn write_all(rendering: &Rendering, outputs: &[Output], progress: &Progress) -> anyhow::Result<()> {
    let write = |encoded: Option<(&Output, Vec<u8>)>| -> anyhow::Result<()> {
        if let Some((output, bytes)) = encoded {
            interrupt::uninterrupted(|| file::write_atomically(&output.path, &bytes))?;
            progress.done();
        }
        Ok(())
    };
    // Layers first: their files are large, and pictures are encoded while they are written.
    let (layers, pictures): (Vec<&Output>, Vec<&Output>) = outputs.iter().partition(|output| output.format == Format::Exr);
    let mut encoded = None;
    for output in layers.into_iter().chain(pictures) {
        progress.step(format!("writing {}", output.path.display()));
        let (written, bytes) = rayon::join(|| write(encoded.take()), || encode(rendering, output));
        written?;
        encoded = Some((output, bytes?));
    }
    write(encoded)
}

/// The bytes of one file.
fn encode(rendering: &Rendering, output: &Output) -> anyhow::Result<Vec<u8>> {
    let cannot = || format!("cannot make {}", output.path.display());
    match output.format {
        Format::Png => {
            let picture = rendering.layers.get(PICTURE_LAYER).with_context(|| format!("there is no layer `{PICTURE_LAYER}` to show"));
            png::encode(picture.with_context(cannot)?, &rendering.tone).with_context(cannot)
        }
        Format::Exr => openexr::encode(&rendering.layers).with_context(cannot),
    }
}

/// The results for `--json`.
fn report<'a>(
    args: &HiArgs,
    rendering: &'a Rendering,
    outputs: &[Output],
    (not_drawn, threads, seconds): (&'a [&'static str], usize, f64),
) -> Report<'a> {
    Report {
        scene: args.request.scene.display().to_string(),
        technique: rendering.technique,
        not_drawn,
        bodies_turned: renderer::turned(&rendering.counters),
        files: outputs.iter().map(|output| output.path.display().to_string()).collect(),
        layers: layer_reports(&rendering.layers),
        threads,
        seconds,
        energy_w: rendering.audit.iter().map(|(name, watts)| (name.clone(), (*watts).into())).collect(),
        imbalance: imbalance(&rendering.audit),
        counters: rendering.counters.iter().map(|(name, count)| (name.clone(), (*count).into())).collect(),
    }
}

/// Name and shape of every layer.
fn layer_reports(layers: &LayerSet) -> Vec<LayerReport<'_>> {
    layers
        .iter()
        .map(|layer| LayerReport { name: layer.name(), width: layer.width(), height: layer.height(), channels: layer.channel_count() })
        .collect()
}

/// The results as text.
fn summary(args: &HiArgs, rendering: &Rendering, outputs: &[Output], seconds: f64) -> String {
    let mut text = String::new();
    let size = rendering.layers.iter().next().map_or_else(String::new, |layer| format!(", {}x{}", layer.width(), layer.height()));
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}: {}{size}, {seconds:.2} s", args.request.scene.display(), rendering.technique);
    for output in outputs {
        let _ = writeln!(text, "  {}", output.path.display());
    }
    let audit: Vec<_> = rendering.audit.iter().map(|(name, watts)| (name.as_str(), format!("{watts:.6} W"))).collect();
    text.push_str(&output::section("energy", &audit));
    let counters: Vec<_> = rendering.counters.iter().map(|(name, count)| (name.as_str(), count.to_string())).collect();
    text.push_str(&output::section("counters", &counters));
    text
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::caustics::TECHNIQUES;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        low: LowArgs,
    }

    fn resolve(words: &[&str]) -> anyhow::Result<HiArgs> {
        HiArgs::resolve(Line::try_parse_from(["render"].iter().chain(words))?.low, TECHNIQUES)
    }

    fn message(words: &[&str]) -> String {
        resolve(words).unwrap_err().to_string()
    }

    #[test]
    fn defaults_are_both_files_in_out() {
        let args = resolve(&["scenes/pool.v2.ron"]).unwrap();
        let paths: Vec<_> = args.outputs.iter().map(|output| output.path.to_str().unwrap()).collect();
        assert_eq!(paths, ["out/pool.v2.png", "out/pool.v2.exr"]);
        assert!(args.default_folder);
        assert_eq!((args.thread_count, args.request.memory_limit_bytes), (0, 4096 << 20));
    }

    #[test]
    fn outputs_are_told_apart_by_their_ending() {
        let args = resolve(&["a.ron", "-o", "x/b.PNG", "-o", "c.exr"]).unwrap();
        assert_eq!(args.outputs.iter().map(|output| output.format).collect::<Vec<_>>(), [Format::Png, Format::Exr]);
        assert!(!args.default_folder);
        for name in ["b.jpg", "b", ".png", "png"] {
            assert!(message(&["a.ron", "-o", name]).contains("a file ends in .png or .exr"), "{name} was accepted");
        }
        assert_eq!(message(&["a.ron", "-o", "b.png", "-o", "b.png"]), "-o names b.png twice");
    }

    #[test]
    fn layers_must_hold_the_picture_if_a_png_is_written() {
        assert!(message(&["a.ron", "--layers", "depth"]).contains("which --layers leaves out"));
        assert!(message(&["a.ron", "--layers", "color,depth,color"]).contains("names `color` twice, again at place 3"));
        let args = resolve(&["a.ron", "--layers", "depth,normal", "-o", "b.exr"]).unwrap();
        assert_eq!(args.request.layers, Some(vec!["depth".to_owned(), "normal".to_owned()]));
        assert!(resolve(&["a.ron", "--layers", "color"]).is_ok());
    }

    #[test]
    fn pictures_need_no_other_layer() {
        assert_eq!(resolve(&["a.ron", "-o", "b.png"]).unwrap().request.layers, Some(vec!["color".to_owned()]));
        assert_eq!(resolve(&["a.ron", "-o", "b.png", "-o", "b.exr"]).unwrap().request.layers, None);
    }

    #[test]
    fn settings_keep_their_order() {
        let args = resolve(&["a.ron", "--set", "a=1", "--set", "b=2", "--set", "a=3"]).unwrap();
        let keys: Vec<_> = args.request.settings.iter().map(|setting| (setting.key.as_str(), setting.value.as_str())).collect();
        assert_eq!(keys, [("a", "1"), ("b", "2"), ("a", "3")]);
    }

    #[test]
    fn an_unknown_technique_is_refused_before_anything_is_read() {
        assert!(message(&["absent.ron", "--technique", "magic"]).starts_with("there is no technique `magic`; the techniques are:"));
    }

    #[test]
    fn a_scene_without_a_file_name_is_refused() {
        assert_eq!(message(&[".."]), ".. does not name a scene file");
    }
}
