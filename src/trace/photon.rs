//! The life of a photon: from surface to surface until it lands, is absorbed, or leaves.
//!
//! A photon is never split. At a smooth boundary it is refracted or reflected, with the chance that Fresnel's law gives each, and takes all of its
//! flux along; media take their share on the way. So every photon has one end and the audit closes to rounding.
//!
//! Photons go in waves of [`WAVE`]. Each step first meets the whole wave with the water, sixteen at a time (`StepWater`), then looks photon
//! by photon whether an object is nearer. What is left of the wave moves up and goes on.

use fearless_simd::{Level, Simd, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use crate::geom::Ray;
use crate::math::lanes::{Lanes, Mask as _};
use crate::math::level::wide_dispatch;
use crate::math::optics::{fresnel_reflectance, reflect, refract};
use crate::math::rng::{rng3, unit_from_bits};
use crate::math::vector::{V3, v3};
use crate::scene::Medium;

use super::audit::{Audit, sum};
use super::beams::Beam;
use super::cells::Cells;
use super::emit::{Emitter, Start};
use super::media::{Place, SmokeBox, Tracking, even_transmittance, water_share};
use super::plane::Plane;
use super::statistics::Deposit;
use super::water::{Heights, OverHeights, Rays, WaterSurface, crossings};
use super::world::{NONE, Surface, World};

/// Photons that step together.
const WAVE: usize = 512;

/// Bodies of glass that can overlap at one place.
const NESTING: usize = 4;

/// New rays start this far off a surface, as a share of their coordinates, on the side they go to: as much as rounding can have put them on
/// the other. More would push those that start near an edge through the next triangle.
const LIFT: f32 = 1.2e-7;

/// Keeps the choices between refraction and reflection apart from all other random numbers.
const STREAM_CHOICE: u32 = 0xf2e5_0000;

/// What photons of one wavelength, or of all, travel through.
pub(super) struct Travel<'a> {
    /// SIMD level.
    pub level: Level,
    /// Where they start.
    pub emitter: &'a Emitter,
    /// What they meet.
    pub world: &'a World,
    /// The water.
    pub water: Option<&'a WaterSurface>,
    /// The water's refractive index at this wavelength.
    pub water_ior: f32,
    /// Refractive index of each object at this wavelength; 1 for those that are not glass.
    pub glass_ior: &'a [f32],
    /// The water's medium.
    pub medium: Medium,
    /// Smoke in the air.
    pub smoke: Option<&'a SmokeBox>,
    /// A plane that measures.
    pub plane: Option<&'a Plane>,
    /// The visible points.
    pub cells: Option<&'a Cells>,
    /// Whether stretches through scattering media are wanted.
    pub beams: bool,
    /// Factor on each channel: 0 for those of other wavelengths.
    pub channels: Vec3,
    /// Most surfaces that a photon may meet.
    pub max_events: u32,
    /// Seed of the run.
    pub seed: u32,
    /// Number of the batch, and of its part in scenes with dispersion.
    pub batch: u32,
    /// Photons in the batch.
    pub batch_photons: u32,
}

impl Travel<'_> {
    /// A number uniform in `[0, 1)` for each photon and surface: below the reflectance, the photon is reflected.
    #[inline(always)]
    fn choice(&self, number: u32, events: u32) -> f32 {
        unit_from_bits(rng3(self.seed ^ STREAM_CHOICE, self.batch.wrapping_mul(0x9e37_79b9) ^ events, number)[0])
    }
}

/// What came of a chunk of photons.
#[derive(Default)]
pub(super) struct Arrivals {
    /// On the measuring plane.
    pub plane: Vec<Deposit>,
    /// At visible points.
    pub pixels: Vec<Deposit>,
    /// Stretches through scattering media.
    pub beams: Vec<Beam>,
    /// Where the light went.
    pub audit: Audit,
}

