//! Textures: surfaces of one format, by mip level and layer.

use crate::api::format::depth::quantize_depth;
use crate::api::format::facts::FormatInfo;
use crate::api::format::quantize::Quantizer;
use crate::api::format::texel::{decode_texel, encode_texel};
use crate::api::rules::F16Rounding;
use crate::api::state::TextureFormat;
use crate::api::surface::Surface;
use crate::api::texture_descriptor::{TextureDescriptor, TextureError, TextureShape};

/// A texture: its description and its surfaces, all layers of level 0 first.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    desc: TextureDescriptor,
    info: FormatInfo,
    /// Number of each level's first surface.
    level_start: Vec<usize>,
    surfaces: Vec<Surface>,
}

impl Texture {
    /// A texture of zeros.
    ///
    /// # Errors
    /// If a part of the description is out of range, see [`TextureDescriptor::validate`].
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

    /// One 2D image of `size` (width and height, texels) with all its mip levels: `texel(x, y)` gives the numbers of level 0 as for
    /// [`Self::set_texel`], and [`Self::generate_mips`] makes the other levels.
    ///
    /// # Errors
    /// If the size or the format is not supported.
    pub fn mipmapped(
        label: impl Into<String>,
        size: (u32, u32),
        format: TextureFormat,
        texel: impl Fn(u32, u32) -> [f32; 4],
    ) -> Result<Self, TextureError> {
        let mip_level_count = 32 - size.0.max(size.1).leading_zeros();
        let mut texture = Self::new(TextureDescriptor { mip_level_count, ..TextureDescriptor::d2(label, size.0, size.1, format) })?;
        for y in 0..size.1 {
            for x in 0..size.0 {
                texture.set_texel(0, 0, x, y, texel(x, y));
            }
        }
        texture.generate_mips();
        Ok(texture)
    }

    /// The description that the texture was made from.
    #[must_use]
    pub fn desc(&self) -> &TextureDescriptor {
        &self.desc
    }
    /// The format's facts.
    #[must_use]
    pub fn info(&self) -> FormatInfo {
        self.info
    }
    /// The surface of a level and layer; both are clamped to what exists.
    #[inline(always)]
    #[must_use]
    pub fn surface(&self, level: u32, layer: u32) -> &Surface {
        &self.surfaces[self.surface_index(level, layer)]
    }
    /// The surface of a level and layer, to write to; both are clamped to what exists.
    pub(crate) fn surface_mut(&mut self, level: u32, layer: u32) -> &mut Surface {
        let index = self.surface_index(level, layer);
        &mut self.surfaces[index]
    }

    #[inline(always)]
    fn surface_index(&self, level: u32, layer: u32) -> usize {
        let level = (level as usize).min(self.level_start.len() - 1);
        let end = self.level_start.get(level + 1).copied().unwrap_or(self.surfaces.len());
        (self.level_start[level] + layer as usize).min(end - 1)
    }

    /// Writes a texel. Each number is rounded to what the format can hold: depth is clamped to 0..=1, integers are given as bit patterns. Channels
    /// that the format lacks are ignored.
    ///
    /// # Panics
    /// If the texel is outside of the surface.
    pub fn set_texel(&mut self, level: u32, layer: u32, x: u32, y: u32, values: [f32; 4]) {
        let info = self.info;
        let surface = self.surface_mut(level, layer);
        assert!(x < surface.width && y < surface.height, "texel ({x}, {y}) of {}x{}", surface.width, surface.height);
        let quantizer = Quantizer::new(info.kind, F16Rounding::NearestEven);
        for (channel, value) in values.into_iter().enumerate().take(info.channels) {
            let stored = if info.depth { quantize_depth(info.kind, value.clamp(0.0, 1.0)) } else { quantizer.apply(value, channel) };
            surface.set(x, y, channel, stored);
        }
    }

    /// Writes the stencil value of a texel; does nothing if the format has no stencil.
    pub fn set_stencil(&mut self, level: u32, layer: u32, x: u32, y: u32, value: u8) {
        self.surface_mut(level, layer).set_stencil(x, y, value);
    }

    /// The description, the number of each level's first surface, and the surfaces.
    pub(crate) fn parts(&self) -> (&TextureDescriptor, &[usize], &[Surface]) {
        (&self.desc, &self.level_start, &self.surfaces)
    }

    /// As [`Self::parts`], with the surfaces to write to.
    pub(crate) fn parts_mut(&mut self) -> (&TextureDescriptor, &[usize], &mut [Surface]) {
        (&self.desc, &self.level_start, &mut self.surfaces)
    }

    /// Fills a surface from the format's bytes, rows top down, tightly packed.
    ///
    /// # Errors
    /// If the texture does not have the surface, or `bytes` has another length than the surface.
    pub fn write_bytes(&mut self, level: u32, layer: u32, bytes: &[u8]) -> Result<(), TextureError> {
        let info = self.info;
        let label = self.desc.label.clone();
        if !self.desc.has_surface(level, layer) {
            return Err(TextureError::NoSurface { label, level, layer });
        }
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

    /// The surface in the format's bytes, rows top down, tightly packed, followed by the stencil bytes if the format has a stencil.
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

    /// Fills mip levels 1.. by averaging 2x2 texels (2x2x2 in a volume) of the level above, rounded to what the format can hold. At odd sizes the
    /// last texel is repeated. Integers have no mean; the first of the texels is taken.
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
