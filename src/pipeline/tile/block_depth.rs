//! Depth of a primitive's blocks: interpolated by the pipeline's rule, clamped, and compared with the depth range of the tile's blocks.

use fearless_simd::{Simd, SimdFrom, f32x16, i32x16, mask32x16};

use nephroid_math::lanes::{Lanes, lanes_from_i32};

use crate::api::draw::Draw;
use crate::api::format::depth::quantize_depth_by;
use crate::api::format::facts::ChannelKind;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::resolved::{BEHIND, IGNORE, WRITE};
use crate::api::rules::DepthPlane;
use crate::geometry::depth_bias::depth_bias;
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::tile::coarse_depth::{CoarseDepth, CoarsePlane, clamp_from_above};
use crate::tile::squares::{LANE_X, LANE_Y};
use crate::vendor::llvmpipe::unpack_bias;

/// Clamps to the viewport's depth range by the pipeline's rule; see [`clamp_to`].
#[inline(always)]
pub(crate) fn clamp_depth<L: Lanes>(z: L, draw: &Draw<'_>) -> L {
    clamp_to(z, (draw.viewport.min_depth, draw.viewport.max_depth), draw.pipeline.rules.depth_plane)
}

/// Clamps to a range. NaN becomes the lower end, but the upper one under the rules of llvmpipe: there, the plane of a triangle whose area vanishes in f32,
/// though not on the grid, is not a number.
#[inline(always)]
fn clamp_to<L: Lanes>(z: L, (low, high): (f32, f32), rule: DepthPlane) -> L {
    match rule {
        DepthPlane::LlvmpipeFused | DepthPlane::LlvmpipeMulAdd => clamp_from_above(z, (low, high)),
        DepthPlane::Reference | DepthPlane::SwiftShader => Lanes::clamp(z, low, high),
    }
}

/// Rounds to a number that the depth format stores.
#[inline(always)]
pub(crate) fn quantized<S: Simd>(z: f32x16<S>, pipeline: &RenderPipeline) -> f32x16<S> {
    match pipeline.depth.kind {
        Some(kind @ ChannelKind::UnormDepth(_)) => Lanes::map(z, |v| quantize_depth_by(pipeline.rules.unorm_depth, kind, v)),
        _ => z,
    }
}

/// Depth of a primitive's blocks.
#[derive(Clone, Copy)]
pub(crate) struct BlockDepth<'c, S: Simd> {
    /// Depth ranges of the tile's blocks, and this primitive's plane over the tile; `None` if not available.
    coarse: Option<(&'c CoarseDepth, CoarsePlane)>,
    /// Column and row of each lane, from the anchor to the tile's first pixel.
    x: f32x16<S>,
    y: f32x16<S>,
    plane: [f32; 3],
    /// Bias that is added last, under the rules of llvmpipe and SwiftShader.
    bias: f32,
    rule: DepthPlane,
    clamp: Option<(f32, f32)>,
}

impl<'c, S: Simd> BlockDepth<'c, S> {
    #[inline(always)]
    pub fn new(
        simd: S,
        primitive: &TilePrimitive,
        origin: [i32; 2],
        draw: &Draw<'_>,
        pipeline: &RenderPipeline,
        coarse: Option<&'c CoarseDepth>,
    ) -> Self {
        let rule = pipeline.rules.depth_plane;
        let (anchor, bias) = match rule {
            DepthPlane::LlvmpipeFused | DepthPlane::LlvmpipeMulAdd => ([0; 2], unpack_bias(primitive.anchor)),
            DepthPlane::Reference => (primitive.anchor, 0.0),
            DepthPlane::SwiftShader => {
                let slope = primitive.z[1].abs().max(primitive.z[2].abs());
                (primitive.anchor, depth_bias(pipeline, slope, (primitive.flags >> flag::BIAS_EXPONENT) as u8))
            }
        };
        // Exact in f32: at most 15 bits of whole pixels and four of fraction.
        let x = (origin[0] - i32::from(anchor[0])) as f32 - (primitive.flags >> flag::SIXTEENTHS & 15) as f32 * 0.0625;
        let y = (origin[1] - i32::from(anchor[1])) as f32 - (primitive.flags >> (flag::SIXTEENTHS + 4) & 15) as f32 * 0.0625;
        // The draw's state is read only where needed: most primitives do without.
        let clamp = if primitive.flags & flag::CLAMP_Z != 0 { Some((draw.viewport.min_depth, draw.viewport.max_depth)) } else { None };
        Self {
            coarse: coarse.map(|coarse| {
                (coarse, CoarsePlane::new([primitive.z[0] + bias, primitive.z[1], primitive.z[2]], [x, y], clamp, pipeline.depth.compare))
            }),
            x: lanes_from_i32(i32x16::simd_from(simd, LANE_X)) + x,
            y: lanes_from_i32(i32x16::simd_from(simd, LANE_Y)) + y,
            plane: primitive.z,
            bias,
            rule,
            clamp,
        }
    }

