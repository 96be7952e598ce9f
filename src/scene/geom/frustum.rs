//! View volumes and culling.

use glam::{Mat4, Vec3, Vec4};

use super::{Aabb, Plane};

/// Where a body is with respect to a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Containment {
    /// No point of the body is in the volume.
    Outside,
    /// Neither could be shown: the body may cross the border.
    Crossing,
    /// Every point of the body is in the volume.
    Inside,
}

/// The volume a camera or light sees, as planes whose positive side is inside.
///
/// Tests are conservative: `Outside` and `Inside` are certain (up to rounding), `Crossing` may also be answered for a body near an
/// edge of the volume that is outside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    planes: [Plane; 6],
    count: usize,
}

impl Frustum {
    /// The world-space volume `−w ≤ x, y ≤ w`, `0 ≤ z ≤ w` of a projection.
    ///
    /// Each plane is a sum or difference of rows of the matrix [Gribb and Hartmann 2001]. A plane at infinity (the far plane of an
    /// infinite projection) has no normal and is left out.
    #[must_use]
    pub fn from_clip_from_world(clip_from_world: Mat4) -> Self {
        let [x, y, z, w]: [Vec4; 4] = std::array::from_fn(|i| clip_from_world.row(i));
        let mut frustum = Self { planes: [Plane { normal: Vec3::ZERO, offset: 0.0 }; 6], count: 0 };
        for coefficients in [w + x, w - x, w + y, w - y, z, w - z] {
            // Relative to the row: rounding leaves a far plane at infinity with a tiny normal.
            let scale = coefficients.abs().max_element();
            if coefficients.truncate().abs().max_element() <= scale * 1e-6 {
                continue;
            }
            if let Some(plane) = Plane::from_coefficients(coefficients) {
                frustum.planes[frustum.count] = plane;
                frustum.count += 1;
            }
        }
        frustum
    }

    /// The bounding planes in the order left, right, bottom, top, near, far; the last is missing for an infinite projection.
    #[must_use]
    pub fn planes(&self) -> &[Plane] {
        &self.planes[..self.count]
    }

