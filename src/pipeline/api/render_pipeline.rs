//! A render pipeline: a program and its fixed-function state, validated once.

use std::sync::Arc;

use crate::api::format::facts::{FormatInfo, SUPPORTED_FORMATS, format_info};
use crate::api::resolved::{DepthPlan, FastPath, FragmentPlan, PrimitiveClass, TargetPlan, reads_second_source};
use crate::api::rules::RasterRules;
use crate::api::shader::program::Program;
use crate::api::shader::varying::{Interpolation, flatten_varyings};
use crate::api::state::{
    ColorTargetState, CompareFunction, DepthStencilState, GeometryTopology, MAX_COLOR_TARGETS, MAX_VARYINGS, PolygonMode, PrimitiveState,
    StencilFaceState, TextureFormat, VertexBufferLayout,
};

/// Widest line and largest point, in pixels.
pub const MAX_POINT_SIZE: f32 = 1024.0;

/// What a pipeline is made from.
///
/// WebGPU: [`GPURenderPipelineDescriptor`](https://www.w3.org/TR/webgpu/#dictdef-gpurenderpipelinedescriptor), with the geometry stage inside the
/// program, and line width and stream-out beside it.
#[derive(Clone, Debug)]
pub struct RenderPipelineDescriptor {
    /// Name in errors and captures.
    pub label: String,
    /// The shaders.
    pub program: Arc<Program>,
    /// How vertices become primitives. Default: triangle list, counter-clockwise front, no culling.
    pub primitive: PrimitiveState,
    /// Depth and stencil; `None` without such an attachment. Default: none.
    pub depth_stencil: Option<DepthStencilState>,
    /// One per colour attachment of the pass; `None` for a hole. Default: none.
    pub targets: Vec<Option<ColorTargetState>>,
    /// How vertex buffers are read. Default: none; the vertex shader reads storage by vertex index.
    pub vertex_buffers: Vec<VertexBufferLayout>,
    /// Width of lines in pixels, 0 < width <= 1024. Default: 1.
    pub line_width: f32,
    /// Stop after stream-out: nothing is rasterized. Default: false.
    pub rasterizer_discard: bool,
}

impl RenderPipelineDescriptor {
    /// A pipeline with default state.
    #[must_use]
    pub fn new(label: impl Into<String>, program: Arc<Program>) -> Self {
        Self {
            label: label.into(),
            program,
            primitive: PrimitiveState::default(),
            depth_stencil: None,
            targets: Vec::new(),
            vertex_buffers: Vec::new(),
            line_width: 1.0,
            rasterizer_discard: false,
        }
    }
}

/// What is wrong with a pipeline's description.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("pipeline `{label}`: {what}")]
pub struct PipelineError {
    /// The pipeline's label.
    pub label: String,
    /// What is wrong, with the value seen and the values allowed.
    pub what: String,
}

/// A validated pipeline, ready to draw.
#[derive(Clone, Debug)]
pub struct RenderPipeline {
    pub(crate) desc: RenderPipelineDescriptor,
    pub(crate) rules: RasterRules,
    pub(crate) targets: Vec<Option<TargetPlan>>,
    pub(crate) depth: DepthPlan,
    pub(crate) interpolation: Vec<Interpolation>,
    /// Scalars that leave the vertex stage.
    pub(crate) vertex_scalars: usize,
    pub(crate) locations: usize,
    /// What is rasterized, after the geometry stage.
    pub(crate) rasterized: PrimitiveClass,
    pub(crate) fragment: FragmentPlan,
    pub(crate) fast_path: FastPath,
    /// A fragment that fails the depth test leaves no trace, and its depth is known before it is shaded.
    pub(crate) rejects_by_depth: bool,
    /// Colour targets of which a fragment replaces every channel, whatever was there, bit = target.
    pub(crate) replaces: u8,
}

