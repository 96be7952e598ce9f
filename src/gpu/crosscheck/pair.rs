//! A frame on both sides, run pass by pass.

use super::vertices::VertexReport;
use super::{Mode, PassBounds, StreamReport, vertex_bound_of};
use crate::pull::same_vertices;
use crate::{DRAWS_PER_BATCH, Gpu, GpuError, GpuFrame, Vertices};
use nephroid_pipeline::frame::{
    AttachmentView, BufferId, Contents, Frame, FrameError, Pass, TextureId, pipelines, run_frame_pass, stream_draws, target_size,
};
use nephroid_pipeline::state::Viewport;
use nephroid_pipeline::{Device, LoadOp, RenderPipeline, Surface, Texture};

/// A frame on both sides, run pass by pass.
pub(crate) struct Pair<'a> {
    device: &'a Device,
    pub mode: Mode,
    on_cpu: &'a Frame,
    pipelines: Vec<RenderPipeline>,
    on_gpu: GpuFrame<'a>,
    gpu_frame: &'a Frame,
    /// What the software GPU draws from its own earlier results. In the resynchronised mode, the driver starts from them, too.
    pub chain: Contents,
    /// In the free-running mode: what the software GPU draws from the driver's earlier results.
    from_driver: Option<Contents>,
    /// Textures and buffers of the driver, as last read back.
    pub actual: Contents,
    /// Attachments that the last pass loads, as they were before it.
    loaded: Vec<(TextureId, Texture)>,
}

impl<'a> Pair<'a> {
    /// A pair before its first pass: contents are the frames' initial contents.
    ///
    /// # Errors
    /// If the frame is not valid or the device cannot hold it.
    pub fn new(gpu: &'a Gpu, device: &'a Device, on_cpu: &'a Frame, on_gpu: &'a Frame, mode: Mode) -> Result<Self, GpuError> {
        let pipelines = pipelines(on_cpu).map_err(FrameError::from)?;
        let chain = Contents::initial(on_cpu).map_err(FrameError::from)?;
        let from_driver = (mode == Mode::FreeRunning).then(|| chain.clone());
        let actual = Contents::initial(on_gpu).map_err(FrameError::from)?;
        let gpu_frame = on_gpu;
        let on_gpu = GpuFrame::new(gpu, gpu_frame)?;
        Ok(Self { device, mode, on_cpu, pipelines, on_gpu, gpu_frame, chain, from_driver, actual, loaded: Vec::new() })
    }

    /// What the software GPU draws from what the driver starts each pass from.
    pub fn expected(&self) -> &Contents {
        self.from_driver.as_ref().unwrap_or(&self.chain)
    }

    /// Runs a pass on both sides and reads the driver's attachments. Returns the queries of the software GPU and of the driver.
    ///
    /// # Errors
    /// If a side cannot run the pass.
    pub fn run(&mut self, index: usize) -> Result<[Vec<u64>; 2], GpuError> {
        let (on_cpu, on_gpu) = (&self.on_cpu.passes[index], &self.gpu_frame.passes[index]);
        let vertices = match self.mode {
            Mode::FreeRunning => Vertices::Shaded,
            Mode::Resynchronised => Vertices::Pulled,
        };
        self.loaded = loaded(on_cpu).map(|id| (id, self.expected().texture(id).clone())).collect();
        self.on_gpu.stream_pass(index, vertices, self.device, &mut self.actual)?;
        let contents = if self.mode == Mode::FreeRunning { &self.actual } else { &self.chain };
        let actual = self.on_gpu.draw_pass(index, vertices, self.device, contents)?;
        let mut output = run_frame_pass(self.device, self.on_cpu, &self.pipelines, on_cpu, &mut self.chain, None)?;
        if let Some(contents) = &mut self.from_driver {
            output = run_frame_pass(self.device, self.on_cpu, &self.pipelines, on_cpu, contents, None)?;
        }
        for view in on_gpu.attachments() {
            self.on_gpu.download(view, &mut self.actual.textures[view.texture.index()])?;
        }
        Ok([output.queries, actual])
    }

    /// Compares the vertex stages of a pass on both sides, before the pass runs, from what the driver starts it from. Draws whose vertex stage the driver
    /// does not run are left out.
    pub fn vertices(&mut self, index: usize, bounds: &[PassBounds]) -> Result<Vec<VertexReport>, GpuError> {
        let frame = self.on_cpu;
        let pass = &frame.passes[index];
        if self.mode == Mode::Resynchronised {
            return Ok(Vec::new());
        }
        let is_compared = |number: &usize| {
            let draw = &pass.draws[*number];
            let repeats = *number > 0 && same_vertices(frame, &pass.draws[number - 1], draw);
            !repeats && frame.pipelines[draw.pipeline.index()].program.geometry.is_none() && draw.vertex_buffers.is_empty()
        };
        let numbers: Vec<usize> = (0..pass.draws.len()).filter(is_compared).collect();
        let mut reports: Vec<VertexReport> = Vec::new();
        for alike in numbers.chunk_by(|a, b| pass.draws[*a].pipeline == pass.draws[*b].pipeline) {
            let desc = &frame.pipelines[pass.draws[alike[0]].pipeline.index()];
            let vectors: Vec<usize> = std::iter::once(4).chain(desc.program.varyings.iter().map(|varying| varying.components)).collect();
            let known = reports.iter().position(|report| report.pipeline == desc.label);
            let at = known.unwrap_or_else(|| {
                reports.push(VertexReport::new((index, &pass.label), &desc.label, vertex_bound_of(bounds, &pass.label)));
                reports.len() - 1
            });
            for batch in alike.chunks(DRAWS_PER_BATCH) {
                let draws: Vec<_> = batch.iter().map(|&number| pass.draws[number].clone()).collect();
                let expected = stream_draws(self.device, frame, pass, &draws, self.from_driver.as_ref().unwrap_or(&self.chain))?;
                let actual = self.on_gpu.stream_out_draws(index, batch, self.device, &self.actual)?;
                let both = batch.iter().zip(&expected).zip(&actual);
                reports[at].compare(&vectors, both.map(|((&number, (_, expected)), actual)| (number, &expected.data[..], &actual[..])));
            }
        }
        reports.iter_mut().for_each(VertexReport::judge);
        Ok(reports)
    }

