//! The camera's uniform, the apparent depth of points under water, and which points those are.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V2, V3, V4, transform_point, v2, v3};
use nephroid_pipeline::TextureView;
use nephroid_pipeline::sampler::load;

/// Camera uniforms.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CameraUniform {
    /// Clip space from world space (of raised positions, see [`CameraUniform::raise`]).
    pub clip_from_world: Mat4,
    /// World space from clip space.
    pub world_from_clip: Mat4,
    /// Eye position, w = 1; for a parallel camera the direction of view, w = 0.
    pub eye_ws: Vec4,
    /// Target size in pixels and its inverse.
    pub size_px: Vec4,
    /// x: height below which points appear raised, m: that of the lowest trough. y: apparent depth over true depth. z: 1 if the eye is under water. w: 1
    /// if there is water.
    pub water: Vec4,
    /// Water extent in x and z: minimum x, minimum z, maximum x, maximum z, metres.
    pub extent: Vec4,
    /// Grid of the surface's heights: x and z of the first vertex, m; vertices per metre along x and z.
    pub grid: Vec4,
    /// x: mean water level, m. y: depth of the water, m: how far below that level the lowest receiver is, or a tenth of the water's size. z, w:
    /// least and greatest height of the surface's vertices, m.
    pub level: Vec4,
}

impl CameraUniform {
    /// The apparent position of a point under water: its depth below the lowest trough times the apparent-depth ratio.
    ///
    /// Points under a plane of water appear raised. A ray that leaves the eye at angle θᵢ from the vertical continues at θₜ in water, so depth h
    /// appears as `h·tan θₜ/tan θᵢ` (for small angles h/n). One ratio is used for the whole picture, that of the ray to the middle of the water, so
    /// the map is affine: straight edges stay straight and convex volumes convex. Callers of [`Self::project`] correct the rest by following each
    /// pixel's own ray. A ratio of 1 is the plain view.
    #[inline(always)]
    pub fn raise<L: Lanes>(&self, p_ws: V3<L>) -> V3<L> {
        let depth = p_ws.y - self.water.x;
        let raised = depth * self.water.y + self.water.x;
        v3(p_ws.x, L::select(depth.lt(depth.like(0.0)), raised, p_ws.y), p_ws.z)
    }

    /// Clip-space position at which a world-space point appears.
    #[inline(always)]
    pub fn project<L: Lanes>(&self, p_ws: V3<L>) -> V4<L> {
        transform_point(&self.clip_from_world, self.raise(p_ws))
    }

    /// Pixel coordinates (y down) of a clip-space position.
    #[inline(always)]
    pub fn pixel<L: Lanes>(&self, clip: V4<L>) -> V2<L> {
        let inv_w = clip.w.like(1.0) / clip.w;
        v2((clip.x * inv_w * 0.5 + 0.5) * self.size_px.x, (-(clip.y * inv_w) * 0.5 + 0.5) * self.size_px.y)
    }

    /// Width of a pixel at a world-space point, m.
    #[inline(always)]
    pub fn pixel_m<L: Lanes>(&self, p_ws: V3<L>) -> L {
        let m = self.clip_from_world.to_cols_array();
        let per_metre = (m[1] * m[1] + m[5] * m[5] + m[9] * m[9]).sqrt();
        let p = self.raise(p_ws);
        let w = p.x * m[3] + p.y * m[7] + p.z * m[11] + m[15];
        w * (2.0 * self.size_px.w / per_metre)
    }

    /// Unit vector from the eye towards a world-space point.
    #[inline(always)]
    pub fn view_direction<L: Lanes>(&self, p_ws: V3<L>) -> V3<L> {
        let eye = self.eye_ws;
        let to = v3(p_ws.x * eye.w - eye.x, p_ws.y * eye.w - eye.y, p_ws.z * eye.w - eye.z);
        // For a parallel camera `eye_ws` is the direction of view, so `to` is minus that direction.
        let to = if eye.w == 0.0 { -to } else { to };
        to.normalize()
    }

