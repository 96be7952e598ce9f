//! Settings of `caustic-volumes`.

use serde::{Deserialize, Serialize};

use crate::check::{At, Invalid, MAX_LENGTH_M};

use super::{EyeRefraction, Radiometry, validate_grid};

/// Which faces of the caustic volumes are rasterized.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Faces {
    /// Those towards the eye: the paper's choice, wrong where the eye is inside a volume.
    Front,
    /// Those away from the eye: right for any eye, and cheaper.
    #[default]
    Back,
}

/// Settings of the technique `caustic-volumes`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CausticVolumes {
    /// How light is counted. Default: Physical
    pub radiometry: Radiometry,
    /// Columns and rows of vertices of the water mesh that makes the volumes, each from 2 to 4096, in place of the water's own grid.
    /// Default: None, the water's grid
    pub grid: Option<(u32, u32)>,
    /// How far the volumes reach below the lowest receiver, m, from 0 to 1e6; above 0 so that the floor lies inside. Default: 0.05
    pub depth_below_floor_m: f32,
    /// Share of the light, after absorption, below which a volume is cut off by a bottom cap, from 0 to 0.5. Default: 0.001
    pub negligible_light: f32,
    /// How the eye sees through the water surface. Default: Snell (the paper: VirtualPlane)
    pub eye_refraction: EyeRefraction,
    /// Whether objects under water cut off the light behind them. Default: true (the paper: false)
    pub underwater_shadows: bool,
    /// Whether objects above the water cut off the light before it enters. Default: true (the paper: false)
    pub surface_shadows: bool,
    /// Width and height of the shadow maps, texels, from 16 to 16384. Default: 2048
    pub shadow_map_size: u32,
    /// Which faces of the volumes are rasterized. Default: Back
    pub faces: Faces,
    /// Samples along each side of a pixel, from 1 to 8: the picture is rendered that many times larger and averaged. Default: 1
    pub samples: u32,
}

impl Default for CausticVolumes {
    fn default() -> Self {
        Self {
            radiometry: Radiometry::Physical,
            grid: None,
            depth_below_floor_m: 0.05,
            negligible_light: 0.001,
            eye_refraction: EyeRefraction::Snell,
            underwater_shadows: true,
            surface_shadows: true,
            shadow_map_size: 2048,
            faces: Faces::Back,
            samples: 1,
        }
    }
}

impl CausticVolumes {
    /// The technique as the paper has it: its equation, its virtual plane, no shadows, front faces.
    pub const PAPER: Self = Self {
        radiometry: Radiometry::Paper,
        grid: None,
        depth_below_floor_m: 0.05,
        negligible_light: 0.001,
        eye_refraction: EyeRefraction::VirtualPlane,
        underwater_shadows: false,
        surface_shadows: false,
        shadow_map_size: 2048,
        faces: Faces::Front,
        samples: 1,
    };

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        validate_grid(self.grid, at)?;
        at.field("depth_below_floor_m").within(self.depth_below_floor_m, 0.0..=MAX_LENGTH_M, "m")?;
        at.field("negligible_light").within(self.negligible_light, 0.0..=0.5, "")?;
        at.field("shadow_map_size").count(self.shadow_map_size, 16..=16384)?;
        at.field("samples").count(self.samples, 1..=8)
    }
}
