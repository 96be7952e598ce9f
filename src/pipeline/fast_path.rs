//! Shortcuts for draws that need neither queue nor shader call per block: adding one colour, counting in the stencil, filling depth.
//!
//! Each does exactly what the general path would; `tests/pipeline` compares the two on random triangles.

use fearless_simd::{Simd, SimdMask, f32x16, mask32x16};
use fearless_simd_macros::simd;

use crate::math::lanes::Lanes;

use super::bins::{Record, flag};
use super::depth_stencil::StencilFace;
use super::format::ChannelKind;
use super::pass::Draw;
use super::raster::{BlockSink, walk};
use super::shader::{PrimitiveAttributes, ShadeSource};
use super::state::{CompareFunction, StencilOperation};
use super::texture::{TILE_PIXELS, offset_in_tile};
use super::tile::{BlockDepth, TileCounters, TileTargets, stencil_face};

/// How a fast path treats depth: `0` ignores it, `1` tests, `2` tests and writes.
const IGNORE: u8 = 0;
const TEST: u8 = 1;
const WRITE: u8 = 2;

/// Which shortcut a draw takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FastPath {
    /// None.
    General,
    /// Adds a colour to one f32 target: the draw's (in front, behind), or each primitive's if `None`.
    Add { channels: u8, depth: u8, strict: bool, color: Option<[[f32; 4]; 2]> },
    /// Changes the stencil only; depth is not written.
    Stencil { depth: u8, strict: bool },
    /// Tests and writes depth only.
    Depth { strict: bool },
}

impl FastPath {
    /// The shortcut that does what this draw asks for.
    pub fn of(draw: &Draw<'_>, source: ShadeSource<'_>) -> Self {
        let pipeline = draw.pipeline;
        let plan = &pipeline.depth;
        let (depth, strict) = match (plan.compare, plan.write, plan.kind) {
            (CompareFunction::Always, false, _) => (IGNORE, false),
            (CompareFunction::Less, write, Some(ChannelKind::Float32)) => (TEST + u8::from(write), true),
            (CompareFunction::LessEqual, write, Some(ChannelKind::Float32)) => (TEST + u8::from(write), false),
            _ => return Self::General,
        };
        if !pipeline.fragment.shades {
            let always = plan.stencil_front.compare == CompareFunction::Always && plan.stencil_back.compare == CompareFunction::Always;
            return match depth {
                IGNORE | TEST if plan.stencil && always => Self::Stencil { depth, strict },
                WRITE if !plan.stencil => Self::Depth { strict },
                _ => Self::General,
            };
        }
        let ([Some(target)], Some(fragment)) = (&pipeline.targets[..], &pipeline.desc.program.fragment) else { return Self::General };
        if plan.stencil || !pipeline.fragment.per_primitive || !target.is_additive_f32() {
            return Self::General;
        }
        let one_color = pipeline.interpolation.is_empty() && !pipeline.fragment.attributes;
        let color = one_color.then(|| {
            [true, false].map(|front| {
                let stand_in = [PrimitiveAttributes::facing_only(front)];
                let source = ShadeSource { primitives: &stand_in, ..source };
                fragment.primitive_color(&draw.bindings, &source, 0)[0]
            })
        });
        Self::Add { channels: target.channels as u8, depth, strict, color }
    }
}

