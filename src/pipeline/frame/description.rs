//! The description of a frame: plain data whose parts refer to each other by number.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use crate::api::buffer::Buffer;
use crate::api::pass::PassOutput;
use crate::api::pipeline_descriptor::RenderPipelineDescriptor;
use crate::api::rules::RasterRules;
use crate::api::sampler::Sampler;
use crate::api::shader::varying::flatten_varyings;
use crate::api::state::{Color, IndexFormat, LoadOp, PixelRect, Viewport};
use crate::api::texture_descriptor::{TextureDescriptor, TextureViewDescriptor};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub struct $name(pub(crate) u32);

        impl $name {
            /// The id of the resource at a position in the frame's list.
            #[must_use]
            pub const fn at(index: u32) -> Self {
                Self(index)
            }

            /// Position in the frame's list.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}
id!(
    /// A texture of the frame.
    TextureId
);
id!(
    /// A buffer of the frame.
    BufferId
);
id!(
    /// A pipeline of the frame.
    PipelineId
);
id!(
    /// A bind group of the frame.
    BindGroupId
);

/// Contents of a texture before the first pass.
#[derive(Clone, Debug)]
pub enum Initial {
    /// Zeros.
    Zero,
    /// Level 0 of each layer in the format's bytes, rows top down. Other mip levels are averaged from level 0.
    Layers(Vec<Arc<[u8]>>),
}

/// A texture of a frame.
#[derive(Clone, Debug)]
pub struct FrameTexture {
    /// Size, format, shape.
    pub desc: TextureDescriptor,
    /// Contents before the first pass.
    pub initial: Initial,
}

/// A buffer of a frame. Shaders only read it; stream-out can write to it.
#[derive(Clone, Debug)]
pub struct FrameBuffer {
    /// Name in errors and captures.
    pub label: String,
    /// The bytes before the first pass, shared so that a frame is cheap to keep.
    pub data: Arc<Buffer>,
}

/// The levels and layers of a texture that a shader reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureView {
    /// The texture.
    pub texture: TextureId,
    /// Levels, layers, and the shape of the view.
    pub range: TextureViewDescriptor,
}

impl From<TextureId> for TextureView {
    /// A view of the whole texture.
    fn from(texture: TextureId) -> Self {
        Self { texture, range: TextureViewDescriptor::default() }
    }
}

/// One entry of a bind group, by binding number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BindEntry {
    /// A uniform buffer from a byte offset on.
    Uniform(BufferId, usize),
    /// A uniform buffer whose offset each draw gives (`dynamic_offset`).
    DynamicUniform(BufferId),
    /// A storage buffer.
    Storage(BufferId),
    /// A texture.
    Texture(TextureView),
    /// A sampler.
    Sampler(Sampler),
}

impl BindEntry {
    /// A texture, or a view of some levels and layers of it.
    pub fn texture(view: impl Into<TextureView>) -> Self {
        Self::Texture(view.into())
    }
}

/// A bind group: bindings that draws share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BindGroup {
    /// By binding number.
    pub entries: Vec<BindEntry>,
}

/// One level of one layer of a texture, as an attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AttachmentView {
    /// The texture.
    pub texture: TextureId,
    /// Mip level.
    pub level: u32,
    /// Layer or slice.
    pub layer: u32,
}

impl From<TextureId> for AttachmentView {
    fn from(texture: TextureId) -> Self {
        Self { texture, level: 0, layer: 0 }
    }
}

/// A colour attachment of a pass.
#[derive(Clone, Copy, Debug)]
pub struct ColorAttachment {
    /// The surface that is drawn to.
    pub view: AttachmentView,
    /// Value before the first draw: cleared or kept.
    pub load: LoadOp<Color>,
}

