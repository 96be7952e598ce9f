//! What the water is made of: absorption and scattering per metre, and how scattering is distributed over angles.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};

/// The homogeneous medium below the water surface.
///
/// In a file: one of the names `Vacuum`, `Clear`, `Pool`, `Coastal`, or `Custom(sigma_a: (r, g, b), sigma_s: (r, g, b), g: x)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Description", into = "Description")]
pub struct Medium {
    /// Absorption coefficient σ_a, 1/m, linear RGB, from 0 to 1000.
    pub sigma_a: Vec3,
    /// Scattering coefficient σ_s, 1/m, linear RGB, from 0 to 1000.
    pub sigma_s: Vec3,
    /// Mean cosine g of the Henyey-Greenstein phase function, above −1 and below 1; positive scatters forward.
    pub g: f32,
}

impl Medium {
    /// Nothing: light passes unchanged. The analytic scenes use it.
    pub const VACUUM: Self = Self { sigma_a: Vec3::ZERO, sigma_s: Vec3::ZERO, g: 0.0 };

    /// Pure water: absorption at 650, 550 and 450 nm (Pope & Fry 1997, table 3), scattering by molecules only (Morel 1974), which is as
    /// strong backward as forward.
    pub const CLEAR: Self = Self { sigma_a: Vec3::new(0.340, 0.0565, 0.00922), sigma_s: Vec3::new(0.0010, 0.0019, 0.0045), g: 0.0 };

    /// A well-kept swimming pool: pure water and a trace of fine particles (our choice: 0.02 1/m, forward).
    pub const POOL: Self = Self { sigma_a: Vec3::new(0.342, 0.060, 0.014), sigma_s: Vec3::new(0.021, 0.022, 0.025), g: 0.85 };

    /// Coastal sea: Petzold's coastal water at 514 nm (a = 0.179, b = 0.219 1/m, mean cosine of the particles 0.924), spread over the
    /// spectrum by adding the absorption of pure water to a flat absorption of particles (our choice).
    pub const COASTAL: Self = Self { sigma_a: Vec3::new(0.479, 0.196, 0.149), sigma_s: Vec3::new(0.219, 0.219, 0.219), g: 0.924 };

    /// The presets by the name that scene files and `--set medium.preset` use.
    pub const PRESETS: [(&'static str, Self); 4] =
        [("Vacuum", Self::VACUUM), ("Clear", Self::CLEAR), ("Pool", Self::POOL), ("Coastal", Self::COASTAL)];

    /// Extinction coefficient σ_t = σ_a + σ_s, 1/m.
    #[must_use]
    pub fn sigma_t(&self) -> Vec3 {
        self.sigma_a + self.sigma_s
    }

    /// The preset's name, if this is one.
    #[must_use]
    pub fn preset(&self) -> Option<&'static str> {
        Self::PRESETS.iter().find(|(_, medium)| medium == self).map(|&(name, _)| name)
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("sigma_a").coefficient(self.sigma_a)?;
        at.field("sigma_s").coefficient(self.sigma_s)?;
        at.field("g").require(self.g > -1.0 && self.g < 1.0, self.g, "a number above -1 and below 1")
    }
}

impl Default for Medium {
    /// [`Medium::CLEAR`].
    fn default() -> Self {
        Self::CLEAR
    }
}

/// A medium as it is written in a file.
#[derive(Serialize, Deserialize)]
#[serde(rename = "Medium", deny_unknown_fields)]
enum Description {
    Vacuum,
    Clear,
    Pool,
    Coastal,
    Custom {
        sigma_a: Vec3,
        sigma_s: Vec3,
        #[serde(default)]
        g: f32,
    },
}

impl From<Description> for Medium {
    fn from(description: Description) -> Self {
        match description {
            Description::Vacuum => Self::VACUUM,
            Description::Clear => Self::CLEAR,
            Description::Pool => Self::POOL,
            Description::Coastal => Self::COASTAL,
            Description::Custom { sigma_a, sigma_s, g } => Self { sigma_a, sigma_s, g },
        }
    }
}

impl From<Medium> for Description {
    fn from(medium: Medium) -> Self {
        match medium.preset() {
            Some("Vacuum") => Self::Vacuum,
            Some("Clear") => Self::Clear,
            Some("Pool") => Self::Pool,
            Some("Coastal") => Self::Coastal,
            _ => Self::Custom { sigma_a: medium.sigma_a, sigma_s: medium.sigma_s, g: medium.g },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_read_and_written_by_its_name() {
        for (name, medium) in Medium::PRESETS {
            assert_eq!(ron::from_str::<Medium>(name).unwrap(), medium);
            assert_eq!(ron::to_string(&medium).unwrap(), name);
            assert_eq!(medium.validate(&At::ROOT), Ok(()));
        }
        let custom = Medium { g: 0.5, ..Medium::POOL };
        assert_eq!(ron::from_str::<Medium>(&ron::to_string(&custom).unwrap()).unwrap(), custom);
        assert_eq!(custom.preset(), None);
    }

    #[test]
    fn presets_absorb_red_most() {
        for (_, medium) in &Medium::PRESETS[1..] {
            assert!(medium.sigma_a.x > medium.sigma_a.y && medium.sigma_a.y > medium.sigma_a.z);
        }
    }
}
