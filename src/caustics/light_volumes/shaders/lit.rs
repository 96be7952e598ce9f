//! Light at the vertices of a generator, and the area that a beam's light is spread over.

use crate::beams::Beam;
use crate::passes::shadow_map::LightUniform;
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, v2, v3};
use nephroid_pipeline::Bindings;
use nephroid_pipeline::sampler::sample_compare;

use super::BeamsUniform;

/// Share of the light that reaches each vertex of the generator.
#[inline(always)]
pub fn lit(bindings: &Bindings<'_>) -> [f32; 3] {
    let beams: &BeamsUniform = bindings.uniform(1);
    let mut lit = [1.0; 3];
    if beams.planes.w > 0.0 {
        let light: &LightUniform = bindings.uniform(2);
        let beam: &Beam = bindings.uniform(4);
        for (lit, g) in lit.iter_mut().zip(&beam.g) {
            let (uv, depth, inside) = light.on_straight_map(beams.turned(v3(g.x, g.y, g.z)));
            if inside {
                *lit = sample_compare(bindings.texture(5), &bindings.sampler(6), uv, 0, depth);
            }
        }
    }
    lit
}

/// Area of a beam's cross-section as the stencil counts it.
///
/// T is the triangle between the rays. Between two planes, a wall is drawn as two triangles instead of the ruled surface between its rays. The
/// diagonal of the wall meets the section at a point P beside an edge of T; δ is the triangle of that edge and P. If P lies outside of T, δ is added
/// to the area; otherwise δ is removed. A removed δ that reaches beyond T is counted there, too, because the stencil then differs from its reference:
/// `|T| + |δ| − 2 |T ∩ δ|`. Overlaps between two δ are ignored, so the area is at least that of the signed sum, and at least half of T. Light is
/// spread over the area that is drawn, so the result depends very little on the number of planes.
#[inline(always)]
pub fn drawn_area<L: Lanes>(beams: &BeamsUniform, beam: &Beam, y: L, corners: &[V2<L>; 3], double_area: L) -> L {
    let [level, step, slabs, _] = beams.planes.to_array();
    let slab = Lanes::clamp(((-y + level) / step).floor(), 0.0, slabs - 1.0);
    let first = slab.equals(y.like(0.0));
    let (top, bottom) = (-(slab * step) + level, -((slab + 1.0) * step) + level);
    let zero = y.like(0.0);
    let sign = L::select(double_area.lt(zero), y.like(-1.0), y.like(1.0));
    let whole = double_area.abs();
    let (mut area, mut balance) = (whole, whole);
    for i in 0..3 {
        let j = (i + 1) % 3;
        // The diagonal starts at the top of the vertex that comes first and ends at the bottom of the other.
        let (from, to) = if beam.g[i].w > 0.0 { (i, j) } else { (j, i) };
        let high = L::select(first, y.like(beam.g[from].y), Lanes::min(top, y.like(beam.g[from].y)));
        let low = Lanes::min(bottom, y.like(beam.g[to].y));
        let start = beam.section_vertex(from, high);
        let end = beam.section_vertex(to, low);
        let t = Lanes::clamp((high - y) / Lanes::max(high - low, y.like(1.0e-12)), 0.0, 1.0);
        let diagonal = v2((end.x - start.x) * t + start.x, (end.y - start.y) * t + start.y);
        let (pi, pj, r) = (corners[i], corners[j], corners[3 - i - j]);
        let outside = (diagonal - pi).perp_dot(pj - pi) * sign;
        // Sides of the other two edges on which P lies: inside of both, beyond one, or beyond both.
        let (d, b) = ((r - pi).perp_dot(diagonal - pi) * sign, (r - pj).perp_dot(diagonal - pj) * sign);
        let taken = outside.abs();
        let beyond = L::select(b.lt(zero), whole - b, whole + d);
        let crossed = whole * taken / Lanes::max(beyond, y.like(f32::MIN_POSITIVE));
        let shared = L::select(d.le(zero) & b.ge(zero), taken, L::select(d.gt(zero) & b.lt(zero), whole, crossed));
        balance = balance + outside;
        area = area + taken - L::select(outside.lt(zero), shared * 2.0, zero);
    }
    Lanes::max(Lanes::max(area, balance.abs()), whole * 0.5) * 0.5
}
