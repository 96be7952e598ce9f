//! The objects of a scene as rays meet them: triangles in world space, and a bounding-volume hierarchy over them.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};

use crate::geom::{Aabb, Mesh};
use crate::scene::{Camera, Light, Material, Scene};

use super::error::TraceError;

/// Most triangles: the hierarchy names them by 32 bits, and keeps some for itself.
const MAX_TRIANGLES: usize = 1 << 27;

/// Boxes of triangles are enlarged by this share of the size of the scene: rounding moves a ray against a triangle by less, so that no
/// triangle that a ray meets is culled with its box.
const BOX_SLACK: f32 = 1.0e-6;

/// No triangle, or no object.
pub(super) const NONE: u32 = u32::MAX;

/// What a surface does to a photon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    /// Takes it in: light that lands.
    Diffuse,
    /// Sends on this share of it.
    Mirror(Vec3),
    /// Glass: refractive index and Abbe number of the inside, absorption in 1/m.
    Glass { ior: f32, abbe: Option<f32>, absorption: Vec3 },
}

/// A triangle in world space, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    a: Vec3A,
    b: Vec3A,
    c: Vec3A,
    /// Number of its object.
    object: u32,
    /// Index of its first vertex normal, or [`NONE`] for one that needs no normals.
    normals: u32,
}

/// A surface point that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Distance, m.
    pub t: f32,
    /// Number of the triangle.
    pub triangle: u32,
}

/// Triangles and the hierarchy over them.
struct Tree {
    bvh: CwBvh,
    /// Numbers of triangles, in the order of the hierarchy; empty where that is the order of all of them.
    numbers: Vec<u32>,
}

/// All objects of a scene.
pub(super) struct World {
    triangles: Vec<Triangle>,
    normals: Vec<Vec3>,
    /// All triangles.
    all: Option<Tree>,
    /// Those that reach above the water: all that light on its way down to the water can meet.
    dry: Option<Tree>,
    /// By object.
    pub surfaces: Vec<Surface>,
    /// Bounds of everything.
    pub bounds: Aabb,
    /// Bodies of glass whose triangles faced in and were turned over.
    pub turned: u64,
    closed: Vec<bool>,
    names: Vec<String>,
}

impl World {
    /// Builds or loads every object's mesh. Water reaches down to `lowest_water` at least, world y.
    pub fn new(scene: &Scene, lowest_water: Option<f32>) -> Result<Self, TraceError> {
        let mut world = Self {
            triangles: Vec::new(),
            normals: Vec::new(),
            all: None,
            dry: None,
            surfaces: Vec::new(),
            bounds: Aabb::EMPTY,
            turned: 0,
            closed: Vec::new(),
            names: Vec::new(),
        };
        for (index, object) in scene.objects.iter().enumerate() {
            let mesh = scene.mesh(index)?.transformed(object.transform.world_from_object());
            let surface = match object.material {
                Material::Diffuse { .. } => Surface::Diffuse,
                Material::Mirror { reflectance } => Surface::Mirror(reflectance),
                Material::Dielectric { ior, abbe, absorption } => Surface::Glass { ior, abbe, absorption },
            };
            world.add(&mesh, surface, object.display_name(index))?;
        }
        if world.triangles.len() > MAX_TRIANGLES {
            return Err(TraceError::TooManyTriangles { found: world.triangles.len(), limit: MAX_TRIANGLES });
        }
        world.build(lowest_water);
        world.check_places(scene)?;
        Ok(world)
    }

    fn add(&mut self, mesh: &Mesh, surface: Surface, name: String) -> Result<(), TraceError> {
        let report = mesh.edge_report();
        let mut inverted = false;
        if matches!(surface, Surface::Glass { .. }) {
            if !report.is_closed() {
                return Err(TraceError::OpenGlass {
                    object: name,
                    border: report.border_count,
                    crowded: report.non_manifold_count,
                    twisted: report.inconsistent_count,
                });
            }
            inverted = mesh.signed_volume() < 0.0;
            self.turned += u64::from(inverted);
        }
        let object = self.surfaces.len() as u32;
        let smooth = surface != Surface::Diffuse;
        for triangle in mesh.triangles() {
            let order = if inverted { [0, 2, 1] } else { [0, 1, 2] };
            let corners = order.map(|k| triangle[k] as usize);
            let [a, b, c] = corners.map(|i| Vec3A::from(mesh.positions[i]));
            let normals = if smooth { self.normals.len() as u32 } else { NONE };
            if smooth {
                let sign = if inverted { -1.0 } else { 1.0 };
                self.normals.extend(corners.map(|i| mesh.normals[i] * sign));
            }
            self.triangles.push(Triangle { a, b, c, object, normals });
        }
        self.bounds = self.bounds.union(mesh.bounds());
        self.surfaces.push(surface);
        self.closed.push(report.is_closed());
        self.names.push(name);
        Ok(())
    }

