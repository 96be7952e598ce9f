//! The surface of a signed distance field.

use fearless_simd::Level;
use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::field::{Near, Sampled};
use crate::geom::{Aabb, Mesh};

/// The six tetrahedra of a cube along its diagonal from corner 0 to corner 7 (Kuhn 1960), as corner numbers whose bits are x, y, z;
/// each is right-handed. Neighbouring cubes cut their common face alike. An edge runs from a corner to one with more bits: seven directions.
const TETRAHEDRA: [[usize; 4]; 6] = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// Cuts the zero surface of `field` (negative inside) out of a lattice by marching tetrahedra [Doi and Koide 1991].
///
/// Unlike marching cubes it has no ambiguous case: the result is a closed manifold whatever the field, provided it is positive on the
/// border of `bounds`. Vertices are then moved onto the surface and given the direction of the field's gradient as normal. Lattice cells are cubes of
/// `cell_m`, the last ones reaching past `bounds`; no texture coordinates. Layers of the lattice are worked on in parallel.
pub(super) fn isosurface(bounds: Aabb, cell_m: f32, field: &dyn Sampled) -> Mesh {
    isosurface_at(Level::new(), bounds, cell_m, field)
}

fn isosurface_at(level: Level, bounds: Aabb, cell_m: f32, field: &dyn Sampled) -> Mesh {
    let lattice = Lattice::sample(level, bounds, cell_m, field);
    let layers: Vec<Layer> = (0..lattice.points[2]).into_par_iter().map(|z| Layer::new(&lattice, z)).collect();
    let mut first_vertices = vec![0];
    first_vertices.extend(layers.iter().scan(0, |count, layer| {
        *count += layer.vertices.len() as u32;
        Some(*count)
    }));
    let settled: Vec<Vec<[Vec3; 2]>> = layers.par_iter().map(|layer| field.settle(level, cell_m, &layer.vertices)).collect();
    let triangles: Vec<Vec<u32>> = (0..lattice.points[2] - 1)
        .into_par_iter()
        .map(|z| {
            let mut indices = Vec::new();
            march_layer(&lattice, z, [0, 1].map(|k| (&layers[z + k], first_vertices[z + k])), &mut indices);
            indices
        })
        .collect();
    let vertices = || settled.iter().flatten();
    Mesh {
        positions: vertices().map(|v| v[0]).collect(),
        normals: vertices().map(|v| v[1]).collect(),
        uvs: Vec::new(),
        indices: triangles.concat(),
    }
}

/// Values of a field at the points of a lattice.
struct Lattice {
    min: Vec3,
    cell_m: f32,
    /// Points along x, y and z, at least 2.
    points: [usize; 3],
    /// x fastest, then y.
    values: Vec<f32>,
    /// For each row of values along x whether all are inside, or all outside, or neither.
    rows: Vec<Option<bool>>,
}

impl Lattice {
    fn sample(level: Level, bounds: Aabb, cell_m: f32, field: &dyn Sampled) -> Self {
        let cells = (bounds.size() / cell_m).ceil().as_uvec3().max(UVec3::ONE);
        let points = (cells + UVec3::ONE).to_array().map(|count| count as usize);
        let mut lattice = Self { min: bounds.min, cell_m, points, values: Vec::new(), rows: Vec::new() };
        let xs: Vec<f32> = (0..points[0]).map(|x| lattice.place([x, 0, 0]).x).collect();
        let mut values = vec![0.0; points[0] * points[1] * points[2]];
        let sample_row = |(number, row): (usize, &mut [f32])| {
            let at = lattice.place([0, number % points[1], number / points[1]]);
            field.values_along_x(level, &xs, at.y, at.z, row);
            let first = row[0] < 0.0;
            row.iter().all(|&value| (value < 0.0) == first).then_some(first)
        };
        let rows = values.par_chunks_exact_mut(points[0]).enumerate().with_min_len(points[1].div_ceil(4)).map(sample_row).collect();
        (lattice.values, lattice.rows) = (values, rows);
        lattice
    }

    fn place(&self, point: [usize; 3]) -> Vec3 {
        self.min + Vec3::from_array(point.map(|at| at as f32)) * self.cell_m
    }

