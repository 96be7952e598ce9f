//! Rays and what they meet.

use glam::Vec3;

use super::{Aabb, Plane};

/// The points `origin + t · direction`, `t ≥ 0`.
///
/// `t` is in metres if the direction is a unit vector; nothing here needs it to be one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start, in metres.
    pub origin: Vec3,
    /// Direction of travel.
    pub direction: Vec3,
}

/// Where a ray meets a triangle `a, b, c`: `p = origin + t · direction = (1 − u − v) a + u b + v c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleHit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric weight of `b`.
    pub u: f32,
    /// Barycentric weight of `c`.
    pub v: f32,
}

impl Ray {
    /// The point at parameter `t`.
    #[must_use]
    pub fn at(self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }

    /// Parameter at which the ray meets a plane; `None` if it runs alongside or away from it.
    #[must_use]
    pub fn meet_plane(self, plane: Plane) -> Option<f32> {
        let t = -plane.signed_distance(self.origin) / plane.normal.dot(self.direction);
        (t >= 0.0 && t.is_finite()).then_some(t)
    }

    /// Range `(t_in, t_out)` of parameters inside a box, `t_in ≥ 0`; `None` if it is missed (slab test, Kay and Kajiya 1986).
    ///
    /// A ray that runs in a face of the box is inside it.
    #[must_use]
    pub fn meet_aabb(self, aabb: Aabb) -> Option<(f32, f32)> {
        let (mut t_in, mut t_out) = (0.0_f32, f32::INFINITY);
        for axis in 0..3 {
            let (o, d) = (self.origin[axis], self.direction[axis]);
            let (low, high) = (aabb.min[axis], aabb.max[axis]);
            if d == 0.0 {
                // No division: 0 · ∞ would be NaN on the faces.
                if o < low || o > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - o) / d, (high - o) / d);
            t_in = t_in.max(a.min(b));
            t_out = t_out.min(a.max(b));
        }
        (t_in <= t_out && !aabb.is_empty()).then_some((t_in, t_out))
    }

    /// Range of parameters inside a sphere, `t_in ≥ 0`; `None` if it is missed.
    ///
    /// Solves `|o + t d − c|² = r²` with the discriminant measured from the point of closest approach, which keeps its digits when
    /// the sphere is far away [Haines et al., Ray Tracing Gems ch. 7, 2019].
    #[must_use]
    pub fn meet_sphere(self, center: Vec3, radius_m: f32) -> Option<(f32, f32)> {
        let to_center = center - self.origin;
        let dd = self.direction.length_squared();
        let t_closest = to_center.dot(self.direction) / dd;
        let miss = to_center - self.direction * t_closest;
        let quarter = (radius_m * radius_m - miss.length_squared()) / dd;
        // NaN where it is missed or the direction is zero: every comparison below fails.
        let half = quarter.sqrt();
        (t_closest + half >= 0.0).then(|| ((t_closest - half).max(0.0), t_closest + half))
    }

    /// Where the ray meets a triangle, from either side; `None` if it misses or the triangle is degenerate (Möller and Trumbore 1997).
    #[must_use]
    pub fn meet_triangle(self, [a, b, c]: [Vec3; 3]) -> Option<TriangleHit> {
        let (ab, ac) = (b - a, c - a);
        let p = self.direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let s = self.origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(ab);
        let v = self.direction.dot(q) * inverse;
        let t = ac.dot(q) * inverse;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(TriangleHit { t, u, v })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOWN: Ray = Ray { origin: Vec3::new(0.25, 5.0, 0.25), direction: Vec3::NEG_Y };

    #[test]
    fn plane_in_front_and_behind() {
        let floor = Plane::from_point_normal(Vec3::ZERO, Vec3::Y);
        assert_eq!(DOWN.meet_plane(floor), Some(5.0));
        assert_eq!(Ray { direction: Vec3::Y, ..DOWN }.meet_plane(floor), None);
        assert_eq!(Ray { direction: Vec3::X, ..DOWN }.meet_plane(floor), None);
    }

    #[test]
    fn box_from_outside_inside_and_along_a_face() {
        let unit = Aabb::from_corners(Vec3::ZERO, Vec3::ONE);
        assert_eq!(DOWN.meet_aabb(unit), Some((4.0, 5.0)));
        assert_eq!(Ray { origin: Vec3::splat(0.5), direction: Vec3::X }.meet_aabb(unit), Some((0.0, 0.5)));
        assert_eq!(Ray { origin: Vec3::new(0.0, 5.0, 1.0), direction: Vec3::NEG_Y }.meet_aabb(unit), Some((4.0, 5.0)));
        assert_eq!(Ray { origin: Vec3::new(-0.1, 5.0, 1.0), direction: Vec3::NEG_Y }.meet_aabb(unit), None);
        assert_eq!(Ray { direction: Vec3::Y, ..DOWN }.meet_aabb(unit), None);
        assert_eq!(DOWN.meet_aabb(Aabb::EMPTY), None);
    }

    #[test]
    fn sphere_far_away_keeps_its_digits() {
        let ray = Ray { origin: Vec3::new(0.0, 0.0, 1e4), direction: Vec3::NEG_Z };
        let (t_in, t_out) = ray.meet_sphere(Vec3::ZERO, 1.0).unwrap();
        assert_eq!((t_in, t_out), (9_999.0, 10_001.0));
        assert_eq!(ray.meet_sphere(Vec3::Y * 1.001, 1.0), None);
        assert_eq!(Ray { direction: Vec3::Z, ..ray }.meet_sphere(Vec3::ZERO, 1.0), None);
        assert_eq!(Ray { origin: Vec3::ZERO, direction: Vec3::X * 2.0 }.meet_sphere(Vec3::ZERO, 1.0), Some((0.0, 0.5)));
    }

    #[test]
    fn triangle_weights_give_the_point() {
        let triangle = [Vec3::ZERO, Vec3::Z, Vec3::X];
        let hit = DOWN.meet_triangle(triangle).unwrap();
        assert_eq!(hit, TriangleHit { t: 5.0, u: 0.25, v: 0.25 });
        assert_eq!(triangle[0] * (1.0 - hit.u - hit.v) + triangle[1] * hit.u + triangle[2] * hit.v, DOWN.at(hit.t));
        assert!(Ray { origin: Vec3::new(0.6, 5.0, 0.6), ..DOWN }.meet_triangle(triangle).is_none());
        assert!(Ray { origin: Vec3::new(0.25, -5.0, 0.25), ..DOWN }.meet_triangle(triangle).is_none());
        assert!(DOWN.meet_triangle([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]).is_none());
    }
}
