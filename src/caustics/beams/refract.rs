//! Refraction at the surface: beams and their flux.

use std::borrow::Cow;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use nephroid_math::optics::{beer_lambert_rgb, fresnel_transmittance, refract};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::water::HeightField;
use nephroid_scene::{Incident, Light, Medium};

use super::{Beam, FluxModel, LightBeams, NONE, comes_first, window};
use crate::audit::{Audit, Entry};
use crate::passes::shadow_map::LightUniform;

/// A water surface and a light before it: above it, or upside down in the water.
pub struct Interface<'a> {
    /// The surface, which the light meets from above.
    pub field: Cow<'a, HeightField>,
    light: Light,
    /// Refractive index beyond the surface over that before it.
    ior: f32,
    /// Extinction coefficient before the surface, 1/m; for parallel light the coordinate along it at which it starts, m.
    before: (Vec3, f32),
    /// As [`LightBeams::sigma_t`].
    sigma_t: Vec3,
    /// As [`LightBeams::side`].
    pub side: f32,
}

/// A vertex of the mesh with its refracted ray.
#[derive(Clone, Copy)]
struct Refracted {
    position: Vec3,
    normal: Vec3,
    /// Refracted ray per metre of depth, and its length; why there is none, if it does not go down.
    ray: Result<(Vec3, f32), NoRay>,
    light_direction: Vec3,
    /// Position relative to a lamp, m.
    from_lamp: Vec3,
    /// What would arrive without the medium before the surface: irradiance across parallel light, W/m², or a lamp's intensity in this direction, W/sr.
    strength: Vec3,
    /// Share of it that the medium leaves.
    kept: Vec3,
    /// Irradiance across the light, W/m².
    irradiance: Vec3,
    transmittance: f32,
}

/// Why a vertex sends no ray down.
#[derive(Clone, Copy)]
enum NoRay {
    /// It faces away from the light.
    FacesAway,
    /// All light is reflected.
    ReflectsAll,
    /// The ray goes up.
    GoesUp,
    /// A nearly horizontal ray would reach the floor a thousand depths away.
    NearlyLevel,
}

/// Where the light on a triangle goes, W, summed over RGB.
#[derive(Clone, Copy, Default)]
struct TriangleEnergy {
    light_in: f64,
    absorbed: f64,
    reflected: f64,
    entered: f64,
    /// Of triangles that make no beam.
    no_beam: NoBeamEnergy,
}

/// Where the light goes on a triangle without a beam, corner by corner.
#[derive(Clone, Copy, Default)]
struct NoBeamEnergy {
    turned_away: f64,
    totally_reflected: f64,
    goes_away: f64,
    nearly_level: f64,
    split: f64,
}

impl<'a> Interface<'a> {
    /// The surface of water with a medium, as a light of the frame meets it.
    #[must_use]
    pub fn new(field: &'a HeightField, light: &Light, uniform: &LightUniform, medium: &Medium) -> Self {
        let (ior, before) = (uniform.water.z, (uniform.own.truncate(), uniform.own.w));
        if uniform.water.x < 0.0 {
            let field = Cow::Owned(window(field, light, 1.0 / ior).as_ref().unwrap_or(field).upside_down());
            return Self { field, light: light.upside_down(), ior, before, sigma_t: Vec3::ZERO, side: -1.0 };
        }
        Self { field: Cow::Borrowed(field), light: *light, ior, before, sigma_t: medium.sigma_t(), side: 1.0 }
    }

