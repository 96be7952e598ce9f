//! The picture: sky and receivers, then the water surface in front of them [SF05 §3.5, third pass].
//!
//! The surface shows the shaded receivers, which are looked up in one of two ways:
//! - *virtual plane*: at the pixel of the surface point, moved vertically onto the mean water plane: the paper's fake refraction;
//! - *Snell*: along the refracted ray of the eye, followed through the position texture by the fixed-point iteration of Shah, Konttinen & Pattanaik
//!   2007, `d ← |S − position(project(S + d·r))|`, damped by half.
//!
//! The search ends after a fixed number of steps. Where what it has found lies further off the ray than [`OFF_RAY_PX`] pixels, or it has found nothing under
//! water, it has not converged: w of the picture is then 2 in place of 1, and the renderer counts such samples (`eye_searches_unconverged`).
//!
//! The result is attenuated by the water along the way, in-scattered light is added, and Fresnel reflection of sky and sun is mixed in. What leaves the water
//! along a refracted ray spreads over a wider angle: `L = (1 − R)·L_water/n²`. The virtual plane shows `(1 − R)·L_water`, as the paper does.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::optics::{beer_lambert_rgb, fresnel_reflectance, reflect, refract};
use nephroid_math::vector::{V2, V3, V4, transform_point, v2, v3, v4};
use nephroid_pipeline::sampler::{AddressMode, Sampler, load, sample_level};
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};

use super::camera::CameraUniform;
use super::environment::EnvironmentUniform;
use super::fullscreen::FullscreenVertex;

/// Length of a ray in water that meets nothing, in depths of the water: nothing is seen through so much of it.
const ENDLESS: f32 = 1.0e4;

/// Steps of the search along a refracted ray.
const SEARCH_STEPS: usize = 8;

/// Distance of what is shown from the refracted ray up to which the search has converged, in pixels there.
const OFF_RAY_PX: f32 = 4.0;

/// w of a sample of the picture whose search has not converged.
const UNCONVERGED: f32 = 2.0;

/// A vertex of the water surface.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WaterVertex {
    /// Position, m; w = 1.
    pub position_ws: Vec4,
    /// Unit normal, up; w = 0.
    pub normal_ws: Vec4,
}

/// Bindings of the background: camera, environment, position, radiance.
pub const BACKGROUND_BINDINGS: [BindingKind; 4] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<EnvironmentUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
];

/// Bindings of the surface: camera, environment, position, radiance, vertices, albedo.
pub const SURFACE_BINDINGS: [BindingKind; 6] = [
    BACKGROUND_BINDINGS[0],
    BACKGROUND_BINDINGS[1],
    BACKGROUND_BINDINGS[2],
    BACKGROUND_BINDINGS[3],
    BindingKind::Storage(size_of::<WaterVertex>()),
    BindingKind::Texture,
];

/// Sky and receivers, without the water surface.
#[must_use]
pub fn background_program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BACKGROUND_BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("../../math/optics.wgsl"),
            include_str!("fullscreen.wgsl"),
            include_str!("camera.wgsl"),
            include_str!("environment.wgsl"),
            include_str!("through_water.wgsl"),
            include_str!("background.wgsl")
        )),
        ..Program::new("background", FullscreenVertex, Background)
    })
}

/// The water surface. With `snell` refracted rays are followed, otherwise the virtual plane is used.
#[must_use]
pub fn surface_program(snell: bool) -> Arc<Program> {
    let varying = |name| Varying { name, components: 3, interpolation: Interpolation::Perspective };
    Arc::new(Program {
        varyings: vec![varying("position_ws"), varying("normal_ws")],
        bindings: SURFACE_BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("../../math/optics.wgsl"),
            include_str!("camera.wgsl"),
            include_str!("environment.wgsl"),
            include_str!("through_water.wgsl"),
            include_str!("texel_or_zero.wgsl"),
            include_str!("water_surface.wgsl")
        )),
        wgsl_constants: vec![("snell", f64::from(u8::from(snell)))],
        ..Program::new("water_surface", SurfaceVertex, SurfaceFragment { snell })
    })
}

/// Radiance after `distance` metres of water: attenuated, with in-scattered light added.
#[inline(always)]
fn through_water<L: Lanes>(environment: &EnvironmentUniform, radiance: V3<L>, distance: L) -> V3<L> {
    let left = beer_lambert_rgb(environment.sigma_t.truncate(), distance);
    let token = distance.token();
    let one = V3::splat(token, glam::Vec3::ONE);
    radiance.hadamard(left) + V3::splat(token, environment.inscatter.truncate()).hadamard(one - left)
}

