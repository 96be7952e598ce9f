//! Fast paths for draws that need neither queue nor shader call per block: adding one colour, adding a kernel (`splat.rs`), counting in the stencil,
//! filling depth.
//!
//! Each gives the result of the general path; `tests/pipeline` compares the two on random triangles.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x16, mask8x16, mask32x16, u8x16, u8x64};
use fearless_simd_macros::simd;

use nephroid_math::lanes::Lanes;

use crate::api::draw::Draw;
use crate::api::format::nan::one_nan_lanes;
use crate::api::resolved::{BEHIND, FastPath, IGNORE, TEST, WRITE};
use crate::api::shader::fragment::{PrimitiveAttributes, ShadeSource};
use crate::api::shader::stages::{Execution, FragmentStage};
use crate::api::state::StencilOperation;
use crate::api::surface::{TILE_PIXELS, offset_in_tile};
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::tile::blend::add_in;
use crate::tile::block_depth::{BlockDepth, test_depth};
use crate::tile::coarse_depth::CoarseDepth;
use crate::tile::depth_stencil::StencilFace;
use crate::tile::raster::{BlockSink, walk};
use crate::tile::splat::{self, SplatDraw};
use crate::tile::squares::next_square;
use crate::tile::targets::{DrawState, TileCounters, TileTargets};

/// The colours of a draw's primitives.
enum Colors<'a> {
    /// One for front-facing primitives, one for back-facing ones.
    Draw([[f32; 4]; 2]),
    /// Computed for each primitive.
    Primitive(&'a dyn FragmentStage, ShadeSource<'a>),
}

impl<'a> Colors<'a> {
    fn of(draw: &'a Draw<'_>, source: ShadeSource<'a>, one_color: bool) -> Option<Self> {
        let fragment = draw.pipeline.desc.program.fragment.as_deref()?;
        if !one_color {
            return Some(Self::Primitive(fragment, source));
        }
        let color = |front| {
            let stand_in = [PrimitiveAttributes::facing_only(front)];
            fragment.primitive_color(&draw.bindings, &ShadeSource { primitives: &stand_in, ..source }, 0)[0]
        };
        Some(Self::Draw([color(true), color(false)]))
    }

    #[inline(always)]
    fn get(&self, draw: &Draw<'_>, primitive: &TilePrimitive) -> [f32; 4] {
        match self {
            Self::Draw(colors) => colors[usize::from(primitive.flags & flag::BACK != 0)],
            Self::Primitive(fragment, source) => fragment.primitive_color(&draw.bindings, source, primitive.attributes)[0],
        }
    }
}

/// Draws primitives of one draw on its fast path; false if the draw has none.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
pub(crate) fn run<S: Simd>(
    simd: S,
    path: FastPath,
    primitives: &[TilePrimitive],
    (draw, state): (&Draw<'_>, &DrawState<'_>),
    source: ShadeSource<'_>,
    coarse: Option<&CoarseDepth>,
    origin: [i32; 2],
    targets: &mut TileTargets<'_>,
    counters: &mut TileCounters,
    (execution, factors): (Execution, &mut Vec<f32>),
) -> bool {
    let passed;
    if let FastPath::Splat { depth, strict } = path {
        let Some(fragment) = draw.pipeline.desc.program.fragment.as_deref() else { return false };
        let splats = SplatDraw { draw, state, fragment, source, execution, origin, strict };
        passed = splat::draw(simd, depth, &splats, primitives, targets, factors);
        counters.fragments_shaded += passed;
        counters.fragments_passed += passed;
        return true;
    }
    let z = targets.depth.as_deref_mut().unwrap_or(&mut []);
    match path {
        FastPath::General | FastPath::Splat { .. } => return false,
        FastPath::Add { channels, depth, strict, one_color } => {
            let (Some(planes), Some(colors)) = (targets.color[0].as_deref_mut(), Colors::of(draw, source, one_color)) else { return false };
            let colors = Some(colors);
            passed = match (channels, depth) {
                (1, IGNORE) => add::<S, 1, IGNORE>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (1, TEST) => add::<S, 1, TEST>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (1, _) => add::<S, 1, WRITE>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (2, IGNORE) => add::<S, 2, IGNORE>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (2, TEST) => add::<S, 2, TEST>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (2, _) => add::<S, 2, WRITE>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (_, IGNORE) => add::<S, 4, IGNORE>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (_, TEST) => add::<S, 4, TEST>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
                (_, _) => add::<S, 4, WRITE>(simd, primitives, (draw, state), coarse, origin, colors, planes, z, strict),
            };
            counters.fragments_shaded += passed;
        }
        FastPath::Stencil { depth, strict } => {
            let Some(stencil) = targets.stencil.as_deref_mut() else { return false };
            passed = match depth {
                IGNORE => count::<S, IGNORE>(simd, primitives, (draw, state), coarse, origin, stencil, z, strict),
                BEHIND => count::<S, BEHIND>(simd, primitives, (draw, state), coarse, origin, stencil, z, strict),
                _ => count::<S, TEST>(simd, primitives, (draw, state), coarse, origin, stencil, z, strict),
            };
        }
        FastPath::Depth { strict } => {
            if z.is_empty() {
                return false;
            }
            passed = add::<S, 0, WRITE>(simd, primitives, (draw, state), coarse, origin, None, &mut [], z, strict);
        }
    }
    counters.fragments_passed += passed;
    true
}

