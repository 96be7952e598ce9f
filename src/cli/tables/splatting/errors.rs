//! Errors of the methods against the ground truth, at equal photons and at equal time.

use std::fmt::Write as _;

use serde::Serialize;

use crate::caustics::Techniques;
use crate::caustics::splatting::{CurvatureFrom, Intersection, Splats, Splatting};
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::tables::LowArgs;
use crate::cli::truth::Truth;
use crate::scene::Scene;

use super::shipped::{self, Change};

/// Photons along a side of the light's view.
const PHOTONS: [u32; 2] = [512, 1024];

/// The methods, the baseline first, and what they change in the settings.
const METHODS: [(&str, Change); 6] = [
    ("fixed", |s| (s.splats, s.splat_size) = (Splats::Fixed, Splatting::PAPER.splat_size)),
    ("A", |s| s.splats = Splats::Sizes),
    ("B", |s| s.splats = Splats::Lens),
    ("B, both", |s| (s.splats, s.curvature) = (Splats::Lens, CurvatureFrom::Both)),
    ("B, normals", |s| (s.splats, s.curvature) = (Splats::Lens, CurvatureFrom::Normals)),
    ("C", |s| s.splats = Splats::Differential),
];

/// Methods of exact photons: B is a splat of the photon's differential there.
const EXACT_METHODS: [usize; 3] = [0, 1, METHODS.len() - 1];

/// A picture and what it costs.
#[derive(Serialize)]
struct Measured {
    scene: &'static str,
    photons_are: &'static str,
    /// Along a side.
    photons: u32,
    method: &'static str,
    frame_s: f64,
    energy_ratio: Option<f64>,
    rel_mse: Option<f64>,
    mae: Option<f64>,
    flip: Option<f64>,
}

/// A group of rows: what they have in common, and the cells of each row.
struct Group {
    title: &'static str,
    rows: Vec<Vec<Measured>>,
}

/// Measures all cells, then prints them.
///
/// # Errors
/// If a scene cannot be loaded, traced or rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    let scenes = shipped::load_all(techniques, &low.scenes)?;
    let progress = Progress::new((scenes.len() * (1 + 3 * METHODS.len() + EXACT_METHODS.len())) as u64);
    let mut groups = [
        Group { title: "Equal numbers of photons, in the pictures of the light", rows: Vec::new() },
        Group { title: "Equal time: as many photons as a frame has time for in which the baseline has 1024²", rows: Vec::new() },
        Group { title: "Equal numbers of photons, in the triangles of the scene", rows: Vec::new() },
    ];
    for &(name, ref scene) in &scenes {
        progress.step(format!("{name}, ground truth"));
        let truth = shipped::truth_of(scene)?;
        progress.done();
        let cell = |photons: u32, method: usize, intersection: Intersection| {
            progress.step(format!("{name}, {photons}x{photons}, {}", METHODS[method].0));
            let measured = measured(name, scene, &truth, (photons, method, intersection), low.frames);
            progress.done();
            measured
        };
        let image = |photons, method| cell(photons, method, Intersection::Image);
        let equal = PHOTONS.map(|photons| (0..METHODS.len()).map(|method| image(photons, method)).collect::<Result<Vec<_>, _>>());
        let [fewer, more] = equal;
        let (fewer, more) = (fewer?, more?);
        let timed = (0..METHODS.len()).map(|method| image(at_time(more[0].frame_s, &fewer[method], &more[method]), method));
        groups[1].rows.push(timed.collect::<Result<_, _>>()?);
        groups[0].rows.extend([fewer, more]);
        let exact = EXACT_METHODS.into_iter().map(|method| cell(PHOTONS[0], method, Intersection::Exact));
        groups[2].rows.push(exact.collect::<Result<_, _>>()?);
    }
    drop(progress);
    if low.json {
        let all: Vec<&Measured> = groups.iter().flat_map(|group| group.rows.iter().flatten()).collect();
        output::json(&all)?
    } else {
        output::text(&report(&groups, low.frames))?
    }
    Ok(())
}

