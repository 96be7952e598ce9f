//! A scene's objects as the passes draw them: one buffer of world-space vertices and a run of indices per object.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::passes::geometry_buffer::ReceiverVertex;
use nephroid_pipeline::Buffer;
use nephroid_scene::geom::{Aabb, Mesh};
use nephroid_scene::water::Water;
use nephroid_scene::{Light, Material, Object, Scene, SceneError};

/// One object's part of the index buffer.
#[derive(Clone, Debug)]
pub struct ReceiverGroup {
    /// What it does with light.
    pub material: Material,
    /// Indices, in the shared index buffer.
    pub elements: std::ops::Range<u32>,
    /// Wholly under water, with nothing dry that light from above could reach past it: it casts no shadow through air.
    pub submerged: bool,
}

/// All receivers of a scene. Static: made once, shared by all frames of an animation.
#[derive(Clone, Debug)]
pub struct Receivers {
    /// [`ReceiverVertex`] in world space.
    pub vertices: Arc<Buffer>,
    /// 32-bit indices.
    pub indices: Arc<Buffer>,
    /// Per object.
    pub groups: Vec<ReceiverGroup>,
    /// World-space bounds.
    pub bounds: Aabb,
    /// Triangles in all.
    pub triangles: u64,
}

impl Receivers {
    /// The groups that can keep a light from what is dry, or from the water surface.
    pub fn air_casters<'a>(&'a self, light: &Light, level_y: f32) -> impl Iterator<Item = &'a ReceiverGroup> + use<'a> {
        let from_above = match *light {
            Light::Directional { .. } => light.incident(Vec3::ZERO).direction_ws.y < 0.0,
            Light::Point { position, .. } | Light::Spot { position, .. } => position.y > level_y,
        };
        self.groups.iter().filter(move |group| !(group.elements.is_empty() || from_above && group.submerged))
    }
}

impl Receivers {
    /// Builds or loads every object's mesh, several at a time; of several errors the first object's is reported. Triangles that cross `cut_y` are cut there, so that what is under water can be moved
    /// (see [`crate::passes::camera::CameraUniform::raise`]) without bending what is above.
    pub fn new(scene: &Scene, cut_y: Option<f32>) -> Result<Self, SceneError> {
        let mut builder = Builder { vertices: Vec::new(), indices: Vec::new(), cut_y };
        let mut groups = Vec::new();
        let place = |(index, object): (usize, &Object)| Ok(scene.mesh(index)?.transformed(object.transform.world_from_object()));
        let meshes: Vec<Result<Mesh, SceneError>> = scene.objects.par_iter().enumerate().map(place).collect();
        for (object, mesh) in scene.objects.iter().zip(meshes) {
            let mesh = mesh?;
            let first = builder.indices.len() as u32;
            builder.mesh(&mesh);
            let elements = first..builder.indices.len() as u32;
            groups.push(ReceiverGroup { material: object.material.clone(), elements, submerged: false });
        }
        if let Some(water) = &scene.water {
            builder.find_submerged(&mut groups, water);
        }
        let bounds = Aabb::from_points(builder.vertices.iter().map(|v| v.position_ws.truncate()));
        let triangles = builder.indices.len() as u64 / 3;
        // Storage bindings hold at least one element.
        if builder.vertices.is_empty() {
            builder.vertices.push(ReceiverVertex { position_ws: Vec4::W, normal_ws: Vec4::Y });
        }
        Ok(Self {
            vertices: Arc::new(Buffer::from_slice(&builder.vertices)),
            indices: Arc::new(Buffer::from_slice(&builder.indices)),
            groups,
            bounds,
            triangles,
        })
    }
}

type Corner = (Vec3, Vec3);

fn vertex((position, normal): &Corner) -> ReceiverVertex {
    ReceiverVertex { position_ws: position.extend(1.0), normal_ws: normal.extend(0.0) }
}

struct Builder {
    vertices: Vec<ReceiverVertex>,
    indices: Vec<u32>,
    cut_y: Option<f32>,
}

impl Builder {
    fn mesh(&mut self, mesh: &Mesh) {
        let first = self.vertices.len() as u32;
        let corners = || mesh.positions.iter().copied().zip(mesh.normals.iter().copied());
        self.vertices.extend(corners().map(|corner| vertex(&corner)));
        for triangle in mesh.triangles() {
            let above = triangle.map(|i| self.cut_y.is_some_and(|cut| mesh.positions[i as usize].y > cut));
            match self.cut_y {
                Some(cut) if above != [above[0]; 3] => {
                    self.cut(triangle.map(|i| (mesh.positions[i as usize], mesh.normals[i as usize])), above, cut);
                }
                _ => self.indices.extend(triangle.map(|i| first + i)),
            }
        }
    }

    /// Marks what is wholly under water, if nothing lies lower than its level beside it.
    fn find_submerged(&self, groups: &mut [ReceiverGroup], water: &Water) {
        let low = |v: &ReceiverVertex| v.position_ws.y < water.level_m;
        let (min, max) = water.extent_ws();
        let inside = |v: &ReceiverVertex| {
            let at = Vec2::new(v.position_ws.x, v.position_ws.z);
            at.cmpge(min).all() && at.cmple(max).all()
        };
        if !self.vertices.iter().all(|v| !low(v) || inside(v)) {
            return;
        }
        for group in groups {
            let mut corners = self.indices[group.elements.start as usize..group.elements.end as usize].iter();
            group.submerged = corners.all(|&i| low(&self.vertices[i as usize]));
        }
    }

    /// A triangle with corners above and below the cut becomes three.
    fn cut(&mut self, corners: [Corner; 3], above: [bool; 3], cut: f32) {
        for side in [true, false] {
            let mut polygon = Vec::with_capacity(4);
            for i in 0..3 {
                let (here, next) = (corners[i], corners[(i + 1) % 3]);
                if above[i] == side {
                    polygon.push(here);
                }
                if above[i] != above[(i + 1) % 3] {
                    // From above to below on every edge, so that neighbours share the new vertex.
                    let (high, low) = if above[i] { (here, next) } else { (next, here) };
                    let t = (high.0.y - cut) / (high.0.y - low.0.y);
                    let mut position = high.0 + (low.0 - high.0) * t;
                    position.y = cut;
                    polygon.push((position, (high.1 + (low.1 - high.1) * t).normalize_or(Vec3::Y)));
                }
            }
            self.polygon(&polygon);
        }
    }

    fn polygon(&mut self, corners: &[Corner]) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners.iter().map(vertex));
        for k in 1..corners.len() as u32 - 1 {
            self.indices.extend([first, first + k, first + k + 1]);
        }
    }
}
