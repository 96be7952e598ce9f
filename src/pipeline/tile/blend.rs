//! Blending and the write to a colour target, for one 4x4 block.

use fearless_simd::{Simd, SimdMask, f32x16, mask32x16};

use nephroid_math::lanes::Lanes;

use crate::api::format::facts::FormatInfo;
use crate::api::format::nan::one_nan_lanes;
use crate::api::format::quantize::Quantizer;
use crate::api::resolved::TargetPlan;
use crate::api::rules::F16Rounding;
use crate::api::state::{ADDITIVE, BlendComponent, BlendFactor, BlendOperation, ColorTargetState};
use crate::api::surface::TILE_PIXELS;

/// Adds values to the numbers of a block whose pixels are in `mask`.
///
/// The others get −0.0, which changes no number, and no NaN, as planes hold only one. A choice between old and new numbers would be compiled to a
/// masked store, which takes some twenty cycles on AMD's processors with AVX2.
#[inline(always)]
pub(crate) fn add_in<S: Simd>(simd: S, mask: mask32x16<S>, values: f32x16<S>, block: &mut [f32]) {
    let nothing = <f32x16<S> as Lanes>::splat(simd, -0.0);
    let old = <f32x16<S> as Lanes>::load(simd, block);
    Lanes::store(one_nan_lanes(old + <f32x16<S> as Lanes>::select(mask, values, nothing)), block);
}

impl TargetPlan {
    pub fn new(state: &ColorTargetState, info: FormatInfo, f16: F16Rounding) -> Self {
        let clamp = info.kind.clamps_blending();
        let quantizer = Quantizer::new(info.kind, f16);
        let all = (1u32 << info.channels) - 1;
        let exact = matches!(quantizer, Quantizer::Exact | Quantizer::Float32) && state.write_mask.bits() & all == all;
        let additive_f32 = exact && state.blend == Some(ADDITIVE);
        let plain = exact && state.blend.is_none();
        Self { channels: info.channels, blend: state.blend, write_mask: state.write_mask, quantizer, clamp, additive_f32, plain }
    }

    /// The blended colours of a block.
    #[inline(always)]
    fn load_source<S: Simd>(&self, simd: S, from: &[f32]) -> [f32x16<S>; 4] {
        let mut components = [<f32x16<S> as Lanes>::splat(simd, 0.0); 4];
        for (component, from) in components.iter_mut().zip(from.chunks_exact(16)) {
            let value = <f32x16<S> as Lanes>::load(simd, from);
            *component = if self.clamp { Lanes::clamp(value, 0.0, 1.0) } else { value };
        }
        components
    }

    /// Whether every channel is written, independent of the old value.
    pub fn replaces(&self) -> bool {
        let all = (1u32 << self.channels) - 1;
        self.blend.is_none() && self.write_mask.bits() & all == all
    }

    /// The value that a target of 32 bits stores: integers unchanged, floats with every NaN as the one bit pattern.
    #[inline(always)]
    fn exactly<S: Simd>(&self, value: f32x16<S>) -> f32x16<S> {
        if self.quantizer == Quantizer::Float32 { one_nan_lanes(value) } else { value }
    }

    /// Whether the mask allows a channel to be written.
    #[inline(always)]
    fn writes(&self, channel: usize) -> bool {
        self.write_mask.bits() >> channel & 1 == 1
    }

