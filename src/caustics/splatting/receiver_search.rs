//! Where a ray ends among the receivers that a light sees: a search in the positions of its map [WD06 §3; Shah, Konttinen & Pattanaik 2007; Wyman 2005].
//!
//! All three searches end alike: the ray is cut with the tangent plane of the receiver in the texel found, which is exact where receivers are flat,
//! and the result counts if the receiver in the texel there is no further off than two texels, and lit on the side where the ray arrives. What counts
//! for nothing is a failure, to be counted by the caller.

use glam::Vec4;

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V3, V4};
use nephroid_pipeline::TextureView;
use nephroid_pipeline::sampler::load;

use super::settings::Search;
use crate::passes::light_view::TexelView;

/// Most steps that halve a bracket. 12 make a pixel of the longest step through a map of 4096 texels.
const HALVINGS: u32 = 12;

/// Farthest distance of a result from the plane of the receiver found there, in texels.
const OFF_TX: f32 = 2.0;

/// What the search looks through.
pub struct Receivers<'a> {
    /// The map's view.
    pub texels: &'a TexelView,
    /// Position of the receiver in each texel, w = 1; 0 where there is none.
    pub position: &'a TextureView<'a>,
    /// Its normal, against the light.
    pub normal: &'a TextureView<'a>,
    /// Corners of the box in which results are looked for, m.
    pub box_ws: [Vec4; 2],
}

/// The end of a ray.
pub struct Landing<L: Lanes> {
    /// Where it is, m.
    pub position: V3<L>,
    /// Distance along the ray, m.
    pub distance: L,
    /// Whether it was found.
    pub landed: L::Mask,
    /// Whether no receiver is on the ray inside of the map. Where neither is set, the search has failed.
    pub missed: L::Mask,
}

/// A candidate for the end of a ray.
struct Candidate<L: Lanes> {
    distance: L,
    holds: L::Mask,
}

impl Receivers<'_> {
    /// Follows rays from `origin` along unit vectors `ray`, at most `steps` steps.
    #[inline(always)]
    pub fn find<L: Lanes>(&self, search: Search, steps: u32, origin: V3<L>, ray: V3<L>) -> Landing<L> {
        let (near, far) = self.interval(origin, ray);
        let crosses = near.le(far);
        match search {
            Search::Bracketed => self.bracketed(steps, origin, ray, near, far),
            Search::Wyman | Search::Shah => {
                let mut distance = near;
                for _ in 0..steps {
                    let at = self.receiver(origin + ray * distance);
                    let to = at.xyz() - origin;
                    let next = if search == Search::Wyman { self.depth(to) / self.depth(ray) } else { to.length() };
                    distance = L::select(at.w.gt(near.like(0.0)), next, distance);
                }
                let seen = self.receiver(origin + ray * distance).w.gt(near.like(0.0));
                let end = self.on_plane(origin, ray, distance);
                self.landing(origin, ray, end.distance, end.holds & crosses, !crosses | !seen)
            }
        }
    }

    /// Steps along the ray until it is behind the receivers, and halves the last step until the end is found.
    #[inline(always)]
    fn bracketed<L: Lanes>(&self, steps: u32, origin: V3<L>, ray: V3<L>, near: L, far: L) -> Landing<L> {
        let crosses = near.le(far);
        let step = (far - near) / steps as f32;
        let (mut low, mut high) = (near, near);
        let mut found = near.lt(near);
        let mut in_front = found;
        for k in 0..=steps {
            let distance = near + step * k as f32;
            let behind = self.behind(origin + ray * distance);
            let enters = crosses & in_front & behind & !found;
            high = L::select(enters, distance, high);
            low = L::select(enters, distance - step, low);
            found = found | enters;
            in_front = !behind;
            if !(crosses & !found).any() {
                break;
            }
        }
        let (mut end, mut done) = (high, near.lt(near));
        for _ in 0..HALVINGS {
            if !(found & !done).any() {
                break;
            }
            let candidate = self.on_plane(origin, ray, high);
            let inside = candidate.distance.ge(low - step) & candidate.distance.le(high + step);
            let takes = found & !done & candidate.holds & inside;
            end = L::select(takes, candidate.distance, end);
            done = done | takes;
            let middle = (low + high) * 0.5;
            let behind = self.behind(origin + ray * middle);
            high = L::select(behind, middle, high);
            low = L::select(behind, low, middle);
        }
        self.landing(origin, ray, end, done, !found)
    }

    #[inline(always)]
    fn landing<L: Lanes>(&self, origin: V3<L>, ray: V3<L>, distance: L, landed: L::Mask, missed: L::Mask) -> Landing<L> {
        Landing { position: origin + ray * distance, distance, landed, missed }
    }

    /// Distances between which a ray is inside of the box.
    #[inline(always)]
    fn interval<L: Lanes>(&self, origin: V3<L>, ray: V3<L>) -> (L, L) {
        let (mut near, mut far) = (origin.x.like(0.0), origin.x.like(f32::MAX));
        for (from, along, axis) in [(origin.x, ray.x, 0), (origin.y, ray.y, 1), (origin.z, ray.z, 2)] {
            let inverse = from.like(1.0) / along;
            let (a, b) = ((-from + self.box_ws[0][axis]) * inverse, (-from + self.box_ws[1][axis]) * inverse);
            // A ray along a side of the box gives 0/0; both functions then keep what there was.
            near = Lanes::max(Lanes::min(a, b), near);
            far = Lanes::min(Lanes::max(a, b), far);
        }
        (near, far)
    }

    /// Component along the view's axis.
    #[inline(always)]
    fn depth<L: Lanes>(&self, v: V3<L>) -> L {
        v.dot(V3::splat(v.x.token(), self.texels.axis_ws.truncate()))
    }

    /// The receiver in the texel of a point.
    #[inline(always)]
    fn receiver<L: Lanes>(&self, p_ws: V3<L>) -> V4<L> {
        let at = self.texels.texel_at(p_ws);
        load(self.position, at.x.floor(), at.y.floor(), 0, 0)
    }

    /// Whether a receiver hides a point from the light.
    #[inline(always)]
    fn behind<L: Lanes>(&self, p_ws: V3<L>) -> L::Mask {
        let at = self.receiver(p_ws);
        at.w.gt(p_ws.x.like(0.0)) & self.depth(p_ws - at.xyz()).ge(p_ws.x.like(0.0))
    }

    /// Cuts the ray with the tangent plane of the receiver in the texel at a distance.
    #[inline(always)]
    fn on_plane<L: Lanes>(&self, origin: V3<L>, ray: V3<L>, distance: L) -> Candidate<L> {
        let zero = distance.like(0.0);
        let start = self.texels.texel_at(origin + ray * distance);
        let (x, y) = (start.x.floor(), start.y.floor());
        let (plane, normal) = (load(self.position, x, y, 0, 0), load(self.normal, x, y, 0, 0).xyz());
        let distance = (plane.xyz() - origin).dot(normal) / ray.dot(normal);
        let p = origin + ray * distance;
        let end = self.texels.texel_at(p);
        let (x, y) = (end.x.floor(), end.y.floor());
        let (there, normal) = (load(self.position, x, y, 0, 0), load(self.normal, x, y, 0, 0).xyz());
        let off = (p - there.xyz()).dot(normal).abs();
        let near = off.le(self.texels.area_at(p).sqrt() * OFF_TX);
        Candidate { distance, holds: near & distance.ge(zero) & there.w.gt(zero) & ray.dot(normal).lt(zero) }
    }
}
