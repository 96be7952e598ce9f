//! The objects of a scene for rays: triangles in world space, with a bounding-volume hierarchy.

use fearless_simd::Level;
use glam::Vec3;

use nephroid_scene::geom::{Aabb, Mesh};
use nephroid_scene::{Camera, Light, Material, Scene};

use super::error::TraceError;
use super::tree::{Hit, Hits, NONE, Packet, Tree};

/// Most triangles: the hierarchy numbers them with 32 bits and reserves some of the numbers.
const MAX_TRIANGLES: usize = 1 << 27;

/// Farthest distance, in sizes of a triangle, by which rounding puts a point on a ray beside its plane.
const NEAR: f32 = 1.0e-2;

/// Enlargement of triangles' boxes, as a share of the size of the scene. It exceeds the rounding error between a ray and a triangle, so a triangle
/// that a ray meets is never culled with its box.
const BOX_SLACK: f32 = 2.0e-6;

/// Interaction of a surface with photons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    /// Absorbs the photon: the light has landed.
    Diffuse,
    /// Reflects this share of the flux.
    Mirror(Vec3),
    /// Glass: refractive index and Abbe number of the inside, absorption in 1/m.
    Glass { ior: f32, abbe: Option<f32>, absorption: Vec3 },
}

/// A triangle in world space, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    a: Vec3,
    b: Vec3,
    c: Vec3,
    /// Number of the triangle's object.
    object: u32,
    /// Index of the triangle's first vertex normal; [`NONE`] for a triangle that needs no normals.
    normals: u32,
}

/// All objects of a scene.
pub(super) struct World {
    triangles: Vec<Triangle>,
    normals: Vec<Vec3>,
    /// Tree of all triangles.
    all: Option<Tree>,
    /// Tree of the triangles that reach above the water: only these can be met by light on its way down to the water.
    dry: Option<Tree>,
    /// Surface of each object.
    pub surfaces: Vec<Surface>,
    /// Bounds of all objects.
    pub bounds: Aabb,
    /// Number of bodies of glass whose triangles faced inwards and were reversed.
    pub turned: u64,
    closed: Vec<bool>,
    names: Vec<String>,
    level: Level,
}