    /// Builds the hierarchies, and puts triangles in the order of the first.
    fn build(&mut self, lowest_water: Option<f32>) {
        let all: Vec<u32> = (0..self.triangles.len() as u32).collect();
        let slack = self.bounds.size().length() * BOX_SLACK;
        if let Some(mut tree) = Tree::new(&self.triangles, all, slack) {
            self.triangles = tree.numbers.iter().map(|&number| self.triangles[number as usize]).collect();
            tree.numbers.clear();
            self.all = Some(tree);
        }
        if let Some(y) = lowest_water {
            let above = |t: &Triangle| t.a.y.max(t.b.y).max(t.c.y) >= y;
            let numbers = (0..self.triangles.len() as u32).filter(|&k| above(&self.triangles[k as usize])).collect();
            self.dry = Tree::new(&self.triangles, numbers, slack);
        }
    }

    /// The nearest triangle along a ray, up to `limit` metres; the one numbered `skip` is passed over.
    #[inline]
    pub fn nearest(&self, origin: Vec3, direction: Vec3, limit: f32, skip: u32) -> Option<Hit> {
        let tree = self.all.as_ref()?;
        let probe = Probe::new(origin, direction);
        let mut hit = RayHit::none();
        tree.bvh.ray_traverse(Ray::new(probe.origin, probe.direction, 0.0, limit), &mut hit, |ray, index| {
            if index as u32 == skip { f32::INFINITY } else { self.triangles[index].meet(&probe, ray.tmax) }
        });
        (hit.primitive_id != NONE).then_some(Hit { t: hit.t, triangle: hit.primitive_id })
    }

    /// [`World::nearest`] for a ray that comes down through air and ends on the water: the same answer, found among fewer triangles.
    #[inline]
    pub fn nearest_above_water(&self, origin: Vec3, direction: Vec3, limit: f32, skip: u32) -> Option<Hit> {
        let tree = self.dry.as_ref()?;
        let probe = Probe::new(origin, direction);
        let mut hit = RayHit::none();
        tree.bvh.ray_traverse(Ray::new(probe.origin, probe.direction, 0.0, limit), &mut hit, |ray, index| {
            let number = tree.numbers[index];
            if number == skip { f32::INFINITY } else { self.triangles[number as usize].meet(&probe, ray.tmax) }
        });
        (hit.primitive_id != NONE).then(|| Hit { t: hit.t, triangle: tree.numbers[hit.primitive_id as usize] })
    }

    /// Number of the object that a triangle belongs to.
    pub fn object(&self, triangle: u32) -> u32 {
        self.triangles[triangle as usize].object
    }

    /// A point on a ray, moved along it into the plane of a triangle: far from the ray's origin, rounding leaves it beside.
    pub fn onto(&self, triangle: u32, p: Vec3, direction: Vec3) -> Vec3 {
        let t = &self.triangles[triangle as usize];
        let normal = Vec3::from((t.b - t.a).cross(t.c - t.a));
        let step = (Vec3::from(t.a) - p).dot(normal) / normal.dot(direction);
        if step.abs() < 1.0e-4 { p + direction * step } else { p }
    }

    /// Unit normal of a triangle's plane, out of the surface; zero for a triangle without area.
    pub fn face_normal(&self, triangle: u32) -> Vec3 {
        let t = &self.triangles[triangle as usize];
        Vec3::from((t.b - t.a).cross(t.c - t.a)).normalize_or_zero()
    }

    /// Unit normal interpolated over a triangle, at a point of it; that of its plane where it has none.
    pub fn smooth_normal(&self, triangle: u32, p: Vec3) -> Vec3 {
        let t = &self.triangles[triangle as usize];
        let face = Vec3::from((t.b - t.a).cross(t.c - t.a));
        if t.normals == NONE {
            return face.normalize_or_zero();
        }
        // Weights are areas of the parts that the point cuts the triangle into.
        let (a, b, c) = (Vec3::from(t.a), Vec3::from(t.b), Vec3::from(t.c));
        let wa = (b - p).cross(c - p).dot(face);
        let wb = (c - p).cross(a - p).dot(face);
        let wc = (a - p).cross(b - p).dot(face);
        let n = &self.normals[t.normals as usize..][..3];
        (n[0] * wa + n[1] * wb + n[2] * wc).try_normalize().unwrap_or_else(|| face.normalize_or_zero())
    }

