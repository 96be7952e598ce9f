//! The tight convex body of a caustic volume: the convex hull of its six vertices, a little enlarged [SF05 §3.2; decision E2].
//!
//! The sides of a beam are not planar, so the paper asks for a "tight body" without saying how to make it. The hull of the generator and the bottom
//! triangle has at most eight faces and contains the beam. It is enlarged for two reasons. Rasterization snaps vertices to a grid, so a hull without
//! slack would lose pixels whose receiver lies on the beam's boundary. Four vertices in one plane, as in all beams of flat water, make the faces of a
//! hull ambiguous, so the bottom is enlarged more than the top and rotated slightly. The exact test at the receiver decides which pixels are lit; the
//! slack costs only fragments.

use glam::{DVec2, DVec3};

/// Most triangles of the hull of six points: `2·6 − 4`.
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
    /// Vertices of each face, by number.
    #[must_use]
    pub fn faces(&self) -> &[[u8; 3]] {
        &self.faces[..self.count]
    }
}

/// A vertex is moved by at most this many times the slack; a triangle with a sharper vertex is a needle.
const MITER_LIMIT: f64 = 16.0;

/// A triangle (in x and z) that contains another and keeps `slack` away from it on all sides.
fn enlarge(triangle: [DVec2; 3], slack: f64) -> [DVec2; 3] {
    let area = (triangle[1] - triangle[0]).perp_dot(triangle[2] - triangle[0]);
    let turn = if area < 0.0 { -1.0 } else { 1.0 };
    let mut enlarged = triangle;
    for i in 0..3 {
        let (before, here, after) = (triangle[(i + 2) % 3], triangle[i], triangle[(i + 1) % 3]);
        let out = |edge: DVec2| DVec2::new(edge.y, -edge.x).normalize_or_zero() * turn;
        let bisector = out(here - before) + out(after - here);
        let length = bisector.length_squared();
        if length < 4.0 / (MITER_LIMIT * MITER_LIMIT) {
            return enlarge_needle(triangle, slack);
        }
        // Moving by `2·bisector/|bisector|²` moves both edges by one.
        enlarged[i] += bisector * (2.0 * slack / length);
    }
    enlarged
}

/// [`enlarge`] for a nearly degenerate triangle, as sections near a focus are.
///
/// The result is a longer triangle along the same line. Its base lies beyond one end and has twice the width needed there. Its tip lies so far beyond
/// the other end that the triangle has the width needed at that end.
fn enlarge_needle(triangle: [DVec2; 3], slack: f64) -> [DVec2; 3] {
    let [a, b, c] = triangle;
    let edges = [(a, b), (b, c), (c, a)];
    let longest = edges.into_iter().max_by(|e, f| (e.1 - e.0).length_squared().total_cmp(&(f.1 - f.0).length_squared()));
    let (start, end) = longest.unwrap_or((a, b));
    let length = (end - start).length();
    let along = (end - start).normalize_or(DVec2::X);
    let across = DVec2::new(-along.y, along.x);
    let offsets = triangle.map(|p| across.dot(p - start));
    let low = offsets.into_iter().fold(0.0, f64::min) - slack;
    let high = offsets.into_iter().fold(0.0, f64::max) + slack;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let base = start - along * slack + across * middle;
    [base - across * (2.0 * half), base + across * (2.0 * half), start + along * (2.0 * length + 3.0 * slack) + across * middle]
}

