//! Which beams are drawn, and between which planes: frustum culling, and clamping to receivers' boxes [BO §3.2, §3.3].
//!
//! There is one test of a beam and one of a parent beam. The first defines the result. The second only ever says what the first would say of every
//! beam below it, and where it cannot say, it asks further down: so both ways give the same list.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::caustics::beams::{Beam, LightBeams, NONE};
use crate::geom::{Frustum, Plane};
use crate::passes::camera::CameraUniform;

use super::hierarchy::{Hierarchy, Node, Rect, Span, triangles};
use super::reach::Reach;
use super::slices::{Slabs, Slices};

/// Distances below this, in shares of the size of the scene, do not let a parent speak for its beams.
const DOUBT: f32 = 1.0e-5;

/// What beams are culled and clamped against.
pub struct Scope<'a> {
    /// Sides of the view volume.
    sides: Vec<Plane>,
    camera: CameraUniform,
    reaches: &'a [Reach],
    slices: &'a Slices,
    /// Slabs of beams where there is no clamping.
    all: Option<Slabs>,
    /// Heights of the parent beams' planes.
    pub span: Span,
    doubt: f32,
}

/// What is done with a beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Out of view.
    pub out_of_view: u64,
    /// In view, but no receiver's box is in the way.
    pub missed: u64,
    /// Drawn in part.
    pub clamped: u64,
    /// Drawn.
    pub drawn: u64,
    /// Tests of beams against the view and against boxes.
    pub beam_tests: u64,
    /// The same of parent beams.
    pub node_tests: u64,
}

impl Counts {
    /// Adds those of another light or part.
    pub fn add(&mut self, other: &Self) {
        self.out_of_view += other.out_of_view;
        self.missed += other.missed;
        self.clamped += other.clamped;
        self.drawn += other.drawn;
        self.beam_tests += other.beam_tests;
        self.node_tests += other.node_tests;
    }
}

/// A beam that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawn {
    /// Its triangle in the mesh.
    pub triangle: u32,
    /// Where it is drawn.
    pub slabs: Slabs,
}

impl<'a> Scope<'a> {
    /// Against a camera's view and what is in the boxes of receivers; `clamp` is false for whole beams.
    #[must_use]
    pub fn new(camera: &CameraUniform, reaches: &'a [Reach], slices: &'a Slices, span: Span, clamp: bool) -> Self {
        let frustum = Frustum::from_clip_from_world(camera.clip_from_world);
        let around = reaches.iter().map(|reach| reach.rect).fold(Rect::EMPTY, Rect::union);
        let size = (around.max - around.min).max_element().max(span.top_y - span.bottom_y);
        let sides = frustum.planes().iter().take(4).copied().collect();
        let all = (!clamp).then(|| slices.all());
        Self { sides, camera: *camera, reaches, slices, all, span, doubt: DOUBT * size.max(1.0e-3) }
    }

    /// A point as it appears through the water surface, see [`CameraUniform::raise`].
    fn raised(&self, p: Vec3) -> Vec3 {
        let v = self.camera.raise(crate::math::vector::v3(p.x, p.y, p.z));
        Vec3::new(v.x, v.y, v.z)
    }

    /// Whether a beam is out of view: all of it on the wrong side of one plane. It is bent where it passes the mean level, below which
    /// things appear raised.
    fn is_out_of_view(&self, beam: &Beam) -> bool {
        let level = self.camera.water.x;
        let at = |i: usize, y: f32| {
            let t = beam.g[i].y - y;
            Vec3::new(beam.g[i].x + beam.d[i].x * t, y, beam.g[i].z + beam.d[i].z * t)
        };
        let mut points = [Vec3::ZERO; 9];
        for i in 0..3 {
            points[i] = self.raised(beam.g[i].truncate());
            points[3 + i] = self.raised(at(i, level.min(beam.g[i].y)));
            points[6 + i] = self.raised(at(i, self.span.bottom_y));
        }
        self.sides.iter().any(|side| points.iter().all(|&p| side.signed_distance(p) < 0.0))
    }

    /// Slabs in which a beam runs into receivers, of the boxes given by number: the bounds of the beam between a slab's planes meet a column
    /// that has something there.
    fn slabs_of(&self, beam: &Beam, boxes: impl Iterator<Item = usize>) -> Slabs {
        let mut slabs = 0;
        for index in boxes {
            let reach = &self.reaches[index];
            if slabs & reach.slabs == reach.slabs {
                continue;
            }
            let bounds = bounds(beam, reach.y);
            if !bounds.meets(reach.rect) {
                continue;
            }
            let mut left = reach.under(bounds).any & !slabs;
            while left != 0 {
                let slab = left.trailing_zeros();
                left &= left - 1;
                let bounds = self::bounds(beam, self.slices.heights(slab, reach.y));
                if bounds.meets(reach.rect) && reach.under(bounds).any >> slab & 1 == 1 {
                    slabs |= 1 << slab;
                }
            }
        }
        slabs
    }

