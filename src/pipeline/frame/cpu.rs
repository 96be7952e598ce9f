//! The CPU executor: runs a frame's passes on the software GPU.

use rayon::prelude::*;

use crate::state::{PixelRect, Viewport};
use crate::{
    Binding, Bindings, Buffer, ColorAttachment, DepthStencilAttachment, Device, Draw, IndexBuffer, LoadOp, Observer, Pass, PassError,
    PassOutput, PipelineError, PrimitiveClass, RenderPipeline, RenderPipelineDescriptor, StreamOutTarget, Texture, TextureError,
    VertexBuffer, run_pass,
};

use super::description::{BindEntry, Frame, FrameDraw, FramePass, FrameTexture, Initial, TextureId};

/// Least bin budget that a pass can work with.
const MIN_BIN_BYTES: u64 = 8 << 20;

/// Draws that one task makes ready.
const DRAWS_PER_TASK: usize = 4096;

/// Why a frame cannot run. Nothing has been drawn when one of these is returned by validation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// A texture is not possible.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// A pipeline is not possible.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// A pass is not possible.
    #[error(transparent)]
    Pass(#[from] PassError),
    /// Another executor cannot run it.
    #[error("{0}")]
    Backend(String),
    /// Something refers to what is not there.
    #[error("pass `{pass}`: {what}")]
    Reference {
        /// The pass's label.
        pass: String,
        /// What is wrong.
        what: String,
    },
    /// The frame needs more memory than it may use.
    #[error(
        "the frame needs {needed_mib} MiB and may use {limit_mib} MiB; the largest part is `{largest}` with {largest_mib} MiB: \
         lower the image size, the water grid or the shadow map size, or raise the limit"
    )]
    Memory {
        /// Needed, rounded up.
        needed_mib: u64,
        /// Allowed.
        limit_mib: u64,
        /// Name of the largest resource.
        largest: String,
        /// Its size, rounded up.
        largest_mib: u64,
    },
}

/// Sees every pass of a frame, and through [`Observer`] every stage of it.
pub trait FrameObserver: Send {
    /// A pass is about to run. Return an observer to see inside of it.
    fn pass_begin(&mut self, index: usize, pass: &FramePass) -> Option<&mut dyn Observer>;
    /// A pass has run; `textures` are as it left them.
    fn pass_end(&mut self, _index: usize, _pass: &FramePass, _textures: &[Texture], _output: &PassOutput) {}
}

/// What a frame left behind.
#[derive(Debug)]
pub struct FrameOutput<'a> {
    /// The device of the executor, for work on the textures.
    pub device: &'a Device,
    /// By texture number.
    pub textures: &'a [Texture],
    /// By pass number.
    pub passes: Vec<PassOutput>,
}

impl FrameOutput<'_> {
    /// A texture.
    #[must_use]
    pub fn texture(&self, id: TextureId) -> &Texture {
        &self.textures[id.index()]
    }
}

/// Something that runs frames.
pub trait Executor: Send {
    /// Runs a frame from its initial contents to its last pass.
    ///
    /// # Errors
    /// If the frame is not valid, too large, or asks for what the executor does not have; nothing has been drawn then.
    fn run(&mut self, frame: &Frame, observer: Option<&mut dyn FrameObserver>) -> Result<FrameOutput<'_>, FrameError>;
    /// The software GPU: all of a CPU executor, elsewhere what runs the stages that the driver lacks.
    fn device(&self) -> &Device;
}

/// Runs frames on the software GPU. Keeps textures between frames of the same shape, because fresh pages cost more than drawing.
pub struct CpuExecutor {
    device: Device,
    memory_limit_bytes: u64,
    textures: Vec<Texture>,
}

impl CpuExecutor {
    /// An executor on a device that refuses frames above a memory limit (resources and bins).
    #[must_use]
    pub fn new(device: Device, memory_limit_bytes: u64) -> Self {
        Self { device, memory_limit_bytes, textures: Vec::new() }
    }
}

