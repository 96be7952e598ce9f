//! What a technique hands over: a frame, and how its textures become layers.

use nephroid_pipeline::frame::{Frame, TextureId};

/// A frame and how to read its results.
pub struct TechniqueFrame {
    /// The frame.
    pub frame: Frame,
    /// Where each layer comes from.
    pub layers: Vec<LayerSource>,
    /// Pixels beyond each edge of the picture, in samples.
    pub margin: u32,
    /// Samples along a pixel's side.
    pub samples: u32,
    /// Energy audit so far, in watts summed over RGB unless the name says otherwise.
    pub audit: Vec<(String, f64)>,
    /// Counters so far.
    pub counters: Vec<(String, u64)>,
    /// Seconds that parts of building the frame took, by the clock given: of this run on this machine, and no part of the result.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Where a layer comes from.
#[derive(Clone, Debug)]
pub struct LayerSource {
    /// Name of the layer.
    pub name: &'static str,
    /// The texture.
    pub texture: TextureId,
    /// Channels of it.
    pub channels: usize,
    /// How samples become a pixel.
    pub resolve: Resolve,
}

/// How samples become a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolve {
    /// Their mean.
    Mean,
    /// Their sum.
    Sum,
    /// The sample next to the pixel's centre.
    Nearest,
    /// The mean vector, divided by its fourth channel: a mean weighted by it.
    WeightedMean,
    /// Distance of the nearest sample's position along the view axis, given as origin and direction; infinite where w = 0.
    Depth(glam::Vec3, glam::Vec3),
}