    /// Blends a block's colours into a tile's planes. `source` is `[component][16]`, `source1` the second source of dual-source
    /// blending, `offset` the block's place in a plane.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a block is its place, mask, two sources and constant")]
    pub fn store<S: Simd>(
        &self,
        simd: S,
        planes: &mut [f32],
        offset: usize,
        mask: u32,
        source: &[f32],
        source1: &[f32],
        constant: [f32; 4],
    ) {
        let lanes = mask32x16::from_bitmask(simd, u64::from(mask));
        if self.additive_f32 {
            for (c, source) in source.chunks_exact(16).enumerate().take(self.channels) {
                let plane = &mut planes[c * TILE_PIXELS + offset..][..16];
                add_in(simd, lanes, <f32x16<S> as Lanes>::load(simd, source), plane);
            }
            return;
        }
        if self.plain {
            for (c, source) in source.chunks_exact(16).enumerate().take(self.channels) {
                let plane = &mut planes[c * TILE_PIXELS + offset..][..16];
                let old = <f32x16<S> as Lanes>::load(simd, plane);
                let new = self.exactly(<f32x16<S> as Lanes>::load(simd, source));
                Lanes::store(<f32x16<S> as Lanes>::select(lanes, new, old), plane);
            }
            return;
        }
        let src = self.load_source(simd, source);
        let mut result = src;
        if let Some(blend) = self.blend {
            let one = <f32x16<S> as Lanes>::splat(simd, 1.0);
            let zero = <f32x16<S> as Lanes>::splat(simd, 0.0);
            let mut dst = [zero, zero, zero, one];
            for (c, value) in dst.iter_mut().enumerate().take(self.channels) {
                *value = Lanes::load(simd, &planes[c * TILE_PIXELS + offset..]);
            }
            let mut constants = [zero; 4];
            for (lanes, v) in constants.iter_mut().zip(constant) {
                *lanes = Lanes::splat(simd, if self.clamp { v.clamp(0.0, 1.0) } else { v });
            }
            let operands = Operands { src, src1: self.load_source(simd, source1), dst, constant: constants };
            for (c, value) in result.iter_mut().enumerate().take(self.channels) {
                let component = if c == 3 { blend.alpha } else { blend.color };
                *value = operands.blend(component, c);
            }
        }
        for c in 0..self.channels {
            if !self.writes(c) {
                continue;
            }
            let value = result[c];
            let plane = &mut planes[c * TILE_PIXELS + offset..][..16];
            let value = match self.quantizer {
                Quantizer::Exact | Quantizer::Float32 => self.exactly(value),
                quantizer => Lanes::map(value, |v| quantizer.apply(v, c)),
            };
            let old = <f32x16<S> as Lanes>::load(simd, plane);
            Lanes::store(<f32x16<S> as Lanes>::select(lanes, value, old), plane);
        }
    }
}

/// The inputs of the blend equation.
struct Operands<S: Simd> {
    src: [f32x16<S>; 4],
    src1: [f32x16<S>; 4],
    dst: [f32x16<S>; 4],
    constant: [f32x16<S>; 4],
}

impl<S: Simd> Operands<S> {
    /// `src·f_s OP dst·f_d`; minimum and maximum ignore the factors.
    #[inline(always)]
    fn blend(&self, component: BlendComponent, c: usize) -> f32x16<S> {
        let (s, d) = (self.src[c], self.dst[c]);
        let (scaled_s, scaled_d) = (self.scale(s, component.src_factor, c), self.scale(d, component.dst_factor, c));
        match component.operation {
            BlendOperation::Add => scaled_s + scaled_d,
            BlendOperation::Subtract => scaled_s - scaled_d,
            BlendOperation::ReverseSubtract => scaled_d - scaled_s,
            BlendOperation::Min => Lanes::min(s, d),
            BlendOperation::Max => Lanes::max(s, d),
        }
    }

    #[inline(always)]
    fn scale(&self, value: f32x16<S>, factor: BlendFactor, c: usize) -> f32x16<S> {
        let f = match factor {
            BlendFactor::Zero => value * 0.0,
            BlendFactor::One => return value,
            BlendFactor::Src => self.src[c],
            BlendFactor::OneMinusSrc => one_minus(self.src[c]),
            BlendFactor::SrcAlpha => self.src[3],
            BlendFactor::OneMinusSrcAlpha => one_minus(self.src[3]),
            BlendFactor::Dst => self.dst[c],
            BlendFactor::OneMinusDst => one_minus(self.dst[c]),
            BlendFactor::DstAlpha => self.dst[3],
            BlendFactor::OneMinusDstAlpha => one_minus(self.dst[3]),
            BlendFactor::SrcAlphaSaturated if c == 3 => return value,
            BlendFactor::SrcAlphaSaturated => Lanes::min(self.src[3], one_minus(self.dst[3])),
            BlendFactor::Constant => self.constant[c],
            BlendFactor::OneMinusConstant => one_minus(self.constant[c]),
            BlendFactor::Src1 => self.src1[c],
            BlendFactor::OneMinusSrc1 => one_minus(self.src1[c]),
            BlendFactor::Src1Alpha => self.src1[3],
            BlendFactor::OneMinusSrc1Alpha => one_minus(self.src1[3]),
        };
        if factor == BlendFactor::Zero { f } else { value * f }
    }
}

#[inline(always)]
fn one_minus<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    -x + 1.0
}