/// Makes a frame's textures, or takes those of the last frame, and puts into them what they hold before the first pass.
fn prepare_textures(frame: &Frame, textures: &mut Vec<Texture>) -> Result<(), FrameError> {
    textures.truncate(frame.textures.len());
    let cleared = cleared_first(frame);
    for (i, described) in frame.textures.iter().enumerate() {
        let reusable = textures.get(i).is_some_and(|t| *t.desc() == described.desc);
        if !reusable {
            let texture = Texture::new(described.desc.clone())?;
            if i < textures.len() {
                textures[i] = texture;
            } else {
                textures.push(texture);
            }
        }
        fill_initial(&mut textures[i], described, reusable && !cleared[i])?;
    }
    Ok(())
}

impl Executor for CpuExecutor {
    fn run(&mut self, frame: &Frame, mut observer: Option<&mut dyn FrameObserver>) -> Result<FrameOutput<'_>, FrameError> {
        let Self { device, memory_limit_bytes, textures } = self;
        // Everything on the device's threads at once: going there for each small pass takes longer than the pass.
        let passes = device.install(|| {
            check_memory(frame, device, *memory_limit_bytes)?;
            check_references(frame)?;
            let pipelines = pipelines(frame)?;
            prepare_textures(frame, textures)?;
            let mut outputs = Vec::with_capacity(frame.passes.len());
            for (index, pass) in frame.passes.iter().enumerate() {
                let inside = observer.as_deref_mut().and_then(|o| o.pass_begin(index, pass));
                let output = match (&pass.cached, inside) {
                    (Some(cached), None) => cached.clone(),
                    (_, inside) => run_frame_pass(device, frame, &pipelines, pass, textures, inside)?,
                };
                if let Some(observer) = observer.as_deref_mut() {
                    observer.pass_end(index, pass, textures, &output);
                }
                outputs.push(output);
            }
            Ok::<_, FrameError>(outputs)
        })?;
        Ok(FrameOutput { device: &self.device, textures: &self.textures, passes })
    }

    fn device(&self) -> &Device {
        &self.device
    }
}

/// Refuses a frame that needs more memory than it may use: its resources, and the bins of the software GPU.
///
/// # Errors
/// [`FrameError::Memory`], with the largest part named.
pub fn check_memory(frame: &Frame, device: &Device, limit_bytes: u64) -> Result<(), FrameError> {
    let bins = (device.wave_bytes() as u64).max(MIN_BIN_BYTES);
    let needed = frame.memory().resources().saturating_add(bins);
    if needed <= limit_bytes {
        return Ok(());
    }
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let (largest, largest_bytes) = frame.largest_resource().unwrap_or(("bins", bins));
    Err(FrameError::Memory {
        needed_mib: mib(needed),
        limit_mib: limit_bytes >> 20,
        largest: largest.to_owned(),
        largest_mib: mib(largest_bytes),
    })
}

/// The frame's pipelines, validated.
pub fn pipelines(frame: &Frame) -> Result<Vec<RenderPipeline>, PipelineError> {
    frame.pipelines.iter().map(|desc| RenderPipeline::new(desc.clone(), frame.rules)).collect()
}

/// The frame's textures as they are before the first pass.
pub fn initial_textures(frame: &Frame) -> Result<Vec<Texture>, TextureError> {
    let filled = |described: &FrameTexture| {
        let mut texture = Texture::new(described.desc.clone())?;
        fill_initial(&mut texture, described, false)?;
        Ok(texture)
    };
    frame.textures.iter().map(filled).collect()
}

/// Puts a texture's initial contents in place; `stale` if it may hold an earlier frame.
fn fill_initial(texture: &mut Texture, described: &FrameTexture, stale: bool) -> Result<(), TextureError> {
    match &described.initial {
        Initial::Zero => {
            if stale {
                for level in 0..described.desc.mip_level_count {
                    for layer in 0..described.desc.level_size(level).2 {
                        let surface = texture.surface_mut(level, layer);
                        surface.planes.fill(0.0);
                        surface.stencil.fill(0);
                    }
                }
            }
        }
        Initial::Layers(layers) => {
            for (layer, bytes) in layers.iter().enumerate() {
                texture.write_bytes(0, layer as u32, bytes)?;
            }
            texture.generate_mips();
        }
    }
    Ok(())
}

