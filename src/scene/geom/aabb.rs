//! Axis-aligned boxes.

use glam::{Mat4, Vec3};

/// An axis-aligned box, `min ≤ p ≤ max` on every axis, both ends included.
///
/// Empty where `min > max` on any axis; [`Aabb::EMPTY`] is the neutral element of [`Aabb::union`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box without points.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box of two opposite corners, in any order.
    #[must_use]
    pub fn from_corners(a: Vec3, b: Vec3) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// The smallest box around points; [`Self::EMPTY`] around none. NaN coordinates are ignored.
    #[must_use]
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::including)
    }

    /// The smallest box around this one and a point.
    #[must_use]
    pub fn including(self, p: Vec3) -> Self {
        // Comparisons, not `min` and `max`: those differ between machines when a coordinate is NaN.
        Self { min: Vec3::select(p.cmplt(self.min), p, self.min), max: Vec3::select(p.cmpgt(self.max), p, self.max) }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The points in both; possibly empty.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// The box grown by `margin_m` on every side (shrunk if negative).
    #[must_use]
    pub fn expanded(self, margin_m: f32) -> Self {
        Self { min: self.min - margin_m, max: self.max + margin_m }
    }

    /// Whether no point is inside.
    #[must_use]
    pub fn is_empty(self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether the point is inside or on the border.
    #[must_use]
    pub fn contains(self, p: Vec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Whether the boxes share a point; touching counts.
    #[must_use]
    pub fn intersects(self, other: Self) -> bool {
        !self.intersection(other).is_empty()
    }

    /// The midpoint; NaN for [`Self::EMPTY`].
    #[must_use]
    pub fn center(self) -> Vec3 {
        // Halved first: the sum of two large coordinates may overflow.
        self.min * 0.5 + self.max * 0.5
    }

    /// The lengths of the sides in metres; zero if empty.
    #[must_use]
    pub fn size(self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Area of the six faces in m²; zero if empty.
    #[must_use]
    pub fn surface_area(self) -> f32 {
        let s = self.size();
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }

    /// The eight corners; bit 0, 1 and 2 of the index choose `max` for x, y and z.
    #[must_use]
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
            Vec3::new(pick(0, self.min.x, self.max.x), pick(1, self.min.y, self.max.y), pick(2, self.min.z, self.max.z))
        })
    }

    /// The smallest box around the image of this one under an affine map.
    #[must_use]
    pub fn transformed(self, to_from_self: Mat4) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        Self::from_points(self.corners().map(|p| to_from_self.transform_point3(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_is_neutral() {
        let a = Aabb::from_corners(Vec3::new(1.0, -2.0, 3.0), Vec3::new(-1.0, 2.0, 5.0));
        assert_eq!(a.union(Aabb::EMPTY), a);
        assert!(Aabb::EMPTY.is_empty() && !a.is_empty());
        assert!(!Aabb::EMPTY.intersects(a));
        assert_eq!(Aabb::from_points([]), Aabb::EMPTY);
        assert_eq!(Aabb::EMPTY.surface_area(), 0.0);
        assert_eq!(Aabb::EMPTY.transformed(Mat4::IDENTITY), Aabb::EMPTY);
    }

    #[test]
    fn measures_of_a_known_box() {
        let a = Aabb::from_points([Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.5, f32::NAN, 0.5)]);
        assert_eq!(a.size(), Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(a.surface_area(), 22.0);
        assert_eq!(a.center(), Vec3::new(0.5, 1.0, 1.5));
        assert_eq!(a.corners()[5], Vec3::new(1.0, 0.0, 3.0));
        assert!(a.contains(Vec3::new(1.0, 2.0, 3.0)) && !a.contains(Vec3::new(1.0, 2.1, 3.0)));
    }

    #[test]
    fn touching_boxes_intersect() {
        let a = Aabb::from_corners(Vec3::ZERO, Vec3::ONE);
        assert!(a.intersects(Aabb::from_corners(Vec3::ONE, Vec3::splat(2.0))));
        assert!(!a.intersects(Aabb::from_corners(Vec3::splat(1.01), Vec3::splat(2.0))));
    }

    #[test]
    fn transform_mirrors_and_moves() {
        let a = Aabb::from_corners(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0));
        let m = Mat4::from_translation(Vec3::X) * Mat4::from_scale(Vec3::new(-2.0, 1.0, 1.0));
        assert_eq!(a.transformed(m), Aabb { min: Vec3::new(-1.0, 0.0, 0.0), max: Vec3::new(1.0, 2.0, 3.0) });
    }
}
