//! Views: the levels and layers of a texture that a shader reads, or the surface that a pass draws to.
//!
//! A [`TextureView`] shows levels and layers of a texture to shaders; a [`TextureViewMut`] is one surface, for an attachment. [`Texture::split`]
//! lends a texture as both at once, where they do not overlap: a pass can draw a mip level from the one above it.

use crate::api::format::depth::depth_value;
use crate::api::format::facts::{ChannelKind, FormatInfo};
use crate::api::state::TextureFormat;
use crate::api::surface::{Surface, TILE_PIXELS};
use crate::api::texture::Texture;
use crate::api::texture_descriptor::{TextureDescriptor, TextureError, TextureShape, TextureViewDescriptor, ViewRange};

/// The surfaces of a texture, in the order in which [`Texture`] keeps them.
#[derive(Clone, Copy, Debug)]
enum Surfaces<'a> {
    All(&'a [Surface]),
    /// All surfaces, with `None` in place of those that are drawn to.
    Unattached(&'a [Option<&'a Surface>]),
}

/// Levels and layers of a texture, for shaders to read.
///
/// WebGPU: [`GPUTextureView`](https://www.w3.org/TR/webgpu/#gputextureview).
#[derive(Clone, Copy, Debug)]
pub struct TextureView<'a> {
    desc: &'a TextureDescriptor,
    info: FormatInfo,
    /// Number of the first surface of each level of the texture.
    level_start: &'a [usize],
    surfaces: Surfaces<'a>,
    base_level: u32,
    levels: u32,
    base_layer: u32,
    layers: u32,
    shape: TextureShape,
}

impl<'a> TextureView<'a> {
    fn new(
        desc: &'a TextureDescriptor,
        info: FormatInfo,
        level_start: &'a [usize],
        surfaces: Surfaces<'a>,
        view: &TextureViewDescriptor,
    ) -> Result<Self, TextureError> {
        let ViewRange { levels, layers, shape } = desc.view_range(view)?;
        let (base_level, base_layer) = (levels.start, layers.start);
        let layers = layers.len() as u32;
        Ok(Self { desc, info, level_start, surfaces, base_level, levels: levels.len() as u32, base_layer, layers, shape })
    }

    /// The texture's label.
    #[must_use]
    pub fn label(&self) -> &'a str {
        &self.desc.label
    }
    /// The texture's format.
    #[must_use]
    pub fn format(&self) -> TextureFormat {
        self.desc.format
    }
    /// The format's facts.
    #[inline(always)]
    #[must_use]
    pub fn info(&self) -> FormatInfo {
        self.info
    }
    /// Shape of the view.
    #[inline(always)]
    #[must_use]
    pub fn shape(&self) -> TextureShape {
        self.shape
    }
    /// Number of mip levels of the view.
    #[inline(always)]
    #[must_use]
    pub fn mip_level_count(&self) -> u32 {
        self.levels
    }
    /// Size of a level of the view: width, height, and layers or slices.
    #[inline(always)]
    #[must_use]
    pub fn level_size(&self, level: u32) -> (u32, u32, u32) {
        let (width, height, depth) = self.desc.level_size(self.base_level + level);
        (width, height, if self.shape == TextureShape::D3 { depth } else { self.layers })
    }

    /// The surface of a level and layer of the view; both are clamped to what the view shows.
    #[inline(always)]
    #[must_use]
    pub fn surface(&self, level: u32, layer: u32) -> &'a Surface {
        let level = level.min(self.levels - 1);
        let layers = if self.shape == TextureShape::D3 { self.level_size(level).2 } else { self.layers };
        let index = self.level_start[(self.base_level + level) as usize] + (self.base_layer + layer.min(layers - 1)) as usize;
        match self.surfaces {
            Surfaces::All(surfaces) => &surfaces[index],
            Surfaces::Unattached(surfaces) => surfaces[index].unwrap_or_else(|| is_drawn_to(self.label())),
        }
    }

    /// The four numbers that a shader reads from a texel inside the surface: missing colour channels are 0, missing alpha is 1, depth is in 0..=1.
    /// For integer formats all four are bit patterns of integers.
    #[inline(always)]
    #[must_use]
    pub fn texel(&self, level: u32, layer: u32, x: u32, y: u32) -> [f32; 4] {
        let surface = self.surface(level, layer);
        self.texel_at(surface, surface.plane_index(x as usize, y as usize))
    }

    /// [`Self::texel`] at a plane index of one of this view's surfaces.
    #[inline(always)]
    pub(crate) fn texel_at(&self, surface: &Surface, index: usize) -> [f32; 4] {
        let mut out = [0.0, 0.0, 0.0, self.info.kind.missing_alpha()];
        for (channel, slot) in out.iter_mut().enumerate().take(surface.channels) {
            *slot = surface.planes[index + channel * TILE_PIXELS];
        }
        if let ChannelKind::UnormDepth(_) = self.info.kind {
            out[0] = depth_value(self.info.kind, out[0]);
        }
        out
    }
}

