//! Setup of small triangles and sprites, sixteen at a time.
//!
//! A triangle that needs no clipping and is less than 64 pixels wide and high touches at most four tiles, and its edge functions, taken from the
//! corner of the tile where it starts, fit 32 bits. The same holds for a sprite of that size. All steps up to their tile primitives are then
//! arithmetic on lanes. Other primitives are set up one at a time (`Emitter::triangle`, `Emitter::point`), at their place in the order. Both ways
//! give the same bits; `tests/pipeline` compares them.

use fearless_simd::{ExtractToken, Simd, SimdBase, SimdMask, i32x16, mask32x16};

use crate::api::surface::TILE;
use crate::geometry::emitter::Emitter;
use crate::primitive::tile_primitive::TilePrimitive;

/// Bound on width and height of small triangles, in 1/256 pixel (exclusive).
pub(crate) const SMALL: i32 = 1 << 14;

/// The ids of the primitives of a part.
#[derive(Clone, Copy)]
pub(crate) enum Ids<'a> {
    /// Consecutive, from this one on.
    From(u32),
    /// One in the list for each primitive.
    Listed(&'a [u32]),
}

impl Ids<'_> {
    #[inline(always)]
    pub fn get(&self, index: usize) -> u32 {
        match self {
            Self::From(first) => first + index as u32,
            Self::Listed(ids) => ids[index],
        }
    }
}

impl Emitter<'_> {
    /// Bounds cut to the scissor; first and last column and row, inclusive.
    #[inline(always)]
    pub fn scissored<S: Simd>(&self, [x0, y0, x1, y1]: [i32x16<S>; 4]) -> [i32x16<S>; 4] {
        let (simd, s) = (x0.token(), self.scissor);
        [
            x0.max(i32x16::splat(simd, s.x0 as i32)),
            y0.max(i32x16::splat(simd, s.y0 as i32)),
            x1.min(i32x16::splat(simd, s.x1 as i32 - 1)),
            y1.min(i32x16::splat(simd, s.y1 as i32 - 1)),
        ]
    }

    /// Adds a small primitive to the bins of its tiles. Its edge functions are given at the first pixel of the tile where its bounds start;
    /// `primitive` holds all other fields.
    #[inline(always)]
    pub fn bin_small(&mut self, [x0, y0, x1, y1]: [i32; 4], a: [i32; 3], b: [i32; 3], c: [i32; 3], primitive: TilePrimitive) {
        let (tx0, ty0, tx1, ty1) = (x0 >> 6, y0 >> 6, x1 >> 6, y1 >> 6);
        let single = tx0 == tx1 && ty0 == ty1;
        let span = TILE as i32 - 1;
        for ty in ty0..=ty1 {
            for tx in tx0..=tx1 {
                let (right, down) = ((tx - tx0) * TILE as i32, (ty - ty0) * TILE as i32);
                let at = [c[0] + a[0] * right + b[0] * down, c[1] + a[1] * right + b[1] * down, c[2] + a[2] * right + b[2] * down];
                if !single && (0..3).any(|i| at[i] + (a[i].max(0) + b[i].max(0)) * span < 0) {
                    continue;
                }
                let (left, top) = (tx * TILE as i32, ty * TILE as i32);
                *self.out.bins.slot(ty as usize, tx as usize) = TilePrimitive {
                    c: at,
                    a: [a[0], a[1]],
                    b: [b[0], b[1]],
                    bounds: [(x0 - left).max(0) as u8, (y0 - top).max(0) as u8, (x1 - left).min(span) as u8, (y1 - top).min(span) as u8],
                    ..primitive
                };
            }
        }
    }
}

#[inline(always)]
pub(crate) fn bits<S: Simd>(mask: mask32x16<S>) -> u32 {
    mask.to_bitmask() as u32
}
