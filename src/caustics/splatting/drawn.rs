//! The scene's surfaces, as light buffers draw them.

use std::sync::Arc;

use glam::Vec3;

use nephroid_pipeline::Buffer;
use nephroid_scene::Material;
use nephroid_scene::water::HeightField;

use super::frame::Shared;
use super::settings::{CurvatureFrom, Splats, Splatting};
use crate::builder::FrameBuilder;
use crate::passes::light_buffer::{SurfaceDraw, SurfaceUniform};
use crate::passes::water_surface::WaterVertex;
use crate::receivers::{Receivers, vertices_of};

/// Surfaces as light buffers draw them.
pub(super) struct Surfaced {
    /// Everything.
    pub all: Vec<SurfaceDraw>,
    /// Glass.
    pub glass: Vec<SurfaceDraw>,
    /// Receivers.
    pub diffuse: Vec<SurfaceDraw>,
}

/// The vertices of all objects, with mean curvature in `normal_ws.w` for mirrors and glass if it is wanted.
#[must_use]
pub fn vertices(receivers: &Receivers, settings: &Splatting) -> Arc<Buffer> {
    if settings.splats != Splats::Lens || settings.curvature != CurvatureFrom::Mesh {
        return receivers.vertices.clone();
    }
    let mut mesh = receivers.mesh.clone();
    let mut vertices = vertices_of(&mesh);
    for group in receivers.groups.iter().filter(|group| !matches!(group.material, Material::Diffuse { .. })) {
        let range = group.indices.start as usize..group.indices.end as usize;
        mesh.indices.clear();
        mesh.indices.extend_from_slice(&receivers.mesh.indices[range]);
        let curvatures = mesh.curvatures();
        for &index in &mesh.indices {
            vertices[index as usize].normal_ws.w = curvatures[index as usize].mean_per_m();
        }
    }
    Arc::new(Buffer::from_slice(&vertices))
}

/// The surfaces of the scene, ready to be drawn.
pub(super) fn surfaces(builder: &mut FrameBuilder<'_>, shared: &Shared, field: Option<&HeightField>) -> Surfaced {
    let vertices = builder.frame.buffer("surfaces", shared.vertices.clone());
    let indices = builder.frame.buffer("surface indices", shared.receivers.indices.clone());
    let (mut all, mut glass, mut diffuse) = (Vec::new(), Vec::new(), Vec::new());
    for group in shared.receivers.groups.iter().filter(|group| !group.indices.is_empty()) {
        let draw =
            SurfaceDraw { vertices, indices: Some(indices), range: group.indices.clone(), surface: SurfaceUniform::from(&group.material) };
        match group.material {
            Material::Diffuse { .. } => diffuse.push(draw.clone()),
            Material::Dielectric { .. } => glass.push(draw.clone()),
            Material::Mirror { .. } => {}
        }
        all.push(draw);
    }
    if let Some((field, water)) = field.zip(builder.scene.water.as_ref()) {
        let curvature = mean_curvature(field);
        let vertex = |(i, (p, n)): (usize, (&Vec3, &Vec3))| WaterVertex { position_ws: p.extend(1.0), normal_ws: n.extend(curvature[i]) };
        let made: Vec<WaterVertex> = field.positions_ws().iter().zip(&field.normals_ws).enumerate().map(vertex).collect();
        let triangles = field.triangle_indices();
        let range = 0..triangles.len() as u32;
        let vertices = builder.frame.buffer("emitting water", Arc::new(Buffer::from_slice(&made)));
        let indices = builder.frame.buffer("emitting water indices", Arc::new(Buffer::from_slice(&triangles)));
        all.push(SurfaceDraw { vertices, indices: Some(indices), range, surface: SurfaceUniform::water(water.ior) });
    }
    Surfaced { all, glass, diffuse }
}

/// Mean curvature of the water at its vertices, 1/m, positive at crests: half the divergence of the normals, by differences of neighbours.
fn mean_curvature(field: &HeightField) -> Vec<f32> {
    let (columns, rows) = (field.columns, field.rows);
    let along = |a: usize, b: usize, pick: fn(Vec3) -> f32, length: f32| (pick(field.normals_ws[b]) - pick(field.normals_ws[a])) / length;
    let mut curvature = Vec::with_capacity((columns * rows) as usize);
    for row in 0..rows {
        for column in 0..columns {
            let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            let (up, down) = (row.saturating_sub(1), (row + 1).min(rows - 1));
            let x = along(field.index(left, row), field.index(right, row), |n| n.x, field.spacing_m.x * (right - left) as f32);
            let z = along(field.index(column, up), field.index(column, down), |n| n.z, field.spacing_m.y * (down - up) as f32);
            curvature.push(0.5 * (x + z));
        }
    }
    curvature
}
