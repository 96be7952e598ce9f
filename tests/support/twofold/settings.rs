//! Settings of `twofold`.

use nephroid::scene::{EyeRefraction, settings};

settings! {
    /// Settings of the technique `twofold`.
    pub struct Twofold("twofold") {
        /// What direct irradiance is multiplied by.
        factor: f32 = 2.0, in 0.0..=16.0, paper 4.0, note "exact for powers of two";
        shared eye_refraction;
        shared shadow_map_size;
        shared samples;
    }
}
