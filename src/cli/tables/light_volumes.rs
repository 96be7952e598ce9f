//! Tables 1 and 2 of Barczak & Olano: four views, three meshes, four ways of drawing.
//!
//! Tables 1 and 2 are of still water: everything that depends on it is computed again for each frame, but it takes no step. A third table has whole frames of
//! an animation, with the water's step, its mesh and its upload.

use std::fmt::Write as _;

use serde::Serialize;

use crate::caustics::Techniques;
use crate::caustics::light_volumes::{BeamCulling, BeamShadows, Gather, LightVolumes};
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::scene::Scene;

use super::LowArgs;
use super::measure::{Cell, measure};

/// Vertices along a side of the water mesh.
const MESHES: [u32; 3] = [120, 160, 200];

/// Width and height of the pictures.
const SIZE: (u32, u32) = (1024, 768);

/// Prefix of the passes that draw beams.
const PASSES: &str = "light_volumes";

/// Frames per second, by mesh.
type Rates = [f64; 3];

/// A view of the paper, and the scene that corresponds to it.
struct PaperView {
    scene: &'static str,
    figure: &'static str,
    /// Share of the beams in view that the paper gives, %.
    in_view: u32,
    /// Table 1: frames per second of the reference and of the hierarchical culler.
    culling: [Rates; 2],
    /// Table 2: frames per second by [`Way`].
    frames: [Rates; 4],
}

const VIEWS: [PaperView; 4] = [
    PaperView {
        scene: "bath.ron",
        figure: "figure 1, left",
        in_view: 50,
        culling: [[17.6, 10.44, 6.87], [28.75, 18.74, 12.74]],
        frames: [[6.51, 4.57, 3.33], [6.85, 4.89, 3.58], [7.33, 5.40, 4.00], [5.58, 4.26, 3.27]],
    },
    PaperView {
        scene: "jetty.ron",
        figure: "figure 1, centre",
        in_view: 35,
        culling: [[23.00, 13.83, 9.10], [31.4, 20.73, 14.14]],
        frames: [[10.75, 7.15, 4.98], [11.98, 7.98, 5.17], [13.34, 9.32, 6.05], [11.48, 8.51, 5.81]],
    },
    PaperView {
        scene: "courtyard.ron",
        figure: "figure 1, right",
        in_view: 100,
        culling: [[13.05, 7.67, 5.01], [27.70, 18.01, 12.19]],
        frames: [[5.51, 3.31, 2.19], [5.86, 3.50, 2.25], [6.55, 4.07, 2.59], [6.34, 4.00, 2.54]],
    },
    PaperView {
        scene: "lido.ron",
        figure: "figure 3",
        in_view: 25,
        culling: [[27.7, 16.97, 11.15], [33.6, 22.47, 15.30]],
        frames: [[11.51, 8.37, 6.20], [12.55, 9.39, 6.46], [14.98, 11.50, 7.90], [11.64, 9.44, 7.24]],
    },
];

/// A row of table 2: a way of drawing.
struct Way {
    name: &'static str,
    culling: BeamCulling,
    shadows: BeamShadows,
    gather: Gather,
}

const WAYS: [Way; 4] = [
    Way { name: "reference", culling: BeamCulling::PerBeam, shadows: BeamShadows::Vertices, gather: Gather::FlatWater },
    Way { name: "hierarchical", culling: BeamCulling::Hierarchical, shadows: BeamShadows::Vertices, gather: Gather::FlatWater },
    Way { name: "and shadow culling", culling: BeamCulling::Hierarchical, shadows: BeamShadows::Both, gather: Gather::FlatWater },
    Way { name: "and vectors", culling: BeamCulling::Hierarchical, shadows: BeamShadows::Both, gather: Gather::Vector },
];

/// One measured cell of table 2.
#[derive(Serialize)]
struct Measured {
    scene: &'static str,
    mesh: u32,
    way: &'static str,
    paper_fps: f64,
    #[serde(flatten)]
    cell: Cell,
}

