//! Vertices of a beam's sections on the slicing planes.

use glam::Vec4;

use crate::beams::Beam;
use crate::beams::geometry::on_ray;
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v3};
use nephroid_pipeline::Bindings;
use nephroid_pipeline::shader::VertexInput;

use super::super::slices::SliceVertex;

/// Vertices of a beam's cross-sections, one per lane.
pub struct SectionVertex<L> {
    /// In the space of the beams, m.
    pub position: V3<L>,
    /// Number of the vertex in the section, 0 to 2.
    pub number: L,
    /// Ray per metre of depth: x, length, z; w is the vertex's transmittance over the mean.
    pub ray: [L; 4],
    /// Depth of the plane below the surface at the vertex, m; 0 on the surface.
    pub depth: L,
}

/// Section vertices for the dummy vertices in the lanes: on the ray of the vertex, at the height of the plane, but never above the surface.
#[inline(always)]
pub fn section_vertex<L: Lanes>(bindings: &Bindings<'_>, input: &VertexInput<'_, L>) -> SectionVertex<L> {
    let slices: &[SliceVertex] = bindings.storage(3);
    let beam: &Beam = bindings.uniform(4);
    let slice = input.per_vertex4(|i| slices.get(i as usize).map_or([0.0; 4], |s| [s.plane_y, s.corner, 0.0, 0.0]));
    let of = |v: &[Vec4; 3], i: u32| slices.get(i as usize).map_or([0.0; 4], |s| v[s.corner as usize].to_array());
    let g = input.per_vertex4(|i| of(&beam.g, i));
    let d = input.per_vertex4(|i| of(&beam.d, i));
    let y = Lanes::min(slice.x, g.y);
    let depth = g.y - y;
    let at = on_ray([g.x, g.z], [d.x, d.z], depth);
    SectionVertex { position: v3(at.x, y, at.y), number: slice.y, ray: [d.x, d.y, d.z, d.w], depth }
}