    /// Refracts the light at every vertex and makes a beam of every lit triangle, in parallel. Results are in mesh order.
    #[must_use]
    pub fn beams(&self, flux_model: FluxModel) -> LightBeams {
        let Self { field, light, ior, .. } = self;
        let columns = field.columns;
        // Directional light is the same everywhere. Computing it takes longer than refracting it, so it is computed once.
        let parallel = matches!(light, Light::Directional { .. }).then(|| light.incident(Vec3::ZERO));
        let vertices: Vec<Refracted> = (0..field.heights_ws.len() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let position = field.position_ws(i % columns, i / columns);
                self.refract_vertex(position, field.normals_ws[i as usize], &parallel.unwrap_or_else(|| light.incident(position)))
            })
            .collect();
        let flat = flat_transmittance(field, light, *ior);
        let indices = field.triangle_indices();
        let (mut beams, energies): (Vec<Beam>, Vec<TriangleEnergy>) = indices
            .par_chunks_exact(3)
            .with_min_len(1024)
            .map(|t| {
                let (made, energy) = beam([0, 1, 2].map(|k| vertices[t[k] as usize]), flux_model, flat, *ior);
                // A triangle without area has no beam.
                (made.unwrap_or_default(), energy)
            })
            .unzip();
        let vertex_ray = |v: &Refracted| match v.ray {
            Ok((ray, length)) => [v.position.extend(0.0), Vec4::new(ray.x, length, ray.z, 0.0)],
            Err(_) => [Vec4::NAN; 2],
        };
        let vertex_rays = vertices.iter().map(vertex_ray).collect();
        let mut out = LightBeams { vertex_rays, side: self.side, sigma_t: self.sigma_t, ..LightBeams::default() };
        // Summed in mesh order on one thread: the same bits for any number of threads.
        out.energy = summed(&energies);
        let mut next = 0..;
        let number = |beam: &Beam| if beam.flux.w > 0.0 { next.next().unwrap_or(NONE) } else { NONE };
        out.of_triangle = beams.iter().map(number).collect();
        out.dark = out.of_triangle.iter().filter(|&&number| number == NONE).count() as u64;
        if out.dark > 0 {
            beams.retain(|beam| beam.flux.w > 0.0);
        }
        out.beams = beams;
        out
    }

    fn refract_vertex(&self, position: Vec3, normal: Vec3, incident: &Incident) -> Refracted {
        let direction = incident.direction_ws;
        let cos = -direction.dot(normal);
        let (t, enters) = refract(to_v3(direction), to_v3(normal), 1.0 / self.ior);
        let per_depth = 1.0 / -t.y;
        let ray = match (cos > 0.0, enters) {
            (false, _) => Err(NoRay::FacesAway),
            (true, false) => Err(NoRay::ReflectsAll),
            _ if t.y < -LEAST_FALL => Ok((Vec3::new(t.x * per_depth, -1.0, t.z * per_depth), per_depth)),
            _ if t.y < 0.0 => Err(NoRay::NearlyLevel),
            _ => Err(NoRay::GoesUp),
        };
        let transmittance = if cos > 0.0 { fresnel_transmittance(cos.min(1.0), 1.0, self.ior) } else { 0.0 };
        let arriving = incident.irradiance;
        let (from_lamp, strength, distance) = match self.light {
            Light::Directional { .. } => (Vec3::ZERO, arriving, (position.dot(direction) - self.before.1).max(0.0)),
            Light::Point { position: lamp, .. } | Light::Spot { position: lamp, .. } => {
                let from = position - lamp;
                (from, arriving * from.length_squared(), from.length())
            }
        };
        let kept = beer_lambert_rgb(self.before.0, distance);
        let kept = if self.before.0 == Vec3::ZERO { Vec3::ONE } else { Vec3::new(kept.x, kept.y, kept.z) };
        Refracted {
            position,
            normal,
            ray,
            light_direction: direction,
            from_lamp,
            strength,
            kept,
            irradiance: arriving * kept,
            transmittance,
        }
    }
}

/// Least component of a refracted ray down.
const LEAST_FALL: f32 = 1.0e-3;

/// Solid angle from which on a triangle's transmittance is more than the mean of those at its corners, sr.
const WIDE_SR: f32 = 0.02;

/// Barycentric weights and weights of a rule for integrals over a triangle, exact for polynomials of degree 3.
const RULE: [([f32; 3], f32); 7] = [
    ([1.0, 0.0, 0.0], 3.0),
    ([0.0, 1.0, 0.0], 3.0),
    ([0.0, 0.0, 1.0], 3.0),
    ([0.5, 0.5, 0.0], 8.0),
    ([0.0, 0.5, 0.5], 8.0),
    ([0.5, 0.0, 0.5], 8.0),
    ([1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0], 27.0),
];

/// Share of a lamp's light that passes a triangle, where its angle changes much from corner to corner.
fn wide_transmittance(v: &[Refracted; 3], ior: f32) -> f32 {
    let (mut passed, mut arriving) = (0.0, 0.0);
    for (b, weight) in RULE {
        let mean = |f: fn(&Refracted) -> Vec3| f(&v[0]) * b[0] + f(&v[1]) * b[1] + f(&v[2]) * b[2];
        let from = mean(|v| v.from_lamp);
        let distance = from.length();
        let cos = -(from / distance).dot(mean(|v| v.normal).normalize());
        // In the plane of the triangle, light falls off as its distance cubed.
        let light = weight / (distance * distance * distance);
        passed += light * if cos > 0.0 { fresnel_transmittance(cos.min(1.0), 1.0, ior) } else { 0.0 };
        arriving += light;
    }
    passed / arriving
}

/// Solid angle of a triangle whose corners are given relative to the eye, sr, above 0 if its normal (anticlockwise) points away from the eye [Van Oosterom
/// & Strackee 1983].
fn solid_angle([a, b, c]: [Vec3; 3]) -> f32 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c));
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    (2.0 * libm::atan2(volume, below)) as f32
}

fn to_v3(v: Vec3) -> V3<f32> {
    v3(v.x, v.y, v.z)
}

/// Transmittance of the level surface at the centre of the water.
fn flat_transmittance(field: &HeightField, light: &Light, ior: f32) -> f32 {
    let middle = (field.position_ws(0, 0) + field.position_ws(field.columns - 1, field.rows - 1)) * 0.5;
    let cos = -light.incident(middle).direction_ws.y;
    if cos > 0.0 { fresnel_transmittance(cos, 1.0, ior) } else { 0.0 }
}

