//! Rays through a whole scene in even light: every reflection and every refraction, as far as they matter.

use glam::DVec3;
use nephroid::scene::{Material, Scene};

/// Share of the eye's radiance below which a ray is given up.
const LEAST_SHARE: f64 = 2.0e-3;

/// Most surfaces along a path.
const MOST_SURFACES: u32 = 24;

struct Triangle {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    object: usize,
}

/// A node of the hierarchy of boxes: its triangles, or the place of its second child; the first one is next to it.
struct Node {
    min: DVec3,
    max: DVec3,
    triangles: std::ops::Range<usize>,
    second: usize,
}

/// The scene's triangles.
pub struct Rays<'a> {
    scene: &'a Scene,
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
}

struct Hit<'t> {
    distance: f64,
    triangle: &'t Triangle,
    weights: [f64; 3],
}

impl<'a> Rays<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let mut triangles = Vec::new();
        for (object, described) in scene.objects.iter().enumerate() {
            let mesh = scene.mesh(object).expect("the mesh").transformed(described.transform.world_from_object());
            triangles.extend(mesh.triangles().map(|indices| Triangle {
                corners: indices.map(|i| mesh.positions[i as usize].as_dvec3()),
                normals: indices.map(|i| mesh.normals[i as usize].as_dvec3()),
                object,
            }));
        }
        let mut rays = Self { scene, triangles, nodes: Vec::new() };
        rays.split(0..rays.triangles.len());
        rays
    }

    /// Adds a node and all below it.
    fn split(&mut self, range: std::ops::Range<usize>) {
        let corners = self.triangles[range.clone()].iter().flat_map(|t| t.corners);
        let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        let (index, slack) = (self.nodes.len(), DVec3::splat(1.0e-9));
        self.nodes.push(Node { min: min - slack, max: max + slack, triangles: range.clone(), second: 0 });
        if range.len() > 4 {
            let axis = (max - min).max_position();
            let middle = range.len() / 2;
            let centre = |t: &Triangle| t.corners.iter().map(|c| c[axis]).sum::<f64>();
            self.triangles[range.clone()].select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)));
            self.split(range.start..range.start + middle);
            self.nodes[index].second = self.nodes.len();
            self.split(range.start + middle..range.end);
        }
    }

    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<Hit<'_>> {
        let inverse = direction.recip();
        let mut best: Option<Hit<'_>> = None;
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            let (a, b) = ((node.min - origin) * inverse, (node.max - origin) * inverse);
            let far = best.as_ref().map_or(f64::INFINITY, |hit| hit.distance);
            if a.min(b).max_element().max(0.0) > a.max(b).min_element().min(far) {
                continue;
            }
            if node.second > 0 {
                stack.extend([node.second, index + 1]);
                continue;
            }
            for triangle in &self.triangles[node.triangles.clone()] {
                let [p, q, r] = triangle.corners;
                let (e, f) = (q - p, r - p);
                let across = direction.cross(f);
                let area = e.dot(across);
                let (to, inverse) = (origin - p, 1.0 / area);
                let u = to.dot(across) * inverse;
                let v = direction.dot(to.cross(e)) * inverse;
                let distance = f.dot(to.cross(e)) * inverse;
                if area != 0.0
                    && u >= 0.0
                    && v >= 0.0
                    && u + v <= 1.0
                    && distance > 0.0
                    && best.as_ref().is_none_or(|b| distance < b.distance)
                {
                    best = Some(Hit { distance, triangle, weights: [1.0 - u - v, u, v] });
                }
            }
        }
        best
    }

    /// Radiance along a ray, and whether the first surface is a mirror or glass.
    pub fn look(&self, origin: DVec3, direction: DVec3) -> (DVec3, bool) {
        let first = self.nearest(origin, direction);
        let specular = first.is_some_and(|hit| !matches!(self.scene.objects[hit.triangle.object].material, Material::Diffuse { .. }));
        (self.radiance(origin, direction, 1.0, 0), specular)
    }

    fn radiance(&self, origin: DVec3, direction: DVec3, share: f64, depth: u32) -> DVec3 {
        if share < LEAST_SHARE || depth > MOST_SURFACES {
            return DVec3::ZERO;
        }
        let Some(hit) = self.nearest(origin, direction) else {
            return self.scene.environment.sky_radiance(direction.as_vec3()).as_dvec3();
        };
        let at = origin + direction * hit.distance;
        let [p, q, r] = hit.triangle.corners;
        let face = (q - p).cross(r - p).normalize();
        let smooth = (0..3).map(|k| hit.triangle.normals[k] * hit.weights[k]).sum::<DVec3>().normalize();
        let from_behind = face.dot(direction) > 0.0;
        let against = |n: DVec3| if n.dot(direction) > 0.0 { -n } else { n };
        let (face, normal) = (against(face), against(smooth));
        let (before, behind) = (at + face * 1.0e-6, at - face * 1.0e-6);
        let mirrored = direction - normal * (2.0 * direction.dot(normal));
        match &self.scene.objects[hit.triangle.object].material {
            Material::Diffuse { albedo } => {
                let albedo = albedo.at(at.as_vec3(), normal.as_vec3());
                (albedo * self.scene.environment.ambient_irradiance / std::f32::consts::PI).as_dvec3()
            }
            Material::Mirror { reflectance } => reflectance.as_dvec3() * self.radiance(before, mirrored, share, depth + 1),
            Material::Dielectric { ior, absorption, .. } => {
                let eta = if from_behind { f64::from(*ior) } else { 1.0 / f64::from(*ior) };
                let c = -direction.dot(normal);
                let k = 1.0 - eta * eta * (1.0 - c * c);
                let c_t = k.max(0.0).sqrt();
                let p = (c - eta * c_t) / (c + eta * c_t);
                let s = (eta * c - c_t) / (eta * c + c_t);
                let reflected = if k <= 0.0 {
                    1.0
                } else if eta == 1.0 {
                    0.0
                } else {
                    0.5 * (p * p + s * s)
                };
                let refracted = direction * eta + normal * (eta * c - c_t);
                let mut sum = self.radiance(before, mirrored, share * reflected, depth + 1) * reflected;
                if reflected < 1.0 {
                    sum += self.radiance(behind, refracted.normalize(), share * (1.0 - reflected), depth + 1) * (1.0 - reflected);
                }
                let inside = if from_behind { hit.distance } else { 0.0 };
                let left = |sigma: f32| libm::exp(f64::from(-sigma) * inside);
                sum * DVec3::new(left(absorption.x), left(absorption.y), left(absorption.z))
            }
        }
    }
}
