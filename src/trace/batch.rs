//! One batch of a run: photons, light in media, and light straight from the lights.

use glam::Vec3;
use rayon::prelude::*;

use super::direct::Direct;
use super::eye::{Eye, Seen};
use super::photon::{Arrivals, Travel, lifted};
use super::random::{Draws, Purpose};
use super::spectrum::index_at;
use super::statistics::{Accumulator, Sorted};
use super::tracer::Tracer;
use super::volume::{Beam, Canvas, Media, View};
use super::wave::{Scratch, travel};
use super::world::Surface;

/// Photons of a chunk; a thread traces one chunk at a time.
const CHUNK: u32 = 4096;

/// Chunks whose results are held before they are summed; memory does not grow with the number of photons.
const ROUND: u32 = 64;

/// Chunks of a round if light in media is measured: few, since it is asked before each round whether to stop.
const VOLUME_ROUND: u32 = 16;

/// Chunks whose beams go to the same sums.
const CANVAS_CHUNKS: usize = 2;

/// Pixels that are looked at before it is asked again whether to stop.
const PIXELS: u32 = 1 << 15;

/// Batches in which light that comes straight from the lights is measured on surfaces, through a place of the pixel each; after these it is known
/// except at edges.
pub(super) const DIRECT_BATCHES: u64 = 8;

impl Tracer {
    /// Traces at least this many more photons, in whole batches.
    pub fn run(&mut self, photons: u64) {
        for _ in 0..photons.div_ceil(self.batch_photons) {
            self.run_batch();
        }
    }

    /// Traces one batch of photons.
    pub fn run_batch(&mut self) {
        self.run_batch_until(&|| false);
    }

    /// Traces one batch of photons, unless `stop` tells to give it up, which it is asked a few times a second. A batch that is given up leaves no trace:
    /// the run is as it was before. Returns whether the batch is done.
    pub fn run_batch_until(&mut self, stop: &(impl Fn() -> bool + Sync)) -> bool {
        let audit = self.run.audit;
        let parts = self.wavelengths.parts();
        let done = parts.iter().enumerate().all(|(part, channels)| self.run_part(part as u32, *channels, stop)) && self.run_direct(stop);
        if !done {
            self.run.audit = audit;
            self.run.accumulators_mut().into_iter().flatten().for_each(Accumulator::drop_batch);
            return false;
        }
        let batch = self.run.batches;
        for accumulator in
            [&mut self.run.plane, &mut self.run.pixels, &mut self.run.volume, &mut self.run.direct_volume].into_iter().flatten()
        {
            accumulator.end_batch();
        }
        if let Some(direct) = &mut self.run.direct
            && batch < DIRECT_BATCHES
        {
            direct.end_batch();
        }
        self.run.batches += 1;
        true
    }

