//! Coverage: walks the 4x4 blocks of one primitive inside one tile and hands each touched block to a sink.
//!
//! The sixteen edge values of a block are one vector addition away from the primitive's. A pixel is inside if no edge value is negative, which is one
//! comparison of the three or-ed together. A primitive over more than [`FEW_BLOCKS`] blocks is first tested in 16x16 regions, sixteen blocks at a
//! time: the greatest and least value of each edge in every block tell which blocks are outside and which are wholly covered. The loops over blocks
//! then run over set bits, with few mispredicted branches. A primitive over several regions first accepts or rejects whole regions.

use fearless_simd::{Simd, SimdBase, SimdFrom, SimdMask, i32x16, mask32x16};

use crate::api::surface::TILE;
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::tile::block_depth::BlockDepth;
use crate::tile::squares::{LANE_X, LANE_Y, next_square, square_range};

/// Receives the covered pixels of a primitive.
pub(crate) trait BlockSink<S: Simd> {
    /// Whether processing a block without covered pixels costs less than a mispredicted branch, about twenty cycles.
    const TAKES_EMPTY: bool = false;

    /// The primitive's depth, which rejects blocks that must fail the test; `None` if depth is not tested.
    #[inline(always)]
    fn depth(&self) -> Option<&BlockDepth<'_, S>> {
        None
    }

    /// Blocks of the region at pixel (rx, ry) in which a fragment may pass, bit = block.
    #[inline(always)]
    fn visible_blocks(&self, simd: S, rx: i32, ry: i32) -> u32 {
        match self.depth() {
            Some(depth) => depth.visible_blocks(simd, rx, ry),
            None => 0xffff,
        }
    }

    /// Regions of the tile in which a fragment may pass, bit = region.
    #[inline(always)]
    fn visible_regions(&self, simd: S) -> u32 {
        match self.depth() {
            Some(depth) => depth.visible_regions(simd),
            None => 0xffff,
        }
    }

    /// Receives the pixels in `mask` of the 4x4 block at pixel (bx, by) of the tile. `mask` is not empty unless [`Self::TAKES_EMPTY`].
    fn block(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32, mask: mask32x16<S>);

    /// Receives a wholly covered block.
    #[inline(always)]
    fn full_block(&mut self, simd: S, primitive: &TilePrimitive, bx: i32, by: i32) {
        self.block(simd, primitive, bx, by, mask32x16::splat(simd, true));
    }

    /// Receives a wholly covered 16x16 region at pixel (rx, ry) of the tile.
    #[inline(always)]
    fn region(&mut self, simd: S, primitive: &TilePrimitive, rx: i32, ry: i32) {
        let mut blocks = self.visible_blocks(simd, rx, ry);
        while let Some((bx, by)) = next_square(&mut blocks, 4, rx, ry) {
            self.full_block(simd, primitive, bx, by);
        }
    }
}

/// Primitives over at most this many blocks are tested block by block.
const FEW_BLOCKS: i32 = 4;

/// Edge functions of a primitive, in lanes, from the tile's origin.
struct WalkEdges<S: Simd> {
    a: [i32; 3],
    b: [i32; 3],
    c: [i32; 3],
    lanes: [i32x16<S>; 3],
    /// Bounds: first and last column and row, inclusive.
    bounds: [i32; 4],
    /// Whether coverage must be masked by the bounds.
    rect: bool,
}

impl<S: Simd> WalkEdges<S> {
    #[inline(always)]
    fn new(simd: S, primitive: &TilePrimitive) -> Self {
        let column = i32x16::simd_from(simd, LANE_X);
        let row = i32x16::simd_from(simd, LANE_Y);
        let [x0, y0, x1, y1] = primitive.bounds;
        let mut edges = Self {
            a: [primitive.a[0], primitive.a[1], -(primitive.a[0] + primitive.a[1])],
            b: [primitive.b[0], primitive.b[1], -(primitive.b[0] + primitive.b[1])],
            c: primitive.c,
            lanes: [column; 3],
            bounds: [i32::from(x0), i32::from(y0), i32::from(x1), i32::from(y1)],
            rect: primitive.flags & flag::RECT != 0,
        };
        for i in 0..3 {
            if primitive.flags >> i & 1 == 1 {
                edges.a[i] = 0;
                edges.b[i] = 0;
                edges.c[i] = 0;
            }
            edges.lanes[i] = column * edges.a[i] + row * edges.b[i];
        }
        edges
    }

