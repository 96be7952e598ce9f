//! Conversion of irradiance to radiance: `L = ρ/π · (E_ambient + E_direct + E_caustic)` for Lambertian receivers; mirrors and glass show the sky.
//!
//! Target: `radiance` (W/(m² sr)) of the surface that each pixel shows, without the water between the surface and the eye.

use std::sync::Arc;

use nephroid_math::lanes::Lanes;
use nephroid_math::optics::{beer_lambert_rgb, fresnel_reflectance, reflect};
use nephroid_math::vector::{V3, v3, v4};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings};

use super::camera::CameraUniform;
use super::environment::EnvironmentUniform;
use super::fullscreen::FullscreenVertex;
use super::geometry_buffer::MaterialKind;

/// Bindings: camera, environment, position, normal, albedo, direct, caustic irradiance.
pub const BINDINGS: [BindingKind; 7] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<EnvironmentUniform>()),
    BindingKind::Texture,
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
        let kind = input.texel_here(bindings.texture(2), 3);
        let p: V3<L> = input.texel3_here(bindings.texture(2));
        let n = input.texel3_here(bindings.texture(3));
        let albedo = input.texel3_here(bindings.texture(4));
        let zero = p.x.like(0.0);
        // Ambient light reaches points under water from the surface, so the water attenuates it.
        let wet = camera.under_water(p);
        let depth = L::select(wet, -(p.y - camera.water.x), zero);
        let ambient = V3::splat(input.token, environment.ambient.truncate())
            .hadamard(beer_lambert_rgb(environment.sigma_t.truncate(), Lanes::max(depth, zero)));
        let irradiance = ambient + input.texel3_here(bindings.texture(5)) + input.texel3_here(bindings.texture(6));
        let diffuse = albedo.hadamard(irradiance) * p.x.like(std::f32::consts::FRAC_1_PI);

        let view = camera.view_direction(p);
        let mirrored = environment.sky(reflect(view, n));
        let mirror = albedo.hadamard(mirrored);
        // Glass as a thin shell: Fresnel reflection over the sky straight behind it.
        let cos = Lanes::clamp(-n.dot(view), 0.0, 1.0);
        let share = fresnel_reflectance(cos, 1.0, 1.5);
        let glass = mirrored * share + environment.sky(view) * (-share + 1.0);
        let is_mirror = kind.equals(kind.like(1.0 + MaterialKind::Mirror as u8 as f32));
        let is_glass = kind.equals(kind.like(1.0 + MaterialKind::Dielectric as u8 as f32));
        let radiance = V3::select(is_mirror, mirror, V3::select(is_glass, glass, diffuse));
        let radiance = V3::select(kind.gt(zero), radiance, v3(zero, zero, zero));
        output.color[0] = v4(radiance.x, radiance.y, radiance.z, p.x.like(1.0));
    }
}
