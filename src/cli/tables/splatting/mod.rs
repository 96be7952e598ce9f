//! Tables of Wyman & Dachsbacher, and of what their methods come to on the scenes of this repository.

mod decisions;
mod errors;
mod hits;
mod rates;
mod report;
mod scenes;
mod shipped;

use crate::caustics::Techniques;

use super::{LowArgs, Table};

/// Measures and prints a table.
///
/// # Errors
/// If a scene or a model cannot be read, traced or rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    match low.table {
        Table::Rates => rates::run(low, techniques),
        Table::Errors => errors::run(low, techniques),
        Table::Hits => hits::run(low, techniques),
        Table::Decisions => decisions::run(low, techniques),
    }
}
