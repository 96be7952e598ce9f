//! Geometry of a beam: its cross-sections on level planes, their areas, and the ray through a point of a section.
//!
//! Vertex i of the cross-section at height y is at `g_i.xz + (g_i.y − y)·d_i.xz`: the intersection of its refracted ray with the level plane
//! [SF05 §3.3]. `geometry.wgsl` is the WGSL twin. Behind a focus, the triangle of a cross-section has the opposite orientation.

use std::ops::{Add, Mul};

use glam::{Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, V3, v2, v3};

use super::Beam;

/// Least area that light is spread over, as a share of the generator's area. Irradiance stays finite at a focus.
pub const SMALLEST_SECTION: f32 = 1.0e-7;

/// Point `depth` metres below the start of a ray, x and z: `g + depth·d`. `g` is the start of the ray, `d` its step per metre of depth, each by x and
/// z; both are the same for all lanes (`f32`) or given per lane.
#[inline(always)]
pub fn on_ray<L, X>(g_xz: [X; 2], d_xz: [X; 2], depth: L) -> V2<L>
where
    L: Lanes + Mul<X, Output = L> + Add<X, Output = L>,
{
    let ([gx, gz], [dx, dz]) = (g_xz, d_xz);
    v2(depth * dx + gx, depth * dz + gz)
}

/// [`on_ray`] for a ray of a [`Beam`], with all four coordinates in one register. x and z are the point; y and w are undefined.
#[inline(always)]
#[must_use]
pub fn on_ray_xz(g: Vec4, d: Vec4, depth: f32) -> Vec4 {
    g + d * depth
}

/// Twice the signed area of a triangle.
#[inline(always)]
pub fn double_area<L: Lanes>(triangle: &[V2<L>; 3]) -> L {
    (triangle[1] - triangle[0]).perp_dot(triangle[2] - triangle[0])
}

impl Beam {
    /// Diagonals along which the walls are cut: bit i is set if the diagonal of the wall below edge i → i+1 starts at the edge's start.
    #[must_use]
    pub fn cuts(&self) -> usize {
        (0..3).filter(|&i| self.g[i].w > 0.0).fold(0, |cuts, i| cuts | 1 << i)
    }

    /// Depth of height `y` below vertex `i` of the generator, m.
    #[inline(always)]
    pub fn depth<L: Lanes>(&self, i: usize, y: L) -> L {
        -y + self.g[i].y
    }

    /// Vertex `i` of the cross-section at height `y`, x and z.
    #[inline(always)]
    pub fn section_vertex<L: Lanes>(&self, i: usize, y: L) -> V2<L> {
        let (g, d) = (self.g[i], self.d[i]);
        on_ray([g.x, g.z], [d.x, d.z], self.depth(i, y))
    }

    /// Cross-section at height `y`, x and z of the three vertices.
    #[inline(always)]
    pub fn section<L: Lanes>(&self, y: L) -> [V2<L>; 3] {
        [self.section_vertex(0, y), self.section_vertex(1, y), self.section_vertex(2, y)]
    }

    /// Signed area of the cross-section at height `y`, m².
    #[must_use]
    pub fn section_area(&self, y: f32) -> f32 {
        0.5 * double_area(&self.section(y))
    }

    /// Vertex `i` of the cross-section at height `y`, world space.
    #[must_use]
    pub fn point(&self, i: usize, y: f32) -> Vec3 {
        let at = self.section_vertex(i, y);
        Vec3::new(at.x, y, at.y)
    }

    /// Area that the beam's flux is spread over where its cross-section has area `area`, m²; at least [`SMALLEST_SECTION`] of the generator's.
    #[inline(always)]
    pub fn lit_area<L: Lanes>(&self, area: L) -> L {
        Lanes::max(area, area.like(SMALLEST_SECTION * self.flux.w))
    }

