//! Clip coordinates to framebuffer coordinates: divide, viewport, snap; and which clip planes a vertex is outside of.

use super::state::{ClipVolume, PixelRect, RasterRules, Viewport, ViewportArithmetic};

/// One pixel in sub-pixel units; coordinates are kept in 1/256 pixel whatever the rules' precision.
pub(super) const ONE: i32 = 256;
/// Half a pixel: where centres are.
pub(super) const HALF: i32 = 128;
/// Framebuffer coordinates stay within ± this many pixels, so that edge functions fit 64 bits and differences 25.
pub(super) const GUARD_PX: f32 = 32768.0;
/// Part of that which vertices leave free: half the greatest line width, and a pixel for rounding.
const GUARD_MARGIN_PX: f32 = 513.0;
/// Snapped coordinates of vertices that clipping made stay within ± this, whatever rounding did to a `w` near zero.
const LIMIT: i32 = GUARD_PX as i32 * ONE;
/// Least `w` that is divided by. Vertices nearer to the eye plane are clipped to it.
pub(super) const MIN_W: f32 = 1.0 / 16_777_216.0;

/// A vertex in framebuffer coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WindowVertex {
    /// Snapped position in 1/256 pixel.
    pub fx: i32,
    /// Snapped position in 1/256 pixel, y down.
    pub fy: i32,
    /// Position in pixels before snapping.
    pub x: f32,
    /// Position in pixels before snapping.
    pub y: f32,
    /// Depth, viewport range applied, before the clamp.
    pub z: f32,
    /// 1/w.
    pub inv_w: f32,
}

/// Outcode bits: outside which plane.
pub(super) mod outside {
    pub const LEFT: u8 = 1;
    pub const RIGHT: u8 = 2;
    pub const BOTTOM: u8 = 4;
    pub const TOP: u8 = 8;
    pub const NEAR: u8 = 16;
    pub const FAR: u8 = 32;
    /// Beyond the guard band, or w too small.
    pub const GUARD: u8 = 64;
    /// A coordinate is not a number, for which D3D drops the primitive [D3D11.3 §15.16.1], or infinite, from which no edge can be drawn.
    pub const NAN: u8 = 128;
    pub const FRUSTUM: u8 = 63;
}

/// A draw's viewport and rules, ready to apply.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewTransform {
    pub rules: RasterRules,
    scale: [f32; 2],
    translate: [f32; 2],
    depth_scale: f32,
    pub depth_range: (f32, f32),
    depth_clip: bool,
    /// Guard band in clip space: outside where `|x| > guard·w`.
    guard: [f32; 2],
}

impl ViewTransform {
    pub fn new(viewport: &Viewport, rules: RasterRules, unclipped_depth: bool) -> Self {
        let scale = [viewport.width * 0.5, viewport.height * -0.5];
        let translate = [viewport.x + viewport.width * 0.5, viewport.y + viewport.height * 0.5];
        let guard = [0, 1].map(|axis: usize| (GUARD_PX - GUARD_MARGIN_PX - translate[axis].abs()) / scale[axis].abs().max(1.0e-3));
        let (near, far) = (viewport.min_depth, viewport.max_depth);
        Self {
            rules,
            scale,
            translate,
            depth_scale: far - near,
            depth_range: (near.min(far), near.max(far)),
            depth_clip: !unclipped_depth,
            guard,
        }
    }

    /// Pixels that may change: inside the viewport where the guard band lets primitives reach beyond it, else all.
    pub fn pixels(&self) -> PixelRect {
        if self.rules.clip_volume == ClipVolume::Frustum {
            return PixelRect::full(u32::MAX, u32::MAX);
        }
        // Pixel centres in the half-open viewport. The casts saturate.
        let first = |axis: usize| (self.translate[axis] - self.scale[axis].abs() - 0.5).ceil() as u32;
        let end = |axis: usize| (self.translate[axis] + self.scale[axis].abs() - 0.5).ceil() as u32;
        PixelRect { x0: first(0), y0: first(1), x1: end(0), y1: end(1) }
    }

    /// Planes that must be clipped against geometrically if a vertex is outside of them.
    pub fn clip_mask(&self) -> u8 {
        match self.rules.clip_volume {
            ClipVolume::GuardBand => outside::NEAR | outside::FAR | outside::GUARD,
            ClipVolume::Frustum => outside::FRUSTUM | outside::GUARD,
        }
    }

    /// Which planes a clip-space position is outside of.
    #[inline(always)]
    pub fn outcode(&self, [x, y, z, w]: [f32; 4]) -> u8 {
        let bit = |is: bool, bit: u8| if is { bit } else { 0 };
        let nan = !(x.is_finite() && y.is_finite() && z.is_finite() && w.is_finite());
        let guard = w < MIN_W || x.abs() > self.guard[0] * w || y.abs() > self.guard[1] * w;
        bit(x < -w, outside::LEFT)
            | bit(x > w, outside::RIGHT)
            | bit(y < -w, outside::BOTTOM)
            | bit(y > w, outside::TOP)
            | bit(self.depth_clip && z < 0.0, outside::NEAR)
            | bit(self.depth_clip && z > w, outside::FAR)
            | bit(guard, outside::GUARD)
            | bit(nan, outside::NAN)
    }

    /// Signed distances to the clip planes in the order of `clip.rs`, inside positive.
    pub fn guard(&self) -> [f32; 2] {
        self.guard
    }

    /// Divide, viewport and snap. `made_by_clipping`: new vertices round differently under the llvmpipe rules.
    #[inline(always)]
    pub fn window_vertex(&self, [x, y, z, w]: [f32; 4], made_by_clipping: bool) -> WindowVertex {
        let inv_w = 1.0 / w;
        let ndc = [x * inv_w, y * inv_w];
        let mut px = [0.0; 2];
        let mut fixed = [0; 2];
        for axis in 0..2 {
            let (n, scale, translate) = (ndc[axis], self.scale[axis], self.translate[axis]);
            px[axis] = if self.rules.viewport == ViewportArithmetic::Fused && !made_by_clipping {
                n.mul_add(scale, translate)
            } else {
                n * scale + translate
            };
            let units = f32::from(1u16 << self.rules.subpixel_bits);
            let coarse = ONE >> self.rules.subpixel_bits;
            fixed[axis] = if self.rules.viewport == ViewportArithmetic::Prescaled {
                let centred = (n * (units * scale) + (units * translate - units * 0.5)).round_ties_even() as i32;
                centred.saturating_mul(coarse).saturating_add(HALF)
            } else {
                ((px[axis] * units).round_ties_even() as i32).saturating_mul(coarse)
            };
            if made_by_clipping {
                fixed[axis] = fixed[axis].clamp(-LIMIT, LIMIT);
            }
        }
        let z = (z * inv_w) * self.depth_scale + if self.depth_scale >= 0.0 { self.depth_range.0 } else { self.depth_range.1 };
        WindowVertex { fx: fixed[0], fy: fixed[1], x: px[0], y: px[1], z, inv_w }
    }
}
