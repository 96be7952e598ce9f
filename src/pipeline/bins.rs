//! Bins: which primitives touch which tile, in submission order.
//!
//! A chunk of primitives fills its own bins, so no locks are needed; a tile later walks the chunks in order. A bin holds
//! the 64-byte set-up record itself, because small triangles are bound by memory latency and a stream of records in tile order beats chasing indices
//! by a factor of two. A primitive over more than [`WIDE_TILES`] tiles is kept once, in a list that every tile merges with its own by sequence
//! number; that bounds a chunk's memory.

use super::setup::{Edges, ZPlane};
use super::state::PixelRect;
use super::texture::TILE;

/// Records per segment of a bin.
const SEGMENT: usize = 16;
/// Most tiles that a primitive is copied to.
pub(super) const WIDE_TILES: u32 = 16;

/// [`Record::flags`].
pub(super) mod flag {
    /// Edge `i` (bit `i`) is not negative anywhere in the tile.
    pub const ACCEPT: u32 = 7;
    /// Coverage must be cut to the record's bounds.
    pub const RECT: u32 = 8;
    /// Depth may leave the viewport's range and must be clamped.
    pub const CLAMP_Z: u32 = 16;
    /// The primitive faces away.
    pub const BACK: u32 = 32;
    /// First bit of the depth anchor's sixteenths, four for x, then four for y.
    pub const SIXTEENTHS: u32 = 8;
    /// First of eight bits: the exponent of the bias' unit, for rules that add the bias last.
    pub const BIAS_EXPONENT: u32 = 16;
}

/// One primitive in one tile.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct Record {
    /// Edge functions at the tile's first pixel.
    pub c: [i32; 3],
    /// Per pixel right, edges 0 and 1; the three sum to zero.
    pub a: [i32; 2],
    /// Per pixel down.
    pub b: [i32; 2],
    /// Depth at the anchor, per pixel right, per pixel down.
    pub z: [f32; 3],
    /// The depth plane's anchor in pixels of the target.
    pub anchor: [i16; 2],
    /// First and last column and row, in pixels of the tile: x0, y0, x1, y1, inclusive.
    pub bounds: [u8; 4],
    /// Which draw of the pass.
    pub draw: u32,
    /// Which entry of the chunk's interpolation data.
    pub attributes: u32,
    /// Place in the chunk's submission order.
    pub sequence: u32,
    pub flags: u32,
}

const _: () = assert!(size_of::<Record>() == 64, "a record is one cache line");

/// A set-up primitive before it is cut into tiles.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prepared {
    pub edges: Edges,
    pub z: ZPlane,
    pub bounds: PixelRectI,
    pub draw: u32,
    pub attributes: u32,
    pub sequence: u32,
    pub flags: u32,
}

/// A pixel rectangle that can be default; half-open.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelRectI {
    pub x0: i32,
    pub y0: i32,
    pub x1: i32,
    pub y1: i32,
}

impl From<PixelRect> for PixelRectI {
    fn from(r: PixelRect) -> Self {
        Self { x0: r.x0 as i32, y0: r.y0 as i32, x1: r.x1 as i32, y1: r.y1 as i32 }
    }
}

impl Prepared {
    /// The record for a tile, or `None` if the bounds do not touch it or an edge excludes it.
    #[inline(always)]
    pub fn record_in(&self, [tx, ty]: [i32; 2]) -> Option<Record> {
        let r = self.bounds;
        let touches = r.x0 >> 6 <= tx && (r.x1 - 1) >> 6 >= tx && r.y0 >> 6 <= ty && (r.y1 - 1) >> 6 >= ty;
        if touches { self.record(tx, ty) } else { None }
    }

