//! Runs frames on drivers: the description that the CPU executor runs, through wgpu and Vulkan, without a window.
//!
//! [`adapters`] finds drivers, [`Gpu`] opens one, [`GpuFrame`] holds a frame's resources on it and runs its passes one by one or all at once;
//! [`GpuExecutor`] is an executor like any other. Fixed-function state is passed on unchanged, and shaders are the programs' WGSL twins. Features
//! that WebGPU lacks are expanded. The geometry stage, point sprites and wide lines run on the software GPU, and the driver pulls their primitives
//! from a storage buffer. Stream-out runs the vertex stage in a compute shader. Occlusion queries are counted in an additional target with additive
//! blending.
//!
//! [`crosscheck`] compares every attachment of every pass with the software GPU's, and [`conformance`] draws random and adversarial primitives.

mod adapter;
mod bind;
pub mod conformance;
pub mod crosscheck;
mod depth_copy;
mod device;
mod encode;
mod executor;
mod frame;
mod layout;
mod pieces;
mod pipeline;
mod pull;
mod resources;
mod stream;
mod twin;

pub use adapter::{Adapter, AdapterLine, Family, adapters, find_adapter};
pub use device::Gpu;
pub use executor::GpuExecutor;
pub(crate) use frame::DRAWS_PER_BATCH;
pub use frame::{GpuFrame, GpuPass, Vertices};

use nephroid_pipeline::frame::FrameError;

/// Why a driver cannot be used or cannot run a frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// No adapter exists.
    #[error("no Vulkan adapter was found: a driver and the Vulkan loader must be installed (Debian: mesa-vulkan-drivers)")]
    NoAdapter,
    /// No adapter has this name.
    #[error("there is no adapter `{seen}`; there are: {known}")]
    UnknownAdapter {
        /// The name seen.
        seen: String,
        /// The names that exist.
        known: String,
    },
    /// The frame needs a feature that the adapter lacks.
    #[error("`{what}` needs {feature}, which {adapter} does not have; {have}")]
    Feature {
        /// Name of the pipeline or texture.
        what: String,
        /// wgpu's name of the feature.
        feature: &'static str,
        /// Name of the adapter.
        adapter: String,
        /// The adapters of this machine that have the feature.
        have: String,
    },
    /// The frame exceeds a limit of the adapter.
    #[error("{what} is {seen}; {adapter} allows up to {limit}")]
    Limit {
        /// The quantity that is too large.
        what: String,
        /// The value seen.
        seen: u64,
        /// Name of the adapter.
        adapter: String,
        /// The largest value allowed.
        limit: u64,
    },
    /// A driver cannot run a program.
    #[error("program `{program}`: {why}")]
    Twin {
        /// Name of the program.
        program: &'static str,
        /// The reason.
        why: String,
    },
    /// The driver or wgpu returned an error.
    #[error("{doing}: {why}")]
    Driver {
        /// The operation that failed.
        doing: String,
        /// The message.
        why: String,
    },
    /// The frame itself is not valid.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl From<GpuError> for FrameError {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Frame(frame) => frame,
            other => Self::Backend(other.to_string()),
        }
    }
}
