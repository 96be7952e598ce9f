//! Surfaces that have a formula: a sum of waves and noise at one moment, exact at any point.

use std::f64::consts::TAU;

use glam::{DVec2, Vec2};

use crate::math::float::sin_cos;
use crate::math::noise::Fbm;

/// A plane or one wave, frozen at a moment; wave numbers in rad/m, phases in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Term {
    /// `slope · ((x, z) − center)`.
    Plane { slope: DVec2, center: DVec2 },
    /// `a · cos(k_x x + k_z z + phase)`.
    Wave { amplitude_m: f64, k_x: f64, k_z: f64, phase: f64 },
    /// `a · cos(k (√(r² + core²) − core) + phase)` around `center` (x, z).
    Circular { amplitude_m: f64, center: DVec2, core_m: f64, k: f64, phase: f64 },
}

/// Fractal noise, frozen at a moment: `amplitude · fbm(x/feature, z/feature, phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoiseTerm {
    pub amplitude_m: f32,
    pub feature_m: f32,
    pub phase: f32,
    pub fbm: Fbm,
    pub seed: u32,
}

/// A water surface with a closed form, frozen at a moment: cheap to evaluate at many points.
///
/// Made by [`Water::formula`](super::Water::formula).
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    pub(super) level_m: f64,
    pub(super) terms: Vec<Term>,
    pub(super) noise: Option<NoiseTerm>,
}

/// Cosine of a phase and its derivative `−sin`: the phase is reduced in 64 bits, so that neither large coordinates nor late times cost accuracy.
fn cosine(phase: f64) -> (f64, f64) {
    let turns = phase / TAU;
    let (s, c) = sin_cos(((turns - (turns + 0.5).floor()) * TAU) as f32);
    (f64::from(c), -f64::from(s))
}

impl Term {
    /// Height in metres and slope `(∂h/∂x, ∂h/∂z)` at world (x, z).
    fn height_and_slope(&self, p: DVec2) -> (f64, DVec2) {
        match *self {
            Self::Plane { slope, center } => (slope.dot(p - center), slope),
            Self::Wave { amplitude_m, k_x, k_z, phase } => {
                let (value, derivative) = cosine(k_x * p.x + k_z * p.y + phase);
                (amplitude_m * value, DVec2::new(k_x, k_z) * (amplitude_m * derivative))
            }
            Self::Circular { amplitude_m, center, core_m, k, phase } => {
                let offset = p - center;
                let rounded = (offset.length_squared() + core_m * core_m).sqrt();
                let (value, derivative) = cosine(k * (rounded - core_m) + phase);
                // ∂r̂/∂x = x/√(r² + core²); the tip of a sharp cone has no slope.
                let outwards = if rounded > 0.0 { offset / rounded } else { DVec2::ZERO };
                (amplitude_m * value, outwards * (amplitude_m * k * derivative))
            }
        }
    }
}

impl NoiseTerm {
    fn height_and_slope(&self, x: f32, z: f32) -> (f64, DVec2) {
        let scale = 1.0 / self.feature_m;
        let (value, gradient) = self.fbm.at3_gradient(x * scale, z * scale, self.phase, self.seed);
        let slope = f64::from(self.amplitude_m) * f64::from(scale);
        (f64::from(self.amplitude_m) * f64::from(value), DVec2::new(f64::from(gradient[0]), f64::from(gradient[1])) * slope)
    }
}

impl Formula {
    /// World y in metres and slope `(∂y/∂x, ∂y/∂z)` at world (x, z). The surface goes on beyond the extent of the water.
    #[must_use]
    pub fn height_and_slope(&self, x_ws: f32, z_ws: f32) -> (f32, Vec2) {
        let p = DVec2::new(f64::from(x_ws), f64::from(z_ws));
        let (mut height, mut slope) = (self.level_m, DVec2::ZERO);
        let noise = self.noise.iter().map(|noise| noise.height_and_slope(x_ws, z_ws));
        for (h, s) in self.terms.iter().map(|term| term.height_and_slope(p)).chain(noise) {
            height += h;
            slope += s;
        }
        (height as f32, slope.as_vec2())
    }
}
