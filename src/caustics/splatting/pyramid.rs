//! A naive pyramid of caustic maps, shown for comparison [WD06 §4, Fig. 4]: each photon is one texel in every level, and each texel of the map takes the
//! finest level in which at least 16 photons lie. It is noisy at first, then blocky, and costs a draw of all photons for each level.

use std::sync::Arc;

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V4, v4};
use nephroid_pipeline::sampler::load;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};

use super::splats::{Source, clear_others, photon, splat_wgsl, sprite};
use crate::passes::fullscreen::FullscreenVertex;

/// Photons in a texel of the level that is taken: noise is gone from 16 on [WD06 §4.1].
const ENOUGH: f32 = 16.0;

/// The program that draws one texel for each photon, of any level.
#[must_use]
pub fn program(source: Source) -> Arc<Program> {
    let name = match source {
        Source::Textures => "texel_splats",
        Source::Records => "texel_splats_of_records",
    };
    Arc::new(Program {
        varyings: vec![Varying { name: "flux", components: 4, interpolation: Interpolation::Flat }],
        bindings: source.bindings(),
        wgsl: Some(splat_wgsl!(source, "texel.wgsl")),
        ..Program::new(name, Vertex { source }, Fragment)
    })
}

struct Vertex {
    source: Source,
}

impl VertexShader for Vertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let photon = photon(self.source, bindings, input);
        output.position = sprite(bindings, &photon);
        if !photon.landed.any() {
            clear_others(&photon, 4, output);
            return;
        }
        output.set3(0, photon.flux);
        output.varyings[3] = photon.beam.like(1.0);
        clear_others(&photon, 4, output);
    }
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let flat = input.flat_varyings();
        let at = input.position.x;
        output.color[0] = v4(at.like(flat[0]), at.like(flat[1]), at.like(flat[2]), at.like(flat[3]));
    }
}

/// Bindings of [`pick`]: the pyramid.
pub const PICK_BINDINGS: [BindingKind; 1] = [BindingKind::Texture];

/// The program that takes a level for each texel. Target: flux per texel of level 0, W, linear RGB; w is the level.
#[must_use]
pub fn pick() -> Arc<Program> {
    Arc::new(Program {
        bindings: PICK_BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("../passes/fullscreen.wgsl"), include_str!("pick_level.wgsl"))),
        ..Program::new("pick_level", FullscreenVertex, Pick)
    })
}

struct Pick;

impl FragmentShader for Pick {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let pyramid = bindings.texture(0);
        let (width, height, _) = pyramid.level_size(0);
        let zero = input.position.x.like(0.0);
        let mut picked: V4<L> = v4(zero, zero, zero, zero);
        let mut done = zero.lt(zero);
        for level in 0..pyramid.mip_level_count() {
            let (columns, rows, _) = pyramid.level_size(level);
            let (across, down) = (columns as f32 / width as f32, rows as f32 / height as f32);
            let here = load(pyramid, (input.position.x * across).floor(), (input.position.y * down).floor(), 0, level);
            let flux = here.xyz() * zero.like(across * down);
            // Where no level has enough, the last one stands.
            picked = V4::select(done, picked, v4(flux.x, flux.y, flux.z, zero.like(level as f32)));
            done = done | here.w.ge(zero.like(ENOUGH));
            if done.all() {
                break;
            }
        }
        output.color[0] = picked;
    }
}
