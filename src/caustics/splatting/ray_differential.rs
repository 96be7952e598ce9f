//! How the ray of a photon moves and turns when its place in the light's view is moved a little: ray differentials [Igehy 1999, eq. 10 to 17].
//!
//! They are the derivative of the map of light, by both principal curvatures of each face. A lens [WD06 §4.2] is their value for light along its axis and
//! for one curvature.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::V3;

/// Change of a ray.
#[derive(Clone, Copy)]
pub struct Differential<L> {
    /// Of a point of it, m.
    pub position: V3<L>,
    /// Of its unit direction.
    pub direction: V3<L>,
}

impl<L: Lanes> Differential<L> {
    /// On the plane with this normal, along the ray.
    #[inline(always)]
    #[must_use]
    pub fn onto(self, ray: V3<L>, normal: V3<L>) -> Self {
        Self { position: self.position - ray * (self.position.dot(normal) / ray.dot(normal)), ..self }
    }

    /// Farther along the ray.
    #[inline(always)]
    #[must_use]
    pub fn transferred(self, distance: L) -> Self {
        Self { position: self.position + self.direction * distance, ..self }
    }

    /// Behind a mirror whose normal turns by `turn`.
    #[inline(always)]
    #[must_use]
    pub fn reflected(self, ray: V3<L>, normal: V3<L>, turn: V3<L>) -> Self {
        let cos = ray.dot(normal);
        let change = self.direction.dot(normal) + ray.dot(turn);
        Self { direction: self.direction - (turn * cos + normal * change) * cos.like(2.0), ..self }
    }

    /// Behind a face with this ratio of indices, n₁/n₂, whose normal, against the ray, turns by `turn`.
    #[inline(always)]
    #[must_use]
    pub fn refracted(self, ray: V3<L>, normal: V3<L>, turn: V3<L>, eta: L) -> Self {
        // The refracted ray is ηd + μn with μ = ηc − √(1 − η²(1 − c²)), c = −d·n.
        let cos = -ray.dot(normal);
        let root = (-(eta * eta * (-(cos * cos) + 1.0)) + 1.0).sqrt();
        let mu = eta * cos - root;
        let change = -(self.direction.dot(normal) + ray.dot(turn));
        let mu_change = (eta - eta * eta * cos / root) * change;
        Self { direction: self.direction * eta + turn * mu + normal * mu_change, ..self }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use nephroid_math::optics::{reflect, refract};
    use nephroid_math::vector::v3;

    use super::*;

    fn lane(v: Vec3) -> V3<f32> {
        v3(v.x, v.y, v.z)
    }

    fn vec(v: V3<f32>) -> Vec3 {
        Vec3::new(v.x, v.y, v.z)
    }

    /// Against differences of rays that meet a saddle at places a hundredth of a metre apart, from parallel light and from a lamp.
    #[test]
    fn differentials_are_what_differences_of_rays_come_to() {
        // The surface z = −(a x² + b y²)/2, seen along d from above.
        let (a, b) = (1.3_f32, -0.4_f32);
        let lamp = Vec3::new(-0.9, 0.6, 3.0);
        let at = |x: f32, y: f32| {
            let p = Vec3::new(x, y, -(a * x * x + b * y * y) * 0.5);
            (p, Vec3::new(a * x, b * y, 1.0).normalize())
        };
        let h = 1.0e-2;
        for (x, y, eta, parallel) in [(0.2, 0.3, 1.0 / 1.5, true), (-0.4, 0.1, 1.3, true), (0.1, -0.2, 0.7, false), (0.3, 0.2, 1.2, false)]
        {
            let along = |p: Vec3| if parallel { Vec3::new(0.3, -0.2, -1.0).normalize() } else { (p - lamp).normalize() };
            for (dx, dy) in [(h, 0.0), (0.0, h)] {
                let (p, n) = at(x, y);
                let ((p1, n1), (p2, n2)) = (at(x - dx * 0.5, y - dy * 0.5), at(x + dx * 0.5, y + dy * 0.5));
                let d = along(p);
                let arriving = Differential { position: lane(p2 - p1), direction: lane(along(p2) - along(p1)) };
                let turn = lane(n2 - n1);
                let distance = 1.7;
                let bent = |p: Vec3, n: Vec3| {
                    let through = vec(refract(lane(along(p)), lane(n), eta).0);
                    (p + through * distance, p + vec(reflect(lane(along(p)), lane(n))) * distance)
                };
                let ((through1, back1), (through2, back2)) = (bent(p1, n1), bent(p2, n2));
                let refracted = arriving.refracted(lane(d), lane(n), turn, eta).transferred(distance);
                let reflected = arriving.reflected(lane(d), lane(n), turn).transferred(distance);
                let (off, off_back) = ((vec(refracted.position) - (through2 - through1)), (vec(reflected.position) - (back2 - back1)));
                assert!(off.length() < 1.0e-3 * h.max((through2 - through1).length()), "{off} {eta}");
                assert!(off_back.length() < 1.0e-3 * h.max((back2 - back1).length()), "{off_back}");
                // On a plane, points lie where the rays meet it.
                let normal = Vec3::new(0.1, 0.5, -1.0).normalize();
                let ray = vec(refract(lane(d), lane(n), eta).0);
                let on = vec(refracted.onto(lane(ray), lane(normal)).position);
                assert!(on.dot(normal).abs() < 1.0e-6 && (on - vec(refracted.position)).cross(ray).length() < 1.0e-6);
            }
        }
    }
}
