//! Driver conformance: random and adversarial primitives, drawn by a driver and by the software GPU under the rules that the driver is said to
//! follow, and compared pixel by pixel.
//!
//! [`CASES`] is the table of what is drawn ([`Drawing`]s, made by `drawings` from the generators of [`primitives`]). [`run()`] draws them, finds the
//! least drawing that shows each difference (`shrink`), and puts every pixel in which the software GPU's own rules differ from the driver
//! down to the rule that makes the difference ([`explain`]). [`probes()`] asks a driver directly about single rules. The result is a [`Report`].

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