/// Adds colours to one target.
struct AddSink<'a, S: Simd, const CHANNELS: usize, const DEPTH: u8> {
    z: BlockDepth<'a, S>,
    color: [f32x16<S>; CHANNELS],
    planes: &'a mut [f32],
    depth: &'a mut [f32],
    strict: bool,
    passed: u64,
}

impl<S: Simd, const CHANNELS: usize, const DEPTH: u8> BlockSink<S> for AddSink<'_, S, CHANNELS, DEPTH> {
    const TAKES_EMPTY: bool = true;

    #[inline(always)]
    fn depth(&self) -> Option<&BlockDepth<'_, S>> {
        if DEPTH == TEST || DEPTH == BEHIND { Some(&self.z) } else { None }
    }

    #[inline(always)]
    fn block(&mut self, simd: S, _record: &TilePrimitive, bx: i32, by: i32, mask: mask32x16<S>) {
        let offset = offset_in_tile(bx as usize, by as usize);
        let pass = test_depth::<S, DEPTH>(&self.z, self.depth, bx, by, offset, mask, self.strict, simd);
        self.passed += u64::from(pass.to_bitmask().count_ones());
        for c in 0..CHANNELS {
            let block = &mut self.planes[c * TILE_PIXELS + offset..][..16];
            add_in(simd, pass, self.color[c], block);
        }
    }
    #[inline(always)]
    fn full_block(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32) {
        if DEPTH != IGNORE {
            return self.block(simd, primitive, bx, by, mask32x16::splat(simd, true));
        }
        let offset = offset_in_tile(bx as usize, by as usize);
        for c in 0..CHANNELS {
            let block = &mut self.planes[c * TILE_PIXELS + offset..][..16];
            Lanes::store(one_nan_lanes(<f32x16<S> as Lanes>::load(simd, block) + self.color[c]), block);
        }
        self.passed += 16;
    }
}

#[simd]
#[inline(never)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
fn add<S: Simd, const CHANNELS: usize, const DEPTH: u8>(
    simd: S,
    primitives: &[TilePrimitive],
    (draw, state): (&Draw<'_>, &DrawState<'_>),
    coarse: Option<&CoarseDepth>,
    origin: [i32; 2],
    colors: Option<Colors<'_>>,
    planes: &mut [f32],
    depth: &mut [f32],
    strict: bool,
) -> u64 {
    let mut passed = 0;
    for primitive in primitives {
        let values = colors.as_ref().map_or([0.0; 4], |colors| colors.get(draw, primitive));
        let mut color = [<f32x16<S> as Lanes>::splat(simd, 0.0); CHANNELS];
        for (lanes, value) in color.iter_mut().zip(values) {
            *lanes = Lanes::splat(simd, value);
        }
        let z = BlockDepth::new(simd, primitive, origin, draw, state.pipeline, coarse);
        let mut sink = AddSink::<S, CHANNELS, DEPTH> { z, color, planes: &mut *planes, depth: &mut *depth, strict, passed: 0 };
        walk(simd, primitive, &mut sink);
        passed += sink.passed;
    }
    passed
}

/// The stencil operation of fragments that pass.
#[derive(Clone, Copy)]
struct Count {
    face: StencilFace,
    /// The number added, if the operation is an addition modulo 256.
    step: Option<u8>,
}

