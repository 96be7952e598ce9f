//! `nephroid trace`: computes the ground truth of a scene, with standard errors.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use serde::Serialize;

use crate::caustics::Techniques;
use crate::cli::args::{self, ImageSize, SettingArgument};
use crate::cli::files::{self, Format, Output};
use crate::cli::pace::{Next, Pace};
use crate::cli::progress::Progress;
use crate::cli::{Outcome, interrupt, output, renderer};
use crate::image::{Layer, LayerSet, ToneMap, file, openexr, png};
use crate::report::number;
use crate::trace::{Measured, TraceOptions, Tracer};

/// Photons if no option says when to stop.
const DEFAULT_PHOTONS: u64 = 50_000_000;

/// Time between checks of the noise, and between savings of the state.
const LOOK: Duration = Duration::from_secs(1);
const KEEP: Duration = Duration::from_secs(60);

/// Seconds that it takes to write the results of a pixel, about.
const WRITING_S: f64 = 0.6e-6;

/// Share of the lit pixels that the picture shows without compression.
const EXPOSED: f64 = 0.98;

/// The arguments as typed.
#[derive(Debug, clap::Args)]
pub struct LowArgs {
    /// The scene file (RON)
    scene: PathBuf,

    /// Stop after this many photons, rounded up to whole batches; `k`, `M` and `G` are understood [default: 50M, unless --time-limit or --error says when to stop]
    #[arg(long, value_name = "N", value_parser = args::large_count)]
    photons: Option<u64>,

    /// Stop after this many seconds, kept within a tenth; how many photons that is, depends on the machine
    #[arg(long, value_name = "SECONDS", value_parser = args::time_limit)]
    time_limit: Option<f64>,

    /// Stop when the noise is below this: root mean square of the pixels' standard errors over the mean irradiance, and with --volume
    /// likewise that of light scattered in media
    #[arg(long, value_name = "SHARE", value_parser = args::share)]
    error: Option<f64>,

    /// Which of the random sequences
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Also measure the light that media scatter once towards the camera: the layers `godrays`, and `direct_godrays` for light that met
    /// neither water nor mirrors nor glass
    #[arg(long)]
    volume: bool,

    /// Change a value of the scene; may be repeated, the last one wins
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = args::setting)]
    settings: Vec<SettingArgument>,

    /// Image size in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = args::image_size)]
    size: Option<ImageSize>,

    /// The moment shown, in seconds since the water was started [default: the scene's]
    #[arg(long, value_name = "SECONDS", value_parser = args::seconds, allow_hyphen_values = true)]
    time: Option<f32>,

    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(args::MAX_THREADS)))]
    threads: Option<u16>,

    #[command(flatten)]
    memory_limit: args::MemoryLimit,

    /// Go on where an interrupted run with the same arguments stopped
    #[arg(long)]
    resume: bool,

    /// File to write, .exr for the layers or .png for a picture of the irradiance; may be repeated [default: both, in out/]
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,

    /// Print the results as JSON
    #[arg(long)]
    json: bool,
}

/// The resolved arguments.
#[derive(Debug)]
pub struct HiArgs {
    /// The techniques whose settings the scene may contain; none of them is used.
    techniques: Techniques,
    low: LowArgs,
    outputs: Vec<Output>,
    default_folder: bool,
    /// File for the state of an unfinished run.
    state: PathBuf,
    photons: u64,
}

impl HiArgs {
    /// Resolves the arguments. Reads nothing and writes nothing.
    ///
    /// # Errors
    /// If flags contradict each other, or a file format is unknown.
    pub fn resolve(mut low: LowArgs, techniques: Techniques) -> anyhow::Result<Self> {
        let default_folder = low.outputs.is_empty();
        let chosen = std::mem::take(&mut low.outputs);
        let outputs = if default_folder { files::default_outputs(&low.scene, ".truth")? } else { files::chosen_outputs(chosen)? };
        let endless = low.time_limit.is_some() || low.error.is_some();
        let photons = low.photons.unwrap_or(if endless { u64::MAX } else { DEFAULT_PHOTONS });
        let state = state_path(&outputs.last().context("there is no file to write")?.path);
        Ok(Self { techniques, low, outputs, default_folder, state, photons })
    }
}

