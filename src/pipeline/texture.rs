//! Textures: every one is kept as 64x64 tiles of planar f32, in the order in which the rasterizer walks pixels.
//!
//! A *surface* is one layer of one mip level. Its tiles follow each other row by row; a tile holds, per channel, 4096
//! numbers: sixteen 16x16 regions row by row, each of sixteen 4x4 blocks row by row, each of 16 pixels row by row. So
//! a block is one 64-byte line, a region one kilobyte and a tile's channel 16 KiB, and the worker that owns a tile works in place on a contiguous
//! slice: there is no load or store conversion, and flushing a pass in waves costs nothing. The road not taken, keeping each
//! format's own bytes in rows, needs a conversion on each tile load and store and a gather for each block read by a shader.
//! The price is memory: an 8-bit channel takes four bytes, and sizes round up to whole tiles.

use nephroid_math::lanes::Lanes;

use super::format::{ChannelKind, FormatInfo, decode_texel, depth_value, encode_texel, format_info};
use super::state::TextureFormat;

/// Pixels along a tile's edge.
pub const TILE: usize = 64;
/// Pixels in a tile.
pub const TILE_PIXELS: usize = TILE * TILE;
/// Largest width or height of a texture.
pub const MAX_SIZE: u32 = 16384;

/// Place of a pixel inside its tile's plane; `x` and `y` are taken modulo 64.
#[inline(always)]
#[must_use]
pub fn offset_in_tile(x: usize, y: usize) -> usize {
    let region = ((y >> 4) & 3) * 4 + ((x >> 4) & 3);
    let block = ((y >> 2) & 3) * 4 + ((x >> 2) & 3);
    region * 256 + block * 16 + (y & 3) * 4 + (x & 3)
}

/// What shape a texture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureShape {
    /// Layers of 2D images; one layer for a plain texture.
    D2,
    /// Six layers: +X −X +Y −Y +Z −Z.
    Cube,
    /// Slices of a volume; each mip level halves the depth as well.
    D3,
}

/// What is wrong with a texture's description or data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TextureError {
    /// Zero or too large.
    #[error("texture `{label}`: size {width}x{height}x{depth} is outside 1..={MAX_SIZE} (depth or layers: 1..=2048)")]
    Size {
        /// The texture's label.
        label: String,
        /// Width seen.
        width: u32,
        /// Height seen.
        height: u32,
        /// Depth or layers seen.
        depth: u32,
    },
    /// Not a supported format.
    #[error("texture `{label}`: format {format:?} is not supported; supported: {}", super::format::SUPPORTED_FORMATS)]
    Format {
        /// The texture's label.
        label: String,
        /// Format seen.
        format: TextureFormat,
    },
    /// More mip levels than the size has.
    #[error("texture `{label}`: {levels} mip levels, the size allows 1..={allowed}")]
    MipLevels {
        /// The texture's label.
        label: String,
        /// Levels seen.
        levels: u32,
        /// Most that the size allows.
        allowed: u32,
    },
    /// A cube needs six square layers.
    #[error("texture `{label}`: a cube needs width = height and 6 layers, not {width}x{height}x{depth}")]
    Cube {
        /// The texture's label.
        label: String,
        /// Width seen.
        width: u32,
        /// Height seen.
        height: u32,
        /// Layers seen.
        depth: u32,
    },
    /// The bytes given are not the surface's.
    #[error("texture `{label}`: {seen} bytes given, the surface has {expected}")]
    Data {
        /// The texture's label.
        label: String,
        /// Bytes seen.
        seen: usize,
        /// Bytes expected.
        expected: usize,
    },
}

/// Size, format and shape of a texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureDescriptor {
    /// Name in errors and captures.
    pub label: String,
    /// Texels across, 1..=16384.
    pub width: u32,
    /// Texels down, 1..=16384.
    pub height: u32,
    /// Layers, or slices of a volume. Default: 1.
    pub depth_or_layers: u32,
    /// Mip levels. Default: 1.
    pub mip_level_count: u32,
    /// What a texel holds.
    pub format: TextureFormat,
    /// Layers, cube or volume. Default: layers.
    pub shape: TextureShape,
}

