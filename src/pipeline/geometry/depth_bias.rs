//! Depth bias.

use crate::api::format::facts::ChannelKind;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::rules::UnormDepth;

/// Raw exponent of the number of greatest magnitude.
#[inline(always)]
pub(crate) fn greatest_exponent(z: [f32; 3]) -> u8 {
    let greatest = z[0].abs().max(z[1].abs()).max(z[2].abs());
    (greatest.to_bits() >> 23) as u8
}

/// `constant·r + slope_scale·slope`, clamped [D3D11.3 §15.10]. For normalized formats `r` is the smallest step; for floats it is the unit in the last
/// place of numbers with this exponent.
#[inline(always)]
pub(crate) fn depth_bias(pipeline: &RenderPipeline, slope: f32, exponent: u8) -> f32 {
    let Some(state) = &pipeline.desc.depth_stencil else { return 0.0 };
    if !state.bias.is_enabled() {
        return 0.0;
    }
    let step = match pipeline.depth.kind {
        Some(ChannelKind::UnormDepth(bits)) => {
            let units = match pipeline.rules.unorm_depth {
                UnormDepth::NearestUp => 1.0,
                UnormDepth::Scaled => 2.0,
                UnormDepth::NearestEven => 1.01,
            };
            units / ((1u32 << bits) - 1) as f32
        }
        // For very small numbers, zero included, the unit in the last place is subnormal. Drivers flush it to 0.
        _ => f32::from_bits(u32::from(exponent).saturating_sub(23) << 23),
    };
    let bias = state.bias.constant as f32 * step + state.bias.slope_scale * slope;
    let clamp = state.bias.clamp;
    if clamp > 0.0 {
        bias.min(clamp)
    } else if clamp < 0.0 {
        bias.max(clamp)
    } else {
        bias
    }
}
