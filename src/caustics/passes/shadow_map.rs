//! Shadow maps of a light: one along its straight rays, for what is on the light's side of the water, and one through flat water, for what is beyond.
//!
//! The light's side is the air for a light above the water, and the water for a lamp in it. The map through the surface is indexed by the point S where
//! light crosses the mean water plane; its depth is the distance to that plane. Light that crosses at S continues straight to all points with the same S,
//! in order of depth. For parallel light S follows from the refracted direction; for a point light it is the solution of Snell's law at the plane. For a
//! lamp in the water the map is indexed by the refracted direction, which S determines, and its depth is the distance from S. The tilt of waves is ignored: shadows keep their places while the caustics move. Road not taken: a map along each beam's own ray, which needs a ray
//! tracer or a map per beam.
//!
//! The map of straight rays is one view, or six where one cannot hold what surrounds a light: the faces of a cube, three in a row.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3, Vec4};

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::optics::beer_lambert_rgb;
use nephroid_math::vector::{V2, V3, transform_point, v2, v3, v4};
use nephroid_pipeline::shader::{Program, VertexInput, VertexOutput, VertexShader};
use nephroid_pipeline::{BindingKind, Bindings};

use super::geometry_buffer::ReceiverVertex;

/// Texels by which a point is moved off its own surface before the lookup.
const SELF_SHADOW_TEXELS: f32 = 2.0;

/// Least square of the cosine of a refracted ray, for the size of texels behind the surface.
const LEAST_COS_SQUARED: f32 = 0.01;

/// Least distance of a light from the water plane, as a share of the depth of the map through the surface.
const LEAST_HEIGHT: f32 = 1.0e-5;