/// The convex hull of a beam's two ends, each enlarged by its slack in metres, and the top by `bent` metres more on all sides.
///
/// A cap that is enlarged by its slack is also moved by it along the beam, away from the other one; `bent` does not move it.
///
/// Computed in f64: after the enlargement, vertices that lie in one plane up to rounding do not occur.
#[must_use]
pub fn hull(top: [DVec3; 3], bottom: [DVec3; 3], top_slack: f64, bottom_slack: f64, bent: f64) -> Hull {
    let flat = |t: [DVec3; 3]| t.map(|p| DVec2::new(p.x, p.z));
    let (flat_top, flat_bottom) = (flat(top), flat(bottom));
    // Horizontal metres per metre of depth along the beam, and how far its edges deviate from that: caps are moved along the beam, not vertically.
    let mut slopes = [DVec2::ZERO; 3];
    for i in 0..3 {
        slopes[i] = (flat_bottom[i] - flat_top[i]) / (top[i].y - bottom[i].y).max(top_slack + bottom_slack);
    }
    let slope = (slopes[0] + slopes[1] + slopes[2]) / 3.0;
    let spread = 1.0 + slopes.iter().map(|s| (*s - slope).length()).fold(0.0, f64::max);
    let large_top = enlarge(flat_top.map(|p| p - slope * top_slack), top_slack * spread + bent);
    // The rotation below reduces the slack by a quarter.
    let large_bottom = enlarge(flat_bottom.map(|p| p + slope * bottom_slack), bottom_slack * spread * 1.25);
    let mut hull = Hull::default();
    for i in 0..3 {
        hull.corners[i] = DVec3::new(large_top[i].x, top[i].y + top_slack, large_top[i].y);
        // The rotation that keeps parallel walls from being planar.
        let along = (large_bottom[(i + 1) % 3] - large_bottom[i]).normalize_or_zero() * (0.25 * bottom_slack);
        let turned = large_bottom[i] + along;
        hull.corners[3 + i] = DVec3::new(turned.x, bottom[i].y - bottom_slack, turned.y);
    }
    if !hull.wrap() {
        hull.search();
    }
    hull
}

impl Hull {
    fn push(&mut self, a: usize, b: usize, c: usize) {
        self.faces[self.count] = [a as u8, b as u8, c as u8];
        self.count += 1;
    }

    /// Finds the faces of a body whose top lies wholly above the plane of its bottom and whose bottom lies wholly below the plane of its top: the two
    /// ends, and for each edge of an end the face to that vertex of the other end which has the other two behind it. Returns false for other bodies.
    fn wrap(&mut self) -> bool {
        let p = self.corners;
        // Corners of both ends counter-clockwise seen from above.
        let upwards = |[a, b, c]: [usize; 3]| if (p[b] - p[a]).cross(p[c] - p[a]).y > 0.0 { [a, b, c] } else { [a, c, b] };
        let (top, bottom) = (upwards([0, 1, 2]), upwards([3, 4, 5]));
        let is_below = |end: [usize; 3], other: [usize; 3]| {
            let normal = (p[end[1]] - p[end[0]]).cross(p[end[2]] - p[end[0]]);
            other.map(|i| normal.dot(p[i] - p[end[0]]) < 0.0)
        };
        if is_below(top, bottom) != [true; 3] || is_below(bottom, top) != [false; 3] {
            return false;
        }
        // The vertex of `other` that is outermost as seen around the edge from a to b.
        let outermost = |a: usize, b: usize, other: [usize; 3]| {
            let edge = p[b] - p[a];
            let mut best = other[0];
            for &i in &other[1..] {
                if edge.cross(p[best] - p[a]).dot(p[i] - p[a]) > 0.0 {
                    best = i;
                }
            }
            best
        };
        self.push(top[0], top[1], top[2]);
        self.push(bottom[0], bottom[2], bottom[1]);
        for i in 0..3 {
            let (a, b) = (top[(i + 1) % 3], top[i]);
            self.push(a, b, outermost(a, b, bottom));
            let (a, b) = (bottom[i], bottom[(i + 1) % 3]);
            self.push(a, b, outermost(a, b, top));
        }
        true
    }

