//! Passes: attachments, draws, and what is counted.

use crate::api::draw::Draw;
use crate::api::state::{Color, LoadOp};
use crate::api::statistics::{PipelineStatistics, StreamOutStatistics};
use crate::api::texture_view::TextureViewMut;

/// A colour attachment.
pub struct ColorAttachment<'a> {
    /// What is drawn to.
    pub view: TextureViewMut<'a>,
    /// What it holds before the first draw. Integer formats take the red number as an integer.
    pub load: LoadOp<Color>,
}

/// The depth-stencil attachment.
pub struct DepthStencilAttachment<'a> {
    /// What is drawn to.
    pub view: TextureViewMut<'a>,
    /// Depth before the first draw.
    pub depth_load: LoadOp<f32>,
    /// Stencil before the first draw.
    pub stencil_load: LoadOp<u32>,
}

/// Where stream-out goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamOutTarget {
    /// Per vertex: clip position (4), then the varyings' scalars.
    pub data: Vec<f32>,
    /// Sizes in pixels of the points among the primitives.
    pub point_sizes: Vec<f32>,
    /// Most floats that `data` may have; later primitives are counted but not written.
    pub capacity: usize,
}

/// Attachments, draws and counters of a pass.
#[derive(Default)]
pub struct Pass<'a> {
    /// Name in errors.
    pub label: String,
    /// Colour attachments; `None` for a hole.
    pub color: Vec<Option<ColorAttachment<'a>>>,
    /// Depth-stencil attachment.
    pub depth_stencil: Option<DepthStencilAttachment<'a>>,
    /// In submission order.
    pub draws: Vec<Draw<'a>>,
    /// Occlusion queries.
    pub query_count: usize,
    /// Stream-out targets.
    pub stream_out: Vec<StreamOutTarget>,
}

/// What a pass counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassOutput {
    /// Pipeline statistics of all draws.
    pub statistics: PipelineStatistics,
    /// Exact number of fragments passed, per query.
    pub queries: Vec<u64>,
    /// Per stream-out target.
    pub stream_out: Vec<StreamOutStatistics>,
    /// Times that the tiles ran: the one number here that depends on the device.
    pub waves: u32,
}
