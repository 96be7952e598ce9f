//! Things in the world: a shape, where it stands, and what it is made of.

use glam::{Mat4, Vec3};
use serde::{Deserialize, Serialize};

use nephroid_math::space;

use super::check::{At, Invalid};
use super::material::Material;
use super::shape::Shape;

/// One thing in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// What it is called in errors, captures and layers. Default: empty
    #[serde(default)]
    pub name: String,
    /// Its surface, in object space.
    pub shape: Shape,
    /// Where it stands. Default: as the shape is
    #[serde(default)]
    pub transform: Transform,
    /// What it is made of. Default: diffuse 0.5 grey
    #[serde(default)]
    pub material: Material,
}

/// From object space to world space: scaled, then turned about x, then y, then z, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Transform {
    /// Shift, m. Default: (0, 0, 0)
    pub translate: Vec3,
    /// Angles about the world's x, y and z axis, applied in this order, counter-clockwise seen from the axis' tip, degrees, from −360 to
    /// 360. Default: (0, 0, 0)
    pub rotate_deg: Vec3,
    /// Factors along the shape's own axes, of magnitude from 1e-6 to 1e6; negative mirrors. Default: (1, 1, 1)
    pub scale: Vec3,
}

impl Default for Transform {
    fn default() -> Self {
        Self { translate: Vec3::ZERO, rotate_deg: Vec3::ZERO, scale: Vec3::ONE }
    }
}

impl Transform {
    /// The whole transform, `T R_z R_y R_x S`; exact for multiples of 90°.
    #[must_use]
    pub fn world_from_object(&self) -> Mat4 {
        space::transform(self.scale, space::rotation_euler_deg(self.rotate_deg), self.translate)
    }

    /// Whether the transform turns left hands into right ones, and with them the winding of triangles.
    #[must_use]
    pub fn mirrors(&self) -> bool {
        let s = self.scale;
        (s.x < 0.0) ^ (s.y < 0.0) ^ (s.z < 0.0)
    }

    fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("translate").point(self.translate)?;
        for (index, angle) in self.rotate_deg.to_array().into_iter().enumerate() {
            at.field("rotate_deg").index(index).within(angle, -360.0..=360.0, "degrees")?;
        }
        for (index, factor) in self.scale.to_array().into_iter().enumerate() {
            let ok = (1.0e-6..=1.0e6).contains(&factor.abs());
            at.field("scale").index(index).require(ok, factor, "a number of magnitude from 1e-6 to 1e6")?;
        }
        Ok(())
    }
}

impl Object {
    /// Its name, or `object 3` for the nameless one of index 3.
    #[must_use]
    pub fn display_name(&self, index: usize) -> String {
        if self.name.is_empty() { format!("object {index}") } else { self.name.clone() }
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        self.shape.validate(&at.field("shape"))?;
        self.transform.validate(&at.field("transform"))?;
        self.material.validate(&at.field("material"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_exact_right_handed_and_in_the_stated_order() {
        let turn =
            |x, y, z, v| Transform { rotate_deg: Vec3::new(x, y, z), ..Transform::default() }.world_from_object().transform_vector3(v);
        assert_eq!(turn(90.0, 0.0, 0.0, Vec3::Y), Vec3::Z);
        assert_eq!(turn(0.0, 90.0, 0.0, Vec3::Z), Vec3::X);
        assert_eq!(turn(0.0, 0.0, 90.0, Vec3::X), Vec3::Y);
        // First about x: y becomes z; then about y: z becomes x.
        assert_eq!(turn(90.0, 90.0, 0.0, Vec3::Y), Vec3::X);
    }

    #[test]
    fn world_from_object_scales_then_turns_then_moves() {
        let transform =
            Transform { translate: Vec3::new(10.0, 0.0, 0.0), rotate_deg: Vec3::new(0.0, 0.0, 90.0), scale: Vec3::new(2.0, 3.0, 1.0) };
        assert_eq!(transform.world_from_object().transform_point3(Vec3::new(1.0, 1.0, 1.0)), Vec3::new(7.0, 2.0, 1.0));
        assert!(!transform.mirrors());
        assert!(Transform { scale: Vec3::new(-1.0, -1.0, -1.0), ..Transform::default() }.mirrors());
        assert!(!Transform { scale: Vec3::new(-1.0, -1.0, 1.0), ..Transform::default() }.mirrors());
    }
}
