//! Whether a frame can run: memory, and what passes and draws refer to.

use rayon::prelude::*;

use crate::api::draw::DRAWS_PER_TASK;
use crate::frame::description::{AttachmentView, BindEntry, BufferId, Frame, FrameDraw, FramePass};
use crate::frame::executor::FrameError;
use crate::run::device::Device;

/// Least bin budget that a pass can work with.
const MIN_BIN_BYTES: u64 = 8 << 20;

/// Refuses a frame that needs more memory than it may use: its resources, and the bins of the software GPU.
///
/// # Errors
/// [`FrameError::Memory`], with the largest part named.
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

/// Every number in the frame points at something, and no pass reads what it writes.
///
/// # Errors
/// [`FrameError::Reference`], with the pass and what is wrong there.
pub fn check_references(frame: &Frame) -> Result<(), FrameError> {
    let fail = |pass: &str, what: String| Err(FrameError::Reference { pass: pass.to_owned(), what });
    for (number, group) in frame.bind_groups.iter().enumerate() {
        for entry in &group.entries {
            let missing = match entry {
                BindEntry::Uniform(b, _) | BindEntry::DynamicUniform(b) | BindEntry::Storage(b) => b.index() >= frame.buffers.len(),
                BindEntry::Texture(view) => view.texture.index() >= frame.textures.len(),
                BindEntry::Sampler(_) => false,
            };
            if missing {
                return fail("(bind groups)", format!("bind group {number} names {entry:?}, which the frame does not have"));
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
        if let Some(what) = problem.or_else(|| read_and_written(frame, pass)) {
            return fail(&pass.label, what);
        }
    }
    Ok(())
}

/// What is wrong with a pass's attachments.
fn attachment_problem(frame: &Frame, pass: &FramePass) -> Option<String> {
    let views = pass.attachments();
    views.iter().enumerate().find_map(|(i, view)| {
        let Some(texture) = frame.textures.get(view.texture.index()) else {
            return Some(format!("attachment {i} names texture {}, which the frame does not have", view.texture.index()));
        };
        let (desc, AttachmentView { level, layer, .. }) = (&texture.desc, *view);
        if level >= desc.mip_level_count || layer >= desc.level_size(level).2 {
            return Some(format!("attachment {i} is level {level} layer {layer} of `{}`", desc.label));
        }
        views[..i].contains(view).then(|| format!("texture `{}`, level {level}, layer {layer} is attached twice", desc.label))
    })
}

/// What is wrong with a pass's stream-out targets: all draws to one of them must write vertices of one size.
fn stream_out_problem(frame: &Frame, pass: &FramePass) -> Option<String> {
    let targets = &pass.stream_out;
    for (i, target) in targets.iter().enumerate() {
        let Some(buffer) = frame.buffers.get(target.buffer.index()) else {
            return Some(format!("stream-out target {i} names buffer {}, which the frame does not have", target.buffer.index()));
        };
        if targets[..i].iter().any(|earlier| earlier.buffer == target.buffer) {
            return Some(format!("buffer `{}` is streamed out to twice", buffer.label));
        }
        let mut writers =
            pass.draws.iter().filter(|draw| draw.stream_out == Some(i as u32) && draw.pipeline.index() < frame.pipelines.len());
        let first = writers.next().map(|draw| frame.stream_floats(draw.pipeline));
        if let Some(other) = writers.map(|draw| frame.stream_floats(draw.pipeline)).find(|&floats| Some(floats) != first) {
            return Some(format!("draws stream vertices of {} and of {other} floats out to buffer `{}`", first.unwrap_or(0), buffer.label));
        }
    }
    None
}

/// What is wrong with the numbers of a draw.
fn draw_problem(frame: &Frame, pass: &FramePass, number: usize, draw: &FrameDraw) -> Option<String> {
    if draw.pipeline.index() >= frame.pipelines.len() || draw.bind_group.index() >= frame.bind_groups.len() {
        return Some(format!("draw {number} names a pipeline or bind group that the frame does not have"));
    }
    if draw.stream_out.is_some_and(|target| target as usize >= pass.stream_out.len()) {
        return Some(format!("draw {number} streams out to target {:?} of {}", draw.stream_out, pass.stream_out.len()));
    }
    if draw.streamed.is_some() && draw.index.is_some() {
        return Some(format!("draw {number} has indices and takes its vertices from stream-out"));
    }
    let mut buffers = draw.vertex_buffers.iter().map(|b| b.0).chain(draw.index.iter().map(|i| i.buffer)).chain(draw.streamed);
    buffers.find_map(|buffer| {
        if buffer.index() >= frame.buffers.len() {
            return Some(format!("draw {number} names buffer {}, which the frame does not have", buffer.index()));
        }
        streams_to(pass, buffer).then(|| format!("draw {number} reads buffer `{}`, to which the pass streams out", label(frame, buffer)))
    })
}

/// What a bind group of the pass reads and the pass writes.
fn read_and_written(frame: &Frame, pass: &FramePass) -> Option<String> {
    let views = pass.attachments();
    let entries = pass.bind_groups().into_iter().flat_map(|group| &frame.bind_groups[group.index()].entries);
    for entry in entries {
        match entry {
            BindEntry::Texture(view) => {
                let desc = &frame.textures[view.texture.index()].desc;
                let range = desc.view_range(&view.range).ok()?;
                if views.iter().any(|v| v.texture == view.texture && range.contains(v.level, v.layer)) {
                    return Some(format!("texture `{}` is read and drawn to in the same pass", desc.label));
                }
            }
            BindEntry::Uniform(buffer, _) | BindEntry::DynamicUniform(buffer) | BindEntry::Storage(buffer) if streams_to(pass, *buffer) => {
                return Some(format!("buffer `{}` is read and streamed out to in the same pass", label(frame, *buffer)));
            }
            _ => {}
        }
    }
    None
}

fn streams_to(pass: &FramePass, buffer: BufferId) -> bool {
    pass.stream_out.iter().any(|target| target.buffer == buffer)
}

fn label(frame: &Frame, buffer: BufferId) -> &str {
    &frame.buffers[buffer.index()].label
}
