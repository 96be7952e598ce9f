//! Frustum culling of beams, and clamping to the boxes of receivers [BO §3.2, §3.3].
//!
//! The test of a single beam defines the result. The hierarchical culler returns a result for a node only if it holds for every beam in the node;
//! otherwise it recurses. Both therefore give the same list.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Vec3, Vec4Swizzles as _};
use rayon::prelude::*;

use crate::beams::geometry::on_ray_xz;
use crate::beams::{Beam, LightBeams, NONE};
use crate::passes::camera::CameraUniform;
use nephroid_scene::geom::{Frustum, Plane};

use super::columns::ReceiverColumns;
use super::hierarchy::{Hierarchy, Node, Rect, Span, triangles};
use super::slices::{Slabs, Slices};

/// A node that is nearer to a side of the view than this share of the scene's size is undecided: its beams are tested one by one.
const DOUBT: f32 = 1.0e-5;

/// Culls beams against the view and clamps them to receivers.
pub struct Culler<'a> {
    /// Sides of the view volume.
    sides: Vec<Plane>,
    camera: CameraUniform,
    /// 1, or −1 for beams that are upside down.
    side: f32,
    columns: &'a [ReceiverColumns],
    /// Indices in `columns` of the boxes of which the eye sees anything.
    boxes: Vec<usize>,
    slices: &'a Slices,
    /// Every slab, if beams are not clamped; otherwise `None`.
    all: Option<Slabs>,
    /// Heights of the planes of parent beams.
    pub span: Span,
    doubt: f32,
}

/// Numbers of beams by outcome, and numbers of tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullStatistics {
    /// Beams out of view.
    pub out_of_view: u64,
    /// Beams in view that meet no box of receivers.
    pub missed: u64,
    /// Accepted beams that are drawn only in some slabs.
    pub clamped: u64,
    /// Accepted beams.
    pub drawn: u64,
    /// Tests of single beams against the view and against boxes.
    pub beam_tests: u64,
    /// Tests of parent beams against the view and against boxes.
    pub node_tests: u64,
}

impl CullStatistics {
    /// Adds the counters of another light or task.
    pub fn add(&mut self, other: &Self) {
        self.out_of_view += other.out_of_view;
        self.missed += other.missed;
        self.clamped += other.clamped;
        self.drawn += other.drawn;
        self.beam_tests += other.beam_tests;
        self.node_tests += other.node_tests;
    }
}

/// An accepted beam, clamped to slabs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClampedBeam {
    /// Number of the beam's triangle in the mesh.
    pub triangle: u32,
    /// The slabs that it is drawn in; at least one.
    pub slabs: Slabs,
}

impl<'a> Culler<'a> {
    /// For a camera, the side of the beams ([`LightBeams::side`]) and the boxes of receivers. `visible[number]` tells whether the eye sees anything of a box. Without `clamp`, accepted beams are
    /// drawn in all slabs.
    #[must_use]
    pub fn new(
        (camera, side): (&CameraUniform, f32),
        columns: &'a [ReceiverColumns],
        visible: &[bool],
        slices: &'a Slices,
        span: Span,
        clamp: bool,
    ) -> Self {
        let frustum = Frustum::from_clip_from_world(camera.clip_from_world);
        let around = columns.iter().map(|columns| columns.rect).fold(Rect::EMPTY, Rect::union);
        let size = (around.max - around.min).max_element().max(span.top_y - span.bottom_y);
        let sides = frustum.planes().iter().take(4).copied().collect();
        let all = (!clamp).then(|| slices.all());
        let boxes = (0..columns.len()).filter(|&k| visible[columns[k].number]).collect();
        Self { sides, camera: *camera, side, columns, boxes, slices, all, span, doubt: DOUBT * size }
    }

    /// The world position at which a point of the beams' space appears through the water surface, see [`CameraUniform::raise`].
    fn raised(&self, p: Vec3) -> Vec3 {
        let v = self.camera.raise(nephroid_math::vector::v3(p.x, p.y * self.side, p.z));
        Vec3::new(v.x, v.y, v.z)
    }

