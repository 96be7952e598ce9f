//! Surfaces: pixels stored as 64x64 tiles of planar f32, in the order in which the rasterizer visits them.
//!
//! A *surface* is one layer of one mip level. Its tiles follow each other row by row. A tile holds 4096 numbers per channel: sixteen 16x16 regions
//! row by row, each of sixteen 4x4 blocks row by row, each of 16 pixels row by row. A block is one 64-byte cache line, a region one kilobyte and a
//! tile's channel 16 KiB. The worker that owns a tile works in place on a contiguous slice: tiles are loaded and stored without conversion, and
//! flushing a pass in waves costs nothing.
//!
//! Road not taken: keeping each format's own bytes in rows. It needs a conversion on each load and store of a tile, and a gather for each block that
//! a shader reads. The price of tiles is memory: an 8-bit channel takes four bytes, and sizes are rounded up to whole tiles.

use nephroid_math::lanes::Lanes;

use crate::api::format::facts::FormatInfo;

/// Pixels along a tile's edge.
pub const TILE: usize = 64;

/// Pixels in a tile.
pub const TILE_PIXELS: usize = TILE * TILE;

/// Index of a pixel in its tile's plane; `x` and `y` are taken modulo 64.
#[inline(always)]
#[must_use]
pub fn offset_in_tile(x: usize, y: usize) -> usize {
    let region = ((y >> 4) & 3) * 4 + ((x >> 4) & 3);
    let block = ((y >> 2) & 3) * 4 + ((x >> 2) & 3);
    region * 256 + block * 16 + (y & 3) * 4 + (x & 3)
}

/// One layer of one mip level.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// Tiles across.
    pub tiles_x: usize,
    /// Colour or depth planes.
    pub channels: usize,
    /// `[tile][channel][4096]`.
    pub planes: Vec<f32>,
    /// `[tile][4096]`, empty without stencil.
    pub stencil: Vec<u8>,
}

impl Surface {
    pub(crate) fn new(width: u32, height: u32, info: FormatInfo) -> Self {
        let tiles_x = width.div_ceil(64) as usize;
        let tiles = tiles_x * height.div_ceil(64) as usize;
        Self {
            width,
            height,
            tiles_x,
            channels: info.channels,
            planes: vec![0.0; tiles * info.channels * TILE_PIXELS],
            stencil: vec![0; if info.stencil { tiles * TILE_PIXELS } else { 0 }],
        }
    }

    /// Tiles in all.
    #[must_use]
    pub fn tile_count(&self) -> usize {
        self.tiles_x * self.height.div_ceil(64) as usize
    }

    /// Index of a texel's channel 0 in `planes`; channel `c` is `c·4096` numbers further on.
    #[inline(always)]
    #[must_use]
    pub fn plane_index(&self, x: usize, y: usize) -> usize {
        self.row_index(y) + self.column_index(x)
    }

    /// The row's term of [`Self::plane_index`].
    #[inline(always)]
    fn row_index(&self, y: usize) -> usize {
        (y >> 6) * (self.tiles_x * self.channels * TILE_PIXELS) + offset_in_tile(0, y)
    }

    /// The column's term of [`Self::plane_index`].
    #[inline(always)]
    fn column_index(&self, x: usize) -> usize {
        (x >> 6) * (self.channels * TILE_PIXELS) + offset_in_tile(x, 0)
    }

    /// The terms of [`Self::plane_index`] for the rows in the lanes.
    #[inline(always)]
    pub(crate) fn row_indices<L: Lanes>(&self, y: L) -> [i32; 16] {
        let mut rows = y.to_i32();
        for row in &mut rows {
            *row = self.row_index(*row as usize) as i32;
        }
        rows
    }

    /// The terms of [`Self::plane_index`] for the columns in the lanes.
    #[inline(always)]
    pub(crate) fn column_indices<L: Lanes>(&self, x: L) -> [i32; 16] {
        let mut columns = x.to_i32();
        for column in &mut columns {
            *column = self.column_index(*column as usize) as i32;
        }
        columns
    }

    /// One channel of a texel inside the surface.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, x: u32, y: u32, channel: usize) -> f32 {
        self.planes[self.plane_index(x as usize, y as usize) + channel * TILE_PIXELS]
    }

    /// Writes one channel of a texel inside the surface; the format must be able to hold `value`.
    pub(crate) fn set(&mut self, x: u32, y: u32, channel: usize, value: f32) {
        let index = self.plane_index(x as usize, y as usize) + channel * TILE_PIXELS;
        self.planes[index] = value;
    }

    /// Stencil value of a texel inside the surface; 0 where there is no stencil plane.
    #[must_use]
    pub fn stencil_at(&self, x: u32, y: u32) -> u8 {
        let (x, y) = (x as usize, y as usize);
        self.stencil.get(((y >> 6) * self.tiles_x + (x >> 6)) * TILE_PIXELS + offset_in_tile(x, y)).copied().unwrap_or(0)
    }

    /// Writes the stencil value of a texel inside the surface; does nothing without a stencil plane.
    pub(crate) fn set_stencil(&mut self, x: u32, y: u32, value: u8) {
        let (x, y) = (x as usize, y as usize);
        if let Some(slot) = self.stencil.get_mut(((y >> 6) * self.tiles_x + (x >> 6)) * TILE_PIXELS + offset_in_tile(x, y)) {
            *slot = value;
        }
    }

    /// The 16 numbers of one channel of the 4x4 block that holds texel (x, y).
    #[inline(always)]
    #[must_use]
    pub fn block(&self, x: usize, y: usize, channel: usize) -> &[f32] {
        let start = (self.plane_index(x, y) & !15) + channel * TILE_PIXELS;
        &self.planes[start..start + 16]
    }
}