/// What one photon remembers beside the numbers in its lane.
#[derive(Clone, Copy)]
struct Memory {
    number: u32,
    events: u32,
    /// Triangle that it comes from.
    skip: u32,
    /// Bodies of glass it is in, innermost last; scenes have at most 4096 objects.
    inside: [u16; NESTING],
    depth: u8,
    wet: bool,
    specular: bool,
}

/// Numbers of all photons of a wave, one array per coordinate.
struct Lanewise {
    origin: [[f32; WAVE]; 3],
    direction: [[f32; WAVE]; 3],
    /// 1 above the water, −1 below, 0 inside glass.
    side: [f32; WAVE],
    /// Number of the photon in its batch, and of surfaces it has met.
    number: [u32; WAVE],
    events: [u32; WAVE],
    /// Distance to the water.
    t: [f32; WAVE],
    /// Normal of the water there, towards the photon.
    normal: [[f32; WAVE]; 3],
    /// Direction after the water.
    onward: [[f32; WAVE]; 3],
    /// 1 for photons that the water reflects.
    reflected: [f32; WAVE],
}

/// Room for a wave; kept from wave to wave.
pub(super) struct Scratch {
    lanes: Box<Lanewise>,
    memory: Vec<Memory>,
    flux: Vec<Vec3>,
    starts: Vec<Start>,
}

impl Scratch {
    /// Room for a wave.
    pub fn new() -> Self {
        let lanes = Lanewise {
            origin: [[0.0; WAVE]; 3],
            direction: [[0.0; WAVE]; 3],
            side: [0.0; WAVE],
            number: [0; WAVE],
            events: [0; WAVE],
            t: [0.0; WAVE],
            normal: [[0.0; WAVE]; 3],
            onward: [[0.0; WAVE]; 3],
            reflected: [0.0; WAVE],
        };
        Self { lanes: Box::new(lanes), memory: Vec::with_capacity(WAVE), flux: Vec::with_capacity(WAVE), starts: Vec::with_capacity(WAVE) }
    }
}

/// Sends photons `first..first + number` of the batch on their way.
pub(super) fn travel(travel: &Travel<'_>, first: u32, number: u32, scratch: &mut Scratch) -> Arrivals {
    let mut arrivals = Arrivals::default();
    let mut sent = 0;
    while sent < number {
        let count = (number - sent).min(WAVE as u32);
        let mut starts = std::mem::take(&mut scratch.starts);
        travel.emitter.start(travel.seed, travel.batch, first + sent, travel.batch_photons, &mut starts, count as usize);
        begin(travel, &starts, first + sent, scratch, &mut arrivals.audit);
        scratch.starts = starts;
        while !scratch.memory.is_empty() {
            step(travel, scratch, &mut arrivals);
        }
        sent += count;
    }
    arrivals
}

/// Puts photons into the lanes.
fn begin(travel: &Travel<'_>, starts: &[Start], first: u32, scratch: &mut Scratch, audit: &mut Audit) {
    scratch.memory.clear();
    scratch.flux.clear();
    for (lane, start) in starts.iter().enumerate() {
        let flux = start.flux * travel.channels;
        audit.emitted += sum(flux);
        audit.photons += 1;
        // Parallel light comes from outside, and no light is in glass.
        let wet = travel.water.is_some_and(|water| water.holds(start.origin));
        scratch.flux.push(flux);
        scratch.memory.push(Memory {
            number: first + lane as u32,
            events: 0,
            skip: NONE,
            inside: [0; NESTING],
            depth: 0,
            wet,
            specular: false,
        });
        (scratch.lanes.number[lane], scratch.lanes.events[lane]) = (first + lane as u32, 0);
        scratch.lanes.put(lane, start.origin, start.direction, if wet { -1.0 } else { 1.0 });
    }
}

impl Lanewise {
    fn put(&mut self, lane: usize, origin: Vec3, direction: Vec3, side: f32) {
        for axis in 0..3 {
            self.origin[axis][lane] = origin[axis];
            self.direction[axis][lane] = direction[axis];
        }
        self.side[lane] = side;
    }
}

fn vector(lanes: &[[f32; WAVE]; 3], lane: usize) -> Vec3 {
    Vec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane])
}

