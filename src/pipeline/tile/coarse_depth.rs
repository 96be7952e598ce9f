//! Least and greatest depth of every 4x4 block of a tile: rejects sixteen blocks of a primitive at once, before any pixel is tested.
//!
//! Used in passes whose draws test depth and never write it, such as passes that add light to what an earlier pass has drawn; the ranges then stay
//! valid. A block is rejected only if no rounding can make one of its fragments pass.

use fearless_simd::{Simd, SimdFrom, SimdMask, f32x16, i32x16, mask32x16};

use nephroid_math::lanes::{Lanes, lanes_from_i32};

use crate::api::state::CompareFunction;
use crate::api::surface::TILE_PIXELS;
use crate::tile::squares::{LANE_X, LANE_Y};

/// Blocks in a tile.
const BLOCKS: usize = TILE_PIXELS / 16;

/// Least and greatest depth by block, in the order of the tile's plane (sixteen consecutive blocks form a region), and by region.
pub(crate) struct CoarseDepth {
    least: [f32; BLOCKS + 16],
    greatest: [f32; BLOCKS + 16],
}

impl Default for CoarseDepth {
    fn default() -> Self {
        Self { least: [0.0; BLOCKS + 16], greatest: [0.0; BLOCKS + 16] }
    }
}

/// Least and greatest of sixteen numbers, by comparing halves. A NaN may hide other numbers; a comparison with the result then counts as visible.
#[inline(always)]
fn extremes(values: &[f32]) -> (f32, f32) {
    let (mut least, mut greatest) = ([0.0; 16], [0.0; 16]);
    least.copy_from_slice(values);
    greatest.copy_from_slice(values);
    for half in [8, 4, 2, 1] {
        for i in 0..half {
            least[i] = if least[i + half] < least[i] { least[i + half] } else { least[i] };
            greatest[i] = if greatest[i + half] > greatest[i] { greatest[i + half] } else { greatest[i] };
        }
    }
    (least[0], greatest[0])
}

impl CoarseDepth {
    /// Reads a tile's depth plane.
    #[inline(always)]
    pub fn read(&mut self, plane: &[f32]) {
        for (block, depths) in plane.chunks_exact(16).enumerate() {
            (self.least[block], self.greatest[block]) = extremes(depths);
        }
        for region in 0..16 {
            self.least[BLOCKS + region] = extremes(&self.least[region * 16..region * 16 + 16]).0;
            self.greatest[BLOCKS + region] = extremes(&self.greatest[region * 16..region * 16 + 16]).1;
        }
    }

    /// Blocks of the region at pixel (rx, ry) in which a fragment of this plane may pass, bit = block.
    #[inline(always)]
    pub fn visible_blocks<S: Simd>(&self, simd: S, plane: &CoarsePlane, rx: i32, ry: i32) -> u32 {
        let first = ((ry >> 4) * 4 + (rx >> 4)) as usize * 16;
        self.visible(simd, plane, plane.bounds(simd, 4.0, rx as f32, ry as f32), first)
    }

    /// Regions of the tile in which a fragment of this plane may pass, bit = region.
    #[inline(always)]
    pub fn visible_regions<S: Simd>(&self, simd: S, plane: &CoarsePlane) -> u32 {
        self.visible(simd, plane, plane.bounds(simd, 16.0, 0.0, 0.0), BLOCKS)
    }

    #[inline(always)]
    fn visible<S: Simd>(&self, simd: S, plane: &CoarsePlane, (least, greatest): (f32x16<S>, f32x16<S>), first: usize) -> u32 {
        // The comparison is written so that NaN is visible.
        let hidden: mask32x16<S> = if plane.passes_below {
            Lanes::gt(least, <f32x16<S> as Lanes>::load(simd, &self.greatest[first..]))
        } else {
            Lanes::lt(greatest, <f32x16<S> as Lanes>::load(simd, &self.least[first..]))
        };
        !(hidden.to_bitmask() as u32) & 0xffff
    }
}

/// A primitive's depth plane over its tile.
#[derive(Clone, Copy)]
pub(crate) struct CoarsePlane {
    /// Depth at the tile's first pixel, change per pixel right, change per pixel down.
    at_origin: f32,
    dx: f32,
    dy: f32,
    /// Upper bound on the rounding error of a depth.
    slack: f32,
    clamp: Option<(f32, f32)>,
    /// Whether a fragment passes if its depth is less than the stored one; otherwise it passes if greater.
    passes_below: bool,
}

impl CoarsePlane {
    /// From the depth plane and the position of the tile's first pixel relative to the plane's anchor. `compare` must be one of the four order
    /// relations.
    #[inline(always)]
    pub fn new([base, dx, dy]: [f32; 3], [x, y]: [f32; 2], clamp: Option<(f32, f32)>, compare: CompareFunction) -> Self {
        let reach = base.abs() + (x.abs() + 64.0) * dx.abs() + (y.abs() + 64.0) * dy.abs();
        let passes_below = matches!(compare, CompareFunction::Less | CompareFunction::LessEqual);
        Self { at_origin: base + x * dx + y * dy, dx, dy, slack: reach * 1.0e-6, clamp, passes_below }
    }

    /// Least and greatest depth in each of sixteen squares, `size` pixels wide, of which the first starts at (x, y).
    #[inline(always)]
    fn bounds<S: Simd>(&self, simd: S, size: f32, x: f32, y: f32) -> (f32x16<S>, f32x16<S>) {
        let column = lanes_from_i32(i32x16::simd_from(simd, LANE_X));
        let row = lanes_from_i32(i32x16::simd_from(simd, LANE_Y));
        let first = column * (self.dx * size) + row * (self.dy * size) + (self.at_origin + x * self.dx + y * self.dy);
        let least = first + ((size - 1.0) * (self.dx.min(0.0) + self.dy.min(0.0)) - self.slack);
        let greatest = first + ((size - 1.0) * (self.dx.max(0.0) + self.dy.max(0.0)) + self.slack);
        match self.clamp {
            // Where they are not numbers, they become the ends, as rules differ on what depth is clamped to there.
            Some((low, high)) => (Lanes::clamp(least, low, high), clamp_from_above(greatest, (low, high))),
            None => (least, greatest),
        }
    }
}

/// `max(min(z, high), low)`; NaN becomes `high`.
#[inline(always)]
pub(crate) fn clamp_from_above<L: Lanes>(z: L, (low, high): (f32, f32)) -> L {
    Lanes::max(Lanes::min(z, z.like(high)), z.like(low))
}
