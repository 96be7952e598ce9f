//! State derived once per pipeline: depth and stencil, fragments, colour targets, and the fast path.

use crate::api::format::facts::{ChannelKind, format_info};
use crate::api::format::quantize::Quantizer;
use crate::api::state::{
    BlendFactor, BlendState, ColorWrites, CompareFunction, DepthStencilState, PrimitiveTopology, StencilFaceState, StencilOperation,
};

/// Class of primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimitiveClass {
    /// Point sprites.
    Points,
    /// Lines with width.
    Lines,
    /// Triangles.
    Triangles,
}

impl PrimitiveClass {
    /// The class of primitives that a topology forms.
    #[must_use]
    pub fn of(topology: PrimitiveTopology) -> Self {
        match topology {
            PrimitiveTopology::PointList => Self::Points,
            PrimitiveTopology::LineList | PrimitiveTopology::LineStrip => Self::Lines,
            PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip => Self::Triangles,
        }
    }
    /// Number of vertices of a primitive: 1, 2 or 3.
    #[must_use]
    pub fn corners(self) -> usize {
        match self {
            Self::Points => 1,
            Self::Lines => 2,
            Self::Triangles => 3,
        }
    }
}

/// Depth and stencil state with its defaults filled in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthPlan {
    pub compare: CompareFunction,
    pub write: bool,
    /// How the depth plane stores depth; `None` without one.
    pub kind: Option<ChannelKind>,
    pub stencil_front: StencilFaceState,
    pub stencil_back: StencilFaceState,
    pub read_mask: u8,
    pub write_mask: u8,
    /// Whether the stencil plane is read or written.
    pub stencil: bool,
}

impl DepthPlan {
    /// From a pipeline's valid state; without any, depth and stencil are ignored.
    pub fn new(state: Option<&DepthStencilState>) -> Self {
        let keep = StencilFaceState::IGNORE;
        let Some(state) = state else {
            return Self {
                compare: CompareFunction::Always,
                write: false,
                kind: None,
                stencil_front: keep,
                stencil_back: keep,
                read_mask: 0,
                write_mask: 0,
                stencil: false,
            };
        };
        Self {
            compare: state.depth_compare.unwrap_or(CompareFunction::Always),
            write: state.depth_write_enabled.unwrap_or(false),
            kind: format_info(state.format).filter(|info| info.depth).map(|info| info.kind),
            stencil_front: state.stencil.front,
            stencil_back: state.stencil.back,
            read_mask: state.stencil.read_mask as u8,
            write_mask: state.stencil.write_mask as u8,
            stencil: state.stencil.front != keep || state.stencil.back != keep,
        }
    }

    /// Whether depth is read or written.
    pub fn tests_depth(&self) -> bool {
        self.kind.is_some() && (self.write || self.compare != CompareFunction::Always)
    }
    /// Whether depth is tested as a 32-bit float, and a fragment that fails its depth or stencil test leaves the stencil unchanged.
    pub(crate) fn fails_without_trace(&self) -> bool {
        let quiet = |face: &StencilFaceState| {
            (face.compare == CompareFunction::Always || face.fail_op == StencilOperation::Keep)
                && face.depth_fail_op == StencilOperation::Keep
        };
        let orders = matches!(
            self.compare,
            CompareFunction::Less | CompareFunction::LessEqual | CompareFunction::Greater | CompareFunction::GreaterEqual
        );
        let stencil = !self.stencil || (quiet(&self.stencil_front) && quiet(&self.stencil_back));
        orders && self.kind == Some(ChannelKind::Float32) && stencil
    }
    /// Whether both faces test the stencil, and a fragment that fails its stencil test leaves the stencil unchanged.
    pub fn stencil_rejects(&self) -> bool {
        let rejects = |face: &StencilFaceState| face.compare != CompareFunction::Always && face.fail_op == StencilOperation::Keep;
        self.stencil && rejects(&self.stencil_front) && rejects(&self.stencil_back)
    }
    pub(crate) fn stencil_writes(&self) -> bool {
        let writes = |face: &StencilFaceState| {
            [face.fail_op, face.depth_fail_op, face.pass_op].iter().any(|op| *op != StencilOperation::Keep) && self.write_mask != 0
        };
        self.stencil && (writes(&self.stencil_front) || writes(&self.stencil_back))
    }
}

