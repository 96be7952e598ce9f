//! How far a driver may be from the software GPU in the passes that techniques share. Each technique states its own passes.

pub use nephroid_image::metrics::bounds::PassBounds;
use nephroid_image::metrics::bounds::{CHAINED, CHAINED_LOOKED_UP, CHAINED_SEARCHED, INTERPOLATED, LOOKED_UP, SEARCHED, SHADED, VERTEX};

/// Shared passes, by the start of their labels.
pub const SHARED: &[PassBounds] = &[
    PassBounds { pass: "geometry_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "light_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "light ", vertices: VERTEX, textures: &[("direct", LOOKED_UP, CHAINED_LOOKED_UP), ("", SHADED, CHAINED)] },
    PassBounds { pass: "picture", vertices: VERTEX, textures: &[("", SEARCHED, CHAINED_SEARCHED)] },
];
