//! Prisms: a closed outline drawn out along x.

use glam::{Vec2, Vec3};

use crate::geom::{Mesh, triangulate_polygon};

/// One corner of an outline: its place `(z, y)` and the outward unit normals of the surface before and after it.
///
/// Equal normals make a smooth corner, different ones a sharp edge.
#[derive(Clone, Copy)]
pub(super) struct OutlineCorner {
    pub place: Vec2,
    pub normal_before: Vec2,
    pub normal_after: Vec2,
}

impl OutlineCorner {
    pub(super) fn smooth(place: Vec2, normal: Vec2) -> Self {
        Self { place, normal_before: normal, normal_after: normal }
    }
}

/// A prism of width `width_m` centred on `x = 0`.
///
/// The outline `(z, y)` runs counter-clockwise in a picture with z to the right and y up, which is clockwise seen from `+x`.
/// Texture coordinates: x and along the outline on the jacket, `(∓z, y)` on the ends.
pub(super) fn prism(outline: &[OutlineCorner], width_m: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let half = width_m * 0.5;
    let n = outline.len();
    let mut along = 0.0;
    for (i, a) in outline.iter().enumerate() {
        let b = outline[(i + 1) % n];
        let length = a.place.distance(b.place);
        let mut push = |p: Vec2, normal: Vec2, x: f32, along: f32| {
            mesh.push_vertex(Vec3::new(x, p.y, p.x), Vec3::new(0.0, normal.y, normal.x), Some(Vec2::new(x, along)))
        };
        let quad = [
            push(a.place, a.normal_after, -half, along),
            push(a.place, a.normal_after, half, along),
            push(b.place, b.normal_before, half, along + length),
            push(b.place, b.normal_before, -half, along + length),
        ];
        mesh.push_quad(quad);
        along += length;
    }
    for x in [half, -half] {
        let first = mesh.positions.len() as u32;
        let places: Vec<Vec3> = outline.iter().map(|c| Vec3::new(x, c.place.y, c.place.x)).collect();
        for &p in &places {
            mesh.push_vertex(p, Vec3::X * x.signum(), Some(Vec2::new(-p.z * x.signum(), p.y)));
        }
        triangulate_polygon(&places, |t| {
            let [a, b, c] = t.map(|i| first + i as u32);
            mesh.indices.extend(if x > 0.0 { [a, c, b] } else { [a, b, c] });
        });
    }
    mesh
}
