//! The depth of a smaller target. A pass at half or quarter size tests against it, and [`super::compose`] upsamples the pass's result by it.
//!
//! Texel i of the smaller target, of width w, has the depth of texel `⌊(i + ½)·W/w⌋` of the larger one, of width W: the texel in the middle of its
//! part of the picture. With W/w = 2 or 4, every pixel beside a straight edge, on either side, then has a texel of its own side among the 2x2 around
//! it, provided that the side is at least one texel wide. Roads not taken: the nearest depth makes thin objects thicker, the farthest depth loses
//! them, and both leave pixels without a texel of their side at quarter size.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use nephroid_math::lanes::Lanes;
use nephroid_pipeline::frame::{BindEntry, DepthStencilAttachment, Draw, Frame, Pass, TextureId};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, DepthStencilState, StencilState, TextureFormat};
use nephroid_pipeline::{BindingKind, Bindings, Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};

use super::fullscreen::{FullscreenVertex, VERTICES, load_clamped};

/// Sizes of both targets.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DownsampleUniform {
    /// Width and height of the larger target, width and height of the smaller one, texels.
    pub sizes: [u32; 4],
}

/// Bindings: sizes, depth.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Uniform(size_of::<DownsampleUniform>()), BindingKind::Texture];

/// The program. It writes depth and no colour.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        writes_depth: true,
        wgsl: Some(concat!(include_str!("fullscreen.wgsl"), include_str!("load_clamped.wgsl"), include_str!("downsample.wgsl"))),
        ..Program::new("downsample", FullscreenVertex, Fragment)
    })
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let [width, height, small_width, small_height] = bindings.uniform::<DownsampleUniform>(0).sizes;
        // Computed in integers: the middle may lie between two texels, where the rounding of a quotient would decide.
        let middle = |i: u32, large: u32, small: u32| ((2 * i + 1) * large / (2 * small)) as f32;
        let (columns, rows) = (input.position.x.to_i32(), input.position.y.to_i32());
        let x = L::from_fn(input.token, |lane| middle(columns[lane] as u32, width, small_width));
        let y = L::from_fn(input.token, |lane| middle(rows[lane] as u32, height, small_height));
        output.depth = load_clamped(bindings.texture(1), x, y).x;
    }
}

/// Adds a `Depth32Float` texture and the pass that fills it, both named `label`. Returns the texture.
///
/// `depth` has depths in 0..=1: a depth texture, or the first channel of a colour texture. `(width, height)` is at most its size.
pub fn depth(frame: &mut Frame, label: &str, depth: TextureId, (width, height): (u32, u32)) -> TextureId {
    let large = &frame.textures[depth.index()].desc;
    let sizes = [large.width, large.height, width, height];
    let format = TextureFormat::Depth32Float;
    let texture = frame.texture(TextureDescriptor::d2(label, width, height, format));
    let uniform = frame.buffer(label, Arc::new(Buffer::from_value(&DownsampleUniform { sizes })));
    let bindings = frame.bind_group(vec![BindEntry::Uniform(uniform, 0), BindEntry::texture(depth)]);
    let pipeline = frame.pipeline(RenderPipelineDescriptor {
        depth_stencil: Some(DepthStencilState {
            format,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Always),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        }),
        ..RenderPipelineDescriptor::new(label, program())
    });
    frame.passes.push(Pass {
        label: label.to_owned(),
        depth_stencil: Some(DepthStencilAttachment { view: texture.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load }),
        draws: vec![Draw::new(pipeline, bindings, VERTICES)],
        ..Pass::default()
    });
    texture
}
