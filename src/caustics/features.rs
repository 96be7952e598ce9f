//! Kinds of light beyond direct light, by which a technique states what it can draw.

use nephroid_scene::{Material, Scene};

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
    /// Dispersion in water or glass.
    Dispersion,
}

impl Feature {
    /// All features.
    pub const ALL: [Self; 5] =
        [Self::WaterCaustics, Self::SpecularCaustics, Self::SpecularCausticsBesideWater, Self::Smoke, Self::Dispersion];

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
            Self::Dispersion => {
                scene.water.as_ref().is_some_and(|water| water.abbe.is_some())
                    || scene.objects.iter().any(|object| spread(&object.material))
            }
        }
    }
}
