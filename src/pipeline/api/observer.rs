//! The capture hook: sees every stage of a pass as it happens.
//!
//! With an observer a pass runs on one thread through the general path, in submission order per chunk and then per tile. The attachments have the
//! same bytes. Without an observer nothing is recorded, at no cost.

/// Outcome of a primitive at the end of the geometry phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimitiveOutcome {
    /// Outside the view, or a coordinate is not a number.
    Rejected,
    /// Culled by its facing.
    Culled,
    /// No area after snapping.
    ZeroArea,
    /// Covers no pixel centre inside the scissor.
    NoSamples,
    /// Went on to rasterization: whole, or as one of the pieces that clipping made if `clipped`.
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
    /// Snapped corners in 1/256 pixel; `None` if the primitive was rejected before snapping. Unused corners repeat the last.
    pub corners_fx: Option<[[i32; 2]; 3]>,
    /// Its outcome.
    pub outcome: PrimitiveOutcome,
}

/// Outcome of a fragment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FragmentOutcome {
    /// Failed the stencil test.
    StencilFailed,
    /// Failed the depth test.
    DepthFailed,
    /// The shader discarded it.
    Discarded,
    /// Passed all tests: the write masks decide which channels change.
    Passed,
}

/// A covered pixel of a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FragmentEvent {
    /// Draw of the pass.
    pub draw: u32,
    /// `primitive_index`, if the program keeps interpolation data; otherwise 0.
    pub primitive_id: u32,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Depth that was tested, in 0..=1.
    pub depth: f32,
    /// Its outcome.
    pub outcome: FragmentOutcome,
    /// Stencil before the fragment.
    pub stencil_before: u8,
    /// Stencil after the fragment.
    pub stencil_after: u8,
    /// The shader's output for target 0; zeros where the shader did not run, and for discarded fragments.
    pub shader_color: [f32; 4],
    /// Target 0 before the fragment.
    pub color_before: [f32; 4],
    /// Target 0 after the fragment.
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
