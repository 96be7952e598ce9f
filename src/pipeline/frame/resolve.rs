//! Resolves the ids of a frame to the resources that a pass of the pipeline takes.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use rayon::prelude::*;

use crate::api::bindings::{Binding, Bindings};
use crate::api::buffer::Buffer;
use crate::api::check::pipeline::PipelineError;
use crate::api::draw::{DRAWS_PER_TASK, Draw, IndexBuffer, VertexBuffer};
use crate::api::observer::Observer;
use crate::api::pass::{ColorAttachment, DepthStencilAttachment, Pass, PassOutput, StreamOutTarget};
use crate::api::pipeline_descriptor::RenderPipelineDescriptor;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::resolved::PrimitiveClass;
use crate::api::state::{PixelRect, Viewport};
use crate::api::texture_view::{TextureView, TextureViewMut, Unattached};
use crate::frame::contents::{Contents, Streamed};
use crate::frame::description::{self, AttachmentView, BindEntry, BufferId, Frame};
use crate::frame::error::FrameError;
use crate::run::device::Device;
use crate::run::pass::run_pass;

/// The frame's pipelines, validated.
///
/// # Errors
/// If the description of a pipeline is refused.
pub fn pipelines(frame: &Frame) -> Result<Vec<RenderPipeline>, PipelineError> {
    frame.pipelines.iter().map(|desc| RenderPipeline::new(desc.clone(), frame.rules)).collect()
}

/// Width and height of a pass's attachments, pixels.
#[must_use]
pub fn target_size(frame: &Frame, pass: &description::Pass) -> (u32, u32) {
    pass.attachments().first().map_or((1, 1), |view| {
        let size = frame.textures[view.texture.index()].desc.level_size(view.level);
        (size.0, size.1)
    })
}

/// Runs one pass on `contents`. [`check_references`](super::check_references) must have accepted the frame.
///
/// # Errors
/// If the pass is not valid. Nothing has been drawn then.
pub fn run_frame_pass(
    device: &Device,
    frame: &Frame,
    pipelines: &[RenderPipeline],
    pass: &description::Pass,
    contents: &mut Contents,
    observer: Option<&mut dyn Observer>,
) -> Result<PassOutput, FrameError> {
    let stream_out = stream_out_targets(pass, contents);
    let Contents { textures, buffers, streamed } = contents;
    let views = pass.attachments();
    let (mut attached, mut rest) = (Vec::new(), Vec::with_capacity(textures.len()));
    attached.resize_with(views.len(), || None);
    for (number, texture) in textures.iter_mut().enumerate() {
        rest.push(lend(texture, number, &views, &mut attached)?);
    }
    let resolver = Resolver { buffers, streamed, size: target_size(frame, pass) };
    // A view of a surface that the pass draws to is not available: its bind group ends before it. No draw of the pass reads that binding.
    let view = |view: &description::TextureView| rest[view.texture.index()].view(&view.range).ok();
    let groups: Vec<Vec<Binding<'_>>> = frame.bind_groups.iter().map(|group| resolver.bind_group(&group.entries, &view)).collect();
    // The vertex buffers of all draws in one list, and each draw's start in it: a pass may have a hundred thousand draws without any, and a list per
    // draw would cost an allocation each.
    let vertex_buffers: Vec<VertexBuffer<'_>> = pass.draws.iter().flat_map(|draw| resolver.vertex_buffers(draw)).collect();
    let starts = pass.draws.iter().scan(0, |next, draw| Some(std::mem::replace(next, *next + draw.vertex_buffers.len())));
    let starts: Vec<usize> = starts.collect();
    let resolve_one = |(draw, &start): (&description::Draw, &usize)| {
        let bindings = Bindings::new(&groups[draw.bind_group.index()], draw.dynamic_offset as usize);
        let buffers = &vertex_buffers[start..start + draw.vertex_buffers.len()];
        resolver.draw(draw, &pipelines[draw.pipeline.index()], bindings, buffers)
    };
    let draws = device.install(|| pass.draws.par_iter().zip(&starts).with_min_len(DRAWS_PER_TASK).map(resolve_one).collect());
    let mut attached = attached.into_iter();
    let mut color = Vec::with_capacity(pass.color.len());
    for target in &pass.color {
        color.push(target.as_ref().and_then(|target| Some(ColorAttachment { view: attached.next().flatten()?, load: target.load })));
    }
    let depth_stencil = pass.depth_stencil.as_ref().zip(attached.next().flatten()).map(|(target, view)| DepthStencilAttachment {
        view,
        depth_load: target.depth_load,
        stencil_load: target.stencil_load,
    });
    let mut run = Pass { label: pass.label.clone(), color, depth_stencil, draws, query_count: pass.query_count, stream_out };
    let output = run_pass(device, &mut run, observer)?;
    let written = std::mem::take(&mut run.stream_out);
    drop(run);
    keep_streamed(frame, pass, &written, contents);
    Ok(output)
}

