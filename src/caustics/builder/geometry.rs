//! The receivers as the camera sees them.

use crate::passes::geometry_buffer::{MaterialUniform, program};
use nephroid_pipeline::frame::{BindEntry, BindGroupId, DepthStencilAttachment, Draw, Pass};
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{LoadOp, RenderPipelineDescriptor};
use nephroid_scene::Material;

use super::FrameBuilder;
use super::state::{clear, depth_state, target};

impl FrameBuilder<'_> {
    /// Adds the pass `geometry_buffer`.
    pub(super) fn geometry_buffer(&mut self) {
        let draws = self.geometry_draws();
        self.frame.passes.push(Pass {
            label: "geometry_buffer".into(),
            color: vec![clear(self.position), clear(self.normal), clear(self.albedo)],
            depth_stencil: Some(DepthStencilAttachment {
                view: self.depth.into(),
                depth_load: LoadOp::Clear(1.0),
                stencil_load: LoadOp::Load,
            }),
            draws,
            ..Pass::default()
        });
    }

    /// A draw per object: one pipeline, and a bind group per material.
    fn geometry_draws(&mut self) -> Vec<Draw> {
        let receivers = self.receivers;
        let format = TextureFormat::Rgba32Float;
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            targets: vec![target(format, None), target(format, None), target(format, None)],
            depth_stencil: Some(depth_state(self.depth_format, CompareFunction::Less, true, DepthBiasState::default())),
            ..RenderPipelineDescriptor::new("geometry_buffer", program())
        });
        let mut draws = Vec::with_capacity(receivers.groups.len());
        let mut made: Vec<(&Material, BindGroupId)> = Vec::new();
        for group in receivers.groups.iter().filter(|g| !g.indices.is_empty()) {
            let bindings = match made.iter().find(|(material, _)| **material == group.material) {
                Some((_, bindings)) => *bindings,
                None => {
                    let material = self.uniform(&format!("material {}", made.len()), &MaterialUniform::from(&group.material));
                    let entries =
                        vec![BindEntry::Uniform(self.camera_buffer, 0), BindEntry::Storage(self.vertices), BindEntry::Uniform(material, 0)];
                    let bindings = self.frame.bind_group(entries);
                    made.push((&group.material, bindings));
                    bindings
                }
            };
            draws.push(Draw::new(pipeline, bindings, group.indices.clone()).indexed(self.indices));
        }
        draws
    }
}
