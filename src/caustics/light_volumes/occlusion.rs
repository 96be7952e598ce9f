//! Receivers that others hide: boxes of which the eye sees nothing clamp no beams [BO §5, future work].
//!
//! The receivers are drawn into a depth buffer as the eye sees them, then each box against it, with a query that counts what passes. Nothing
//! that is visible is behind the faces of its box. As with shadow culling, answers decide what a frame draws: the queries run while
//! it is built, and the frame has the same passes again for other executors.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::passes::geometry_buffer::{self, MaterialUniform, ReceiverVertex};
use crate::stage::Stage;
use crate::stage::state::depth_state;
use crate::{Receivers, RenderError};
use nephroid_math::space::sin_cos_deg;
use nephroid_pipeline::frame::{
    BindEntry, BindGroupId, Contents, DepthTarget, Frame, FrameDraw, FrameError, FramePass, PipelineId, TextureId, pipelines,
    run_frame_pass,
};
use nephroid_pipeline::shader::Program;
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{Buffer, Device, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::geom::Aabb;
use nephroid_scene::{Camera, Material, Scene};

use super::boxes::ReceiverBox;
use super::shadow::QUERIES_PER_PASS;

/// Corners of a box's faces, as bits of x, y and z: two triangles each.
const FACES: [[u8; 6]; 6] =
    [[0, 2, 6, 0, 6, 4], [1, 5, 7, 1, 7, 3], [0, 4, 5, 0, 5, 1], [2, 3, 7, 2, 7, 6], [0, 1, 3, 0, 3, 2], [4, 6, 7, 4, 7, 5]];

/// Vertices of a box.
const BOX_VERTICES: u32 = 36;

/// A frame's resources for these queries.
struct Prepared {
    depth: TextureId,
    bindings: BindGroupId,
    pipeline: PipelineId,
}

/// What the queries are made from.
pub struct Queries<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Receivers.
    pub receivers: &'a Receivers,
    /// Their boxes.
    pub boxes: &'a [ReceiverBox],
}

