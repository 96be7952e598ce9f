//! Bounds of many tubes: boxes along axes of their own.

use glam::Vec3;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V3, v3};

use super::LANES;
use super::beam::safe;

/// Slack of a side, as a share of the coordinates.
const SLACK: f32 = 1.0e-6;

/// Six planes around a set of points, as x, y, z and d: those with `n·p ≤ d` for all.
pub(super) type Hull = [[f32; 4]; 6];

/// The box around points with sides across three axes, of any length.
pub(super) fn hull(axes: [Vec3; 3], points: impl Iterator<Item = Vec3> + Clone) -> Hull {
    let size = points.clone().fold(0.0_f32, |size, p| size.max(p.length()));
    std::array::from_fn(|side| {
        let axis = axes[side / 2].normalize_or(Vec3::Y);
        let normal = if side % 2 == 0 { axis } else { -axis };
        let d = points.clone().fold(f32::NEG_INFINITY, |d, p| d.max(normal.dot(p)));
        [normal.x, normal.y, normal.z, d + SLACK * size]
    })
}

/// Up to sixteen hulls, one per element of each array.
pub(super) struct Hulls {
    planes: [[[f32; LANES]; 4]; 6],
    count: usize,
}

impl Hulls {
    /// Packs hulls.
    pub fn new(hulls: &[Hull]) -> Self {
        let mut planes = [[[0.0; LANES]; 4]; 6];
        for (k, hull) in hulls.iter().enumerate() {
            for (lanes, plane) in planes.iter_mut().zip(hull) {
                for (lanes, value) in lanes.iter_mut().zip(plane) {
                    lanes[k] = *value;
                }
            }
        }
        Self { planes, count: hulls.len() }
    }

    /// The parts of a range in which a ray is inside of each hull, and the hulls that it meets as bits.
    #[inline(always)]
    pub fn clip<L: Lanes>(&self, token: L::Token, origin: Vec3, direction: Vec3, range: (f32, f32)) -> ([[f32; LANES]; 2], u32) {
        let (o, d) = (V3::splat(token, origin), V3::splat(token, direction));
        let zero = L::splat(token, 0.0);
        let (mut starts, mut ends, mut met) = ([0.0; LANES], [0.0; LANES], 0);
        let mut first = 0;
        while first < self.count {
            let (mut from, mut to) = (L::splat(token, range.0), L::splat(token, range.1));
            for [x, y, z, d_plane] in &self.planes {
                let normal = v3(L::load(token, &x[first..]), L::load(token, &y[first..]), L::load(token, &z[first..]));
                let slope = safe(normal.dot(d));
                let s = (L::load(token, &d_plane[first..]) - normal.dot(o)) / slope;
                let leaves = slope.gt(zero);
                from = L::select(leaves, from, Lanes::max(from, s));
                to = L::select(leaves, Lanes::min(to, s), to);
            }
            met |= from.lt(to).bits() << first;
            from.store(&mut starts[first..]);
            to.store(&mut ends[first..]);
            first += L::LEN;
        }
        ([starts, ends], met & ((1_u32 << self.count) - 1))
    }
}