    /// Whether a beam is out of view: all of it beyond one of the given sides. Points below the lowest trough appear raised, so a beam appears bent at
    /// that height, and the test includes its vertices there.
    fn is_out_of_view(&self, beam: &Beam, sides: Sides) -> bool {
        let level = self.camera.water.x * self.side;
        let mut points = [Vec3::ZERO; 9];
        for i in 0..3 {
            points[i] = self.raised(beam.g[i].truncate());
            points[3 + i] = self.raised(beam.point(i, level.min(beam.g[i].y)));
            points[6 + i] = self.raised(beam.point(i, self.span.bottom_y));
        }
        let beyond = |side: &Plane| points.iter().all(|&p| side.signed_distance(p) < 0.0);
        self.sides.iter().enumerate().any(|(k, side)| sides >> k & 1 == 1 && beyond(side))
    }

    /// Slabs in which a beam meets receivers of the given boxes. A beam meets a slab's receivers if the beam's bounds between the slab's planes
    /// overlap a column that has receivers in the slab.
    fn slabs_of(&self, beam: &Beam, boxes: impl Iterator<Item = usize>) -> Slabs {
        let mut slabs = 0;
        for index in boxes {
            let columns = &self.columns[index];
            if slabs & columns.slabs == columns.slabs {
                continue;
            }
            let bounds = section_bounds(beam, columns.y[0]).union(section_bounds(beam, columns.y[1]));
            if !bounds.meets(columns.rect) {
                continue;
            }
            let below = columns.under(bounds);
            if columns.rect.contains(bounds) {
                // The beam stays over these columns at all heights, so it meets every slab that all of them have.
                slabs |= below.every;
            }
            let mut left = below.any & !slabs;
            // Neighbouring slabs share a plane, so its section is computed once.
            let mut above = (f32::NAN, Rect::EMPTY);
            while left != 0 {
                let slab = left.trailing_zeros();
                left &= left - 1;
                let [low_y, high_y] = self.slices.heights(slab, columns.y);
                let high = if above.0 == high_y { above.1 } else { section_bounds(beam, high_y) };
                let low = section_bounds(beam, low_y);
                above = (low_y, low);
                let bounds = low.union(high);
                if bounds.meets(columns.rect) && columns.under(bounds).any >> slab & 1 == 1 {
                    slabs |= 1 << slab;
                }
            }
        }
        slabs
    }

    /// Slabs in which a beam is drawn: the definition. `sides` are the sides of the view that the beam may be beyond. In slabs `accepted` the beam is
    /// known to meet receivers and is not tested.
    fn of_beam(
        &self,
        light: &LightBeams,
        number: u32,
        sides: Sides,
        accepted: Slabs,
        boxes: impl Iterator<Item = usize>,
        statistics: &mut CullStatistics,
    ) -> Slabs {
        let beam = &light.beams[number as usize];
        if sides != 0 {
            statistics.beam_tests += 1;
            if self.is_out_of_view(beam, sides) {
                statistics.out_of_view += 1;
                return 0;
            }
        }
        let slabs = match self.all {
            Some(all) => all,
            None => accepted | self.slabs_of(beam, boxes.inspect(|_| statistics.beam_tests += 1)),
        } & self.before_end(light, number);
        if slabs == 0 {
            statistics.missed += 1;
        }
        slabs
    }

    /// The slabs that a beam of mirrors or glass reaches before its light has landed; all for others.
    fn before_end(&self, light: &LightBeams, number: u32) -> Slabs {
        light.ends_y.get(number as usize).map_or(Slabs::MAX, |&end_y| self.slices.between(end_y, f32::INFINITY))
    }

