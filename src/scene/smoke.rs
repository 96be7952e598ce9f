//! Smoke: a box of air whose density varies from place to place.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use nephroid_math::noise::Fbm;

use super::check::{At, Invalid};

/// Most cells along a side of a cloud.
pub const MAX_SMOKE_CELLS: u32 = 256;

/// A box filled with smoke: coefficients at density 1, times a density from 0 to 1 that is linear between the corners of a grid.
///
/// It fills air only; where the box reaches into water or glass, it ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Smoke {
    /// Corner with the smallest coordinates, in world space, m.
    pub min: Vec3,
    /// Corner with the largest coordinates, in world space, m; each above that of `min`.
    pub max: Vec3,
    /// Absorption coefficient σ_a at density 1, 1/m, linear RGB, from 0 to 1000. Default: (0, 0, 0)
    #[serde(default)]
    pub sigma_a: Vec3,
    /// Scattering coefficient σ_s at density 1, 1/m, linear RGB, from 0 to 1000.
    pub sigma_s: Vec3,
    /// Mean cosine g of the Henyey-Greenstein phase function, above −1 and below 1. Default: 0
    #[serde(default)]
    pub g: f32,
    /// How dense it is where. Default: Uniform
    #[serde(default)]
    pub density: Density,
}

/// Density over the points of a [`Smoke`] box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Density {
    /// 1 everywhere.
    #[default]
    Uniform,
    /// Billows: fractal noise, cut off below a threshold, sampled on a grid.
    Noise {
        /// Size of the largest billows, m. Default: 0.5
        #[serde(default = "scale_m")]
        scale_m: f32,
        /// How many times the noise is added at half the size and strength, from 1 to 8. Default: 4
        #[serde(default = "octaves")]
        octaves: u32,
        /// Value of the noise, from −1 to 1, at and below which the air is clear; the density is 1 where the noise is 1. Default: −0.2
        #[serde(default = "threshold")]
        threshold: f32,
        /// Cells of the grid along x, y and z, each from 1 to 256. Default: (64, 64, 64)
        #[serde(default = "cells")]
        cells: (u32, u32, u32),
        /// Which of the random clouds. Default: 0
        #[serde(default)]
        seed: u32,
    },
}

fn scale_m() -> f32 {
    0.5
}

fn octaves() -> u32 {
    4
}

fn threshold() -> f32 {
    -0.2
}

fn cells() -> (u32, u32, u32) {
    (64, 64, 64)
}

/// Densities at the corners of a grid of cells, x fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityGrid {
    /// Number of corners along x, y and z, each at least 2.
    pub corners: [u32; 3],
    /// Density at every corner, from 0 to 1.
    pub values: Vec<f32>,
}

impl Smoke {
    /// The density sampled on its grid; two corners along each side where it is uniform.
    #[must_use]
    pub fn density_grid(&self) -> DensityGrid {
        match self.density {
            Density::Uniform => DensityGrid { corners: [2; 3], values: vec![1.0; 8] },
            Density::Noise { scale_m, octaves, threshold, cells, seed } => {
                let corners = [cells.0 + 1, cells.1 + 1, cells.2 + 1];
                let fbm = Fbm { octaves, ..Fbm::default() };
                let step = (self.max - self.min) / Vec3::new(cells.0 as f32, cells.1 as f32, cells.2 as f32);
                let mut values = Vec::with_capacity(corners.iter().map(|&c| c as usize).product());
                for z in 0..corners[2] {
                    for y in 0..corners[1] {
                        for x in 0..corners[0] {
                            let p = (self.min + step * Vec3::new(x as f32, y as f32, z as f32)) / scale_m;
                            let value = fbm.at3(p.x, p.y, p.z, seed);
                            values.push(((value - threshold) / (1.0 - threshold)).clamp(0.0, 1.0));
                        }
                    }
                }
                DensityGrid { corners, values }
            }
        }
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("min").point(self.min)?;
        let max = at.field("max");
        max.point(self.max)?;
        for axis in 0..3 {
            max.index(axis).require(self.max[axis] > self.min[axis], self.max[axis], "a coordinate above that of `min`")?;
        }
        at.field("sigma_a").coefficient(self.sigma_a)?;
        at.field("sigma_s").coefficient(self.sigma_s)?;
        at.field("g").require(self.g > -1.0 && self.g < 1.0, self.g, "a number above -1 and below 1")?;
        if let Density::Noise { scale_m, octaves, threshold, cells, seed: _ } = self.density {
            let at = at.field("density");
            at.field("scale_m").length_m(scale_m)?;
            at.field("octaves").count(octaves, 1..=8)?;
            at.field("threshold").require((-1.0..1.0).contains(&threshold), threshold, "a number from -1, below 1")?;
            for (axis, count) in [cells.0, cells.1, cells.2].into_iter().enumerate() {
                at.field("cells").index(axis).count(count, 1..=MAX_SMOKE_CELLS)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn billows_stay_between_nothing_and_one_and_are_neither() {
        let text = "(min: (0, 0, 0), max: (2, 2, 2), sigma_s: (1, 1, 1), density: Noise(cells: (16, 16, 16)))";
        let smoke: Smoke = ron::from_str(text).unwrap();
        assert_eq!(smoke.validate(&At::ROOT), Ok(()));
        let grid = smoke.density_grid();
        assert_eq!((grid.corners, grid.values.len()), ([17; 3], 17 * 17 * 17));
        assert!(grid.values.iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(grid.values.contains(&0.0) && grid.values.iter().any(|&v| v > 0.2));
    }

    #[test]
    fn a_box_turned_inside_out_is_refused() {
        let text = "(min: (0, 0, 0), max: (2, -2, 2), sigma_s: (1, 1, 1))";
        let smoke: Smoke = ron::from_str(text).unwrap();
        assert_eq!(smoke.validate(&At::ROOT).unwrap_err().to_string(), "max[1]: found -2, expected a coordinate above that of `min`");
    }
}