/// How fragments are shaded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FragmentPlan {
    /// Colour outputs that the stage computes (dual-source blending needs a second one).
    pub outputs: usize,
    /// Depth and stencil are tested after the shader.
    pub late_tests: bool,
    /// One colour per primitive.
    pub per_primitive: bool,
    /// The product of a function of the column and one of the row, both without any but flat varyings.
    pub separable: bool,
    /// The fragment stage must run at all.
    pub shades: bool,
    /// Per-primitive interpolation data must be kept.
    pub attributes: bool,
    /// Primitives that share a block are shaded together.
    pub merges: bool,
}

/// State of a colour target that blending needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TargetPlan {
    pub channels: usize,
    pub blend: Option<BlendState>,
    pub write_mask: ColorWrites,
    pub(crate) quantizer: Quantizer,
    /// Whether source colour and blend constant are clamped to 0..=1 before blending, as for unorm formats [D3D11.3 §17.5].
    pub(crate) clamp: bool,
    /// Whether blending is plain addition in every channel of an f32 target: old value plus shader output.
    pub additive_f32: bool,
    /// Whether the target is of 32 bits, not blended, and takes the shader's output in every channel.
    pub(crate) plain: bool,
}

/// Depth modes of fast paths: ignored (`IGNORE`), tested for nearer fragments (`TEST`), tested and written (`WRITE`), tested for farther ones
/// (`BEHIND`).
pub(crate) const IGNORE: u8 = 0;

pub(crate) const TEST: u8 = 1;

pub(crate) const WRITE: u8 = 2;

pub(crate) const BEHIND: u8 = 3;

/// The fast path that a pipeline's draws take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FastPath {
    /// No fast path: the general one.
    General,
    /// Adds a colour to one f32 target. `one_color`: all primitives of a draw with the same facing have the same colour.
    Add { channels: u8, depth: u8, strict: bool, one_color: bool },
    /// Adds sprites with a separable kernel to f32 targets.
    Splat { depth: u8, strict: bool },
    /// Changes the stencil only; depth is tested but not written.
    Stencil { depth: u8, strict: bool },
    /// Tests and writes depth only.
    Depth { strict: bool },
}

impl FastPath {
    /// The fast path that gives the same result as the general path for this state.
    pub fn of(plan: &DepthPlan, fragment: &FragmentPlan, targets: &[Option<TargetPlan>], has_varyings: bool) -> Self {
        let (depth, strict) = match (plan.compare, plan.write, plan.kind) {
            (CompareFunction::Always, false, _) => (IGNORE, false),
            (CompareFunction::Less, write, Some(ChannelKind::Float32)) => (TEST + u8::from(write), true),
            (CompareFunction::LessEqual, write, Some(ChannelKind::Float32)) => (TEST + u8::from(write), false),
            (CompareFunction::Greater, false, Some(ChannelKind::Float32)) => (BEHIND, true),
            (CompareFunction::GreaterEqual, false, Some(ChannelKind::Float32)) => (BEHIND, false),
            _ => return Self::General,
        };
        if !fragment.shades {
            let always = plan.stencil_front.compare == CompareFunction::Always && plan.stencil_back.compare == CompareFunction::Always;
            return match depth {
                IGNORE | TEST | BEHIND if plan.stencil && always => Self::Stencil { depth, strict },
                WRITE if !plan.stencil => Self::Depth { strict },
                _ => Self::General,
            };
        }
        let additive = |target: &Option<TargetPlan>| target.as_ref().is_none_or(|target| target.additive_f32);
        match targets {
            _ if fragment.separable && !plan.stencil && matches!(depth, IGNORE | TEST) && targets.iter().all(additive) => {
                Self::Splat { depth, strict }
            }
            [Some(target)] if !plan.stencil && depth != BEHIND && fragment.per_primitive && target.additive_f32 => {
                let one_color = !has_varyings && !fragment.attributes;
                Self::Add { channels: target.channels as u8, depth, strict, one_color }
            }
            _ => Self::General,
        }
    }
}

/// True if the factor reads the second source of dual-source blending.
pub(crate) fn reads_second_source(factor: BlendFactor) -> bool {
    matches!(factor, BlendFactor::Src1 | BlendFactor::OneMinusSrc1 | BlendFactor::Src1Alpha | BlendFactor::OneMinusSrc1Alpha)
}