    /// World-space corners of every triangle that bends or reflects light.
    pub fn specular_triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let specular = |t: &&Triangle| self.surfaces[t.object as usize] != Surface::Diffuse;
        self.triangles.iter().filter(specular).map(|t| [t.a, t.b, t.c].map(Vec3::from))
    }

    /// The closed object that a point is in, if any: the one whose outermost surface a ray from the point leaves first.
    fn around(&self, p: Vec3) -> Option<u32> {
        // A direction that no shipped mesh is aligned with.
        let direction = Vec3::new(0.299_7, 0.903_6, 0.306_2).normalize();
        let mut depth = vec![0_i32; self.surfaces.len()];
        let (mut origin, mut skip) = (p, NONE);
        while let Some(hit) = self.nearest(origin, direction, f32::INFINITY, skip) {
            let object = self.object(hit.triangle) as usize;
            depth[object] += if self.face_normal(hit.triangle).dot(direction) > 0.0 { 1 } else { -1 };
            origin += direction * hit.t;
            skip = hit.triangle;
        }
        (0..depth.len()).find(|&k| self.closed[k] && depth[k] > 0).map(|k| k as u32)
    }

    fn check_places(&self, scene: &Scene) -> Result<(), TraceError> {
        for (light, source) in scene.lights.iter().enumerate() {
            if let Light::Point { position, .. } | Light::Spot { position, .. } = *source
                && let Some(object) = self.around(position)
            {
                return Err(TraceError::LightInside { light, position: position.to_array(), object: self.names[object as usize].clone() });
            }
        }
        if let Camera::Perspective { position, .. } = scene.camera
            && let Some(object) = self.around(position)
        {
            return Err(TraceError::CameraInside { position: position.to_array(), object: self.names[object as usize].clone() });
        }
        Ok(())
    }
}

impl Tree {
    /// Builds the hierarchy over some of the triangles; `None` over none.
    fn new(triangles: &[Triangle], numbers: Vec<u32>, slack: f32) -> Option<Self> {
        if numbers.is_empty() {
            return None;
        }
        let boxes: Vec<Bounds> = numbers.iter().map(|&number| triangles[number as usize].bounds(slack)).collect();
        let indices = (0..boxes.len() as u32).collect();
        let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Low, &boxes, indices, SortPrecision::U64, 0);
        ReinsertionOptimizer::default().run(&mut bvh, 0.05, None);
        let bvh = bvh2_to_cwbvh(&bvh, 3, true, false);
        let numbers = bvh.primitive_indices.iter().map(|&index| numbers[index as usize]).collect();
        Some(Self { bvh, numbers })
    }
}

/// A ray with two directions across it.
struct Probe {
    origin: Vec3A,
    direction: Vec3A,
    across: [Vec3A; 2],
}

impl Probe {
    #[inline]
    fn new(origin: Vec3, direction: Vec3) -> Self {
        // The hierarchy takes the sign of a component from a comparison and that of its inverse from its bits: −0 would be both.
        let direction = direction + Vec3::ZERO;
        let (x, y) = direction.any_orthonormal_pair();
        Self { origin: origin.into(), direction: direction.into(), across: [x.into(), y.into()] }
    }
}

impl Triangle {
    /// A box around the triangle, a little larger.
    fn bounds(&self, slack: f32) -> Bounds {
        let slack = Vec3A::splat(slack);
        Bounds::new(self.a.min(self.b).min(self.c) - slack, self.a.max(self.b).max(self.c) + slack)
    }