/// Lends a texture's attached surfaces to the pass. Returns the other surfaces.
fn lend<'a>(
    texture: &'a mut crate::api::texture::Texture,
    number: usize,
    views: &[AttachmentView],
    attached: &mut [Option<TextureViewMut<'a>>],
) -> Result<Unattached<'a>, FrameError> {
    let places: Vec<usize> = (0..views.len()).filter(|&place| views[place].texture.index() == number).collect();
    let surfaces: Vec<(u32, u32)> = places.iter().map(|&place| (views[place].level, views[place].layer)).collect();
    let (lent, rest) = texture.split(&surfaces)?;
    for (place, view) in places.into_iter().zip(lent) {
        attached[place] = Some(view);
    }
    Ok(rest)
}

/// Empty stream-out targets, each with the capacity that its buffer has left.
fn stream_out_targets(pass: &description::Pass, contents: &Contents) -> Vec<StreamOutTarget> {
    let room = |stream: &description::StreamOut| contents.stream_room(stream.buffer, stream.append) / size_of::<f32>();
    pass.stream_out.iter().map(|stream| StreamOutTarget { capacity: room(stream), ..StreamOutTarget::default() }).collect()
}

/// Writes streamed-out data to the buffers.
fn keep_streamed(frame: &Frame, pass: &description::Pass, written: &[StreamOutTarget], contents: &mut Contents) {
    for (target, (stream, written)) in pass.stream_out.iter().zip(written).enumerate() {
        let writer = pass.draws.iter().find(|draw| draw.stream_out == Some(target as u32));
        let floats = writer.map_or(1, |draw| frame.stream_floats(draw.pipeline));
        contents.write_streamed(stream.buffer, stream.append, &written.data, (written.data.len() / floats) as u32);
    }
}

/// Runs the vertex and geometry stages of one draw and returns its primitives. Textures that the draw's pass draws to cannot be read.
///
/// # Errors
/// If the draw is not valid.
pub fn stream_draw(
    device: &Device,
    frame: &Frame,
    pass: &description::Pass,
    draw: &description::Draw,
    contents: &Contents,
) -> Result<(PrimitiveClass, StreamOutTarget), FrameError> {
    Ok(stream_draws(device, frame, pass, std::slice::from_ref(draw), contents)?.swap_remove(0))
}

