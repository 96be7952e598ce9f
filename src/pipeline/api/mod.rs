//! The interface of the pipeline: state, formats, textures, shaders, pipelines, draws and passes. Plain data, checked before anything is drawn.
//!
//! | Question | File |
//! |---|---|
//! | Which pipeline state exists, and what may a rasterizer choose? | `state.rs`, `rules.rs` |
//! | What can a texel hold, and how is it stored? | `format/`, `surface.rs`, `texture_descriptor.rs`, `texture.rs`, `texture_view.rs` |
//! | How does a shader read buffers and textures? | `buffer.rs`, `bindings.rs`, `sampler.rs`, `implicit_lod.rs` |
//! | How are shaders written and run? | [`shader`] |
//! | How is a pipeline described, and what is derived from the description? | `pipeline_descriptor.rs`, `render_pipeline.rs`, `resolved.rs` |
//! | How are draws and passes described? | `draw.rs`, `pass.rs` |
//! | What is refused, and why? | [`check`] |
//! | What can be counted and observed? | `statistics.rs`, `observer.rs` |

pub(crate) mod bindings;
pub(crate) mod buffer;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod draw;
pub(crate) mod format;
pub(crate) mod implicit_lod;
pub(crate) mod observer;
pub(crate) mod pass;
pub(crate) mod pipeline_descriptor;
pub(crate) mod render_pipeline;
pub(crate) mod resolved;
pub(crate) mod rules;
pub mod sampler;
pub mod shader;
pub(crate) mod state;
pub(crate) mod statistics;
pub(crate) mod surface;
pub(crate) mod texture;
pub(crate) mod texture_descriptor;
pub(crate) mod texture_view;
