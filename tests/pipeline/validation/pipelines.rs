//! Rules of pipelines.

use std::sync::Arc;

use nephroid_pipeline::shader::{Interpolation, Program, Varying};
use nephroid_pipeline::state::{
    ADD, BlendComponent, BlendFactor, BlendOperation, BlendState, ColorTargetState, ColorWrites, CompareFunction, DepthStencilState,
    IndexFormat, PolygonMode, PrimitiveTopology, RasterRules, StencilFaceState, StencilOperation, TextureFormat, VertexAttribute,
    VertexBufferLayout, VertexFormat, VertexStepMode,
};
use nephroid_pipeline::{
    BindingKind, ColorTargetProblem, DepthStencilProblem, PipelineProblem, PrimitiveClass, RenderPipeline, RenderPipelineDescriptor,
    VertexBufferProblem,
};

use super::{Row, rule};
use crate::depth_stencil::depth_state;
use crate::passes::{Ones, depth_only_program, plain_program, target};

type Made = Result<(), PipelineProblem>;

/// A pipeline with one target, edited, under some rules.
pub fn made_under(rules: RasterRules, edit: impl FnOnce(&mut RenderPipelineDescriptor)) -> Made {
    let mut desc = RenderPipelineDescriptor::new("test", Arc::new(plain_program(Ones)));
    desc.targets = vec![target(TextureFormat::Rgba8Unorm)];
    edit(&mut desc);
    RenderPipeline::new(desc, rules).map(drop).map_err(|error| error.problem)
}

/// A pipeline with one target, edited.
pub fn made(edit: impl FnOnce(&mut RenderPipelineDescriptor)) -> Made {
    made_under(RasterRules::REFERENCE, edit)
}

fn program(edit: impl FnOnce(&mut Program)) -> Made {
    let mut program = plain_program(Ones);
    edit(&mut program);
    made(|desc| desc.program = Arc::new(program))
}

/// A state that blends colour so, and adds alpha.
pub fn blended(format: TextureFormat, color: BlendComponent) -> Option<ColorTargetState> {
    Some(ColorTargetState { format, blend: Some(BlendState { color, alpha: ADD }), write_mask: ColorWrites::ALL })
}

fn masked(bits: u32) -> Made {
    let write_mask = ColorWrites::from_bits_retain(bits);
    made(|desc| desc.targets = vec![Some(ColorTargetState { format: TextureFormat::Rgba8Unorm, blend: None, write_mask })])
}

fn depth(format: TextureFormat, edit: impl FnOnce(&mut DepthStencilState)) -> Made {
    let mut state = depth_state(format, CompareFunction::Always, false);
    edit(&mut state);
    made(|desc| desc.depth_stencil = Some(state))
}

fn layout(array_stride: u64, attributes: &[(VertexFormat, u64, u32)]) -> VertexBufferLayout {
    let attributes = attributes.iter().map(|&(format, offset, shader_location)| VertexAttribute { format, offset, shader_location });
    VertexBufferLayout { array_stride, step_mode: VertexStepMode::Vertex, attributes: attributes.collect() }
}

fn buffers(layouts: Vec<VertexBufferLayout>) -> Made {
    made(|desc| desc.vertex_buffers = layouts)
}

