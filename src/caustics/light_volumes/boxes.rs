//! The boxes that beams are clamped to: the bounds of what is under water, object by object [BO §3.2].

use glam::Vec3;

use crate::Receivers;
use crate::passes::geometry_buffer::ReceiverVertex;
use nephroid_scene::geom::Aabb;

/// Added on every side, as a share of the size of everything: a receiver that lies in a side of its box is inside of it after rounding, too.
const MARGIN: f32 = 1.0e-4;

/// Bounds of an object, or of the part of it that faces one way, and what is in them.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceiverBox {
    /// World space, with a margin.
    pub bounds: Aabb,
    /// The triangles, each by its place among the receivers' indices.
    pub triangles: Vec<u32>,
}

impl ReceiverBox {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, triangles: Vec::new() };

    /// Corners of its triangles, world space.
    pub fn corners<'a>(&'a self, receivers: &'a Receivers) -> impl Iterator<Item = [Vec3; 3]> + 'a {
        let corners = corners_of(receivers);
        self.triangles.iter().map(move |&triangle| corners(triangle))
    }
}

/// How far a box reaches beyond what is in it, m.
#[must_use]
pub fn margin(receivers: &Receivers) -> f32 {
    receivers.bounds.size().max_element() * MARGIN
}

/// World-space corners of a triangle, by the place of its first index.
fn corners_of(receivers: &Receivers) -> impl Fn(u32) -> [Vec3; 3] + '_ {
    let vertices: &[ReceiverVertex] = bytemuck::cast_slice(receivers.vertices.bytes());
    let indices: &[u32] = bytemuck::cast_slice(receivers.indices.bytes());
    move |first| [0, 1, 2].map(|k| vertices[indices[first as usize + k] as usize].position_ws.truncate())
}

/// Boxes of all receivers that reach below `level_y`, world space.
///
/// An object that is hollow, like a pool, has one box for each way its surface faces, if these together are much smaller than the one around it.
#[must_use]
pub fn boxes(receivers: &Receivers, level_y: f32) -> Vec<ReceiverBox> {
    let margin = margin(receivers);
    let corners = corners_of(receivers);
    let mut all = Vec::new();
    for group in &receivers.groups {
        let mut facing = [const { ReceiverBox::EMPTY }; 6];
        for first in group.elements.clone().step_by(3) {
            let [a, b, c] = corners(first);
            if a.y.min(b.y).min(c.y) > level_y {
                continue;
            }
            let normal = (b - a).cross(c - a);
            let axis = normal.abs().max_position();
            let side = &mut facing[2 * axis + usize::from(normal[axis] < 0.0)];
            side.bounds = [a, b, c].into_iter().fold(side.bounds, Aabb::including);
            side.triangles.push(first);
        }
        let mut parts: Vec<ReceiverBox> = facing.into_iter().filter(|part| !part.triangles.is_empty()).collect();
        for part in &mut parts {
            part.bounds = part.bounds.expanded(margin);
        }
        let whole = parts.iter().fold(Aabb::EMPTY, |whole, part| whole.union(part.bounds));
        let volume = |bounds: &Aabb| bounds.size().element_product();
        if parts.iter().map(|part| volume(&part.bounds)).sum::<f32>() < 0.5 * volume(&whole) {
            all.extend(parts);
        } else if !parts.is_empty() {
            all.push(ReceiverBox { bounds: whole, triangles: parts.into_iter().flat_map(|part| part.triangles).collect() });
        }
    }
    all
}
