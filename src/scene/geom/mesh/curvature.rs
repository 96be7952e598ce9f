//! Curvature of a surface at its vertices.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};

use super::Mesh;
use super::topology::place_ids;

/// The principal curvatures at a point of a surface, in 1/m: positive where the surface bends away from its normal, as a ball does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Curvature {
    /// `κ₁`, the larger.
    pub largest_per_m: f32,
    /// `κ₂`, the smaller; perpendicular to the first.
    pub smallest_per_m: f32,
    /// Unit tangent along which the curvature is `κ₁`. Any tangent where both are equal, zero where there is no surface.
    pub direction: Vec3,
}

impl Curvature {
    /// Mean curvature `H = (κ₁ + κ₂)/2`, 1/m.
    #[must_use]
    pub fn mean_per_m(self) -> f32 {
        0.5 * (self.largest_per_m + self.smallest_per_m)
    }
}

/// A symmetric form in a tangent plane: `uu`, `uv` and `vv`.
#[derive(Clone, Copy, Default)]
struct Form {
    uu: f64,
    uv: f64,
    vv: f64,
}

impl Form {
    /// The value of the form for two vectors.
    fn of(self, a: DVec2, b: DVec2) -> f64 {
        self.uu * a.x * b.x + self.uv * (a.x * b.y + a.y * b.x) + self.vv * a.y * b.y
    }

    /// Both eigenvalues, the larger first, and a vector along the eigenvector of the larger.
    fn principal(self) -> (f64, f64, DVec2) {
        let (mean, half) = (0.5 * (self.uu + self.vv), 0.5 * (self.uu - self.vv));
        let radius = (half * half + self.uv * self.uv).sqrt();
        // Of the two ways to write the eigenvector, the one that does not cancel.
        let along = if half >= 0.0 { DVec2::new(half + radius, self.uv) } else { DVec2::new(self.uv, radius - half) };
        (mean + radius, mean - radius, if radius > 0.0 { along.normalize() } else { DVec2::X })
    }
}

/// A triangle with its tangent frame and the form `II(e) = Δn` that fits the differences of its normals along its sides best.
struct Facet {
    normal: DVec3,
    u: DVec3,
    v: DVec3,
    form: Form,
    /// Area of the part of the triangle that is nearest to each corner, m².
    shares: [f64; 3],
}

impl Facet {
    /// `None` for a triangle without an area.
    fn new(corners: [DVec3; 3], normals: [DVec3; 3]) -> Option<Self> {
        // Side `k` is opposite to corner `k`.
        let sides = [0, 1, 2].map(|k| corners[(k + 2) % 3] - corners[(k + 1) % 3]);
        let scale = sides.iter().map(|side| side.length()).fold(0.0, f64::max);
        let cross = sides[0].cross(sides[1]);
        let (normal, u) = (cross.try_normalize()?, sides[0].try_normalize()?);
        let v = normal.cross(u);
        // Least squares over six equations for three unknowns: for each side (x, y), with the difference of normals (a, b),
        // uu x + uv y = a and uv x + vv y = b. In units of the longest side, so that the matrix is near to one.
        let (mut xx, mut xy, mut yy, mut right) = (0.0, 0.0, 0.0, DVec3::ZERO);
        for k in 0..3 {
            let difference = normals[(k + 2) % 3] - normals[(k + 1) % 3];
            let (x, y) = (sides[k].dot(u) / scale, sides[k].dot(v) / scale);
            let (a, b) = (difference.dot(u), difference.dot(v));
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
            right += DVec3::new(x * a, y * a + x * b, y * b);
        }
        let matrix = DMat3::from_cols(DVec3::new(xx, xy, 0.0), DVec3::new(xy, xx + yy, xy), DVec3::new(0.0, xy, yy));
        let solved = matrix.inverse() * right / scale;
        solved.is_finite().then(|| Self {
            normal,
            u,
            v,
            form: Form { uu: solved.x, uv: solved.y, vv: solved.z },
            shares: shares(sides, 0.5 * cross.length()),
        })
    }

    /// The facet's form in another tangent frame, which is turned into the facet's plane about the line where the planes meet.
    fn seen_in(&self, normal: DVec3, u: DVec3, v: DVec3) -> Form {
        let turn = DQuat::from_rotation_arc(normal, self.normal);
        let [u, v] = [turn * u, turn * v].map(|axis| DVec2::new(axis.dot(self.u), axis.dot(self.v)));
        Form { uu: self.form.of(u, u), uv: self.form.of(u, v), vv: self.form.of(v, v) }
    }
}

