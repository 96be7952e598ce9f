//! Snell's law and Fresnel's equations, and the irradiance below a plane surface.

use std::f64::consts::FRAC_PI_2;

/// Angle of refraction, `sin θt = sin θi / n`; for light that meets a denser medium, or `None` where all of it is reflected (`n < 1`).
pub fn refraction_angle(angle: f64, ior: f64) -> Option<f64> {
    let sine = libm::sin(angle) / ior;
    (sine.abs() <= 1.0).then(|| libm::asin(sine))
}

/// Share of unpolarised light that a surface reflects, in the form of sines and tangents of the angles:
/// `R = ½ [sin²(θi − θt)/sin²(θi + θt) + tan²(θi − θt)/tan²(θi + θt)]`, at normal incidence `((n − 1)/(n + 1))²`.
///
/// `ior` is that of the far side over that of the near side.
pub fn reflectance(angle: f64, ior: f64) -> f64 {
    if ior == 1.0 {
        return 0.0;
    }
    // Below this angle the quotients lose digits, and R differs from that of normal incidence by less than 1e-12.
    if angle.abs() < 1.0e-4 {
        let r = (ior - 1.0) / (ior + 1.0);
        return r * r;
    }
    let Some(inside) = refraction_angle(angle, ior) else { return 1.0 };
    if angle.abs() >= FRAC_PI_2 {
        return 1.0;
    }
    let (minus, plus) = (angle - inside, angle + inside);
    let s = libm::sin(minus) / libm::sin(plus);
    let p = s * libm::cos(plus) / libm::cos(minus);
    0.5 * (s * s + p * p)
}

/// Share of unpolarised light that passes, `T = 1 − R`.
pub fn transmittance(angle: f64, ior: f64) -> f64 {
    1.0 - reflectance(angle, ior)
}

/// T1: irradiance of a level floor at `depth` below still water, for light `angle` off the vertical:
/// `E = cos θi T(θi) e^(−σt h / cos θt)`.
pub fn still_water(angle: f64, ior: f64, sigma_t: f64, depth: f64) -> f64 {
    let inside = refraction_angle(angle, ior).expect("light comes from the thinner side");
    libm::cos(angle) * transmittance(angle, ior) * libm::exp(-sigma_t * depth / libm::cos(inside))
}

/// T2: irradiance of a level floor below water whose surface is `y = sx x + sz z`, for light along the unit vector `light` (y up), in
/// clear water.
///
/// A bundle of rays of cross-section A meets `A / cos θi` of the surface and goes on with the cross-section `A cos θt / cos θi`; the floor,
/// whose normal makes an angle ψ with the refracted ray, catches it on `A cos θt / (cos θi cos ψ)`. So
/// `E = T(θi) (cos θi / cos θt) cos ψ`.
/// The refracted ray lies in the plane of `light` and the surface's normal N, at the angle θt to −N:
/// `t = −cos θt N + sin θt p`, p the unit vector along the part of `light` across N.
pub fn leaning_water(light: [f64; 3], slope: [f64; 2], ior: f64) -> f64 {
    let (t, angle, inside) = leaning_refraction(light, slope, ior);
    transmittance(angle, ior) * libm::cos(angle) / libm::cos(inside) * -t[1]
}

/// The refracted ray below leaning water, and the angles of incidence and refraction; see [`leaning_water`].
pub fn leaning_refraction(light: [f64; 3], slope: [f64; 2], ior: f64) -> ([f64; 3], f64, f64) {
    let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
    let normal = [-slope[0] / length, 1.0 / length, -slope[1] / length];
    let cosine: f64 = -(0..3).map(|i| light[i] * normal[i]).sum::<f64>();
    let across: [f64; 3] = std::array::from_fn(|i| light[i] + cosine * normal[i]);
    let sine = across.iter().map(|c| c * c).sum::<f64>().sqrt();
    let angle = libm::atan2(sine, cosine);
    let inside = refraction_angle(angle, ior).expect("light comes from the thinner side");
    let p = across.map(|c| if sine > 0.0 { c / sine } else { 0.0 });
    (std::array::from_fn(|i| -libm::cos(inside) * normal[i] + libm::sin(inside) * p[i]), angle, inside)
}

/// Unit vector along which the light of a sun at this azimuth (from +x towards +z) and elevation travels.
pub fn sunlight(azimuth: f64, elevation: f64) -> [f64; 3] {
    let level = libm::cos(elevation);
    [-level * libm::cos(azimuth), -libm::sin(elevation), -level * libm::sin(azimuth)]
}
