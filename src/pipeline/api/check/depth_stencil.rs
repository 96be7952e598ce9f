//! Depth and stencil state, and depth bias.

use crate::api::format::facts::format_info;
use crate::api::resolved::PrimitiveClass;
use crate::api::state::{CompareFunction, DepthStencilState, StencilFaceState, StencilOperation, TextureFormat};

/// What is wrong with a pipeline's depth and stencil state.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DepthStencilProblem {
    /// Not a format for depth or stencil.
    #[error("{format:?} is not a depth or stencil format")]
    Format {
        /// The format seen.
        format: TextureFormat,
    },
    /// Depth is tested or written, and the format has none.
    #[error("depth state needs a depth format, not {format:?}")]
    NoDepth {
        /// The format seen.
        format: TextureFormat,
    },
    /// The stencil is tested or written, and the format has none.
    #[error("stencil state needs a stencil format, not {format:?}")]
    NoStencil {
        /// The format seen.
        format: TextureFormat,
    },
    /// A format with depth, and nothing said about writing it.
    #[error("depth_write_enabled must be given for {format:?}")]
    DepthWriteEnabledMissing {
        /// The format seen.
        format: TextureFormat,
    },
    /// Depth is written, or a failed depth test changes the stencil, and nothing is said about the test.
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

/// What is wrong with a depth and stencil state.
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