#[cold]
fn is_drawn_to(label: &str) -> ! {
    panic!("a view of texture `{label}` was made of a surface that is drawn to")
}

/// One surface of a texture, to draw to. The format is the texture's.
#[derive(Debug)]
pub struct TextureViewMut<'a> {
    pub(crate) surface: &'a mut Surface,
    format: TextureFormat,
    info: FormatInfo,
}

impl TextureViewMut<'_> {
    /// The texture's format.
    #[must_use]
    pub fn format(&self) -> TextureFormat {
        self.format
    }
    /// The format's facts.
    #[must_use]
    pub fn info(&self) -> FormatInfo {
        self.info
    }
    /// Width and height of the surface.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.surface.width, self.surface.height)
    }
}

/// The surfaces of a texture that are not drawn to, see [`Texture::split`].
#[derive(Debug)]
pub struct Unattached<'a> {
    desc: &'a TextureDescriptor,
    info: FormatInfo,
    level_start: &'a [usize],
    surfaces: Vec<Option<&'a Surface>>,
}

impl Unattached<'_> {
    /// A view of these surfaces.
    ///
    /// # Errors
    /// If the view reaches beyond the texture, or shows a surface that is drawn to.
    pub fn view(&self, view: &TextureViewDescriptor) -> Result<TextureView<'_>, TextureError> {
        let range = self.desc.view_range(view)?;
        for level in range.levels.clone() {
            let layers = if range.shape == TextureShape::D3 { 0..self.desc.level_size(level).2 } else { range.layers.clone() };
            for layer in layers {
                if self.surfaces[self.level_start[level as usize] + layer as usize].is_none() {
                    return Err(TextureError::DrawnTo { label: self.desc.label.clone(), level, layer });
                }
            }
        }
        TextureView::new(self.desc, self.info, self.level_start, Surfaces::Unattached(&self.surfaces), view)
    }
}

impl Texture {
    /// The four numbers that a shader reads from a texel inside the surface, see [`TextureView::texel`].
    #[must_use]
    pub fn texel(&self, level: u32, layer: u32, x: u32, y: u32) -> [f32; 4] {
        self.view().texel(level, layer, x, y)
    }

    /// A view of all levels and layers, for shaders to read.
    #[must_use]
    pub fn view(&self) -> TextureView<'_> {
        let parts = self.parts();
        let whole = TextureView::new(parts.0, self.info(), parts.1, Surfaces::All(parts.2), &TextureViewDescriptor::default());
        whole.unwrap_or_else(|_| unreachable!("a texture has a level and a layer"))
    }

    /// A view of some levels and layers, for shaders to read.
    ///
    /// # Errors
    /// If the view reaches beyond the texture, or its shape does not fit the layers.
    pub fn view_of(&self, view: &TextureViewDescriptor) -> Result<TextureView<'_>, TextureError> {
        let parts = self.parts();
        TextureView::new(parts.0, self.info(), parts.1, Surfaces::All(parts.2), view)
    }

    /// Level 0 of layer 0, to draw to.
    #[must_use]
    pub fn view_mut(&mut self) -> TextureViewMut<'_> {
        let (format, info) = (self.desc().format, self.info());
        TextureViewMut { surface: self.surface_mut(0, 0), format, info }
    }

    /// Splits the texture into the surfaces of `attached`, to draw to, and all others, for shaders to read meanwhile. `attached` names each surface
    /// by level and layer (or slice).
    ///
    /// # Errors
    /// If a surface does not exist or is named twice.
    pub fn split(&mut self, attached: &[(u32, u32)]) -> Result<(Vec<TextureViewMut<'_>>, Unattached<'_>), TextureError> {
        let info = self.info();
        for (i, &(level, layer)) in attached.iter().enumerate() {
            let desc = self.desc();
            if !desc.has_surface(level, layer) {
                return Err(TextureError::NoSurface { label: desc.label.clone(), level, layer });
            }
            if attached[..i].contains(&(level, layer)) {
                return Err(TextureError::AttachedTwice { label: desc.label.clone(), level, layer });
            }
        }
        let (desc, level_start, surfaces) = self.parts_mut();
        let numbers: Vec<usize> = attached.iter().map(|&(level, layer)| level_start[level as usize] + layer as usize).collect();
        let mut lent: Vec<Option<TextureViewMut<'_>>> = attached.iter().map(|_| None).collect();
        let mut rest = Vec::with_capacity(surfaces.len());
        for (number, surface) in surfaces.iter_mut().enumerate() {
            match numbers.iter().position(|&n| n == number) {
                Some(place) => {
                    lent[place] = Some(TextureViewMut { surface, format: desc.format, info });
                    rest.push(None);
                }
                None => rest.push(Some(&*surface)),
            }
        }
        Ok((lent.into_iter().flatten().collect(), Unattached { desc, info, level_start, surfaces: rest }))
    }
}
