//! Named float layers: the result of a render, and the contents of an EXR.

use crate::{Image, SizeError};

/// Most channels a layer can have.
pub const MAX_CHANNELS: usize = 4;

/// Longest layer name, in bytes: the limit of an OpenEXR attribute name, so that every layer can be written.
pub const MAX_NAME_LENGTH: usize = 255;

/// A layer that every technique can write: its name, shape and meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StandardLayer {
    /// Name in files and on the command line.
    pub name: &'static str,
    /// Number of channels: 3 is RGB or XYZ.
    pub channels: usize,
    /// Unit of the values, "1" for a pure number.
    pub unit: &'static str,
    /// Description of the values in one line.
    pub summary: &'static str,
}

/// The layers that a render can write, in the order in which files hold them. Intermediate attachments have the names `pass/attachment`.
pub const STANDARD_LAYERS: &[StandardLayer] = &[
    StandardLayer { name: "color", channels: 3, unit: "W/(m2 sr)", summary: "the picture: linear radiance towards the eye" },
    StandardLayer { name: "depth", channels: 1, unit: "m", summary: "distance along the view axis; infinity where nothing was hit" },
    StandardLayer { name: "normal", channels: 3, unit: "1", summary: "shading normal, world space" },
    StandardLayer { name: "position", channels: 3, unit: "m", summary: "visible point, world space" },
    StandardLayer { name: "albedo", channels: 3, unit: "1", summary: "diffuse reflectance" },
    StandardLayer { name: "direct", channels: 3, unit: "W/m2", summary: "irradiance that reached the surface without a caustic" },
    StandardLayer {
        name: "caustic_irradiance",
        channels: 3,
        unit: "W/m2",
        summary: "irradiance that reached the surface through the water",
    },
    StandardLayer { name: "caustic_direction", channels: 3, unit: "1", summary: "mean direction the caustic light came from" },
    StandardLayer { name: "volume", channels: 3, unit: "W/(m2 sr)", summary: "radiance scattered by the medium" },
    StandardLayer { name: "godrays", channels: 3, unit: "W/(m2 sr)", summary: "the part of `volume` that came through the caustic" },
    StandardLayer { name: "shadow", channels: 1, unit: "1", summary: "share of the light that nothing blocks, 0 to 1" },
    StandardLayer { name: "stencil_count", channels: 1, unit: "1", summary: "stencil value after the caustic passes" },
    StandardLayer { name: "fragment_count", channels: 1, unit: "1", summary: "fragments shaded at this pixel" },
];

/// Why a layer or a set of layers is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayerError {
    /// The name is empty, too long, or holds something other than visible ASCII.
    #[error("layer name {name:?} is not 1 to 255 visible ASCII characters")]
    BadName {
        /// The name seen.
        name: String,
    },
    /// A layer has no planes or more than four.
    #[error("layer `{name}` has {found} channels; 1 to 4 are allowed")]
    BadChannelCount {
        /// Name of the layer.
        name: String,
        /// Number of planes given.
        found: usize,
    },
    /// Two planes of a layer differ in size.
    #[error("layer `{name}` is {}x{} pixels in channel 0 and {}x{} in channel {channel}", .first.0, .first.1, .found.0, .found.1)]
    UnequalPlanes {
        /// Name of the layer.
        name: String,
        /// Size of channel 0.
        first: (u32, u32),
        /// Index of the channel that differs.
        channel: usize,
        /// Size of that channel.
        found: (u32, u32),
    },
    /// An interleaved list of pixels has the wrong length.
    #[error("layer `{name}` has the wrong size")]
    Size {
        /// Name of the layer.
        name: String,
        /// The reason.
        source: SizeError,
    },
    /// Two layers of a set have the same name.
    #[error("there are two layers named `{name}`")]
    Duplicate {
        /// The name.
        name: String,
    },
}

/// One to four float planes of the same size under a name. Any bit pattern is a value: NaN and infinities are kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    name: String,
    planes: Vec<Image<f32>>,
}

