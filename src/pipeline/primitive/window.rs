//! Vertices in framebuffer coordinates.

/// Sub-pixel units per pixel. Coordinates are kept in 1/256 pixel, whatever the precision of the rules is.
pub(crate) const ONE: i32 = 256;

/// Sub-pixel units of half a pixel, where centres are.
pub(crate) const HALF: i32 = 128;

/// Framebuffer coordinates stay within ± this many pixels, so that edge functions fit 64 bits and differences 25.
pub(crate) const GUARD_PX: f32 = 32768.0;

/// A vertex in framebuffer coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WindowVertex {
    /// Snapped position in 1/256 pixel.
    pub fx: i32,
    /// Snapped position in 1/256 pixel, y down.
    pub fy: i32,
    /// Position in pixels before snapping.
    pub x: f32,
    /// Position in pixels before snapping.
    pub y: f32,
    /// Depth in the viewport's range, before the clamp.
    pub z: f32,
    /// 1/w.
    pub inv_w: f32,
}

/// Outcode bits: one for each plane that a vertex is outside of.
pub(crate) mod outside {
    pub const LEFT: u8 = 1;
    pub const RIGHT: u8 = 2;
    pub const BOTTOM: u8 = 4;
    pub const TOP: u8 = 8;
    pub const NEAR: u8 = 16;
    pub const FAR: u8 = 32;
    /// Beyond the guard band, or `w` too small for the divide.
    pub const GUARD: u8 = 64;
    /// A coordinate is NaN, for which D3D drops the primitive [D3D11.3 §15.16.1], or infinite, for which no edge function exists.
    pub const NAN: u8 = 128;
    pub const FRUSTUM: u8 = 63;
}
