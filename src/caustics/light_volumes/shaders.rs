//! The programs: beams swept through the slicing planes, counted in the stencil, then drawn with the light they carry [BO §3.2].
//!
//! A vertex program makes the corners of every beam from one array of dummy vertices; the beam is in its uniforms. Counting and drawing run the
//! same program, so that their vertices are the same to the last bit on any driver; where beams are counted its colours are masked.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use crate::beams::Beam;
use crate::passes::camera::CameraUniform;
use crate::passes::fullscreen::FullscreenVertex;
use crate::passes::shadow_map::LightUniform;
use nephroid_math::lanes::Lanes;
use nephroid_math::optics::beer_lambert_rgb;
use nephroid_math::vector::{V2, V3, V4, v2, v3, v4};
use nephroid_pipeline::sampler::sample_compare;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};
use nephroid_scene::Radiometry;

use super::settings::{EnergyAt, Gather};
use super::slices::SliceVertex;

/// What all beams of a light have in common.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BeamsUniform {
    /// Extinction coefficient, 1/m; 0 in paper radiometry. w is 1 if what is under water hides things from others.
    pub sigma_t: Vec4,
    /// Mean level of the water, distance of two planes, number of slabs; 1 if vertices are looked up in the shadow map.
    pub planes: Vec4,
}

/// A beam as its draws find it: dynamic offsets are multiples of 256 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BeamSlot {
    /// The beam.
    pub beam: Beam,
    padding: [Vec4; 9],
}

impl BeamSlot {
    /// A beam in its slot.
    #[must_use]
    pub fn new(beam: Beam) -> Self {
        Self { beam, padding: [Vec4::ZERO; 9] }
    }
}

/// The light of a [`Relight`] pass.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RelightUniform {
    /// Towards the light under still water: a unit vector (paper), or per unit of height (physical). w is 1 for vectors, 0 for intensities.
    pub to_light: Vec4,
}

/// Bindings of the beams' programs: camera, beams, light, slices, the beam, shadow map, comparison sampler, position, normal, visibility.
pub const BINDINGS: [BindingKind; 10] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<BeamsUniform>()),
    BindingKind::Uniform(size_of::<LightUniform>()),
    BindingKind::Storage(size_of::<SliceVertex>()),
    BindingKind::DynamicUniform(size_of::<Beam>()),
    BindingKind::Texture,
    BindingKind::Sampler,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// Bindings of the relighting program: light, normal, position, three sums.
pub const RELIGHT_BINDINGS: [BindingKind; 6] = [
    BindingKind::Uniform(size_of::<RelightUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// Smallest cross-section that light is spread over, as a share of the generator: keeps a focus finite [decision E4].
const SMALLEST_SECTION: f32 = 1.0e-7;

/// The program that counts and draws beams.
///
/// Targets: irradiance, or the sum of intensities, or that of vectors by red, green and blue light (three targets); then the sum of irradiance
/// times direction, and the number of beams.
#[must_use]
pub fn beam_program(radiometry: Radiometry, gather: Gather, energy: EnergyAt) -> Arc<Program> {
    let varying = |name, interpolation| Varying { name, components: 3, interpolation };
    let paper = radiometry == Radiometry::Paper;
    let flag = |on| f64::from(u8::from(on));
    let constants = vec![("paper", flag(paper)), ("gather", f64::from(gather as u8))];
    let shared = BINDINGS.to_vec();
    Arc::new(match energy {
        EnergyAt::Face => Program {
            bindings: shared,
            varyings: vec![varying("intensity", Interpolation::Perspective), varying("ray", Interpolation::Perspective)],
            wgsl: Some(concat!(
                include_str!("../../math/optics.wgsl"),
                include_str!("../passes/camera.wgsl"),
                include_str!("../passes/shadow_map.wgsl"),
                include_str!("beam.wgsl"),
                include_str!("lit.wgsl"),
                include_str!("targets.wgsl"),
                include_str!("face.wgsl")
            )),
            wgsl_constants: constants,
            ..Program::new("light_volume_face", FaceVertex, FaceFragment { paper, gather })
        },
        EnergyAt::Receiver => Program {
            bindings: shared,
            varyings: vec![varying("lit", Interpolation::Flat)],
            wgsl: Some(concat!(
                include_str!("../../math/optics.wgsl"),
                include_str!("../passes/camera.wgsl"),
                include_str!("../passes/shadow_map.wgsl"),
                include_str!("beam.wgsl"),
                include_str!("lit.wgsl"),
                include_str!("targets.wgsl"),
                include_str!("receiver.wgsl")
            )),
            wgsl_constants: constants,
            ..Program::new("light_volume_receiver", ReceiverVertex, ReceiverFragment { paper, gather })
        },
    })
}

/// The program that turns sums of intensities or vectors into irradiance.
#[must_use]
pub fn relight_program() -> Arc<Program> {
    Arc::new(Program {
        bindings: RELIGHT_BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("../passes/fullscreen.wgsl"), include_str!("relight.wgsl"))),
        ..Program::new("light_volume_relight", FullscreenVertex, Relight)
    })
}