/// Draws a record by a shortcut; false if there is none.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
pub(super) fn run<S: Simd>(
    simd: S,
    path: FastPath,
    record: &Record,
    draw: &Draw<'_>,
    source: ShadeSource<'_>,
    origin: [i32; 2],
    targets: &mut TileTargets<'_>,
    counters: &mut TileCounters,
) -> bool {
    let passed;
    let mut shaded = None;
    match path {
        FastPath::General => return false,
        FastPath::Add { channels, depth, strict, color } => {
            let color = match (color, &draw.pipeline.desc.program.fragment) {
                (Some(colors), _) => colors[usize::from(record.flags & flag::BACK != 0)],
                (None, Some(fragment)) => fragment.primitive_color(&draw.bindings, &source, record.attributes)[0],
                (None, None) => return false,
            };
            let Some(planes) = targets.color[0].as_deref_mut() else { return false };
            let z = targets.depth.as_deref_mut().unwrap_or(&mut []);
            passed = match (channels, depth) {
                (1, IGNORE) => add::<S, 1, IGNORE>(simd, record, draw, origin, color, planes, z, strict),
                (1, TEST) => add::<S, 1, TEST>(simd, record, draw, origin, color, planes, z, strict),
                (1, _) => add::<S, 1, WRITE>(simd, record, draw, origin, color, planes, z, strict),
                (2, IGNORE) => add::<S, 2, IGNORE>(simd, record, draw, origin, color, planes, z, strict),
                (2, TEST) => add::<S, 2, TEST>(simd, record, draw, origin, color, planes, z, strict),
                (2, _) => add::<S, 2, WRITE>(simd, record, draw, origin, color, planes, z, strict),
                (_, IGNORE) => add::<S, 4, IGNORE>(simd, record, draw, origin, color, planes, z, strict),
                (_, TEST) => add::<S, 4, TEST>(simd, record, draw, origin, color, planes, z, strict),
                (_, _) => add::<S, 4, WRITE>(simd, record, draw, origin, color, planes, z, strict),
            };
            shaded = Some(passed);
        }
        FastPath::Stencil { depth, strict } => {
            let plan = &draw.pipeline.depth;
            let face = if record.flags & flag::BACK != 0 { plan.stencil_back } else { plan.stencil_front };
            let face = stencil_face(draw, face);
            let Some(stencil) = targets.stencil.as_deref_mut() else { return false };
            let z = targets.depth.as_deref_mut().unwrap_or(&mut []);
            passed = match depth {
                IGNORE => count::<S, IGNORE>(simd, record, draw, origin, face, stencil, z, strict),
                _ => count::<S, TEST>(simd, record, draw, origin, face, stencil, z, strict),
            };
        }
        FastPath::Depth { strict } => {
            let Some(z) = targets.depth.as_deref_mut() else { return false };
            passed = add::<S, 0, WRITE>(simd, record, draw, origin, [0.0; 4], &mut [], z, strict);
        }
    }
    counters.fragments_passed += passed;
    counters.fragments_shaded += shaded.unwrap_or(0);
    true
}

/// The depth test of a block and, for [`WRITE`], its write; returns what passes.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of a sink, borrowed separately")]
fn test_depth<S: Simd, const DEPTH: u8>(
    z: &BlockDepth<S>,
    plane: &mut [f32],
    bx: i32,
    by: i32,
    offset: usize,
    mask: mask32x16<S>,
    strict: bool,
    simd: S,
) -> mask32x16<S> {
    if DEPTH == IGNORE {
        return mask;
    }
    let new = z.at(bx, by);
    let block = &mut plane[offset..offset + 16];
    let stored = <f32x16<S> as Lanes>::load(simd, block);
    let pass = mask & if strict { Lanes::lt(new, stored) } else { Lanes::le(new, stored) };
    if DEPTH == WRITE {
        Lanes::store(<f32x16<S> as Lanes>::select(pass, new, stored), block);
    }
    pass
}

