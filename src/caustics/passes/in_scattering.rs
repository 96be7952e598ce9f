//! Adds the radiance that the medium scatters towards the eye to the picture.
//!
//! Drawn over every pixel with additive blending. The texture holds radiance summed along the eye's path and attenuated up to the eye, W/(m² sr).

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings};

use super::fullscreen::FullscreenVertex;

/// Bindings: in-scattered radiance.
pub const BINDINGS: [BindingKind; 1] = [BindingKind::Texture];

/// The program.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("fullscreen.wgsl"), include_str!("in_scattering.wgsl"))),
        ..Program::new("in_scattering", FullscreenVertex, Fragment)
    })
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let radiance = input.texel3_here(bindings.texture(0));
        // The picture's alpha does not change.
        output.color[0] = v4(radiance.x, radiance.y, radiance.z, radiance.x.like(0.0));
    }
}