/// `FILE.state`, in the folder of the file.
fn state_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".state");
    path.with_file_name(name)
}

/// The output of `--json`.
#[derive(Serialize)]
struct Report {
    scene: String,
    /// Bodies of glass whose triangles faced in, and were turned over.
    bodies_turned: u64,
    files: Vec<String>,
    finished: bool,
    photons: u64,
    batches: u64,
    seed: u32,
    photons_per_s: f64,
    noise: serde_json::Map<String, serde_json::Value>,
    energy_w: serde_json::Map<String, serde_json::Value>,
    imbalance: f64,
    counters: serde_json::Map<String, serde_json::Value>,
    seconds: f64,
}

/// Traces, writes every file, and prints a report.
///
/// # Errors
/// If the scene cannot be loaded or traced, a saved state does not fit, or a file cannot be written.
pub fn run(args: &HiArgs) -> anyhow::Result<Outcome> {
    interrupt::install_patient()?;
    let start = Instant::now();
    let low = &args.low;
    let scene = renderer::load_settled(args.techniques, &low.scene, low.size, low.time, &low.settings)?;
    if args.default_folder {
        files::make_default_folder()?;
    }
    args.outputs.iter().try_for_each(|output| file::check_writable(&output.path))?;
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(low.threads.map_or(0, usize::from)).build().context("cannot start the threads")?;
    let memory_limit_bytes = low.memory_limit.bytes();
    let options = TraceOptions { seed: low.seed, camera: true, volume: low.volume, memory_limit_bytes, ..TraceOptions::default() };
    let mut tracer = pool.install(|| Tracer::new(&scene, &options))?;
    if low.resume {
        let bytes = fs::read(&args.state)
            .with_context(|| format!("cannot read {}, which an interrupted run would have left", args.state.display()))?;
        tracer.restore(&bytes).with_context(|| format!("cannot go on from {}", args.state.display()))?;
    }
    let begun = (Instant::now(), tracer.photons());
    let end = pool.install(|| trace(args, &mut tracer, start))?;
    let photons_per_s = (tracer.photons() - begun.1) as f64 / begun.0.elapsed().as_secs_f64();
    let finished = match end {
        End::Finished => true,
        End::Interrupted => false,
        End::TooShort => bail!(
            "--time-limit {} is too short: the noise is known after two batches, and {} done; --resume goes on from there, a smaller --size makes \
             batches shorter",
            low.time_limit.unwrap_or_default(),
            if tracer.batches() == 1 { "one was" } else { "none was" },
        ),
    };
    pool.install(|| -> anyhow::Result<()> {
        let layers = layers(&tracer)?;
        for output in &args.outputs {
            let bytes = encode(&layers, output)?;
            interrupt::uninterrupted(|| file::write_atomically(&output.path, &bytes))?;
        }
        Ok(())
    })?;
    if finished {
        match fs::remove_file(&args.state) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("cannot remove {}", args.state.display()));
            }
            _ => {}
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    renderer::warn_of_turned(&low.scene, tracer.turned_bodies());
    if low.json {
        output::json(&report(args, &tracer, finished, (photons_per_s, seconds)))?;
    } else {
        output::text(&summary(args, &tracer, finished, (photons_per_s, seconds)))?;
    }
    Ok(if finished { Outcome::Done } else { Outcome::Interrupted })
}

/// How a run ends.
enum End {
    Finished,
    Interrupted,
    /// There was no time for two batches.
    TooShort,
}