#[simd]
#[inline(never)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
fn add<S: Simd, const CHANNELS: usize, const DEPTH: u8>(
    simd: S,
    record: &Record,
    draw: &Draw<'_>,
    origin: [i32; 2],
    color: [f32; 4],
    planes: &mut [f32],
    depth: &mut [f32],
    strict: bool,
) -> u64 {
    struct Sink<'a, S: Simd, const CHANNELS: usize, const DEPTH: u8> {
        z: BlockDepth<S>,
        color: [f32x16<S>; CHANNELS],
        planes: &'a mut [f32],
        depth: &'a mut [f32],
        strict: bool,
        passed: u64,
    }
    impl<S: Simd, const CHANNELS: usize, const DEPTH: u8> BlockSink<S> for Sink<'_, S, CHANNELS, DEPTH> {
        #[inline(always)]
        fn block(&mut self, simd: S, _record: &Record, bx: i32, by: i32, mask: mask32x16<S>) {
            let offset = offset_in_tile(bx as usize, by as usize);
            let pass = test_depth::<S, DEPTH>(&self.z, self.depth, bx, by, offset, mask, self.strict, simd);
            self.passed += u64::from(pass.to_bitmask().count_ones());
            for c in 0..CHANNELS {
                let block = &mut self.planes[c * TILE_PIXELS + offset..][..16];
                let old = <f32x16<S> as Lanes>::load(simd, block);
                Lanes::store(<f32x16<S> as Lanes>::select(pass, old + self.color[c], old), block);
            }
        }
        #[inline(always)]
        fn region(&mut self, simd: S, record: &Record, rx: i32, ry: i32) {
            if DEPTH != IGNORE {
                let all = mask32x16::splat(simd, true);
                for by in (ry..ry + 16).step_by(4) {
                    for bx in (rx..rx + 16).step_by(4) {
                        self.block(simd, record, bx, by, all);
                    }
                }
                return;
            }
            // A region is one run of 256 numbers.
            let offset = offset_in_tile(rx as usize, ry as usize);
            for c in 0..CHANNELS {
                for block in self.planes[c * TILE_PIXELS + offset..][..256].chunks_exact_mut(16) {
                    Lanes::store(<f32x16<S> as Lanes>::load(simd, block) + self.color[c], block);
                }
            }
            self.passed += 256;
        }
    }
    let mut sink = Sink::<S, CHANNELS, DEPTH> {
        z: BlockDepth::new(simd, record, origin, draw),
        color: std::array::from_fn(|c| <f32x16<S> as Lanes>::splat(simd, color[c])),
        planes,
        depth,
        strict,
        passed: 0,
    };
    walk(simd, record, &mut sink);
    sink.passed
}

#[simd]
#[inline(never)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
fn count<S: Simd, const DEPTH: u8>(
    simd: S,
    record: &Record,
    draw: &Draw<'_>,
    origin: [i32; 2],
    face: StencilFace,
    stencil: &mut [u8],
    depth: &mut [f32],
    strict: bool,
) -> u64 {
    struct Sink<'a, S: Simd, const DEPTH: u8> {
        z: BlockDepth<S>,
        face: StencilFace,
        stencil: &'a mut [u8],
        depth: &'a mut [f32],
        strict: bool,
        passed: u64,
    }
    impl<S: Simd, const DEPTH: u8> BlockSink<S> for Sink<'_, S, DEPTH> {
        #[inline(always)]
        fn block(&mut self, simd: S, _record: &Record, bx: i32, by: i32, mask: mask32x16<S>) {
            let offset = offset_in_tile(bx as usize, by as usize);
            let covered = mask.to_bitmask() as u32;
            let pass = test_depth::<S, DEPTH>(&self.z, self.depth, bx, by, offset, mask, self.strict, simd).to_bitmask() as u32;
            if self.face.state.depth_fail_op != StencilOperation::Keep {
                self.face.apply(simd, self.face.state.depth_fail_op, &mut self.stencil[offset..], covered & !pass);
            }
            self.face.apply(simd, self.face.state.pass_op, &mut self.stencil[offset..], pass);
            self.passed += u64::from(pass.count_ones());
        }
        #[inline(always)]
        fn region(&mut self, simd: S, record: &Record, rx: i32, ry: i32) {
            if DEPTH != IGNORE {
                let all = mask32x16::splat(simd, true);
                for by in (ry..ry + 16).step_by(4) {
                    for bx in (rx..rx + 16).step_by(4) {
                        self.block(simd, record, bx, by, all);
                    }
                }
                return;
            }
            let offset = offset_in_tile(rx as usize, ry as usize);
            for block in self.stencil[offset..offset + 256].chunks_exact_mut(16) {
                self.face.apply(simd, self.face.state.pass_op, block, 0xffff);
            }
            self.passed += 256;
        }
    }
    let mut sink = Sink::<S, DEPTH> { z: BlockDepth::new(simd, record, origin, draw), face, stencil, depth, strict, passed: 0 };
    walk(simd, record, &mut sink);
    sink.passed
}
