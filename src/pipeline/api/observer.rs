//! The capture hook: sees every stage of a pass as it happens.
//!
//! With an observer a pass runs on one thread through the general path, in submission order per chunk and then per
//! tile; the attachments come out the same. Without one nothing is recorded and nothing is paid.

/// What became of a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimitiveOutcome {
    /// Outside the view, or a coordinate is not a number.
    Rejected,
    /// Faces the wrong way.
    Culled,
    /// No area after snapping.
    ZeroArea,
    /// Covers no pixel centre inside the scissor.
    NoSamples,
    /// Went on to rasterization, as one of the pieces that clipping made if `clipped`.
    Rasterized {
        /// Clipping moved or added vertices.
        clipped: bool,
        /// Faces the viewer.
        front_facing: bool,
    },
}

/// A primitive at the end of the geometry phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimitiveEvent {
    /// Draw of the pass.
    pub draw: u32,
    /// Instance of the draw.
    pub instance: u32,
    /// `primitive_index`.
    pub primitive_id: u32,
    /// Snapped corners in 1/256 pixel, if it got that far. Unused corners repeat the last.
    pub corners_fx: Option<[[i32; 2]; 3]>,
    /// What became of it.
    pub outcome: PrimitiveOutcome,
}

/// What became of a fragment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FragmentOutcome {
    /// Failed the stencil test.
    StencilFailed,
    /// Failed the depth test.
    DepthFailed,
    /// The shader discarded it.
    Discarded,
    /// Wrote what the masks let through.
    Passed,
}

/// A covered pixel of a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FragmentEvent {
    /// Draw of the pass.
    pub draw: u32,
    /// `primitive_index`, if the program keeps it.
    pub primitive_id: u32,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Depth that was tested, in 0..=1.
    pub depth: f32,
    /// What became of it.
    pub outcome: FragmentOutcome,
    /// Stencil before.
    pub stencil_before: u8,
    /// Stencil after.
    pub stencil_after: u8,
    /// What the shader gave for target 0; zeros where it did not run, and for fragments it discarded.
    pub shader_color: [f32; 4],
    /// Target 0 before.
    pub color_before: [f32; 4],
    /// Target 0 after.
    pub color_after: [f32; 4],
}

/// Watches a pass. Every method does nothing by default.
pub trait Observer: Send {
    /// Vertices were shaded: their indices, clip positions and varyings (`scalars` per vertex).
    fn vertices(&mut self, _draw: u32, _instance: u32, _indices: &[u32], _positions: &[[f32; 4]], _varyings: &[f32], _scalars: usize) {}
    /// The geometry stage emitted vertices (clip positions) as strips of these lengths.
    fn geometry(&mut self, _draw: u32, _primitive_id: u32, _positions: &[[f32; 4]], _strips: &[u32]) {}
    /// A primitive left the geometry phase.
    fn primitive(&mut self, _event: PrimitiveEvent) {}
    /// A fragment was tested, and shaded or not.
    fn fragment(&mut self, _event: FragmentEvent) {}
}

/// A shorter borrow of an observer.
pub(crate) fn reborrow<'s>(observer: &'s mut Option<&mut dyn Observer>) -> Option<&'s mut dyn Observer> {
    match observer {
        Some(observer) => Some(&mut **observer),
        None => None,
    }
}
