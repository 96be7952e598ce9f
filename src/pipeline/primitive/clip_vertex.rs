//! Corners of a primitive that is being clipped, and the planes that it is clipped to.

/// A corner of a clipped primitive.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClipVertex {
    /// Clip-space position.
    pub position: [f32; 4],
    /// The same position before rounding, for the reference arithmetic.
    pub exact: [f64; 4],
    /// Barycentric weights in the primitive's original vertices.
    pub weights: [f32; 3],
    /// Number of the original vertex; `None` if clipping made the corner.
    pub original: Option<u8>,
}

/// A clip plane: signed distance `sign·v[axis] + scale·w + offset`, inside where it is not negative.
#[derive(Clone, Copy)]
pub(crate) struct Plane {
    pub axis: usize,
    pub sign: f32,
    pub scale: f32,
    pub offset: f32,
}
