//! Shadow maps of a light: receivers above the water through air, and receivers under water through flat water.
//!
//! The map through water is indexed by the point S where light enters the mean water plane; its depth is the depth below that plane. Light that
//! enters at S continues straight to all points with the same S, in order of depth. For parallel light S follows from the refracted direction; for a
//! point light it is the solution of Snell's law at the plane. The tilt of waves is ignored: shadows keep their places while the caustics move. Road
//! not taken: a map along each beam's own ray, which needs a ray tracer or a map per beam.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3, Vec4};

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V2, V3, transform_point, v2, v3, v4};
use nephroid_pipeline::shader::{Program, VertexInput, VertexOutput, VertexShader};
use nephroid_pipeline::{BindingKind, Bindings};

use super::geometry_buffer::ReceiverVertex;

/// Texels by which a point is moved off its own surface before the lookup.
const SELF_SHADOW_TEXELS: f32 = 2.0;

/// Uniform of a light and its two shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightUniform {
    /// Clip space of the map through air, from world space.
    pub clip_from_world: Mat4,
    /// Position, with w = 1; for parallel light the direction of travel, with w = 0.
    pub position_ws: Vec4,
    /// Irradiance on a surface perpendicular to the light (parallel light, W/m²) or radiant intensity (W/sr), linear RGB.
    pub intensity: Vec4,
    /// Spot axis (unit) and cosine of the outer angle; w = −2 without a cone.
    pub spot: Vec4,
    /// x: cosine of the inner angle. y: mean water level, m. z: refractive index. w: depth of the map through water, m.
    pub water: Vec4,
    /// Extent of the map through water in x and z: minimum x, minimum z, size x, size z, metres.
    pub entry: Vec4,
    /// Direction of the light under flat water, unit (parallel light only).
    pub refracted: Vec4,
}

/// The light at a point: its direction of travel (unit) and its irradiance, W/m².
pub struct LightAt<L> {
    /// Direction in which the light travels.
    pub direction: V3<L>,
    /// Irradiance on a surface perpendicular to the light.
    pub irradiance: V3<L>,
}

impl LightUniform {
    /// The unshadowed light at a point. [`nephroid_scene::Light::incident`] is the definition.
    #[inline(always)]
    pub fn at<L: Lanes>(&self, p_ws: V3<L>) -> LightAt<L> {
        let token = p_ws.x.token();
        let intensity = V3::splat(token, self.intensity.truncate());
        if self.position_ws.w == 0.0 {
            return LightAt { direction: V3::splat(token, self.position_ws.truncate()), irradiance: intensity };
        }
        let to = p_ws - V3::splat(token, self.position_ws.truncate());
        let squared = to.dot(to);
        let direction = to * (p_ws.x.like(1.0) / squared.sqrt());
        let mut scale = p_ws.x.like(1.0) / squared;
        if self.spot.w > -2.0 {
            let cos = direction.dot(V3::splat(token, self.spot.truncate()));
            // Smoothstep from the outer to the inner cone.
            let t = Lanes::clamp((cos - self.spot.w) / (self.water.x - self.spot.w).max(1.0e-6), 0.0, 1.0);
            scale = scale * (t * t * (t * -2.0 + 3.0));
        }
        LightAt { direction, irradiance: intensity * scale }
    }

    /// The point at which light enters the mean water plane on its way to a point under water: x and z, metres.
    #[inline(always)]
    pub fn entry_point<L: Lanes>(&self, p_ws: V3<L>) -> V2<L> {
        let depth = -(p_ws.y - self.water.y);
        if self.position_ws.w == 0.0 {
            let per_depth = Vec2::new(self.refracted.x, self.refracted.z) / -self.refracted.y;
            return v2(p_ws.x - depth * per_depth.x, p_ws.z - depth * per_depth.y);
        }
        let (light, height) = (self.position_ws, (self.position_ws.y - self.water.y).max(1.0e-4));
        let across = v2(p_ws.x - light.x, p_ws.z - light.z);
        let distance = across.dot(across).sqrt();
        // sin θᵢ − n sin θₜ increases with the horizontal distance between the light and the entry point: bisect in 20 steps, to a millionth.
        let depth = Lanes::max(depth, depth.like(0.0));
        let (mut low, mut high) = (distance.like(0.0), distance);
        for _ in 0..20 {
            let middle = (low + high) * 0.5;
            let rest = distance - middle;
            let sin_i = middle / (middle * middle + height * height).sqrt();
            let sin_t = rest / Lanes::max((rest * rest + depth * depth).sqrt(), rest.like(1.0e-12));
            let beyond = (sin_i - sin_t * self.water.z).gt(middle.like(0.0));
            high = L::select(beyond, middle, high);
            low = L::select(beyond, low, middle);
        }
        let share = L::select(distance.gt(distance.like(1.0e-9)), (low + high) * 0.5 / distance, distance.like(0.0));
        v2(across.x * share + light.x, across.y * share + light.z)
    }

