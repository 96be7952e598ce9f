//! Subdivision to a maximum edge length, for techniques that compute something per vertex.

use std::collections::BTreeMap;

use glam::Vec3;
use thiserror::Error;

use super::Mesh;

/// Why a mesh was not subdivided.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum TessellateError {
    /// The edge length is no length.
    #[error("maximum edge length {seen_m} m: must be above 0 and finite")]
    EdgeLength {
        /// The length asked for.
        seen_m: f32,
    },
    /// The result would be too large.
    #[error("the subdivided mesh would exceed {max_triangles} triangles: raise the maximum edge length")]
    TooManyTriangles {
        /// The limit.
        max_triangles: usize,
    },
}

impl Mesh {
    /// The same surface with no edge longer than `max_edge_m`.
    ///
    /// Every edge that is too long is halved, until none is. Whether and where an edge is cut depends on its two ends alone, so
    /// triangles that met in an edge still do and no cracks open, seams included. Texture coordinates are interpolated, normals
    /// interpolated and brought back to unit length; positions stay on the flat triangles.
    ///
    /// # Errors
    /// If the length is not above zero and finite, or the result would have more than `max_triangles` triangles.
    pub fn tessellated(&self, max_edge_m: f32, max_triangles: usize) -> Result<Self, TessellateError> {
        if !(max_edge_m.is_finite() && max_edge_m > 0.0) {
            return Err(TessellateError::EdgeLength { seen_m: max_edge_m });
        }
        let mut mesh = self.clone();
        let too_long = |a: Vec3, b: Vec3| a.distance_squared(b) > max_edge_m * max_edge_m;
        loop {
            let mut midpoints = BTreeMap::<(u32, u32), u32>::new();
            let old = std::mem::take(&mut mesh.indices);
            for t in old.chunks_exact(3) {
                let t = [t[0], t[1], t[2]];
                let cuts: [Option<u32>; 3] = std::array::from_fn(|side| {
                    let (a, b) = (t[side], t[(side + 1) % 3]);
                    let (pa, pb) = (mesh.positions[a as usize], mesh.positions[b as usize]);
                    // A midpoint that falls on an end (coordinates at the limit of f32) cannot shorten the edge.
                    let cut = too_long(pa, pb) && midpoint(pa, pb) != pa && midpoint(pa, pb) != pb;
                    cut.then(|| *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| mesh.push_midpoint(a, b)))
                });
                mesh.push_cut(t, cuts);
                if mesh.triangle_count() > max_triangles {
                    return Err(TessellateError::TooManyTriangles { max_triangles });
                }
            }
            if midpoints.is_empty() {
                return Ok(mesh);
            }
        }
    }

    fn push_midpoint(&mut self, a: u32, b: u32) -> u32 {
        let (i, j) = (a as usize, b as usize);
        let uv = (!self.uvs.is_empty()).then(|| self.uvs[i] * 0.5 + self.uvs[j] * 0.5);
        let normal = (self.normals[i] + self.normals[j]).normalize_or(self.normals[i.min(j)]);
        self.push_vertex(midpoint(self.positions[i], self.positions[j]), normal, uv)
    }

    /// Appends a triangle whose sides `ab`, `bc`, `ca` are cut at the given vertices, as one to four triangles.
    fn push_cut(&mut self, t: [u32; 3], cuts: [Option<u32>; 3]) {
        // Turn the triangle until the pattern is one of the four below.
        for turn in 0..3 {
            let [a, b, c] = std::array::from_fn(|k| t[(k + turn) % 3]);
            let turned: [Option<u32>; 3] = std::array::from_fn(|k| cuts[(k + turn) % 3]);
            match turned {
                [None, None, None] => return self.indices.extend([a, b, c]),
                [Some(ab), None, None] => return self.indices.extend([a, ab, c, ab, b, c]),
                [Some(ab), Some(bc), None] => {
                    self.indices.extend([ab, b, bc]);
                    let length2 = |i: u32, j: u32| self.positions[i as usize].distance_squared(self.positions[j as usize]);
                    let quad = if length2(a, bc) <= length2(ab, c) { [a, ab, bc, a, bc, c] } else { [a, ab, c, ab, bc, c] };
                    return self.indices.extend(quad);
                }
                [Some(ab), Some(bc), Some(ca)] => return self.indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]),
                _ => {}
            }
        }
    }
}

/// Commutative to the last bit, so both triangles of an edge agree.
fn midpoint(a: Vec3, b: Vec3) -> Vec3 {
    a * 0.5 + b * 0.5
}
