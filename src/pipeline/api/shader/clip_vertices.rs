//! Vertices between the last vertex-like stage and setup: in groups of sixteen, planar inside a group.
//!
//! Planes over all vertices would be a power of two apart, as chunks have such sizes; all planes of a vertex would then fall into one set of the
//! cache.

/// Vertices in a group.
pub(crate) const GROUP: usize = 16;

/// Sixteen vertices in clip space.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct ClipGroup {
    /// x, y, z, w.
    pub position: [[f32; GROUP]; 4],
    pub point_size: [f32; GROUP],
}

/// Clip-space positions and point sizes. Entries of the last group beyond the last vertex are undefined.
#[derive(Default)]
pub(crate) struct ClipVertices {
    pub groups: Vec<ClipGroup>,
    count: usize,
}

impl ClipVertices {
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn resize(&mut self, count: usize) {
        self.count = count;
        self.groups.resize(count.div_ceil(GROUP), ClipGroup { position: [[0.0; GROUP]; 4], point_size: [1.0; GROUP] });
    }

    pub fn clear(&mut self) {
        self.resize(0);
    }

    #[inline]
    pub fn push(&mut self, position: [f32; 4], point_size: f32) {
        let (group, lane) = (self.count / GROUP, self.count % GROUP);
        self.resize(self.count + 1);
        let group = &mut self.groups[group];
        for (plane, value) in group.position.iter_mut().zip(position) {
            plane[lane] = value;
        }
        group.point_size[lane] = point_size;
    }

    #[inline(always)]
    pub fn get(&self, vertex: usize) -> [f32; 4] {
        let [x, y, z, w] = &self.groups[vertex / GROUP].position;
        let lane = vertex % GROUP;
        [x[lane], y[lane], z[lane], w[lane]]
    }

    #[inline(always)]
    pub fn point_size(&self, vertex: usize) -> f32 {
        self.groups[vertex / GROUP].point_size[vertex % GROUP]
    }

    /// The positions from vertex `first` on, for an observer.
    pub fn positions_from(&self, first: usize) -> Vec<[f32; 4]> {
        (first..self.count).map(|v| self.get(v)).collect()
    }
}
