//! The tile phase: one tile walks all chunks in order. Its part of every attachment is a plain slice.
//!
//! The general path tests depth and stencil block by block, queues the blocks that pass, shades the queue in one call and blends it in order. Draws
//! that only count, fill depth or add a constant colour skip the queue (`fast_path.rs`).

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use nephroid_math::level::{baseline, wide_dispatch};

use crate::api::observer::{Observer, reborrow};
use crate::api::resolved::FastPath;
use crate::api::surface::TILE;
use crate::geometry::chunk_output::ChunkOutput;
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::tile::coarse_depth::CoarseDepth;
use crate::tile::fast_path;
use crate::tile::queue::Queue;
use crate::tile::targets::{TileContext, TileCounters, TileTargets};
use crate::tile::worker::TileWorker;

impl<'a> TileWorker<'a, '_> {
    /// Draws primitives in order.
    #[simd]
    #[inline(never)]
    fn primitives<S: Simd>(&mut self, simd: S, primitives: &[TilePrimitive]) {
        for run in primitives.chunk_by(|a, b| a.draw == b.draw) {
            let number = run[0].draw;
            if number != self.draw {
                self.end_draw(simd);
                self.draw = number;
            }
            if self.context.states[number as usize].repetitions > 0 {
                self.repeated.extend_from_slice(run);
            }
            self.run(simd, run);
        }
    }

    /// Finishes the current draw and those that repeat it.
    #[inline(always)]
    fn end_draw<S: Simd>(&mut self, simd: S) {
        self.flush(simd);
        if self.repeated.is_empty() {
            return;
        }
        let primitives = std::mem::take(self.repeated);
        for _ in 0..self.context.states[self.draw as usize].repetitions {
            self.draw += 1;
            self.run(simd, &primitives);
            self.flush(simd);
        }
        *self.repeated = primitives;
        self.repeated.clear();
    }

    /// Draws primitives with the state of the current draw.
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, primitives: &[TilePrimitive]) {
        let (draw, state) = (&self.context.draws[self.draw as usize], &self.context.states[self.draw as usize]);
        let path = if self.observer.is_none() { state.path } else { FastPath::General };
        let source = self.source();
        let coarse = self.coarse.filter(|_| state.pipeline.rejects_by_depth && self.observer.is_none());
        let shading = (self.context.execution, &mut self.scratch.colors);
        if !fast_path::run(simd, path, primitives, (draw, state), source, coarse, self.origin, self.targets, self.counters, shading) {
            self.general(simd, primitives, coarse);
        }
    }
}

/// Scratch buffers of a worker.
#[derive(Default)]
pub(crate) struct TileScratch {
    queue: Queue,
    coarse: CoarseDepth,
    /// Primitives of the current draw, if it is repeated.
    repeated: Vec<TilePrimitive>,
}

/// Colour targets that the first primitive of a tile overwrites wholly, bit = target: their old values are never read.
pub(crate) fn replaced_first(context: &TileContext<'_>, [x, y]: [usize; 2], tile: usize, chunks: &[ChunkOutput]) -> u8 {
    let Some(chunk) = chunks.iter().find(|chunk| !chunk.bins.is_untouched(tile)) else { return 0 };
    let wide = chunk.bins.wide.iter().find_map(|w| w.in_tile([x as i32, y as i32]));
    let small = chunk.bins.segments(tile).next().and_then(|primitives| primitives.first().copied());
    let first = [wide, small].into_iter().flatten().min_by_key(|primitive| primitive.sequence);
    let last = TILE as u8 - 1;
    match first {
        Some(primitive) if primitive.flags & flag::ACCEPT == flag::ACCEPT && primitive.bounds == [0, 0, last, last] => {
            context.draws[primitive.draw as usize].pipeline.replaces
        }
        _ => 0,
    }
}

/// Runs the chunks of a wave on the tile whose first pixel is `origin`.
pub(crate) fn run_tile(
    context: &TileContext<'_>,
    tile: usize,
    origin: [i32; 2],
    targets: &mut TileTargets<'_>,
    chunks: &[ChunkOutput],
    scratch: &mut TileScratch,
    mut observer: Option<&mut dyn Observer>,
) -> TileCounters {
    let mut counters = TileCounters::default();
    let level = context.execution.level;
    let observer = reborrow(&mut observer);
    wide_dispatch!(
        level,
        simd => tile_chunks(simd, context, tile, origin, targets, chunks, scratch, &mut counters, observer),
        tile_chunks(baseline(), context, tile, origin, targets, chunks, scratch, &mut counters, observer)
    );
    counters
}

#[allow(clippy::too_many_arguments, reason = "the SIMD attribute wants a free function; the caller has eight arguments less the token")]
#[simd]
fn tile_chunks<'a, S: Simd>(
    simd: S,
    context: &'a TileContext<'a>,
    tile: usize,
    origin: [i32; 2],
    targets: &'a mut TileTargets<'_>,
    chunks: &'a [ChunkOutput],
    scratch: &'a mut TileScratch,
    counters: &'a mut TileCounters,
    observer: Option<&'a mut dyn Observer>,
) {
    let tile_coordinates = [origin[0] >> 6, origin[1] >> 6];
    let TileScratch { queue, coarse, repeated } = scratch;
    let touched = chunks.iter().any(|chunk| !chunk.bins.is_untouched(tile));
    let coarse = match &targets.depth {
        Some(plane) if touched && context.depth_stays => {
            coarse.read(plane);
            Some(&*coarse)
        }
        _ => None,
    };
    let mut worker = TileWorker {
        context,
        origin,
        targets,
        coarse,
        scratch: queue,
        repeated,
        counters,
        observer,
        chunk: None,
        stencil_before: [0; 16],
        draw: u32::MAX,
        merges: false,
    };
    for chunk in chunks {
        if chunk.bins.is_untouched(tile) {
            continue;
        }
        worker.chunk = Some(chunk);
        worker.draw = u32::MAX;
        let mut wide = chunk.bins.wide.iter().filter_map(|w| w.in_tile(tile_coordinates)).peekable();
        for segment in chunk.bins.segments(tile) {
            let mut rest = segment;
            // Primitives over many tiles are merged in here, in submission order.
            while let (Some(w), Some(last)) = (wide.peek(), rest.last())
                && w.sequence < last.sequence
            {
                let (before, after) = rest.split_at(rest.partition_point(|r| r.sequence < w.sequence));
                worker.primitives(simd, before);
                worker.primitives(simd, std::slice::from_ref(w));
                wide.next();
                rest = after;
            }
            worker.primitives(simd, rest);
        }
        for w in wide {
            worker.primitives(simd, std::slice::from_ref(&w));
        }
        worker.end_draw(simd);
    }
}