/// Uniform of a light and its two shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightUniform {
    /// Clip space of the map of straight rays, from world space. With a cube, that of one of its faces where the map is drawn.
    pub clip_from_world: Mat4,
    /// Position, with w = 1; for parallel light the direction of travel, with w = 0.
    pub position_ws: Vec4,
    /// Irradiance on a surface perpendicular to the light (parallel light, W/m²) or radiant intensity (W/sr), linear RGB. w: cosine of the inner angle.
    pub intensity: Vec4,
    /// Spot axis (unit) and cosine of the outer angle; w = −2 without a cone.
    pub spot: Vec4,
    /// x: 1 for a light above the water, −1 for one in it. y: mean water level, m. z: refractive index beyond the surface over that on the light's side.
    /// w: how far the surface reaches from the mean level towards the light, m.
    pub water: Vec4,
    /// Extent of the map through the surface in x and z: minimum x, minimum z, size x, size z, metres.
    pub entry: Vec4,
    /// Direction of the light beyond flat water, unit (parallel light only). w: depth of the map through the surface, m.
    pub refracted: Vec4,
    /// Extinction coefficient on the light's side, 1/m, linear RGB. w: for parallel light in water, the coordinate along it at which it starts, m.
    pub own: Vec4,
    /// With a cube, x: near plane n, m; y, z: f/(f − n) and f·n/(f − n), with f the far plane; w: width of a face, texels. Zeros without.
    pub cube: Vec4,
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
            let t = Lanes::clamp((cos - self.spot.w) / (self.intensity.w - self.spot.w).max(1.0e-6), 0.0, 1.0);
            scale = scale * (t * t * (t * -2.0 + 3.0));
        }
        LightAt { direction, irradiance: intensity * scale }
    }

    /// Share of the light that the medium on the light's side leaves on the way to a point there, linear RGB.
    #[inline(always)]
    pub fn kept<L: Lanes>(&self, p_ws: V3<L>) -> V3<L> {
        let token = p_ws.x.token();
        let along = V3::splat(token, self.position_ws.truncate());
        let distance = if self.position_ws.w == 0.0 { p_ws.dot(along) - self.own.w } else { (p_ws - along).length() };
        beer_lambert_rgb(self.own.truncate(), Lanes::max(distance, distance.like(0.0)))
    }

    /// Whether the map through the surface is indexed by the direction of the refracted ray, not by the place where it starts: for a lamp in the water. Its
    /// light leaves the surface in all directions, but starts from a disc, at whose edge a texel would hold many directions.
    #[inline(always)]
    fn maps_directions(&self) -> bool {
        self.position_ws.w != 0.0 && self.water.x < 0.0
    }

    /// Distance of a point beyond the mean water plane, m.
    #[inline(always)]
    fn beyond<L: Lanes>(&self, p_ws: V3<L>) -> L {
        (-(p_ws.y - self.water.y)) * self.water.x
    }

    /// The point at which light crosses the mean water plane on its way to a point beyond: x and z, metres.
    #[inline(always)]
    pub fn entry_point<L: Lanes>(&self, p_ws: V3<L>) -> V2<L> {
        let depth = self.beyond(p_ws);
        if self.position_ws.w == 0.0 {
            let per_depth = Vec2::new(self.refracted.x, self.refracted.z) / self.refracted.y.abs();
            return v2(p_ws.x - depth * per_depth.x, p_ws.z - depth * per_depth.y);
        }
        let light = self.position_ws;
        let height = ((light.y - self.water.y) * self.water.x).max(self.refracted.w * LEAST_HEIGHT);
        let across = v2(p_ws.x - light.x, p_ws.z - light.z);
        let distance = across.dot(across).sqrt();
        // n₁ sin θᵢ − n₂ sin θₜ increases with the horizontal distance between the light and the entry point: bisect in 20 steps, to a millionth.
        let depth = Lanes::max(depth, depth.like(0.0));
        let (mut low, mut high) = (distance.like(0.0), distance);
        for _ in 0..20 {
            let middle = (low + high) * 0.5;
            let rest = distance - middle;
            let sin_i = middle / (middle * middle + height * height).sqrt();
            let sin_t = rest / Lanes::max((rest * rest + depth * depth).sqrt(), rest.like(f32::MIN_POSITIVE));
            let beyond = (sin_i - sin_t * self.water.z).gt(middle.like(0.0));
            high = L::select(beyond, middle, high);
            low = L::select(beyond, low, middle);
        }
        let share = L::select(distance.gt(distance.like(0.0)), (low + high) * 0.5 / distance, distance.like(0.0));
        v2(across.x * share + light.x, across.y * share + light.z)
    }

    /// Texture coordinates and depth of a point in the map through the surface.
    #[inline(always)]
    pub fn on_refracted_map<L: Lanes>(&self, p_ws: V3<L>) -> (V2<L>, L) {
        let entry = self.entry_point(p_ws);
        if self.maps_directions() {
            let beyond = self.beyond(p_ws);
            let (x, z) = (p_ws.x - entry.x, p_ws.z - entry.y);
            let distance = (x * x + z * z + beyond * beyond).sqrt();
            let up = Lanes::max(beyond, beyond.like(0.0)) / Lanes::max(distance, distance.like(f32::MIN_POSITIVE));
            // Lambert's azimuthal projection, which keeps areas.
            let scale = distance.like(0.5) / ((up + 1.0).sqrt() * Lanes::max(distance, distance.like(f32::MIN_POSITIVE)));
            return (v2(x * scale + 0.5, z * scale + 0.5), distance / self.refracted.w);
        }
        let uv = v2((entry.x - self.entry.x) / self.entry.z, (entry.y - self.entry.y) / self.entry.w);
        (uv, (self.beyond(p_ws) + self.water.w) / self.refracted.w)
    }

    /// Offset along the normal, m, by which a surface in a map through the surface of `size` texels must be moved at a point so that it does not shadow
    /// itself.
    #[inline(always)]
    pub fn refracted_texel<L: Lanes>(&self, p_ws: V3<L>, size: u32) -> L {
        let texel = SELF_SHADOW_TEXELS * self.entry.z.max(self.entry.w) / size as f32;
        let one = p_ws.x.like(1.0);
        if self.maps_directions() {
            // The circle of all directions has a radius of half of the map, and a radius of √2 on the sphere.
            let to = p_ws - V3::splat(p_ws.x.token(), self.position_ws.truncate());
            return to.length() * (SELF_SHADOW_TEXELS * 2.0 * std::f32::consts::SQRT_2 / size as f32);
        }
        if self.position_ws.w == 0.0 {
            return one * texel;
        }
        // A texel of a lamp's map grows behind the surface by 1 + (depth tan θₜ)/(height tan θᵢ), with angles from a straight ray: tan θₜ/tan θᵢ is
        // cos θᵢ/(n cos θₜ).
        let light = self.position_ws;
        let height = ((light.y - self.water.y) * self.water.x).max(self.refracted.w * LEAST_HEIGHT);
        let depth = Lanes::max(self.beyond(p_ws), one.like(0.0));
        let (x, z) = (p_ws.x - light.x, p_ws.z - light.z);
        let squared = x * x + z * z;
        let whole = depth + height;
        let cos_squared = whole * whole / (whole * whole + squared);
        let sin_squared = (one - cos_squared) * (1.0 / (self.water.z * self.water.z));
        let cos_t = Lanes::max(one - sin_squared, one.like(LEAST_COS_SQUARED)).sqrt();
        (one + depth * cos_squared.sqrt() / (cos_t * (height * self.water.z))) * texel
    }

    /// The same offset for the map of straight rays, at a point.
    #[inline(always)]
    pub fn straight_texel<L: Lanes>(&self, p_ws: V3<L>, size: u32) -> L {
        if self.cube.w > 0.0 {
            return self.face_of(p_ws).distance * (SELF_SHADOW_TEXELS * 2.0 / self.cube.w);
        }
        let c = self.clip_from_world.to_cols_array();
        // Clip units per metre across the map. A perspective map spreads with distance.
        let per_metre = (c[0] * c[0] + c[4] * c[4] + c[8] * c[8]).sqrt();
        let w = p_ws.x * c[3] + p_ws.y * c[7] + p_ws.z * c[11] + c[15];
        w * (SELF_SHADOW_TEXELS * 2.0 / (per_metre * size as f32))
    }

    /// Texture coordinates and depth of a point in the map of straight rays, and whether the map holds it.
    #[inline(always)]
    pub fn on_straight_map<L: Lanes>(&self, p_ws: V3<L>) -> (V2<L>, L, L::Mask) {
        let (zero, one) = (p_ws.x.like(0.0), p_ws.x.like(1.0));
        if self.cube.w > 0.0 {
            let face = self.face_of(p_ws);
            // Filtering stays inside of the face.
            let half = 0.5 / self.cube.w;
            let x = Lanes::clamp(face.x * 0.5 + 0.5, half, 1.0 - half);
            let y = Lanes::clamp(face.y * 0.5 + 0.5, half, 1.0 - half);
            let uv = v2((face.column + x) * (1.0 / 3.0), (face.row + y) * 0.5);
            return (uv, -(one / face.distance * self.cube.z) + self.cube.y, face.distance.gt(zero));
        }
        let clip = transform_point(&self.clip_from_world, p_ws);
        let inv_w = one / clip.w;
        let uv = v2(clip.x * inv_w * 0.5 + 0.5, -(clip.y * inv_w) * 0.5 + 0.5);
        let inside = clip.w.gt(zero) & uv.x.ge(zero) & uv.x.le(one) & uv.y.ge(zero) & uv.y.le(one);
        (uv, clip.z * inv_w, inside)
    }

    /// The face of the cube on which a point appears.
    #[inline(always)]
    fn face_of<L: Lanes>(&self, p_ws: V3<L>) -> OnFace<L> {
        let to = p_ws - V3::splat(p_ws.x.token(), self.position_ws.truncate());
        let (zero, one) = (to.x.like(0.0), to.x.like(1.0));
        let (x, y, z) = (to.x.abs(), to.y.abs(), to.z.abs());
        let is_x = x.ge(y) & x.ge(z);
        let is_y = !is_x & y.ge(z);
        let distance = Lanes::max(x, Lanes::max(y, z));
        let inverse = one / distance;
        let along = L::select(is_x, to.x, L::select(is_y, to.y, to.z));
        OnFace {
            column: L::select(is_x, zero, L::select(is_y, one, one + one)),
            row: L::select(along.ge(zero), zero, one),
            x: L::select(is_x, to.z, to.x) * inverse,
            y: L::select(is_y, to.z, to.y) * inverse,
            distance,
        }
    }

    /// The uniform with which a face of the cube is drawn, by its column (axis x, y, z) and row (towards the axis, or against it).
    #[must_use]
    pub fn with_face(&self, column: usize, row: usize) -> Self {
        let light = self.position_ws.truncate();
        let unit = |axis: usize| Vec3::AXES[axis];
        let (right, down) = ([2, 0, 0][column], [1, 2, 1][column]);
        let ahead = unit(column) * if row == 0 { 1.0 } else { -1.0 };
        let [_, scale, shift, _] = self.cube.to_array();
        let row_of = |v: Vec3, add: f32| v.extend(add - v.dot(light));
        let ahead = row_of(ahead, 0.0);
        let rows = [row_of(unit(right), 0.0), -row_of(unit(down), 0.0), ahead * scale - Vec4::W * shift, ahead];
        Self { clip_from_world: Mat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose(), ..*self }
    }
}

