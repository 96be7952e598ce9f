//! Settings of `light-volumes`.

use nephroid_scene::{EyeRefraction, MAX_GRID, Radiometry, choices, settings};

choices! {
    /// How light of many beams is added up at a receiver.
    pub enum Gather {
        /// Intensities; the cosine is that of light under still water [BO §3.2].
        FlatWater,
        /// Vectors towards the light, as long as its intensity; the cosine is that of their sum [BO §3.2].
        Vector,
        /// Irradiances, each with the cosine of its own beam.
        PerBeam,
    }
}

choices! {
    /// Where the light of a beam is computed.
    pub enum EnergyAt {
        /// At the slicing planes; a pixel takes what is interpolated on the first face of the beam that is drawn over it [BO §3.2].
        Face,
        /// At the height of the receiver that the pixel shows.
        Receiver,
    }
}

choices! {
    /// How beams that need not be drawn are found.
    pub enum BeamCulling {
        /// Not at all: every beam is drawn in full.
        Off,
        /// Each on its own.
        PerBeam,
        /// Down quadtrees of parent beams [BO §3.3].
        Hierarchical,
    }
}

choices! {
    /// How objects above the water cut off beams.
    pub enum BeamShadows {
        /// Not at all.
        Off,
        /// A shadow map is sampled at each vertex of the water [BO §3.4].
        Vertices,
        /// Leaves of the hierarchy in shadow are culled.
        Culling,
        /// Both.
        Both,
    }
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

settings! {
    /// Settings of the technique `light-volumes`.
    pub struct LightVolumes("light_volumes") {
        shared radiometry, note "decisions E1 and E5; also `--radiometry`";
        /// How the light of many beams is added up at a receiver.
        gather: Gather = Gather::PerBeam, paper Gather::Vector, said "flat_water, vector",
            note "decision E6: irradiance beam by beam, or sums that `relight` turns into irradiance";
        /// Where the light of a beam is computed.
        energy: EnergyAt = EnergyAt::Receiver, paper EnergyAt::Face, note "decision E3";
        shared grid, said "120x120 to 200x200", note "at most 2,097,152 triangles (1025x1025)";
        /// Longest edge of the triangles of mirrors and glass that make beams, as a share of the object's size.
        generator_edge: f32 = 0.02, in 0.001..=1.0;
        /// Slicing planes, the surface among them.
        planes: u32 = 9, in 2..=64, said "not said";
        shared depth_below_floor;
        /// How beams that need not be drawn are found.
        culling: BeamCulling = BeamCulling::Hierarchical, note "`per_beam` is the paper's reference, `off` draws whole beams";
        /// Whether beams are drawn only where the boxes of receivers are.
        clamping: bool = true;
        /// Whether receivers that others hide from the eye are left out of clamping.
        receiver_culling: bool = false, said "future work";
        /// Quadtrees along x and z.
        buckets: (u32, u32) = (4, 4), in 1..=64, unit "quadtrees", said "not said";
        /// How often each quadtree is cut.
        levels: u32 = 3, in 0..=8, said "not said";
        /// How objects above the water cut off beams.
        shadows: BeamShadows = BeamShadows::Both, note "`vertices` samples the map, `culling` culls leaves";
        /// Share of a leaf that must be in shadow for it to be culled.
        least_shadow: f32 = 0.98, in 0.0..=1.0, paper 0.65, note "S_min";
        shared eye_refraction;
        shared underwater_shadows, note "decision E8";
        shared shadow_map_size, note "queries use at most 512";
        shared samples;
    }
}
