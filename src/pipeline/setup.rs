//! Triangle setup: edge functions, depth plane and interpolation planes of one snapped triangle.
//!
//! With positions in 1/256 pixel and pixel centres at odd multiples of 128, the edge function of `a → b` at pixel (px, py) is
//! `E = 256·(A·px + B·py) + K` with `A = a.y − b.y`, `B = b.x − a.x`. Its sign is that of `A·px + B·py + ⌊K/256⌋`, so edges are
//! kept in whole pixels, exactly. The fill rule subtracts one from `K` for edges that are neither top nor left. Inside a tile that an edge
//! crosses, the number fits 32 bits: `|A|, |B| ≤ 2^24`, so `63·(|A|+|B|) < 2^31`; an edge that does not cross the tile is dropped there.

use super::depth_bias::{depth_bias, greatest_exponent, pack_bias};
use super::render_pipeline::RenderPipeline;
use super::shader::PrimitiveAttributes;
use super::state::{DepthPlane, PixelRect, SetupFrom};
use super::viewport::{HALF, WindowVertex};

/// Three edge functions in whole pixels, from the target's origin: inside where none is negative.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Edges {
    pub a: [i32; 3],
    pub b: [i32; 3],
    pub c: [i64; 3],
}

/// Twice the signed area in 1/65536 pixel², y down: positive is clockwise on the screen.
#[inline(always)]
pub(super) fn double_area(v: [&WindowVertex; 3]) -> i64 {
    let (x1, y1) = (i64::from(v[1].fx - v[0].fx), i64::from(v[1].fy - v[0].fy));
    let (x2, y2) = (i64::from(v[2].fx - v[0].fx), i64::from(v[2].fy - v[0].fy));
    x1 * y2 - x2 * y1
}

