//! The volume program: one point per beam enters, the geometry stage emits the faces of its hull, and the fragment stage computes the light at each
//! receiver inside [SF05 §3.3, §3.4].
//!
//! Targets: caustic irradiance (W/m², RGB); if the layers are wanted, the sum of `E·ω` (ω: direction towards the light) and the number of volumes per
//! pixel.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec4};

use crate::passes::camera::CameraUniform;
use crate::passes::shadow_map::LightUniform;
use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::optics::beer_lambert_rgb;
use nephroid_math::vector::{V3, v2, v3, v4};
use nephroid_pipeline::sampler::sample_compare;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Geometry, GeometryInput, GeometryOutput, GeometryShader, Interpolation, Program,
    Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::GeometryTopology;
use nephroid_pipeline::{BindingKind, Bindings};
use nephroid_scene::Radiometry;

use super::hull::{MAX_FACES, hull};
use super::needle::{FOCUSED, Needle, is_focused, is_narrow, is_near};
use crate::beams::Beam;
use crate::beams::geometry::double_area;

/// Uniforms of the volumes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VolumeUniform {
    /// x: height of the bottom cap, m. y: slack per unit of clip w, m. z: 1 if vertices are tested against the map through air. w: 1 if faces towards
    /// the eye are drawn, −1 if faces away from the eye are drawn.
    pub shape: Vec4,
    /// Extinction coefficient c(λ), 1/m. w: 1, or −1 if the beams are upside down ([`crate::beams::LightBeams::side`]).
    pub sigma_t: Vec4,
}

/// Bindings: camera, volumes, light, beams, position, normal, visibility, map through air, comparison sampler.
pub const BINDINGS: [BindingKind; 9] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<VolumeUniform>()),
    BindingKind::Uniform(size_of::<LightUniform>()),
    BindingKind::Storage(size_of::<Beam>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::DepthTexture,
    BindingKind::ComparisonSampler,
];

/// The program.
#[must_use]
pub fn program(radiometry: Radiometry) -> Arc<Program> {
    let flat = |name, components| Varying { name, components, interpolation: Interpolation::Flat };
    Arc::new(Program {
        geometry: Some(Geometry {
            shader: Arc::new(HullGeometry),
            output: GeometryTopology::TriangleStrip,
            max_vertices: 3 * MAX_FACES,
            input_varyings: Vec::new(),
        }),
        varyings: vec![flat("beam", 2), flat("visibility", 3)],
        bindings: BINDINGS.to_vec(),
        may_discard: true,
        wgsl: Some(concat!(
            include_str!("../../math/optics.wgsl"),
            include_str!("../passes/camera.wgsl"),
            include_str!("../beams/geometry.wgsl"),
            include_str!("needle.wgsl"),
            include_str!("shaders.wgsl")
        )),
        wgsl_constants: vec![("paper", f64::from(u8::from(radiometry == Radiometry::Paper)))],
        ..match radiometry {
            Radiometry::Paper => Program::new("caustic_volume", BeamVertex, VolumeFragment::<true>),
            Radiometry::Physical => Program::new("caustic_volume", BeamVertex, VolumeFragment::<false>),
        }
    })
}

/// A beam's number travels as a page and a place on it.
const BEAMS_PER_PAGE: u32 = 4096;

/// Passes one point per beam. The geometry stage finds the beam by the primitive's number.
struct BeamVertex;

impl VertexShader for BeamVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let zero = L::splat(input.token, 0.0);
        output.position = v4(zero, zero, zero, zero.like(1.0));
    }
}

struct HullGeometry;

