//! The view of a light's map of straight rays.

use glam::{Mat4, Vec3, Vec4};

use nephroid_math::space::{look_to, orthographic, perspective};
use nephroid_scene::Light;
use nephroid_scene::geom::Aabb;

/// Half of the widest angle of one view. Texels at the edge of a wider one are more than four times as large as in its middle.
const WIDEST_RAD: f32 = std::f32::consts::FRAC_PI_3;

/// Near plane of a lamp among what it lights, as a share of the far plane.
const NEAR: f32 = 1.0e-3;

/// What a map of straight rays holds.
pub(super) enum ShadowView {
    /// One view.
    One(Mat4),
    /// The six faces of a cube around a lamp, from a near to a far plane, m.
    Cube {
        /// Distance of the near planes.
        near: f32,
        /// Distance of the far planes.
        far: f32,
    },
}

impl ShadowView {
    /// The narrowest view that holds what a light reaches of `bounds`: orthographic for parallel light; for a lamp a perspective along the spot or towards
    /// the middle of the bounds; where both are too wide, a cube.
    pub fn of(light: &Light, bounds: Aabb) -> Self {
        let centre = bounds.center();
        let radius = (bounds.size().length() * 0.5).max(f32::MIN_POSITIVE);
        let (position, spot) = match *light {
            Light::Directional { .. } => return Self::One(parallel(light.incident(centre).direction_ws, centre, radius)),
            Light::Point { position, .. } => (position, None),
            Light::Spot { position, direction, outer_deg, .. } => (position, Some((direction.normalize(), outer_deg.to_radians()))),
        };
        let to = centre - position;
        let distance = to.length();
        let far = distance + radius;
        let near = (distance - radius).max(far * NEAR);
        let around = (distance > radius).then(|| (to / distance, libm::asinf(radius / distance)));
        let narrow = around.into_iter().chain(spot).filter(|(_, half)| *half <= WIDEST_RAD);
        match narrow.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((direction, half)) => Self::One(cone(position, direction, half, [near, far])),
            None => Self::Cube { near, far },
        }
    }

    /// Clip space from world space; the identity for a cube, whose faces have views of their own.
    pub fn clip_from_world(&self) -> Mat4 {
        match *self {
            Self::One(matrix) => matrix,
            Self::Cube { .. } => Mat4::IDENTITY,
        }
    }

    /// The cube's numbers for a map that has `size` texels along a side if it is one view, see
    /// [`LightUniform::cube`](crate::passes::shadow_map::LightUniform::cube). A face covers a narrower angle than the widest view and has half as many.
    pub fn cube(&self, size: u32) -> Vec4 {
        match *self {
            Self::One(_) => Vec4::ZERO,
            Self::Cube { near, far } => {
                let scale = far / (far - near);
                Vec4::new(near, scale, scale * near, (size / 2).max(1) as f32)
            }
        }
    }
}

fn side(direction: Vec3) -> Vec3 {
    if direction.y.abs() > 0.99 { Vec3::X } else { Vec3::Y }
}

/// Parallel light around a sphere.
fn parallel(direction: Vec3, centre: Vec3, radius: f32) -> Mat4 {
    let view = look_to(centre - direction * (2.0 * radius), direction, side(direction)).unwrap_or_default();
    orthographic(Vec3::new(-radius, -radius, -3.0 * radius), Vec3::new(radius, radius, -radius)).unwrap_or_default() * view
}

/// A view from a lamp, `half` of its angle in radians to each side of `direction`.
fn cone(position: Vec3, direction: Vec3, half: f32, [near, far]: [f32; 2]) -> Mat4 {
    let view = look_to(position, direction, side(direction)).unwrap_or_default();
    // A little wider, so that filtering at the edge finds texels.
    perspective((2.02 * half).max(0.02), 1.0, near, far).unwrap_or_default() * view
}
