//! From a frame's numbers to what a pass of the pipeline takes.

use rayon::prelude::*;

use crate::api::bindings::{Binding, Bindings};
use crate::api::buffer::Buffer;
use crate::api::draw::{DRAWS_PER_TASK, Draw, IndexBuffer, VertexBuffer};
use crate::api::observer::Observer;
use crate::api::pass::{ColorAttachment, DepthStencilAttachment, Pass, PassOutput, StreamOutTarget};
use crate::api::render_pipeline::{PipelineError, RenderPipeline, RenderPipelineDescriptor};
use crate::api::resolved::PrimitiveClass;
use crate::api::state::{PixelRect, Viewport};
use crate::api::texture::Texture;
use crate::frame::description::{BindEntry, BufferId, Frame, FrameDraw, FramePass};
use crate::frame::executor::FrameError;
use crate::run::device::Device;
use crate::run::pass::run_pass;

/// The frame's pipelines, validated.
pub fn pipelines(frame: &Frame) -> Result<Vec<RenderPipeline>, PipelineError> {
    frame.pipelines.iter().map(|desc| RenderPipeline::new(desc.clone(), frame.rules)).collect()
}

/// Runs one pass on textures as they are. [`check_references`] must have passed.
pub fn run_frame_pass(
    device: &Device,
    frame: &Frame,
    pipelines: &[RenderPipeline],
    pass: &FramePass,
    textures: &mut [Texture],
    observer: Option<&mut dyn Observer>,
) -> Result<PassOutput, FrameError> {
    let views = pass.attachments();
    let size = target_size(frame, pass);
    // Attachments are lent out mutably, all other textures shared.
    let mut attached: Vec<Option<&mut Texture>> = views.iter().map(|_| None).collect();
    let mut shared: Vec<Option<&Texture>> = Vec::with_capacity(textures.len());
    for (i, texture) in textures.iter_mut().enumerate() {
        match views.iter().position(|v| v.texture.index() == i) {
            Some(slot) => {
                attached[slot] = Some(texture);
                shared.push(None);
            }
            None => shared.push(Some(&*texture)),
        }
    }
    let groups: Vec<Vec<Binding<'_>>> =
        frame.bind_groups.iter().map(|group| group.entries.iter().map_while(|entry| resolve(frame, entry, &shared)).collect()).collect();
    // All draws' vertex buffers in one list, and where each draw's begin: a pass may have a hundred thousand draws without any.
    let vertex_buffers: Vec<VertexBuffer<'_>> = pass.draws.iter().flat_map(|draw| vertex_buffers(frame, draw)).collect();
    let starts = pass.draws.iter().scan(0, |next, draw| Some(std::mem::replace(next, *next + draw.vertex_buffers.len())));
    let starts: Vec<usize> = starts.collect();
    let resolve_one = |(draw, &start): (&FrameDraw, &usize)| {
        let bindings = Bindings::new(&groups[draw.bind_group.index()], draw.dynamic_offset as usize);
        let buffers = &vertex_buffers[start..start + draw.vertex_buffers.len()];
        resolve_draw(frame, draw, &pipelines[draw.pipeline.index()], bindings, buffers, size)
    };
    let draws = device.install(|| pass.draws.par_iter().zip(&starts).with_min_len(DRAWS_PER_TASK).map(resolve_one).collect());
    let mut lent = attached.into_iter();
    let mut color = Vec::with_capacity(pass.color.len());
    for target in &pass.color {
        color.push(match target {
            Some(target) => lent.next().flatten().map(|texture| ColorAttachment {
                format: texture.desc().format,
                surface: texture.surface_mut(target.view.level, target.view.layer),
                load: target.load,
            }),
            None => None,
        });
    }
    let depth_stencil = pass.depth.as_ref().zip(lent.next().flatten()).map(|(target, texture)| DepthStencilAttachment {
        format: texture.desc().format,
        surface: texture.surface_mut(target.view.level, target.view.layer),
        depth_load: target.depth_load,
        stencil_load: target.stencil_load,
    });
    let mut run = Pass { label: pass.label.clone(), color, depth_stencil, draws, query_count: pass.query_count, stream_out: Vec::new() };
    Ok(run_pass(device, &mut run, observer)?)
}

