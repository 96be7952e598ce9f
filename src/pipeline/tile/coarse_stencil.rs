//! The blocks of a tile in which a stencil test can pass: rejects primitives of a draw, and blocks of them, before any pixel is tested.
//!
//! A stencil volume marks few blocks, and most faces of the draw that follows touch none of them. The set of blocks remains an upper bound while that
//! draw runs: a failed test keeps the stencil, so a block in which no pixel passes does not change.

use fearless_simd::Simd;

use crate::primitive::tile_primitive::TilePrimitive;
use crate::tile::depth_stencil::StencilFace;
use crate::tile::squares::square_range;

/// Regions of a tile.
const REGIONS: usize = 16;

/// By region: its blocks with at least one pixel that passes, bit = block. Regions that no primitive touches have none.
pub(crate) struct CoarseStencil {
    blocks: [u16; REGIONS],
    regions: u32,
}

impl CoarseStencil {
    /// Every block may pass: nothing has been tested.
    pub const ALL: Self = Self { blocks: [0xffff; REGIONS], regions: 0xffff };

    /// Tests a tile's stencil in the regions that these primitives touch, for both faces.
    #[inline(always)]
    pub fn read<S: Simd>(simd: S, stencil: &[u8], [front, back]: &[StencilFace; 2], primitives: &[TilePrimitive]) -> Self {
        let mut passing = Self { blocks: [0; REGIONS], regions: 0 };
        let mut touched = primitives.iter().fold(0, |regions, primitive| regions | touched(primitive, 4, 0, 0));
        while touched != 0 {
            let region = touched.trailing_zeros() as usize;
            touched &= touched - 1;
            let bytes = &stencil[region * 256..region * 256 + 256];
            let mut blocks = front.passing_blocks(simd, bytes);
            if back.state.compare != front.state.compare {
                blocks |= back.passing_blocks(simd, bytes);
            }
            passing.blocks[region] = blocks as u16;
            passing.regions |= u32::from(blocks != 0) << region;
        }
        passing
    }

    /// Whether the test can pass in a primitive's bounds. A primitive over several regions is tested by region, others by block.
    #[inline(always)]
    pub fn meets(&self, primitive: &TilePrimitive) -> bool {
        let regions = touched(primitive, 4, 0, 0) & self.regions;
        if regions & regions.wrapping_sub(1) != 0 || regions == 0 {
            return regions != 0;
        }
        let region = regions.trailing_zeros() as usize;
        let (x, y) = (region as i32 % 4 * 16, region as i32 / 4 * 16);
        touched(primitive, 2, x, y) & u32::from(self.blocks[region]) != 0
    }

    /// Blocks of the region at pixel (rx, ry) in which the test can pass.
    #[inline(always)]
    pub fn blocks(&self, rx: i32, ry: i32) -> u32 {
        u32::from(self.blocks[((ry >> 4) * 4 + (rx >> 4)) as usize])
    }

    /// Regions in which the test can pass, bit = region.
    #[inline(always)]
    pub fn regions(&self) -> u32 {
        self.regions
    }
}

/// The squares that a primitive's bounds touch, of sixteen squares `1 << log` pixels wide, the first of them at (x, y); bit = square.
#[inline(always)]
fn touched(primitive: &TilePrimitive, log: u32, x: i32, y: i32) -> u32 {
    let [x0, y0, x1, y1] = primitive.bounds.map(i32::from);
    square_range((x0 - x) >> log, (x1 - x) >> log, (y0 - y) >> log, (y1 - y) >> log)
}
