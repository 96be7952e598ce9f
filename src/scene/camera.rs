//! The eye: where it stands, where it looks and how it projects.
//!
//! View space is right-handed: x right, y up, the eye looks along −z. Clip space is WebGPU's: x right, y up, depth 0 at `near_m` and 1 at
//! `far_m`. The eye may stand above the water or under it.

use glam::{Mat4, Vec3};
use serde::{Deserialize, Serialize};

use nephroid_math::space;

use super::check::{At, Invalid, MAX_LENGTH_M};

/// A pinhole or parallel camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Camera {
    /// A pinhole.
    Perspective {
        /// Where the eye is, in world space, m.
        position: Vec3,
        /// The point it looks at, in world space, m; not the position itself.
        target: Vec3,
        /// Which way is up in the picture; not along the view. Default: (0, 1, 0)
        #[serde(default = "up")]
        up: Vec3,
        /// Vertical angle of view in degrees, from 1 to 170. Default: 45
        #[serde(default = "fov_deg")]
        fov_deg: f32,
        /// Distance of the near plane, m. Default: 0.1
        #[serde(default = "near_m")]
        near_m: f32,
        /// Distance of the far plane, m, above `near_m`. Default: 100
        #[serde(default = "far_m")]
        far_m: f32,
    },
    /// Parallel rays: every pixel sees along the same direction.
    Orthographic {
        /// Centre of the picture's plane, in world space, m.
        position: Vec3,
        /// A point on the central ray, in world space, m; not the position itself.
        target: Vec3,
        /// Which way is up in the picture; not along the view. Default: (0, 1, 0)
        #[serde(default = "up")]
        up: Vec3,
        /// Height of the picture in the world, m; its width follows from the image.
        height_m: f32,
        /// Distance of the near plane, m. Default: 0.1
        #[serde(default = "near_m")]
        near_m: f32,
        /// Distance of the far plane, m, above `near_m`. Default: 100
        #[serde(default = "far_m")]
        far_m: f32,
    },
}

fn up() -> Vec3 {
    Vec3::Y
}

fn fov_deg() -> f32 {
    45.0
}

fn near_m() -> f32 {
    0.1
}

fn far_m() -> f32 {
    100.0
}

impl Camera {
    /// Where the eye is, in world space, m.
    #[must_use]
    pub fn position_ws(&self) -> Vec3 {
        match *self {
            Self::Perspective { position, .. } | Self::Orthographic { position, .. } => position,
        }
    }

    /// The point the camera looks at, in world space, m.
    #[must_use]
    pub fn target_ws(&self) -> Vec3 {
        match *self {
            Self::Perspective { target, .. } | Self::Orthographic { target, .. } => target,
        }
    }

    /// Which way is up, in world space; of any length.
    #[must_use]
    pub fn up_ws(&self) -> Vec3 {
        match *self {
            Self::Perspective { up, .. } | Self::Orthographic { up, .. } => up,
        }
    }

    /// Unit vector along the central ray, in world space.
    #[must_use]
    pub fn forward_ws(&self) -> Vec3 {
        (self.target_ws() - self.position_ws()).normalize()
    }

    /// Distances of the near and far plane, m.
    #[must_use]
    pub fn depth_range_m(&self) -> (f32, f32) {
        match *self {
            Self::Perspective { near_m, far_m, .. } | Self::Orthographic { near_m, far_m, .. } => (near_m, far_m),
        }
    }

    /// Rigid transform from world space to view space; the identity for a camera that [`Scene::validate`](super::Scene::validate) refuses.
    #[must_use]
    pub fn view_from_world(&self) -> Mat4 {
        space::look_at(self.position_ws(), self.target_ws(), self.up_ws()).unwrap_or_default()
    }

