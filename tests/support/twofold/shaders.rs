//! Direct irradiance times a factor.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use nephroid::math::lanes::Lanes;
use nephroid::math::vector::v4;
use nephroid::passes::fullscreen::FullscreenVertex;
use nephroid::pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid::pipeline::{BindingKind, Bindings};

/// Numbers of the pass.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct TwofoldUniform {
    /// x: the factor.
    pub factor: Vec4,
}

/// Bindings: numbers, direct irradiance.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: vec![BindingKind::Uniform(size_of::<TwofoldUniform>()), BindingKind::Texture],
        wgsl: Some(concat!(include_str!("../../../src/caustics/passes/fullscreen.wgsl"), include_str!("shaders.wgsl"))),
        ..Program::new("twofold", FullscreenVertex, Fragment)
    })
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let uniform: &TwofoldUniform = bindings.uniform(0);
        let direct = input.texel3_here(bindings.texture(1));
        let sum = direct * direct.x.like(uniform.factor.x);
        output.color[0] = v4(sum.x, sum.y, sum.z, direct.x.like(1.0));
    }
}
