//! Runs the cross-check and prints the results.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;

use super::{HiArgs, Modes};
use crate::caustics::{RenderOptions, Renderer, TechniqueFrame};
use crate::cli::{Outcome, interrupt, list, output, renderer};
use crate::frame::Frame;
use crate::frame::check_memory;
use crate::gpu::crosscheck::{AttachmentReport, Located, Mode, Report, VertexReport, crosscheck, locate, plain_tone, side_by_side};
use crate::gpu::{Gpu, GpuError, conformance, find_adapter};
use crate::image::{file, png};
use crate::pipeline::{Device, DeviceOptions, Surface, format_info};

/// Results of all comparisons.
#[derive(Serialize)]
struct All {
    adapter: String,
    rules: &'static str,
    agrees: bool,
    frames: Vec<FrameReport>,
    conformance: Option<conformance::Report>,
}

/// Results of one frame in one mode.
#[derive(Serialize)]
struct FrameReport {
    scene: String,
    technique: &'static str,
    /// Bodies of glass whose triangles faced in, and were turned over.
    bodies_turned: u64,
    #[serde(flatten)]
    report: Report,
    located: Option<Located>,
    pictures: Vec<PathBuf>,
}

/// Runs the cross-check and prints the results.
///
/// # Errors
/// If there is no driver, a frame cannot be built or run, or a picture cannot be written.
pub fn run(args: &HiArgs) -> anyhow::Result<Outcome> {
    interrupt::install()?;
    let adapter = match find_adapter(args.adapter.as_deref()) {
        Err(GpuError::NoAdapter) => anyhow::bail!("not run: {}", GpuError::NoAdapter),
        other => other?,
    };
    let gpu = Gpu::open(adapter)?;
    let device = Device::new(DeviceOptions::default())?;
    let rules = conformance::choose_rules(&gpu, &device)?;
    let scenes = if args.all { list::scene_paths(Path::new("scenes"))? } else { args.scenes.clone() };
    if let Some(folder) = &args.output {
        fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let mut all = All { adapter: gpu.adapter().title(), rules: rules.0, agrees: true, frames: Vec::new(), conformance: None };
    let modes: &[Mode] = match args.mode {
        Modes::Free => &[Mode::FreeRunning],
        Modes::Resync => &[Mode::Resynchronised],
        Modes::Both => &[Mode::Resynchronised, Mode::FreeRunning],
    };
    if !args.json {
        output::text(&format!("{}, compared under the rules {}\n", all.adapter, all.rules))?;
    }
    for scene in &scenes {
        let loaded = renderer::load_settled(args.techniques, scene, args.size, None, &args.settings)?;
        let compared = args.techniques.iter().filter(|technique| args.technique.as_ref().is_none_or(|name| name == technique.name()));
        let mut turned = 0;
        for technique in compared {
            let options = RenderOptions {
                technique: technique.name().to_owned(),
                techniques: args.techniques,
                memory_limit_bytes: args.memory_limit_bytes,
                ..RenderOptions::default()
            };
            let TechniqueFrame { mut frame, counters, .. } = Renderer::new(&loaded, &options)?.build(&loaded)?;
            frame.rules = rules.1;
            turned = renderer::turned(&counters);
            let copies = (COPIES - 1) * frame.memory().textures + frame.memory().buffers;
            check_memory(&frame, &device, args.memory_limit_bytes.saturating_sub(copies))?;
            for &mode in modes {
                let mut report = check(args, &gpu, &device, &frame, mode, scene, technique.name())?;
                report.bodies_turned = turned;
                all.agrees &= report.report.agrees();
                if !args.json {
                    output::text(&table(&report))?;
                }
                all.frames.push(report);
            }
        }
        renderer::warn_of_turned(scene, turned);
    }
    if let Some(share) = args.conformance {
        let report = conformance::run(&gpu, &device, rules, share)?;
        all.agrees &= report.passes();
        if !args.json {
            output::text(&format!("\n{}\n", report.markdown()))?;
        }
        all.conformance = Some(report);
    }
    if args.json {
        output::json(&all)?;
    } else {
        output::text(if all.agrees { "all within their bounds\n" } else { "not all within their bounds\n" })?;
    }
    Ok(if all.agrees { Outcome::Done } else { Outcome::Differs })
}

/// Copies of a frame's textures at one time: the software GPU's two, the driver's, and those read back from it. Of buffers there are two.
const COPIES: u64 = 4;

fn check(
    args: &HiArgs,
    gpu: &Gpu,
    device: &Device,
    frame: &Frame,
    mode: Mode,
    scene: &Path,
    technique: &'static str,
) -> anyhow::Result<FrameReport> {
    let mut pictures = Vec::new();
    let mut failed = None;
    let watch = |attachment: &AttachmentReport, surfaces: [&Surface; 2]| {
        if let (false, Some(folder)) = (attachment.within, &args.output)
            && failed.is_none()
        {
            let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
            let name = format!("{stem}-{technique}-{mode:?}-{}-{}.png", attachment.pass, attachment.texture).replace(' ', "-");
            failed = picture(attachment, surfaces, &folder.join(name), &mut pictures).err();
        }
    };
    let report = crosscheck(gpu, device, frame, frame, mode, &args.techniques.bounds(technique), watch)?;
    if let Some(error) = failed {
        return Err(error);
    }
    let located = match report.first_failure() {
        Some(failure) => locate(gpu, device, frame, frame, mode, failure)?,
        None => None,
    };
    Ok(FrameReport { scene: scene.display().to_string(), technique, bodies_turned: 0, report, located, pictures })
}

fn picture(attachment: &AttachmentReport, surfaces: [&Surface; 2], path: &Path, written: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let Some(info) = format_info(attachment.format) else { return Ok(()) };
    let layer = side_by_side(info, surfaces, &attachment.difference, attachment.bound.tolerance)?;
    let bytes = png::encode(&layer, &plain_tone())?;
    interrupt::uninterrupted(|| file::write_atomically(path, &bytes))?;
    written.push(path.to_owned());
    Ok(())
}

/// The results as a table.
fn table(report: &FrameReport) -> String {
    let mode = match report.report.mode {
        Mode::FreeRunning => "free-running",
        Mode::Resynchronised => "resynchronised",
    };
    let mut text = format!("\n{}, {}, {mode}\n", report.scene, report.technique);
    let header =
        ["", "pass", "attachment", "bound", "differ", "max ulp", "max relative", "beyond", "moved", "left", "worst", "light", "drift"]
            .map(str::to_owned);
    let rows = report.report.attachments.iter().map(|a| {
        let d = &a.difference;
        [
            (if a.within { "ok" } else { "DIFFERS" }).to_owned(),
            a.pass.clone(),
            a.texture.clone(),
            a.bound.name.to_owned(),
            d.differing.to_string(),
            d.max_ulp.to_string(),
            format!("{:.1e}", d.max_relative),
            d.outliers.to_string(),
            d.moved.to_string(),
            d.unexplained().to_string(),
            format!("{:.1e}", d.worst_unexplained),
            format!("{:.1e}", d.light),
            format!("{:.1e}", a.drift),
        ]
    });
    let rows: Vec<[String; 13]> = std::iter::once(header).chain(rows).collect();
    let rows: Vec<[&str; 13]> = rows.iter().map(|row| std::array::from_fn(|k| row[k].as_str())).collect();
    text.push_str(&output::columns(&rows));
    text.push_str(&vertex_table(&report.report));
    // Writing to a string cannot fail.
    for query in &report.report.queries {
        let _ = writeln!(text, "DIFFERS  pass {}, query {}: {} and {}", query.pass_index, query.query, query.expected, query.actual);
    }
    if let Some(located) = &report.located {
        let _ = writeln!(text, "{}", told(located));
    }
    for path in &report.pictures {
        let _ = writeln!(text, "  {}", path.display());
    }
    text
}

/// Table of the vertex stages: the worst draw of each pass.
fn vertex_table(report: &Report) -> String {
    let mut rows: Vec<[String; 7]> = Vec::new();
    for pass in report.vertices.chunk_by(|a, b| a.pass_index == b.pass_index) {
        let within = pass.iter().all(|v| v.within);
        let sum = |count: fn(&VertexReport) -> u64| pass.iter().map(count).sum::<u64>().to_string();
        rows.push([
            (if within { "ok" } else { "DIFFERS" }).to_owned(),
            pass[0].pass.clone(),
            pass[0].bound.name.to_owned(),
            sum(|v| v.vertices),
            sum(|v| v.differing),
            sum(|v| v.outliers),
            format!("{:.1e}", pass.iter().map(|v| v.max_relative).fold(0.0, f64::max)),
        ]);
    }
    if rows.is_empty() {
        return String::new();
    }
    rows.insert(0, ["", "vertices of pass", "bound", "compared", "differ", "beyond", "max relative"].map(str::to_owned));
    let rows: Vec<[&str; 7]> = rows.iter().map(|row| std::array::from_fn(|k| row[k].as_str())).collect();
    output::columns(&rows)
}

/// The place at which two versions begin to differ, in words.
fn told(located: &Located) -> String {
    let p = &located.pixel;
    let mut text = format!(
        "first in pass `{}`, attachment `{}`, pixel ({}, {}), channel {}: {} (bits {:08x}) expected, {} (bits {:08x}) seen",
        located.pass,
        located.texture,
        p.x,
        p.y,
        p.channel,
        p.expected,
        p.expected.to_bits(),
        p.actual,
        p.actual.to_bits()
    );
    let Some((draw, label)) = &located.draw else { return text + "; it differs before the first draw" };
    let _ = write!(text, "\n  since draw {draw} (pipeline `{label}`)");
    if let Some(primitive) = located.primitive {
        let _ = write!(text, ", primitive {primitive}");
    }
    if let Some(after) = &located.after {
        let _ = write!(text, ": {} expected, {} seen", after.expected, after.actual);
    }
    for line in located.state.lines() {
        let _ = write!(text, "\n    {line}");
    }
    for vertex in located.vertices.iter().take(12) {
        let _ = write!(text, "\n    vertex {vertex:?}");
    }
    text
}
