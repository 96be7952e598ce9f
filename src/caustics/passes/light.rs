//! Direct light of one light, for every pixel: irradiance above the water, and whether light through flat water reaches a point below it.
//!
//! Targets: `direct` (W/m², summed over lights), `visibility` (share of the light under water, 0..=1).

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v3, v4};
use nephroid_pipeline::sampler::sample_compare;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings};

use super::camera::CameraUniform;
use super::fullscreen::FullscreenVertex;
use super::shadow_map::{LightUniform, none};

/// Bindings: camera, light, position, normal, map through air, map through water, comparison sampler.
pub const BINDINGS: [BindingKind; 7] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<LightUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::DepthTexture,
    BindingKind::DepthTexture,
    BindingKind::ComparisonSampler,
];

/// The program. Without shadows every point is lit.
#[must_use]
pub fn program(air_shadows: bool, water_shadows: bool) -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("fullscreen.wgsl"),
            include_str!("camera.wgsl"),
            include_str!("shadow_map.wgsl"),
            include_str!("light.wgsl")
        )),
        wgsl_constants: vec![("air_shadows", f64::from(u8::from(air_shadows))), ("water_shadows", f64::from(u8::from(water_shadows)))],
        ..Program::new("light", FullscreenVertex, Fragment { air_shadows, water_shadows })
    })
}

struct Fragment {
    air_shadows: bool,
    water_shadows: bool,
}

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let light: &LightUniform = bindings.uniform(1);
        let (position, normal) = (bindings.texture(2), bindings.texture(3));
        let p: V3<L> = input.texel3_here(position);
        let n = input.texel3_here(normal);
        let (zero, one) = (p.x.like(0.0), p.x.like(1.0));
        let exists = input.texel_here(position, 3).gt(zero);
        let wet = camera.under_water(p) & exists;
        let dry = exists & !wet;
        let sampler = bindings.sampler(6);

        let mut direct = v3(zero, zero, zero);
        if !none(dry) {
            let incident = light.at(p);
            let off = p + n * light.air_texel(p, bindings.texture(4).level_size(0).0);
            let cos = Lanes::max(-n.dot(incident.direction), zero);
            let mut lit = one;
            if self.air_shadows {
                let (uv, depth, inside) = light.through_air(off);
                lit = L::select(inside, sample_compare(bindings.texture(4), &sampler, uv, 0, depth), one);
            }
            direct = V3::select(dry, incident.irradiance * (cos * lit), direct);
        }
        let mut visibility = one;
        if self.water_shadows && !none(wet) {
            let (uv, depth) = light.through_water(p + n * one.like(light.water_texel(bindings.texture(5).level_size(0).0)));
            visibility = sample_compare(bindings.texture(5), &sampler, uv, 0, depth);
        }
        let visibility = L::select(wet, visibility, zero);
        output.color[0] = v4(direct.x, direct.y, direct.z, one);
        output.color[1] = v4(visibility, zero, zero, one);
    }
}
