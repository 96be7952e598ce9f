//! Primitive assembly: the vertices or indices of primitive `i` of a draw.

use crate::api::draw::IndexBuffer;
use crate::api::state::PrimitiveTopology;

/// Number of vertices of a primitive of this topology.
pub(crate) fn vertices_per_primitive(topology: PrimitiveTopology) -> usize {
    match topology {
        PrimitiveTopology::PointList => 1,
        PrimitiveTopology::LineList | PrimitiveTopology::LineStrip => 2,
        PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip => 3,
    }
}

/// Number of primitives that `vertices` vertices or indices form without primitive restart.
fn primitive_count(topology: PrimitiveTopology, vertices: u32) -> u32 {
    match topology {
        PrimitiveTopology::PointList => vertices,
        PrimitiveTopology::LineList => vertices / 2,
        PrimitiveTopology::LineStrip => vertices.saturating_sub(1),
        PrimitiveTopology::TriangleList => vertices / 3,
        PrimitiveTopology::TriangleStrip => vertices.saturating_sub(2),
    }
}

/// Start of each primitive of a draw.
#[derive(Clone, Debug)]
pub(crate) enum Assembly {
    /// Computed from the primitive's number.
    Regular { topology: PrimitiveTopology, count: u32 },
    /// A strip with restarts: first vertex or index and parity of each primitive.
    Restarted { topology: PrimitiveTopology, starts: Vec<(u32, bool)> },
}

impl Assembly {
    /// Scans the indices of a strip for restarts [WebGPU: primitive restart is always on for indexed strips].
    pub fn new(topology: PrimitiveTopology, index: Option<&IndexBuffer<'_>>, first: u32, vertices: u32) -> Self {
        let count = primitive_count(topology, vertices);
        if let Some(index) = index
            && topology.is_strip()
        {
            let restart = index.restart();
            let is_restart = |i: u32| index.get((first + i) as usize) == restart;
            if (0..vertices).any(is_restart) {
                let per_primitive = vertices_per_primitive(topology) as u32;
                let mut starts = Vec::new();
                let mut strip_start = 0;
                for i in 0..vertices {
                    if is_restart(i) {
                        strip_start = i + 1;
                    } else if i + 1 - strip_start >= per_primitive {
                        let start = i + 1 - per_primitive;
                        starts.push((start, (start - strip_start) & 1 == 1));
                    }
                }
                return Self::Restarted { topology, starts };
            }
        }
        Self::Regular { topology, count }
    }

    /// Number of primitives of one instance.
    pub fn count(&self) -> u32 {
        match self {
            Self::Regular { count, .. } => *count,
            Self::Restarted { starts, .. } => starts.len() as u32,
        }
    }

    /// The positions of a primitive's vertices in the draw's range of vertices, or of indices if it is indexed; provoking vertex first. Odd triangles
    /// of a strip swap their last two, so that all have the same winding [Vulkan spec, triangle strips].
    #[inline(always)]
    pub fn places(&self, primitive: u32) -> [u32; 3] {
        let (topology, start, odd) = match self {
            Self::Regular { topology, .. } => match topology {
                PrimitiveTopology::PointList => return [primitive; 3],
                PrimitiveTopology::LineList => return [2 * primitive, 2 * primitive + 1, 0],
                PrimitiveTopology::TriangleList => return [3 * primitive, 3 * primitive + 1, 3 * primitive + 2],
                strip => (*strip, primitive, primitive & 1 == 1),
            },
            Self::Restarted { topology, starts } => {
                let (start, odd) = starts[primitive as usize];
                (*topology, start, odd)
            }
        };
        match topology {
            PrimitiveTopology::TriangleStrip if odd => [start, start + 2, start + 1],
            _ => [start, start + 1, start + 2],
        }
    }
}
