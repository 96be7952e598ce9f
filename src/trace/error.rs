//! Why a scene cannot be traced.

use nephroid_scene::SceneError;

/// Why a scene cannot be traced.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// A mesh of the scene cannot be had.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There is nothing that could make a caustic.
    #[error("the scene has no caustics to trace: it needs a light, and water, a mirror or glass that the light can reach")]
    NothingSpecular,
    /// Glass whose surface does not enclose anything.
    #[error(
        "{object} is glass, but its mesh is open: {border} edges have one triangle only, {crowded} have more than two, {twisted} join \
         triangles of opposite orientation; a closed mesh is needed"
    )]
    OpenGlass {
        /// Name of the object.
        object: String,
        /// Edges of one triangle.
        border: usize,
        /// Edges of three triangles or more.
        crowded: usize,
        /// Edges whose triangles disagree about which side is out.
        twisted: usize,
    },
    /// A light that is in a solid body.
    #[error("light {light} at ({}, {}, {}) is inside {object}; it must be outside of all closed objects", .position[0], .position[1], .position[2])]
    LightInside {
        /// Index of the light.
        light: usize,
        /// Its position, m.
        position: [f32; 3],
        /// Name of the object.
        object: String,
    },
    /// An eye that is in glass.
    #[error("the camera at ({}, {}, {}) is inside {object}; it must be outside of all closed objects", .position[0], .position[1], .position[2])]
    CameraInside {
        /// Position of the eye, m.
        position: [f32; 3],
        /// Name of the object.
        object: String,
    },
    /// Too many triangles for the numbers that name them.
    #[error("the scene has {found} triangles; the ground truth takes at most {limit}")]
    TooManyTriangles {
        /// Number of triangles.
        found: usize,
        /// Most that can be.
        limit: usize,
    },
    /// A state that was kept of another run.
    #[error("the kept state does not belong to this run: {what} was {found}, now {expected}")]
    OtherState {
        /// What differs.
        what: &'static str,
        /// Its value in the state.
        found: String,
        /// Its value in this run.
        expected: String,
    },
    /// A state that is damaged.
    #[error("the kept state is damaged: {0}")]
    BadState(&'static str),
}
