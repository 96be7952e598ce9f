//! The software GPU: from draws to attachments. Every stage is exact, and results have the same bytes on any number of threads and at any SIMD level.
//!
//! Rooms, in the order in which a pass goes through them. A room uses only those above it in this table:
//!
//! | Room | What is in it |
//! |---|---|
//! | `api` | the interface: formats, textures, shaders, pipelines, draws, passes |
//! | `primitive` | data between phases: vertices in window coordinates, planes, set-up primitives |
//! | `vendor` | arithmetic of known drivers, separate from the reference path |
//! | `geometry` | fetch, assembly, vertex, geometry, stream-out, clip, viewport, cull, setup, bin |
//! | `tile` | raster, depth and stencil, fragment, blend |
//! | `run` | devices, and the order of all work in a pass |
//! | [`frame`] | resources and passes as data, and the executor that runs them |
//!
//! Not supported: multisampling, line and point polygon modes, conservative rasterization, storage writes from shaders.

mod api;
pub mod frame;
mod geometry;
mod primitive;
mod run;
mod tile;
mod vendor;

pub use api::bindings::{Binding, BindingKind, Bindings};
pub use api::buffer::Buffer;
pub use api::check::attachment::AttachmentProblem;
pub use api::check::binding::{BindingProblem, BoundKind, MAX_UNIFORM_BYTES, STORAGE_SIZE_ALIGNMENT, UNIFORM_OFFSET_ALIGNMENT};
pub use api::check::color_target::ColorTargetProblem;
pub use api::check::depth_stencil::DepthStencilProblem;
pub use api::check::draw::DrawProblem;
pub use api::check::pass::PassError;
pub use api::check::pipeline::{PipelineError, PipelineProblem};
pub use api::check::sampler::SamplerError;
pub use api::check::vertex_buffer::{MAX_ARRAY_STRIDE, MAX_VERTEX_ATTRIBUTES, MAX_VERTEX_BUFFERS, VERTEX_ALIGNMENT, VertexBufferProblem};
pub use api::compare::compare;
pub use api::draw::{Draw, IndexBuffer, VertexBuffer};
pub use api::format::{
    ChannelKind, FORMATS, FormatInfo, Quantizer, SUPPORTED_FORMATS, decode_texel, depth_value, encode_texel, f16_to_f32, f32_to_f16,
    f32_to_ufloat, format_info, format_name, linear_to_srgb8, quantize_depth, srgb8_to_linear, ufloat_to_f32,
};
pub use api::implicit_lod::{Coordinates, FragmentPlace};
pub use api::observer::{FragmentEvent, FragmentOutcome, Observer, PrimitiveEvent, PrimitiveOutcome};
pub use api::pass::{ColorAttachment, DepthStencilAttachment, Pass, PassOutput, StreamOutTarget};
pub use api::pipeline_descriptor::{MAX_POINT_SIZE, RenderPipelineDescriptor};
pub use api::render_pipeline::RenderPipeline;
pub use api::resolved::PrimitiveClass;
pub use api::state::LoadOp;
pub use api::statistics::{PipelineStatistics, StreamOutStatistics};
pub use api::surface::{Surface, TILE, TILE_PIXELS, offset_in_tile};
pub use api::texture::Texture;
pub use api::texture_descriptor::{
    MAX_LAYERS, MAX_SIZE, MAX_VOLUME_SIZE, TextureDescriptor, TextureError, TextureShape, TextureViewDescriptor, ViewProblem, ViewRange,
};
pub use api::texture_view::{TextureView, TextureViewMut, Unattached};
pub use api::{sampler, shader};
pub use run::device::{Device, DeviceError, DeviceOptions};
pub use run::pass::run_pass;
pub use tile::depth_stencil::stencil_operation;

/// Pipeline state: the types of `wgpu-types`, the few that WebGPU lacks, and the rules that a rasterizer may choose.
pub mod state {
    pub use crate::api::rules::*;
    pub use crate::api::state::*;
}
