//! Triangle setup: edge functions, depth plane and interpolation planes of one snapped triangle.
//!
//! With positions in 1/256 pixel and pixel centres at odd multiples of 128, the edge function of `a → b` at pixel (px, py) is
//! `E = 256·(A·px + B·py) + K` with `A = a.y − b.y`, `B = b.x − a.x`. Its sign is that of `A·px + B·py + ⌊K/256⌋`, so edges are exact in whole
//! pixels. The fill rule subtracts one from `K` for edges that are neither top nor left. Inside a tile that an edge crosses, the value fits 32 bits:
//! `|A|, |B| ≤ 2^24`, so `63·(|A|+|B|) < 2^31`. An edge that does not cross the tile is dropped there.

use crate::api::render_pipeline::RenderPipeline;
use crate::api::rules::{DepthPlane, SetupFrom};
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::api::state::PixelRect;
use crate::geometry::depth_bias::{depth_bias, greatest_exponent};
use crate::primitive::planes::{Edges, PlaneFrame, ZPlane, max_slope};
use crate::primitive::window::{HALF, WindowVertex};
use crate::vendor::llvmpipe;
use crate::vendor::llvmpipe::pack_bias;
use crate::vendor::swiftshader;

/// Twice the signed area in 1/65536 pixel², y down: positive is clockwise on the screen.
#[inline(always)]
pub(crate) fn double_area(v: [&WindowVertex; 3]) -> i64 {
    let (x1, y1) = (i64::from(v[1].fx - v[0].fx), i64::from(v[1].fy - v[0].fy));
    let (x2, y2) = (i64::from(v[2].fx - v[0].fx), i64::from(v[2].fy - v[0].fy));
    x1 * y2 - x2 * y1
}

/// Edge functions of a triangle that is clockwise on the screen.
#[inline(always)]
pub(crate) fn edges(v: [&WindowVertex; 3]) -> Edges {
    let mut edges = Edges::default();
    for i in 0..3 {
        let (from, to) = (v[i], v[(i + 1) % 3]);
        let a = from.fy - to.fy;
        let b = to.fx - from.fx;
        // An edge that goes up is a left edge; one that goes right and not down is a top edge.
        let top_left = a > 0 || (a == 0 && b > 0);
        let k = i64::from(a) * i64::from(HALF - from.fx) + i64::from(b) * i64::from(HALF - from.fy) - i64::from(!top_left);
        edges.a[i] = a;
        edges.b[i] = b;
        edges.c[i] = k >> 8;
    }
    edges
}

/// Pixels whose centres lie inside the bounding box of some points, cut to `scissor`; `None` if there are none.
#[inline(always)]
pub(crate) fn pixel_bounds(min: (i32, i32), max: (i32, i32), scissor: PixelRect) -> Option<PixelRect> {
    // First centre at or right of the minimum, last at or left of the maximum.
    let first = |v: i32| (v + HALF - 1) >> 8;
    let last = |v: i32| (v - HALF) >> 8;
    let x0 = first(min.0).max(scissor.x0 as i32);
    let y0 = first(min.1).max(scissor.y0 as i32);
    let x1 = (last(max.0) + 1).min(scissor.x1 as i32);
    let y1 = (last(max.1) + 1).min(scissor.y1 as i32);
    (x0 < x1 && y0 < y1).then_some(PixelRect { x0: x0 as u32, y0: y0 as u32, x1: x1 as u32, y1: y1 as u32 })
}

/// The depth plane through three vertices by the pipeline's rules, and its bias. Under rules that add the bias last, the two are kept apart;
/// otherwise the plane contains the bias. SwiftShader's choice of the reference vertex needs `clip`.
#[inline(always)]
pub(crate) fn depth_plane(pipeline: &RenderPipeline, v: [&WindowVertex; 3], area: i64, clip: impl Fn() -> [[f32; 4]; 3]) -> (ZPlane, f32) {
    let z = [v[0].z, v[1].z, v[2].z];
    match pipeline.rules.depth_plane {
        DepthPlane::Reference => {
            let plane = reference_plane(v, area, z);
            let bias = depth_bias(pipeline, max_slope(&plane), greatest_exponent(z));
            (ZPlane { base: plane.base + bias, ..plane }, bias)
        }
        DepthPlane::LlvmpipeFused | DepthPlane::LlvmpipeMulAdd => {
            let (plane, slope) = llvmpipe::depth_plane(v);
            let bias = depth_bias(pipeline, slope, greatest_exponent(z));
            (ZPlane { anchor: pack_bias(bias), at_origin: true, ..plane }, bias)
        }
        DepthPlane::SwiftShader => {
            let (plane, deltas) = swiftshader::depth_plane(v, clip());
            // The unit follows from the greatest of the first depth and the two differences to it.
            let bias_exponent = greatest_exponent(deltas);
            (ZPlane { bias_exponent, ..plane }, depth_bias(pipeline, max_slope(&plane), bias_exponent))
        }
    }
}

fn reference_plane(v: [&WindowVertex; 3], area: i64, z: [f32; 3]) -> ZPlane {
    let frame = PlaneFrame::new(v.map(|v| [v.fx, v.fy]), area);
    let [base, dx, dy] = frame.plane(z);
    ZPlane { base, dx, dy, anchor: frame.anchor, ..ZPlane::default() }
}

/// The planes of the screen-linear weights of vertices 1 and 2.
#[inline(always)]
pub(crate) fn interpolation_planes(rule: SetupFrom, v: [&WindowVertex; 3], area: i64) -> PrimitiveAttributes {
    let (l1, l2) = match rule {
        SetupFrom::Snapped => (reference_plane(v, area, [0.0, 1.0, 0.0]), reference_plane(v, area, [0.0, 0.0, 1.0])),
        SetupFrom::Unsnapped => (llvmpipe::unsnapped_plane(v, [0.0, 1.0, 0.0]), llvmpipe::unsnapped_plane(v, [0.0, 0.0, 1.0])),
    };
    PrimitiveAttributes {
        anchor: [l1.anchor[0] as f32, l1.anchor[1] as f32],
        l1: [l1.base, l1.dx, l1.dy],
        l2: [l2.base, l2.dx, l2.dy],
        inv_w: [v[0].inv_w, v[1].inv_w, v[2].inv_w],
        ..PrimitiveAttributes::default()
    }
}