/// Corners of a beam's cross-sections, one per lane.
struct Corner<L> {
    /// World space, m.
    position: V3<L>,
    /// Which of the three it is.
    number: L,
    /// Ray per metre of depth: x, length, z; and the share of transmittance.
    ray: [L; 4],
    /// Height of the surface there, less that of the plane: 0 on the surface.
    depth: L,
}

/// Where the dummy vertices of some lanes are: on the ray of their corner, at their plane, but never above the surface.
#[inline(always)]
fn corner<L: Lanes>(bindings: &Bindings<'_>, input: &VertexInput<'_, L>) -> Corner<L> {
    let slices: &[SliceVertex] = bindings.storage(3);
    let beam: &Beam = bindings.uniform(4);
    let slice = input.per_vertex4(|i| slices.get(i as usize).map_or([0.0; 4], |s| [s.plane_y, s.corner, 0.0, 0.0]));
    let of = |v: &[Vec4; 3], i: u32| slices.get(i as usize).map_or([0.0; 4], |s| v[s.corner as usize].to_array());
    let g = input.per_vertex4(|i| of(&beam.g, i));
    let d = input.per_vertex4(|i| of(&beam.d, i));
    let y = Lanes::min(slice.x, g.y);
    let depth = g.y - y;
    Corner { position: v3(g.x + d.x * depth, y, g.z + d.z * depth), number: slice.y, ray: [d.x, d.y, d.z, d.w], depth }
}

/// How much of the light reaches each corner of the generator.
#[inline(always)]
fn lit(bindings: &Bindings<'_>) -> [f32; 3] {
    let beams: &BeamsUniform = bindings.uniform(1);
    let mut lit = [1.0; 3];
    if beams.planes.w > 0.0 {
        let light: &LightUniform = bindings.uniform(2);
        let beam: &Beam = bindings.uniform(4);
        for (lit, g) in lit.iter_mut().zip(&beam.g) {
            let (uv, depth, inside) = light.through_air(v3(g.x, g.y, g.z));
            if inside {
                *lit = sample_compare(bindings.texture(5), &bindings.sampler(6), uv, 0, depth);
            }
        }
    }
    lit
}

struct FaceVertex;

impl VertexShader for FaceVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let beams: &BeamsUniform = bindings.uniform(1);
        let beam: &Beam = bindings.uniform(4);
        let corner = corner(bindings, input);
        output.position = camera.project(corner.position);
        let (_, double_area) = section(beam, corner.position.y);
        let area = double_area.abs() * 0.5;
        let zero = corner.depth.like(0.0);
        let lit = lit(bindings);
        let second = corner.number.equals(zero.like(1.0));
        let third = corner.number.equals(zero.like(2.0));
        let lit = L::select(third, zero.like(lit[2]), L::select(second, zero.like(lit[1]), zero.like(lit[0])));
        // I_sp = I_s·T·A_s/A_p at the corner [BO §3.1].
        let scale = lit * corner.ray[3] / spread(area, beam);
        let flux = V3::splat(input.token, beam.flux.truncate());
        let intensity = flux.hadamard(beer_lambert_rgb(beams.sigma_t.truncate(), corner.depth * corner.ray[1])) * scale;
        output.set3(0, intensity);
        output.set3(3, v3(corner.ray[0], zero.like(-1.0), corner.ray[2]));
    }
}

struct FaceFragment {
    paper: bool,
    gather: Gather,
}

impl FragmentShader for FaceFragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let shine = Shine { intensity: input.varying3(0), ray: input.varying3(3) };
        shine.write(self.paper, self.gather, bindings, input, output);
    }
}

struct ReceiverVertex;

impl VertexShader for ReceiverVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        output.position = camera.project(corner(bindings, input).position);
        let lit = lit(bindings);
        let token = input.token;
        output.set3(0, v3(L::splat(token, lit[0]), L::splat(token, lit[1]), L::splat(token, lit[2])));
    }
}

struct ReceiverFragment {
    paper: bool,
    gather: Gather,
}

