//! Conversion of irradiance to radiance: `L = ρ/π · (E_ambient + E_direct + E_caustic)` for Lambertian receivers.
//!
//! Target: `radiance` (W/(m² sr)) of the receiver that each pixel shows, without the water between the receiver and the eye.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::optics::beer_lambert_rgb;
use nephroid_math::vector::{V3, v3, v4};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings};

use super::camera::CameraUniform;
use super::environment::EnvironmentUniform;
use super::fullscreen::FullscreenVertex;

/// Bindings: camera, environment, position, albedo, direct, caustic irradiance.
pub const BINDINGS: [BindingKind; 6] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<EnvironmentUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// The program.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("../../math/optics.wgsl"),
            include_str!("fullscreen.wgsl"),
            include_str!("camera.wgsl"),
            include_str!("environment.wgsl"),
            include_str!("shade.wgsl")
        )),
        ..Program::new("shade", FullscreenVertex, Fragment)
    })
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let environment: &EnvironmentUniform = bindings.uniform(1);
        let p: V3<L> = input.texel3_here(bindings.texture(2));
        let albedo = input.texel3_here(bindings.texture(3));
        let zero = p.x.like(0.0);
        let exists = input.texel_here(bindings.texture(2), 3).gt(zero);
        // Ambient light reaches points under water from the surface, so the water attenuates it.
        let wet = input.texel_here(bindings.texture(3), 3).gt(zero);
        let depth = L::select(wet, -(p.y - camera.level.x), zero);
        let ambient = V3::splat(input.token, environment.ambient.truncate())
            .hadamard(beer_lambert_rgb(environment.sigma_t.truncate(), Lanes::max(depth, zero)));
        let irradiance = ambient + input.texel3_here(bindings.texture(4)) + input.texel3_here(bindings.texture(5));
        let radiance = albedo.hadamard(irradiance) * p.x.like(std::f32::consts::FRAC_1_PI);
        let radiance = V3::select(exists, radiance, v3(zero, zero, zero));
        output.color[0] = v4(radiance.x, radiance.y, radiance.z, p.x.like(1.0));
    }
}
