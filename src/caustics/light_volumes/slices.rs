//! The slicing planes, and the bodies made from dummy vertices on them [BO §3.2].
//!
//! All beams share one array of vertices, three per plane, and one array of indices. A beam that is clamped to a run of planes draws those indices
//! that form the walls between these planes and a cap at either end.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use nephroid_pipeline::Buffer;

/// Most planes: a [`Slabs`] has one bit for each slab between two neighbouring planes.
pub const MAX_PLANES: u32 = 64;

/// A set of slabs, the spaces between neighbouring planes: bit k is the slab below plane k, counted from the surface down.
pub type Slabs = u64;

/// A dummy vertex.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SliceVertex {
    /// Height of the plane, m. The first plane is the surface itself and has a height above all water.
    pub plane_y: f32,
    /// Number of the section's vertex, 0 to 2.
    pub corner: f32,
}

/// Number of combinations of diagonals of the three walls, one bit each.
const CUTS: usize = 8;

/// Height that marks the surface: above every vertex of the water.
const SURFACE_Y: f32 = 1.0e30;

/// Planes, vertices and indices.
#[derive(Clone, Debug)]
pub struct Slices {
    /// Heights of the planes from the top down, m; the first is the surface's mean level.
    pub planes_y: Vec<f32>,
    /// [`SliceVertex`], three for each plane.
    pub vertices: Arc<Buffer>,
    /// 32-bit indices.
    pub indices: Arc<Buffer>,
    /// Range of indices of each body: by cuts of the walls, then by first and last plane.
    ranges: Vec<Range<u32>>,
}

impl Slices {
    /// `count` planes, 2 to [`MAX_PLANES`], from the mean level of the water down to `bottom_y`.
    #[must_use]
    pub fn new(level_y: f32, bottom_y: f32, count: u32) -> Self {
        let slabs = (count - 1) as f32;
        let planes_y: Vec<f32> = (0..count).map(|k| level_y + (bottom_y - level_y) * (k as f32 / slabs)).collect();
        let on_plane = |k: usize| if k == 0 { SURFACE_Y } else { planes_y[k] };
        let vertices: Vec<SliceVertex> =
            (0..3 * count as usize).map(|k| SliceVertex { plane_y: on_plane(k / 3), corner: (k % 3) as f32 }).collect();
        let (indices, ranges) = bodies(count);
        let (vertices, indices) = (Arc::new(Buffer::from_slice(&vertices)), Arc::new(Buffer::from_slice(&indices)));
        Self { planes_y, vertices, indices, ranges }
    }

    /// All slabs.
    #[must_use]
    pub fn all(&self) -> Slabs {
        Slabs::MAX >> (65 - self.planes_y.len())
    }

    /// The slabs that reach into heights `low..=high`.
    #[must_use]
    pub fn between(&self, low: f32, high: f32) -> Slabs {
        let slabs = self.planes_y.len() - 1;
        // Crests rise above the first plane, so the first slab has no upper end.
        let top = |k: usize| if k == 0 { f32::INFINITY } else { self.planes_y[k] };
        (0..slabs).filter(|&k| top(k) >= low && self.planes_y[k + 1] <= high).fold(0, |all, k| all | 1 << k)
    }

    /// Heights of a slab, lower first, cut to the range `y`. Crests rise above the first plane.
    #[inline(always)]
    #[must_use]
    pub fn heights(&self, slab: u32, y: [f32; 2]) -> [f32; 2] {
        let slab = slab as usize;
        let top = if slab == 0 { y[1] } else { self.planes_y[slab].min(y[1]) };
        [self.planes_y[slab + 1].max(y[0]), top]
    }

    /// Indices of the body between two planes, with walls cut as [`Beam::cuts`](crate::beams::Beam::cuts) says.
    #[must_use]
    pub fn indices(&self, cuts: usize, planes: Range<u32>) -> Range<u32> {
        let count = self.planes_y.len();
        self.ranges[(cuts * count + planes.start as usize) * count + planes.end as usize].clone()
    }
}

/// First and last plane of every unbroken run of slabs.
pub fn runs(mut slabs: Slabs) -> impl Iterator<Item = Range<u32>> {
    std::iter::from_fn(move || {
        (slabs != 0).then(|| {
            let first = slabs.trailing_zeros();
            let length = (slabs >> first).trailing_ones();
            slabs &= !((Slabs::MAX >> (64 - length)) << first);
            first..first + length
        })
    })
}

