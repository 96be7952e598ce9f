//! View rays through random places of their pixels, and what media let pass along them.

use arrayvec::ArrayVec;
use glam::Vec3;

use nephroid_scene::geom::Ray;

use super::super::eye::{Eye, MAX_CROSSINGS, Seen, Stretch};
use super::super::media::{Place, even_transmittance};
use super::super::random::{Draws, Purpose};
use super::Media;

/// A view ray: its straight parts, and where it ends.
pub(in super::super) struct View {
    /// In order from the eye.
    pub stretches: ArrayVec<Stretch, { MAX_CROSSINGS as usize }>,
    /// The solid point that it ends at.
    pub seen: Option<Seen>,
}

impl View {
    /// The view ray of a pixel in a batch: through a random place of the pixel.
    pub fn of_pixel(eye: &Eye<'_>, seed: u32, batch: u32, pixel: u32) -> Self {
        let mut draws = Draws::new(seed, Purpose::View, batch, pixel);
        let [x, y] = [pixel % eye.columns(), pixel / eye.columns()].map(|corner| f64::from(corner) + f64::from(draws.uniform()));
        let mut stretches = ArrayVec::new();
        let seen = eye.look(x, y, |stretch| stretches.push(stretch));
        Self { stretches, seen }
    }
}

/// Factors from radiance at the start of each straight part of a view to radiance at the eye, linear RGB.
pub(in super::super) fn passed(stretches: &[Stretch], media: Media<'_>) -> ArrayVec<Vec3, { MAX_CROSSINGS as usize }> {
    let mut passed = Vec3::ONE;
    let mut factors = ArrayVec::new();
    for (number, stretch) in stretches.iter().enumerate() {
        factors.push(passed * stretch.throughput);
        if number + 1 < stretches.len() {
            passed *= match (stretch.place, media.smoke) {
                (Place::Water, _) => even_transmittance(media.medium.sigma_t(), stretch.length),
                (Place::Air, Some(smoke)) => {
                    let ray = Ray { origin: stretch.origin, direction: stretch.direction };
                    smoke.exact_transmittance(ray, stretch.length)
                }
                _ => Vec3::ONE,
            };
        }
    }
    factors
}
