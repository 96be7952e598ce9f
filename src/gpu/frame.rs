//! A frame on a device: its resources, and its passes, which are prepared and run.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::GpuError;
use super::device::Gpu;
use super::layout::Used;
use super::pieces::{Part, Pieces};
use super::pipeline::{COUNTER_FORMAT, Compiled, Variant, pulled_layout};
use super::pull::{Pulled, must_be_pulled, pull, same_vertices};
use super::resources::Resources;
use super::stream::Streamed;
use super::twin::VertexSource;
use nephroid_pipeline::frame::{
    AttachmentView, BindEntry, BufferId, Contents, Draw, Frame, FrameError, Pass, PipelineId, TextureId, check_references, cleared_first,
    target_size,
};
use nephroid_pipeline::state::{MAX_COLOR_TARGETS, PrimitiveTopology};
use nephroid_pipeline::{Buffer, Device, Texture, TextureDescriptor};

/// Most draws that are prepared and submitted at once. A pass may have a hundred thousand, whose vertices need not be on the device all together.
pub(super) const DRAWS_PER_BATCH: usize = 4096;

/// Which side shades vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertices {
    /// The driver, wherever it can.
    Shaded,
    /// The software GPU: the driver draws exactly the same clip positions and varyings, so that these cannot be the cause of a difference.
    Pulled,
}

/// A frame's resources on a device.
pub struct GpuFrame<'f> {
    pub(super) gpu: &'f Gpu,
    pub(super) frame: &'f Frame,
    pub(super) resources: Resources,
    pub(super) compiled: BTreeMap<(PipelineId, Variant), Compiled>,
    pub(super) streamed: BTreeMap<PipelineId, Streamed>,
}

/// Prepared draws of a pass. They can run any number of times.
pub struct GpuPass {
    pub(super) index: usize,
    /// Whether these are not the pass's first draws, so that they keep what the earlier ones drew.
    pub(super) continues: bool,
    pub(super) draws: Vec<GpuDraw>,
    pub(super) groups: Vec<wgpu::BindGroup>,
    pub(super) pieces: Vec<wgpu::BindGroup>,
    pub(super) counters: Vec<wgpu::Texture>,
}

/// A prepared draw.
pub(super) struct GpuDraw {
    /// Number of the draw in the pass.
    pub number: usize,
    pub pipeline: (PipelineId, Variant),
    /// Number of the bind group, if the pipeline has one.
    pub group: Option<usize>,
    /// Offset of the dynamic uniform, if the pipeline has one.
    pub offset: Option<u32>,
    pub vertices: Source,
}

/// The vertices of a prepared draw.
pub(super) enum Source {
    /// A range of the draw's own vertices.
    Own(Range<u32>),
    /// Pulled vertices.
    Pulled(Vec<Part>),
}

impl<'f> GpuFrame<'f> {
    /// Creates a frame's textures and buffers, and fills them.
    ///
    /// # Errors
    /// If the frame is not valid or the device cannot hold it.
    pub fn new(gpu: &'f Gpu, frame: &'f Frame) -> Result<Self, GpuError> {
        check_references(frame)?;
        let resources = Resources::new(gpu, frame)?;
        let this = Self { gpu, frame, resources, compiled: BTreeMap::new(), streamed: BTreeMap::new() };
        this.fill()?;
        Ok(this)
    }

    /// Uploads the initial contents of textures. Textures that a pass clears before they are read are left out.
    fn fill(&self) -> Result<(), GpuError> {
        let initial = Contents::initial(self.frame).map_err(FrameError::from)?;
        for (number, (texture, cleared)) in initial.textures.iter().zip(cleared_first(self.frame)).enumerate() {
            if !cleared {
                self.upload(TextureId::at(number as u32), texture)?;
            }
        }
        Ok(())
    }