/// Measures all cells, then prints them.
///
/// # Errors
/// If a scene cannot be loaded or rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    let scenes: Vec<Scene> = VIEWS.iter().map(|view| techniques.load(&low.scenes.join(view.scene))).collect::<Result<_, _>>()?;
    let progress = Progress::new((VIEWS.len() * MESHES.len() * WAYS.len()) as u64);
    let mut all = Vec::new();
    for (view, scene) in VIEWS.iter().zip(&scenes) {
        for (m, mesh) in MESHES.into_iter().enumerate() {
            for (w, way) in WAYS.iter().enumerate() {
                progress.step(format!("{}, {mesh}x{mesh}, {}", view.scene, way.name));
                let cell = measure(&prepared(scene, mesh, way), "light-volumes", low.frames)?;
                all.push(Measured { scene: view.scene, mesh, way: way.name, paper_fps: view.frames[w][m], cell });
                progress.done();
            }
        }
    }
    drop(progress);
    if low.json {
        output::json(&all)?
    } else {
        output::text(&report(&all, low.frames))?
    }
    Ok(())
}

/// A scene with the settings of the paper's test.
fn prepared(scene: &Scene, mesh: u32, way: &Way) -> Scene {
    let mut scene = scene.clone();
    (scene.image.width, scene.image.height) = SIZE;
    let (culling, shadows, gather) = (way.culling, way.shadows, way.gather);
    let settings = scene.techniques.edit::<LightVolumes>();
    let shadow_map_size = settings.shadow_map_size;
    *settings = LightVolumes { grid: Some((mesh, mesh)), culling, shadows, gather, shadow_map_size, ..LightVolumes::PAPER };
    scene
}

/// The cells of one view and mesh, by way.
fn ways(all: &[Measured], view: usize, mesh: usize) -> &[Measured] {
    let first = (view * MESHES.len() + mesh) * WAYS.len();
    &all[first..first + WAYS.len()]
}

/// All tables as Markdown.
fn report(all: &[Measured], frames: u32) -> String {
    let mut text = format!(
        "{}x{}, S_min 65 %, {} threads, median of {frames} frames. The paper: Pentium 4 with 3.2 GHz, GeForce 6800.\n",
        SIZE.0,
        SIZE.1,
        rayon::current_num_threads()
    );
    let tables = [culling_table(all), frame_table(all), moving_table(all), gain_table(all), work_table(all)];
    text.push_str(&tables.concat());
    text
}

fn percent(faster: f64) -> String {
    format!("{:+.0} %", (faster - 1.0) * 100.0)
}

/// Table 1: speed-up of culling and clamping by the hierarchy.
fn culling_table(all: &[Measured]) -> String {
    let mut text = String::from(
        "\nTable 1: culling and clamping, hierarchical against beam by beam. `culling` is that alone, with what it takes to keep the hierarchy; \
         `frame` is a frame whose beams are not drawn.\n\n\
         | view | mesh | paper | culling | | frame | |\n|---|---|---|---|---|---|---|\n",
    );
    for (v, view) in VIEWS.iter().enumerate() {
        for (m, mesh) in MESHES.iter().enumerate() {
            let [reference, hierarchical, ..] = ways(all, v, m) else { continue };
            let culled = [reference, hierarchical].map(|measured| measured.cell.building("culling"));
            let without =
                [reference, hierarchical].map(|Measured { cell, .. }| cell.frame_s - cell.passes_s(PASSES) - cell.building("draws"));
            let _ = writeln!(
                text,
                "| {} | {mesh}² | {} | {} | {:.2} → {:.2} ms | {} | {:.0} → {:.0} fps |",
                view.scene,
                percent(view.culling[1][m] / view.culling[0][m]),
                percent(culled[0] / culled[1]),
                culled[0] * 1.0e3,
                culled[1] * 1.0e3,
                percent(without[0] / without[1]),
                1.0 / without[0],
                1.0 / without[1],
            );
        }
    }
    text
}

