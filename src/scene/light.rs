//! Sources of light: the sun, points and spots. A directional light gives an irradiance, the others an intensity.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use nephroid_math::space::{direction_deg, sin_cos_deg};

use super::check::{At, Invalid};

/// Most lights in one scene.
pub const MAX_LIGHTS: usize = 16;

/// A source of light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Light {
    /// Parallel light that fills the world: the sun.
    Directional {
        /// Which way the light travels.
        aim: Aim,
        /// Irradiance on a surface perpendicular to the light, W/m², linear RGB.
        irradiance: Vec3,
    },
    /// Light from one point, the same in all directions.
    Point {
        /// Where it is, in world space, m.
        position: Vec3,
        /// Radiant intensity, W/sr, linear RGB.
        intensity: Vec3,
    },
    /// Light from one point into a cone.
    Spot {
        /// Where it is, in world space, m.
        position: Vec3,
        /// The cone's axis, away from the light, in world space; of any length above 0.
        direction: Vec3,
        /// Radiant intensity inside the inner cone, W/sr, linear RGB.
        intensity: Vec3,
        /// Angle between the axis and the edge of full intensity, degrees, from 0 to `outer_deg`. Default: 20
        #[serde(default = "inner_deg")]
        inner_deg: f32,
        /// Angle between the axis and the edge of darkness, degrees, at most 89. Default: 30
        #[serde(default = "outer_deg")]
        outer_deg: f32,
    },
}

fn inner_deg() -> f32 {
    20.0
}

fn outer_deg() -> f32 {
    30.0
}

/// The direction of a parallel light, said in one of two ways.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Aim {
    /// The direction in which the light travels, in world space; of any length above 0.
    Along(Vec3),
    /// Where the light comes from, as one says it of the sun.
    Sun {
        /// Compass direction of the sun, degrees, from −360 to 360: 0 stands at +x, 90 at +z, 180 at −x. Default: 0
        #[serde(default)]
        azimuth_deg: f32,
        /// Height of the sun over the horizon, degrees, from −90 to 90; the angle of incidence on flat water is 90 − this.
        elevation_deg: f32,
    },
}

impl Aim {
    /// Unit vector along which the light travels, in world space. Exactly (0, −1, 0) for an elevation of 90°.
    #[must_use]
    pub fn direction_ws(&self) -> Vec3 {
        match *self {
            Self::Along(direction) => direction.normalize(),
            Self::Sun { azimuth_deg, elevation_deg } => -direction_deg(azimuth_deg, elevation_deg),
        }
    }

    /// Azimuth and elevation in degrees, as in [`Aim::Sun`]; an azimuth of 0 for light straight up or down.
    #[must_use]
    pub fn angles_deg(&self) -> (f32, f32) {
        match *self {
            Self::Sun { azimuth_deg, elevation_deg } => (azimuth_deg, elevation_deg),
            Self::Along(_) => {
                let to_light = (-self.direction_ws()).as_dvec3();
                let horizontal = (to_light.x * to_light.x + to_light.z * to_light.z).sqrt();
                let azimuth = if horizontal == 0.0 { 0.0 } else { libm::atan2(to_light.z, to_light.x) };
                (azimuth.to_degrees() as f32, libm::atan2(to_light.y, horizontal).to_degrees() as f32)
            }
        }
    }
}

/// The light that arrives at one point, before any shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit vector along which the light travels, in world space.
    pub direction_ws: Vec3,
    /// Irradiance on a surface perpendicular to that direction, W/m², linear RGB.
    pub irradiance: Vec3,
}

impl Light {
    /// The light mirrored at the plane y = 0.
    #[must_use]
    pub fn upside_down(&self) -> Self {
        let mirrored = |v: Vec3| Vec3::new(v.x, -v.y, v.z);
        match *self {
            Self::Directional { aim, irradiance } => Self::Directional { aim: Aim::Along(mirrored(aim.direction_ws())), irradiance },
            Self::Point { position, intensity } => Self::Point { position: mirrored(position), intensity },
            Self::Spot { position, direction, intensity, inner_deg, outer_deg } => {
                Self::Spot { position: mirrored(position), direction: mirrored(direction), intensity, inner_deg, outer_deg }
            }
        }
    }

    /// The unshadowed light that arrives at `position_ws`.
    ///
    /// Directional: E; point: I / r²; spot: s I / r², with s the smoothstep of the cosine from the outer to the inner cone. At the light
    /// itself (r = 0) there is no direction and the irradiance is 0.
    #[must_use]
    pub fn incident(&self, position_ws: Vec3) -> Incident {
        match *self {
            Self::Directional { aim, irradiance } => Incident { direction_ws: aim.direction_ws(), irradiance },
            Self::Point { position, intensity } => from_point(position, intensity, position_ws),
            Self::Spot { position, direction, intensity, inner_deg, outer_deg } => {
                let mut incident = from_point(position, intensity, position_ws);
                let cos = incident.direction_ws.dot(direction.normalize());
                incident.irradiance *= spot_falloff(cos, inner_deg, outer_deg);
                incident
            }
        }
    }