fn sum(v: Vec3) -> f64 {
    f64::from(v.x) + f64::from(v.y) + f64::from(v.z)
}

impl TriangleEnergy {
    /// Adds the light of a corner of a triangle that makes no beam. `measure`: the corner's part of the triangle's.
    fn corner_without_beam(&mut self, v: &Refracted, measure: f32) {
        let incident = v.strength * v.kept * measure;
        let (through, reflected) = (sum(incident * v.transmittance), sum(incident * (1.0 - v.transmittance)));
        let ends = &mut self.no_beam;
        match v.ray {
            Err(NoRay::FacesAway) => ends.turned_away += sum(incident),
            Err(NoRay::ReflectsAll) => ends.totally_reflected += sum(incident),
            Err(NoRay::GoesUp) => ends.goes_away += through,
            Err(NoRay::NearlyLevel) => ends.nearly_level += through,
            Ok(_) => ends.split += through,
        }
        if !matches!(v.ray, Err(NoRay::FacesAway | NoRay::ReflectsAll)) {
            self.reflected += reflected;
        }
    }
}

/// The audit of a surface up to where beams start.
fn summed(energies: &[TriangleEnergy]) -> Audit {
    let watts = energies.iter().fold([0.0; 9], |mut sums, e| {
        let n = &e.no_beam;
        let more =
            [e.light_in, e.absorbed, e.reflected, n.totally_reflected, n.turned_away, n.goes_away, n.nearly_level, n.split, e.entered];
        sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        sums
    });
    let mut audit = Audit::default();
    ENTRIES.into_iter().zip(watts).for_each(|(entry, watts)| audit.add(entry, watts));
    audit
}

/// Entries of the sums over triangles, in their order.
const ENTRIES: [Entry; 9] = [
    Entry::LightIn,
    Entry::AbsorbedBefore,
    Entry::Reflected,
    Entry::TotallyReflected,
    Entry::TurnedAway,
    Entry::GoesAway,
    Entry::NearlyLevel,
    Entry::SplitPaths,
    Entry::Entered,
];

fn beam(v: [Refracted; 3], flux_model: FluxModel, flat_transmittance: f32, ior: f32) -> (Option<Beam>, TriangleEnergy) {
    let [a, b, c] = v.map(|v| v.position);
    // Twice the area times the upward normal.
    let cross = (b - a).cross(c - a);
    let turned = cross.y < 0.0;
    let cross = if turned { -cross } else { cross };
    let area = 0.5 * cross.length();
    let mean = |f: fn(&Refracted) -> Vec3| (f(&v[0]) + f(&v[1]) + f(&v[2])) / 3.0;
    let direction = mean(|v| v.light_direction).normalize_or_zero();
    // The measure of what arrives: the area across parallel light, or the solid angle of a lamp's light. By its irradiance at the corners, light of a lamp
    // near a coarse mesh would be too bright by the square of an edge over its distance.
    let measure = if v[0].from_lamp == Vec3::ZERO {
        -direction.dot(cross) * 0.5
    } else {
        let seen = [v[0], v[1], v[2]].map(|v| v.from_lamp);
        if turned { solid_angle(seen) } else { -solid_angle(seen) }
    };
    let measure = measure.max(0.0);
    let incident = mean(|v| v.strength * v.kept) * measure;
    let transmittance = if v[0].from_lamp != Vec3::ZERO && measure > WIDE_SR {
        wide_transmittance(&v, ior)
    } else {
        (v[0].transmittance + v[1].transmittance + v[2].transmittance) / 3.0
    };
    let mut energy = TriangleEnergy {
        light_in: sum(mean(|v| v.strength) * measure),
        absorbed: sum(mean(|v| v.strength * (Vec3::ONE - v.kept)) * measure),
        ..TriangleEnergy::default()
    };
    let (Ok(ra), Ok(rb), Ok(rc)) = (v[0].ray, v[1].ray, v[2].ray) else {
        v.iter().for_each(|v| energy.corner_without_beam(v, measure / 3.0));
        return (None, energy);
    };
    let entered = incident * transmittance;
    energy.entered = sum(entered);
    energy.reflected = sum(incident * (1.0 - transmittance));
    let flux = match flux_model {
        FluxModel::Conserved => entered,
        FluxModel::FlatTransmittance => mean(|v| v.irradiance) * flat_transmittance * area,
        FluxModel::OwnTransmittance => mean(|v| v.irradiance) * transmittance * area,
    };
    if flux == Vec3::ZERO {
        return (None, energy);
    }
    let corners = [a, b, c];
    let order = |i: usize| if comes_first(corners[i], corners[(i + 1) % 3]) { 1.0 } else { -1.0 };
    let rays = [ra, rb, rc];
    let beam = Beam {
        g: [0, 1, 2].map(|i: usize| corners[i].extend(order(i))),
        d: [0, 1, 2].map(|i: usize| Vec4::new(rays[i].0.x, rays[i].1, rays[i].0.z, v[i].transmittance / transmittance)),
        flux: flux.extend(area),
    };
    (Some(beam), energy)
}
