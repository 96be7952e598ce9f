//! The tile phase: one tile walks all chunks in order, with its part of every attachment as plain slices.
//!
//! The general path tests depth and stencil block by block, queues the survivors, shades the queue in one call and
//! blends it in order. Draws that only count, fill depth or add a constant colour skip the queue (`fast_path.rs`).

use fearless_simd::{Simd, SimdMask, f32x16, mask32x16};
use fearless_simd_macros::simd;

use nephroid_math::lanes::Lanes;
use nephroid_math::level::{baseline, wide_dispatch};

use super::bins::{Record, flag};
use super::block_depth::{BlockDepth, clamp_depth, quantized};
use super::chunk::ChunkOutput;
use super::coarse_depth::CoarseDepth;
use super::coarse_stencil::CoarseStencil;
use super::depth_stencil::{StencilFace, compare_lanes};
use super::fast_path::FastPath;
use super::format::{ChannelKind, depth_value, quantize_depth_by};
use super::observer::{FragmentEvent, FragmentOutcome, Observer, reborrow};
use super::pass::Draw;
use super::raster::{BlockSink, walk};
use super::render_pipeline::RenderPipeline;
use super::shader::{Execution, PrimitiveAttributes, ShadeBatch, ShadeItem, ShadeSource};
use super::state::{MAX_COLOR_TARGETS, StencilFaceState};
use super::texture::{TILE, TILE_PIXELS, offset_in_tile};

/// Blocks that are shaded in one call.
const QUEUE: usize = 64;

/// A tile's part of the attachments.
pub(super) struct TileTargets<'a> {
    /// `[channel][4096]` per target.
    pub color: [Option<&'a mut [f32]>; MAX_COLOR_TARGETS],
    pub depth: Option<&'a mut [f32]>,
    pub stencil: Option<&'a mut [u8]>,
}

/// What a tile counted.
#[derive(Clone, Debug, Default)]
pub(super) struct TileCounters {
    pub fragments_shaded: u64,
    pub fragments_passed: u64,
    /// Fragments passed: a query and a count to add to it.
    pub queries: Vec<(u32, u64)>,
}

/// What the tile phase needs to know of the pass.
pub(super) struct TileContext<'a> {
    pub draws: &'a [Draw<'a>],
    /// By draw.
    pub states: &'a [DrawState<'a>],
    /// Depth is tested, as 32-bit float, and no draw writes it: a [`CoarseDepth`] stays true.
    pub depth_stays: bool,
    pub execution: Execution,
}

/// What most records ask of their draw. A pass may have a hundred thousand draws of a few records per tile: then this is all that is read of each.
#[derive(Clone, Copy)]
pub(super) struct DrawState<'a> {
    pub pipeline: &'a RenderPipeline,
    /// The pipeline's, unless a query must count.
    path: FastPath,
    stencil_reference: u8,
    /// How many of the draws that follow have the same records.
    repetitions: u32,
}

impl<'a> DrawState<'a> {
    pub fn of(draw: &Draw<'a>, repetitions: u32) -> Self {
        let path = if draw.query.is_none() { draw.pipeline.fast_path } else { FastPath::General };
        Self { pipeline: draw.pipeline, path, stencil_reference: draw.stencil_reference as u8, repetitions }
    }

    /// The stencil state for one facing.
    #[inline(always)]
    pub fn stencil_face(&self, state: StencilFaceState) -> StencilFace {
        let plan = &self.pipeline.depth;
        StencilFace { state, reference: self.stencil_reference, read_mask: plan.read_mask, write_mask: plan.write_mask }
    }
}

/// A worker's buffers.
#[derive(Default)]
pub(super) struct TileScratch {
    queue: Queue,
    coarse: CoarseDepth,
    /// Records of the draw at work, if it is repeated.
    repeated: Vec<Record>,
}

/// Blocks that passed the early tests and await shading.
struct Queue {
    len: usize,
    items: [ShadeItem; QUEUE],
    /// Depth as shaders see it, before it is clamped and rounded to what the target stores.
    z: Box<[[f32; 16]; QUEUE]>,
    /// Whether the item faces away.
    facing: [bool; QUEUE],
    keep: [u16; QUEUE],
    colors: Vec<f32>,
    /// By block of the tile: the place where it was queued last.
    latest: [u8; TILE_PIXELS / 16],
}

