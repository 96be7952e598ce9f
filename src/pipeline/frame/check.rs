//! Checks before a frame runs: its memory, and the references in its passes and draws.

use rayon::prelude::*;

use crate::api::draw::DRAWS_PER_TASK;
use crate::frame::description::{AttachmentView, BindEntry, BufferId, Draw, Frame, Pass};
use crate::frame::error::{BindGroupProblem, FrameError, ReferenceProblem};
use crate::run::device::Device;

/// Least bin budget with which a pass can run, bytes.
const MIN_BIN_BYTES: u64 = 8 << 20;

/// Refuses a frame whose resources and bins need more than `limit_bytes`. `device` gives the bin budget.
///
/// # Errors
/// [`FrameError::Memory`], with the name of the largest resource.
pub fn check_memory(frame: &Frame, device: &Device, limit_bytes: u64) -> Result<(), FrameError> {
    let bins = (device.wave_bytes() as u64).max(MIN_BIN_BYTES);
    let needed = frame.memory().resources().saturating_add(bins);
    if needed <= limit_bytes {
        return Ok(());
    }
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let (largest, largest_bytes) = frame.largest_resource().unwrap_or(("bins", bins));
    Err(FrameError::Memory {
        needed_mib: mib(needed),
        limit_mib: limit_bytes >> 20,
        largest: largest.to_owned(),
        largest_mib: mib(largest_bytes),
    })
}

/// Checks that every id refers to a resource of the frame, that samplers are valid, and that no pass reads what it writes.
///
/// # Errors
/// [`FrameError::BindGroup`], [`FrameError::Texture`] for a view, or [`FrameError::Reference`] with the pass and the cause.
pub fn check_references(frame: &Frame) -> Result<(), FrameError> {
    for (group, entries) in frame.bind_groups.iter().map(|group| &group.entries).enumerate() {
        for (binding, entry) in entries.iter().enumerate() {
            if let Some(problem) = entry_problem(frame, entry) {
                return Err(FrameError::BindGroup { group, binding, problem });
            }
            if let BindEntry::Texture(view) = entry {
                frame.textures[view.texture.index()].desc.view_range(&view.range)?;
            }
        }
    }
    for pass in &frame.passes {
        let problem = attachment_problem(frame, pass).or_else(|| stream_out_problem(frame, pass));
        let draws = pass.draws.par_iter().enumerate().with_min_len(DRAWS_PER_TASK);
        let problem = problem.or_else(|| draws.find_map_first(|(number, draw)| draw_problem(frame, pass, number, draw)));
        if let Some(problem) = problem.or_else(|| read_and_written(frame, pass)) {
            return Err(FrameError::Reference { pass: pass.label.clone(), problem });
        }
    }
    Ok(())
}

/// Why an entry of a bind group is refused, or `None`.
fn entry_problem(frame: &Frame, entry: &BindEntry) -> Option<BindGroupProblem> {
    match entry {
        BindEntry::Uniform(buffer, _) | BindEntry::DynamicUniform(buffer) | BindEntry::Storage(buffer) => {
            let buffer = buffer.index();
            (buffer >= frame.buffers.len()).then_some(BindGroupProblem::NoBuffer { buffer })
        }
        BindEntry::Texture(view) => {
            let texture = view.texture.index();
            (texture >= frame.textures.len()).then_some(BindGroupProblem::NoTexture { texture })
        }
        BindEntry::Sampler(sampler) => sampler.validate().err().map(BindGroupProblem::Sampler),
    }
}

/// Why the attachments of a pass are refused, or `None`.
fn attachment_problem(frame: &Frame, pass: &Pass) -> Option<ReferenceProblem> {
    let views = pass.attachments();
    views.iter().enumerate().find_map(|(attachment, view)| {
        let Some(texture) = frame.textures.get(view.texture.index()) else {
            return Some(ReferenceProblem::NoTexture { attachment, texture: view.texture.index() });
        };
        let (desc, AttachmentView { level, layer, .. }) = (&texture.desc, *view);
        let texture = || desc.label.clone();
        if !desc.has_surface(level, layer) {
            return Some(ReferenceProblem::NoSurface { attachment, texture: texture(), level, layer });
        }
        views[..attachment].contains(view).then(|| ReferenceProblem::AttachedTwice { texture: texture(), level, layer })
    })
}

