//! Views of a light: a box for parallel light, a pyramid for a point light; given, or fitted to what they must hold.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::space::{look_to, orthographic, perspective};
use nephroid_math::vector::{V2, V3, transform_point, v2};
use nephroid_pipeline::MAX_SIZE;
use nephroid_scene::Light;
use nephroid_scene::geom::Aabb;

use super::shadow_map::LightUniform;

/// Share of its size by which a fitted view is larger than what it holds, on each side, so that rounding leaves nothing out.
const SLACK: f32 = 1.0e-4;

/// Largest tangent of half the opening of a fitted view.
const MOST_TANGENT: f32 = 8.0;

/// The view of a point light: a pyramid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pyramid {
    /// Position of the light, m.
    pub position_ws: Vec3,
    /// Axis of the view, of any length above 0.
    pub axis_ws: Vec3,
    /// Up direction of the view; must not be parallel to the axis.
    pub up_ws: Vec3,
    /// Vertical opening angle, in `(0, π)`.
    pub fov_y_rad: f32,
    /// Width over height, above 0.
    pub aspect: f32,
    /// Distance of the near plane along the axis, m, above 0.
    pub near_m: f32,
    /// Distance of the far plane, m, above `near_m`; may be infinite.
    pub far_m: f32,
}

/// Least distance of the near plane of a point light from which occluders are drawn, over the distance of the box that is viewed.
const LEAST_NEAR: f32 = 1.0e-3;

/// Uniform of a light's view.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightView {
    /// Clip space from world space.
    pub clip_from_world: Mat4,
    /// Position, m, with w = 1; for parallel light the unit direction of travel, with w = 0.
    pub position_ws: Vec4,
}

impl LightView {
    /// Parallel light: the view is the box `min_ls..max_ls` in light space, m. Light space has its origin at that of world space, looks along −z and
    /// has `up_ws` up.
    ///
    /// `None` if the direction is parallel to `up_ws` or the box is empty.
    #[must_use]
    pub fn parallel(direction_ws: Vec3, up_ws: Vec3, min_ls: Vec3, max_ls: Vec3) -> Option<Self> {
        let clip_from_world = orthographic(min_ls, max_ls)? * look_to(Vec3::ZERO, direction_ws, up_ws)?;
        Some(Self { clip_from_world, position_ws: direction_ws.normalize().extend(0.0) })
    }

    /// A point light. `None` if the axis is parallel to `up_ws` or the pyramid is empty.
    #[must_use]
    pub fn point(p: &Pyramid) -> Option<Self> {
        let clip_from_view = perspective(p.fov_y_rad, p.aspect, p.near_m, p.far_m)?;
        let clip_from_world = clip_from_view * look_to(p.position_ws, p.axis_ws, p.up_ws)?;
        Some(Self { clip_from_world, position_ws: p.position_ws.extend(1.0) })
    }

    /// Unit vector along which light travels when it reaches a point.
    #[inline(always)]
    pub fn direction_at<L: Lanes>(&self, p_ws: V3<L>) -> V3<L> {
        let light = V3::splat(p_ws.x.token(), self.position_ws.truncate());
        if self.position_ws.w == 0.0 { light } else { (p_ws - light).normalize() }
    }
}

/// The view of the shadow map of straight rays, where that is one view.
impl From<&LightUniform> for LightView {
    fn from(light: &LightUniform) -> Self {
        Self { clip_from_world: light.clip_from_world, position_ws: light.position_ws }
    }
}

/// The smallest view of a light that holds a box, or points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedView {
    /// The view.
    pub view: LightView,
    /// Unit vector along its axis.
    pub axis_ws: Vec3,
    /// Width and height: m for parallel light, on the plane at distance 1 along the axis for a point light.
    pub extent: Vec2,
}

impl FittedView {
    /// Parallel light looks along its direction; a point light, and a spot whatever its cone, looks at the middle of the box.
    ///
    /// `None` if the box is empty, or if a point light is inside of it or so near that the view would open by more than some 165 degrees.
    #[must_use]
    pub fn new(light: &Light, bounds: Aabb) -> Option<Self> {
        if bounds.is_empty() { None } else { Self::of_points(light, &bounds.corners(), Aabb::EMPTY) }
    }