/// Table 2: frames per second.
fn frame_table(all: &[Measured]) -> String {
    let mut text = String::from("\nTable 2: frames per second, the paper's and ours, and ours over the paper's.\n\n| view | |");
    MESHES.iter().for_each(|mesh| text.push_str(&format!(" {mesh}², paper | ours | |")));
    text.push_str(&format!("\n|---|---|{}\n", "---|".repeat(3 * MESHES.len())));
    for (v, view) in VIEWS.iter().enumerate() {
        for (w, way) in WAYS.iter().enumerate() {
            let _ = write!(text, "| {} ({}) | {} |", view.scene, view.figure, way.name);
            for m in 0..MESHES.len() {
                let Measured { paper_fps, cell, .. } = &ways(all, v, m)[w];
                let fps = 1.0 / cell.frame_s;
                let _ = write!(text, " {paper_fps:.2} | {fps:.2} | {:.2} |", fps / paper_fps);
            }
            text.push('\n');
        }
    }
    text
}

/// Whole frames of moving water, beside frames that only draw.
fn moving_table(all: &[Measured]) -> String {
    let mut text = String::from(
        "\nWhole frames of an animation, 24 in a second of the scene: the water's step, its mesh, its upload, and drawing; beside drawing alone, as in table \
         2. Milliseconds.\n\n| view | |",
    );
    MESHES.iter().for_each(|mesh| text.push_str(&format!(" {mesh}², moving | drawing alone | moving, fps |")));
    text.push_str(&format!("\n|---|---|{}\n", "---:|".repeat(3 * MESHES.len())));
    for (v, view) in VIEWS.iter().enumerate() {
        for (w, way) in WAYS.iter().enumerate() {
            let _ = write!(text, "| {} | {} |", view.scene, way.name);
            for m in 0..MESHES.len() {
                let cell = &ways(all, v, m)[w].cell;
                let moving = cell.moving_frame_s.unwrap_or(cell.frame_s);
                let _ = write!(text, " {:.1} | {:.1} | {:.2} |", moving * 1.0e3, cell.frame_s * 1.0e3, 1.0 / moving);
            }
            text.push('\n');
        }
    }
    text
}

/// Speed-up of whole frames over the reference, for each step.
fn gain_table(all: &[Measured]) -> String {
    let mut text = String::from("\nWhole frames over the reference, the paper's and ours.\n\n| view | |");
    MESHES.iter().for_each(|mesh| text.push_str(&format!(" {mesh}², paper | ours |")));
    text.push_str(&format!("\n|---|---|{}\n", "---|".repeat(2 * MESHES.len())));
    for (v, view) in VIEWS.iter().enumerate() {
        for (w, way) in WAYS.iter().enumerate().skip(1) {
            let _ = write!(text, "| {} | {} |", view.scene, way.name);
            for m in 0..MESHES.len() {
                let cells = ways(all, v, m);
                let _ = write!(
                    text,
                    " {} | {} |",
                    percent(view.frames[w][m] / view.frames[0][m]),
                    percent(cells[0].cell.frame_s / cells[w].cell.frame_s)
                );
            }
            text.push('\n');
        }
    }
    text
}

/// Numbers of draws, queries and fragments.
fn work_table(all: &[Measured]) -> String {
    let mut text = String::from(
        "\nWork. `in view` is the share of beams that are not out of view, the paper's in brackets; `shadow` are beams culled in shadow.\n\n\
         | view | mesh | | beams | in view | shadow | miss | clamped | drawn | draws | tests | queries | fragments |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (v, view) in VIEWS.iter().enumerate() {
        for m in 0..MESHES.len() {
            let cells = ways(all, v, m);
            let in_view = 1.0 - cells[0].cell.counter("beams_out_of_view") as f64 / cells[0].cell.counter("beams").max(1) as f64;
            for Measured { mesh, way, cell, .. } in cells {
                let count = |name: &str| cell.counter(name);
                let _ = writeln!(
                    text,
                    "| {} | {mesh}² | {way} | {} | {:.0} % ({} %) | {} | {} | {} | {} | {} | {} | {} | {} |",
                    view.scene,
                    count("beams"),
                    in_view * 100.0,
                    view.in_view,
                    count("beams_in_shadow"),
                    count("beams_that_miss"),
                    count("beams_clamped"),
                    count("beams_drawn"),
                    count("beam_draws"),
                    count("beam_tests") + count("node_tests"),
                    count("shadow_queries"),
                    cell.fragments(PASSES),
                );
            }
        }
    }
    text
}
