//! All surfaces of a scene in a tree, and paths of light through mirrors and glass.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};

use nephroid_math::optics::{beer_lambert_rgb, fresnel_reflectance, reflect, refract};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::geom::Mesh;
use nephroid_scene::{Light, Material};

use crate::audit::Entry;

/// Most events (reflections and refractions) on a path that ends as a beam.
const MOST_EVENTS: u32 = 12;

/// Most events on a path that ends on a receiver. Total reflection takes nothing away, so long paths in glass carry much light: 2.6 % of that which lands
/// behind a glass figure has met between 12 and 64 surfaces.
const MOST_EVENTS_OF_ARRIVALS: u32 = 64;

/// Light with less than this share of the arriving light is not followed.
const LEAST_SHARE: f32 = 1.0e-3;

/// Most bodies of glass within each other that are told apart.
const NESTING: usize = 4;

/// Offset of a ray's start from the surface that it leaves, as a share of its coordinates: some times the rounding error of a point on a ray. What is nearer
/// to a surface than that cannot be told from it.
const LIFT: f32 = 5.0e-7;

/// Rounding error of the distance to a triangle, as a share of the distance of its farthest corner. A ray that starts so close to a triangle starts on it: the
/// foot of a mirror that stands on a table is not in the table's shadow.
const HIT_ERROR: f32 = 3.0e-7;

/// Enlargement of triangles' boxes, as a share of the size of all surfaces: more than the rounding error between a ray and a triangle.
const BOX_SLACK: f32 = 2.0e-6;

/// Bytes of a triangle: in the mesh with half a vertex, by its number, its pieces, in the tree (two nodes and an index) and, while that is made, its box.
pub const TRIANGLE_BYTES: u64 = 12 + 12 + 8 + 2 + 2 * 32 + 4 + 32;

/// No triangle.
const NONE: u32 = u32::MAX;

/// Height at which light that starts on a receiver is looked at, as a share of the size of all surfaces.
const TOUCH: f32 = 1.0e-4;

/// Least downward component of a beam's direction: a nearly horizontal ray would reach the floor a thousand depths away.
const LEAST_FALL: f32 = 1.0e-3;

/// Light that has left mirrors and glass for good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// Hash of the path's events and of the pieces of surface at which they happen.
    pub hash: u64,
    /// Share of the arriving light that the path carries, linear RGB.
    pub share: Vec3,
    /// Position of the last event, m.
    pub position: Vec3,
    /// Unit direction of travel.
    pub direction: Vec3,
    /// Height of the receiver that it meets, m; `None` if it leaves the scene.
    pub lands_y: Option<f32>,
}

/// Light that arrives at a diffuse receiver after mirrors and glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Hash of the path's events and of the pieces of surface at which they happen, that of the receiver included.
    pub hash: u64,
    /// Where, m.
    pub position: Vec3,
    /// Unit direction of travel.
    pub direction: Vec3,
    /// Share of the light that met the first surface, linear RGB.
    pub share: Vec3,
    /// The part of `share` that is due to mirrors, without what glass reflects and absorbs.
    pub tint: Vec3,
    /// Whether its path is one that image space can follow: one reflection at a mirror, or one refraction into and one out of glass.
    pub plain: bool,
}

/// Where the light of a ray has gone from the first mirror or glass that it has met.
#[derive(Clone, Debug)]
pub struct Followed {
    /// Where it has met that, m.
    pub first: Vec3,
    /// Light on receivers.
    pub arrivals: Vec<Arrival>,
    /// Light that ends elsewhere.
    pub losses: Losses,
}

/// Shares of light that end without being seen, linear RGB, as the entries of the audit have them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    pub absorbed_before: Vec3,
    pub by_mirrors: Vec3,
    pub in_glass: Vec3,
    pub too_many_events: Vec3,
    pub too_weak: Vec3,
    pub wrong_side: Vec3,
    pub stays_in_glass: Vec3,
    pub absorbed_behind: Vec3,
    pub missed: Vec3,
}