impl GeometryShader for HullGeometry {
    fn geometry(&self, bindings: &Bindings<'_>, input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let volume: &VolumeUniform = bindings.uniform(1);
        let beams: &[Beam] = bindings.storage(3);
        let Some(beam) = beams.get(input.primitive_id as usize) else { return };
        let side = volume.sigma_t.w;
        // A number of more than 24 bits is not exact in one varying.
        let number = input.primitive_id;
        let mut varyings = [(number / BEAMS_PER_PAGE) as f32, (number % BEAMS_PER_PAGE) as f32, 1.0, 1.0, 1.0];
        if volume.shape.z > 0.0 {
            // Shadows of objects above the water, sampled once per vertex of the mesh.
            let light: &LightUniform = bindings.uniform(2);
            for (lit, g) in varyings[2..].iter_mut().zip(&beam.g) {
                let (uv, depth, inside) = light.on_straight_map(v3(g.x, g.y * side, g.z));
                if inside {
                    *lit = sample_compare(bindings.texture(7), &bindings.sampler(8), uv, 0, depth);
                }
            }
            if varyings[2..] == [0.0; 3] {
                return;
            }
        }
        let bottom_y = volume.shape.x;
        let top = beam.g.map(|g| DVec3::new(f64::from(g.x), f64::from(g.y), f64::from(g.z)));
        let section = beam.section(bottom_y);
        let bottom = section.map(|at| DVec3::new(f64::from(at.x), f64::from(bottom_y), f64::from(at.y)));
        // A sixteenth of a pixel is sixteen steps of the rasterizer's grid: more than snapping and projection can move an edge.
        let project = |p: DVec3| camera.project(v3(p.x as f32, p.y as f32 * side, p.z as f32));
        let slack = |p: DVec3| {
            let clip = project(p);
            f64::from(volume.shape.y * clip.w.max(0.1))
        };
        let (at_top, at_bottom) = reach(beam, bottom_y, slack(top[0]), slack(bottom[0]).max(slack(bottom[1])).max(slack(bottom[2])));
        // A crest above the lowest trough is not raised together with the water below it (`CameraUniform::raise`). This bends the beam at the trough
        // by at most `bend`, measured from the hull's top. What is above the water is not raised.
        let (level, ratio) = (camera.water.x, camera.water.y);
        let bend = |i: usize| {
            let (g, d) = (beam.g[i], beam.d[i]);
            let above = if side > 0.0 { (g.y + at_top as f32 - level).max(0.0) } else { 0.0 };
            f64::from(above * (1.0 - ratio) / ratio * (d.x * d.x + d.z * d.z).sqrt())
        };
        let bent = bend(0).max(bend(1)).max(bend(2));
        let hull = hull(top, bottom, at_top, at_bottom, bent);
        let clip = hull.corners.map(|p| {
            let clip = project(p);
            [clip.x, clip.y, clip.z, clip.w]
        });
        for &face in hull.faces() {
            // Turned over, a hull winds the other way.
            let face = if side > 0.0 { face } else { [face[0], face[2], face[1]] };
            if faces_otherwise(face.map(|corner| clip[usize::from(corner)]), volume.shape.w) {
                continue;
            }
            for corner in face {
                output.emit(clip[usize::from(corner)], 1.0, &varyings);
            }
            output.end_primitive();
        }
    }
}

/// Twice the area of a beam's generator, seen from above, m².
#[inline(always)]
fn generator_of(beam: &Beam) -> f32 {
    double_area(&beam.g.map(|g| v2(g.x, g.z)))
}

/// How far the hull reaches beyond a beam's sections at its top and its bottom, m, from the slacks there, which are sixteenths of a pixel: a section that is
/// narrower than a pixel lights pixels beside it, up to half the diagonal of its square away.
fn reach(beam: &Beam, bottom_y: f32, top_slack: f64, bottom_slack: f64) -> (f64, f64) {
    const SQUARE_SLACKS: f64 = 12.0;
    // Height over the longest edge, as signed as the section.
    let generator = generator_of(beam).abs();
    let height = |y: f32| {
        let corners = beam.section(y);
        let longest = (0..3).map(|i| corners[(i + 1) % 3] - corners[i]).map(|e| e.dot(e)).fold(f32::MIN_POSITIVE, f32::max);
        f64::from(double_area(&corners) / longest.sqrt())
    };
    let beside = |height: f64, slack: f64| slack * (1.0 + SQUARE_SLACKS * (1.0625 - height.abs() / (16.0 * slack)).clamp(0.0, 1.0));
    let top_y = beam.g[0].y.min(beam.g[1].y).min(beam.g[2].y);
    // The area is quadratic in the depth: three sections see a turn that the two ends do not.
    let levels = [top_y, 0.5 * (top_y + bottom_y), bottom_y];
    let [top, middle, bottom] = levels.map(height);
    let turns = middle * top <= 0.0 || middle * bottom <= 0.0;
    if !turns && levels.iter().all(|&y| double_area(&beam.section(y)).abs() > 2.0 * FOCUSED * generator) {
        return (top_slack, bottom_slack);
    }
    let middle_slack = 0.5 * (top_slack + bottom_slack);
    let (at_top, at_bottom) = (beside(top, top_slack), beside(bottom, bottom_slack));
    let between = beside(if turns { 0.0 } else { middle }, middle_slack);
    // The hull widens evenly on the way.
    let missing = (between - 0.5 * (at_top + at_bottom)).max(0.0);
    (at_top + missing, at_bottom + missing)
}

/// Whether a face clearly has the orientation that is culled, so that it need not be emitted. `wanted` is 1 for faces towards the eye.
///
/// The orientation is the sign of `det(x, y, w)` of the corners, as in homogeneous rasterization. Where it is near zero, the pipeline decides.
fn faces_otherwise(corners: [[f32; 4]; 3], wanted: f32) -> bool {
    let [a, b, c] = corners.map(|[x, y, _, w]| DVec3::new(f64::from(x), f64::from(y), f64::from(w)));
    let doubtful = 1.0e-6 * a.length() * b.length() * c.length();
    a.dot(b.cross(c)) * f64::from(wanted) < -doubtful
}

struct VolumeFragment<const PAPER: bool>;

