//! Counters and audit of a frame.

use super::photons::Fate;
use crate::audit::{Audit, Entry};
use crate::receivers::Receivers;
use crate::tally::Named;

/// What is counted while the frame is built.
#[derive(Default)]
pub(super) struct Totals {
    /// Rays of light: texels of the photons' views.
    pub rays: u64,
    /// Lights that reach no receiver by way of mirrors, glass or water.
    pub dark: u64,
    /// Lamps that do not see the whole scene from one side, although their views should hold it.
    pub fitted: u64,
    /// Lamps whose map has parallel rays.
    pub parallel: u64,
    pub exact: Option<ExactTotals>,
}

/// Sums over exact photons.
#[derive(Default)]
pub(super) struct ExactTotals {
    /// Rays that meet a mirror, glass or water.
    pub rays: u64,
    /// Photons in the map.
    pub photons: u64,
    /// Photons on receivers outside of the map.
    pub beyond: u64,
    /// Where the light of the rays has gone.
    pub audit: Audit,
}

impl Totals {
    pub fn counters(&self, receivers: &Receivers) -> Named<u64> {
        let mut counters = receivers.counters();
        let mut add = |name: &str, count| counters.push((name.to_owned(), count));
        add("photon_rays", self.rays);
        add("lights_without_caustics", self.dark);
        add("lights_amid_the_scene", self.fitted);
        add("maps_of_parallel_rays", self.parallel);
        if let Some(exact) = &self.exact {
            add("photon_rays_arrived", exact.rays);
            add(LANDED, exact.photons);
            add("photons_beyond_the_map", exact.beyond);
        }
        counters
    }
}

const LANDED: &str = "photons_landed";

/// Fates of photons with their counters and the entries for their light.
pub(super) const ENDS: &[(u32, &str, Entry)] = &[
    (Fate::Landed as u32, LANDED, Entry::Landed),
    (Fate::TotallyReflected as u32, "photons_totally_reflected", Entry::TotallyReflected),
    (Fate::NoExit as u32, "photons_in_open_glass", Entry::StaysInGlass),
    (Fate::Missed as u32, "photons_missed", Entry::Missed),
    (Fate::NotFound as u32, "photons_not_found", Entry::NotFound),
];

/// Where light is lost on its way through the surface of water, in the channels of `photon_losses`.
pub(super) const LOST_IN_WATER: [Option<Entry>; 4] =
    [Some(Entry::Reflected), Some(Entry::AbsorbedBefore), Some(Entry::AbsorbedBehind), None];

/// The same for mirrors and glass.
pub(super) const LOST_AT_OBJECTS: [Option<Entry>; 4] = [Some(Entry::Reflected), Some(Entry::ByMirrors), Some(Entry::InGlass), None];
