//! Quadtrees over the water, and parent beams: bounding volumes around all beams of a node [BO §3.3].
//!
//! A parent beam is the convex hull of two level rectangles, one on a plane above all crests and one on the lowest slicing plane. Every ray of the
//! node, extended to both planes, starts in the upper rectangle and ends in the lower one. At any height in between it lies in the rectangle
//! interpolated between the two.

use std::ops::Range;

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles as _};
use rayon::prelude::*;

use crate::beams::geometry::on_ray_xz;
use crate::beams::{LightBeams, NONE};

/// Rectangles are widened by this share of their coordinates, which is more than the rounding error of a ray.
const SLACK: f32 = 1.0e-5;

/// A rectangle in x and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Least coordinates, m.
    pub min: Vec2,
    /// Greatest coordinates, m.
    pub max: Vec2,
}

impl Rect {
    /// The empty rectangle.
    pub const EMPTY: Self = Self { min: Vec2::INFINITY, max: Vec2::NEG_INFINITY };

    /// The smallest rectangle around this one and a point.
    #[must_use]
    pub fn including(self, p: Vec2) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }
    /// The smallest rectangle around both rectangles.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
    /// Whether both rectangles have a point in common.
    #[must_use]
    pub fn meets(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }
    /// Whether this rectangle contains all of the other.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }
    fn widened(self) -> Self {
        let slack = Vec2::splat(SLACK * self.min.abs().max(self.max.abs()).max_element());
        Self { min: self.min - slack, max: self.max + slack }
    }
    fn corners(self) -> [Vec2; 4] {
        [self.min, Vec2::new(self.max.x, self.min.y), self.max, Vec2::new(self.min.x, self.max.y)]
    }
}

/// Heights of the generators and of both planes of the parent beams, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Upper plane: above all generators.
    pub top_y: f32,
    /// Height of the lowest point of the generators.
    pub trough_y: f32,
    /// Lower plane: the lowest slicing plane.
    pub bottom_y: f32,
}

/// Cells of the water mesh: columns and rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cells {
    /// Columns.
    pub columns: Range<u32>,
    /// Rows.
    pub rows: Range<u32>,
}

impl Cells {
    /// Number of cells.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.columns.len() as u32 * self.rows.len() as u32
    }
}

/// A node of a quadtree.
#[derive(Clone, Debug)]
pub struct Node {
    /// The node's cells of the mesh. A cell has the two triangles between its four vertices.
    pub cells: Cells,
    /// Indices of the node's children; empty for a leaf.
    pub children: Range<u32>,
    /// Levels below the node.
    pub levels: u32,
    /// The parent beam on the upper plane; empty if no triangle of the node has a beam.
    pub top: Rect,
    /// The parent beam on the lower plane.
    pub bottom: Rect,
    /// Number of beams in the node.
    pub beams: u32,
}

impl Node {
    /// Cross-section of the parent beam at a height.
    #[must_use]
    pub fn section(&self, span: Span, y: f32) -> Rect {
        let t = ((span.top_y - y) / (span.top_y - span.bottom_y)).max(0.0);
        Rect { min: self.top.min + (self.bottom.min - self.top.min) * t, max: self.top.max + (self.bottom.max - self.top.max) * t }
    }

    /// Corners of the parent beam's cross-section at a height.
    #[must_use]
    pub fn corners(&self, span: Span, y: f32) -> [Vec3; 4] {
        self.section(span, y).corners().map(|p| Vec3::new(p.x, y, p.y))
    }

    /// Whether no triangle of the node has a beam.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.beams == 0
    }
}

/// All quadtrees of a mesh.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    /// All nodes, parents before their children, roots first.
    pub nodes: Vec<Node>,
    /// Number of roots.
    pub roots: usize,
    /// Columns of cells of the mesh.
    pub columns: u32,
}

impl Hierarchy {
    /// `buckets` quadtrees along x and z over a mesh of `vertices`, each subdivided `levels` times or until one cell is left.
    #[must_use]
    pub fn new(vertices: (u32, u32), buckets: (u32, u32), levels: u32) -> Self {
        let (columns, rows) = (vertices.0 - 1, vertices.1 - 1);
        let mut nodes = Vec::new();
        for row in parts(&(0..rows), buckets.1) {
            for column in parts(&(0..columns), buckets.0) {
                nodes.push(Self::node(column, row.clone(), levels));
            }
        }
        let roots = nodes.len();
        let mut next = 0;
        while next < nodes.len() {
            let (cells, levels) = (nodes[next].cells.clone(), nodes[next].levels);
            if levels > 0 && cells.count() > 1 {
                let first = nodes.len() as u32;
                for row in parts(&cells.rows, 2) {
                    for column in parts(&cells.columns, 2) {
                        nodes.push(Self::node(column, row.clone(), levels - 1));
                    }
                }
                nodes[next].children = first..nodes.len() as u32;
            }
            next += 1;
        }
        Self { nodes, roots, columns }
    }

    fn node(columns: Range<u32>, rows: Range<u32>, levels: u32) -> Node {
        Node { cells: Cells { columns, rows }, children: 0..0, levels, top: Rect::EMPTY, bottom: Rect::EMPTY, beams: 0 }
    }

