//! glTF 2.0, as JSON with buffers beside it or embedded, and as one GLB.
//!
//! The scene's nodes are walked and every mesh is placed where a node uses it. The JSON is parsed by the crate `gltf-json`; accessors are
//! read here, because those of the crate `gltf` panic on offsets and counts that do not fit their buffer. Only what geometry needs is
//! checked: a file whose animation is broken still has its mesh.
//!
//! Left out: skins and morph targets (a mesh has its rest shape), cameras, lights, materials, points and lines.

mod accessor;
mod container;
mod primitive;

use std::path::Path;

use glam::{Mat4, Quat, Vec3, Vec4};
use gltf_json as json;

use super::{Fault, MeshFileError, MeshLimits, Place, finish};
use crate::geom::Mesh;

use accessor::Buffers;

/// Reads a glTF or GLB file from memory. `name` is the file's name in messages; buffers in files of their own are looked for in `base`
/// and refused without one.
///
/// # Errors
/// If the bytes are no glTF 2.0 file, need an extension that is not supported, exceed a limit or hold no triangle.
pub fn from_bytes(name: &Path, bytes: &[u8], base: Option<&Path>, limits: &MeshLimits) -> Result<Mesh, MeshFileError> {
    parse(bytes, base, limits).map_err(|fault| fault.in_file(name))
}

/// Required extensions that leave geometry alone, by their beginning.
const HARMLESS_EXTENSIONS: [&str; 6] = ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "EXT_lights_", "KHR_xmp"];
/// Required extensions that are read.
const READ_EXTENSIONS: [&str; 1] = ["KHR_mesh_quantization"];

pub(super) fn parse(bytes: &[u8], base: Option<&Path>, limits: &MeshLimits) -> Result<Mesh, Fault> {
    let (json_bytes, blob) = container::split(bytes)?;
    let root = json::Root::from_slice(json_bytes).map_err(|e| {
        let seen = e.to_string();
        // The place is named once, in front.
        let seen = seen.split(" at line ").next().unwrap_or_default().to_owned();
        Fault::syntax(Place::LineColumn(e.line() as u64, e.column() as u64), "a glTF 2.0 document", seen)
    })?;
    check_version(&root)?;
    let buffers = container::load_buffers(&root, blob, base, limits)?;
    let mut mesh = Mesh::default();
    for (node, world_from_node) in placed_meshes(&root)? {
        append_node(&mut mesh, &root, &buffers, node, world_from_node, limits)?;
    }
    finish(mesh)
}

fn check_version(root: &json::Root) -> Result<(), Fault> {
    let at = |item: &str| Place::Item(item.into());
    let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
    if version.split('.').next() != Some("2") {
        return Err(Fault::unsupported(at("asset.version"), format!("glTF version {version:?}"), "must be 2.x"));
    }
    let is_known = |name: &str| READ_EXTENSIONS.contains(&name) || HARMLESS_EXTENSIONS.iter().any(|known| name.starts_with(known));
    match root.extensions_required.iter().find(|name| !is_known(name)) {
        Some(name) => Err(Fault::unsupported(
            at("extensionsRequired"),
            format!("the extension {name:?}"),
            format!("export without it (required extensions may be {}, {}*)", READ_EXTENSIONS.join(", "), HARMLESS_EXTENSIONS.join("*, ")),
        )),
        None => Ok(()),
    }
}

/// Nodes of the scene that have a mesh, and where they stand: the default scene, else the first, else all nodes that are no children.
fn placed_meshes(root: &json::Root) -> Result<Vec<(usize, Mat4)>, Fault> {
    let scene = match (root.scene, root.scenes.first()) {
        (Some(index), _) => Some(lookup(&root.scenes, index.value(), "scene", "scenes")?),
        (None, first) => first,
    };
    let children_of = |node: &json::Node| node.children.iter().flatten().map(|c| c.value()).collect::<Vec<_>>();
    let starts: Vec<usize> = match scene {
        Some(scene) => scene.nodes.iter().map(|n| n.value()).collect(),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            root.nodes.iter().flat_map(children_of).for_each(|c| is_child.get_mut(c).into_iter().for_each(|seen| *seen = true));
            (0..root.nodes.len()).filter(|&n| !is_child[n]).collect()
        }
    };

    let mut visited = vec![false; root.nodes.len()];
    let mut stack: Vec<(usize, Mat4)> = starts.into_iter().rev().map(|n| (n, Mat4::IDENTITY)).collect();
    let mut placed = Vec::new();
    while let Some((index, world_from_parent)) = stack.pop() {
        let node = lookup(&root.nodes, index, "node", "nodes")?;
        // A cycle would never end, and shared subtrees could double at every level.
        if std::mem::replace(&mut visited[index], true) {
            let expected = "a tree: every node with one parent, and no cycle";
            return Err(Fault::syntax(Place::Item(format!("nodes[{index}]")), expected, "a node that is reached twice"));
        }
        let world_from_node = world_from_parent * local_transform(node, index)?;
        if node.mesh.is_some() {
            placed.push((index, world_from_node));
        }
        stack.extend(children_of(node).into_iter().rev().map(|c| (c, world_from_node)));
    }

    Ok(placed)
}

