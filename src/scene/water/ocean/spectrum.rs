//! How a wind sea spreads its energy over lengths and directions of waves.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::super::GRAVITY_M_PER_S2;
use super::super::error::{WaterError, require, within};
use super::super::waves::dispersion;
use super::OceanSettings;
use nephroid_math::space::sin_cos_deg;

/// Energy of the waves over their wave number `k`. All are densities of variance: `∫ S(k) dk` is the variance of the height in m².
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Spectrum {
    /// A sea in balance with the wind, `S(k) = ½·α·k⁻³·e^{−1/(kl)²}` with `l = U²/g`: the equilibrium range of O. M. Phillips (1958), cut off at long waves as by Tessendorf.
    Phillips {
        /// Phillips' constant `α`, without unit. 0..=1. Default: 0.0081
        #[serde(default = "default_alpha")]
        alpha: f32,
    },
    /// A sea still growing, `S(ω) = α·g²·ω⁻⁵·e^{−(5/4)(ω_p/ω)⁴}·γ^{r}` (Hasselmann et al. 1973), converted to wave numbers by `S(k) = S(ω)·dω/dk`.
    ///
    /// `α = 0.076·(g·fetch/U²)^{−0.22}`, `ω_p = 22·(g²/(U·fetch))^{1/3}`, `r = e^{−(ω−ω_p)²/(2σ²ω_p²)}` and `σ = 0.07` below the peak, 0.09 above. With a
    /// finite depth the energy is multiplied by `tanh²(kd)/(1 + 2kd/sinh 2kd)` (TMA, Bouws et al. 1985).
    Jonswap {
        /// Length of water the wind blows over, in metres. 1..=1e7. Default: 5000
        #[serde(default = "default_fetch")]
        fetch_m: f32,
        /// Peak enhancement `γ`. 1..=20. Default: 3.3
        #[serde(default = "default_gamma")]
        gamma: f32,
    },
}

fn default_alpha() -> f32 {
    0.0081
}
fn default_fetch() -> f32 {
    5000.0
}
fn default_gamma() -> f32 {
    3.3
}

impl Default for Spectrum {
    fn default() -> Self {
        Self::Phillips { alpha: default_alpha() }
    }
}

impl Spectrum {
    pub(super) fn validate(&self) -> Result<(), WaterError> {
        match *self {
            Self::Phillips { alpha } => require(within(alpha, 0.0, 1.0), "model.spectrum.alpha", alpha, "0 ..= 1"),
            Self::Jonswap { fetch_m, gamma } => {
                require(within(fetch_m, 1.0, 1e7), "model.spectrum.fetch_m", fetch_m, "1 ..= 10000000 m")?;
                require(within(gamma, 1.0, 20.0), "model.spectrum.gamma", gamma, "1 ..= 20")
            }
        }
    }
}

/// A spectrum with its wind, ready to be evaluated.
#[derive(Clone, Debug)]
pub(super) struct Sea {
    spectrum: Spectrum,
    wind_speed: f64,
    /// Unit vector the wind blows to, in (x, z).
    wind: [f64; 2],
    spreading: f64,
    /// `N(s)` with `∫ N·cos^{2s}(θ/2) dθ = 1`.
    spreading_norm: f64,
    depth_m: Option<f64>,
    shortest_m: f64,
    /// Distance of neighbouring wave numbers, `2π/L` in rad/m.
    pub k_step: f64,
}

impl Sea {
    pub fn new(settings: &OceanSettings) -> Self {
        let (sine, cosine) = sin_cos_deg(settings.wind_direction_deg);
        let s = f64::from(settings.spreading);
        Self {
            spectrum: settings.spectrum,
            wind_speed: f64::from(settings.wind_speed_m_per_s),
            wind: [cosine, sine],
            spreading: s,
            spreading_norm: spreading_norm(s),
            depth_m: settings.depth_m.map(f64::from),
            shortest_m: f64::from(settings.shortest_wave_m),
            k_step: TAU / f64::from(settings.patch_m),
        }
    }

    /// Variance density `Ψ(k) = S(|k|)·D(θ)/|k|` in m⁴ at a wave vector in rad/m: its integral over the plane is the variance.
    pub fn density_m4(&self, k: [f64; 2]) -> f64 {
        let k_length = (k[0] * k[0] + k[1] * k[1]).sqrt();
        let cos_theta = (k[0] * self.wind[0] + k[1] * self.wind[1]) / k_length;
        // cos²(θ/2) = (1 + cos θ)/2
        let spread = self.spreading_norm * libm::pow((0.5 * (1.0 + cos_theta)).clamp(0.0, 1.0), self.spreading);
        self.density_m3(k_length) * spread / k_length
    }

    /// Variance density `S(k)` in m³ over the wave number in rad/m.
    pub fn density_m3(&self, k: f64) -> f64 {
        let g = GRAVITY_M_PER_S2;
        let short = k * self.shortest_m / TAU;
        let energy = match self.spectrum {
            Spectrum::Phillips { alpha } => {
                let kl = k * self.wind_speed * self.wind_speed / g;
                0.5 * f64::from(alpha) / (k * k * k) * libm::exp(-1.0 / (kl * kl))
            }
            Spectrum::Jonswap { fetch_m, gamma } => {
                let (fetch, u) = (f64::from(fetch_m), self.wind_speed);
                let alpha = 0.076 * libm::pow(g * fetch / (u * u), -0.22);
                let peak = 22.0 * libm::cbrt(g * g / (u * fetch));
                let omega = dispersion(k, self.depth_m);
                let sigma = if omega <= peak { 0.07 } else { 0.09 };
                let off = (omega - peak) / (sigma * peak);
                let enhancement = libm::pow(f64::from(gamma), libm::exp(-0.5 * off * off));
                let ratio2 = (peak / omega) * (peak / omega);
                let over_omega = alpha * g * g / (omega * omega * omega * omega * omega) * libm::exp(-1.25 * ratio2 * ratio2) * enhancement;
                over_omega * self.group_speed(k, omega) * self.shallow_factor(k)
            }
        };
        energy * libm::exp(-short * short)
    }

    /// `dω/dk = ½(ω/k)(1 + 2kd/sinh 2kd)`, `½·ω/k` over deep water.
    fn group_speed(&self, k: f64, omega: f64) -> f64 {
        0.5 * omega / k * (1.0 + self.depth_ratio(k))
    }

    /// Kitaigorodskii's factor, 1 over deep water.
    fn shallow_factor(&self, k: f64) -> f64 {
        let tanh = self.depth_m.map_or(1.0, |depth| libm::tanh(k * depth));
        tanh * tanh / (1.0 + self.depth_ratio(k))
    }

    /// `2kd/sinh 2kd`: 1 in the shallows, 0 over deep water.
    fn depth_ratio(&self, k: f64) -> f64 {
        self.depth_m.map_or(0.0, |depth| 2.0 * k * depth / libm::sinh(2.0 * k * depth))
    }
}

/// `N(s) = 2^{2s−1}/π · Γ(s+1)²/Γ(2s+1)` (M. S. Longuet-Higgins et al. 1963), through logarithms so that large `s` do not overflow.
fn spreading_norm(s: f64) -> f64 {
    libm::exp((2.0 * s - 1.0) * std::f64::consts::LN_2 + 2.0 * libm::lgamma(s + 1.0) - libm::lgamma(2.0 * s + 1.0)) / PI
}