    /// Projection from view space to clip space for a picture of `aspect` = width / height; see [`space::perspective`] and
    /// [`space::orthographic`]. The identity for a camera that [`Scene::validate`](super::Scene::validate) refuses.
    #[must_use]
    pub fn clip_from_view(&self, aspect: f32) -> Mat4 {
        let (near_m, far_m) = self.depth_range_m();
        let projection = match *self {
            Self::Perspective { fov_deg, .. } => space::perspective(fov_deg.to_radians(), aspect, near_m, far_m),
            Self::Orthographic { height_m, .. } => {
                let corner = Vec3::new(0.5 * height_m * aspect, 0.5 * height_m, -near_m);
                space::orthographic(Vec3::new(-corner.x, -corner.y, -far_m), corner)
            }
        };
        projection.unwrap_or_default()
    }

    /// The whole projection, `clip_from_view * view_from_world`.
    #[must_use]
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        self.clip_from_view(aspect) * self.view_from_world()
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("position").point(self.position_ws())?;
        at.field("target").point(self.target_ws())?;
        at.field("up").direction(self.up_ws())?;
        let view = self.target_ws() - self.position_ws();
        let target = self.target_ws();
        at.field("target").require(
            view.length() >= 1.0e-6,
            format!("({}, {}, {}), the camera's position", target.x, target.y, target.z),
            "another point than the position",
        )?;
        let up = self.up_ws();
        let sin_squared = view.normalize().cross(up.normalize()).length_squared();
        at.field("up").require(
            sin_squared > 1.0e-8,
            format!("({}, {}, {}), which is along the view", up.x, up.y, up.z),
            "a direction that is not along target − position",
        )?;
        match *self {
            Self::Perspective { fov_deg, .. } => at.field("fov_deg").within(fov_deg, 1.0..=170.0, "degrees")?,
            Self::Orthographic { height_m, .. } => at.field("height_m").length_m(height_m)?,
        }
        let (near_m, far_m) = self.depth_range_m();
        at.field("near_m").within(near_m, 1.0e-4..=MAX_LENGTH_M, "m")?;
        at.field("far_m").length_m(far_m)?;
        at.field("far_m").require(far_m > near_m * 1.0001, far_m, &format!("a distance above near_m = {near_m} m"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::Perspective {
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::new(1.0, 2.0, -7.0),
            up: Vec3::Y,
            fov_deg: 90.0,
            near_m: 0.5,
            far_m: 20.0,
        }
    }

    #[test]
    fn perspective_maps_the_corners_of_the_frustum_to_the_clip_volume() {
        let clip = camera().clip_from_world(2.0);
        for (depth_m, expected) in [(0.5, 0.0), (20.0, 1.0)] {
            let corner_ws = Vec3::new(1.0 + 2.0 * depth_m, 2.0 + depth_m, 3.0 - depth_m);
            let ndc = clip.project_point3(corner_ws);
            assert!(ndc.abs_diff_eq(Vec3::new(1.0, 1.0, expected), 2e-6), "{ndc}");
        }
    }

    #[test]
    fn orthographic_looking_down_maps_plus_x_right_and_minus_z_up() {
        let camera = Camera::Orthographic {
            position: Vec3::new(0.0, 5.0, 0.0),
            target: Vec3::ZERO,
            up: Vec3::NEG_Z,
            height_m: 2.0,
            near_m: 1.0,
            far_m: 9.0,
        };
        let clip = camera.clip_from_world(1.0);
        assert_eq!(clip.project_point3(Vec3::new(1.0, 4.0, -1.0)), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(clip.project_point3(Vec3::new(-1.0, -4.0, 1.0)), Vec3::new(-1.0, -1.0, 1.0));
    }

    #[test]
    fn view_is_a_rigid_transform_with_the_eye_at_the_origin() {
        let mut camera = camera();
        if let Camera::Perspective { target, up, .. } = &mut camera {
            *target = Vec3::new(-3.0, 0.4, 2.0);
            *up = Vec3::new(0.1, 3.0, 0.2);
        }
        let view = camera.view_from_world();
        assert!(view.transform_point3(camera.position_ws()).length() < 1e-6);
        assert!((view.determinant() - 1.0).abs() < 1e-6);
        assert!(view.transform_vector3(camera.forward_ws()).abs_diff_eq(Vec3::NEG_Z, 1e-6));
    }
}
