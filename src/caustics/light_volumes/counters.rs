//! Counters and times of a frame, over all lights.

use std::sync::Arc;

use crate::Receivers;
use crate::beams::LightBeams;

use super::cull::{ClampedBeam, CullStatistics};
use super::shadow::Shadowed;
use super::slices;

/// Counters of a frame.
#[derive(Default)]
pub struct Counters {
    /// Counters of culling and clamping.
    pub culling: CullStatistics,
    /// Number of draws of beams.
    pub draws: u64,
    /// Number of shadow queries.
    pub queries: u64,
    /// Leaves of the hierarchy culled because they are in shadow.
    pub leaves_culled: u64,
    /// Beams in these leaves.
    pub beams_shadowed: u64,
    /// Boxes of receivers that are hidden from the eye.
    pub boxes_hidden: u64,
}

impl Counters {
    /// Adds the counters of one light.
    pub fn add(&mut self, beams: &LightBeams, shadowed: &Shadowed, culling: &CullStatistics, accepted: &[ClampedBeam]) {
        self.culling.add(culling);
        self.draws += accepted.iter().map(|beam| 2 * slices::runs(beam.slabs).count() as u64).sum::<u64>();
        self.queries += shadowed.queries();
        self.leaves_culled += shadowed.leaves;
        self.beams_shadowed += shadowed.beams(beams).iter().filter(|culled| **culled).count() as u64;
    }

    /// Name and value of every counter.
    #[must_use]
    pub fn named(&self, receivers: &Receivers, beams: &[Arc<LightBeams>]) -> Vec<(String, u64)> {
        let CullStatistics { out_of_view, missed, clamped, drawn, beam_tests, node_tests } = self.culling;
        let own = [
            ("beams", beams.iter().map(|l| l.beams.len() as u64).sum()),
            ("beams_dark", beams.iter().map(|l| l.dark).sum()),
            ("beams_in_shadow", self.beams_shadowed),
            ("beams_out_of_view", out_of_view),
            ("beams_that_miss", missed),
            ("beams_clamped", clamped),
            ("beams_drawn", drawn),
            ("beam_draws", self.draws),
            ("beam_tests", beam_tests),
            ("node_tests", node_tests),
            ("shadow_queries", self.queries),
            ("leaves_culled", self.leaves_culled),
            ("boxes_hidden", self.boxes_hidden),
        ];
        [receivers.counters(), own.map(|(name, count)| (name.to_owned(), count)).into()].concat()
    }
}

/// Seconds spent in the parts of frame building.
#[derive(Default)]
pub struct Seconds {
    /// Making beams.
    pub beams: f64,
    /// Occlusion queries.
    pub queries: f64,
    /// Culling, and fitting the hierarchy to the beams.
    pub culling: f64,
    /// Making draws.
    pub draws: f64,
}

impl Seconds {
    /// Name and value of every time, in seconds.
    #[must_use]
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        vec![("beams", self.beams), ("queries", self.queries), ("culling", self.culling), ("draws", self.draws)]
    }
}

/// Runs `work` and adds the seconds it takes to `sum`.
pub fn timed<R>(clock: fn() -> f64, sum: &mut f64, work: impl FnOnce() -> R) -> R {
    let start = clock();
    let result = work();
    *sum += clock() - start;
    result
}
