//! Pipelines: the checks of a description, each with its cause.

use crate::api::bindings::BindingKind;
use crate::api::check::binding::MAX_UNIFORM_BYTES;
use crate::api::check::color_target::{self, ColorTargetProblem};
use crate::api::check::depth_stencil::{self, DepthStencilProblem};
use crate::api::check::vertex_buffer::{self, MAX_VERTEX_BUFFERS, VertexBufferProblem};
use crate::api::format::facts::format_info;
use crate::api::pipeline_descriptor::{MAX_POINT_SIZE, RenderPipelineDescriptor};
use crate::api::rules::RasterRules;
use crate::api::shader::program::Program;
use crate::api::shader::varying::{Varying, flatten_varyings};
use crate::api::state::{MAX_COLOR_TARGETS, MAX_VARYINGS, PolygonMode, PrimitiveTopology, TextureFormat};

/// A pipeline that is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("pipeline `{label}`: {problem}")]
pub struct PipelineError {
    /// The pipeline's label.
    pub label: String,
    /// The cause.
    pub problem: PipelineProblem,
}

/// Why the description of a pipeline is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineProblem {
    /// Sub-pixel precision other than 4 or 8 bits.
    #[error("{bits} sub-pixel bits; 4 or 8 are allowed")]
    SubpixelBits {
        /// The bits seen.
        bits: u8,
    },
    /// Polygons drawn as lines or points.
    #[error("polygon mode {mode:?}; allowed: Fill")]
    PolygonMode {
        /// The mode seen.
        mode: PolygonMode,
    },
    /// Conservative rasterization, which is not supported.
    #[error("conservative rasterization must be off")]
    Conservative,
    /// A line width out of range.
    #[error("line width {width}; allowed: above 0, up to {MAX_POINT_SIZE}")]
    LineWidth {
        /// The width seen.
        width: f32,
    },
    /// `strip_index_format` for a topology that is not a strip.
    #[error("strip_index_format is for strips only, not for {topology:?}")]
    StripIndexFormat {
        /// The topology seen.
        topology: PrimitiveTopology,
    },
    /// A varying with more than four scalars, or none.
    #[error("varying `{name}` has {components} scalars; allowed: 1..=4")]
    VaryingComponents {
        /// The varying's name.
        name: &'static str,
        /// The scalars seen.
        components: usize,
    },
    /// Too many varyings.
    #[error("{scalars} varying scalars; at most {MAX_VARYINGS}")]
    Varyings {
        /// The scalars seen.
        scalars: usize,
    },
    /// A uniform buffer larger than drivers allow.
    #[error("binding {binding} is a uniform buffer of {bytes} bytes; at most {MAX_UNIFORM_BYTES}")]
    UniformSize {
        /// The binding number.
        binding: usize,
        /// Bytes that the program reads.
        bytes: usize,
    },
    /// Too many colour targets.
    #[error("{count} colour targets; at most {MAX_COLOR_TARGETS}")]
    ColorTargetCount {
        /// The targets seen.
        count: usize,
    },
    /// A colour target is refused.
    #[error("target {target}: {problem}")]
    ColorAttachment {
        /// The target's number.
        target: usize,
        /// The cause.
        problem: ColorTargetProblem,
    },
    /// Colour targets without a fragment stage.
    #[error("colour targets need a fragment stage")]
    FragmentStage,
    /// Neither a colour target nor depth and stencil state, although primitives are rasterized.
    #[error("no colour target and no depth-stencil state; without either rasterizer_discard must be on")]
    NoTarget,
    /// Depth or stencil state is refused.
    #[error(transparent)]
    DepthStencil(DepthStencilProblem),
    /// The fragment stage writes depth, but the depth-stencil format has none.
    #[error("the fragment stage writes depth, and the depth-stencil format is {format:?}")]
    FragDepth {
        /// The format seen; `None` without depth and stencil state.
        format: Option<TextureFormat>,
    },
    /// Too many vertex buffers.
    #[error("{count} vertex buffers; at most {MAX_VERTEX_BUFFERS}")]
    VertexBufferCount {
        /// The buffers seen.
        count: usize,
    },
    /// The layout of a vertex buffer is refused.
    #[error("vertex buffer {slot}: {problem}")]
    VertexBuffer {
        /// The buffer's slot.
        slot: usize,
        /// The cause.
        problem: VertexBufferProblem,
    },
}

