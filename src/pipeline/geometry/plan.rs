//! Cuts the draws of a pass into chunks for the parallel geometry phase. The cut depends on the draws alone, never on the number of threads.

use std::ops::Range;

use crate::api::draw::Draw;
use crate::geometry::assemble::Assembly;

/// Fewest and most output primitives of a chunk. Within this range, a pass has about [`CHUNKS`] chunks.
const CHUNK_PRIMITIVES: Range<u64> = 512..4_096;

const CHUNKS: u64 = 48;

/// A run of primitives of one instance of one draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub draw: u32,
    pub instance: u32,
    pub first: u32,
    pub count: u32,
}

/// Starts of a draw's primitives.
pub(crate) fn assembly_of(draw: &Draw<'_>) -> Assembly {
    let elements = draw.vertices.end - draw.vertices.start;
    Assembly::new(draw.pipeline.desc.primitive.topology, draw.index.as_ref(), draw.vertices.start, elements)
}

/// Most primitives that a geometry shader may emit per primitive; 1 without a geometry stage.
pub(crate) fn geometry_weight(draw: &Draw<'_>) -> u64 {
    draw.pipeline.desc.program.geometry.as_ref().map_or(1, |g| g.max_vertices.max(1) as u64)
}

/// Cuts the draws into chunks of about equal work. Returns a list of parts, and each chunk's range of that list. A draw with repetitions is not cut,
/// and its repetitions have no parts of their own.
pub(crate) fn plan(draws: &[Draw<'_>], assemblies: &[Assembly], repetitions: &[u32]) -> (Vec<Part>, Vec<Range<usize>>) {
    let firsts = std::iter::successors(Some(0), |&draw: &usize| Some(draw + 1 + repetitions[draw] as usize).filter(|&d| d < draws.len()));
    let firsts = firsts.take(draws.len());
    let work = |draw: usize| {
        let instances = draws[draw].instances.end - draws[draw].instances.start;
        u64::from(assemblies[draw].count()) * u64::from(instances) * geometry_weight(&draws[draw])
    };
    let total: u64 = firsts.clone().map(work).sum();
    let capacity = (total / CHUNKS).clamp(CHUNK_PRIMITIVES.start, CHUNK_PRIMITIVES.end);
    let mut parts = Vec::new();
    let mut chunks = Vec::new();
    let mut chunk_start = 0;
    let mut room = capacity;
    for number in firsts {
        let (draw, count) = (&draws[number], assemblies[number].count());
        let weight = geometry_weight(draw);
        let whole = repetitions[number] > 0;
        for instance in draw.instances.clone() {
            let mut first = 0;
            while first < count {
                let fits = if whole { u64::from(count) } else { (room / weight).max(1) };
                let fits = fits.min(u64::from(count - first)) as u32;
                parts.push(Part { draw: number as u32, instance, first, count: fits });
                first += fits;
                room = room.saturating_sub(u64::from(fits) * weight);
                if room < weight {
                    chunks.push(chunk_start..parts.len());
                    chunk_start = parts.len();
                    room = capacity;
                }
            }
        }
    }
    if chunk_start < parts.len() {
        chunks.push(chunk_start..parts.len());
    }
    (parts, chunks)
}
