//! Water over time: keeps what a model needs from one frame to the next.

use super::height_field::{HeightField, Layout};
use super::ocean::FftOcean;
use super::pipe_fluid::{PipeFluid, SprayParticle};
use super::{Water, WaterModel};

/// A water surface that is asked for at one time after another.
///
/// Going forward in time costs only the steps between; going back restarts a simulated model. The bits of a surface depend on its time alone.
#[derive(Clone, Debug)]
pub struct WaterSim {
    water: Water,
    state: State,
}

#[derive(Clone, Debug)]
enum State {
    Formula,
    Fluid(Box<PipeFluid>),
    Ocean(Box<FftOcean>),
}

impl WaterSim {
    pub(super) fn new(water: &Water) -> Self {
        let state = match &water.model {
            WaterModel::PipeFluid(settings) => State::Fluid(Box::new(PipeFluid::new(settings, water))),
            WaterModel::FftOcean(settings) => State::Ocean(Box::new(FftOcean::new(settings))),
            _ => State::Formula,
        };
        Self { water: water.clone(), state }
    }

    /// The surface at `time_s` on the water's own grid.
    #[must_use]
    pub fn surface_at(&mut self, time_s: f32) -> HeightField {
        let (columns, rows) = self.water.grid;
        self.surface_with_grid(columns, rows, time_s)
    }

    /// The surface at `time_s` on a grid of `columns × rows` vertices (both brought into `2..=4096`).
    #[must_use]
    pub fn surface_with_grid(&mut self, columns: u32, rows: u32, time_s: f32) -> HeightField {
        let layout: Layout = self.water.layout(columns, rows);
        match &mut self.state {
            State::Fluid(fluid) => {
                fluid.advance_to(f64::from(time_s));
                fluid.sample(&layout)
            }
            State::Ocean(ocean) => ocean.sample(&layout, self.water.level_m, f64::from(time_s)),
            State::Formula => match self.water.formula(time_s) {
                Some(formula) => layout.sample(|column, row| formula.height_and_slope(layout.x_ws(column), layout.z_ws(row))),
                None => layout.sample(|_, _| (self.water.level_m, glam::Vec2::ZERO)),
            },
        }
    }

    /// Water in the air after the surface that was last asked for; empty for models without spray.
    #[must_use]
    pub fn spray(&self) -> &[SprayParticle] {
        match &self.state {
            State::Fluid(fluid) => fluid.spray(),
            State::Formula | State::Ocean(_) => &[],
        }
    }
}