    /// What is drawn of a beam: the definition. `seen`: known to be in view; `granted`: slabs in which it is known to meet receivers.
    fn of_beam(&self, beam: &Beam, seen: bool, granted: Slabs, boxes: impl Iterator<Item = usize>, counts: &mut Counts) -> Slabs {
        if !seen {
            counts.beam_tests += 1;
            if self.is_out_of_view(beam) {
                counts.out_of_view += 1;
                return 0;
            }
        }
        let slabs = match self.all {
            Some(all) => all,
            None => granted | self.slabs_of(beam, boxes.inspect(|_| counts.beam_tests += 1)),
        };
        if slabs == 0 {
            counts.missed += 1;
        }
        slabs
    }

    /// Where a parent beam is with respect to the view: surely out, surely in, or neither.
    fn view_of(&self, node: &Node) -> View {
        let level = self.camera.water.x.clamp(self.span.bottom_y, self.span.top_y);
        let mut points = [Vec3::ZERO; 12];
        for (k, y) in [self.span.top_y, level, self.span.bottom_y].into_iter().enumerate() {
            for (i, p) in node.corners(self.span, y).into_iter().enumerate() {
                points[4 * k + i] = self.raised(p);
            }
        }
        let mut inside = true;
        for side in &self.sides {
            let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
            for &p in &points {
                let distance = side.signed_distance(p);
                (least, most) = (least.min(distance), most.max(distance));
            }
            if most < -self.doubt {
                return View::Out;
            }
            inside &= least > self.doubt;
        }
        if inside { View::In } else { View::Unsure }
    }

    /// All beams in full.
    #[must_use]
    pub fn everything(&self, light: &LightBeams, shadowed: &[bool]) -> (Vec<Drawn>, Counts) {
        let slabs = self.all.unwrap_or_default();
        let alive = |&triangle: &usize| light.of_triangle[triangle] != NONE && shadowed.get(triangle) != Some(&true);
        let drawn = (0..light.of_triangle.len()).filter(alive).map(|triangle| Drawn { triangle: triangle as u32, slabs }).collect();
        self.gathered(std::iter::once((drawn, Counts::default())))
    }

    /// Beams of the whole mesh, each tested on its own.
    #[must_use]
    pub fn one_by_one(&self, light: &LightBeams, shadowed: &[bool]) -> (Vec<Drawn>, Counts) {
        let triangles = light.of_triangle.len();
        let parts: Vec<(Vec<Drawn>, Counts)> = (0..triangles.div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let (mut drawn, mut counts) = (Vec::new(), Counts::default());
                for triangle in part * PART..((part + 1) * PART).min(triangles) {
                    let beam = light.of_triangle[triangle];
                    if beam == NONE || shadowed.get(triangle) == Some(&true) {
                        continue;
                    }
                    let slabs = self.of_beam(&light.beams[beam as usize], false, 0, 0..self.reaches.len(), &mut counts);
                    if slabs != 0 {
                        drawn.push(Drawn { triangle: triangle as u32, slabs });
                    }
                }
                (drawn, counts)
            })
            .collect();
        self.gathered(parts.into_iter())
    }

    /// The same beams, found down the hierarchy.
    #[must_use]
    pub fn by_hierarchy(&self, light: &LightBeams, hierarchy: &Hierarchy, shadowed: &[bool]) -> (Vec<Drawn>, Counts) {
        let parts: Vec<(Vec<Drawn>, Counts)> = (0..hierarchy.roots)
            .into_par_iter()
            .map(|root| {
                let mut walk = Walk { scope: self, light, hierarchy, shadowed, drawn: Vec::new(), counts: Counts::default() };
                let boxes: Vec<usize> = (0..self.reaches.len()).collect();
                walk.node(root as u32, false, 0, &boxes);
                (walk.drawn, walk.counts)
            })
            .collect();
        let (mut drawn, counts) = self.gathered(parts.into_iter());
        // In the order of the mesh, whatever the tree is like: light is added up in this order.
        drawn.par_sort_unstable_by_key(|drawn| drawn.triangle);
        (drawn, counts)
    }

    fn gathered(&self, parts: impl Iterator<Item = (Vec<Drawn>, Counts)>) -> (Vec<Drawn>, Counts) {
        let (mut all, mut counts) = (Vec::new(), Counts::default());
        for (drawn, part) in parts {
            all.extend(drawn);
            counts.add(&part);
        }
        counts.drawn = all.len() as u64;
        let slabs = self.reaches.iter().fold(0, |slabs, reach| slabs | reach.slabs);
        counts.clamped = all.iter().filter(|drawn| self.all.is_none() && drawn.slabs != slabs).count() as u64;
        (all, counts)
    }
}

