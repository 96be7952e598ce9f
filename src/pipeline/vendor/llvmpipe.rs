//! Arithmetic of Mesa's llvmpipe, as measured: depth planes, bias and clipping.

use crate::primitive::clip_vertex::ClipVertex;
use crate::primitive::planes::ZPlane;
use crate::primitive::window::WindowVertex;

pub(crate) fn unsnapped_plane(v: [&WindowVertex; 3], f: [f32; 3]) -> ZPlane {
    let (x1, y1) = (f64::from(v[1].x) - f64::from(v[0].x), f64::from(v[1].y) - f64::from(v[0].y));
    let (x2, y2) = (f64::from(v[2].x) - f64::from(v[0].x), f64::from(v[2].y) - f64::from(v[0].y));
    let (f1, f2) = (f64::from(f[1] - f[0]), f64::from(f[2] - f[0]));
    let scale = 1.0 / (x1 * y2 - x2 * y1);
    let (dx, dy) = ((f1 * y2 - f2 * y1) * scale, (f2 * x1 - f1 * x2) * scale);
    let anchor = [v[0].fx >> 8, v[0].fy >> 8];
    let offset = [f64::from(anchor[0]) + 0.5 - f64::from(v[0].x), f64::from(anchor[1]) + 0.5 - f64::from(v[0].y)];
    let base = f64::from(f[0]) + dx * offset[0] + dy * offset[1];
    ZPlane { base: base as f32, dx: dx as f32, dy: dy as f32, anchor, ..ZPlane::default() }
}

/// The depth plane in f32, from positions before snapping and anchored at the target's origin; and its slope for depth bias.
///
/// The slope is computed from the same products as the gradients, rounded in another order.
pub(crate) fn depth_plane(v: [&WindowVertex; 3]) -> (ZPlane, f32) {
    let z = [v[0].z, v[1].z, v[2].z];
    let x = [v[0].x - 0.5, v[1].x - 0.5, v[2].x - 0.5];
    let y = [v[0].y - 0.5, v[1].y - 0.5, v[2].y - 0.5];
    let ooa = 1.0 / ((x[0] - x[1]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[0] - y[1]));
    let (x01, x20, y01, y20) = (x[0] - x[1], x[2] - x[0], y[0] - y[1], y[2] - y[0]);
    let (z01, z20) = (z[0] - z[1], z[2] - z[0]);
    let dx = z01 * (y20 * ooa) - z20 * (y01 * ooa);
    let dy = z20 * (x01 * ooa) - z01 * (x20 * ooa);
    let slope = ((y01 * z20 - z01 * y20) * ooa).abs().max(((z01 * x20 - x01 * z20) * ooa).abs());
    (ZPlane { base: z[0] - (dx * x[0] + dy * y[0]), dx, dy, ..ZPlane::default() }, slope)
}

/// Packs a bias into two 16-bit numbers. A tile primitive keeps them in place of its anchor, which is the target's origin.
pub(crate) fn pack_bias(bias: f32) -> [i32; 2] {
    let bits = bias.to_bits();
    [i32::from(bits as u16 as i16), i32::from((bits >> 16) as u16 as i16)]
}

/// The inverse of [`pack_bias`].
#[inline(always)]
pub(crate) fn unpack_bias([low, high]: [i16; 2]) -> f32 {
    f32::from_bits(u32::from(low as u16) | u32::from(high as u16) << 16)
}

/// The point where the edge from `inside` (distance `near >= 0`) to `outside` (`far < 0`) meets a clip plane, computed from the nearer end.
pub(crate) fn clipped_edge(inside: &ClipVertex, near: f32, outside: &ClipVertex, far: f32) -> ClipVertex {
    if -far < near { lerp_vertex(outside, inside, far / (far - near)) } else { lerp_vertex(inside, outside, near / (near - far)) }
}

fn lerp_vertex(from: &ClipVertex, to: &ClipVertex, t: f32) -> ClipVertex {
    ClipVertex {
        position: std::array::from_fn(|i| from.position[i] + t * (to.position[i] - from.position[i])),
        weights: std::array::from_fn(|i| from.weights[i] + t * (to.weights[i] - from.weights[i])),
        ..ClipVertex::default()
    }
}
