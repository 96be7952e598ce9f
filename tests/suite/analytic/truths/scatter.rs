//! Light scattered once towards the eye.

use std::f64::consts::PI;

/// Phase function of Henyey and Greenstein, `p = (1 − g²)/(4π (1 + g² − 2g cos θ)^(3/2))`; θ between the directions in which light
/// travels before and after, so that positive g is forward. 1/sr.
pub fn henyey_greenstein(cosine: f64, g: f64) -> f64 {
    let base = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
}

/// A straight piece of a view through a medium that parallel light fills.
#[derive(Clone, Copy)]
pub struct Slab {
    /// Scattering coefficient, 1/m.
    pub sigma_s: f64,
    /// Extinction coefficient, 1/m.
    pub sigma_t: f64,
    /// Irradiance across the light, as it enters the medium, W/m².
    pub irradiance: f64,
    /// Value of the phase function for the angle between the light and the way back to the eye, 1/sr.
    pub phase: f64,
    /// Way of the light through the medium to the start of the piece of view, m.
    pub light_path: f64,
    /// By how much that way grows per metre of view.
    pub light_path_per_m: f64,
    /// Length of the piece, m.
    pub length: f64,
}

impl Slab {
    /// T10: `L = σs p E e^(−σt d₀) (1 − e^(−σt (1 + c) S)) / (σt (1 + c))`: at s along the view the light has come `d₀ + c s`, and
    /// goes back s. For `c = −1`, where both ways together are the same for all s, the last factor is S.
    pub fn radiance(&self) -> f64 {
        let rate = self.sigma_t * (1.0 + self.light_path_per_m);
        let length = if rate.abs() < 1.0e-12 { self.length } else { -libm::expm1(-rate * self.length) / rate };
        self.sigma_s * self.phase * self.irradiance * libm::exp(-self.sigma_t * self.light_path) * length
    }
}