/// The depth-stencil attachment of a pass.
#[derive(Clone, Copy, Debug)]
pub struct DepthStencilAttachment {
    /// The surface that is drawn to.
    pub view: AttachmentView,
    /// Depth before the first draw.
    pub depth_load: LoadOp<f32>,
    /// Stencil before the first draw.
    pub stencil_load: LoadOp<u32>,
}

/// A buffer that a pass streams primitives out to: per vertex the clip position (4 floats), then the varyings' scalars.
///
/// Only whole primitives are written; those for which there is no room are counted and dropped [D3D11.3 §14.5].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamOut {
    /// The buffer; its length is the room for primitives.
    pub buffer: BufferId,
    /// Whether primitives are written after those of earlier passes; otherwise they overwrite the buffer from its start.
    pub append: bool,
}

/// An index buffer of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameIndex {
    /// The buffer.
    pub buffer: BufferId,
    /// 16 or 32 bits.
    pub format: IndexFormat,
}

/// One draw of a pass. [`crate::Draw`] describes the fields.
#[derive(Clone, Debug)]
pub struct Draw {
    /// The pipeline.
    pub pipeline: PipelineId,
    /// The bind group.
    pub bind_group: BindGroupId,
    /// Byte offset of the dynamic uniform, a multiple of 256 (WebGPU's limit). Default: 0.
    pub dynamic_offset: u32,
    /// Vertex buffers with byte offsets, by slot. Default: none.
    pub vertex_buffers: Vec<(BufferId, usize)>,
    /// Index buffer. Default: none.
    pub index: Option<FrameIndex>,
    /// Vertices; for an indexed draw, the range of the index buffer.
    pub vertices: Range<u32>,
    /// Added to every index. Default: 0.
    pub base_vertex: i32,
    /// Instances. Default: one.
    pub instances: Range<u32>,
    /// Viewport. Default: the whole target.
    pub viewport: Option<Viewport>,
    /// Scissor. Default: the whole target.
    pub scissor: Option<PixelRect>,
    /// Stencil reference. Default: 0.
    pub stencil_reference: u32,
    /// Blend constant. Default: zeros.
    pub blend_constant: [f32; 4],
    /// Occlusion query of the pass. Default: none.
    pub query: Option<u32>,
    /// Stream-out target of the pass that this draw's primitives are appended to. Default: none.
    pub stream_out: Option<u32>,
    /// A buffer that earlier passes streamed out to: at most as many vertices are drawn as they wrote [D3D11 DrawAuto]. Default: none.
    pub streamed: Option<BufferId>,
}

impl Draw {
    /// A draw of `elements` vertices, every other field at its default.
    #[must_use]
    pub fn new(pipeline: PipelineId, bind_group: BindGroupId, vertices: Range<u32>) -> Self {
        Self {
            pipeline,
            bind_group,
            dynamic_offset: 0,
            vertex_buffers: Vec::new(),
            index: None,
            vertices,
            base_vertex: 0,
            instances: 0..1,
            viewport: None,
            scissor: None,
            stencil_reference: 0,
            blend_constant: [0.0; 4],
            query: None,
            stream_out: None,
            streamed: None,
        }
    }
    /// The draw with 32-bit indices from a buffer.
    #[must_use]
    pub fn indexed(mut self, buffer: BufferId) -> Self {
        self.index = Some(FrameIndex { buffer, format: IndexFormat::Uint32 });
        self
    }
}

/// One render pass.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// Name in errors, in captures and for `--layers`.
    pub label: String,
    /// Colour attachments by target; `None` for a target without one.
    pub color: Vec<Option<ColorAttachment>>,
    /// Depth-stencil attachment.
    pub depth_stencil: Option<DepthStencilAttachment>,
    /// Draws in submission order.
    pub draws: Vec<Draw>,
    /// Number of occlusion queries.
    pub query_count: usize,
    /// Stream-out targets, by the number that draws name.
    pub stream_out: Vec<StreamOut>,
    /// Output of the pass, if it ran while the frame was built and leaves its attachments unchanged. An executor may return it instead of running the
    /// pass, unless an observer watches the pass. Default: `None`.
    pub cached: Option<PassOutput>,
}

