//! What is connected to what: places, edges, closedness, volume, welding.

use std::collections::BTreeMap;

use glam::Vec3;

use super::Mesh;

/// One side of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Edge {
    /// Places of its ends, smaller first.
    pub places: [u32; 2],
    /// Position in the index list of its first vertex; the second is the next of the same triangle.
    pub corner: u32,
    /// Whether it runs from the smaller place to the larger.
    pub rising: bool,
}

/// The place of each vertex: the number of the first vertex with the same coordinates. `0.0` and `-0.0` are the same.
pub(super) fn place_ids(positions: &[Vec3]) -> Vec<u32> {
    let key = |i: u32| (positions[i as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (key(i), i));
    let mut places = vec![0; positions.len()];
    for run in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &vertex in run {
            places[vertex as usize] = run[0];
        }
    }
    places
}

/// All triangle sides between different places, sorted, so that sides of one edge are neighbours.
pub(super) fn edges(indices: &[u32], places: &[u32]) -> Vec<Edge> {
    let mut edges = Vec::with_capacity(indices.len());
    for (triangle, t) in indices.chunks_exact(3).enumerate() {
        for side in 0..3 {
            let (from, to) = (places[t[side] as usize], places[t[(side + 1) % 3] as usize]);
            if from != to {
                let corner = (triangle * 3 + side) as u32;
                edges.push(Edge { places: [from.min(to), from.max(to)], corner, rising: from < to });
            }
        }
    }
    edges.sort_unstable();
    edges
}

/// How the triangles of a mesh meet. Vertices at one place count as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EdgeReport {
    /// Edges in all.
    pub edge_count: usize,
    /// Edges of one triangle only: the border of an open surface.
    pub border_count: usize,
    /// Edges of three triangles or more.
    pub non_manifold_count: usize,
    /// Edges whose two triangles run along it in the same direction: one of them is inside out.
    pub inconsistent_count: usize,
    /// Triangles with two corners at one place; their remaining sides are counted as edges.
    pub collapsed_count: usize,
}

impl EdgeReport {
    /// Whether the surface is a closed manifold with one orientation: every edge has two triangles that run along it in opposite directions.
    #[must_use]
    pub fn is_closed(self) -> bool {
        self.edge_count > 0 && self.border_count == 0 && self.non_manifold_count == 0 && self.inconsistent_count == 0
    }
}

impl Mesh {
    /// Counts edges by how many triangles share them.
    #[must_use]
    pub fn edge_report(&self) -> EdgeReport {
        let places = place_ids(&self.positions);
        let collapsed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| places[i as usize]);
            a == b || b == c || c == a
        };
        let mut report = EdgeReport { collapsed_count: self.triangles().filter(collapsed).count(), ..EdgeReport::default() };
        for run in edges(&self.indices, &places).chunk_by(|a, b| a.places == b.places) {
            report.edge_count += 1;
            match run {
                [_] => report.border_count += 1,
                [a, b] => report.inconsistent_count += usize::from(a.rising == b.rising),
                _ => report.non_manifold_count += 1,
            }
        }
        report
    }

    /// Whether the mesh bounds a solid; see [`EdgeReport::is_closed`].
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.edge_report().is_closed()
    }

    /// Volume in m³, `Σ_triangles a · (b × c) / 6`: positive for a closed surface whose triangles face out.
    ///
    /// For an open surface it is the volume of the cone over it from the centre of its bounds.
    #[must_use]
    pub fn signed_volume(&self) -> f64 {
        if self.positions.is_empty() {
            return 0.0;
        }
        // About the centre, so that a small body far from the origin keeps its digits.
        let center = self.bounds().center().as_dvec3();
        self.triangles().fold(0.0, |sum, t| {
            let [a, b, c] = self.corners(t).map(|p| p.as_dvec3() - center);
            sum + a.dot(b.cross(c)) / 6.0
        })
    }

    /// Area of all triangles in m².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.triangles().fold(0.0, |sum, t| {
            let [a, b, c] = self.corners(t).map(|p| p.as_dvec3());
            sum + (b - a).cross(c - a).length() / 2.0
        })
    }

    /// The mesh with vertices closer than `tolerance_m` joined into one and collapsed triangles left out, normals made smooth and
    /// texture coordinates dropped.
    ///
    /// Each vertex joins the first earlier one in reach that did not itself join another; coordinates are never averaged. A tolerance
    /// that is not above zero joins equal coordinates only.
    #[must_use]
    pub fn welded(&self, tolerance_m: f32) -> Self {
        let join = if tolerance_m > 0.0 { self.join_within(tolerance_m) } else { place_ids(&self.positions) };
        let mut mesh = Self { positions: self.positions.clone(), ..Self::default() };
        for triangle in self.triangles() {
            let [a, b, c] = triangle.map(|i| join[i as usize]);
            if a != b && b != c && c != a {
                mesh.indices.extend([a, b, c]);
            }
        }
        mesh.normals.resize(mesh.positions.len(), Vec3::Y);
        mesh.compact();
        mesh.smooth_normals();
        mesh
    }

    /// For each vertex the one it joins. Kept vertices lie in a grid of cells one tolerance wide, so only 27 cells can hold one in reach.
    fn join_within(&self, tolerance_m: f32) -> Vec<u32> {
        let mut cells = BTreeMap::<[i64; 3], Vec<u32>>::new();
        let cell_of = |p: Vec3| (p.as_dvec3() / f64::from(tolerance_m)).floor().to_array().map(|c| c as i64);
        let mut join = Vec::with_capacity(self.positions.len());
        for (vertex, &p) in self.positions.iter().enumerate() {
            let [x, y, z] = cell_of(p);
            let near = |i: &u32| self.positions[*i as usize].distance_squared(p) <= tolerance_m * tolerance_m;
            let offsets = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
            let found = offsets
                .filter_map(|[i, j, k]: [i64; 3]| cells.get(&[x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)]))
                .flatten()
                .copied()
                .filter(near)
                .min();
            join.push(found.unwrap_or(vertex as u32));
            if found.is_none() {
                cells.entry([x, y, z]).or_default().push(vertex as u32);
            }
        }
        join
    }
}
