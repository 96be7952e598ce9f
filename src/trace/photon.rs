//! Interactions of one photon with surfaces and media.
//!
//! Photons are never split. At a smooth boundary a photon is refracted or reflected, each with the probability given by Fresnel's law, and keeps its
//! whole flux; media reduce the flux along the way. So every photon has one end, and the audit closes up to rounding.

use fearless_simd::Level;
use glam::Vec3;

use nephroid_math::optics::{fresnel_reflectance, reflect, refract};
use nephroid_math::vector::{V3, v3};
use nephroid_scene::Medium;
use nephroid_scene::geom::Ray;

use super::audit::{Audit, sum};
use super::cells::Cells;
use super::emit::Emitter;
use super::media::{Place, SmokeBox, even_transmittance, water_share};
use super::plane::Plane;
use super::random::Draws;
use super::statistics::Deposit;
use super::tree::NONE;
use super::volume::Beam;
use super::water::WaterSurface;
use super::world::{Facet, Surface, World};

/// Most bodies of glass that may overlap at one point.
const NESTING: usize = 4;

/// Offset of new rays from a surface, as a share of their coordinates, on the side to which they go: the largest distance by which rounding can have
/// put them on the other side. A larger offset would push rays that start near an edge through the next triangle.
const LIFT: f32 = 1.2e-7;

/// The surroundings of photons, for one wavelength or for all.
pub(super) struct Travel<'a> {
    /// SIMD level.
    pub level: Level,
    /// Starts of photons.
    pub emitter: &'a Emitter,
    /// Objects of the scene.
    pub world: &'a World,
    /// The water surface, if there is water.
    pub water: Option<&'a WaterSurface>,
    /// The water's refractive index at this wavelength.
    pub water_ior: f32,
    /// Refractive index of each object at this wavelength; 1 for those that are not glass.
    pub glass_ior: &'a [f32],
    /// The water's medium.
    pub medium: Medium,
    /// Smoke in the air, if any.
    pub smoke: Option<&'a SmokeBox>,
    /// The measuring plane, if any.
    pub plane: Option<&'a Plane>,
    /// Footprints of the pixels, if they are measured.
    pub cells: Option<&'a Cells>,
    /// Whether stretches through scattering media are recorded.
    pub beams: bool,
    /// Factor on each channel: 0 for channels of other wavelengths.
    pub channels: Vec3,
    /// Most surfaces that a photon may meet before it is dropped.
    pub max_events: u32,
    /// Seed of the run.
    pub seed: u32,
    /// Number of the batch, and of the batch's part in scenes with dispersion.
    pub batch: u32,
    /// Number of photons of the batch.
    pub batch_photons: u32,
}

/// Results of a chunk of photons.
#[derive(Default)]
pub(super) struct Arrivals {
    /// Deposits on the measuring plane.
    pub plane: Vec<Deposit>,
    /// Deposits on pixels.
    pub pixels: Vec<Deposit>,
    /// Stretches through scattering media.
    pub beams: Vec<Beam>,
    /// Energy audit of the chunk.
    pub audit: Audit,
}

/// The state of a photon, except for position and direction.
#[derive(Clone, Copy)]
pub(super) struct Photon {
    /// Its random numbers: all random decisions on its path use them.
    pub draws: Draws,
    /// Number of surfaces met.
    events: u32,
    /// The triangle that it comes from, which its next ray skips.
    pub skip: u32,
    /// Flux, W, linear RGB.
    pub flux: Vec3,
    /// Bodies of glass that the photon is in, innermost last; scenes have at most 4096 objects.
    inside: [u16; NESTING],
    depth: u8,
    wet: bool,
    specular: bool,
}

impl Photon {
    /// A photon that leaves its light, outside of all glass.
    pub fn new(draws: Draws, flux: Vec3, wet: bool) -> Self {
        Self { draws, events: 0, skip: NONE, flux, inside: [0; NESTING], depth: 0, wet, specular: false }
    }

    /// The medium that the photon is in.
    pub fn place(&self) -> Place {
        match (self.depth, self.wet) {
            (0, false) => Place::Air,
            (0, true) => Place::Water,
            (depth, _) => Place::Glass(u32::from(self.inside[depth as usize - 1])),
        }
    }
}