    /// Blocks of the region at pixel (rx, ry) in which a fragment may pass the depth test, bit = block.
    #[inline(always)]
    pub fn visible_blocks(&self, simd: S, rx: i32, ry: i32) -> u32 {
        match &self.coarse {
            Some((coarse, plane)) => coarse.visible_blocks(simd, plane, rx, ry),
            None => 0xffff,
        }
    }

    /// Regions of the tile in which a fragment may pass the depth test, bit = region.
    #[inline(always)]
    pub fn visible_regions(&self, simd: S) -> u32 {
        match &self.coarse {
            Some((coarse, plane)) => coarse.visible_regions(simd, plane),
            None => 0xffff,
        }
    }

    /// Clamped depth of the block at pixel (bx, by) of the tile, as the depth test uses it.
    #[inline(always)]
    pub fn at(&self, bx: i32, by: i32) -> f32x16<S> {
        self.clamped(self.interpolated(bx, by))
    }

    #[inline(always)]
    pub fn clamped(&self, z: f32x16<S>) -> f32x16<S> {
        match self.clamp {
            Some(range) => clamp_to(z, range, self.rule),
            None => z,
        }
    }

    /// Depth before the clamp, as shaders see it [WebGPU: fragments of unclipped primitives].
    #[inline(always)]
    pub fn interpolated(&self, bx: i32, by: i32) -> f32x16<S> {
        let [base, dx, dy] = self.plane;
        let (x, y) = (self.x + bx as f32, self.y + by as f32);
        match self.rule {
            DepthPlane::Reference => (y * dy + base) + x * dx,
            DepthPlane::SwiftShader => ((y * dy + base) + x * dx) + self.bias,
            DepthPlane::LlvmpipeMulAdd => ((x * dx + base) + y * dy) + self.bias,
            DepthPlane::LlvmpipeFused => {
                let bias = self.bias;
                <f32x16<S> as Lanes>::from_fn(Lanes::token(x), |i| dy.mul_add(y.lane(i), dx.mul_add(x.lane(i), base)) + bias)
            }
        }
    }
}

/// Tests the depth of a block and, for [`WRITE`], writes it. Returns the pixels that pass.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of a sink, borrowed separately")]
pub(crate) fn test_depth<S: Simd, const DEPTH: u8>(
    z: &BlockDepth<'_, S>,
    plane: &mut [f32],
    bx: i32,
    by: i32,
    offset: usize,
    mask: mask32x16<S>,
    strict: bool,
    simd: S,
) -> mask32x16<S> {
    if DEPTH == IGNORE {
        return mask;
    }
    let new = z.at(bx, by);
    let block = &mut plane[offset..offset + 16];
    let stored = <f32x16<S> as Lanes>::load(simd, block);
    let (near, far) = if DEPTH == BEHIND { (stored, new) } else { (new, stored) };
    let pass = mask & if strict { Lanes::lt(near, far) } else { Lanes::le(near, far) };
    if DEPTH == WRITE {
        Lanes::store(<f32x16<S> as Lanes>::select(pass, new, stored), block);
    }
    pass
}
