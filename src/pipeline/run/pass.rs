//! Runs a render pass: the order of all work.
//!
//! Chunks of primitives run the geometry phase in parallel, each into its own bins. Then tiles run in parallel, each through all chunks in order.
//! When the bins reach their byte budget, the tiles run and the pass continues with the next chunks: this is a *wave*. Chunks and waves are cut by
//! the draws alone, never by threads, and a tile sees primitives in submission order in any case, so the bytes are the same.

use rayon::prelude::*;

use crate::api::check::pass::PassError;
use crate::api::draw::{DRAWS_PER_TASK, Draw};
use crate::api::observer::{Observer, reborrow};
use crate::api::pass::{ColorAttachment, DepthStencilAttachment, Pass, PassOutput, StreamOutTarget};
use crate::api::state::{MAX_COLOR_TARGETS, PixelRect};
use crate::api::statistics::StreamOutStatistics;
use crate::api::surface::{TILE, TILE_PIXELS};
use crate::geometry::assemble::Assembly;
use crate::geometry::chunk::process_chunk;
use crate::geometry::chunk_output::{ChunkContext, ChunkOutput, Streamed};
use crate::geometry::plan::{assembly_of, geometry_weight, plan};
use crate::geometry::repeat::repetitions;
use crate::run::clear::Clears;
use crate::run::device::Device;
use crate::tile::targets::{DrawState, TileContext, TileCounters, TileTargets};
use crate::tile::walk::{TileScratch, replaced_first, run_tile};

/// Chunks per thread that run before the size of the bins is checked again.
const CHUNK_GROUP: usize = 4;

/// Runs a pass on the device's threads. `observer` sees every stage.
///
/// # Errors
/// If the pass is not valid; nothing has been drawn then.
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
        // An observer sees each draw go through all stages, so no draw is treated as a repetition.
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

    /// Runs the tiles over a wave of chunks. The first wave clears the tiles.
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
                // An observer needs the values from before the draw.
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
                // The cost of tiles differs so much that every tile is a task of its own.
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
        // After the first primitive that does not fit, nothing more is written [D3D11.3 §14.5].
        let full = statistics[index].primitives_written < statistics[index].primitive_storage_needed;
        let written = if full { 0 } else { needed.min(room) };
        target.data.extend_from_slice(&data[..written * floats]);
        target.point_sizes.extend(sizes.iter().take(written));
        statistics[index].primitives_written += written as u64;
        statistics[index].primitive_storage_needed += needed as u64;
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
        let per_tile = attachment.view.surface.channels * TILE_PIXELS;
        for (tile, planes) in tiles.iter_mut().zip(attachment.view.surface.planes.chunks_exact_mut(per_tile)) {
            tile.color[slot] = Some(planes);
        }
    }
    if let Some(attachment) = depth_stencil {
        let surface = &mut *attachment.view.surface;
        for (tile, plane) in tiles.iter_mut().zip(surface.planes.chunks_exact_mut(TILE_PIXELS)) {
            tile.depth = Some(plane);
        }
        for (tile, plane) in tiles.iter_mut().zip(surface.stencil.chunks_exact_mut(TILE_PIXELS)) {
            tile.stencil = Some(plane);
        }
    }
    tiles
}
