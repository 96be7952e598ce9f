//! The boxes that beams are clamped to: the bounds of what is under water, object by object [BO §3.2].

use crate::caustics::Receivers;
use crate::geom::Aabb;
use crate::passes::geometry_buffer::ReceiverVertex;

/// Added on every side, as a share of the size of everything: a receiver that lies in a side of its box is inside of it after rounding, too.
const MARGIN: f32 = 1.0e-4;

/// Boxes of all receivers that reach below `level_y`, world space.
///
/// An object that is hollow, like a pool, has one box for each way its surface faces, if these together are much smaller than the one around it.
#[must_use]
pub fn boxes(receivers: &Receivers, level_y: f32) -> Vec<Aabb> {
    let margin = receivers.bounds.size().max_element() * MARGIN;
    let vertices: &[ReceiverVertex] = bytemuck::cast_slice(receivers.vertices.bytes());
    let indices: &[u32] = bytemuck::cast_slice(receivers.indices.bytes());
    let mut all = Vec::new();
    for group in &receivers.groups {
        let mut facing = [Aabb::EMPTY; 6];
        for triangle in indices[group.elements.start as usize..group.elements.end as usize].chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k: usize| vertices[triangle[k] as usize].position_ws.truncate());
            if a.y.min(b.y).min(c.y) > level_y {
                continue;
            }
            let normal = (b - a).cross(c - a);
            let axis = normal.abs().max_position();
            let side = 2 * axis + usize::from(normal[axis] < 0.0);
            facing[side] = [a, b, c].into_iter().fold(facing[side], Aabb::including);
        }
        let parts: Vec<Aabb> = facing.into_iter().filter(|part| !part.is_empty()).map(|part| part.expanded(margin)).collect();
        let Some(whole) = parts.iter().copied().reduce(Aabb::union) else { continue };
        let volume = |part: &Aabb| part.size().element_product();
        if parts.iter().map(volume).sum::<f32>() < 0.5 * volume(&whole) {
            all.extend(parts);
        } else {
            all.push(whole);
        }
    }
    all
}