impl Layer {
    /// Makes a layer of 1 to [`MAX_CHANNELS`] planes of equal size. The name must be visible ASCII, at most [`MAX_NAME_LENGTH`] bytes.
    ///
    /// # Errors
    /// If the name, the number of planes or a size is not allowed.
    pub fn new(name: impl Into<String>, planes: Vec<Image<f32>>) -> Result<Self, LayerError> {
        let name = name.into();
        if name.is_empty() || name.len() > MAX_NAME_LENGTH || !name.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err(LayerError::BadName { name });
        }
        if planes.is_empty() || planes.len() > MAX_CHANNELS {
            return Err(LayerError::BadChannelCount { name, found: planes.len() });
        }
        let first = planes[0].size();
        if let Some((channel, plane)) = planes.iter().enumerate().find(|(_, plane)| plane.size() != first) {
            return Err(LayerError::UnequalPlanes { name, first, channel, found: plane.size() });
        }
        Ok(Self { name, planes })
    }

    /// Splits pixels of `N` channels, row-major, into planes.
    ///
    /// # Errors
    /// If the name, the number of channels or the number of pixels is not allowed.
    pub fn from_pixels<const N: usize>(name: &str, width: u32, height: u32, pixels: &[[f32; N]]) -> Result<Self, LayerError> {
        let plane = |channel: usize| {
            Image::from_vec(width, height, pixels.iter().map(|pixel| pixel[channel]).collect())
                .map_err(|source| LayerError::Size { name: name.to_owned(), source })
        };
        Self::new(name, (0..N).map(plane).collect::<Result<_, _>>()?)
    }

    /// The name, never empty.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.planes[0].width()
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.planes[0].height()
    }

    /// Number of channels, 1 to [`MAX_CHANNELS`].
    #[must_use]
    pub fn channel_count(&self) -> usize {
        self.planes.len()
    }

    /// One plane per channel, all of one size.
    #[must_use]
    pub fn planes(&self) -> &[Image<f32>] {
        &self.planes
    }

    /// The pixels as RGB, row by row: a single channel is repeated, of two the first, a fourth is left out.
    #[must_use]
    pub fn rgb(&self) -> Vec<[f32; 3]> {
        let channels = if self.channel_count() < 3 { [0; 3] } else { [0, 1, 2] };
        let [r, g, b] = channels.map(|channel: usize| self.planes[channel].pixels());
        r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect()
    }

    /// The same pixels under another name.
    ///
    /// # Errors
    /// If the name is not allowed.
    pub fn renamed(self, name: impl Into<String>) -> Result<Self, LayerError> {
        Self::new(name, self.planes)
    }
}

/// Layers in the order in which they were added; no two have the same name. Sizes may differ: an intermediate map can have another size than the
/// picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerSet {
    layers: Vec<Layer>,
}

impl LayerSet {
    /// A set without layers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a layer at the end.
    ///
    /// # Errors
    /// If the set has a layer of this name.
    pub fn push(&mut self, layer: Layer) -> Result<(), LayerError> {
        if self.get(layer.name()).is_some() {
            return Err(LayerError::Duplicate { name: layer.name });
        }
        self.layers.push(layer);
        Ok(())
    }

    /// The layer with this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// Adds a vector, m, to the positions of the layer `position`, if there is one. Zeros, where a picture shows no surface, stay.
    pub fn move_positions(&mut self, by: [f64; 3]) {
        let Some(layer) = self.layers.iter_mut().find(|layer| layer.name == "position") else { return };
        if by == [0.0; 3] || layer.planes.len() != 3 {
            return;
        }
        for k in 0..layer.planes[0].pixels().len() {
            if layer.planes.iter().any(|plane| plane.pixels()[k] != 0.0) {
                for (plane, by) in layer.planes.iter_mut().zip(by) {
                    let pixel = &mut plane.pixels_mut()[k];
                    *pixel = (f64::from(*pixel) + by) as f32;
                }
            }
        }
    }

