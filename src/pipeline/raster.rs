//! Coverage: walks the 4x4 blocks of one record inside one tile and hands each touched block to a sink.
//!
//! A block's sixteen edge values are one vector add away from the record's; inside means that no edge is negative, which is
//! one comparison of the three or-ed together. Records wider than a 16x16 region first accept or reject whole regions.

use fearless_simd::{Simd, SimdBase, SimdFrom, SimdMask, i32x16, mask32x16};

use super::bins::{Record, flag};

/// Takes the covered pixels of a record.
pub(super) trait BlockSink<S: Simd> {
    /// A 4x4 block at pixel (bx, by) of the tile; at least one lane of `mask` may be set.
    fn block(&mut self, simd: S, record: &Record, bx: i32, by: i32, mask: mask32x16<S>);

    /// A wholly covered 16x16 region at pixel (rx, ry) of the tile.
    #[inline(always)]
    fn region(&mut self, simd: S, record: &Record, rx: i32, ry: i32) {
        let all = mask32x16::splat(simd, true);
        for by in (ry..ry + 16).step_by(4) {
            for bx in (rx..rx + 16).step_by(4) {
                self.block(simd, record, bx, by, all);
            }
        }
    }
}

/// Columns of the lanes of a block.
pub(super) const LANE_X: [i32; 16] = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3];
/// Rows of the lanes of a block.
pub(super) const LANE_Y: [i32; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3];

/// Edge functions of a record, in lanes and at the tile's origin.
struct WalkEdges<S: Simd> {
    a: [i32; 3],
    b: [i32; 3],
    c: [i32; 3],
    lanes: [i32x16<S>; 3],
}

/// Hands every touched block of a record to the sink.
#[inline(always)]
pub(super) fn walk<S: Simd, K: BlockSink<S>>(simd: S, record: &Record, sink: &mut K) {
    let column = i32x16::simd_from(simd, LANE_X);
    let row = i32x16::simd_from(simd, LANE_Y);
    let mut edges = WalkEdges {
        a: [record.a[0], record.a[1], -(record.a[0] + record.a[1])],
        b: [record.b[0], record.b[1], -(record.b[0] + record.b[1])],
        c: record.c,
        lanes: [column; 3],
    };
    for i in 0..3 {
        if record.flags >> i & 1 == 1 {
            edges.a[i] = 0;
            edges.b[i] = 0;
            edges.c[i] = 0;
        }
        edges.lanes[i] = column * edges.a[i] + row * edges.b[i];
    }
    let [x0, y0, x1, y1] = record.bounds.map(i32::from);
    let rect = record.flags & flag::RECT != 0;
    let single = (x0 >> 4) == (x1 >> 4) && (y0 >> 4) == (y1 >> 4);
    for ry in ((y0 & !15)..=y1).step_by(16) {
        for rx in ((x0 & !15)..=x1).step_by(16) {
            // A primitive inside one region goes straight to its blocks.
            if !single {
                let mut outside = false;
                let mut inside = true;
                for i in 0..3 {
                    let at = edges.c[i] + edges.a[i] * rx + edges.b[i] * ry;
                    outside |= at + 15 * (edges.a[i].max(0) + edges.b[i].max(0)) < 0;
                    inside &= at + 15 * (edges.a[i].min(0) + edges.b[i].min(0)) >= 0;
                }
                if outside {
                    continue;
                }
                let within_bounds = rx >= x0 && ry >= y0 && rx + 15 <= x1 && ry + 15 <= y1;
                if inside && (within_bounds || !rect) {
                    sink.region(simd, record, rx, ry);
                    continue;
                }
            }
            let part = [x0.max(rx), y0.max(ry), x1.min(rx + 15), y1.min(ry + 15)];
            walk_blocks(simd, record, &edges, part, rect, sink);
        }
    }
}

#[inline(always)]
fn walk_blocks<S: Simd, K: BlockSink<S>>(simd: S, record: &Record, edges: &WalkEdges<S>, part: [i32; 4], rect: bool, sink: &mut K) {
    let [x0, y0, x1, y1] = part;
    for by in ((y0 & !3)..=y1).step_by(4) {
        for bx in ((x0 & !3)..=x1).step_by(4) {
            let at = |i: usize| edges.lanes[i] + (edges.c[i] + edges.a[i] * bx + edges.b[i] * by);
            let mut outside = at(0) | at(1) | at(2);
            if rect {
                // The same trick for the four sides of the bounds.
                let column = i32x16::simd_from(simd, LANE_X);
                let row = i32x16::simd_from(simd, LANE_Y);
                let (left, right) = (column + (bx - x0), -column + (x1 - bx));
                let (top, bottom) = (row + (by - y0), -row + (y1 - by));
                outside = outside | left | right | top | bottom;
            }
            let mask = outside.simd_ge(i32x16::splat(simd, 0));
            if mask.any_true() {
                sink.block(simd, record, bx, by, mask);
            }
        }
    }
}
