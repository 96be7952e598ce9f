//! Intersects rays with a water surface.
//!
//! Along a ray that is steeper than the surface can be, the height over the surface is monotonic and has one root. Newton's method finds it in a few
//! steps from the mean level, bracketed by the bounds of the surface. Other rays march: the height over the surface divided by its greatest rate of
//! change is a safe step. Light from the sky nearly always is of the first kind, which is processed sixteen rays at a time; rays of the second kind
//! are processed one by one.

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V3, v3};

use super::{Heights, WaterSurface};

/// Most steps of Newton's method; roots that have not converged by then are found by bisection.
const NEWTON_STEPS: usize = 8;

/// Steps of a bisection, which shrink the bracket to a few units in the last place.
const BISECTIONS: usize = 32;

/// Most steps of a march.
const MARCH_STEPS: usize = 4096;

/// Least step of a march and largest residual of a root, as a share of the scale of coordinates.
const TINY: f32 = 1.0e-6;

/// Rays in lanes, and the side of the surface on which each starts: 1 above, −1 below, 0 for rays that the water does not stop.
#[derive(Clone, Copy)]
pub struct Rays<L> {
    /// Start, world space, m.
    pub origin: V3<L>,
    /// Unit vector.
    pub direction: V3<L>,
    /// Side of the surface: 1, −1 or 0.
    pub side: L,
}

/// Intersections with the surface.
#[derive(Clone, Copy)]
pub struct Crossing<L> {
    /// Distance, m; infinite for rays that miss.
    pub t: L,
    /// Unit normal of the surface, pointing up; undefined for rays that miss.
    pub normal: V3<L>,
}

/// Intersects rays with the surface.
#[inline(always)]
pub fn crossings<L: Lanes, H: Heights>(surface: &WaterSurface, heights: &H, rays: Rays<L>) -> Crossing<L> {
    let zero = rays.side.like(0.0);
    let infinite = zero.like(f32::INFINITY);
    let d = rays.direction;
    let flat = (d.x * d.x + d.z * d.z).sqrt();
    let away = d.y * rays.side;
    let steep = d.y.abs().gt(flat * (surface.slope * 1.01) + TINY);
    let subject = !rays.side.equals(zero);
    let mut t = infinite;
    let falling = subject & steep & away.lt(zero);
    if falling.any() {
        t = L::select(falling, steep_root(surface, heights, rays), infinite);
    }
    let winding = subject & !steep;
    if winding.any() {
        t = march_lanes(surface, heights, rays, winding, t);
    }
    let met = t.lt(infinite);
    if !met.any() {
        return Crossing { t, normal: v3(zero, zero, zero) };
    }
    // Rays that miss get a finite position, because the normal at infinity would be NaN.
    let at = L::select(met, t, zero);
    let normal = heights.normal(rays.origin.x + d.x * at, rays.origin.z + d.z * at);
    Crossing { t, normal }
}

