//! Traces photons in waves of [`WAVE`].
//!
//! Each step first intersects the whole wave with the water, sixteen photons at a time, and computes the interaction with the water; then it searches
//! for nearer triangles; then each photon takes its step. Photons that continue are compacted for the next step. Photons with neighbouring numbers
//! start near each other, so those in neighbouring lanes mostly meet the same surfaces.

use fearless_simd::{Simd, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::level::wide_dispatch;
use nephroid_math::optics::{fresnel_reflectance, reflect, refract};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::geom::Ray;

use super::audit::{Audit, sum};
use super::emit::Start;
use super::media::Place;
use super::photon::{Ahead, Arrivals, One, Photon, Travel, Wetting};
use super::tree::{Hits, NONE, Packet};
use super::water::{Heights, OverHeights, Rays, WaterSurface, crossings};

/// Number of photons that step together.
const WAVE: usize = 512;

/// Values of all photons of a wave, one array per coordinate.
struct Lanewise {
    origin: [[f32; WAVE]; 3],
    direction: [[f32; WAVE]; 3],
    /// Side of the water surface: 1 above, −1 below, 0 inside glass.
    side: [f32; WAVE],
    /// [`Ahead::choice`], drawn before the next surface is known, so that it is drawn alike for water and glass.
    choice: [f32; WAVE],
    /// [`Photon::skip`].
    skip: [u32; WAVE],
    /// Distance to the next surface: first the water's, then that of a nearer triangle.
    t: [f32; WAVE],
    /// Number of the triangle if a triangle is the next surface.
    triangle: [u32; WAVE],
    /// Normal of the water at the intersection, on the side of the photon.
    normal: [[f32; WAVE]; 3],
    /// Direction after the interaction with the water.
    onward: [[f32; WAVE]; 3],
    /// 1 for photons that the water reflects.
    reflected: [f32; WAVE],
}

/// Scratch buffers for a wave; kept from wave to wave.
pub(super) struct Scratch {
    lanes: Box<Lanewise>,
    photons: Vec<Photon>,
    starts: Vec<Start>,
}

impl Scratch {
    /// Allocates the buffers.
    pub fn new() -> Self {
        let lanes = Lanewise {
            origin: [[0.0; WAVE]; 3],
            direction: [[0.0; WAVE]; 3],
            side: [0.0; WAVE],
            choice: [0.0; WAVE],
            skip: [NONE; WAVE],
            t: [0.0; WAVE],
            triangle: [NONE; WAVE],
            normal: [[0.0; WAVE]; 3],
            onward: [[0.0; WAVE]; 3],
            reflected: [0.0; WAVE],
        };
        Self { lanes: Box::new(lanes), photons: Vec::with_capacity(WAVE), starts: Vec::with_capacity(WAVE) }
    }
}

/// Traces the photons `first..first + number` of the batch.
pub(super) fn travel(travel: &Travel<'_>, first: u32, number: u32, scratch: &mut Scratch) -> Arrivals {
    let mut arrivals = Arrivals::default();
    let mut sent = 0;
    while sent < number {
        let count = (number - sent).min(WAVE as u32);
        travel.emitter.start(travel.seed, travel.batch, first + sent, travel.batch_photons, &mut scratch.starts, count as usize);
        begin(travel, scratch, &mut arrivals.audit);
        while !scratch.photons.is_empty() {
            step(travel, scratch, &mut arrivals);
        }
        sent += count;
    }
    arrivals
}

/// Loads photons into the lanes.
fn begin(travel: &Travel<'_>, scratch: &mut Scratch, audit: &mut Audit) {
    let Scratch { lanes, photons, starts } = scratch;
    photons.clear();
    for (lane, start) in starts.iter().enumerate() {
        let flux = start.flux * travel.channels;
        audit.emitted += sum(flux);
        audit.photons += 1;
        // Parallel light starts outside of the water.
        let wet = travel.water.is_some_and(|water| water.holds(start.origin));
        let mut photon = Photon::new(start.draws, flux, wet);
        lanes.put(lane, &mut photon, start.origin, start.direction);
        photons.push(photon);
    }
}

impl Lanewise {
    /// Prepares a photon for its next step.
    #[inline(always)]
    fn put(&mut self, lane: usize, photon: &mut Photon, origin: Vec3, direction: Vec3) {
        for axis in 0..3 {
            self.origin[axis][lane] = origin[axis];
            self.direction[axis][lane] = direction[axis];
        }
        self.side[lane] = match photon.place() {
            Place::Air => 1.0,
            Place::Water => -1.0,
            Place::Glass(_) => 0.0,
        };
        (self.choice[lane], self.skip[lane]) = (photon.draws.uniform(), photon.skip);
    }
}

#[inline(always)]
fn vector(lanes: &[[f32; WAVE]; 3], lane: usize) -> Vec3 {
    Vec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane])
}

