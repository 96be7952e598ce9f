//! Copies depth to and from textures. WebGPU cannot copy a buffer to 32-bit depth, nor 24-bit depth to a buffer, so a triangle is drawn.

use std::sync::OnceLock;

use nephroid_pipeline::state::TextureFormat;

const SOURCE: &str = "
@group(0) @binding(0) var number: texture_2d<f32>;
@group(0) @binding(0) var depth: texture_depth_2d;

@vertex
fn vs(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

@fragment
fn to_depth(@builtin(position) at: vec4<f32>) -> @builtin(frag_depth) f32 {
    return textureLoad(number, vec2<i32>(at.xy), 0).r;
}

@fragment
fn from_depth(@builtin(position) at: vec4<f32>) -> @location(0) f32 {
    return textureLoad(depth, vec2<i32>(at.xy), 0);
}
";

/// The pipelines; each is made on first use.
#[derive(Debug, Default)]
pub(super) struct DepthCopy {
    module: OnceLock<wgpu::ShaderModule>,
}

impl DepthCopy {
    fn pipeline(&self, device: &wgpu::Device, entry: &str, to: TextureFormat) -> wgpu::RenderPipeline {
        let module = self.module.get_or_init(|| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("depth copy"),
                source: wgpu::ShaderSource::Wgsl(SOURCE.into()),
            })
        });
        let is_depth = to.has_depth_aspect();
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("depth copy"),
            layout: None,
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("vs"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: is_depth.then(|| wgpu::DepthStencilState {
                format: to,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: if is_depth {
                    &[]
                } else {
                    &[Some(wgpu::ColorTargetState { format: TextureFormat::R32Float, blend: None, write_mask: wgpu::ColorWrites::ALL })]
                },
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Fills the depth aspect of `to`, one level of one layer, with the numbers of an r32float texture of the same size.
    pub fn write(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        from: &wgpu::TextureView,
        to: (&wgpu::TextureView, TextureFormat),
    ) {
        let pipeline = self.pipeline(device, "to_depth", to.1);
        let keep = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: to.0,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: to.1.has_stencil_aspect().then_some(keep),
        };
        let pass = wgpu::RenderPassDescriptor { depth_stencil_attachment: Some(depth), ..wgpu::RenderPassDescriptor::default() };
        draw(device, encoder, &pipeline, from, &pass);
    }

    /// Fills an r32float texture with the depth aspect of a texture of the same size.
    pub fn read(&self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder, from: &wgpu::TextureView, to: &wgpu::TextureView) {
        let pipeline = self.pipeline(device, "from_depth", TextureFormat::R32Float);
        let target = wgpu::RenderPassColorAttachment {
            view: to,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let pass = wgpu::RenderPassDescriptor { color_attachments: &[Some(target)], ..wgpu::RenderPassDescriptor::default() };
        draw(device, encoder, &pipeline, from, &pass);
    }
}

fn draw(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    from: &wgpu::TextureView,
    pass: &wgpu::RenderPassDescriptor<'_>,
) {
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("depth copy"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(from) }],
    });
    let mut pass = encoder.begin_render_pass(pass);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
}