/// One surface for every photon of the wave.
fn step(travel: &Travel<'_>, scratch: &mut Scratch, arrivals: &mut Arrivals) {
    let Scratch { lanes, memory, flux, .. } = scratch;
    let count = memory.len();
    match travel.water {
        Some(water) => water.over(StepWater { travel, water, lanes, count }),
        None => lanes.t[..count].fill(f32::INFINITY),
    }
    let mut kept = 0;
    for lane in 0..count {
        let mut one = One { travel, photon: memory[lane], flux: flux[lane], arrivals };
        let (origin, direction) = (vector(&lanes.origin, lane), vector(&lanes.direction, lane));
        let outcome = one.step(origin, direction, lanes, lane);
        let (photon, left) = (one.photon, one.flux);
        if let Some((origin, direction)) = outcome {
            let side = match (photon.depth, photon.wet) {
                (0, false) => 1.0,
                (0, true) => -1.0,
                _ => 0.0,
            };
            lanes.put(kept, origin, direction, side);
            (lanes.number[kept], lanes.events[kept]) = (photon.number, photon.events);
            memory[kept] = photon;
            flux[kept] = left;
            kept += 1;
        }
    }
    memory.truncate(kept);
    flux.truncate(kept);
}

/// Meets the first `count` photons of a wave with the water and says what it would do to them.
struct StepWater<'a> {
    travel: &'a Travel<'a>,
    water: &'a WaterSurface,
    lanes: &'a mut Lanewise,
    count: usize,
}

impl OverHeights for StepWater<'_> {
    type Output = ();

    fn run<H: Heights>(self, heights: &H) {
        let Self { travel, water, lanes, count } = self;
        wide_dispatch!(travel.level, simd => wide_water(simd, travel, water, heights, lanes, count), {
            for lane in 0..count {
                water_lanes::<f32, H>((), travel, water, heights, lanes, lane);
            }
        });
    }
}

#[simd]
fn wide_water<S: Simd, H: Heights>(simd: S, travel: &Travel<'_>, water: &WaterSurface, heights: &H, lanes: &mut Lanewise, count: usize) {
    for first in (0..count).step_by(16) {
        water_lanes::<f32x16<S>, H>(simd, travel, water, heights, lanes, first);
    }
}

#[inline(always)]
fn load3<L: Lanes>(token: L::Token, lanes: &[[f32; WAVE]; 3], first: usize) -> V3<L> {
    v3(L::load(token, &lanes[0][first..]), L::load(token, &lanes[1][first..]), L::load(token, &lanes[2][first..]))
}

#[inline(always)]
fn store3<L: Lanes>(v: V3<L>, lanes: &mut [[f32; WAVE]; 3], first: usize) {
    v.x.store(&mut lanes[0][first..]);
    v.y.store(&mut lanes[1][first..]);
    v.z.store(&mut lanes[2][first..]);
}

#[inline(always)]
fn water_lanes<L: Lanes, H: Heights>(
    token: L::Token,
    travel: &Travel<'_>,
    water: &WaterSurface,
    heights: &H,
    lanes: &mut Lanewise,
    first: usize,
) {
    let direction: V3<L> = load3(token, &lanes.direction, first);
    let side = L::load(token, &lanes.side[first..]);
    let rays = Rays { origin: load3(token, &lanes.origin, first), direction, side };
    let crossing = crossings(water, heights, rays);
    crossing.t.store(&mut lanes.t[first..]);
    if !crossing.t.lt(side.like(f32::INFINITY)).any() {
        return;
    }
    let mut choice = [0.0_f32; 16];
    for (lane, choice) in choice.iter_mut().enumerate().take(L::LEN) {
        *choice = travel.choice(lanes.number[first + lane], lanes.events[first + lane]);
    }
    let ior = travel.water_ior;
    // Against the photon. A smooth normal of a mesh may lean away from grazing light; then light grazes.
    let up = side.gt(side.like(0.0));
    let normal = V3::select(up, crossing.normal, -crossing.normal);
    let cos = -direction.dot(normal);
    let from_air = fresnel_reflectance(cos, 1.0, ior);
    let from_water = fresnel_reflectance(cos, ior, 1.0);
    let reflectance = L::select(up, from_air, from_water);
    let (into_water, _) = refract(direction, normal, 1.0 / ior);
    let (into_air, _) = refract(direction, normal, ior);
    let bounced = L::load(token, &choice).lt(reflectance);
    let onward = V3::select(bounced, reflect(direction, normal), V3::select(up, into_water, into_air));
    store3(normal, &mut lanes.normal, first);
    store3(onward.normalize(), &mut lanes.onward, first);
    L::select(bounced, side.like(1.0), side.like(0.0)).store(&mut lanes.reflected[first..]);
}

