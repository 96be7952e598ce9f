//! Clip coordinates to framebuffer coordinates: divide, viewport, snap; and outcodes against the clip planes.

use nephroid_math::lanes::Lanes;

use crate::api::rules::{ClipVolume, RasterRules, ViewportArithmetic};
use crate::api::state::{PixelRect, Viewport};
use crate::primitive::window::{GUARD_PX, HALF, ONE, WindowVertex, outside};

/// Margin inside the guard band that vertices keep free: half the greatest line width, and a pixel for rounding.
const GUARD_MARGIN_PX: f32 = 513.0;

/// Snapped coordinates of vertices that clipping made are clamped to ± this, because rounding near `w = 0` may move them anywhere.
const LIMIT: i32 = GUARD_PX as i32 * ONE;

/// Least `w` for the perspective divide. Primitives are clipped to the plane `w = MIN_W`.
pub(crate) const MIN_W: f32 = 1.0 / 16_777_216.0;

/// Vertices in framebuffer coordinates, before snapping.
pub(crate) struct WindowLanes<L> {
    /// x and y in whole units of the sub-pixel grid.
    pub units: [L; 2],
    /// x and y in pixels.
    pub pixels: [L; 2],
    pub z: L,
    pub inv_w: L,
}

/// A draw's viewport and rules, in the form that the transform needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewTransform {
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

    /// The pixels that a draw may change. With the guard band this is the viewport, because primitives are not clipped to it; otherwise all pixels.
    pub fn pixels(&self) -> PixelRect {
        if self.rules.clip_volume == ClipVolume::Frustum {
            return PixelRect::full(u32::MAX, u32::MAX);
        }
        // Pixels whose centres are in the half-open viewport. The casts saturate.
        let first = |axis: usize| (self.translate[axis] - self.scale[axis].abs() - 0.5).ceil() as u32;
        let end = |axis: usize| (self.translate[axis] + self.scale[axis].abs() - 0.5).ceil() as u32;
        PixelRect { x0: first(0), y0: first(1), x1: end(0), y1: end(1) }
    }

    /// Outcode bits of the planes that primitives are clipped against geometrically.
    pub fn clip_mask(&self) -> u8 {
        match self.rules.clip_volume {
            ClipVolume::GuardBand => outside::NEAR | outside::FAR | outside::GUARD,
            ClipVolume::Frustum => outside::FRUSTUM | outside::GUARD,
        }
    }

    /// Outcode bits of the planes behind which a point is dropped. Side planes are not among them: the square of a centre slightly outside may reach
    /// inside.
    pub fn point_clip_mask(&self) -> u8 {
        outside::NEAR | outside::FAR | outside::GUARD
    }

    /// Outcodes of clip-space positions: one bit for each plane that a position is outside of.
    #[inline(always)]
    pub fn outside<L: Lanes>(&self, [x, y, z, w]: [L; 4]) -> [(L::Mask, u8); 8] {
        let (zero, most) = (x.like(0.0), x.like(f32::MAX));
        // The comparison is written so that NaN is outside.
        let finite = x.abs().le(most) & y.abs().le(most) & z.abs().le(most) & w.abs().le(most);
        let guard = w.lt(x.like(MIN_W)) | x.abs().gt(w * self.guard[0]) | y.abs().gt(w * self.guard[1]);
        let clips_depth = if self.depth_clip { zero.equals(zero) } else { zero.lt(zero) };
        [
            (x.lt(-w), outside::LEFT),
            (x.gt(w), outside::RIGHT),
            (y.lt(-w), outside::BOTTOM),
            (y.gt(w), outside::TOP),
            (z.lt(zero) & clips_depth, outside::NEAR),
            (z.gt(w) & clips_depth, outside::FAR),
            (guard, outside::GUARD),
            (!finite, outside::NAN),
        ]
    }

    /// Scale of the guard band in x and y, clip space: outside where `|x| > guard·w`.
    pub fn guard(&self) -> [f32; 2] {
        self.guard
    }

    /// Divides and applies the viewport. `made_by_clipping`: under the llvmpipe rules such vertices are rounded in another way.
    #[inline(always)]
    pub fn window<L: Lanes>(&self, [x, y, z, w]: [L; 4], made_by_clipping: bool) -> WindowLanes<L> {
        let inv_w = x.like(1.0) / w;
        let fused = self.rules.viewport == ViewportArithmetic::Fused && !made_by_clipping;
        let [(px, ux), (py, uy)] = [self.axis(x * inv_w, 0, fused), self.axis(y * inv_w, 1, fused)];
        let z = (z * inv_w) * self.depth_scale + if self.depth_scale >= 0.0 { self.depth_range.0 } else { self.depth_range.1 };
        WindowLanes { units: [ux, uy], pixels: [px, py], z, inv_w }
    }

    /// A normalized coordinate in pixels, and in whole units of the sub-pixel grid from [`Self::grid_origin`] on.
    #[inline(always)]
    fn axis<L: Lanes>(&self, n: L, axis: usize, fused: bool) -> (L, L) {
        let (scale, translate) = (self.scale[axis], self.translate[axis]);
        let pixels = if fused { n.map(|n| n.mul_add(scale, translate)) } else { n * scale + translate };
        let units = f32::from(1u16 << self.rules.subpixel_bits);
        let snapped = if self.rules.viewport == ViewportArithmetic::Prescaled {
            n * (units * scale) + (units * translate - units * 0.5)
        } else {
            pixels * units
        };
        (pixels, snapped.round_ties_even())
    }

    /// Size of a unit of the sub-pixel grid, in 1/256 pixel.
    #[inline(always)]
    pub fn grid_unit(&self) -> i32 {
        ONE >> self.rules.subpixel_bits
    }

    /// Origin of the sub-pixel grid, in 1/256 pixel.
    #[inline(always)]
    pub fn grid_origin(&self) -> i32 {
        if self.rules.viewport == ViewportArithmetic::Prescaled { HALF } else { 0 }
    }

    /// Framebuffer coordinates of a vertex that clipping made.
    pub fn clipped_vertex(&self, position: [f32; 4]) -> WindowVertex {
        let window = self.window(position, true);
        // The casts saturate.
        let fixed =
            window.units.map(|u| (u as i32).saturating_mul(self.grid_unit()).saturating_add(self.grid_origin()).clamp(-LIMIT, LIMIT));
        WindowVertex { fx: fixed[0], fy: fixed[1], x: window.pixels[0], y: window.pixels[1], z: window.z, inv_w: window.inv_w }
    }
}
