//! Descriptions of textures and of their views.

use std::ops::Range;

use crate::api::format::facts::{FormatInfo, SUPPORTED_FORMATS, format_info};
use crate::api::state::TextureFormat;
use crate::api::surface::TILE_PIXELS;

/// Largest width or height of a texture.
pub const MAX_SIZE: u32 = 16384;

/// Most layers of a texture.
pub const MAX_LAYERS: u32 = 2048;

/// Largest width, height or depth of a volume. WebGPU's `maxTextureDimension3D` default.
pub const MAX_VOLUME_SIZE: u32 = 2048;

/// The shape of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureShape {
    /// Layers of 2D images; one layer for a plain texture.
    D2,
    /// Six layers: +X −X +Y −Y +Z −Z.
    Cube,
    /// Slices of a volume; each mip level halves the depth as well.
    D3,
}

/// Why a texture's description, data or view is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TextureError {
    /// A width, height or depth of zero, or one that is too large.
    #[error("texture `{label}`: size {width}x{height}x{depth} is outside 1..={allowed} (depth or layers: 1..=2048)")]
    Size {
        /// The texture's label.
        label: String,
        /// Width seen.
        width: u32,
        /// Height seen.
        height: u32,
        /// Depth or layers seen.
        depth: u32,
        /// Largest width and height of a texture of this shape.
        allowed: u32,
    },
    /// An unsupported format.
    #[error("texture `{label}`: format {format:?} is not supported; supported: {}", SUPPORTED_FORMATS)]
    Format {
        /// The texture's label.
        label: String,
        /// Format seen.
        format: TextureFormat,
    },
    /// A volume with a depth or stencil format.
    #[error("texture `{label}`: a volume cannot hold {format:?}")]
    VolumeFormat {
        /// The texture's label.
        label: String,
        /// Format seen.
        format: TextureFormat,
    },
    /// More mip levels than the size allows.
    #[error("texture `{label}`: {levels} mip levels, the size allows 1..={allowed}")]
    MipLevels {
        /// The texture's label.
        label: String,
        /// Levels seen.
        levels: u32,
        /// Most that the size allows.
        allowed: u32,
    },
    /// A cube that does not have six square layers.
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
    /// Data of another length than the surface.
    #[error("texture `{label}`: {seen} bytes given, the surface has {expected}")]
    Data {
        /// The texture's label.
        label: String,
        /// Bytes seen.
        seen: usize,
        /// Bytes expected.
        expected: usize,
    },
    /// Data for another number of layers than the texture has.
    #[error("texture `{label}`: data for {seen} layers given, the texture has {expected}")]
    Layers {
        /// The texture's label.
        label: String,
        /// Layers seen.
        seen: usize,
        /// Layers expected.
        expected: u32,
    },
    /// A view that the texture cannot have.
    #[error("texture `{label}` with {levels} levels and {layers} layers cannot be seen as {view:?}: {problem}")]
    View {
        /// The texture's label.
        label: String,
        /// The view.
        view: TextureViewDescriptor,
        /// Levels of the texture.
        levels: u32,
        /// Layers of the texture; 1 for a volume.
        layers: u32,
        /// The cause.
        problem: ViewProblem,
    },
    /// A view shows a surface that the same pass draws to.
    #[error("texture `{label}`: level {level} of layer {layer} is read and drawn to at once")]
    DrawnTo {
        /// The texture's label.
        label: String,
        /// Mip level.
        level: u32,
        /// Layer or slice.
        layer: u32,
    },
    /// A level or layer that the texture does not have.
    #[error("texture `{label}`: level {level} of layer {layer} does not exist")]
    NoSurface {
        /// The texture's label.
        label: String,
        /// Mip level.
        level: u32,
        /// Layer or slice.
        layer: u32,
    },
    /// A surface that is attached twice.
    #[error("texture `{label}`: level {level} of layer {layer} is attached twice")]
    AttachedTwice {
        /// The texture's label.
        label: String,
        /// Mip level.
        level: u32,
        /// Layer or slice.
        layer: u32,
    },
}

/// Why a view of a texture is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewProblem {
    /// No mip levels, or levels that the texture does not have.
    #[error("the mip levels are not among the texture's")]
    MipLevels,
    /// No layers, or layers that the texture does not have.
    #[error("the layers are not among the texture's")]
    ArrayLayers,
    /// A volume seen as images, or images seen as a volume.
    #[error("a texture of shape {texture:?} cannot be seen as {view:?}")]
    Shape {
        /// The texture's shape.
        texture: TextureShape,
        /// The view's shape.
        view: TextureShape,
    },
    /// A cube view of more or fewer than six layers.
    #[error("a cube needs 6 layers, not {layers}")]
    CubeLayers {
        /// Layers of the view.
        layers: u32,
    },
    /// A cube view of faces that are not square.
    #[error("a cube needs width = height, not {width}x{height}")]
    CubeSize {
        /// Width of the texture.
        width: u32,
        /// Height of the texture.
        height: u32,
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
    /// Format of the texels.
    pub format: TextureFormat,
    /// Layers, cube or volume. Default: layers.
    pub shape: TextureShape,
}

impl TextureDescriptor {
    /// One 2D image.
    pub fn d2(label: impl Into<String>, width: u32, height: u32, format: TextureFormat) -> Self {
        Self { label: label.into(), width, height, depth_or_layers: 1, mip_level_count: 1, format, shape: TextureShape::D2 }
    }

