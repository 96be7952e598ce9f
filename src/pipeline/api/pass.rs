//! Passes: attachments, draws and counters.

use crate::api::draw::Draw;
use crate::api::state::{Color, LoadOp};
use crate::api::statistics::{PipelineStatistics, StreamOutStatistics};
use crate::api::texture_view::TextureViewMut;

/// A colour attachment.
pub struct ColorAttachment<'a> {
    /// The surface that is drawn to.
    pub view: TextureViewMut<'a>,
    /// Value before the first draw: cleared or kept. Integer formats round each clear component toward zero and clamp it.
    pub load: LoadOp<Color>,
}

/// The depth-stencil attachment.
pub struct DepthStencilAttachment<'a> {
    /// The surface that is drawn to.
    pub view: TextureViewMut<'a>,
    /// Depth before the first draw.
    pub depth_load: LoadOp<f32>,
    /// Stencil before the first draw.
    pub stencil_load: LoadOp<u32>,
}

/// Receives the primitives of draws with stream-out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamOutTarget {
    /// Per vertex: clip position (4), then the varyings' scalars.
    pub data: Vec<f32>,
    /// Sizes of the streamed points, pixels, one for each.
    pub point_sizes: Vec<f32>,
    /// Most floats that `data` may hold. Primitives beyond are counted but not written.
    pub capacity: usize,
}

/// Attachments, draws and counters of a pass.
#[derive(Default)]
pub struct Pass<'a> {
    /// Name in errors.
    pub label: String,
    /// Colour attachments by target; `None` for a target without one.
    pub color: Vec<Option<ColorAttachment<'a>>>,
    /// Depth-stencil attachment, if any.
    pub depth_stencil: Option<DepthStencilAttachment<'a>>,
    /// Draws in submission order.
    pub draws: Vec<Draw<'a>>,
    /// Number of occlusion queries.
    pub query_count: usize,
    /// Stream-out targets, by the number that draws name.
    pub stream_out: Vec<StreamOutTarget>,
}

/// Counters of a pass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassOutput {
    /// Pipeline statistics of all draws.
    pub statistics: PipelineStatistics,
    /// By query: number of fragments that passed, exact.
    pub queries: Vec<u64>,
    /// By stream-out target.
    pub stream_out: Vec<StreamOutStatistics>,
    /// Number of waves: how often the tiles ran. The only number here that depends on the device.
    pub waves: u32,
}