impl Losses {
    /// Every share with its entry.
    pub fn each(&self) -> [(Entry, Vec3); 9] {
        [
            (Entry::AbsorbedBefore, self.absorbed_before),
            (Entry::ByMirrors, self.by_mirrors),
            (Entry::InGlass, self.in_glass),
            (Entry::TooManyEvents, self.too_many_events),
            (Entry::TooWeak, self.too_weak),
            (Entry::WrongSide, self.wrong_side),
            (Entry::StaysInGlass, self.stays_in_glass),
            (Entry::AbsorbedBehind, self.absorbed_behind),
            (Entry::Missed, self.missed),
        ]
    }
}

impl Path {
    /// Whether the light travels downwards, so that level planes can slice its beam.
    pub fn goes_down(&self) -> bool {
        self.direction.y < -LEAST_FALL
    }
}

/// All surfaces of a scene, with a tree over their triangles.
pub struct Surfaces {
    meshes: Vec<(Mesh, Material)>,
    /// By mesh and vertex, the smooth piece of surface that the vertex belongs to.
    pieces: Vec<Vec<u32>>,
    /// Mesh and triangle, by number in the tree.
    triangles: Vec<(u32, u32)>,
    tree: Bvh2,
    /// See [`TOUCH`], m.
    touch_m: f32,
    /// The mesh that is the surface of water.
    water: Option<u32>,
}

/// Intersection of a ray with a surface.
struct Meeting {
    position: Vec3,
    /// The triangle's place in the tree; [`NONE`] for a point of a generator, whose mesh is not in the tree.
    place: u32,
    mesh: u32,
    piece: u32,
    /// Interpolated normal. Both normals point out of the mesh.
    normal: Vec3,
    face: Vec3,
}

/// The state of light on its path.
#[derive(Clone, Copy)]
struct State {
    hash: u64,
    share: Vec3,
    position: Vec3,
    direction: Vec3,
    events: u32,
    /// See [`Arrival::tint`].
    tint: Vec3,
    /// See [`Arrival::plain`].
    plain: bool,
    inside: Bodies,
    /// The triangle that the light comes from, which its ray skips.
    skip: u32,
}

impl State {
    /// Light that has met nothing.
    fn new(position: Vec3, direction: Vec3) -> Self {
        let inside = Bodies::default();
        Self { hash: 1, share: Vec3::ONE, position, direction, events: 0, tint: Vec3::ONE, plain: true, inside, skip: NONE }
    }
}

/// The bodies of glass that light is in, innermost last.
#[derive(Clone, Copy, Default)]
struct Bodies {
    meshes: [u32; NESTING],
    depth: usize,
}

impl Bodies {
    fn innermost(&self) -> Option<u32> {
        self.meshes[..self.depth].last().copied()
    }

    fn entered(mut self, mesh: u32) -> Self {
        if self.depth < NESTING {
            self.meshes[self.depth] = mesh;
            self.depth += 1;
        }
        self
    }

    fn left(mut self, mesh: u32) -> Self {
        if let Some(place) = self.meshes[..self.depth].iter().position(|&body| body == mesh) {
            self.meshes.copy_within(place + 1..self.depth, place);
            self.depth -= 1;
        }
        self
    }

    /// These bodies, with one around them all or not.
    fn within(mut self, mesh: u32, is_in: bool) -> Self {
        self = self.left(mesh);
        if is_in && self.depth < NESTING {
            self.meshes.copy_within(0..self.depth, 1);
            self.meshes[0] = mesh;
            self.depth += 1;
        }
        self
    }

    /// These bodies, with one among them or not: rounding can lead a ray past an edge unseen.
    fn with(self, mesh: u32, is_in: bool) -> Self {
        match (is_in, self.meshes[..self.depth].contains(&mesh)) {
            (true, false) => self.entered(mesh),
            (false, true) => self.left(mesh),
            _ => self,
        }
    }
}

