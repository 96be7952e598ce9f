//! Photons as additive splats in the caustic map: what all kinds of splats share, and round ones.
//!
//! A splat adds a photon's flux to the texels around the place where it lies, in shares that add up to 1. A texel then holds flux, W, and in its fourth
//! channel a number of photons. Round splats are Gaussians with a standard deviation of a fifth of their diameter, cut at their diameter along both
//! axes; their shares are divided by the sum over the texels that they cover, so that a splat brings its whole flux wherever it lies between texels
//! (decision E5). The paper divides by the integral, `2πσ²`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use nephroid_math::float::exp;
use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V2, V3, V4, v2, v3, v4};
use nephroid_pipeline::sampler::load;
use nephroid_pipeline::shader::{
    Axis, Interpolation, Program, Separable, SeparableShader, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};

use super::exact::PhotonRecord;
use super::photons::Fate;
use crate::passes::light_view::TexelView;

/// Largest diameter of a splat, in texels.
pub const MOST_DIAMETER_TX: f32 = 63.0;

/// Least diameter, in texels: the smallest size of the paper. In focus, eq. 7 gives 0.
pub const LEAST_DIAMETER_TX: f32 = 3.0;

/// Amount by which a sprite is larger than its splat, in texels, so that snapping its place cuts nothing off.
pub const SPRITE_MARGIN_TX: f32 = 0.04;

/// Farthest distance of a photon from the plane of the receiver that the map has there, in texels.
const OFF_TX: f32 = 2.0;

/// `1/(2σ²)` times the squared diameter, for σ of a fifth of the diameter.
pub const FALLOFF: f32 = 12.5;

/// Numbers of splats.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SplatsUniform {
    /// x: diameter, in texels where it is fixed, else in diameters of the photon's beam. y: columns of photons in textures. z: distance between photons
    /// of light that is neither gathered nor spread, in texels. w: share of the map that these photons make.
    pub shape: Vec4,
}

/// Where photons are read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Textures of the pass `photons`: one photon for each texel.
    Textures,
    /// Records in a buffer, see [`PhotonRecord`].
    Records,
}

impl Source {
    /// Bindings: map's view, numbers; map's receivers' position, normal; photons' position, direction, flux, or records.
    #[must_use]
    pub fn bindings(self) -> Vec<BindingKind> {
        let uniforms = [BindingKind::Uniform(size_of::<TexelView>()), BindingKind::Uniform(size_of::<SplatsUniform>())];
        let photons = match self {
            Self::Textures => vec![BindingKind::Texture; 3],
            Self::Records => vec![BindingKind::Storage(size_of::<PhotonRecord>())],
        };
        uniforms.into_iter().chain([BindingKind::Texture; 2]).chain(photons).collect()
    }
}

/// The sources of a splat program in WGSL: the parts that all share, those of its photons, and its own.
macro_rules! splat_wgsl {
    ($source:expr, $($own:literal),+) => {
        match $source {
            $crate::splatting::splats::Source::Textures => concat!(
                include_str!("../passes/light_view.wgsl"),
                include_str!("../passes/texel_or_zero.wgsl"),
                include_str!("splats.wgsl"),
                include_str!("photon_textures.wgsl"),
                $(include_str!($own)),+
            ),
            $crate::splatting::splats::Source::Records => concat!(
                include_str!("../passes/light_view.wgsl"),
                include_str!("../passes/texel_or_zero.wgsl"),
                include_str!("splats.wgsl"),
                include_str!("photon_records.wgsl"),
                $(include_str!($own)),+
            ),
        }
    };
}
pub(super) use splat_wgsl;

/// A photon, as a vertex shader reads it.
pub(super) struct Photon<L: Lanes> {
    /// Its column and row, in textures.
    pub texel: V2<L>,
    /// Position, m.
    pub position: V3<L>,
    /// Normal of its receiver.
    pub normal: V3<L>,
    /// Where it lies in the map, in texels.
    pub at: V2<L>,
    /// Whether it lies on a receiver, and on the side of it that the map shows.
    pub landed: L::Mask,
    /// Its flux, W, linear RGB.
    pub flux: V3<L>,
    /// Diameter of its beam, in texels.
    pub beam: L,
}

/// The photon of each lane's vertex.
#[inline(always)]
pub(super) fn photon<L: Lanes>(source: Source, bindings: &Bindings<'_>, input: &VertexInput<'_, L>) -> Photon<L> {
    let map: &TexelView = bindings.uniform(0);
    let zero = L::splat(input.token, 0.0);
    let (texel, position, ray, flux, width, exists) = match source {
        Source::Textures => {
            let columns = bindings.uniform::<SplatsUniform>(1).shape.y as u32;
            let texel = v2(input.per_vertex(|i| (i % columns) as f32), input.per_vertex(|i| (i / columns) as f32));
            let position: V4<L> = load(bindings.texture(4), texel.x, texel.y, 0, 0);
            let exists = position.w.equals(zero.like(Fate::Landed as u8 as f32));
            if !exists.any() {
                // Most texels have no photon: nothing more is read for sixteen of them.
                let none = v3(zero, zero, zero);
                return Photon { texel, position: none, normal: none, at: v2(zero, zero), landed: exists, flux: none, beam: zero };
            }
            let ray = load(bindings.texture(5), texel.x, texel.y, 0, 0);
            let flux = load(bindings.texture(6), texel.x, texel.y, 0, 0).xyz();
            (texel, position.xyz(), ray.xyz(), flux, ray.w, exists)
        }
        Source::Records => {
            let records: &[PhotonRecord] = bindings.storage(4);
            let position = input.per_vertex4(|i| records[i as usize].position_ws.to_array());
            let ray = input.per_vertex4(|i| records[i as usize].direction_ws.to_array()).xyz();
            let flux = input.per_vertex4(|i| records[i as usize].flux.to_array()).xyz();
            (v2(zero, zero), position.xyz(), ray, flux, position.w, zero.equals(zero))
        }
    };
    let at = map.texel_at(position);
    let (x, y) = (at.x.floor(), at.y.floor());
    let there: V4<L> = load(bindings.texture(2), x, y, 0, 0);
    let normal = load(bindings.texture(3), x, y, 0, 0).xyz();
    let off = (position - there.xyz()).dot(normal).abs();
    let width_tx = map.area_at(position).sqrt();
    let landed = exists & there.w.equals(zero.like(1.0)) & off.le(width_tx * OFF_TX) & ray.dot(normal).lt(zero);
    Photon {
        texel,
        position,
        normal,
        at: V2::select(landed, at, v2(zero, zero)),
        landed,
        flux: flux * zero.like(bindings.uniform::<SplatsUniform>(1).shape.w),
        beam: width / width_tx,
    }
}