/// Traces batches until a stop condition holds. The state is saved every minute, and if an interrupt or the time limit comes too early.
fn trace(args: &HiArgs, tracer: &mut Tracer, start: Instant) -> anyhow::Result<End> {
    let progress = Progress::new(if args.photons == u64::MAX { 0 } else { args.photons / 1000 });
    let pixels = tracer.scene().image.width as f64 * f64::from(tracer.scene().image.height);
    let pace = Pace::new(args.low.time_limit, pixels * WRITING_S);
    let (mut looked, mut kept) = (start, Instant::now());
    let mut last = Duration::ZERO;
    let keep = |tracer: &Tracer| {
        interrupt::uninterrupted(|| file::write_atomically(&args.state, &tracer.state())).context("cannot keep the state of the run")
    };
    // Standard errors are known from the second batch on.
    while tracer.photons() < args.photons || tracer.batches() < 2 {
        match pace.next(start.elapsed(), tracer.batches(), last) {
            Next::Batch => {}
            Next::Enough => break,
            Next::TooShort => {
                keep(tracer)?;
                return Ok(End::TooShort);
            }
        }
        let begun = Instant::now();
        if !tracer.run_batch_until(&|| interrupt::is_asked() || pace.is_over(start.elapsed())) {
            if interrupt::is_asked() {
                keep(tracer)?;
                return Ok(End::Interrupted);
            }
            continue;
        }
        last = begun.elapsed();
        progress.reach(tracer.photons() / 1000);
        if looked.elapsed() >= LOOK || args.low.error.is_some() && tracer.batches().is_power_of_two() {
            let noise = tracer.noise();
            progress.step(format!("thousand photons, noise {:.2} %", noise * 100.0));
            if args.low.error.is_some_and(|error| noise <= error) {
                break;
            }
            looked = Instant::now();
        }
        if kept.elapsed() >= KEEP {
            keep(tracer)?;
            kept = Instant::now();
        }
    }
    Ok(End::Finished)
}

/// The measurements as layers: means, and standard errors under the same names with `_error`.
fn layers(tracer: &Tracer) -> anyhow::Result<LayerSet> {
    let mut set = LayerSet::new();
    let mut push = |name: &str, measured: Option<Measured>| -> anyhow::Result<()> {
        let Some(measured) = measured else { return Ok(()) };
        let plane = |values: &[[f64; 3]]| values.iter().map(|v| v.map(|c| c as f32)).collect::<Vec<_>>();
        let (columns, rows) = (measured.columns, measured.rows);
        set.push(Layer::from_pixels(name, columns, rows, &plane(&measured.mean))?)?;
        set.push(Layer::from_pixels(&format!("{name}_error"), columns, rows, &plane(&measured.standard_error))?)?;
        if let Some(valid) = &measured.valid {
            let mask: Vec<[f32; 1]> = valid.iter().map(|&v| [f32::from(u8::from(v))]).collect();
            set.push(Layer::from_pixels(&format!("{name}_valid"), columns, rows, &mask)?)?;
        }
        Ok(())
    };
    push("caustic_irradiance", tracer.pixels())?;
    push("godrays", tracer.volume())?;
    push("direct_irradiance", tracer.direct())?;
    push("direct_godrays", tracer.direct_volume())?;
    push("plane", tracer.plane())?;
    if let Some(points) = tracer.pixel_points() {
        let (columns, rows) = (tracer.scene().image.width, tracer.scene().image.height);
        let of = |value: fn(&(glam::Vec3, glam::Vec3)) -> glam::Vec3| {
            points.iter().map(|p| p.as_ref().map_or([0.0; 3], |p| value(p).to_array())).collect::<Vec<_>>()
        };
        set.push(Layer::from_pixels("position", columns, rows, &of(|p| p.0))?)?;
        set.push(Layer::from_pixels("normal", columns, rows, &of(|p| p.1))?)?;
    }
    Ok(set)
}

/// The bytes of one file.
fn encode(layers: &LayerSet, output: &Output) -> anyhow::Result<Vec<u8>> {
    let cannot = || format!("cannot make {}", output.path.display());
    match output.format {
        Format::Exr => openexr::encode(layers).with_context(cannot),
        Format::Png => {
            let picture = layers.get("caustic_irradiance").context("there is no irradiance to show").with_context(cannot)?;
            png::encode(picture, &exposure(picture)).with_context(cannot)
        }
    }
}

/// An exposure at which all lit pixels but the brightest few are shown without compression.
fn exposure(picture: &Layer) -> ToneMap {
    let planes = picture.planes();
    let brightest = |k: usize| planes.iter().map(|plane| plane.pixels()[k]).fold(0.0, f32::max);
    let mut values: Vec<f32> = (0..planes[0].pixels().len()).map(brightest).filter(|&v| v > 0.0).collect();
    if values.is_empty() {
        return ToneMap::with_stops(0.0);
    }
    values.sort_by(f32::total_cmp);
    let value = values[((values.len() - 1) as f64 * EXPOSED) as usize];
    ToneMap::with_stops(libm::log2f(0.8 / value))
}