impl<const PAPER: bool> FragmentShader for VolumeFragment<PAPER> {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let volume: &VolumeUniform = bindings.uniform(1);
        let flat = input.flat_varyings();
        let number = flat[0] as usize * BEAMS_PER_PAGE as usize + flat[1] as usize;
        let beam = &bindings.storage::<Beam>(3)[number];
        let position = bindings.texture(4);
        let side = volume.sigma_t.w;
        let p_ws: V3<L> = input.texel3_here(position);
        let p = v3(p_ws.x, p_ws.y * side, p_ws.z);
        let zero = p.x.like(0.0);

        // Intersect the three rays with the plane y = P.y; the result is a triangle in x and z [SF05 §3.3].
        let corners = beam.section(p.y);
        let double_area = double_area(&corners);
        let positive = double_area.gt(zero);

        // Both beams of an edge evaluate it from the same end, so they get the same number, and a point on the edge belongs to exactly one of them.
        // Behind a focus the triangle has the opposite orientation, and the signs of its edges are reversed [decision E5].
        let at = v2(p.x, p.z);
        let mut weight = [zero; 3];
        let mut inside = p.y.ge(zero.like(volume.shape.x));
        for i in 0..3 {
            let j = (i + 1) % 3;
            let first = beam.g[i].w > 0.0;
            let (from, to) = if first { (corners[i], corners[j]) } else { (corners[j], corners[i]) };
            let side = (to - from).perp_dot(at - from);
            let not_negative = side.ge(zero);
            // The interior is on the non-negative side of the edge where `first` and `positive` are equal, otherwise on the negative side.
            inside = inside
                & if first {
                    (positive & not_negative) | (!positive & !not_negative)
                } else {
                    (positive & !not_negative) | (!positive & not_negative)
                };
            weight[(i + 2) % 3] = if first { side } else { -side };
        }
        // Around a focus a section is narrower than a pixel, and lights pixels beside it.
        let generator = zero.like(generator_of(beam).abs());
        let focused = is_focused(double_area, generator);
        let middle = inside;
        let (mut narrow, mut pixel) = (zero.lt(zero), zero);
        if focused.any() {
            let camera: &CameraUniform = bindings.uniform(0);
            pixel = camera.pixel_m(p_ws);
            let needles = focused & is_narrow(&corners, double_area, pixel);
            narrow = needles & is_near(&corners, at, pixel) & p.y.ge(zero.like(volume.shape.x));
            inside = inside & !needles;
        }
        if !(inside | narrow).any() {
            output.keep = inside;
            return;
        }
        let inv_area = zero.like(1.0) / double_area;
        let mut b = [weight[0] * inv_area, weight[1] * inv_area, weight[2] * inv_area];
        let (mut area, mut share) = (double_area.abs() * 0.5, zero.like(1.0));
        if narrow.any() {
            let needle = Needle::of(&corners, double_area, pixel);
            share = L::select(narrow, needle.coverage(at), share);
            inside = inside | (narrow & share.gt(zero));
            area = L::select(narrow, needle.area(), area);
            for (b, near) in b.iter_mut().zip(needle.weights(at)) {
                *b = L::select(narrow, near, *b);
            }
        }
        output.keep = inside;
        if !inside.any() {
            return;
        }
        let below = b[0] * beam.depth(0, p.y) + b[1] * beam.depth(1, p.y) + b[2] * beam.depth(2, p.y);
        let mut keep = inside & below.gt(zero);
        let travelled = beam.path_length(b, p.y);

        // F_P = A_gen/A_P times I₀ is flux over area [SF05 §3.4], attenuated per wavelength over the distance in water.
        let area = beam.lit_area(area);
        let visible = input.texel_here(bindings.texture(6), 0);
        let lit = b[0] * flat[2] + b[1] * flat[3] + b[2] * flat[4];
        let mut scale = visible * Lanes::clamp(lit, 0.0, 1.0) * share / area;
        let ray = beam.ray(b);
        if !PAPER {
            // The section is level: cos θ_obj/cos θ_p is −N·ray, with the ray per metre of depth [decision E1].
            let n = input.texel3_here(bindings.texture(5));
            let n = v3(n.x, n.y * side, n.z);
            scale = scale * Lanes::max(-n.dot(ray), zero);
        }
        let exists = input.texel_here(position, 3).equals(zero.like(1.0));
        keep = keep & exists & scale.gt(zero);
        output.keep = keep;
        if !keep.any() {
            return;
        }
        let flux = V3::splat(input.token, beam.flux.truncate());
        let irradiance = flux.hadamard(beer_lambert_rgb(volume.sigma_t.truncate(), travelled)) * scale;
        let total = irradiance.x + irradiance.y + irradiance.z;
        // Direction towards the light, weighted by the light's irradiance.
        let direction = -ray.normalize() * total;
        let direction = v3(direction.x, direction.y * side, direction.z);
        output.color[0] = v4(irradiance.x, irradiance.y, irradiance.z, zero);
        output.color[1] = v4(direction.x, direction.y, direction.z, total);
        output.color[2] = v4(L::select(middle, zero.like(1.0), zero), zero, zero, zero);
    }
}
