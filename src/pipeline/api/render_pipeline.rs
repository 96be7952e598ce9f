//! A render pipeline: a program and its fixed-function state, validated once.

use crate::api::check::pipeline::{PipelineError, problem};
use crate::api::format::facts::format_info;
use crate::api::pipeline_descriptor::RenderPipelineDescriptor;
use crate::api::resolved::{DepthPlan, FastPath, FragmentPlan, PrimitiveClass, TargetPlan, reads_second_source};
use crate::api::rules::RasterRules;
use crate::api::shader::varying::{Interpolation, flatten_varyings};
use crate::api::state::{ColorTargetState, CompareFunction};

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
    /// The class of primitives that is rasterized: that of the geometry stage if there is one.
    pub(crate) rasterized: PrimitiveClass,
    pub(crate) fragment: FragmentPlan,
    pub(crate) fast_path: FastPath,
    /// Whether a fragment that fails the depth test changes nothing, and its depth is known before it is shaded.
    pub(crate) rejects_by_depth: bool,
    /// Colour targets in which every fragment overwrites every channel, independent of the old value; bit = target.
    pub(crate) replaces: u8,
}

impl RenderPipeline {
    /// Validates a description and derives the state that drawing needs.
    ///
    /// # Errors
    /// With the first problem found in the description.
    pub fn new(desc: RenderPipelineDescriptor, rules: RasterRules) -> Result<Self, PipelineError> {
        if let Some(problem) = problem(&desc, &rules) {
            return Err(PipelineError { label: desc.label, problem });
        }
        let program = desc.program.clone();
        let interpolation = flatten_varyings(&program.varyings);
        let vertex_scalars = program.geometry.as_ref().map_or(interpolation.len(), |g| flatten_varyings(&g.input_varyings).len());
        // A target whose channels are all masked counts as none: nothing is shaded for it.
        let plan = |target: &Option<ColorTargetState>| {
            let state = target.as_ref().filter(|state| !state.write_mask.is_empty())?;
            Some(TargetPlan::new(state, format_info(state.format)?, rules.f16_rounding))
        };
        let targets: Vec<Option<TargetPlan>> = desc.targets.iter().map(plan).collect();
        let second_source = desc.targets.iter().flatten().filter_map(|target| target.blend).any(|blend| {
            let factors = [blend.color.src_factor, blend.color.dst_factor, blend.alpha.src_factor, blend.alpha.dst_factor];
            factors.into_iter().any(reads_second_source)
        });
        let written = targets.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let outputs = if second_source { 2 } else { written };
        let depth = DepthPlan::new(desc.depth_stencil.as_ref());
        let attributes = desc.vertex_buffers.iter().flat_map(|layout| &layout.attributes);
        let locations = attributes.map(|attribute| attribute.shader_location as usize + 1).max().unwrap_or(0);
        let rasterized = desc.rasterized();
        let per_primitive = program.fragment.as_ref().is_some_and(|f| f.per_primitive()) && !program.may_discard && !program.writes_depth;
        let sprites = rasterized == PrimitiveClass::Points && !program.may_discard && !program.writes_depth;
        let flat = interpolation.iter().all(|&mode| mode == Interpolation::Flat);
        let merges = program.fragment.as_ref().is_some_and(|f| f.merges_fragments());
        let shades = program.fragment.is_some() && (outputs > 0 || program.may_discard || program.writes_depth);
        let fragment = FragmentPlan {
            outputs,
            late_tests: shades && (program.writes_depth || (program.may_discard && (depth.write || depth.stencil_writes()))),
            per_primitive,
            separable: sprites && flat && program.fragment.as_ref().is_some_and(|f| f.separable()),
            shades,
            attributes: shades && !(per_primitive && interpolation.is_empty()),
            merges: shades && !per_primitive && merges && !interpolation.contains(&Interpolation::Flat),
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

    /// The description that the pipeline was made from.
    #[must_use]
    pub fn desc(&self) -> &RenderPipelineDescriptor {
        &self.desc
    }
    /// The class of primitives that is rasterized: that of the geometry stage if there is one.
    #[must_use]
    pub fn rasterized(&self) -> PrimitiveClass {
        self.rasterized
    }
    /// Floats per vertex that stream-out writes: clip position (4), then the varyings' scalars. See [`crate::StreamOutTarget`].
    #[must_use]
    pub fn stream_floats(&self) -> usize {
        4 + self.interpolation.len()
    }
    /// The rasterization rules of the pipeline.
    #[must_use]
    pub fn rules(&self) -> RasterRules {
        self.rules
    }
}
