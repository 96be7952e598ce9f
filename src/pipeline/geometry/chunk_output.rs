//! What a chunk of primitives hands to the tiles.

use crate::api::draw::Draw;
use crate::api::shader::clip_vertices::ClipVertices;
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::api::shader::stages::Execution;
use crate::api::state::PixelRect;
use crate::api::statistics::PipelineStatistics;
use crate::geometry::assemble::Assembly;
use crate::geometry::bins::Bins;
use crate::geometry::window_vertices::WindowVertices;

/// What a part streamed out.
pub(crate) struct Streamed {
    pub draw: u32,
    /// Its vertices as floats.
    pub data: Vec<f32>,
    /// If they are points: their sizes.
    pub sizes: Vec<f32>,
}

/// What a chunk hands to the tiles, and its own scratch. Kept between frames, because fresh pages are dear.
#[derive(Default)]
pub(crate) struct ChunkOutput {
    pub bins: Bins,
    pub attributes: Vec<PrimitiveAttributes>,
    pub varyings: Vec<f32>,
    pub statistics: PipelineStatistics,
    /// Streamed primitives in order.
    pub stream: Vec<Streamed>,
    /// Tile primitives made so far.
    pub sequence: u32,
    pub scratch: Scratch,
}

impl ChunkOutput {
    /// Bytes that stay until the tiles have run.
    pub fn bytes(&self) -> usize {
        self.bins.bytes() + self.attributes.len() * size_of::<PrimitiveAttributes>() + self.varyings.len() * 4
    }
}

/// Vertices of one part on their way through the stages.
#[derive(Default)]
pub(crate) struct Scratch {
    pub vertex_index: Vec<u32>,
    pub primitives: Vec<[u32; 3]>,
    pub attributes: Vec<f32>,
    pub clip: ClipVertices,
    pub varyings: Vec<f32>,
    pub emitted: ClipVertices,
    pub emitted_varyings: Vec<f32>,
    pub emitted_primitives: Vec<[u32; 3]>,
    pub strips: Vec<u32>,
    pub emitted_from: Vec<u32>,
    pub window: WindowVertices,
    /// Index to vertex of the part: direct-mapped.
    pub cache: Vec<CacheEntry>,
    /// Number of the part that cache entries must have been made for.
    pub cache_part: u32,
}

#[derive(Clone, Copy, Default)]
pub(crate) struct CacheEntry {
    pub index: u32,
    pub slot: u32,
    pub part: u32,
}

/// What the geometry phase needs to know of the pass.
pub(crate) struct ChunkContext<'a> {
    pub draws: &'a [Draw<'a>],
    pub assemblies: &'a [Assembly],
    /// By draw: how many of those that follow repeat it.
    pub repetitions: &'a [u32],
    pub execution: Execution,
    pub target: PixelRect,
    pub tiles_x: usize,
    pub tile_count: usize,
}
