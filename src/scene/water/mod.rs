//! The water: a description as it stands in a scene file, and the surface it means at any time.
//!
//! [`Water`] is data. [`Water::surface`] samples it on its grid as a [`HeightField`]; [`Water::height_normal`] evaluates it exactly at a point where
//! the model has a formula; [`Water::simulator`] is for animation, where each frame continues from the one before. All three agree to the bit: a
//! surface is a function of the description and the time, never of what was asked before.
//!
//! | Model | Formula | Time |
//! |---|---|---|
//! | [`WaterModel::Flat`], [`WaterModel::Tilted`] | yes | none |
//! | [`WaterModel::Waves`], [`WaterModel::CircularCosine`], [`WaterModel::AxisCosine`] | yes | any |
//! | [`WaterModel::PipeFluid`] | no, simulated on a grid | from 0 on, up to [`Water::max_time_s`] |
//! | [`WaterModel::FftOcean`] | no, a sum of thousands of waves | any |
//!
//! World space: metres, y up; (x, z) pairs are `Vec2`. Every model is a height field: no overturning waves, because the
//! techniques need an evenly spaced grid.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

mod cosine;
mod error;
mod formula;
mod height_field;
mod ocean;
mod pipe_fluid;
mod sim;
#[cfg(test)]
mod tests;
mod waves;

pub use cosine::{Axis, AxisCosine, CircularCosine, Ripples};
pub use error::WaterError;
pub use formula::Formula;
pub use height_field::{HeightField, normal_from_slope};
pub use ocean::{FftOcean, OceanSettings, Spectrum};
pub use pipe_fluid::{
    Drop, FluidSettings, InitialState, MovingObject, ObjectPath, ObjectShape, PipeFluid, Rain, SprayParticle, SpraySettings,
};
pub use sim::WaterSim;
pub use waves::{Motion, PlaneWave};

use error::{require, within};
use formula::Term;
use height_field::Layout;

/// How far beyond its edges the water is taken to reach, as a share of its larger side.
const EXTENT_SLACK: f32 = 1.0e-4;

/// Standard acceleration of gravity, in m/s².
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Most vertices a water grid may have along one side.
pub const MAX_GRID: u32 = 4096;

/// A rectangle of water, as a scene file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Water {
    /// World (x, z) of the middle of the surface, in metres. −1e6..=1e6. Default: (0, 0)
    pub center_m: Vec2,
    /// Extent along x and z, in metres. 1e-5..=1e6. Default: (10, 10)
    pub size_m: Vec2,
    /// World y of the still surface, in metres. −1e6..=1e6. Default: 0
    pub level_m: f32,
    /// Refractive index of the water, relative to the air above it. 0.25..=4; 1 makes the surface invisible. Default: 1.333
    pub ior: f32,
    /// Abbe number V = (n_d − 1)/(n_F − n_C) of the water, 5..=200: how little colours are spread; water has 56. Only the ground truth
    /// spreads them. Default: None, not at all
    pub abbe: Option<f32>,
    /// Vertices of the surface grid along x and z. 2..=4096. Default: (64, 64)
    pub grid: (u32, u32),
    /// What shape the surface has. Default: Flat
    pub model: WaterModel,
}

impl Default for Water {
    fn default() -> Self {
        Self {
            center_m: Vec2::ZERO,
            size_m: Vec2::splat(10.0),
            level_m: 0.0,
            ior: 1.333,
            abbe: None,
            grid: (64, 64),
            model: WaterModel::Flat,
        }
    }
}

/// The shape of a water surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum WaterModel {
    /// A still plane.
    #[default]
    Flat,
    /// A still plane that leans: with light, an optical wedge.
    Tilted {
        /// Rise per metre along x and z, each −1..=1; the middle of the water stays at its level.
        slope: Vec2,
    },
    /// A sum of plane waves; at most 4096.
    Waves(Vec<PlaneWave>),
    /// Rings around a point and small noise.
    CircularCosine(CircularCosine),
    /// Waves along an axis and strong noise.
    AxisCosine(AxisCosine),
    /// A fluid of columns joined by pipes, with drops, rain, objects and spray.
    PipeFluid(FluidSettings),
    /// A wind sea made by a Fourier transform.
    FftOcean(OceanSettings),
}

impl Water {
    /// Checks every field; the error names the first that is out of range.
    ///
    /// The other methods expect a description that passed. They do not panic on one that did not, but what they return then means nothing.
    pub fn validate(&self) -> Result<(), WaterError> {
        let place = |v: Vec2| within(v.x, -1e6, 1e6) && within(v.y, -1e6, 1e6);
        require(place(self.center_m), "center_m", self.center_m, "-1000000 ..= 1000000 m along x and z")?;
        let size = self.size_m;
        require(within(size.x, 1e-5, 1e6) && within(size.y, 1e-5, 1e6), "size_m", size, "0.00001 ..= 1000000 m along x and z")?;
        require(within(self.level_m, -1e6, 1e6), "level_m", self.level_m, "-1000000 ..= 1000000 m")?;
        require(within(self.ior, 0.25, 4.0), "ior", self.ior, "0.25 ..= 4")?;
        if let Some(abbe) = self.abbe {
            require(within(abbe, 5.0, 200.0), "abbe", abbe, "5 ..= 200")?;
        }
        let sides = 2..=MAX_GRID;
        require(sides.contains(&self.grid.0) && sides.contains(&self.grid.1), "grid", self.grid, "2 ..= 4096 vertices along x and z")?;
        match &self.model {
            WaterModel::Flat => Ok(()),
            WaterModel::Tilted { slope } => {
                require(within(slope.x, -1.0, 1.0) && within(slope.y, -1.0, 1.0), "model.slope", slope, "-1 ..= 1 along x and z")
            }
            WaterModel::Waves(waves) => {
                require(waves.len() <= 4096, "model: the number of waves", waves.len(), "0 ..= 4096")?;
                waves.iter().enumerate().try_for_each(|(i, wave)| wave.validate(&format!("model.waves[{i}]")))
            }
            WaterModel::CircularCosine(model) => model.validate(),
            WaterModel::AxisCosine(model) => model.validate(),
            WaterModel::PipeFluid(settings) => settings.validate(self),
            WaterModel::FftOcean(settings) => settings.validate(),
        }
    }