/// Edge functions of a triangle that is clockwise on the screen.
#[inline(always)]
pub(super) fn edges(v: [&WindowVertex; 3]) -> Edges {
    let mut edges = Edges::default();
    for i in 0..3 {
        let (from, to) = (v[i], v[(i + 1) % 3]);
        let a = from.fy - to.fy;
        let b = to.fx - from.fx;
        // Going up is a left edge, going right without going down a top edge.
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
pub(super) fn pixel_bounds(min: (i32, i32), max: (i32, i32), scissor: PixelRect) -> Option<PixelRect> {
    // First centre at or right of the minimum, last at or left of the maximum.
    let first = |v: i32| (v + HALF - 1) >> 8;
    let last = |v: i32| (v - HALF) >> 8;
    let x0 = first(min.0).max(scissor.x0 as i32);
    let y0 = first(min.1).max(scissor.y0 as i32);
    let x1 = (last(max.0) + 1).min(scissor.x1 as i32);
    let y1 = (last(max.1) + 1).min(scissor.y1 as i32);
    (x0 < x1 && y0 < y1).then_some(PixelRect { x0: x0 as u32, y0: y0 as u32, x1: x1 as u32, y1: y1 as u32 })
}

/// Depth as a linear function of the pixel: `base` at the anchor, then per pixel right and down.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ZPlane {
    pub base: f32,
    pub dx: f32,
    pub dy: f32,
    /// Anchor in whole pixels.
    pub anchor: [i32; 2],
    /// The anchor is the target's origin, and in its place stands a bias that is added last: see [`super::depth_bias`].
    pub at_origin: bool,
    /// SwiftShader: raw exponent of the number whose last place is the unit of the constant bias, which is added last.
    pub bias_exponent: u8,
    /// And sixteenths of a pixel beyond it.
    pub sixteenths: [u8; 2],
}

impl ZPlane {
    /// The same depth everywhere.
    pub fn flat(z: f32) -> Self {
        Self { base: z, ..Self::default() }
    }

    /// Whether a covered pixel's depth might leave `range` by rounding or extrapolation, over `pixels` from the anchor.
    #[inline(always)]
    pub fn may_leave(&self, range: (f32, f32), vertex_z: [f32; 3], bias: f32, pixels: f32) -> bool {
        let slack = 1.0e-6 * (self.base.abs() + (self.dx.abs() + self.dy.abs()) * pixels + 1.0e-3);
        let low = vertex_z[0].min(vertex_z[1]).min(vertex_z[2]) + bias;
        let high = vertex_z[0].max(vertex_z[1]).max(vertex_z[2]) + bias;
        // Written so that not-a-number asks for the clamp.
        !(low - slack > range.0 && high + slack < range.1)
    }
}

/// The plane through three vertices by the pipeline's rules, and its bias. Rasterizers that add the bias last keep it apart, others
/// have it in the plane. `clip` is needed by SwiftShader's choice of reference vertex.
#[inline(always)]
pub(super) fn depth_plane(pipeline: &RenderPipeline, v: [&WindowVertex; 3], area: i64, clip: impl Fn() -> [[f32; 4]; 3]) -> (ZPlane, f32) {
    let z = [v[0].z, v[1].z, v[2].z];
    match pipeline.rules.depth_plane {
        DepthPlane::Reference => {
            let plane = reference_plane(v, area, z);
            let bias = depth_bias(pipeline, max_slope(&plane), greatest_exponent(z));
            (ZPlane { base: plane.base + bias, ..plane }, bias)
        }
        DepthPlane::LlvmpipeFused | DepthPlane::LlvmpipeMulAdd => {
            let x = [v[0].x - 0.5, v[1].x - 0.5, v[2].x - 0.5];
            let y = [v[0].y - 0.5, v[1].y - 0.5, v[2].y - 0.5];
            let ooa = 1.0 / ((x[0] - x[1]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[0] - y[1]));
            let (x01, x20, y01, y20) = (x[0] - x[1], x[2] - x[0], y[0] - y[1], y[2] - y[0]);
            let (z01, z20) = (z[0] - z[1], z[2] - z[0]);
            let dx = z01 * (y20 * ooa) - z20 * (y01 * ooa);
            let dy = z20 * (x01 * ooa) - z01 * (x20 * ooa);
            // Not the gradients themselves: the same products, rounded in another order.
            let slope = ((y01 * z20 - z01 * y20) * ooa).abs().max(((z01 * x20 - x01 * z20) * ooa).abs());
            let bias = depth_bias(pipeline, slope, greatest_exponent(z));
            let plane = ZPlane { base: z[0] - (dx * x[0] + dy * y[0]), dx, dy, ..ZPlane::default() };
            (ZPlane { anchor: pack_bias(bias), at_origin: true, ..plane }, bias)
        }
        DepthPlane::SwiftShader => {
            let (plane, deltas) = swiftshader_plane(v, clip());
            // The step follows the greatest of the first depth and the two differences to it.
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

/// What all planes over one snapped triangle share: its two edges from vertex 0, in f64.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneFrame {
    /// Vertices 1 and 2 from vertex 0 in 1/256 pixel.
    pub x: [f64; 2],
    pub y: [f64; 2],
    /// 256 over twice the area.
    pub scale: f64,
    /// From vertex 0 to the anchor's centre in pixels.
    pub to_centre: [f64; 2],
    /// The pixel that vertex 0 is in.
    pub anchor: [i32; 2],
}

impl PlaneFrame {
    /// From the corners and twice the signed area.
    #[inline(always)]
    pub fn new([v0, v1, v2]: [[i32; 2]; 3], area: i64) -> Self {
        // Ends of wide lines may lie beyond what a record's 16-bit anchor can name.
        let pixel = |at: i32| (at >> 8).clamp(i16::MIN.into(), i16::MAX.into());
        let anchor = [pixel(v0[0]), pixel(v0[1])];
        Self {
            x: [f64::from(v1[0].wrapping_sub(v0[0])), f64::from(v2[0].wrapping_sub(v0[0]))],
            y: [f64::from(v1[1].wrapping_sub(v0[1])), f64::from(v2[1].wrapping_sub(v0[1]))],
            scale: 256.0 / area as f64,
            to_centre: [
                f64::from((anchor[0] << 8).wrapping_add(HALF).wrapping_sub(v0[0])) / 256.0,
                f64::from((anchor[1] << 8).wrapping_add(HALF).wrapping_sub(v0[1])) / 256.0,
            ],
            anchor,
        }
    }

    /// The plane through these values at the three vertices: at the anchor, per pixel right, per pixel down.
    #[inline(always)]
    pub fn plane(&self, f: [f32; 3]) -> [f32; 3] {
        let (f1, f2) = (f64::from(f[1]) - f64::from(f[0]), f64::from(f[2]) - f64::from(f[0]));
        let dx = (f1 * self.y[1] - f2 * self.y[0]) * self.scale;
        let dy = (f2 * self.x[0] - f1 * self.x[1]) * self.scale;
        let base = f64::from(f[0]) + dx * self.to_centre[0] + dy * self.to_centre[1];
        [base as f32, dx as f32, dy as f32]
    }
}

/// Measured on SwiftShader: the vertex of least clip y leads, then the one of greatest w; f32 relative to it. Also gives the first's depth and
/// the differences of the other two to it.
fn swiftshader_plane(v: [&WindowVertex; 3], clip: [[f32; 4]; 3]) -> (ZPlane, [f32; 3]) {
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
    // A corner that clipping cut off can lie beyond what a record's 16-bit anchor can name.
    let near = anchor.map(|at| at.clamp(i16::MIN.into(), i16::MAX.into()));
    let base = if near == anchor { v0.z } else { v0.z + ((near[0] - anchor[0]) as f32 * dx + (near[1] - anchor[1]) as f32 * dy) };
    let anchor = near;
    (ZPlane { base, dx, dy, anchor, sixteenths, ..ZPlane::default() }, [v0.z, z1, z2])
}

/// Slope of a plane for depth bias: `max(|∂z/∂x|, |∂z/∂y|)` [D3D11.3 §15.10].
pub(super) fn max_slope(plane: &ZPlane) -> f32 {
    plane.dx.abs().max(plane.dy.abs())
}

/// The planes that give vertices 1 and 2 their weight at a pixel.
#[inline(always)]
pub(super) fn interpolation_planes(rule: SetupFrom, v: [&WindowVertex; 3], area: i64) -> PrimitiveAttributes {
    let (l1, l2) = match rule {
        SetupFrom::Snapped => (reference_plane(v, area, [0.0, 1.0, 0.0]), reference_plane(v, area, [0.0, 0.0, 1.0])),
        SetupFrom::Unsnapped => (unsnapped_plane(v, [0.0, 1.0, 0.0]), unsnapped_plane(v, [0.0, 0.0, 1.0])),
    };
    PrimitiveAttributes {
        anchor: [l1.anchor[0] as f32, l1.anchor[1] as f32],
        l1: [l1.base, l1.dx, l1.dy],
        l2: [l2.base, l2.dx, l2.dy],
        inv_w: [v[0].inv_w, v[1].inv_w, v[2].inv_w],
        ..PrimitiveAttributes::default()
    }
}

fn unsnapped_plane(v: [&WindowVertex; 3], f: [f32; 3]) -> ZPlane {
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
