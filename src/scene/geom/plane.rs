//! Planes.

use glam::{Mat4, Vec3, Vec4};

/// The plane `normal · p + offset = 0`; the positive side is the one the normal points to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Direction to the positive side; of unit length unless a constructor says otherwise.
    pub normal: Vec3,
    /// `−normal · p` for every point `p` of the plane, in metres if the normal is a unit vector.
    pub offset: f32,
}

impl Plane {
    /// The plane through a point, perpendicular to a unit normal.
    #[must_use]
    pub fn from_point_normal(point: Vec3, normal: Vec3) -> Self {
        Self { normal, offset: -normal.dot(point) }
    }

    /// The plane through three points, counter-clockwise seen from its positive side; `None` if they lie on one line.
    #[must_use]
    pub fn from_points(a: Vec3, b: Vec3, c: Vec3) -> Option<Self> {
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Self::from_point_normal(a, normal))
    }

    /// The plane `(x, y, z) · p + w = 0`, scaled to a unit normal; `None` if `(x, y, z)` is zero or not finite.
    #[must_use]
    pub fn from_coefficients(coefficients: Vec4) -> Option<Self> {
        let length = coefficients.truncate().length();
        (length > 0.0 && length.is_finite()).then(|| {
            let c = coefficients / length;
            Self { normal: c.truncate(), offset: c.w }
        })
    }

    /// Distance of a point, negative behind the plane.
    #[must_use]
    pub fn signed_distance(self, p: Vec3) -> f32 {
        self.normal.dot(p) + self.offset
    }

    /// The nearest point of the plane.
    #[must_use]
    pub fn project(self, p: Vec3) -> Vec3 {
        p - self.normal * self.signed_distance(p)
    }

    /// The mirror image of a point.
    #[must_use]
    pub fn reflect(self, p: Vec3) -> Vec3 {
        p - self.normal * (2.0 * self.signed_distance(p))
    }

    /// The same plane with its sides swapped.
    #[must_use]
    pub fn flipped(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }

    /// The image of the plane under an invertible map: `plane' = (M⁻¹)ᵀ plane`. `None` if the map is singular.
    #[must_use]
    pub fn transformed(self, to_from_self: Mat4) -> Option<Self> {
        let coefficients = to_from_self.inverse().transpose() * self.normal.extend(self.offset);
        coefficients.is_finite().then_some(())?;
        Self::from_coefficients(coefficients)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_follow_the_winding() {
        let p = Plane::from_points(Vec3::ZERO, Vec3::Z, Vec3::X).unwrap();
        assert_eq!(p.normal, Vec3::Y);
        assert_eq!(p.signed_distance(Vec3::new(3.0, 2.0, 1.0)), 2.0);
        assert_eq!(p.reflect(Vec3::new(3.0, 2.0, 1.0)), Vec3::new(3.0, -2.0, 1.0));
        assert_eq!(p.project(Vec3::new(3.0, 2.0, 1.0)), Vec3::new(3.0, 0.0, 1.0));
        assert_eq!(p.flipped().signed_distance(Vec3::Y), -1.0);
    }

    #[test]
    fn degenerate_planes_are_refused() {
        assert_eq!(Plane::from_points(Vec3::ZERO, Vec3::X, Vec3::X * 2.0), None);
        assert_eq!(Plane::from_coefficients(Vec4::W), None);
        assert_eq!(Plane::from_coefficients(Vec4::splat(f32::NAN)), None);
        assert_eq!(Plane::from_point_normal(Vec3::ZERO, Vec3::Y).transformed(Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0))), None);
    }

    #[test]
    fn transform_moves_points_and_plane_alike() {
        let m = Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)) * Mat4::from_scale(Vec3::new(2.0, 0.5, 3.0));
        let p = Plane::from_points(Vec3::X, Vec3::Y, Vec3::Z).unwrap().transformed(m).unwrap();
        for q in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert!(p.signed_distance(m.transform_point3(q)).abs() < 1e-6);
        }
        assert!((p.normal.length() - 1.0).abs() < 1e-6);
    }
}
