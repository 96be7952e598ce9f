//! Errors of the tracer.

use nephroid_scene::{OverLimit, SceneError};

/// Why a scene cannot be traced.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// A mesh of the scene cannot be made or loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The run would take more memory than it may.
    #[error(transparent)]
    Memory(#[from] OverLimit),
    /// The scene has nothing that makes a caustic.
    #[error("the scene has no caustics to trace: it needs a light, and water, a mirror or glass that the light can reach")]
    NothingSpecular,
    /// A light inside of a closed object.
    #[error("light {light} at ({}, {}, {}) is inside {object}; it must be outside of all closed objects", .position[0], .position[1], .position[2])]
    LightInside {
        /// Index of the light.
        light: usize,
        /// Its position, m.
        position: [f32; 3],
        /// Name of the object.
        object: String,
    },
    /// A camera inside of glass.
    #[error("the camera at ({}, {}, {}) is inside {object}; it must be outside of all closed objects", .position[0], .position[1], .position[2])]
    CameraInside {
        /// Position of the eye, m.
        position: [f32; 3],
        /// Name of the object.
        object: String,
    },
    /// More triangles than their numbers can name.
    #[error("the scene has {found} triangles; the ground truth takes at most {limit}")]
    TooManyTriangles {
        /// Number of triangles.
        found: usize,
        /// Largest number allowed.
        limit: usize,
    },
    /// A saved state that belongs to another run.
    #[error("the kept state does not belong to this run: {what} was {found}, now {expected}")]
    OtherState {
        /// The quantity that differs.
        what: &'static str,
        /// Its value in the state.
        found: String,
        /// Its value in this run.
        expected: String,
    },
    /// A saved state that is damaged.
    #[error("the kept state is damaged: {0}")]
    BadState(&'static str),
}
