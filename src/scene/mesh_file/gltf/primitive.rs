//! One primitive: attributes, indices, topology.

use glam::{Vec2, Vec3};
use gltf_json::{
    self as json,
    accessor::{ComponentType, Type},
    mesh::{Mode, Semantic},
    validation::Checked,
};

use super::{
    super::{Fault, MeshLimits, Place},
    accessor::{Accessor, Buffers},
};
use crate::geom::Mesh;

/// Reads a primitive in the mesh's own space; `None` if it has no triangles (points, lines).
pub(super) fn read(
    root: &json::Root,
    buffers: &Buffers<'_>,
    primitive: &json::mesh::Primitive,
    place: &str,
    limits: &MeshLimits,
) -> Result<Option<Mesh>, Fault> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err(Fault::syntax(Place::Item(format!("{place}.mode")), "0 to 6", "another number"));
    };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
    let Some(positions) = attribute(Semantic::Positions) else {
        return Err(Fault::syntax(Place::Item(place.into()), "an attribute POSITION", "none"));
    };
    let named = |name: &str| format!("{place}.attributes.{name}");
    let positions = Accessor::new(root, buffers, positions, Type::Vec3, &named("POSITION"))?;
    let normals =
        attribute(Semantic::Normals).map(|index| Accessor::new(root, buffers, index, Type::Vec3, &named("NORMAL"))).transpose()?;
    let uvs =
        attribute(Semantic::TexCoords(0)).map(|index| Accessor::new(root, buffers, index, Type::Vec2, &named("TEXCOORD_0"))).transpose()?;
    for (accessor, name) in [(&normals, "NORMAL"), (&uvs, "TEXCOORD_0")] {
        if let Some(accessor) = accessor.as_ref().filter(|a| a.count != positions.count) {
            let expected = format!("as many as POSITION, {}", positions.count);
            return Err(Fault::syntax(Place::Item(named(name)), expected, accessor.count.to_string()));
        }
    }
    check_component(&positions, &named("POSITION"))?;

    let corners = read_indices(root, buffers, primitive, positions.count, place, limits)?;
    let triangle_count = match mode {
        Mode::Triangles => corners.len() / 3,
        _ => corners.len().saturating_sub(2),
    };
    limits.check_triangles(triangle_count as u64, || Place::Item(place.into()))?;

    // Primitives often share one large buffer: take only the vertices this one uses.
    let mut used = corners.clone();
    used.sort_unstable();
    used.dedup();
    limits.check_vertices(used.len() as u64, || Place::Item(place.into()))?;
    let mut mesh = Mesh::default();
    for &vertex in &used {
        let i = vertex as usize;
        let position = Vec3::from(positions.vector::<3>(i));
        if !position.is_finite() {
            return Err(Fault::not_finite(Place::Item(named("POSITION")), format!("position {vertex}"), position));
        }
        let uv = uvs.as_ref().map(|uvs| Vec2::from(uvs.vector::<2>(i)));
        if let Some(uv) = uv.filter(|uv| !uv.is_finite()) {
            return Err(Fault::not_finite(Place::Item(named("TEXCOORD_0")), format!("texture coordinate {vertex}"), uv));
        }
        let normal = normals.as_ref().map_or(Vec3::ZERO, |normals| Vec3::from(normals.vector::<3>(i)));
        // Textures have v down in glTF, up here.
        mesh.push_vertex(position, normal, uv.map(|uv| Vec2::new(uv.x, 1.0 - uv.y)));
    }
    let whole = used.last().is_some_and(|&last| last as usize + 1 == used.len());
    let vertex = |corner: u32| if whole { corner } else { used.partition_point(|&u| u < corner) as u32 };
    assemble(mode, &corners, |t| mesh.indices.extend(t.map(vertex)));
    if normals.is_none() {
        limits.check_vertices(mesh.indices.len() as u64, || Place::Item(place.into()))?;
        mesh.flat_normals();
    }
    Ok(Some(mesh))
}

/// Positions are floats, or integers of up to 16 bits with `KHR_mesh_quantization`.
fn check_component(positions: &Accessor<'_>, place: &str) -> Result<(), Fault> {
    if positions.component == ComponentType::U32 {
        return Err(Fault::syntax(
            Place::Item(place.into()),
            "a componentType of 5126 (float) or, quantised, 5120 to 5123",
            "5125 (unsigned int)",
        ));
    }
    Ok(())
}

/// The vertices in drawing order; without indices simply all of them.
fn read_indices(
    root: &json::Root,
    buffers: &Buffers<'_>,
    primitive: &json::mesh::Primitive,
    vertex_count: usize,
    place: &str,
    limits: &MeshLimits,
) -> Result<Vec<u32>, Fault> {
    let Some(index) = primitive.indices else {
        limits.check_vertices(vertex_count as u64, || Place::Item(place.into()))?;
        return Ok((0..vertex_count as u32).collect());
    };
    let place = format!("{place}.indices");
    let accessor = Accessor::new(root, buffers, index.value(), Type::Scalar, &place)?;
    if !matches!(accessor.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) || accessor.normalized {
        return Err(Fault::syntax(
            Place::Item(place),
            "unsigned integers (componentType 5121, 5123 or 5125)",
            format!("{:?}", accessor.component),
        ));
    }
    limits.check_triangles(accessor.count as u64 / 3, || Place::Item(place.clone()))?;
    let mut corners = Vec::with_capacity(accessor.count);
    for i in 0..accessor.count {
        let seen = accessor.number(i, 0) as u32;
        if seen as usize >= vertex_count {
            let allowed = format!("below {vertex_count}, the count of POSITION");
            return Err(Fault::out_of_range(Place::Item(place), format!("index {i}"), i64::from(seen), allowed));
        }
        corners.push(seen);
    }
    Ok(corners)
}

/// Triangles of a list, strip or fan; those of strips and fans that repeat a corner are joints and left out.
fn assemble(mode: Mode, corners: &[u32], mut emit: impl FnMut([u32; 3])) {
    let mut emit_unless_joint = |t: [u32; 3]| {
        if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
            emit(t);
        }
    };
    match mode {
        Mode::TriangleStrip => {
            for (i, t) in corners.windows(3).enumerate() {
                emit_unless_joint(if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] });
            }
        }
        Mode::TriangleFan => {
            for t in corners.windows(2).skip(1) {
                emit_unless_joint([t[0], t[1], corners[0]]);
            }
        }
        _ => corners.chunks_exact(3).for_each(|t| emit([t[0], t[1], t[2]])),
    }
}