/// `T · R · S`, or the matrix if there is one.
fn local_transform(node: &json::Node, index: usize) -> Result<Mat4, Fault> {
    let at = |field: &str| Place::Item(format!("nodes[{index}].{field}"));
    let transform = if let Some(matrix) = &node.matrix {
        Mat4::from_cols_array(matrix)
    } else {
        let rotation = node.rotation.as_ref().map_or(Vec4::W, |r| Vec4::from(r.0));
        // Exporters round: a unit quaternion only nearly.
        let Some(rotation) = rotation.try_normalize() else {
            return Err(Fault::syntax(at("rotation"), "a unit quaternion", rotation.to_string()));
        };
        let scale = node.scale.map_or(Vec3::ONE, Vec3::from);
        let translation = node.translation.map_or(Vec3::ZERO, Vec3::from);
        Mat4::from_scale_rotation_translation(scale, Quat::from_vec4(rotation), translation)
    };
    if !transform.is_finite() {
        return Err(Fault::not_finite(at("matrix"), "the transform", transform));
    }
    if transform.row(3) != Vec4::W {
        return Err(Fault::syntax(at("matrix"), "an affine matrix: 0, 0, 0, 1 as elements 3, 7, 11 and 15", transform.row(3).to_string()));
    }
    Ok(transform)
}

fn append_node(
    all: &mut Mesh,
    root: &json::Root,
    buffers: &Buffers<'_>,
    node: usize,
    world_from_node: Mat4,
    limits: &MeshLimits,
) -> Result<(), Fault> {
    let Some(index) = root.nodes[node].mesh.map(|m| m.value()) else { return Ok(()) };
    let mesh = lookup(&root.meshes, index, &format!("nodes[{node}].mesh"), "meshes")?;
    for (at, primitive) in mesh.primitives.iter().enumerate() {
        let place = format!("meshes[{index}].primitives[{at}]");
        let Some(part) = primitive::read(root, buffers, primitive, &place, limits)? else { continue };
        let whole = |seen: usize, more: usize| seen as u64 + more as u64;
        limits.check_vertices(whole(all.positions.len(), part.positions.len()), || Place::Item(place.clone()))?;
        limits.check_triangles(whole(all.triangle_count(), part.triangle_count()), || Place::Item(place.clone()))?;
        let part = if world_from_node == Mat4::IDENTITY { part } else { transformed(&part, world_from_node) };
        if let Some(p) = part.positions.iter().find(|p| !p.is_finite()) {
            return Err(Fault::not_finite(Place::Item(place), format!("a position, placed by nodes[{node}],"), p));
        }
        all.append(&part);
    }
    Ok(())
}

/// [`Mesh::transformed`], except that a zero normal stays zero: it means "missing" until the end.
fn transformed(part: &Mesh, world_from_node: Mat4) -> Mesh {
    let mut moved = part.transformed(world_from_node);
    for (n, read) in moved.normals.iter_mut().zip(&part.normals) {
        if *read == Vec3::ZERO || !read.is_finite() {
            *n = Vec3::ZERO;
        }
    }
    moved
}

/// An element of one of the document's arrays.
fn lookup<'a, T>(array: &'a [T], index: usize, what: &str, array_name: &str) -> Result<&'a T, Fault> {
    array.get(index).ok_or_else(|| {
        let allowed = if array.is_empty() {
            format!("an index of {array_name}, which is empty")
        } else {
            format!("0 to {} (an index of {array_name})", array.len() - 1)
        };
        Fault::out_of_range(Place::Item(what.into()), "the index", index as i64, allowed)
    })
}
