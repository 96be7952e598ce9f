//! The general path: tests depth and stencil block by block and queues the blocks that pass.

use fearless_simd::{Simd, SimdMask, f32x16, mask32x16};
use fearless_simd_macros::simd;

use nephroid_math::lanes::Lanes;

use crate::api::compare::compare_lanes;
use crate::api::draw::Draw;
use crate::api::shader::stages::ShadeItem;
use crate::api::surface::offset_in_tile;
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::tile::block_depth::{BlockDepth, quantized};
use crate::tile::coarse_depth::CoarseDepth;
use crate::tile::coarse_stencil::CoarseStencil;
use crate::tile::depth_stencil::StencilFace;
use crate::tile::raster::{BlockSink, walk};
use crate::tile::worker::TileWorker;

/// Tests depth alone and queues blocks that pass; sufficient for most draws that shade.
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
    fn block(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32, mask: mask32x16<S>) {
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
            worker.push(simd, primitive, bx, by, pass, z);
        }
    }
}

/// Tests blocks and queues them.
struct GeneralSink<'w, 'a, 'b, S: Simd> {
    worker: &'w mut TileWorker<'a, 'b>,
    draw: &'a Draw<'a>,
    depth: BlockDepth<'a, S>,
    /// The stencil test, if it can be made before the shader and the depth test.
    stencil: Option<StencilFace>,
    /// Blocks in which the stencil test can pass.
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
    fn block(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32, mask: mask32x16<S>) {
        let worker = &mut *self.worker;
        let pipeline = self.draw.pipeline;
        if let (Some(face), Some(stencil)) = (&self.stencil, worker.targets.stencil.as_deref())
            && face.test(simd, &stencil[offset_in_tile(bx as usize, by as usize)..], mask.to_bitmask() as u32) == 0
        {
            return;
        }
        let z = self.depth.interpolated(bx, by);
        let (x, y) = ((worker.origin[0] + bx) as u32, (worker.origin[1] + by) as u32);
        let item = ShadeItem::new(x, y, primitive.attributes, mask.to_bitmask() as u16);
        let back = primitive.flags & flag::BACK != 0;
        // The queue's next slot is filled first, so that an observer also sees the depth of fragments that fail.
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
        worker.push(simd, primitive, bx, by, covered as u16, z);
        // For an observer, each block is tested, shaded and blended before the next one.
        if observed {
            worker.flush(simd);
        }
    }
}

impl<'a> TileWorker<'a, '_> {
    /// Draws primitives of one draw: tests their blocks and queues those that pass.
    #[simd]
    #[inline(never)]
    pub fn general<S: Simd>(&mut self, simd: S, primitives: &[TilePrimitive], coarse: Option<&'a CoarseDepth>) {
        let draw = &self.context.draws[self.draw as usize];
        self.merges = draw.pipeline.fragment.merges && self.observer.is_none();
        let early_depth_only = draw.pipeline.rejects_by_depth && !draw.pipeline.depth.stencil && self.observer.is_none();
        if early_depth_only {
            for primitive in primitives {
                let depth = BlockDepth::new(simd, primitive, self.origin, draw, draw.pipeline, coarse);
                walk(simd, primitive, &mut QueueSink { draw, depth, worker: self });
            }
            return;
        }
        let plan = &draw.pipeline.depth;
        let rejects = plan.stencil_rejects() && !draw.pipeline.fragment.late_tests && self.observer.is_none();
        let state = &self.context.states[self.draw as usize];
        let faces = [plan.stencil_front, plan.stencil_back].map(|face| state.stencil_face(face));
        let passing = match self.targets.stencil.as_deref().filter(|_| rejects) {
            Some(stencil) => CoarseStencil::read(simd, stencil, &faces, primitives),
            None => CoarseStencil::ALL,
        };
        for primitive in primitives {
            if !passing.meets(primitive) {
                continue;
            }
            let stencil = rejects.then(|| faces[usize::from(primitive.flags & flag::BACK != 0)]);
            let depth = BlockDepth::new(simd, primitive, self.origin, draw, draw.pipeline, coarse);
            walk(simd, primitive, &mut GeneralSink { draw, depth, stencil, passing: &passing, worker: self });
        }
    }
}
