//! Linear functions over a snapped triangle: its edges, and planes through three values.

use crate::primitive::window::HALF;

/// Three edge functions `a·x + b·y + c` in whole pixels from the target's origin. A pixel is inside where none is negative.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Edges {
    pub a: [i32; 3],
    pub b: [i32; 3],
    pub c: [i64; 3],
}

/// Depth as a linear function of the pixel: value at the anchor, change per pixel right and per pixel down.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ZPlane {
    pub base: f32,
    pub dx: f32,
    pub dy: f32,
    /// Anchor in whole pixels.
    pub anchor: [i32; 2],
    /// llvmpipe: the anchor is the target's origin, and `anchor` holds a bias instead, which is added last; see `vendor::llvmpipe`.
    pub at_origin: bool,
    /// SwiftShader: raw exponent of a number whose unit in the last place is the unit of the constant bias, which is added last.
    pub bias_exponent: u8,
    /// SwiftShader: sixteenths of a pixel that the anchor lies beyond `anchor`.
    pub sixteenths: [u8; 2],
}

impl ZPlane {
    /// The plane of constant depth.
    pub fn flat(z: f32) -> Self {
        Self { base: z, ..Self::default() }
    }

    /// Whether rounding or extrapolation may move a covered pixel's depth out of `range`. `pixels` bounds the distance from the anchor.
    #[inline(always)]
    pub fn may_leave(&self, range: (f32, f32), vertex_z: [f32; 3], bias: f32, pixels: f32) -> bool {
        let slack = 1.0e-6 * (self.base.abs() + (self.dx.abs() + self.dy.abs()) * pixels + 1.0e-3);
        let low = vertex_z[0].min(vertex_z[1]).min(vertex_z[2]) + bias;
        let high = vertex_z[0].max(vertex_z[1]).max(vertex_z[2]) + bias;
        // The comparison is written so that NaN requests the clamp.
        !(low - slack > range.0 && high + slack < range.1)
    }
}

/// Data that all planes over one snapped triangle share: its two edges from vertex 0, in f64.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneFrame {
    /// Vertices 1 and 2 from vertex 0 in 1/256 pixel.
    pub x: [f64; 2],
    pub y: [f64; 2],
    /// 256 over twice the area.
    pub scale: f64,
    /// Vector from vertex 0 to the centre of the anchor pixel, pixels.
    pub to_centre: [f64; 2],
    /// The pixel that contains vertex 0.
    pub anchor: [i32; 2],
}

impl PlaneFrame {
    /// From the snapped corners and twice the signed area.
    #[inline(always)]
    pub fn new([v0, v1, v2]: [[i32; 2]; 3], area: i64) -> Self {
        // Ends of wide lines may lie beyond the range of a tile primitive's 16-bit anchor.
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

    /// The plane through values at the three vertices: value at the anchor, change per pixel right and per pixel down.
    #[inline(always)]
    pub fn plane(&self, f: [f32; 3]) -> [f32; 3] {
        let (f1, f2) = (f64::from(f[1]) - f64::from(f[0]), f64::from(f[2]) - f64::from(f[0]));
        let dx = (f1 * self.y[1] - f2 * self.y[0]) * self.scale;
        let dy = (f2 * self.x[0] - f1 * self.x[1]) * self.scale;
        let base = f64::from(f[0]) + dx * self.to_centre[0] + dy * self.to_centre[1];
        [base as f32, dx as f32, dy as f32]
    }
}

/// Slope of a plane for depth bias: `max(|∂z/∂x|, |∂z/∂y|)` [D3D11.3 §15.10].
pub(crate) fn max_slope(plane: &ZPlane) -> f32 {
    plane.dx.abs().max(plane.dy.abs())
}

impl ZPlane {
    /// Largest distance of the anchor from the vertices, pixels: 0 unless the anchor is the target's origin.
    pub fn anchor_slack(&self) -> f32 {
        if self.at_origin { 32768.0 } else { 2.0 }
    }
}
