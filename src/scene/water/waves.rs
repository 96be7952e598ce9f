//! Water as a sum of plane waves, and the wave numbers and frequencies shared by the other models.

use std::f64::consts::TAU;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::GRAVITY_M_PER_S2;
use super::error::{WaterError, require, within};
use super::formula::Term;
use nephroid_math::space::sin_cos_deg;

/// How fast a wave travels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Motion {
    /// It stands still: `ω = 0`. Two steady waves never change; a *standing* wave is two opposite travelling ones.
    Steady,
    /// A phase speed in m/s, `ω = speed · k`; negative runs backwards. −1000..=1000.
    Speed(f32),
    /// Gravity waves over deep water, `ω = √(g·k)`.
    #[default]
    DeepWater,
    /// Gravity waves over water of this depth in metres, `ω = √(g·k·tanh(k·depth))`. Above 0, at most 1e5.
    Depth(f32),
}

impl Motion {
    /// Angular frequency in rad/s of a wave of `wave_number_per_m` (rad/m, positive).
    #[must_use]
    pub fn angular_frequency(self, wave_number_per_m: f64) -> f64 {
        match self {
            Self::Steady => 0.0,
            Self::Speed(speed) => f64::from(speed) * wave_number_per_m,
            Self::DeepWater => dispersion(wave_number_per_m, None),
            Self::Depth(depth) => dispersion(wave_number_per_m, Some(f64::from(depth))),
        }
    }

    pub(super) fn validate(self, field: &str) -> Result<(), WaterError> {
        match self {
            Self::Speed(speed) => require(within(speed, -1e3, 1e3), field, self, "Speed(-1000 ..= 1000 m/s)"),
            Self::Depth(depth) => require(depth > 0.0 && depth <= 1e5, field, self, "Depth(above 0, at most 1e5 m)"),
            Self::Steady | Self::DeepWater => Ok(()),
        }
    }
}

/// Dispersion of gravity waves: `ω = √(g·k·tanh(k·d))` in rad/s, `√(g·k)` where the depth `d` is `None`.
pub(super) fn dispersion(wave_number_per_m: f64, depth_m: Option<f64>) -> f64 {
    let deep = GRAVITY_M_PER_S2 * wave_number_per_m;
    depth_m.map_or(deep, |depth| deep * libm::tanh(wave_number_per_m * depth)).sqrt()
}

/// One travelling or steady wave with straight crests: `a · cos(k (d · (x, z)) − ω t + φ)`, positions in world space.
///
/// The surface `a·cos kx` whose first focus under vertical light is `n/((n − 1)·a·k²)` below its crests is a steady one with `direction_deg: 0`; the egg-crate
/// `a(cos kx + cos kz)` is two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlaneWave {
    /// Amplitude `a` in metres: crests are this far above the mean level. −100..=100. Default: 0.02
    pub amplitude_m: f32,
    /// Distance between crests in metres, `k = 2π/wavelength`. 1e-5..=1e5. Default: 1
    pub wavelength_m: f32,
    /// Direction `d` it travels in, in degrees from +x towards +z. Any finite number. Default: 0
    pub direction_deg: f32,
    /// Phase `φ` at the world origin at time 0, in radians; 0 is a crest. Any finite number. Default: 0
    pub phase_rad: f32,
    /// How fast it travels. Default: DeepWater
    pub motion: Motion,
}

impl Default for PlaneWave {
    fn default() -> Self {
        Self { amplitude_m: 0.02, wavelength_m: 1.0, direction_deg: 0.0, phase_rad: 0.0, motion: Motion::DeepWater }
    }
}

impl PlaneWave {
    /// Wave number `k = 2π/wavelength`, in rad/m.
    #[must_use]
    pub fn wave_number_per_m(&self) -> f64 {
        TAU / f64::from(self.wavelength_m)
    }

    /// Angular frequency in rad/s.
    #[must_use]
    pub fn angular_frequency(&self) -> f64 {
        self.motion.angular_frequency(self.wave_number_per_m())
    }

    pub(super) fn term(&self, time_s: f64) -> Term {
        let k = self.wave_vector_per_m();
        let phase = f64::from(self.phase_rad) - self.angular_frequency() * time_s;
        Term::Wave { amplitude_m: f64::from(self.amplitude_m), k_x: k.x, k_z: k.y, phase }
    }

    /// Wave vector along x and z, rad/m.
    pub(in super::super) fn wave_vector_per_m(&self) -> DVec2 {
        let (sine, cosine) = sin_cos_deg(self.direction_deg);
        DVec2::new(cosine, sine) * self.wave_number_per_m()
    }

    pub(super) fn validate(&self, field: &str) -> Result<(), WaterError> {
        require(within(self.amplitude_m, -100.0, 100.0), format_args!("{field}.amplitude_m"), self.amplitude_m, "-100 ..= 100 m")?;
        require(within(self.wavelength_m, 1e-5, 1e5), format_args!("{field}.wavelength_m"), self.wavelength_m, "0.00001 ..= 100000 m")?;
        require(self.direction_deg.is_finite(), format_args!("{field}.direction_deg"), self.direction_deg, "a finite number of degrees")?;
        require(self.phase_rad.is_finite(), format_args!("{field}.phase_rad"), self.phase_rad, "a finite number of radians")?;
        self.motion.validate(&format!("{field}.motion"))
    }
}