impl TextureDescriptor {
    /// One 2D image.
    pub fn d2(label: impl Into<String>, width: u32, height: u32, format: TextureFormat) -> Self {
        Self { label: label.into(), width, height, depth_or_layers: 1, mip_level_count: 1, format, shape: TextureShape::D2 }
    }

    /// The format's facts, if everything about the description is in range.
    pub fn validate(&self) -> Result<FormatInfo, TextureError> {
        let Self { width, height, depth_or_layers: depth, .. } = *self;
        let label = || self.label.clone();
        if !(1..=MAX_SIZE).contains(&width) || !(1..=MAX_SIZE).contains(&height) || !(1..=2048).contains(&depth) {
            return Err(TextureError::Size { label: label(), width, height, depth });
        }
        if self.shape == TextureShape::Cube && (width != height || depth != 6) {
            return Err(TextureError::Cube { label: label(), width, height, depth });
        }
        let allowed = 32 - width.max(height).leading_zeros();
        if !(1..=allowed).contains(&self.mip_level_count) {
            return Err(TextureError::MipLevels { label: label(), levels: self.mip_level_count, allowed });
        }
        format_info(self.format).ok_or(TextureError::Format { label: label(), format: self.format })
    }

    /// Size of a mip level: width, height, and layers or slices.
    #[must_use]
    pub fn level_size(&self, level: u32) -> (u32, u32, u32) {
        let depth = if self.shape == TextureShape::D3 { (self.depth_or_layers >> level).max(1) } else { self.depth_or_layers };
        ((self.width >> level).max(1), (self.height >> level).max(1), depth)
    }

    /// Bytes of memory the texture takes, known before it is made. Zero for an unsupported format.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        let Some(info) = format_info(self.format) else { return 0 };
        let per_tile = (info.channels * 4 + usize::from(info.stencil)) as u64 * TILE_PIXELS as u64;
        (0..self.mip_level_count)
            .map(|level| {
                let (width, height, depth) = self.level_size(level);
                u64::from(width.div_ceil(64)) * u64::from(height.div_ceil(64)) * u64::from(depth) * per_tile
            })
            .sum()
    }
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
    fn new(width: u32, height: u32, info: FormatInfo) -> Self {
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

    /// Place of a texel's channel 0 in `planes`; channel `c` is `c·4096` further on.
    #[inline(always)]
    #[must_use]
    pub fn plane_index(&self, x: usize, y: usize) -> usize {
        self.row_index(y) + self.column_index(x)
    }

    /// The part of [`Self::plane_index`] that the row gives.
    #[inline(always)]
    fn row_index(&self, y: usize) -> usize {
        (y >> 6) * (self.tiles_x * self.channels * TILE_PIXELS) + offset_in_tile(0, y)
    }

    /// The part of [`Self::plane_index`] that the column gives.
    #[inline(always)]
    fn column_index(&self, x: usize) -> usize {
        (x >> 6) * (self.channels * TILE_PIXELS) + offset_in_tile(x, 0)
    }

    /// What the rows of lanes give to [`Self::plane_index`].
    #[inline(always)]
    pub(super) fn row_indices<L: Lanes>(&self, y: L) -> [i32; 16] {
        let mut rows = y.to_i32();
        for row in &mut rows {
            *row = self.row_index(*row as usize) as i32;
        }
        rows
    }

    /// What the columns of lanes give to [`Self::plane_index`].
    #[inline(always)]
    pub(super) fn column_indices<L: Lanes>(&self, x: L) -> [i32; 16] {
        let mut columns = x.to_i32();
        for column in &mut columns {
            *column = self.column_index(*column as usize) as i32;
        }
        columns
    }

    /// One number of a texel inside the surface.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, x: u32, y: u32, channel: usize) -> f32 {
        self.planes[self.plane_index(x as usize, y as usize) + channel * TILE_PIXELS]
    }

    /// Writes one number of a texel inside the surface, unrounded.
    pub fn set(&mut self, x: u32, y: u32, channel: usize, value: f32) {
        let index = self.plane_index(x as usize, y as usize) + channel * TILE_PIXELS;
        self.planes[index] = value;
    }

    /// Stencil value of a texel inside the surface; 0 where there is no stencil plane.
    #[must_use]
    pub fn stencil_at(&self, x: u32, y: u32) -> u8 {
        let (x, y) = (x as usize, y as usize);
        self.stencil.get(((y >> 6) * self.tiles_x + (x >> 6)) * TILE_PIXELS + offset_in_tile(x, y)).copied().unwrap_or(0)
    }

    /// Writes the stencil value of a texel inside the surface; nothing where there is no stencil plane.
    pub fn set_stencil(&mut self, x: u32, y: u32, value: u8) {
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

/// A texture: its description and its surfaces, levels outermost.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    desc: TextureDescriptor,
    info: FormatInfo,
    /// First surface of each level.
    level_start: Vec<usize>,
    surfaces: Vec<Surface>,
}

