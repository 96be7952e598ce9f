//! A plane that measures the irradiance of light that crosses it.

use glam::{DVec3, Vec3};

use nephroid_scene::MeasuringPlane;

/// Tolerance at the end of a stretch, as a share of its length or of a tenth of the plane: a plane that lies in a surface measures the light that lands there.
const REACH: f32 = 1.0e-5;

/// A [`MeasuringPlane`] in the form for intersections.
pub(super) struct Plane {
    corner: Vec3,
    normal: Vec3,
    /// Vectors whose dot products with an offset from the corner are texel coordinates.
    along_u: Vec3,
    along_v: Vec3,
    columns: f32,
    rows: f32,
    /// A tenth of its longer side, m.
    least: f32,
}

impl Plane {
    /// Prepares a plane.
    pub fn new(plane: &MeasuringPlane) -> Self {
        let (u, v) = (plane.u.as_dvec3(), plane.v.as_dvec3());
        let normal = u.cross(v);
        // The dual basis: u·along_u = columns, v·along_u = 0, and the other way around.
        let dual = |a: DVec3, b: DVec3, count: u32| (b.cross(normal) / a.dot(b.cross(normal)) * f64::from(count)).as_vec3();
        let (columns, rows) = plane.texels;
        Self {
            corner: plane.corner,
            normal: normal.normalize().as_vec3(),
            along_u: dual(u, v, columns),
            along_v: dual(v, u, rows),
            columns: columns as f32,
            rows: rows as f32,
            least: plane.u.length().max(plane.v.length()) * 0.1,
        }
    }

    /// Index of the texel whose front side a stretch of a ray crosses, and the distance to the crossing.
    pub fn crossed(&self, origin: Vec3, direction: Vec3, length: f32) -> Option<(u32, f32)> {
        let towards = direction.dot(self.normal);
        if towards >= 0.0 {
            return None;
        }
        let t = (self.corner - origin).dot(self.normal) / towards;
        let end = length + length.max(self.least) * REACH;
        if !(t > 0.0 && t <= end) {
            return None;
        }
        let offset = origin + direction * t - self.corner;
        let (u, v) = (offset.dot(self.along_u), offset.dot(self.along_v));
        let over = u >= 0.0 && u < self.columns && v >= 0.0 && v < self.rows;
        over.then(|| (v as u32 * self.columns as u32 + u as u32, t.min(length)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> Plane {
        // Facing up: z × x = y. Skewed, so that the dual basis matters.
        Plane::new(&MeasuringPlane { corner: Vec3::new(1.0, 0.0, 1.0), u: Vec3::Z * 2.0, v: Vec3::new(3.0, 0.0, 1.0), texels: (4, 3) })
    }

    #[test]
    fn texels_run_along_u_then_v() {
        let at = |column: f32, row: f32| Vec3::new(1.0, 5.0, 1.0) + Vec3::Z * (column * 0.5) + Vec3::new(1.0, 0.0, 1.0 / 3.0) * row;
        for (column, row) in [(0, 0), (3, 0), (0, 2), (2, 1)] {
            let hit = plane().crossed(at(column as f32 + 0.5, row as f32 + 0.5), Vec3::NEG_Y, 6.0);
            assert_eq!(hit, Some((row * 4 + column, 5.0)));
        }
        assert_eq!(plane().crossed(at(-0.01, 0.5), Vec3::NEG_Y, 6.0), None);
        assert_eq!(plane().crossed(at(4.01, 0.5), Vec3::NEG_Y, 6.0), None);
    }

    #[test]
    fn only_the_front_counts_and_only_within_reach() {
        let above = Vec3::new(2.0, 5.0, 2.0);
        assert!(plane().crossed(above, Vec3::NEG_Y, 5.0).is_some());
        assert!(plane().crossed(above, Vec3::NEG_Y, 4.9).is_none());
        assert!(plane().crossed(above, Vec3::Y, 9.0).is_none());
        assert!(plane().crossed(above - Vec3::Y * 10.0, Vec3::Y, 9.0).is_none());
    }
}
