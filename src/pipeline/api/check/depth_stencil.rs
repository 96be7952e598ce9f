//! Depth and stencil state, and depth bias.

use crate::api::format::facts::format_info;
use crate::api::resolved::PrimitiveClass;
use crate::api::state::{CompareFunction, DepthStencilState, StencilFaceState, StencilOperation, TextureFormat};

/// Why the depth and stencil state of a pipeline is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DepthStencilProblem {
    /// A colour format.
    #[error("{format:?} is not a depth or stencil format")]
    Format {
        /// The format seen.
        format: TextureFormat,
    },
    /// Depth is tested or written, but the format has no depth.
    #[error("depth state needs a depth format, not {format:?}")]
    NoDepth {
        /// The format seen.
        format: TextureFormat,
    },
    /// The stencil is tested or written, but the format has no stencil.
    #[error("stencil state needs a stencil format, not {format:?}")]
    NoStencil {
        /// The format seen.
        format: TextureFormat,
    },
    /// A format with depth, but `depth_write_enabled` is not given.
    #[error("depth_write_enabled must be given for {format:?}")]
    DepthWriteEnabledMissing {
        /// The format seen.
        format: TextureFormat,
    },
    /// `depth_compare` is not given, although depth is written or the stencil operation for a failed depth test changes the stencil.
    #[error("depth_compare must be given for {format:?} where depth is written or its test changes the stencil")]
    DepthCompareMissing {
        /// The format seen.
        format: TextureFormat,
    },
    /// Depth bias for points or lines.
    #[error("depth bias must be 0 for {rasterized:?}")]
    BiasTopology {
        /// What is rasterized, after the geometry stage.
        rasterized: PrimitiveClass,
    },
    /// Depth bias that is infinite or not a number.
    #[error("depth bias slope_scale {slope_scale}, clamp {clamp}; both must be finite")]
    BiasNotFinite {
        /// The slope scale seen.
        slope_scale: f32,
        /// The clamp seen.
        clamp: f32,
    },
}

/// Why a depth and stencil state is refused, or `None`.
pub(crate) fn problem(state: &DepthStencilState, rasterized: PrimitiveClass) -> Option<DepthStencilProblem> {
    let format = state.format;
    let Some(info) = format_info(format).filter(|info| info.depth || info.stencil) else {
        return Some(DepthStencilProblem::Format { format });
    };
    let faces = [state.stencil.front, state.stencil.back];
    if !info.stencil && faces.iter().any(|face| *face != StencilFaceState::IGNORE) {
        return Some(DepthStencilProblem::NoStencil { format });
    }
    let writes = state.depth_write_enabled == Some(true);
    if !info.depth && (writes || state.depth_compare.is_some_and(|compare| compare != CompareFunction::Always)) {
        return Some(DepthStencilProblem::NoDepth { format });
    }
    if info.depth && state.depth_write_enabled.is_none() {
        return Some(DepthStencilProblem::DepthWriteEnabledMissing { format });
    }
    let compares = writes || faces.iter().any(|face| face.depth_fail_op != StencilOperation::Keep);
    if info.depth && compares && state.depth_compare.is_none() {
        return Some(DepthStencilProblem::DepthCompareMissing { format });
    }
    let bias = state.bias;
    if rasterized != PrimitiveClass::Triangles && (bias.is_enabled() || bias.clamp != 0.0) {
        return Some(DepthStencilProblem::BiasTopology { rasterized });
    }
    let finite = bias.slope_scale.is_finite() && bias.clamp.is_finite();
    (!finite).then_some(DepthStencilProblem::BiasNotFinite { slope_scale: bias.slope_scale, clamp: bias.clamp })
}
