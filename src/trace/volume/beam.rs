//! The light that a beam scatters towards view rays.

use glam::Vec3;

use nephroid_math::float::exp;
use nephroid_math::lanes::Lanes;
use nephroid_math::optics::henyey_greenstein;
use nephroid_math::vector::{V3, v3};
use nephroid_scene::geom::{Aabb, Ray};

use super::super::media::{Place, SmokeBox};
use super::{LANES, Media};

/// A straight part of a photon's path through a medium that scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Beam {
    /// Start, world space, m.
    pub origin: Vec3,
    /// Unit vector of propagation.
    pub direction: Vec3,
    /// Length, m; may be infinite.
    pub length: f32,
    /// Flux at the start, W, linear RGB.
    pub flux: Vec3,
    /// Medium that the beam runs through.
    pub place: Place,
}

/// A beam with what its medium does to its light.
pub(super) struct Lit<'a> {
    pub beam: Beam,
    /// Coefficients at density 1, 1/m, linear RGB.
    sigma_s: Vec3,
    sigma_t: Vec3,
    /// Mean cosine of the phase function.
    g: f32,
    /// The smoke around the beam, if its medium is smoke.
    smoke: Option<&'a SmokeBox>,
    /// Density, and its integral from the start of the beam, m, in even steps; empty if the density is 1.
    columns: Vec<[f32; 2]>,
    steps_per_m: f32,
    /// Most that a part of the beam may be long for its density to count as even and its attenuation as slight, m.
    pub most: f32,
}

/// Parts of a beam, each with the views that pass it.
#[derive(Clone, Copy)]
pub(super) struct Parts<L> {
    /// Length, m.
    pub chord: L,
    /// Direction of the views, away from the eye.
    pub direction: V3<L>,
    /// One over the volume per area of the picture in pixels and length of the views: 1/m².
    pub per_volume: L,
    /// Density of the medium.
    pub density: L,
    /// Integral of the density from the start of the beam, and from the start of the view, m.
    pub columns: [L; 2],
    /// By how much the way to the eye grows with the way along the beam.
    pub slope: L,
}

impl<'a> Lit<'a> {
    /// A beam in its medium; `columns` is a buffer for its tables.
    pub fn new(beam: Beam, media: Media<'a>, mut columns: Vec<[f32; 2]>) -> Self {
        /// Length of the steps of a table, in cells of the smoke.
        const STEP: f32 = 0.5;
        /// Optical depth of a part.
        const DEPTH: f32 = 0.5;
        columns.clear();
        let mut steps_per_m = 0.0;
        let smoke = media.smoke.filter(|_| beam.place == Place::Air);
        let (sigma_s, sigma_t, g) = match smoke {
            Some(smoke) => (smoke.sigma_s, smoke.sigma_t, smoke.g),
            None => (media.medium.sigma_s, media.medium.sigma_t(), media.medium.g),
        };
        let mut most = DEPTH / sigma_t.max_element().max(f32::MIN_POSITIVE);
        if let Some(smoke) = smoke.filter(|smoke| smoke.is_uneven()) {
            let step = STEP * smoke.cell_size();
            let count = (beam.length / step).ceil().max(1.0);
            steps_per_m = count / beam.length;
            let ray = Ray { origin: beam.origin, direction: beam.direction };
            let density = |k: f32| smoke.density_near(ray.at(k / steps_per_m));
            let mut node = [density(0.0), 0.0];
            columns.push(node);
            for k in 0..count as u32 {
                let (middle, end) = (density(k as f32 + 0.5), density(k as f32 + 1.0));
                node = [end, node[1] + (node[0] + 4.0 * middle + end) / (6.0 * steps_per_m)];
                columns.push(node);
            }
            most = most.min(step);
        }
        Self { beam, sigma_s, sigma_t, g, smoke, columns, steps_per_m, most }
    }

    /// The buffer of the tables.
    pub fn into_columns(self) -> Vec<[f32; 2]> {
        self.columns
    }

