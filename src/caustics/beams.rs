//! Generators and their refracted rays: one beam per triangle of the water mesh and light [SF05 §3.2, BO §3.2].

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use rayon::prelude::*;

use nephroid_math::optics::{fresnel_transmittance, refract};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::water::HeightField;
use nephroid_scene::{Incident, Light};

/// No beam.
pub const NONE: u32 = u32::MAX;

/// How much light a beam carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// The flux `E⊥·|ω·n|·A·T`, with E⊥ and T the means of the vertices, n and A the triangle's own: no light is made or lost.
    Conserved,
    /// `E⊥·T·A`, with T that of the mean surface: no cosine [SF05 §3.4].
    FlatTransmittance,
    /// `E⊥·T·A`, with T the mean of the vertices: no cosine [BO §3.1].
    OwnTransmittance,
}

/// A caustic volume: the light that goes through one triangle of the water mesh.
///
/// Vertex i of the cross-section at height y is at `g.xz + (g.y − y)·d.xz`, [SF05 §3.3]'s intersection of the refracted ray with the plane Π.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Beam {
    /// Generator triangle, metres; w is ±1: which end of the edge i → i+1 comes first in the order that both
    /// neighbours agree on.
    pub g: [Vec4; 3],
    /// Refracted rays per metre of depth: x, length of the ray, z; w is the vertex's transmittance over the mean of the three.
    pub d: [Vec4; 3],
    /// What it carries as [`Count`] says, W, linear RGB; w is the generator's area in m².
    pub flux: Vec4,
}

impl Beam {
    /// Along which diagonals its walls are cut: bit i is set if that along the edge i → i+1 starts from the edge's start.
    #[must_use]
    pub fn cuts(&self) -> usize {
        (0..3).filter(|&i| self.g[i].w > 0.0).fold(0, |cuts, i| cuts | 1 << i)
    }

    /// Cross-section at height `y`, x and z of the three vertices.
    #[must_use]
    pub fn section(&self, y: f32) -> [[f32; 2]; 3] {
        [0, 1, 2].map(|i: usize| {
            let t = self.g[i].y - y;
            [self.g[i].x + self.d[i].x * t, self.g[i].z + self.d[i].z * t]
        })
    }

    /// Signed area of the cross-section at height `y`, m².
    #[must_use]
    pub fn section_area(&self, y: f32) -> f32 {
        let [a, b, c] = self.section(y);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    }
}

/// What happened to a light's energy at the surface, in watts summed over RGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceEnergy {
    /// On the water.
    pub incident: f64,
    /// Sent back by Fresnel's law.
    pub reflected: f64,
    /// Into the water.
    pub entered: f64,
    /// Of triangles that face away from the light, or whose rays do not go down.
    pub grazing: f64,
}

impl SurfaceEnergy {
    fn add(&mut self, other: &Self) {
        self.incident += other.incident;
        self.reflected += other.reflected;
        self.entered += other.entered;
        self.grazing += other.grazing;
    }
}

/// A light's beams through a water surface.
#[derive(Clone, Debug, Default)]
pub struct LightBeams {
    /// In the order of the mesh's triangles, without those that carry no light.
    pub beams: Vec<Beam>,
    /// Per triangle of the mesh, its beam; [`NONE`] for those that carry no light.
    pub of_triangle: Vec<u32>,
    /// Per vertex of a water mesh, its position (m) and its refracted ray per metre of depth as in [`Beam`]; without a ray both are not
    /// numbers. Beams of other generators have none.
    pub corners: Vec<[Vec4; 2]>,
    /// Energy at the surface.
    pub energy: SurfaceEnergy,
    /// Triangles without a beam.
    pub dark: u64,
}

/// A vertex of the mesh with its refracted ray.
#[derive(Clone, Copy)]
struct Refracted {
    position: Vec3,
    /// Ray per metre of depth, and its length; `None` if it does not go down.
    ray: Option<(Vec3, f32)>,
    light_direction: Vec3,
    irradiance: Vec3,
    transmittance: f32,
}

