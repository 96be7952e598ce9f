//! The CPU executor: runs a frame's passes on the software GPU.

use crate::frame::check::{check_memory, check_references};
use crate::frame::contents::Contents;
use crate::frame::description::Frame;
use crate::frame::error::FrameError;
use crate::frame::executor::{Executor, FrameObserver, FrameOutput};
use crate::frame::resolve::{pipelines, run_frame_pass};
use crate::run::device::Device;

/// Runs frames on the software GPU. Textures are kept for the next frame of the same shape, because allocating fresh pages costs more than drawing.
pub struct CpuExecutor {
    device: Device,
    memory_limit_bytes: u64,
    contents: Contents,
}

impl CpuExecutor {
    /// An executor on a device. It refuses frames whose resources and bins need more than `memory_limit_bytes`.
    #[must_use]
    pub fn new(device: Device, memory_limit_bytes: u64) -> Self {
        Self { device, memory_limit_bytes, contents: Contents::default() }
    }
}

impl Executor for CpuExecutor {
    fn run(&mut self, frame: &Frame, mut observer: Option<&mut dyn FrameObserver>) -> Result<FrameOutput<'_>, FrameError> {
        let Self { device, memory_limit_bytes, contents } = self;
        // The whole frame runs inside the device's thread pool: entering the pool for each small pass takes longer than the pass.
        let passes = device.install(|| {
            check_memory(frame, device, *memory_limit_bytes)?;
            check_references(frame)?;
            let pipelines = pipelines(frame)?;
            contents.reset(frame)?;
            let mut outputs = Vec::with_capacity(frame.passes.len());
            for (index, pass) in frame.passes.iter().enumerate() {
                let inside = observer.as_deref_mut().and_then(|o| o.pass_begin(index, pass));
                let output = match (&pass.cached, inside) {
                    (Some(cached), None) => cached.clone(),
                    (_, inside) => run_frame_pass(device, frame, &pipelines, pass, contents, inside)?,
                };
                if let Some(observer) = observer.as_deref_mut() {
                    observer.pass_end(index, pass, contents, &output);
                }
                outputs.push(output);
            }
            Ok::<_, FrameError>(outputs)
        })?;
        Ok(FrameOutput { device: &self.device, contents: &self.contents, passes })
    }

    fn device(&self) -> &Device {
        &self.device
    }
}
