//! The cross-check: one frame on the software GPU and on a driver, compared attachment by attachment after every pass.
//!
//! *Free-running*, each side reads what itself drew in earlier passes, and the driver shades vertices: the check is of the whole frame.
//! *Resynchronised*, the driver starts every pass from the software GPU's attachments, and gets its vertices: what differs then is the doing
//! of that one pass, after the vertex stage.

mod compare;

pub use compare::{Difference, Pixel, compare, relative, ulps};

use super::{Gpu, GpuError, GpuFrame, Vertices};
use crate::frame::cpu::{initial_textures, pipelines, run_frame_pass};
use crate::frame::{Frame, FrameError};
use crate::pipeline::{Device, Texture};

/// What the driver starts each pass from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// What it drew itself.
    FreeRunning,
    /// The software GPU's attachments and vertices.
    Resynchronised,
}

/// One attachment after one pass.
#[derive(Clone, Debug)]
pub struct AttachmentReport {
    /// The pass.
    pub pass: String,
    /// The texture.
    pub texture: String,
    /// How far the two versions are apart.
    pub difference: Difference,
}

/// Runs a frame on both sides.
///
/// # Errors
/// If the frame is not valid or the driver fails.
pub fn crosscheck(gpu: &Gpu, device: &Device, frame: &Frame, mode: Mode) -> Result<Vec<AttachmentReport>, GpuError> {
    let pipelines = pipelines(frame).map_err(FrameError::from)?;
    let mut on_gpu = GpuFrame::new(gpu, frame)?;
    let mut expected = initial_textures(frame).map_err(FrameError::from)?;
    let mut actual = expected.clone();
    let mut reports = Vec::new();
    for (index, pass) in frame.passes.iter().enumerate() {
        let (vertices, textures): (Vertices, &[Texture]) = match mode {
            Mode::FreeRunning => (Vertices::Shaded, &actual),
            Mode::Resynchronised => (Vertices::Pulled, &expected),
        };
        let ready = on_gpu.prepare(index, 0..pass.draws.len(), vertices, device, textures)?;
        on_gpu.run([&ready])?;
        run_frame_pass(device, frame, &pipelines, pass, &mut expected, None)?;
        for view in pass.attachments() {
            let number = view.texture.index();
            on_gpu.download(view, &mut actual[number])?;
            let [e, a] = [&expected, &actual].map(|t| t[number].surface(view.level, view.layer));
            reports.push(AttachmentReport {
                pass: pass.label.clone(),
                texture: frame.textures[number].desc.label.clone(),
                difference: compare(expected[number].info(), e, a, 1e-4),
            });
            if mode == Mode::Resynchronised {
                on_gpu.upload(view.texture, &expected[number])?;
            }
        }
    }
    Ok(reports)
}
