//! A scene's objects as passes draw them: one world-space mesh, with a range of indices per object.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::passes::geometry_buffer::ReceiverVertex;
use nephroid_pipeline::Buffer;
use nephroid_scene::geom::{Aabb, Mesh};
use nephroid_scene::water::Water;
use nephroid_scene::{Light, Material, PlacedMesh, Scene, SceneError};

/// Counter of bodies of glass whose triangles faced in, and were turned over.
pub const BODIES_TURNED: &str = "bodies_turned";

/// One object's part of the mesh.
#[derive(Clone, Debug)]
pub struct ReceiverGroup {
    /// The object's material.
    pub material: Material,
    /// Range of the mesh's indices.
    pub indices: std::ops::Range<u32>,
    /// World y of its highest point, m.
    pub top_y: f32,
}

/// All receivers of a scene. They are static: made once and shared by all frames of an animation.
#[derive(Clone, Debug)]
pub struct Receivers {
    /// World-space mesh of all objects, one after the other.
    pub mesh: Mesh,
    /// The mesh's vertices as [`ReceiverVertex`], for shaders.
    pub vertices: Arc<Buffer>,
    /// The mesh's 32-bit indices, for draws.
    pub indices: Arc<Buffer>,
    /// One group per object.
    pub groups: Vec<ReceiverGroup>,
    /// World-space bounds of the mesh.
    pub bounds: Aabb,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Bodies of glass whose triangles faced in, and were turned over.
    pub turned: u64,
    /// World y of the lowest point beside the water, m; infinite if there is none.
    pub lowest_beside_water_y: f32,
}

impl Receivers {
    /// Makes or loads every object's mesh, several at a time. If several fail, the first object's error is returned. Triangles that cross height
    /// `cut_y` are cut there, so that the part under water can be raised (see [`crate::passes::camera::CameraUniform::raise`]) without bending the
    /// part above.
    ///
    /// # Errors
    /// If a mesh cannot be made or loaded.
    pub fn new(scene: &Scene, cut_y: Option<f32>) -> Result<Self, SceneError> {
        let place = |index: usize| scene.placed_mesh(index);
        let meshes: Vec<Result<PlacedMesh, SceneError>> = (0..scene.objects.len()).into_par_iter().map(place).collect();
        let (mut all, mut turned) = (Mesh::default(), 0);
        let mut groups = Vec::new();
        for (object, mesh) in scene.objects.iter().zip(meshes) {
            let first = all.indices.len() as u32;
            let placed = mesh?;
            turned += u64::from(placed.turned);
            append(&mut all, &placed.mesh, cut_y);
            let indices = first..all.indices.len() as u32;
            let heights = all.indices[first as usize..].iter().map(|&i| all.positions[i as usize].y);
            let top_y = heights.fold(f32::NEG_INFINITY, f32::max);
            groups.push(ReceiverGroup { material: object.material.clone(), indices, top_y });
        }
        Ok(Self {
            vertices: Arc::new(Buffer::from_slice(&vertices_of(&all))),
            indices: Arc::new(Buffer::from_slice(&all.indices)),
            groups,
            bounds: all.bounds(),
            triangles: all.triangle_count() as u64,
            lowest_beside_water_y: scene.water.as_ref().map_or(f32::INFINITY, |water| lowest_beside(&all, water)),
            mesh: all,
            turned,
        })
    }

    /// Name and value of what is counted of a scene's objects.
    #[must_use]
    pub fn counters(&self) -> Vec<(String, u64)> {
        let mut counters = vec![("receiver_triangles".to_owned(), self.triangles)];
        if self.turned > 0 {
            counters.push((BODIES_TURNED.to_owned(), self.turned));
        }
        counters
    }

