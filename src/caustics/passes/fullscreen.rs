//! A pass over every pixel: one triangle that covers the target.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v4};
use nephroid_pipeline::frame::{BindEntry, ColorAttachment, Draw, Frame, Pass, TextureId};
use nephroid_pipeline::sampler::load;
use nephroid_pipeline::shader::{Program, VertexInput, VertexOutput, VertexShader};
use nephroid_pipeline::state::{Color, ColorTargetState, ColorWrites};
use nephroid_pipeline::{Bindings, LoadOp, RenderPipelineDescriptor, TextureDescriptor, TextureView};

/// Vertices of the triangle.
pub const VERTICES: std::ops::Range<u32> = 0..3;

/// Vertex shader of the triangle (−1, −1), (3, −1), (−1, 3) at depth 0.
pub struct FullscreenVertex;

impl VertexShader for FullscreenVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let x = input.per_vertex(|i| if i == 1 { 3.0 } else { -1.0 });
        let y = input.per_vertex(|i| if i == 2 { 3.0 } else { -1.0 });
        output.position = v4(x, y, x.like(0.0), x.like(1.0));
    }
}

/// Adds a texture, and a pass of the same name that writes every texel once.
pub fn fill(frame: &mut Frame, desc: TextureDescriptor, program: Arc<Program>, entries: Vec<BindEntry>) -> TextureId {
    let label = desc.label.clone();
    let target = ColorTargetState { format: desc.format, blend: None, write_mask: ColorWrites::ALL };
    let texture = frame.texture(desc);
    let bindings = frame.bind_group(entries);
    let pipeline =
        frame.pipeline(RenderPipelineDescriptor { targets: vec![Some(target)], ..RenderPipelineDescriptor::new(label.clone(), program) });
    let load = LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 });
    frame.passes.push(Pass {
        label,
        color: vec![Some(ColorAttachment { view: texture.into(), load })],
        draws: vec![Draw::new(pipeline, bindings, VERTICES)],
        ..Pass::default()
    });
    texture
}

/// The texel at integer coordinates; outside of the texture, the nearest texel inside.
#[inline(always)]
pub(super) fn load_clamped<L: Lanes>(texture: &TextureView<'_>, x: L, y: L) -> V4<L> {
    let (width, height, _) = texture.level_size(0);
    load(texture, Lanes::clamp(x, 0.0, (width - 1) as f32), Lanes::clamp(y, 0.0, (height - 1) as f32), 0, 0)
}
