//! Tubes along a path.

use glam::{Vec2, Vec3};

use super::circle;
use crate::geom::Mesh;

/// A cross-section of a tube: an ellipse.
#[derive(Clone, Copy)]
pub(super) struct Ring {
    /// A point of the path.
    pub center: Vec3,
    /// Unit vector across the path.
    pub side: Vec3,
    /// Unit vector across the path, `side × up` pointing along it.
    pub up: Vec3,
    /// Half-axes along `side` and `up` in metres.
    pub radius: Vec2,
}

/// Joins rings into a tube: back to the first if `closed`, with flat ends otherwise.
///
/// Texture coordinates: around × mean radius of the first ring, length along the path.
pub(super) fn tube(rings: &[Ring], sides: u32, closed: bool) -> Mesh {
    let circle = circle(sides);
    let mut mesh = Mesh::default();
    let count = rings.len() + usize::from(closed);
    let around_m = rings[0].radius.element_sum() * 0.5 * std::f32::consts::TAU;
    let mut v = 0.0;
    for i in 0..count {
        let ring = rings[i % rings.len()];
        if i > 0 {
            v += ring.center.distance(rings[i - 1].center);
        }
        for (k, c) in circle.iter().enumerate() {
            let normal = (ring.side * (c.x * ring.radius.y) + ring.up * (c.y * ring.radius.x)).normalize_or(ring.side);
            mesh.push_vertex(place(ring, *c), normal, Some(Vec2::new(k as f32 / sides as f32 * around_m, v)));
        }
    }
    let stride = sides + 1;
    for i in 0..count as u32 - 1 {
        for k in 0..sides {
            let a = i * stride + k;
            mesh.push_quad([a, a + 1, a + stride + 1, a + stride]);
        }
    }
    if !closed {
        cap(&mut mesh, rings[0], &circle, true);
        cap(&mut mesh, rings[rings.len() - 1], &circle, false);
    }
    mesh
}

fn place(ring: Ring, c: Vec2) -> Vec3 {
    ring.center + ring.side * (c.x * ring.radius.x) + ring.up * (c.y * ring.radius.y)
}

/// A flat end, facing back along the path at its start.
fn cap(mesh: &mut Mesh, ring: Ring, circle: &[Vec2], start: bool) {
    let along = ring.side.cross(ring.up);
    let normal = if start { -along } else { along };
    let middle = mesh.push_vertex(ring.center, normal, Some(Vec2::ZERO));
    let rim: Vec<u32> = circle.iter().map(|&c| mesh.push_vertex(place(ring, c), normal, Some(c * ring.radius))).collect();
    for pair in rim.windows(2) {
        mesh.push_triangle(if start { [middle, pair[1], pair[0]] } else { [middle, pair[0], pair[1]] });
    }
}