impl Count {
    fn of(face: StencilFace) -> Self {
        let step = match face.state.pass_op {
            StencilOperation::IncrementWrap if face.write_mask == 0xff => Some(1),
            StencilOperation::DecrementWrap if face.write_mask == 0xff => Some(0xff),
            _ => None,
        };
        Self { face, step }
    }
}

/// Counts in the stencil.
struct CountSink<'a, S: Simd, const DEPTH: u8> {
    z: BlockDepth<'a, S>,
    count: Count,
    stencil: &'a mut [u8],
    depth: &'a mut [f32],
    strict: bool,
    passed: u64,
}

impl<S: Simd, const DEPTH: u8> CountSink<'_, S, DEPTH> {
    #[inline(always)]
    fn apply(&mut self, simd: S, offset: usize, pass: u32) {
        let block = &mut self.stencil[offset..offset + 16];
        match self.count.step {
            Some(step) => {
                let old = u8x16::from_slice(simd, block);
                let step =
                    simd.select_u8x16(mask8x16::from_bitmask(simd, u64::from(pass)), u8x16::splat(simd, step), u8x16::splat(simd, 0));
                (old + step).store_slice(block);
            }
            None => self.count.face.apply(simd, self.count.face.state.pass_op, block, pass),
        }
        self.passed += u64::from(pass.count_ones());
    }
}

impl<S: Simd, const DEPTH: u8> BlockSink<S> for CountSink<'_, S, DEPTH> {
    #[inline(always)]
    fn depth(&self) -> Option<&BlockDepth<'_, S>> {
        if DEPTH == TEST || DEPTH == BEHIND { Some(&self.z) } else { None }
    }

    #[inline(always)]
    fn block(&mut self, simd: S, _record: &TilePrimitive, bx: i32, by: i32, mask: mask32x16<S>) {
        let offset = offset_in_tile(bx as usize, by as usize);
        let covered = mask.to_bitmask() as u32;
        let mut pass = covered;
        if DEPTH != IGNORE {
            pass = test_depth::<S, DEPTH>(&self.z, self.depth, bx, by, offset, mask, self.strict, simd).to_bitmask() as u32;
            let face = self.count.face;
            face.apply(simd, face.state.depth_fail_op, &mut self.stencil[offset..], covered & !pass);
        }
        self.apply(simd, offset, pass);
    }
    #[inline(always)]
    fn full_block(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32) {
        if DEPTH != IGNORE {
            return self.block(simd, primitive, bx, by, mask32x16::splat(simd, true));
        }
        self.apply(simd, offset_in_tile(bx as usize, by as usize), 0xffff);
    }
    #[inline(always)]
    fn region(&mut self, simd: S, primitive: &TilePrimitive, rx: i32, ry: i32) {
        let offset = offset_in_tile(rx as usize, ry as usize);
        let step = if DEPTH == IGNORE { self.count.step } else { None };
        let Some(step) = step else {
            let mut blocks = self.visible_blocks(simd, rx, ry);
            while let Some((bx, by)) = next_square(&mut blocks, 4, rx, ry) {
                self.full_block(simd, primitive, bx, by);
            }
            return;
        };
        // A region is one run of 256 bytes.
        let step = u8x64::splat(simd, step);
        for run in self.stencil[offset..offset + 256].chunks_exact_mut(64) {
            (u8x64::from_slice(simd, run) + step).store_slice(run);
        }
        self.passed += 256;
    }
}

#[simd]
#[inline(never)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
fn count<S: Simd, const DEPTH: u8>(
    simd: S,
    primitives: &[TilePrimitive],
    (draw, state): (&Draw<'_>, &DrawState<'_>),
    coarse: Option<&CoarseDepth>,
    origin: [i32; 2],
    stencil: &mut [u8],
    depth: &mut [f32],
    strict: bool,
) -> u64 {
    let plan = &state.pipeline.depth;
    let (front, back) = (Count::of(state.stencil_face(plan.stencil_front)), Count::of(state.stencil_face(plan.stencil_back)));
    let mut passed = 0;
    for primitive in primitives {
        let count = if primitive.flags & flag::BACK != 0 { back } else { front };
        let z = BlockDepth::new(simd, primitive, origin, draw, state.pipeline, coarse);
        let mut sink = CountSink::<S, DEPTH> { z, count, stencil: &mut *stencil, depth: &mut *depth, strict, passed: 0 };
        walk(simd, primitive, &mut sink);
        passed += sink.passed;
    }
    passed
}
