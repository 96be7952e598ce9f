//! `nephroid compare`: compares two pictures, or techniques with the ground truth.

mod pictures;
mod scene;
mod table;

use std::ffi::OsStr;
use std::path::PathBuf;

use anyhow::{bail, ensure};

use crate::caustics::Techniques;
use crate::cli::args::{self, ImageSize, SettingArgument};
use crate::cli::{Outcome, interrupt, output};
use crate::report::{MEASURES, Measure, measure};

/// The arguments as typed.
#[derive(Debug, clap::Args)]
#[command(after_long_help = measures_help())]
pub struct LowArgs {
    /// Two files, reference first (PNG or EXR); or one scene (RON), to compare techniques with the ground truth
    #[arg(required = true, num_args = 1..=2, value_name = "REFERENCE TEST | SCENE")]
    files: Vec<PathBuf>,

    /// With two EXR files: the layer to compare [default: caustic_irradiance, or color]
    #[arg(long, value_name = "NAME", value_parser = args::layer_name)]
    layer: Option<String>,

    /// With a scene: which techniques, separated by commas, or `all`
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    techniques: Option<Vec<String>>,

    /// With a scene: photons of the ground truth; `k`, `M` and `G` are understood [default: 50M]
    #[arg(long, value_name = "N", value_parser = args::large_count)]
    photons: Option<u64>,

    /// With a scene: which of the random sequences of the ground truth [default: 0]
    #[arg(long, value_name = "N")]
    seed: Option<u32>,

    /// With a scene: change a value of it; may be repeated, the last one wins
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = args::setting)]
    settings: Vec<SettingArgument>,

    /// With a scene: image size in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = args::image_size)]
    size: Option<ImageSize>,

    /// With a scene: the moment, in seconds since the water was started [default: the scene's]
    #[arg(long, value_name = "SECONDS", value_parser = args::seconds, allow_hyphen_values = true)]
    time: Option<f32>,

    #[command(flatten)]
    memory_limit: args::MemoryLimit,

    /// Exit with 1 if a measure is worse than this; may be repeated
    #[arg(long = "bound", value_name = "MEASURE=VALUE", value_parser = bound)]
    bounds: Vec<Bound>,

    /// Picture to write (PNG): reference, result and difference; of several techniques, one picture each with its name put in [default: in out/ for a scene, none for two files]
    #[arg(short, long = "output", value_name = "FILE")]
    output: Option<PathBuf>,

    /// Print the results as JSON
    #[arg(long)]
    json: bool,
}

/// A bound on one measure.
#[derive(Clone, Debug)]
pub struct Bound {
    measure: &'static Measure,
    value: f64,
}

/// Parses `MEASURE=VALUE`.
fn bound(text: &str) -> Result<Bound, String> {
    let names = || MEASURES.iter().map(|m| m.name).collect::<Vec<_>>().join(", ");
    let Some((name, value)) = text.split_once('=') else { return Err(format!("expected MEASURE=VALUE, MEASURE one of {}", names())) };
    let measure = measure(name.trim()).ok_or_else(|| format!("there is no measure `{}`; there are: {}", name.trim(), names()))?;
    let number = value.trim().parse::<f64>().ok().filter(|value| value.is_finite() && *value >= 0.0);
    let value = number.ok_or_else(|| format!("the bound of {} must be a number, at least 0", measure.name))?;
    Ok(Bound { measure, value })
}

/// The table of measures, shown below the flags.
fn measures_help() -> String {
    let rows: Vec<_> = MEASURES.iter().map(|m| ["", m.name, m.summary]).collect();
    format!(
        "Measures; a bound is the most that is allowed, for energy_ratio and bias the largest distance from 1 and 0, for psnr and ssim the least:\n{}",
        output::columns(&rows)
    )
}

/// The resolved arguments.
#[derive(Debug)]
pub struct HiArgs {
    what: What,
    bounds: Vec<Bound>,
    output: Option<PathBuf>,
    json: bool,
}

#[derive(Debug)]
enum What {
    Pictures(pictures::Request),
    Scene(scene::Request),
}

