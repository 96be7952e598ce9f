//! Kinds of light beyond direct light, by which a technique states what it can draw.

use nephroid_scene::water::Water;
use nephroid_scene::{Light, Material, Scene};

/// A kind of light that a scene contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Caustics of light that is refracted into water.
    WaterCaustics,
    /// Caustics of mirrors and glass in a scene without water.
    SpecularCaustics,
    /// Caustics of mirrors and glass beside water.
    SpecularCausticsBesideWater,
    /// Light that smoke scatters and absorbs.
    Smoke,
    /// Light of a source in the water that the surface reflects back into it.
    ReflectionInWater,
    /// Dispersion in water or glass.
    Dispersion,
}

impl Feature {
    /// All features.
    pub const ALL: [Self; 6] = [
        Self::WaterCaustics,
        Self::SpecularCaustics,
        Self::SpecularCausticsBesideWater,
        Self::Smoke,
        Self::ReflectionInWater,
        Self::Dispersion,
    ];

    /// The feature in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::WaterCaustics => "caustics of water",
            Self::SpecularCaustics => "caustics of mirrors and glass",
            Self::SpecularCausticsBesideWater => "caustics of mirrors and glass in a scene with water",
            Self::Smoke => "light in smoke",
            Self::ReflectionInWater => "light that the water's surface reflects back into the water",
            Self::Dispersion => "dispersion",
        }
    }

    /// Whether a scene contains this kind of light.
    #[must_use]
    pub fn is_asked_by(self, scene: &Scene) -> bool {
        let specular = || scene.objects.iter().any(|object| !matches!(object.material, Material::Diffuse { .. }));
        let spread = |material: &Material| matches!(material, Material::Dielectric { abbe: Some(_), .. });
        match self {
            Self::WaterCaustics => scene.water.is_some() && !scene.lights.is_empty(),
            Self::SpecularCaustics => scene.water.is_none() && specular() && !scene.lights.is_empty(),
            Self::SpecularCausticsBesideWater => scene.water.is_some() && specular() && !scene.lights.is_empty(),
            Self::Smoke => scene.smoke.is_some(),
            Self::ReflectionInWater => {
                scene.water.as_ref().is_some_and(|water| scene.lights.iter().any(|light| is_in(light, water, scene.time_s)))
            }
            Self::Dispersion => {
                scene.water.as_ref().is_some_and(|water| water.abbe.is_some())
                    || scene.objects.iter().any(|object| spread(&object.material))
            }
        }
    }
}

/// Whether a light is in the water; for water without a formula, below its level.
fn is_in(light: &Light, water: &Water, time_s: f32) -> bool {
    match *light {
        Light::Directional { .. } => light.incident(glam::Vec3::ZERO).direction_ws.y > 0.0,
        Light::Point { position: p, .. } | Light::Spot { position: p, .. } => {
            let (min, max) = (water.min_ws(), water.max_ws());
            let over = (min.x..=max.x).contains(&p.x) && (min.y..=max.y).contains(&p.z);
            over && p.y < water.height_normal(p.x, p.z, time_s).map_or(water.level_m, |(height, _)| height)
        }
    }
}
