//! Validation before anything is drawn: one enum of causes for each thing that is checked, with the values seen and allowed as fields.
//!
//! `docs/validation.md` lists the rules beside WebGPU's. The enums are `non_exhaustive`: a rule that is added later adds a variant, and code that
//! matches some causes still compiles.
//!
//! | What is checked | File | When |
//! |---|---|---|
//! | pipelines | `pipeline.rs`, `color_target.rs`, `depth_stencil.rs`, `vertex_buffer.rs` | once, by `RenderPipeline::new` |
//! | bindings | `binding.rs`, `sampler.rs` | for each draw, before the first one |
//! | passes | `pass.rs`, `attachment.rs`, `draw.rs` | before the first draw |

pub(crate) mod attachment;
pub(crate) mod binding;
pub(crate) mod color_target;
pub(crate) mod depth_stencil;
pub(crate) mod draw;
pub(crate) mod pass;
pub(crate) mod pipeline;
pub(crate) mod sampler;
pub(crate) mod vertex_buffer;
