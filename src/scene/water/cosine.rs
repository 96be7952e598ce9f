//! The two procedural water models of Papadopoulos & Papaioannou [PP10 §4]: a cosine and Perlin noise.
//!
//! The paper gives no numbers; the defaults here make its two descriptions true: a circular cosine with *small* noise, "familiar and
//! easily comparable", and a cosine along a world axis with *significant* noise, "approximating the turbulent waves of a water surface".

use std::f64::consts::TAU;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::error::{WaterError, require, within};
use super::formula::{NoiseTerm, Term};
use super::waves::Motion;
use nephroid_math::noise::Fbm;

/// Fractal Perlin noise on top of a wave: `amplitude · fbm(x/feature, z/feature, rate·t)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ripples {
    /// Largest height in metres, before the scale of the model. 0..=100. Default: 0.01
    pub amplitude_m: f32,
    /// Size of the largest bumps in metres. 1e-5..=1e5. Default: 0.5
    pub feature_m: f32,
    /// How quickly the bumps change, in lifetimes per second; 0 is still. 0..=1000. Default: 0.5
    pub rate_per_s: f32,
    /// Number of octaves, each of half the size and height of the one before. 1..=12. Default: 2
    pub octaves: u32,
    /// Which noise: every seed is another one. Default: 1
    pub seed: u32,
}

impl Default for Ripples {
    fn default() -> Self {
        Self { amplitude_m: 0.01, feature_m: 0.5, rate_per_s: 0.5, octaves: 2, seed: 1 }
    }
}

impl Ripples {
    fn term(&self, scale: f32, time_s: f64) -> NoiseTerm {
        NoiseTerm {
            amplitude_m: self.amplitude_m * scale,
            feature_m: self.feature_m,
            phase: (f64::from(self.rate_per_s) * time_s) as f32,
            fbm: Fbm { octaves: self.octaves, ..Fbm::default() },
            seed: self.seed,
        }
    }

    fn validate(&self, field: &str) -> Result<(), WaterError> {
        require(within(self.amplitude_m, 0.0, 100.0), format_args!("{field}.amplitude_m"), self.amplitude_m, "0 ..= 100 m")?;
        require(within(self.feature_m, 1e-5, 1e5), format_args!("{field}.feature_m"), self.feature_m, "0.00001 ..= 100000 m")?;
        require(within(self.rate_per_s, 0.0, 1e3), format_args!("{field}.rate_per_s"), self.rate_per_s, "0 ..= 1000 1/s")?;
        require((1..=12).contains(&self.octaves), format_args!("{field}.octaves"), self.octaves, "1 ..= 12")
    }
}

/// Rings around a point, with small noise [PP10 §4, first model].
///
/// `h = scale · (a · cos(k·r̂ − ω t + φ) + ripples)`, `r̂ = √(r² + core²) − core` and `r` the distance from the centre. With the paper's `core = 0` the surface has a tip
/// at the centre wherever the phase there is not a multiple of π, and the slope at that one point is taken as zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CircularCosine {
    /// Factor on the whole surface, the control the paper gives its user. 0..=100. Default: 1
    pub scale: f32,
    /// World (x, z) of the centre, in metres. Default: (0, 0)
    pub center_m: Vec2,
    /// Amplitude `a` in metres. −100..=100. Default: 0.04
    pub amplitude_m: f32,
    /// Distance between rings in metres. 1e-5..=1e5. Default: 1
    pub wavelength_m: f32,
    /// Phase `φ` in radians. Any finite number. Default: 0
    pub phase_rad: f32,
    /// Radius in metres over which the tip at the centre is rounded off. 0..=1e5. Default: 0 (the paper's)
    pub core_m: f32,
    /// How fast the rings run outwards. Default: DeepWater
    pub motion: Motion,
    /// The noise. Default: that of [`Ripples`], a quarter of the wave
    pub ripples: Ripples,
}

impl Default for CircularCosine {
    fn default() -> Self {
        Self {
            scale: 1.0,
            center_m: Vec2::ZERO,
            amplitude_m: 0.04,
            wavelength_m: 1.0,
            phase_rad: 0.0,
            core_m: 0.0,
            motion: Motion::DeepWater,
            ripples: Ripples::default(),
        }
    }
}

