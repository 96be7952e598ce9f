//! The tight convex body of a caustic volume: the convex hull of its six corners, a little enlarged [SF05 §3.2; decision E2].
//!
//! The sides of a beam are not planar, so the paper asks for a "tight body" without saying how it is made. The hull of the generator
//! and the bottom triangle has at most eight faces and contains the beam. It is enlarged for two reasons: rasterization snaps corners to a grid, so
//! a hull without slack would lose pixels whose receiver lies on the beam's boundary; and four corners in one plane (as in all
//! beams of flat water) make a hull's faces ambiguous, so the bottom is enlarged more than the top and turned a little.
//! Which pixels are lit is decided by the exact test at the receiver, so the slack costs fragments and changes nothing else.

use glam::{DVec2, DVec3};

/// Most triangles of the hull of six points: 2·6 − 4.
pub const MAX_FACES: usize = 8;

/// The triangles of a hull, corners counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hull {
    /// Top corners 0..3, bottom corners 3..6.
    pub corners: [DVec3; 6],
    faces: [[u8; 3]; MAX_FACES],
    count: usize,
}

impl Hull {
    /// Corner numbers of each face.
    #[must_use]
    pub fn faces(&self) -> &[[u8; 3]] {
        &self.faces[..self.count]
    }
}

/// Sharp corners are moved by at most this many times the slack.
const MITER_LIMIT: f64 = 4.0;

/// Moves the edges of a triangle (in x and z) outwards by `slack`.
fn enlarge(triangle: [DVec2; 3], slack: f64) -> [DVec2; 3] {
    let area = (triangle[1] - triangle[0]).perp_dot(triangle[2] - triangle[0]);
    let turn = if area < 0.0 { -1.0 } else { 1.0 };
    let centre = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    [0, 1, 2].map(|i: usize| {
        let (before, here, after) = (triangle[(i + 2) % 3], triangle[i], triangle[(i + 1) % 3]);
        let out = |edge: DVec2| DVec2::new(edge.y, -edge.x).normalize_or_zero() * turn;
        let (n, m) = (out(here - before), out(after - here));
        let bisector = n + m;
        let length = bisector.length_squared();
        // Moving by `2·bisector/|bisector|²` moves both edges by one.
        let miter = if length > 4.0 / (MITER_LIMIT * MITER_LIMIT) {
            bisector * (2.0 / length)
        } else {
            (here - centre).normalize_or_zero() * MITER_LIMIT
        };
        here + miter * slack
    })
}

