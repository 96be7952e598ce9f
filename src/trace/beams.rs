//! Light that the medium scatters once towards the eye: photon beams against view rays.
//!
//! Every straight part of a photon's path through a scattering medium is a beam. A view ray that passes a beam at a distance of less than half the
//! beam's width w receives [Jarosz et al. 2011, beam x beam 1D]
//!
//! `L += σ_s p(θ) Φ T(photon) T(eye) / (w sin θ)`, θ the angle between beam and view ray.
//!
//! The width is the only approximation: the result is blurred over w, across the beam. The beams of a batch are cut into pieces and stored in a
//! hierarchy, which every view ray traverses.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::Ray as BoxRay;

use nephroid_math::optics::henyey_greenstein;
use nephroid_scene::Medium;
use nephroid_scene::geom::Ray;

use super::eye::Stretch;
use super::media::{Place, SmokeBox, even_transmittance};
use super::random::Draws;

/// Length of the pieces that beams are cut into, in beam widths: shorter pieces have tighter boxes, longer pieces are fewer.
const PIECE_WIDTHS: f32 = 16.0;

/// Most pieces that one beam is cut into.
const MAX_PIECES: u32 = 64;

/// View rays and beams whose angle has a sine below this are skipped: 1/sin θ would be mostly noise.
const LEAST_SINE: f32 = 1.0e-3;

/// A straight part of a photon's path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beam {
    /// Start, world space, m.
    pub origin: Vec3,
    /// Unit vector of propagation.
    pub direction: Vec3,
    /// Length, m.
    pub length: f32,
    /// Flux at the start, W.
    pub flux: Vec3,
    /// Medium that the beam runs through.
    pub place: Place,
}

/// The beams of a batch, in a hierarchy for view rays.
pub(super) struct BeamTree<'a> {
    beams: &'a [Beam],
    /// Number of the beam and range of distances along it, in the order of the hierarchy.
    pieces: Vec<(u32, f32, f32)>,
    bvh: Bvh2,
    width: f32,
    medium: Medium,
    smoke: Option<&'a SmokeBox>,
}

impl<'a> BeamTree<'a> {
    /// Builds the hierarchy. Beams end at `reach` metres from their start.
    pub fn new(beams: &'a [Beam], width: f32, reach: f32, medium: Medium, smoke: Option<&'a SmokeBox>) -> Self {
        let mut pieces = Vec::new();
        let mut boxes = Vec::new();
        for (number, beam) in beams.iter().enumerate() {
            let length = beam.length.min(reach);
            let count = ((length / (PIECE_WIDTHS * width)).ceil() as u32).clamp(1, MAX_PIECES);
            for k in 0..count {
                let (from, to) = (length * k as f32 / count as f32, length * (k + 1) as f32 / count as f32);
                let (a, b) = (Vec3A::from(beam.origin + beam.direction * from), Vec3A::from(beam.origin + beam.direction * to));
                let slack = Vec3A::splat(0.5 * width * 1.001);
                boxes.push(Bounds::new(a.min(b) - slack, a.max(b) + slack));
                pieces.push((number as u32, from, to));
            }
        }
        let indices = (0..boxes.len() as u32).collect();
        let bvh = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::VeryLow, &boxes, indices, SortPrecision::U64, 0);
        let pieces = bvh.primitive_indices.iter().map(|&index| pieces[index as usize]).collect();
        Self { beams, pieces, bvh, width, medium, smoke }
    }

    /// Radiance that reaches the eye from one stretch of a view ray, W/(m² sr), without the attenuation between the eye and the stretch. `draws` are
    /// the random numbers of the view ray.
    pub fn gather(&self, view: &Stretch, draws: &mut Draws) -> Vec3 {
        let (o, d) = (Vec3A::from(view.origin), Vec3A::from(view.direction));
        let mut sum = Vec3::ZERO;
        if self.pieces.is_empty() {
            return sum;
        }
        self.bvh.ray_traverse_anyhit(BoxRay::new(o, d, 0.0, view.length), |_, index| {
            sum += self.meet(view, index, draws);
        });
        sum
    }

    /// Contribution of one piece of a beam.
    fn meet(&self, view: &Stretch, index: usize, draws: &mut Draws) -> Vec3 {
        let (number, from, to) = self.pieces[index];
        let beam = &self.beams[number as usize];
        if beam.place != view.place {
            return Vec3::ZERO;
        }
        let cross = view.direction.cross(beam.direction);
        let sine = cross.length();
        if sine < LEAST_SINE {
            return Vec3::ZERO;
        }
        let offset = beam.origin - view.origin;
        let scale = 1.0 / (sine * sine);
        if (offset.dot(cross) / sine).abs() > 0.5 * self.width {
            return Vec3::ZERO;
        }
        // Points of smallest distance: their distances along the view ray and along the beam.
        let seen_at = offset.cross(beam.direction).dot(cross) * scale;
        let along = offset.cross(view.direction).dot(cross) * scale;
        if !(seen_at >= 0.0 && seen_at < view.length && along >= from && along < to) {
            return Vec3::ZERO;
        }
        // Scattered light travels towards the eye, against the view ray.
        let cos = -view.direction.dot(beam.direction);
        let (sigma_s, g, transmittance) = match (view.place, self.smoke) {
            (Place::Air, Some(smoke)) => {
                let at = Ray { origin: view.origin, direction: view.direction };
                let to_eye = smoke.transmittance(at, seen_at, draws);
                let from_light = smoke.transmittance(Ray { origin: beam.origin, direction: beam.direction }, along, draws);
                (smoke.sigma_s * smoke.density(at.at(seen_at)), smoke.g, to_eye * from_light)
            }
            (Place::Water, _) => (self.medium.sigma_s, self.medium.g, even_transmittance(self.medium.sigma_t(), seen_at + along)),
            _ => return Vec3::ZERO,
        };
        beam.flux * sigma_s * transmittance * (henyey_greenstein(cos, g) / (self.width * sine))
    }
}