    /// Draws the last pass on the software GPU again, with everything moved by at most one unit of the grid that vertices snap to, in eight directions.
    /// `watch` is called with the contents after each of them.
    ///
    /// # Errors
    /// If the pass is not valid when moved.
    pub fn moved(&mut self, index: usize, mut watch: impl FnMut(&Contents)) -> Result<(), GpuError> {
        let pass = &self.on_cpu.passes[index];
        let unit = 1.0 / (1_u32 << self.on_cpu.rules.subpixel_bits) as f32;
        let size = target_size(self.on_cpu, pass);
        let contents = self.from_driver.as_mut().unwrap_or(&mut self.chain);
        let drawn: Vec<(TextureId, Texture)> =
            pass.attachments().iter().map(|view| (view.texture, contents.texture(view.texture).clone())).collect();
        for (right, down) in [(-1.0, -1.0), (0.0, -1.0), (1.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (-1.0, 1.0), (0.0, 1.0), (1.0, 1.0)] {
            for (id, texture) in &self.loaded {
                contents.textures[id.index()].clone_from(texture);
            }
            let mut shifted = Pass { stream_out: Vec::new(), ..pass.clone() };
            for draw in &mut shifted.draws {
                draw.stream_out = None;
                let viewport = draw.viewport.get_or_insert_with(|| Viewport::full(size.0, size.1));
                (viewport.x, viewport.y) = (viewport.x + right * unit, viewport.y + down * unit);
            }
            run_frame_pass(self.device, self.on_cpu, &self.pipelines, &shifted, contents, None)?;
            watch(contents);
        }
        for (id, texture) in drawn {
            contents.textures[id.index()] = texture;
        }
        Ok(())
    }

    /// Makes both sides start the next pass from the same: from the software GPU's results of this one (resynchronised), or from the driver's
    /// (free-running).
    ///
    /// # Errors
    /// If the driver fails.
    pub fn settle(&mut self, index: usize) -> Result<(), GpuError> {
        let pass = &self.on_cpu.passes[index];
        for view in pass.attachments() {
            let id = view.texture;
            match &mut self.from_driver {
                Some(contents) => contents.textures[id.index()].clone_from(&self.actual.textures[id.index()]),
                None => {
                    self.on_gpu.upload(id, self.chain.texture(id))?;
                    self.actual.textures[id.index()].clone_from(&self.chain.textures[id.index()]);
                }
            }
        }
        for stream in &pass.stream_out {
            let id: BufferId = stream.buffer;
            if self.from_driver.is_none() {
                self.on_gpu.upload_buffer(id, self.chain.buffer(id))?;
            }
            let (from, to) = match &mut self.from_driver {
                Some(contents) => (&self.actual, contents),
                None => (&self.chain, &mut self.actual),
            };
            to.buffers[id.index()].clone_from(&from.buffers[id.index()]);
            to.streamed[id.index()] = from.streamed[id.index()];
        }
        Ok(())
    }

    /// Streamed-out buffers of a pass whose lengths differ. The reports of vertices do not show this.
    pub fn streams(&self, index: usize) -> Vec<StreamReport> {
        let pass = &self.on_cpu.passes[index];
        let vertices = |contents: &Contents, id: BufferId| contents.streamed[id.index()].vertices;
        let report = pass.stream_out.iter().map(|stream| StreamReport {
            pass_index: index,
            buffer: self.on_cpu.buffers[stream.buffer.index()].label.clone(),
            expected: vertices(self.expected(), stream.buffer),
            actual: vertices(&self.actual, stream.buffer),
        });
        report.filter(|report| report.expected != report.actual).collect()
    }

    /// Both versions of an attachment.
    pub fn surfaces(&self, view: AttachmentView) -> [&Surface; 2] {
        [self.expected(), &self.actual].map(|contents| surface(contents, view))
    }
}

/// One surface of the contents.
pub(super) fn surface(contents: &Contents, view: AttachmentView) -> &Surface {
    contents.texture(view.texture).surface(view.level, view.layer)
}

/// Textures of the attachments that a pass does not clear.
fn loaded(pass: &Pass) -> impl Iterator<Item = TextureId> {
    let color = pass.color.iter().flatten().filter(|target| matches!(target.load, LoadOp::Load)).map(|target| target.view.texture);
    let depth =
        pass.depth_stencil.iter().filter(|target| matches!(target.depth_load, LoadOp::Load) || matches!(target.stencil_load, LoadOp::Load));
    color.chain(depth.map(|target| target.view.texture))
}