impl Surfaces {
    /// Surfaces from meshes in world space.
    pub fn new(meshes: Vec<(Mesh, Material)>) -> Self {
        let of_mesh = |(number, (mesh, _)): (usize, &(Mesh, Material))| (0..mesh.triangle_count() as u32).map(move |t| (number as u32, t));
        let triangles: Vec<(u32, u32)> = meshes.iter().enumerate().flat_map(of_mesh).collect();
        let size = meshes.iter().fold(0.0, |size: f32, (mesh, _)| size.max(mesh.bounds().size().max_element()));
        let slack = Vec3A::splat((size * BOX_SLACK).max(f32::MIN_POSITIVE));
        let boxes: Vec<Bounds> = triangles
            .iter()
            .map(|&(mesh, triangle)| {
                let [a, b, c] = corners(&meshes[mesh as usize].0, triangle).map(Vec3A::from);
                Bounds::new(a.min(b).min(c) - slack, a.max(b).max(c) + slack)
            })
            .collect();
        let indices = (0..boxes.len() as u32).collect();
        let tree = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Low, &boxes, indices, SortPrecision::U64, 0);
        let pieces = meshes.iter().map(|(mesh, _)| pieces(mesh)).collect();
        Self { meshes, pieces, triangles, tree, touch_m: size * TOUCH, water: None }
    }

    /// Whether a light reaches a point of a mirror or of glass, the paths that it takes from there, and the light that ends before.
    pub fn paths(&self, object: u32, position: Vec3, normal: Vec3, light: &Light, direction: Vec3) -> (bool, Vec<Path>, Losses) {
        let Material::Mirror { .. } = self.meshes[object as usize].1 else {
            // Light that arrives from the inside of glass has met another generator first.
            if direction.dot(normal) >= 0.0 {
                return (false, Vec::new(), Losses::default());
            }
            return self.paths_from(object, position, normal, light, direction);
        };
        self.paths_from(object, position, normal, light, direction)
    }

    fn paths_from(&self, object: u32, position: Vec3, normal: Vec3, light: &Light, direction: Vec3) -> (bool, Vec<Path>, Losses) {
        let facing = if direction.dot(normal) < 0.0 { normal } else { -normal };
        let distance = match *light {
            Light::Directional { .. } => f32::INFINITY,
            Light::Point { position: at, .. } | Light::Spot { position: at, .. } => at.distance(position),
        };
        // The start is moved off the surface and towards the light, so that the ground below an object does not block the light.
        let start = position + (facing - direction) * lift(position);
        let lit = self.nearest(start, -direction, distance, NONE).is_none();
        let start = State::new(position, direction);
        // All three vertices of a generator's triangle lie on the same piece, so piece 0 stands for it.
        let meeting = Meeting { position, place: NONE, mesh: object, piece: 0, normal, face: normal };
        let (mut found, mut losses) = (Vec::new(), Losses::default());
        let mut left: Vec<State> = Vec::new();
        self.event(start, &meeting, MOST_EVENTS, &mut left, &mut losses);
        while let Some(state) = left.pop() {
            match self.nearest(state.position, state.direction, f32::INFINITY, state.skip) {
                Some(meeting) if !self.is_diffuse(meeting.mesh) => {
                    self.event(state, &meeting, MOST_EVENTS, &mut left, &mut losses);
                }
                receiver if state.inside.innermost().is_none() => {
                    let State { hash, share, position, direction, skip, .. } = state;
                    // Mirrors and glass stand on receivers: light from their lowest corners starts there, or below by a rounding error.
                    let above = position + Vec3::Y * self.touch_m;
                    let receiver = receiver.or_else(|| self.nearest(above, direction, f32::INFINITY, skip));
                    found.push(Path { hash, share, position, direction, lands_y: receiver.map(|at| at.position.y) });
                }
                _ => losses.stays_in_glass += state.share,
            }
        }
        (lit, found, losses)
    }

    /// Follows a ray of a light to the first mirror, glass or water, and its light from there. `None` if it meets a receiver first, or nothing. The ray is
    /// followed from `start`, its light from where `emitted` says that it was emitted if it meets its first surface at a point.
    pub fn arrivals(&self, start: Vec3, direction: Vec3, emitted: impl Fn(Vec3) -> Vec3) -> Option<Followed> {
        let first = self.nearest(start, direction, f32::INFINITY, NONE).filter(|first| !self.is_diffuse(first.mesh))?;
        let start = State::new(emitted(first.position), direction);
        let (mut arrivals, mut left, mut losses) = (Vec::new(), Vec::new(), Losses::default());
        self.event(start, &first, MOST_EVENTS_OF_ARRIVALS, &mut left, &mut losses);
        while let Some(mut state) = left.pop() {
            let Some(meeting) = self.nearest(state.position, state.direction, f32::INFINITY, state.skip) else {
                let in_glass = state.inside.innermost().is_some_and(|body| self.water != Some(body));
                *(if in_glass { &mut losses.stays_in_glass } else { &mut losses.missed }) += state.share;
                continue;
            };
            if !self.is_diffuse(meeting.mesh) {
                self.event(state, &meeting, MOST_EVENTS_OF_ARRIVALS, &mut left, &mut losses);
                continue;
            }
            self.travel(&mut state, meeting.position, &mut losses);
            arrivals.push(Arrival {
                hash: step_hash(state.hash, meeting.mesh, meeting.piece, 6),
                position: meeting.position,
                direction: state.direction,
                share: state.share,
                tint: state.tint,
                plain: state.plain,
            });
        }
        Some(Followed { first: first.position, arrivals, losses })
    }

    fn is_diffuse(&self, mesh: u32) -> bool {
        matches!(self.meshes[mesh as usize].1, Material::Diffuse { .. })
    }

    /// Refractive index of the innermost body, or of air.
    fn index_in(&self, inside: Bodies) -> f32 {
        match inside.innermost().map(|body| &self.meshes[body as usize].1) {
            Some(Material::Dielectric { ior, .. }) => *ior,
            _ => 1.0,
        }
    }

    /// Share of light that is left after a distance in the innermost body.
    fn kept(&self, inside: Bodies, distance: f32) -> Vec3 {
        let Some(Material::Dielectric { absorption, .. }) = inside.innermost().map(|body| &self.meshes[body as usize].1) else {
            return Vec3::ONE;
        };
        let absorption = *absorption;
        let kept = beer_lambert_rgb(absorption, distance);
        Vec3::new(kept.x, kept.y, kept.z)
    }

    /// Takes from light what the innermost body absorbs on the way to a point.
    fn travel(&self, state: &mut State, to: Vec3, losses: &mut Losses) {
        let Some(body) = state.inside.innermost() else { return };
        let kept = self.kept(state.inside, to.distance(state.position));
        let absorbed = match (self.water == Some(body), state.events) {
            (true, 0) => &mut losses.absorbed_before,
            (true, _) => &mut losses.absorbed_behind,
            _ => &mut losses.in_glass,
        };
        *absorbed += state.share * (Vec3::ONE - kept);
        state.share *= kept;
    }

    /// These surfaces and that of water, whose normals point out of it. Glass displaces water.
    pub fn with_water(&self, mesh: Mesh, material: Material) -> Self {
        let number = self.meshes.len() as u32;
        Self { water: Some(number), ..Self::new(self.meshes.iter().cloned().chain([(mesh, material)]).collect()) }
    }

    /// The first surface that a ray meets, if it is a receiver.
    pub fn receiver(&self, start: Vec3, direction: Vec3) -> Option<Vec3> {
        let meeting = self.nearest(start, direction, f32::INFINITY, NONE)?;
        matches!(self.meshes[meeting.mesh as usize].1, Material::Diffuse { .. }).then_some(meeting.position)
    }

    /// Follows light through an event at a mirror or at glass.
    fn event(&self, mut state: State, at: &Meeting, most_events: u32, left: &mut Vec<State>, losses: &mut Losses) {
        if state.events >= most_events {
            losses.too_many_events += state.share;
            return;
        }
        let outside = state.direction.dot(at.face) < 0.0;
        if self.water == Some(at.mesh) && state.inside.innermost().is_some_and(|body| body != at.mesh) {
            // There is no water in glass, but the light may leave into it.
            self.travel(&mut state, at.position, losses);
            state.inside = state.inside.within(at.mesh, outside);
            state.position = at.position;
            state.skip = at.place;
            state.events += 1;
            left.push(state);
            return;
        }
        let (face, mut normal) = if outside { (at.face, at.normal) } else { (-at.face, -at.normal) };
        if normal.dot(state.direction) >= 0.0 {
            normal = face;
        }
        let cos = -normal.dot(state.direction);
        let (is_mirror, tint) = match self.meshes[at.mesh as usize].1 {
            Material::Mirror { reflectance } => (true, reflectance),
            _ => (false, Vec3::ONE),
        };
        if !is_mirror {
            state.inside = state.inside.with(at.mesh, !outside);
        }
        self.travel(&mut state, at.position, losses);
        let incoming = to_v3(state.direction);
        let events = state.events + 1;
        let mut follow = |event: u64, share: Vec3, direction: V3<f32>, through: bool, inside: Bodies| {
            let direction = Vec3::new(direction.x, direction.y, direction.z);
            // Light that the interpolated normal sends to the wrong side of the face is dropped.
            let goes_through = direction.dot(face) < 0.0;
            let position = at.position + face * if through { -lift(at.position) } else { lift(at.position) };
            let hash = step_hash(state.hash, at.mesh, at.piece, event);
            // Reflected first and last; or through the first surface, and through the second one from its inside.
            let first_or_second = events == 1 && through == inside.innermost().is_some() || events == 2 && through && inside.depth == 0;
            let plain = state.plain && first_or_second && (through || is_mirror);
            let next = State { hash, share, position, direction, events, tint: state.tint * tint, plain, inside, skip: at.place };
            if goes_through != through {
                losses.wrong_side += share;
            } else if share.max_element() < LEAST_SHARE {
                losses.too_weak += share;
            } else {
                left.push(next);
            }
        };
        let side = u64::from(outside);
        match self.meshes[at.mesh as usize].1 {
            Material::Mirror { reflectance } => {
                follow(side, state.share * reflectance, reflect(incoming, to_v3(normal)), false, state.inside);
                losses.by_mirrors += state.share * (Vec3::ONE - reflectance);
            }
            Material::Dielectric { ior, .. } => {
                let beyond = if outside { state.inside.entered(at.mesh) } else { state.inside.left(at.mesh) };
                let (n1, n2) = if outside { (self.index_in(state.inside), ior) } else { (ior, self.index_in(beyond)) };
                let (refracted, passes) = refract(incoming, to_v3(normal), n1 / n2);
                let reflectance = if passes { fresnel_reflectance(cos.min(1.0), n1, n2) } else { 1.0 };
                if passes {
                    follow(2 + side, state.share * (1.0 - reflectance), refracted, true, beyond);
                }
                follow(4 + side, state.share * reflectance, reflect(incoming, to_v3(normal)), false, state.inside);
            }
            Material::Diffuse { .. } => {}
        }
    }

    /// The first intersection along a ray, up to `limit` metres, without the triangle at the place `skip` of the tree; `None` if there is none.
    fn nearest(&self, origin: Vec3, direction: Vec3, limit: f32, skip: u32) -> Option<Meeting> {
        let number = |place: usize| self.triangles[self.tree.primitive_indices[place] as usize];
        let meet = |place: usize| {
            let (mesh, triangle) = number(place);
            meet(origin, direction, corners(&self.meshes[mesh as usize].0, triangle))
        };
        let mut hit = RayHit::none();
        let ray = Ray::new(origin.into(), direction.into(), 0.0, limit);
        self.tree.ray_traverse(ray, &mut hit, |_, place| {
            if place as u32 == skip { f32::INFINITY } else { meet(place).map_or(f32::INFINITY, |(t, _)| t) }
        });
        if hit.primitive_id == obvhs::ray::INVALID_ID {
            return None;
        }
        let place = hit.primitive_id as usize;
        let (t, [u, v, w]) = meet(place)?;
        let (number, triangle) = number(place);
        let mesh = &self.meshes[number as usize].0;
        let [i, j, k] = [0, 1, 2].map(|corner| mesh.indices[3 * triangle as usize + corner] as usize);
        let [a, b, c] = corners(mesh, triangle);
        let normal = mesh.normals[i] * u + mesh.normals[j] * v + mesh.normals[k] * w;
        let face = (b - a).cross(c - a).normalize_or(mesh.normals[i]);
        Some(Meeting {
            position: origin + direction * t,
            place: place as u32,
            mesh: number,
            piece: self.pieces[number as usize][i] + 1,
            normal: normal.normalize_or(face),
            face,
        })
    }
}