fn measured(
    name: &'static str,
    scene: &Scene,
    truth: &Truth,
    (photons, method, intersection): (u32, usize, Intersection),
    frames: u32,
) -> anyhow::Result<Measured> {
    let (label, change) = METHODS[method];
    let mut settings = Splatting { photons, intersection, ..*scene.techniques.get::<Splatting>() };
    change(&mut settings);
    let scene = shipped::with(scene, settings);
    let (verdicts, once_s) = shipped::judged(&scene, truth)?;
    // Following photons through triangles takes seconds: one frame will do.
    let exact = intersection == Intersection::Exact;
    let frame_s = if exact { once_s } else { shipped::frame_s(&scene, frames)? };
    let value = |name| shipped::value(&verdicts, name);
    Ok(Measured {
        scene: name,
        photons_are: if exact { "exact" } else { "image" },
        photons,
        method: label,
        frame_s,
        energy_ratio: value("energy_ratio"),
        rel_mse: value("rel_mse_net"),
        mae: value("mae"),
        flip: value("flip"),
    })
}

/// Photons along a side for which a frame takes `wanted` seconds, if it grows with their number as between two frames.
fn at_time(wanted: f64, fewer: &Measured, more: &Measured) -> u32 {
    let squares = [fewer, more].map(|cell| f64::from(cell.photons) * f64::from(cell.photons));
    let per_photon = ((more.frame_s - fewer.frame_s) / (squares[1] - squares[0])).max(f64::MIN_POSITIVE);
    let count = squares[1] + (wanted - more.frame_s) / per_photon;
    (count.max(0.0).sqrt().round() as u32).clamp(64, 2048)
}

fn report(groups: &[Group], frames: u32) -> String {
    let mut text = format!(
        "480x270, 2x2 samples, map of 1024² texels, against 16 million traced photons at the points that the picture shows; {} threads, median of {frames} \
         frames.\n",
        rayon::current_num_threads()
    );
    for group in groups {
        let Some(first) = group.rows.first() else { continue };
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{}.\n", group.title);
        let names: String = first.iter().map(|cell| format!(" {} |", cell.method)).collect();
        let columns = "---:|".repeat(first.len());
        let table = |title: &str, of: &dyn Fn(&Measured) -> String| {
            let mut text = format!("\n{title}\n\n| scene | photons |{names}\n|---|---|{columns}\n");
            for row in &group.rows {
                let photons: Vec<String> = row.iter().map(|cell| format!("{}²", cell.photons)).collect();
                let same = photons.iter().all(|p| *p == photons[0]);
                let photons = if same { photons[0].clone() } else { photons.join(", ") };
                let cells: String = row.iter().map(|cell| format!(" {} |", of(cell))).collect();
                let _ = writeln!(text, "| {} | {photons} |{cells}", row[0].scene);
            }
            text
        };
        text.push_str(&table("Energy ratio:", &|cell| shipped::cell(cell.energy_ratio, 4)));
        text.push_str(&table("relMSE, less the noise of the truth:", &|cell| shipped::cell(cell.rel_mse, 3)));
        text.push_str(&table("Mean absolute error over the mean:", &|cell| shipped::cell(cell.mae, 3)));
        text.push_str(&table("FLIP:", &|cell| shipped::cell(cell.flip, 3)));
        text.push_str(&table("Time of a frame, ms:", &|cell| format!("{:.0}", cell.frame_s * 1.0e3)));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(photons: u32, frame_s: f64) -> Measured {
        Measured {
            scene: "ball",
            photons_are: "image",
            photons,
            method: "A",
            frame_s,
            energy_ratio: Some(0.5),
            rel_mse: Some(2.0),
            mae: None,
            flip: Some(0.25),
        }
    }

    #[test]
    fn equal_time_follows_from_two_frames() {
        // A tenth of a second and a microsecond per photon.
        let of = |photons: u32| measured(photons, 0.1 + f64::from(photons * photons) * 1.0e-6);
        assert_eq!(at_time(of(700).frame_s, &of(512), &of(1024)), 700);
        assert_eq!(at_time(of(1300).frame_s, &of(512), &of(1024)), 1300);
        assert_eq!(at_time(0.01, &of(512), &of(1024)), 64);
        // More photons that took less time, as noise can have it.
        assert_eq!(at_time(1.0, &measured(512, 0.3), &measured(1024, 0.2)), 2048);
    }

    #[test]
    fn the_report_has_every_measure() {
        let group =
            Group { title: "Some", rows: vec![vec![measured(512, 0.1), measured(512, 0.2)], vec![measured(300, 0.1), measured(64, 0.3)]] };
        let text = report(&[group], 3);
        for line in [
            "| ball | 512² | 0.5000 | 0.5000 |",
            "| ball | 300², 64² | 2.00 | 2.00 |",
            "| ball | 512² | - | - |",
            "| ball | 300², 64² | 100 | 300 |",
        ] {
            assert!(text.contains(line), "{text}");
        }
    }
}