/// Triangles that one task tests.
const PART: usize = 1024;

/// Bounds of a beam between two heights.
#[inline(always)]
fn bounds(beam: &Beam, y: [f32; 2]) -> Rect {
    let mut bounds = Rect::EMPTY;
    for (g, d) in beam.g.iter().zip(&beam.d) {
        for y in y {
            let t = (g.y - y).max(0.0);
            bounds = bounds.including(Vec2::new(g.x + d.x * t, g.z + d.z * t));
        }
    }
    bounds
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum View {
    Out,
    In,
    Unsure,
}

/// A walk down one tree.
struct Walk<'a> {
    scope: &'a Scope<'a>,
    light: &'a LightBeams,
    hierarchy: &'a Hierarchy,
    shadowed: &'a [bool],
    drawn: Vec<Drawn>,
    counts: Counts,
}

impl Walk<'_> {
    /// `seen`: wholly in view; `granted`: slabs in which every beam here meets receivers; `boxes`: those that some may run into elsewhere.
    fn node(&mut self, index: u32, seen: bool, granted: Slabs, boxes: &[usize]) {
        let (scope, hierarchy) = (self.scope, self.hierarchy);
        let node = &hierarchy.nodes[index as usize];
        if node.is_empty() {
            return;
        }
        let mut seen = seen;
        if !seen {
            self.counts.node_tests += 1;
            match scope.view_of(node) {
                View::Out => {
                    self.counts.out_of_view += self.alive(node);
                    return;
                }
                View::In => seen = true,
                View::Unsure => {}
            }
        }
        let mut granted = granted;
        let mut near = Vec::with_capacity(boxes.len());
        for &index in boxes {
            let reach = &scope.reaches[index];
            if granted & reach.slabs == reach.slabs {
                continue;
            }
            self.counts.node_tests += 1;
            // If all of it is in the box at one height, every beam runs into the box, and none needs to be asked [BO §3.3]. Beams exist at
            // heights below the troughs; above, a beam is taken to be where its corner is.
            let section = |y: f32| node.section(scope.span, y);
            let passed = section(reach.y[0].min(scope.span.trough_y)).union(section(reach.y[1]));
            if !passed.meets(reach.rect) {
                continue;
            }
            let below = reach.under(passed);
            if scope.all.is_none() {
                let inside = |y: f32| y <= scope.span.trough_y && reach.rect.contains(section(y));
                let mut left = below.every & !granted;
                while left != 0 {
                    let slab = left.trailing_zeros();
                    left &= left - 1;
                    if scope.slices.heights(slab, reach.y).into_iter().any(inside) {
                        granted |= 1 << slab;
                    }
                }
            }
            if below.any & !granted != 0 {
                near.push(index);
            }
        }
        if seen && granted == 0 && near.is_empty() && scope.all.is_none() {
            self.counts.missed += self.alive(node);
            return;
        }
        if !node.children.is_empty() {
            for child in node.children.clone() {
                self.node(child, seen, granted, &near);
            }
            return;
        }
        for triangle in triangles(hierarchy.columns, &node.cells) {
            let beam = self.light.of_triangle[triangle as usize];
            if beam == NONE || self.shadowed.get(triangle as usize) == Some(&true) {
                continue;
            }
            let beam = &self.light.beams[beam as usize];
            let slabs = scope.of_beam(beam, seen, granted, near.iter().copied(), &mut self.counts);
            if slabs != 0 {
                self.drawn.push(Drawn { triangle, slabs });
            }
        }
    }

    /// Beams of a node that are not culled for their shadow.
    fn alive(&self, node: &Node) -> u64 {
        if self.shadowed.is_empty() {
            return u64::from(node.beams);
        }
        let beams = triangles(self.hierarchy.columns, &node.cells).map(|triangle| triangle as usize);
        beams.filter(|&triangle| self.light.of_triangle[triangle] != NONE && !self.shadowed[triangle]).count() as u64
    }
}