    /// Traces the photons of one wavelength, or of all. Returns whether it is done.
    fn run_part(&mut self, part: u32, channels: Vec3, stop: &(impl Fn() -> bool + Sync)) -> bool {
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
            beams: self.views.is_some(),
            channels,
            max_events: self.scene.trace.max_events,
            seed: self.options.seed,
            batch,
            batch_photons: self.batch_photons as u32,
        };
        let chunks = (self.batch_photons as u32).div_ceil(CHUNK);
        let (plane_len, pixel_len) =
            (self.run.plane.as_ref().map_or(0, Accumulator::len), self.run.pixels.as_ref().map_or(0, Accumulator::len));
        let media = Media { medium: self.scene.medium, smoke: self.smoke.as_ref() };
        let per_round = if self.views.is_some() { VOLUME_ROUND } else { ROUND };
        for round in 0..chunks.div_ceil(per_round) {
            if stop() {
                return false;
            }
            let range = round * per_round..((round + 1) * per_round).min(chunks);
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
            if let (Some(volume), Some(views)) = (&mut self.run.volume, &self.views) {
                let beams: Vec<&[Beam]> = arrivals.iter().map(|(_, _, arrivals)| arrivals.beams.as_slice()).collect();
                let canvases: Vec<Canvas> = beams
                    .par_chunks(CANVAS_CHUNKS)
                    .map(|beams| {
                        let mut canvas = Canvas::new(volume.len());
                        beams.iter().for_each(|beams| views.add(self.options.level, beams, media, &mut canvas));
                        canvas
                    })
                    .collect();
                volume.add_pictures(&canvases);
            }
            for (_, _, arrivals) in arrivals {
                self.run.audit.add(&arrivals.audit);
            }
        }
        true
    }

    /// Measures the light that comes straight from the lights, for a batch. Returns whether it is done.
    fn run_direct(&mut self, stop: &(impl Fn() -> bool + Sync)) -> bool {
        let lit = self.run.direct.is_some() && self.run.batches < DIRECT_BATCHES;
        let (points, media) = (self.options.points.is_some(), self.run.direct_volume.is_some());
        if (lit && !points || media) && !self.run_direct_views(lit && !points, media, stop) {
            return false;
        }
        if lit && points {
            self.light_points();
        }
        true
    }

    /// Measures the light straight from the lights on surfaces that view rays meet, and in media along them.
    fn run_direct_views(&mut self, surfaces: bool, media: bool, stop: &(impl Fn() -> bool + Sync)) -> bool {
        let (seed, batch) = (self.options.seed, self.run.batches as u32);
        let eye = Eye::new(&self.scene, &self.world, self.water.as_ref());
        let mut hits = Vec::new();
        let pixels = eye.columns() * eye.rows();
        for first in (0..pixels).step_by(PIXELS as usize) {
            if stop() {
                return false;
            }
            let direct = self.direct_light();
            let at = |pixel: u32| {
                let view = View::of_pixel(&eye, seed, batch, pixel);
                let irradiance = surfaces.then(|| direct.at_end(&view)).flatten();
                let radiance = media.then(|| direct.along(&view, &mut Draws::new(seed, Purpose::Direct, batch, pixel)));
                (pixel, irradiance, radiance)
            };
            let range = first..(first + PIXELS).min(pixels);
            let values: Vec<_> = range.into_par_iter().with_min_len(64).map(at).collect();
            if let Some(sums) = &mut self.run.direct {
                let landed = values.iter().filter_map(|&(pixel, irradiance, _)| Some((pixel, irradiance?.to_array().map(f64::from))));
                sums.add_values(landed);
            }
            if let Some(sums) = &mut self.run.direct_volume {
                sums.add_values(values.iter().filter_map(|&(pixel, _, radiance)| Some((pixel, radiance?))));
            }
            hits.extend(values.iter().filter(|(_, irradiance, _)| irradiance.is_some()).map(|(pixel, _, _)| *pixel));
        }
        self.count_hits(&hits);
        true
    }

    /// Measures the light that comes straight from the lights to the given points.
    fn light_points(&mut self) {
        let Some(cells) = &self.cells else { return };
        let (direct, water) = (self.direct_light(), self.water.as_ref());
        let value = |(pixel, seen): (usize, &Option<Seen>)| {
            let seen = seen.as_ref()?;
            let wet = water.is_some_and(|water| water.holds(lifted(seen.position, seen.normal)));
            Some((pixel as u32, direct.irradiance(seen, wet).to_array().map(f64::from)))
        };
        let values: Vec<_> = cells.seen.par_iter().enumerate().filter_map(value).collect();
        let hits: Vec<u32> = values.iter().map(|(pixel, _)| *pixel).collect();
        if let Some(sums) = &mut self.run.direct {
            sums.add_values(values);
        }
        self.count_hits(&hits);
    }

    fn count_hits(&mut self, pixels: &[u32]) {
        for &pixel in pixels {
            self.run.hits[pixel as usize] += 1;
        }
    }

    fn direct_light(&self) -> Direct<'_> {
        Direct {
            lights: &self.scene.lights,
            world: &self.world,
            water: self.water.as_ref(),
            media: Media { medium: self.scene.medium, smoke: self.smoke.as_ref() },
            reach: self.reach,
        }
    }
}
