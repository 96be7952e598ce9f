//! Why a picture cannot be made.

use std::error::Error;

use nephroid_pipeline::DeviceError;
use nephroid_pipeline::frame::FrameError;
use nephroid_scene::SceneError;

/// Why a picture cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No technique of that name.
    #[error("there is no technique `{seen}`; there are: {known}")]
    UnknownTechnique {
        /// The name seen.
        seen: String,
        /// The names known.
        known: String,
    },
    /// No layer of that name.
    #[error("`{technique}` has no layer or attachment `{seen}`; there are: {known}")]
    UnknownLayer {
        /// The technique.
        technique: &'static str,
        /// The name seen.
        seen: String,
        /// The names known.
        known: String,
    },
    /// What only this technique refuses.
    #[error(transparent)]
    Technique(Box<dyn Error + Send + Sync>),
    /// A mesh of the scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The frame cannot run.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The threads cannot be started.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The result cannot be held as layers.
    #[error(transparent)]
    Layer(#[from] nephroid_image::LayerError),
}

impl RenderError {
    /// An error of one technique.
    pub fn of_technique(error: impl Error + Send + Sync + 'static) -> Self {
        Self::Technique(Box::new(error))
    }
}