/// The next surface of a photon.
pub(super) struct Ahead {
    /// Distance to the surface, m; infinite if there is none.
    pub length: f32,
    /// The triangle, or [`NONE`] for the water.
    pub triangle: u32,
    /// A number uniform in `[0, 1)`, drawn for this surface of whatever kind: the photon is reflected if the number is below the reflectance.
    pub choice: f32,
}

/// Interaction of a photon with the water surface.
pub(super) struct Wetting {
    /// Whether the photon is reflected.
    pub reflected: bool,
    /// Normal on the side of the photon.
    pub normal: Vec3,
    /// Direction after the interaction.
    pub onward: Vec3,
}

/// A photon during a step.
pub(super) struct One<'a, 'b> {
    pub travel: &'a Travel<'a>,
    pub photon: &'b mut Photon,
    pub arrivals: &'b mut Arrivals,
}

impl One<'_, '_> {
    /// Moves the photon to the next surface and through the interaction there. Returns the new origin and direction, or `None` at the photon's end.
    #[inline]
    pub fn step(&mut self, ray: Ray, ahead: Ahead, water: impl FnOnce() -> Wetting) -> Option<(Vec3, Vec3)> {
        let Ray { origin, direction } = ray;
        let Ahead { length, triangle, choice } = ahead;
        self.cross(origin, direction, length);
        if self.photon.flux == Vec3::ZERO {
            return None;
        }
        if length == f32::INFINITY {
            let end = if self.photon.specular { &mut self.arrivals.audit.left } else { &mut self.arrivals.audit.missed };
            *end += sum(self.photon.flux);
            return None;
        }
        self.arrivals.audit.events += 1;
        self.photon.events += 1;
        let p = origin + direction * length;
        let world = self.travel.world;
        self.photon.skip = triangle;
        let onward = if triangle == NONE {
            let Wetting { reflected, normal, onward } = water();
            self.photon.wet ^= !reflected;
            (lifted(p, if reflected { normal } else { -normal }), onward)
        } else {
            let object = world.object(triangle);
            let surface = world.surfaces[object as usize];
            if surface == Surface::Diffuse {
                self.land(p, direction, triangle);
                return None;
            }
            let facet = world.facet(triangle);
            let p = facet.onto(p, direction);
            match surface {
                Surface::Mirror(reflectance) => self.mirror(p, direction, &facet, reflectance),
                _ => self.glass(p, direction, &facet, object, choice),
            }
        };
        if self.photon.events >= self.travel.max_events {
            self.arrivals.audit.lost += sum(self.photon.flux);
            self.arrivals.audit.photons_lost += 1;
            return None;
        }
        self.photon.specular = true;
        Some(onward)
    }