impl FragmentShader for ReceiverFragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let beams: &BeamsUniform = bindings.uniform(1);
        let beam: &Beam = bindings.uniform(4);
        let lit = input.flat_varyings();
        let p: V3<L> = input.texel3_here(bindings.texture(7));
        let zero = p.x.like(0.0);
        let (corners, double_area) = section(beam, p.y);
        let area = drawn_area(beams, beam, p.y, &corners, double_area);
        // Weights of the corners; the stencil has decided what is inside, and walls cut into triangles are a little off.
        let at = v2(p.x, p.z);
        let inverse = zero.like(1.0) / double_area;
        let mut weights = [zero; 3];
        for (i, weight) in weights.iter_mut().enumerate() {
            let (a, b) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
            *weight = Lanes::clamp((b - a).perp_dot(at - a) * inverse, 0.0, 1.0);
        }
        let sum = zero.like(1.0) / Lanes::max(weights[0] + weights[1] + weights[2], zero.like(1.0e-6));
        let [b0, b1, b2] = [weights[0] * sum, weights[1] * sum, weights[2] * sum];
        let ray = v3(
            b0 * beam.d[0].x + b1 * beam.d[1].x + b2 * beam.d[2].x,
            zero.like(-1.0),
            b0 * beam.d[0].z + b1 * beam.d[1].z + b2 * beam.d[2].z,
        );
        let travelled =
            b0 * (-p.y + beam.g[0].y) * beam.d[0].y + b1 * (-p.y + beam.g[1].y) * beam.d[1].y + b2 * (-p.y + beam.g[2].y) * beam.d[2].y;
        let share = b0 * (lit[0] * beam.d[0].w) + b1 * (lit[1] * beam.d[1].w) + b2 * (lit[2] * beam.d[2].w);
        let flux = V3::splat(input.token, beam.flux.truncate());
        let left = beer_lambert_rgb(beams.sigma_t.truncate(), Lanes::max(travelled, zero));
        let shine = Shine { intensity: flux.hadamard(left) * (share / spread(area, beam)), ray };
        shine.write(self.paper, self.gather, bindings, input, output);
    }
}

/// Cross-section of a beam at some heights, x and z of its corners, and twice its signed area.
#[inline(always)]
fn section<L: Lanes>(beam: &Beam, y: L) -> ([V2<L>; 3], L) {
    let mut corners = [v2(y, y); 3];
    for (corner, (g, d)) in corners.iter_mut().zip(beam.g.iter().zip(&beam.d)) {
        let depth = -y + g.y;
        *corner = v2(depth * d.x + g.x, depth * d.z + g.z);
    }
    (corners, (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]))
}

/// Area of a beam's cross-section as the stencil counts it.
///
/// Between two planes a wall is two triangles and not the ruled surface that rays make of it. Their diagonal cuts the section in a point beside each
/// edge of the rays' triangle T, and adds the triangle δ of that edge and point if it lies outside, or takes it away. One that is
/// taken away and reaches beyond T counts there as well, since the stencil differs from its reference both ways: `|T| + |δ| − 2 |T ∩ δ|`.
/// So light is spread over what is drawn, however few planes there are. What several δ have
/// in common is left out; so the area is at least that of the signed sum, and half of T.
#[inline(always)]
fn drawn_area<L: Lanes>(beams: &BeamsUniform, beam: &Beam, y: L, corners: &[V2<L>; 3], double_area: L) -> L {
    let [level, step, slabs, _] = beams.planes.to_array();
    let slab = Lanes::clamp(((-y + level) / step).floor(), 0.0, slabs - 1.0);
    let first = slab.equals(y.like(0.0));
    let (top, bottom) = (-(slab * step) + level, -((slab + 1.0) * step) + level);
    let zero = y.like(0.0);
    let sign = L::select(double_area.lt(zero), y.like(-1.0), y.like(1.0));
    let whole = double_area.abs();
    let (mut area, mut balance) = (whole, whole);
    for i in 0..3 {
        let j = (i + 1) % 3;
        // From the top of the corner that both neighbours take for the first, to the bottom of the other.
        let (from, to) = if beam.g[i].w > 0.0 { (i, j) } else { (j, i) };
        let (gf, df, gt, dt) = (beam.g[from], beam.d[from], beam.g[to], beam.d[to]);
        let high = L::select(first, y.like(gf.y), Lanes::min(top, y.like(gf.y)));
        let low = Lanes::min(bottom, y.like(gt.y));
        let (above, below) = (-high + gf.y, -low + gt.y);
        let start = v2(above * df.x + gf.x, above * df.z + gf.z);
        let end = v2(below * dt.x + gt.x, below * dt.z + gt.z);
        let t = Lanes::clamp((high - y) / Lanes::max(high - low, y.like(1.0e-12)), 0.0, 1.0);
        let diagonal = v2((end.x - start.x) * t + start.x, (end.y - start.y) * t + start.y);
        let (pi, pj, r) = (corners[i], corners[j], corners[3 - i - j]);
        let outside = (diagonal - pi).perp_dot(pj - pi) * sign;
        // On which sides of the other two edges the point is: inside of both, beyond one, or beyond both.
        let (d, b) = ((r - pi).perp_dot(diagonal - pi) * sign, (r - pj).perp_dot(diagonal - pj) * sign);
        let taken = outside.abs();
        let beyond = L::select(b.lt(zero), whole - b, whole + d);
        let crossed = whole * taken / Lanes::max(beyond, y.like(f32::MIN_POSITIVE));
        let shared = L::select(d.le(zero) & b.ge(zero), taken, L::select(d.gt(zero) & b.lt(zero), whole, crossed));
        balance = balance + outside;
        area = area + taken - L::select(outside.lt(zero), shared * 2.0, zero);
    }
    Lanes::max(Lanes::max(area, balance.abs()), whole * 0.5) * 0.5
}