impl HiArgs {
    /// Resolves the arguments. Reads nothing and writes nothing.
    ///
    /// # Errors
    /// If flags contradict each other, or a technique or file format is unknown.
    pub fn resolve(low: LowArgs, known: Techniques) -> anyhow::Result<Self> {
        let is_scene = |path: &PathBuf| path.extension().and_then(OsStr::to_str).is_some_and(|e| e.eq_ignore_ascii_case("ron"));
        if let Some(path) = &low.output {
            let png = path.extension().and_then(OsStr::to_str).is_some_and(|e| e.eq_ignore_ascii_case("png"));
            ensure!(png, "the picture {} must be named .png", path.display());
        }
        let of_scene = low.techniques.is_some()
            || low.photons.is_some()
            || low.seed.is_some()
            || !low.settings.is_empty()
            || low.size.is_some()
            || low.time.is_some();
        let what = match low.files.as_slice() {
            [scene] if is_scene(scene) => {
                ensure!(low.layer.is_none(), "--layer is for two files; techniques are compared by their caustic irradiance");
                What::Scene(scene::Request {
                    scene: scene.clone(),
                    known,
                    techniques: techniques(known, low.techniques.as_deref())?,
                    photons: low.photons.unwrap_or(scene::DEFAULT_PHOTONS),
                    seed: low.seed.unwrap_or(0),
                    size: low.size,
                    time_s: low.time,
                    settings: low.settings,
                    memory_limit_bytes: low.memory_limit.bytes(),
                })
            }
            [one] => bail!("{} alone cannot be compared; give a second file, or one scene (.ron)", one.display()),
            [reference, test] => {
                if let Some(scene) = [reference, test].into_iter().find(|path| is_scene(path)) {
                    bail!("{} is a scene; a scene is compared by itself, two files must be PNG or EXR", scene.display());
                }
                ensure!(!of_scene, "--techniques, --photons, --seed, --set, --size and --time are for a scene, not for two files");
                What::Pictures(pictures::Request {
                    reference: reference.clone(),
                    test: test.clone(),
                    layer: low.layer,
                    memory_limit_bytes: low.memory_limit.bytes(),
                })
            }
            _ => bail!("one scene or two files can be compared"),
        };
        Ok(Self { what, bounds: low.bounds, output: low.output, json: low.json })
    }
}

/// The named techniques; each must be known and named once. All techniques for `all` or if none is named.
fn techniques(known: Techniques, names: Option<&[String]>) -> anyhow::Result<Vec<&'static str>> {
    let all: Vec<&'static str> = known.names().collect();
    let Some(names) = names else { return Ok(all) };
    if names == ["all"] {
        return Ok(all);
    }
    let mut chosen = Vec::new();
    for name in names {
        let Some(&known) = all.iter().find(|known| **known == name.as_str()) else {
            bail!("there is no technique `{name}`; the techniques are: all, {}", all.join(", "));
        };
        ensure!(!chosen.contains(&known), "--techniques names `{known}` twice");
        chosen.push(known);
    }
    Ok(chosen)
}

/// Compares, prints the results and writes pictures.
///
/// # Errors
/// If a file cannot be read, compared or written.
pub fn run(args: &HiArgs) -> anyhow::Result<Outcome> {
    interrupt::install()?;
    let results = match &args.what {
        What::Pictures(request) => pictures::compare(request, args.output.as_deref())?,
        What::Scene(request) => scene::compare(request, args.output.as_deref())?,
    };
    table::tell(&results, &args.bounds, args.json)
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

    fn message(words: &[&str]) -> String {
        match Line::try_parse_from(["compare"].iter().chain(words)) {
            Ok(line) => HiArgs::resolve(line.low, TECHNIQUES).unwrap_err().to_string(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        assert!(message(&["a.exr"]).contains("alone cannot be compared"));
        assert!(message(&["a.ron", "b.exr"]).contains("a.ron is a scene"));
        assert!(message(&["a.exr", "b.exr", "--photons", "5"]).contains("are for a scene"));
        assert!(message(&["a.ron", "--layer", "color"]).contains("--layer is for two files"));
        assert!(message(&["a.ron", "--techniques", "magic"]).contains("there is no technique `magic`; the techniques are: all, "));
        assert!(message(&["a.ron", "--bound", "beauty=1"]).contains("there is no measure `beauty`"));
        assert!(message(&["a.ron", "--bound", "mse=-1"]).contains("must be a number, at least 0"));
        assert!(message(&["a.ron", "-o", "x.exr"]).contains("must be named .png"));
    }
}