    /// Value of edge `i` at a pixel of the tile.
    #[inline(always)]
    fn at(&self, i: usize, x: i32, y: i32) -> i32 {
        self.c[i] + self.a[i] * x + self.b[i] * y
    }

    /// Of sixteen squares, `1 << log` pixels wide and the first of them at (x, y): those with pixels inside, and those wholly covered.
    #[inline(always)]
    fn squares(&self, simd: S, log: i32, x: i32, y: i32) -> (u32, u32) {
        let zero = i32x16::splat(simd, 0);
        let (mut greatest, mut least) = (zero, zero);
        let span = (1 << log) - 1;
        for i in 0..3 {
            // The pixel offsets of a block, scaled by the width of a square, are the offsets of the squares' first pixels.
            let first = (self.lanes[i] << log as u32) + self.at(i, x, y);
            greatest |= first + span * (self.a[i].max(0) + self.b[i].max(0));
            least |= first + span * (self.a[i].min(0) + self.b[i].min(0));
        }
        let [x0, y0, x1, y1] = self.bounds;
        let touched =
            greatest.simd_ge(zero).to_bitmask() as u32 & square_range((x0 - x) >> log, (x1 - x) >> log, (y0 - y) >> log, (y1 - y) >> log);
        let mut inside = least.simd_ge(zero).to_bitmask() as u32;
        if self.rect {
            let (last_x, last_y) = (((x1 - x + 1) >> log) - 1, ((y1 - y + 1) >> log) - 1);
            inside &= square_range((x0 - x + span) >> log, last_x, (y0 - y + span) >> log, last_y);
        }
        (touched, inside)
    }

    /// Covered pixels of the block at (bx, by).
    #[inline(always)]
    fn coverage(&self, simd: S, bx: i32, by: i32) -> mask32x16<S> {
        let mut outside =
            (self.lanes[0] + self.at(0, bx, by)) | (self.lanes[1] + self.at(1, bx, by)) | (self.lanes[2] + self.at(2, bx, by));
        if self.rect {
            // The four sides of the bounds are tested in the same way.
            let [x0, y0, x1, y1] = self.bounds;
            let column = i32x16::simd_from(simd, LANE_X);
            let row = i32x16::simd_from(simd, LANE_Y);
            outside = outside | (column + (bx - x0)) | (-column + (x1 - bx)) | (row + (by - y0)) | (-row + (y1 - by));
        }
        outside.simd_ge(i32x16::splat(simd, 0))
    }
}

