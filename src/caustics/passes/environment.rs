//! The uniform of sky, sun discs and medium.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::V3;
use nephroid_scene::{Environment, Light, MAX_LIGHTS, Medium};

/// Sky, sun discs and the medium.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EnvironmentUniform {
    /// Radiance straight up, W/(m² sr).
    pub zenith: Vec4,
    /// Radiance at the horizon.
    pub horizon: Vec4,
    /// Radiance from below.
    pub ground: Vec4,
    /// Radiance of the sun's disc. w is the squared half chord of the disc's angular radius, 0 without a disc.
    pub disc: Vec4,
    /// Unit vectors along which the directional lights travel; w is 1 for lights that exist.
    pub suns: [Vec4; MAX_LIGHTS],
    /// Ambient irradiance, W/m².
    pub ambient: Vec4,
    /// Extinction coefficient, 1/m.
    pub sigma_t: Vec4,
    /// Radiance that a thick layer of water scatters towards the eye: `σₛ/σₜ · E/(4π)`, with E the ambient irradiance plus the lights' mean
    /// irradiance on the water. w is the refractive index.
    pub inscatter: Vec4,
}

impl EnvironmentUniform {
    /// From the scene's parts. `lights_on_water` is the irradiance on the mean water plane, summed over lights.
    #[must_use]
    pub fn new(environment: &Environment, lights: &[Light], medium: &Medium, ior: f32, lights_on_water: Vec3) -> Self {
        let mut suns = [Vec4::ZERO; MAX_LIGHTS];
        for (slot, light) in suns.iter_mut().zip(lights) {
            if light.is_directional() {
                *slot = light.incident(Vec3::ZERO).direction_ws.extend(1.0);
            }
        }
        let disc = environment.sun_disc.map_or(Vec4::ZERO, |disc| {
            let half_chord = nephroid_math::space::sin_cos_deg(0.5 * disc.angular_radius_deg).0 as f32 * 2.0;
            disc.radiance.extend(half_chord * half_chord)
        });
        let sigma_t = medium.sigma_t();
        let albedo = Vec3::select(sigma_t.cmpgt(Vec3::ZERO), medium.sigma_s / sigma_t, Vec3::ZERO);
        let inscatter = albedo * (environment.ambient_irradiance + lights_on_water) / (4.0 * std::f32::consts::PI);
        Self {
            zenith: environment.zenith.extend(0.0),
            horizon: environment.horizon.extend(0.0),
            ground: environment.ground.extend(0.0),
            disc,
            suns,
            ambient: environment.ambient_irradiance.extend(0.0),
            sigma_t: sigma_t.extend(0.0),
            inscatter: inscatter.extend(ior),
        }
    }

    /// Radiance that arrives from the unit vector `direction` (pointing away from the eye), including the sun's disc.
    /// [`Environment::sky_radiance`] is the definition of the gradient.
    #[inline(always)]
    pub fn sky<L: Lanes>(&self, direction: V3<L>) -> V3<L> {
        let token = direction.x.token();
        let horizon = V3::splat(token, self.horizon.truncate());
        let zero = L::splat(token, 0.0);
        let y = Lanes::clamp(direction.y, -1.0, 1.0);
        let low = (-y + 1.0) * (-y + 1.0);
        let up = -(low * low) + 1.0;
        let down = Lanes::min(-y / 0.02, L::splat(token, 1.0));
        let above = horizon + (V3::splat(token, self.zenith.truncate()) - horizon) * up;
        let below = horizon + (V3::splat(token, self.ground.truncate()) - horizon) * down;
        let mut radiance = V3::select(y.lt(zero), below, above);
        if self.disc.w > 0.0 {
            for sun in self.suns.iter().filter(|s| s.w > 0.0) {
                let gap = direction + V3::splat(token, sun.truncate());
                let inside = gap.dot(gap).le(L::splat(token, self.disc.w));
                radiance = V3::select(inside, radiance + V3::splat(token, self.disc.truncate()), radiance);
            }
        }
        radiance
    }
}
