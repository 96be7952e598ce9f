//! Traversal of the tree by one ray: sixteen boxes, or sixteen triangles, at a time.

use arrayvec::ArrayVec;
use fearless_simd::{Level, Simd, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::level::wide_dispatch;
use nephroid_math::vector::V3;

use super::{Hit, LEAF, Leaf, NONE, Node, Probe, STACK, Tree, WIDTH, load, meet_boxes, meet_triangles};

/// The nearest triangle along a ray; its number is [`NONE`] if there is none.
#[inline]
pub(super) fn nearest(level: Level, tree: &Tree, ray: [Vec3; 2], limit: f32, skip: u32) -> Hit {
    wide_dispatch!(level, simd => wide(simd, tree, ray, limit, skip), whole::<f32>((), tree, ray, limit, skip))
}

#[simd]
fn wide<S: Simd>(simd: S, tree: &Tree, ray: [Vec3; 2], limit: f32, skip: u32) -> Hit {
    whole::<f32x16<S>>(simd, tree, ray, limit, skip)
}

#[inline(always)]
fn whole<L: Lanes>(token: L::Token, tree: &Tree, [origin, direction]: [Vec3; 2], limit: f32, skip: u32) -> Hit {
    let probe = Probe::new(V3::splat(token, origin), V3::splat(token, direction));
    let mut best = Hit { t: limit, triangle: NONE };
    walk::<L>(token, tree, tree.root(), &probe, skip, &mut best);
    best
}

/// Searches below one node, or in one leaf, for an intersection nearer than `best`. All lanes of the probe hold the same ray.
#[inline(always)]
pub(super) fn walk<L: Lanes>(token: L::Token, tree: &Tree, root: u32, probe: &Probe<L>, skip: u32, best: &mut Hit) {
    let mut stack = ArrayVec::<(u32, f32), STACK>::new();
    stack.push((root, 0.0));
    while let Some((reference, entry)) = stack.pop() {
        if entry > best.t {
            continue;
        }
        if reference & LEAF != 0 {
            meet_leaf::<L>(token, &tree.leaves[(reference & !LEAF) as usize], probe, skip, best);
            continue;
        }
        let node = &tree.nodes[reference as usize];
        let (entries, mut hits) = meet_node::<L>(token, node, probe, best.t);
        // The nearest box is on top of the stack.
        let bottom = stack.len();
        while hits != 0 {
            let child = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            stack.push((node.children[child], entries[child]));
            let mut place = stack.len() - 1;
            while place > bottom && stack[place - 1].1 < stack[place].1 {
                stack.swap(place - 1, place);
                place -= 1;
            }
        }
    }
}

/// Distances at which a ray enters sixteen boxes, and one bit for each box met up to `limit`.
#[inline(always)]
fn meet_node<L: Lanes>(token: L::Token, node: &Node, probe: &Probe<L>, limit: f32) -> ([f32; WIDTH], u32) {
    let mut entries = [0.0; WIDTH];
    let mut bits = 0;
    for first in (0..WIDTH).step_by(L::LEN) {
        let (low, high) = (load::<L>(token, &node.low, first), load::<L>(token, &node.high, first));
        let (enter, meets) = meet_boxes(low, high, probe, L::splat(token, limit));
        enter.store(&mut entries[first..]);
        bits |= meets.bits() << first;
    }
    (entries, bits & node.exists)
}

/// Intersects a ray with the triangles of a leaf and keeps the nearest intersection.
#[inline(always)]
pub(super) fn meet_leaf<L: Lanes>(token: L::Token, leaf: &Leaf, probe: &Probe<L>, skip: u32, best: &mut Hit) {
    for first in (0..WIDTH).step_by(L::LEN) {
        let corners = [
            load::<L>(token, &leaf.corners[0], first),
            load::<L>(token, &leaf.corners[1], first),
            load::<L>(token, &leaf.corners[2], first),
        ];
        let (t, mut hits) = meet_triangles(corners, probe, L::splat(token, best.t));
        if hits == 0 {
            continue;
        }
        let distances = t.to_array();
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let number = leaf.numbers[first + lane];
            if number != skip && number != NONE {
                best.keep(distances[lane], number);
            }
        }
    }
}
