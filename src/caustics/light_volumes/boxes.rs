//! The boxes that beams are clamped to: bounds of the receivers under water, object by object [BO §3.2].

use glam::Vec3;

use crate::Receivers;
use nephroid_scene::geom::Aabb;

/// Margin on every side, as a share of the size of all receivers. A receiver that lies in a side of its box stays inside after rounding.
const MARGIN: f32 = 1.0e-4;

/// Bounds of an object, or of the part of an object that faces one direction, and the triangles inside.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceiverBox {
    /// Bounds in world space, including a margin.
    pub bounds: Aabb,
    /// The triangles, each by the position of its first index in the receivers' mesh.
    pub triangles: Vec<u32>,
}

impl ReceiverBox {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, triangles: Vec::new() };

    /// Positions of the box's triangles, world space.
    pub fn positions<'a>(&'a self, receivers: &'a Receivers) -> impl Iterator<Item = [Vec3; 3]> + 'a {
        self.triangles.iter().map(|&first| receivers.triangle_at(first))
    }
}

/// How far a box reaches beyond its triangles, m.
#[must_use]
pub fn margin(receivers: &Receivers) -> f32 {
    receivers.bounds.size().max_element() * MARGIN
}

/// Boxes of all receivers that reach below `level_y`, world space.
///
/// A hollow object such as a pool has one box for each direction that its surface faces, if these boxes together are much smaller than the box around
/// the whole object.
#[must_use]
pub fn boxes(receivers: &Receivers, level_y: f32) -> Vec<ReceiverBox> {
    let margin = margin(receivers);
    let mut all = Vec::new();
    for group in &receivers.groups {
        let mut facing = [const { ReceiverBox::EMPTY }; 6];
        for first in group.indices.clone().step_by(3) {
            let [a, b, c] = receivers.triangle_at(first);
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
