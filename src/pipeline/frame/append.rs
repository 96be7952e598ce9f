//! Appends one frame to another.

use crate::frame::description::{
    AttachmentView, BindEntry, BindGroup, BindGroupId, BufferId, ColorAttachment, DepthStencilAttachment, Draw, Frame, FrameIndex, Pass,
    PipelineId, StreamOut, TextureId, TextureView,
};

/// Numbers of resources of each kind that the frame has before another one is appended.
struct Offsets {
    textures: u32,
    buffers: u32,
    pipelines: u32,
    bind_groups: u32,
}

impl Frame {
    /// Appends the resources and passes of another frame.
    ///
    /// Every id in `part` is shifted by the number of resources that `self` already has, so the appended passes use their own resources, as before.
    /// The rules of `self` apply to both; those of `part` are dropped.
    pub fn append(&mut self, part: Self) {
        let Self { rules: _, textures, buffers, pipelines, bind_groups, passes } = part;
        let offsets = Offsets {
            textures: self.textures.len() as u32,
            buffers: self.buffers.len() as u32,
            pipelines: self.pipelines.len() as u32,
            bind_groups: self.bind_groups.len() as u32,
        };
        self.textures.extend(textures);
        self.buffers.extend(buffers);
        self.pipelines.extend(pipelines);
        self.bind_groups.extend(bind_groups.into_iter().map(|group| offsets.bind_group(group)));
        self.passes.extend(passes.into_iter().map(|pass| offsets.pass(pass)));
    }
}

/// The structs are destructured field by field, so a new field that holds an id cannot be forgotten here.
impl Offsets {
    fn texture(&self, TextureId(id): TextureId) -> TextureId {
        TextureId(id + self.textures)
    }

    fn buffer(&self, BufferId(id): BufferId) -> BufferId {
        BufferId(id + self.buffers)
    }

    fn bind_group(&self, BindGroup { entries }: BindGroup) -> BindGroup {
        let moved = |entry| match entry {
            BindEntry::Uniform(buffer, offset) => BindEntry::Uniform(self.buffer(buffer), offset),
            BindEntry::DynamicUniform(buffer) => BindEntry::DynamicUniform(self.buffer(buffer)),
            BindEntry::Storage(buffer) => BindEntry::Storage(self.buffer(buffer)),
            BindEntry::Texture(TextureView { texture, range }) => BindEntry::Texture(TextureView { texture: self.texture(texture), range }),
            BindEntry::Sampler(sampler) => BindEntry::Sampler(sampler),
        };
        BindGroup { entries: entries.into_iter().map(moved).collect() }
    }

    fn view(&self, AttachmentView { texture, level, layer }: AttachmentView) -> AttachmentView {
        AttachmentView { texture: self.texture(texture), level, layer }
    }

    fn pass(&self, Pass { label, color, depth_stencil, draws, query_count, stream_out, cached }: Pass) -> Pass {
        let color_target = |ColorAttachment { view, load }| ColorAttachment { view: self.view(view), load };
        let stream = |StreamOut { buffer, append }| StreamOut { buffer: self.buffer(buffer), append };
        let depth_target = |DepthStencilAttachment { view, depth_load, stencil_load }| DepthStencilAttachment {
            view: self.view(view),
            depth_load,
            stencil_load,
        };
        Pass {
            label,
            color: color.into_iter().map(|target| target.map(color_target)).collect(),
            depth_stencil: depth_stencil.map(depth_target),
            draws: draws.into_iter().map(|draw| self.draw(draw)).collect(),
            query_count,
            stream_out: stream_out.into_iter().map(stream).collect(),
            cached,
        }
    }

    fn draw(&self, draw: Draw) -> Draw {
        let Draw {
            pipeline: PipelineId(pipeline),
            bind_group: BindGroupId(bind_group),
            dynamic_offset,
            vertex_buffers,
            index,
            vertices,
            base_vertex,
            instances,
            viewport,
            scissor,
            stencil_reference,
            blend_constant,
            query,
            stream_out,
            streamed,
        } = draw;
        Draw {
            pipeline: PipelineId(pipeline + self.pipelines),
            bind_group: BindGroupId(bind_group + self.bind_groups),
            dynamic_offset,
            vertex_buffers: vertex_buffers.into_iter().map(|(buffer, offset)| (self.buffer(buffer), offset)).collect(),
            index: index.map(|FrameIndex { buffer, format }| FrameIndex { buffer: self.buffer(buffer), format }),
            vertices,
            base_vertex,
            instances,
            viewport,
            scissor,
            stencil_reference,
            blend_constant,
            query,
            stream_out,
            streamed: streamed.map(|buffer| self.buffer(buffer)),
        }
    }
}
