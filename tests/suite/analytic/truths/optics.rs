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

/// Share of unpolarised light that a level sheet reflects, with all reflections inside of it: `Rₛ = 2R/(1 + R)`; the rest passes.
///
/// Both its surfaces reflect R, from either side. First comes R; what enters, 1 − R, is reflected inside and leaves at the top again after
/// 1, 3, 5... reflections: `Rₛ = R + (1 − R)² R (1 + R² + R⁴ + ...) = R + (1 − R)² R/(1 − R²)`. Light counts as unpolarised anew at every
/// surface, and its paths add up by power, as the tracer has it.
pub fn sheet_reflectance(angle: f64, ior: f64) -> f64 {
    let r = reflectance(angle, ior);
    2.0 * r / (1.0 + r)
}

/// T16: a level sheet of glass over still water, air between them. All is per light that falls on the sheet.
///
/// Light in the gap goes down, is reflected by the water with R, and by the sheet with Rₛ, which sends it down again: with each round trip
/// R Rₛ of it is left. So `D = (1 − Rₛ)(1 + R Rₛ + R² Rₛ² + ...) = (1 − Rₛ)/(1 − R Rₛ)` goes down, `R D` up, and `(1 − R) D` into the water.
#[derive(Clone, Copy, Debug)]
pub struct SheetOverWater {
    /// Rₛ of the sheet.
    pub sheet: f64,
    /// R of the water.
    pub water: f64,
}

impl SheetOverWater {
    /// The stack at an angle of incidence; every surface but those inside of the sheet meets light at that angle.
    pub fn new(angle: f64, sheet_ior: f64, water_ior: f64) -> Self {
        Self { sheet: sheet_reflectance(angle, sheet_ior), water: reflectance(angle, water_ior) }
    }

    /// What goes down through the gap, every time that it does.
    pub fn down(self) -> f64 {
        (1.0 - self.sheet) / (1.0 - self.water * self.sheet)
    }

    /// What goes up through the gap, every time that it does.
    pub fn up(self) -> f64 {
        self.water * self.down()
    }

    /// What enters the water.
    pub fn entered(self) -> f64 {
        (1.0 - self.water) * self.down()
    }
}

/// T16: share of light that passes still water and then a level sheet of glass in it: `(1 − R)(1 − Rₛ)/(1 − R Rₛ)`.
///
/// The surface reflects the same R from below, at the angle of refraction; of what is between it and the sheet, R Rₛ is left after each
/// round trip.
pub fn sheet_under_water(angle: f64, sheet_ior: f64, water_ior: f64) -> f64 {
    let inside = refraction_angle(angle, water_ior).expect("light comes from the thinner side");
    let (water, sheet) = (reflectance(angle, water_ior), sheet_reflectance(inside, sheet_ior / water_ior));
    (1.0 - water) * (1.0 - sheet) / (1.0 - water * sheet)
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
