//! Table 1 of Wyman & Dachsbacher: five scenes, two numbers of photons, three methods; and a fourth method, which the paper does not have.
//!
//! Nothing moves, but all that depends on the light is drawn again for each frame, as if it moved. The eye sees the receivers through the glass, as in the
//! paper.

use std::path::Path;

use serde::Serialize;

use crate::caustics::Techniques;
use crate::caustics::splatting::{Splats, Splatting};
use crate::cli::progress::Progress;
use crate::cli::{output, renderer};
use crate::scene::{Group, Scene};

use super::report;
use super::scenes::{self, Made, SCENES};
use crate::cli::tables::LowArgs;
use crate::cli::tables::measure::{Cell, measure};

/// Photons along a side of the light's view.
pub const PHOTONS: [u32; 2] = [512, 1024];

/// A method, a column of the table.
pub struct Method {
    /// The paper's name of it.
    pub name: &'static str,
    splats: Splats,
}

/// The paper's methods in its order, and ours.
pub const METHODS: [Method; 4] = [
    Method { name: "previous work", splats: Splats::Fixed },
    Method { name: "multi res", splats: Splats::Sizes },
    Method { name: "thin lens", splats: Splats::Lens },
    Method { name: "differential", splats: Splats::Differential },
];

/// One measured cell.
#[derive(Serialize)]
pub struct Measured {
    /// The paper's name of the scene.
    pub scene: &'static str,
    /// What it is made of here.
    pub bodies: Vec<Made>,
    /// Along a side of the light's view.
    pub photons: u32,
    /// The paper's name of the method.
    pub method: &'static str,
    /// `None` for the method that the paper does not have.
    pub paper_fps: Option<f64>,
    /// What was measured.
    #[serde(flatten)]
    pub cell: Cell,
}

impl Measured {
    /// Frames per second.
    pub fn fps(&self) -> f64 {
        1.0 / self.cell.frame_s
    }
}

/// Measures all cells, then prints them.
///
/// # Errors
/// If a model cannot be read, a scene cannot be rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    // All models are read before anything is measured.
    let made: Vec<(Scene, Vec<Made>)> =
        SCENES.iter().map(|paper| scenes::make(paper, low.models.as_deref(), techniques)).collect::<Result<_, _>>()?;
    let progress = Progress::new((SCENES.len() * PHOTONS.len() * METHODS.len()) as u64);
    let mut all = Vec::new();
    for (paper, (scene, bodies)) in SCENES.iter().zip(&made) {
        for (p, photons) in PHOTONS.into_iter().enumerate() {
            for (m, method) in METHODS.iter().enumerate() {
                progress.step(format!("{}, {photons}x{photons}, {}", paper.name, method.name));
                let cell = measure(&prepared(scene, photons, method.splats), "splatting", low.frames)?;
                let paper_fps = paper.frames[p].get(m).copied();
                all.push(Measured { scene: paper.name, bodies: bodies.clone(), photons, method: method.name, paper_fps, cell });
                progress.done();
            }
        }
    }
    drop(progress);
    for paper in &SCENES {
        let cells = all.iter().filter(|measured: &&Measured| measured.scene == paper.name);
        let turned = cells.map(|measured| renderer::turned(&measured.cell.counters)).max();
        renderer::warn_of_turned(Path::new(paper.name), turned.unwrap_or(0));
    }
    if low.json {
        output::json(&all)?
    } else {
        output::text(&report::report(&all, low.frames))?
    }
    Ok(())
}

/// A scene with the settings of the paper's test. Our method has splats of its own size.
fn prepared(scene: &Scene, photons: u32, splats: Splats) -> Scene {
    let mut scene = scene.clone();
    let splat_size = if splats == Splats::Differential { Splatting::DEFAULTS } else { &Splatting::PAPER }.splat_size;
    *scene.techniques.edit::<Splatting>() = Splatting { photons, splats, splat_size, ..Splatting::PAPER };
    scene
}

#[cfg(test)]
mod tests {
    use crate::caustics::TECHNIQUES;
    use crate::caustics::splatting::{Search, Views};
    use crate::cli::tables::measure::PassCost;

    use super::*;