/// Area that a beam's light is spread over: never nothing.
#[inline(always)]
fn spread<L: Lanes>(area: L, beam: &Beam) -> L {
    Lanes::max(area, area.like(SMALLEST_SECTION * beam.flux.w))
}

/// Light of one beam at a pixel.
struct Shine<L> {
    /// Irradiance of a level surface (physical), or I_sp (paper), W/m².
    intensity: V3<L>,
    /// Its way, per metre of depth.
    ray: V3<L>,
}

impl<L: Lanes> Shine<L> {
    /// What is added for it; nothing where no receiver is.
    #[inline(always)]
    fn write(self, paper: bool, gather: Gather, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let zero = self.ray.x.like(0.0);
        let exists = input.texel_here(bindings.texture(7), 3).equals(zero.like(1.0));
        let beams: &BeamsUniform = bindings.uniform(1);
        let visible = if beams.sigma_t.w > 0.0 { input.texel_here(bindings.texture(9), 0) } else { zero.like(1.0) };
        let visible = L::select(exists, visible, zero);
        let intensity = self.intensity * visible;
        // Towards the light: a unit vector in the paper, and where flux is kept per unit of height, since the section is level: [decision E1].
        let unit = -self.ray.normalize();
        let to_light = if paper { unit } else { -self.ray };
        let cos = Lanes::max(input.texel3_here(bindings.texture(8)).dot(to_light), zero);
        let irradiance = intensity * cos;
        output.color[0] = match gather {
            Gather::PerBeam => v4(irradiance.x, irradiance.y, irradiance.z, zero),
            Gather::FlatWater => v4(intensity.x, intensity.y, intensity.z, zero),
            Gather::Vector => vector(to_light, intensity.x),
        };
        output.color[1] = vector(to_light, intensity.y);
        output.color[2] = vector(to_light, intensity.z);
        let total = irradiance.x + irradiance.y + irradiance.z;
        output.color[3] = v4(unit.x * total, unit.y * total, unit.z * total, total);
        output.color[4] = v4(L::select(exists, zero.like(1.0), zero), zero, zero, zero);
    }
}

#[inline(always)]
fn vector<L: Lanes>(direction: V3<L>, length: L) -> V4<L> {
    v4(direction.x * length, direction.y * length, direction.z * length, length.like(0.0))
}

/// `Σ I·(N·L)` with the L of still water, or `N·Σ I L`, by channel [BO §3.2].
struct Relight;

impl FragmentShader for Relight {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let light: &RelightUniform = bindings.uniform(0);
        let n: V3<L> = input.texel3_here(bindings.texture(1));
        let zero = n.x.like(0.0);
        let exists = input.texel_here(bindings.texture(2), 3).equals(zero.like(1.0));
        let first = input.texel3_here(bindings.texture(3));
        let irradiance = if light.to_light.w > 0.0 {
            let (green, blue) = (input.texel3_here(bindings.texture(4)), input.texel3_here(bindings.texture(5)));
            v3(n.dot(first), n.dot(green), n.dot(blue))
        } else {
            first * n.dot(V3::splat(input.token, light.to_light.truncate()))
        };
        let none = v3(zero, zero, zero);
        let lit = v3(Lanes::max(irradiance.x, zero), Lanes::max(irradiance.y, zero), Lanes::max(irradiance.z, zero));
        let lit = V3::select(exists, lit, none);
        output.color[0] = v4(lit.x, lit.y, lit.z, zero);
    }
}

/// Towards the light under still water, as [`RelightUniform`] has it.
#[must_use]
pub fn to_light(refracted: Vec3, radiometry: Radiometry) -> Vec3 {
    match radiometry {
        Radiometry::Paper => -refracted,
        Radiometry::Physical => refracted / refracted.y,
    }
}
