//! Whether a frame can run: memory, and what passes and draws refer to.

use rayon::prelude::*;

use crate::api::draw::DRAWS_PER_TASK;
use crate::frame::description::{BindEntry, Frame, FrameDraw};
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

/// Every number in the frame points at something.
pub fn check_references(frame: &Frame) -> Result<(), FrameError> {
    let fail = |pass: &str, what: String| Err(FrameError::Reference { pass: pass.to_owned(), what });
    for (number, group) in frame.bind_groups.iter().enumerate() {
        for entry in &group.entries {
            let missing = match entry {
                BindEntry::Uniform(b, _) | BindEntry::DynamicUniform(b) | BindEntry::Storage(b) => b.index() >= frame.buffers.len(),
                BindEntry::Texture(t) => t.index() >= frame.textures.len(),
                BindEntry::Sampler(_) => false,
            };
            if missing {
                return fail("(bind groups)", format!("bind group {number} names {entry:?}, which the frame does not have"));
            }
        }
    }
    for pass in &frame.passes {
        let views = pass.attachments();
        for (i, view) in views.iter().enumerate() {
            let Some(texture) = frame.textures.get(view.texture.index()) else {
                return fail(&pass.label, format!("attachment {i} names texture {}, which the frame does not have", view.texture.index()));
            };
            if view.level >= texture.desc.mip_level_count || view.layer >= texture.desc.level_size(view.level).2 {
                return fail(
                    &pass.label,
                    format!("attachment {i} is level {} layer {} of `{}`", view.level, view.layer, texture.desc.label),
                );
            }
            if views[..i].iter().any(|earlier| earlier.texture == view.texture) {
                return fail(&pass.label, format!("texture `{}` is attached twice", texture.desc.label));
            }
        }
        let problems = pass.draws.par_iter().enumerate().with_min_len(DRAWS_PER_TASK);
        if let Some(what) = problems.find_map_first(|(number, draw)| missing_reference(frame, number, draw)) {
            return fail(&pass.label, what);
        }
        for entry in pass.bind_groups().iter().flat_map(|group| &frame.bind_groups[group.index()].entries) {
            if let BindEntry::Texture(texture) = entry
                && views.iter().any(|v| v.texture == *texture)
            {
                let name = &frame.textures[texture.index()].desc.label;
                return fail(&pass.label, format!("texture `{name}` is read and drawn to in the same pass"));
            }
        }
    }
    Ok(())
}

/// What a draw names that the frame does not have.
fn missing_reference(frame: &Frame, number: usize, draw: &FrameDraw) -> Option<String> {
    if draw.pipeline.index() >= frame.pipelines.len() || draw.bind_group.index() >= frame.bind_groups.len() {
        return Some(format!("draw {number} names a pipeline or bind group that the frame does not have"));
    }
    let mut buffers = draw.vertex_buffers.iter().map(|b| b.0).chain(draw.index.iter().map(|i| i.buffer));
    let missing = buffers.find(|buffer| buffer.index() >= frame.buffers.len())?;
    Some(format!("draw {number} names buffer {}, which the frame does not have", missing.index()))
}