    #[test]
    fn the_paper_s_numbers_are_those_that_it_prints() {
        let paper = |scene: &str, p: usize| SCENES.iter().find(|known| known.name == scene).unwrap().frames[p];
        assert_eq!(paper("Ball & Dragon", 0), [25.1, 21.5, 19.5]);
        assert_eq!(paper("Beethoven", 0), [49.4, 27.7, 38.8]);
        assert_eq!(paper("Buddha", 1), [13.5, 8.6, 8.5]);
        assert_eq!(paper("Bunny", 0), [30.8, 26.4, 27.6]);
        assert_eq!(paper("Gargoyle", 1), [8.4, 6.4, 6.2]);
        assert_eq!(SCENES.map(|scene| scene.triangles), [256_000, 5_000, 50_000, 70_000, 205_000]);
        let sums = [0, 1].map(|p| SCENES.iter().map(|scene| scene.frames[p].iter().sum::<f64>()).sum::<f64>());
        assert!((sums[0] - 398.0).abs() < 1.0e-9 && (sums[1] - 145.6).abs() < 1.0e-9, "{sums:?}");
    }

    #[test]
    fn settings_are_the_paper_s() {
        let (scene, _) = scenes::make(&SCENES[1], None, TECHNIQUES).unwrap();
        let prepared = prepared(&scene, 1024, Splats::Fixed);
        let settings = prepared.techniques.get::<Splatting>();
        assert_eq!((settings.photons, settings.map_size, settings.splat_size), (1024, 512, 7.0));
        assert_eq!((settings.views, settings.search, settings.search_steps), (Views::Scene, Search::Wyman, 10));
        assert_eq!((prepared.image.width, prepared.image.height), (512, 512));
        prepared.validate().unwrap();
    }

    /// One small frame of each method draws its splats from a view that opens by 90 degrees.
    #[test]
    fn every_method_is_measured_pass_by_pass() {
        let (mut scene, _) = scenes::make(&SCENES[1], None, TECHNIQUES).unwrap();
        (scene.image.width, scene.image.height) = (32, 32);
        for method in &METHODS {
            let mut scene = prepared(&scene, 48, method.splats);
            let settings = scene.techniques.edit::<Splatting>();
            (settings.map_size, settings.shadow_map_size) = (64, 64);
            let cell = measure(&scene, "splatting", 1).unwrap();
            assert!(cell.frame_s > 0.0 && cell.fragments("splats") > 0, "{}", method.name);
            assert_eq!(cell.passes_s("resolve") > 0.0, method.splats == Splats::Sizes, "{}", method.name);
            assert_eq!((cell.counter("photon_rays"), cell.counter("lights_amid_the_scene")), (48 * 48, 0));
            let steps: f64 = report::steps(&cell).iter().map(|(_, seconds)| seconds).sum();
            assert!((steps - cell.frame_s).abs() < 1.0e-9, "{steps} {}", cell.frame_s);
        }
    }

    #[test]
    fn the_report_has_a_row_for_each_scene_and_number_of_photons() {
        let pass = |label: &str, seconds| PassCost { label: label.to_owned(), seconds, fragments: 7 };
        let cell = |frame_s| Cell {
            frame_s,
            moving_frame_s: None,
            building_s: Vec::new(),
            passes: vec![pass("photons 0", 0.01), pass("splats 0", 0.02)],
            counters: Vec::new(),
        };
        let mut all = Vec::new();
        for paper in &SCENES {
            for (p, photons) in PHOTONS.into_iter().enumerate() {
                for (m, method) in METHODS.iter().enumerate() {
                    let (bodies, paper_fps) = (vec![Made { mesh: "x.ply".to_owned(), triangles: 1234 }], paper.frames[p].get(m).copied());
                    // Twice the paper's rate, and four times the time of the last for ours.
                    let cell = cell(paper_fps.map_or(0.25, |fps| 0.5 / fps));
                    all.push(Measured { scene: paper.name, bodies, photons, method: method.name, paper_fps, cell });
                }
            }
        }
        let text = report::report(&all, 5);
        for paper in &SCENES {
            for photons in PHOTONS {
                // In the table of rates, in that of gains, and in each of the steps and of the fragments for every method.
                let rows = text.lines().filter(|line| line.starts_with(&format!("| {} | {photons}² |", paper.name))).count();
                assert_eq!(rows, 2 + METHODS.len(), "{text}");
            }
        }
        assert!(text.contains("| Beethoven | 512² | 49.4 | 98.8 | 2.00 | 27.7 | 55.4 | 2.00 | 38.8 | 77.6 | 2.00 | 4.0 |"), "{text}");
        assert!(text.contains("| Beethoven | 512² | 0.56 | 0.56 | 0.79 | 0.79 | 0.04 |"), "{text}");
        assert!(text.contains("| Gargoyle | 205000 | x.ply | 1234 |"), "{text}");
        let lines: serde_json::Value = serde_json::to_value(&all).unwrap();
        assert_eq!((lines.as_array().unwrap().len(), &lines[3]["paper_fps"]), (40, &serde_json::Value::Null));
        assert_eq!(lines[0]["passes"][1]["label"], "splats 0");
    }
}
