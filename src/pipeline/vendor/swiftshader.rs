//! Arithmetic of SwiftShader, as measured: depth planes, winding and clipping.

use crate::primitive::clip_vertex::{ClipVertex, Plane};
use crate::primitive::corner::Corner;
use crate::primitive::planes::ZPlane;
use crate::primitive::window::{GUARD_PX, HALF, WindowVertex};

/// The depth plane in f32, relative to one of the vertices. As measured, the vertices are rotated until the one of least clip y is first, then until
/// the one of greatest w is first. Also returns the first vertex's depth and the differences of the other two to it.
pub(crate) fn depth_plane(v: [&WindowVertex; 3], clip: [[f32; 4]; 3]) -> (ZPlane, [f32; 3]) {
    let mut order = [0, 1, 2];
    let rotate_to_front = |order: &mut [usize; 3], wanted: f32, key: &dyn Fn(usize) -> f32| {
        let (second, third) = (key(order[1]), key(order[2]));
        if second == wanted {
            order.rotate_left(1);
        }
        if third == wanted {
            order.rotate_left(2);
        }
    };
    let y = |i: usize| clip[i][1];
    rotate_to_front(&mut order, y(0).min(y(1)).min(y(2)), &y);
    let w = |i: usize| clip[i][3];
    rotate_to_front(&mut order, w(0).max(w(1)).max(w(2)), &w);
    let [v0, v1, v2] = order.map(|i| v[i]);
    let px = |v: &WindowVertex| ((v.fx - HALF) as f32 / 256.0, (v.fy - HALF) as f32 / 256.0);
    let ((x0, y0), (x1, y1), (x2, y2)) = (px(v0), px(v1), px(v2));
    let (x1, y1, x2, y2) = (x1 - x0, y1 - y0, x2 - x0, y2 - y0);
    let d = 1.0 / (x1 * y2 - y1 * x2);
    let (z1, z2) = (v1.z - v0.z, v2.z - v0.z);
    let dx = d * (y2 * z1 - y1 * z2);
    let dy = d * (x1 * z2 - x2 * z1);
    let anchor = [(v0.fx - HALF) >> 8, (v0.fy - HALF) >> 8];
    let sixteenths = [((v0.fx - HALF) & 255) as u8 >> 4, ((v0.fy - HALF) & 255) as u8 >> 4];
    // A corner that clipping cut off can lie beyond the range of a tile primitive's 16-bit anchor.
    let near = anchor.map(|at| at.clamp(i16::MIN.into(), i16::MAX.into()));
    let base = if near == anchor { v0.z } else { v0.z + ((near[0] - anchor[0]) as f32 * dx + (near[1] - anchor[1]) as f32 * dy) };
    let anchor = near;
    (ZPlane { base, dx, dy, anchor, sixteenths, ..ZPlane::default() }, [v0.z, z1, z2])
}

/// Whether a triangle is counter-clockwise on the screen before it is clipped, as SwiftShader computes it: the sign of the snapped area in f32,
/// negated for each corner behind the eye.
pub(crate) fn winds_counter_clockwise(corners: &[Corner; 3]) -> bool {
    let sixteenths = |fx: i32, pixels: f32| {
        // Far outside the view, only the position before snapping is known.
        if pixels.abs() < GUARD_PX { ((fx - HALF) >> 4) as f32 } else { ((pixels - 0.5) * 16.0).round_ties_even() }
    };
    let [[x0, y0], [x1, y1], [x2, y2]] = corners.map(|c| [sixteenths(c.window.fx, c.window.x), sixteenths(c.window.fy, c.window.y)]);
    let area = (y0 - y2) * x1 + (y2 - y1) * x0 + (y1 - y0) * x2;
    let turned = corners.iter().filter(|c| c.clip[3].is_sign_negative()).count() % 2 == 1;
    if turned { area < 0.0 } else { area > 0.0 }
}

/// The point where the edge from `inside` (distance `near >= 0`) to `outside` (`far < 0`) meets a clip plane, put onto the plane.
pub(crate) fn clipped_edge(plane: &Plane, inside: &ClipVertex, near: f32, outside: &ClipVertex, far: f32) -> ClipVertex {
    let scale = 1.0 / (far - near);
    let mix = |a: f32, b: f32| (far * a - near * b) * scale;
    let mut vertex = ClipVertex {
        position: std::array::from_fn(|i| mix(inside.position[i], outside.position[i])),
        weights: std::array::from_fn(|i| mix(inside.weights[i], outside.weights[i])),
        ..ClipVertex::default()
    };
    if plane.axis < 3 {
        vertex.position[plane.axis] = -plane.sign * plane.scale * vertex.position[3];
    }
    vertex
}