/// Width and height of a pass's attachments.
pub fn target_size(frame: &Frame, pass: &FramePass) -> (u32, u32) {
    pass.attachments().first().map_or((1, 1), |view| {
        let size = frame.textures[view.texture.index()].desc.level_size(view.level);
        (size.0, size.1)
    })
}

/// Runs the vertex and geometry stages of one draw and returns its primitives. Textures that the draw's pass draws to are not read.
pub fn stream_draw(
    device: &Device,
    frame: &Frame,
    pass: &FramePass,
    draw: &FrameDraw,
    textures: &[Texture],
) -> Result<(PrimitiveClass, StreamOutTarget), FrameError> {
    let described = &frame.pipelines[draw.pipeline.index()];
    let streamed = RenderPipelineDescriptor { targets: Vec::new(), depth_stencil: None, rasterizer_discard: true, ..described.clone() };
    let pipeline = RenderPipeline::new(streamed, frame.rules)?;
    let shared: Vec<Option<&Texture>> = textures.iter().map(Some).collect();
    let entries = &frame.bind_groups[draw.bind_group.index()].entries;
    let group: Vec<Binding<'_>> = entries.iter().map_while(|entry| resolve(frame, entry, &shared)).collect();
    let bindings = Bindings::new(&group, draw.dynamic_offset as usize);
    let buffers: Vec<VertexBuffer<'_>> = vertex_buffers(frame, draw).collect();
    let resolved = Draw {
        query: None,
        stream_out: Some(0),
        // There is no target to be inside of.
        scissor: PixelRect::full(1, 1),
        ..resolve_draw(frame, draw, &pipeline, bindings, &buffers, target_size(frame, pass))
    };
    let target = StreamOutTarget { capacity: usize::MAX, ..StreamOutTarget::default() };
    let mut run = Pass { label: pass.label.clone(), draws: vec![resolved], stream_out: vec![target], ..Pass::default() };
    run_pass(device, &mut run, None)?;
    Ok((pipeline.rasterized(), run.stream_out.swap_remove(0)))
}

fn vertex_buffers<'a>(frame: &'a Frame, draw: &'a FrameDraw) -> impl Iterator<Item = VertexBuffer<'a>> {
    draw.vertex_buffers.iter().map(|(id, offset)| VertexBuffer { buffer: data(frame, *id), offset: *offset })
}

/// A frame's draw as the pipeline takes it, to a target of this size.
fn resolve_draw<'a>(
    frame: &'a Frame,
    draw: &FrameDraw,
    pipeline: &'a RenderPipeline,
    bindings: Bindings<'a>,
    vertex_buffers: &'a [VertexBuffer<'a>],
    size: (u32, u32),
) -> Draw<'a> {
    Draw {
        vertex_buffers,
        index: draw.index.map(|i| IndexBuffer { buffer: data(frame, i.buffer), format: i.format, offset: 0 }),
        base_vertex: draw.base_vertex,
        instances: draw.instances.clone(),
        viewport: draw.viewport.unwrap_or_else(|| Viewport::full(size.0, size.1)),
        scissor: draw.scissor.unwrap_or_else(|| PixelRect::full(size.0, size.1)),
        stencil_reference: draw.stencil_reference,
        blend_constant: draw.blend_constant,
        query: draw.query,
        ..Draw::new(pipeline, bindings, draw.elements.clone(), size)
    }
}

fn data(frame: &Frame, id: BufferId) -> &Buffer {
    &frame.buffers[id.index()].data
}

/// A bind group entry as the pipeline takes it; `None` for a texture that this pass draws to (no draw of the pass reads it).
fn resolve<'a>(frame: &'a Frame, entry: &BindEntry, shared: &[Option<&'a Texture>]) -> Option<Binding<'a>> {
    Some(match *entry {
        BindEntry::Uniform(id, offset) => Binding::Uniform { buffer: data(frame, id), offset, dynamic: false },
        BindEntry::DynamicUniform(id) => Binding::Uniform { buffer: data(frame, id), offset: 0, dynamic: true },
        BindEntry::Storage(id) => Binding::Storage(data(frame, id)),
        BindEntry::Texture(id) => Binding::Texture((*shared.get(id.index())?)?),
        BindEntry::Sampler(sampler) => Binding::Sampler(sampler),
    })
}