impl Texture {
    /// A texture of zeros.
    pub fn new(desc: TextureDescriptor) -> Result<Self, TextureError> {
        let info = desc.validate()?;
        let mut level_start = Vec::new();
        let mut surfaces = Vec::new();
        for level in 0..desc.mip_level_count {
            level_start.push(surfaces.len());
            let (width, height, depth) = desc.level_size(level);
            surfaces.extend((0..depth).map(|_| Surface::new(width, height, info)));
        }
        Ok(Self { desc, info, level_start, surfaces })
    }

    /// The description it was made from.
    #[must_use]
    pub fn desc(&self) -> &TextureDescriptor {
        &self.desc
    }
    /// The format's facts.
    #[must_use]
    pub fn info(&self) -> FormatInfo {
        self.info
    }
    /// A surface; `level` and `layer` are clamped to what exists.
    #[inline(always)]
    #[must_use]
    pub fn surface(&self, level: u32, layer: u32) -> &Surface {
        &self.surfaces[self.surface_index(level, layer)]
    }
    /// A surface to draw to; `level` and `layer` are clamped to what exists.
    pub fn surface_mut(&mut self, level: u32, layer: u32) -> &mut Surface {
        let index = self.surface_index(level, layer);
        &mut self.surfaces[index]
    }

    #[inline(always)]
    fn surface_index(&self, level: u32, layer: u32) -> usize {
        let level = (level as usize).min(self.level_start.len() - 1);
        let end = self.level_start.get(level + 1).copied().unwrap_or(self.surfaces.len());
        (self.level_start[level] + layer as usize).min(end - 1)
    }

    /// What a shader reads from a texel inside the surface: missing channels are 0, missing alpha 1, depth in 0..=1.
    /// Of integer formats all four are bit patterns of integers.
    #[inline(always)]
    #[must_use]
    pub fn texel(&self, level: u32, layer: u32, x: u32, y: u32) -> [f32; 4] {
        let surface = self.surface(level, layer);
        self.texel_at(surface, surface.plane_index(x as usize, y as usize))
    }

    /// [`Self::texel`] by its place in the planes of one of this texture's surfaces.
    #[inline(always)]
    pub(super) fn texel_at(&self, surface: &Surface, index: usize) -> [f32; 4] {
        let mut out = [0.0, 0.0, 0.0, self.info.kind.missing_alpha()];
        for (channel, slot) in out.iter_mut().enumerate().take(surface.channels) {
            *slot = surface.planes[index + channel * TILE_PIXELS];
        }
        if let ChannelKind::UnormDepth(_) = self.info.kind {
            out[0] = depth_value(self.info.kind, out[0]);
        }
        out
    }