/// Distance by which a ray's start is moved off the surface at a point, m.
fn lift(p: Vec3) -> f32 {
    (LIFT * p.abs().max_element()).max(f32::MIN_POSITIVE)
}

/// The hash of a path with one more event at a piece of a mesh.
fn step_hash(hash: u64, mesh: u32, piece: u32, event: u64) -> u64 {
    let key = (u64::from(mesh) << 32 | u64::from(piece)) << 3 | event;
    (hash ^ key).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29).wrapping_add(key)
}

/// Distance along a ray to a triangle, and barycentric weights of the intersection; `None` if the ray misses.
///
/// Vertices are taken relative to the ray's start, and both triangles at an edge compute the same number for it, with opposite signs. Whatever the
/// rounding, no ray passes between two triangles that share an edge or a vertex.
fn meet(origin: Vec3, direction: Vec3, corners: [Vec3; 3]) -> Option<(f32, [f32; 3])> {
    let [a, b, c] = corners.map(|corner| corner - origin);
    let edges = [direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))];
    let one_side = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
    let sum = edges[0] + edges[1] + edges[2];
    if !one_side || sum == 0.0 {
        return None;
    }
    let weights = edges.map(|e| e / sum);
    let t = direction.dot(a * weights[0] + b * weights[1] + c * weights[2]);
    let farthest = a.abs().max(b.abs()).max(c.abs()).max_element();
    (t > HIT_ERROR * farthest).then_some((t, weights))
}

