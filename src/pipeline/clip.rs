//! Clipping of triangles and lines in homogeneous coordinates (Sutherland and Hodgman 1974).
//!
//! A new vertex on an edge is computed the same way whichever of the two triangles that share the edge asks, so that meshes
//! stay closed: from the inside end to the outside end, or by a rule that does not depend on direction.

use super::state::{ClipArithmetic, ClipVolume};
use super::viewport::{MIN_W, ViewTransform};

/// A polygon never has more corners: three, and one more per plane.
pub(super) const MAX_CORNERS: usize = 3 + 9;

/// A corner of a clipped primitive.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClipVertex {
    /// Clip-space position.
    pub position: [f32; 4],
    /// Weights of the primitive's vertices.
    pub weights: [f32; 3],
    /// Which vertex it is, if clipping did not make it.
    pub original: Option<u8>,
}

/// A clip plane: signed distance `sign·v[axis] + scale·w + offset`, inside where it is not negative.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    sign: f32,
    scale: f32,
    offset: f32,
}

impl Plane {
    fn distance(&self, v: &[f32; 4]) -> f32 {
        // `w` alone is the plane w >= MIN_W.
        if self.axis == 3 { v[3] + self.offset } else { self.sign * v[self.axis] + self.scale * v[3] }
    }
}

/// The planes of a view, in the order in which the rules apply them.
fn planes(view: &ViewTransform, depth_clip: bool) -> ([Plane; 9], usize) {
    let plane = |axis, sign: f32, scale| Plane { axis, sign, scale, offset: 0.0 };
    let w = Plane { axis: 3, sign: 1.0, scale: 0.0, offset: -MIN_W };
    let (near, far) = (plane(2, 1.0, 0.0), plane(2, -1.0, 1.0));
    let sides = |gx, gy| [plane(0, -1.0, gx), plane(0, 1.0, gx), plane(1, -1.0, gy), plane(1, 1.0, gy)];
    let [gx, gy] = view.guard();
    let mut list = [w; 9];
    let mut count = 0;
    let mut push = |p: Plane| {
        list[count] = p;
        count += 1;
    };
    let depth = |push: &mut dyn FnMut(Plane)| {
        if depth_clip {
            push(near);
            push(far);
        }
    };
    match (view.rules.clip_volume, view.rules.clip_arithmetic) {
        (ClipVolume::GuardBand, _) => {
            depth(&mut push);
            push(w);
            sides(gx, gy).into_iter().for_each(push);
        }
        (ClipVolume::Frustum, ClipArithmetic::OntoPlane) => {
            depth(&mut push);
            push(w);
            sides(1.0, 1.0).into_iter().for_each(push);
        }
        (ClipVolume::Frustum, _) => {
            sides(1.0, 1.0).into_iter().for_each(&mut push);
            depth(&mut push);
            push(w);
        }
    }
    (list, count)
}

fn lerp_vertex(from: &ClipVertex, to: &ClipVertex, t: f32) -> ClipVertex {
    ClipVertex {
        position: std::array::from_fn(|i| from.position[i] + t * (to.position[i] - from.position[i])),
        weights: std::array::from_fn(|i| from.weights[i] + t * (to.weights[i] - from.weights[i])),
        original: None,
    }
}

/// The point where the edge from `inside` (distance `d_in >= 0`) to `outside` (`d_out < 0`) meets the plane.
fn intersect(arithmetic: ClipArithmetic, plane: &Plane, inside: &ClipVertex, d_in: f32, outside: &ClipVertex, d_out: f32) -> ClipVertex {
    match arithmetic {
        ClipArithmetic::InsideToOutside => lerp_vertex(inside, outside, d_in / (d_in - d_out)),
        ClipArithmetic::NearestEndpoint => {
            if -d_out < d_in {
                lerp_vertex(outside, inside, d_out / (d_out - d_in))
            } else {
                lerp_vertex(inside, outside, d_in / (d_in - d_out))
            }
        }
        ClipArithmetic::OntoPlane => {
            let scale = 1.0 / (d_out - d_in);
            let mix = |a: f32, b: f32| (d_out * a - d_in * b) * scale;
            let mut vertex = ClipVertex {
                position: std::array::from_fn(|i| mix(inside.position[i], outside.position[i])),
                weights: std::array::from_fn(|i| mix(inside.weights[i], outside.weights[i])),
                original: None,
            };
            if plane.axis < 3 {
                vertex.position[plane.axis] = -plane.sign * plane.scale * vertex.position[3];
            }
            vertex
        }
    }
}

/// Clips a triangle; the polygon is empty if nothing is left.
pub(super) fn clip_triangle(view: &ViewTransform, depth_clip: bool, triangle: [[f32; 4]; 3]) -> ([ClipVertex; MAX_CORNERS], usize) {
    let mut polygon = [ClipVertex::default(); MAX_CORNERS];
    for (i, position) in triangle.into_iter().enumerate() {
        let mut weights = [0.0; 3];
        weights[i] = 1.0;
        polygon[i] = ClipVertex { position, weights, original: Some(i as u8) };
    }
    let mut corners = 3;
    let (planes, plane_count) = planes(view, depth_clip);
    for plane in &planes[..plane_count] {
        let mut kept = [ClipVertex::default(); MAX_CORNERS];
        let mut kept_count = 0;
        for i in 0..corners {
            let (a, b) = (&polygon[i], &polygon[(i + 1) % corners]);
            let (da, db) = (plane.distance(&a.position), plane.distance(&b.position));
            let mut keep = |v: ClipVertex| {
                // A convex polygon gains at most one corner per plane; rounding must not gain more.
                if kept_count < MAX_CORNERS {
                    kept[kept_count] = v;
                    kept_count += 1;
                }
            };
            if da >= 0.0 {
                keep(*a);
                if db < 0.0 {
                    keep(intersect(view.rules.clip_arithmetic, plane, a, da, b, db));
                }
            } else if db >= 0.0 {
                keep(intersect(view.rules.clip_arithmetic, plane, b, db, a, da));
            }
        }
        polygon = kept;
        corners = kept_count;
        if corners < 3 {
            return (polygon, 0);
        }
    }
    (polygon, corners)
}

/// Clips a line; `None` if nothing is left.
pub(super) fn clip_line(view: &ViewTransform, depth_clip: bool, ends: [[f32; 4]; 2]) -> Option<[ClipVertex; 2]> {
    let mut a = ClipVertex { position: ends[0], weights: [1.0, 0.0, 0.0], original: Some(0) };
    let mut b = ClipVertex { position: ends[1], weights: [0.0, 1.0, 0.0], original: Some(1) };
    let (planes, plane_count) = planes(view, depth_clip);
    for plane in &planes[..plane_count] {
        let (da, db) = (plane.distance(&a.position), plane.distance(&b.position));
        match (da >= 0.0, db >= 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (true, false) => b = intersect(view.rules.clip_arithmetic, plane, &a, da, &b, db),
            (false, true) => a = intersect(view.rules.clip_arithmetic, plane, &b, db, &a, da),
        }
    }
    Some([a, b])
}