    /// Finds the faces of any six points: every three points whose plane has all other points on one side.
    fn search(&mut self) {
        let p = self.corners;
        for a in 0..4 {
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
                    if above != below && self.count < MAX_FACES {
                        if below {
                            self.push(a, b, c);
                        } else {
                            self.push(a, c, b);
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_math::rng::uniform3;

    fn random_beam(i: u32, spread: f64) -> Hull {
        let r = |k: u32| uniform3(7, k, i).map(|v| f64::from(v) - 0.5);
        let top = [0, 1, 2].map(|k| DVec3::new(r(k)[0], 0.1 * r(k)[1], r(k)[2]));
        let bottom = [3, 4, 5].map(|k| {
            let t = top[k as usize - 3];
            DVec3::new(t.x + spread * r(k)[0], -2.0, t.z + spread * r(k)[2])
        });
        hull(top, bottom, 1.0e-3, 1.0e-3, 0.0)
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

    /// Faces as sets of corners, in order.
    fn sorted_faces(hull: &Hull) -> Vec<[u8; 3]> {
        let mut faces: Vec<[u8; 3]> = hull
            .faces()
            .iter()
            .map(|f| {
                let least = (0..3).min_by_key(|&k| f[k]).unwrap_or(0);
                [f[least], f[(least + 1) % 3], f[(least + 2) % 3]]
            })
            .collect();
        faces.sort_unstable();
        faces
    }

    #[test]
    fn wrapping_finds_the_faces_that_the_search_finds() {
        let mut tilted = 0;
        for i in 0..20_000 {
            let wrapped = random_beam(i, [0.1, 1.0, 40.0][i as usize % 3]);
            let mut again = Hull { corners: wrapped.corners, ..Hull::default() };
            tilted += usize::from(!again.wrap());
            let mut searched = Hull { corners: wrapped.corners, ..Hull::default() };
            searched.search();
            assert_eq!(sorted_faces(&wrapped), sorted_faces(&searched), "beam {i}");
        }
        // Tops so steep that their plane cuts the bottom need the search.
        assert!((100..10_000).contains(&tilted), "{tilted}");
    }

    #[test]
    fn hull_is_closed_for_the_parallel_beams_of_flat_water() {
        for i in 0..2000u32 {
            let size = 0.01 + 0.001 * f64::from(i % 100);
            let at = f64::from(i / 100) * 0.37;
            let top = [DVec3::new(at, 0.0, at), DVec3::new(at, 0.0, at + size), DVec3::new(at + size, 0.0, at)];
            let shift = DVec3::new(0.2, -1.05, -0.1 * f64::from(i % 7));
            assert_closed(&hull(top, top.map(|p| p + shift), 1.0e-4, 2.0e-4, 0.0), &format!("beam {i}"));
        }
    }

    #[test]
    fn hull_contains_the_beam_and_needles_too() {
        let mut needles = 0;
        for i in 0..4000 {
            let r = |k: u32| uniform3(9, k, i).map(|v| f64::from(v) - 0.5);
            let top = [0, 1, 2].map(|k| DVec3::new(r(k)[0], 0.0, r(k)[2]));
            let mut bottom = [3, 4, 5].map(|k| DVec3::new(top[k as usize - 3].x + r(k)[0], -1.0, top[k as usize - 3].z + r(k)[2]));
            // Every other section is a line to within a millionth, or a point.
            if i % 2 == 1 {
                let share = 0.5 + r(6)[0];
                bottom[2] = bottom[0].lerp(bottom[1], share) + DVec3::new(0.0, 0.0, 1.0e-6 * r(6)[1]);
                if i % 64 == 1 {
                    bottom = [bottom[0]; 3];
                }
                needles += 1;
            }
            let hull = hull(top, bottom, 1.0e-3, 1.0e-3, 0.0);
            assert_closed(&hull, &format!("beam {i}"));
            for f in hull.faces() {
                let [a, b, c] = f.map(|k| hull.corners[usize::from(k)]);
                let n = (b - a).cross(c - a).normalize();
                for p in top.iter().chain(&bottom) {
                    assert!(n.dot(*p - a) < -1.0e-6, "beam {i}: a corner of the beam is only {} inside of its hull", -n.dot(*p - a));
                }
            }
        }
        assert_eq!(needles, 2000);
    }
}
