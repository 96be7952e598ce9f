//! Errors of rendering.

use std::error::Error;

use nephroid_pipeline::DeviceError;
use nephroid_pipeline::frame::FrameError;
use nephroid_scene::{OverLimit, SceneError};

/// Why a picture cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No technique has the name.
    #[error("there is no technique `{seen}`; there are: {known}")]
    UnknownTechnique {
        /// The name seen.
        seen: String,
        /// The names that exist.
        known: String,
    },
    /// The technique's frame has no such layer or attachment.
    #[error("`{technique}` has no layer or attachment `{seen}`; there are: {known}")]
    UnknownLayer {
        /// The technique.
        technique: &'static str,
        /// The name seen.
        seen: String,
        /// The names that exist.
        known: String,
    },
    /// The picture would take more memory than it may.
    #[error(transparent)]
    Memory(#[from] OverLimit),
    /// An error that only one technique has.
    #[error(transparent)]
    Technique(Box<dyn Error + Send + Sync>),
    /// A mesh of the scene cannot be made or loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The frame cannot run.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The worker threads cannot be started.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The results cannot be stored as layers.
    #[error(transparent)]
    Layer(#[from] nephroid_image::LayerError),
}

impl RenderError {
    /// Wraps an error of one technique.
    pub fn of_technique(error: impl Error + Send + Sync + 'static) -> Self {
        Self::Technique(Box::new(error))
    }
}