/// A point on a face of the cube.
struct OnFace<L> {
    /// Column of the face in the map: 0, 1, 2 for the axes x, y, z.
    column: L,
    /// Row of the face in the map: 0 towards the axis, 1 against it.
    row: L,
    /// Coordinates on the face, −1 to 1, to the right and down.
    x: L,
    y: L,
    /// Distance along the axis, m.
    distance: L,
}

/// Bindings of both programs: light, vertices.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Uniform(size_of::<LightUniform>()), BindingKind::Storage(size_of::<ReceiverVertex>())];

/// The depth-only program of the map of straight rays.
#[must_use]
pub fn straight_program() -> Arc<Program> {
    Arc::new(Program {
        fragment: None,
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("shadow_map.wgsl"),
            include_str!("receiver_vertex.wgsl"),
            include_str!("shadow_map_straight.wgsl")
        )),
        ..Program::new("shadow_map_straight", StraightVertex, NoFragment)
    })
}

/// The depth-only program of the map through the surface.
#[must_use]
pub fn refracted_program() -> Arc<Program> {
    Arc::new(Program {
        fragment: None,
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("shadow_map.wgsl"),
            include_str!("receiver_vertex.wgsl"),
            include_str!("shadow_map_refracted.wgsl")
        )),
        ..Program::new("shadow_map_refracted", RefractedVertex, NoFragment)
    })
}

