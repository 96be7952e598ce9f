//! A run of the ground truth: batches of photons, and their measurements so far.

use fearless_simd::Level;
use glam::Vec3;
use rayon::prelude::*;

use nephroid_scene::Scene;
use nephroid_scene::geom::Aabb;

use super::account::account;
use super::audit::Audit;
use super::batch::DIRECT_BATCHES;
use super::cells::{Cells, Points};
use super::emit::Emitter;
use super::error::TraceError;
use super::eye::Eye;
use super::media::SmokeBox;
use super::plane::Plane;
use super::spectrum::Wavelengths;
use super::statistics::{Accumulator, Measured};
use super::tree::{Hit, NONE};
use super::volume::{Media, Views};
use super::water::WaterSurface;
use super::world::{Surface, World};

/// Least and greatest number of photons of a batch.
const BATCH: (u64, u64) = (1 << 16, 1 << 24);

/// Photons of a batch for each pixel, if scattered light is measured: they are spread evenly within a batch.
const VOLUME_PHOTONS: u64 = 8;

/// Most of these: a batch takes some seconds, and the noise is known after two.
const VOLUME_BATCH: u64 = 1 << 21;

/// Options of a run: what is measured, and how.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// Seed of all random numbers. Default: 0
    pub seed: u32,
    /// Whether to measure irradiance at the points that the camera's pixels show. Default: false
    pub camera: bool,
    /// Whether to measure light that media scatter towards the camera. Default: false
    pub volume: bool,
    /// Points at which to measure irradiance, instead of those that the camera shows. Default: none
    pub points: Option<Points>,
    /// SIMD level; it changes no result. Default: the machine's best
    pub level: Level,
    /// Most memory that a run may take, bytes. Default: 4 GiB
    pub memory_limit_bytes: u64,
}

impl Default for TraceOptions {
    fn default() -> Self {
        Self { seed: 0, camera: false, volume: false, points: None, level: Level::new(), memory_limit_bytes: 4 << 30 }
    }
}

/// Traces photons through a scene and measures where they land. The bits of a result depend on scene, options and number of photons only.
pub struct Tracer {
    pub(super) scene: Scene,
    pub(super) options: TraceOptions,
    pub(super) world: World,
    pub(super) water: Option<WaterSurface>,
    pub(super) smoke: Option<SmokeBox>,
    pub(super) emitter: Emitter,
    pub(super) wavelengths: Wavelengths,
    pub(super) plane: Option<Plane>,
    pub(super) cells: Option<Cells>,
    /// Views of the pixels for scattered light; `None` if it is not measured.
    pub(super) views: Option<Views>,
    pub(super) reach: f32,
    pub(super) batch_photons: u64,
    pub(super) run: Run,
}

/// Measurements of a run: all that is saved when the run is interrupted.
pub(super) struct Run {
    pub plane: Option<Accumulator>,
    pub pixels: Option<Accumulator>,
    pub volume: Option<Accumulator>,
    /// Light straight from the lights: on surfaces, and scattered towards the camera.
    pub direct: Option<Accumulator>,
    pub direct_volume: Option<Accumulator>,
    /// View rays by pixel that ended on a diffuse surface in the batches of `direct`.
    pub hits: Vec<u8>,
    pub audit: Audit,
    pub batches: u64,
}

impl Run {
    /// All pictures of sums.
    pub fn accumulators(&self) -> [&Option<Accumulator>; 5] {
        [&self.plane, &self.pixels, &self.volume, &self.direct, &self.direct_volume]
    }

    /// All pictures of sums.
    pub fn accumulators_mut(&mut self) -> [&mut Option<Accumulator>; 5] {
        [&mut self.plane, &mut self.pixels, &mut self.volume, &mut self.direct, &mut self.direct_volume]
    }
}

impl Tracer {
    /// Prepares a run: loads meshes, marks the directions in which lights emit, and computes the footprints of pixels.
    ///
    /// # Errors
    /// If the run would take more memory than its limit, a mesh cannot be made or loaded, or the scene cannot be traced, see [`TraceError`].
    pub fn new(scene: &Scene, options: &TraceOptions) -> Result<Self, TraceError> {
        let settled = scene.settled()?;
        account(&settled, options).check(options.memory_limit_bytes)?;
        let mut options = options.clone();
        let shift = settled.origin - scene.origin;
        for position in options.points.iter_mut().flat_map(|points| &mut points.positions) {
            *position = position.map(|p| (p.as_dvec3() - shift).as_vec3());
        }
        Self::of_settled(&settled, &options)
    }