struct Background;

impl FragmentShader for Background {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let environment: &EnvironmentUniform = bindings.uniform(1);
        let (position, radiance) = (bindings.texture(2), bindings.texture(3));
        let p: V3<L> = input.texel3_here(position);
        let exists = input.texel_here(position, 3).gt(p.x.like(0.0));
        let seen = input.texel3_here(radiance);
        let ray = camera.ray(input.position.x, input.position.y);
        let color = if camera.water.z > 0.0 {
            // The eye is under water, so it sees everything through water.
            let eye = V3::splat(input.token, camera.eye_ws.truncate());
            let distance = L::select(exists, (p - eye).length(), p.x.like(ENDLESS * camera.level.y));
            through_water(environment, V3::select(exists, seen, v3(p.x.like(0.0), p.x.like(0.0), p.x.like(0.0))), distance)
        } else {
            V3::select(exists, seen, environment.sky(ray))
        };
        output.color[0] = v4(color.x, color.y, color.z, p.x.like(1.0));
    }
}

struct SurfaceVertex;

impl VertexShader for SurfaceVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let vertices: &[WaterVertex] = bindings.storage(4);
        let position = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.position_ws.to_array())).xyz();
        let normal = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.normal_ws.to_array())).xyz();
        // The surface appears at its own position: only points under it are raised.
        output.position = transform_point(&camera.clip_from_world, position);
        output.set3(0, position);
        output.set3(3, normal);
    }
}

struct SurfaceFragment {
    snell: bool,
}

impl FragmentShader for SurfaceFragment {
    const MERGES_FRAGMENTS: bool = true;

    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let environment: &EnvironmentUniform = bindings.uniform(1);
        let surface: V3<L> = input.varying3(0);
        let up = input.varying3(3).normalize();
        let view = camera.view_direction(surface);
        let one = surface.x.like(1.0);
        let ior = environment.inscatter.w;
        let mut mark = one;
        let color = if camera.water.z > 0.0 {
            from_below(camera, environment, surface, up, view, ior)
        } else {
            // The far side of a wave can face away from the eye; the cosine is then that of a nearly grazing view.
            let cos = Lanes::max(-view.dot(up), surface.x.like(0.02));
            let reflectance = fresnel_reflectance(cos, 1.0, ior);
            let (ray, _) = refract(view, up, 1.0 / ior);
            let seen = if self.snell { self.follow(bindings, camera, surface, ray) } else { self.virtual_plane(bindings, camera, surface) };
            mark = seen.mark;
            let below = through_water(environment, seen.radiance, seen.distance);
            // Radiance in the thinner medium is less by n²; the paper shows the water's own.
            let below = if self.snell { below * one.like(1.0 / (ior * ior)) } else { below };
            let mirrored = reflect(view, up);
            // Light that a wave reflects downwards would hit the water again; the sky just above the horizon is taken instead.
            let mirrored = v3(mirrored.x, Lanes::max(mirrored.y, surface.x.like(0.01)), mirrored.z).normalize();
            below * (one - reflectance) + environment.sky(mirrored) * reflectance
        };
        output.color[0] = v4(color.x, color.y, color.z, mark);
    }
}

/// The radiance behind a surface point.
struct Seen<L> {
    radiance: V3<L>,
    /// Distance in water to the point seen, m.
    distance: L,
    /// 1, or [`UNCONVERGED`].
    mark: L,
}

impl SurfaceFragment {
    /// The paper's lookup, at this surface point moved vertically onto the mean plane.
    #[inline(always)]
    fn virtual_plane<L: Lanes>(&self, bindings: &Bindings<'_>, camera: &CameraUniform, surface: V3<L>) -> Seen<L> {
        let on_plane = v3(surface.x, surface.y.like(camera.level.x), surface.z);
        let pixel = camera.pixel(transform_point(&camera.clip_from_world, on_plane));
        let at = position_at(bindings, pixel);
        let distance = L::select(at.w.gt(at.w.like(0.0)), (v3(at.x, at.y, at.z) - surface).length(), at.w.like(ENDLESS * camera.level.y));
        Seen { radiance: radiance_at(bindings, camera, pixel), distance, mark: at.w.like(1.0) }
    }