    /// Checks every field.
    ///
    /// Returns the facts of the format.
    ///
    /// # Errors
    /// If size, layers or mip levels are out of range, the shape does not fit them, or the format is not supported.
    pub fn validate(&self) -> Result<FormatInfo, TextureError> {
        let Self { width, height, depth_or_layers: depth, format, .. } = *self;
        let label = || self.label.clone();
        let volume = self.shape == TextureShape::D3;
        let (allowed, allowed_depth) = if volume { (MAX_VOLUME_SIZE, MAX_VOLUME_SIZE) } else { (MAX_SIZE, MAX_LAYERS) };
        if !(1..=allowed).contains(&width) || !(1..=allowed).contains(&height) || !(1..=allowed_depth).contains(&depth) {
            return Err(TextureError::Size { label: label(), width, height, depth, allowed });
        }
        if self.shape == TextureShape::Cube && (width != height || depth != 6) {
            return Err(TextureError::Cube { label: label(), width, height, depth });
        }
        let longest = width.max(height).max(if volume { depth } else { 1 });
        let allowed = 32 - longest.leading_zeros();
        if !(1..=allowed).contains(&self.mip_level_count) {
            return Err(TextureError::MipLevels { label: label(), levels: self.mip_level_count, allowed });
        }
        let info = format_info(format).ok_or_else(|| TextureError::Format { label: label(), format })?;
        if volume && (info.depth || info.stencil) {
            return Err(TextureError::VolumeFormat { label: label(), format });
        }
        Ok(info)
    }

    /// Whether the texture has this level and this layer or slice.
    #[must_use]
    pub fn has_surface(&self, level: u32, layer: u32) -> bool {
        level < self.mip_level_count && layer < self.level_size(level).2
    }

    /// Size of a mip level: width and height in texels, and the number of layers or slices.
    #[must_use]
    pub fn level_size(&self, level: u32) -> (u32, u32, u32) {
        let depth = if self.shape == TextureShape::D3 { (self.depth_or_layers >> level).max(1) } else { self.depth_or_layers };
        ((self.width >> level).max(1), (self.height >> level).max(1), depth)
    }

    /// Memory of the texture in bytes, known before it is made. Zero for an unsupported format.
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

/// The levels and layers of a texture that a view shows. Default: all.
///
/// WebGPU: [`GPUTextureViewDescriptor`](https://www.w3.org/TR/webgpu/#dictdef-gputextureviewdescriptor). Shaders count levels and layers from the
/// view's first ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureViewDescriptor {
    /// First mip level. Default: 0.
    pub base_mip_level: u32,
    /// Number of mip levels; `None` for all that follow. Default: `None`.
    pub mip_level_count: Option<u32>,
    /// First layer; 0 for a volume, whose view always shows all slices. Default: 0.
    pub base_array_layer: u32,
    /// Number of layers; `None` for all that follow. Default: `None`.
    pub array_layer_count: Option<u32>,
    /// Shape of the view: images, or the faces of a cube. Default: the texture's own shape.
    pub shape: Option<TextureShape>,
}

impl TextureViewDescriptor {
    /// One mip level, all layers.
    #[must_use]
    pub fn level(level: u32) -> Self {
        Self { base_mip_level: level, mip_level_count: Some(1), ..Self::default() }
    }
    /// One layer as an image, all levels.
    #[must_use]
    pub fn layer(layer: u32) -> Self {
        Self { base_array_layer: layer, array_layer_count: Some(1), shape: Some(TextureShape::D2), ..Self::default() }
    }
}

/// The levels, layers and shape of a view, checked against its texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewRange {
    /// Mip levels of the texture.
    pub levels: Range<u32>,
    /// Layers of the texture; for a volume `0..1`, which stands for all slices.
    pub layers: Range<u32>,
    /// Shape of the view.
    pub shape: TextureShape,
}

impl ViewRange {
    /// Whether the view shows this level and layer.
    #[must_use]
    pub fn contains(&self, level: u32, layer: u32) -> bool {
        self.levels.contains(&level) && (self.shape == TextureShape::D3 || self.layers.contains(&layer))
    }
}

impl TextureDescriptor {
    /// The levels, layers and shape that a view of this texture shows.
    ///
    /// # Errors
    /// If the view reaches beyond the texture's levels or layers, or if its shape does not fit them.
    pub fn view_range(&self, view: &TextureViewDescriptor) -> Result<ViewRange, TextureError> {
        let shape = view.shape.unwrap_or(self.shape);
        let volume = self.shape == TextureShape::D3;
        let all_layers = if volume { 1 } else { self.depth_or_layers };
        let range = |first: u32, count: Option<u32>, all: u32| {
            let end = count.map_or(all, |count| first.saturating_add(count));
            (first < end && end <= all).then_some(first..end)
        };
        let levels = range(view.base_mip_level, view.mip_level_count, self.mip_level_count).ok_or(ViewProblem::MipLevels);
        let layers = range(view.base_array_layer, view.array_layer_count, all_layers).ok_or(ViewProblem::ArrayLayers);
        let seen = levels.and_then(|levels| layers.map(|layers| ViewRange { levels, layers, shape }));
        let checked = seen.and_then(|range| self.shape_problem(&range).map_or(Ok(range), Err));
        checked.map_err(|problem| TextureError::View {
            label: self.label.clone(),
            view: *view,
            levels: self.mip_level_count,
            layers: all_layers,
            problem,
        })
    }

    /// Why the layers of a view cannot have the view's shape, or `None`.
    fn shape_problem(&self, range: &ViewRange) -> Option<ViewProblem> {
        if (self.shape == TextureShape::D3) != (range.shape == TextureShape::D3) {
            return Some(ViewProblem::Shape { texture: self.shape, view: range.shape });
        }
        let Self { width, height, .. } = *self;
        let layers = range.layers.len() as u32;
        match range.shape {
            TextureShape::Cube if layers != 6 => Some(ViewProblem::CubeLayers { layers }),
            TextureShape::Cube if width != height => Some(ViewProblem::CubeSize { width, height }),
            _ => None,
        }
    }
}
