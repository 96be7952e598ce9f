//! Bins: lists of the primitives that touch each tile, in submission order.
//!
//! A chunk of primitives fills bins of its own, so no locks are needed; later a tile walks the chunks in order. A bin holds the 64-byte set-up
//! primitive itself: small triangles are bound by memory latency, and reading a stream of primitives in tile order is twice as fast as following
//! indices. A primitive that touches more than [`WIDE_TILES`] tiles is kept once, in a list that every tile merges with its own by sequence number;
//! that bounds a chunk's memory.

use crate::primitive::tile_primitive::{SetupPrimitive, TilePrimitive};

/// Primitives per segment of a bin.
const SEGMENT: usize = 16;

/// Most tiles that a primitive is copied to; beyond, it is kept once.
pub(crate) const WIDE_TILES: u32 = 16;

#[derive(Clone, Copy, Default)]
struct Bin {
    head: u32,
    tail: u32,
    count: u32,
}

/// The bins of one chunk. Their allocations are kept between frames.
#[derive(Default)]
pub(crate) struct Bins {
    primitives: Vec<TilePrimitive>,
    next: Vec<u32>,
    segments_used: usize,
    bins: Vec<Bin>,
    pub wide: Vec<SetupPrimitive>,
    tiles_x: usize,
}

impl Bins {
    pub fn reset(&mut self, tiles_x: usize, tile_count: usize) {
        self.segments_used = 0;
        self.next.clear();
        self.bins.clear();
        self.bins.resize(tile_count, Bin::default());
        self.wide.clear();
        self.tiles_x = tiles_x;
    }

    /// Bytes of all primitives in the bins.
    pub fn bytes(&self) -> usize {
        self.segments_used * SEGMENT * size_of::<TilePrimitive>()
            + self.bins.len() * size_of::<Bin>()
            + self.wide.len() * size_of::<SetupPrimitive>()
    }

    /// Adds a primitive to the bins of all tiles that it touches.
    #[inline(always)]
    pub fn insert(&mut self, primitive: &SetupPrimitive) {
        let r = primitive.bounds;
        let (tx0, ty0, tx1, ty1) = (r.x0 >> 6, r.y0 >> 6, (r.x1 - 1) >> 6, (r.y1 - 1) >> 6);
        if tx0 == tx1 && ty0 == ty1 {
            if let Some(primitive) = primitive.primitive(tx0, ty0) {
                self.push(ty0 as usize * self.tiles_x + tx0 as usize, primitive);
            }
        } else if (tx1 - tx0 + 1) as u32 * (ty1 - ty0 + 1) as u32 > WIDE_TILES {
            self.wide.push(*primitive);
        } else {
            for ty in ty0..=ty1 {
                for tx in tx0..=tx1 {
                    if let Some(primitive) = primitive.primitive(tx, ty) {
                        self.push(ty as usize * self.tiles_x + tx as usize, primitive);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, tile: usize, primitive: TilePrimitive) {
        *self.next_slot(tile) = primitive;
    }

    /// The place for the next primitive of the tile in this row and column.
    #[inline(always)]
    pub fn slot(&mut self, row: usize, column: usize) -> &mut TilePrimitive {
        self.next_slot(row * self.tiles_x + column)
    }

    #[inline(always)]
    fn next_slot(&mut self, tile: usize) -> &mut TilePrimitive {
        let bin = &mut self.bins[tile];
        let slot = bin.count as usize % SEGMENT;
        if slot == 0 {
            let segment = self.segments_used as u32;
            self.segments_used += 1;
            if self.segments_used * SEGMENT > self.primitives.len() {
                self.primitives.resize(self.segments_used.max(64) * 2 * SEGMENT, TilePrimitive::default());
            }
            self.next.push(u32::MAX);
            if bin.count == 0 {
                bin.head = segment;
            } else {
                self.next[bin.tail as usize] = segment;
            }
            bin.tail = segment;
        }
        bin.count += 1;
        &mut self.primitives[bin.tail as usize * SEGMENT + slot]
    }

    /// The primitives of a tile's bin in order, as slices.
    pub fn segments(&self, tile: usize) -> impl Iterator<Item = &[TilePrimitive]> {
        let bin = self.bins[tile];
        let mut segment = bin.head as usize;
        let mut left = bin.count as usize;
        std::iter::from_fn(move || {
            if left == 0 {
                return None;
            }
            let count = left.min(SEGMENT);
            let primitives = &self.primitives[segment * SEGMENT..segment * SEGMENT + count];
            left -= count;
            segment = self.next[segment] as usize;
            Some(primitives)
        })
    }

    /// True if no primitive of the chunk touches the tile.
    pub fn is_untouched(&self, tile: usize) -> bool {
        self.bins[tile].count == 0 && self.wide.is_empty()
    }
}