impl Default for Queue {
    fn default() -> Self {
        Self {
            len: 0,
            items: [ShadeItem::default(); QUEUE],
            z: Box::new([[0.0; 16]; QUEUE]),
            facing: [false; QUEUE],
            keep: [0; QUEUE],
            colors: vec![0.0; QUEUE * 64],
            latest: [0; TILE_PIXELS / 16],
        }
    }
}

/// Colour targets that the first primitive of a tile replaces all over, bit = target: what they held before is never seen.
pub(super) fn replaced_first(context: &TileContext<'_>, [x, y]: [usize; 2], tile: usize, chunks: &[ChunkOutput]) -> u8 {
    let Some(chunk) = chunks.iter().find(|chunk| !chunk.bins.is_untouched(tile)) else { return 0 };
    let wide = chunk.bins.wide.iter().find_map(|w| w.record_in([x as i32, y as i32]));
    let small = chunk.bins.segments(tile).next().and_then(|records| records.first().copied());
    let first = [wide, small].into_iter().flatten().min_by_key(|record| record.sequence);
    let last = TILE as u8 - 1;
    match first {
        Some(record) if record.flags & flag::ACCEPT == flag::ACCEPT && record.bounds == [0, 0, last, last] => {
            context.draws[record.draw as usize].pipeline.replaces
        }
        _ => 0,
    }
}

/// Runs the chunks of a wave through one tile whose first pixel is `origin`.
pub(super) fn run_tile(
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
        joins: false,
    };
    for chunk in chunks {
        if chunk.bins.is_untouched(tile) {
            continue;
        }
        worker.chunk = Some(chunk);
        worker.draw = u32::MAX;
        let mut wide = chunk.bins.wide.iter().filter_map(|w| w.record_in(tile_coordinates)).peekable();
        for segment in chunk.bins.segments(tile) {
            let mut rest = segment;
            // Primitives over many tiles come in between, in the order of submission.
            while let (Some(w), Some(last)) = (wide.peek(), rest.last())
                && w.sequence < last.sequence
            {
                let (before, after) = rest.split_at(rest.partition_point(|r| r.sequence < w.sequence));
                worker.records(simd, before);
                worker.records(simd, std::slice::from_ref(w));
                wide.next();
                rest = after;
            }
            worker.records(simd, rest);
        }
        for w in wide {
            worker.records(simd, std::slice::from_ref(&w));
        }
        worker.end_draw(simd);
    }
}

/// One tile at work.
pub(super) struct TileWorker<'a, 'b> {
    context: &'a TileContext<'a>,
    /// First pixel of the tile.
    pub origin: [i32; 2],
    pub targets: &'a mut TileTargets<'b>,
    /// The tile's depth, where it stays as it is.
    coarse: Option<&'a CoarseDepth>,
    scratch: &'a mut Queue,
    repeated: &'a mut Vec<Record>,
    pub counters: &'a mut TileCounters,
    observer: Option<&'a mut dyn Observer>,
    chunk: Option<&'a ChunkOutput>,
    /// Stencil of the block at work before its tests, for the observer.
    stencil_before: [u8; 16],
    /// Draw of the last record.
    draw: u32,
    /// Whether its blocks may join those of the queue.
    joins: bool,
}