    /// Densities at distances along the beam, and their integrals from the start of the beam.
    #[inline(always)]
    pub fn densities<L: Lanes>(&self, token: L::Token, s: L) -> (L, L) {
        if self.columns.is_empty() {
            return (L::splat(token, 1.0), s);
        }
        let s = s.to_array();
        let (mut densities, mut columns) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..L::LEN {
            let at = s[k] * self.steps_per_m;
            let step = (at.max(0.0) as usize).min(self.columns.len() - 2);
            let ([d0, c0], [d1, c1], share) = (self.columns[step], self.columns[step + 1], at - step as f32);
            densities[k] = d0 + (d1 - d0) * share;
            columns[k] = c0 + (c1 - c0) * share;
        }
        (L::load(token, &densities), L::load(token, &columns))
    }

    /// Integrals of the density along views that start at `origin`, over `way` metres. Views without a bit in `wanted` may get any numbers.
    #[inline(always)]
    pub fn view_columns<L: Lanes>(&self, token: L::Token, origin: V3<L>, direction: V3<L>, way: L, wanted: u32) -> L {
        let Some(smoke) = self.smoke else { return way };
        if self.columns.is_empty() {
            return within(token, smoke.bounds(), origin, direction, way);
        }
        let (ox, oy, oz) = (origin.x.to_array(), origin.y.to_array(), origin.z.to_array());
        let (dx, dy, dz) = (direction.x.to_array(), direction.y.to_array(), direction.z.to_array());
        let (way, mut columns) = (way.to_array(), [0.0; LANES]);
        for k in 0..L::LEN {
            if wanted >> k & 1 == 1 {
                let view = Ray { origin: Vec3::new(ox[k], oy[k], oz[k]), direction: Vec3::new(dx[k], dy[k], dz[k]) };
                columns[k] = smoke.column(view, 0.0, way[k]);
            }
        }
        L::load(token, &columns)
    }

    /// Whether the beam is in smoke of varying density.
    pub fn is_in_uneven_smoke(&self) -> bool {
        !self.columns.is_empty()
    }

    /// Radiance at the start of the views, W/(m² sr), mean over their pixel.
    #[inline(always)]
    pub fn scattered<L: Lanes>(&self, token: L::Token, parts: &Parts<L>) -> V3<L> {
        let cos = -parts.direction.dot(V3::splat(token, self.beam.direction));
        let base = parts.chord * parts.per_volume * parts.density * henyey_greenstein(cos, self.g);
        let depth = -(parts.columns[0] + parts.columns[1]);
        let change = parts.density * (parts.slope + 1.0) * parts.chord * 0.5;
        let strength = self.beam.flux * self.sigma_s;
        v3(
            base * passed(self.sigma_t.x, depth, change) * strength.x,
            base * passed(self.sigma_t.y, depth, change) * strength.y,
            base * passed(self.sigma_t.z, depth, change) * strength.z,
        )
    }
}

/// Transmittance in one channel: the mean of `e^(−σ x)` over the chord is its value in the middle times `sinh(h)/h`, h half the change of the exponent.
#[inline(always)]
fn passed<L: Lanes>(sigma_t: f32, depth: L, change: L) -> L {
    let h = change * sigma_t;
    let square = h * h;
    exp(depth * sigma_t) * ((square * (1.0 / 20.0) + 1.0) * square * (1.0 / 6.0) + 1.0)
}

/// Lengths of rays in a box.
#[inline(always)]
fn within<L: Lanes>(token: L::Token, bounds: Aabb, origin: V3<L>, direction: V3<L>, length: L) -> L {
    let (a, b) = (V3::splat(token, bounds.min) - origin, V3::splat(token, bounds.max) - origin);
    let zero = L::splat(token, 0.0);
    let (mut enter, mut leave) = (zero, length);
    for (a, b, along) in [(a.x, b.x, direction.x), (a.y, b.y, direction.y), (a.z, b.z, direction.z)] {
        let inverse = zero.like(1.0) / safe(along);
        let (a, b) = (a * inverse, b * inverse);
        enter = Lanes::max(enter, Lanes::min(a, b));
        leave = Lanes::min(leave, Lanes::max(a, b));
    }
    Lanes::max(leave - enter, zero)
}

/// A divisor, away from 0.
#[inline(always)]
pub(super) fn safe<L: Lanes>(divisor: L) -> L {
    /// Lower bound on the magnitude of divisors.
    const LEAST: f32 = 1.0e-20;
    let least = divisor.like(LEAST);
    L::select(divisor.abs().lt(least), least, divisor)
}
