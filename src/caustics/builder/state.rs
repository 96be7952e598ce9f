//! Pipeline state that passes share.

use nephroid_pipeline::LoadOp;
use nephroid_pipeline::frame::{ColorAttachment, TextureId};
use nephroid_pipeline::state::{
    ADDITIVE, BlendState, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, StencilState,
    TextureFormat,
};

/// An attachment that is cleared to zeros.
#[must_use]
pub fn clear(texture: TextureId) -> Option<ColorAttachment> {
    Some(ColorAttachment { view: texture.into(), load: LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 }) })
}

/// An attachment that the first pass clears to zeros and later passes keep: passes sum in it.
#[must_use]
pub fn clear_or_keep(texture: TextureId, first: bool) -> Option<ColorAttachment> {
    if first { clear(texture) } else { Some(ColorAttachment { view: texture.into(), load: LoadOp::Load }) }
}

/// A colour target of a pipeline that writes all channels.
#[must_use]
pub fn target(format: TextureFormat, blend: Option<BlendState>) -> Option<ColorTargetState> {
    Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })
}

/// Depth state without stencil.
#[must_use]
pub fn depth_state(format: TextureFormat, compare: CompareFunction, write: bool, bias: DepthBiasState) -> DepthStencilState {
    DepthStencilState { format, depth_write_enabled: Some(write), depth_compare: Some(compare), stencil: StencilState::default(), bias }
}

/// A texture in which the fragments of a pass are summed.
#[derive(Clone, Copy, Debug)]
pub struct Sum {
    /// The texture.
    pub texture: TextureId,
    /// Its format.
    pub format: TextureFormat,
    /// Whether the pass clears it first.
    pub clear: bool,
}

/// Pipeline targets and attachments of sums; `None` for a target without one. Targets of `None` at the end are left out.
#[must_use]
pub fn additive(sums: &[Option<Sum>]) -> (Vec<Option<ColorTargetState>>, Vec<Option<ColorAttachment>>) {
    let used = sums.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    let states = sums[..used].iter().map(|sum| sum.and_then(|sum| target(sum.format, Some(ADDITIVE))));
    let attachments = sums[..used].iter().map(|sum| sum.and_then(|sum| clear_or_keep(sum.texture, sum.clear)));
    (states.collect(), attachments.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_between_sums_stay_and_holes_at_the_end_do_not() {
        let sum = |id, clear| Some(Sum { texture: TextureId::at(id), format: TextureFormat::R32Float, clear });
        let (states, attachments) = additive(&[sum(3, true), None, sum(5, false), None, None]);
        assert_eq!((states.len(), attachments.len()), (3, 3));
        assert!(states[1].is_none() && attachments[1].is_none());
        let [first, last] = [0, 2].map(|k: usize| attachments[k].expect("a sum"));
        assert_eq!([first.view.texture, last.view.texture], [TextureId::at(3), TextureId::at(5)]);
        assert!(matches!(first.load, LoadOp::Clear(_)) && matches!(last.load, LoadOp::Load));
        assert!(states[0].as_ref().is_some_and(|state| state.blend == Some(ADDITIVE)));
        assert!(additive(&[None, None]).0.is_empty());
    }
}