impl RenderPipeline {
    /// Checks a description and works out what drawing needs.
    pub fn new(desc: RenderPipelineDescriptor, rules: RasterRules) -> Result<Self, PipelineError> {
        let label = desc.label.clone();
        let fail = |what: String| Err(PipelineError { label: label.clone(), what });
        let program = desc.program.clone();
        if !matches!(rules.subpixel_bits, 4 | 8) {
            return fail(format!("{} sub-pixel bits; 4 or 8 are allowed", rules.subpixel_bits));
        }
        if desc.primitive.polygon_mode != PolygonMode::Fill || desc.primitive.conservative {
            return fail("polygon mode must be Fill and conservative rasterization off".into());
        }
        if !(desc.line_width > 0.0 && desc.line_width <= MAX_POINT_SIZE) {
            return fail(format!("line width {}; allowed: above 0, up to {MAX_POINT_SIZE}", desc.line_width));
        }
        if desc.primitive.strip_index_format.is_some() && !desc.primitive.topology.is_strip() {
            return fail("strip_index_format is for strips only".into());
        }
        if desc.targets.len() > MAX_COLOR_TARGETS {
            return fail(format!("{} colour targets; at most {MAX_COLOR_TARGETS}", desc.targets.len()));
        }
        let rasterized = match program.geometry.as_ref().map(|g| g.output) {
            Some(GeometryTopology::Points) => PrimitiveClass::Points,
            Some(GeometryTopology::LineStrip) => PrimitiveClass::Lines,
            Some(GeometryTopology::TriangleStrip) => PrimitiveClass::Triangles,
            None => PrimitiveClass::of(desc.primitive.topology),
        };
        let interpolation = flatten_varyings(&program.varyings);
        let vertex_scalars = program.geometry.as_ref().map_or(interpolation.len(), |g| flatten_varyings(&g.input_varyings).len());
        if interpolation.len() > MAX_VARYINGS || vertex_scalars > MAX_VARYINGS {
            return fail(format!("{} varying scalars; at most {MAX_VARYINGS}", interpolation.len().max(vertex_scalars)));
        }
        let mut targets = Vec::new();
        // A target whose channels are all masked is as good as none: nothing is shaded for it.
        let written = |target: &Option<ColorTargetState>| target.as_ref().is_some_and(|state| !state.write_mask.is_empty());
        let mut outputs = desc.targets.iter().rposition(written).map_or(0, |last| last + 1);
        for (slot, target) in desc.targets.iter().enumerate() {
            let Some(state) = target else {
                targets.push(None);
                continue;
            };
            let info = match color_info(state.format) {
                Ok(info) => info,
                Err(what) => return fail(format!("target {slot}: {what}")),
            };
            if !info.blendable && state.blend.is_some() {
                return fail(format!("target {slot}: {:?} cannot be blended: it holds integers", state.format));
            }
            if let Some(blend) = state.blend {
                let factors = [blend.color.src_factor, blend.color.dst_factor, blend.alpha.src_factor, blend.alpha.dst_factor];
                if factors.into_iter().any(reads_second_source) {
                    if desc.targets.len() != 1 {
                        return fail(format!("target {slot}: dual-source blending needs exactly one target, not {}", desc.targets.len()));
                    }
                    outputs = 2;
                }
            }
            targets.push(written(target).then(|| TargetPlan::new(state, info, rules.f16_rounding)));
        }
        if desc.targets.iter().any(Option::is_some) && program.fragment.is_none() && !desc.rasterizer_discard {
            return fail("colour targets need a fragment stage".into());
        }
        let depth = match depth_plan(desc.depth_stencil.as_ref()) {
            Ok(plan) => plan,
            Err(what) => return fail(what),
        };
        if let Some(bias) = desc.depth_stencil.as_ref().map(|d| d.bias)
            && bias.is_enabled()
            && rasterized != PrimitiveClass::Triangles
        {
            return fail("depth bias must be 0 for points and lines".into());
        }
        let mut locations = 0;
        for (slot, layout) in desc.vertex_buffers.iter().enumerate() {
            for attribute in &layout.attributes {
                if attribute.shader_location >= 16 {
                    return fail(format!("vertex buffer {slot}: shader location {}; allowed: 0..16", attribute.shader_location));
                }
                if layout.array_stride != 0 && attribute.offset + attribute.format.size() > layout.array_stride {
                    return fail(format!("vertex buffer {slot}: attribute at byte {} does not fit the stride", attribute.offset));
                }
                locations = locations.max(attribute.shader_location as usize + 1);
            }
        }
        let per_primitive = program.fragment.as_ref().is_some_and(|f| f.per_primitive()) && !program.may_discard && !program.writes_depth;
        let joins = program.fragment.as_ref().is_some_and(|f| f.joins_primitives());
        let shades = program.fragment.is_some() && (outputs > 0 || program.may_discard || program.writes_depth);
        let fragment = FragmentPlan {
            outputs,
            late_tests: shades && (program.writes_depth || (program.may_discard && (depth.write || depth.stencil_writes()))),
            per_primitive,
            shades,
            attributes: shades && !(per_primitive && interpolation.is_empty()),
            joins: shades && !per_primitive && joins && !interpolation.contains(&Interpolation::Flat),
        };
        let fast_path = FastPath::of(&depth, &fragment, &targets, !interpolation.is_empty());
        let rejects_by_depth = !fragment.late_tests && depth.fails_without_trace();
        let always = depth.compare == CompareFunction::Always && !depth.stencil && fragment.shades && !program.may_discard;
        let replaced = targets.iter().enumerate().filter(|(_, target)| always && target.is_some_and(|target| target.replaces()));
        let replaces = replaced.fold(0, |bits, (slot, _)| bits | 1 << slot);
        Ok(Self {
            rules,
            replaces,
            targets,
            depth,
            interpolation,
            vertex_scalars,
            locations,
            rasterized,
            fragment,
            fast_path,
            rejects_by_depth,
            desc,
        })
    }