fn report(args: &HiArgs, tracer: &Tracer, finished: bool, (photons_per_s, seconds): (f64, f64)) -> Report {
    let audit = tracer.audit();
    Report {
        scene: args.low.scene.display().to_string(),
        bodies_turned: tracer.turned_bodies(),
        files: args.outputs.iter().map(|output| output.path.display().to_string()).collect(),
        finished,
        photons: tracer.photons(),
        batches: tracer.batches(),
        seed: tracer.seed(),
        photons_per_s,
        noise: tracer.noises().into_iter().map(|(name, noise)| (name.to_owned(), noise.into())).collect(),
        energy_w: audit.watts(tracer.batches()).into_iter().map(|(name, watts)| (name.to_owned(), watts.into())).collect(),
        imbalance: audit.imbalance(),
        counters: counters(tracer).into_iter().map(|(name, count)| (name.to_owned(), count.into())).collect(),
        seconds,
    }
}

fn counters(tracer: &Tracer) -> Vec<(&'static str, u64)> {
    let mut counts = tracer.audit().counts();
    counts.push(("bodies_turned", tracer.turned_bodies()));
    counts.push(("pixels_left_out", tracer.pixels_left_out()));
    counts.retain(|(name, count)| *count > 0 || *name == "photons");
    counts
}

fn summary(args: &HiArgs, tracer: &Tracer, finished: bool, (photons_per_s, seconds): (f64, f64)) -> String {
    let mut text = String::new();
    let (scene, photons, rate) = (args.low.scene.display(), tracer.photons(), number(photons_per_s, 3));
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{scene}: {photons} photons, {rate} photons/s, {seconds:.2} s");
    if !finished {
        let _ = writeln!(text, "interrupted; the same command with --resume goes on");
    }
    for output in &args.outputs {
        let _ = writeln!(text, "  {}", output.path.display());
    }
    let noises: Vec<_> = tracer.noises().into_iter().map(|(name, noise)| (name, format!("{:.3} %", noise * 100.0))).collect();
    text.push_str(&output::section("noise", &noises));
    let watts: Vec<_> = tracer.audit().watts(tracer.batches()).into_iter().map(|(name, watts)| (name, format!("{watts:.6} W"))).collect();
    text.push_str(&output::section("energy", &watts));
    let counts: Vec<_> = counters(tracer).into_iter().map(|(name, count)| (name, count.to_string())).collect();
    text.push_str(&output::section("counters", &counts));
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
        HiArgs::resolve(Line::try_parse_from(["trace"].iter().chain(words))?.low, TECHNIQUES)
    }

    #[test]
    fn files_are_named_after_the_scene_and_the_state_after_the_last() {
        let args = resolve(&["scenes/pool.ron"]).unwrap();
        let paths: Vec<_> = args.outputs.iter().map(|output| output.path.to_str().unwrap()).collect();
        assert_eq!(paths, ["out/pool.truth.png", "out/pool.truth.exr"]);
        assert_eq!(args.state, Path::new("out/pool.truth.exr.state"));
        assert_eq!(args.photons, DEFAULT_PHOTONS);
    }

    #[test]
    fn a_time_or_an_error_takes_the_place_of_the_default_number() {
        assert_eq!(resolve(&["a.ron", "--time-limit", "5"]).unwrap().photons, u64::MAX);
        assert_eq!(resolve(&["a.ron", "--error", "0.01"]).unwrap().photons, u64::MAX);
        assert_eq!(resolve(&["a.ron", "--error", "0.01", "--photons", "3M"]).unwrap().photons, 3_000_000);
        for words in [["a.ron", "--photons", "0"], ["a.ron", "--error", "0"], ["a.ron", "--time-limit", "-1"]] {
            assert!(resolve(&words).is_err(), "{words:?} was accepted");
        }
    }
}