    fn of_settled(scene: &Scene, options: &TraceOptions) -> Result<Self, TraceError> {
        let water = WaterSurface::new(scene);
        let world = World::new(scene, water.as_ref().map(|water| water.level - water.rise), options.level)?;
        let mut targets: Vec<[Vec3; 3]> = world.specular_triangles().collect();
        let mut bounds = world.bounds;
        if let Some(water) = &water {
            let body = Aabb {
                min: Vec3::new(water.min.x, water.level - water.rise, water.min.y),
                max: Vec3::new(water.max.x, water.level + water.rise, water.max.y),
            };
            targets.extend(box_triangles(body));
            bounds = bounds.union(body);
        }
        if let Some(smoke) = &scene.smoke {
            bounds = bounds.union(Aabb { min: smoke.min, max: smoke.max });
        }
        let emitter = Emitter::new(&scene.lights, bounds, &targets);
        if emitter.total_w() <= 0.0 {
            return Err(TraceError::NothingSpecular);
        }
        let size = bounds.size().length();
        let (columns, rows) = (scene.image.width, scene.image.height);
        let eye = Eye::new(scene, &world, water.as_ref());
        let cells = match &options.points {
            Some(points) => Some(Cells::of_points(&on_diffuse_surfaces(points, &world))),
            None => options.camera.then(|| Cells::of_camera(&eye, columns, rows)),
        };
        let smoke = scene.smoke.as_ref().map(SmokeBox::new);
        let media = Media { medium: scene.medium, smoke: smoke.as_ref() };
        let views = options.volume.then(|| Views::new(&eye, media, size));
        let picture = || Accumulator::new(columns, rows);
        let direct = options.camera || options.points.is_some();
        let run = Run {
            plane: scene.trace.plane.map(|plane| Accumulator::new(plane.texels.0, plane.texels.1)),
            pixels: cells.as_ref().map(|cells| Accumulator::new(cells.columns, cells.rows)),
            volume: options.volume.then(picture),
            direct: direct.then(|| cells.as_ref().map_or_else(picture, |cells| Accumulator::new(cells.columns, cells.rows))),
            direct_volume: options.volume.then(picture),
            hits: vec![0; if direct { cells.as_ref().map_or(0, |cells| cells.seen.len()) } else { 0 }],
            audit: Audit::default(),
            batches: 0,
        };
        let texels = [&run.plane, &run.pixels].into_iter().flatten().map(|a| a.len() as u64).max().unwrap_or(1);
        let views_of_batch = if options.volume { (VOLUME_PHOTONS * u64::from(columns) * u64::from(rows)).min(VOLUME_BATCH) } else { 1 };
        let batch_photons = texels.max(views_of_batch).next_power_of_two().clamp(BATCH.0, BATCH.1);

        Ok(Self {
            plane: scene.trace.plane.as_ref().map(Plane::new),
            smoke,
            wavelengths: Wavelengths::of(scene),
            reach: size,
            scene: scene.clone(),
            options: options.clone(),
            world,
            water,
            emitter,
            cells,
            views,
            batch_photons,
            run,
        })
    }

    /// The traced scene, as it is computed with ([`Scene::settled`]).
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Seed of the run.
    #[must_use]
    pub fn seed(&self) -> u32 {
        self.options.seed
    }

    /// Number of photons of a batch. In scenes with dispersion each photon is traced once per colour.
    #[must_use]
    pub fn batch_photons(&self) -> u64 {
        self.batch_photons
    }

    /// Number of batches traced.
    #[must_use]
    pub fn batches(&self) -> u64 {
        self.run.batches
    }

    /// Number of photons traced. In scenes with dispersion, the photons of the three colours count as one.
    #[must_use]
    pub fn photons(&self) -> u64 {
        self.run.batches * self.batch_photons
    }

    /// Irradiance on the scene's measuring plane, W/m²; `None` if the scene has no such plane.
    #[must_use]
    pub fn plane(&self) -> Option<Measured> {
        let area = self.scene.trace.plane.as_ref()?.texel_area_m2();
        Some(self.run.plane.as_ref()?.measured(|_| 1.0 / area))
    }

    /// Irradiance at the points that pixels show, W/m²; `None` if it is not measured.
    #[must_use]
    pub fn pixels(&self) -> Option<Measured> {
        let mut measured = self.run.pixels.as_ref()?.measured(|_| 1.0);
        measured.valid = Some(self.cells.as_ref()?.valid.clone());
        Some(measured)
    }

    /// Area of each pixel's footprint, m²; 0 for pixels that show no diffuse surface.
    #[must_use]
    pub fn pixel_areas(&self) -> Option<&[f64]> {
        self.cells.as_ref().map(|cells| cells.areas.as_slice())
    }

    /// World-space point in the middle of each pixel, and the triangle's normal on the side of the eye.
    #[must_use]
    pub fn pixel_points(&self) -> Option<Vec<Option<(Vec3, Vec3)>>> {
        let seen = &self.cells.as_ref()?.seen;
        Some(seen.iter().map(|seen| seen.map(|seen| (seen.position, seen.normal))).collect())
    }

    /// Radiance scattered towards the camera, W/(m² sr); `None` if it is not measured.
    #[must_use]
    pub fn volume(&self) -> Option<Measured> {
        Some(self.run.volume.as_ref()?.measured(|_| 1.0))
    }