#[inline(always)]
fn fetch<L: Lanes>(bindings: &Bindings<'_>, input: &VertexInput<'_, L>) -> V3<L> {
    let vertices: &[ReceiverVertex] = bindings.storage(1);
    input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.position_ws.to_array())).xyz()
}

struct StraightVertex;

impl VertexShader for StraightVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let light: &LightUniform = bindings.uniform(0);
        output.position = transform_point(&light.clip_from_world, fetch(bindings, input));
    }
}

struct RefractedVertex;

impl VertexShader for RefractedVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let light: &LightUniform = bindings.uniform(0);
        let (uv, depth) = light.on_refracted_map(fetch(bindings, input));
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

/// Direction of parallel light behind the flat surface of water of index `ior`, in the water or above it; straight down or up for light that cannot pass.
#[must_use]
pub fn refracted_at_flat_water(direction: Vec3, ior: f32) -> Vec3 {
    let d = v3(direction.x, direction.y, direction.z);
    let up = direction.y > 0.0;
    let (side, eta) = if up { (-1.0, ior) } else { (1.0, 1.0 / ior) };
    let (t, passes) = nephroid_math::optics::refract(d, v3(0.0, side, 0.0), eta);
    if passes && t.y * side < 0.0 { Vec3::new(t.x, t.y, t.z) } else { Vec3::new(0.0, -side, 0.0) }
}
