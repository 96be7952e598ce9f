//! Output of a technique: a frame, and the assignment of its textures to layers.

use nephroid_pipeline::frame::{Frame, TextureId};

use super::Tally;
use super::audit::Audit;

/// A frame and the sources of its layers.
pub struct TechniqueFrame {
    /// The frame.
    pub frame: Frame,
    /// Source of each layer.
    pub layers: Vec<LayerSource>,
    /// Layers that are 0 where the picture shows a mirror or glass; `None` for scenes without them.
    pub light_mask: Option<LightMask>,
    /// Margin beyond each edge of the picture, in samples.
    pub margin: u32,
    /// Samples along each side of a pixel.
    pub samples: u32,
    /// Energy audit. The renderer adds that of the tallies.
    pub audit: Audit,
    /// Counters of frame building. The renderer adds those of the tallies and of the passes.
    pub counters: Vec<(String, u64)>,
    /// What the renderer counts once the frame has run, for counters and audit.
    pub tallies: Vec<Tally>,
    /// Seconds that the parts of frame building took, by the clock of [`Builder::set_clock`](crate::Builder::set_clock). They depend on machine and
    /// run, and are no part of the result.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Layers of light, which does not land on mirrors and glass.
#[derive(Clone, Debug)]
pub struct LightMask {
    /// Texture whose w is 1 + [`crate::passes::geometry_buffer::MaterialKind`] of the nearest surface.
    pub kinds: TextureId,
    /// Names of the layers.
    pub layers: Vec<&'static str>,
}

/// The source of a layer.
#[derive(Clone, Debug)]
pub struct LayerSource {
    /// Name of the layer.
    pub name: &'static str,
    /// The texture.
    pub texture: TextureId,
    /// Number of its channels that the layer has.
    pub channels: usize,
    /// How samples are reduced to a pixel.
    pub resolve: Resolve,
}

/// How the samples of a pixel are reduced to one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolve {
    /// Their mean.
    Mean,
    /// Their sum.
    Sum,
    /// The value of the sample nearest to the pixel's centre.
    Nearest,
    /// The mean vector divided by the mean of the fourth channel: a mean weighted by that channel.
    WeightedMean,
    /// Distance of the nearest sample's position along the view axis, given by origin and direction; infinite where w = 0.
    Depth(glam::Vec3, glam::Vec3),
}
