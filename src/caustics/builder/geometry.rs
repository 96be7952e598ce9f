//! Surfaces as a camera sees them.

use crate::passes::geometry_buffer::{MaterialUniform, program};
use nephroid_pipeline::frame::{BindEntry, BindGroupId, BufferId, DepthStencilAttachment, Draw, Pass, TextureId};
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, Face, PrimitiveState, TextureFormat};
use nephroid_pipeline::{LoadOp, RenderPipelineDescriptor};

use super::FrameBuilder;
use super::state::{clear, depth_state, target};
use crate::ReceiverGroup;

/// Targets of a pass over surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct GeometryTargets {
    /// World position, m; w is 1 + [`crate::passes::geometry_buffer::MaterialKind`], 0 where there is no surface.
    pub position: TextureId,
    /// Unit normal towards the eye; w is the refractive index.
    pub normal: TextureId,
    /// Albedo; w is 1 under water, otherwise 0.
    pub albedo: TextureId,
    /// Depth.
    pub depth: TextureId,
    /// Format of the depth texture.
    pub depth_format: TextureFormat,
}

/// Surfaces to be drawn: objects, each with its material.
pub(super) type Surfaces<'a> = Vec<(&'a ReceiverGroup, MaterialUniform)>;

impl FrameBuilder<'_> {
    /// Adds a pass that draws surfaces, without the faces `cull`.
    pub(super) fn geometry_pass(
        &mut self,
        label: &str,
        camera: BufferId,
        targets: GeometryTargets,
        cull: Option<Face>,
        surfaces: &Surfaces<'_>,
    ) {
        let draws = self.geometry_draws(label, camera, targets.depth_format, cull, surfaces);
        self.frame.passes.push(Pass {
            label: label.into(),
            color: vec![clear(targets.position), clear(targets.normal), clear(targets.albedo)],
            depth_stencil: Some(DepthStencilAttachment {
                view: targets.depth.into(),
                depth_load: LoadOp::Clear(1.0),
                stencil_load: LoadOp::Load,
            }),
            draws,
            ..Pass::default()
        });
    }

    /// A draw per object: one pipeline, and a bind group per material.
    fn geometry_draws(
        &mut self,
        label: &str,
        camera: BufferId,
        depth_format: TextureFormat,
        cull: Option<Face>,
        surfaces: &Surfaces<'_>,
    ) -> Vec<Draw> {
        let format = TextureFormat::Rgba32Float;
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            primitive: PrimitiveState { cull_mode: cull, ..PrimitiveState::default() },
            targets: vec![target(format, None), target(format, None), target(format, None)],
            depth_stencil: Some(depth_state(depth_format, CompareFunction::Less, true, DepthBiasState::default())),
            ..RenderPipelineDescriptor::new(label, program())
        });
        let mut draws = Vec::with_capacity(surfaces.len());
        let mut made: Vec<(&MaterialUniform, BindGroupId)> = Vec::new();
        for (group, material) in surfaces.iter().filter(|(group, _)| !group.indices.is_empty()) {
            let bindings = match made.iter().find(|(known, _)| *known == material) {
                Some((_, bindings)) => *bindings,
                None => {
                    let uniform = self.uniform(&format!("{label} material {}", made.len()), material);
                    let entries = vec![
                        BindEntry::Uniform(camera, 0),
                        BindEntry::Storage(self.vertices),
                        BindEntry::Uniform(uniform, 0),
                        BindEntry::texture(self.heights),
                    ];
                    let bindings = self.frame.bind_group(entries);
                    made.push((material, bindings));
                    bindings
                }
            };
            draws.push(Draw::new(pipeline, bindings, group.indices.clone()).indexed(self.indices));
        }
        draws
    }
}
