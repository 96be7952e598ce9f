//! `nephroid`: a deterministic, multi-threaded software GPU and the real-time caustics techniques built on it.
//!
//! A *frame* is data: named resources and an ordered list of passes. Executors run frames; the CPU executor
//! runs them on [`pipeline`], which reproduces the stages of a GPU exactly and gives the same bytes for the same
//! input on any number of threads and at any SIMD level. Layers, lowest first (a module uses only lower ones):
//!
//! - L0 [`math`]
//! - L1 [`image`], [`geom`]
//! - L2 [`pipeline`], [`metrics`]
//! - L3 [`frame`], [`scene`]
//! - L4 [`passes`], [`trace`]
//! - L5 [`caustics`]
//! - L6 [`report`], and `gpu` with the feature `wgpu`
//! - L7 [`cli`]

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