impl<'a> TileWorker<'a, '_> {
    /// Draws records in order.
    #[simd]
    #[inline(never)]
    fn records<S: Simd>(&mut self, simd: S, records: &[Record]) {
        for run in records.chunk_by(|a, b| a.draw == b.draw) {
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

    /// Finishes the draw at work and those that repeat it.
    #[inline(always)]
    fn end_draw<S: Simd>(&mut self, simd: S) {
        self.flush(simd);
        if self.repeated.is_empty() {
            return;
        }
        let records = std::mem::take(self.repeated);
        for _ in 0..self.context.states[self.draw as usize].repetitions {
            self.draw += 1;
            self.run(simd, &records);
            self.flush(simd);
        }
        *self.repeated = records;
        self.repeated.clear();
    }

    /// Draws records as the draw at work does.
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, records: &[Record]) {
        let (draw, state) = (&self.context.draws[self.draw as usize], &self.context.states[self.draw as usize]);
        let path = if self.observer.is_none() { state.path } else { FastPath::General };
        let source = self.source();
        let coarse = self.coarse.filter(|_| state.pipeline.rejects_by_depth && self.observer.is_none());
        if !super::fast_path::run(simd, path, records, (draw, state), source, coarse, self.origin, self.targets, self.counters) {
            self.general(simd, records, coarse);
        }
    }

    fn source(&self) -> ShadeSource<'a> {
        let (primitives, varyings): (&'a [_], &'a [_]) = match self.chunk {
            Some(chunk) => (&chunk.attributes, &chunk.varyings),
            None => (&[], &[]),
        };
        let interpolation: &'a [_] = match self.context.states.get(self.draw as usize) {
            Some(state) => &state.pipeline.interpolation,
            None => &[],
        };
        ShadeSource { primitives, varyings, interpolation }
    }

    /// Walks records of one draw through the tests and the queue.
    #[simd]
    #[inline(never)]
    fn general<S: Simd>(&mut self, simd: S, records: &[Record], coarse: Option<&'a CoarseDepth>) {
        let draw = &self.context.draws[self.draw as usize];
        self.joins = draw.pipeline.fragment.joins && self.observer.is_none();
        let early_depth_only = draw.pipeline.rejects_by_depth && !draw.pipeline.depth.stencil && self.observer.is_none();
        if early_depth_only {
            for record in records {
                let depth = BlockDepth::new(simd, record, self.origin, draw, draw.pipeline, coarse);
                walk(simd, record, &mut QueueSink { draw, depth, worker: self });
            }
            return;
        }
        let plan = &draw.pipeline.depth;
        let rejects = plan.stencil_rejects() && !draw.pipeline.fragment.late_tests && self.observer.is_none();
        let state = &self.context.states[self.draw as usize];
        let faces = [plan.stencil_front, plan.stencil_back].map(|face| state.stencil_face(face));
        let passing = match self.targets.stencil.as_deref().filter(|_| rejects) {
            Some(stencil) => CoarseStencil::read(simd, stencil, &faces, records),
            None => CoarseStencil::ALL,
        };
        for record in records {
            if !passing.meets(record) {
                continue;
            }
            let stencil = rejects.then(|| faces[usize::from(record.flags & flag::BACK != 0)]);
            let depth = BlockDepth::new(simd, record, self.origin, draw, draw.pipeline, coarse);
            walk(simd, record, &mut GeneralSink { draw, depth, stencil, passing: &passing, worker: self });
        }
    }

    /// Queues a block, whose depth before the clamp is `z`; it may join one that is there already.
    #[inline(always)]
    fn push<S: Simd>(&mut self, simd: S, record: &Record, bx: i32, by: i32, mask: u16, z: f32x16<S>) {
        let queue = &mut *self.scratch;
        let (x, y) = ((self.origin[0] + bx) as u32, (self.origin[1] + by) as u32);
        let back = record.flags & flag::BACK != 0;
        if self.joins {
            let latest = &mut queue.latest[offset_in_tile(bx as usize, by as usize) / 16];
            let slot = usize::from(*latest);
            // Of an earlier queue only the place may be left: it is the block's if its pixels are.
            if slot < queue.len
                && (queue.items[slot].x, queue.items[slot].y, queue.facing[slot]) == (x, y, back)
                && queue.items[slot].join(record.attributes, mask)
            {
                let joined = mask32x16::from_bitmask(simd, u64::from(mask));
                let before = <f32x16<S> as Lanes>::load(simd, &queue.z[slot]);
                Lanes::store(<f32x16<S> as Lanes>::select(joined, z, before), &mut queue.z[slot]);
                return;
            }
            *latest = queue.len as u8;
        }
        let slot = queue.len;
        Lanes::store(z, &mut queue.z[slot]);
        queue.items[slot] = ShadeItem::new(x, y, record.attributes, mask);
        queue.facing[slot] = back;
        queue.len = slot + 1;
        if slot + 1 == QUEUE {
            self.flush_queue(simd);
        }
    }

    /// Shades and blends what is queued.
    #[inline(always)]
    fn flush<S: Simd>(&mut self, simd: S) {
        if self.scratch.len > 0 {
            self.flush_queue(simd);
        }
    }

    #[simd]
    #[inline(never)]
    fn flush_queue<S: Simd>(&mut self, simd: S) {
        let draw = &self.context.draws[self.draw as usize];
        let pipeline = draw.pipeline;
        let count = self.scratch.len;
        let outputs = pipeline.fragment.outputs;
        let source = match self.chunk {
            Some(chunk) => ShadeSource { primitives: &chunk.attributes, varyings: &chunk.varyings, interpolation: &pipeline.interpolation },
            None => return,
        };
        let needed = QUEUE * outputs.max(1) * 64;
        if self.scratch.colors.len() < needed {
            self.scratch.colors.resize(needed, 0.0);
        }
        if let Some(fragment) = &pipeline.desc.program.fragment
            && pipeline.fragment.shades
        {
            if pipeline.fragment.per_primitive {
                for (i, item) in self.scratch.items[..count].iter().enumerate() {
                    let colors = if pipeline.fragment.attributes {
                        fragment.primitive_color(&draw.bindings, &source, item.primitive)
                    } else {
                        let stand_in = [PrimitiveAttributes::facing_only(!self.scratch.facing[i])];
                        fragment.primitive_color(&draw.bindings, &ShadeSource { primitives: &stand_in, ..source }, 0)
                    };
                    for (target, color) in colors.iter().enumerate().take(outputs) {
                        for (component, value) in color.iter().enumerate() {
                            self.scratch.colors[((i * outputs + target) * 4 + component) * 16..][..16].fill(*value);
                        }
                    }
                    self.scratch.keep[i] = u16::MAX;
                }
            } else {
                let mut batch = ShadeBatch {
                    source,
                    items: &self.scratch.items[..count],
                    z: &mut self.scratch.z[..count],
                    colors: &mut self.scratch.colors,
                    targets: outputs,
                    keep: &mut self.scratch.keep,
                    may_discard: pipeline.desc.program.may_discard,
                    writes_depth: pipeline.desc.program.writes_depth,
                };
                fragment.run(self.context.execution, &draw.bindings, &mut batch);
            }
            self.counters.fragments_shaded += self.scratch.items[..count].iter().map(|i| u64::from(i.mask.count_ones())).sum::<u64>();
        }
        for i in 0..count {
            self.finish_block(simd, draw, i);
        }
        self.scratch.len = 0;
    }

    /// Late tests, counters and blending of one shaded block.
    #[inline(always)]
    fn finish_block<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, i: usize) {
        let pipeline = draw.pipeline;
        let item = self.scratch.items[i];
        let (bx, by) = (item.x as i32 - self.origin[0], item.y as i32 - self.origin[1]);
        let offset = offset_in_tile(bx as usize, by as usize);
        let mut mask = u32::from(item.mask);
        if pipeline.fragment.shades {
            let kept = mask & u32::from(self.scratch.keep[i]);
            self.report(draw, item, i, mask & !kept, FragmentOutcome::Discarded, None);
            mask = kept;
        }
        if pipeline.fragment.late_tests {
            let z = clamp_depth(<f32x16<S> as Lanes>::load(simd, &self.scratch.z[i]), draw);
            mask = self.test_block(simd, draw, item, i, quantized(z, pipeline), self.scratch.facing[i], mask);
        }
        let passed = u64::from(mask.count_ones());
        self.counters.fragments_passed += passed;
        if let Some(query) = draw.query {
            match self.counters.queries.last_mut() {
                Some((last, count)) if *last == query => *count += passed,
                _ => self.counters.queries.push((query, passed)),
            }
        }
        if mask == 0 {
            return;
        }
        let before = self.observer.is_some().then(|| self.color_block(pipeline, offset));
        let outputs = pipeline.fragment.outputs;
        for (target, plan) in pipeline.targets.iter().enumerate() {
            let (Some(plan), Some(planes)) = (plan, self.targets.color[target].as_deref_mut()) else { continue };
            let source = &self.scratch.colors[(i * outputs + target) * 64..][..64];
            let second = if outputs > pipeline.targets.len() { &self.scratch.colors[(i * outputs + 1) * 64..][..64] } else { source };
            plan.store(simd, planes, offset, mask, source, second, draw.blend_constant);
        }
        self.report(draw, item, i, mask, FragmentOutcome::Passed, before.as_deref());
    }

    /// Depth and stencil tests of the pixels in `mask`; returns those that pass. Depth `z` is as the target stores it.
    #[inline(always)]
    #[allow(
        clippy::too_many_arguments,
        reason = "a block is its item, queue place, depth, facing and mask; a struct would only rename them"
    )]
    fn test_block<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, item: ShadeItem, i: usize, z: f32x16<S>, back: bool, mask: u32) -> u32 {
        let plan = &draw.pipeline.depth;
        let (bx, by) = (item.x as i32 - self.origin[0], item.y as i32 - self.origin[1]);
        let offset = offset_in_tile(bx as usize, by as usize);
        let face = if back { plan.stencil_back } else { plan.stencil_front };
        let face = self.context.states[self.draw as usize].stencil_face(face);
        let mut stencil_pass = mask;
        if plan.stencil
            && let Some(stencil) = self.targets.stencil.as_deref_mut()
        {
            stencil_pass = face.test(simd, &stencil[offset..], mask);
            face.apply(simd, face.state.fail_op, &mut stencil[offset..], mask & !stencil_pass);
        }
        let mut pass = stencil_pass;
        if plan.tests_depth()
            && let Some(depth) = self.targets.depth.as_deref_mut()
        {
            let stored = <f32x16<S> as Lanes>::load(simd, &depth[offset..]);
            pass &= compare_lanes(plan.compare, z, stored).to_bitmask() as u32;
            if plan.write {
                let written = <f32x16<S> as Lanes>::select(mask32x16::from_bitmask(simd, u64::from(pass)), z, stored);
                Lanes::store(written, &mut depth[offset..]);
            }
        }
        if plan.stencil
            && let Some(stencil) = self.targets.stencil.as_deref_mut()
        {
            face.apply(simd, face.state.depth_fail_op, &mut stencil[offset..], stencil_pass & !pass);
            face.apply(simd, face.state.pass_op, &mut stencil[offset..], pass);
        }
        self.report(draw, item, i, mask & !stencil_pass, FragmentOutcome::StencilFailed, None);
        self.report(draw, item, i, stencil_pass & !pass, FragmentOutcome::DepthFailed, None);
        pass
    }

    fn stencil_block(&self, offset: usize) -> [u8; 16] {
        let mut block = [0; 16];
        if let Some(stencil) = self.targets.stencil.as_deref() {
            block.copy_from_slice(&stencil[offset..offset + 16]);
        }
        block
    }

    /// Target 0 of a block, `[component][16]`.
    fn color_block(&self, pipeline: &RenderPipeline, offset: usize) -> Vec<f32> {
        let mut block = vec![0.0; 64];
        if let (Some(Some(plan)), Some(planes)) = (pipeline.targets.first(), self.targets.color[0].as_deref()) {
            for c in 0..plan.channels {
                block[c * 16..c * 16 + 16].copy_from_slice(&planes[c * TILE_PIXELS + offset..][..16]);
            }
        }
        block
    }

    /// Tells the observer, if there is one, what became of the pixels in `mask`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "an event has this many parts")]
    fn report(&mut self, draw: &Draw<'_>, item: ShadeItem, i: usize, mask: u32, outcome: FragmentOutcome, color_before: Option<&[f32]>) {
        if self.observer.is_some() && mask != 0 {
            self.report_fragments(draw, item, i, mask, outcome, color_before);
        }
    }

    #[cold]
    #[allow(clippy::too_many_arguments, reason = "an event has this many parts")]
    fn report_fragments(
        &mut self,
        draw: &Draw<'_>,
        item: ShadeItem,
        i: usize,
        mask: u32,
        outcome: FragmentOutcome,
        color_before: Option<&[f32]>,
    ) {
        let pipeline = draw.pipeline;
        let offset = offset_in_tile((item.x as i32 - self.origin[0]) as usize, (item.y as i32 - self.origin[1]) as usize);
        let after = self.color_block(pipeline, offset);
        let stencil_after = self.stencil_block(offset);
        let outputs = pipeline.fragment.outputs;
        let shaded = outcome == FragmentOutcome::Passed && outputs > 0;
        let kind = pipeline.depth.kind.unwrap_or(ChannelKind::Float32);
        let z = self.scratch.z[i];
        let attributes = self.chunk.and_then(|c| c.attributes.get(item.primitive as usize));
        let primitive_id = attributes.filter(|_| pipeline.fragment.attributes).map_or(0, |a| a.primitive_id);
        for lane in (0..16usize).filter(|lane| mask >> lane & 1 == 1) {
            let four = |block: &[f32]| [0, 1, 2, 3].map(|c: usize| block[c * 16 + lane]);
            let event = FragmentEvent {
                draw: self.draw,
                primitive_id,
                x: item.x + (lane as u32 & 3),
                y: item.y + (lane as u32 >> 2),
                depth: depth_value(kind, quantize_depth_by(pipeline.rules.unorm_depth, kind, clamp_depth(z[lane], draw))),
                outcome,
                stencil_before: self.stencil_before[lane],
                stencil_after: stencil_after[lane],
                shader_color: if shaded { four(&self.scratch.colors[i * outputs * 64..][..64]) } else { [0.0; 4] },
                color_before: four(color_before.unwrap_or(&after)),
                color_after: four(&after),
            };
            if let Some(observer) = self.observer.as_deref_mut() {
                observer.fragment(event);
            }
        }
    }
}

