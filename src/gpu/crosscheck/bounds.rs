//! Bounds on the difference between a driver and the software GPU: those of the frame's passes, which the caller states, and those of drivers.

use serde::Serialize;

use super::Mode;
use crate::Family;
use nephroid_image::metrics::bounds::{ANOTHER_SURFACE, INTERPOLATED, SHADED, VERTEX};
pub use nephroid_image::metrics::bounds::{Bound, EXACT, PassBounds};
use nephroid_pipeline::FormatInfo;

/// A [`Bound`] as reports contain it.
#[derive(Serialize)]
#[serde(remote = "Bound")]
pub(super) struct ReportedBound {
    name: &'static str,
    tolerance: f64,
    outliers_ppm: f64,
    unexplained_ppm: f64,
    worst: f64,
    light: f64,
}

/// Depth if the driver computes vertices itself: clip positions differ in their last places, and so do a few pixels along edges.
const OWN_VERTICES: Bound = Bound::new("own-vertices", 1.0e-4, [100.0, 20.0], ANOTHER_SURFACE, 1.0e-5);

/// Depth and coverage of hardware with unknown arithmetic: a few units in the last place, and single pixels along edges.
const HARDWARE: Bound = Bound::new("hardware", 1.0e-4, [500.0, 50.0], ANOTHER_SURFACE, 1.0e-4);

/// [`INTERPOLATED`] for llvmpipe, which anchors its planes at the target's origin: small triangles far from the origin differ by up to 1e-3, and slivers whose area
/// vanishes in f32 by any amount.
const INTERPOLATED_FROM_ORIGIN: Bound = Bound::new("interpolated-from-origin", 1.0e-4, [4000.0, 100.0], ANOTHER_SURFACE, 1.0e-4);

/// [`INTERPOLATED`] for SwiftShader, which anchors its planes at a corner: in a triangle that starts close to the eye and is many times as large as the
/// picture, that corner is far from the pixels.
const INTERPOLATED_FROM_CORNER: Bound = Bound::new("interpolated-from-corner", 5.0e-4, [200.0, 20.0], 0.1, 1.0e-4);

/// Largest share of the light in which an attachment may differ, in the free-running mode, from what the software GPU draws from its own earlier results.
/// Passes pass on what the passes before them add, and some multiply it: light gathers where rays meet, and last places with it.
pub const DRIFT: f64 = 1.0e-2;

/// The bound of one attachment of one pass. Attachments without a row in `passes` have the bound of shaded colours.
#[must_use]
pub fn bound_of(passes: &[PassBounds], family: Family, mode: Mode, pass: &str, texture: &str, info: FormatInfo) -> Bound {
    if info.depth || info.stencil || info.kind.is_integer() {
        return match (family, mode) {
            (Family::Other, _) => HARDWARE,
            (_, Mode::Resynchronised) => EXACT,
            (_, Mode::FreeRunning) => OWN_VERTICES,
        };
    }
    let rows = row_of(passes, pass).map_or(&[][..], |row| row.textures);
    // A texture of one of several lights has the light's number behind its name; one of several textures of a buffer has its name at the end.
    let is = |name: &str| {
        let [before, behind] = [texture.strip_suffix(name), texture.strip_prefix(name)];
        before.is_some_and(|rest| rest.is_empty() || rest.ends_with(' ')) || behind.is_some_and(|rest| rest.starts_with(' '))
    };
    let row = rows.iter().find(|(name, ..)| name.is_empty() || is(name));
    let (resynchronised, free) = row.map_or((SHADED, SHADED), |(_, resynchronised, free)| (*resynchronised, *free));
    let bound = match mode {
        Mode::Resynchronised => resynchronised,
        Mode::FreeRunning => free,
    };
    if bound != INTERPOLATED {
        return bound;
    }
    let bound = match family {
        Family::Lavapipe => INTERPOLATED_FROM_ORIGIN,
        Family::SwiftShader => INTERPOLATED_FROM_CORNER,
        Family::Other => bound,
    };
    // Where an edge moves, a pixel shows another surface.
    if mode == Mode::FreeRunning { Bound { worst: ANOTHER_SURFACE, ..bound } } else { bound }
}

/// The bound of a pass's vertices.
#[must_use]
pub fn vertex_bound_of(passes: &[PassBounds], pass: &str) -> Bound {
    row_of(passes, pass).map_or(VERTEX, |row| row.vertices)
}

/// The row of `passes` for a pass.
fn row_of<'b>(passes: &'b [PassBounds], pass: &str) -> Option<&'b PassBounds> {
    passes.iter().find(|row| pass.starts_with(row.pass))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_image::metrics::bounds::{ACCUMULATED, COUNTED, OWN_BEAMS, SWEPT};
    use nephroid_pipeline::format_info;
    use nephroid_pipeline::state::TextureFormat;

    const PASSES: &[PassBounds] = &[
        PassBounds { pass: "sums", vertices: SWEPT, textures: &[("count", COUNTED, OWN_BEAMS), ("", ACCUMULATED, OWN_BEAMS)] },
        PassBounds { pass: "seen", vertices: VERTEX, textures: &[("", INTERPOLATED, INTERPOLATED)] },
    ];

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
                assert_eq!(bound_of(PASSES, family, Mode::Resynchronised, "seen", "depth", info), EXACT);
            }
            assert_ne!(bound_of(PASSES, Family::Other, Mode::Resynchronised, "seen", "depth", info), EXACT);
        }
    }

    #[test]
    fn rows_are_found_by_the_start_of_the_label_and_the_texture() {
        let info = format_info(TextureFormat::Rgba32Float).unwrap();
        let of = |pass, texture, mode| bound_of(PASSES, Family::SwiftShader, mode, pass, texture, info);
        assert_eq!(of("sums 0", "count", Mode::Resynchronised), COUNTED);
        assert_eq!(of("sums 0", "buffer front 0 count", Mode::Resynchronised), COUNTED);
        assert_eq!(of("sums 0", "discount", Mode::Resynchronised), ACCUMULATED);
        assert_eq!(of("sums 1", "count 1", Mode::Resynchronised), COUNTED);
        assert_eq!(of("sums 1", "counter", Mode::Resynchronised), ACCUMULATED);
        assert_eq!(of("sums 1", "light", Mode::Resynchronised), ACCUMULATED);
        assert_eq!(of("sums 1", "light", Mode::FreeRunning), OWN_BEAMS);
        assert_eq!(of("other", "light", Mode::Resynchronised), SHADED);
        let seen = |mode| bound_of(PASSES, Family::Lavapipe, mode, "seen", "", info);
        assert_eq!(seen(Mode::Resynchronised), INTERPOLATED_FROM_ORIGIN);
        assert_eq!(seen(Mode::FreeRunning), Bound { worst: ANOTHER_SURFACE, ..INTERPOLATED_FROM_ORIGIN });
        assert_eq!(of("seen", "", Mode::Resynchronised), INTERPOLATED_FROM_CORNER);
        assert_eq!((vertex_bound_of(PASSES, "sums 7"), vertex_bound_of(PASSES, "other")), (SWEPT, VERTEX));
    }
}
