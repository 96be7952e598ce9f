//! Bind groups of draws: the bindings that the entry points of a pipeline use.

use std::num::NonZeroU64;

use super::GpuError;
use super::frame::GpuFrame;
use super::layout::Used;
use nephroid_pipeline::BindingKind;
use nephroid_pipeline::frame::{BindEntry, BindGroupProblem, BufferId, Draw, FrameError, TextureView};
use nephroid_pipeline::sampler::Sampler;

impl GpuFrame<'_> {
    /// Bind group of a draw. `per_draw` replaces the buffer of a uniform whose offset each draw gives, if the entry points read it as an array.
    pub(super) fn bind_group(
        &self,
        draw: &Draw,
        bindings: &[Used],
        layout: &wgpu::BindGroupLayout,
        per_draw: Option<&wgpu::Buffer>,
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
        for used in bindings {
            match described.entries.get(used.number as usize) {
                Some(BindEntry::Texture(view)) => views.push(self.sampled_view(view, used.ty)),
                Some(BindEntry::Sampler(sampler)) => samplers.push(self.sampler(sampler)),
                Some(_) => {}
                None => return Err(missing(used.number).into()),
            }
        }
        let (mut views_left, mut samplers_left) = (views.iter(), samplers.iter());
        let mut entries = Vec::new();
        for &Used { number, .. } in bindings {
            let entry = described.entries[number as usize];
            let size = kinds.get(number as usize).and_then(|kind| match kind {
                BindingKind::Uniform(bytes) | BindingKind::DynamicUniform(bytes) => NonZeroU64::new(*bytes as u64),
                _ => None,
            });
            let buffer = |id: BufferId, offset: u64| {
                wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: &self.resources.buffers[id.index()], offset, size })
            };
            let resource = match entry {
                BindEntry::Uniform(id, offset) => Some(buffer(id, offset as u64)),
                BindEntry::DynamicUniform(id) => Some(per_draw.map_or_else(|| buffer(id, 0), wgpu::Buffer::as_entire_binding)),
                BindEntry::Storage(id) => Some(buffer(id, 0)),
                BindEntry::Texture(_) => views_left.next().map(wgpu::BindingResource::TextureView),
                BindEntry::Sampler(_) => samplers_left.next().map(wgpu::BindingResource::Sampler),
            };
            entries.push(wgpu::BindGroupEntry { binding: number, resource: resource.ok_or_else(|| missing(number))? });
        }
        self.gpu.checked("making a bind group", || {
            self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        })
    }

    fn sampled_view(&self, view: &TextureView, ty: wgpu::BindingType) -> wgpu::TextureView {
        let used = match ty {
            wgpu::BindingType::Texture { sample_type, view_dimension, .. } => Some((sample_type, view_dimension)),
            _ => None,
        };
        let depth = used.is_some_and(|(sample_type, _)| sample_type == wgpu::TextureSampleType::Depth)
            || self.frame.textures[view.texture.index()].desc.format.has_depth_aspect();
        // For WebGPU, a view of one layer is a 2D image and not an array, unless the twin declares an array.
        self.resources.texture(view.texture).create_view(&wgpu::TextureViewDescriptor {
            dimension: used.map(|(_, dimension)| dimension),
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
}