/// Rules of colour targets and of what is rasterized.
pub fn targets() -> Vec<Row> {
    use TextureFormat::*;
    let (one, two) = (target(Rgba8Unorm), vec![target(Rgba8Unorm); 2]);
    let max = |src_factor| BlendComponent { src_factor, dst_factor: BlendFactor::One, operation: BlendOperation::Max };
    let second = BlendComponent { src_factor: BlendFactor::Src1, dst_factor: BlendFactor::Zero, operation: BlendOperation::Add };
    let subpixel = |subpixel_bits| made_under(RasterRules { subpixel_bits, ..RasterRules::REFERENCE }, |_| ());
    vec![
        rule!("sub-pixel-bits": subpixel(5) => PipelineProblem::SubpixelBits { bits: 5 }, subpixel(4)),
        rule!("polygon-mode": made(|desc| desc.primitive.polygon_mode = PolygonMode::Line)
            => PipelineProblem::PolygonMode { mode: PolygonMode::Line }, made(|_| ())),
        rule!("conservative": made(|desc| desc.primitive.conservative = true) => PipelineProblem::Conservative, made(|_| ())),
        rule!("line-width": made(|desc| desc.line_width = 1025.0) => PipelineProblem::LineWidth { width: 1025.0 },
            made(|desc| desc.line_width = 1024.0)),
        rule!("strip-index-format": made(|desc| desc.primitive.strip_index_format = Some(IndexFormat::Uint32))
        => PipelineProblem::StripIndexFormat { topology: PrimitiveTopology::TriangleList },
        made(|desc| {
            desc.primitive.topology = PrimitiveTopology::TriangleStrip;
            desc.primitive.strip_index_format = Some(IndexFormat::Uint32);
        })),
        rule!("color-target-count": made(|desc| desc.targets = vec![one.clone(); 9]) => PipelineProblem::ColorTargetCount { count: 9 },
            made(|desc| desc.targets = vec![one.clone(); 8])),
        rule!("color-target-format": made(|desc| desc.targets = vec![one.clone(), target(Bc1RgbaUnorm)])
            => PipelineProblem::ColorAttachment { target: 1, problem: ColorTargetProblem::Format { format: Bc1RgbaUnorm } },
            made(|desc| desc.targets = two.clone())),
        rule!("color-target-renderable": made(|desc| desc.targets = vec![target(Depth32Float)])
            => PipelineProblem::ColorAttachment { target: 0, problem: ColorTargetProblem::NotRenderable { format: Depth32Float } },
            made(|desc| desc.targets = vec![target(R32Float)])),
        rule!("write-mask": masked(0x10)
            => PipelineProblem::ColorAttachment { target: 0, problem: ColorTargetProblem::WriteMask { bits: 0x10 } }, masked(0xf)),
        rule!("blendable": made(|desc| desc.targets = vec![blended(R32Uint, ADD)])
            => PipelineProblem::ColorAttachment { target: 0, problem: ColorTargetProblem::NotBlendable { format: R32Uint } },
            made(|desc| desc.targets = vec![target(R32Uint)])),
        rule!("min-max-factor": made(|desc| desc.targets = vec![blended(Rgba8Unorm, max(BlendFactor::Dst))])
            => PipelineProblem::ColorAttachment {
                target: 0,
                problem: ColorTargetProblem::MinMaxFactor { operation: BlendOperation::Max, factor: BlendFactor::Dst },
            },
            made(|desc| desc.targets = vec![blended(Rgba8Unorm, max(BlendFactor::One))])),
        rule!("dual-source-target": made(|desc| desc.targets = vec![blended(Rgba8Unorm, second), one.clone()])
            => PipelineProblem::ColorAttachment { target: 0, problem: ColorTargetProblem::DualSource { targets: 2 } },
            made(|desc| desc.targets = vec![blended(Rgba8Unorm, second)])),
        rule!("fragment-stage": made(|desc| desc.program = Arc::new(depth_only_program())) => PipelineProblem::FragmentStage,
            made(|desc| desc.program = Arc::new(plain_program(Ones)))),
        rule!("no-target": made(|desc| desc.targets = vec![None]) => PipelineProblem::NoTarget,
            made(|desc| (desc.targets, desc.rasterizer_discard) = (vec![None], true))),
    ]
}

/// Rules of depth and stencil state.
pub fn depth_and_stencil() -> Vec<Row> {
    use TextureFormat::*;
    let invert = StencilFaceState { pass_op: StencilOperation::Invert, ..StencilFaceState::IGNORE };
    let invert_behind = StencilFaceState { depth_fail_op: StencilOperation::Invert, ..StencilFaceState::IGNORE };
    let biased = |topology, clamp| {
        let mut state = depth_state(Depth32Float, CompareFunction::Less, true);
        state.bias.clamp = clamp;
        made(|desc| (desc.depth_stencil, desc.primitive.topology) = (Some(state), topology))
    };
    let compared = |depth_compare| {
        depth(Depth24PlusStencil8, |state| {
            state.depth_compare = depth_compare;
            state.stencil.back = invert_behind;
        })
    };
    let writes = |format| {
        let mut program = plain_program(Ones);
        program.writes_depth = true;
        made(|desc| {
            desc.program = Arc::new(program);
            desc.depth_stencil = Some(depth_state(format, CompareFunction::Always, false));
        })
    };
    vec![
        rule!("depth-stencil-format": depth(R32Float, |_| ())
            => PipelineProblem::DepthStencil(DepthStencilProblem::Format { format: R32Float }), depth(Depth16Unorm, |_| ())),
        rule!("depth-state": depth(Stencil8, |state| state.depth_compare = Some(CompareFunction::Less))
            => PipelineProblem::DepthStencil(DepthStencilProblem::NoDepth { format: Stencil8 }), depth(Stencil8, |_| ())),
        rule!("stencil-state": depth(Depth32Float, |state| state.stencil.front = invert)
            => PipelineProblem::DepthStencil(DepthStencilProblem::NoStencil { format: Depth32Float }),
            depth(Depth32FloatStencil8, |state| state.stencil.front = invert)),
        rule!("depth-write-enabled": depth(Depth24Plus, |state| state.depth_write_enabled = None)
            => PipelineProblem::DepthStencil(DepthStencilProblem::DepthWriteEnabledMissing { format: Depth24Plus }),
            depth(Stencil8, |state| state.depth_write_enabled = None)),
        rule!("depth-compare": compared(None)
            => PipelineProblem::DepthStencil(DepthStencilProblem::DepthCompareMissing { format: Depth24PlusStencil8 }),
            compared(Some(CompareFunction::Less))),
        rule!("depth-bias-topology": biased(PrimitiveTopology::LineStrip, 0.5)
            => PipelineProblem::DepthStencil(DepthStencilProblem::BiasTopology { rasterized: PrimitiveClass::Lines }),
            biased(PrimitiveTopology::TriangleStrip, 0.5)),
        rule!("depth-bias-finite": biased(PrimitiveTopology::TriangleList, f32::INFINITY)
            => PipelineProblem::DepthStencil(DepthStencilProblem::BiasNotFinite { slope_scale: 0.0, clamp: f32::INFINITY }),
            biased(PrimitiveTopology::TriangleList, f32::MAX)),
        rule!("frag-depth": writes(Stencil8) => PipelineProblem::FragDepth { format: Some(Stencil8) }, writes(Depth32Float)),
    ]
}