    /// Unit vector of the ray through a pixel (centre coordinates) in plain space.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, x_px: L, y_px: L) -> V3<L> {
        let x = x_px * (2.0 * self.size_px.z) - 1.0;
        let y = -(y_px * (2.0 * self.size_px.w)) + 1.0;
        let far = transform_point(&self.world_from_clip, v3(x, y, x.like(1.0)));
        let inv_w = far.w.like(1.0) / far.w;
        self.view_direction(v3(far.x * inv_w, far.y * inv_w, far.z * inv_w))
    }

    /// Lanes whose point is above or below the water's rectangle.
    #[inline(always)]
    fn in_extent<L: Lanes>(&self, p_ws: V3<L>) -> L::Mask {
        let e = self.extent;
        p_ws.x.ge(p_ws.x.like(e.x)) & p_ws.x.le(p_ws.x.like(e.z)) & p_ws.z.ge(p_ws.z.like(e.y)) & p_ws.z.le(p_ws.z.like(e.w))
    }

    /// Lanes whose point is beside the water's rectangle and lower than all of its surface. Light that leaves the rectangle below the surface stays in water,
    /// so this is where it may land. Lower by a thousandth of the depth, so that a deck that lies at the water's level is not.
    #[inline(always)]
    pub fn is_beside_and_lower<L: Lanes>(&self, p_ws: V3<L>) -> L::Mask {
        !self.in_extent(p_ws) & p_ws.y.lt(p_ws.x.like(self.water.x - 1.0e-3 * self.level.y))
    }

    /// Lanes whose point is in the body of water whatever the height of the surface there, and lanes for which that height matters.
    #[inline(always)]
    pub fn far_under_water<L: Lanes>(&self, p_ws: V3<L>) -> (L::Mask, L::Mask) {
        // What rounding could decide counts as near.
        let near = 1.0e-3 * self.level.y;
        let inside = self.in_extent(p_ws);
        let (below, above) = (p_ws.y.lt(p_ws.y.like(self.level.z - near)), p_ws.y.gt(p_ws.y.like(self.level.w + near)));
        (inside & below, inside & !below & !above)
    }

    /// Lanes whose point is in the body of water: inside its extent and below the surface there. `heights` is the texture of the surface's heights.
    ///
    /// Between its vertices the surface is that of the triangles of [`nephroid_scene::water::HeightField::triangle_indices`], so that the line where
    /// things become wet is the line where the water's surface is drawn.
    #[inline(always)]
    pub fn under_water<L: Lanes>(&self, heights: &TextureView<'_>, p_ws: V3<L>) -> L::Mask {
        let (zero, one) = (p_ws.x.like(0.0), p_ws.x.like(1.0));
        if self.water.w == 0.0 {
            return zero.lt(zero);
        }
        let (wet, near) = self.far_under_water(p_ws);
        if !near.any() {
            return wet;
        }
        let inside = self.in_extent(p_ws);
        let (columns, rows, _) = heights.level_size(0);
        let column = Lanes::clamp((p_ws.x - self.grid.x) * self.grid.z, 0.0, (columns - 1) as f32);
        let row = Lanes::clamp((p_ws.z - self.grid.y) * self.grid.w, 0.0, (rows - 1) as f32);
        let left = Lanes::min(column.floor(), zero.like((columns - 2) as f32));
        let top = Lanes::min(row.floor(), zero.like((rows - 2) as f32));
        let (x, z) = (column - left, row - top);
        // The triangle's corners are (0, 0) or (1, 1), and both others.
        let far = (x + z).gt(one);
        let first = L::select(far, one, zero);
        let along_x = L::select(far, one - z, x);
        let along_z = L::select(far, one - x, z);
        let base = load(heights, left + first, top + first, 0, 0).x;
        let right = load(heights, left + one, top, 0, 0).x;
        let below = load(heights, left, top + one, 0, 0).x;
        let surface = base + along_x * (right - base) + along_z * (below - base);
        inside & p_ws.y.lt(surface)
    }
}

/// Apparent over true depth for a ray that enters water of index `ior` with unit direction `direction`: `tan θₜ/tan θᵢ`.
#[must_use]
pub fn apparent_depth_ratio(direction: Vec3, ior: f32) -> f32 {
    let cos_i = direction.y.abs();
    let sin_i = (1.0 - cos_i * cos_i).max(0.0).sqrt();
    let sin_t = sin_i / ior;
    let cos_t = (1.0 - sin_t * sin_t).sqrt();
    // sin θₜ/sin θᵢ is 1/n for every angle.
    (cos_i / (ior * cos_t)).max(0.05)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn apparent_depth_vertical_is_one_over_n() {
        assert!((apparent_depth_ratio(Vec3::NEG_Y, 1.333) - 1.0 / 1.333).abs() < 1e-6);
    }

    #[test]
    fn apparent_depth_matches_tangents_at_45_degrees() {
        let d = Vec3::new(1.0, -1.0, 0.0).normalize();
        let sin_t = libm::sin(std::f64::consts::FRAC_PI_4) / 1.333;
        let tan_t = sin_t / (1.0 - sin_t * sin_t).sqrt();
        assert!((f64::from(apparent_depth_ratio(d, 1.333)) - tan_t).abs() < 1e-6);
    }
}
