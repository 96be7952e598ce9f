//! Traversal of the tree by sixteen rays together.
//!
//! A packet first tests the sixteen boxes of a node at once, by intervals of the rays' origins and directions, and then tests each of the remaining
//! boxes for all rays at once. Few rays in a box continue one by one.

use arrayvec::ArrayVec;
use fearless_simd::{Level, Simd, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::level::wide_dispatch;
use nephroid_math::vector::V3;

use super::walk::{self, meet_leaf, walk};
use super::{Hit, LEAF, Leaf, NONE, Node, Probe, STACK, Tree, WIDTH, load, meet_boxes, meet_triangles};

/// Number of rays of a packet.
const RAYS: usize = 16;

/// Sixteen rays, one per element of each array.
pub(crate) struct Packet<'a> {
    /// Start points, world space, m: one array per coordinate.
    pub origin: [&'a [f32; RAYS]; 3],
    /// Unit direction vectors: one array per coordinate.
    pub direction: [&'a [f32; RAYS]; 3],
    /// The triangle that each ray ignores.
    pub skip: &'a [u32; RAYS],
}

/// Intersections of sixteen rays.
pub(crate) struct Hits {
    /// Distance to the triangle, m. As input: the greatest distance to search.
    pub t: [f32; RAYS],
    /// Number of the triangle; [`NONE`] if the ray meets none.
    pub triangles: [u32; RAYS],
}

impl Hits {
    #[inline(always)]
    fn keep(&mut self, ray: usize, t: f32, triangle: u32) {
        let mut best = self.of(ray);
        best.keep(t, triangle);
        (self.t[ray], self.triangles[ray]) = (best.t, best.triangle);
    }

    #[inline(always)]
    fn of(&self, ray: usize) -> Hit {
        Hit { t: self.t[ray], triangle: self.triangles[ray] }
    }

    #[inline(always)]
    fn put(&mut self, ray: usize, hit: Hit) {
        (self.t[ray], self.triangles[ray]) = (hit.t, hit.triangle);
    }
}

/// Finds the nearest triangle along each ray in `active`.
#[inline]
pub(super) fn nearest(level: Level, tree: &Tree, packet: &Packet<'_>, active: u32, hits: &mut Hits) {
    wide_dispatch!(level, simd => wide(simd, tree, packet, active, hits), {
        for ray in bits(active) {
            let at = |v: &[&[f32; RAYS]; 3]| Vec3::new(v[0][ray], v[1][ray], v[2][ray]);
            let rays = [at(&packet.origin), at(&packet.direction)];
            hits.put(ray, walk::nearest(level, tree, rays, hits.t[ray], packet.skip[ray]));
        }
    });
}

/// Indices of the set bits of a word.
fn bits(mut word: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (word != 0).then(|| word.trailing_zeros() as usize);
        word &= word.wrapping_sub(1);
        bit
    })
}

#[simd]
fn wide<S: Simd>(simd: S, tree: &Tree, packet: &Packet<'_>, active: u32, hits: &mut Hits) {
    walk_packet::<f32x16<S>>(simd, tree, packet, active, hits);
}

/// At most this many rays in a box are followed one by one.
const FEW: u32 = 4;

/// A node or leaf to visit, and the distance at which each ray enters its box: NaN for rays that miss the box.
#[derive(Clone, Copy)]
struct Entry {
    reference: u32,
    entries: [f32; RAYS],
}

