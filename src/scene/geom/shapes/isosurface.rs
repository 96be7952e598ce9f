//! The surface of a signed distance field.

use glam::{UVec3, Vec3};

use crate::geom::{Aabb, Mesh};

/// The six tetrahedra of a cube along its diagonal from corner 0 to corner 7 (Kuhn 1960), as corner numbers whose bits are x, y, z;
/// each is right-handed. Neighbouring cubes cut their common face alike.
const TETRAHEDRA: [[usize; 4]; 6] = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// Cuts the zero surface of `field` (negative inside) out of a lattice by marching tetrahedra [Doi and Koide 1991].
///
/// Unlike marching cubes it has no ambiguous case: the result is a closed manifold whatever the field, provided it is positive on the
/// border of `bounds`. Vertices are then moved onto the surface and given the direction of the field's gradient as normal. Lattice cells are cubes of
/// `cell_m`, the last ones reaching past `bounds`; no texture coordinates.
pub(super) fn isosurface(bounds: Aabb, cell_m: f32, field: impl Fn(Vec3) -> f32) -> Mesh {
    let size = bounds.size();
    let cells = (size / cell_m).ceil().as_uvec3().max(UVec3::ONE);
    let points = cells + UVec3::ONE;
    let place = |p: UVec3| bounds.min + p.as_vec3() * cell_m;
    let number = |p: UVec3| p.x + points.x * (p.y + points.y * p.z);
    let mut values = Vec::with_capacity((points.x * points.y * points.z) as usize);
    for z in 0..points.z {
        for y in 0..points.y {
            for x in 0..points.x {
                values.push(field(place(UVec3::new(x, y, z))));
            }
        }
    }

    // Each triangle corner as the lattice edge it lies on.
    let mut corners: Vec<[u32; 2]> = Vec::new();
    for z in 0..cells.z {
        for y in 0..cells.y {
            for x in 0..cells.x {
                let corner: [u32; 8] = std::array::from_fn(|i| {
                    let i = i as u32;
                    number(UVec3::new(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)))
                });
                let inside = corner.map(|c| values[c as usize] < 0.0);
                if inside.contains(&true) && inside.contains(&false) {
                    for t in TETRAHEDRA {
                        march(t.map(|i| corner[i]), t.map(|i| inside[i]), &mut corners);
                    }
                }
            }
        }
    }

    let mut edges = corners.clone();
    edges.sort_unstable();
    edges.dedup();
    let unpack = |n: u32| UVec3::new(n % points.x, n / points.x % points.y, n / points.x / points.y);
    let mut mesh = Mesh::default();
    for &[a, b] in &edges {
        let (fa, fb) = (values[a as usize], values[b as usize]);
        // Kept off the lattice points, where several edges meet and vertices would coincide.
        let t = (fa / (fa - fb)).clamp(0.04, 0.96);
        let (pa, pb) = (place(unpack(a)), place(unpack(b)));
        let (p, normal) = settle(pa + (pb - pa) * t, cell_m, 0.25 * t.min(1.0 - t), &field);
        mesh.push_vertex(p, normal, None);
    }
    mesh.indices = corners.iter().map(|c| edges.binary_search(c).expect("edges come from corners") as u32).collect();
    mesh
}

/// Appends the triangles that part the inside corners of a right-handed tetrahedron from the outside ones, facing out.
fn march(t: [u32; 4], inside: [bool; 4], corners: &mut Vec<[u32; 2]>) {
    let edge = |i: usize, j: usize| [t[i].min(t[j]), t[i].max(t[j])];
    // For each single corner, the other three counter-clockwise seen from it.
    const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
    match inside.iter().filter(|i| **i).count() {
        1 | 3 => {
            let lone_is_inside = inside.iter().filter(|i| **i).count() == 1;
            let lone = (0..4).find(|&i| inside[i] == lone_is_inside).expect("one corner differs");
            let [a, b, c] = OTHERS[lone];
            // Seen from the lone corner the triangle is clockwise: it faces away, out if that corner is inside.
            let [a, b, c] = [edge(lone, a), edge(lone, b), edge(lone, c)];
            corners.extend(if lone_is_inside { [a, b, c] } else { [a, c, b] });
        }
        2 => {
            let i = (0..4).find(|&i| inside[i]).expect("two corners are inside");
            let j = (i + 1..4).find(|&j| inside[j]).expect("two corners are inside");
            // Turn (i, j, k, l) into an even permutation, hence right-handed.
            let rest: Vec<usize> = (0..4).filter(|&k| k != i && k != j).collect();
            let even = matches!((i, j), (0, 1) | (0, 3) | (1, 2) | (2, 3));
            let (k, l) = if even { (rest[0], rest[1]) } else { (rest[1], rest[0]) };
            let quad = [edge(i, k), edge(i, l), edge(j, l), edge(j, k)];
            corners.extend([quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]]);
        }
        _ => {}
    }
}

/// Moves a point towards the surface along the gradient, by at most `reach` cells; also its normal there.
///
/// A reach of a quarter of the distance to the nearer end of the lattice edge keeps vertices of different edges apart, so no triangle
/// collapses.
fn settle(mut p: Vec3, cell_m: f32, reach: f32, field: impl Fn(Vec3) -> f32) -> (Vec3, Vec3) {
    let step = cell_m * 0.2;
    let gradient = |p: Vec3| {
        let along = |e: Vec3| field(p + e * step) - field(p - e * step);
        Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)) / (2.0 * step)
    };
    let start = p;
    for _ in 0..2 {
        let g = gradient(p);
        p -= g * (field(p) / g.length_squared().max(0.05));
    }
    p = start + (p - start).clamp_length_max(cell_m * reach);
    (p, gradient(p).normalize_or(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ball_is_closed_round_and_faces_out() {
        let bounds = Aabb::from_corners(Vec3::splat(-1.2), Vec3::splat(1.2));
        let mesh = isosurface(bounds, 0.06, |p| p.length() - 1.0);
        assert_eq!(mesh.validate(), Ok(()));
        assert!(mesh.is_closed(), "{:?}", mesh.edge_report());
        assert!((mesh.signed_volume() - std::f64::consts::TAU * 2.0 / 3.0).abs() < 0.02, "{}", mesh.signed_volume());
        assert!(mesh.positions.iter().zip(&mesh.normals).all(|(p, n)| (p.length() - 1.0).abs() < 4e-3 && n.dot(*p) > 0.995));
    }

    #[test]
    fn any_field_gives_a_closed_manifold() {
        // White noise inside: every case of every tetrahedron turns up.
        for seed in 0..5 {
            let bounds = Aabb::from_corners(Vec3::ZERO, Vec3::splat(14.0));
            let mesh = isosurface(bounds, 1.0, |p| {
                let border = p.min_element() < 0.5 || p.max_element() > 13.5;
                if border { 1.0 } else { nephroid_math::noise::perlin3(p.x * 0.77 + 0.4, p.y * 0.81 + 0.3, p.z * 0.73, seed) }
            });
            assert!(mesh.triangle_count() > 2000);
            let places = mesh.edge_report();
            assert!(places.is_closed(), "{places:?}");
            assert!(mesh.signed_volume() > 0.0);
        }
    }
}
