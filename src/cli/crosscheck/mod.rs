//! `nephroid crosscheck`: runs frames on the software GPU and on a driver and compares them after every pass.

#[cfg(feature = "wgpu")]
mod run;

use std::path::PathBuf;

use anyhow::ensure;
use clap::ValueEnum;

use crate::caustics::Techniques;
use crate::cli::args::{self, ImageSize, SettingArgument};

/// The arguments as typed.
#[derive(Debug, clap::Args)]
pub struct LowArgs {
    /// Scene files to compare (RON)
    scenes: Vec<PathBuf>,

    /// Compare every scene in the folder scenes/ and below
    #[arg(long)]
    all: bool,

    /// The technique to compare; `nephroid list techniques` shows the names [default: each of them]
    #[arg(long, value_name = "NAME")]
    technique: Option<String>,

    /// Draw random and adversarial primitives, more than a million triangles, and compare those
    #[arg(long)]
    conformance: bool,

    /// With --conformance: the share of its primitives that is drawn, above 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = args::share, requires = "conformance")]
    share: Option<f64>,

    /// Part of the name of the adapter; `nephroid list adapters` shows them [default: the first of them]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,

    /// Refuse to start what takes more memory than this, in MiB; a frame's textures are held four times
    #[arg(long, value_name = "MIB", default_value_t = 8192, value_parser = clap::value_parser!(u32).range(1..))]
    memory_limit: u32,

    /// What the driver starts each pass from
    #[arg(long, value_name = "MODE", default_value = "both")]
    mode: Modes,

    /// Image size in pixels [default: each scene's]
    #[arg(long, value_name = "WxH", value_parser = args::image_size)]
    size: Option<ImageSize>,

    /// Change a value of the scenes or a setting of the techniques; may be repeated, the last one wins
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = args::setting)]
    settings: Vec<SettingArgument>,

    /// Folder for a picture of each attachment that is beyond its bound: expected, actual, difference [default: none is written]
    #[arg(short, long = "output", value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What the driver starts each pass from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Modes {
    /// From what it drew itself
    Free,
    /// From what the software GPU drew, with its vertices
    Resync,
    /// First one, then the other
    Both,
}

/// The resolved arguments.
#[cfg_attr(not(feature = "wgpu"), expect(dead_code, reason = "without drivers nothing is run, but arguments are checked all the same"))]
#[derive(Debug)]
pub struct HiArgs {
    /// All known techniques.
    pub techniques: Techniques,
    /// The technique to compare; each, if there is none.
    pub technique: Option<String>,
    /// Scene files; all below scenes/ if `all`.
    pub scenes: Vec<PathBuf>,
    /// Whether every shipped scene is compared.
    pub all: bool,
    /// Share of the conformance run, if one is requested.
    pub conformance: Option<f64>,
    /// Part of the adapter's name.
    pub adapter: Option<String>,
    /// The state from which the driver starts each pass.
    pub mode: Modes,
    /// Most memory that a comparison may take, bytes.
    pub memory_limit_bytes: u64,
    /// Overrides the scenes' image size.
    pub size: Option<ImageSize>,
    /// Further overrides.
    pub settings: Vec<SettingArgument>,
    /// Folder for pictures.
    pub output: Option<PathBuf>,
    /// Whether to print JSON instead of a table.
    pub json: bool,
}

impl HiArgs {
    /// Resolves the arguments. Reads nothing.
    ///
    /// # Errors
    /// If flags contradict each other.
    pub fn resolve(low: LowArgs, techniques: Techniques) -> anyhow::Result<Self> {
        ensure!(
            !low.scenes.is_empty() || low.all || low.conformance,
            "nothing to compare: name scene files, or give --all or --conformance"
        );
        ensure!(low.scenes.is_empty() || !low.all, "--all takes every scene there is; leave out the names");
        if let Some(name) = &low.technique {
            techniques.find(name)?;
        }
        Ok(Self {
            techniques,
            technique: low.technique,
            scenes: low.scenes,
            all: low.all,
            conformance: low.conformance.then(|| low.share.unwrap_or(1.0)),
            adapter: low.adapter,
            mode: low.mode,
            memory_limit_bytes: u64::from(low.memory_limit) << 20,
            size: low.size,
            settings: low.settings,
            output: low.output,
            json: low.json,
        })
    }
}

/// Returns an error, because this build has no drivers.
///
/// # Errors
/// Always.
#[cfg(not(feature = "wgpu"))]
pub fn run(_args: &HiArgs) -> anyhow::Result<crate::cli::Outcome> {
    anyhow::bail!("not run: {}", crate::cli::drivers::WITHOUT)
}

#[cfg(feature = "wgpu")]
pub use run::run;

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
        HiArgs::resolve(Line::try_parse_from(["crosscheck"].iter().chain(words))?.low, TECHNIQUES)
    }

    #[test]
    fn something_must_be_compared() {
        assert!(resolve(&[]).unwrap_err().to_string().starts_with("nothing to compare"));
        assert!(resolve(&["a.ron", "--all"]).is_err());
        assert!(resolve(&["a.ron"]).is_ok());
        assert!(resolve(&["--all", "--mode", "free"]).is_ok());
    }

    #[test]
    fn a_share_is_of_the_conformance_run() {
        assert_eq!(resolve(&["--conformance"]).unwrap().conformance, Some(1.0));
        assert_eq!(resolve(&["--conformance", "--share", "0.25"]).unwrap().conformance, Some(0.25));
        for share in ["0", "-1", "1.5", "nan", "x"] {
            assert!(resolve(&["--conformance", "--share", share]).is_err(), "{share} was accepted");
        }
        assert!(resolve(&["--all", "--share", "0.5"]).is_err());
    }
}