    /// Whether the point is inside or on the border.
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        self.planes().iter().all(|plane| plane.signed_distance(p) >= 0.0)
    }

    /// Tests a box: its nearest and farthest corner against each plane. The empty box is outside.
    #[must_use]
    pub fn test_aabb(&self, aabb: Aabb) -> Containment {
        if aabb.is_empty() {
            return Containment::Outside;
        }
        let mut inside = true;
        for plane in self.planes() {
            let positive = plane.normal.cmpge(Vec3::ZERO);
            if plane.signed_distance(Vec3::select(positive, aabb.max, aabb.min)) < 0.0 {
                return Containment::Outside;
            }
            inside &= plane.signed_distance(Vec3::select(positive, aabb.min, aabb.max)) >= 0.0;
        }
        if inside { Containment::Inside } else { Containment::Crossing }
    }

    /// Tests a sphere.
    #[must_use]
    pub fn test_sphere(&self, center: Vec3, radius_m: f32) -> Containment {
        let nearest = self.planes().iter().map(|plane| plane.signed_distance(center)).fold(f32::INFINITY, f32::min);
        if nearest < -radius_m {
            Containment::Outside
        } else if nearest >= radius_m {
            Containment::Inside
        } else {
            Containment::Crossing
        }
    }

    /// The convex polygon `polygon` cut to the volume (Sutherland and Hodgman 1974); empty if nothing remains.
    #[must_use]
    pub fn clip_polygon(&self, polygon: &[Vec3]) -> Vec<Vec3> {
        let mut points = polygon.to_vec();
        for plane in self.planes() {
            let input = std::mem::take(&mut points);
            for (i, &p) in input.iter().enumerate() {
                let q = input[(i + 1) % input.len()];
                let (dp, dq) = (plane.signed_distance(p), plane.signed_distance(q));
                if dp >= 0.0 {
                    points.push(p);
                }
                if (dp >= 0.0) != (dq >= 0.0) {
                    points.push(p + (q - p) * (dp / (dp - dq)));
                }
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks along −z from the origin, 90 degrees both ways, near 1, far 10, z from 0 to 1.
    fn clip_from_view() -> Mat4 {
        let (near, far) = (1.0, 10.0);
        Mat4::from_cols(
            Vec4::X,
            Vec4::Y,
            Vec4::new(0.0, 0.0, far / (near - far), -1.0),
            Vec4::new(0.0, 0.0, near * far / (near - far), 0.0),
        )
    }

    #[test]
    fn planes_of_a_right_angled_camera() {
        let f = Frustum::from_clip_from_world(clip_from_view());
        assert_eq!(f.planes().len(), 6);
        assert!(f.contains(Vec3::new(0.0, 0.0, -5.0)) && f.contains(Vec3::new(4.9, -4.9, -5.0)));
        for outside in
            [Vec3::new(5.1, 0.0, -5.0), Vec3::new(0.0, 5.1, -5.0), Vec3::new(0.0, 0.0, -0.9), Vec3::new(0.0, 0.0, -10.1), Vec3::Z]
        {
            assert!(!f.contains(outside), "{outside}");
        }
    }

    #[test]
    fn infinite_projection_has_five_planes() {
        let clip_from_view = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, -1.0, -1.0), Vec4::new(0.0, 0.0, -1.0, 0.0));
        let f = Frustum::from_clip_from_world(clip_from_view);
        assert_eq!(f.planes().len(), 5);
        assert!(f.contains(Vec3::new(0.0, 0.0, -1e9)) && !f.contains(Vec3::new(0.0, 0.0, -0.5)));
    }

    #[test]
    fn boxes_and_spheres_agree_with_their_points() {
        let f = Frustum::from_clip_from_world(clip_from_view());
        let (mut seen_outside, mut seen_inside) = (0, 0);
        for i in 0..4000_u32 {
            let at = |k: u32| (i.wrapping_mul(2_654_435_761).rotate_left(k) & 0xffff) as f32 / 65_536.0;
            let center = Vec3::new(at(0) * 24.0 - 12.0, at(7) * 24.0 - 12.0, -at(13) * 14.0 + 1.0);
            let half = 0.1 + at(19) * 2.0;
            let b = Aabb::from_corners(center - half, center + half);
            let inside = b.corners().map(|p| f.contains(p));
            match f.test_aabb(b) {
                Containment::Outside => {
                    seen_outside += 1;
                    assert!(!inside.contains(&true) && !f.contains(center), "{b:?}");
                }
                Containment::Inside => {
                    seen_inside += 1;
                    assert!(!inside.contains(&false), "{b:?}");
                }
                Containment::Crossing => assert!(inside.contains(&false), "{b:?}"),
            }
            match f.test_sphere(center, half) {
                Containment::Outside => assert!(!f.contains(center)),
                Containment::Inside => assert!(f.contains(center + Vec3::Y * half) && f.contains(center - Vec3::X * half)),
                Containment::Crossing => {}
            }
        }
        assert!(seen_outside > 500 && seen_inside > 100, "{seen_outside} {seen_inside}");
        assert_eq!(f.test_aabb(Aabb::EMPTY), Containment::Outside);
    }

    #[test]
    fn clipped_polygon_is_the_cross_section() {
        let f = Frustum::from_clip_from_world(clip_from_view());
        let big = [Vec3::new(-50.0, -50.0, -5.0), Vec3::new(50.0, -50.0, -5.0), Vec3::new(50.0, 50.0, -5.0), Vec3::new(-50.0, 50.0, -5.0)];
        let cut = f.clip_polygon(&big);
        let b = Aabb::from_points(cut.iter().copied());
        assert!((b.min - Vec3::new(-5.0, -5.0, -5.0)).length() < 1e-4 && (b.max - Vec3::new(5.0, 5.0, -5.0)).length() < 1e-4, "{cut:?}");
        assert!(f.clip_polygon(&big.map(|p| p + Vec3::Z * 10.0)).is_empty());
    }
}
