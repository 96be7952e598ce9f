//! Beams of mirrors and glass, such as a ring on a table or a glass ball: future work of the paper [BO §5].
//!
//! The generators are the triangles that light meets first. From each of their vertices light is followed through reflections and refractions until
//! it has left mirrors and glass for good; its beam starts there. Where glass splits the light, both parts are followed. Three vertices make a beam
//! if their light has taken the same path: the same events at the same smooth pieces of surface.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::RenderError;
use crate::audit::{Audit, Entry};
use crate::beams::{Beam, LightBeams, NONE, comes_first};
use crate::surfaces::{Losses, Path, Surfaces};
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
    /// Shares of its light that do not get to the end of a path.
    losses: Losses,
}

/// Triangles of a task. It does not depend on the number of threads.
const PART: usize = 256;

/// Entries of light that is followed, or not, through mirrors and glass.
const COUNTED: [Entry; 14] = [
    Entry::LightIn,
    Entry::ByMirrors,
    Entry::InGlass,
    Entry::GoesAway,
    Entry::NearlyLevel,
    Entry::SplitPaths,
    Entry::TooManyEvents,
    Entry::TooWeak,
    Entry::WrongSide,
    Entry::StaysInGlass,
    Entry::Entered,
    Entry::Carried,
    Entry::Missed,
    Entry::Landed,
];

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
        let mut found: Vec<(u64, (Beam, f32))> = Vec::new();
        let mut out = LightBeams { energy: Audit::of(&COUNTED), ..LightBeams::default() };
        let bounds = self.generators.iter().fold(Aabb::EMPTY, |all, (_, mesh)| all.union(mesh.bounds()));
        for (object, mesh) in &self.generators {
            let vertices: Vec<GeneratorVertex> = (0..mesh.positions.len())
                .into_par_iter()
                .with_min_len(64)
                .map(|i| self.vertex(*object, mesh.positions[i], mesh.normals[i], light))
                .collect();
            let count = mesh.triangle_count();
            let part = |part: usize| {
                let (mut beams, mut audit, mut dark) = (Vec::new(), Audit::default(), 0);
                for t in part * PART..((part + 1) * PART).min(count) {
                    let corners = [0, 1, 2].map(|k| mesh.indices[3 * t + k] as usize);
                    let positions = corners.map(|i| mesh.positions[i]);
                    let triangle = Triangle::new(positions, corners.map(|i| &vertices[i]), radiometry);
                    let middle = positions.into_iter().sum::<Vec3>() / 3.0;
                    let place = curve_position((middle - bounds.min) / bounds.size().max(Vec3::splat(f32::MIN_POSITIVE)));
                    let before = beams.len();
                    beams.extend(triangle.beams(&mut audit).map(|beam| (place, beam)));
                    dark += u64::from(beams.len() == before);
                }
                (beams, audit, dark)
            };
            let parts: Vec<_> = (0..count.div_ceil(PART)).into_par_iter().map(part).collect();
            for (beams, audit, dark) in parts {
                found.extend(beams);
                out.energy.merge(&audit);
                out.dark += dark;
            }
            if found.len() as u64 > MAX_BEAMS {
                return Err(LightVolumesError::TooManyGenerators { object: format!("object {object}"), limit: MAX_BEAMS }.into());
            }
        }
        found.sort_by_key(|(place, _)| *place);
        (out.beams, out.ends_y) = found.into_iter().map(|(_, beam)| beam).unzip();
        // Two beams correspond to the two triangles of a cell of a mesh.
        out.of_triangle = (0..out.beams.len() as u32).collect();
        out.of_triangle.resize(2 * cells(&out) as usize, NONE);
        Ok(out)
    }

    fn vertex(&self, object: u32, position: Vec3, normal: Vec3, light: &Light) -> GeneratorVertex {
        let incident = light.incident(position);
        let (lit, paths, losses) = self.surfaces.paths(object, position, normal, light, incident.direction_ws);
        GeneratorVertex { irradiance: incident.irradiance, direction: incident.direction_ws, lit, paths, losses }
    }
}

/// Number of pairs of beams. Each pair corresponds to a cell of a water mesh.
pub fn cells(beams: &LightBeams) -> u32 {
    (beams.beams.len() as u32).div_ceil(2).max(1)
}

