//! Frames on real drivers: the same description that the CPU executor runs, through wgpu and Vulkan, without a window.
//!
//! [`adapters`] finds drivers, [`Gpu`] opens one, [`GpuFrame`] holds a frame's resources on it and runs its passes one by one or all at once;
//! [`GpuExecutor`] does what every executor does. Fixed-function state is handed on as it is, and shaders are the programs' WGSL twins. What
//! WebGPU lacks is expanded: the geometry stage, point sprites and wide lines run on the software GPU, and the driver pulls their
//! primitives from a storage buffer; stream-out runs the vertex stage in a compute shader; occlusion queries are counted by an additive target
//! beside the pass's own.
//!
//! [`crosscheck`] compares every attachment of every pass with the software GPU's, and [`conformance`] draws random and adversarial primitives.

mod adapter;
pub mod conformance;
pub mod crosscheck;
mod depth_copy;
mod device;
mod executor;
mod frame;
mod pipeline;
mod pull;
mod resources;
mod stream;
mod twin;

pub use adapter::{Adapter, AdapterLine, Family, adapters, find_adapter};
pub use device::Gpu;
pub use executor::GpuExecutor;
pub use frame::{GpuFrame, GpuPass, Vertices};

use nephroid_pipeline::frame::FrameError;

/// Why a driver cannot be used, or cannot run a frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error("no Vulkan adapter was found: a driver and the Vulkan loader must be installed (Debian: mesa-vulkan-drivers)")]
    NoAdapter,
    /// No adapter of that name.
    #[error("there is no adapter `{seen}`; there are: {known}")]
    UnknownAdapter {
        /// The name seen.
        seen: String,
        /// The names known.
        known: String,
    },
    /// The frame needs what the adapter lacks.
    #[error("`{what}` needs {feature}, which {adapter} does not have; {have}")]
    Feature {
        /// Pipeline or texture.
        what: String,
        /// The feature as wgpu names it.
        feature: &'static str,
        /// The adapter.
        adapter: String,
        /// Which adapters here have it.
        have: String,
    },
    /// The frame exceeds a limit of the adapter.
    #[error("{what} is {seen}; {adapter} allows up to {limit}")]
    Limit {
        /// What is too large.
        what: String,
        /// The value seen.
        seen: u64,
        /// The adapter.
        adapter: String,
        /// The largest value allowed.
        limit: u64,
    },
    /// A program cannot be run by a driver.
    #[error("program `{program}`: {why}")]
    Twin {
        /// The program.
        program: &'static str,
        /// Why.
        why: String,
    },
    /// The driver or wgpu refused something.
    #[error("{doing}: {why}")]
    Driver {
        /// What was being done.
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
