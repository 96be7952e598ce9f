//! The software GPU: from draws to attachments, every stage exact, the same bytes on any number of threads and at any SIMD level.
//!
//! Stages in order: index fetch and primitive assembly (`assemble`), vertex (`fetch`, `shader`, `batch`), geometry, stream-out (`chunk`), clip
//! (`clip`), viewport and snap (`viewport`, `vertices`), cull and setup (`emit`, `outline`, `small`, `setup`), bin (`bins`); then per tile: raster (`raster`), depth
//! and stencil (`coarse_depth`, `coarse_stencil`, `block_depth`, `depth_stencil`), fragment (`shader`, `batch`), blend (`blend`). `pass`, `chunk` and `tile` are the only
//! files that know the order; `plan` cuts draws into chunks,
//! and `repeat` finds draws that need the first half of it once.
//!
//! What is not here: multisampling, line and point polygon modes, conservative rasterization, storage writes from shaders.

mod assemble;
mod batch;
mod bindings;
mod bins;
mod blend;
mod block_depth;
mod chunk;
mod clip;
mod coarse_depth;
mod coarse_stencil;
mod depth_bias;
mod depth_stencil;
mod emit;
mod fast_path;
mod fetch;
mod format;
pub mod frame;
mod implicit_lod;
mod observer;
mod outline;
mod pass;
mod pass_check;
mod plan;
mod raster;
mod render_pipeline;
mod repeat;
pub mod sampler;
mod setup;
pub mod shader;
mod small;
mod spare;
pub mod state;
mod statistics;
mod texture;
mod tile;
mod vertices;
mod viewport;

pub use assemble::IndexBuffer;
pub use bindings::{Binding, BindingKind, Bindings, Buffer};
pub use depth_stencil::{compare, stencil_operation};
pub use fetch::VertexBuffer;
pub use format::{
    ChannelKind, FORMATS, FormatInfo, Quantizer, SUPPORTED_FORMATS, decode_texel, depth_value, encode_texel, f16_to_f32, f32_to_f16,
    f32_to_ufloat, format_info, format_name, linear_to_srgb8, quantize_depth, srgb8_to_linear, ufloat_to_f32,
};
pub use implicit_lod::{Coordinates, FragmentPlace};
pub use observer::{FragmentEvent, FragmentOutcome, Observer, PrimitiveEvent, PrimitiveOutcome};
pub use pass::{
    ColorAttachment, DepthStencilAttachment, Device, DeviceError, DeviceOptions, Draw, LoadOp, Pass, PassError, PassOutput,
    StreamOutTarget, run_pass,
};
pub use render_pipeline::{MAX_POINT_SIZE, PipelineError, PrimitiveClass, RenderPipeline, RenderPipelineDescriptor};
pub use statistics::{PipelineStatistics, StreamOutStatistics};
pub use texture::{MAX_SIZE, Surface, TILE, TILE_PIXELS, Texture, TextureDescriptor, TextureError, TextureShape, offset_in_tile};
