//! Settings of `caustic-volumes`.

use nephroid_scene::{EyeRefraction, MAX_GRID, Radiometry, choices, settings};

choices! {
    /// Which faces of the caustic volumes are rasterized.
    pub enum Faces {
        /// Those towards the eye: the paper's choice, wrong where the eye is inside a volume.
        Front,
        /// Those away from the eye: right for any eye, and cheaper.
        Back,
    }
}

settings! {
    /// Settings of the technique `caustic-volumes`.
    pub struct CausticVolumes("caustic_volumes") {
        shared radiometry, note "decisions E1 and E4; also `--radiometry`";
        shared grid, said "64x64, 128x128";
        shared depth_below_floor;
        /// Share of the light, after absorption in the clearest channel, below which a volume is cut off by a bottom cap; 0 for never.
        negligible_light: f32 = 0.001, in 0.0..=0.5;
        shared eye_refraction;
        shared underwater_shadows, note "decision E6, through water";
        /// Whether objects above the water cut off the light before it enters.
        surface_shadows: bool = true, paper false, note "decision E6, through air";
        shared shadow_map_size;
        /// Which faces of the volumes are rasterized.
        faces: Faces = Faces::Back, paper Faces::Front, note "decision E3";
        shared samples;
    }
}
