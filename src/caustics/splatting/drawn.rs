//! The scene's surfaces, as light buffers draw them.

use std::sync::Arc;

use glam::{Mat3, Vec3};

use nephroid_pipeline::Buffer;
use nephroid_scene::Material;
use nephroid_scene::water::HeightField;

use super::frame::Shared;
use super::settings::{CurvatureFrom, Intersection, Splats, Splatting};
use crate::builder::FrameBuilder;
use crate::passes::light_buffer::{SurfaceDraw, SurfaceUniform};
use crate::passes::shape_operator::ShapeOperator;
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

/// The vertices of all objects.
pub struct Vertices {
    /// Position and normal, with mean curvature in `normal_ws.w` for mirrors and glass if it is wanted.
    vertices: Arc<Buffer>,
    /// Their shape operators, if these are wanted.
    operators: Option<Arc<Buffer>>,
}

impl Vertices {
    /// With what these settings want.
    pub fn new(receivers: &Receivers, settings: &Splatting) -> Self {
        if settings.splats != Splats::Lens || settings.curvature == CurvatureFrom::Normals {
            return Self { vertices: receivers.vertices.clone(), operators: None };
        }
        let mut mesh = receivers.mesh.clone();
        let mut vertices = vertices_of(&mesh);
        let mut operators = vec![ShapeOperator::default(); vertices.len()];
        for group in receivers.groups.iter().filter(|group| !matches!(group.material, Material::Diffuse { .. })) {
            let range = group.indices.start as usize..group.indices.end as usize;
            mesh.indices.clear();
            mesh.indices.extend_from_slice(&receivers.mesh.indices[range]);
            let curvatures = mesh.curvatures();
            for &index in &mesh.indices {
                let index = index as usize;
                vertices[index].normal_ws.w = curvatures[index].mean_per_m();
                operators[index] = ShapeOperator::new(curvatures[index], mesh.normals[index]);
            }
        }
        // Exact photons know their differentials from their neighbours.
        let wanted = settings.has_both_curvatures() && settings.intersection == Intersection::Image;
        let operators = wanted.then(|| Arc::new(Buffer::from_slice(&operators)));
        Self { vertices: Arc::new(Buffer::from_slice(&vertices)), operators }
    }
}

/// The surfaces of the scene, ready to be drawn.
pub(super) fn surfaces(builder: &mut FrameBuilder<'_>, shared: &Shared, field: Option<&HeightField>) -> Surfaced {
    let vertices = builder.frame.buffer("surfaces", shared.vertices.vertices.clone());
    let operators = shared.vertices.operators.clone().map(|operators| builder.frame.buffer("shape operators", operators));
    let indices = builder.frame.buffer("surface indices", shared.receivers.indices.clone());
    let (mut all, mut glass, mut diffuse) = (Vec::new(), Vec::new(), Vec::new());
    for group in shared.receivers.groups.iter().filter(|group| !group.indices.is_empty()) {
        let (range, surface) = (group.indices.clone(), SurfaceUniform::from(&group.material));
        let draw = SurfaceDraw { vertices, indices: Some(indices), range, surface, operators };
        match group.material {
            Material::Diffuse { .. } => diffuse.push(SurfaceDraw { operators: None, ..draw.clone() }),
            Material::Dielectric { .. } => glass.push(draw.clone()),
            Material::Mirror { .. } => {}
        }
        all.push(draw);
    }
    if let Some((field, water)) = field.zip(builder.scene.water.as_ref()) {
        let bends = shape_operators(field);
        // Half the sum of both curvatures is half the trace.
        let mean = |bend: &ShapeOperator| 0.5 * bend.diagonal.element_sum();
        let vertex = |((p, n), bend): ((&Vec3, &Vec3), _)| WaterVertex { position_ws: p.extend(1.0), normal_ws: n.extend(mean(bend)) };
        let made: Vec<WaterVertex> = field.positions_ws().iter().zip(&field.normals_ws).zip(&bends).map(vertex).collect();
        let triangles = field.triangle_indices();
        let range = 0..triangles.len() as u32;
        let vertices = builder.frame.buffer("emitting water", Arc::new(Buffer::from_slice(&made)));
        let indices = builder.frame.buffer("emitting water indices", Arc::new(Buffer::from_slice(&triangles)));
        let operators = operators.map(|_| builder.frame.buffer("shape operators of water", Arc::new(Buffer::from_slice(&bends))));
        all.push(SurfaceDraw { vertices, indices: Some(indices), range, surface: SurfaceUniform::water(water.ior), operators });
    }
    Surfaced { all, glass, diffuse }
}

/// How the water's normal turns at its vertices, above 0 at crests, by differences of neighbours.
fn shape_operators(field: &HeightField) -> Vec<ShapeOperator> {
    let (columns, rows) = (field.columns, field.rows);
    let positions = field.positions_ws();
    let mut operators = Vec::with_capacity((columns * rows) as usize);
    for row in 0..rows {
        for column in 0..columns {
            let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            let (up, down) = (row.saturating_sub(1), (row + 1).min(rows - 1));
            let sides = [(field.index(left, row), field.index(right, row)), (field.index(column, up), field.index(column, down))];
            let [along_x, along_z] = sides.map(|(a, b)| positions[b] - positions[a]);
            let [turn_x, turn_z] = sides.map(|(a, b)| field.normals_ws[b] - field.normals_ws[a]);
            let normal = field.normals_ws[field.index(column, row)];
            // S maps steps to turns of the normal, and the normal to 0.
            let steps = Mat3::from_cols(along_x, along_z, normal);
            let operator = Mat3::from_cols(turn_x, turn_z, Vec3::ZERO) * steps.inverse();
            operators.push(ShapeOperator::of_columns([operator.x_axis, operator.y_axis, operator.z_axis]));
        }
    }
    operators
}