/// A photon taking its step.
struct One<'a, 'b> {
    travel: &'a Travel<'a>,
    photon: Memory,
    flux: Vec3,
    arrivals: &'b mut Arrivals,
}

impl One<'_, '_> {
    /// Goes to the next surface and through what it does; the new origin and direction, or `None` at the end.
    fn step(&mut self, origin: Vec3, direction: Vec3, lanes: &Lanewise, lane: usize) -> Option<(Vec3, Vec3)> {
        let to_water = lanes.t[lane];
        let world = self.travel.world;
        let hit = if to_water < f32::INFINITY && !self.photon.wet {
            world.nearest_above_water(origin, direction, to_water, self.photon.skip)
        } else {
            world.nearest(origin, direction, to_water, self.photon.skip)
        };
        let length = hit.map_or(to_water, |hit| hit.t);
        self.cross(origin, direction, length);
        if self.flux == Vec3::ZERO {
            return None;
        }
        if length == f32::INFINITY {
            let end = if self.photon.specular { &mut self.arrivals.audit.left } else { &mut self.arrivals.audit.missed };
            *end += sum(self.flux);
            return None;
        }
        self.arrivals.audit.events += 1;
        self.photon.events += 1;
        let p = origin + direction * length;
        let onward = match hit {
            None => self.water(p, lanes, lane),
            Some(hit) => {
                self.photon.skip = hit.triangle;
                let object = world.object(hit.triangle);
                let surface = world.surfaces[object as usize];
                if surface == Surface::Diffuse {
                    self.land(p, direction, hit.triangle);
                    return None;
                }
                let p = world.onto(hit.triangle, p, direction);
                match surface {
                    Surface::Mirror(reflectance) => self.mirror(p, direction, hit.triangle, reflectance),
                    _ => self.glass(p, direction, hit.triangle, object),
                }
            }
        };
        if self.photon.events >= self.travel.max_events {
            self.arrivals.audit.lost += sum(self.flux);
            self.arrivals.audit.photons_lost += 1;
            return None;
        }
        self.photon.specular = true;
        Some(onward)
    }

    /// The place that the photon is in.
    fn place(&self) -> Place {
        match (self.photon.depth, self.photon.wet) {
            (0, false) => Place::Air,
            (0, true) => Place::Water,
            (depth, _) => Place::Glass(u32::from(self.photon.inside[depth as usize - 1])),
        }
    }

    /// Passes the plane that measures and the medium on the way to the next surface.
    fn cross(&mut self, origin: Vec3, direction: Vec3, length: f32) {
        let travel = self.travel;
        let place = self.place();
        let ray = Ray { origin, direction };
        if let Some(plane) = travel.plane
            && self.photon.specular
            && let Some((texel, distance)) = plane.crossed(origin, direction, length)
        {
            let value = self.flux * self.transmittance(place, ray, distance, 1);
            self.arrivals.plane.push(Deposit { texel, value: value.to_array() });
        }
        let before = self.flux;
        let share = match place {
            Place::Air => {
                let Some(smoke) = travel.smoke else { return };
                if travel.beams && self.photon.specular && smoke.scatters() {
                    self.smoke_beam(smoke, ray, length);
                }
                smoke.share()
            }
            Place::Water => {
                let medium = &travel.medium;
                if medium.sigma_t() == Vec3::ZERO {
                    return;
                }
                if travel.beams && self.photon.specular && medium.sigma_s != Vec3::ZERO {
                    self.arrivals.beams.push(Beam { origin, direction, length, flux: before, place, key: self.photon.number });
                }
                water_share(medium)
            }
            Place::Glass(_) => Vec3::ZERO,
        };
        self.flux = before * self.transmittance(place, ray, length, 0);
        let taken = sum(before) - sum(self.flux);
        if taken != 0.0 {
            let scattered = sum((before - self.flux) * share);
            self.arrivals.audit.scattered += scattered;
            self.arrivals.audit.absorbed += taken - scattered;
        }
    }

