//! Driver conformance: random and adversarial primitives are drawn by a driver and by the software GPU under the driver's presumed rules, and
//! compared pixel by pixel.
//!
//! [`CASES`] is the table of cases; each makes [`Drawing`]s (in `drawings`) from the generators of [`primitives`]. [`run()`] draws them, reduces each
//! difference to a minimal drawing (`shrink`), and attributes every pixel in which the software GPU's own rules differ from the driver to a rule
//! ([`explain`]). [`probes()`] tests single rules of a driver. The result is a [`Report`].

mod cases;
pub mod drawing;
mod drawings;
pub mod explain;
pub mod image;
pub mod primitives;
mod probes;
pub mod program;
mod report;
mod run;
mod shrink;

pub use cases::{CASES, Case, Expectation, FEW, Kind, WELL_SHAPED};
pub use drawing::Drawing;
pub use probes::{Probe, probes};
pub use report::{CaseReport, Report, Verdict};
pub use run::{SEED, choose_rules, run, run_case};
pub use shrink::{Reproducer, shrink};
