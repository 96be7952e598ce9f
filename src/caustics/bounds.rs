//! Bounds on the difference between a driver and the software GPU in the passes that techniques share. Each technique states those of its own passes.

pub use nephroid_image::metrics::bounds::PassBounds;
use nephroid_image::metrics::bounds::{Bound, INTERPOLATED, LOOKED_UP, PATTERNED, SEARCHED, SHADED, VERTEX};

/// Vertices in a light's view, which fits narrowly around things far away: where it ends, differences cancel places.
const IN_LIGHT_VIEW: Bound = Bound::new("light-view-vertex", 1.0e-5, [10.0, 10.0], 1.0e-3, 0.0);

/// Bounds of the shared passes, by the start of their labels.
pub const SHARED: &[PassBounds] = &[
    PassBounds { pass: "geometry_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "receiver_buffer", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "back_faces", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "surroundings light ", vertices: VERTEX, textures: &[("", LOOKED_UP, LOOKED_UP)] },
    PassBounds { pass: "surroundings radiance", vertices: VERTEX, textures: &[("", SHADED, SHADED)] },
    PassBounds { pass: "surroundings", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    PassBounds { pass: "shade", vertices: VERTEX, textures: &[("", SHADED, SHADED)] },
    PassBounds { pass: "glass", vertices: VERTEX, textures: &[("", SEARCHED, SEARCHED)] },
    PassBounds {
        pass: "light_buffer",
        vertices: IN_LIGHT_VIEW,
        textures: &[("material", PATTERNED, PATTERNED), ("", INTERPOLATED, INTERPOLATED)],
    },
    PassBounds { pass: "light ", vertices: VERTEX, textures: &[("direct", LOOKED_UP, LOOKED_UP), ("", SHADED, SHADED)] },
    PassBounds { pass: "picture", vertices: VERTEX, textures: &[("", SEARCHED, SEARCHED)] },
];