    /// Texture coordinates and depth of a point in the map through water.
    #[inline(always)]
    pub fn through_water<L: Lanes>(&self, p_ws: V3<L>) -> (V2<L>, L) {
        let entry = self.entry_point(p_ws);
        let uv = v2((entry.x - self.entry.x) / self.entry.z, (entry.y - self.entry.y) / self.entry.w);
        (uv, -(p_ws.y - self.water.y) / self.water.w)
    }

    /// Offset along the normal, m, by which a surface in a map through water of `size` texels must be moved so that it does not shadow itself.
    #[inline(always)]
    pub fn water_texel(&self, size: u32) -> f32 {
        SELF_SHADOW_TEXELS * self.entry.z.max(self.entry.w) / size as f32
    }

    /// The same offset for the map through air, at a point.
    #[inline(always)]
    pub fn air_texel<L: Lanes>(&self, p_ws: V3<L>, size: u32) -> L {
        let c = self.clip_from_world.to_cols_array();
        // Clip units per metre across the map. A perspective map spreads with distance.
        let per_metre = (c[0] * c[0] + c[4] * c[4] + c[8] * c[8]).sqrt();
        let w = p_ws.x * c[3] + p_ws.y * c[7] + p_ws.z * c[11] + c[15];
        w * (SELF_SHADOW_TEXELS * 2.0 / (per_metre * size as f32))
    }

    /// Texture coordinates and depth of a point in the map through air. Lanes behind the light get coordinates outside of the map.
    #[inline(always)]
    pub fn through_air<L: Lanes>(&self, p_ws: V3<L>) -> (V2<L>, L, L::Mask) {
        let clip = transform_point(&self.clip_from_world, p_ws);
        let inv_w = clip.w.like(1.0) / clip.w;
        let uv = v2(clip.x * inv_w * 0.5 + 0.5, -(clip.y * inv_w) * 0.5 + 0.5);
        let (zero, one) = (clip.w.like(0.0), clip.w.like(1.0));
        let inside = clip.w.gt(zero) & uv.x.ge(zero) & uv.x.le(one) & uv.y.ge(zero) & uv.y.le(one);
        (uv, clip.z * inv_w, inside)
    }
}

/// Bindings of both programs: light, vertices.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Uniform(size_of::<LightUniform>()), BindingKind::Storage(size_of::<ReceiverVertex>())];

/// The depth-only program of the map through air.
#[must_use]
pub fn air_program() -> Arc<Program> {
    Arc::new(Program {
        fragment: None,
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("shadow_map.wgsl"), include_str!("receiver_vertex.wgsl"), include_str!("shadow_map_air.wgsl"))),
        ..Program::new("shadow_map_air", AirVertex, NoFragment)
    })
}

/// The depth-only program of the map through water.
#[must_use]
pub fn water_program() -> Arc<Program> {
    Arc::new(Program {
        fragment: None,
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("shadow_map.wgsl"), include_str!("receiver_vertex.wgsl"), include_str!("shadow_map_water.wgsl"))),
        ..Program::new("shadow_map_water", WaterVertex, NoFragment)
    })
}

#[inline(always)]
fn fetch<L: Lanes>(bindings: &Bindings<'_>, input: &VertexInput<'_, L>) -> V3<L> {
    let vertices: &[ReceiverVertex] = bindings.storage(1);
    input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.position_ws.to_array())).xyz()
}

struct AirVertex;

impl VertexShader for AirVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let light: &LightUniform = bindings.uniform(0);
        output.position = transform_point(&light.clip_from_world, fetch(bindings, input));
    }
}

struct WaterVertex;

impl VertexShader for WaterVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let light: &LightUniform = bindings.uniform(0);
        let (uv, depth) = light.through_water(fetch(bindings, input));
        output.position = v4(uv.x * 2.0 - 1.0, -(uv.y * 2.0) + 1.0, depth, depth.like(1.0));
    }
}

/// Type parameter for programs that have no fragment shader.
struct NoFragment;

impl nephroid_pipeline::shader::FragmentShader for NoFragment {
    #[inline(always)]
    fn fragment<L: Lanes>(
        &self,
        _bindings: &Bindings<'_>,
        _input: &nephroid_pipeline::shader::FragmentInput<'_, L>,
        _output: &mut nephroid_pipeline::shader::FragmentOutput<L>,
    ) {
    }
}

/// True if the mask has no lane set.
#[inline(always)]
pub(super) fn none<M: Mask>(mask: M) -> bool {
    !mask.any()
}

/// Direction of parallel light under flat water; straight down for light that cannot enter.
#[must_use]
pub fn refracted_under_flat_water(direction: Vec3, ior: f32) -> Vec3 {
    let d = v3(direction.x, direction.y, direction.z);
    let (t, entered) = nephroid_math::optics::refract(d, v3(0.0, 1.0, 0.0), 1.0 / ior);
    if entered && t.y < 0.0 { Vec3::new(t.x, t.y, t.z) } else { Vec3::NEG_Y }
}