/// By texture: whether the first thing that happens to it is that a pass clears all of it.
pub fn cleared_first(frame: &Frame) -> Vec<bool> {
    // By texture: nothing has happened yet, or whether it was cleared.
    let mut first: Vec<Option<bool>> =
        frame.textures.iter().map(|t| (t.desc.mip_level_count > 1 || t.desc.depth_or_layers > 1).then_some(false)).collect();
    let mut happens = |texture: TextureId, clears: bool| {
        first[texture.index()].get_or_insert(clears);
    };
    for pass in &frame.passes {
        for target in pass.color.iter().flatten() {
            happens(target.view.texture, matches!(target.load, LoadOp::Clear(_)));
        }
        if let Some(target) = &pass.depth {
            let format = crate::format_info(frame.textures[target.view.texture.index()].desc.format);
            let depth = format.is_none_or(|f| !f.depth) || matches!(target.depth_load, LoadOp::Clear(_));
            let stencil = format.is_none_or(|f| !f.stencil) || matches!(target.stencil_load, LoadOp::Clear(_));
            happens(target.view.texture, depth && stencil);
        }
        for entry in pass.bind_groups().iter().flat_map(|group| &frame.bind_groups[group.index()].entries) {
            if let BindEntry::Texture(texture) = entry {
                happens(*texture, false);
            }
        }
    }
    first.into_iter().map(|first| first == Some(true)).collect()
}

/// Every number in the frame points at something.
pub fn check_references(frame: &Frame) -> Result<(), FrameError> {
    let fail = |pass: &str, what: String| Err(FrameError::Reference { pass: pass.to_owned(), what });
    for (number, group) in frame.bind_groups.iter().enumerate() {
        for entry in &group.entries {
            let missing = match entry {
                BindEntry::Uniform(b, _) | BindEntry::DynamicUniform(b) | BindEntry::Storage(b) => b.index() >= frame.buffers.len(),
                BindEntry::Texture(t) => t.index() >= frame.textures.len(),
                BindEntry::Sampler(_) => false,
            };
            if missing {
                return fail("(bind groups)", format!("bind group {number} names {entry:?}, which the frame does not have"));
            }
        }
    }
    for pass in &frame.passes {
        let views = pass.attachments();
        for (i, view) in views.iter().enumerate() {
            let Some(texture) = frame.textures.get(view.texture.index()) else {
                return fail(&pass.label, format!("attachment {i} names texture {}, which the frame does not have", view.texture.index()));
            };
            if view.level >= texture.desc.mip_level_count || view.layer >= texture.desc.level_size(view.level).2 {
                return fail(
                    &pass.label,
                    format!("attachment {i} is level {} layer {} of `{}`", view.level, view.layer, texture.desc.label),
                );
            }
            if views[..i].iter().any(|earlier| earlier.texture == view.texture) {
                return fail(&pass.label, format!("texture `{}` is attached twice", texture.desc.label));
            }
        }
        let problems = pass.draws.par_iter().enumerate().with_min_len(DRAWS_PER_TASK);
        if let Some(what) = problems.find_map_first(|(number, draw)| missing_reference(frame, number, draw)) {
            return fail(&pass.label, what);
        }
        for entry in pass.bind_groups().iter().flat_map(|group| &frame.bind_groups[group.index()].entries) {
            if let BindEntry::Texture(texture) = entry
                && views.iter().any(|v| v.texture == *texture)
            {
                let name = &frame.textures[texture.index()].desc.label;
                return fail(&pass.label, format!("texture `{name}` is read and drawn to in the same pass"));
            }
        }
    }
    Ok(())
}

/// What a draw names that the frame does not have.
fn missing_reference(frame: &Frame, number: usize, draw: &FrameDraw) -> Option<String> {
    if draw.pipeline.index() >= frame.pipelines.len() || draw.bind_group.index() >= frame.bind_groups.len() {
        return Some(format!("draw {number} names a pipeline or bind group that the frame does not have"));
    }
    let mut buffers = draw.vertex_buffers.iter().map(|b| b.0).chain(draw.index.iter().map(|i| i.buffer));
    let missing = buffers.find(|buffer| buffer.index() >= frame.buffers.len())?;
    Some(format!("draw {number} names buffer {}, which the frame does not have", missing.index()))
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

fn data(frame: &Frame, id: super::description::BufferId) -> &Buffer {
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
