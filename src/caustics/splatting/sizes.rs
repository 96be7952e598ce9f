//! Method A: splats of four sizes at once, of which each texel of the map takes one or a blend of two, by the number of photons near it [WD06 §4.1].
//!
//! Each photon is one sprite that adds a Gaussian of every size, and in another target a 1 for every size whose splat covers the texel. `resolve` picks:
//! from the largest size down, a smaller one takes over as the number of photons under it rises from 8 to 16. In between both are blended, smoothly,
//! and only where the smaller one is brighter; with [`Blend::Linear`] the blend is linear and everywhere, which makes rings (Figure 5).

use std::sync::Arc;

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V3, V4, v3, v4};
use nephroid_pipeline::shader::{
    Axis, FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Separable, SeparableShader, Varying, VertexInput,
    VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};

use super::settings::Blend;
use super::splats::{
    FALLOFF, LEAST_DIAMETER_TX, MOST_DIAMETER_TX, SPRITE_MARGIN_TX, Source, SplatsUniform, bell, clear_others, photon, sampled_sum,
    splat_wgsl, sprite,
};
use crate::passes::fullscreen::FullscreenVertex;

/// Diameters, in distances between photons.
const DIAMETERS: [f32; 4] = [3.0, 7.0, 11.0, 15.0];

/// Numbers of photons between which a smaller size takes over.
const PHOTONS: [f32; 2] = [8.0, 16.0];

/// The program of the splats. Targets: flux of each size, summed over RGB, or in three targets for red, green and blue with `colours`; then the number
/// of photons under each size.
#[must_use]
pub fn program(source: Source, colours: bool, by_integral: bool) -> Arc<Program> {
    let varying = |name| Varying { name, components: 4, interpolation: Interpolation::Flat };
    let vertex = Vertex { source, by_integral };
    let base = match (colours, source) {
        (false, Source::Textures) => Program::new("grey_splats", vertex, Separable(Grey)),
        (false, Source::Records) => Program::new("grey_splats_of_records", vertex, Separable(Grey)),
        (true, Source::Textures) => Program::new("colour_splats", vertex, Separable(Colours)),
        (true, Source::Records) => Program::new("colour_splats_of_records", vertex, Separable(Colours)),
    };
    let wgsl = if colours {
        splat_wgsl!(source, "sizes.wgsl", "sizes_colours.wgsl")
    } else {
        splat_wgsl!(source, "sizes.wgsl", "sizes_grey.wgsl")
    };
    Arc::new(Program {
        varyings: vec![varying("place"), varying("shares"), varying("flux")],
        bindings: source.bindings(),
        wgsl: Some(wgsl),
        wgsl_constants: vec![("by_integral", f64::from(u8::from(by_integral)))],
        ..base
    })
}

struct Vertex {
    source: Source,
    by_integral: bool,
}

/// Radius of a size in texels, for a distance between photons.
#[inline(always)]
fn radius<L: Lanes>(size: usize, distance: L) -> L {
    Lanes::clamp(distance * DIAMETERS[size], LEAST_DIAMETER_TX, MOST_DIAMETER_TX) * 0.5
}

/// `1/(2σ²)` of a radius.
#[inline(always)]
fn falloff<L: Lanes>(radius: L) -> L {
    radius.like(0.25 * FALLOFF) / (radius * radius)
}

impl VertexShader for Vertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let photon = photon(self.source, bindings, input);
        output.position = sprite(bindings, &photon);
        if !photon.landed.any() {
            clear_others(&photon, 12, output);
            return;
        }
        let distance = photon.beam.like(bindings.uniform::<SplatsUniform>(1).shape.z);
        output.varyings[0] = photon.at.x;
        output.varyings[1] = photon.at.y;
        output.varyings[2] = distance;
        output.varyings[3] = distance.like(0.0);
        for size in 0..4 {
            let radius = radius(size, distance);
            let falloff = falloff(radius);
            output.varyings[4 + size] = if self.by_integral {
                falloff * std::f32::consts::FRAC_1_PI
            } else {
                falloff.like(1.0) / (sampled_sum(photon.at.x, radius, falloff) * sampled_sum(photon.at.y, radius, falloff))
            };
        }
        output.point_size = radius(3, distance) * 2.0 + SPRITE_MARGIN_TX;
        output.set3(8, photon.flux);
        output.varyings[11] = photon.flux.x + photon.flux.y + photon.flux.z;
        clear_others(&photon, 12, output);
    }
}

/// Gaussian of every size, and 1 where the texel is under it.
#[inline(always)]
fn bells<L: Lanes>(flat: &[f32], axis: Axis, at: L) -> (V4<L>, V4<L>) {
    let t = at - flat[axis as usize];
    let (zero, one) = (t.like(0.0), t.like(1.0));
    let (mut bells, mut inside) = ([zero; 4], [zero; 4]);
    for size in 0..4 {
        let radius = radius(size, t.like(flat[2]));
        let share = if axis == Axis::X { flat[4 + size] } else { 1.0 };
        bells[size] = bell(t, radius, falloff(radius)) * share;
        inside[size] = L::select(t.abs().lt(radius), one, zero);
    }
    (v4(bells[0], bells[1], bells[2], bells[3]), v4(inside[0], inside[1], inside[2], inside[3]))
}