/// Refracts a light at every vertex and makes a beam of every triangle, in parallel; results are in mesh order.
#[must_use]
pub fn light_beams(field: &HeightField, light: &Light, ior: f32, count: Count) -> LightBeams {
    let columns = field.columns;
    // Parallel light is the same everywhere, and takes longer to ask for than to refract.
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
            let (made, energy) = beam([0, 1, 2].map(|k| vertices[t[k] as usize]), count, flat);
            // Without an area there is no beam.
            (made.unwrap_or_default(), energy)
        })
        .unzip();
    let corner = |v: &Refracted| match v.ray {
        Some((ray, length)) => [v.position.extend(0.0), Vec4::new(ray.x, length, ray.z, 0.0)],
        None => [Vec4::NAN; 2],
    };
    let mut out = LightBeams { corners: vertices.iter().map(corner).collect(), ..LightBeams::default() };
    // Summed in mesh order on one thread: the same bits for any number of them.
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
    // A ray that is all but level would reach the floor a mile away.
    let ray = (enters && cos > 0.0 && t.y < -1.0e-3).then(|| {
        let per_depth = 1.0 / -t.y;
        (Vec3::new(t.x * per_depth, -1.0, t.z * per_depth), per_depth)
    });
    let transmittance = if cos > 0.0 { fresnel_transmittance(cos.min(1.0), 1.0, ior) } else { 0.0 };
    Refracted { position, ray, light_direction: direction, irradiance: incident.irradiance, transmittance }
}

/// Transmittance of the mean surface at the middle of the water.
fn flat_transmittance(field: &HeightField, light: &Light, ior: f32) -> f32 {
    let middle = (field.position_ws(0, 0) + field.position_ws(field.columns - 1, field.rows - 1)) * 0.5;
    let cos = -light.incident(middle).direction_ws.y;
    if cos > 0.0 { fresnel_transmittance(cos, 1.0, ior) } else { 0.0 }
}

fn beam(v: [Refracted; 3], count: Count, flat_transmittance: f32) -> (Option<Beam>, SurfaceEnergy) {
    let [a, b, c] = v.map(|v| v.position);
    // Twice the area, along the normal that points up.
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
    let flux = match count {
        Count::Conserved => entered,
        Count::FlatTransmittance => mean(|v| v.irradiance) * flat_transmittance * area,
        Count::OwnTransmittance => mean(|v| v.irradiance) * transmittance * area,
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

/// Which of two corners comes first: both beams at an edge must evaluate it from the same end.
#[must_use]
pub fn comes_first(p: Vec3, q: Vec3) -> bool {
    (p.x, p.z, p.y) < (q.x, q.z, q.y)
}

/// Where the light of all beams goes, in watts summed over RGB.
///
/// With `water` for the generators: `water_incident = surface_reflected + surface_grazing + water_entered`, and `beams_carry = absorbed_above_bottom + reached_bottom` (`beams_carry` is
/// `water_entered` in physical radiometry) on the level
/// of the volumes' bottom cap, for beams that nothing blocks.
#[must_use]
pub fn audit(generators: &str, beams: &[LightBeams], sigma_t: Vec3, bottom_y: f32) -> Vec<(String, f64)> {
    let mut energy = SurfaceEnergy::default();
    let mut bottom = 0.0;
    let mut carried = 0.0;
    for light in beams {
        energy.incident += light.energy.incident;
        energy.reflected += light.energy.reflected;
        energy.entered += light.energy.entered;
        energy.grazing += light.energy.grazing;
        let left = |beam: &Beam| {
            let length = [0, 1, 2].map(|i: usize| (beam.g[i].y - bottom_y) * beam.d[i].y).iter().sum::<f32>() / 3.0;
            sigma_t.to_array().map(|sigma| libm::exp(f64::from(-sigma * length.max(0.0))))
        };
        // Exponentials in parallel, sums in the order of the beams: the same bits on any number of threads.
        let shares: Vec<[f64; 3]> = light.beams.par_iter().with_min_len(1024).map(left).collect();
        for (beam, left) in light.beams.iter().zip(shares) {
            for (flux, left) in beam.flux.to_array().into_iter().zip(left) {
                carried += f64::from(flux);
                bottom += f64::from(flux) * left;
            }
        }
    }
    let entry = |name: &str, watts| (name.to_owned(), watts);
    vec![
        entry(&format!("{generators}_incident"), energy.incident),
        entry("surface_reflected", energy.reflected),
        entry("surface_grazing", energy.grazing),
        entry(&format!("{generators}_entered"), energy.entered),
        entry("beams_carry", carried),
        entry("absorbed_above_bottom", carried - bottom),
        entry("reached_bottom", bottom),
    ]
}
