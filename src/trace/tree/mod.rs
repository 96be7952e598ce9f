//! Intersects rays with many triangles: a tree with sixteen boxes per node and up to sixteen triangles per leaf.
//!
//! `obvhs` builds a binary hierarchy; its nodes are merged until they have sixteen children. A single ray ([`walk`]) is tested against all boxes of a
//! node, or all triangles of a leaf, in the lanes of one register. Sixteen rays of similar direction ([`packet`]) traverse the tree together: each
//! box is tested once for all of them, and rays that diverge from the others continue alone.
//!
//! The triangle that a ray meets depends only on the ray and the triangles: of two triangles at one distance, the one with the lower number is met.
//! So both traversals give the same bits, whatever rays form a packet.

mod build;
mod packet;
mod walk;

use fearless_simd::Level;
use glam::Vec3;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V3, v3};

pub(super) use build::Numbered;
pub(super) use packet::{Hits, Packet};

/// Boxes per node and triangles per leaf.
const WIDTH: usize = 16;

/// Capacity of a traversal stack: fifteen entries for each level. A tree is at most as deep as the binary one; with the largest number of triangles
/// allowed it has about seven levels, so this is more than enough.
const STACK: usize = 512;

/// Lower bound on the magnitude of direction components, so that their inverses are finite.
const LEAST_COMPONENT: f32 = 1.0e-12;

/// Number that stands for no triangle or no object.
pub(super) const NONE: u32 = u32::MAX;

/// Sixteen boxes and their children; each array is one cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Node {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
    /// Index of a node, or of a leaf with [`LEAF`] set.
    children: [u32; WIDTH],
    /// One bit for each child that exists.
    exists: u32,
}

impl Node {
    const EMPTY: Self = Self { low: [[0.0; WIDTH]; 3], high: [[0.0; WIDTH]; 3], children: [0; WIDTH], exists: 0 };
}

/// Bit that marks the index of a leaf.
const LEAF: u32 = 1 << 31;

/// Up to sixteen triangles: coordinates of corners a, b and c.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Leaf {
    corners: [[[f32; WIDTH]; 3]; 3],
    /// Number of each triangle; [`NONE`] for unused places.
    numbers: [u32; WIDTH],
    /// Number of triangles.
    count: u32,
}

/// A tree over triangles.
pub(super) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

/// Intersection of a ray with a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Distance, m.
    pub t: f32,
    /// Number of the triangle.
    pub triangle: u32,
}

impl Hit {
    /// Keeps the nearer of two intersections; of two at one distance, the one with the lower number. The first must be nearer than the limit.
    #[inline(always)]
    fn keep(&mut self, t: f32, triangle: u32) {
        if t < self.t || (t == self.t && triangle < self.triangle && self.triangle != NONE) {
            *self = Self { t, triangle };
        }
    }
}

impl Tree {
    /// The node or leaf at which a traversal starts.
    fn root(&self) -> u32 {
        if self.leaves.len() == 1 { LEAF } else { 0 }
    }

    /// Builds a tree over triangles. Boxes are enlarged by `slack` metres. `None` without triangles.
    pub fn new(triangles: &[Numbered], slack: f32) -> Option<Self> {
        (!triangles.is_empty()).then(|| build::build(triangles, slack))
    }

    /// The nearest triangle along a ray, up to `limit` metres. The triangle numbered `skip` is ignored.
    #[inline]
    pub fn nearest(&self, level: Level, origin: Vec3, direction: Vec3, limit: f32, skip: u32) -> Option<Hit> {
        let hit = walk::nearest(level, self, [origin, direction], limit, skip);
        (hit.triangle != NONE).then_some(hit)
    }

    /// [`Tree::nearest`] for the rays of a packet in `active`, one bit each. Results are written to `hits`.
    #[inline]
    pub fn nearest_of_packet(&self, level: Level, packet: &Packet<'_>, active: u32, hits: &mut Hits) {
        packet::nearest(level, self, packet, active, hits);
    }
}

/// Rays, one per lane, with values that all tests use.
#[derive(Clone, Copy)]
struct Probe<L> {
    origin: V3<L>,
    direction: V3<L>,
    /// Two unit vectors perpendicular to the direction.
    across: [V3<L>; 2],
    /// One over the components of the direction.
    inverse: V3<L>,
}