    /// Irradiance straight from the lights, without water, mirrors and glass, W/m²; `None` if it is not measured. Pixels are means over view rays that
    /// end on a diffuse surface.
    #[must_use]
    pub fn direct(&self) -> Option<Measured> {
        let direct = self.run.direct.as_ref()?;
        let batches = self.run.batches.min(DIRECT_BATCHES) as f64;
        let mut measured = direct.measured(|pixel| batches / f64::from(self.run.hits[pixel].max(1)));
        measured.valid = Some(self.run.hits.iter().map(|&hits| hits > 0).collect());
        Some(measured)
    }

    /// Radiance straight from the lights, scattered towards the camera, W/(m² sr); `None` if it is not measured.
    #[must_use]
    pub fn direct_volume(&self) -> Option<Measured> {
        Some(self.run.direct_volume.as_ref()?.measured(|_| 1.0))
    }

    /// Energy audit of all batches.
    #[must_use]
    pub fn audit(&self) -> Audit {
        self.run.audit
    }

    /// Number of bodies of glass whose triangles faced inwards and were reversed.
    #[must_use]
    pub fn turned_bodies(&self) -> u64 {
        self.world.turned
    }

    /// Number of pixels of [`Tracer::volume`] that lack light behind the surface of the water, because views part too much in them.
    #[must_use]
    pub fn pixels_left_out(&self) -> u64 {
        self.views.as_ref().map_or(0, |views| views.left_out)
    }

    /// Flux that the lights emit towards specular surfaces, W summed over RGB: the audit's `emitted` per batch, computed from areas.
    #[must_use]
    pub fn emitted_w(&self) -> f64 {
        self.emitter.total_w()
    }

    /// Relative noise by layer: root mean square of standard errors over mean value, of the layers whose noise falls with every batch. Layers without
    /// light have none.
    #[must_use]
    pub fn noises(&self) -> Vec<(&'static str, f64)> {
        let shown = self.cells.as_ref().map_or(0, |cells| cells.valid.iter().filter(|valid| **valid).count());
        let run = &self.run;
        [("caustic_irradiance", &run.pixels), ("plane", &run.plane), ("godrays", &run.volume), ("direct_godrays", &run.direct_volume)]
            .into_iter()
            .filter_map(|(name, sums)| sums.as_ref().map(|sums| (name, sums)))
            .map(|(name, sums)| (name, sums.noise(if name == "caustic_irradiance" { shown } else { sums.len() })))
            .filter(|(name, noise)| *name != "direct_godrays" || noise.is_finite())
            .collect()
    }

    /// The largest of [`Tracer::noises`].
    #[must_use]
    pub fn noise(&self) -> f64 {
        self.noises().into_iter().map(|(_, noise)| noise).fold(0.0, f64::max)
    }
}

/// The points without those on mirrors and glass, where no light lands, and without those that lie on no surface.
fn on_diffuse_surfaces(points: &Points, world: &World) -> Points {
    const REACH: f32 = 1.0e-3;
    let mut points = points.clone();
    for (position, normal) in points.positions.iter_mut().zip(&points.normals) {
        if let Some(p) = *position {
            let reach = REACH * world.bounds.size().max_element().max(p.abs().max_element());
            let hit = world.nearest(p + *normal * reach, -*normal, 2.0 * reach, NONE);
            let diffuse = |hit: Hit| world.surfaces[world.object(hit.triangle) as usize] == Surface::Diffuse;
            if !hit.is_some_and(diffuse) {
                *position = None;
            }
        }
    }
    points
}

/// The point that the middle of each pixel of the scene's camera shows through the water surface, in world space, m; `None` for pixels that show no
/// surface. No photons are traced.
///
/// # Errors
/// If a mesh cannot be made or loaded, or the scene cannot be traced.
pub fn camera_points(scene: &Scene) -> Result<Vec<Option<Vec3>>, TraceError> {
    let settled = scene.settled()?;
    let shift = settled.origin - scene.origin;
    let scene = &*settled;
    let water = WaterSurface::new(scene);
    let world = World::new(scene, None, Level::new())?;
    let eye = Eye::new(scene, &world, water.as_ref());
    let (columns, rows) = (scene.image.width, scene.image.height);
    let look = |pixel: u32| {
        eye.look(f64::from(pixel % columns) + 0.5, f64::from(pixel / columns) + 0.5, |_| {})
            .map(|seen| (seen.position.as_dvec3() + shift).as_vec3())
    };
    Ok((0..columns * rows).into_par_iter().with_min_len(256).map(look).collect())
}

/// The twelve triangles of a box.
fn box_triangles(body: Aabb) -> Vec<[Vec3; 3]> {
    const QUADS: [[usize; 4]; 6] = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let at = |k: usize| {
        let pick = |bit: usize, low: f32, high: f32| if k & bit == 0 { low } else { high };
        Vec3::new(pick(1, body.min.x, body.max.x), pick(2, body.min.y, body.max.y), pick(4, body.min.z, body.max.z))
    };
    QUADS.iter().flat_map(|q| [[at(q[0]), at(q[1]), at(q[2])], [at(q[0]), at(q[2]), at(q[3])]]).collect()
}
