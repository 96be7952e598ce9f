//! Output of a chunk of primitives, for the tiles.

use crate::api::draw::Draw;
use crate::api::shader::clip_vertices::ClipVertices;
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::api::shader::stages::Execution;
use crate::api::state::PixelRect;
use crate::api::statistics::PipelineStatistics;
use crate::geometry::assemble::Assembly;
use crate::geometry::bins::Bins;
use crate::geometry::window_vertices::WindowVertices;

/// Primitives that a part streamed out.
pub(crate) struct Streamed {
    pub draw: u32,
    /// Their vertices, as floats.
    pub data: Vec<f32>,
    /// Their sizes if they are points.
    pub sizes: Vec<f32>,
}

/// Output of a chunk, and its scratch buffers. Kept between frames, because allocating fresh pages is expensive.
#[derive(Default)]
pub(crate) struct ChunkOutput {
    pub bins: Bins,
    pub attributes: Vec<PrimitiveAttributes>,
    pub varyings: Vec<f32>,
    pub statistics: PipelineStatistics,
    /// Streamed-out primitives of each part, in order.
    pub stream: Vec<Streamed>,
    /// Number of tile primitives made so far.
    pub sequence: u32,
    pub scratch: Scratch,
}

impl ChunkOutput {
    /// Bytes that are in use until the tiles have run.
    pub fn bytes(&self) -> usize {
        self.bins.bytes() + self.attributes.len() * size_of::<PrimitiveAttributes>() + self.varyings.len() * 4
    }
}

/// Vertices of one part, stage by stage.
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
    /// Direct-mapped vertex cache: from index to the part's vertex.
    pub cache: Vec<CacheEntry>,
    /// Number of the current part: entries of other parts are invalid.
    pub cache_part: u32,
}

#[derive(Clone, Copy, Default)]
pub(crate) struct CacheEntry {
    pub index: u32,
    pub slot: u32,
    pub part: u32,
}

/// The pass, as the geometry phase needs it.
pub(crate) struct ChunkContext<'a> {
    pub draws: &'a [Draw<'a>],
    pub assemblies: &'a [Assembly],
    /// By draw: how many of the following draws repeat it.
    pub repetitions: &'a [u32],
    pub execution: Execution,
    pub target: PixelRect,
    pub tiles_x: usize,
    pub tile_count: usize,
}
