//! A run of the ground truth: batches of photons, and their measurements so far.

use fearless_simd::Level;
use glam::Vec3;
use rayon::prelude::*;

use nephroid_scene::Scene;
use nephroid_scene::geom::Aabb;

use super::account::account;
use super::audit::Audit;
use super::beams::{Beam, BeamTree};
use super::cells::{Cells, Points};
use super::emit::Emitter;
use super::error::TraceError;
use super::eye::{Eye, Stretch};
use super::media::{Place, SmokeBox, even_transmittance};
use super::photon::{Arrivals, Travel};
use super::plane::Plane;
use super::random::{Draws, Purpose};
use super::spectrum::{Wavelengths, index_at};
use super::statistics::{Accumulator, Measured, Sorted};
use super::tree::{Hit, NONE};
use super::water::WaterSurface;
use super::wave::{Scratch, travel};
use super::world::{Surface, World};

/// Photons of a chunk; a thread traces one chunk at a time.
const CHUNK: u32 = 4096;

/// Chunks whose results are held before they are summed; memory does not grow with the number of photons.
const ROUND: u32 = 64;

/// Least and greatest number of photons of a batch.
const BATCH: (u64, u64) = (1 << 16, 1 << 24);

/// Photons of a batch if scattered light is measured, because all beams of a batch are held at once.
const BEAM_BATCH: u64 = 1 << 16;

/// Width of beams as a share of the size of the lit region.
const BEAM_WIDTH: f32 = 1.0 / 300.0;

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
    scene: Scene,
    pub(super) options: TraceOptions,
    pub(super) world: World,
    water: Option<WaterSurface>,
    smoke: Option<SmokeBox>,
    emitter: Emitter,
    wavelengths: Wavelengths,
    plane: Option<Plane>,
    cells: Option<Cells>,
    /// View rays of the camera's pixels, as stretches.
    views: Vec<Vec<Stretch>>,
    beam_width: f32,
    reach: f32,
    batch_photons: u64,
    pub(super) run: Run,
}

