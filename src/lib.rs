//! `nephroid`: a deterministic, multi-threaded software GPU and the real-time caustics techniques built on it.
//!
//! A *frame* is data: named resources and an ordered list of passes. Executors run frames; the CPU executor
//! runs them on [`pipeline`], which reproduces the stages of a GPU exactly and gives the same bytes for the same
//! input on any number of threads and at any SIMD level.
//!
//! The modules, each built only on modules above it:
//!
//! - [`math`]: lanes, vectors, elementary functions with the same bits everywhere
//! - [`pipeline`], with [`frame`]: the software GPU
//! - [`image`], with [`metrics`] and [`report`]: layers of floats, files, errors between pictures
//! - [`scene`], with [`geom`]: scene files, meshes, water
//! - [`trace`]: the ground truth
//! - [`caustics`], with [`passes`]: the techniques
//! - `gpu`, with the feature `wgpu`: frames on Vulkan drivers and the cross-check
//! - [`cli`]: the program

#[cfg(not(target_family = "wasm"))]
pub mod cli;

pub use nephroid_caustics as caustics;
pub use nephroid_caustics::passes;
#[cfg(feature = "wgpu")]
pub use nephroid_gpu as gpu;
pub use nephroid_image as image;
pub use nephroid_image::{metrics, report};
pub use nephroid_math as math;
pub use nephroid_pipeline as pipeline;
pub use nephroid_pipeline::frame;
pub use nephroid_scene as scene;
pub use nephroid_scene::geom;
pub use nephroid_trace as trace;

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
