//! Errors of splatting.

use crate::RenderError;

/// Why a scene cannot be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SplattingError {
    /// A light is inside of, or close to, what it has to see.
    #[error(
        "splatting draws what a light sees from its place: light {light} is inside of the box around {of}, or too near to it; move the light away"
    )]
    NoView {
        /// Number of the light.
        light: usize,
        /// What the view should hold.
        of: &'static str,
    },
    /// More exact photons than are kept at once.
    #[error(
        "`splatting.photons` is {seen}; with `splatting.intersection` exact, which is the default with mirrors or glass, at most {most} are allowed"
    )]
    TooManyExact {
        /// Photons along a side.
        seen: u32,
        /// Most allowed.
        most: u32,
    },
    /// Splats in the picture of a scene whose water the eye looks through by Snell's law.
    #[error(
        "with `splatting.gather` eye, the eye sees no splats through water: set `splatting.eye_refraction` to virtual_plane, or `gather` to light"
    )]
    EyeThroughWater,
}

impl From<SplattingError> for RenderError {
    fn from(error: SplattingError) -> Self {
        Self::of_technique(error)
    }
}