    /// The smallest view that holds points, which may be less than that of their box; with a near plane so near to the light that what is in
    /// `occluders`, if that is not empty, hides them.
    #[must_use]
    pub fn of_points(light: &Light, points: &[Vec3], occluders: Aabb) -> Option<Self> {
        let bounds = Aabb::from_points(points.iter().copied());
        if bounds.is_empty() {
            return None;
        }
        let axis_ws = light.incident(bounds.center()).direction_ws.try_normalize()?;
        let up_ws = if axis_ws.y.abs() > 0.9 { Vec3::X } else { Vec3::Y };
        match *light {
            Light::Directional { .. } => {
                let light_from_world = look_to(Vec3::ZERO, axis_ws, up_ws)?;
                let seen = Aabb::from_points(points.iter().map(|&p| light_from_world.transform_point3(p)));
                let seen = seen.expanded((seen.size().max_element() * SLACK).max(f32::MIN_POSITIVE));
                let (min_ls, mut max_ls) = (seen.center() - seen.size() * 0.5, seen.center() + seen.size() * 0.5);
                if !occluders.is_empty() {
                    max_ls.z = max_ls.z.max(occluders.transformed(light_from_world).max.z);
                }
                let view = LightView::parallel(axis_ws, up_ws, min_ls, max_ls)?;
                Some(Self { view, axis_ws, extent: (max_ls - min_ls).truncate() })
            }
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                let view_from_world = look_to(position, axis_ws, up_ws)?;
                let seen: Vec<Vec3> = points.iter().map(|&p| view_from_world.transform_point3(p)).collect();
                let near_m = seen.iter().fold(f32::INFINITY, |near, p| near.min(-p.z));
                let far_m = seen.iter().fold(0.0, |far: f32, p| far.max(-p.z));
                let tangent = |side: fn(Vec3) -> f32| seen.iter().fold(0.0, |most: f32, &p| most.max(side(p).abs() / -p.z)) * (1.0 + SLACK);
                let half = Vec2::new(tangent(|p| p.x), tangent(|p| p.y)).max(Vec2::splat(SLACK));
                // Written so that NaN gives no view.
                if !(near_m > 0.0 && half.max_element() <= MOST_TANGENT) {
                    return None;
                }
                let occluders = if occluders.is_empty() { Vec::new() } else { occluders.corners().to_vec() };
                let nearest = occluders.iter().fold(near_m, |near, &p| near.min(-view_from_world.transform_point3(p).z));
                let near_m = nearest.max(near_m * LEAST_NEAR);
                let pyramid = Pyramid {
                    position_ws: position,
                    axis_ws,
                    up_ws,
                    fov_y_rad: 2.0 * libm::atanf(half.y),
                    aspect: half.x / half.y,
                    near_m: near_m * (1.0 - 10.0 * SLACK),
                    far_m: far_m * (1.0 + 10.0 * SLACK),
                };
                Some(Self { view: LightView::point(&pyramid)?, axis_ws, extent: half * 2.0 })
            }
        }
    }

    /// The sides of a cube around a lamp that see any of the points or lie in the direction `towards`, in the order +x, −x, +y, −y, +z, −z: for what is
    /// too wide for one view. `Self::of_points` has the meaning of the near plane.
    #[must_use]
    pub fn sides_around(position_ws: Vec3, points: &[Vec3], towards: Vec3) -> Vec<Self> {
        let side_of = |v: Vec3| {
            let axis = v.abs().max_position();
            2 * axis + usize::from(v[axis] < 0.0)
        };
        let mut farthest = [0.0_f32; 6];
        for to in points.iter().map(|&p| p - position_ws) {
            let far = &mut farthest[side_of(to)];
            *far = far.max(to.abs().max_element());
        }
        let most = farthest.iter().copied().fold(0.0, f32::max);
        let seen = |side: usize| farthest[side] > 0.0 || side == side_of(towards);
        let view = |side: usize| {
            let axis_ws = Vec3::AXES[side / 2] * if side.is_multiple_of(2) { 1.0 } else { -1.0 };
            let up_ws = if side / 2 == 1 { Vec3::X } else { Vec3::Y };
            let (near_m, far_m) = (most * LEAST_NEAR * 0.1, most * (1.0 + 10.0 * SLACK));
            let pyramid = Pyramid { position_ws, axis_ws, up_ws, fov_y_rad: std::f32::consts::FRAC_PI_2, aspect: 1.0, near_m, far_m };
            Some(Self { view: LightView::point(&pyramid)?, axis_ws, extent: Vec2::splat(2.0) })
        };
        (0..6).filter(|&side| seen(side)).filter_map(view).collect()
    }

    /// Whether the light is a point, so that the view is a pyramid.
    #[must_use]
    pub fn is_point(&self) -> bool {
        self.view.position_ws.w != 0.0
    }

    /// Width and height of about `side²` texels that are about square; neither is larger than a texture may be.
    #[must_use]
    pub fn square_texels(&self, side: u32) -> (u32, u32) {
        let longer = f64::from(self.extent.x / self.extent.y).sqrt().clamp(0.25, 4.0);
        let round = |length: f64| ((f64::from(side) * length).round() as u32).clamp(1, MAX_SIZE);
        (round(longer), round(1.0 / longer))
    }
}