    /// Distance at which a ray meets the triangle, from either side, within `(0, limit)`; infinity if it does not.
    ///
    /// Seen along the ray, the triangle is flat and the ray a point; it is inside if it lies on one side of all edges. Two triangles of one
    /// edge compute its side from the same numbers up to the sign, so that no ray slips through between them [Woop et al. 2013].
    /// Coordinates are measured from the ray, so that small triangles far from its origin keep their digits.
    #[inline]
    fn meet(&self, probe: &Probe, limit: f32) -> f32 {
        let [x, y] = probe.across;
        let (a, b, c) = (self.a - probe.origin, self.b - probe.origin, self.c - probe.origin);
        let (ax, ay) = (a.dot(x), a.dot(y));
        let (bx, by) = (b.dot(x), b.dot(y));
        let (cx, cy) = (c.dot(x), c.dot(y));
        let u = bx * cy - by * cx;
        let v = cx * ay - cy * ax;
        let w = ax * by - ay * bx;
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        if !inside {
            return f32::INFINITY;
        }
        let normal = (self.b - self.a).cross(self.c - self.a);
        let t = normal.dot(a) / normal.dot(probe.direction);
        if t > 0.0 && t < limit { t } else { f32::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn world(objects: &str) -> Result<World, TraceError> {
        let text = format!("(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), objects: [{objects}])");
        World::new(&crate::scene::parse(&text, "world", Path::new("")).unwrap(), None)
    }

    #[test]
    fn rays_along_an_axis_meet_what_is_there_whatever_the_signs_of_their_zeros() {
        let world = world("(shape: Grid(size_m: (2, 2))), (shape: Cuboid(size_m: (1, 1, 1)), transform: (translate: (0, -3, 0)))").unwrap();
        for x in [0.0, -0.0] {
            for z in [0.0, -0.0] {
                let hit = world.nearest(Vec3::new(0.1, 1.0, 0.2), Vec3::new(x, -1.0, z), f32::INFINITY, NONE);
                assert_eq!(hit.map(|hit| hit.t), Some(1.0), "direction ({x:?}, -1, {z:?})");
            }
        }
    }

    #[test]
    fn nearest_hits_are_those_of_every_triangle_asked() {
        let world = world("(shape: TorusKnot(segments: 96, sides: 12)), (shape: Figure(height_m: 1, resolution: 24))").unwrap();
        for k in 0..4000_u32 {
            let [a, b, c] = crate::math::rng::uniform3(5, 0, k).map(|u| u * 2.0 - 1.0);
            let [d, e, f] = crate::math::rng::uniform3(5, 1, k).map(|u| u - 0.5);
            let (origin, direction) = (Vec3::new(a, b, c), Vec3::new(d, e, f).normalize());
            let probe = Probe::new(origin, direction);
            let brute = world.triangles.iter().map(|t| t.meet(&probe, f32::INFINITY)).fold(f32::INFINITY, f32::min);
            let found = world.nearest(origin, direction, f32::INFINITY, NONE).map_or(f32::INFINITY, |hit| hit.t);
            assert_eq!(found, brute, "ray {k}");
        }
    }

    #[test]
    fn no_ray_slips_through_the_edges_of_a_closed_mesh() {
        let world = world("(shape: IcoSphere(radius_m: 1, subdivisions: 3))").unwrap();
        // From far away, straight at points on edges and corners.
        for triangle in &world.triangles {
            for target in [triangle.a, (triangle.a + triangle.b) * 0.5, (triangle.b * 0.25 + triangle.c * 0.75)] {
                let target = Vec3::from(target) * 0.999;
                let origin = Vec3::new(9.0, 5.0, 7.0);
                let mut depth = 0;
                let (mut from, mut skip) = (origin, NONE);
                let direction = (target - origin).normalize();
                while let Some(hit) = world.nearest(from, direction, f32::INFINITY, skip) {
                    depth += if world.face_normal(hit.triangle).dot(direction) < 0.0 { 1 } else { -1 };
                    from += direction * hit.t;
                    skip = hit.triangle;
                }
                assert_eq!(depth, 0, "a ray towards {target}");
            }
        }
    }

    #[test]
    fn bad_glass_and_bad_places_are_told() {
        let glass = |shape: &str, place: &str| world(&format!("(name: \"lens\", shape: {shape}, {place} material: Dielectric())"));
        let open = glass("Grid()", "").err().unwrap().to_string();
        assert!(open.starts_with("lens is glass, but its mesh is open: 4 edges"), "{open}");
        let around = glass("UvSphere(radius_m: 1)", "transform: (translate: (0, 2, 5)),").err().unwrap().to_string();
        assert!(around.starts_with("the camera at (0, 2, 5) is inside lens"), "{around}");
        assert_eq!(glass("UvSphere(radius_m: 1)", "").unwrap().turned, 0);
        let lit = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), lights: [Point(position: (0.1, 0, 0), intensity: (1, 1, 1))], \
                   objects: [(shape: Cuboid(size_m: (1, 1, 1)))])";
        let scene = crate::scene::parse(lit, "lit", Path::new("")).unwrap();
        let inside = World::new(&scene, None).err().unwrap().to_string();
        assert!(inside.starts_with("light 0 at (0.1, 0, 0) is inside object 0"), "{inside}");
    }

    #[test]
    fn glass_that_faces_in_is_turned_over_and_counted() {
        let scene = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), objects: [(shape: UvSphere(), material: Dielectric())])";
        let scene = crate::scene::parse(scene, "turned", Path::new("")).unwrap();
        let mut mesh = scene.mesh(0).unwrap();
        for triangle in mesh.indices.chunks_exact_mut(3) {
            triangle.swap(1, 2);
        }
        let mut world = world("").unwrap();
        world.add(&mesh, Surface::Glass { ior: 1.5, abbe: None, absorption: Vec3::ZERO }, "ball".to_owned()).unwrap();
        assert_eq!(world.turned, 1);
        let t = &world.triangles[0];
        assert!(Vec3::from((t.b - t.a).cross(t.c - t.a)).dot(Vec3::from(t.a)) > 0.0);
    }
}