    /// Handles the measuring plane and the medium on the way to the next surface.
    fn cross(&mut self, origin: Vec3, direction: Vec3, length: f32) {
        let travel = self.travel;
        let place = self.photon.place();
        let ray = Ray { origin, direction };
        if let Some(plane) = travel.plane
            && self.photon.specular
            && let Some((texel, distance)) = plane.crossed(origin, direction, length)
        {
            // Measurements must not change the path, so they use a random sequence of their own.
            let mut aside = self.photon.draws.aside();
            let value = self.photon.flux * self.transmittance(place, ray, distance, &mut aside);
            self.arrivals.plane.push(Deposit { texel, value: value.to_array() });
        }
        let before = self.photon.flux;
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
                    self.arrivals.beams.push(Beam { origin, direction, length, flux: before, place });
                }
                water_share(medium)
            }
            Place::Glass(_) => Vec3::ZERO,
        };
        let mut draws = self.photon.draws;
        self.photon.flux = before * self.transmittance(place, ray, length, &mut draws);
        self.photon.draws = draws;
        let taken = sum(before) - sum(self.photon.flux);
        if taken != 0.0 {
            let scattered = sum((before - self.photon.flux) * share);
            self.arrivals.audit.scattered += scattered;
            self.arrivals.audit.absorbed += taken - scattered;
        }
    }

    /// Records the stretch of a ray through smoke, with the flux that reaches it.
    fn smoke_beam(&mut self, smoke: &SmokeBox, ray: Ray, length: f32) {
        if let Some((enter, leave)) = smoke.span(ray, length) {
            let beam =
                Beam { origin: ray.at(enter), direction: ray.direction, length: leave - enter, flux: self.photon.flux, place: Place::Air };
            self.arrivals.beams.push(beam);
        }
    }

    /// Transmittance from the start of a ray to a distance.
    fn transmittance(&self, place: Place, ray: Ray, length: f32, draws: &mut Draws) -> Vec3 {
        let travel = self.travel;
        match place {
            Place::Air => travel.smoke.map_or(Vec3::ONE, |smoke| smoke.transmittance(ray, length, draws)),
            Place::Water => even_transmittance(travel.medium.sigma_t(), length),
            Place::Glass(object) => match travel.world.surfaces[object as usize] {
                Surface::Glass { absorption, .. } => even_transmittance(absorption, length),
                _ => Vec3::ONE,
            },
        }
    }

    /// Ends the photon on a diffuse surface.
    fn land(&mut self, p: Vec3, direction: Vec3, triangle: u32) {
        let watts = sum(self.photon.flux);
        if !self.photon.specular {
            self.arrivals.audit.landed_direct += watts;
            return;
        }
        self.arrivals.audit.landed += watts;
        if let Some(cells) = self.travel.cells {
            let facet = self.travel.world.facet(triangle);
            let (p, normal) = (facet.onto(p, direction), facet.normal());
            let flux = self.photon.flux;
            let pixels = &mut self.arrivals.pixels;
            cells.find(p, direction, normal, |pixel, weight| {
                pixels.push(Deposit { texel: pixel, value: (flux * weight).to_array() });
            });
        }
    }

    fn mirror(&mut self, p: Vec3, direction: Vec3, facet: &Facet<'_>, reflectance: Vec3) -> (Vec3, Vec3) {
        let before = sum(self.photon.flux);
        self.photon.flux *= reflectance;
        self.arrivals.audit.absorbed += before - sum(self.photon.flux);
        let face = facing(facet.normal(), direction);
        let smooth = facing(facet.smooth_normal(p), direction);
        let mut onward = reflected(direction, smooth);
        if onward.dot(face) <= 0.0 {
            self.arrivals.audit.normals_replaced += 1;
            onward = reflected(direction, face);
        }
        (lifted(p, face), onward)
    }

    fn glass(&mut self, p: Vec3, direction: Vec3, facet: &Facet<'_>, object: u32, choice: f32) -> (Vec3, Vec3) {
        let outward = facet.normal();
        let entering = direction.dot(outward) < 0.0;
        let face = if entering { outward } else { -outward };
        let smooth = facet.smooth_normal(p);
        let mut normal = if entering { smooth } else { -smooth };
        if direction.dot(normal) >= 0.0 {
            self.arrivals.audit.normals_replaced += 1;
            normal = face;
        }
        let within = self.photon.inside[..self.photon.depth as usize].contains(&(object as u16));
        if entering == within {
            // Rounding has put the ray's start beyond the next triangle at an edge, or the body intersects itself.
            self.arrivals.audit.unexpected_sides += 1;
            return (lifted(p, -face), direction);
        }
        let here = self.index_here(None);
        let there = if entering { self.travel.glass_ior[object as usize] } else { self.index_here(Some((object, p))) };
        let here = if entering { here } else { self.travel.glass_ior[object as usize] };
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

    /// Refractive index at the photon. With an object and a point, the index of the medium that remains after leaving that object.
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

    /// Records that a body was entered or left.
    fn change_side(&mut self, object: u32, entering: bool, p: Vec3) {
        let photon = &mut *self.photon;
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
        // Glass displaces water, so the side of the water surface on which the photon emerges is determined here.
        photon.wet = self.travel.water.is_some_and(|water| water.holds(p));
    }
}

/// The normal, turned against a direction.
fn facing(normal: Vec3, direction: Vec3) -> Vec3 {
    if normal.dot(direction) > 0.0 { -normal } else { normal }
}

/// A point moved off its surface, so that rounding cannot put it on the other side.
pub(super) fn lifted(p: Vec3, normal: Vec3) -> Vec3 {
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
