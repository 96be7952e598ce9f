//! A render pass: attachments, draws, and the order of everything.
//!
//! Chunks of primitives run the geometry phase in parallel, each into its own bins; then tiles run in parallel, each through all chunks in
//! order. When the bins' byte budget is reached the tiles run and the pass goes on with the next chunks: a *wave*. Where chunks and waves are
//! cut depends on the draws alone, never on threads, and a tile sees primitives in submission order either way, so the bytes are the same.

use std::fmt;
use std::ops::Range;

use fearless_simd::Level;
use rayon::prelude::*;
pub use wgpu_types::LoadOp;

use super::assemble::{Assembly, IndexBuffer};
use super::bindings::Bindings;
use super::chunk::{ChunkContext, ChunkOutput, Streamed, process_chunk};
use super::fetch::VertexBuffer;
use super::format::{format_info, quantize_depth};
use super::observer::{Observer, reborrow};
pub use super::pass_check::PassError;
use super::plan::{assembly_of, geometry_weight, plan};
use super::render_pipeline::RenderPipeline;
use super::repeat::repetitions;
use super::shader::{Execution, ShaderWidth};
use super::spare::Spare;
use super::state::{Color, MAX_COLOR_TARGETS, PixelRect, RasterRules, TextureFormat, Viewport};
use super::statistics::{PipelineStatistics, StreamOutStatistics};
use super::texture::{Surface, TILE, TILE_PIXELS};
use super::tile::{DrawState, TileContext, TileCounters, TileScratch, TileTargets, replaced_first, run_tile};

/// Per thread: chunks that are run between two looks at the bins' size.
const CHUNK_GROUP: usize = 4;
/// Per thread: bytes of bins after which the tiles run, whatever the budget. Bins that leave the cache before they are read make
/// small primitives twice as dear.
const WAVE_BYTES: usize = 4 << 20;
/// Draws that one task looks at, where there are many.
pub(super) const DRAWS_PER_TASK: usize = 4096;

/// Where passes run: threads, SIMD level, memory. Results do not depend on any of them.
pub struct Device {
    pool: rayon::ThreadPool,
    execution: Execution,
    bin_budget_bytes: usize,
    /// Buffers of earlier passes.
    chunks: Spare<ChunkOutput>,
    tiles: Spare<TileScratch>,
}

/// What was asked for; the buffers inside help nobody.
impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Device({} threads, {:?})", self.threads(), self.execution)
    }
}

/// How to make a [`Device`].
#[derive(Clone, Copy, Debug)]
pub struct DeviceOptions {
    /// Worker threads; `None` for one per core. Default: `None`.
    pub threads: Option<usize>,
    /// SIMD level; `None` for the machine's best. Default: `None`.
    pub level: Option<Level>,
    /// Lanes per shader call. Default: sixteen.
    pub width: ShaderWidth,
    /// Most bytes of bins before the tiles run. Default: 256 MiB.
    pub bin_budget_bytes: usize,
}

impl Default for DeviceOptions {
    fn default() -> Self {
        Self { threads: None, level: None, width: ShaderWidth::Sixteen, bin_budget_bytes: 256 << 20 }
    }
}

/// The worker threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start {threads} worker threads: {why}")]
pub struct DeviceError {
    /// Threads asked for; 0 means one per core.
    pub threads: usize,
    /// The system's reason.
    pub why: String,
}

impl Device {
    /// Starts the worker threads.
    pub fn new(options: DeviceOptions) -> Result<Self, DeviceError> {
        let threads = options.threads.unwrap_or(0);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| DeviceError { threads, why: error.to_string() })?;
        let level = options.level.unwrap_or_else(Level::new);
        Ok(Self {
            pool,
            execution: Execution { level, width: options.width },
            bin_budget_bytes: options.bin_budget_bytes,
            chunks: Spare::default(),
            tiles: Spare::default(),
        })
    }

    /// How shaders run.
    #[must_use]
    pub fn execution(&self) -> Execution {
        self.execution
    }

    /// Worker threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Bytes that bins may take before a wave is flushed: a few MiB per thread, or less if the budget is less.
    #[must_use]
    pub fn wave_bytes(&self) -> usize {
        self.bin_budget_bytes.min(WAVE_BYTES * self.threads())
    }

    /// Runs other data-parallel work on the device's threads.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }
}