struct Grey;

impl SeparableShader for Grey {
    const TARGETS: usize = 2;

    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; 8]) {
        let (bells, inside) = bells(flat, axis, at);
        values[0] = bells * at.like(if axis == Axis::X { flat[11] } else { 1.0 });
        values[1] = inside;
    }
}

struct Colours;

impl SeparableShader for Colours {
    const TARGETS: usize = 4;

    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; 8]) {
        let (bells, inside) = bells(flat, axis, at);
        for channel in 0..3 {
            values[channel] = bells * at.like(if axis == Axis::X { flat[8 + channel] } else { 1.0 });
        }
        values[3] = inside;
    }
}

/// Bindings of `resolve`: colour of grey flux; red or all flux, counts; with colours, green and blue.
#[must_use]
pub fn resolve_bindings(colours: bool) -> Vec<BindingKind> {
    let textures = if colours { 4 } else { 2 };
    std::iter::once(BindingKind::Uniform(16)).chain(std::iter::repeat_n(BindingKind::Texture, textures)).collect()
}

/// The program that picks a size for each texel. Target: flux, W, linear RGB; w is the number of photons under the smallest size.
#[must_use]
pub fn resolve(colours: bool, blend: Blend) -> Arc<Program> {
    let wgsl = if colours {
        concat!(include_str!("../passes/fullscreen.wgsl"), include_str!("resolve.wgsl"), include_str!("resolve_colours.wgsl"))
    } else {
        concat!(include_str!("../passes/fullscreen.wgsl"), include_str!("resolve.wgsl"), include_str!("resolve_grey.wgsl"))
    };
    let linear = blend == Blend::Linear;
    let name = if colours { "resolve_colours" } else { "resolve_grey" };
    Arc::new(Program {
        bindings: resolve_bindings(colours),
        wgsl: Some(wgsl),
        wgsl_constants: vec![("linear", f64::from(u8::from(linear)))],
        ..Program::new(name, FullscreenVertex, Resolve { colours, linear })
    })
}

struct Resolve {
    colours: bool,
    linear: bool,
}

impl Resolve {
    /// Picks from flux of four sizes, smallest first, by the counts under them. `brightness`: what decides whether a smaller size is brighter.
    #[inline(always)]
    fn pick<L: Lanes>(&self, flux: [V3<L>; 4], brightness: V4<L>, counts: V4<L>) -> V3<L> {
        let (zero, one) = (counts.x.like(0.0), counts.x.like(1.0));
        let brightness = [brightness.x, brightness.y, brightness.z, brightness.w];
        let counts = [counts.x, counts.y, counts.z, counts.w];
        let (mut picked, mut bright) = (flux[3], brightness[3]);
        for size in [2, 1, 0] {
            let share = Lanes::clamp((counts[size] - PHOTONS[0]) / (PHOTONS[1] - PHOTONS[0]), 0.0, 1.0);
            let weight = if self.linear {
                share
            } else {
                // The cubic Bernstein polynomials of coefficients 0, 0, 1, 1.
                let smooth = share * share * (share * -2.0 + 3.0);
                L::select(brightness[size].gt(bright) | share.ge(one), smooth, zero)
            };
            picked = picked.lerp(flux[size], weight);
            bright = bright * (one - weight) + brightness[size] * weight;
        }
        picked
    }
}

impl FragmentShader for Resolve {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let colour: &[f32; 4] = bindings.uniform(0);
        let counts = texel4(input, bindings, 2);
        let first = texel4(input, bindings, 1);
        let (flux, brightness) = if self.colours {
            let (green, blue) = (texel4(input, bindings, 3), texel4(input, bindings, 4));
            let sizes =
                [v3(first.x, green.x, blue.x), v3(first.y, green.y, blue.y), v3(first.z, green.z, blue.z), v3(first.w, green.w, blue.w)];
            (sizes, first + green + blue)
        } else {
            let tint = v3(first.x.like(colour[0]), first.x.like(colour[1]), first.x.like(colour[2]));
            ([tint * first.x, tint * first.y, tint * first.z, tint * first.w], first)
        };
        let picked = self.pick(flux, brightness, counts);
        output.color[0] = v4(picked.x, picked.y, picked.z, counts.x);
    }
}

#[inline(always)]
fn texel4<L: Lanes>(input: &FragmentInput<'_, L>, bindings: &Bindings<'_>, binding: usize) -> V4<L> {
    let texture = bindings.texture(binding);
    v4(input.texel_here(texture, 0), input.texel_here(texture, 1), input.texel_here(texture, 2), input.texel_here(texture, 3))
}