    /// Checks that the surface exists at `time_s`: a finite number and, for a simulated model, in `0..=max_time_s()`.
    pub fn validate_time(&self, time_s: f32) -> Result<(), WaterError> {
        require(time_s.is_finite(), "time", time_s, "a finite number of seconds")?;
        match self.max_time_s() {
            None => Ok(()),
            Some(max) => {
                require(within(time_s, 0.0, max), "time", time_s, "for a simulated fluid, from 0 to an hour or four million steps")
            }
        }
    }

    /// Latest time in seconds a simulated model can reach, an hour or four million steps; `None` for models without a limit.
    ///
    /// Surfaces at earlier times than 0 or later times than this are those at the limit.
    #[must_use]
    pub fn max_time_s(&self) -> Option<f32> {
        match &self.model {
            WaterModel::PipeFluid(settings) => Some(PipeFluid::max_time_s(settings, self) as f32),
            _ => None,
        }
    }

    /// The surface at `time_s` on the water's own grid.
    ///
    /// A simulated model is run from time 0: for animation use [`Self::simulator`].
    #[must_use]
    pub fn surface(&self, time_s: f32) -> HeightField {
        self.surface_with_grid(self.grid.0, self.grid.1, time_s)
    }

    /// The surface at `time_s` on a grid of `columns × rows` vertices over the same extent (both brought into `2..=4096`).
    ///
    /// Only the sampling changes: the motion of a simulated model does not depend on this grid.
    #[must_use]
    pub fn surface_with_grid(&self, columns: u32, rows: u32, time_s: f32) -> HeightField {
        self.simulator().surface_with_grid(columns, rows, time_s)
    }

    /// World y and unit normal of the surface at world (x, z), exact at any point; `None` for models without a formula.
    ///
    /// To evaluate many points at one time, take [`Self::formula`] once.
    #[must_use]
    pub fn height_normal(&self, x_ws: f32, z_ws: f32, time_s: f32) -> Option<(f32, Vec3)> {
        let (height, slope) = self.formula(time_s)?.height_and_slope(x_ws, z_ws);
        Some((height, normal_from_slope(slope)))
    }

    /// The surface at `time_s` as a formula; `None` for models that have none.
    #[must_use]
    pub fn formula(&self, time_s: f32) -> Option<Formula> {
        let time_s = f64::from(time_s);
        let (terms, noise): (Vec<Term>, _) = match &self.model {
            WaterModel::Flat => (Vec::new(), None),
            WaterModel::Tilted { slope } => (vec![Term::Plane { slope: slope.as_dvec2(), center: self.center_m.as_dvec2() }], None),
            WaterModel::Waves(waves) => (waves.iter().map(|wave| wave.term(time_s)).collect(), None),
            WaterModel::CircularCosine(model) => {
                let (wave, noise) = model.terms(time_s);
                (vec![wave], Some(noise))
            }
            WaterModel::AxisCosine(model) => {
                let (wave, noise) = model.terms(time_s);
                (vec![wave], Some(noise))
            }
            WaterModel::PipeFluid(_) | WaterModel::FftOcean(_) => return None,
        };
        Some(Formula { level_m: f64::from(self.level_m), terms, noise })
    }

    /// What gives surfaces at one time after another, each for the price of its own step.
    #[must_use]
    pub fn simulator(&self) -> WaterSim {
        WaterSim::new(self)
    }

    /// World y that no wave falls below at any time, in metres; for tilted and simulated water, which have no such bound, the level.
    #[must_use]
    pub fn lowest_m(&self) -> f32 {
        let rise = self.formula(0.0).map_or(0.0, |formula| formula.bounds(0.0).0);
        self.level_m - rise as f32
    }

    /// World (x, z) of the corner with the smallest coordinates, in metres.
    #[must_use]
    pub fn min_ws(&self) -> Vec2 {
        self.center_m - self.size_m * 0.5
    }

    /// World (x, z) of the corner with the largest coordinates, in metres.
    #[must_use]
    pub fn max_ws(&self) -> Vec2 {
        self.center_m + self.size_m * 0.5
    }

    /// World (x, z) of the corners between which things count as under water, in metres: a little more than the water. Walls often stand
    /// exactly at its edge, and their interpolated positions are a few units in the last place off.
    #[must_use]
    pub fn extent_ws(&self) -> (Vec2, Vec2) {
        let slack = Vec2::splat(self.size_m.max_element() * EXTENT_SLACK);
        (self.min_ws() - slack, self.max_ws() + slack)
    }

    fn layout(&self, columns: u32, rows: u32) -> Layout {
        let (columns, rows) = (columns.clamp(2, MAX_GRID), rows.clamp(2, MAX_GRID));
        let spacing_m = self.size_m / Vec2::new((columns - 1) as f32, (rows - 1) as f32);
        Layout { columns, rows, origin_ws: self.min_ws(), spacing_m }
    }
}
