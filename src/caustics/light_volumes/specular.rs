//! Beams of mirrors and glass, such as a ring on a table or a glass ball: future work of the paper [BO §5].
//!
//! The generators are the triangles that light meets first. From each of their vertices light is followed through reflections and refractions until
//! it has left mirrors and glass for good; its beam starts there. Where glass splits the light, both parts are followed. Three vertices make a beam
//! if their light has taken the same path: the same events at the same smooth pieces of surface.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::RenderError;
use crate::beams::{Beam, LightBeams, NONE, comes_first};
use crate::surfaces::{Path, Surfaces};
use nephroid_scene::geom::{Aabb, Mesh};
use nephroid_scene::{Light, Material, Radiometry, Scene};

use super::{LightVolumesError, MAX_BEAMS};

/// All surfaces of the scene, and the generators among them.
pub struct Specular {
    surfaces: Surfaces,
    /// Generators: meshes that are fine enough for beams, each with the number of its object in the scene.
    generators: Vec<(u32, Mesh)>,
}

/// Light at a vertex of a generator.
struct GeneratorVertex {
    /// Irradiance on a surface perpendicular to the light, W/m², linear RGB.
    irradiance: Vec3,
    direction: Vec3,
    /// Whether the light reaches the vertex.
    lit: bool,
    paths: Vec<Path>,
}

impl Specular {
    /// Reads the scene's objects; `None` if none is a mirror or glass. `edge`: longest edge of a generator's triangle, as a share of its object's
    /// size.
    ///
    /// # Errors
    /// If a mesh cannot be made or loaded, or is cut into more than [`MAX_BEAMS`] triangles.
    pub fn new(scene: &Scene, edge: f32) -> Result<Option<Self>, RenderError> {
        if !scene.objects.iter().any(|object| is_specular(&object.material)) {
            return Ok(None);
        }
        let (mut meshes, mut generators) = (Vec::new(), Vec::new());
        for (index, object) in scene.objects.iter().enumerate() {
            let mesh = scene.placed_mesh(index)?.mesh;
            if is_specular(&object.material) {
                let size = mesh.bounds().size().max_element();
                let fine = mesh.tessellated((edge * size).max(f32::MIN_POSITIVE), MAX_BEAMS as usize);
                let too_many = |_| LightVolumesError::TooManyGenerators { object: object.name.clone(), limit: MAX_BEAMS };
                generators.push((index as u32, fine.map_err(too_many)?));
            }
            meshes.push((mesh, object.material.clone()));
        }
        Ok(Some(Self { surfaces: Surfaces::new(meshes), generators }))
    }

    /// A light's beams, in the order of a space-filling curve. Light that travels upwards makes no beam.
    ///
    /// # Errors
    /// If there are more than [`MAX_BEAMS`] beams.
    pub fn beams(&self, light: &Light, radiometry: Radiometry) -> Result<LightBeams, RenderError> {
        let mut found: Vec<(u64, Beam)> = Vec::new();
        let mut out = LightBeams::default();
        let bounds = self.generators.iter().fold(Aabb::EMPTY, |all, (_, mesh)| all.union(mesh.bounds()));
        for (object, mesh) in &self.generators {
            let vertices: Vec<GeneratorVertex> = (0..mesh.positions.len())
                .into_par_iter()
                .with_min_len(64)
                .map(|i| self.vertex(*object, mesh.positions[i], mesh.normals[i], light))
                .collect();
            let made: Vec<(f64, Vec<Beam>)> = (0..mesh.triangle_count())
                .into_par_iter()
                .with_min_len(64)
                .map(|t| {
                    let [a, b, c] = [0, 1, 2].map(|k| mesh.indices[3 * t + k] as usize);
                    let positions = [a, b, c].map(|i| mesh.positions[i]);
                    beams_of(positions, [&vertices[a], &vertices[b], &vertices[c]], radiometry)
                })
                .collect();
            for (t, (incident, beams)) in made.into_iter().enumerate() {
                let middle = [0, 1, 2].map(|k| mesh.positions[mesh.indices[3 * t + k] as usize]).into_iter().sum::<Vec3>() / 3.0;
                out.energy.incident += incident;
                out.dark += u64::from(beams.is_empty());
                let place = curve_position((middle - bounds.min) / bounds.size().max(Vec3::splat(f32::MIN_POSITIVE)));
                found.extend(beams.into_iter().map(|beam| (place, beam)));
            }
            if found.len() as u64 > MAX_BEAMS {
                return Err(LightVolumesError::TooManyGenerators { object: format!("object {object}"), limit: MAX_BEAMS }.into());
            }
        }
        found.sort_by_key(|(place, _)| *place);
        out.beams = found.into_iter().map(|(_, beam)| beam).collect();
        out.energy.entered = out.beams.iter().map(|beam| beam.flux.truncate().as_dvec3().element_sum()).sum();
        out.energy.grazing = out.energy.incident - out.energy.entered;
        // Two beams correspond to the two triangles of a cell of a mesh.
        out.of_triangle = (0..out.beams.len() as u32).collect();
        out.of_triangle.resize(2 * cells(&out) as usize, NONE);
        Ok(out)
    }

