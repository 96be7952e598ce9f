//! Converts the library's binary hierarchy to nodes of sixteen boxes.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::{LEAF, Leaf, NONE, Node, Tree, WIDTH};

/// A triangle's corners, and its number.
pub(crate) type Numbered = ([Vec3; 3], u32);

/// A tree over triangles whose boxes are enlarged by `slack` metres.
pub(super) fn build(triangles: &[Numbered], slack: f32) -> Tree {
    let boxes: Vec<Bounds> = triangles
        .iter()
        .map(|(corners, _)| {
            let [a, b, c] = corners.map(Vec3A::from);
            Bounds::new(a.min(b).min(c) - Vec3A::splat(slack), a.max(b).max(c) + Vec3A::splat(slack))
        })
        .collect();
    let indices = (0..boxes.len() as u32).collect();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Low, &boxes, indices, SortPrecision::U64, 0);
    ReinsertionOptimizer::default().run(&mut binary, 0.1, None);
    let mut tree = Tree { nodes: vec![Node::EMPTY], leaves: Vec::new() };
    Builder { binary: &binary, triangles, counts: counts(&binary) }.fill(&mut tree, 0, 0);
    tree
}

/// Number of triangles below each node of the binary tree.
fn counts(binary: &Bvh2) -> Vec<u32> {
    let mut counts = vec![0; binary.nodes.len()];
    let mut stack = vec![(0_usize, false)];
    while let Some((index, done)) = stack.pop() {
        let node = &binary.nodes[index];
        if node.is_leaf() {
            counts[index] = node.prim_count;
            continue;
        }
        let first = node.first_index as usize;
        if done {
            counts[index] = counts[first] + counts[first + 1];
        } else {
            stack.extend([(index, true), (first, false), (first + 1, false)]);
        }
    }
    counts
}

struct Builder<'a> {
    binary: &'a Bvh2,
    triangles: &'a [Numbered],
    counts: Vec<u32>,
}

impl Builder<'_> {
    /// Fills a node with the subtree of a node of the binary tree.
    fn fill(&self, tree: &mut Tree, node: usize, root: u32) {
        let mut work = vec![(node, root)];
        while let Some((node, root)) = work.pop() {
            for (slot, child) in self.open(root).into_iter().enumerate() {
                let bounds = self.binary.nodes[child as usize].aabb();
                let reference = if self.counts[child as usize] as usize <= WIDTH {
                    tree.leaves.push(self.leaf(child));
                    (tree.leaves.len() - 1) as u32 | LEAF
                } else {
                    tree.nodes.push(Node::EMPTY);
                    work.push((tree.nodes.len() - 1, child));
                    (tree.nodes.len() - 1) as u32
                };
                let node = &mut tree.nodes[node];
                for axis in 0..3 {
                    (node.low[axis][slot], node.high[axis][slot]) = (bounds.min[axis], bounds.max[axis]);
                }
                node.children[slot] = reference;
                node.exists |= 1 << slot;
            }
        }
    }

    /// Replaces the largest boxes below a node by their children until there are sixteen boxes or only leaves remain.
    fn open(&self, root: u32) -> Vec<u32> {
        let mut open = vec![root];
        while open.len() < WIDTH {
            let area = |&index: &u32| self.binary.nodes[index as usize].aabb().half_area();
            let divisible = |&&index: &&u32| self.counts[index as usize] as usize > WIDTH;
            let largest = (0..open.len()).filter(|&k| divisible(&&open[k])).max_by(|&a, &b| area(&open[a]).total_cmp(&area(&open[b])));
            let Some(largest) = largest else { break };
            let first = self.binary.nodes[open[largest] as usize].first_index;
            open[largest] = first;
            open.push(first + 1);
        }
        open
    }

    /// All triangles below a node of the binary tree, as a leaf.
    fn leaf(&self, root: u32) -> Leaf {
        let mut leaf = Leaf { corners: [[[0.0; WIDTH]; 3]; 3], numbers: [NONE; WIDTH], count: 0 };
        let mut stack = vec![root];
        let mut slot = 0;
        while let Some(index) = stack.pop() {
            let node = &self.binary.nodes[index as usize];
            if !node.is_leaf() {
                stack.extend([node.first_index + 1, node.first_index]);
                continue;
            }
            for k in node.first_index..node.first_index + node.prim_count {
                let (corners, number) = self.triangles[self.binary.primitive_indices[k as usize] as usize];
                for (corner, p) in corners.into_iter().enumerate() {
                    for axis in 0..3 {
                        leaf.corners[corner][axis][slot] = p[axis];
                    }
                }
                leaf.numbers[slot] = number;
                slot += 1;
            }
        }
        leaf.count = slot as u32;
        leaf
    }
}