#[inline(always)]
fn walk_packet<L: Lanes>(token: L::Token, tree: &Tree, packet: &Packet<'_>, active: u32, hits: &mut Hits) {
    if active == 0 {
        return;
    }
    let first = active.trailing_zeros() as usize;
    let [origin, direction] = [packet.origin, packet.direction].map(|v| v.map(|v| filled(*v, active, v[first])));
    let mut found = Hits { t: filled(hits.t, active, NOWHERE), triangles: [NONE; RAYS] };
    let probe: Probe<L> = Probe::new(load(token, &origin, 0), load(token, &direction, 0));
    let (singles, bounds) = (Singles::new(&probe), Intervals::new(&origin, &probe));
    let mut stack = ArrayVec::<Entry, STACK>::new();
    stack.push(Entry { reference: tree.root(), entries: [0.0; RAYS] });
    while let Some(Entry { reference, entries }) = stack.pop() {
        let rays = L::load(token, &entries).le(L::load(token, &found.t)).bits();
        let few = rays.count_ones() <= FEW;
        if reference & LEAF == 0 && !few {
            push_children::<L>(token, &tree.nodes[reference as usize], &probe, &bounds, &found.t, &mut stack);
            continue;
        }
        let leaf = (reference & LEAF != 0).then(|| &tree.leaves[(reference & !LEAF) as usize]);
        if let Some(leaf) = leaf
            && rays.count_ones() > leaf.count
        {
            meet_leaf_together::<L>(token, leaf, &probe, packet.skip, rays, &mut found);
            continue;
        }
        for ray in bits(rays) {
            let (single, skip, mut best) = (singles.probe::<L>(token, ray), packet.skip[ray], found.of(ray));
            match leaf {
                Some(leaf) => meet_leaf(token, leaf, &single, skip, &mut best),
                None => walk(token, tree, reference, &single, skip, &mut best),
            }
            found.put(ray, best);
        }
    }
    for ray in bits(active) {
        hits.put(ray, found.of(ray));
    }
}

/// Search distance of inactive rays: no box is so near.
const NOWHERE: f32 = -1.0;

/// Values of the active rays; inactive rays get `value`.
#[inline(always)]
fn filled(mut numbers: [f32; RAYS], active: u32, value: f32) -> [f32; RAYS] {
    for ray in bits(!active & 0xffff) {
        numbers[ray] = value;
    }
    numbers
}

/// Pushes the boxes of a node that any active ray meets. The nearest is on top of the stack.
#[inline(always)]
fn push_children<L: Lanes>(
    token: L::Token,
    node: &Node,
    probe: &Probe<L>,
    bounds: &Intervals,
    limits: &[f32; RAYS],
    stack: &mut ArrayVec<Entry, STACK>,
) {
    let limit = L::load(token, limits);
    let mut entered = [[0.0; RAYS]; WIDTH];
    let mut order = ArrayVec::<(f32, usize), WIDTH>::new();
    for child in bits(bounds.meet::<L>(token, node) & node.exists) {
        let (low, high) = (place(token, &node.low, child), place(token, &node.high, child));
        let (enter, meets) = meet_boxes(low, high, probe, limit);
        let rays = meets.bits();
        if rays == 0 {
            continue;
        }
        L::select(meets, enter, L::splat(token, f32::NAN)).store(&mut entered[child]);
        // The rays of a packet have similar distances, so one of them decides the order.
        let near = entered[child][rays.trailing_zeros() as usize];
        let rank = order.iter().position(|&(other, _)| other < near).unwrap_or(order.len());
        order.insert(rank, (near, child));
    }
    for (_, child) in order {
        stack.push(Entry { reference: node.children[child], entries: entered[child] });
    }
}

/// Intersects each triangle of a leaf with all rays in `rays`.
#[inline(always)]
fn meet_leaf_together<L: Lanes>(token: L::Token, leaf: &Leaf, probe: &Probe<L>, skip: &[u32; RAYS], rays: u32, found: &mut Hits) {
    for slot in 0..leaf.count as usize {
        let [a, b, c] = &leaf.corners;
        let corners = [place(token, a, slot), place(token, b, slot), place(token, c, slot)];
        let (t, hits) = meet_triangles(corners, probe, L::load(token, &found.t));
        if hits & rays == 0 {
            continue;
        }
        let distances = t.to_array();
        for ray in bits(hits & rays) {
            if leaf.numbers[slot] != skip[ray] {
                found.keep(ray, distances[ray], leaf.numbers[slot]);
            }
        }
    }
}