/// Why a description is refused, or `None`.
pub(crate) fn problem(desc: &RenderPipelineDescriptor, rules: &RasterRules) -> Option<PipelineProblem> {
    let primitive = &desc.primitive;
    if !matches!(rules.subpixel_bits, 4 | 8) {
        return Some(PipelineProblem::SubpixelBits { bits: rules.subpixel_bits });
    }
    if primitive.polygon_mode != PolygonMode::Fill {
        return Some(PipelineProblem::PolygonMode { mode: primitive.polygon_mode });
    }
    if primitive.conservative {
        return Some(PipelineProblem::Conservative);
    }
    if !(desc.line_width > 0.0 && desc.line_width <= MAX_POINT_SIZE) {
        return Some(PipelineProblem::LineWidth { width: desc.line_width });
    }
    if primitive.strip_index_format.is_some() && !primitive.topology.is_strip() {
        return Some(PipelineProblem::StripIndexFormat { topology: primitive.topology });
    }
    program_problem(&desc.program).or_else(|| target_problem(desc)).or_else(|| vertex_buffer_problem(desc))
}

/// Why the declarations of a program are refused, or `None`.
fn program_problem(program: &Program) -> Option<PipelineProblem> {
    let before_geometry = program.geometry.as_ref().map_or(&[][..], |geometry| &geometry.input_varyings);
    for varyings in [before_geometry, &program.varyings] {
        if let Some(Varying { name, components, .. }) = varyings.iter().find(|varying| !(1..=4).contains(&varying.components)) {
            return Some(PipelineProblem::VaryingComponents { name, components: *components });
        }
        let scalars = flatten_varyings(varyings).len();
        if scalars > MAX_VARYINGS {
            return Some(PipelineProblem::Varyings { scalars });
        }
    }
    program.bindings.iter().enumerate().find_map(|(binding, kind)| match *kind {
        BindingKind::Uniform(bytes) | BindingKind::DynamicUniform(bytes) if bytes > MAX_UNIFORM_BYTES => {
            Some(PipelineProblem::UniformSize { binding, bytes })
        }
        _ => None,
    })
}

/// Why the colour targets or the depth and stencil state are refused, or `None`.
fn target_problem(desc: &RenderPipelineDescriptor) -> Option<PipelineProblem> {
    let count = desc.targets.len();
    if count > MAX_COLOR_TARGETS {
        return Some(PipelineProblem::ColorTargetCount { count });
    }
    for (target, state) in desc.targets.iter().enumerate() {
        if let Some(problem) = state.as_ref().and_then(|state| color_target::problem(state, count)) {
            return Some(PipelineProblem::ColorAttachment { target, problem });
        }
    }
    let depth_stencil = desc.depth_stencil.as_ref();
    if let Some(problem) = depth_stencil.and_then(|state| depth_stencil::problem(state, desc.rasterized())) {
        return Some(PipelineProblem::DepthStencil(problem));
    }
    if desc.rasterizer_discard {
        return None;
    }
    let has_color = desc.targets.iter().any(Option::is_some);
    if has_color && desc.program.fragment.is_none() {
        return Some(PipelineProblem::FragmentStage);
    }
    if !has_color && depth_stencil.is_none() {
        return Some(PipelineProblem::NoTarget);
    }
    let format = depth_stencil.map(|state| state.format);
    let has_depth = format.and_then(format_info).is_some_and(|info| info.depth);
    (desc.program.writes_depth && !has_depth).then_some(PipelineProblem::FragDepth { format })
}

/// Why the layouts of the vertex buffers are refused, or `None`.
fn vertex_buffer_problem(desc: &RenderPipelineDescriptor) -> Option<PipelineProblem> {
    let count = desc.vertex_buffers.len();
    if count > MAX_VERTEX_BUFFERS {
        return Some(PipelineProblem::VertexBufferCount { count });
    }
    vertex_buffer::problem(&desc.vertex_buffers).map(|(slot, problem)| PipelineProblem::VertexBuffer { slot, problem })
}