/// Passes every touched block of a primitive to the sink.
#[inline(always)]
pub(crate) fn walk<S: Simd, K: BlockSink<S>>(simd: S, primitive: &TilePrimitive, sink: &mut K) {
    if primitive.flags & flag::ACCEPT == flag::ACCEPT {
        return walk_rectangle(simd, primitive, sink);
    }
    let edges = WalkEdges::new(simd, primitive);
    let [x0, y0, x1, y1] = edges.bounds;
    let (columns, rows) = ((x1 >> 2) - (x0 >> 2) + 1, (y1 >> 2) - (y0 >> 2) + 1);
    if K::TAKES_EMPTY && columns <= 2 && rows <= 2 {
        // Which of the four blocks are touched cannot be predicted. A block beyond the tile's edge has no pixels; its position is clamped to another
        // block's.
        for block in 0..4 {
            let (bx, by) = ((x0 & !3) + (block & 1) * 4, (y0 & !3) + (block >> 1) * 4);
            let exists = (block & 1) < columns && (block >> 1) < rows;
            let mask = edges.coverage(simd, bx, by) & mask32x16::splat(simd, exists);
            sink.block(simd, primitive, bx.min(60), by.min(60), mask);
        }
        return;
    }
    if columns * rows <= FEW_BLOCKS {
        for by in ((y0 & !3)..=y1).step_by(4) {
            for bx in ((x0 & !3)..=x1).step_by(4) {
                let mask = edges.coverage(simd, bx, by);
                if mask.any_true() {
                    sink.block(simd, primitive, bx, by, mask);
                }
            }
        }
        return;
    }
    if (x0 >> 4) == (x1 >> 4) && (y0 >> 4) == (y1 >> 4) {
        // A primitive inside one region goes straight to its blocks.
        return walk_region(simd, primitive, &edges, x0 & !15, y0 & !15, sink);
    }
    let (touched, inside) = edges.squares(simd, 4, 0, 0);
    let touched = touched & sink.visible_regions(simd);
    let (mut full, mut part) = (touched & inside, touched & !inside);
    while let Some((rx, ry)) = next_square(&mut full, 16, 0, 0) {
        sink.region(simd, primitive, rx, ry);
    }
    while let Some((rx, ry)) = next_square(&mut part, 16, 0, 0) {
        walk_region(simd, primitive, &edges, rx, ry, sink);
    }
}

/// Blocks of a primitive that covers its bounds wholly: a sprite, or a tile's part of a large triangle.
#[inline(always)]
fn walk_rectangle<S: Simd, K: BlockSink<S>>(simd: S, primitive: &TilePrimitive, sink: &mut K) {
    let [x0, y0, x1, y1] = primitive.bounds.map(i32::from);
    if [x0, y0, x1, y1] == [0, 0, TILE as i32 - 1, TILE as i32 - 1] {
        for region in 0..16 {
            sink.region(simd, primitive, (region & 3) * 16, (region >> 2) * 16);
        }
        return;
    }
    if K::TAKES_EMPTY && (x1 >> 2) - (x0 >> 2) < 2 && (y1 >> 2) - (y0 >> 2) < 2 {
        for block in 0..4 {
            let (bx, by) = ((x0 & !3) + (block & 1) * 4, (y0 & !3) + (block >> 1) * 4);
            let covered = square_range(x0 - bx, x1 - bx, y0 - by, y1 - by);
            sink.block(simd, primitive, bx.min(60), by.min(60), mask32x16::from_bitmask(simd, u64::from(covered)));
        }
        return;
    }
    for by in ((y0 & !3)..=y1).step_by(4) {
        for bx in ((x0 & !3)..=x1).step_by(4) {
            // Pixels of a block are numbered like the blocks of a region.
            let covered = square_range(x0 - bx, x1 - bx, y0 - by, y1 - by);
            if covered == 0xffff {
                sink.full_block(simd, primitive, bx, by);
            } else {
                sink.block(simd, primitive, bx, by, mask32x16::from_bitmask(simd, u64::from(covered)));
            }
        }
    }
}

/// Blocks of the region at (rx, ry): first the whole ones, then those that an edge crosses.
#[inline(always)]
fn walk_region<S: Simd, K: BlockSink<S>>(simd: S, primitive: &TilePrimitive, edges: &WalkEdges<S>, rx: i32, ry: i32, sink: &mut K) {
    let (touched, inside) = edges.squares(simd, 2, rx, ry);
    let touched = touched & sink.visible_blocks(simd, rx, ry);
    let (mut full, mut part) = (touched & inside, touched & !inside);
    while let Some((bx, by)) = next_square(&mut full, 4, rx, ry) {
        sink.full_block(simd, primitive, bx, by);
    }
    while let Some((bx, by)) = next_square(&mut part, 4, rx, ry) {
        let mask = edges.coverage(simd, bx, by);
        if mask.any_true() {
            sink.block(simd, primitive, bx, by, mask);
        }
    }
}
