//! Bounds on the difference between a driver and the software GPU in the passes that techniques share. Each technique states those of its own passes.

pub use nephroid_image::metrics::bounds::PassBounds;
use nephroid_image::metrics::bounds::{CHAINED, CHAINED_LOOKED_UP, CHAINED_SEARCHED, INTERPOLATED, LOOKED_UP, SEARCHED, SHADED, VERTEX};

/// Bounds of the shared passes, by the start of their labels.
pub const SHARED: &[PassBounds] = &[
    PassBounds { pass: "geometry_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "receiver_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "back_faces", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "surroundings light ", vertices: VERTEX, textures: &[("", LOOKED_UP, CHAINED_LOOKED_UP)] },
    PassBounds { pass: "surroundings radiance", vertices: VERTEX, textures: &[("", SHADED, CHAINED_LOOKED_UP)] },
    PassBounds { pass: "surroundings", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "glass", vertices: VERTEX, textures: &[("", SEARCHED, CHAINED_SEARCHED)] },
    PassBounds { pass: "light_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "light ", vertices: VERTEX, textures: &[("direct", LOOKED_UP, CHAINED_LOOKED_UP), ("", SHADED, CHAINED)] },
    PassBounds { pass: "picture", vertices: VERTEX, textures: &[("", SEARCHED, CHAINED_SEARCHED)] },
];
