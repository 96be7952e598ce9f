//! What scenes can ask of a technique beyond direct light, so that a technique can say what it does not draw.

use nephroid_scene::{Material, Scene};

/// Light that a scene asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Caustics of light that is refracted into water.
    WaterCaustics,
    /// Caustics of mirrors and glass in a scene without water.
    SpecularCaustics,
    /// Caustics of mirrors and glass beside water.
    SpecularCausticsBesideWater,
    /// Light that smoke scatters and keeps.
    Smoke,
    /// Colours that water or glass spread apart.
    Dispersion,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::WaterCaustics, Self::SpecularCaustics, Self::SpecularCausticsBesideWater, Self::Smoke, Self::Dispersion];

    /// Whether a scene asks for it.
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
