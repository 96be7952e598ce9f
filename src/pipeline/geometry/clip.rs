//! Clipping of triangles and lines in homogeneous coordinates (Sutherland and Hodgman 1974).
//!
//! A new vertex on an edge is computed the same way for both triangles that share the edge, so meshes stay closed: always from the inside end to the
//! outside end, or by a rule that is symmetric in the two ends.

use crate::api::rules::{ClipArithmetic, ClipVolume};
use crate::geometry::viewport::{MIN_W, ViewTransform};
use crate::primitive::clip_vertex::{ClipVertex, Plane};
use crate::vendor::llvmpipe;
use crate::vendor::swiftshader;

/// A polygon has at most this many corners: three, and one more per plane.
pub(crate) const MAX_CORNERS: usize = 3 + 9;

impl Plane {
    /// Signed distance of a vertex from the plane, in the precision of the arithmetic: f32, or f64 before any rounding.
    fn distance(&self, arithmetic: ClipArithmetic, vertex: &ClipVertex) -> f64 {
        // Axis 3 is the plane `w >= MIN_W`.
        if arithmetic == ClipArithmetic::InsideToOutside {
            let v = &vertex.exact;
            if self.axis == 3 { v[3] + f64::from(self.offset) } else { f64::from(self.sign) * v[self.axis] + f64::from(self.scale) * v[3] }
        } else {
            let v = &vertex.position;
            f64::from(if self.axis == 3 { v[3] + self.offset } else { self.sign * v[self.axis] + self.scale * v[3] })
        }
    }
}

/// The clip planes of a view, in the order in which the rules apply them.
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
            let [right, left, top, bottom] = sides(1.0, 1.0);
            [left, right, top, bottom].into_iter().for_each(push);
        }
        (ClipVolume::Frustum, _) => {
            sides(1.0, 1.0).into_iter().for_each(&mut push);
            depth(&mut push);
            push(w);
        }
    }
    (list, count)
}

/// Interpolates from the inside to the outside end in f64; the result is rounded once, after all planes. In f32, an edge hundreds of metres long that
/// passes close to the eye is off by a tenth of a pixel, enough to reverse the winding of the piece next to it.
fn lerp_exact(inside: &ClipVertex, d_in: f64, outside: &ClipVertex, d_out: f64) -> ClipVertex {
    let t = d_in / (d_in - d_out);
    let exact: [f64; 4] = std::array::from_fn(|i| inside.exact[i] + t * (outside.exact[i] - inside.exact[i]));
    ClipVertex {
        position: exact.map(|c| c as f32),
        exact,
        weights: std::array::from_fn(|i| inside.weights[i] + t as f32 * (outside.weights[i] - inside.weights[i])),
        original: None,
    }
}

/// The point where the edge from `inside` (distance `d_in >= 0`) to `outside` (`d_out < 0`) meets the plane.
fn intersect(arithmetic: ClipArithmetic, plane: &Plane, inside: &ClipVertex, d_in: f64, outside: &ClipVertex, d_out: f64) -> ClipVertex {
    match arithmetic {
        ClipArithmetic::InsideToOutside => lerp_exact(inside, d_in, outside, d_out),
        ClipArithmetic::NearestEndpoint => llvmpipe::clipped_edge(inside, d_in as f32, outside, d_out as f32),
        ClipArithmetic::OntoPlane => swiftshader::clipped_edge(plane, inside, d_in as f32, outside, d_out as f32),
    }
}

/// Clips a triangle. The polygon is empty if nothing is left.
pub(crate) fn clip_triangle(view: &ViewTransform, depth_clip: bool, triangle: [[f32; 4]; 3]) -> ([ClipVertex; MAX_CORNERS], usize) {
    let mut polygon = [ClipVertex::default(); MAX_CORNERS];
    for (i, position) in triangle.into_iter().enumerate() {
        let mut weights = [0.0; 3];
        weights[i] = 1.0;
        polygon[i] = ClipVertex { position, exact: position.map(f64::from), weights, original: Some(i as u8) };
    }
    let mut corners = 3;
    let (planes, plane_count) = planes(view, depth_clip);
    for plane in &planes[..plane_count] {
        let mut kept = [ClipVertex::default(); MAX_CORNERS];
        let mut kept_count = 0;
        for i in 0..corners {
            let (a, b) = (&polygon[i], &polygon[(i + 1) % corners]);
            let (da, db) = (plane.distance(view.rules.clip_arithmetic, a), plane.distance(view.rules.clip_arithmetic, b));
            let mut keep = |v: ClipVertex| {
                // A convex polygon gains at most one corner per plane; rounding must not add more.
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
pub(crate) fn clip_line(view: &ViewTransform, depth_clip: bool, ends: [[f32; 4]; 2]) -> Option<[ClipVertex; 2]> {
    let mut a = ClipVertex { position: ends[0], exact: ends[0].map(f64::from), weights: [1.0, 0.0, 0.0], original: Some(0) };
    let mut b = ClipVertex { position: ends[1], exact: ends[1].map(f64::from), weights: [0.0, 1.0, 0.0], original: Some(1) };
    let (planes, plane_count) = planes(view, depth_clip);
    for plane in &planes[..plane_count] {
        let (da, db) = (plane.distance(view.rules.clip_arithmetic, &a), plane.distance(view.rules.clip_arithmetic, &b));
        match (da >= 0.0, db >= 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (true, false) => b = intersect(view.rules.clip_arithmetic, plane, &a, da, &b, db),
            (false, true) => a = intersect(view.rules.clip_arithmetic, plane, &b, db, &a, da),
        }
    }
    Some([a, b])
}