/// One draw of a pass.
#[derive(Clone, Debug)]
pub struct Draw<'a> {
    /// Program and fixed state.
    pub pipeline: &'a RenderPipeline,
    /// What the shaders read.
    pub bindings: Bindings<'a>,
    /// By slot of the pipeline's layouts.
    pub vertex_buffers: &'a [VertexBuffer<'a>],
    /// Index buffer, if indexed.
    pub index: Option<IndexBuffer<'a>>,
    /// Vertices, or places in the index buffer.
    pub elements: Range<u32>,
    /// Added to every index.
    pub base_vertex: i32,
    /// Instances.
    pub instances: Range<u32>,
    /// Where clip space goes.
    pub viewport: Viewport,
    /// Pixels that may change.
    pub scissor: PixelRect,
    /// Stencil reference; the low 8 bits count.
    pub stencil_reference: u32,
    /// Blend constant.
    pub blend_constant: [f32; 4],
    /// Occlusion query that counts this draw's fragments.
    pub query: Option<u32>,
    /// Stream-out target that this draw's primitives are appended to.
    pub stream_out: Option<u32>,
}

impl<'a> Draw<'a> {
    /// A draw of `elements` vertices over the whole of a target.
    #[must_use]
    pub fn new(pipeline: &'a RenderPipeline, bindings: Bindings<'a>, elements: Range<u32>, size: (u32, u32)) -> Self {
        Self {
            pipeline,
            bindings,
            vertex_buffers: &[],
            index: None,
            elements,
            base_vertex: 0,
            instances: 0..1,
            viewport: Viewport::full(size.0, size.1),
            scissor: PixelRect::full(size.0, size.1),
            stencil_reference: 0,
            blend_constant: [0.0; 4],
            query: None,
            stream_out: None,
        }
    }
}

/// A colour attachment.
pub struct ColorAttachment<'a> {
    /// What is drawn to.
    pub surface: &'a mut Surface,
    /// Its format.
    pub format: TextureFormat,
    /// What it holds before the first draw. Integer formats take the red number as an integer.
    pub load: LoadOp<Color>,
}

/// The depth-stencil attachment.
pub struct DepthStencilAttachment<'a> {
    /// What is drawn to.
    pub surface: &'a mut Surface,
    /// Its format.
    pub format: TextureFormat,
    /// Depth before the first draw.
    pub depth_load: LoadOp<f32>,
    /// Stencil before the first draw.
    pub stencil_load: LoadOp<u32>,
}

/// Where stream-out goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamOutTarget {
    /// Per vertex: clip position (4), then the varyings' scalars.
    pub data: Vec<f32>,
    /// Sizes in pixels of the points among the primitives.
    pub point_sizes: Vec<f32>,
    /// Most floats that `data` may have; later primitives are counted but not written.
    pub capacity: usize,
}

/// Attachments, draws and counters of a pass.
#[derive(Default)]
pub struct Pass<'a> {
    /// Name in errors.
    pub label: String,
    /// Colour attachments; `None` for a hole.
    pub color: Vec<Option<ColorAttachment<'a>>>,
    /// Depth-stencil attachment.
    pub depth_stencil: Option<DepthStencilAttachment<'a>>,
    /// In submission order.
    pub draws: Vec<Draw<'a>>,
    /// Occlusion queries.
    pub query_count: usize,
    /// Stream-out targets.
    pub stream_out: Vec<StreamOutTarget>,
}

/// What a pass counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassOutput {
    /// Pipeline statistics of all draws.
    pub statistics: PipelineStatistics,
    /// Exact number of fragments passed, per query.
    pub queries: Vec<u64>,
    /// Per stream-out target.
    pub stream_out: Vec<StreamOutStatistics>,
    /// Times that the tiles ran: the one number here that depends on the device.
    pub waves: u32,
}

/// Runs a pass. Nothing is drawn if it is not valid.
pub fn run_pass(device: &Device, pass: &mut Pass<'_>, observer: Option<&mut dyn Observer>) -> Result<PassOutput, PassError> {
    device.pool.install(|| {
        let size = pass.validate()?;
        Ok(PassRun::new(device, pass, size).run(observer))
    })
}

/// A pass in progress.
struct PassRun<'p, 'a> {
    device: &'p Device,
    pass: &'p mut Pass<'a>,
    target: PixelRect,
    tiles: (usize, usize),
    output: PassOutput,
}

impl<'p, 'a> PassRun<'p, 'a> {
    fn new(device: &'p Device, pass: &'p mut Pass<'a>, size: (u32, u32)) -> Self {
        let tiles = (size.0.div_ceil(TILE as u32) as usize, size.1.div_ceil(TILE as u32) as usize);
        let output = PassOutput {
            queries: vec![0; pass.query_count],
            stream_out: vec![StreamOutStatistics::default(); pass.stream_out.len()],
            ..PassOutput::default()
        };
        Self { device, pass, target: PixelRect::full(size.0, size.1), tiles, output }
    }

