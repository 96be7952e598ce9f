//! Direct light of one light, for every pixel: irradiance on the light's side of the water, and whether light through flat water reaches a point beyond.
//!
//! Light in the water also shines on dry things beside it that no water is above: water has a surface and no sides, so light that leaves its rectangle below
//! the surface goes on straight. The way from the light to a dry point goes through the surface if it is under water where it comes to the rectangle, or
//! starts there, and above the surface where it leaves the rectangle or ends ([`passes_surface`]).
//!
//! Targets: `direct` (W/m², summed over lights), `visibility` (share of the light that passes the surface and reaches the point, 0..=1; 0 on the light's
//! side).

use std::sync::Arc;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V3, v3, v4};
use nephroid_pipeline::sampler::sample_compare;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings, TextureView};

use super::camera::CameraUniform;
use super::fullscreen::FullscreenVertex;
use super::shadow_map::LightUniform;

/// Bindings: light, position, normal, albedo, map of straight rays, map through the surface, comparison sampler, camera, heights of the water's surface.
pub const BINDINGS: [BindingKind; 9] = [
    BindingKind::Uniform(size_of::<LightUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::DepthTexture,
    BindingKind::DepthTexture,
    BindingKind::ComparisonSampler,
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Texture,
];

/// Which objects cast shadows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shadows {
    /// Those on the light's side of the water.
    pub straight: bool,
    /// Those beyond its surface.
    pub refracted: bool,
}

/// The program. Without shadows every point is lit.
#[must_use]
pub fn program(shadows: Shadows) -> Arc<Program> {
    let flag = |on| f64::from(u8::from(on));
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("../../math/optics.wgsl"),
            include_str!("fullscreen.wgsl"),
            include_str!("shadow_map.wgsl"),
            include_str!("camera.wgsl"),
            include_str!("under_water.wgsl"),
            include_str!("light.wgsl")
        )),
        wgsl_constants: vec![("straight_shadows", flag(shadows.straight)), ("refracted_shadows", flag(shadows.refracted))],
        ..Program::new("light", FullscreenVertex, Fragment { shadows })
    })
}

struct Fragment {
    shadows: Shadows,
}

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let light: &LightUniform = bindings.uniform(0);
        let (position, normal, albedo) = (bindings.texture(1), bindings.texture(2), bindings.texture(3));
        let (straight_map, refracted_map) = (bindings.texture(4), bindings.texture(5));
        let p: V3<L> = input.texel3_here(position);
        let n = input.texel3_here(normal);
        let (zero, one) = (p.x.like(0.0), p.x.like(1.0));
        let exists = input.texel_here(position, 3).gt(zero);
        let wet = input.texel_here(albedo, 3).gt(zero);
        let beyond = exists & if light.water.x > 0.0 { wet } else { !wet };
        let mut near = exists & !beyond;
        if light.water.x < 0.0 && beyond.any() {
            near = near | (beyond & !passes_surface(light, bindings.uniform(7), bindings.texture(8), p));
        }
        let sampler = bindings.sampler(6);

        let mut direct = v3(zero, zero, zero);
        if near.any() {
            let incident = light.at(p);
            let off = p + n * light.straight_texel(p, straight_map.level_size(0).0);
            let cos = Lanes::max(-n.dot(incident.direction), zero);
            let mut lit = one;
            if self.shadows.straight {
                // The depth is that of a point off the surface, so that the surface does not shadow itself, at the place of the point itself: seen from a lamp,
                // the point off it lies further out on all sides, and shadows would be too small.
                let (uv, _, inside) = light.on_straight_map(p);
                let (_, depth, _) = light.on_straight_map(off);
                lit = L::select(inside, sample_compare(straight_map, &sampler, uv, 0, depth), one);
            }
            let mut arriving = incident.irradiance;
            if light.water.x < 0.0 {
                arriving = arriving.hadamard(light.kept(p));
            }
            direct = V3::select(near, arriving * (cos * lit), direct);
        }
        let mut visibility = one;
        if self.shadows.refracted && beyond.any() {
            let (uv, _) = light.on_refracted_map(p);
            let (_, depth) = light.on_refracted_map(p + n * light.refracted_texel(p, refracted_map.level_size(0).0));
            visibility = sample_compare(refracted_map, &sampler, uv, 0, depth);
        }
        let visibility = L::select(beyond, visibility, zero);
        output.color[0] = v4(direct.x, direct.y, direct.z, one);
        output.color[1] = v4(visibility, zero, zero, one);
    }
}

/// Lanes whose way from a light in the water to a dry point goes through the water's surface.
#[inline(always)]
pub fn passes_surface<L: Lanes>(light: &LightUniform, camera: &CameraUniform, heights: &TextureView<'_>, p: V3<L>) -> L::Mask {
    let at = V3::splat(p.x.token(), light.position_ws.truncate());
    let is_lamp = light.position_ws.w != 0.0;
    // From the point back to the light: to the lamp at 1, or endlessly along parallel light.
    let back = if is_lamp { at - p } else { -at };
    let e = camera.extent;
    let (mut leaves, mut comes) = (p.x.like(0.0), p.x.like(if is_lamp { 1.0 } else { f32::MAX }));
    for (start, along, low, high) in [(p.x, back.x, e.x, e.z), (p.z, back.z, e.y, e.w)] {
        // Along a side, it is always or never between both.
        let along = L::select(along.abs().lt(along.like(1.0e-9)), along.like(1.0e-9), along);
        let (a, b) = ((-start + low) / along, (-start + high) / along);
        leaves = Lanes::max(leaves, Lanes::min(a, b));
        comes = Lanes::min(comes, Lanes::max(a, b));
    }
    let passes = leaves.le(comes) & !is_wet(camera, heights, p + back * leaves);
    if is_lamp { passes } else { passes & is_wet(camera, heights, p + back * comes) }
}

/// Lanes whose place is under water, with places beside the water's rectangle moved to its side.
#[inline(always)]
fn is_wet<L: Lanes>(camera: &CameraUniform, heights: &TextureView<'_>, q: V3<L>) -> L::Mask {
    let e = camera.extent;
    camera.under_water(heights, v3(Lanes::clamp(q.x, e.x, e.z), q.y, Lanes::clamp(q.z, e.y, e.w)))
}
