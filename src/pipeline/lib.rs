//! The software GPU: from draws to attachments. Every stage is exact, and results have the same bytes on any number of threads and at any SIMD level.
//!
//! ```
//! use nephroid_pipeline::prelude::*;
//!
//! /// Vertex shader: the position is attribute 0.
//! struct Corner;
//!
//! impl VertexShader for Corner {
//!     #[inline(always)]
//!     fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
//!         output.position = input.attribute(0);
//!     }
//! }
//!
//! /// Fragment shader: the same colour everywhere.
//! struct Orange;
//!
//! impl FragmentShader for Orange {
//!     #[inline(always)]
//!     fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
//!         output.color[0] = V4::from_array(input.token, [1.0, 0.2, 0.0, 1.0]);
//!     }
//! }
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let device = Device::new(DeviceOptions::default())?;
//!     let mut canvas = Canvas::new(&device, (8, 8), &[TextureFormat::Rgba8Unorm], None)?;
//!     let pipeline = canvas.pipeline(Program::new("orange", Corner, Orange), |desc| {
//!         desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x2])];
//!     })?;
//!     // The lower left half of the canvas, counter-clockwise: in clip space y points up.
//!     let corners = Buffer::from_slice(&[[-1.0f32, -1.0], [1.0, -1.0], [-1.0, 1.0]]);
//!     let output = canvas.draw(vec![Draw {
//!         vertex_buffers: &[VertexBuffer { buffer: &corners, offset: 0 }],
//!         ..Draw::new(&pipeline, Bindings::default(), 0..3, canvas.size())
//!     }])?;
//!
//!     // Row 0 is the top row. Pixels with their centre on the diagonal belong to the other half: the diagonal is neither a top nor a left edge.
//!     assert_eq!(canvas.pixel(0, 2, 5), [1.0, 0.2, 0.0, 1.0]);
//!     assert_eq!(canvas.pixel(0, 5, 5), [0.0; 4]);
//!     assert_eq!(output.statistics.fragments_passed, 7 * 8 / 2);
//!     Ok(())
//! }
//! ```
//!
//! `docs/examples/` has five programs of at most 60 lines, and `docs/examples.md` describes them: indices, textures and depth; counting in the
//! stencil; adding in a float target; a test that compares a pass with a committed picture.
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
//! | `canvas` | [`Canvas`]: targets, clears, draws and what they left, for tests and first programs |
//!
//! Not supported: multisampling, line and point polygon modes, conservative rasterization, storage writes from shaders.

mod api;
mod canvas;
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
pub use canvas::{Canvas, CanvasError};
/// Lanes, vectors of lanes, elementary functions and random numbers: what shaders are written with.
pub use nephroid_math as math;
pub use run::device::{Device, DeviceError, DeviceOptions};
pub use run::pass::run_pass;
pub use tile::depth_stencil::stencil_operation;

/// Pipeline state: the types of `wgpu-types`, the few that WebGPU lacks, and the rules that a rasterizer may choose.
pub mod state {
    pub use crate::api::rules::*;
    pub use crate::api::state::*;
}

/// Everything that a program which draws needs, for one `use nephroid_pipeline::prelude::*`: state, resources, shaders, [`Canvas`], lanes and
/// vectors. Elementary functions and random numbers stay in [`math`].
pub mod prelude {
    pub use nephroid_math::lanes::{Lanes, Mask};
    pub use nephroid_math::vector::{V2, V3, V4, v2, v3, v4};

    pub use crate::sampler::{AddressMode, FilterMode, Sampler, load, sample_3d, sample_compare, sample_cube, sample_grad, sample_level};
    pub use crate::shader::{
        FragmentInput, FragmentOutput, FragmentShader, Geometry, GeometryInput, GeometryOutput, GeometryShader, Interpolation, Program,
        Varying, VertexInput, VertexOutput, VertexShader,
    };
    pub use crate::state::*;
    pub use crate::{
        Binding, BindingKind, Bindings, Buffer, Canvas, Device, DeviceOptions, Draw, IndexBuffer, PassOutput, RenderPipeline,
        RenderPipelineDescriptor, Texture, TextureDescriptor, TextureShape, VertexBuffer,
    };
}