    /// Of the given sides of the view, those that beams of a node may be beyond; `None` if all beams of the node are beyond one side.
    fn sides_of(&self, node: &Node, sides: Sides) -> Option<Sides> {
        let level = (self.camera.water.x * self.side).clamp(self.span.bottom_y, self.span.top_y);
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

    /// Accepts every beam in all slabs.
    #[must_use]
    pub fn everything(&self, light: &LightBeams, shadowed: &[bool]) -> (Vec<ClampedBeam>, CullStatistics) {
        let slabs = self.all.unwrap_or_default();
        let alive = |&triangle: &usize| light.of_triangle[triangle] != NONE && shadowed.get(triangle) != Some(&true);
        let triangles = (0..light.of_triangle.len()).filter(alive);
        let before_end = |triangle: usize| slabs & self.before_end(light, light.of_triangle[triangle]);
        let beams = triangles.map(|triangle| ClampedBeam { triangle: triangle as u32, slabs: before_end(triangle) });
        let beams = beams.filter(|beam| beam.slabs != 0).collect();
        self.gathered(std::iter::once((beams, CullStatistics::default())))
    }

    /// Tests every beam of the mesh separately: the paper's reference.
    #[must_use]
    pub fn one_by_one(&self, light: &LightBeams, shadowed: &[bool]) -> (Vec<ClampedBeam>, CullStatistics) {
        let triangles = light.of_triangle.len();
        let parts: Vec<(Vec<ClampedBeam>, CullStatistics)> = (0..triangles.div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let (mut accepted, mut statistics) = (Vec::new(), CullStatistics::default());
                for triangle in part * PART..((part + 1) * PART).min(triangles) {
                    let beam = light.of_triangle[triangle];
                    if beam == NONE || shadowed.get(triangle) == Some(&true) {
                        continue;
                    }
                    let slabs = self.of_beam(light, beam, ALL_SIDES, 0, self.boxes.iter().copied(), &mut statistics);
                    if slabs != 0 {
                        accepted.push(ClampedBeam { triangle: triangle as u32, slabs });
                    }
                }
                (accepted, statistics)
            })
            .collect();
        self.gathered(parts.into_iter())
    }

    /// Finds the same beams as [`Self::one_by_one`] by walking down the hierarchy.
    #[must_use]
    pub fn by_hierarchy(&self, light: &LightBeams, hierarchy: &Hierarchy, shadowed: &[bool]) -> (Vec<ClampedBeam>, CullStatistics) {
        // Stored by triangle, so that beams come in mesh order whatever the tree is: light is summed in this order.
        let slabs: Vec<AtomicU64> = light.of_triangle.iter().map(|_| AtomicU64::new(0)).collect();
        let parts: Vec<CullStatistics> = (0..hierarchy.roots)
            .into_par_iter()
            .map(|root| {
                let mut walk = Walk { culler: self, light, hierarchy, shadowed, slabs: &slabs, statistics: CullStatistics::default() };
                walk.node(root as u32, ALL_SIDES, 0, &self.boxes);
                walk.statistics
            })
            .collect();
        let beams = (0..).zip(slabs).map(|(triangle, slabs)| ClampedBeam { triangle, slabs: slabs.into_inner() });
        let statistics = parts.iter().fold(CullStatistics::default(), |mut sum, part| {
            sum.add(part);
            sum
        });
        self.gathered(std::iter::once((beams.filter(|beam| beam.slabs != 0).collect(), statistics)))
    }

    fn gathered(&self, parts: impl Iterator<Item = (Vec<ClampedBeam>, CullStatistics)>) -> (Vec<ClampedBeam>, CullStatistics) {
        let (mut all, mut statistics) = (Vec::new(), CullStatistics::default());
        for (beams, part) in parts {
            if all.is_empty() {
                all = beams;
            } else {
                all.extend(beams);
            }
            statistics.add(&part);
        }
        statistics.drawn = all.len() as u64;
        let slabs = self.columns.iter().fold(0, |slabs, columns| slabs | columns.slabs);
        statistics.clamped = all.iter().filter(|beam| self.all.is_none() && beam.slabs != slabs).count() as u64;
        (all, statistics)
    }
}

/// Triangles per parallel task.
const PART: usize = 1024;

