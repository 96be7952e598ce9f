//! What a scene file says about a pipe-model fluid.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::super::Water;
use super::super::error::{WaterError, require, within};
use super::forces::{Drop, MovingObject, Rain};
use super::spray::SpraySettings;

/// Most columns along one side.
const MAX_CELLS: u32 = 1024;

/// A fluid of columns joined by pipes; see the [module](super) for the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FluidSettings {
    /// Columns of water along x and z; `None` is one less than the vertices of the surface grid, the paper's arrangement. 2..=1024; a column may be at most
    /// twice as long as wide. Default: None
    pub cells: Option<(u32, u32)>,
    /// Depth of the still water in metres, which sets the speed of all waves, `√(g·depth)`; it need not be the depth of the pool. 1e-5..=1e4. Default: 0.25
    pub depth_m: f32,
    /// Rate at which flows die out, in 1/s: waves lose half of this per second. 0..=100. Default: 0.2
    pub damping_per_s: f32,
    /// The surface at time 0, at rest. Default: Still
    pub initial: InitialState,
    /// Single drops. At most 4096. Default: none
    pub drops: Vec<Drop>,
    /// Drops that keep falling. Default: None
    pub rain: Option<Rain>,
    /// Bodies that press on the surface. At most 256. Default: none
    pub objects: Vec<MovingObject>,
    /// Water that is thrown off where the surface rises fast. Default: None
    pub spray: Option<SpraySettings>,
}

impl Default for FluidSettings {
    fn default() -> Self {
        Self {
            cells: None,
            depth_m: 0.25,
            damping_per_s: 0.2,
            initial: InitialState::Still,
            drops: Vec::new(),
            rain: None,
            objects: Vec::new(),
            spray: None,
        }
    }
}

/// The surface of a fluid at time 0; nothing flows yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum InitialState {
    /// Flat.
    #[default]
    Still,
    /// A standing wave of the basin, `a · cos(π m (x − x₀)/L_x) · cos(π n (z − z₀)/L_z)`.
    Cosine {
        /// Half waves `(m, n)` along x and z. 0..=512.
        half_waves: (u32, u32),
        /// Amplitude `a` in metres, below the depth. −100..=100.
        amplitude_m: f32,
    },
    /// A round hump (or hollow), `a · (1 − r²/R²)²` inside the radius; its volume adds to the fluid.
    Hump {
        /// World (x, z) of its middle, in metres. Any two finite numbers.
        center_m: Vec2,
        /// Radius `R` in metres. 1e-5..=1e6.
        radius_m: f32,
        /// Height `a` in metres; a hollow's is above −depth. −100..=100.
        height_m: f32,
    },
}

impl FluidSettings {
    /// Columns along x and z: as set, or one less than the vertices of the water's grid.
    #[must_use]
    pub fn cell_counts(&self, water: &Water) -> (u32, u32) {
        let side = |vertices: u32| vertices.saturating_sub(1);
        let (columns, rows) = self.cells.unwrap_or((side(water.grid.0), side(water.grid.1)));
        (columns.clamp(2, MAX_CELLS), rows.clamp(2, MAX_CELLS))
    }

    pub(in super::super) fn validate(&self, water: &Water) -> Result<(), WaterError> {
        if let Some((columns, rows)) = self.cells {
            let valid = (2..=MAX_CELLS).contains(&columns) && (2..=MAX_CELLS).contains(&rows);
            require(valid, "model.cells", (columns, rows), "2 ..= 1024 along x and z")?;
        }
        let (columns, rows) = self.cell_counts(water);
        let aspect = (water.size_m.x / columns as f32) / (water.size_m.y / rows as f32);
        require(within(aspect, 0.5, 2.0), "model.cells: length over width of a column", aspect, "0.5 ..= 2")?;
        require(within(self.depth_m, 1e-5, 1e4), "model.depth_m", self.depth_m, "0.00001 ..= 10000 m")?;
        require(within(self.damping_per_s, 0.0, 100.0), "model.damping_per_s", self.damping_per_s, "0 ..= 100 1/s")?;
        self.initial.validate(self.depth_m)?;
        require(self.drops.len() <= 4096, "model.drops: their number", self.drops.len(), "0 ..= 4096")?;
        require(self.objects.len() <= 256, "model.objects: their number", self.objects.len(), "0 ..= 256")?;
        self.drops.iter().enumerate().try_for_each(|(i, drop)| drop.validate(&format!("model.drops[{i}]"), water))?;
        self.objects.iter().enumerate().try_for_each(|(i, object)| object.validate(&format!("model.objects[{i}]")))?;
        self.rain.iter().try_for_each(Rain::validate)?;
        self.spray.iter().try_for_each(SpraySettings::validate)
    }
}

impl InitialState {
    fn validate(&self, depth_m: f32) -> Result<(), WaterError> {
        match *self {
            Self::Still => Ok(()),
            Self::Cosine { half_waves, amplitude_m } => {
                let valid = half_waves.0 <= 512 && half_waves.1 <= 512;
                require(valid, "model.initial.half_waves", half_waves, "0 ..= 512 along x and z")?;
                let valid = within(amplitude_m, -100.0, 100.0) && amplitude_m.abs() < depth_m;
                require(valid, "model.initial.amplitude_m", amplitude_m, "-100 ..= 100 m, less than the depth")
            }
            Self::Hump { center_m, radius_m, height_m } => {
                require(center_m.is_finite(), "model.initial.center_m", center_m, "two finite numbers of metres")?;
                require(within(radius_m, 1e-5, 1e6), "model.initial.radius_m", radius_m, "0.00001 ..= 1000000 m")?;
                let valid = within(height_m, -100.0, 100.0) && height_m > -depth_m;
                require(valid, "model.initial.height_m", height_m, "-100 ..= 100 m, above minus the depth")
            }
        }
    }
}