impl<L: Lanes> Probe<L> {
    #[inline(always)]
    fn new(origin: V3<L>, direction: V3<L>) -> Self {
        let (x, y) = across(direction);
        let inverse = v3(inverse(direction.x), inverse(direction.y), inverse(direction.z));
        Self { origin, direction, across: [x, y], inverse }
    }
}

#[inline(always)]
fn inverse<L: Lanes>(component: L) -> L {
    let least = component.like(LEAST_COMPONENT);
    component.like(1.0) / L::select(component.abs().lt(least), least, component)
}

/// Two unit vectors perpendicular to a third and to each other [Duff et al. 2017].
#[inline(always)]
fn across<L: Lanes>(n: V3<L>) -> (V3<L>, V3<L>) {
    let sign = L::select(n.z.lt(n.z.like(0.0)), n.z.like(-1.0), n.z.like(1.0));
    let a = n.z.like(-1.0) / (sign + n.z);
    let b = n.x * n.y * a;
    (v3(sign * n.x * n.x * a + 1.0, sign * b, -(sign * n.x)), v3(b, sign + n.y * n.y * a, -n.y))
}

/// Distances at which rays enter boxes, and a mask of the boxes met before `limit`: one ray and many boxes, or many rays and one box.
#[inline(always)]
fn meet_boxes<L: Lanes>(low: V3<L>, high: V3<L>, probe: &Probe<L>, limit: L) -> (L, L::Mask) {
    let (a, b) = (low - probe.origin, high - probe.origin);
    let (ax, bx) = (a.x * probe.inverse.x, b.x * probe.inverse.x);
    let (ay, by) = (a.y * probe.inverse.y, b.y * probe.inverse.y);
    let (az, bz) = (a.z * probe.inverse.z, b.z * probe.inverse.z);
    let enter = Lanes::max(Lanes::max(Lanes::min(ax, bx), Lanes::min(ay, by)), Lanes::max(Lanes::min(az, bz), limit.like(0.0)));
    let leave = Lanes::min(Lanes::min(Lanes::max(ax, bx), Lanes::max(ay, by)), Lanes::min(Lanes::max(az, bz), limit));
    (enter, enter.le(leave))
}

/// Distances at which rays meet triangles `[a, b, c]` from either side, and a mask of those met up to `limit`.
///
/// Seen along the ray, the triangle is planar and the ray a point. The point is inside if it lies on one side of all edges. Two triangles at an edge
/// compute the side from the same numbers up to the sign, so no ray passes between them [Woop et al. 2013]. Coordinates are relative to the ray, so
/// small triangles far from its origin keep their digits.
#[inline(always)]
fn meet_triangles<L: Lanes>(corners: [V3<L>; 3], probe: &Probe<L>, limit: L) -> (L, u32) {
    let [a, b, c] = [corners[0] - probe.origin, corners[1] - probe.origin, corners[2] - probe.origin];
    let [x, y] = probe.across;
    let (ax, ay) = (a.dot(x), a.dot(y));
    let (bx, by) = (b.dot(x), b.dot(y));
    let (cx, cy) = (c.dot(x), c.dot(y));
    let u = bx * cy - by * cx;
    let v = cx * ay - cy * ax;
    let w = ax * by - ay * bx;
    let zero = limit.like(0.0);
    let inside = (u.ge(zero) & v.ge(zero) & w.ge(zero)) | (u.le(zero) & v.le(zero) & w.le(zero));
    if !inside.any() {
        return (limit, 0);
    }
    let normal = (b - a).cross(c - a);
    let t = normal.dot(a) / normal.dot(probe.direction);
    (t, (inside & t.gt(zero) & t.le(limit)).bits())
}

/// Three coordinates of [`Lanes::LEN`] points, from `first` on.
#[inline(always)]
fn load<L: Lanes>(token: L::Token, points: &[[f32; WIDTH]; 3], first: usize) -> V3<L> {
    v3(L::load(token, &points[0][first..]), L::load(token, &points[1][first..]), L::load(token, &points[2][first..]))
}
