//! Vertex normals from the surface: smooth, smooth up to creases, flat.

use glam::Vec3;

use super::{
    Mesh,
    topology::{edges, place_ids},
};

/// The normal of a vertex no triangle with an area uses.
const FALLBACK_NORMAL: Vec3 = Vec3::Y;

/// The unit vector along `v`; zero if `v` is zero or not finite.
///
/// Scaled to about 1 first, by a power of two: the square of a small component would be rounded as a denormal, or away, and that of a
/// large one overflow.
pub(crate) fn direction(v: Vec3) -> Vec3 {
    let largest = v.abs().max_element();
    if !(v.is_finite() && largest > 0.0) {
        return Vec3::ZERO;
    }
    let exponent = libm::ilogbf(largest);
    Vec3::from_array(v.to_array().map(|c| libm::scalbnf(c, -exponent))).normalize()
}

/// The unit vector along `v`, or [`FALLBACK_NORMAL`] if it has none.
pub(super) fn normal_along(v: Vec3) -> Vec3 {
    let unit = direction(v);
    if unit == Vec3::ZERO { FALLBACK_NORMAL } else { unit }
}

/// Unit normal of a triangle; zero if it has no area.
pub(super) fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    // Scaled first, so that neither a millimetre mesh nor a planet leaves the range of f32 in the cross product.
    let (ab, ac) = (b - a, c - a);
    let scale = ab.abs().max(ac.abs()).max_element();
    if scale > 0.0 && scale.is_finite() { direction((ab / scale).cross(ac / scale)) } else { Vec3::ZERO }
}

/// Angle at corner `a` in radians, 0..=π.
fn corner_angle([a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac) = (direction(b - a), direction(c - a));
    libm::atan2f(ab.cross(ac).length(), ab.dot(ac))
}

/// What each corner of a triangle adds to the normal there: the unit face normal times the angle at the corner.
fn corner_terms(corners: [Vec3; 3]) -> [Vec3; 3] {
    let normal = face_normal(corners);
    let [a, b, c] = corners;
    [normal * corner_angle([a, b, c]), normal * corner_angle([b, c, a]), normal * corner_angle([c, a, b])]
}

impl Mesh {
    /// Replaces the normals by smooth ones: `n(p) = normalize(Σ_triangles at p angle · face normal)` [Thürmer and Wüthrich 1998].
    ///
    /// Weighting by angle makes the result independent of how the surface around a vertex is cut into triangles. All vertices at one
    /// place get the same normal, so texture seams do not show; see [`Mesh::crease`] for edges that should stay sharp. Triangles
    /// without an area count nothing; a vertex without any other gets `+y`. Panics on vertex numbers that do not exist.
    pub fn smooth_normals(&mut self) {
        let places = place_ids(&self.positions);
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for triangle in self.indices.chunks_exact(3) {
            let terms = corner_terms(self.corners([triangle[0], triangle[1], triangle[2]]));
            for (&vertex, term) in triangle.iter().zip(terms) {
                sums[places[vertex as usize] as usize] += term;
            }
        }
        self.normals.clear();
        self.normals.extend(places.iter().map(|&place| normal_along(sums[place as usize])));
    }

    /// Replaces the normals by ones that are smooth except across creases: edges at which the surface turns by more than `angle_rad`.
    ///
    /// Two corners at one place share a normal if a chain of edges that are no creases connects their triangles around it. Vertices
    /// are split where their corners got different normals and dropped where unused. Border edges, and edges of more than two
    /// triangles, are creases. Panics on vertex numbers that do not exist.
    pub fn crease(&mut self, angle_rad: f32) {
        let places = place_ids(&self.positions);
        let cos_limit = libm::cosf(angle_rad.clamp(0.0, std::f32::consts::PI));
        let faces: Vec<Vec3> = self.triangles().map(|t| face_normal(self.corners(t))).collect();

        // Join the corners on both sides of every smooth edge.
        let mut group: Vec<u32> = (0..self.indices.len() as u32).collect();
        let edges = edges(&self.indices, &places);
        for run in edges.chunk_by(|a, b| a.places == b.places) {
            let &[a, b] = run else { continue };
            let (face_a, face_b) = (faces[a.corner as usize / 3], faces[b.corner as usize / 3]);
            if face_a.dot(face_b) < cos_limit {
                continue;
            }
            for place in a.places {
                let corner_at = |edge_corner: u32| {
                    let (triangle, side) = (edge_corner / 3 * 3, edge_corner % 3);
                    let next = triangle + (side + 1) % 3;
                    if places[self.indices[edge_corner as usize] as usize] == place { edge_corner } else { next }
                };
                join(&mut group, corner_at(a.corner), corner_at(b.corner));
            }
        }

        let mut sums = vec![Vec3::ZERO; self.indices.len()];
        for triangle in 0..self.triangle_count() {
            let corners = std::array::from_fn(|k| self.positions[self.indices[triangle * 3 + k] as usize]);
            for (k, term) in corner_terms(corners).into_iter().enumerate() {
                sums[root(&mut group, (triangle * 3 + k) as u32) as usize] += term;
            }
        }

        // One new vertex per (old vertex, group): corners sorted by both.
        let mut corners: Vec<(u32, u32, u32)> =
            (0..self.indices.len() as u32).map(|corner| (self.indices[corner as usize], root(&mut group, corner), corner)).collect();
        corners.sort_unstable();
        let mut mesh = Self { indices: vec![0; self.indices.len()], ..Self::default() };
        for run in corners.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let old = run[0].0 as usize;
            let normal = normal_along(sums[run[0].1 as usize]);
            let vertex = mesh.push_vertex(self.positions[old], normal, self.uvs.get(old).copied());
            for &(_, _, corner) in run {
                mesh.indices[corner as usize] = vertex;
            }
        }
        *self = mesh;
    }

    /// Replaces the normals by those of the triangles, giving every triangle three vertices of its own.
    ///
    /// A triangle without an area gets `+y`. Panics on vertex numbers that do not exist.
    pub fn flat_normals(&mut self) {
        let mut mesh = Self::default();
        for triangle in self.triangles() {
            let normal = normal_along(face_normal(self.corners(triangle)));
            for old in triangle {
                let vertex = mesh.push_vertex(self.positions[old as usize], normal, self.uvs.get(old as usize).copied());
                mesh.indices.push(vertex);
            }
        }
        *self = mesh;
    }
}

/// Smallest member of the group of a corner (union-find with path halving).
fn root(group: &mut [u32], mut corner: u32) -> u32 {
    while group[corner as usize] != corner {
        let parent = group[corner as usize];
        group[corner as usize] = group[parent as usize];
        corner = group[corner as usize];
    }
    corner
}

fn join(group: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(group, a), root(group, b));
    group[a.max(b) as usize] = a.min(b);
}