impl Queries<'_> {
    /// The part of a box that can be lit: what is above the water is not, and would be bent where it passes the surface.
    fn lit_part(&self, of: &ReceiverBox) -> Aabb {
        let mut bounds = of.bounds;
        if let Some(water) = &self.scene.water {
            bounds.max.y = bounds.max.y.min(water.level_m).max(bounds.min.y);
        }
        bounds
    }

    fn prepare(&self, stage: &Stage, frame: &mut Frame) -> Prepared {
        let label = "receiver_query_depth";
        let depth = frame.texture(TextureDescriptor::d2(label, stage.size.0, stage.size.1, TextureFormat::Depth32Float));
        let camera = frame.buffer("query camera", Arc::new(Buffer::from_value(&stage.camera)));
        let material = frame.buffer("query material", Arc::new(Buffer::from_value(&MaterialUniform::from(&Material::default()))));
        let bind = |frame: &mut Frame, label: &str, vertices: Arc<Buffer>| {
            let vertices = frame.buffer(label, vertices);
            frame.bind_group(vec![BindEntry::Uniform(camera, 0), BindEntry::Storage(vertices), BindEntry::Uniform(material, 0)])
        };
        let receivers = bind(frame, "query receivers", self.receivers.vertices.clone());
        let indices = frame.buffer("query receiver indices", self.receivers.indices.clone());
        let vertices: Vec<ReceiverVertex> = self.boxes.iter().flat_map(|of| faces(self.lit_part(of))).collect();
        let bindings = bind(frame, "query boxes", Arc::new(Buffer::from_slice(&vertices)));
        let program = Arc::new(Program { fragment: None, ..(*geometry_buffer::program()).clone() });
        let mut pipeline = |label: &str, compare, write| {
            frame.pipeline(RenderPipelineDescriptor {
                depth_stencil: Some(depth_state(TextureFormat::Depth32Float, compare, write, DepthBiasState::default())),
                ..RenderPipelineDescriptor::new(label, program.clone())
            })
        };
        let filled = pipeline(label, CompareFunction::Less, true);
        let asked = pipeline("receiver_query", CompareFunction::LessEqual, false);
        let groups = self.receivers.groups.iter().filter(|group| !group.elements.is_empty());
        let draws = groups.map(|group| FrameDraw::new(filled, receivers, group.elements.clone()).indexed(indices)).collect();
        let target = Some(DepthTarget { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        frame.passes.push(FramePass { label: label.into(), depth: target, draws, ..FramePass::default() });
        Prepared { depth, bindings, pipeline: asked }
    }

    fn pass(prepared: &Prepared, label: String, boxes: &[u32]) -> FramePass {
        let draw = |(query, &number): (usize, &u32)| FrameDraw {
            query: Some(query as u32),
            ..FrameDraw::new(prepared.pipeline, prepared.bindings, number * BOX_VERTICES..(number + 1) * BOX_VERTICES)
        };
        FramePass {
            label,
            depth: Some(DepthTarget { view: prepared.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
            draws: boxes.iter().enumerate().map(draw).collect(),
            query_count: boxes.len(),
            ..FramePass::default()
        }
    }

    /// Whether the eye sees anything of each box; the passes are added to the stage's frame.
    ///
    /// # Errors
    /// If the queries cannot run.
    pub fn ask(&self, device: &Device, stage: &mut Stage) -> Result<Vec<bool>, RenderError> {
        let mut visible = vec![true; self.boxes.len()];
        let asked: Vec<u32> = (0..self.boxes.len() as u32).filter(|&number| !self.eye_is_in(number)).collect();
        if asked.is_empty() {
            return Ok(visible);
        }
        let mut counting = Frame { rules: stage.frame.rules, ..Frame::default() };
        let prepared = self.prepare(stage, &mut counting);
        let mut contents = Contents::initial(&counting).map_err(FrameError::from)?;
        let made = pipelines(&counting).map_err(FrameError::from)?;
        run_frame_pass(device, &counting, &made, &counting.passes[0], &mut contents, None)?;
        let mut frame = std::mem::take(&mut stage.frame);
        let again = self.prepare(stage, &mut frame);
        stage.frame = frame;
        for (part, numbers) in asked.chunks(QUERIES_PER_PASS).enumerate() {
            let label = format!("receiver_queries part {part}");
            let output = run_frame_pass(device, &counting, &made, &Self::pass(&prepared, label.clone(), numbers), &mut contents, None)?;
            for (&number, &count) in numbers.iter().zip(&output.queries) {
                visible[number as usize] = count > 0;
            }
            stage.frame.passes.push(FramePass { known: Some(output), ..Self::pass(&again, label, numbers) });
        }
        Ok(visible)
    }

    /// Whether the eye is so near to a box that its faces may be cut away.
    fn eye_is_in(&self, number: u32) -> bool {
        let near = match self.scene.camera {
            Camera::Perspective { near_m, fov_deg, .. } => {
                let (sin, cos) = sin_cos_deg(fov_deg * 0.5);
                let aspect = self.scene.image.width as f32 / self.scene.image.height as f32;
                // No corner of the near plane is farther from the eye.
                near_m * (1.0 + (sin / cos) as f32 * (1.0 + aspect))
            }
            Camera::Orthographic { .. } => return true,
        };
        let eye = self.scene.camera.position_ws();
        let reach = self.boxes[number as usize].bounds.expanded(near);
        eye.cmpge(reach.min).all() && eye.cmple(reach.max).all()
    }
}

fn faces(of: Aabb) -> impl Iterator<Item = ReceiverVertex> {
    let corner = move |bits: u8| {
        let pick = |axis: usize| if bits >> axis & 1 == 1 { of.max[axis] } else { of.min[axis] };
        ReceiverVertex { position_ws: Vec3::new(pick(0), pick(1), pick(2)).extend(1.0), normal_ws: Vec4::Y }
    };
    FACES.into_iter().flatten().map(corner)
}
