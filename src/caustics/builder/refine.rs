//! Triangles cut small enough for a map in which straight edges are bent.
//!
//! Behind a water surface, the rays of a lamp do not meet in a point: in the map through the surface the edges of a large triangle are curves, and a
//! rasterizer would draw their chords. Each edge is halved until it is short for its distance from the lamp. Whether an edge is cut depends on its ends alone,
//! so the triangles on both sides of it still fit together.

use glam::Vec3;

use crate::passes::geometry_buffer::ReceiverVertex;
use crate::receivers::{ReceiverGroup, Receivers};

/// Longest edge, as a share of the distance of its middle from the lamp.
const LONGEST: f32 = 0.15;

/// Most halvings of an edge: of one that passes close by the lamp.
const MOST_HALVINGS: u32 = 7;

/// Triangles as a map draws them.
pub(super) struct Refined {
    /// Indices of those that stay whole.
    pub whole: Vec<u32>,
    /// Corners of the parts of the others, three each.
    pub parts: Vec<ReceiverVertex>,
}

/// The triangles of some groups, cut for a lamp at a place; without those wholly below `lowest_y`, if it is given.
pub(super) fn refined(receivers: &Receivers, groups: &[&ReceiverGroup], lamp: Vec3, lowest_y: Option<f32>) -> Refined {
    let mut refined = Refined { whole: Vec::new(), parts: Vec::new() };
    for group in groups {
        for first in group.indices.clone().step_by(3) {
            let corners = receivers.triangle_at(first);
            if lowest_y.is_some_and(|lowest| corners.iter().all(|p| p.y < lowest)) {
                continue;
            }
            if (0..3).any(|i| is_long(corners[i], corners[(i + 1) % 3], lamp)) {
                cut(corners, lamp, MOST_HALVINGS, &mut refined.parts);
            } else {
                refined.whole.extend_from_slice(&receivers.mesh.indices[first as usize..first as usize + 3]);
            }
        }
    }
    refined
}

fn is_long(a: Vec3, b: Vec3, lamp: Vec3) -> bool {
    a.distance(b) > LONGEST * lamp.distance((a + b) * 0.5)
}

/// Cuts a triangle into those between its corners and the middles of its long edges.
fn cut([a, b, c]: [Vec3; 3], lamp: Vec3, halvings: u32, parts: &mut Vec<ReceiverVertex>) {
    let long = |p: Vec3, q: Vec3| halvings > 0 && is_long(p, q, lamp);
    let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
    let mut more = |triangles: &[[Vec3; 3]]| triangles.iter().for_each(|&triangle| cut(triangle, lamp, halvings - 1, parts));
    match (long(a, b), long(b, c), long(c, a)) {
        (false, false, false) => {
            parts.extend([a, b, c].map(|p| ReceiverVertex { position_ws: p.extend(1.0), normal_ws: glam::Vec4::ZERO }));
        }
        (true, false, false) => more(&[[a, ab, c], [ab, b, c]]),
        (false, true, false) => more(&[[b, bc, a], [bc, c, a]]),
        (false, false, true) => more(&[[c, ca, b], [ca, a, b]]),
        (true, true, false) => more(&[[ab, b, bc], [a, ab, c], [ab, bc, c]]),
        (false, true, true) => more(&[[bc, c, ca], [b, bc, a], [bc, ca, a]]),
        (true, false, true) => more(&[[ca, a, ab], [c, ca, b], [ca, ab, b]]),
        (true, true, true) => more(&[[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(corners: [Vec3; 3], lamp: Vec3) -> Vec<[Vec3; 3]> {
        let mut parts = Vec::new();
        cut(corners, lamp, MOST_HALVINGS, &mut parts);
        parts.chunks_exact(3).map(|t| [0, 1, 2].map(|k| t[k].position_ws.truncate())).collect()
    }

    #[test]
    fn parts_cover_the_triangle_and_are_short() {
        let corners = [Vec3::new(-2.0, 1.0, -2.0), Vec3::new(3.0, 1.0, -2.0), Vec3::new(-2.0, 1.5, 2.0)];
        let lamp = Vec3::new(0.1, -0.4, 0.0);
        let parts = parts(corners, lamp);
        let area = |[a, b, c]: [Vec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let sum: f32 = parts.iter().map(|&part| area(part)).sum();
        assert!((sum / area(corners) - 1.0).abs() < 1e-4 && parts.len() > 200, "{sum} in {} parts", parts.len());
        for [a, b, c] in parts {
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            assert!(longest < 0.16 * lamp.distance((a + b + c) / 3.0) * 1.2, "{longest} at {a}");
        }
    }

    #[test]
    fn neighbours_meet_in_the_same_corners() {
        let (p, q) = (Vec3::new(0.0, 1.0, -3.0), Vec3::new(0.0, 1.0, 3.0));
        let lamp = Vec3::new(0.3, -0.5, 0.2);
        let on_edge = |parts: Vec<[Vec3; 3]>| {
            let mut on: Vec<i32> = parts.into_iter().flatten().filter(|v| v.x == 0.0).map(|v| (v.z * 4096.0) as i32).collect();
            on.sort_unstable();
            on.dedup();
            on
        };
        let (left, right) =
            (on_edge(parts([p, q, Vec3::new(-4.0, 1.0, 0.0)], lamp)), on_edge(parts([q, p, Vec3::new(5.0, 2.0, 1.0)], lamp)));
        assert!(left == right && left.len() > 8, "{left:?} {right:?}");
    }
}