fn is_specular(material: &Material) -> bool {
    !matches!(material, Material::Diffuse { .. })
}

/// A triangle of a generator.
struct Triangle<'a> {
    vertices: [&'a GeneratorVertex; 3],
    area: f32,
    /// Area across the light, m².
    across: f32,
    /// The area by which the radiometry multiplies irradiance, m².
    counted: f32,
}

impl<'a> Triangle<'a> {
    fn new(positions: [Vec3; 3], vertices: [&'a GeneratorVertex; 3], radiometry: Radiometry) -> Self {
        let cross = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
        let area = 0.5 * cross.length();
        let direction = vertices.iter().map(|v| v.direction).sum::<Vec3>().normalize_or_zero();
        let across = 0.5 * direction.dot(cross).abs();
        let counted = match radiometry {
            Radiometry::Physical => across,
            Radiometry::Paper => area,
        };
        Self { vertices, area, across, counted }
    }

    /// The beams that the light on it makes. All of its light is counted, corner by corner.
    fn beams(&self, audit: &mut Audit) -> impl Iterator<Item = (Beam, f32)> {
        for vertex in self.vertices.iter().filter(|vertex| vertex.lit) {
            let arriving = vertex.irradiance * (self.across / 3.0);
            audit.add(Entry::LightIn, watts(arriving));
            for (entry, share) in vertex.losses.each() {
                if share != Vec3::ZERO {
                    audit.add(entry, watts(arriving * share));
                }
            }
            for path in &vertex.paths {
                let light = watts(arriving * path.share);
                let end = match self.paths(path.hash) {
                    _ if path.direction.y >= 0.0 => Entry::GoesAway,
                    _ if !path.goes_down() => Entry::NearlyLevel,
                    Some(paths) if paths.iter().all(|path| path.goes_down()) => Entry::Entered,
                    _ => Entry::SplitPaths,
                };
                audit.add(end, light);
                if end == Entry::Entered {
                    let carried = watts(vertex.irradiance * path.share * (self.counted / 3.0));
                    audit.add(if path.lands_y.is_some() { Entry::Landed } else { Entry::Missed }, carried);
                }
            }
        }
        let of = |first: &Path| {
            let paths = self.paths(first.hash)?;
            Some((self.beam(&paths)?, end_of(&paths)))
        };
        let beams: Vec<(Beam, f32)> = self.vertices[0].paths.iter().filter_map(of).collect();
        for (beam, _) in &beams {
            audit.add(Entry::Carried, watts(beam.flux.truncate()));
        }
        beams.into_iter()
    }

    /// The paths of the three corners that took a way; `None` if not all did.
    fn paths(&self, hash: u64) -> Option<[Path; 3]> {
        let of = |vertex: &GeneratorVertex| vertex.paths.iter().find(|path| path.hash == hash).copied();
        Some([of(self.vertices[0])?, of(self.vertices[1])?, of(self.vertices[2])?])
    }

    fn beam(&self, paths: &[Path; 3]) -> Option<Beam> {
        let vertices = &self.vertices;
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
            flux: (mean * self.counted).extend(self.area),
        })
    }
}

/// Height below which a beam with these paths at its corners lights nothing, m: all corners land above it. Between them the receiver may lie lower by as much
/// again as they differ. Minus infinity if a corner's light leaves the scene, so that what its neighbours light may lie anywhere.
fn end_of(paths: &[Path; 3]) -> f32 {
    let heights = paths.map(|path| path.lands_y.unwrap_or(f32::NEG_INFINITY));
    let (low, high) = heights.into_iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    if low == f32::NEG_INFINITY { low } else { low - (high - low) }
}

fn watts(light: Vec3) -> f64 {
    light.as_dvec3().element_sum()
}

/// Position of a point of the unit cube on the Morton curve, 21 bits per axis.
fn curve_position(p: Vec3) -> u64 {
    let spread = |v: f32| {
        let cell = (v.clamp(0.0, 1.0) * 2_097_151.0) as u64;
        (0..21).fold(0, |bits, k| bits | (cell >> k & 1) << (3 * k))
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}