/// The mixed areas of Meyer, Desbrun, Schröder and Barr (2003): what is nearest to each corner, or a half and two quarters of the triangle where one
/// angle is obtuse. `sides[k]` is opposite to corner `k`.
fn shares(sides: [DVec3; 3], area: f64) -> [f64; 3] {
    // Dot product of the two sides that leave corner `k`: |a||b| cos.
    let dots = [0, 1, 2].map(|k| -sides[(k + 1) % 3].dot(sides[(k + 2) % 3]));
    if let Some(obtuse) = dots.iter().position(|&dot| dot < 0.0) {
        return [0, 1, 2].map(|k| if k == obtuse { 0.5 * area } else { 0.25 * area });
    }
    // An eighth of (side² · cotangent of the opposite angle), over the two sides at the corner; cot = dot / (2 area).
    let part = [0, 1, 2].map(|k| sides[k].length_squared() * dots[k] / (16.0 * area));
    [0, 1, 2].map(|k| part[(k + 1) % 3] + part[(k + 2) % 3])
}

impl Mesh {
    /// Principal curvatures at every vertex, from how the normals change along the sides of the triangles around it [Rusinkiewicz 2004].
    ///
    /// Vertices at one place with the same normal count as one, so that texture seams do not show; across a crease, where the normals differ, each
    /// vertex sees its own side alone. Zero for a vertex that no triangle with an area uses. Panics on vertex numbers that do not exist.
    #[must_use]
    pub fn curvatures(&self) -> Vec<Curvature> {
        let places = place_ids(&self.positions);
        let mut points = BTreeMap::new();
        let point_of: Vec<usize> = (0..self.vertex_count())
            .map(|i| {
                let key = (places[i], (self.normals[i] + Vec3::ZERO).to_array().map(f32::to_bits));
                let next = points.len();
                *points.entry(key).or_insert(next)
            })
            .collect();
        let mut sums = vec![(Form::default(), 0.0); points.len()];
        let frame = |vertex: usize| {
            let normal = self.normals[vertex].as_dvec3().normalize_or_zero();
            let (u, v) = if normal == DVec3::ZERO { (normal, normal) } else { normal.any_orthonormal_pair() };
            (normal, u, v)
        };
        for triangle in self.triangles() {
            let vertices = triangle.map(|i| i as usize);
            let normals = vertices.map(|i| self.normals[i].as_dvec3());
            let Some(facet) = Facet::new(self.corners(triangle).map(|p| p.as_dvec3()), normals) else { continue };
            for (vertex, share) in vertices.into_iter().zip(facet.shares) {
                let (normal, u, v) = frame(vertex);
                if normal == DVec3::ZERO {
                    continue;
                }
                let form = facet.seen_in(normal, u, v);
                let (sum, area) = &mut sums[point_of[vertex]];
                *sum = Form { uu: sum.uu + share * form.uu, uv: sum.uv + share * form.uv, vv: sum.vv + share * form.vv };
                *area += share;
            }
        }
        let curvature = |vertex: usize| {
            let (sum, area) = sums[point_of[vertex]];
            if area <= 0.0 {
                return Curvature::default();
            }
            let (largest, smallest, along) = Form { uu: sum.uu / area, uv: sum.uv / area, vv: sum.vv / area }.principal();
            let (_, u, v) = frame(vertex);
            let direction = (u * along.x + v * along.y).as_vec3();
            Curvature { largest_per_m: largest as f32, smallest_per_m: smallest as f32, direction }
        };
        (0..self.vertex_count()).map(curvature).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec3};

    use super::*;
    use crate::geom::shapes::{Cuboid, Cylinder, IcoSphere, Torus, UvSphere};

    #[track_caller]
    fn near(seen: f32, wanted: f32, bound: f32) {
        assert!((seen - wanted).abs() <= bound, "{seen} is not within {bound} of {wanted}");
    }

    #[test]
    fn a_ball_bends_alike_everywhere() {
        for mesh in [UvSphere::default().mesh().expect("a mesh"), IcoSphere::default().mesh().expect("a mesh")] {
            for curvature in mesh.curvatures() {
                near(curvature.largest_per_m, 2.0, 0.02);
                near(curvature.smallest_per_m, 2.0, 0.02);
            }
        }
    }

