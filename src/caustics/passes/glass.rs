//! What mirrors and glass show: the receivers behind and before them, and the sky.
//!
//! A mirror shows what the mirrored view ray meets. Glass shows that by the share of Fresnel's law, and for the rest what the ray meets that has passed both its
//! faces ([`BackFaces`]), attenuated on the way inside by the Beer-Lambert law. Receivers are searched first in the picture, then in a wider view of the
//! surroundings ([`SeenReceivers`]); a ray that finds none shows the sky.
//!
//! Target: `glass` (W/(m² sr)), the radiance of the surface that each pixel shows: for receivers, that of the pass `shade`. Each ray meets mirrors and glass
//! once: what is seen in or through them has none.

use std::sync::Arc;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::optics::{beer_lambert, fresnel_reflectance_by, reflect};
use nephroid_math::vector::{V3, v3, v4};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings};

use super::camera::CameraUniform;
use super::environment::EnvironmentUniform;
use super::fullscreen::FullscreenVertex;
use super::geometry_buffer::MaterialKind;
use super::receiver_search::SeenReceivers;
use super::shadow_map::none;
use super::two_interfaces::{BackFaces, Entry};

/// Bindings: camera; environment; position, normal and albedo of the nearest surfaces; the same of back faces of glass, whose albedo is the absorption
/// coefficient; position, normal and radiance of the receivers; a wider camera, and what it sees of the receivers.
pub const BINDINGS: [BindingKind; 15] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<EnvironmentUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Uniform(size_of::<CameraUniform>()),
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
            include_str!("receiver_search.wgsl"),
            include_str!("two_interfaces.wgsl"),
            include_str!("glass.wgsl")
        )),
        ..Program::new("glass", FullscreenVertex, Fragment)
    })
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let kind = input.texel_here(bindings.texture(2), 3);
        let is_mirror = kind.equals(kind.like(1.0 + MaterialKind::Mirror as u8 as f32));
        let is_glass = kind.equals(kind.like(1.0 + MaterialKind::Dielectric as u8 as f32));
        let one = kind.like(1.0);
        let mut radiance = input.texel3_here(bindings.texture(10));
        if (is_mirror | is_glass).any() {
            let scene = Surroundings::of(bindings);
            let p: V3<L> = input.texel3_here(bindings.texture(2));
            let n = input.texel3_here(bindings.texture(3));
            let view = scene.near.camera.view_direction(p);
            let mirrored = scene.radiance(p, reflect(view, n), is_mirror | is_glass);
            let mirror = mirrored.hadamard(input.texel3_here(bindings.texture(4)));
            radiance = V3::select(is_mirror, mirror, radiance);
            if is_glass.any() {
                let wet = scene.near.camera.under_water(p);
                let outside = L::select(wet, one.like(scene.environment.inscatter.w), one);
                let eta = outside / Lanes::max(input.texel_here(bindings.texture(3), 3), one);
                let back = input.texel3_here(bindings.texture(5));
                let has_back = input.texel_here(bindings.texture(5), 3).gt(one.like(0.0));
                let thickness = L::select(has_back, (back - p).length(), one.like(0.0));
                let faces = BackFaces { camera: scene.near.camera, position: bindings.texture(5), normal: bindings.texture(6) };
                let exit = faces.pass(&Entry { position: p, normal: n, view, thickness, eta });
                let absorption = input.texel3_here(bindings.texture(7));
                let left = v3(
                    beer_lambert(absorption.x, exit.length),
                    beer_lambert(absorption.y, exit.length),
                    beer_lambert(absorption.z, exit.length),
                );
                let reflected = fresnel_reflectance_by(-n.dot(view), eta);
                let behind = scene.radiance(exit.position, exit.direction, is_glass);
                let through = behind.hadamard(left) * (exit.share * (one - reflected));
                radiance = V3::select(is_glass, mirrored * reflected + through, radiance);
            }
        }
        output.color[0] = v4(radiance.x, radiance.y, radiance.z, one);
    }
}

/// All that a ray can meet.
struct Surroundings<'a> {
    environment: &'a EnvironmentUniform,
    /// Receivers in the picture.
    near: SeenReceivers<'a>,
    /// Receivers in the wider view.
    wide: SeenReceivers<'a>,
}

impl<'a> Surroundings<'a> {
    #[inline(always)]
    fn of(bindings: &'a Bindings<'_>) -> Self {
        let seen = |camera, first| SeenReceivers {
            camera: bindings.uniform(camera),
            position: bindings.texture(first),
            normal: bindings.texture(first + 1),
            radiance: bindings.texture(first + 2),
        };
        Self { environment: bindings.uniform(1), near: seen(0, 8), wide: seen(11, 12) }
    }

    /// Radiance that arrives along rays, for the lanes of `wanted`.
    #[inline(always)]
    fn radiance<L: Lanes>(&self, origin: V3<L>, direction: V3<L>, wanted: L::Mask) -> V3<L> {
        let near = self.near.search(origin, direction, wanted);
        let rest = wanted & !near.exists;
        if none(rest) {
            return near.radiance;
        }
        let wide = self.wide.search(origin, direction, rest);
        V3::select(near.exists, near.radiance, V3::select(wide.exists, wide.radiance, self.environment.sky(direction)))
    }
}