/// A fitted view of so many texels, as a uniform.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TexelView {
    /// The view.
    pub view: LightView,
    /// x, y, z: unit vector along the axis. w: area of a texel, m² across parallel light; for a point light on the plane at distance 1, where the
    /// texel's solid angle is this area times the cube of the cosine between its ray and the axis.
    pub axis_ws: Vec4,
    /// Width and height in texels, and their inverses.
    pub size_tx: Vec4,
}

impl TexelView {
    /// A view of `size` texels.
    #[must_use]
    pub fn new(fitted: &FittedView, (width, height): (u32, u32)) -> Self {
        let size = Vec2::new(width as f32, height as f32);
        let texel = fitted.extent / size;
        Self {
            view: fitted.view,
            axis_ws: fitted.axis_ws.extend(texel.x * texel.y),
            size_tx: Vec4::new(size.x, size.y, 1.0 / size.x, 1.0 / size.y),
        }
    }

    /// The view with its texels shifted by up to half of one along both sides, by another part for each number: members 0, 1, .. of a sequence that
    /// fills the texel evenly (M. Roberts 2018, R₂).
    #[must_use]
    pub fn shifted(&self, number: u64) -> Self {
        let part = |step: f64| {
            let at = (number % 65_536) as f64 * step;
            at - at.floor() - 0.5
        };
        let (x, y) = (part(0.754_877_666_246_692_8), part(0.569_840_290_998_053_3));
        let ndc = Vec3::new(2.0 * x as f32 * self.size_tx.z, 2.0 * y as f32 * self.size_tx.w, 0.0);
        let view = LightView { clip_from_world: Mat4::from_translation(ndc) * self.view.clip_from_world, ..self.view };
        Self { view, ..*self }
    }

    /// Area across the light's ray to a point that a texel covers there, m².
    #[inline(always)]
    pub fn area_at<L: Lanes>(&self, p_ws: V3<L>) -> L {
        let area = self.axis_ws.w;
        if self.view.position_ws.w == 0.0 {
            return p_ws.x.like(area);
        }
        // ω·r² = a·cos³θ·r² = a·z³/r, with z = r·cos θ.
        let to = p_ws - V3::splat(p_ws.x.token(), self.view.position_ws.truncate());
        let along = to.dot(V3::splat(p_ws.x.token(), self.axis_ws.truncate()));
        along * along * along * area / to.length()
    }

    /// How far a point moves across the view's axis with one texel along x and along y, m.
    #[inline(always)]
    pub fn steps_at<L: Lanes>(&self, p_ws: V3<L>) -> [V3<L>; 2] {
        let m = &self.view.clip_from_world;
        let token = p_ws.x.token();
        let (x, y) = (V3::splat(token, m.row(0).truncate()), V3::splat(token, m.row(1).truncate()));
        // Clip space moves by the product of the row and the step, and its w stays.
        let w = transform_point(m, p_ws).w;
        [x * (w * (2.0 * self.size_tx.z) / x.dot(x)), y * (w * (-2.0 * self.size_tx.w) / y.dot(y))]
    }

    /// Texel coordinates (y down) of a point; infinite or NaN in the plane of a point light.
    #[inline(always)]
    pub fn texel_at<L: Lanes>(&self, p_ws: V3<L>) -> V2<L> {
        let clip = transform_point(&self.view.clip_from_world, p_ws);
        let inv_w = clip.w.like(1.0) / clip.w;
        v2((clip.x * inv_w * 0.5 + 0.5) * self.size_tx.x, (-(clip.y * inv_w) * 0.5 + 0.5) * self.size_tx.y)
    }
}

#[cfg(test)]
mod tests {
    use nephroid_math::vector::v3;
    use nephroid_scene::Aim;

    use super::*;

    fn sun(along: Vec3) -> Light {
        Light::Directional { aim: Aim::Along(along), irradiance: Vec3::ONE }
    }

    fn lamp(position: Vec3) -> Light {
        Light::Point { position, intensity: Vec3::ONE }
    }