/// Bounds of a beam's section at a height. A vertex below that height counts at its own position.
#[inline(always)]
fn section_bounds(beam: &Beam, y: f32) -> Rect {
    let at = |i: usize| on_ray_xz(beam.g[i], beam.d[i], (beam.g[i].y - y).max(0.0));
    let [a, b, c] = [at(0), at(1), at(2)];
    Rect { min: a.min(b).min(c).xz(), max: a.max(b).max(c).xz() }
}

/// A set of the four sides of the view, one bit each.
type Sides = u32;

const ALL_SIDES: Sides = 0b1111;

/// A walk down one quadtree.
struct Walk<'a> {
    culler: &'a Culler<'a>,
    light: &'a LightBeams,
    hierarchy: &'a Hierarchy,
    shadowed: &'a [bool],
    /// Slabs of each triangle's beam, by triangle.
    slabs: &'a [AtomicU64],
    statistics: CullStatistics,
}

impl Walk<'_> {
    /// Visits a node. `sides` are the sides of the view that beams of the node may be beyond; in slabs `accepted` every beam of the node meets
    /// receivers; `boxes` are those that some beam may meet in other slabs.
    fn node(&mut self, index: u32, sides: Sides, accepted: Slabs, boxes: &[usize]) {
        let (culler, hierarchy) = (self.culler, self.hierarchy);
        let node = &hierarchy.nodes[index as usize];
        if node.is_empty() {
            return;
        }
        let mut sides = sides;
        if sides != 0 {
            self.statistics.node_tests += 1;
            let Some(undecided) = culler.sides_of(node, sides) else {
                self.statistics.out_of_view += self.alive(node);
                return;
            };
            sides = undecided;
        }
        let mut accepted = accepted;
        let mut near = Vec::with_capacity(boxes.len());
        for &index in boxes {
            let columns = &culler.columns[index];
            if accepted & columns.slabs == columns.slabs {
                continue;
            }
            self.statistics.node_tests += 1;
            // If the whole section of the node is inside the box at one height, every beam meets the box there, and none needs a test [BO §3.3].
            // Sections are exact below the troughs; above them, a vertex of a beam counts at its own position.
            let section = |y: f32| node.section(culler.span, y);
            let passed = section(columns.y[0].min(culler.span.trough_y)).union(section(columns.y[1]));
            if !passed.meets(columns.rect) {
                continue;
            }
            let below = columns.under(passed);
            if culler.all.is_none() {
                let inside = |y: f32| y <= culler.span.trough_y && columns.rect.contains(section(y));
                let mut left = below.every & !accepted;
                while left != 0 {
                    let slab = left.trailing_zeros();
                    left &= left - 1;
                    if culler.slices.heights(slab, columns.y).into_iter().any(inside) {
                        accepted |= 1 << slab;
                    }
                }
            }
            if below.any & !accepted != 0 {
                near.push(index);
            }
        }
        if sides == 0 && accepted == 0 && near.is_empty() && culler.all.is_none() {
            self.statistics.missed += self.alive(node);
            return;
        }
        if !node.children.is_empty() {
            for child in node.children.clone() {
                self.node(child, sides, accepted, &near);
            }
            return;
        }
        for triangle in triangles(hierarchy.columns, &node.cells) {
            let beam = self.light.of_triangle[triangle as usize];
            if beam == NONE || self.shadowed.get(triangle as usize) == Some(&true) {
                continue;
            }
            let slabs = culler.of_beam(self.light, beam, sides, accepted, near.iter().copied(), &mut self.statistics);
            self.slabs[triangle as usize].store(slabs, Ordering::Relaxed);
        }
    }

    /// Number of beams of a node that shadow culling has kept.
    fn alive(&self, node: &Node) -> u64 {
        if self.shadowed.is_empty() {
            return u64::from(node.beams);
        }
        let beams = triangles(self.hierarchy.columns, &node.cells).map(|triangle| triangle as usize);
        beams.filter(|&triangle| self.light.of_triangle[triangle] != NONE && !self.shadowed[triangle]).count() as u64
    }
}