fn to_v3(v: Vec3) -> V3<f32> {
    v3(v.x, v.y, v.z)
}

fn corners(mesh: &Mesh, triangle: u32) -> [Vec3; 3] {
    [0, 1, 2].map(|corner| mesh.positions[mesh.indices[3 * triangle as usize + corner] as usize])
}

/// By vertex, the smooth piece of surface that it belongs to. Triangles that share a vertex belong to one piece; shapes have separate vertices on
/// both sides of a sharp edge.
fn pieces(mesh: &Mesh) -> Vec<u32> {
    fn root(parents: &mut [u32], mut v: u32) -> u32 {
        while parents[v as usize] != v {
            parents[v as usize] = parents[parents[v as usize] as usize];
            v = parents[v as usize];
        }
        v
    }
    let mut parents: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for t in mesh.triangles() {
        for (a, b) in [(t[0], t[1]), (t[1], t[2])] {
            let (a, b) = (root(&mut parents, a), root(&mut parents, b));
            // The lower number becomes the root, so a piece has the number of its first vertex.
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    (0..parents.len() as u32).map(|v| root(&mut parents, v)).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use nephroid_scene::Albedo;
    use nephroid_scene::geom::shapes::{Cuboid, Cylinder, Grid};

    use super::*;

    /// A block of the water's index that stands in water and above it: light is bent at its top, and nowhere below.
    #[test]
    fn glass_displaces_the_water_around_it() {
        let at = |mesh: Mesh, y: f32| mesh.transformed(glam::Mat4::from_translation(Vec3::new(0.0, y, 0.0)));
        let grid = |side: f32| Grid { size_m: Vec2::splat(side), ..Grid::default() }.mesh().expect("a grid");
        let clear = |ior| Material::Dielectric { ior, abbe: None, absorption: Vec3::ZERO };
        let block = Cuboid { size_m: Vec3::new(4.0, 1.6, 4.0) }.mesh().expect("a block");
        let floor = (at(grid(20.0), -1.0), Material::Diffuse { albedo: Albedo::Solid(Vec3::ONE) });
        let direction = Vec3::new(0.5, -0.75_f32.sqrt(), 0.0);
        let start = Vec3::new(0.0, 0.8, 0.0) - direction;
        let lands = |ior: f32, water: f32| {
            let surfaces = Surfaces::new(vec![(block.clone(), clear(ior)), floor.clone()]).with_water(grid(20.0), clear(water));
            let followed = surfaces.arrivals(start, direction, |_| start).expect("the block is met");
            let brightest = followed.arrivals.iter().max_by(|a, b| a.share.x.total_cmp(&b.share.x)).expect("light lands");
            (brightest.position.x, brightest.share.x)
        };
        let (x, share) = lands(1.333, 1.333);
        let sine = 0.5 / 1.333_f32;
        let expected = 1.8 * sine / (1.0 - sine * sine).sqrt();
        assert!((x - expected).abs() < 1.0e-3, "{x} {expected}");
        // Fresnel's loss at the top alone; in water of another index there is one more, and light is bent again where it leaves the block.
        assert!((share - 0.978).abs() < 1.0e-3, "{share}");
        let (bent, less) = lands(1.333, 1.0);
        assert!((bent - x).abs() > 0.03 && less < share - 0.01, "{bent} {less}");
    }

    /// A mirror that stands on a table, whose triangles reach far beyond it: light reaches all of the mirror's foot. A board just above the foot shades it.
    #[test]
    fn tables_do_not_shade_what_stands_on_them() {
        let table = |size: f32, y: f32| {
            let grid = Grid { size_m: Vec2::splat(size), ..Grid::default() }.mesh().expect("a grid");
            (
                grid.transformed(glam::Mat4::from_translation(Vec3::new(0.37, y, -0.21))),
                Material::Diffuse { albedo: Albedo::Solid(Vec3::ONE) },
            )
        };
        let mirror = Material::Mirror { reflectance: Vec3::ONE };
        let ring = Cylinder { radius_m: 0.5, height_m: 0.2, slices: 64, open: true }.mesh().expect("a ring");
        let lit = |other: (Mesh, Material)| {
            let surfaces = Surfaces::new(vec![(ring.clone(), mirror.clone()), other]);
            let (mut feet, mut lit) = (0, 0);
            for turn in 0..40 {
                let (sin, cos) = nephroid_math::space::sin_cos_deg(9.0 * turn as f32 + 1.0);
                let direction = Vec3::new(0.8 * sin as f32, -0.6, 0.8 * cos as f32);
                let sun = Light::Directional { aim: nephroid_scene::Aim::Along(direction), irradiance: Vec3::ONE };
                for (&position, &normal) in ring.positions.iter().zip(&ring.normals) {
                    // The outer side is lit where it faces the sun.
                    if position.y.abs() < 1.0e-6 && normal.dot(position) > 0.0 && normal.dot(direction) < -0.1 {
                        feet += 1;
                        lit += usize::from(surfaces.paths(0, position, normal, &sun, direction).0);
                    }
                }
            }
            (feet, lit)
        };
        for size in [2.0, 8.0, 30.0] {
            let (feet, lit) = lit(table(size, 0.0));
            assert!(feet > 500 && lit == feet, "{size} m: {lit} of {feet} places at the foot are lit");
        }
        assert_eq!(lit(table(8.0, 0.001)).1, 0, "a board above the foot does not shade it");
    }
}