    /// Whether no cell between rows `y` and `y + 1` of layers `z` and `z + 1` is cut, as far as these rows exist.
    fn is_uncut(&self, y: usize, z: usize) -> bool {
        let row = |j: usize, k: usize| self.rows[y.min(self.points[1] - 1 - j) + j + self.points[1] * (z.min(self.points[2] - 1 - k) + k)];
        let first = row(0, 0);
        first.is_some() && row(1, 0) == first && row(0, 1) == first && row(1, 1) == first
    }
}

/// What lies in one layer of lattice points along z, and on the edges that start there.
struct Layer {
    /// Vertices by the point their edge starts at, then by its direction.
    vertices: Vec<Near>,
    /// For each point the number of its first vertex in the layer, and one bit for every direction with a vertex.
    points: Vec<(u32, u8)>,
}

impl Layer {
    fn new(lattice: &Lattice, z: usize) -> Self {
        let [columns, rows, layers] = lattice.points;
        let mut layer = Self { vertices: Vec::new(), points: vec![(0, 0); columns * rows] };
        for y in (0..rows).filter(|&y| !lattice.is_uncut(y, z)) {
            for x in 0..columns {
                let at = x + columns * (y + rows * z);
                let here = lattice.values[at];
                let first = layer.vertices.len() as u32;
                let mut directions = 0;
                for direction in 1..8 {
                    let [i, j, k] = [direction & 1, direction >> 1 & 1, direction >> 2];
                    if x + i == columns || y + j == rows || z + k == layers {
                        continue;
                    }
                    let there = lattice.values[at + i + columns * (j + rows * k)];
                    if (here < 0.0) != (there < 0.0) {
                        directions |= 1 << direction;
                        // Kept off the lattice points, where several edges meet and vertices would coincide.
                        let t = (here / (here - there)).clamp(0.04, 0.96);
                        let (from, to) = (lattice.place([x, y, z]), lattice.place([x + i, y + j, z + k]));
                        // A quarter of the distance to the nearer end of the lattice edge keeps vertices of different edges apart, so no
                        // triangle collapses.
                        let reach_m = lattice.cell_m * (0.25 * t.min(1.0 - t));
                        layer.vertices.push(Near { position: from + (to - from) * t, reach_m });
                    }
                }
                layer.points[x + columns * y] = (first, directions);
            }
        }
        layer
    }

    /// Number in the layer of the vertex on the edge from a point in a direction.
    fn vertex(&self, point: usize, direction: usize) -> u32 {
        let (first, directions) = self.points[point];
        first + (directions & ((1 << direction) - 1)).count_ones()
    }
}

/// Appends the triangles in the cells between two layers, each given with the number of its first vertex.
fn march_layer(lattice: &Lattice, z: usize, layers: [(&Layer, u32); 2], indices: &mut Vec<u32>) {
    let [columns, rows, _] = lattice.points;
    for y in (0..rows - 1).filter(|&y| !lattice.is_uncut(y, z)) {
        for x in 0..columns - 1 {
            let corner = |i: usize| [x + (i & 1) + columns * (y + (i >> 1 & 1)), i >> 2];
            let inside: [bool; 8] = std::array::from_fn(|i| {
                let [point, k] = corner(i);
                lattice.values[point + columns * rows * (z + k)] < 0.0
            });
            if inside.contains(&true) && inside.contains(&false) {
                let vertex = |from: usize, to: usize| {
                    let [point, k] = corner(from);
                    let (layer, first) = layers[k];
                    first + layer.vertex(point, to - from)
                };
                for t in TETRAHEDRA {
                    march(t, t.map(|i| inside[i]), vertex, indices);
                }
            }
        }
    }
}