/// Tests depth alone and queues what passes: what most draws that shade need.
struct QueueSink<'w, 'a, 'b, S: Simd> {
    worker: &'w mut TileWorker<'a, 'b>,
    draw: &'a Draw<'a>,
    depth: BlockDepth<'a, S>,
}

impl<S: Simd> BlockSink<S> for QueueSink<'_, '_, '_, S> {
    #[inline(always)]
    fn depth(&self) -> Option<&BlockDepth<'_, S>> {
        Some(&self.depth)
    }

    #[inline(always)]
    fn block(&mut self, simd: S, record: &Record, bx: i32, by: i32, mask: mask32x16<S>) {
        let worker = &mut *self.worker;
        let plan = &self.draw.pipeline.depth;
        let z = self.depth.interpolated(bx, by);
        let tested = self.depth.clamped(z);
        let offset = offset_in_tile(bx as usize, by as usize);
        let mut pass = mask;
        if let Some(depth) = worker.targets.depth.as_deref_mut() {
            let stored = <f32x16<S> as Lanes>::load(simd, &depth[offset..]);
            pass &= compare_lanes(plan.compare, tested, stored);
            if plan.write {
                Lanes::store(<f32x16<S> as Lanes>::select(pass, tested, stored), &mut depth[offset..]);
            }
        }
        let pass = pass.to_bitmask() as u16;
        if pass != 0 {
            worker.push(simd, record, bx, by, pass, z);
        }
    }
}

