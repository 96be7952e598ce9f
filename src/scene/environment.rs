//! The light that comes from everywhere: the sky above, the ground below, the sun's disc and the ambient light in the water.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use nephroid_math::space::sin_cos_deg;

use super::check::{At, Invalid};

/// Radiance of the surroundings as a function of direction, and the ambient irradiance on receivers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Environment {
    /// Radiance of the sky straight up, W/(m² sr), linear RGB. Default: (20, 36, 70)
    pub zenith: Vec3,
    /// Radiance of the sky just above the horizon, W/(m² sr), linear RGB. Default: (70, 82, 95)
    pub horizon: Vec3,
    /// Radiance from below the horizon, W/(m² sr), linear RGB. Default: (24, 22, 19)
    pub ground: Vec3,
    /// The discs of the directional lights, visible in the sky and as glints in the water. Default: None, no disc
    pub sun_disc: Option<SunDisc>,
    /// Irradiance that reaches every receiver from no direction in particular, W/m², linear RGB: the term L_A of [SF05 §3.4].
    /// Default: (60, 75, 90)
    pub ambient_irradiance: Vec3,
}

/// The visible disc of a directional light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SunDisc {
    /// Half the angle that the disc fills, degrees, above 0 and at most 45. Default: 0.2665, the sun's
    pub angular_radius_deg: f32,
    /// Radiance of the disc, W/(m² sr), linear RGB. The sun's is its irradiance over 6.8e-5 sr, too bright for any picture without
    /// glare; shipped scenes show less. Default: (20000, 19000, 17000)
    pub radiance: Vec3,
}

impl Default for Environment {
    fn default() -> Self {
        Self {
            zenith: Vec3::new(20.0, 36.0, 70.0),
            horizon: Vec3::new(70.0, 82.0, 95.0),
            ground: Vec3::new(24.0, 22.0, 19.0),
            sun_disc: None,
            ambient_irradiance: Vec3::new(60.0, 75.0, 90.0),
        }
    }
}

impl Default for SunDisc {
    fn default() -> Self {
        Self { angular_radius_deg: 0.2665, radiance: Vec3::new(20000.0, 19000.0, 17000.0) }
    }
}

impl Environment {
    /// An environment that sends no light at all, as the analytic scenes need it.
    pub const BLACK: Self =
        Self { zenith: Vec3::ZERO, horizon: Vec3::ZERO, ground: Vec3::ZERO, sun_disc: None, ambient_irradiance: Vec3::ZERO };

    /// Radiance that arrives from the unit vector `direction_ws` (pointing away from the eye), without the sun's disc, W/(m² sr).
    ///
    /// Above the horizon `horizon + (zenith − horizon) (1 − (1 − y)⁴)` with y the direction's vertical part, so that the sky is brightest
    /// in a narrow band at the horizon; below it `ground`, reached over the first 0.02 of y so that a wavy reflection shows no hard line.
    #[must_use]
    pub fn sky_radiance(&self, direction_ws: Vec3) -> Vec3 {
        const HAZE: f32 = 0.02;
        let y = direction_ws.y.clamp(-1.0, 1.0);
        if y >= 0.0 {
            let low = (1.0 - y) * (1.0 - y);
            self.horizon + (self.zenith - self.horizon) * (1.0 - low * low)
        } else {
            self.horizon + (self.ground - self.horizon) * (-y / HAZE).min(1.0)
        }
    }

    /// Radiance of the sun's disc in the unit vector `direction_ws`, for light that travels along the unit vector `light_ws`, W/(m² sr);
    /// 0 outside the disc and where there is none.
    #[must_use]
    pub fn disc_radiance(&self, direction_ws: Vec3, light_ws: Vec3) -> Vec3 {
        match self.sun_disc {
            // Half the chord, not the cosine: 1 − cos of a quarter degree has lost half of its bits in f32.
            Some(disc) if (direction_ws + light_ws).length() <= 2.0 * sin_cos_deg(0.5 * disc.angular_radius_deg).0 as f32 => disc.radiance,
            _ => Vec3::ZERO,
        }
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        const RADIANCE: &str = "W/(m² sr)";
        at.field("zenith").light(self.zenith, RADIANCE)?;
        at.field("horizon").light(self.horizon, RADIANCE)?;
        at.field("ground").light(self.ground, RADIANCE)?;
        at.field("ambient_irradiance").light(self.ambient_irradiance, "W/m²")?;
        if let Some(disc) = self.sun_disc {
            let at = at.field("sun_disc");
            at.field("angular_radius_deg").within(disc.angular_radius_deg, 0.01..=45.0, "degrees")?;
            at.field("radiance").light(disc.radiance, RADIANCE)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sky_is_continuous_from_zenith_through_horizon_to_ground() {
        let env = Environment::default();
        assert_eq!(env.sky_radiance(Vec3::Y), env.zenith);
        assert_eq!(env.sky_radiance(Vec3::X), env.horizon);
        assert_eq!(env.sky_radiance(Vec3::NEG_Y), env.ground);
        let at = |y: f32| env.sky_radiance(Vec3::new((1.0 - y * y).sqrt(), y, 0.0));
        for step in -1000..1000 {
            let y = step as f32 * 1e-3;
            assert!((at(y + 1e-3) - at(y)).length() < 6.0, "jump at y = {y}");
        }
    }

    #[test]
    fn disc_is_seen_only_within_its_radius() {
        let env = Environment { sun_disc: Some(SunDisc::default()), ..Environment::default() };
        let toward = |deg: f32| {
            let (sin, cos) = sin_cos_deg(deg);
            env.disc_radiance(Vec3::new(sin as f32, cos as f32, 0.0), Vec3::NEG_Y)
        };
        assert_eq!(toward(0.26), SunDisc::default().radiance);
        assert_eq!(toward(0.27), Vec3::ZERO);
        assert_eq!(Environment::BLACK.disc_radiance(Vec3::Y, Vec3::NEG_Y), Vec3::ZERO);
    }
}
