//! A frame on a device: its resources, and its passes, which are prepared and run.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::GpuError;
use super::device::Gpu;
use super::pipeline::{COUNTER_FORMAT, Compiled, Variant};
use super::pull::{Pulled, must_be_pulled, pull};
use super::resources::{Resources, attachment_view};
use super::stream::Streamed;
use super::twin::{PULLED_GROUP, TextureUse, VertexSource};
use nephroid_pipeline::frame::{
    AttachmentView, BindEntry, BindGroupProblem, BufferId, Contents, Draw, Frame, FrameError, Pass, PipelineId, TextureId, TextureView,
    check_references, cleared_first, target_size,
};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::state::{MAX_COLOR_TARGETS, PixelRect, PrimitiveTopology, Viewport};
use nephroid_pipeline::{BindingKind, Buffer, Device, Texture, TextureDescriptor, TextureShape};

/// Which side shades vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertices {
    /// The driver, wherever it can.
    Shaded,
    /// The software GPU: the driver draws exactly the same clip positions and varyings, so that these cannot be the cause of a difference.
    Pulled,
}

/// A frame's resources on a device.
pub struct GpuFrame<'f> {
    gpu: &'f Gpu,
    frame: &'f Frame,
    resources: Resources,
    compiled: BTreeMap<(PipelineId, Variant), Compiled>,
    pub(super) streamed: BTreeMap<PipelineId, Streamed>,
}

/// A prepared pass. It can run any number of times.
pub struct GpuPass {
    index: usize,
    draws: Vec<GpuDraw>,
    counters: Vec<wgpu::Texture>,
}

/// A prepared draw.
struct GpuDraw {
    /// Number of the draw in the pass.
    number: usize,
    pipeline: (PipelineId, Variant),
    group: Option<wgpu::BindGroup>,
    /// Pulled vertices in pieces that fit a binding, each with its number of vertices.
    pulled: Vec<(wgpu::BindGroup, u32)>,
    /// Range of vertices to draw if none are pulled.
    vertices: Range<u32>,
}

impl<'f> GpuFrame<'f> {
    /// Creates a frame's textures and buffers, and fills them.
    ///
    /// # Errors
    /// If the frame is not valid or the device cannot hold it.
    pub fn new(gpu: &'f Gpu, frame: &'f Frame) -> Result<Self, GpuError> {
        check_references(frame)?;
        let resources = Resources::new(gpu, frame)?;
        let this = Self { gpu, frame, resources, compiled: BTreeMap::new(), streamed: BTreeMap::new() };
        this.fill()?;
        Ok(this)
    }

    /// Uploads the initial contents of textures. Textures that a pass clears before they are read are left out.
    fn fill(&self) -> Result<(), GpuError> {
        let initial = Contents::initial(self.frame).map_err(FrameError::from)?;
        for (number, (texture, cleared)) in initial.textures.iter().zip(cleared_first(self.frame)).enumerate() {
            if !cleared {
                self.upload(TextureId::at(number as u32), texture)?;
            }
        }
        Ok(())
    }