    #[test]
    fn a_torus_bends_by_its_two_radii() {
        let worst_of = |torus: Torus| {
            let mesh = torus.mesh().expect("a mesh");
            let mut worst = 0.0_f32;
            for ((p, n), curvature) in mesh.positions.iter().zip(&mesh.normals).zip(mesh.curvatures()) {
                let from_axis = Vec3::new(p.x, 0.0, p.z).length();
                let cosine = (from_axis - torus.radius_m) / torus.tube_radius_m;
                let (around_tube, around_axis) = (1.0 / torus.tube_radius_m, cosine / from_axis);
                worst = worst.max((curvature.largest_per_m - around_tube).abs()).max((curvature.smallest_per_m - around_axis).abs());
                near(curvature.mean_per_m(), 0.5 * (around_tube + around_axis), 0.05);
                // Around the tube: in the surface, and across the way around the axis.
                let around = Vec3::new(-p.z, 0.0, p.x) / from_axis;
                near(curvature.direction.length(), 1.0, 1e-5);
                near(curvature.direction.dot(*n), 0.0, 1e-5);
                near(curvature.direction.dot(around), 0.0, 0.02);
            }
            worst
        };
        let (coarse, fine) = (worst_of(Torus::default()), worst_of(Torus { slices: 384, sides: 192, ..Torus::default() }));
        // Curvatures of this torus are up to 5 1/m.
        println!("worst errors: {coarse} 1/m, and {fine} on a mesh four times as fine");
        assert!(coarse < 0.1 && fine < 0.3 * coarse, "{coarse} {fine}");
    }

    #[test]
    fn seams_do_not_show_and_creases_do() {
        let cylinder = Cylinder { radius_m: 0.25, ..Cylinder::default() };
        let mesh = cylinder.mesh().expect("a mesh");
        let all = mesh.curvatures();
        for (n, curvature) in mesh.normals.iter().zip(&all) {
            // The foot and the top are flat up to their rims, the wall is round up to them.
            let is_wall = n.y.abs() < 0.5;
            near(curvature.largest_per_m, if is_wall { 4.0 } else { 0.0 }, 0.02);
            near(curvature.smallest_per_m, 0.0, 0.02);
            if is_wall {
                near(curvature.direction.y, 0.0, 1e-3);
            }
        }
        let seam = |i: usize| {
            (0..mesh.vertex_count()).find(|&j| j != i && mesh.positions[i] == mesh.positions[j] && mesh.normals[i] == mesh.normals[j])
        };
        let pairs: Vec<(usize, usize)> = (0..mesh.vertex_count()).filter_map(|i| Some((i, seam(i)?))).collect();
        assert!(!pairs.is_empty());
        assert!(pairs.iter().all(|&(i, j)| all[i] == all[j]));
        assert!(Cuboid::default().mesh().expect("a mesh").curvatures().iter().all(|c| c.largest_per_m == 0.0 && c.smallest_per_m == 0.0));
    }

    #[test]
    fn a_saddle_bends_both_ways() {
        // y = a (x² − z²), twice as dense along x.
        const A: f32 = 0.75;
        let mut mesh = Mesh::default();
        for row in 0..21_u32 {
            for column in 0..41_u32 {
                let (x, z) = ((column as f32 - 20.0) * 0.01, (row as f32 - 10.0) * 0.02);
                mesh.positions.push(Vec3::new(x, A * (x * x - z * z), z));
                mesh.normals.push(Vec3::new(-2.0 * A * x, 1.0, 2.0 * A * z).normalize());
            }
        }
        for row in 0..20_u32 {
            for column in 0..40_u32 {
                let at = row * 41 + column;
                mesh.indices.extend([at, at + 41, at + 42, at, at + 42, at + 1]);
            }
        }
        let middle = mesh.curvatures()[10 * 41 + 20];
        near(middle.largest_per_m, 2.0 * A, 0.01);
        near(middle.smallest_per_m, -2.0 * A, 0.01);
        near(middle.direction.z.abs(), 1.0, 1e-3);
        near(middle.mean_per_m(), 0.0, 0.01);
    }

    #[test]
    fn scale_and_side_count() {
        let mut mesh = Torus::default().mesh().expect("a mesh");
        let before = mesh.curvatures();
        let double = mesh.transformed(Mat4::from_scale(Vec3::splat(2.0)));
        mesh.flip();
        for ((before, double), turned) in before.iter().zip(double.curvatures()).zip(mesh.curvatures()) {
            near(double.largest_per_m, 0.5 * before.largest_per_m, 1e-3);
            near(turned.smallest_per_m, -before.largest_per_m, 1e-3);
            near(turned.largest_per_m, -before.smallest_per_m, 1e-3);
        }
    }

    #[test]
    fn vertices_without_a_surface_have_none() {
        let mesh = Mesh { positions: vec![Vec3::ZERO; 3], normals: vec![Vec3::Y; 3], uvs: Vec::new(), indices: vec![0, 1, 2] };
        assert_eq!(mesh.curvatures(), vec![Curvature::default(); 3]);
    }
}
