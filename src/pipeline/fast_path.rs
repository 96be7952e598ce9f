//! Shortcuts for draws that need neither queue nor shader call per block: adding one colour, counting in the stencil, filling depth.
//!
//! Each does exactly what the general path would; `tests/fast_paths.rs` compares the two on random triangles.

use fearless_simd::{Simd, SimdMask, f32x16, mask32x16};

use crate::math::lanes::Lanes;

use super::bins::{Record, flag};
use super::depth_stencil::StencilFace;
use super::format::ChannelKind;
use super::pass::Draw;
use super::raster::{BlockSink, walk};
use super::shader::ShadeSource;
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
    /// Adds a colour to one f32 target; the colour is the draw's, or each primitive's if `None`.
    Add { channels: u8, depth: u8, strict: bool, color: Option<[f32; 4]> },
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
            let none = [super::shader::PrimitiveAttributes::default()];
            let source = ShadeSource { primitives: &none, ..source };
            fragment.primitive_color(&draw.bindings, &source, 0)[0]
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
    let mut passed = 0;
    let mut shaded = None;
    match path {
        FastPath::General => return false,
        FastPath::Add { channels, depth, strict, color } => {
            let color = match (color, &draw.pipeline.desc.program.fragment) {
                (Some(color), _) => color,
                (None, Some(fragment)) => fragment.primitive_color(&draw.bindings, &source, record.attributes)[0],
                (None, None) => return false,
            };
            let Some(planes) = targets.color[0].as_deref_mut() else { return false };
            let z = targets.depth.as_deref_mut().unwrap_or(&mut []);
            macro_rules! add {
                ($channels:literal, $depth:ident, $strict:literal) => {
                    add::<S, $channels, $depth, $strict>(simd, record, draw, origin, color, planes, z, &mut passed)
                };
            }
            macro_rules! by_depth {
                ($channels:literal) => {
                    match (depth, strict) {
                        (IGNORE, _) => add!($channels, IGNORE, false),
                        (TEST, false) => add!($channels, TEST, false),
                        (TEST, true) => add!($channels, TEST, true),
                        (_, false) => add!($channels, WRITE, false),
                        (_, true) => add!($channels, WRITE, true),
                    }
                };
            }
            match channels {
                1 => by_depth!(1),
                2 => by_depth!(2),
                _ => by_depth!(4),
            }
            shaded = Some(passed);
        }
        FastPath::Stencil { depth, strict } => {
            let plan = &draw.pipeline.depth;
            let face = if record.flags & flag::BACK != 0 { plan.stencil_back } else { plan.stencil_front };
            let face = stencil_face(draw, face);
            let Some(stencil) = targets.stencil.as_deref_mut() else { return false };
            let z = targets.depth.as_deref_mut().unwrap_or(&mut []);
            match (depth, strict) {
                (IGNORE, _) => count::<S, IGNORE, false>(simd, record, draw, origin, face, stencil, z, &mut passed),
                (_, false) => count::<S, TEST, false>(simd, record, draw, origin, face, stencil, z, &mut passed),
                (_, true) => count::<S, TEST, true>(simd, record, draw, origin, face, stencil, z, &mut passed),
            }
        }
        FastPath::Depth { strict } => {
            let Some(z) = targets.depth.as_deref_mut() else { return false };
            if strict {
                add::<S, 0, WRITE, true>(simd, record, draw, origin, [0.0; 4], &mut [], z, &mut passed);
            } else {
                add::<S, 0, WRITE, false>(simd, record, draw, origin, [0.0; 4], &mut [], z, &mut passed);
            }
        }
    }
    counters.fragments_passed += passed;
    counters.fragments_shaded += shaded.unwrap_or(0);
    true
}

/// The depth test of a block and, for [`WRITE`], its write; returns what passes.
#[inline(always)]
fn test_depth<S: Simd, const DEPTH: u8, const STRICT: bool>(
    z: &BlockDepth<S>,
    plane: &mut [f32],
    bx: i32,
    by: i32,
    offset: usize,
    mask: mask32x16<S>,
    simd: S,
) -> mask32x16<S> {
    if DEPTH == IGNORE {
        return mask;
    }
    let new = z.at(bx, by);
    let block = &mut plane[offset..offset + 16];
    let stored = <f32x16<S> as Lanes>::load(simd, block);
    let pass = mask & if STRICT { Lanes::lt(new, stored) } else { Lanes::le(new, stored) };
    if DEPTH == WRITE {
        Lanes::store(<f32x16<S> as Lanes>::select(pass, new, stored), block);
    }
    pass
}

#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
fn add<S: Simd, const CHANNELS: usize, const DEPTH: u8, const STRICT: bool>(
    simd: S,
    record: &Record,
    draw: &Draw<'_>,
    origin: [i32; 2],
    color: [f32; 4],
    planes: &mut [f32],
    depth: &mut [f32],
    passed: &mut u64,
) {
    struct Sink<'a, S: Simd, const CHANNELS: usize, const DEPTH: u8, const STRICT: bool> {
        z: BlockDepth<S>,
        color: [f32x16<S>; CHANNELS],
        planes: &'a mut [f32],
        depth: &'a mut [f32],
        passed: u64,
    }
    impl<S: Simd, const CHANNELS: usize, const DEPTH: u8, const STRICT: bool> BlockSink<S> for Sink<'_, S, CHANNELS, DEPTH, STRICT> {
        #[inline(always)]
        fn block(&mut self, simd: S, _record: &Record, bx: i32, by: i32, mask: mask32x16<S>) {
            let offset = offset_in_tile(bx as usize, by as usize);
            let pass = test_depth::<S, DEPTH, STRICT>(&self.z, self.depth, bx, by, offset, mask, simd);
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
    let mut sink = Sink::<S, CHANNELS, DEPTH, STRICT> {
        z: BlockDepth::new(simd, record, origin, draw),
        color: std::array::from_fn(|c| <f32x16<S> as Lanes>::splat(simd, color[c])),
        planes,
        depth,
        passed: 0,
    };
    walk(simd, record, &mut sink);
    *passed += sink.passed;
}

#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of a tile worker, borrowed separately")]
fn count<S: Simd, const DEPTH: u8, const STRICT: bool>(
    simd: S,
    record: &Record,
    draw: &Draw<'_>,
    origin: [i32; 2],
    face: StencilFace,
    stencil: &mut [u8],
    depth: &mut [f32],
    passed: &mut u64,
) {
    struct Sink<'a, S: Simd, const DEPTH: u8, const STRICT: bool> {
        z: BlockDepth<S>,
        face: StencilFace,
        stencil: &'a mut [u8],
        depth: &'a mut [f32],
        passed: u64,
    }
    impl<S: Simd, const DEPTH: u8, const STRICT: bool> BlockSink<S> for Sink<'_, S, DEPTH, STRICT> {
        #[inline(always)]
        fn block(&mut self, simd: S, _record: &Record, bx: i32, by: i32, mask: mask32x16<S>) {
            let offset = offset_in_tile(bx as usize, by as usize);
            let covered = mask.to_bitmask() as u32;
            let pass = test_depth::<S, DEPTH, STRICT>(&self.z, self.depth, bx, by, offset, mask, simd).to_bitmask() as u32;
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
    let mut sink = Sink::<S, DEPTH, STRICT> { z: BlockDepth::new(simd, record, origin, draw), face, stencil, depth, passed: 0 };
    walk(simd, record, &mut sink);
    *passed += sink.passed;
}