/// [`stream_draw`] of several draws, in parallel: the primitives of each.
///
/// # Errors
/// If a draw is not valid.
pub fn stream_draws(
    device: &Device,
    frame: &Frame,
    pass: &description::Pass,
    draws: &[description::Draw],
    contents: &Contents,
) -> Result<Vec<(PrimitiveClass, StreamOutTarget)>, FrameError> {
    let resolver = Resolver { buffers: &contents.buffers, streamed: &contents.streamed, size: target_size(frame, pass) };
    let view = |view: &description::TextureView| contents.textures.get(view.texture.index())?.view_of(&view.range).ok();
    // Thousands of draws share a few pipelines and bind groups.
    let (mut pipelines, mut groups) = (BTreeMap::new(), BTreeMap::new());
    for draw in draws {
        if let Entry::Vacant(new) = pipelines.entry(draw.pipeline) {
            let described = frame.pipelines[draw.pipeline.index()].clone();
            let streamed = RenderPipelineDescriptor { targets: Vec::new(), depth_stencil: None, rasterizer_discard: true, ..described };
            new.insert(RenderPipeline::new(streamed, frame.rules)?);
        }
        groups.entry(draw.bind_group).or_insert_with(|| resolver.bind_group(&frame.bind_groups[draw.bind_group.index()].entries, &view));
    }
    let buffers: Vec<Vec<VertexBuffer<'_>>> = draws.iter().map(|draw| resolver.vertex_buffers(draw).collect()).collect();
    let resolved = draws.iter().zip(&buffers).enumerate().map(|(number, (draw, buffers))| {
        let bindings = Bindings::new(&groups[&draw.bind_group], draw.dynamic_offset as usize);
        Draw {
            query: None,
            stream_out: Some(number as u32),
            // Without a target, the scissor is never used.
            scissor: PixelRect::full(1, 1),
            ..resolver.draw(draw, &pipelines[&draw.pipeline], bindings, buffers)
        }
    });
    let stream_out = vec![StreamOutTarget { capacity: usize::MAX, ..StreamOutTarget::default() }; draws.len()];
    let mut run = Pass { label: pass.label.clone(), draws: resolved.collect(), stream_out, ..Pass::default() };
    run_pass(device, &mut run, None)?;
    let streams = std::mem::take(&mut run.stream_out);
    Ok(draws.iter().map(|draw| pipelines[&draw.pipeline].rasterized()).zip(streams).collect())
}

/// The parts of a frame from which the draws of a pass are resolved.
struct Resolver<'a> {
    buffers: &'a [Arc<Buffer>],
    streamed: &'a [Streamed],
    /// Width and height of the pass's attachments.
    size: (u32, u32),
}

impl<'a> Resolver<'a> {
    fn buffer(&self, id: BufferId) -> &'a Buffer {
        &self.buffers[id.index()]
    }

    fn vertex_buffers(&self, draw: &description::Draw) -> impl Iterator<Item = VertexBuffer<'a>> {
        draw.vertex_buffers.iter().map(|(id, offset)| VertexBuffer { buffer: self.buffer(*id), offset: *offset })
    }

    /// The pipeline's form of a bind group, up to the first texture for which `view` returns `None`.
    fn bind_group(&self, entries: &[BindEntry], view: &impl Fn(&description::TextureView) -> Option<TextureView<'a>>) -> Vec<Binding<'a>> {
        let resolve = |entry: &BindEntry| {
            Some(match entry {
                BindEntry::Uniform(id, offset) => Binding::Uniform { buffer: self.buffer(*id), offset: *offset, dynamic: false },
                BindEntry::DynamicUniform(id) => Binding::Uniform { buffer: self.buffer(*id), offset: 0, dynamic: true },
                BindEntry::Storage(id) => Binding::Storage(self.buffer(*id)),
                BindEntry::Texture(of) => Binding::Texture(view(of)?),
                BindEntry::Sampler(sampler) => Binding::Sampler(*sampler),
            })
        };
        entries.iter().map_while(resolve).collect()
    }

    /// The pipeline's form of a frame's draw.
    fn draw(
        &self,
        draw: &description::Draw,
        pipeline: &'a RenderPipeline,
        bindings: Bindings<'a>,
        vertex_buffers: &'a [VertexBuffer<'a>],
    ) -> Draw<'a> {
        let size = self.size;
        let mut elements = draw.vertices.clone();
        if let Some(buffer) = draw.streamed {
            elements.end = elements.end.min(elements.start.saturating_add(self.streamed[buffer.index()].vertices));
        }
        Draw {
            vertex_buffers,
            index: draw.index.map(|i| IndexBuffer { buffer: self.buffer(i.buffer), format: i.format, offset: 0 }),
            base_vertex: draw.base_vertex,
            instances: draw.instances.clone(),
            viewport: draw.viewport.unwrap_or_else(|| Viewport::full(size.0, size.1)),
            scissor: draw.scissor.unwrap_or_else(|| PixelRect::full(size.0, size.1)),
            stencil_reference: draw.stencil_reference,
            blend_constant: draw.blend_constant,
            query: draw.query,
            stream_out: draw.stream_out,
            ..Draw::new(pipeline, bindings, elements, size)
        }
    }
}
