//! Surfaces that have a formula: a sum of waves and noise at one moment, exact at any point.

use std::f64::consts::TAU;

use glam::{DVec2, Vec2};

use nephroid_math::float::sin_cos;
use nephroid_math::lanes::Lanes;
use nephroid_math::noise::Fbm;

/// A plane or one wave, frozen at a moment; wave numbers in rad/m, phases in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Term {
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

/// Bound on the magnitude of the gradient of one octave of Perlin noise in space: ramps of unit slope, each weighted by at most 1, and the
/// fade's steepest slope 15/8 along each axis times differences of ramps of at most √3.
const NOISE_SLOPE: f64 = 1.0 + 1.875 * 1.733 * 1.733;

impl Formula {
    /// Height above the mean level in metres and slope along x and z, for many points at once.
    ///
    /// Phases are computed in 32 bits: for coordinates of a hundred waves the slope is good to some 1e-5 of its largest value, and
    /// better in proportion nearer to the origin. [`Self::height_and_slope`] has no such limit.
    #[inline(always)]
    pub fn rise_and_slope<L: Lanes>(&self, x_ws: L, z_ws: L) -> (L, L, L) {
        let zero = x_ws.like(0.0);
        let (mut height, mut slope_x, mut slope_z) = (zero, zero, zero);
        for term in &self.terms {
            match *term {
                Term::Plane { slope, center } => {
                    let (sx, sz) = (slope.x as f32, slope.y as f32);
                    height = height + (x_ws - center.x as f32) * sx + (z_ws - center.y as f32) * sz;
                    slope_x = slope_x + sx;
                    slope_z = slope_z + sz;
                }
                Term::Wave { amplitude_m, k_x, k_z, phase } => {
                    let turn = phase - (phase / TAU).floor() * TAU;
                    let (s, c) = sin_cos(x_ws * k_x as f32 + z_ws * k_z as f32 + turn as f32);
                    height = height + c * amplitude_m as f32;
                    slope_x = slope_x - s * (amplitude_m * k_x) as f32;
                    slope_z = slope_z - s * (amplitude_m * k_z) as f32;
                }
                Term::Circular { amplitude_m, center, core_m, k, phase } => {
                    let turn = (phase - k * core_m) - ((phase - k * core_m) / TAU).floor() * TAU;
                    let (dx, dz) = (x_ws - center.x as f32, z_ws - center.y as f32);
                    let rounded = (dx * dx + dz * dz + (core_m * core_m) as f32).sqrt();
                    let (s, c) = sin_cos(rounded * k as f32 + turn as f32);
                    height = height + c * amplitude_m as f32;
                    let outwards = s * (-amplitude_m * k) as f32 / Lanes::max(rounded, x_ws.like(1.0e-30));
                    slope_x = slope_x + dx * outwards;
                    slope_z = slope_z + dz * outwards;
                }
            }
        }
        if let Some(noise) = &self.noise {
            let (xs, zs) = (x_ws.to_array(), z_ws.to_array());
            let mut sampled = [[0.0_f32; 16]; 3];
            for lane in 0..L::LEN {
                let (h, slope) = noise.height_and_slope(xs[lane], zs[lane]);
                (sampled[0][lane], sampled[1][lane], sampled[2][lane]) = (h as f32, slope.x as f32, slope.y as f32);
            }
            height = height + L::load(x_ws.token(), &sampled[0]);
            slope_x = slope_x + L::load(x_ws.token(), &sampled[1]);
            slope_z = slope_z + L::load(x_ws.token(), &sampled[2]);
        }
        (height, slope_x, slope_z)
    }

    /// Bounds that hold everywhere within `extent_m` of the planes' middle: magnitude of the height above the mean level in metres, and
    /// magnitude of the slope.
    #[must_use]
    pub fn bounds(&self, extent_m: f64) -> (f64, f64) {
        let (mut rise, mut slope) = (0.0, 0.0);
        for term in &self.terms {
            match *term {
                Term::Plane { slope: s, .. } => {
                    rise += s.length() * extent_m;
                    slope += s.length();
                }
                Term::Wave { amplitude_m, k_x, k_z, .. } => {
                    rise += amplitude_m.abs();
                    slope += amplitude_m.abs() * (k_x * k_x + k_z * k_z).sqrt();
                }
                Term::Circular { amplitude_m, k, .. } => {
                    rise += amplitude_m.abs();
                    slope += amplitude_m.abs() * k.abs();
                }
            }
        }
        if let Some(noise) = &self.noise {
            let amplitude = f64::from(noise.amplitude_m.abs());
            rise += amplitude * 1.05;
            slope += amplitude / f64::from(noise.feature_m) * NOISE_SLOPE * noise.fbm.slope_factor();
        }
        (rise, slope)
    }

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