    /// Replaces the contents of a texture.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn upload(&self, id: TextureId, contents: &Texture) -> Result<(), GpuError> {
        self.gpu.upload(self.resources.texture(id), contents)
    }

    /// Replaces the contents of a buffer.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn upload_buffer(&self, id: BufferId, contents: &Buffer) -> Result<(), GpuError> {
        self.gpu.write_buffer(&self.resources.buffers[id.index()], contents.bytes())
    }

    /// Reads one surface of a texture back into `into`, which must have the same description.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn download(&self, view: AttachmentView, into: &mut Texture) -> Result<(), GpuError> {
        self.gpu.download(self.resources.texture(view.texture), into, view.level, view.layer)
    }

    /// Textures that stages run by the software GPU may read in some draws of a pass.
    pub(super) fn read_by_expanded_stages(&self, pass: usize, draws: Range<usize>, vertices: Vertices) -> BTreeSet<TextureId> {
        let drawn = &self.frame.passes[pass].draws[draws];
        let expanded = drawn.iter().filter(|draw| vertices == Vertices::Pulled || must_be_pulled(self.frame, draw));
        let entries = expanded.flat_map(|draw| &self.frame.bind_groups[draw.bind_group.index()].entries);
        entries.filter_map(|entry| if let BindEntry::Texture(view) = entry { Some(view.texture) } else { None }).collect()
    }

    /// Prepares some draws of a pass. `device` runs the stages that the driver lacks, reading `contents`.
    ///
    /// # Errors
    /// If a program has no WGSL twin, the device lacks a feature, or a limit is exceeded.
    pub fn prepare(
        &mut self,
        index: usize,
        draws: Range<usize>,
        vertices: Vertices,
        device: &Device,
        contents: &Contents,
    ) -> Result<GpuPass, GpuError> {
        let pass = &self.frame.passes[index];
        let counters = self.counters(pass)?;
        let mut ready = Vec::with_capacity(draws.len());
        // Thousands of draws share a few bind groups.
        let mut groups = BTreeMap::new();
        for number in draws {
            let draw = &pass.draws[number];
            if self.frame.pipelines[draw.pipeline.index()].rasterizer_discard {
                continue;
            }
            let pulled = match vertices == Vertices::Pulled || must_be_pulled(self.frame, draw) {
                true => Some(pull(device, self.frame, pass, draw, contents)?),
                false => None,
            };
            let variant = Variant {
                vertices: pulled.as_ref().map_or(VertexSource::Shaded, |p| VertexSource::Pulled { point_coord: p.point_coord }),
                corners: pulled.as_ref().map_or(0, |p| corners(p.topology)),
                counters: counters.len() as u32,
                query: draw.query,
            };
            let key = (draw.pipeline, variant);
            if !self.compiled.contains_key(&key) {
                self.compiled.insert(key, Compiled::new(self.gpu, &self.frame.pipelines[draw.pipeline.index()], variant)?);
            }
            let compiled = &self.compiled[&key];
            let group = match groups.entry((key, draw.bind_group, draw.dynamic_offset)) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) if compiled.bindings.is_empty() => new.insert(None),
                Entry::Vacant(new) => {
                    new.insert(Some(self.bind_group(draw, &compiled.bindings, &compiled.pipeline.get_bind_group_layout(0))?))
                }
            };
            let group = group.clone();
            let pulled = pulled.map_or(Ok(Vec::new()), |p| self.pulled_pieces(&p, compiled))?;
            let mut vertices = draw.vertices.clone();
            if let Some(buffer) = draw.streamed {
                vertices.end = vertices.end.min(vertices.start.saturating_add(contents.streamed[buffer.index()].vertices));
            }
            ready.push(GpuDraw { number, pipeline: key, group, pulled, vertices });
        }
        Ok(GpuPass { index, draws: ready, counters })
    }

    /// Targets that count the pass's queries, four queries per target.
    fn counters(&self, pass: &Pass) -> Result<Vec<wgpu::Texture>, GpuError> {
        let count = pass.query_count.div_ceil(4);
        if count == 0 {
            return Ok(Vec::new());
        }
        let what = format!("pass `{}`: colour targets, one for each four occlusion queries included,", pass.label);
        self.gpu.within(&what, (pass.color.len() + count) as u64, MAX_COLOR_TARGETS as u64)?;
        self.gpu.require(wgpu::Features::FLOAT32_BLENDABLE, &pass.label)?;
        let (width, height) = target_size(self.frame, pass);
        (0..count).map(|k| self.gpu.create_texture(&TextureDescriptor::d2(format!("counter {k}"), width, height, COUNTER_FORMAT))).collect()
    }

    pub(super) fn gpu(&self) -> &'f Gpu {
        self.gpu
    }

    pub(super) fn frame(&self) -> &'f Frame {
        self.frame
    }

    /// Bind group of a draw: the bindings that the entry points use.
    pub(super) fn bind_group(
        &self,
        draw: &Draw,
        bindings: &[(u32, Option<TextureUse>)],
        layout: &wgpu::BindGroupLayout,
    ) -> Result<wgpu::BindGroup, GpuError> {
        let described = &self.frame.bind_groups[draw.bind_group.index()];
        let kinds = &self.frame.pipelines[draw.pipeline.index()].program.bindings;
        let missing = |number: u32| FrameError::BindGroup {
            group: draw.bind_group.index(),
            binding: number as usize,
            problem: BindGroupProblem::Missing,
        };
        let mut views = Vec::new();
        let mut samplers = Vec::new();
        for (number, texture) in bindings {
            match described.entries.get(*number as usize) {
                Some(BindEntry::Texture(view)) => views.push(self.sampled_view(view, *texture)),
                Some(BindEntry::Sampler(sampler)) => samplers.push(self.sampler(sampler)),
                Some(_) => {}
                None => return Err(missing(*number).into()),
            }
        }
        let (mut views_left, mut samplers_left) = (views.iter(), samplers.iter());
        let mut entries = Vec::new();
        for &(number, _) in bindings {
            let entry = described.entries[number as usize];
            let size = kinds.get(number as usize).and_then(|kind| match kind {
                BindingKind::Uniform(bytes) | BindingKind::DynamicUniform(bytes) => Some(*bytes as u64),
                _ => None,
            });
            let buffer = |id: BufferId, offset: u64| {
                wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &self.resources.buffers[id.index()],
                    offset,
                    size: size.and_then(std::num::NonZeroU64::new),
                })
            };
            let resource = match entry {
                BindEntry::Uniform(id, offset) => Some(buffer(id, offset as u64)),
                BindEntry::DynamicUniform(id) => Some(buffer(id, draw.dynamic_offset.into())),
                BindEntry::Storage(id) => Some(buffer(id, 0)),
                BindEntry::Texture(_) => views_left.next().map(wgpu::BindingResource::TextureView),
                BindEntry::Sampler(_) => samplers_left.next().map(wgpu::BindingResource::Sampler),
            };
            entries.push(wgpu::BindGroupEntry { binding: number, resource: resource.ok_or_else(|| missing(number))? });
        }
        let group = self.gpu.checked("making a bind group", || {
            self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        })?;
        Ok(group)
    }

    fn sampled_view(&self, view: &TextureView, used: Option<TextureUse>) -> wgpu::TextureView {
        let depth = used.is_some_and(|u| u.depth) || self.frame.textures[view.texture.index()].desc.format.has_depth_aspect();
        // For WebGPU, a view of one layer is a 2D image and not an array, unless the twin declares an array.
        self.resources.texture(view.texture).create_view(&wgpu::TextureViewDescriptor {
            dimension: used.map(|u| u.dimension),
            aspect: if depth { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All },
            base_mip_level: view.range.base_mip_level,
            mip_level_count: view.range.mip_level_count,
            base_array_layer: view.range.base_array_layer,
            array_layer_count: view.range.array_layer_count,
            ..wgpu::TextureViewDescriptor::default()
        })
    }

    fn sampler(&self, sampler: &Sampler) -> wgpu::Sampler {
        let [address_mode_u, address_mode_v, address_mode_w] = sampler.address_mode;
        self.gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            address_mode_u,
            address_mode_v,
            address_mode_w,
            mag_filter: sampler.mag_filter,
            min_filter: sampler.min_filter,
            mipmap_filter: match sampler.mipmap_filter {
                wgpu::FilterMode::Nearest => wgpu::MipmapFilterMode::Nearest,
                wgpu::FilterMode::Linear => wgpu::MipmapFilterMode::Linear,
            },
            lod_min_clamp: sampler.lod_min_clamp,
            lod_max_clamp: sampler.lod_max_clamp,
            compare: sampler.compare,
            ..wgpu::SamplerDescriptor::default()
        })
    }

    /// Buffers and bind groups of pulled vertices, each with whole primitives.
    fn pulled_pieces(&self, pulled: &Pulled, compiled: &Compiled) -> Result<Vec<(wgpu::BindGroup, u32)>, GpuError> {
        let limits = self.gpu.device.limits();
        let largest = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let primitive = pulled.stride * corners(pulled.topology) as usize;
        let most = (largest / 4 / primitive as u64).max(1) as usize * primitive;
        let piece = |data: &[f32]| {
            let buffer = self.gpu.create_buffer("pulled vertices", bytemuck::cast_slice(data))?;
            let group = self.gpu.checked("binding pulled vertices", || {
                self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &compiled.pipeline.get_bind_group_layout(PULLED_GROUP),
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
                })
            })?;
            Ok((group, (data.len() / pulled.stride) as u32))
        };
        pulled.data.chunks(most).map(piece).collect()
    }

    /// Runs passes in order in one submission, and waits until they have run.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn run<'p>(&self, passes: impl IntoIterator<Item = &'p GpuPass>) -> Result<(), GpuError> {
        self.gpu.checked("running passes", || {
            let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            for pass in passes {
                self.encode(&mut encoder, pass);
            }
            self.gpu.queue.submit([encoder.finish()]);
        })?;
        self.gpu.wait()
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, ready: &GpuPass) {
        let pass = &self.frame.passes[ready.index];
        if ready.draws.is_empty() && pass.attachments().is_empty() {
            return; // The pass only streams out.
        }
        let store = wgpu::StoreOp::Store;
        let view = |view: AttachmentView| {
            let volume = self.frame.textures[view.texture.index()].desc.shape == TextureShape::D3;
            let descriptor = match volume {
                true => wgpu::TextureViewDescriptor {
                    base_mip_level: view.level,
                    mip_level_count: Some(1),
                    ..wgpu::TextureViewDescriptor::default()
                },
                false => attachment_view(view.level, view.layer),
            };
            (self.resources.texture(view.texture).create_view(&descriptor), volume.then_some(view.layer))
        };
        let color: Vec<_> = pass.color.iter().map(|t| t.as_ref().map(|t| (view(t.view), t.load))).collect();
        let depth = pass.depth_stencil.as_ref().map(|t| (view(t.view).0, t));
        let counters: Vec<_> = ready.counters.iter().map(|t| t.create_view(&wgpu::TextureViewDescriptor::default())).collect();
        let mut attachments: Vec<_> = color
            .iter()
            .map(|target| {
                target.as_ref().map(|((view, slice), load)| wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: *slice,
                    resolve_target: None,
                    ops: wgpu::Operations { load: *load, store },
                })
            })
            .collect();
        attachments.extend(counters.iter().map(|view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store },
            })
        }));
        let depth_stencil_attachment = depth.as_ref().map(|(view, target)| {
            let format = self.frame.textures[target.view.texture.index()].desc.format;
            wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: format.has_depth_aspect().then_some(wgpu::Operations { load: target.depth_load, store }),
                stencil_ops: format.has_stencil_aspect().then_some(wgpu::Operations { load: target.stencil_load, store }),
            }
        });
        let mut encoded = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(&pass.label),
            color_attachments: &attachments,
            depth_stencil_attachment,
            ..wgpu::RenderPassDescriptor::default()
        });
        let (width, height) = target_size(self.frame, pass);
        for ready in &ready.draws {
            let draw = &pass.draws[ready.number];
            let scissor = draw.scissor.unwrap_or_else(|| PixelRect::full(width, height)).intersect(PixelRect::full(width, height));
            if scissor.x0 >= scissor.x1 || scissor.y0 >= scissor.y1 {
                continue;
            }
            let v = draw.viewport.unwrap_or_else(|| Viewport::full(width, height));
            encoded.set_pipeline(&self.compiled[&ready.pipeline].pipeline);
            encoded.set_viewport(v.x, v.y, v.width, v.height, v.min_depth, v.max_depth);
            encoded.set_scissor_rect(scissor.x0, scissor.y0, scissor.x1 - scissor.x0, scissor.y1 - scissor.y0);
            encoded.set_stencil_reference(draw.stencil_reference & 0xff);
            let [r, g, b, a] = draw.blend_constant.map(f64::from);
            encoded.set_blend_constant(wgpu::Color { r, g, b, a });
            if let Some(group) = &ready.group {
                encoded.set_bind_group(0, group, &[]);
            }
            if ready.pipeline.1.corners != 0 {
                for (group, count) in &ready.pulled {
                    encoded.set_bind_group(PULLED_GROUP, group, &[]);
                    encoded.draw(0..*count, 0..1);
                }
                continue;
            }
            for (slot, (buffer, offset)) in draw.vertex_buffers.iter().enumerate() {
                encoded.set_vertex_buffer(slot as u32, self.resources.buffers[buffer.index()].slice(*offset as u64..));
            }
            match draw.index {
                Some(index) => {
                    encoded.set_index_buffer(self.resources.buffers[index.buffer.index()].slice(..), index.format);
                    encoded.draw_indexed(ready.vertices.clone(), draw.base_vertex, draw.instances.clone());
                }
                None => encoded.draw(ready.vertices.clone(), draw.instances.clone()),
            }
        }
    }

    /// Number of fragments that passed in the last run of a pass, by query.
    ///
    /// # Errors
    /// If the driver fails.
    pub fn queries(&self, pass: &GpuPass) -> Result<Vec<u64>, GpuError> {
        let described = &self.frame.passes[pass.index];
        let mut counts = Vec::new();
        for (k, counter) in pass.counters.iter().enumerate() {
            let (width, height) = target_size(self.frame, described);
            let desc = TextureDescriptor::d2(format!("counter {k}"), width, height, COUNTER_FORMAT);
            let mut read = Texture::new(desc).map_err(FrameError::from)?;
            self.gpu.download(counter, &mut read, 0, 0)?;
            for channel in 0..4.min(described.query_count - 4 * k) {
                counts.push(read.read_channel(0, 0, channel).iter().map(|&n| n as u64).sum());
            }
        }
        Ok(counts)
    }
}

fn corners(topology: PrimitiveTopology) -> u8 {
    match topology {
        PrimitiveTopology::PointList => 1,
        PrimitiveTopology::LineList | PrimitiveTopology::LineStrip => 2,
        PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip => 3,
    }
}