/// The indices of all bodies, and the range of each body: by cuts, then by first and last plane.
fn bodies(count: u32) -> (Vec<u32>, Vec<Range<u32>>) {
    let (mut indices, mut ranges) = (Vec::new(), Vec::new());
    for cuts in 0..CUTS {
        for first in 0..count {
            for last in 0..count {
                let start = indices.len() as u32;
                // Around a triangle, the edges cannot all start at the vertex that comes first, nor all at the other one.
                if first < last && cuts != 0 && cuts != CUTS - 1 {
                    body(&mut indices, cuts, first, last);
                }
                ranges.push(start..indices.len() as u32);
            }
        }
    }
    (indices, ranges)
}

/// Indices of the walls between two planes and of a cap at either end, counter-clockwise as seen from outside.
///
/// The wall along an edge is cut from the top of the vertex that comes first, so both beams at the edge cut it alike. The wall's triangles start at
/// that vertex, too: depth is interpolated from a triangle's first vertex and must have the same bits for both beams, or light is lost between them.
fn body(indices: &mut Vec<u32>, cuts: usize, first: u32, last: u32) {
    for plane in first..last {
        let (top, bottom) = (3 * plane, 3 * plane + 3);
        for i in 0..3 {
            let j = (i + 1) % 3;
            let (ti, tj, bi, bj) = (top + i, top + j, bottom + i, bottom + j);
            indices.extend(if cuts >> i & 1 == 1 { [ti, bi, bj, ti, bj, tj] } else { [tj, ti, bi, tj, bi, bj] });
        }
    }
    indices.extend([3 * first, 3 * first + 1, 3 * first + 2]);
    indices.extend([3 * last, 3 * last + 2, 3 * last + 1]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The indices of a body between two of `count` planes.
    fn indices(count: u32, cuts: usize, planes: Range<u32>) -> Vec<u32> {
        let range = Slices::new(0.0, -3.0, count).indices(cuts, planes);
        bodies(count).0[range.start as usize..range.end as usize].to_vec()
    }

    #[test]
    fn every_body_is_closed() {
        for cuts in 1..CUTS - 1 {
            for first in 0..4 {
                for last in first + 1..5 {
                    let mut edges = std::collections::BTreeMap::<(u32, u32), i32>::new();
                    for t in indices(5, cuts, first..last).chunks_exact(3) {
                        for k in 0..3 {
                            let (a, b) = (t[k], t[(k + 1) % 3]);
                            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
                        }
                    }
                    assert!(edges.values().all(|&sum| sum == 0), "cuts {cuts:b}, planes {first}..{last}: {edges:?}");
                    assert!(!edges.is_empty());
                }
            }
        }
    }

    #[test]
    fn both_sides_of_a_wall_are_drawn_from_the_same_corner() {
        for cuts in 1..CUTS - 1 {
            let indices = indices(2, cuts, 0..1);
            for (i, wall) in indices[..18].chunks_exact(6).enumerate() {
                let first = if cuts >> i & 1 == 1 { i } else { (i + 1) % 3 };
                assert_eq!([wall[0], wall[3]], [first as u32; 2], "cuts {cuts:b}, edge {i}");
            }
        }
    }

    #[test]
    fn slabs_are_those_that_reach_into_a_range() {
        // Planes at 0, -1, -2, -3.
        let slices = Slices::new(0.0, -3.0, 4);
        assert_eq!(slices.all(), 0b111);
        assert_eq!(slices.between(-1.5, -1.2), 0b010);
        assert_eq!(slices.between(-2.0, -1.2), 0b110);
        assert_eq!(slices.between(0.2, 0.3), 0b001);
        assert_eq!(slices.between(-9.0, -5.0), 0);
    }

    #[test]
    fn runs_are_unbroken_and_complete() {
        let found: Vec<_> = runs(0b1_0110_1110).collect();
        assert_eq!(found, [1..4, 5..7, 8..9]);
        assert_eq!(runs(0).count(), 0);
        assert!(runs(Slabs::MAX >> 1).eq(std::iter::once(0..63)));
    }
}
