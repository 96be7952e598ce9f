//! Counters and audit of a frame.

use super::exact::LightSums;
use super::photons::Fate;
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
    pub light: LightSums,
    /// Whether losses are not counted, so that it is not known what has missed all receivers.
    pub lossless: bool,
}

impl Totals {
    pub fn named(&self, receivers: &Receivers) -> (Named<u64>, Named<f64>) {
        let mut counters = receivers.counters();
        counters.extend([
            ("photon_rays".to_owned(), self.rays),
            ("lights_without_caustics".to_owned(), self.dark),
            ("lights_amid_the_scene".to_owned(), self.fitted),
            ("maps_of_parallel_rays".to_owned(), self.parallel),
        ]);
        let mut audit = Vec::new();
        if let Some(exact) = &self.exact {
            let count = |name: &str, count| (name.to_owned(), count);
            counters.extend([count("photon_rays_arrived", exact.rays), count(LANDED, exact.photons), count(BEYOND, exact.beyond)]);
            let light = &exact.light;
            let mut ends = vec![(ARRIVED, light.arrived_w), (LANDED, light.landed_w), (BEYOND, light.beyond_w)];
            if !exact.lossless {
                ends.extend([(MISSED, light.missed_w), (DROPPED, light.dropped_w)]);
            }
            audit.extend(ends.into_iter().map(|(name, watts)| (name.to_owned(), watts)));
        }
        (counters, audit)
    }
}

/// Entry for all light that arrives at mirrors, glass or water.
pub(super) const ARRIVED: &str = "photons_arrived";

/// Entry for light that lands on receivers.
const LANDED: &str = "photons_landed";

/// Entry for light on receivers that the map does not hold.
const BEYOND: &str = "photons_beyond_the_map";

/// Entry for light that leaves the scene.
const MISSED: &str = "photons_missed";

/// Entry for light that is not followed to its end.
const DROPPED: &str = "photons_dropped";

/// Names of fates in counters and audit.
pub(super) const FATES: &[(u32, &str)] = &[
    (Fate::Landed as u32, LANDED),
    (Fate::TotallyReflected as u32, "photons_totally_reflected"),
    (Fate::NoExit as u32, "photons_in_open_glass"),
    (Fate::Missed as u32, MISSED),
    (Fate::NotFound as u32, "photons_not_found"),
];
