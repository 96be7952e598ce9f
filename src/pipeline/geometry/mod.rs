//! The geometry phase: from the draws of a pass to primitives in the bins of tiles. Chunks of primitives run it in parallel.
//!
//! | Stage | File |
//! |---|---|
//! | cut into chunks | `plan.rs`, `repeat.rs` |
//! | index fetch, primitive assembly | `assemble.rs`, `vertex_stage.rs` |
//! | vertex fetch and vertex shader | `fetch.rs`, `vertex_stage.rs` |
//! | geometry shader, stream-out | `geometry_stage.rs`, `stream_out.rs` |
//! | viewport, snap, outcodes | `viewport.rs`, `window_vertices.rs` |
//! | clip | `clip.rs` |
//! | cull and setup, one at a time | `emitter.rs`, `triangle.rs`, `point.rs`, `line.rs`, `setup.rs`, `depth_bias.rs` |
//! | cull and setup, sixteen at a time | `small.rs`, `small_triangles.rs`, `small_points.rs` |
//! | bin | `bins.rs` |
//! | all of it in order, for one chunk | `chunk.rs`, `chunk_output.rs` |

pub(crate) mod assemble;
pub(crate) mod bins;
pub(crate) mod chunk;
pub(crate) mod chunk_output;
pub(crate) mod clip;
pub(crate) mod depth_bias;
pub(crate) mod emitter;
pub(crate) mod fetch;
pub(crate) mod geometry_stage;
pub(crate) mod line;
pub(crate) mod plan;
pub(crate) mod point;
pub(crate) mod repeat;
pub(crate) mod setup;
pub(crate) mod small;
pub(crate) mod small_points;
pub(crate) mod small_triangles;
pub(crate) mod stream_out;
pub(crate) mod triangle;
pub(crate) mod vertex_stage;
pub(crate) mod viewport;
pub(crate) mod window_vertices;