impl World {
    /// Makes or loads every object's mesh. `lowest_water`: lower bound on the world y of the water surface.
    ///
    /// # Errors
    /// If a mesh cannot be made or loaded, glass is not closed, or there are too many triangles.
    pub fn new(scene: &Scene, lowest_water: Option<f32>, level: Level) -> Result<Self, TraceError> {
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
            level,
        };
        for (index, object) in scene.objects.iter().enumerate() {
            let placed = scene.placed_mesh(index)?;
            let surface = match object.material {
                Material::Diffuse { .. } => Surface::Diffuse,
                Material::Mirror { reflectance } => Surface::Mirror(reflectance),
                Material::Dielectric { ior, abbe, absorption } => Surface::Glass { ior, abbe, absorption },
            };
            world.turned += u64::from(placed.turned);
            world.add(&placed.mesh, surface, object.display_name(index));
        }
        if world.triangles.len() > MAX_TRIANGLES {
            return Err(TraceError::TooManyTriangles { found: world.triangles.len(), limit: MAX_TRIANGLES });
        }
        world.build(lowest_water);
        world.check_places(scene)?;
        Ok(world)
    }

    fn add(&mut self, mesh: &Mesh, surface: Surface, name: String) {
        let object = self.surfaces.len() as u32;
        let smooth = surface != Surface::Diffuse;
        for triangle in mesh.triangles() {
            let corners = triangle.map(|i| i as usize);
            let [a, b, c] = corners.map(|i| mesh.positions[i]);
            let normals = if smooth { self.normals.len() as u32 } else { NONE };
            if smooth {
                self.normals.extend(corners.map(|i| mesh.normals[i]));
            }
            self.triangles.push(Triangle { a, b, c, object, normals });
        }
        self.bounds = self.bounds.union(mesh.bounds());
        self.surfaces.push(surface);
        self.closed.push(mesh.is_closed());
        self.names.push(name);
    }

    /// Builds both trees.
    fn build(&mut self, lowest_water: Option<f32>) {
        let slack = self.bounds.size().length() * BOX_SLACK;
        let numbered = self.triangles.iter().zip(0..).map(|(t, number)| ([t.a, t.b, t.c], number));
        let all: Vec<_> = numbered.collect();
        self.all = Tree::new(&all, slack);
        if let Some(y) = lowest_water {
            let above = |corners: &[Vec3; 3]| corners.iter().any(|p| p.y >= y);
            self.dry = Tree::new(&all.into_iter().filter(|(corners, _)| above(corners)).collect::<Vec<_>>(), slack);
        }
    }

    /// The nearest triangle along a ray, up to `limit` metres. The triangle numbered `skip` is ignored.
    #[inline]
    pub fn nearest(&self, origin: Vec3, direction: Vec3, limit: f32, skip: u32) -> Option<Hit> {
        self.all.as_ref()?.nearest(self.level, origin, direction, limit, skip)
    }

    /// [`World::nearest`] for sixteen rays at once. Rays in `above` come down through air and end at the water; for them, the smaller tree gives the
    /// same result.
    pub fn nearest_of_packet(&self, packet: &Packet<'_>, active: u32, above: u32, hits: &mut Hits) {
        for (tree, rays) in [(&self.all, active & !above), (&self.dry, active & above)] {
            if let Some(tree) = tree
                && rays != 0
            {
                tree.nearest_of_packet(self.level, packet, rays, hits);
            }
        }
    }

    /// Number of a triangle's object.
    pub fn object(&self, triangle: u32) -> u32 {
        self.triangles[triangle as usize].object
    }

    /// A triangle with its surface and normals.
    #[inline]
    pub fn facet(&self, triangle: u32) -> Facet<'_> {
        let triangle = &self.triangles[triangle as usize];
        let normals = (triangle.normals != NONE).then(|| &self.normals[triangle.normals as usize..][..3]);
        Facet { triangle, normals, across: (triangle.b - triangle.a).cross(triangle.c - triangle.a) }
    }

    /// World-space corners of every triangle that refracts or reflects light.
    pub fn specular_triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let specular = |t: &&Triangle| self.surfaces[t.object as usize] != Surface::Diffuse;
        self.triangles.iter().filter(specular).map(|t| [t.a, t.b, t.c])
    }

    /// The closed object that contains a point, if any: a ray from the point leaves its surface first.
    fn around(&self, p: Vec3) -> Option<u32> {
        // A direction along which no shipped mesh is aligned.
        let direction = Vec3::new(0.299_7, 0.903_6, 0.306_2).normalize();
        let mut depth = vec![0_i32; self.surfaces.len()];
        let (mut origin, mut skip) = (p, NONE);
        while let Some(hit) = self.nearest(origin, direction, f32::INFINITY, skip) {
            let object = self.object(hit.triangle) as usize;
            depth[object] += if self.facet(hit.triangle).normal().dot(direction) > 0.0 { 1 } else { -1 };
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

/// One triangle of the world.
pub(super) struct Facet<'a> {
    triangle: &'a Triangle,
    normals: Option<&'a [Vec3]>,
    /// Normal out of the surface, with the length of twice the area.
    across: Vec3,
}

impl Facet<'_> {
    /// Moves a point on a ray along the ray into the triangle's plane: far from the ray's origin, rounding leaves the point beside the plane.
    #[inline]
    pub fn onto(&self, p: Vec3, direction: Vec3) -> Vec3 {
        let step = (self.triangle.a - p).dot(self.across) / self.across.dot(direction);
        if step * step < self.across.length() * (NEAR * NEAR) { p + direction * step } else { p }
    }

    /// Unit normal of the plane, out of the surface; zero for a degenerate triangle.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        self.across.normalize_or_zero()
    }

    /// Interpolated unit normal at a point of the triangle; the plane's normal if the triangle has no vertex normals.
    #[inline]
    pub fn smooth_normal(&self, p: Vec3) -> Vec3 {
        let Some(&[na, nb, nc]) = self.normals else { return self.normal() };
        // The weights are areas of the parts into which the point divides the triangle.
        let &Triangle { a, b, c, .. } = self.triangle;
        let to_c = c - p;
        let wa = (b - p).cross(to_c).dot(self.across);
        let wb = to_c.cross(a - p).dot(self.across);
        let wc = self.across.length_squared() - wa - wb;
        (na * wa + nb * wb + nc * wc).try_normalize().unwrap_or_else(|| self.normal())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn world(objects: &str) -> Result<World, TraceError> {
        let text = format!("(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), objects: [{objects}])");
        World::new(&nephroid_scene::parse(&text, "world", Path::new(""), &[]).unwrap(), None, Level::new())
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
            let [a, b, c] = nephroid_math::rng::uniform3(5, 0, k).map(|u| u * 2.0 - 1.0);
            let [d, e, f] = nephroid_math::rng::uniform3(5, 1, k).map(|u| u - 0.5);
            let (origin, direction) = (Vec3::new(a, b, c), Vec3::new(d, e, f).normalize());
            let ray = nephroid_scene::geom::Ray { origin, direction };
            let brute =
                world.triangles.iter().filter_map(|t| ray.meet_triangle([t.a, t.b, t.c])).map(|hit| hit.t).fold(f32::INFINITY, f32::min);
            let hit = world.nearest(origin, direction, f32::INFINITY, NONE);
            let found = hit.map_or(f32::INFINITY, |hit| hit.t);
            assert!(found == brute || (found - brute).abs() < 1e-4, "ray {k}: {found}, one by one {brute}");
            for (name, level) in nephroid_math::level::available_levels() {
                let again = world.all.as_ref().unwrap().nearest(level, origin, direction, f32::INFINITY, NONE);
                assert_eq!(again, hit, "ray {k} at level {name}");
            }
        }
    }

    /// Beams of rays, from parallel to going anywhere: the boxes and leaves they share are other ones, the answers are not.
    #[test]
    fn packets_meet_what_their_rays_meet_alone() {
        let world = world(
            "(shape: TorusKnot(segments: 96, sides: 12)), (shape: Figure(height_m: 1, resolution: 24)), (shape: Grid(size_m: (4, 4)))",
        )
        .unwrap();
        let tree = world.all.as_ref().unwrap();
        let (mut met, mut missed) = (0, 0);
        for k in 0..600_u32 {
            let spread = [0.0, 0.01, 0.1, 1.0][k as usize % 4];
            let [a, b, c] = nephroid_math::rng::uniform3(6, 0, k).map(|u| u * 2.0 - 1.0);
            let [d, e, f] = nephroid_math::rng::uniform3(6, 1, k).map(|u| u - 0.5);
            let (mut origins, mut directions, mut limits, mut skips) = ([[0.0; 16]; 3], [[0.0; 16]; 3], [0.0; 16], [NONE; 16]);
            for ray in 0..16 {
                let [u, v, w] = nephroid_math::rng::uniform3(7 + ray as u32, 0, k).map(|u| (u - 0.5) * spread);
                let (origin, direction) = (Vec3::new(a + u, b + v, c + w), (Vec3::new(d, e, f) + Vec3::new(v, w, u)).normalize());
                for axis in 0..3 {
                    (origins[axis][ray], directions[axis][ray]) = (origin[axis], direction[axis]);
                }
                limits[ray] = if ray % 5 == 4 { 0.3 } else { f32::INFINITY };
                skips[ray] = if ray % 3 == 2 {
                    world.nearest(origin, direction, f32::INFINITY, NONE).map_or(NONE, |hit| hit.triangle)
                } else {
                    NONE
                };
            }
            let active = if k % 7 == 0 { 0x5ac3 } else { 0xffff };
            let packet = Packet { origin: origins.each_ref(), direction: directions.each_ref(), skip: &skips };
            for (name, level) in nephroid_math::level::available_levels() {
                let mut hits = Hits { t: limits, triangles: [NONE; 16] };
                tree.nearest_of_packet(level, &packet, active, &mut hits);
                for ray in 0..16 {
                    let at = |v: &[[f32; 16]; 3]| Vec3::new(v[0][ray], v[1][ray], v[2][ray]);
                    let alone = tree.nearest(level, at(&origins), at(&directions), limits[ray], skips[ray]);
                    let alone = if active >> ray & 1 == 1 { alone } else { None };
                    let expected = alone.map_or((limits[ray], NONE), |hit| (hit.t, hit.triangle));
                    assert_eq!((hits.t[ray], hits.triangles[ray]), expected, "packet {k}, ray {ray}, level {name}");
                    *(if alone.is_some() { &mut met } else { &mut missed }) += 1;
                }
            }
        }
        assert!(met > 10_000 && missed > 10_000, "{met} met, {missed} missed");
    }

    #[test]
    fn no_ray_slips_through_the_edges_of_a_closed_mesh() {
        let world = world("(shape: IcoSphere(radius_m: 1, subdivisions: 3))").unwrap();
        // Straight at points on edges and corners, from far away and from inside.
        for triangle in &world.triangles {
            for target in [triangle.a, (triangle.a + triangle.b) * 0.5, triangle.b * 0.25 + triangle.c * 0.75] {
                for origin in [Vec3::new(9.0, 5.0, 7.0), Vec3::new(0.1, 0.2, -0.1)] {
                    let to = target - origin;
                    let outside = origin.length() > 1.0;
                    // A little further than the surface where the ray enters, so that it is not grazing.
                    if outside && to.normalize().dot(target) > -0.3 {
                        continue;
                    }
                    let hit = world.nearest(origin, to.normalize(), f32::INFINITY, NONE);
                    assert!(hit.is_some_and(|hit| hit.t < to.length() * 1.001), "a ray from {origin} to {target}: {hit:?}");
                }
            }
        }
    }

    #[test]
    fn bad_glass_and_bad_places_are_told() {
        let glass = |shape: &str, place: &str| world(&format!("(name: \"lens\", shape: {shape}, {place} material: Dielectric())"));
        let open = glass("Grid()", "").err().unwrap().to_string();
        assert!(open.contains("lens is glass, but its mesh is open: 4 edges"), "{open}");
        let around = glass("UvSphere(radius_m: 1)", "transform: (translate: (0, 2, 5)),").err().unwrap().to_string();
        assert!(around.starts_with("the camera at (0, 2, 5) is inside lens"), "{around}");
        assert_eq!(glass("UvSphere(radius_m: 1)", "").unwrap().turned, 0);
        let lit = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), lights: [Point(position: (0.1, 0, 0), intensity: (1, 1, 1))], \
                   objects: [(shape: Cuboid(size_m: (1, 1, 1)))])";
        let scene = nephroid_scene::parse(lit, "lit", Path::new(""), &[]).unwrap();
        let inside = World::new(&scene, None, Level::new()).err().unwrap().to_string();
        assert!(inside.starts_with("light 0 at (0.1, 0, 0) is inside object 0"), "{inside}");
    }
}