    /// All layers in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Layer> {
        self.layers.iter()
    }

    /// The names in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.layers.iter().map(Layer::name)
    }

    /// Number of layers.
    #[must_use]
    pub fn len(&self) -> usize {
        self.layers.len()
    }

    /// Whether there are no layers.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }
}

impl<'a> IntoIterator for &'a LayerSet {
    type Item = &'a Layer;
    type IntoIter = std::slice::Iter<'a, Layer>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(width: u32, height: u32) -> Image<f32> {
        Image::filled(width, height, 0.5).unwrap()
    }

    #[test]
    fn names_must_be_visible_ascii() {
        for name in ["", "two words", "tab\t", "caf\u{e9}", "nul\0", &"x".repeat(256)] {
            assert_eq!(Layer::new(name, vec![plane(1, 1)]).unwrap_err(), LayerError::BadName { name: name.to_owned() });
        }
        assert!(Layer::new("beams/stencil.0", vec![plane(1, 1)]).is_ok());
    }

    #[test]
    fn channel_counts_are_one_to_four() {
        for found in [0, 5] {
            let error = Layer::new("a", vec![plane(2, 2); found]).unwrap_err();
            assert_eq!(error, LayerError::BadChannelCount { name: "a".into(), found });
        }
        for count in 1..=4 {
            assert_eq!(Layer::new("a", vec![plane(2, 2); count]).unwrap().channel_count(), count);
        }
    }

    #[test]
    fn planes_of_unequal_size_are_refused() {
        let error = Layer::new("a", vec![plane(2, 3), plane(2, 3), plane(3, 2)]).unwrap_err();
        assert_eq!(error, LayerError::UnequalPlanes { name: "a".into(), first: (2, 3), channel: 2, found: (3, 2) });
        assert_eq!(error.to_string(), "layer `a` is 2x3 pixels in channel 0 and 3x2 in channel 2");
    }

    #[test]
    fn pixels_are_split_into_planes() {
        let layer = Layer::from_pixels("a", 2, 1, &[[1.0, 2.0], [3.0, 4.0]]).unwrap();
        assert_eq!(layer.planes()[0].pixels(), [1.0, 3.0]);
        assert_eq!(layer.planes()[1].pixels(), [2.0, 4.0]);
        assert!(matches!(Layer::from_pixels("a", 2, 2, &[[1.0]]), Err(LayerError::Size { .. })));
    }

    #[test]
    fn rgb_repeats_a_single_channel_and_leaves_out_a_fourth() {
        let rgb = |count: usize| {
            let planes = (0..count).map(|c| Image::from_vec(2, 1, vec![c as f32, 10.0 + c as f32]).unwrap()).collect();
            Layer::new("a", planes).unwrap().rgb()
        };
        let grey = vec![[0.0; 3], [10.0; 3]];
        let color = vec![[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]];
        assert_eq!((1..=4).map(rgb).collect::<Vec<_>>(), [grey.clone(), grey, color.clone(), color]);
    }

    #[test]
    fn a_set_keeps_order_and_refuses_a_second_layer_of_a_name() {
        let mut set = LayerSet::new();
        for name in ["z", "a", "m"] {
            set.push(Layer::new(name, vec![plane(1, 1)]).unwrap()).unwrap();
        }
        assert_eq!(set.push(Layer::new("a", vec![plane(1, 1)]).unwrap()).unwrap_err(), LayerError::Duplicate { name: "a".into() });
        assert_eq!(set.names().collect::<Vec<_>>(), ["z", "a", "m"]);
    }

    #[test]
    fn standard_layers_can_all_be_made() {
        let mut set = LayerSet::new();
        for standard in STANDARD_LAYERS {
            set.push(Layer::new(standard.name, vec![plane(1, 1); standard.channels]).unwrap()).unwrap();
        }
        assert_eq!(set.len(), 13);
    }
}
