//! `nephroid tables`: repeats the measurements of a paper's tables and prints them beside the paper's numbers.

mod light_volumes;
mod measure;
mod splatting;

use std::path::PathBuf;

use anyhow::ensure;
use clap::{ValueEnum, ValueHint};

use crate::caustics::Techniques;
use crate::cli::interrupt;

/// The arguments as typed.
#[derive(Debug, clap::Args)]
pub struct LowArgs {
    /// Whose tables
    #[arg(long, value_name = "TECHNIQUE")]
    paper: Paper,

    /// Which of `splatting`'s tables
    #[arg(long, value_name = "NAME", default_value = "rates")]
    table: Table,

    /// The folder with the scenes of this repository
    #[arg(long, value_name = "FOLDER", default_value = "scenes", value_hint = ValueHint::DirPath)]
    scenes: PathBuf,

    /// The folder with the meshes of `splatting`'s paper; without it, procedural ones of about as many triangles
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    models: Option<PathBuf>,

    /// Frames of which the median is taken, in tables with times
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    frames: u32,

    /// Print every number as JSON
    #[arg(long)]
    json: bool,
}

/// Papers with tables that can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Paper {
    /// Barczak & Olano: table 1, culling and clamping, and table 2, whole frames
    LightVolumes,
    /// Wyman & Dachsbacher: table 1, whole frames
    Splatting,
}

/// Tables that can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Table {
    /// Frames per second, as in the paper
    Rates,
    /// Errors of its methods against the ground truth, at equal photons and at equal time
    Errors,
    /// Where photons land in pictures and in triangles
    Hits,
    /// What each decision that the paper leaves open changes
    Decisions,
}

/// Measures and prints the tables.
///
/// # Errors
/// If a scene or a model cannot be loaded or rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    ensure!(low.models.is_none() || low.paper == Paper::Splatting, "--models names the meshes of another paper; use --paper splatting");
    ensure!(low.table == Table::Rates || low.paper == Paper::Splatting, "--table names a table of another paper; use --paper splatting");
    ensure!(
        low.table == Table::Rates || low.models.is_none(),
        "--models is for --table rates; the others measure the scenes of this repository"
    );
    interrupt::install()?;
    match low.paper {
        Paper::LightVolumes => light_volumes::run(low, techniques),
        Paper::Splatting => splatting::run(low, techniques),
    }
}