    /// The groups that can cast a shadow of this light on a point above water or on the water surface. Light from above that passes an object wholly
    /// below the lowest point of the surface, `trough_y`, reaches no point above water, unless there is one beside the water and as low.
    pub fn casters<'a>(&'a self, light: &Light, trough_y: f32) -> impl Iterator<Item = &'a ReceiverGroup> + use<'a> {
        let from_above = match *light {
            Light::Directional { .. } => light.incident(Vec3::ZERO).direction_ws.y < 0.0,
            Light::Point { position, .. } | Light::Spot { position, .. } => position.y > trough_y,
        };
        let passes = from_above && self.lowest_beside_water_y >= trough_y;
        self.groups.iter().filter(move |group| !(group.indices.is_empty() || passes && group.top_y < trough_y))
    }

    /// The receivers mirrored at the plane y = 0, as beams that go up meet them. Buffers for shaders are those of the receivers themselves.
    #[must_use]
    pub fn upside_down(&self) -> Self {
        let mirrored = |p: Vec3| Vec3::new(p.x, -p.y, p.z);
        let mut turned = self.clone();
        turned.mesh.positions.iter_mut().for_each(|p| *p = mirrored(*p));
        if !self.bounds.is_empty() {
            turned.bounds = Aabb::from_corners(mirrored(self.bounds.min), mirrored(self.bounds.max));
        }
        turned
    }

    /// Positions of a group's vertices in the order of its indices, three per triangle.
    pub fn positions_of<'a>(&'a self, group: &ReceiverGroup) -> impl Iterator<Item = Vec3> + use<'a> {
        let indices = &self.mesh.indices[group.indices.start as usize..group.indices.end as usize];
        indices.iter().map(|&i| self.mesh.positions[i as usize])
    }

    /// Positions of the triangle whose first index has this position among the indices.
    #[must_use]
    pub fn triangle_at(&self, first: u32) -> [Vec3; 3] {
        let first = first as usize;
        [0, 1, 2].map(|k| self.mesh.positions[self.mesh.indices[first + k] as usize])
    }
}

/// A mesh's vertices for shaders. Without vertices there is one unused element, because a storage binding has at least one.
pub(crate) fn vertices_of(mesh: &Mesh) -> Vec<ReceiverVertex> {
    let mut vertices: Vec<ReceiverVertex> = mesh.positions.iter().zip(&mesh.normals).map(|(&p, &n)| receiver_vertex(p, n)).collect();
    if vertices.is_empty() {
        vertices.push(receiver_vertex(Vec3::ZERO, Vec3::Y));
    }
    vertices
}

fn receiver_vertex(position: Vec3, normal: Vec3) -> ReceiverVertex {
    ReceiverVertex { position_ws: position.extend(1.0), normal_ws: normal.extend(0.0) }
}

/// Appends a mesh, cut at a height if one is given.
fn append(all: &mut Mesh, mesh: &Mesh, cut_y: Option<f32>) {
    let first = all.positions.len() as u32;
    all.positions.extend_from_slice(&mesh.positions);
    all.normals.extend_from_slice(&mesh.normals);
    for triangle in mesh.triangles() {
        let above = triangle.map(|i| cut_y.is_some_and(|cut| mesh.positions[i as usize].y > cut));
        match cut_y {
            Some(cut) if above != [above[0]; 3] => {
                let vertices = triangle.map(|i| PolygonVertex { position: mesh.positions[i as usize], normal: mesh.normals[i as usize] });
                append_cut(all, vertices, above, cut);
            }
            _ => all.indices.extend(triangle.map(|i| first + i)),
        }
    }
}

/// A vertex of the part of a triangle on one side of the cut.
#[derive(Clone, Copy)]
struct PolygonVertex {
    position: Vec3,
    normal: Vec3,
}

/// A triangle with vertices above and below the cut becomes three triangles.
fn append_cut(all: &mut Mesh, vertices: [PolygonVertex; 3], above: [bool; 3], cut: f32) {
    for side in [true, false] {
        let mut polygon = Vec::with_capacity(4);
        for i in 0..3 {
            let (here, next) = (vertices[i], vertices[(i + 1) % 3]);
            if above[i] == side {
                polygon.push(here);
            }
            if above[i] != above[(i + 1) % 3] {
                // Every edge is traversed from above to below, so both triangles of the edge compute the same new vertex.
                let (high, low) = if above[i] { (here, next) } else { (next, here) };
                let t = (high.position.y - cut) / (high.position.y - low.position.y);
                let mut position = high.position + (low.position - high.position) * t;
                position.y = cut;
                let normal = (high.normal + (low.normal - high.normal) * t).normalize_or(Vec3::Y);
                polygon.push(PolygonVertex { position, normal });
            }
        }
        append_polygon(all, &polygon);
    }
}

/// Appends a convex polygon as a fan of triangles.
fn append_polygon(all: &mut Mesh, vertices: &[PolygonVertex]) {
    let first = all.positions.len() as u32;
    all.positions.extend(vertices.iter().map(|vertex| vertex.position));
    all.normals.extend(vertices.iter().map(|vertex| vertex.normal));
    for k in 1..vertices.len() as u32 - 1 {
        all.indices.extend([first, first + k, first + k + 1]);
    }
}

/// World y of the lowest point of a mesh that is not over the water's extent.
fn lowest_beside(all: &Mesh, water: &Water) -> f32 {
    let (min, max) = water.extent_ws();
    let is_beside = |p: &&Vec3| {
        let at = Vec2::new(p.x, p.z);
        !(at.cmpge(min).all() && at.cmple(max).all())
    };
    all.positions.iter().filter(is_beside).fold(f32::INFINITY, |low, p| low.min(p.y))
}