    /// The description it was made from.
    #[must_use]
    pub fn desc(&self) -> &RenderPipelineDescriptor {
        &self.desc
    }
    /// Points, lines or triangles, after the geometry stage.
    #[must_use]
    pub fn rasterized(&self) -> PrimitiveClass {
        self.rasterized
    }
    /// Floats per vertex that stream-out writes, see [`crate::StreamOutTarget`].
    #[must_use]
    pub fn stream_floats(&self) -> usize {
        4 + self.interpolation.len()
    }
    /// The rules it rasterizes by.
    #[must_use]
    pub fn rules(&self) -> RasterRules {
        self.rules
    }
}

fn color_info(format: TextureFormat) -> Result<FormatInfo, String> {
    match format_info(format) {
        Some(info) if !info.renderable => Err(format!("{format:?} cannot be a colour target, only a texture that shaders read")),
        Some(info) if !info.depth && !info.stencil => Ok(info),
        _ => Err(format!("{format:?} cannot be a colour target; supported: {SUPPORTED_FORMATS}")),
    }
}

fn depth_plan(state: Option<&DepthStencilState>) -> Result<DepthPlan, String> {
    let keep = StencilFaceState::IGNORE;
    let Some(state) = state else {
        return Ok(DepthPlan {
            compare: CompareFunction::Always,
            write: false,
            kind: None,
            stencil_front: keep,
            stencil_back: keep,
            read_mask: 0,
            write_mask: 0,
            stencil: false,
        });
    };
    let info = format_info(state.format)
        .filter(|info| info.depth || info.stencil)
        .ok_or_else(|| format!("{:?} is not a depth or stencil format", state.format))?;
    let uses_stencil = state.stencil.front != keep || state.stencil.back != keep;
    if uses_stencil && !info.stencil {
        return Err(format!("stencil state needs a stencil format, not {:?}", state.format));
    }
    let compare = state.depth_compare.unwrap_or(CompareFunction::Always);
    let write = state.depth_write_enabled.unwrap_or(false);
    if (write || compare != CompareFunction::Always) && !info.depth {
        return Err(format!("depth state needs a depth format, not {:?}", state.format));
    }
    Ok(DepthPlan {
        compare,
        write,
        kind: info.depth.then_some(info.kind),
        stencil_front: state.stencil.front,
        stencil_back: state.stencil.back,
        read_mask: state.stencil.read_mask as u8,
        write_mask: state.stencil.write_mask as u8,
        stencil: uses_stencil,
    })
}
