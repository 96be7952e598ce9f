//! Textures in which a technique sums caustic light.

use nephroid_pipeline::frame::TextureId;
use nephroid_pipeline::state::TextureFormat;

use super::state::Sum;
use super::{Contributions, FrameBuilder, FrameLight};
use crate::{LayerSource, Resolve};

/// Sums over all lights and beams.
#[derive(Clone, Copy, Debug)]
pub struct CausticTargets {
    /// Irradiance, W/m², linear RGB.
    pub irradiance: TextureId,
    /// Irradiance times the direction towards the light; w is the sum of the weights. `None` unless the layer `caustic_direction` is wanted.
    pub direction: Option<TextureId>,
    /// Number of light volumes or beams per sample. `None` unless the layer `fragment_count` is wanted.
    pub count: Option<TextureId>,
}

impl CausticTargets {
    /// Adds the textures that the wanted layers need. `count_label` names the texture that counts.
    pub fn new(builder: &mut FrameBuilder<'_>, layers: &[&str], count_label: &str) -> Self {
        let wants = |layer| layers.contains(&layer);
        Self {
            irradiance: builder.target("caustic_irradiance", TextureFormat::Rgba32Float),
            direction: wants("caustic_direction").then(|| builder.target("caustic_direction_sum", TextureFormat::Rgba32Float)),
            count: wants("fragment_count").then(|| builder.target(count_label, TextureFormat::R32Float)),
        }
    }

    /// The irradiance as an attachment of a light's pass.
    #[must_use]
    pub fn irradiance_sum(&self, light: &FrameLight) -> Sum {
        Sum { texture: self.irradiance, format: TextureFormat::Rgba32Float, clear: light.is_first() }
    }

    /// Direction and count as attachments of a light's pass.
    #[must_use]
    pub fn optional_sums(&self, light: &FrameLight) -> [Option<Sum>; 2] {
        let sum = |texture: Option<TextureId>, format| texture.map(|texture| Sum { texture, format, clear: light.is_first() });
        [sum(self.direction, TextureFormat::Rgba32Float), sum(self.count, TextureFormat::R32Float)]
    }

    /// The irradiance as a contribution, with a layer for each of the other textures.
    #[must_use]
    pub fn contributions(&self) -> Contributions {
        let source = |name, texture, channels, resolve| LayerSource { name, texture, channels, resolve };
        let direction = self.direction.map(|texture| source("caustic_direction", texture, 3, Resolve::WeightedMean));
        let count = self.count.map(|texture| source("fragment_count", texture, 1, Resolve::Sum));
        Contributions { layers: direction.into_iter().chain(count).collect(), ..Contributions::new(self.irradiance) }
    }
}