    /// Replaces the contents of a texture.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn upload(&self, id: TextureId, contents: &Texture) -> Result<(), GpuError> {
        self.gpu.upload(self.resources.texture(id), contents)
    }

    /// Replaces the contents of a buffer.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn upload_buffer(&self, id: BufferId, contents: &Buffer) -> Result<(), GpuError> {
        self.gpu.write_buffer(&self.resources.buffers[id.index()], contents.bytes())
    }

    /// Reads one surface of a texture back into `into`, which must have the same description.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn download(&self, view: AttachmentView, into: &mut Texture) -> Result<(), GpuError> {
        self.gpu.download(self.resources.texture(view.texture), into, view.level, view.layer)
    }

    /// Textures that stages run by the software GPU may read in some draws of a pass.
    pub(super) fn read_by_expanded_stages(&self, pass: usize, draws: Range<usize>, vertices: Vertices) -> BTreeSet<TextureId> {
        let drawn = &self.frame.passes[pass].draws[draws];
        let expanded = drawn.iter().filter(|draw| vertices == Vertices::Pulled || must_be_pulled(self.frame, draw));
        let entries = expanded.flat_map(|draw| &self.frame.bind_groups[draw.bind_group.index()].entries);
        entries.filter_map(|entry| if let BindEntry::Texture(view) = entry { Some(view.texture) } else { None }).collect()
    }

    /// Runs a pass in batches of draws, and waits until it has run. Returns the counts of its queries. `device` runs the stages that the driver lacks,
    /// reading `contents`.
    ///
    /// # Errors
    /// If a program has no WGSL twin, the device lacks a feature, a limit is exceeded, or the driver fails.
    pub fn draw_pass(&mut self, index: usize, vertices: Vertices, device: &Device, contents: &Contents) -> Result<Vec<u64>, GpuError> {
        let (count, queries) = (self.frame.passes[index].draws.len(), self.frame.passes[index].query_count);
        let mut counts = vec![0; queries];
        let mut start = 0;
        loop {
            let end = (start + DRAWS_PER_BATCH).min(count);
            let ready = self.prepare(index, start..end, vertices, device, contents)?;
            self.run([&ready])?;
            for (sum, passed) in counts.iter_mut().zip(self.queries(&ready)?) {
                *sum += passed;
            }
            if end == count {
                return Ok(counts);
            }
            start = end;
        }
    }

    /// Prepares some draws of a pass. A range that does not begin with the first draw keeps what the pass's attachments hold. `device` runs the stages
    /// that the driver lacks, reading `contents`.
    ///
    /// # Errors
    /// If a program has no WGSL twin, the device lacks a feature, or a limit is exceeded.
    pub fn prepare(
        &mut self,
        index: usize,
        draws: Range<usize>,
        vertices: Vertices,
        device: &Device,
        contents: &Contents,
    ) -> Result<GpuPass, GpuError> {
        let pass = &self.frame.passes[index];
        let counters = self.counters(pass)?;
        let mut ready = GpuPass {
            index,
            continues: draws.start > 0,
            draws: Vec::with_capacity(draws.len()),
            groups: Vec::new(),
            pieces: Vec::new(),
            counters,
        };
        let drawn: Vec<usize> = draws.filter(|&n| !self.frame.pipelines[pass.draws[n].pipeline.index()].rasterizer_discard).collect();
        let pulled: Vec<usize> =
            drawn.iter().copied().filter(|&n| vertices == Vertices::Pulled || must_be_pulled(self.frame, &pass.draws[n])).collect();
        let mut pieces = Pieces::new(self.gpu);
        let mut pulled = self.pull_all(pass, &pulled, &mut pieces, device, contents)?;
        // Thousands of draws share a few bind groups.
        let mut groups = BTreeMap::new();
        for number in drawn {
            let draw = &pass.draws[number];
            let (source, corners, parts) = match pulled.remove(&number) {
                Some(of) => (VertexSource::Pulled { point_coord: of.point_coord }, of.corners, Some(of.parts)),
                None => (VertexSource::Shaded, 0, None),
            };
            let variant = Variant { vertices: source, corners, counters: ready.counters.len() as u32, query: draw.query };
            let key = (draw.pipeline, variant);
            if !self.compiled.contains_key(&key) {
                self.compiled.insert(key, Compiled::new(self.gpu, &self.frame.pipelines[draw.pipeline.index()], variant)?);
            }
            let compiled = &self.compiled[&key];
            let group = match (groups.entry((key, draw.bind_group)), &compiled.group) {
                (_, None) => None,
                (Entry::Occupied(known), _) => Some(*known.get()),
                (Entry::Vacant(new), Some(layout)) => {
                    ready.groups.push(self.bind_group(draw, &compiled.bindings, layout, None)?);
                    Some(*new.insert(ready.groups.len() - 1))
                }
            };
            let offset = compiled.bindings.iter().any(Used::is_dynamic).then_some(draw.dynamic_offset);
            let vertices = parts.map_or_else(|| Source::Own(own_vertices(draw, contents)), Source::Pulled);
            ready.draws.push(GpuDraw { number, pipeline: key, group, offset, vertices });
        }
        ready.pieces = pieces.upload(self.gpu, &pulled_layout(&self.gpu.device))?;
        Ok(ready)
    }

    /// Pulls the vertices of some draws of a pass, by the draw's number. A draw that has those of the draw before it shares them.
    fn pull_all(
        &self,
        pass: &Pass,
        numbers: &[usize],
        pieces: &mut Pieces,
        device: &Device,
        contents: &Contents,
    ) -> Result<BTreeMap<usize, PulledDraw>, GpuError> {
        let repeats = |k: &usize| *k > 0 && same_vertices(self.frame, &pass.draws[numbers[k - 1]], &pass.draws[numbers[*k]]);
        let firsts: Vec<usize> = (0..numbers.len()).filter(|k| !repeats(k)).map(|k| numbers[k]).collect();
        let draws: Vec<Draw> = firsts.iter().map(|&number| pass.draws[number].clone()).collect();
        let mut pulled: BTreeMap<usize, PulledDraw> = BTreeMap::new();
        for (&number, of) in firsts.iter().zip(pull(device, self.frame, pass, &draws, contents)?) {
            let Pulled { topology, point_coord, stride, data } = of;
            let corners = corners(topology);
            pulled.insert(number, PulledDraw { point_coord, corners, parts: pieces.add(&data, stride, corners.into()) });
        }
        for &number in numbers {
            if let (false, Some((_, before))) = (pulled.contains_key(&number), pulled.range(..number).next_back()) {
                pulled.insert(number, before.clone());
            }
        }
        Ok(pulled)
    }

    /// Targets that count the pass's queries, four queries per target.
    fn counters(&self, pass: &Pass) -> Result<Vec<wgpu::Texture>, GpuError> {
        let count = pass.query_count.div_ceil(4);
        if count == 0 {
            return Ok(Vec::new());
        }
        let what = format!("pass `{}`: colour targets, one for each four occlusion queries included,", pass.label);
        self.gpu.within(&what, (pass.color.len() + count) as u64, MAX_COLOR_TARGETS as u64)?;
        self.gpu.require(wgpu::Features::FLOAT32_BLENDABLE, &pass.label)?;
        let (width, height) = target_size(self.frame, pass);
        (0..count).map(|k| self.gpu.create_texture(&TextureDescriptor::d2(format!("counter {k}"), width, height, COUNTER_FORMAT))).collect()
    }
}

/// Pulled vertices of a draw, and what its pipeline must know of them.
#[derive(Clone)]
struct PulledDraw {
    point_coord: bool,
    corners: u8,
    parts: Vec<Part>,
}

/// The range of a draw's own vertices, cut to those that were streamed out.
fn own_vertices(draw: &Draw, contents: &Contents) -> Range<u32> {
    let mut vertices = draw.vertices.clone();
    if let Some(buffer) = draw.streamed {
        vertices.end = vertices.end.min(vertices.start.saturating_add(contents.streamed[buffer.index()].vertices));
    }
    vertices
}

fn corners(topology: PrimitiveTopology) -> u8 {
    match topology {
        PrimitiveTopology::PointList => 1,
        PrimitiveTopology::LineList | PrimitiveTopology::LineStrip => 2,
        PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip => 3,
    }
}
