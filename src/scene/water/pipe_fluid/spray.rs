//! Water thrown off the surface: particles that carry volume, fly, and give it back.

use glam::{DVec2, DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::super::GRAVITY_M_PER_S2;
use super::super::error::{WaterError, require, within};
use super::solver::Grid;
use nephroid_math::rng::uniform3;

/// When and how water leaves the surface as spray, after O'Brien & Hodgins.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpraySettings {
    /// A column that rises faster than this throws one particle per step, in m/s. 1e-3..=1e3. Default: 0.5
    pub threshold_m_per_s: f32,
    /// Radius of a particle in metres; its volume is taken from the column. 1e-5..=10. Default: 0.006
    pub radius_m: f32,
    /// Random part of a particle's velocity, as a share of its speed. 0..=1. Default: 0.3
    pub jitter: f32,
    /// Most particles in the air at once; beyond it none are thrown. 0..=1 000 000. Default: 20 000
    pub max_count: u32,
    /// Which random numbers: every seed is another spray. Default: 1
    pub seed: u32,
}

impl Default for SpraySettings {
    fn default() -> Self {
        Self { threshold_m_per_s: 0.5, radius_m: 0.006, jitter: 0.3, max_count: 20_000, seed: 1 }
    }
}

impl SpraySettings {
    pub(super) fn validate(&self) -> Result<(), WaterError> {
        let threshold = self.threshold_m_per_s;
        require(within(threshold, 1e-3, 1e3), "model.spray.threshold_m_per_s", threshold, "0.001 ..= 1000 m/s")?;
        require(within(self.radius_m, 1e-5, 10.0), "model.spray.radius_m", self.radius_m, "0.00001 ..= 10 m")?;
        require(within(self.jitter, 0.0, 1.0), "model.spray.jitter", self.jitter, "0 ..= 1")?;
        require(self.max_count <= 1_000_000, "model.spray.max_count", self.max_count, "0 ..= 1000000")
    }
}

/// A ball of water in the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SprayParticle {
    /// World (x, z) of its middle, in metres.
    pub position_m: DVec2,
    /// Height of its middle above the still level, in metres.
    pub height_m: f64,
    /// Velocity in m/s.
    pub velocity_m_per_s: Vec3,
    /// Volume in m³.
    pub volume_m3: f64,
}

/// All spray of a fluid.
#[derive(Clone, Debug)]
pub(super) struct Spray {
    settings: SpraySettings,
    particles: Vec<SprayParticle>,
    /// Particles thrown since time 0: the index of their random numbers.
    thrown_count: u32,
}

impl Spray {
    /// Stream of the random numbers of spray.
    const STREAM: u32 = 0x7370_7261;

    pub fn new(settings: SpraySettings) -> Self {
        Self { settings, particles: Vec::new(), thrown_count: 0 }
    }

    pub fn restart(&mut self) {
        self.particles.clear();
        self.thrown_count = 0;
    }

    pub fn particles(&self) -> &[SprayParticle] {
        &self.particles
    }

    pub fn volume_m3(&self) -> f64 {
        self.particles.iter().map(|particle| particle.volume_m3).sum()
    }

    /// Flies on by one step, lands what meets the surface, then throws from the columns that rise too fast.
    ///
    /// `inflows` is what the pipes brought, without landing spray and drops, so that one does not set off the next.
    pub fn step(&mut self, grid: &Grid, step_s: f64, depth_m: f64, inflows: &[f64], volumes: &mut [f64]) {
        let area = grid.cell_area_m2();
        let max_ws = grid.min_ws + grid.cell_m * DVec2::new(grid.columns as f64, grid.rows as f64);
        self.particles.retain_mut(|particle| {
            particle.fly(step_s, grid.min_ws, max_ws);
            let (column, row) = grid.cell_at(particle.position_m);
            let volume = &mut volumes[grid.index(column, row)];
            let flying = particle.velocity_m_per_s.y > 0.0 || particle.height_m > *volume / area - depth_m;
            if !flying {
                *volume += particle.volume_m3;
            }
            flying
        });

        let radius = f64::from(self.settings.radius_m);
        let particle_volume = std::f64::consts::PI * 4.0 / 3.0 * radius * radius * radius;
        for row in 0..grid.rows {
            for column in 0..grid.columns {
                let i = grid.index(column, row);
                let rise = inflows[i] / area;
                let room = self.particles.len() < self.settings.max_count as usize;
                if rise > f64::from(self.settings.threshold_m_per_s) && volumes[i] > particle_volume && room {
                    let height_m = volumes[i] / area - depth_m;
                    volumes[i] -= particle_volume;
                    let slope = slope_at(grid, volumes, column, row);
                    self.throw(grid, (column, row), height_m, rise, slope, particle_volume);
                }
            }
        }
    }

    /// Starts a particle from a random place of a column, along the surface normal at the speed it rises, and shaken.
    fn throw(&mut self, grid: &Grid, cell: (usize, usize), height_m: f64, rise: f64, slope: DVec2, volume_m3: f64) {
        let place = uniform3(self.settings.seed, Self::STREAM, self.thrown_count).map(|u| f64::from(u) - 0.5);
        let shake = uniform3(self.settings.seed, Self::STREAM + 1, self.thrown_count).map(|u| 2.0 * f64::from(u) - 1.0);
        self.thrown_count = self.thrown_count.wrapping_add(1);
        let velocity = DVec3::new(-slope.x, 1.0, -slope.y) * rise + DVec3::from(shake) * (rise * f64::from(self.settings.jitter));
        self.particles.push(SprayParticle {
            position_m: grid.center_ws(cell.0, cell.1) + grid.cell_m * DVec2::new(place[0], place[1]),
            height_m,
            velocity_m_per_s: velocity.as_vec3(),
            volume_m3,
        });
    }
}

/// Slope of the columns around a cell by central differences, one-sided at the walls.
fn slope_at(grid: &Grid, volumes: &[f64], column: usize, row: usize) -> DVec2 {
    let (west, east) = (column.saturating_sub(1), (column + 1).min(grid.columns - 1));
    let (north, south) = (row.saturating_sub(1), (row + 1).min(grid.rows - 1));
    let height = |column: usize, row: usize| volumes[grid.index(column, row)] / grid.cell_area_m2();
    DVec2::new(
        (height(east, row) - height(west, row)) / ((east - west) as f64 * grid.cell_m.x),
        (height(column, south) - height(column, north)) / ((south - north) as f64 * grid.cell_m.y),
    )
}

impl SprayParticle {
    /// Free flight by one step; walls of the basin turn it back.
    fn fly(&mut self, step_s: f64, min_ws: DVec2, max_ws: DVec2) {
        self.velocity_m_per_s.y -= (GRAVITY_M_PER_S2 * step_s) as f32;
        let velocity = self.velocity_m_per_s.as_dvec3();
        self.height_m += velocity.y * step_s;
        self.position_m += DVec2::new(velocity.x, velocity.z) * step_s;
        let outside = self.position_m.cmplt(min_ws) | self.position_m.cmpgt(max_ws);
        self.velocity_m_per_s.x *= if outside.x { -1.0 } else { 1.0 };
        self.velocity_m_per_s.z *= if outside.y { -1.0 } else { 1.0 };
        self.position_m = self.position_m.clamp(min_ws, max_ws);
    }
}
