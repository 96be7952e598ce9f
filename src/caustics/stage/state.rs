//! Pipeline state that passes have in common.

use nephroid_pipeline::LoadOp;
use nephroid_pipeline::frame::{ColorTarget, TextureId};
use nephroid_pipeline::state::{
    BlendState, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, StencilState, TextureFormat,
};

/// An attachment that starts as zeros.
pub fn clear(texture: TextureId) -> Option<ColorTarget> {
    Some(ColorTarget { view: texture.into(), load: LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 }) })
}

/// An attachment that starts as zeros the first time and is added to after that.
pub fn clear_or_keep(texture: TextureId, first: bool) -> Option<ColorTarget> {
    if first { clear(texture) } else { Some(ColorTarget { view: texture.into(), load: LoadOp::Load }) }
}

/// A colour target of a pipeline, all channels written.
pub fn target(format: TextureFormat, blend: Option<BlendState>) -> Option<ColorTargetState> {
    Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })
}

/// Depth state without stencil.
pub fn depth_state(format: TextureFormat, compare: CompareFunction, write: bool, bias: DepthBiasState) -> DepthStencilState {
    DepthStencilState { format, depth_write_enabled: Some(write), depth_compare: Some(compare), stencil: StencilState::default(), bias }
}