#[inline(always)]
fn arrays<L: Lanes>(v: V3<L>) -> [[f32; RAYS]; 3] {
    [v.x.to_array(), v.y.to_array(), v.z.to_array()]
}

/// Element `index` of an array, in all lanes.
#[inline(always)]
fn place<L: Lanes>(token: L::Token, of: &[[f32; RAYS]; 3], index: usize) -> V3<L> {
    V3::splat(token, Vec3::new(of[0][index], of[1][index], of[2][index]))
}

/// The packet's probe, from which probes of single rays are taken.
struct Singles([[[f32; RAYS]; 3]; 5]);

impl Singles {
    #[inline(always)]
    fn new<L: Lanes>(probe: &Probe<L>) -> Self {
        let [x, y] = probe.across;
        Self([arrays(probe.origin), arrays(probe.direction), arrays(x), arrays(y), arrays(probe.inverse)])
    }

    /// One ray in all lanes.
    #[inline(always)]
    fn probe<L: Lanes>(&self, token: L::Token, ray: usize) -> Probe<L> {
        let [origin, direction, x, y, inverse] = &self.0;
        Probe {
            origin: place(token, origin, ray),
            direction: place(token, direction, ray),
            across: [place(token, x, ray), place(token, y, ray)],
            inverse: place(token, inverse, ray),
        }
    }
}

/// Intervals that contain the values of all active rays.
struct Intervals {
    origin: [[f32; 2]; 3],
    /// Intervals of the inverse directions; `None` for an axis along which the rays have both signs.
    inverse: [Option<[f32; 2]>; 3],
}

impl Intervals {
    #[inline(always)]
    fn new<L: Lanes>(origin: &[[f32; RAYS]; 3], probe: &Probe<L>) -> Self {
        let inverse = [probe.inverse.x, probe.inverse.y, probe.inverse.z];
        let mut intervals = Self { origin: [[0.0; 2]; 3], inverse: [None; 3] };
        for axis in 0..3 {
            intervals.origin[axis] = interval(origin[axis]);
            let [least, most] = interval(inverse[axis].to_array());
            intervals.inverse[axis] = (least > 0.0 || most < 0.0).then_some([least, most]);
        }
        intervals
    }

    /// One bit for each box of a node that a ray could meet. Differences and products are rounded in the same way for all rays, so a box is rejected
    /// only if every ray's own test would reject it.
    #[inline(always)]
    fn meet<L: Lanes>(&self, token: L::Token, node: &Node) -> u32 {
        let mut hits = 0;
        for first in (0..WIDTH).step_by(L::LEN) {
            let (mut enter, mut leave) = (L::splat(token, 0.0), L::splat(token, f32::INFINITY));
            for axis in 0..3 {
                let Some([least, most]) = self.inverse[axis] else { continue };
                let [low, high] = self.origin[axis];
                let (near, far) = if least > 0.0 {
                    (L::load(token, &node.low[axis][first..]) - high, L::load(token, &node.high[axis][first..]) - low)
                } else {
                    (L::load(token, &node.high[axis][first..]) - low, L::load(token, &node.low[axis][first..]) - high)
                };
                enter = Lanes::max(enter, Lanes::min(near * least, near * most));
                leave = Lanes::min(leave, Lanes::max(far * least, far * most));
            }
            hits |= enter.le(leave).bits() << first;
        }
        hits
    }
}

/// Least and greatest of sixteen numbers.
#[inline(always)]
fn interval(numbers: [f32; RAYS]) -> [f32; 2] {
    let (mut least, mut most) = (numbers, numbers);
    for half in [8, 4, 2, 1] {
        for k in 0..half {
            least[k] = if least[k + half] < least[k] { least[k + half] } else { least[k] };
            most[k] = if most[k + half] > most[k] { most[k + half] } else { most[k] };
        }
    }
    [least[0], most[0]]
}