/// Moves every photon of the wave to its next surface.
fn step(travel: &Travel<'_>, scratch: &mut Scratch, arrivals: &mut Arrivals) {
    let Scratch { lanes, photons, .. } = scratch;
    let count = photons.len();
    match travel.water {
        Some(water) => water.over(StepWater { travel, water, lanes, count }),
        None => lanes.t[..count].fill(f32::INFINITY),
    }
    for first in (0..count).step_by(16) {
        find_triangles(travel, lanes, first, (count - first).min(16));
    }
    let mut kept = 0;
    for lane in 0..count {
        let ray = Ray { origin: vector(&lanes.origin, lane), direction: vector(&lanes.direction, lane) };
        let ahead = Ahead { length: lanes.t[lane], triangle: lanes.triangle[lane], choice: lanes.choice[lane] };
        let wetting =
            || Wetting { reflected: lanes.reflected[lane] > 0.0, normal: vector(&lanes.normal, lane), onward: vector(&lanes.onward, lane) };
        let onward = One { travel, photon: &mut photons[lane], arrivals }.step(ray, ahead, wetting);
        if let Some((origin, direction)) = onward {
            photons[kept] = photons[lane];
            lanes.put(kept, &mut photons[kept], origin, direction);
            kept += 1;
        }
    }
    photons.truncate(kept);
}

/// Searches for triangles nearer than the water, for `count` photons from `first` on.
fn find_triangles(travel: &Travel<'_>, lanes: &mut Lanewise, first: usize, count: usize) {
    let (t, side) = (part(&lanes.t, first), part(&lanes.side, first));
    let active = 0xffff_u32 >> (16 - count);
    let mut above = 0;
    for lane in 0..16 {
        above |= u32::from(t[lane] < f32::INFINITY && side[lane] > 0.0) << lane;
    }
    let mut hits = Hits { t: *t, triangles: [NONE; 16] };
    let packet = Packet {
        origin: lanes.origin.each_ref().map(|v| part(v, first)),
        direction: lanes.direction.each_ref().map(|v| part(v, first)),
        skip: part(&lanes.skip, first),
    };
    travel.world.nearest_of_packet(&packet, active, above, &mut hits);
    lanes.t[first..first + 16].copy_from_slice(&hits.t);
    lanes.triangle[first..first + 16].copy_from_slice(&hits.triangles);
}

/// Sixteen neighbouring elements of an array.
#[inline(always)]
fn part<T>(numbers: &[T; WAVE], first: usize) -> &[T; 16] {
    numbers[first..].first_chunk().unwrap_or_else(|| unreachable!("a wave is a whole number of sixteens"))
}

/// Intersects the first `count` photons of a wave with the water and computes their interactions with it.
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
    let ior = travel.water_ior;
    // The normal is on the side of the photon. A smooth normal of a mesh may lean away from grazing light; the light then counts as grazing.
    let up = side.gt(side.like(0.0));
    let normal = V3::select(up, crossing.normal, -crossing.normal);
    let cos = -direction.dot(normal);
    let from_air = fresnel_reflectance(cos, 1.0, ior);
    let from_water = fresnel_reflectance(cos, ior, 1.0);
    let reflectance = L::select(up, from_air, from_water);
    let (into_water, _) = refract(direction, normal, 1.0 / ior);
    let (into_air, _) = refract(direction, normal, ior);
    let bounced = L::load(token, &lanes.choice[first..]).lt(reflectance);
    let onward = V3::select(bounced, reflect(direction, normal), V3::select(up, into_water, into_air));
    store3(normal, &mut lanes.normal, first);
    store3(onward.normalize(), &mut lanes.onward, first);
    L::select(bounced, side.like(1.0), side.like(0.0)).store(&mut lanes.reflected[first..]);
}