/// Rules of vertex buffers' layouts.
pub fn vertices() -> Vec<Row> {
    use VertexBufferProblem::*;
    use VertexFormat::{Float32x2, Float64, Uint8x2};
    vec![
        rule!("vertex-buffer-count": buffers(vec![layout(4, &[]); 9]) => PipelineProblem::VertexBufferCount { count: 9 },
            buffers(vec![layout(4, &[]); 8])),
        rule!("vertex-stride-alignment": buffers(vec![layout(4, &[]), layout(6, &[])])
            => PipelineProblem::VertexBuffer { slot: 1, problem: ArrayStride { array_stride: 6 } },
            buffers(vec![layout(4, &[]), layout(8, &[])])),
        rule!("vertex-stride-limit": buffers(vec![layout(2052, &[])])
            => PipelineProblem::VertexBuffer { slot: 0, problem: ArrayStride { array_stride: 2052 } }, buffers(vec![layout(2048, &[])])),
        rule!("vertex-attribute-size": buffers(vec![layout(12, &[(Float32x2, 8, 0)])])
            => PipelineProblem::VertexBuffer { slot: 0, problem: AttributeSize { offset: 8, allowed: 12 } },
            buffers(vec![layout(12, &[(Float32x2, 4, 0)])])),
        rule!("vertex-attribute-size-stride-0": buffers(vec![layout(0, &[(Float32x2, u64::MAX - 3, 0)])])
            => PipelineProblem::VertexBuffer { slot: 0, problem: AttributeSize { offset: 0xffff_ffff_ffff_fffc, allowed: 2048 } },
            buffers(vec![layout(0, &[(Float32x2, 2040, 0)])])),
        rule!("vertex-attribute-offset": buffers(vec![layout(8, &[(Uint8x2, 3, 0)])])
            => PipelineProblem::VertexBuffer { slot: 0, problem: AttributeOffset { offset: 3, alignment: 2 } },
            buffers(vec![layout(12, &[(Uint8x2, 2, 0), (Float64, 4, 1)])])),
        rule!("shader-location": buffers(vec![layout(8, &[(Float32x2, 0, 16)])])
            => PipelineProblem::VertexBuffer { slot: 0, problem: ShaderLocation { shader_location: 16 } },
            buffers(vec![layout(8, &[(Float32x2, 0, 15)])])),
        rule!("shader-location-twice": buffers(vec![layout(8, &[(Float32x2, 0, 3)]), layout(8, &[(Float32x2, 0, 3)])])
            => PipelineProblem::VertexBuffer { slot: 1, problem: ShaderLocationTwice { shader_location: 3 } },
            buffers(vec![layout(8, &[(Float32x2, 0, 3)]), layout(8, &[(Float32x2, 0, 4)])])),
    ]
}

/// Rules of what programs declare.
pub fn programs() -> Vec<Row> {
    let varying = |components| Varying { name: "wide", components, interpolation: Interpolation::Flat };
    let uniform = |bytes| program(|p| p.bindings = vec![BindingKind::Uniform(bytes)]);
    vec![
        rule!("varying-components": program(|p| p.varyings = vec![varying(5)])
            => PipelineProblem::VaryingComponents { name: "wide", components: 5 }, program(|p| p.varyings = vec![varying(4)])),
        rule!("varying-count": program(|p| p.varyings = vec![varying(4); 17]) => PipelineProblem::Varyings { scalars: 68 },
            program(|p| p.varyings = vec![varying(4); 16])),
        rule!("uniform-size": uniform(65540) => PipelineProblem::UniformSize { binding: 0, bytes: 65540 }, uniform(65536)),
    ]
}