    /// The record for tile (tx, ty), which the bounds touch; `None` if an edge excludes the whole tile.
    #[inline(always)]
    pub fn record(&self, tx: i32, ty: i32) -> Option<Record> {
        let (x0, y0) = (tx * TILE as i32, ty * TILE as i32);
        let mut flags = self.flags;
        let mut c = [0; 3];
        for (i, c) in c.iter_mut().enumerate() {
            let (a, b) = (i64::from(self.edges.a[i]), i64::from(self.edges.b[i]));
            let at_origin = self.edges.c[i] + a * i64::from(x0) + b * i64::from(y0);
            let span = TILE as i64 - 1;
            let high = at_origin + (a.max(0) + b.max(0)) * span;
            let low = at_origin + (a.min(0) + b.min(0)) * span;
            if high < 0 {
                return None;
            }
            if low >= 0 {
                flags |= 1 << i;
            } else {
                *c = at_origin as i32;
            }
        }
        let clamp = |v: i32, origin: i32| (v - origin).clamp(0, TILE as i32 - 1) as u8;
        let r = self.bounds;
        Some(Record {
            c,
            a: [self.edges.a[0], self.edges.a[1]],
            b: [self.edges.b[0], self.edges.b[1]],
            z: [self.z.base, self.z.dx, self.z.dy],
            anchor: [self.z.anchor[0] as i16, self.z.anchor[1] as i16],
            bounds: [clamp(r.x0, x0), clamp(r.y0, y0), clamp(r.x1 - 1, x0), clamp(r.y1 - 1, y0)],
            draw: self.draw,
            attributes: self.attributes,
            sequence: self.sequence,
            flags,
        })
    }
}

#[derive(Clone, Copy, Default)]
struct Bin {
    head: u32,
    tail: u32,
    count: u32,
}

/// The bins of one chunk. Buffers are kept between frames.
#[derive(Default)]
pub(super) struct Bins {
    records: Vec<Record>,
    next: Vec<u32>,
    segments_used: usize,
    bins: Vec<Bin>,
    pub wide: Vec<Prepared>,
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

    /// Bytes in use.
    pub fn bytes(&self) -> usize {
        self.segments_used * SEGMENT * size_of::<Record>() + self.bins.len() * size_of::<Bin>() + self.wide.len() * size_of::<Prepared>()
    }

    /// Adds a primitive to every tile that it touches.
    #[inline(always)]
    pub fn insert(&mut self, primitive: &Prepared) {
        let r = primitive.bounds;
        let (tx0, ty0, tx1, ty1) = (r.x0 >> 6, r.y0 >> 6, (r.x1 - 1) >> 6, (r.y1 - 1) >> 6);
        if tx0 == tx1 && ty0 == ty1 {
            if let Some(record) = primitive.record(tx0, ty0) {
                self.push(ty0 as usize * self.tiles_x + tx0 as usize, record);
            }
        } else if (tx1 - tx0 + 1) as u32 * (ty1 - ty0 + 1) as u32 > WIDE_TILES {
            self.wide.push(*primitive);
        } else {
            for ty in ty0..=ty1 {
                for tx in tx0..=tx1 {
                    if let Some(record) = primitive.record(tx, ty) {
                        self.push(ty as usize * self.tiles_x + tx as usize, record);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, tile: usize, record: Record) {
        *self.next_slot(tile) = record;
    }

    /// Where the next record of the tile in this row and column goes.
    #[inline(always)]
    pub fn slot(&mut self, row: usize, column: usize) -> &mut Record {
        self.next_slot(row * self.tiles_x + column)
    }

    #[inline(always)]
    fn next_slot(&mut self, tile: usize) -> &mut Record {
        let bin = &mut self.bins[tile];
        let slot = bin.count as usize % SEGMENT;
        if slot == 0 {
            let segment = self.segments_used as u32;
            self.segments_used += 1;
            if self.segments_used * SEGMENT > self.records.len() {
                self.records.resize(self.segments_used.max(64) * 2 * SEGMENT, Record::default());
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
        &mut self.records[bin.tail as usize * SEGMENT + slot]
    }

    /// The segments of a tile's bin, in order.
    pub fn segments(&self, tile: usize) -> impl Iterator<Item = &[Record]> {
        let bin = self.bins[tile];
        let mut segment = bin.head as usize;
        let mut left = bin.count as usize;
        std::iter::from_fn(move || {
            if left == 0 {
                return None;
            }
            let count = left.min(SEGMENT);
            let records = &self.records[segment * SEGMENT..segment * SEGMENT + count];
            left -= count;
            segment = self.next[segment] as usize;
            Some(records)
        })
    }

    /// True if nothing touches the tile.
    pub fn is_untouched(&self, tile: usize) -> bool {
        self.bins[tile].count == 0 && self.wide.is_empty()
    }
}