    /// Fits the parent beams to the beams of a light.
    pub fn update(&mut self, light: &LightBeams, span: Span) {
        let columns = self.columns;
        self.nodes.par_iter_mut().with_min_len(64).filter(|node| node.children.is_empty()).for_each(|node| {
            let mut around = Around::new(span);
            let beams =
                || triangles(columns, &node.cells).map(|triangle| light.of_triangle[triangle as usize]).filter(|&beam| beam != NONE);
            node.beams = if light.dark == 0 && !light.vertex_rays.is_empty() { 2 * node.cells.count() } else { beams().count() as u32 };
            if light.vertex_rays.is_empty() {
                for beam in beams().map(|beam| &light.beams[beam as usize]) {
                    beam.g.iter().zip(&beam.d).for_each(|(&g, &d)| around.add(g, d));
                }
            } else {
                // Neighbouring triangles share their vertices, so visiting vertices is a sixth of the work.
                for row in node.cells.rows.start..=node.cells.rows.end {
                    let first = row * (columns + 1);
                    let vertices = (first + node.cells.columns.start) as usize..=(first + node.cells.columns.end) as usize;
                    light.vertex_rays[vertices].iter().for_each(|&[g, d]| around.add(g, d));
                }
            }
            (node.top, node.bottom) = if node.beams > 0 { around.rectangles() } else { (Rect::EMPTY, Rect::EMPTY) };
        });
        for index in (0..self.nodes.len()).rev() {
            let children = self.nodes[index].children.clone();
            if children.is_empty() {
                continue;
            }
            let below = &self.nodes[children.start as usize..children.end as usize];
            let (top, bottom) = below.iter().fold((Rect::EMPTY, Rect::EMPTY), |(t, b), n| (t.union(n.top), b.union(n.bottom)));
            let beams = below.iter().map(|n| n.beams).sum();
            let node = &mut self.nodes[index];
            (node.top, node.bottom, node.beams) = (top, bottom, beams);
        }
    }
}

/// Bounds of rays on both planes of a span. Of the four coordinates only x and z are used.
struct Around {
    planes_y: [f32; 2],
    low: [Vec4; 2],
    high: [Vec4; 2],
}

impl Around {
    fn new(span: Span) -> Self {
        Self { planes_y: [span.top_y, span.bottom_y], low: [Vec4::INFINITY; 2], high: [Vec4::NEG_INFINITY; 2] }
    }

    /// Adds a ray as in [`Beam`](crate::beams::Beam). NaN, which marks a missing ray, changes nothing.
    #[inline(always)]
    fn add(&mut self, g: Vec4, d: Vec4) {
        for k in 0..2 {
            let at = on_ray_xz(g, d, g.y - self.planes_y[k]);
            // Comparisons with NaN are false.
            self.low[k] = Vec4::select(at.cmplt(self.low[k]), at, self.low[k]);
            self.high[k] = Vec4::select(at.cmpgt(self.high[k]), at, self.high[k]);
        }
    }

    fn rectangles(&self) -> (Rect, Rect) {
        let around = |k: usize| Rect { min: self.low[k].xz(), max: self.high[k].xz() }.widened();
        (around(0), around(1))
    }
}

/// A range divided into `count` parts of about equal length, without empty parts.
fn parts(range: &Range<u32>, count: u32) -> impl Iterator<Item = Range<u32>> + use<> {
    let (start, length) = (u64::from(range.start), range.len() as u64);
    let at = move |k: u64| (start + length * k / u64::from(count)) as u32;
    (0..u64::from(count)).map(move |k| at(k)..at(k + 1)).filter(|part| !part.is_empty())
}

/// The triangles of a set of cells.
pub fn triangles(columns: u32, cells: &Cells) -> impl Iterator<Item = u32> + use<> {
    let across = cells.columns.clone();
    cells.rows.clone().flat_map(move |row| across.clone().flat_map(move |column| [0, 1].map(|k| 2 * (row * columns + column) + k)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_hold_every_triangle_once() {
        for (vertices, buckets, levels) in [((120, 120), (4, 4), 3), ((6, 3), (2, 5), 8), ((2, 2), (1, 1), 0), ((200, 31), (3, 2), 4)] {
            let hierarchy = Hierarchy::new(vertices, buckets, levels);
            let mut seen = vec![0; 2 * (vertices.0 as usize - 1) * (vertices.1 as usize - 1)];
            for leaf in hierarchy.nodes.iter().filter(|node| node.children.is_empty()) {
                for triangle in triangles(hierarchy.columns, &leaf.cells) {
                    seen[triangle as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&count| count == 1), "{vertices:?} in {buckets:?}, {levels} levels");
        }
    }

    #[test]
    fn children_make_up_their_parent() {
        let hierarchy = Hierarchy::new((33, 17), (2, 1), 3);
        for (index, node) in hierarchy.nodes.iter().enumerate().filter(|(_, node)| !node.children.is_empty()) {
            let below = &hierarchy.nodes[node.children.start as usize..node.children.end as usize];
            assert!(node.children.start as usize > index);
            assert_eq!(below.iter().map(|child| child.cells.count()).sum::<u32>(), node.cells.count());
        }
    }
}
