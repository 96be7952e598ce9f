//! A tile's part of the attachments, its counters, and the state of the pass that it needs.

use crate::api::draw::Draw;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::resolved::FastPath;
use crate::api::shader::stages::Execution;
use crate::api::state::{MAX_COLOR_TARGETS, StencilFaceState};
use crate::tile::depth_stencil::StencilFace;

/// A tile's part of the attachments.
pub(crate) struct TileTargets<'a> {
    /// `[channel][4096]` per target.
    pub color: [Option<&'a mut [f32]>; MAX_COLOR_TARGETS],
    pub depth: Option<&'a mut [f32]>,
    pub stencil: Option<&'a mut [u8]>,
}

/// Counters of a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileCounters {
    pub fragments_shaded: u64,
    pub fragments_passed: u64,
    /// Fragments that passed: the number of a query and a count to add to it.
    pub queries: Vec<(u32, u64)>,
}

/// The state of the pass that the tile phase needs.
pub(crate) struct TileContext<'a> {
    pub draws: &'a [Draw<'a>],
    /// State of each draw.
    pub states: &'a [DrawState<'a>],
    /// Whether depth is tested as a 32-bit float and no draw writes it, so that [`CoarseDepth`](crate::tile::coarse_depth::CoarseDepth) stays valid.
    pub depth_stays: bool,
    pub execution: Execution,
}

/// State of a draw that most primitives need. In a pass of a hundred thousand draws with a few primitives per tile, nothing else is read of most
/// draws.
#[derive(Clone, Copy)]
pub(crate) struct DrawState<'a> {
    pub pipeline: &'a RenderPipeline,
    /// The pipeline's fast path, or the general path if a query counts the draw's fragments.
    pub path: FastPath,
    stencil_reference: u8,
    /// How many of the following draws have the same primitives.
    pub repetitions: u32,
}

impl<'a> DrawState<'a> {
    pub fn of(draw: &Draw<'a>, repetitions: u32) -> Self {
        let path = if draw.query.is_none() { draw.pipeline.fast_path } else { FastPath::General };
        Self { pipeline: draw.pipeline, path, stencil_reference: draw.stencil_reference as u8, repetitions }
    }

    /// The stencil state for one facing.
    #[inline(always)]
    pub fn stencil_face(&self, state: StencilFaceState) -> StencilFace {
        let plan = &self.pipeline.depth;
        StencilFace { state, reference: self.stencil_reference, read_mask: plan.read_mask, write_mask: plan.write_mask }
    }
}
