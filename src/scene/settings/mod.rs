//! The settings of each technique: one struct per technique, every field with its unit, its range and its default.

use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};

mod caustic_volumes;
mod light_volumes;

pub use caustic_volumes::{CausticVolumes, Faces};
pub use light_volumes::{BeamCulling, BeamShadows, EnergyAt, Gather, LightVolumes};

/// Largest side of the water grid that a technique may ask for, in vertices.
pub const MAX_GRID: u32 = 4096;

/// What the techniques are told, beyond the scene itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TechniqueSettings {
    /// Caustic volumes (Sandberg & Falemo 2005). Default: all defaults
    pub caustic_volumes: CausticVolumes,
    /// Hierarchical light volumes (Barczak & Olano). Default: all defaults
    pub light_volumes: LightVolumes,
}

/// Whether light is counted as the paper prints it, or so that none is made or lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Radiometry {
    /// The published equation, to the letter.
    Paper,
    /// Flux is conserved: transmittance and both cosines are in, and receivers answer to the angle of the light.
    #[default]
    Physical,
}

/// How the eye sees through the water surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum EyeRefraction {
    /// The picture of what is under water, looked up through a plane at the mean level and shifted by the waves [SF05 §3.5].
    VirtualPlane,
    /// Each pixel's ray refracted by Snell's law and followed to what it hits.
    #[default]
    Snell,
}

impl TechniqueSettings {
    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        self.caustic_volumes.validate(&at.field("caustic_volumes"))?;
        self.light_volumes.validate(&at.field("light_volumes"))
    }
}

/// A grid that a technique asks for in place of the water's own.
fn validate_grid(grid: Option<(u32, u32)>, at: &At<'_>) -> Result<(), Invalid> {
    if let Some((columns, rows)) = grid {
        let grid = at.field("grid");
        grid.index(0).count(columns, 2..=MAX_GRID)?;
        grid.index(1).count(rows, 2..=MAX_GRID)?;
    }
    Ok(())
}
