//! The cross-check: runs one frame on the software GPU and on a driver, and compares every attachment after every pass.
//!
//! In the *free-running* mode, each side reads its own results of earlier passes, and the driver shades vertices: the whole frame is checked. In the
//! *resynchronised* mode, the driver starts every pass from the software GPU's attachments and draws the software GPU's vertices: a difference is
//! then caused by that pass alone, after its vertex stage. Every attachment has a named [`Bound`]. The first attachment beyond its bound is traced to
//! a draw, a primitive and a pixel ([`locate()`]).

mod bounds;
mod compare;
mod locate;
mod picture;
mod vertices;

use serde::Serialize;

pub use bounds::{Bound, EXACT, PassBounds, bound_of, vertex_bound_of};
pub use compare::{Difference, Pixel, compare, relative, ulps};
pub use locate::{Located, locate};
pub use picture::{plain_tone, side_by_side};
pub use vertices::VertexReport;

use super::{Gpu, GpuError, GpuFrame, Vertices};
use nephroid_pipeline::Device;
use nephroid_pipeline::frame::{AttachmentView, BufferId, Contents, Frame, FrameError, TextureId, pipelines, run_frame_pass, stream_draw};
use nephroid_pipeline::state::TextureFormat;

/// The state from which the driver starts each pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Its own results of earlier passes.
    FreeRunning,
    /// The software GPU's attachments and vertices.
    Resynchronised,
}

/// Comparison of one attachment after one pass.
#[derive(Clone, Debug, Serialize)]
pub struct AttachmentReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Label of the pass.
    pub pass: String,
    /// Label of the texture.
    pub texture: String,
    /// Format of the texture.
    pub format: TextureFormat,
    /// The bound.
    #[serde(with = "bounds::ReportedBound")]
    pub bound: Bound,
    /// The difference between the two versions.
    pub difference: Difference,
    /// Whether the difference is within the bound.
    pub within: bool,
    #[serde(skip)]
    pub(crate) view: AttachmentView,
}

/// An occlusion query whose counts differ; they must be equal.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct QueryReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Number of the query.
    pub query: usize,
    /// Number of fragments that passed on the software GPU.
    pub expected: u64,
    /// Number of fragments that passed on the driver.
    pub actual: u64,
}

/// A stream-out buffer whose numbers of vertices differ.
#[derive(Clone, Debug, Serialize)]
pub struct StreamReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Label of the buffer.
    pub buffer: String,
    /// Vertices written by the software GPU.
    pub expected: u32,
    /// Vertices written by the driver.
    pub actual: u32,
}

/// Results of the cross-check of one frame.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The mode of the cross-check.
    pub mode: Mode,
    /// Attachments by pass, then by number.
    pub attachments: Vec<AttachmentReport>,
    /// In the free-running mode: the vertex stage of every draw whose vertices a driver can stream out.
    pub vertices: Vec<VertexReport>,
    /// Occlusion queries whose counts differ.
    pub queries: Vec<QueryReport>,
    /// Stream-out buffers with different numbers of vertices.
    pub streams: Vec<StreamReport>,
}

impl Report {
    /// Whether all attachments and vertices are within their bounds, and all counts are equal.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.first_failure().is_none() && self.queries.is_empty() && self.streams.is_empty() && self.vertices.iter().all(|v| v.within)
    }

    /// The first attachment beyond its bound.
    #[must_use]
    pub fn first_failure(&self) -> Option<&AttachmentReport> {
        self.attachments.iter().find(|a| !a.within)
    }
}

/// A frame on both sides, run pass by pass.
pub(crate) struct Pair<'a> {
    device: &'a Device,
    mode: Mode,
    on_cpu: &'a Frame,
    pipelines: Vec<nephroid_pipeline::RenderPipeline>,
    on_gpu: GpuFrame<'a>,
    gpu_frame: &'a Frame,
    /// Textures and buffers of the software GPU.
    pub expected: Contents,
    /// Textures and buffers of the driver, as last read back.
    pub actual: Contents,
}

impl<'a> Pair<'a> {
    /// A pair before its first pass: contents are the frames' initial contents.
    ///
    /// # Errors
    /// If the frame is not valid or the device cannot hold it.
    pub fn new(gpu: &'a Gpu, device: &'a Device, on_cpu: &'a Frame, on_gpu: &'a Frame, mode: Mode) -> Result<Self, GpuError> {
        let pipelines = pipelines(on_cpu).map_err(FrameError::from)?;
        let expected = Contents::initial(on_cpu).map_err(FrameError::from)?;
        let actual = Contents::initial(on_gpu).map_err(FrameError::from)?;
        Ok(Self { device, mode, on_cpu, pipelines, on_gpu: GpuFrame::new(gpu, on_gpu)?, gpu_frame: on_gpu, expected, actual })
    }

    /// Runs a pass on both sides and reads the driver's attachments. Returns the queries of the software GPU and of the driver.
    ///
    /// # Errors
    /// If a side cannot run the pass.
    pub fn run(&mut self, index: usize) -> Result<[Vec<u64>; 2], GpuError> {
        let (expected, actual) = (&self.on_cpu.passes[index], &self.gpu_frame.passes[index]);
        let vertices = match self.mode {
            Mode::FreeRunning => Vertices::Shaded,
            Mode::Resynchronised => Vertices::Pulled,
        };
        self.on_gpu.stream_pass(index, vertices, self.device, &mut self.actual)?;
        let contents = if self.mode == Mode::FreeRunning { &self.actual } else { &self.expected };
        let ready = self.on_gpu.prepare(index, 0..actual.draws.len(), vertices, self.device, contents)?;
        self.on_gpu.run([&ready])?;
        let output = run_frame_pass(self.device, self.on_cpu, &self.pipelines, expected, &mut self.expected, None)?;
        for view in actual.attachments() {
            self.on_gpu.download(view, &mut self.actual.textures[view.texture.index()])?;
        }
        Ok([output.queries, self.on_gpu.queries(&ready)?])
    }