    /// Step per metre of depth of the ray through the point with these barycentric weights.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, weights: [L; 3]) -> V3<L> {
        let [a, b, c] = weights;
        let d = &self.d;
        v3(a * d[0].x + b * d[1].x + c * d[2].x, a.like(-1.0), a * d[0].z + b * d[1].z + c * d[2].z)
    }

    /// Length of the ray with these weights, from the generator down to height `y`, m.
    #[inline(always)]
    pub fn path_length<L: Lanes>(&self, weights: [L; 3], y: L) -> L {
        let [a, b, c] = weights;
        a * self.depth(0, y) * self.d[0].y + b * self.depth(1, y) * self.d[1].y + c * self.depth(2, y) * self.d[2].y
    }
}

/// Whether the edge p → q starts at the end from which both of its beams evaluate it.
#[must_use]
pub fn comes_first(p: Vec3, q: Vec3) -> bool {
    (p.x, p.z, p.y) < (q.x, q.z, q.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right triangle of area 1/2 at height 2 whose rays meet on the axis 4 m below: at depth t each side has shrunk by 1 − t/4.
    fn cone() -> Beam {
        let g = [Vec4::new(0.0, 2.0, 0.0, 1.0), Vec4::new(1.0, 2.0, 0.0, -1.0), Vec4::new(0.0, 2.0, 1.0, 1.0)];
        let step = |g: Vec4| Vec4::new(-g.x / 4.0, (1.0 + (g.x * g.x + g.z * g.z) / 16.0).sqrt(), -g.z / 4.0, 1.0);
        Beam { g, d: g.map(step), flux: Vec4::new(1.0, 1.0, 1.0, 0.5) }
    }

    #[test]
    fn sections_of_a_cone_shrink_by_similar_triangles_and_turn_over_behind_the_focus() {
        let beam = cone();
        for (depth, side) in [(0.0, 1.0), (1.0, 0.75), (2.0, 0.5), (4.0, 0.0), (6.0, -0.5)] {
            let y = 2.0 - depth;
            assert_eq!(beam.point(1, y), Vec3::new(side, y, 0.0));
            assert_eq!(beam.point(2, y), Vec3::new(0.0, y, side));
            // A point reflection keeps the orientation, so the area is side²/2 on both sides of this focus.
            assert_eq!(beam.section_area(y), 0.5 * side * side, "at depth {depth}");
        }
        // A line focus turns the triangle over: only z crosses.
        let mut line = cone();
        line.d[1].x = 0.0;
        assert_eq!(line.section_area(2.0 - 6.0), -0.25);
    }

    #[test]
    fn rays_and_lengths_are_those_of_the_vertices_at_the_vertices_and_their_mean_in_the_middle() {
        let beam = cone();
        for i in 0..3 {
            let mut weights = [0.0; 3];
            weights[i] = 1.0;
            let ray = beam.ray(weights);
            assert_eq!([ray.x, ray.y, ray.z], [beam.d[i].x, -1.0, beam.d[i].z]);
            assert_eq!(beam.path_length(weights, -1.0), 3.0 * beam.d[i].y);
        }
        let third = 1.0 / 3.0_f32;
        let mean = beam.path_length([third; 3], 0.0);
        let expected = 2.0 * (beam.d[0].y + beam.d[1].y + beam.d[2].y) / 3.0;
        assert!((mean - expected).abs() < 1.0e-6, "{mean} in place of {expected}");
    }

    #[test]
    fn light_is_spread_over_a_ten_millionth_of_the_generator_at_least() {
        let beam = cone();
        assert_eq!(beam.lit_area(beam.section_area(-2.0)), 0.5e-7);
        assert_eq!(beam.lit_area(0.25), 0.25);
    }

    #[test]
    fn both_forms_of_a_point_on_a_ray_have_the_same_bits() {
        let beam = cone();
        for (k, depth) in [0.0, 0.1, 1.7, 33.3, 1.0e6].into_iter().enumerate() {
            let (g, d) = (beam.g[k % 3], beam.d[k % 3]);
            let (narrow, wide) = (on_ray([g.x, g.z], [d.x, d.z], depth), on_ray_xz(g, d, depth));
            assert_eq!([narrow.x.to_bits(), narrow.y.to_bits()], [wide.x.to_bits(), wide.z.to_bits()], "at depth {depth}");
        }
    }
}
