//! Optics of clear media and their surfaces: refraction, reflection, Fresnel, attenuation and phase functions.
//!
//! All functions are pure; those that run per beam, photon or fragment are generic over [`Lanes`]. Directions are unit vectors along the
//! *propagation* of light. A surface normal passed to these functions must point against the incident light (`d·n ≤ 0`). `n1` is the refractive index
//! on the incident side, `n2` on the other.

use std::f32::consts::PI;

use glam::Vec3;

use super::float::exp;
use super::lanes::Lanes;
use super::vector::{V3, v3};

#[cfg(test)]
mod tests;

/// `1/4π`: the phase function of a medium that scatters equally in all directions, in 1/sr.
pub const ISOTROPIC_PHASE: f32 = 0.25 / PI;

/// Snell's law: the refracted direction, and a mask of the lanes in which it exists.
///
/// `t = ηd + (ηc − √k)n` with `c = −d·n`, `k = 1 − η²(1 − c²)` and `η = n1/n2`. `d` and `n` are unit vectors, `d·n ≤ 0`; the result has unit
/// length. The mask is false for total reflection (`k < 0`) and if an argument is NaN; the direction is then finite for finite arguments but
/// meaningless.
#[inline(always)]
pub fn refract<L: Lanes>(d: V3<L>, n: V3<L>, eta: f32) -> (V3<L>, L::Mask) {
    refract_by(d, n, d.x.like(eta))
}

/// [`refract`] with an index ratio for each lane.
#[inline(always)]
pub fn refract_by<L: Lanes>(d: V3<L>, n: V3<L>, eta: L) -> (V3<L>, L::Mask) {
    let zero = d.x.like(0.0);
    let c = -d.dot(n);
    let k = d.x.like(1.0) - (d.x.like(1.0) - c * c) * (eta * eta);
    let root = Lanes::max(k, zero).sqrt();
    (d * eta + n * (c * eta - root), k.ge(zero))
}

/// Mirror direction `d − 2(d·n)n` of unit vectors; the sign of `n` does not matter.
#[inline(always)]
pub fn reflect<L: Lanes>(d: V3<L>, n: V3<L>) -> V3<L> {
    d - n * (d.dot(n) * 2.0)
}

/// Share of unpolarised light that a smooth dielectric surface reflects, `0..=1`: Fresnel's equations.
///
/// `R = ½[((n2c − n1c_t)/(n2c + n1c_t))² + ((n1c − n2c_t)/(n1c + n2c_t))²]`, `c` the cosine of the angle of incidence in `[0, 1]` (clamped) and `c_t` that of
/// refraction. 1 for total reflection and at grazing incidence; 0 for `n1 = n2`, where the formula would be 0/0 at grazing incidence.
#[inline(always)]
pub fn fresnel_reflectance<L: Lanes>(cos_i: L, n1: f32, n2: f32) -> L {
    let (zero, one) = (cos_i.like(0.0), cos_i.like(1.0));
    let eta = n1 / n2;
    let c = cos_i.clamp(0.0, 1.0);
    let k = one - (one - c * c) * (eta * eta);
    let c_t = Lanes::max(k, zero).sqrt();
    let p = (c * n2 - c_t * n1) / (c * n2 + c_t * n1);
    let s = (c * n1 - c_t * n2) / (c * n1 + c_t * n2);
    let reflectance = L::select(k.le(zero), one, (p * p + s * s) * 0.5);
    if n1 == n2 { zero } else { reflectance }
}

/// [`fresnel_reflectance`] with an index ratio `eta = n1/n2` for each lane; the last bits may differ.
#[inline(always)]
pub fn fresnel_reflectance_by<L: Lanes>(cos_i: L, eta: L) -> L {
    let (zero, one) = (cos_i.like(0.0), cos_i.like(1.0));
    let c = cos_i.clamp(0.0, 1.0);
    let k = one - (one - c * c) * (eta * eta);
    let c_t = Lanes::max(k, zero).sqrt();
    let p = (c - c_t * eta) / (c + c_t * eta);
    let s = (c * eta - c_t) / (c * eta + c_t);
    let reflectance = L::select(k.le(zero), one, (p * p + s * s) * 0.5);
    L::select(eta.equals(one), zero, reflectance)
}

/// Share of unpolarised light that passes a smooth dielectric surface: `T = 1 − R`, see [`fresnel_reflectance`].
#[inline(always)]
pub fn fresnel_transmittance<L: Lanes>(cos_i: L, n1: f32, n2: f32) -> L {
    cos_i.like(1.0) - fresnel_reflectance(cos_i, n1, n2)
}