    /// Compares the vertex stages of a pass on both sides, before the pass runs. Draws whose vertex stage the driver does not run are left out.
    fn vertices(&mut self, index: usize, bounds: &[PassBounds]) -> Result<Vec<VertexReport>, GpuError> {
        let pass = &self.on_cpu.passes[index];
        let mut reports = Vec::new();
        for (number, draw) in pass.draws.iter().enumerate() {
            let program = &self.on_cpu.pipelines[draw.pipeline.index()].program;
            if self.mode == Mode::Resynchronised || program.geometry.is_some() || !draw.vertex_buffers.is_empty() {
                continue;
            }
            let (_, expected) = stream_draw(self.device, self.on_cpu, pass, draw, &self.expected)?;
            let actual = self.on_gpu.stream_out(index, number, self.device, &self.actual)?;
            let vectors: Vec<usize> = std::iter::once(4).chain(program.varyings.iter().map(|varying| varying.components)).collect();
            reports.push(VertexReport::new(
                (index, &pass.label, number),
                vertex_bound_of(bounds, &pass.label),
                &vectors,
                &expected.data,
                &actual,
            ));
        }
        Ok(reports)
    }

    /// In the resynchronised mode, gives the driver the software GPU's attachments and streamed-out buffers of a pass.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn resynchronise(&mut self, index: usize) -> Result<(), GpuError> {
        if self.mode == Mode::Resynchronised {
            for view in self.on_cpu.passes[index].attachments() {
                self.upload(view.texture)?;
            }
            for stream in &self.on_cpu.passes[index].stream_out {
                self.upload_buffer(stream.buffer)?;
            }
        }
        Ok(())
    }

    fn upload(&mut self, id: TextureId) -> Result<(), GpuError> {
        self.on_gpu.upload(id, self.expected.texture(id))?;
        self.actual.textures[id.index()] = self.expected.texture(id).clone();
        Ok(())
    }

    fn upload_buffer(&mut self, id: BufferId) -> Result<(), GpuError> {
        self.on_gpu.upload_buffer(id, self.expected.buffer(id))?;
        self.actual.buffers[id.index()] = self.expected.buffers[id.index()].clone();
        self.actual.streamed[id.index()] = self.expected.streamed[id.index()];
        Ok(())
    }

    /// Streamed-out buffers of a pass whose lengths differ. The reports of vertices do not show this.
    fn streams(&self, index: usize) -> Vec<StreamReport> {
        let pass = &self.on_cpu.passes[index];
        let vertices = |contents: &Contents, id: BufferId| contents.streamed[id.index()].vertices;
        let report = pass.stream_out.iter().map(|stream| StreamReport {
            pass_index: index,
            buffer: self.on_cpu.buffers[stream.buffer.index()].label.clone(),
            expected: vertices(&self.expected, stream.buffer),
            actual: vertices(&self.actual, stream.buffer),
        });
        report.filter(|report| report.expected != report.actual).collect()
    }

    /// Both versions of an attachment.
    pub fn surfaces(&self, view: AttachmentView) -> [&nephroid_pipeline::Surface; 2] {
        [&self.expected, &self.actual].map(|contents| contents.texture(view.texture).surface(view.level, view.layer))
    }
}

/// Runs a frame on both sides and compares every attachment after every pass. `bounds` are those of the frame's passes. `watch` is called with both
/// versions of each attachment.
///
/// `on_cpu` and `on_gpu` are the same frame, except where a test has planted a difference; their textures and passes correspond.
///
/// # Errors
/// If the frame is not valid, or the driver lacks a feature or fails.
pub fn crosscheck(
    gpu: &Gpu,
    device: &Device,
    on_cpu: &Frame,
    on_gpu: &Frame,
    mode: Mode,
    bounds: &[PassBounds],
    mut watch: impl FnMut(&AttachmentReport, [&nephroid_pipeline::Surface; 2]),
) -> Result<Report, GpuError> {
    let mut pair = Pair::new(gpu, device, on_cpu, on_gpu, mode)?;
    let mut report = Report { mode, attachments: Vec::new(), vertices: Vec::new(), queries: Vec::new(), streams: Vec::new() };
    for (index, pass) in on_cpu.passes.iter().enumerate() {
        report.vertices.extend(pair.vertices(index, bounds)?);
        let [expected, actual] = pair.run(index)?;
        let queries = expected.into_iter().zip(actual).enumerate().filter(|(_, (e, a))| e != a);
        report.queries.extend(queries.map(|(query, (expected, actual))| QueryReport { pass_index: index, query, expected, actual }));
        report.streams.extend(pair.streams(index));
        for view in pass.attachments() {
            let number = view.texture.index();
            let desc = &on_cpu.textures[number].desc;
            let info = pair.expected.textures[number].info();
            let bound = bound_of(bounds, gpu.adapter().family(), mode, &pass.label, &desc.label, info);
            let surfaces = pair.surfaces(view);
            let difference = compare(info, surfaces[0], surfaces[1], bound.tolerance);
            let within = bound.holds(difference.pixels, difference.outliers, difference.unexplained());
            let attachment = AttachmentReport {
                pass_index: index,
                pass: pass.label.clone(),
                texture: desc.label.clone(),
                format: desc.format,
                bound,
                difference,
                within,
                view,
            };
            watch(&attachment, surfaces);
            report.attachments.push(attachment);
        }
        pair.resynchronise(index)?;
    }
    Ok(report)
}