    fn boxes() -> [Aabb; 3] {
        [
            Aabb::from_corners(Vec3::new(-1.0, 0.0, -2.0), Vec3::new(1.0, 0.5, 3.0)),
            Aabb::from_corners(Vec3::new(40.0, 7.0, -60.0), Vec3::new(40.1, 7.4, -59.8)),
            // A floor: one side is zero.
            Aabb::from_corners(Vec3::new(-6.0, 0.0, -6.0), Vec3::new(6.0, 0.0, 6.0)),
        ]
    }

    fn lights() -> Vec<Light> {
        let suns = [Vec3::NEG_Y, Vec3::X, Vec3::new(0.3, -1.0, 0.2), Vec3::new(-0.5, 0.7, 0.1)].map(sun);
        suns.into_iter().chain([Vec3::new(0.0, 9.0, 0.0), Vec3::new(-20.0, 4.0, 3.0), Vec3::new(90.0, -30.0, 5.0)].map(lamp)).collect()
    }

    #[test]
    fn a_fitted_view_holds_its_box_and_little_more() {
        for light in lights() {
            for bounds in boxes() {
                let fitted = FittedView::new(&light, bounds).expect("a view");
                let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
                for corner in bounds.corners() {
                    let clip = fitted.view.clip_from_world * corner.extend(1.0);
                    let ndc = clip.truncate() / clip.w;
                    assert!(ndc.truncate().abs().max_element() <= 1.0 && (0.0..=1.0).contains(&ndc.z), "{light:?} {bounds:?}: {ndc}");
                    (least, most) = (least.min(ndc), most.max(ndc));
                }
                // Each side of the view is touched, but for a side of no extent.
                let touched = most.truncate().max(-least.truncate());
                assert!(touched.min_element() > 0.98 || bounds.size().min_element() == 0.0, "{light:?} {bounds:?}: {least} {most}");
            }
        }
    }

    /// The solid angle of a pyramid with tangents a and b of half its openings is 4·asin(ab/√((1+a²)(1+b²))); the area of a box is that of its face.
    #[test]
    fn texels_add_up_to_the_view() {
        for light in lights() {
            let fitted = FittedView::new(&light, boxes()[0]).expect("a view");
            let size = (96, 64);
            let texels = TexelView::new(&fitted, size);
            let world_from_clip = fitted.view.clip_from_world.inverse();
            let mut sum = 0.0;
            for y in 0..size.1 {
                for x in 0..size.0 {
                    let ndc = Vec3::new((x as f32 + 0.5) / 48.0 - 1.0, (y as f32 + 0.5) / 32.0 - 1.0, 0.5);
                    let p = world_from_clip.project_point3(ndc);
                    let p = v3(p.x, p.y, p.z);
                    let (across, at) = (texels.area_at(p), texels.texel_at(p));
                    // Rows count downwards, heights upwards.
                    let row = (size.1 - 1 - y) as f32;
                    assert!((at.x - x as f32 - 0.5).abs().max((at.y - row - 0.5).abs()) < 0.01, "{light:?}: {x} {y} {at:?}");
                    for (step, along) in texels.steps_at(p).into_iter().zip([(1.0, 0.0), (0.0, 1.0)]) {
                        let next = texels.texel_at(p + step);
                        let off = (next.x - at.x - along.0).abs().max((next.y - at.y - along.1).abs());
                        assert!(off < 0.01, "{light:?}: {x} {y} {next:?}");
                    }
                    let to = Vec3::new(p.x, p.y, p.z) - fitted.view.position_ws.truncate();
                    let squared = if fitted.is_point() { to.length_squared() } else { 1.0 };
                    sum += f64::from(across / squared);
                }
            }
            let [a, b] = (fitted.extent * 0.5).as_dvec2().to_array();
            let pyramid = 4.0 * libm::asin(a * b / ((1.0 + a * a) * (1.0 + b * b)).sqrt());
            let expected = if fitted.is_point() { pyramid } else { 4.0 * a * b };
            assert!((sum / expected - 1.0).abs() < 1.0e-3, "{light:?}: {sum} {expected}");
        }
    }

    #[test]
    fn a_light_inside_of_the_box_and_an_empty_box_have_no_view() {
        let bounds = boxes()[0];
        for position in [Vec3::new(0.0, 0.2, 0.0), Vec3::new(0.0, 0.51, 0.0), Vec3::new(0.9, 0.1, 2.9)] {
            assert_eq!(FittedView::new(&lamp(position), bounds), None, "{position}");
        }
        assert_eq!(FittedView::new(&sun(Vec3::NEG_Y), Aabb::EMPTY), None);
    }
}
