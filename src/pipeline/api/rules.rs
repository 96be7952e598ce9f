//! Rasterization rules: the freedoms that specifications leave to a rasterizer, as data.

/// The freedoms that specifications leave to a rasterizer, as data. Presets hold the choices of known rasterizers; `REFERENCE` is ours.
///
/// Sources for the presets: measurements of Mesa 25.0.7 (llvmpipe) and SwiftShader 5.0; the reasons are in `docs/architecture.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RasterRules {
    /// Bits of sub-pixel precision that framebuffer coordinates are rounded to (nearest, ties to even), 8 or 4. Default: 8.
    pub subpixel_bits: u8,
    /// How framebuffer coordinates are computed before they are rounded. Default: `MulAdd`.
    pub viewport: ViewportArithmetic,
    /// How far primitives are clipped before rasterization. Default: `GuardBand`.
    pub clip_volume: ClipVolume,
    /// How the position of a new vertex on a clip plane is computed. Default: `InsideToOutside`.
    pub clip_arithmetic: ClipArithmetic,
    /// How depth is interpolated. Default: `Reference`.
    pub depth_plane: DepthPlane,
    /// Whether attributes are interpolated from snapped positions. Default: `Snapped`.
    pub setup_from: SetupFrom,
    /// Which ends the corners of a wide line are offset from. Default: `UnsnappedEnds`.
    pub line_corners: LineCorners,
    /// How float targets of 16, 11 and 10 bits round. Default: `NearestEven`.
    pub f16_rounding: F16Rounding,
    /// How depth is converted to a b-bit integer, and the size of the unit of constant bias. Default: `NearestUp`.
    pub unorm_depth: UnormDepth,
}

/// Arithmetic from clip coordinates to framebuffer coordinates; `n = c · (1/w)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewportArithmetic {
    /// `n·scale + translate`, rounded twice.
    MulAdd,
    /// `fma(n, scale, translate)`, rounded once (vertices made by clipping: rounded twice). llvmpipe where the CPU has FMA.
    Fused,
    /// `round(n·(2^b·scale) + (2^b·translate − 2^(b−1)))`, sub-pixel scale and pixel-centre offset folded in. SwiftShader.
    Prescaled,
}

/// Planes that primitives are clipped against geometrically; the scissor limits the pixels beyond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipVolume {
    /// Near, far and `w > 0`; x and y only beyond 2^15 pixels [D3D11.3 §3.4.1].
    GuardBand,
    /// The exact view frustum, x and y included. llvmpipe, SwiftShader.
    Frustum,
}

/// Arithmetic of a new vertex on a clip plane, from the two ends of its edge; `d` is the signed distance, inside positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipArithmetic {
    /// `t = d_in/(d_in − d_out)`, `v = in + t·(out − in)`, in f64, rounded once.
    InsideToOutside,
    /// The same interpolation, starting from whichever end is nearer to the plane; plane order −x, +x, −y, +y, near, far. llvmpipe.
    NearestEndpoint,
    /// `v = (d_out·in − d_in·out)/(d_out − d_in)` with the clipped coordinate put on the plane; plane order near,
    /// far, −x, +x, +y, −y. SwiftShader.
    OntoPlane,
}

/// Arithmetic of depth at a pixel centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthPlane {
    /// Gradients in f64 from snapped vertices, rounded to f32; anchored at the pixel that holds vertex 0;
    /// `(z₀ + Δy·∂z/∂y) + Δx·∂z/∂x`.
    Reference,
    /// f32 gradients from unsnapped vertices, anchored at the target's origin, fused: llvmpipe where the CPU has FMA.
    LlvmpipeFused,
    /// The same without FMA, `(a₀ + x·∂z/∂x) + y·∂z/∂y`.
    LlvmpipeMulAdd,
    /// f32 gradients from snapped vertices, relative to a chosen vertex: SwiftShader.
    SwiftShader,
}

/// Positions that attributes are interpolated from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetupFrom {
    /// Snapped positions [D3D11.3 §15.16.2].
    Snapped,
    /// Positions before snapping. llvmpipe.
    Unsnapped,
}

/// Ends that the corners of a wide line are offset from. The corners are snapped after the offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineCorners {
    /// The ends before snapping.
    UnsnappedEnds,
    /// The snapped ends. llvmpipe.
    SnappedEnds,
}

/// Rounding from f32 to floats of 16, 11 or 10 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum F16Rounding {
    /// To nearest, ties to even; overflow becomes infinity. SwiftShader (where most overflows become NaN), most GPUs.
    NearestEven,
    /// Toward zero; overflow becomes the largest finite number [D3D11.3 §3.2.2]. llvmpipe.
    TowardZero,
}

/// Conversion of depth to an integer of b bits, and the unit of constant depth bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnormDepth {
    /// `⌊z·(2^b − 1) + 0.5⌋` with no rounding on the way [D3D11.3 §3.2.3.6]; unit `1/(2^b − 1)`.
    NearestUp,
    /// `z·((2^b − 1)/2^b)` rounded to f32, then to multiples of `2^−b`, ties to even; unit `2/(2^b − 1)`. llvmpipe.
    Scaled,
    /// `z·(2^b − 1)` rounded to f32, then to integers, ties to even; unit `1.01/(2^b − 1)`. SwiftShader.
    NearestEven,
}

impl RasterRules {
    /// The reference: D3D11.3's rules, each freedom resolved in the most accurate way.
    pub const REFERENCE: Self = Self {
        subpixel_bits: 8,
        viewport: ViewportArithmetic::MulAdd,
        clip_volume: ClipVolume::GuardBand,
        clip_arithmetic: ClipArithmetic::InsideToOutside,
        depth_plane: DepthPlane::Reference,
        setup_from: SetupFrom::Snapped,
        line_corners: LineCorners::UnsnappedEnds,
        f16_rounding: F16Rounding::NearestEven,
        unorm_depth: UnormDepth::NearestUp,
    };
    /// Mesa's llvmpipe on a CPU with FMA.
    pub const LAVAPIPE: Self = Self {
        viewport: ViewportArithmetic::Fused,
        clip_volume: ClipVolume::Frustum,
        clip_arithmetic: ClipArithmetic::NearestEndpoint,
        depth_plane: DepthPlane::LlvmpipeFused,
        setup_from: SetupFrom::Unsnapped,
        line_corners: LineCorners::SnappedEnds,
        f16_rounding: F16Rounding::TowardZero,
        unorm_depth: UnormDepth::Scaled,
        ..Self::REFERENCE
    };
    /// Mesa's llvmpipe on a CPU without FMA, or with `GALLIUM_OVERRIDE_CPU_CAPS=sse4.1`.
    pub const LAVAPIPE_NO_FMA: Self =
        Self { viewport: ViewportArithmetic::MulAdd, depth_plane: DepthPlane::LlvmpipeMulAdd, ..Self::LAVAPIPE };
    /// SwiftShader as Chromium builds it: 4 sub-pixel bits.
    pub const SWIFTSHADER: Self = Self {
        subpixel_bits: 4,
        viewport: ViewportArithmetic::Prescaled,
        clip_volume: ClipVolume::Frustum,
        clip_arithmetic: ClipArithmetic::OntoPlane,
        depth_plane: DepthPlane::SwiftShader,
        unorm_depth: UnormDepth::NearestEven,
        ..Self::REFERENCE
    };
}

impl Default for RasterRules {
    fn default() -> Self {
        Self::REFERENCE
    }
}
