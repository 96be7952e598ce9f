//! Receivers hidden by others: boxes of which the eye sees nothing do not clamp beams [BO §5, future work].
//!
//! The receivers, without mirrors and glass, are drawn into a depth buffer from the eye. An occlusion query then tests each box against it. The faces
//! of a box lie before everything inside; if they are hidden, everything inside is hidden, too.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::builder::state::depth_state;
use crate::builder::{FrameBuilder, water_heights};
use crate::passes::geometry_buffer::{self, MaterialUniform, ReceiverVertex};
use crate::readback::{self, OcclusionQueries};
use crate::{ReceiverGroup, RenderError};
use nephroid_math::space::sin_cos_deg;
use nephroid_pipeline::frame::{BindEntry, DepthStencilAttachment, Draw, Frame, Pass, PipelineId};
use nephroid_pipeline::shader::Program;
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{Buffer, Device, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::HeightField;
use nephroid_scene::{Camera, Material, Scene};

use super::boxes::ReceiverBox;

/// Vertices of a box's faces (two triangles each), as bits of x, y and z.
const FACES: [[u8; 6]; 6] =
    [[0, 2, 6, 0, 6, 4], [1, 5, 7, 1, 7, 3], [0, 4, 5, 0, 5, 1], [2, 3, 7, 2, 7, 6], [0, 1, 3, 0, 3, 2], [4, 6, 7, 4, 7, 5]];

/// Number of vertices of a drawn box.
const BOX_VERTICES: u32 = 36;

/// For each box, whether the eye sees anything of it. The passes of the queries are added to the builder's frame.
///
/// # Errors
/// If the queries cannot run.
pub fn visible_boxes(device: &Device, builder: &mut FrameBuilder<'_>, boxes: &[ReceiverBox]) -> Result<Vec<bool>, RenderError> {
    let mut visible = vec![true; boxes.len()];
    let asked: Vec<u32> = (0..boxes.len() as u32).filter(|&number| !eye_is_in(builder.scene, &boxes[number as usize])).collect();
    if asked.is_empty() {
        return Ok(visible);
    }
    let queries = describe(builder, boxes);
    let counts = readback::ask(device, &mut builder.frame, queries, |counter| counter.count("receiver_queries", &asked))?;
    for (number, count) in asked.into_iter().zip(counts) {
        visible[number as usize] = count > 0;
    }
    Ok(visible)
}

/// Describes the queries: receivers as occluders, boxes as shapes.
fn describe(builder: &FrameBuilder<'_>, boxes: &[ReceiverBox]) -> OcclusionQueries {
    let receivers = builder.receivers;
    let label = "receiver_query_depth";
    let mut frame = Frame::default();
    let depth = frame.texture(TextureDescriptor::d2(label, builder.size.0, builder.size.1, TextureFormat::Depth32Float));
    let camera = frame.buffer("query camera", Arc::new(Buffer::from_value(&builder.camera)));
    let material = frame.buffer("query material", Arc::new(Buffer::from_value(&MaterialUniform::from(&Material::default()))));
    let heights = water_heights(&mut frame, builder.water);
    let mut bind = |label: &str, vertices: Arc<Buffer>| {
        let (vertices, heights) = (BindEntry::Storage(frame.buffer(label, vertices)), BindEntry::texture(heights));
        frame.bind_group(vec![BindEntry::Uniform(camera, 0), vertices, BindEntry::Uniform(material, 0), heights])
    };
    let occluders = bind("query receivers", receivers.vertices.clone());
    let vertices: Vec<ReceiverVertex> = boxes.iter().flat_map(|of| faces(lit_part(builder.water, of))).collect();
    let bindings = bind("query boxes", Arc::new(Buffer::from_slice(&vertices)));
    let indices = frame.buffer("query receiver indices", receivers.indices.clone());
    let pipeline = query_pipeline(&mut frame, "receiver_query", CompareFunction::LessEqual, false);
    let fill = query_pipeline(&mut frame, label, CompareFunction::Less, true);
    let is_diffuse = |group: &ReceiverGroup| matches!(group.material, Material::Diffuse { .. });
    let groups = receivers.groups.iter().filter(|group| !group.indices.is_empty() && is_diffuse(group));
    let draws = groups.map(|group| Draw::new(fill, occluders, group.indices.clone()).indexed(indices)).collect();
    let target = Some(DepthStencilAttachment { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
    frame.passes.push(Pass { label: label.into(), depth_stencil: target, draws, ..Pass::default() });
    OcclusionQueries { occluders: frame, depth, pipeline, bindings, shape_vertices: BOX_VERTICES }
}

/// A pipeline that draws receivers without colours.
fn query_pipeline(frame: &mut Frame, label: &str, compare: CompareFunction, write: bool) -> PipelineId {
    frame.pipeline(RenderPipelineDescriptor {
        depth_stencil: Some(depth_state(TextureFormat::Depth32Float, compare, write, DepthBiasState::default())),
        ..RenderPipelineDescriptor::new(label, Arc::new(Program { fragment: None, ..(*geometry_buffer::program()).clone() }))
    })
}

/// The part of a box that caustic light can reach: below the water's crests. The part above is not lit, and would appear bent at the surface.
fn lit_part(water: Option<&HeightField>, of: &ReceiverBox) -> Aabb {
    let mut bounds = of.bounds;
    if let Some(water) = water {
        bounds.max.y = bounds.max.y.min(water.height_range_ws().1).max(bounds.min.y);
    }
    bounds
}

/// Whether the eye is so close to a box that the near plane may clip its faces.
fn eye_is_in(scene: &Scene, of: &ReceiverBox) -> bool {
    let near = match scene.camera {
        Camera::Perspective { near_m, fov_deg, .. } => {
            let (sin, cos) = sin_cos_deg(fov_deg * 0.5);
            let aspect = scene.image.width as f32 / scene.image.height as f32;
            // The corners of the near plane are at most this far from the eye.
            near_m * (1.0 + (sin / cos) as f32 * (1.0 + aspect))
        }
        Camera::Orthographic { .. } => return true,
    };
    let eye = scene.camera.position_ws();
    let around = of.bounds.expanded(near);
    eye.cmpge(around.min).all() && eye.cmple(around.max).all()
}

fn faces(of: Aabb) -> impl Iterator<Item = ReceiverVertex> {
    let vertex = move |bits: u8| {
        let pick = |axis: usize| if bits >> axis & 1 == 1 { of.max[axis] } else { of.min[axis] };
        ReceiverVertex { position_ws: Vec3::new(pick(0), pick(1), pick(2)).extend(1.0), normal_ws: Vec4::Y }
    };
    FACES.into_iter().flatten().map(vertex)
}
