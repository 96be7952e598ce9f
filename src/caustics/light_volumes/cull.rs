//! Which beams are drawn, and between which planes: frustum culling, and clamping to receivers' boxes [BO §3.2, §3.3].
//!
//! There is one test of a beam and one of a parent beam. The first defines the result. The second only ever says what the first would say of every
//! beam below it, and where it cannot say, it asks further down: so both ways give the same list.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Vec3, Vec4Swizzles as _};
use rayon::prelude::*;

use crate::beams::{Beam, LightBeams, NONE};
use crate::passes::camera::CameraUniform;
use nephroid_scene::geom::{Frustum, Plane};

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
    /// Those of them that the eye sees anything of.
    boxes: Vec<usize>,
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
    /// Against a camera's view and what is in the boxes of receivers; `clamp` is false for whole beams. `visible` says of every box whether
    /// the eye sees anything of it.
    #[must_use]
    pub fn new(camera: &CameraUniform, reaches: &'a [Reach], visible: &[bool], slices: &'a Slices, span: Span, clamp: bool) -> Self {
        let frustum = Frustum::from_clip_from_world(camera.clip_from_world);
        let around = reaches.iter().map(|reach| reach.rect).fold(Rect::EMPTY, Rect::union);
        let size = (around.max - around.min).max_element().max(span.top_y - span.bottom_y);
        let sides = frustum.planes().iter().take(4).copied().collect();
        let all = (!clamp).then(|| slices.all());
        let boxes = (0..reaches.len()).filter(|&k| visible[reaches[k].number]).collect();
        Self { sides, camera: *camera, reaches, boxes, slices, all, span, doubt: DOUBT * size.max(1.0e-3) }
    }

    /// A point as it appears through the water surface, see [`CameraUniform::raise`].
    fn raised(&self, p: Vec3) -> Vec3 {
        let v = self.camera.raise(nephroid_math::vector::v3(p.x, p.y, p.z));
        Vec3::new(v.x, v.y, v.z)
    }

    /// Whether a beam is out of view: all of it on the wrong side of one plane, of those that it may be beyond. It is bent where it passes
    /// the mean level, below which things appear raised.
    fn is_out_of_view(&self, beam: &Beam, sides: Sides) -> bool {
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
        let beyond = |side: &Plane| points.iter().all(|&p| side.signed_distance(p) < 0.0);
        self.sides.iter().enumerate().any(|(k, side)| sides >> k & 1 == 1 && beyond(side))
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
            let bounds = section(beam, reach.y[0]).union(section(beam, reach.y[1]));
            if !bounds.meets(reach.rect) {
                continue;
            }
            let below = reach.under(bounds);
            if reach.rect.contains(bounds) {
                // Wherever it is at which height, there is something below.
                slabs |= below.every;
            }
            let mut left = below.any & !slabs;
            // Neighbours share a plane.
            let mut above = (f32::NAN, Rect::EMPTY);
            while left != 0 {
                let slab = left.trailing_zeros();
                left &= left - 1;
                let [low_y, high_y] = self.slices.heights(slab, reach.y);
                let high = if above.0 == high_y { above.1 } else { section(beam, high_y) };
                let low = section(beam, low_y);
                above = (low_y, low);
                let bounds = low.union(high);
                if bounds.meets(reach.rect) && reach.under(bounds).any >> slab & 1 == 1 {
                    slabs |= 1 << slab;
                }
            }
        }
        slabs
    }

    /// What is drawn of a beam: the definition. `sides`: those of the view that it may be beyond; `granted`: slabs in which it is known to meet receivers.
    fn of_beam(&self, beam: &Beam, sides: Sides, granted: Slabs, boxes: impl Iterator<Item = usize>, counts: &mut Counts) -> Slabs {
        if sides != 0 {
            counts.beam_tests += 1;
            if self.is_out_of_view(beam, sides) {
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

    /// The sides of the view that beams of a node may be beyond, of those given; `None` if all are surely beyond one.
    fn sides_of(&self, node: &Node, sides: Sides) -> Option<Sides> {
        let level = self.camera.water.x.clamp(self.span.bottom_y, self.span.top_y);
        let mut points = [Vec3::ZERO; 12];
        for (k, y) in [self.span.top_y, level, self.span.bottom_y].into_iter().enumerate() {
            for (i, p) in node.corners(self.span, y).into_iter().enumerate() {
                points[4 * k + i] = self.raised(p);
            }
        }
        let mut unsure = 0;
        for (k, side) in self.sides.iter().enumerate().filter(|(k, _)| sides >> k & 1 == 1) {
            let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
            for &p in &points {
                let distance = side.signed_distance(p);
                (least, most) = (least.min(distance), most.max(distance));
            }
            if most < -self.doubt {
                return None;
            }
            if least <= self.doubt {
                unsure |= 1 << k;
            }
        }
        Some(unsure)
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
                    let slabs = self.of_beam(&light.beams[beam as usize], ALL_SIDES, 0, self.boxes.iter().copied(), &mut counts);
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
        // By triangle, so that beams come in the order of the mesh, whatever the tree is like: light is added up in this order.
        let slabs: Vec<AtomicU64> = light.of_triangle.iter().map(|_| AtomicU64::new(0)).collect();
        let counts: Vec<Counts> = (0..hierarchy.roots)
            .into_par_iter()
            .map(|root| {
                let mut walk = Walk { scope: self, light, hierarchy, shadowed, slabs: &slabs, counts: Counts::default() };
                walk.node(root as u32, ALL_SIDES, 0, &self.boxes);
                walk.counts
            })
            .collect();
        let drawn = (0..).zip(slabs).map(|(triangle, slabs)| Drawn { triangle, slabs: slabs.into_inner() });
        let counts = counts.iter().fold(Counts::default(), |mut sum, part| {
            sum.add(part);
            sum
        });
        self.gathered(std::iter::once((drawn.filter(|drawn| drawn.slabs != 0).collect(), counts)))
    }

    fn gathered(&self, parts: impl Iterator<Item = (Vec<Drawn>, Counts)>) -> (Vec<Drawn>, Counts) {
        let (mut all, mut counts) = (Vec::new(), Counts::default());
        for (drawn, part) in parts {
            if all.is_empty() {
                all = drawn;
            } else {
                all.extend(drawn);
            }
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

/// Bounds of a beam at a height; above a corner, where that is.
#[inline(always)]
fn section(beam: &Beam, y: f32) -> Rect {
    // All four coordinates at once, of which x and z count.
    let at = |i: usize| beam.g[i] + beam.d[i] * (beam.g[i].y - y).max(0.0);
    let [a, b, c] = [at(0), at(1), at(2)];
    Rect { min: a.min(b).min(c).xz(), max: a.max(b).max(c).xz() }
}

/// Some of the four sides of the view.
type Sides = u32;

const ALL_SIDES: Sides = 0b1111;

/// A walk down one tree.
struct Walk<'a> {
    scope: &'a Scope<'a>,
    light: &'a LightBeams,
    hierarchy: &'a Hierarchy,
    shadowed: &'a [bool],
    /// What is drawn of each triangle's beam.
    slabs: &'a [AtomicU64],
    counts: Counts,
}

impl Walk<'_> {
    /// `sides`: those that beams here may be beyond; `granted`: slabs in which every beam here meets receivers; `boxes`: those that some may run into elsewhere.
    fn node(&mut self, index: u32, sides: Sides, granted: Slabs, boxes: &[usize]) {
        let (scope, hierarchy) = (self.scope, self.hierarchy);
        let node = &hierarchy.nodes[index as usize];
        if node.is_empty() {
            return;
        }
        let mut sides = sides;
        if sides != 0 {
            self.counts.node_tests += 1;
            let Some(unsure) = scope.sides_of(node, sides) else {
                self.counts.out_of_view += self.alive(node);
                return;
            };
            sides = unsure;
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
        if sides == 0 && granted == 0 && near.is_empty() && scope.all.is_none() {
            self.counts.missed += self.alive(node);
            return;
        }
        if !node.children.is_empty() {
            for child in node.children.clone() {
                self.node(child, sides, granted, &near);
            }
            return;
        }
        for triangle in triangles(hierarchy.columns, &node.cells) {
            let beam = self.light.of_triangle[triangle as usize];
            if beam == NONE || self.shadowed.get(triangle as usize) == Some(&true) {
                continue;
            }
            let beam = &self.light.beams[beam as usize];
            let slabs = scope.of_beam(beam, sides, granted, near.iter().copied(), &mut self.counts);
            self.slabs[triangle as usize].store(slabs, Ordering::Relaxed);
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
