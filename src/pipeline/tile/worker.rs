//! A tile while it is drawn: the queue of blocks, shading, late tests and blending.

use fearless_simd::{Simd, SimdMask, f32x16, mask32x16};
use fearless_simd_macros::simd;

use nephroid_math::lanes::Lanes;

use crate::api::compare::compare_lanes;
use crate::api::draw::Draw;
use crate::api::observer::{FragmentOutcome, Observer};
use crate::api::shader::fragment::{PrimitiveAttributes, ShadeSource};
use crate::api::shader::stages::{ShadeBatch, ShadeItem};
use crate::api::surface::offset_in_tile;
use crate::geometry::chunk_output::ChunkOutput;
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::tile::block_depth::{clamp_depth, quantized};
use crate::tile::coarse_depth::CoarseDepth;
use crate::tile::queue::{QUEUE, Queue};
use crate::tile::targets::{TileContext, TileCounters, TileTargets};

/// A tile while it is drawn.
pub(crate) struct TileWorker<'a, 'b> {
    pub context: &'a TileContext<'a>,
    /// First pixel of the tile.
    pub origin: [i32; 2],
    pub targets: &'a mut TileTargets<'b>,
    /// The tile's depth ranges, in passes that do not write depth.
    pub coarse: Option<&'a CoarseDepth>,
    pub scratch: &'a mut Queue,
    pub repeated: &'a mut Vec<TilePrimitive>,
    pub counters: &'a mut TileCounters,
    pub observer: Option<&'a mut dyn Observer>,
    pub chunk: Option<&'a ChunkOutput>,
    /// Stencil of the current block before its tests, for the observer.
    pub stencil_before: [u8; 16],
    /// The draw of the last primitive.
    pub draw: u32,
    /// Whether the draw's blocks may be merged with queued ones.
    pub merges: bool,
}

impl<'a> TileWorker<'a, '_> {
    pub fn source(&self) -> ShadeSource<'a> {
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

    /// Queues a block with depth `z` (before the clamp), or merges it with the same block of another primitive in the queue.
    #[inline(always)]
    pub fn push<S: Simd>(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32, mask: u16, z: f32x16<S>) {
        let queue = &mut *self.scratch;
        let (x, y) = ((self.origin[0] + bx) as u32, (self.origin[1] + by) as u32);
        let back = primitive.flags & flag::BACK != 0;
        if self.merges {
            let latest = &mut queue.latest[offset_in_tile(bx as usize, by as usize) / 16];
            let slot = usize::from(*latest);
            // The slot may be left over from an earlier queue. It is this block's if the position is the same.
            if slot < queue.len
                && (queue.items[slot].x, queue.items[slot].y, queue.facing[slot]) == (x, y, back)
                && queue.items[slot].merge(primitive.attributes, mask)
            {
                let merged = mask32x16::from_bitmask(simd, u64::from(mask));
                let before = <f32x16<S> as Lanes>::load(simd, &queue.z[slot]);
                Lanes::store(<f32x16<S> as Lanes>::select(merged, z, before), &mut queue.z[slot]);
                return;
            }
            *latest = queue.len as u8;
        }
        let slot = queue.len;
        Lanes::store(z, &mut queue.z[slot]);
        queue.items[slot] = ShadeItem::new(x, y, primitive.attributes, mask);
        queue.facing[slot] = back;
        queue.len = slot + 1;
        if slot + 1 == QUEUE {
            self.flush_queue(simd);
        }
    }

    /// Shades and blends the queued blocks.
    #[inline(always)]
    pub fn flush<S: Simd>(&mut self, simd: S) {
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

    /// Tests depth and stencil of the pixels in `mask`; returns those that pass. `z` is depth as the target stores it.
    #[inline(always)]
    #[allow(
        clippy::too_many_arguments,
        reason = "a block is its item, queue place, depth, facing and mask; a struct would only rename them"
    )]
    pub fn test_block<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, item: ShadeItem, i: usize, z: f32x16<S>, back: bool, mask: u32) -> u32 {
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
}