/// Clip-space position of a splat; outside of the view volume for photons that lie on no receiver.
#[inline(always)]
pub(super) fn sprite<L: Lanes>(bindings: &Bindings<'_>, photon: &Photon<L>) -> V4<L> {
    let size = bindings.uniform::<TexelView>(0).size_tx;
    let depth = L::select(photon.landed, photon.beam.like(0.5), photon.beam.like(2.0));
    v4(photon.at.x * (2.0 * size.z) - 1.0, -(photon.at.y * (2.0 * size.w)) + 1.0, depth, depth.like(1.0))
}

/// Zeros in the first `count` varyings of photons that lie on no receiver, and a point of one pixel: what they have computed means nothing.
#[inline(always)]
pub(super) fn clear_others<L: Lanes>(photon: &Photon<L>, count: usize, output: &mut VertexOutput<L>) {
    let zero = photon.beam.like(0.0);
    for varying in &mut output.varyings[..count] {
        *varying = L::select(photon.landed, *varying, zero);
    }
    output.point_size = L::select(photon.landed, output.point_size, zero.like(1.0));
}

/// Sum of a Gaussian over the texel centres within `radius` of `at` along an axis.
#[inline(always)]
pub(super) fn sampled_sum<L: Lanes>(at: L, radius: L, falloff: L) -> L {
    let first = (at - radius).floor() + 0.5;
    let mut sum = at.like(0.0);
    for k in 0..=MOST_DIAMETER_TX as u32 + 1 {
        let centre = first + k as f32;
        if !centre.lt(at + radius).any() {
            break;
        }
        sum = sum + bell(centre - at, radius, falloff);
    }
    sum
}

/// The Gaussian `e^(−falloff·t²)` for `|t| < radius`, else 0.
#[inline(always)]
pub(super) fn bell<L: Lanes>(t: L, radius: L, falloff: L) -> L {
    L::select(t.abs().lt(radius), exp(-(t * t * falloff)), t.like(0.0))
}

/// The program of round splats: of one size, or as wide as their photons' beams. `by_integral`: shares are divided by the integral.
#[must_use]
pub fn round(source: Source, by_beam: bool, by_integral: bool) -> Arc<Program> {
    let varying = |name| Varying { name, components: 4, interpolation: Interpolation::Flat };
    let flag = |name, value: bool| (name, f64::from(u8::from(value)));
    Arc::new(Program {
        varyings: vec![varying("kernel"), varying("flux")],
        bindings: source.bindings(),
        wgsl: Some(splat_wgsl!(source, "round.wgsl")),
        wgsl_constants: vec![flag("by_beam", by_beam), flag("by_integral", by_integral)],
        ..match source {
            Source::Textures => Program::new("round_splats", Vertex { source, by_beam, by_integral }, Separable(Fragment)),
            Source::Records => Program::new("round_splats_of_records", Vertex { source, by_beam, by_integral }, Separable(Fragment)),
        }
    })
}

struct Vertex {
    source: Source,
    by_beam: bool,
    by_integral: bool,
}

impl VertexShader for Vertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let photon = photon(self.source, bindings, input);
        output.position = sprite(bindings, &photon);
        if !photon.landed.any() {
            clear_others(&photon, 8, output);
            return;
        }
        let wanted = photon.beam.like(bindings.uniform::<SplatsUniform>(1).shape.x);
        let wanted = if self.by_beam { photon.beam * wanted } else { wanted };
        let diameter = Lanes::clamp(wanted, LEAST_DIAMETER_TX, MOST_DIAMETER_TX);
        let radius = diameter * 0.5;
        let falloff = diameter.like(FALLOFF) / (diameter * diameter);
        let share = if self.by_integral {
            falloff * std::f32::consts::FRAC_1_PI
        } else {
            falloff.like(1.0) / (sampled_sum(photon.at.x, radius, falloff) * sampled_sum(photon.at.y, radius, falloff))
        };
        output.point_size = diameter + SPRITE_MARGIN_TX;
        output.varyings[0] = photon.at.x;
        output.varyings[1] = photon.at.y;
        output.varyings[2] = radius;
        output.varyings[3] = falloff;
        output.set3(4, photon.flux * share);
        output.varyings[7] = share;
        clear_others(&photon, 8, output);
    }
}

struct Fragment;

impl SeparableShader for Fragment {
    const TARGETS: usize = 1;

    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; 8]) {
        let bell = bell(at - flat[axis as usize], at.like(flat[2]), at.like(flat[3]));
        values[0] = match axis {
            Axis::X => v4(bell * flat[4], bell * flat[5], bell * flat[6], bell * flat[7]),
            Axis::Y => v4(bell, bell, bell, bell),
        };
    }
}
