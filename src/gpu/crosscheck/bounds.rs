//! How far a driver may be from the software GPU, by stage: every bound has a name, and the name says what it allows for.

use serde::Serialize;

use super::Mode;
use crate::Family;
use nephroid_pipeline::FormatInfo;

/// What an attachment must keep to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bound {
    /// Name in reports.
    pub name: &'static str,
    /// Relative error up to which a pixel is in order, see [`super::relative`]; 0 for bit equality.
    pub tolerance: f64,
    /// Pixels per million that may be beyond it.
    pub outliers_ppm: f64,
    /// Pixels per million of these that need not lie at an edge.
    pub unexplained_ppm: f64,
}

impl Bound {
    /// Whether so many pixels of `pixels` are within the bound.
    #[must_use]
    pub fn holds(&self, pixels: u64, outliers: u64, unexplained: u64) -> bool {
        let per_million = pixels as f64 / 1.0e6;
        outliers as f64 <= self.outliers_ppm * per_million && unexplained as f64 <= self.unexplained_ppm * per_million
    }
}

const fn bound(name: &'static str, tolerance: f64, outliers_ppm: f64, unexplained_ppm: f64) -> Bound {
    Bound { name, tolerance, outliers_ppm, unexplained_ppm }
}

/// Coverage, depth, stencil, counts: the same bits.
pub const EXACT: Bound = bound("exact", 0.0, 0.0, 0.0);

/// Depth where the driver computes vertices itself: clip positions differ in their last places, and so do a few pixels along edges.
const OWN_VERTICES: Bound = bound("own-vertices", 1.0e-4, 100.0, 20.0);

/// Vertices as the driver's own vertex stage makes them: a few products and sums, in another order or fused.
const VERTEX: Bound = bound("vertex", 2.0e-6, 10.0, 10.0);

/// Vertices that are swept down a ray, and what they look up in a shadow map that the driver drew itself.
const SWEPT: Bound = bound("swept-vertex", 5.0e-4, 300.0, 300.0);

/// Depth and coverage of hardware, whose arithmetic is not known: a few units in the last place, and single pixels along edges.
const HARDWARE: Bound = bound("hardware", 1.0e-4, 500.0, 50.0);

/// Interpolated attributes, from f32 planes; patterns that follow from them switch at other last places.
const INTERPOLATED: Bound = bound("interpolated", 1.0e-4, 200.0, 60.0);

/// The same on llvmpipe, which anchors its planes at the target's origin: small triangles far from it are off by up to 1e-3.
const INTERPOLATED_FROM_ORIGIN: Bound = bound("interpolated-from-origin", 1.0e-4, 4000.0, 600.0);

/// Shaded from equal inputs: elementary functions differ in their last places.
const SHADED: Bound = bound("shaded", 1.0e-4, 100.0, 20.0);

/// Looked up in a shadow map of thousands of texels: the place between two of them is known to some 1e-4 of a texel.
const LOOKED_UP: Bound = bound("looked-up", 5.0e-4, 100.0, 20.0);

/// Sums of blended contributions with equal inputs and equal coverage.
const ACCUMULATED: Bound = bound("accumulated", 1.0e-5, 20.0, 5.0);

/// Counts of fragments that a shader's own comparisons let through: beams meet in edges that rounding may move.
const COUNTED: Bound = bound("counted", 0.0, 20.0, 20.0);

/// What follows refracted rays through the picture: where depth jumps, the last place of a direction decides what is hit.
const SEARCHED: Bound = bound("searched", 1.0e-4, 12000.0, 800.0);

/// Shaded from what the driver itself drew before: shadow edges and seams move with the last places of positions.
const CHAINED: Bound = bound("chained", 1.0e-4, 12000.0, 800.0);

/// The same of light that shadow maps let through, see [`LOOKED_UP`].
const CHAINED_LOOKED_UP: Bound = bound("chained-looked-up", 5.0e-4, 12000.0, 800.0);

/// The searched picture of inputs that differ in their last places.
const CHAINED_SEARCHED: Bound = bound("chained-searched", 1.0e-4, 20000.0, 1500.0);

/// What a pass of a technique computes, by the start of its label and the texture drawn to. What is not in the table is shaded.
const STAGES: &[(&str, &str, Bound, Bound)] = &[
    // Pass, texture (all if empty), resynchronised, free-running.
    ("geometry_buffer", "", INTERPOLATED, INTERPOLATED),
    ("light_buffer", "", INTERPOLATED, INTERPOLATED),
    ("light ", "direct", LOOKED_UP, CHAINED_LOOKED_UP),
    ("caustic_volumes", "volume_count", COUNTED, CHAINED),
    ("caustic_volumes", "", ACCUMULATED, CHAINED_LOOKED_UP),
    ("light_volumes", "beam_count", COUNTED, CHAINED),
    ("light_volumes", "", ACCUMULATED, CHAINED_LOOKED_UP),
    ("picture", "", SEARCHED, CHAINED_SEARCHED),
    ("", "", SHADED, CHAINED),
];

/// The bound of one attachment of one pass.
#[must_use]
pub fn bound_of(family: Family, mode: Mode, pass: &str, texture: &str, info: FormatInfo) -> Bound {
    if info.depth || info.stencil || info.kind.is_integer() {
        return match (family, mode) {
            (Family::Other, _) => HARDWARE,
            (_, Mode::Resynchronised) => EXACT,
            (_, Mode::FreeRunning) => OWN_VERTICES,
        };
    }
    let stage = STAGES.iter().find(|(prefix, name, ..)| pass.starts_with(prefix) && (name.is_empty() || *name == texture));
    let (resynchronised, free) = stage.map_or((SHADED, CHAINED), |(.., r, f)| (*r, *f));
    let bound = match mode {
        Mode::Resynchronised => resynchronised,
        Mode::FreeRunning => free,
    };
    if bound == INTERPOLATED && family == Family::Lavapipe { INTERPOLATED_FROM_ORIGIN } else { bound }
}

/// The bound of a pass's vertices.
#[must_use]
pub fn vertex_bound_of(pass: &str) -> Bound {
    if pass.starts_with("light_volumes") { SWEPT } else { VERTEX }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_pipeline::format_info;
    use nephroid_pipeline::state::TextureFormat;

    #[test]
    fn depth_stencil_and_integers_are_exact_when_resynchronised() {
        for format in [
            TextureFormat::Depth32Float,
            TextureFormat::Stencil8,
            TextureFormat::R32Uint,
            TextureFormat::Rgba8Sint,
            TextureFormat::Depth32FloatStencil8,
        ] {
            let info = format_info(format).unwrap();
            for family in [Family::Lavapipe, Family::SwiftShader] {
                assert_eq!(bound_of(family, Mode::Resynchronised, "picture", "depth", info), EXACT);
            }
            assert_ne!(bound_of(Family::Other, Mode::Resynchronised, "picture", "depth", info), EXACT);
        }
    }

    #[test]
    fn bounds_fail_one_pixel_beyond() {
        assert!(EXACT.holds(1_000_000, 0, 0));
        assert!(!EXACT.holds(1_000_000, 1, 0));
        assert!(SHADED.holds(1_000_000, 100, 20));
        assert!(!SHADED.holds(1_000_000, 101, 0));
        assert!(!SHADED.holds(1_000_000, 21, 21));
    }
}
