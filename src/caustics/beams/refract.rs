//! Refraction at the surface: beams and their flux.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use nephroid_math::optics::{fresnel_transmittance, refract};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::water::HeightField;
use nephroid_scene::{Incident, Light};

use super::{Beam, FluxModel, LightBeams, NONE, SurfaceEnergy, comes_first};

/// A vertex of the mesh with its refracted ray.
#[derive(Clone, Copy)]
struct Refracted {
    position: Vec3,
    /// Refracted ray per metre of depth, and its length; `None` if it does not go down.
    ray: Option<(Vec3, f32)>,
    light_direction: Vec3,
    irradiance: Vec3,
    transmittance: f32,
}

/// Refracts a light at every vertex and makes a beam of every lit triangle, in parallel. Results are in mesh order.
#[must_use]
pub fn light_beams(field: &HeightField, light: &Light, ior: f32, flux_model: FluxModel) -> LightBeams {
    let columns = field.columns;
    // Directional light is the same everywhere. Computing it takes longer than refracting it, so it is computed once.
    let parallel = matches!(light, Light::Directional { .. }).then(|| light.incident(Vec3::ZERO));
    let vertices: Vec<Refracted> = (0..field.heights_ws.len() as u32)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let position = field.position_ws(i % columns, i / columns);
            refract_vertex(position, field.normals_ws[i as usize], &parallel.unwrap_or_else(|| light.incident(position)), ior)
        })
        .collect();
    let flat = flat_transmittance(field, light, ior);
    let indices = field.triangle_indices();
    let (mut beams, energies): (Vec<Beam>, Vec<SurfaceEnergy>) = indices
        .par_chunks_exact(3)
        .with_min_len(1024)
        .map(|t| {
            let (made, energy) = beam([0, 1, 2].map(|k| vertices[t[k] as usize]), flux_model, flat);
            // A triangle without area has no beam.
            (made.unwrap_or_default(), energy)
        })
        .unzip();
    let vertex_ray = |v: &Refracted| match v.ray {
        Some((ray, length)) => [v.position.extend(0.0), Vec4::new(ray.x, length, ray.z, 0.0)],
        None => [Vec4::NAN; 2],
    };
    let mut out = LightBeams { vertex_rays: vertices.iter().map(vertex_ray).collect(), ..LightBeams::default() };
    // Summed in mesh order on one thread: the same bits for any number of threads.
    energies.iter().for_each(|energy| out.energy.add(energy));
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

fn to_v3(v: Vec3) -> V3<f32> {
    v3(v.x, v.y, v.z)
}

fn refract_vertex(position: Vec3, normal: Vec3, incident: &Incident, ior: f32) -> Refracted {
    let direction = incident.direction_ws;
    let cos = -direction.dot(normal);
    let (t, enters) = refract(to_v3(direction), to_v3(normal), 1.0 / ior);
    // A nearly horizontal ray would reach the floor a thousand depths away.
    let ray = (enters && cos > 0.0 && t.y < -1.0e-3).then(|| {
        let per_depth = 1.0 / -t.y;
        (Vec3::new(t.x * per_depth, -1.0, t.z * per_depth), per_depth)
    });
    let transmittance = if cos > 0.0 { fresnel_transmittance(cos.min(1.0), 1.0, ior) } else { 0.0 };
    Refracted { position, ray, light_direction: direction, irradiance: incident.irradiance, transmittance }
}

/// Transmittance of the level surface at the centre of the water.
fn flat_transmittance(field: &HeightField, light: &Light, ior: f32) -> f32 {
    let middle = (field.position_ws(0, 0) + field.position_ws(field.columns - 1, field.rows - 1)) * 0.5;
    let cos = -light.incident(middle).direction_ws.y;
    if cos > 0.0 { fresnel_transmittance(cos, 1.0, ior) } else { 0.0 }
}

fn beam(v: [Refracted; 3], flux_model: FluxModel, flat_transmittance: f32) -> (Option<Beam>, SurfaceEnergy) {
    let [a, b, c] = v.map(|v| v.position);
    // Twice the area times the upward normal.
    let cross = (b - a).cross(c - a);
    let cross = if cross.y < 0.0 { -cross } else { cross };
    let area = 0.5 * cross.length();
    let mean = |f: fn(&Refracted) -> Vec3| (f(&v[0]) + f(&v[1]) + f(&v[2])) / 3.0;
    let direction = mean(|v| v.light_direction).normalize_or_zero();
    let across = (-direction.dot(cross) * 0.5).max(0.0);
    let incident = mean(|v| v.irradiance) * across;
    let transmittance = (v[0].transmittance + v[1].transmittance + v[2].transmittance) / 3.0;
    let sum = |v: Vec3| f64::from(v.x) + f64::from(v.y) + f64::from(v.z);
    let mut energy = SurfaceEnergy { incident: sum(incident), ..SurfaceEnergy::default() };
    let (Some(ra), Some(rb), Some(rc)) = (v[0].ray, v[1].ray, v[2].ray) else {
        energy.grazing = energy.incident;
        return (None, energy);
    };
    let entered = incident * transmittance;
    energy.entered = sum(entered);
    energy.reflected = energy.incident - energy.entered;
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
