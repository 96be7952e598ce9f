//! Settings of `light-volumes`.

use serde::{Deserialize, Serialize};

use crate::check::{At, Invalid, MAX_LENGTH_M};

use super::{EyeRefraction, Radiometry, validate_grid};

/// How light of many beams is added up at a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Gather {
    /// Intensities; the cosine is that of light under still water [BO §3.2].
    FlatWater,
    /// Vectors towards the light, as long as its intensity; the cosine is that of their sum [BO §3.2].
    Vector,
    /// Irradiances, each with the cosine of its own beam.
    #[default]
    PerBeam,
}

/// Where the light of a beam is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum EnergyAt {
    /// At the slicing planes; a pixel takes what is interpolated on the first face of the beam that is drawn over it [BO §3.2].
    Face,
    /// At the height of the receiver that the pixel shows.
    #[default]
    Receiver,
}

/// How beams that need not be drawn are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BeamCulling {
    /// Not at all: every beam is drawn in full.
    Off,
    /// Each on its own.
    PerBeam,
    /// Down quadtrees of parent beams [BO §3.3].
    #[default]
    Hierarchical,
}

/// How objects above the water cut off beams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BeamShadows {
    /// Not at all.
    Off,
    /// A shadow map is sampled at each vertex of the water [BO §3.4].
    Vertices,
    /// Leaves of the hierarchy in shadow are culled.
    Culling,
    /// Both.
    #[default]
    Both,
}

impl BeamShadows {
    /// Whether vertices are looked up in a shadow map.
    #[must_use]
    pub fn samples_vertices(self) -> bool {
        matches!(self, Self::Vertices | Self::Both)
    }
    /// Whether leaves are culled.
    #[must_use]
    pub fn culls_leaves(self) -> bool {
        matches!(self, Self::Culling | Self::Both)
    }
}

/// Settings of the technique `light-volumes`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LightVolumes {
    /// How light is counted. Default: Physical
    pub radiometry: Radiometry,
    /// How the light of many beams is added up. Default: PerBeam (the paper: FlatWater or Vector)
    pub gather: Gather,
    /// Where the light of a beam is computed. Default: Receiver (the paper: Face)
    pub energy: EnergyAt,
    /// Columns and rows of vertices of the water mesh that makes the beams, each from 2 to 4096, in place of the water's own grid.
    /// Default: None, the water's grid
    pub grid: Option<(u32, u32)>,
    /// Longest edge of the triangles of mirrors and glass that make beams, as a share of the object's size, from 0.001 to 1. Default: 0.02
    pub generator_edge: f32,
    /// Slicing planes, the surface among them, from 2 to 64. Default: 9
    pub planes: u32,
    /// How far the lowest plane lies below the lowest receiver, m, from 0 to 1e6; above 0 so that the floor lies inside. Default: 0.05
    pub depth_below_floor_m: f32,
    /// How beams that need not be drawn are found. Default: Hierarchical
    pub culling: BeamCulling,
    /// Whether beams are drawn only where the boxes of receivers are. Default: true
    pub clamping: bool,
    /// Whether receivers that others hide from the eye are left out of clamping. Default: false
    pub receiver_culling: bool,
    /// Quadtrees along x and z, each from 1 to 64. Default: (4, 4)
    pub buckets: (u32, u32),
    /// How often each quadtree is cut, from 0 to 8. Default: 3
    pub levels: u32,
    /// How objects above the water cut off beams. Default: Both
    pub shadows: BeamShadows,
    /// S_min, the share of a leaf that must be in shadow for it to be culled, from 0 to 1. Default: 0.98 (the paper: 0.65)
    pub least_shadow: f32,
    /// How the eye sees through the water surface. Default: Snell
    pub eye_refraction: EyeRefraction,
    /// Whether objects under water cut off the light behind them. Default: true (the paper: false)
    pub underwater_shadows: bool,
    /// Width and height of the shadow maps, texels, from 16 to 16384. Default: 2048
    pub shadow_map_size: u32,
    /// Samples along each side of a pixel, from 1 to 8: the picture is rendered that many times larger and averaged. Default: 1
    pub samples: u32,
}

impl Default for LightVolumes {
    fn default() -> Self {
        Self {
            radiometry: Radiometry::Physical,
            gather: Gather::PerBeam,
            energy: EnergyAt::Receiver,
            grid: None,
            generator_edge: 0.02,
            planes: 9,
            depth_below_floor_m: 0.05,
            culling: BeamCulling::Hierarchical,
            clamping: true,
            receiver_culling: false,
            buckets: (4, 4),
            levels: 3,
            shadows: BeamShadows::Both,
            least_shadow: 0.98,
            eye_refraction: EyeRefraction::Snell,
            underwater_shadows: true,
            shadow_map_size: 2048,
            samples: 1,
        }
    }
}

impl LightVolumes {
    /// The technique as the paper has it, with vectors: its equation, energy read from faces, light that passes through what it hits.
    pub const PAPER: Self = Self {
        radiometry: Radiometry::Paper,
        gather: Gather::Vector,
        energy: EnergyAt::Face,
        grid: None,
        generator_edge: 0.02,
        planes: 9,
        depth_below_floor_m: 0.05,
        culling: BeamCulling::Hierarchical,
        clamping: true,
        receiver_culling: false,
        buckets: (4, 4),
        levels: 3,
        shadows: BeamShadows::Both,
        least_shadow: 0.65,
        eye_refraction: EyeRefraction::VirtualPlane,
        underwater_shadows: false,
        shadow_map_size: 2048,
        samples: 1,
    };

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        validate_grid(self.grid, at)?;
        at.field("generator_edge").within(self.generator_edge, 0.001..=1.0, "")?;
        at.field("planes").count(self.planes, 2..=64)?;
        at.field("depth_below_floor_m").within(self.depth_below_floor_m, 0.0..=MAX_LENGTH_M, "m")?;
        let buckets = at.field("buckets");
        buckets.index(0).count(self.buckets.0, 1..=64)?;
        buckets.index(1).count(self.buckets.1, 1..=64)?;
        at.field("levels").count(self.levels, 0..=8)?;
        at.field("least_shadow").within(self.least_shadow, 0.0..=1.0, "")?;
        at.field("shadow_map_size").count(self.shadow_map_size, 16..=16384)?;
        at.field("samples").count(self.samples, 1..=8)
    }
}
