//! Colour targets: formats, write masks and blending.

use crate::api::format::facts::{SUPPORTED_FORMATS, format_info};
use crate::api::resolved::reads_second_source;
use crate::api::state::{BlendFactor, BlendOperation, ColorTargetState, ColorWrites, TextureFormat};

/// Why a colour target of a pipeline is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ColorTargetProblem {
    /// An unsupported format.
    #[error("format {format:?} is not supported; supported: {SUPPORTED_FORMATS}")]
    Format {
        /// The format seen.
        format: TextureFormat,
    },
    /// A depth or stencil format, or a format that cannot be rendered to.
    #[error("{format:?} cannot be a colour target")]
    NotRenderable {
        /// The format seen.
        format: TextureFormat,
    },
    /// Bits beyond the four channels.
    #[error("write mask {bits:#x}; allowed: 0..=0xf")]
    WriteMask {
        /// The mask seen.
        bits: u32,
    },
    /// A format that cannot be blended.
    #[error("{format:?} cannot be blended")]
    NotBlendable {
        /// The format seen.
        format: TextureFormat,
    },
    /// Operation `Min` or `Max` with a factor other than `One`: these operations ignore factors.
    #[error("blend factor {factor:?} for operation {operation:?}; allowed: One")]
    MinMaxFactor {
        /// The operation, `Min` or `Max`.
        operation: BlendOperation,
        /// The factor seen.
        factor: BlendFactor,
    },
    /// Dual-source blending with more than one target.
    #[error("dual-source blending needs exactly one target, not {targets}")]
    DualSource {
        /// Targets seen.
        targets: usize,
    },
}

/// Whether a format can be a colour target.
pub(crate) fn is_color_renderable(format: TextureFormat) -> bool {
    format_info(format).is_some_and(|info| info.renderable && !info.depth && !info.stencil)
}

/// Why one of `targets` colour targets is refused, or `None`.
pub(crate) fn problem(state: &ColorTargetState, targets: usize) -> Option<ColorTargetProblem> {
    let format = state.format;
    if format_info(format).is_none() {
        return Some(ColorTargetProblem::Format { format });
    }
    if !is_color_renderable(format) {
        return Some(ColorTargetProblem::NotRenderable { format });
    }
    if !ColorWrites::ALL.contains(state.write_mask) {
        return Some(ColorTargetProblem::WriteMask { bits: state.write_mask.bits() });
    }
    let blend = state.blend?;
    if !format_info(format).is_some_and(|info| info.blendable) {
        return Some(ColorTargetProblem::NotBlendable { format });
    }
    for component in [blend.color, blend.alpha] {
        let (operation, factors) = (component.operation, [component.src_factor, component.dst_factor]);
        let takes_no_factor = matches!(operation, BlendOperation::Min | BlendOperation::Max);
        if let Some(&factor) = factors.iter().find(|factor| takes_no_factor && **factor != BlendFactor::One) {
            return Some(ColorTargetProblem::MinMaxFactor { operation, factor });
        }
        if targets != 1 && factors.into_iter().any(reads_second_source) {
            return Some(ColorTargetProblem::DualSource { targets });
        }
    }
    None
}
