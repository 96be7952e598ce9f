//! What surfaces do with light, and the patterns that vary it over a surface.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};

/// Most colours in one [`Albedo::Tiles`].
pub const MAX_TILE_COLOURS: usize = 8;

/// What a surface does with light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Material {
    /// Lambertian: reflects albedo/π times the irradiance, in every direction alike.
    Diffuse {
        /// The share of light reflected, and its pattern.
        albedo: Albedo,
    },
    /// A perfect mirror.
    Mirror {
        /// The share of light reflected, linear RGB, from 0 to 1. Default: (0.95, 0.95, 0.95)
        #[serde(default = "mirror_reflectance")]
        reflectance: Vec3,
    },
    /// A smooth transparent body: glass.
    Dielectric {
        /// Refractive index of the inside, from 1 to 4. Default: 1.5
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Abbe number V = (n_d − 1)/(n_F − n_C) of the inside, from 5 to 200: how little colours are spread; crown glass has 59, water 56.
        /// Only the ground truth spreads them. Default: None, not at all
        #[serde(default)]
        abbe: Option<f32>,
        /// Absorption coefficient of the inside, 1/m, linear RGB. Default: (0, 0, 0)
        #[serde(default)]
        absorption: Vec3,
    },
}

fn mirror_reflectance() -> Vec3 {
    Vec3::splat(0.95)
}

fn glass_ior() -> f32 {
    1.5
}

impl Default for Material {
    /// Diffuse, solid, 0.5 grey.
    fn default() -> Self {
        Self::Diffuse { albedo: Albedo::default() }
    }
}

/// The albedo of a diffuse surface over its points, each colour linear RGB from 0 to 1.
///
/// Patterns live in world space and are metric: the point's two coordinates along the axes that the normal is least aligned with, so
/// that tiles of the floor and of the walls of one pool share their lines. [`Albedo::at`](super::pattern) is the definition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Albedo {
    /// One colour.
    Solid(Vec3),
    /// Tiles on a rectangular grid with grout between them.
    Tiles {
        /// Width and height of one tile with half of the grout around it, m. Default: (0.15, 0.15)
        #[serde(default = "tile_size_m")]
        size_m: Vec2,
        /// The colours tiles are drawn from, each with the same chance; from 1 to 8.
        colours: Vec<Vec3>,
        /// Colour of the grout. Default: (0.62, 0.62, 0.60)
        #[serde(default = "grout")]
        grout: Vec3,
        /// Width of the grout between two tiles, m, from 0 to the smaller side of a tile. Default: 0.006
        #[serde(default = "grout_width_m")]
        grout_width_m: f32,
        /// Largest relative change of a tile's brightness, from 0 to 1, drawn for each tile. Default: 0.08
        #[serde(default = "tile_variation")]
        variation: f32,
        /// Which of the random arrangements. Default: 0
        #[serde(default)]
        seed: u32,
    },
    /// Squares of two colours.
    Checker {
        /// Side of one square, m. Default: 0.5
        #[serde(default = "checker_size_m")]
        size_m: f32,
        /// Colour of the square at the origin. Default: (0.8, 0.8, 0.8)
        #[serde(default = "checker_even")]
        even: Vec3,
        /// Colour of its neighbours. Default: (0.2, 0.2, 0.2)
        #[serde(default = "checker_odd")]
        odd: Vec3,
    },
    /// Fractal noise between two colours: sand, stone, plaster.
    Noise {
        /// Colour where the noise is lowest.
        low: Vec3,
        /// Colour where the noise is highest.
        high: Vec3,
        /// Size of the largest features, m. Default: 0.5
        #[serde(default = "noise_scale_m")]
        scale_m: f32,
        /// How many times the noise is added at half the size and strength, from 1 to 8. Default: 5
        #[serde(default = "noise_octaves")]
        octaves: u32,
        /// Which of the random patterns. Default: 0
        #[serde(default)]
        seed: u32,
    },
}

fn tile_size_m() -> Vec2 {
    Vec2::splat(0.15)
}

fn grout() -> Vec3 {
    Vec3::new(0.62, 0.62, 0.60)
}

fn grout_width_m() -> f32 {
    0.006
}

fn tile_variation() -> f32 {
    0.08
}

fn checker_size_m() -> f32 {
    0.5
}

fn checker_even() -> Vec3 {
    Vec3::splat(0.8)
}

fn checker_odd() -> Vec3 {
    Vec3::splat(0.2)
}

fn noise_scale_m() -> f32 {
    0.5
}

fn noise_octaves() -> u32 {
    5
}

impl Default for Albedo {
    /// 0.5 grey.
    fn default() -> Self {
        Self::Solid(Vec3::splat(0.5))
    }
}

impl Material {
    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        match self {
            Self::Diffuse { albedo } => albedo.validate(&at.field("albedo")),
            Self::Mirror { reflectance } => at.field("reflectance").reflectance(*reflectance),
            Self::Dielectric { ior, abbe, absorption } => {
                at.field("ior").within(*ior, 1.0..=4.0, "")?;
                if let Some(abbe) = *abbe {
                    at.field("abbe").within(abbe, 5.0..=200.0, "")?;
                }
                at.field("absorption").coefficient(*absorption)
            }
        }
    }
}

impl Albedo {
    fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        match self {
            Self::Solid(colour) => at.reflectance(*colour),
            Self::Tiles { size_m, colours, grout, grout_width_m, variation, seed: _ } => {
                at.field("size_m").extent2(*size_m)?;
                let list = at.field("colours");
                list.list(colours.len(), 1..=MAX_TILE_COLOURS)?;
                for (index, colour) in colours.iter().enumerate() {
                    list.index(index).reflectance(*colour)?;
                }
                at.field("grout").reflectance(*grout)?;
                at.field("grout_width_m").within(*grout_width_m, 0.0..=size_m.min_element(), "m (the smaller side of a tile)")?;
                at.field("variation").within(*variation, 0.0..=1.0, "")
            }
            Self::Checker { size_m, even, odd } => {
                at.field("size_m").length_m(*size_m)?;
                at.field("even").reflectance(*even)?;
                at.field("odd").reflectance(*odd)
            }
            Self::Noise { low, high, scale_m, octaves, seed: _ } => {
                at.field("low").reflectance(*low)?;
                at.field("high").reflectance(*high)?;
                at.field("scale_m").length_m(*scale_m)?;
                at.field("octaves").count(*octaves, 1..=8)
            }
        }
    }
}