    /// The stretch of a ray through smoke, with the flux that reaches it.
    fn smoke_beam(&mut self, smoke: &SmokeBox, ray: Ray, length: f32) {
        if let Some((enter, leave)) = smoke.span(ray, length) {
            let key = self.photon.number ^ self.photon.events.wrapping_mul(0x85eb_ca6b);
            let beam =
                Beam { origin: ray.at(enter), direction: ray.direction, length: leave - enter, flux: self.flux, place: Place::Air, key };
            self.arrivals.beams.push(beam);
        }
    }

    /// Transmittance from the start of a ray to a distance.
    fn transmittance(&self, place: Place, ray: Ray, length: f32, purpose: u32) -> Vec3 {
        let travel = self.travel;
        match place {
            Place::Air => travel.smoke.map_or(Vec3::ONE, |smoke| {
                let draw = self.photon.events << 1 | purpose;
                let key = [travel.seed ^ self.photon.number, travel.batch ^ draw.wrapping_mul(0x9e37_79b9)];
                smoke.transmittance(ray, length, &mut Tracking { key, drawn: 0 })
            }),
            Place::Water => even_transmittance(travel.medium.sigma_t(), length),
            Place::Glass(object) => match travel.world.surfaces[object as usize] {
                Surface::Glass { absorption, .. } => even_transmittance(absorption, length),
                _ => Vec3::ONE,
            },
        }
    }

    /// Ends on a diffuse surface.
    fn land(&mut self, p: Vec3, direction: Vec3, triangle: u32) {
        let watts = sum(self.flux);
        if !self.photon.specular {
            self.arrivals.audit.landed_direct += watts;
            return;
        }
        self.arrivals.audit.landed += watts;
        if let Some(cells) = self.travel.cells {
            let (p, normal) = (self.travel.world.onto(triangle, p, direction), self.travel.world.face_normal(triangle));
            let flux = self.flux;
            let pixels = &mut self.arrivals.pixels;
            cells.find(p, direction, normal, |pixel, weight| {
                pixels.push(Deposit { texel: pixel, value: (flux * weight).to_array() });
            });
        }
    }

    /// Refracted or reflected by the water, as [`StepWater`] chose.
    fn water(&mut self, p: Vec3, lanes: &Lanewise, lane: usize) -> (Vec3, Vec3) {
        let reflected = lanes.reflected[lane] > 0.0;
        let normal = vector(&lanes.normal, lane);
        self.photon.wet ^= !reflected;
        self.photon.skip = NONE;
        let to = if reflected { normal } else { -normal };
        (lifted(p, to), vector(&lanes.onward, lane))
    }

    fn mirror(&mut self, p: Vec3, direction: Vec3, triangle: u32, reflectance: Vec3) -> (Vec3, Vec3) {
        let before = sum(self.flux);
        self.flux *= reflectance;
        self.arrivals.audit.absorbed += before - sum(self.flux);
        let face = facing(self.travel.world.face_normal(triangle), direction);
        let smooth = facing(self.travel.world.smooth_normal(triangle, p), direction);
        let mut onward = reflected(direction, smooth);
        if onward.dot(face) <= 0.0 {
            self.arrivals.audit.normals_replaced += 1;
            onward = reflected(direction, face);
        }
        (lifted(p, face), onward)
    }