    fn run(mut self, mut observer: Option<&mut dyn Observer>) -> PassOutput {
        let draws = || self.pass.draws.par_iter().with_min_len(DRAWS_PER_TASK);
        let assemblies: Vec<Assembly> = draws().map(assembly_of).collect();
        // An observer sees each draw go through all stages.
        let repetitions = match &observer {
            None => repetitions(&self.pass.draws, |draw| u64::from(assemblies[draw].count()) * geometry_weight(&self.pass.draws[draw])),
            Some(_) => vec![0; self.pass.draws.len()],
        };
        let states: Vec<DrawState<'_>> = draws().zip(&repetitions).map(|(draw, &count)| DrawState::of(draw, count)).collect();
        let (parts, chunks) = plan(&self.pass.draws, &assemblies, &repetitions);
        let mut wave: Vec<ChunkOutput> = Vec::new();
        let mut wave_bytes = 0;
        for group in chunks.chunks(CHUNK_GROUP * self.device.threads()) {
            let context = ChunkContext {
                draws: &self.pass.draws,
                assemblies: &assemblies,
                repetitions: &repetitions,
                execution: self.device.execution,
                target: self.target,
                tiles_x: self.tiles.0,
                tile_count: self.tiles.0 * self.tiles.1,
            };
            let first = wave.len();
            match reborrow(&mut observer) {
                None => {
                    let device = self.device;
                    wave.par_extend(group.par_iter().map(|range| {
                        let mut chunk = device.chunks.take();
                        process_chunk(&context, &parts[range.clone()], &mut chunk, None);
                        chunk
                    }));
                }
                Some(observer) => wave.extend(group.iter().map(|range| {
                    let mut chunk = self.device.chunks.take();
                    process_chunk(&context, &parts[range.clone()], &mut chunk, Some(&mut *observer));
                    chunk
                })),
            }
            for chunk in &wave[first..] {
                self.output.statistics.add(&chunk.statistics);
                wave_bytes += chunk.bytes();
            }
            for chunk in &wave[first..] {
                append_stream_out(&self.pass.draws, &mut self.pass.stream_out, &mut self.output.stream_out, chunk);
            }
            if wave_bytes >= self.device.wave_bytes() {
                self.flush(&states, &wave, reborrow(&mut observer));
                self.device.chunks.give_back(wave.drain(..));
                wave_bytes = 0;
            }
        }
        if !wave.is_empty() || self.output.waves == 0 {
            self.flush(&states, &wave, reborrow(&mut observer));
        }
        self.device.chunks.give_back(wave);
        self.output
    }

    /// Runs the tiles over a wave of chunks; the first time, clears them.
    fn flush(&mut self, states: &[DrawState<'_>], wave: &[ChunkOutput], mut observer: Option<&mut dyn Observer>) {
        let clear = self.output.waves == 0;
        self.output.waves += 1;
        let pass = &mut *self.pass;
        let clears = Clears::of(pass);
        let depth_stays = states.iter().any(|s| s.pipeline.rejects_by_depth) && !states.iter().any(|s| s.pipeline.depth.write);
        let context = TileContext { draws: &pass.draws, states, depth_stays, execution: self.device.execution };
        let tiles = split_tiles(&mut pass.color, &mut pass.depth_stencil, self.tiles.0 * self.tiles.1);
        let tiles_x = self.tiles.0;
        let run = |tile: usize, mut targets: TileTargets<'_>, scratch: &mut TileScratch, observer: Option<&mut dyn Observer>| {
            if clear {
                // An observer is told what was there before.
                let replaced = if observer.is_none() { replaced_first(&context, [tile % tiles_x, tile / tiles_x], tile, wave) } else { 0 };
                clears.apply(&mut targets, replaced);
            }
            let origin = [(tile % tiles_x * TILE) as i32, (tile / tiles_x * TILE) as i32];
            run_tile(&context, tile, origin, &mut targets, wave, scratch, observer)
        };
        let counters: Vec<TileCounters> = match reborrow(&mut observer) {
            None => tiles
                .into_par_iter()
                .enumerate()
                // Tiles differ so much that half of a thread's share must not be one task.
                .with_max_len(1)
                .map(|(tile, targets)| {
                    let mut scratch = self.device.tiles.take();
                    let counters = run(tile, targets, &mut scratch, None);
                    self.device.tiles.give_back([scratch]);
                    counters
                })
                .collect(),
            Some(observer) => {
                let mut scratch = TileScratch::default();
                tiles.into_iter().enumerate().map(|(tile, targets)| run(tile, targets, &mut scratch, Some(&mut *observer))).collect()
            }
        };
        for tile in counters {
            self.output.statistics.fragment_shader_invocations += tile.fragments_shaded;
            self.output.statistics.fragments_passed += tile.fragments_passed;
            for (query, count) in tile.queries {
                self.output.queries[query as usize] += count;
            }
        }
    }
}