    fn vertex(&self, object: u32, position: Vec3, normal: Vec3, light: &Light) -> GeneratorVertex {
        let incident = light.incident(position);
        let (lit, paths) = self.surfaces.paths(object, position, normal, light, incident.direction_ws);
        GeneratorVertex { irradiance: incident.irradiance, direction: incident.direction_ws, lit, paths }
    }
}

/// Number of pairs of beams. Each pair corresponds to a cell of a water mesh.
pub fn cells(beams: &LightBeams) -> u32 {
    (beams.beams.len() as u32).div_ceil(2).max(1)
}

fn is_specular(material: &Material) -> bool {
    !matches!(material, Material::Diffuse { .. })
}

/// Flux that arrives at a triangle, W summed over RGB, and the beams that this light makes.
fn beams_of(positions: [Vec3; 3], vertices: [&GeneratorVertex; 3], radiometry: Radiometry) -> (f64, Vec<Beam>) {
    let cross = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
    let area = 0.5 * cross.length();
    let direction = vertices.iter().map(|v| v.direction).sum::<Vec3>().normalize_or_zero();
    let across = 0.5 * direction.dot(cross).abs();
    let arriving = vertices.iter().map(|v| if v.lit { v.irradiance } else { Vec3::ZERO }).sum::<Vec3>() / 3.0;
    let counted = match radiometry {
        Radiometry::Physical => across,
        Radiometry::Paper => area,
    };
    let beams = vertices[0].paths.iter().filter_map(|first| {
        let same = |vertex: &GeneratorVertex| vertex.paths.iter().find(|path| path.hash == first.hash).copied();
        let paths = [*first, same(vertices[1])?, same(vertices[2])?];
        let carried: [Vec3; 3] =
            std::array::from_fn(|i| if vertices[i].lit { vertices[i].irradiance * paths[i].share } else { Vec3::ZERO });
        let mean = carried.iter().copied().sum::<Vec3>() / 3.0;
        if mean == Vec3::ZERO || !paths.iter().all(Path::goes_down) {
            return None;
        }
        Some(Beam {
            g: std::array::from_fn(|i| {
                let (p, q) = (paths[i].position, paths[(i + 1) % 3].position);
                p.extend(if comes_first(p, q) { 1.0 } else { -1.0 })
            }),
            d: std::array::from_fn(|i| {
                let per_depth = 1.0 / -paths[i].direction.y;
                let weight = carried[i].element_sum() / mean.element_sum();
                Vec4::new(paths[i].direction.x * per_depth, per_depth, paths[i].direction.z * per_depth, weight)
            }),
            flux: (mean * counted).extend(area),
        })
    });
    ((arriving * across).as_dvec3().element_sum(), beams.collect())
}

/// Position of a point of the unit cube on the Morton curve, 21 bits per axis.
fn curve_position(p: Vec3) -> u64 {
    let spread = |v: f32| {
        let cell = (v.clamp(0.0, 1.0) * 2_097_151.0) as u64;
        (0..21).fold(0, |bits, k| bits | (cell >> k & 1) << (3 * k))
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}