impl CircularCosine {
    pub(super) fn terms(&self, time_s: f64) -> (Term, NoiseTerm) {
        let k = TAU / f64::from(self.wavelength_m);
        let wave = Term::Circular {
            amplitude_m: f64::from(self.amplitude_m) * f64::from(self.scale),
            center: self.center_m.as_dvec2(),
            core_m: f64::from(self.core_m),
            k,
            phase: f64::from(self.phase_rad) - self.motion.angular_frequency(k) * time_s,
        };
        (wave, self.ripples.term(self.scale, time_s))
    }

    pub(super) fn validate(&self) -> Result<(), WaterError> {
        validate_wave(self.scale, self.amplitude_m, self.wavelength_m, self.phase_rad)?;
        require(self.center_m.is_finite(), "model.center_m", self.center_m, "two finite numbers of metres")?;
        require(within(self.core_m, 0.0, 1e5), "model.core_m", self.core_m, "0 ..= 100000 m")?;
        self.motion.validate("model.motion")?;
        self.ripples.validate("model.ripples")
    }
}

/// A horizontal world axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// Towards +x.
    #[default]
    X,
    /// Towards +z.
    Z,
}

/// Waves along a world axis, with strong noise [PP10 §4, second model].
///
/// `h = scale · (a · cos(k·x − ω t + φ) + ripples)`, or `z` for `x`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AxisCosine {
    /// Factor on the whole surface, the control the paper gives its user. 0..=100. Default: 1
    pub scale: f32,
    /// Axis the wave travels along. Default: X
    pub axis: Axis,
    /// Amplitude `a` in metres. −100..=100. Default: 0.04
    pub amplitude_m: f32,
    /// Distance between crests in metres. 1e-5..=1e5. Default: 2
    pub wavelength_m: f32,
    /// Phase `φ` in radians. Any finite number. Default: 0
    pub phase_rad: f32,
    /// How fast it travels. Default: DeepWater
    pub motion: Motion,
    /// The noise. Default: as high as the wave (0.04 m), features of 0.8 m, 4 octaves, else that of [`Ripples`]
    pub ripples: Ripples,
}

impl Default for AxisCosine {
    fn default() -> Self {
        Self {
            scale: 1.0,
            axis: Axis::X,
            amplitude_m: 0.04,
            wavelength_m: 2.0,
            phase_rad: 0.0,
            motion: Motion::DeepWater,
            ripples: Ripples { amplitude_m: 0.04, feature_m: 0.8, octaves: 4, ..Ripples::default() },
        }
    }
}

impl AxisCosine {
    pub(super) fn terms(&self, time_s: f64) -> (Term, NoiseTerm) {
        let k = TAU / f64::from(self.wavelength_m);
        let (k_x, k_z) = match self.axis {
            Axis::X => (k, 0.0),
            Axis::Z => (0.0, k),
        };
        let phase = f64::from(self.phase_rad) - self.motion.angular_frequency(k) * time_s;
        let wave = Term::Wave { amplitude_m: f64::from(self.amplitude_m) * f64::from(self.scale), k_x, k_z, phase };
        (wave, self.ripples.term(self.scale, time_s))
    }

    pub(super) fn validate(&self) -> Result<(), WaterError> {
        validate_wave(self.scale, self.amplitude_m, self.wavelength_m, self.phase_rad)?;
        self.motion.validate("model.motion")?;
        self.ripples.validate("model.ripples")
    }
}

fn validate_wave(scale: f32, amplitude_m: f32, wavelength_m: f32, phase_rad: f32) -> Result<(), WaterError> {
    require(within(scale, 0.0, 100.0), "model.scale", scale, "0 ..= 100")?;
    require(within(amplitude_m, -100.0, 100.0), "model.amplitude_m", amplitude_m, "-100 ..= 100 m")?;
    require(within(wavelength_m, 1e-5, 1e5), "model.wavelength_m", wavelength_m, "0.00001 ..= 100000 m")?;
    require(phase_rad.is_finite(), "model.phase_rad", phase_rad, "a finite number of radians")
}
