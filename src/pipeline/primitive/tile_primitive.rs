//! Set-up primitives: whole, and cut to one tile.

use crate::api::state::PixelRect;
use crate::api::surface::TILE;
use crate::primitive::planes::{Edges, ZPlane};

/// Bits of [`TilePrimitive::flags`].
pub(crate) mod flag {
    /// Bit `i` is set if edge function `i` is not negative anywhere in the tile.
    pub const ACCEPT: u32 = 7;
    /// Coverage must be masked by the primitive's bounds.
    pub const RECT: u32 = 8;
    /// Depth may leave the viewport's range and must be clamped.
    pub const CLAMP_Z: u32 = 16;
    /// The primitive is back-facing.
    pub const BACK: u32 = 32;
    /// First bit of the sixteenths of a pixel of the depth anchor: four bits for x, then four for y.
    pub const SIXTEENTHS: u32 = 8;
    /// First of eight bits: the exponent that gives the unit of the bias, for rules that add the bias last.
    pub const BIAS_EXPONENT: u32 = 16;
}

/// One primitive in one tile.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct TilePrimitive {
    /// Values of the edge functions at the tile's first pixel.
    pub c: [i32; 3],
    /// Change of edge functions 0 and 1 per pixel right; the three changes sum to zero.
    pub a: [i32; 2],
    /// Change of edge functions 0 and 1 per pixel down.
    pub b: [i32; 2],
    /// Depth plane: value at the anchor, change per pixel right and per pixel down.
    pub z: [f32; 3],
    /// The depth plane's anchor in pixels of the target.
    pub anchor: [i16; 2],
    /// First and last column and row, in pixels of the tile: x0, y0, x1, y1, inclusive.
    pub bounds: [u8; 4],
    /// Number of the draw in the pass.
    pub draw: u32,
    /// Index in the chunk's interpolation data.
    pub attributes: u32,
    /// Place in the chunk's submission order.
    pub sequence: u32,
    pub flags: u32,
}

const _: () = assert!(size_of::<TilePrimitive>() == 64, "a primitive is one cache line");

/// A set-up primitive before it is cut into tiles.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SetupPrimitive {
    pub edges: Edges,
    pub z: ZPlane,
    pub bounds: PixelRectI,
    pub draw: u32,
    pub attributes: u32,
    pub sequence: u32,
    pub flags: u32,
}

/// A half-open pixel rectangle with a default value.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelRectI {
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

impl SetupPrimitive {
    /// Cuts the primitive to a tile; `None` if the bounds do not touch the tile or an edge excludes it.
    #[inline(always)]
    pub fn in_tile(&self, [tx, ty]: [i32; 2]) -> Option<TilePrimitive> {
        let r = self.bounds;
        let touches = r.x0 >> 6 <= tx && (r.x1 - 1) >> 6 >= tx && r.y0 >> 6 <= ty && (r.y1 - 1) >> 6 >= ty;
        if touches { self.primitive(tx, ty) } else { None }
    }

    /// Cuts the primitive to tile (tx, ty), which the bounds must touch; `None` if an edge excludes the whole tile.
    #[inline(always)]
    pub fn primitive(&self, tx: i32, ty: i32) -> Option<TilePrimitive> {
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
        Some(TilePrimitive {
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