/// Schlick's approximation of [`fresnel_reflectance`] (C. Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", 1994).
///
/// `R ≈ R₀ + (1 − R₀)(1 − c)⁵`, `R₀ = ((n1 − n2)/(n1 + n2))²`. On the denser side, the cosine of the *refracted* ray is used, because the
/// approximation fails with that of the incident ray. 1 for total reflection.
#[inline(always)]
pub fn schlick_reflectance<L: Lanes>(cos_i: L, n1: f32, n2: f32) -> L {
    let (zero, one) = (cos_i.like(0.0), cos_i.like(1.0));
    let mut c = cos_i.clamp(0.0, 1.0);
    if n1 > n2 {
        let eta = n1 / n2;
        c = Lanes::max(one - (one - c * c) * (eta * eta), zero).sqrt();
    }
    let r = (n1 - n2) / (n1 + n2);
    let m = one - c;
    let m2 = m * m;
    m2 * m2 * m * (1.0 - r * r) + r * r
}

/// Cosine of the critical angle inside the denser medium, beyond which (smaller cosines) all light is reflected.
///
/// `√(1 − (n2/n1)²)`; `None` if there is no total reflection (`n1 ≤ n2`) or an index is not a positive number.
#[must_use]
pub fn critical_cosine(n1: f32, n2: f32) -> Option<f32> {
    let ratio = n2 / n1;
    (n2 > 0.0 && n1 > n2).then(|| ((1.0 - ratio) * (1.0 + ratio)).sqrt())
}

/// Critical angle from the normal in radians, `asin(n2/n1)`; `None` as for [`critical_cosine`].
#[must_use]
pub fn critical_angle_rad(n1: f32, n2: f32) -> Option<f32> {
    (n2 > 0.0 && n1 > n2).then(|| libm::asinf(n2 / n1))
}

/// Share of light left after a homogeneous medium: `e^(−σ_t·s)` (Beer & Lambert), for extinction `sigma_t_per_m` in 1/m and a path of `s` metres.
#[inline(always)]
pub fn beer_lambert<L: Lanes>(sigma_t_per_m: L, distance_m: L) -> L {
    exp(-(sigma_t_per_m * distance_m))
}

/// [`beer_lambert`] for the three colour channels.
#[inline(always)]
pub fn beer_lambert_rgb<L: Lanes>(sigma_t_per_m: Vec3, distance_m: L) -> V3<L> {
    v3(exp(distance_m * -sigma_t_per_m.x), exp(distance_m * -sigma_t_per_m.y), exp(distance_m * -sigma_t_per_m.z))
}

/// Phase function of Henyey & Greenstein (1941), in 1/sr.
///
/// `p = (1 − g²) / (4π(1 + g² − 2g·cosθ)^{3/2})`, θ between the directions of propagation before and after, so that `g > 0` scatters forward (textbooks
/// whose vectors both point away from the particle have `+2g·cosθ`). `g` in `(−1, 1)` is the mean cosine. Integrates to 1 over the sphere.
#[inline(always)]
pub fn henyey_greenstein<L: Lanes>(cos_theta: L, g: f32) -> L {
    let base = cos_theta * (-2.0 * g) + (1.0 + g * g);
    cos_theta.like((1.0 - g * g) * ISOTROPIC_PHASE) / (base * base.sqrt())
}

/// Schlick's phase function, in 1/sr: an approximation of [`henyey_greenstein`] without the power (Blasi, Le Saëc & Schlick 1993).
///
/// `p = (1 − k²) / (4π(1 − k·cosθ)²)`, same convention for θ. `k` in `(−1, 1)`, for instance [`schlick_k`]. Integrates to 1, but its peak is far higher than that of the
/// function it stands for: do not mix the two in one comparison.
#[inline(always)]
pub fn schlick_phase<L: Lanes>(cos_theta: L, k: f32) -> L {
    let base = cos_theta * -k + 1.0;
    cos_theta.like((1.0 - k * k) * ISOTROPIC_PHASE) / (base * base)
}

/// The `k` of [`schlick_phase`] usually paired with a Henyey-Greenstein `g`: `1.55g − 0.55g³`.
#[must_use]
pub fn schlick_k(g: f32) -> f32 {
    1.55 * g - 0.55 * g * g * g
}
