//! A frame's pipelines on a device.

use super::GpuError;
use super::device::Gpu;
use super::layout::{Used, layout, storage_layout};
use super::twin::{PULLED_GROUP, Twin, VertexSource};
use nephroid_pipeline::RenderPipelineDescriptor;
use nephroid_pipeline::state::{ADDITIVE, BlendFactor, ColorTargetState, ColorWrites, FrontFace, PrimitiveTopology, TextureFormat};

/// Format of the targets that count fragments: one query per channel.
pub(super) const COUNTER_FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// A variant of a frame's pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Variant {
    pub vertices: VertexSource,
    /// Corners of pulled primitives: 1 for points, 2 for lines, 3 for triangles; 0 for the pipeline's own topology.
    pub corners: u8,
    /// Number of the pass's targets that count fragments.
    pub counters: u32,
    /// The query that counts the draw's fragments.
    pub query: Option<u32>,
}

/// A pipeline on a device.
#[derive(Debug)]
pub(super) struct Compiled {
    pub pipeline: wgpu::RenderPipeline,
    /// Bindings of group 0 that the pipeline uses, and the group's layout, if there are any.
    pub bindings: Vec<Used>,
    pub group: Option<wgpu::BindGroupLayout>,
}

impl Compiled {
    /// Compiles a variant of a frame's pipeline.
    ///
    /// # Errors
    /// If the device lacks a feature, the program has no usable WGSL twin, or the driver refuses the pipeline.
    pub fn new(gpu: &Gpu, desc: &RenderPipelineDescriptor, variant: Variant) -> Result<Self, GpuError> {
        require_features(gpu, desc)?;
        let first_counter = desc.targets.len() as u32;
        let counter = variant.query.map(|query| first_counter + query / 4);
        let has_targets = desc.targets.iter().any(Option::is_some);
        let twin = Twin::new(&desc.program, variant.vertices, has_targets, counter)?;
        let mut targets = desc.targets.clone();
        targets.extend((0..variant.counters).map(|k| Some(counter_target(variant.query, k))));
        let mut primitive = desc.primitive;
        if variant.corners != 0 {
            primitive.strip_index_format = None;
            primitive.topology = match variant.corners {
                1 => PrimitiveTopology::PointList,
                2 => PrimitiveTopology::LineList,
                _ => PrimitiveTopology::TriangleList,
            };
        }
        // Sprites and wide lines are never culled, whatever the winding of their triangles is.
        if variant.corners == 3 && !draws_triangles(desc) {
            primitive.cull_mode = None;
            primitive.front_face = FrontFace::Ccw;
        }
        let options = wgpu::PipelineCompilationOptions { constants: &desc.program.wgsl_constants, ..Default::default() };
        let layouts: Vec<_> = match variant.vertices {
            VertexSource::Pulled { .. } => Vec::new(),
            VertexSource::Shaded => desc
                .vertex_buffers
                .iter()
                .map(|l| Some(wgpu::VertexBufferLayout { array_stride: l.array_stride, step_mode: l.step_mode, attributes: &l.attributes }))
                .collect(),
        };
        let (pipeline, group) = gpu.checked(&format!("making pipeline `{}`", desc.label), || {
            let group = (!twin.bindings.is_empty()).then(|| layout(&gpu.device, wgpu::ShaderStages::VERTEX_FRAGMENT, &twin.bindings));
            let pulled = pulled_layout(&gpu.device);
            let mut groups = vec![group.as_ref()];
            if let VertexSource::Pulled { .. } = variant.vertices {
                groups.resize(PULLED_GROUP as usize, None);
                groups.push(Some(&pulled));
            }
            let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(&desc.label),
                bind_group_layouts: &groups,
                immediate_size: 0,
            });
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(desc.program.name),
                source: wgpu::ShaderSource::Wgsl(twin.source.as_str().into()),
            });
            let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(&desc.label),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(twin.vertex_entry),
                    compilation_options: options.clone(),
                    buffers: &layouts,
                },
                primitive,
                depth_stencil: desc.depth_stencil.clone(),
                multisample: wgpu::MultisampleState::default(),
                fragment: twin.fragment_entry.map(|entry| wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: options.clone(),
                    targets: &targets,
                }),
                multiview_mask: None,
                cache: None,
            });
            (pipeline, group)
        })?;
        Ok(Self { pipeline, bindings: twin.bindings, group })
    }
}

/// Layout of the group of pulled vertices, the same for all pipelines.
pub(super) fn pulled_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    storage_layout(device, wgpu::ShaderStages::VERTEX, &[true])
}

fn draws_triangles(desc: &RenderPipelineDescriptor) -> bool {
    use nephroid_pipeline::state::GeometryTopology;
    match &desc.program.geometry {
        Some(geometry) => geometry.output == GeometryTopology::TriangleStrip,
        None => desc.primitive.topology.is_triangles(),
    }
}

/// State of counter target `k`: adds one in the query's channel and nothing elsewhere.
fn counter_target(query: Option<u32>, k: u32) -> ColorTargetState {
    let write_mask = match query {
        Some(query) if query / 4 == k => ColorWrites::from_bits_truncate(1 << (query % 4)),
        _ => ColorWrites::empty(),
    };
    ColorTargetState { format: COUNTER_FORMAT, blend: Some(ADDITIVE), write_mask }
}

fn require_features(gpu: &Gpu, desc: &RenderPipelineDescriptor) -> Result<(), GpuError> {
    for target in desc.targets.iter().flatten() {
        if target.format == TextureFormat::Rg11b10Ufloat {
            gpu.require(wgpu::Features::RG11B10UFLOAT_RENDERABLE, &desc.label)?;
        }
        let Some(blend) = target.blend else { continue };
        if matches!(target.format, TextureFormat::R32Float | TextureFormat::Rg32Float | TextureFormat::Rgba32Float) {
            gpu.require(wgpu::Features::FLOAT32_BLENDABLE, &desc.label)?;
        }
        let factors = [blend.color.src_factor, blend.color.dst_factor, blend.alpha.src_factor, blend.alpha.dst_factor];
        if factors.iter().any(BlendFactor::ref_second_blend_source) {
            gpu.require(wgpu::Features::DUAL_SOURCE_BLENDING, &desc.label)?;
        }
    }
    if desc.primitive.unclipped_depth {
        gpu.require(wgpu::Features::DEPTH_CLIP_CONTROL, &desc.label)?;
    }
    Ok(())
}