    fn glass(&mut self, p: Vec3, direction: Vec3, triangle: u32, object: u32) -> (Vec3, Vec3) {
        let world = self.travel.world;
        let outward = world.face_normal(triangle);
        let entering = direction.dot(outward) < 0.0;
        let face = if entering { outward } else { -outward };
        let smooth = world.smooth_normal(triangle, p);
        let mut normal = if entering { smooth } else { -smooth };
        if direction.dot(normal) >= 0.0 {
            self.arrivals.audit.normals_replaced += 1;
            normal = face;
        }
        let within = self.photon.inside[..self.photon.depth as usize].contains(&(object as u16));
        if entering == within {
            // A ray so close to an edge that rounding has put its start beyond the next triangle; or a body that passes through itself.
            self.arrivals.audit.unexpected_sides += 1;
            return (lifted(p, -face), direction);
        }
        let here = self.index_here(None);
        let there = if entering { self.travel.glass_ior[object as usize] } else { self.index_here(Some((object, p))) };
        let here = if entering { here } else { self.travel.glass_ior[object as usize] };
        let choice = self.travel.choice(self.photon.number, self.photon.events);
        let bounced = choice < fresnel_reflectance(-direction.dot(normal), here, there);
        let mut onward = if bounced { reflected(direction, normal) } else { refracted(direction, normal, here / there) };
        let onto = if bounced { face } else { -face };
        if onward.dot(onto) <= 0.0 {
            self.arrivals.audit.normals_replaced += 1;
            onward = if bounced { reflected(direction, face) } else { refracted(direction, face, here / there) };
        }
        if !bounced {
            self.change_side(object, entering, p);
        }
        (lifted(p, onto), onward)
    }

    /// Refractive index at the photon's place; with an object and a point, of what is there once that object is left.
    fn index_here(&self, leaving: Option<(u32, Vec3)>) -> f32 {
        let bodies = &self.photon.inside[..self.photon.depth as usize];
        let innermost = bodies.iter().rev().find(|&&body| leaving.is_none_or(|(object, _)| u32::from(body) != object));
        let wet = match leaving {
            Some((_, p)) => self.travel.water.is_some_and(|water| water.holds(p)),
            None => self.photon.wet,
        };
        match innermost {
            Some(&body) => self.travel.glass_ior[body as usize],
            None if wet => self.travel.water_ior,
            None => 1.0,
        }
    }

    /// Remembers that a body was entered or left.
    fn change_side(&mut self, object: u32, entering: bool, p: Vec3) {
        let photon = &mut self.photon;
        let depth = photon.depth as usize;
        if entering {
            if depth < NESTING {
                photon.inside[depth] = object as u16;
                photon.depth += 1;
            }
            return;
        }
        if let Some(place) = photon.inside[..depth].iter().position(|&body| u32::from(body) == object) {
            photon.inside.copy_within(place + 1..depth, place);
            photon.depth -= 1;
        }
        // Glass displaces water: on which side of its surface the photon comes out, it learns only now.
        photon.wet = self.travel.water.is_some_and(|water| water.holds(p));
    }
}

/// The normal turned against a direction.
fn facing(normal: Vec3, direction: Vec3) -> Vec3 {
    if normal.dot(direction) > 0.0 { -normal } else { normal }
}

/// A point moved off its surface, so that rounding cannot leave it behind.
fn lifted(p: Vec3, normal: Vec3) -> Vec3 {
    p + normal * (LIFT * p.abs().max_element())
}

fn to_v3(v: Vec3) -> V3<f32> {
    v3(v.x, v.y, v.z)
}

fn reflected(direction: Vec3, normal: Vec3) -> Vec3 {
    let r = reflect(to_v3(direction), to_v3(normal));
    Vec3::new(r.x, r.y, r.z).normalize()
}

fn refracted(direction: Vec3, normal: Vec3, eta: f32) -> Vec3 {
    let (r, _) = refract(to_v3(direction), to_v3(normal), eta);
    Vec3::new(r.x, r.y, r.z).normalize()
}