    /// Fills a surface from the format's bytes, rows top down, tightly packed.
    pub fn write_bytes(&mut self, level: u32, layer: u32, bytes: &[u8]) -> Result<(), TextureError> {
        let info = self.info;
        let label = self.desc.label.clone();
        let surface = self.surface_mut(level, layer);
        let expected = surface.width as usize * surface.height as usize * info.bytes;
        if bytes.len() != expected {
            return Err(TextureError::Data { label, seen: bytes.len(), expected });
        }
        for (i, texel) in bytes.chunks_exact(info.bytes.max(1)).enumerate() {
            let (x, y) = (i as u32 % surface.width, i as u32 / surface.width);
            let values = decode_texel(info, texel);
            for (channel, &value) in values.iter().enumerate().take(info.channels) {
                surface.set(x, y, channel, value);
            }
        }
        Ok(())
    }

    /// The format's bytes of a surface, rows top down, tightly packed; then the stencil bytes if there are any.
    #[must_use]
    pub fn read_bytes(&self, level: u32, layer: u32) -> Vec<u8> {
        let surface = self.surface(level, layer);
        let texels = surface.width as usize * surface.height as usize;
        let mut bytes = Vec::with_capacity(texels * (self.info.bytes + usize::from(self.info.stencil)));
        for y in 0..surface.height {
            for x in 0..surface.width {
                let mut values = [0.0; 4];
                for (channel, value) in values.iter_mut().enumerate().take(surface.channels) {
                    *value = surface.get(x, y, channel);
                }
                encode_texel(self.info, &values, &mut bytes);
            }
        }
        if self.info.stencil {
            for y in 0..surface.height {
                bytes.extend((0..surface.width).map(|x| surface.stencil_at(x, y)));
            }
        }
        bytes
    }

    /// One channel of a surface as rows of numbers, top down.
    #[must_use]
    pub fn read_channel(&self, level: u32, layer: u32, channel: usize) -> Vec<f32> {
        let surface = self.surface(level, layer);
        (0..surface.height).flat_map(|y| (0..surface.width).map(move |x| surface.get(x, y, channel))).collect()
    }

    /// Fills mip levels 1.. by averaging 2x2 texels (2x2x2 in a volume) of the level above, rounded to what the format can hold; odd edges repeat
    /// the last texel. Integers have no mean: the first of the texels is taken.
    pub fn generate_mips(&mut self) {
        let mut bytes = Vec::new();
        for level in 1..self.desc.mip_level_count {
            let (width, height, depth) = self.desc.level_size(level);
            let (above_width, above_height, above_depth) = self.desc.level_size(level - 1);
            for layer in 0..depth {
                let layers: &[u32] = if self.desc.shape == TextureShape::D3 {
                    &[(2 * layer).min(above_depth - 1), (2 * layer + 1).min(above_depth - 1)]
                } else {
                    &[layer]
                };
                for y in 0..height {
                    for x in 0..width {
                        let mut mean = [0.0; 4];
                        for (channel, mean) in mean.iter_mut().enumerate().take(self.info.channels) {
                            if self.info.kind.is_integer() {
                                *mean = self.surface(level - 1, layers[0]).get(2 * x, 2 * y, channel);
                                continue;
                            }
                            let mut sum = 0.0;
                            for &from in layers {
                                let above = self.surface(level - 1, from);
                                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                                    let (sx, sy) = ((2 * x + dx).min(above_width - 1), (2 * y + dy).min(above_height - 1));
                                    sum += above.get(sx, sy, channel);
                                }
                            }
                            *mean = sum / (4 * layers.len()) as f32;
                        }
                        bytes.clear();
                        encode_texel(self.info, &mean, &mut bytes);
                        let rounded = decode_texel(self.info, &bytes);
                        for (channel, &value) in rounded.iter().enumerate().take(self.info.channels) {
                            self.surface_mut(level, layer).set(x, y, channel, value);
                        }
                    }
                }
            }
        }
    }
}