    /// Follows a refracted ray from the surface to the first receiver under water.
    #[inline(always)]
    fn follow<L: Lanes>(&self, bindings: &Bindings<'_>, camera: &CameraUniform, surface: V3<L>, ray: V3<L>) -> Seen<L> {
        let zero = surface.x.like(0.0);
        // The start is the receiver straight behind the surface, or the depth of the water if that receiver is above it.
        let mut pixel = camera.pixel(transform_point(&camera.clip_from_world, surface));
        let mut distance = Lanes::min(-(zero.like(1.0) / ray.y), zero.like(4.0)) * camera.level.y;
        // At a jump in depth the iteration has no fixed point and oscillates. Of the points found, the one nearest to the ray is taken.
        let mut best = pixel;
        let mut best_distance = zero;
        let mut best_miss = zero.like(f32::INFINITY);
        for step in 0..SEARCH_STEPS {
            let at = position_at(bindings, pixel);
            let point = v3(at.x, at.y, at.z);
            // A receiver above the water hides the water at this pixel; the ray continues below it.
            // The geometry buffer knows which points are wet; most are far from the surface, and need not be looked up.
            let (mut wet, near) = camera.far_under_water(point);
            if (near & at.w.gt(zero)).any() {
                wet = wet | (near & load(bindings.texture(5), pixel.x.floor(), pixel.y.floor(), 0, 0).w.gt(zero));
            }
            let wet = at.w.gt(zero) & wet;
            let to = point - surface;
            let guess = to.length();
            let beside = to - ray * to.dot(ray);
            let miss = beside.dot(beside);
            let better = wet & miss.lt(best_miss);
            best = V2::select(better, pixel, best);
            best_distance = L::select(better, guess, best_distance);
            best_miss = L::select(better, miss, best_miss);
            // Without damping, the iteration oscillates on walls seen edge-on; half a step does not.
            let next = if step == 0 { guess } else { (guess + distance) * 0.5 };
            distance = L::select(wet, next, distance);
            pixel = camera.pixel(camera.project(surface + ray * distance));
        }
        // If the iteration finds no point under water, the water is taken to be deep.
        let found = best_miss.lt(zero.like(f32::INFINITY));
        let distance = L::select(found, best_distance, zero.like(ENDLESS * camera.level.y));
        let tolerance = camera.pixel_m(surface + ray * distance) * OFF_RAY_PX;
        let mark = L::select(found & best_miss.le(tolerance * tolerance), zero.like(1.0), zero.like(UNCONVERGED));
        Seen { radiance: radiance_at(bindings, camera, best), distance, mark }
    }
}

/// The surface as an eye under water sees it: Snell's window, and total reflection around it.
#[inline(always)]
fn from_below<L: Lanes>(
    camera: &CameraUniform,
    environment: &EnvironmentUniform,
    surface: V3<L>,
    up: V3<L>,
    view: V3<L>,
    ior: f32,
) -> V3<L> {
    let down = -up;
    let cos = Lanes::max(-view.dot(down), surface.x.like(1.0e-3));
    let (ray, leaves) = refract(view, down, ior);
    let reflectance = L::select(leaves, fresnel_reflectance(cos, ior, 1.0), surface.x.like(1.0));
    // Radiance in the denser medium is larger by n².
    let sky = environment.sky(ray.normalize()) * surface.x.like(ior * ior);
    let token = surface.x.token();
    let water = V3::splat(token, environment.inscatter.truncate());
    let at_surface = V3::select(leaves, sky * (surface.x.like(1.0) - reflectance), v3(cos.like(0.0), cos.like(0.0), cos.like(0.0)))
        + water * reflectance;
    let eye = V3::splat(token, camera.eye_ws.truncate());
    through_water(environment, at_surface, (surface - eye).length())
}

#[inline(always)]
fn position_at<L: Lanes>(bindings: &Bindings<'_>, pixel: V2<L>) -> V4<L> {
    load(bindings.texture(2), pixel.x.floor(), pixel.y.floor(), 0, 0)
}

#[inline(always)]
fn radiance_at<L: Lanes>(bindings: &Bindings<'_>, camera: &CameraUniform, pixel: V2<L>) -> V3<L> {
    let uv = v2(pixel.x * camera.size_px.z, pixel.y * camera.size_px.w);
    let sampler = Sampler::linear(AddressMode::ClampToEdge);
    let color = sample_level(bindings.texture(3), &sampler, uv, 0, uv.x.like(0.0));
    v3(color.x, color.y, color.z)
}