/// The only root of rays that are steeper than the surface; infinity if it lies behind the ray's start or outside of the water's rectangle.
#[inline(always)]
fn steep_root<L: Lanes, H: Heights>(surface: &WaterSurface, heights: &H, rays: Rays<L>) -> L {
    let (o, d) = (rays.origin, rays.direction);
    let zero = o.x.like(0.0);
    let infinite = zero.like(f32::INFINITY);
    let y = o.y - surface.level;
    let inverse = zero.like(1.0) / d.y;
    let (a, b) = ((-y + surface.rise) * inverse, (-y - surface.rise) * inverse);
    let low = Lanes::max(Lanes::min(a, b), zero);
    let high = Lanes::max(Lanes::max(a, b), zero);
    let mut t = Lanes::min(Lanes::max(-y * inverse, low), high);
    // Accuracy of the rays' heights over the surface, from that of the coordinates.
    let exact = (y.abs() + o.x.abs() + o.z.abs() + surface.rise) * 2.0e-7 + surface.size * 1.0e-8;
    let mut settled = zero.lt(zero);
    for _ in 0..NEWTON_STEPS {
        let (h, slope_x, slope_z) = heights.rise_and_slope(o.x + d.x * t, o.z + d.z * t);
        let f = y + d.y * t - h;
        let step = f / (d.y - slope_x * d.x - slope_z * d.z);
        // A converged lane keeps its value while others iterate.
        t = L::select(settled, t, Lanes::min(Lanes::max(t - step, low), high));
        settled = settled | f.abs().le(exact);
        if settled.all() {
            break;
        }
    }
    if !settled.all() {
        let (mut near, mut far) = (low, high);
        for _ in 0..BISECTIONS {
            let middle = (near + far) * 0.5;
            let (h, _, _) = heights.rise_and_slope(o.x + d.x * middle, o.z + d.z * middle);
            let before = ((y + d.y * middle - h) * rays.side).gt(zero);
            near = L::select(before, middle, near);
            far = L::select(before, far, middle);
        }
        t = L::select(settled, t, (near + far) * 0.5);
    }
    let (x, z) = (o.x + d.x * t, o.z + d.z * t);
    let over = x.ge(x.like(surface.min.x)) & x.le(x.like(surface.max.x)) & z.ge(z.like(surface.min.y)) & z.le(z.like(surface.max.y));
    L::select(over & high.gt(zero), t, infinite)
}

/// Marches the chosen lanes one by one. The others keep their `t`.
#[inline(always)]
fn march_lanes<L: Lanes, H: Heights>(surface: &WaterSurface, heights: &H, rays: Rays<L>, chosen: L::Mask, t: L) -> L {
    let (o, d) = (rays.origin, rays.direction);
    let o = [o.x.to_array(), o.y.to_array(), o.z.to_array()];
    let d = [d.x.to_array(), d.y.to_array(), d.z.to_array()];
    let (sides, mut found) = (rays.side.to_array(), t.to_array());
    let bits = chosen.bits();
    for lane in 0..L::LEN {
        if bits >> lane & 1 == 1 {
            let at = |v: &[[f32; 16]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
            found[lane] = march(surface, heights, at(&o), at(&d), sides[lane]);
        }
    }
    L::load(t.token(), &found)
}

/// The first root of a ray that may meet the surface several times.
fn march<H: Heights>(surface: &WaterSurface, heights: &H, o: [f32; 3], d: [f32; 3], side: f32) -> f32 {
    let y = o[1] - surface.level;
    // The part of the ray that is over the rectangle and between the bounds of the surface.
    let (mut from, mut to) = (0.0_f32, f32::INFINITY);
    for (start, step, low, high) in
        [(o[0], d[0], surface.min.x, surface.max.x), (y, d[1], -surface.rise, surface.rise), (o[2], d[2], surface.min.y, surface.max.y)]
    {
        if step == 0.0 {
            if start < low || start > high {
                return f32::INFINITY;
            }
            continue;
        }
        let (a, b) = ((low - start) / step, (high - start) / step);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    let over = |t: f32| {
        let (h, _, _) = heights.rise_and_slope(o[0] + d[0] * t, o[2] + d[2] * t);
        (y + d[1] * t - h) * side
    };
    let fastest = d[1].abs() + surface.slope * (d[0] * d[0] + d[2] * d[2]).sqrt();
    let least = TINY * surface.size;
    let mut t = from;
    let mut f = over(t);
    if f < 0.0 {
        // The ray enters beside the water and below its surface, or it starts on the surface and rounding has put it across.
        if from > 0.0 || f < -least {
            return f32::INFINITY;
        }
        f = 0.0;
    }
    for _ in 0..MARCH_STEPS {
        let next = t + (f / fastest).max(least);
        if next > to {
            return f32::INFINITY;
        }
        let g = over(next);
        if g < 0.0 {
            let (mut near, mut far) = (t, next);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (near + far);
                if over(middle) > 0.0 {
                    near = middle;
                } else {
                    far = middle;
                }
            }
            return 0.5 * (near + far);
        }
        (t, f) = (next, g);
    }
    f32::INFINITY
}