    /// Whether this is a [`Light::Directional`].
    #[must_use]
    pub fn is_directional(&self) -> bool {
        matches!(self, Self::Directional { .. })
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        match *self {
            Self::Directional { aim, irradiance } => {
                let aim_at = at.field("aim");
                match aim {
                    Aim::Along(direction) => aim_at.direction(direction)?,
                    Aim::Sun { azimuth_deg, elevation_deg } => {
                        aim_at.field("azimuth_deg").within(azimuth_deg, -360.0..=360.0, "degrees")?;
                        aim_at.field("elevation_deg").within(elevation_deg, -90.0..=90.0, "degrees")?;
                    }
                }
                at.field("irradiance").light(irradiance, "W/m²")
            }
            Self::Point { position, intensity } => {
                at.field("position").point(position)?;
                at.field("intensity").light(intensity, "W/sr")
            }
            Self::Spot { position, direction, intensity, inner_deg, outer_deg } => {
                at.field("position").point(position)?;
                at.field("direction").direction(direction)?;
                at.field("intensity").light(intensity, "W/sr")?;
                at.field("outer_deg").above(outer_deg, 0.0, 89.0, "degrees")?;
                at.field("inner_deg").within(inner_deg, 0.0..=outer_deg, "degrees (outer_deg)")
            }
        }
    }
}

fn from_point(light_ws: Vec3, intensity: Vec3, position_ws: Vec3) -> Incident {
    let offset = position_ws - light_ws;
    let distance_squared = offset.length_squared();
    if distance_squared > 0.0 {
        Incident { direction_ws: offset / distance_squared.sqrt(), irradiance: intensity / distance_squared }
    } else {
        Incident { direction_ws: Vec3::ZERO, irradiance: Vec3::ZERO }
    }
}

/// Share of a spot's intensity at an angle whose cosine is `cos` from its axis: 1 inside the inner cone, 0 outside the outer, between
/// them the smoothstep `t² (3 − 2t)` of `t = (cos − cos_outer) / (cos_inner − cos_outer)`; a step where both cones are the same.
#[must_use]
pub fn spot_falloff(cos: f32, inner_deg: f32, outer_deg: f32) -> f32 {
    let cos_inner = sin_cos_deg(inner_deg).1 as f32;
    let cos_outer = sin_cos_deg(outer_deg).1 as f32;
    if cos >= cos_inner {
        1.0
    } else if cos <= cos_outer {
        0.0
    } else {
        let t = (cos - cos_outer) / (cos_inner - cos_outer);
        t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cos_deg(angle: f32) -> f32 {
        sin_cos_deg(angle).1 as f32
    }

    #[test]
    fn sun_directions_are_exact_where_the_angles_are() {
        let aim = |azimuth_deg, elevation_deg| Aim::Sun { azimuth_deg, elevation_deg }.direction_ws();
        assert_eq!(aim(0.0, 90.0), Vec3::NEG_Y);
        assert_eq!(aim(0.0, 0.0), Vec3::NEG_X, "a sun at +x sends its light along -x");
        assert_eq!(aim(90.0, 0.0), Vec3::NEG_Z, "a sun at +z sends its light along -z");
        assert_eq!(aim(180.0, 30.0).y, -0.5);
    }

    #[test]
    fn aim_along_says_the_same_as_its_angles() {
        for aim in [Aim::Sun { azimuth_deg: 37.0, elevation_deg: 52.0 }, Aim::Sun { azimuth_deg: -120.0, elevation_deg: -10.0 }] {
            let (azimuth, elevation) = Aim::Along(aim.direction_ws() * 3.0).angles_deg();
            let (a, e) = aim.angles_deg();
            assert!((azimuth - a).abs() < 1e-4 && (elevation - e).abs() < 1e-4, "{azimuth} {elevation}");
        }
        assert_eq!(Aim::Along(Vec3::NEG_Y).angles_deg(), (0.0, 90.0));
    }

    #[test]
    fn point_light_falls_off_with_the_square_of_the_distance() {
        let light = Light::Point { position: Vec3::new(0.0, 4.0, 0.0), intensity: Vec3::splat(8.0) };
        let incident = light.incident(Vec3::new(0.0, 2.0, 0.0));
        assert_eq!((incident.direction_ws, incident.irradiance), (Vec3::NEG_Y, Vec3::splat(2.0)));
        assert_eq!(light.incident(Vec3::new(0.0, 4.0, 0.0)).irradiance, Vec3::ZERO);
    }

    #[test]
    fn spot_light_is_full_inside_and_dark_outside() {
        assert_eq!(spot_falloff(1.0, 10.0, 20.0), 1.0);
        assert_eq!(spot_falloff(cos_deg(20.1), 10.0, 20.0), 0.0);
        let middle = 0.5 * (cos_deg(10.0) + cos_deg(20.0));
        assert!((spot_falloff(middle, 10.0, 20.0) - 0.5).abs() < 1e-6);
        assert_eq!(spot_falloff(cos_deg(15.0), 15.0, 15.0), 1.0);
    }
}
