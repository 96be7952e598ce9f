//! What mirrors and glass show: the receivers behind and before them, and the sky.
//!
//! A mirror shows what the mirrored view ray meets. Glass shows that by the share of Fresnel's law, and for the rest what the parts of the ray meet that have
//! passed its body ([`Faces`]), attenuated on the way inside by the Beer-Lambert law. Receivers are searched first in the picture, then in a wider view of the
//! surroundings ([`SeenReceivers`]); a ray that finds none shows the sky.
//!
//! Target: `glass` (W/(m² sr)), the radiance of the surface that each pixel shows: for receivers, that of the pass `shade`. w is 1, or 2 where a ray passes
//! behind a receiver and then meets none: what it meets may be hidden, and the renderer counts such samples (`eye_searches_unconverged`). Each ray meets mirrors and glass
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
use super::glass_body::{Entry, Exit, Faces};
use super::receiver_search::{ReceiverBounds, SeenReceivers};

/// Bindings: camera; environment; position, normal and albedo of the nearest surfaces; the same of back faces of glass, whose albedo is the absorption
/// coefficient; position, normal and radiance of the receivers; a wider camera, and what it sees of the receivers; bounds of the receivers.
pub const BINDINGS: [BindingKind; 16] = [
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
    BindingKind::Uniform(size_of::<ReceiverBounds>()),
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
            include_str!("texel_or_zero.wgsl"),
            include_str!("receiver_search.wgsl"),
            include_str!("glass_body.wgsl"),
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
        let mut doubtful = kind.lt(kind);
        if (is_mirror | is_glass).any() {
            let scene = Surroundings::of(bindings);
            let p: V3<L> = input.texel3_here(bindings.texture(2));
            let n = input.texel3_here(bindings.texture(3));
            let view = scene.near.camera.view_direction(p);
            let mirrored = Ray { origin: p, direction: reflect(view, n), share: input.texel3_here(bindings.texture(4)) };
            let mut rays = [mirrored; 3];
            if is_glass.any() {
                let body = Body::of(bindings, input, p);
                rays = body.rays(&Entry { position: p, normal: n, view, thickness: body.thickness, eta: body.eta }, mirrored);
                rays[0].share = V3::select(is_mirror, mirrored.share, rays[0].share);
            }
            let none = v3(one.like(0.0), one.like(0.0), one.like(0.0));
            radiance = V3::select(is_mirror | is_glass, none, radiance);
            for (number, ray) in rays.iter().enumerate() {
                // A mirror shows the first ray alone.
                let wanted = if number == 0 { is_mirror | is_glass } else { is_glass };
                let wanted = wanted & ray.share.dot(ray.share).gt(one.like(0.0));
                let (arriving, doubt) = scene.radiance(ray, wanted);
                radiance = radiance + V3::select(wanted, arriving.hadamard(ray.share), none);
                doubtful = doubtful | doubt;
            }
        }
        output.color[0] = v4(radiance.x, radiance.y, radiance.z, L::select(doubtful, one + one, one));
    }
}

/// A part of a view ray after mirrors and glass.
#[derive(Clone, Copy)]
struct Ray<L> {
    origin: V3<L>,
    /// Unit vector, away from the eye.
    direction: V3<L>,
    /// Share of the radiance along the ray that reaches the eye.
    share: V3<L>,
}

/// The body of glass that a pixel shows.
struct Body<'a, L> {
    faces: Faces<'a>,
    /// Absorption coefficient, 1/m.
    absorption: V3<L>,
    /// Distance from the front face to the back face along the view ray, m.
    thickness: L,
    /// Refractive index outside over the one inside.
    eta: L,
}

impl<'a, L: Lanes> Body<'a, L> {
    #[inline(always)]
    fn of(bindings: &'a Bindings<'_>, input: &FragmentInput<'_, L>, front: V3<L>) -> Self {
        let camera: &CameraUniform = bindings.uniform(0);
        let environment: &EnvironmentUniform = bindings.uniform(1);
        let (zero, one) = (front.x.like(0.0), front.x.like(1.0));
        let outside = L::select(input.texel_here(bindings.texture(4), 3).gt(zero), one.like(environment.inscatter.w), one);
        let back = input.texel3_here(bindings.texture(5));
        let has_back = input.texel_here(bindings.texture(5), 3).gt(zero);
        Self {
            faces: Faces {
                camera,
                front: bindings.texture(2),
                front_normal: bindings.texture(3),
                back: bindings.texture(5),
                back_normal: bindings.texture(6),
            },
            absorption: input.texel3_here(bindings.texture(7)),
            thickness: L::select(has_back, (back - front).length(), zero),
            eta: outside / Lanes::max(input.texel_here(bindings.texture(3), 3), one),
        }
    }

    /// The mirrored ray with its share, and the two parts of the other one.
    #[inline(always)]
    fn rays(&self, entry: &Entry<L>, mirrored: Ray<L>) -> [Ray<L>; 3] {
        let reflected = fresnel_reflectance_by(-entry.normal.dot(entry.view), entry.eta);
        let [first, second] = self.faces.pass(entry);
        let enters = reflected.like(1.0) - reflected;
        [Ray { share: mirrored.share * reflected, ..mirrored }, self.ray(&first, enters), self.ray(&second, enters)]
    }

    #[inline(always)]
    fn ray(&self, exit: &Exit<L>, enters: L) -> Ray<L> {
        let left = v3(
            beer_lambert(self.absorption.x, exit.length),
            beer_lambert(self.absorption.y, exit.length),
            beer_lambert(self.absorption.z, exit.length),
        );
        Ray { origin: exit.position, direction: exit.direction, share: left * (exit.share * enters) }
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
            bounds: bindings.uniform(15),
            position: bindings.texture(first),
            normal: bindings.texture(first + 1),
            radiance: bindings.texture(first + 2),
        };
        Self { environment: bindings.uniform(1), near: seen(0, 8), wide: seen(11, 12) }
    }

    /// Radiance that arrives along rays, for the lanes of `wanted`; and the lanes of which it is not known whether they meet a receiver.
    #[inline(always)]
    fn radiance<L: Lanes>(&self, ray: &Ray<L>, wanted: L::Mask) -> (V3<L>, L::Mask) {
        let mut radiance = self.environment.sky(ray.direction);
        let (mut rest, mut doubtful) = (wanted, ray.origin.x.lt(ray.origin.x));
        for receivers in [&self.near, &self.wide] {
            let found = receivers.search(ray.origin, ray.direction, rest);
            radiance = V3::select(found.exists, found.radiance, radiance);
            rest = rest & !found.exists;
            doubtful = doubtful | found.doubtful;
        }
        (radiance, doubtful & rest)
    }
}
