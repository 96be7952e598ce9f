//! The tile phase: from the primitives in a tile's bins to its pixels. Tiles run it in parallel.
//!
//! | Stage | File |
//! |---|---|
//! | raster | `raster.rs`, `squares.rs` |
//! | depth and stencil of whole blocks | `coarse_depth.rs`, `coarse_stencil.rs` |
//! | depth and stencil of pixels | `block_depth.rs`, `depth_stencil.rs`, `general.rs` |
//! | fragment shader | `queue.rs`, `worker.rs` |
//! | blend | `blend.rs` |
//! | fast paths of simple draws | `fast_path.rs`, `splat.rs` |
//! | events for an observer | `report.rs` |
//! | all of it in order, for one tile | `walk.rs`, `targets.rs` |

pub(crate) mod blend;
pub(crate) mod block_depth;
pub(crate) mod coarse_depth;
pub(crate) mod coarse_stencil;
pub(crate) mod depth_stencil;
pub(crate) mod fast_path;
pub(crate) mod general;
pub(crate) mod queue;
pub(crate) mod raster;
pub(crate) mod report;
pub(crate) mod splat;
pub(crate) mod squares;
pub(crate) mod targets;
pub(crate) mod walk;
pub(crate) mod worker;
