//! Passes as a driver's commands, and the counts of their queries.

use super::GpuError;
use super::frame::{GpuDraw, GpuFrame, GpuPass, Source};
use super::pipeline::{COUNTER_FORMAT, Variant};
use super::resources::attachment_view;
use super::twin::PULLED_GROUP;
use nephroid_pipeline::frame::{AttachmentView, FrameError, FrameIndex, PipelineId, target_size};
use nephroid_pipeline::state::{PixelRect, Viewport};
use nephroid_pipeline::{Texture, TextureDescriptor, TextureShape};

/// State that the last encoded draw has set.
#[derive(Default)]
struct DrawState {
    pipeline: Option<(PipelineId, Variant)>,
    viewport: Option<Viewport>,
    scissor: Option<PixelRect>,
    stencil_reference: Option<u32>,
    blend_constant: Option<[f32; 4]>,
    group: Option<(usize, Option<u32>)>,
    piece: Option<usize>,
    index: Option<FrameIndex>,
}

impl GpuFrame<'_> {
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
        // Further draws of a pass keep what the earlier ones drew.
        let keeps = ready.continues;
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
                    ops: wgpu::Operations { load: if keeps { wgpu::LoadOp::Load } else { *load }, store },
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
            let depth_load = if keeps { wgpu::LoadOp::Load } else { target.depth_load };
            let stencil_load = if keeps { wgpu::LoadOp::Load } else { target.stencil_load };
            wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: format.has_depth_aspect().then_some(wgpu::Operations { load: depth_load, store }),
                stencil_ops: format.has_stencil_aspect().then_some(wgpu::Operations { load: stencil_load, store }),
            }
        });
        let mut encoded = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(&pass.label),
            color_attachments: &attachments,
            depth_stencil_attachment,
            ..wgpu::RenderPassDescriptor::default()
        });
        let mut state = DrawState::default();
        let size = target_size(self.frame, pass);
        for draw in &ready.draws {
            self.encode_draw(&mut encoded, &mut state, ready, draw, size);
        }
    }

    /// Encodes a draw. State that the draw before it has set is not set again: a pass may have a hundred thousand draws.
    fn encode_draw(
        &self,
        encoded: &mut wgpu::RenderPass<'_>,
        state: &mut DrawState,
        ready: &GpuPass,
        one: &GpuDraw,
        (width, height): (u32, u32),
    ) {
        let draw = &self.frame.passes[ready.index].draws[one.number];
        let scissor = draw.scissor.unwrap_or_else(|| PixelRect::full(width, height)).intersect(PixelRect::full(width, height));
        if scissor.x0 >= scissor.x1 || scissor.y0 >= scissor.y1 {
            return;
        }
        if state.pipeline.replace(one.pipeline) != Some(one.pipeline) {
            encoded.set_pipeline(&self.compiled[&one.pipeline].pipeline);
        }
        let v = draw.viewport.unwrap_or_else(|| Viewport::full(width, height));
        if state.viewport.replace(v) != Some(v) {
            encoded.set_viewport(v.x, v.y, v.width, v.height, v.min_depth, v.max_depth);
        }
        if state.scissor.replace(scissor) != Some(scissor) {
            encoded.set_scissor_rect(scissor.x0, scissor.y0, scissor.x1 - scissor.x0, scissor.y1 - scissor.y0);
        }
        if state.stencil_reference.replace(draw.stencil_reference) != Some(draw.stencil_reference) {
            encoded.set_stencil_reference(draw.stencil_reference & 0xff);
        }
        if state.blend_constant.replace(draw.blend_constant) != Some(draw.blend_constant) {
            let [r, g, b, a] = draw.blend_constant.map(f64::from);
            encoded.set_blend_constant(wgpu::Color { r, g, b, a });
        }
        if let Some(group) = one.group
            && state.group.replace((group, one.offset)) != Some((group, one.offset))
        {
            encoded.set_bind_group(0, &ready.groups[group], one.offset.as_slice());
        }
        let own = match &one.vertices {
            Source::Own(vertices) => vertices.clone(),
            Source::Pulled(parts) => {
                for part in parts {
                    if state.piece.replace(part.piece) != Some(part.piece) {
                        encoded.set_bind_group(PULLED_GROUP, &ready.pieces[part.piece], &[]);
                    }
                    encoded.draw(part.vertices.clone(), 0..1);
                }
                return;
            }
        };
        for (slot, (buffer, offset)) in draw.vertex_buffers.iter().enumerate() {
            encoded.set_vertex_buffer(slot as u32, self.resources.buffers[buffer.index()].slice(*offset as u64..));
        }
        match draw.index {
            Some(index) => {
                if state.index.replace(index) != Some(index) {
                    encoded.set_index_buffer(self.resources.buffers[index.buffer.index()].slice(..), index.format);
                }
                encoded.draw_indexed(own, draw.base_vertex, draw.instances.clone());
            }
            None => encoded.draw(own, draw.instances.clone()),
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
