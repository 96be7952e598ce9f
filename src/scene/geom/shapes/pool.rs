//! A pool seen from inside.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Check, ShapeError};
use crate::geom::Mesh;

/// A rectangular pool: a floor, four walls facing in, and a level deck around it at `y = 0`.
///
/// It is a surface, not a solid. Floor and walls have texture coordinates for tiles: `(x, −z)` on floor and deck, the distance along
/// the wall and `y` on walls, all in metres from the pool's middle, so that joints run on from wall to floor and a row of tiles ends at
/// the deck.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pool {
    /// Inner lengths along x and z in metres, above 0. Default: (6, 4).
    pub size_m: Vec2,
    /// Depth below the deck at the end `x < 0` in metres, above 0. Default: 1.6.
    pub depth_m: f32,
    /// Depth at the end `x > 0` in metres, above 0; the floor slopes between the two. Default: 1.6.
    pub far_depth_m: f32,
    /// Breadth of the deck in metres; 0 for none. Default: 1.
    pub deck_m: f32,
}

impl Default for Pool {
    fn default() -> Self {
        Self { size_m: Vec2::new(6.0, 4.0), depth_m: 1.6, far_depth_m: 1.6, deck_m: 1.0 }
    }
}

impl Pool {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Pool");
        self.size_m.to_array().into_iter().try_for_each(|side| check.length("size_m", side))?;
        check.length("depth_m", self.depth_m)?;
        check.length("far_depth_m", self.far_depth_m)?;
        check.number("deck_m", self.deck_m, 0.0..=super::MAX_LENGTH_M)?;

        let half = self.size_m * 0.5;
        // Counter-clockwise seen from above: north is −z.
        let plan = [Vec2::new(-half.x, half.y), half, Vec2::new(half.x, -half.y), -half];
        let rim = plan.map(|p| Vec3::new(p.x, 0.0, p.y));
        let foot = plan.map(|p| Vec3::new(p.x, if p.x < 0.0 { -self.depth_m } else { -self.far_depth_m }, p.y));
        let mut mesh = Mesh::default();
        let level = |p: Vec3| Vec2::new(p.x, -p.z);

        push_flat(&mut mesh, foot, foot.map(level));
        for i in 0..4 {
            let next = (i + 1) % 4;
            // Seen from inside, the next corner of the plan is to the left.
            let quad = [foot[next], foot[i], rim[i], rim[next]];
            let left = (rim[next] - rim[i]).normalize();
            push_flat(&mut mesh, quad, quad.map(|p| Vec2::new(-p.dot(left), p.y)));
        }
        if self.deck_m > 0.0 {
            let outer = rim.map(|p| p + Vec3::new(p.x.signum(), 0.0, p.z.signum()) * self.deck_m);
            for i in 0..4 {
                let next = (i + 1) % 4;
                let quad = [outer[i], outer[next], rim[next], rim[i]];
                push_flat(&mut mesh, quad, quad.map(level));
            }
        }
        Ok(mesh)
    }
}

/// A plane quad with vertices of its own.
fn push_flat(mesh: &mut Mesh, quad: [Vec3; 4], uvs: [Vec2; 4]) {
    let normal = (quad[1] - quad[0]).cross(quad[3] - quad[0]).normalize_or(Vec3::Y);
    let vertices = std::array::from_fn(|i| mesh.push_vertex(quad[i], normal, Some(uvs[i])));
    mesh.push_quad(vertices);
}
