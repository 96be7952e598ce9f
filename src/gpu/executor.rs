//! An executor that runs whole frames on a driver.

use std::collections::BTreeSet;

use super::GpuError;
use super::device::Gpu;
use super::frame::{GpuFrame, Vertices};
use nephroid_pipeline::frame::{
    AttachmentView, Contents, Executor, Frame, FrameError, FrameObserver, FrameOutput, TextureId, check_memory,
};
use nephroid_pipeline::{Device, PassOutput, Texture};

/// Runs whole frames on a driver. Textures are read back after the last pass. Of the counters of a pass, only queries and stream-out are available.
pub struct GpuExecutor {
    gpu: Gpu,
    device: Device,
    memory_limit_bytes: u64,
    contents: Contents,
}

impl GpuExecutor {
    /// An executor on a driver. It refuses frames above a memory limit. `device` runs the stages that the driver lacks.
    #[must_use]
    pub fn new(gpu: Gpu, device: Device, memory_limit_bytes: u64) -> Self {
        Self { gpu, device, memory_limit_bytes, contents: Contents::default() }
    }
}

impl Executor for GpuExecutor {
    fn run(&mut self, frame: &Frame, mut observer: Option<&mut dyn FrameObserver>) -> Result<FrameOutput<'_>, FrameError> {
        check_memory(frame, &self.device, self.memory_limit_bytes)?;
        let mut on_gpu = GpuFrame::new(&self.gpu, frame)?;
        self.contents = Contents::initial(frame)?;
        let mut passes = Vec::with_capacity(frame.passes.len());
        let mut drawn = BTreeSet::new();
        for (index, pass) in frame.passes.iter().enumerate() {
            if let Some(observer) = observer.as_deref_mut() {
                // The stages of a driver cannot be observed, so the returned observer is not used.
                let _ = observer.pass_begin(index, pass);
            }
            for id in on_gpu.read_by_expanded_stages(index, 0..pass.draws.len(), Vertices::Shaded).intersection(&drawn) {
                read_whole(&on_gpu, *id, &mut self.contents.textures)?;
            }
            let stream_out = on_gpu.stream_pass(index, Vertices::Shaded, &self.device, &mut self.contents)?;
            let queries = on_gpu.draw_pass(index, Vertices::Shaded, &self.device, &self.contents)?;
            drawn.extend(pass.attachments().iter().map(|view| view.texture));
            let output = PassOutput { queries, stream_out, ..PassOutput::default() };
            if let Some(observer) = observer.as_deref_mut() {
                for view in pass.attachments() {
                    on_gpu.download(view, &mut self.contents.textures[view.texture.index()])?;
                }
                observer.pass_end(index, pass, &self.contents, &output);
            }
            passes.push(output);
        }
        for id in drawn {
            read_whole(&on_gpu, id, &mut self.contents.textures)?;
        }
        Ok(FrameOutput { device: &self.device, contents: &self.contents, passes })
    }

    fn device(&self) -> &Device {
        &self.device
    }
}

fn read_whole(on_gpu: &GpuFrame<'_>, id: TextureId, textures: &mut [Texture]) -> Result<(), GpuError> {
    let into = &mut textures[id.index()];
    for level in 0..into.desc().mip_level_count {
        for layer in 0..into.desc().level_size(level).2 {
            on_gpu.download(AttachmentView { texture: id, level, layer }, into)?;
        }
    }
    Ok(())
}