/// Appends a chunk's streamed primitives, whole ones only, until a target is full.
fn append_stream_out(draws: &[Draw<'_>], targets: &mut [StreamOutTarget], statistics: &mut [StreamOutStatistics], chunk: &ChunkOutput) {
    for Streamed { draw, data, sizes } in &chunk.stream {
        let draw = &draws[*draw as usize];
        let Some(index) = draw.stream_out.map(|t| t as usize) else { continue };
        let floats = draw.pipeline.rasterized.corners() * draw.pipeline.stream_floats();
        let target = &mut targets[index];
        let needed = data.len() / floats;
        let room = target.capacity.saturating_sub(target.data.len()) / floats;
        // Once a primitive did not fit, nothing more is written [D3D11.3 §14.5].
        let full = statistics[index].primitives_written < statistics[index].primitive_storage_needed;
        let written = if full { 0 } else { needed.min(room) };
        target.data.extend_from_slice(&data[..written * floats]);
        target.point_sizes.extend(sizes.iter().take(written));
        statistics[index].primitives_written += written as u64;
        statistics[index].primitive_storage_needed += needed as u64;
    }
}

/// What attachments hold before the first draw.
struct Clears {
    color: Vec<Option<[f32; 4]>>,
    depth: Option<f32>,
    stencil: Option<u8>,
}

impl Clears {
    fn of(pass: &Pass<'_>) -> Self {
        // Clear values round as blending does; a pass that draws nothing has no rules.
        let rules = pass.draws.first().map_or(RasterRules::REFERENCE, |draw| draw.pipeline.rules);
        let f16 = rules.f16_rounding;
        let color = pass.color.iter().map(|attachment| {
            let attachment = attachment.as_ref()?;
            let info = format_info(attachment.format)?;
            match attachment.load {
                LoadOp::Clear(c) => Some(info.clear_value(c, f16)),
                _ => None,
            }
        });
        let depth_stencil = pass.depth_stencil.as_ref();
        let depth = depth_stencil.and_then(|a| match (a.depth_load, format_info(a.format)) {
            (LoadOp::Clear(z), Some(info)) if info.depth => Some(quantize_depth(info.kind, z.clamp(0.0, 1.0))),
            _ => None,
        });
        let stencil = depth_stencil.and_then(|a| match a.stencil_load {
            LoadOp::Clear(s) => Some(s as u8),
            _ => None,
        });
        Self { color: color.collect(), depth, stencil }
    }

    /// Clears a tile but for the colour targets in `replaced`.
    fn apply(&self, targets: &mut TileTargets<'_>, replaced: u8) {
        for (slot, (planes, color)) in targets.color.iter_mut().zip(&self.color).enumerate() {
            if let (Some(planes), Some(color), 0) = (planes, color, replaced >> slot & 1) {
                for (plane, value) in planes.chunks_exact_mut(TILE_PIXELS).zip(color) {
                    plane.fill(*value);
                }
            }
        }
        if let (Some(plane), Some(z)) = (&mut targets.depth, self.depth) {
            plane.fill(z);
        }
        if let (Some(plane), Some(value)) = (&mut targets.stencil, self.stencil) {
            plane.fill(value);
        }
    }
}

/// Cuts the attachments into tiles.
fn split_tiles<'s>(
    color: &'s mut [Option<ColorAttachment<'_>>],
    depth_stencil: &'s mut Option<DepthStencilAttachment<'_>>,
    tile_count: usize,
) -> Vec<TileTargets<'s>> {
    let mut tiles: Vec<TileTargets<'s>> =
        (0..tile_count).map(|_| TileTargets { color: [const { None }; MAX_COLOR_TARGETS], depth: None, stencil: None }).collect();
    for (slot, attachment) in color.iter_mut().enumerate() {
        let Some(attachment) = attachment else { continue };
        let per_tile = attachment.surface.channels * TILE_PIXELS;
        for (tile, planes) in tiles.iter_mut().zip(attachment.surface.planes.chunks_exact_mut(per_tile)) {
            tile.color[slot] = Some(planes);
        }
    }
    if let Some(attachment) = depth_stencil {
        let surface = &mut *attachment.surface;
        for (tile, plane) in tiles.iter_mut().zip(surface.planes.chunks_exact_mut(TILE_PIXELS)) {
            tile.depth = Some(plane);
        }
        for (tile, plane) in tiles.iter_mut().zip(surface.stencil.chunks_exact_mut(TILE_PIXELS)) {
            tile.stencil = Some(plane);
        }
    }
    tiles
}
