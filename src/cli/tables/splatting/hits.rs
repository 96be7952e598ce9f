//! Where photons land that are followed in the pictures of the light, and where the same paths end in the triangles of the scene.

use std::fmt::Write as _;

use anyhow::Context as _;
use glam::Vec3;
use serde::Serialize;

use crate::caustics::Techniques;
use crate::caustics::splatting::hits::{Hit, exact_hits};
use crate::caustics::splatting::{Search, Splatting, Views};
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::tables::LowArgs;
use crate::scene::Scene;

use super::shipped::{self, Change};

/// Code of photons that have landed, in the fourth channel of their positions.
const LANDED: f32 = 1.0;

/// Ends of the histogram's bins, in widths of a photon's texel.
const BINS: [f64; 5] = [0.01, 0.1, 1.0, 10.0, f64::INFINITY];

/// Ways to find where photons land, and what they change in the settings.
const WAYS: [(&str, Change); 6] = [
    ("default", |_| ()),
    ("search: wyman, 10 steps", |s| (s.search, s.search_steps) = (Search::Wyman, 10)),
    ("search: shah, 10 steps", |s| (s.search, s.search_steps) = (Search::Shah, 10)),
    ("smooth_exits: false", |s| s.smooth_exits = false),
    ("exit_steps: 0, smooth_exits: false", |s| (s.exit_steps, s.smooth_exits) = (0, false)),
    ("views: scene", |s| s.views = Views::Scene),
];

/// Shares of all photons of a scene.
#[derive(Clone, Default, Serialize)]
struct Shares {
    scene: &'static str,
    way: &'static str,
    /// Photons that land in pictures or in triangles.
    photons: u64,
    /// By bin of distance, of those that land in both.
    bins: [f64; BINS.len()],
    /// Shares that land in triangles alone, and in pictures alone.
    lost: f64,
    made: f64,
}

/// Measures and prints the histograms.
///
/// # Errors
/// If a scene cannot be loaded or rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    let scenes = shipped::load_all(techniques, &low.scenes)?;
    let progress = Progress::new((scenes.len() * WAYS.len()) as u64);
    let mut all = Vec::new();
    for &(name, ref scene) in &scenes {
        for (way, change) in WAYS {
            progress.step(format!("{name}, {way}"));
            let mut settings = *scene.techniques.get::<Splatting>();
            change(&mut settings);
            all.push(Shares { scene: name, way, ..shares(&shipped::with(scene, settings))? });
            progress.done();
        }
    }
    drop(progress);
    if low.json {
        output::json(&all)?
    } else {
        output::text(&report(&all))?
    }
    Ok(())
}

/// The photons of all lights.
fn shares(scene: &Scene) -> anyhow::Result<Shares> {
    let exact = exact_hits(scene)?;
    let names: Vec<String> = (0..exact.len()).filter(|&k| exact[k].is_some()).map(|k| format!("photons {k}/photon_position {k}")).collect();
    let rendered = shipped::render(scene, &names.iter().map(String::as_str).collect::<Vec<_>>())?;
    let mut counts = Shares::default();
    for (hits, name) in exact.iter().flatten().zip(&names) {
        let seen = rendered.layers.get(&name.replace(' ', "_")).context("the frame has no photons")?;
        let fates = seen.planes()[3].pixels();
        let positions = seen.rgb();
        for ((hit, position), fate) in hits.texels.iter().zip(positions).zip(fates) {
            count(&mut counts, hit.as_ref(), (*fate == LANDED).then(|| Vec3::from_array(position)));
        }
    }
    let photons = counts.photons.max(1) as f64;
    counts.bins.iter_mut().chain([&mut counts.lost, &mut counts.made]).for_each(|share| *share /= photons);
    Ok(counts)
}

/// Adds a photon to the counts.
fn count(counts: &mut Shares, exact: Option<&Hit>, seen: Option<Vec3>) {
    match (exact, seen) {
        (Some(hit), Some(position)) => {
            let widths = f64::from(hit.position.distance(position) / hit.width_m);
            let bin = BINS.iter().position(|end| widths < *end).unwrap_or(BINS.len() - 1);
            counts.bins[bin] += 1.0;
        }
        (Some(_), None) => counts.lost += 1.0,
        (None, Some(_)) => counts.made += 1.0,
        (None, None) => return,
    }
    counts.photons += 1;
}

fn report(all: &[Shares]) -> String {
    let mut text = String::from(
        "512² photons. Distance between where a photon lands by the pictures of the light and where the same path ends in the triangles of the scene, in \
         widths of the photon's texel at the first surface; shares of the photons that land either way, %.\n\n\
         | scene | how | photons | to 0.01 | 0.01 to 0.1 | 0.1 to 1 | 1 to 10 | more | in triangles alone | in pictures alone |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for shares in all {
        // Writing to a string cannot fail.
        let _ = write!(text, "| {} | {} | {} |", shares.scene, shares.way, shares.photons);
        for share in shares.bins.iter().chain([&shares.lost, &shares.made]) {
            let _ = write!(text, " {:.2} |", share * 100.0);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_are_counted_by_their_distance() {
        let hit = Hit { position: Vec3::X, flux: Vec3::ONE, width_m: 0.1 };
        let mut counts = Shares::default();
        for off in [0.0005, 0.005, 0.05, 0.5, 50.0] {
            count(&mut counts, Some(&hit), Some(Vec3::new(1.0, off, 0.0)));
        }
        count(&mut counts, Some(&hit), None);
        count(&mut counts, None, Some(Vec3::X));
        count(&mut counts, None, None);
        assert_eq!((counts.photons, counts.bins, counts.lost, counts.made), (7, [1.0; 5], 1.0, 1.0));
        assert!(report(&[Shares { scene: "ball", way: "default", ..counts }]).contains("| ball | default | 7 | 100.00 |"));
    }
}