/// Measurements of a run: all that is saved when the run is interrupted.
pub(super) struct Run {
    pub plane: Option<Accumulator>,
    pub pixels: Option<Accumulator>,
    pub volume: Option<Accumulator>,
    pub audit: Audit,
    pub batches: u64,
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
        let lit = Aabb::from_points(targets.iter().flatten().copied()).size().length();
        let (columns, rows) = (scene.image.width, scene.image.height);
        let eye = Eye::new(scene, &world, water.as_ref());
        let cells = match &options.points {
            Some(points) => Some(Cells::of_points(&on_diffuse_surfaces(points, &world))),
            None => options.camera.then(|| Cells::of_camera(&eye, columns, rows)),
        };
        let views = if options.volume { views(&eye, columns, rows) } else { Vec::new() };
        let run = Run {
            plane: scene.trace.plane.map(|plane| Accumulator::new(plane.texels.0, plane.texels.1)),
            pixels: cells.as_ref().map(|cells| Accumulator::new(cells.columns, cells.rows)),
            volume: options.volume.then(|| Accumulator::new(columns, rows)),
            audit: Audit::default(),
            batches: 0,
        };
        let texels = [&run.plane, &run.pixels].into_iter().flatten().map(|a| a.len() as u64).max().unwrap_or(1);
        let batch_photons = if options.volume { BEAM_BATCH } else { texels.next_power_of_two().clamp(BATCH.0, BATCH.1) };
        Ok(Self {
            plane: scene.trace.plane.as_ref().map(Plane::new),
            smoke: scene.smoke.as_ref().map(SmokeBox::new),
            wavelengths: Wavelengths::of(scene),
            beam_width: scene.trace.beam_width_m.unwrap_or(lit * BEAM_WIDTH),
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

    /// Traces at least this many more photons, in whole batches.
    pub fn run(&mut self, photons: u64) {
        for _ in 0..photons.div_ceil(self.batch_photons) {
            self.run_batch();
        }
    }

    /// Traces one batch of photons.
    pub fn run_batch(&mut self) {
        let parts = self.wavelengths.parts();
        for (part, channels) in parts.iter().enumerate() {
            self.run_part(part as u32, *channels);
        }
        for accumulator in [&mut self.run.plane, &mut self.run.pixels, &mut self.run.volume].into_iter().flatten() {
            accumulator.end_batch();
        }
        self.run.batches += 1;
    }

    /// Traces the photons of one wavelength, or of all.
    fn run_part(&mut self, part: u32, channels: Vec3) {
        let batch = (self.run.batches as u32).wrapping_mul(4) + part;
        let colour = self.wavelengths.colour(part);
        let water_ior = self.scene.water.as_ref().map_or(1.0, |w| index_at(w.ior, w.abbe, colour));
        let glass_ior: Vec<f32> = self
            .world
            .surfaces
            .iter()
            .map(|surface| match *surface {
                Surface::Glass { ior, abbe, .. } => index_at(ior, abbe, colour),
                _ => 1.0,
            })
            .collect();
        let journey = Travel {
            level: self.options.level,
            emitter: &self.emitter,
            world: &self.world,
            water: self.water.as_ref(),
            water_ior,
            glass_ior: &glass_ior,
            medium: self.scene.medium,
            smoke: self.smoke.as_ref(),
            plane: self.plane.as_ref(),
            cells: self.cells.as_ref(),
            beams: self.options.volume,
            channels,
            max_events: self.scene.trace.max_events,
            seed: self.options.seed,
            batch,
            batch_photons: self.batch_photons as u32,
        };
        let chunks = (self.batch_photons as u32).div_ceil(CHUNK);
        let (plane_len, pixel_len) =
            (self.run.plane.as_ref().map_or(0, Accumulator::len), self.run.pixels.as_ref().map_or(0, Accumulator::len));
        let mut beams: Vec<Beam> = Vec::new();
        for round in 0..chunks.div_ceil(ROUND) {
            let range = round * ROUND..((round + 1) * ROUND).min(chunks);
            let arrivals: Vec<(Sorted, Sorted, Arrivals)> = range
                .into_par_iter()
                .map_init(Scratch::new, |scratch, chunk| {
                    let first = chunk * CHUNK;
                    let mut arrivals = travel(&journey, first, CHUNK.min(self.batch_photons as u32 - first), scratch);
                    let plane = Sorted::new(&std::mem::take(&mut arrivals.plane), plane_len);
                    let pixels = Sorted::new(&std::mem::take(&mut arrivals.pixels), pixel_len);
                    (plane, pixels, arrivals)
                })
                .collect();
            if let Some(plane) = &mut self.run.plane {
                plane.add(&arrivals.iter().map(|a| &a.0).collect::<Vec<_>>());
            }
            if let Some(pixels) = &mut self.run.pixels {
                pixels.add(&arrivals.iter().map(|a| &a.1).collect::<Vec<_>>());
            }
            for (_, _, arrivals) in arrivals {
                self.run.audit.add(&arrivals.audit);
                beams.extend(arrivals.beams);
            }
        }
        if let Some(volume) = &mut self.run.volume {
            let (smoke, medium, seed) = (self.smoke.as_ref(), self.scene.medium, self.options.seed);
            let tree = BeamTree::new(&beams, self.beam_width, self.reach, medium, smoke);
            let views = &self.views;
            volume.add_each(|pixel| {
                let mut draws = Draws::new(seed, Purpose::View, batch, pixel as u32);
                gather(&tree, &views[pixel], (medium.sigma_t(), smoke), &mut draws)
            });
        }
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

    /// Flux that the lights emit towards specular surfaces, W summed over RGB: the audit's `emitted` per batch, computed from areas.
    #[must_use]
    pub fn emitted_w(&self) -> f64 {
        self.emitter.total_w()
    }

    /// The largest relative noise of the measurements: root mean square of standard errors over mean value.
    #[must_use]
    pub fn noise(&self) -> f64 {
        let shown = self.cells.as_ref().map_or(0, |cells| cells.valid.iter().filter(|valid| **valid).count());
        let pixels = self.run.pixels.iter().map(|pixels| pixels.noise(shown));
        let others = [&self.run.plane, &self.run.volume].into_iter().flatten().map(|all| all.noise(all.len()));
        pixels.chain(others).fold(0.0, f64::max)
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

/// View rays through the middles of all pixels.
fn views(eye: &Eye<'_>, columns: u32, rows: u32) -> Vec<Vec<Stretch>> {
    (0..columns * rows)
        .into_par_iter()
        .with_min_len(256)
        .map(|pixel| {
            let (x, y) = (f64::from(pixel % columns) + 0.5, f64::from(pixel / columns) + 0.5);
            let mut view = Vec::new();
            eye.look(x, y, |stretch| view.push(stretch));
            view
        })
        .collect()
}

/// Radiance along a whole view ray.
fn gather(tree: &BeamTree<'_>, view: &[Stretch], (sigma_t, smoke): (Vec3, Option<&SmokeBox>), draws: &mut Draws) -> [f64; 3] {
    let mut passed = Vec3::ONE;
    let mut sum = [0.0; 3];
    for (number, stretch) in view.iter().enumerate() {
        let radiance = tree.gather(stretch, draws) * passed * stretch.throughput;
        for (sum, value) in sum.iter_mut().zip(radiance.to_array()) {
            *sum += f64::from(value);
        }
        if number + 1 < view.len() {
            passed *= match (stretch.place, smoke) {
                (Place::Water, _) => even_transmittance(sigma_t, stretch.length),
                (Place::Air, Some(smoke)) => {
                    let ray = nephroid_scene::geom::Ray { origin: stretch.origin, direction: stretch.direction };
                    smoke.transmittance(ray, stretch.length, draws)
                }
                _ => Vec3::ONE,
            };
        }
    }
    sum
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