/// Tests blocks and queues them.
struct GeneralSink<'w, 'a, 'b, S: Simd> {
    worker: &'w mut TileWorker<'a, 'b>,
    draw: &'a Draw<'a>,
    depth: BlockDepth<'a, S>,
    /// A stencil test that may be made before anything else.
    stencil: Option<StencilFace>,
    /// Where it can pass.
    passing: &'w CoarseStencil,
}

impl<S: Simd> BlockSink<S> for GeneralSink<'_, '_, '_, S> {
    #[inline(always)]
    fn depth(&self) -> Option<&BlockDepth<'_, S>> {
        Some(&self.depth)
    }

    #[inline(always)]
    fn visible_blocks(&self, simd: S, rx: i32, ry: i32) -> u32 {
        match self.passing.blocks(rx, ry) {
            0 => 0,
            passing => passing & self.depth.visible_blocks(simd, rx, ry),
        }
    }

    #[inline(always)]
    fn visible_regions(&self, simd: S) -> u32 {
        self.passing.regions() & self.depth.visible_regions(simd)
    }

    #[inline(always)]
    fn block(&mut self, simd: S, record: &Record, bx: i32, by: i32, mask: mask32x16<S>) {
        let worker = &mut *self.worker;
        let pipeline = self.draw.pipeline;
        if let (Some(face), Some(stencil)) = (&self.stencil, worker.targets.stencil.as_deref())
            && face.test(simd, &stencil[offset_in_tile(bx as usize, by as usize)..], mask.to_bitmask() as u32) == 0
        {
            return;
        }
        let z = self.depth.interpolated(bx, by);
        let (x, y) = ((worker.origin[0] + bx) as u32, (worker.origin[1] + by) as u32);
        let item = ShadeItem::new(x, y, record.attributes, mask.to_bitmask() as u16);
        let back = record.flags & flag::BACK != 0;
        // The slot is filled first, so that an observer sees the depth of fragments that fail.
        let slot = worker.scratch.len;
        Lanes::store(z, &mut worker.scratch.z[slot]);
        let observed = worker.observer.is_some();
        if observed {
            worker.stencil_before = worker.stencil_block(offset_in_tile(bx as usize, by as usize));
        }
        let mut covered = u32::from(item.mask);
        if !pipeline.fragment.late_tests {
            covered = worker.test_block(simd, self.draw, item, slot, quantized(self.depth.clamped(z), pipeline), back, covered);
            if covered == 0 {
                return;
            }
        }
        worker.push(simd, record, bx, by, covered as u16, z);
        // An observer sees each block from its tests to its blending before the next one.
        if observed {
            worker.flush(simd);
        }
    }
}