/// Why the stream-out targets of a pass are refused, or `None`: all draws to one target must write vertices of one size.
fn stream_out_problem(frame: &Frame, pass: &Pass) -> Option<ReferenceProblem> {
    let targets = &pass.stream_out;
    for (i, target) in targets.iter().enumerate() {
        let Some(buffer) = frame.buffers.get(target.buffer.index()) else {
            return Some(ReferenceProblem::NoStreamOutBuffer { target: i, buffer: target.buffer.index() });
        };
        let buffer = || buffer.label.clone();
        if targets[..i].iter().any(|earlier| earlier.buffer == target.buffer) {
            return Some(ReferenceProblem::StreamedOutTwice { buffer: buffer() });
        }
        let mut writers =
            pass.draws.iter().filter(|draw| draw.stream_out == Some(i as u32) && draw.pipeline.index() < frame.pipelines.len());
        let Some(first) = writers.next().map(|draw| frame.stream_floats(draw.pipeline)) else { continue };
        if let Some(other) = writers.map(|draw| frame.stream_floats(draw.pipeline)).find(|&floats| floats != first) {
            return Some(ReferenceProblem::StreamOutVertices { buffer: buffer(), first, other });
        }
    }
    None
}

/// Why the references of a draw are refused, or `None`.
fn draw_problem(frame: &Frame, pass: &Pass, number: usize, of: &Draw) -> Option<ReferenceProblem> {
    let (draw, pipeline, bind_group) = (number, of.pipeline.index(), of.bind_group.index());
    if pipeline >= frame.pipelines.len() {
        return Some(ReferenceProblem::NoPipeline { draw, pipeline });
    }
    if bind_group >= frame.bind_groups.len() {
        return Some(ReferenceProblem::NoBindGroup { draw, bind_group });
    }
    let count = pass.stream_out.len();
    if let Some(target) = of.stream_out.filter(|&target| target as usize >= count) {
        return Some(ReferenceProblem::NoStreamOutTarget { draw, target, count });
    }
    if of.streamed.is_some() && of.index.is_some() {
        return Some(ReferenceProblem::IndexedStreamOut { draw });
    }
    let mut buffers = of.vertex_buffers.iter().map(|b| b.0).chain(of.index.iter().map(|i| i.buffer)).chain(of.streamed);
    buffers.find_map(|buffer| {
        if buffer.index() >= frame.buffers.len() {
            return Some(ReferenceProblem::NoBuffer { draw, buffer: buffer.index() });
        }
        streams_to(pass, buffer).then(|| ReferenceProblem::DrawReadsStreamOut { draw, buffer: label(frame, buffer) })
    })
}

/// A texture or buffer that a bind group of the pass reads and the pass also writes.
fn read_and_written(frame: &Frame, pass: &Pass) -> Option<ReferenceProblem> {
    let views = pass.attachments();
    let entries = pass.bind_groups().into_iter().flat_map(|group| &frame.bind_groups[group.index()].entries);
    for entry in entries {
        match entry {
            BindEntry::Texture(view) => {
                let desc = &frame.textures[view.texture.index()].desc;
                let range = desc.view_range(&view.range).ok()?;
                if views.iter().any(|v| v.texture == view.texture && range.contains(v.level, v.layer)) {
                    return Some(ReferenceProblem::ReadAndDrawnTo { texture: desc.label.clone() });
                }
            }
            BindEntry::Uniform(buffer, _) | BindEntry::DynamicUniform(buffer) | BindEntry::Storage(buffer) if streams_to(pass, *buffer) => {
                return Some(ReferenceProblem::ReadAndStreamedOut { buffer: label(frame, *buffer) });
            }
            _ => {}
        }
    }
    None
}

fn streams_to(pass: &Pass, buffer: BufferId) -> bool {
    pass.stream_out.iter().any(|target| target.buffer == buffer)
}

fn label(frame: &Frame, buffer: BufferId) -> String {
    frame.buffers[buffer.index()].label.clone()
}
