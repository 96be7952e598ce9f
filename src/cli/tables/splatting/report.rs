//! The table and what it rests on, as Markdown.

use std::fmt::Write as _;

use super::rates::{METHODS, Measured, PHOTONS};
use super::scenes::SCENES;
use crate::cli::tables::measure::Cell;

/// Parts of a frame: their names, and prefixes of the labels of their passes. What is left is the picture.
const STEPS: [(&str, &str); 7] = [
    ("receivers", "light_buffer receivers"),
    ("front", "light_buffer front"),
    ("back", "light_buffer back"),
    ("photons", "photons"),
    ("splats", "splats"),
    ("resolve", "resolve"),
    ("gather", "gather"),
];

/// All tables.
pub fn report(all: &[Measured], frames: u32) -> String {
    let mut text = format!(
        "512x512, map of 512² texels, {} threads, median of {frames} frames. The paper: Pentium 4 with 3.0 GHz, GeForce 7800 GTX.\n",
        rayon::current_num_threads()
    );
    // Writing to a string cannot fail.
    let _ = write!(text, "{}{}{}{}", scene_table(all), frame_table(all), gain_table(all), step_table(all));
    text
}

/// Cells of each scene and number of photons, by method.
fn rows(all: &[Measured]) -> impl Iterator<Item = &[Measured]> {
    all.chunks(METHODS.len())
}

/// What the scenes are made of.
fn scene_table(all: &[Measured]) -> String {
    let mut text = String::from("\nScenes.\n\n| scene | triangles, paper | bodies | triangles |\n|---|---|---|---|\n");
    for (paper, measured) in SCENES.iter().zip(all.chunks(METHODS.len() * PHOTONS.len())) {
        let bodies = measured.first().map_or(&[][..], |first| &first.bodies);
        let list = |of: &dyn Fn(usize) -> String| (0..bodies.len()).map(of).collect::<Vec<_>>().join(" + ");
        let (names, counts) = (list(&|k| bodies[k].mesh.clone()), list(&|k| bodies[k].triangles.to_string()));
        let _ = writeln!(text, "| {} | {} | {names} | {counts} |", paper.name, paper.triangles);
    }
    text
}

/// Table 1: frames per second.
fn frame_table(all: &[Measured]) -> String {
    let mut text = String::from("\nTable 1: frames per second, the paper's and ours, and ours over the paper's.\n\n| scene | photons |");
    METHODS[..3].iter().for_each(|method| text.push_str(&format!(" {}, paper | ours | |", method.name)));
    text.push_str(&format!(" {}, ours |\n|---|---|{}\n", METHODS[3].name, "---|".repeat(10)));
    for row in rows(all) {
        let _ = write!(text, "| {} | {}² |", row[0].scene, row[0].photons);
        for measured in row {
            let fps = measured.fps();
            let _ = match measured.paper_fps {
                Some(paper) => write!(text, " {paper:.1} | {fps:.1} | {:.2} |", fps / paper),
                None => write!(text, " {fps:.1} |"),
            };
        }
        text.push('\n');
    }
    text
}

/// Rates over that of splats of one size.
fn gain_table(all: &[Measured]) -> String {
    let mut text = String::from("\nFrames per second over those of the previous work, the paper's and ours.\n\n| scene | photons |");
    METHODS[1..3].iter().for_each(|method| text.push_str(&format!(" {}, paper | ours |", method.name)));
    text.push_str(&format!(" {}, ours |\n|---|---|{}\n", METHODS[3].name, "---|".repeat(5)));
    for row in rows(all) {
        let _ = write!(text, "| {} | {}² |", row[0].scene, row[0].photons);
        for measured in &row[1..] {
            if let Some((paper, base)) = measured.paper_fps.zip(row[0].paper_fps) {
                let _ = write!(text, " {:.2} |", paper / base);
            }
            let _ = write!(text, " {:.2} |", measured.fps() / row[0].fps());
        }
        text.push('\n');
    }
    text
}

/// Time by part of a frame, s. The parts sum up to the frame.
pub fn steps(cell: &Cell) -> Vec<(&'static str, f64)> {
    let mut steps: Vec<_> = STEPS.iter().map(|(name, prefix)| (*name, cell.passes_s(prefix))).collect();
    let technique: f64 = steps.iter().map(|(_, seconds)| seconds).sum();
    let picture = cell.passes_s("") - technique;
    steps.extend([("picture", picture), ("between", cell.frame_s - technique - picture)]);
    steps
}

/// Where the time goes.
fn step_table(all: &[Measured]) -> String {
    let mut text = String::from(
        "\nTime by part of a frame, ms: the light's views of receivers, front and back faces; the photons; their splats; the choice among sizes; the \
         map's light on pixels; the rest of the picture with its shadow map; and what is between passes. `fragments` are those of splats.\n\n\
         | scene | photons | method |",
    );
    STEPS.iter().for_each(|(name, _)| text.push_str(&format!(" {name} |")));
    text.push_str(&format!(" picture | between | frame | fragments |\n|{}\n", "---|".repeat(STEPS.len() + 7)));
    for Measured { scene, photons, method, cell, .. } in all {
        let _ = write!(text, "| {scene} | {photons}² | {method} |");
        steps(cell).iter().for_each(|(_, seconds)| text.push_str(&format!(" {:.2} |", seconds * 1.0e3)));
        let _ = writeln!(text, " {:.2} | {} |", cell.frame_s * 1.0e3, cell.fragments("splats"));
    }
    text
}