impl Pass {
    /// The surfaces that the pass draws to: colour attachments in order, then depth-stencil.
    #[must_use]
    pub fn attachments(&self) -> Vec<AttachmentView> {
        self.color.iter().flatten().map(|t| t.view).chain(self.depth_stencil.iter().map(|t| t.view)).collect()
    }

    /// The bind groups that the draws use, each once. A pass may have a hundred thousand draws with one bind group.
    #[must_use]
    pub fn bind_groups(&self) -> BTreeSet<BindGroupId> {
        self.draws.chunk_by(|a, b| a.bind_group == b.bind_group).map(|run| run[0].bind_group).collect()
    }

    /// The texture views that the draws read, in the order of the bind groups.
    pub fn views_read<'f>(&self, frame: &'f Frame) -> impl Iterator<Item = &'f TextureView> + use<'f> {
        let groups = self.bind_groups().into_iter().filter_map(|group| frame.bind_groups.get(group.index()));
        groups.flat_map(|group| &group.entries).filter_map(|entry| match entry {
            BindEntry::Texture(view) => Some(view),
            _ => None,
        })
    }
}

/// A frame: named resources and an ordered list of passes.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Rasterization rules of all pipelines.
    pub rules: RasterRules,
    /// Textures, attachments included.
    pub textures: Vec<FrameTexture>,
    /// Buffers.
    pub buffers: Vec<FrameBuffer>,
    /// Pipelines.
    pub pipelines: Vec<RenderPipelineDescriptor>,
    /// Bind groups.
    pub bind_groups: Vec<BindGroup>,
    /// Passes in order.
    pub passes: Vec<Pass>,
}

impl Frame {
    /// Adds a texture of zeros.
    pub fn texture(&mut self, desc: TextureDescriptor) -> TextureId {
        self.textures.push(FrameTexture { desc, initial: Initial::Zero });
        TextureId(self.textures.len() as u32 - 1)
    }
    /// Adds a texture with initial data, one byte string per layer (see [`Initial::Layers`]).
    pub fn texture_with(&mut self, desc: TextureDescriptor, layers: Vec<Arc<[u8]>>) -> TextureId {
        self.textures.push(FrameTexture { desc, initial: Initial::Layers(layers) });
        TextureId(self.textures.len() as u32 - 1)
    }
    /// Adds a buffer.
    pub fn buffer(&mut self, label: impl Into<String>, data: Arc<Buffer>) -> BufferId {
        self.buffers.push(FrameBuffer { label: label.into(), data });
        BufferId(self.buffers.len() as u32 - 1)
    }
    /// Adds a pipeline.
    pub fn pipeline(&mut self, desc: RenderPipelineDescriptor) -> PipelineId {
        self.pipelines.push(desc);
        PipelineId(self.pipelines.len() as u32 - 1)
    }
    /// Adds a bind group.
    pub fn bind_group(&mut self, entries: Vec<BindEntry>) -> BindGroupId {
        self.bind_groups.push(BindGroup { entries });
        BindGroupId(self.bind_groups.len() as u32 - 1)
    }
    /// Floats per vertex that draws with a pipeline stream out: clip position (4), then the varyings' scalars.
    #[must_use]
    pub fn stream_floats(&self, pipeline: PipelineId) -> usize {
        4 + flatten_varyings(&self.pipelines[pipeline.index()].program.varyings).len()
    }
    /// The pass with this label.
    #[must_use]
    pub fn pass_index(&self, label: &str) -> Option<usize> {
        self.passes.iter().position(|p| p.label == label)
    }
    /// The texture with this label.
    #[must_use]
    pub fn texture_named(&self, label: &str) -> Option<TextureId> {
        self.textures.iter().position(|t| t.desc.label == label).map(|i| TextureId(i as u32))
    }
}