/// Appends the triangles that part the inside corners of a right-handed tetrahedron from the outside ones, facing out; `vertex` is the number
/// of the vertex between two corners, the smaller of them first.
fn march(t: [usize; 4], inside: [bool; 4], vertex: impl Fn(usize, usize) -> u32, indices: &mut Vec<u32>) {
    let edge = |i: usize, j: usize| vertex(t[i].min(t[j]), t[i].max(t[j]));
    // For each single corner, the other three counter-clockwise seen from it.
    const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
    match inside.iter().filter(|i| **i).count() {
        1 | 3 => {
            let lone_is_inside = inside.iter().filter(|i| **i).count() == 1;
            let lone = (0..4).find(|&i| inside[i] == lone_is_inside).expect("one corner differs");
            let [a, b, c] = OTHERS[lone];
            // Seen from the lone corner the triangle is clockwise: it faces away, out if that corner is inside.
            let [a, b, c] = [edge(lone, a), edge(lone, b), edge(lone, c)];
            indices.extend(if lone_is_inside { [a, b, c] } else { [a, c, b] });
        }
        2 => {
            let i = (0..4).find(|&i| inside[i]).expect("two corners are inside");
            let j = (i + 1..4).find(|&j| inside[j]).expect("two corners are inside");
            // Turn (i, j, k, l) into an even permutation, hence right-handed.
            let k = (0..4).find(|&k| k != i && k != j).expect("two corners are left");
            let l = 6 - i - j - k;
            let even = matches!((i, j), (0, 1) | (0, 3) | (1, 2) | (2, 3));
            let (k, l) = if even { (k, l) } else { (l, k) };
            let quad = [edge(i, k), edge(i, l), edge(j, l), edge(j, k)];
            indices.extend([quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]]);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use nephroid_math::lanes::Lanes;
    use nephroid_math::level::available_levels;
    use nephroid_math::vector::{V3, v3};

    use super::*;
    use crate::geom::shapes::field::Field;

    /// A ball of radius 1.
    struct Ball;

    impl Field for Ball {
        #[inline(always)]
        fn value<L: Lanes>(&self, p: V3<L>) -> L {
            p.length() - 1.0
        }
    }

    /// White noise inside of a box: every case of every tetrahedron turns up.
    struct Noise {
        seed: u32,
    }

    impl Field for Noise {
        fn value<L: Lanes>(&self, p: V3<L>) -> L {
            let (x, y, z) = (p.x.to_array(), p.y.to_array(), p.z.to_array());
            L::from_fn(p.x.token(), |i| {
                let p = Vec3::new(x[i], y[i], z[i]);
                let border = p.min_element() < 0.5 || p.max_element() > 13.5;
                if border { 1.0 } else { nephroid_math::noise::perlin3(p.x * 0.77 + 0.4, p.y * 0.81 + 0.3, p.z * 0.73, self.seed) }
            })
        }
    }

    /// A flat box; the gradient of its field jumps at the edges.
    struct Slab;

    impl Field for Slab {
        #[inline(always)]
        fn value<L: Lanes>(&self, p: V3<L>) -> L {
            let q = v3(p.x.abs() - 1.0, p.y.abs() - 0.2, p.z.abs() - 1.0);
            Lanes::max(Lanes::max(q.x, q.y), q.z)
        }
    }

    fn cube(half: f32) -> Aabb {
        Aabb::from_corners(Vec3::splat(-half), Vec3::splat(half))
    }

    #[test]
    fn ball_is_closed_round_and_faces_out() {
        let mesh = isosurface(cube(1.2), 0.06, &Ball);
        assert_eq!(mesh.validate(), Ok(()));
        assert!(mesh.is_closed(), "{:?}", mesh.edge_report());
        assert!((mesh.signed_volume() - std::f64::consts::TAU * 2.0 / 3.0).abs() < 0.02, "{}", mesh.signed_volume());
        assert!(mesh.positions.iter().zip(&mesh.normals).all(|(p, n)| (p.length() - 1.0).abs() < 4e-3 && n.dot(*p) > 0.995));
    }

    #[test]
    fn any_field_gives_a_closed_manifold() {
        for seed in 0..5 {
            let bounds = Aabb::from_corners(Vec3::ZERO, Vec3::splat(14.0));
            let mesh = isosurface(bounds, 1.0, &Noise { seed });
            assert!(mesh.triangle_count() > 2000);
            let places = mesh.edge_report();
            assert!(places.is_closed(), "{places:?}");
            assert!(mesh.signed_volume() > 0.0);
        }
    }

    #[test]
    fn surface_is_the_same_at_every_level_and_on_any_number_of_threads() {
        let on = |threads: usize, level: Level| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let surface = || [isosurface_at(level, cube(1.2), 0.07, &Ball), isosurface_at(level, cube(1.2), 0.05, &Slab)];
            pool.install(surface)
        };
        let expected = on(1, Level::fallback());
        assert!(expected.iter().all(|mesh| mesh.is_closed()));
        for (name, level) in available_levels() {
            assert!(on(3, level) == expected, "{name}");
        }
    }
}