/// The hull of a beam's two ends, each enlarged by its slack in metres.
///
/// Faces are found by asking of every three corners whether the rest lies on one side: twenty questions of three dot products, which is less work than
/// keeping a half-built hull. In f64, where corners in one plane to within rounding do not occur after the enlargement.
#[must_use]
pub fn hull(top: [DVec3; 3], bottom: [DVec3; 3], top_slack: f64, bottom_slack: f64) -> Hull {
    let flat = |t: [DVec3; 3]| t.map(|p| DVec2::new(p.x, p.z));
    let large_top = enlarge(flat(top), top_slack);
    let large_bottom = enlarge(flat(bottom), bottom_slack * 1.25);
    let mut hull = Hull::default();
    for i in 0..3 {
        hull.corners[i] = DVec3::new(large_top[i].x, top[i].y + top_slack, large_top[i].y);
        // The turn that keeps parallel walls from being flat.
        let along = (large_bottom[(i + 1) % 3] - large_bottom[i]).normalize_or_zero() * (0.25 * bottom_slack);
        let turned = large_bottom[i] + along;
        hull.corners[3 + i] = DVec3::new(turned.x, bottom[i].y - bottom_slack, turned.y);
    }
    let p = hull.corners;
    for a in 0..4usize {
        for b in a + 1..5 {
            for c in b + 1..6 {
                let normal = (p[b] - p[a]).cross(p[c] - p[a]);
                let level = normal.dot(p[a]);
                let (mut above, mut below) = (false, false);
                for (i, corner) in p.iter().enumerate() {
                    if i != a && i != b && i != c {
                        let side = normal.dot(*corner) - level;
                        above |= side > 0.0;
                        below |= side < 0.0;
                    }
                }
                if above != below && hull.count < MAX_FACES {
                    hull.faces[hull.count] = if below { [a as u8, b as u8, c as u8] } else { [a as u8, c as u8, b as u8] };
                    hull.count += 1;
                }
            }
        }
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::uniform3;

    fn random_beam(i: u32, spread: f64) -> Hull {
        let r = |k: u32| uniform3(7, k, i).map(|v| f64::from(v) - 0.5);
        let top = [0, 1, 2].map(|k| DVec3::new(r(k)[0], 0.1 * r(k)[1], r(k)[2]));
        let bottom = [3, 4, 5].map(|k| {
            let t = top[k as usize - 3];
            DVec3::new(t.x + spread * r(k)[0], -2.0, t.z + spread * r(k)[2])
        });
        hull(top, bottom, 1.0e-3, 1.0e-3)
    }

    /// Every edge of a closed surface is used once in each direction, and Euler's formula holds.
    fn assert_closed(hull: &Hull, what: &str) {
        let mut edges = std::collections::BTreeMap::new();
        for f in hull.faces() {
            for k in 0..3 {
                *edges.entry((f[k], f[(k + 1) % 3])).or_insert(0) += 1;
            }
        }
        for (&(a, b), &count) in &edges {
            assert_eq!((count, edges.get(&(b, a)).copied()), (1, Some(1)), "{what}: edge {a} {b} of {:?}", hull.faces());
        }
        let used: std::collections::BTreeSet<u8> = hull.faces().iter().flatten().copied().collect();
        assert_eq!(hull.faces().len(), 2 * used.len() - 4, "{what}");
    }

    #[test]
    fn hull_is_closed_and_winds_outwards_for_random_beams() {
        for i in 0..20_000 {
            let hull = random_beam(i, [0.1, 1.0, 3.0][i as usize % 3]);
            assert_closed(&hull, &format!("beam {i}"));
            let volume: f64 = hull
                .faces()
                .iter()
                .map(|f| {
                    let [a, b, c] = f.map(|k| hull.corners[usize::from(k)]);
                    a.dot(b.cross(c))
                })
                .sum();
            assert!(volume > 0.0, "beam {i} is inside out");
        }
    }

    #[test]
    fn hull_is_closed_for_the_parallel_beams_of_flat_water() {
        for i in 0..2000u32 {
            let size = 0.01 + 0.001 * f64::from(i % 100);
            let at = f64::from(i / 100) * 0.37;
            let top = [DVec3::new(at, 0.0, at), DVec3::new(at, 0.0, at + size), DVec3::new(at + size, 0.0, at)];
            let shift = DVec3::new(0.2, -1.05, -0.1 * f64::from(i % 7));
            assert_closed(&hull(top, top.map(|p| p + shift), 1.0e-4, 2.0e-4), &format!("beam {i}"));
        }
    }

    #[test]
    fn hull_contains_the_beam_with_slack() {
        let mut blunt = 0;
        for i in 0..2000 {
            let r = |k: u32| uniform3(9, k, i).map(|v| f64::from(v) - 0.5);
            let top = [0, 1, 2].map(|k| DVec3::new(r(k)[0], 0.0, r(k)[2]));
            let bottom = [3, 4, 5].map(|k| DVec3::new(top[k as usize - 3].x + r(k)[0], -1.0, top[k as usize - 3].z + r(k)[2]));
            let hull = hull(top, bottom, 1.0e-3, 1.0e-3);
            // Corners sharper than the miter limit may stand out by a part of the slack.
            let sharp = |t: [DVec3; 3]| {
                let [a, b, c] = t.map(|p| DVec2::new(p.x, p.z));
                let longest = (b - a).length().max((c - b).length()).max((a - c).length());
                (b - a).perp_dot(c - a).abs() < 0.4 * longest * longest
            };
            let bound = if sharp(top) || sharp(bottom) { 1.0e-3 } else { 1.0e-9 };
            blunt += usize::from(bound < 1.0e-3);
            for f in hull.faces() {
                let [a, b, c] = f.map(|k| hull.corners[usize::from(k)]);
                let n = (b - a).cross(c - a).normalize();
                for p in top.iter().chain(&bottom) {
                    assert!(n.dot(*p - a) < bound, "beam {i}: a corner of the beam is {} outside of its hull", n.dot(*p - a));
                }
            }
        }
        assert!(blunt > 20, "only {blunt} beams were blunt");
    }
}
