//! Bounds on the difference between two versions of an attachment. Every bound has a name that says what it allows for.

/// Bound on the difference between two versions of an attachment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Name in reports.
    pub name: &'static str,
    /// Largest relative error of a pixel that is within the tolerance; 0 for bit equality.
    pub tolerance: f64,
    /// Pixels per million that may be beyond the tolerance.
    pub outliers_ppm: f64,
    /// Pixels per million that may be beyond the tolerance and not at an edge.
    pub unexplained_ppm: f64,
}

impl Bound {
    /// A bound with its name, its tolerance, and pixels per million beyond it: in all, and not at edges.
    #[must_use]
    pub const fn new(name: &'static str, tolerance: f64, outliers_ppm: f64, unexplained_ppm: f64) -> Self {
        Self { name, tolerance, outliers_ppm, unexplained_ppm }
    }

    /// Whether this many of `pixels` pixels are within the bound.
    #[must_use]
    pub fn holds(&self, pixels: u64, outliers: u64, unexplained: u64) -> bool {
        let per_million = pixels as f64 / 1.0e6;
        outliers as f64 <= self.outliers_ppm * per_million && unexplained as f64 <= self.unexplained_ppm * per_million
    }
}

/// The bounds of one kind of pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassBounds {
    /// Start of the pass's label.
    pub pass: &'static str,
    /// Bound on the vertices, if the driver computes them.
    pub vertices: Bound,
    /// Bounds on the textures drawn to, by name without the number of a light (empty for all others): from equal inputs, and from the driver's own earlier results.
    pub textures: &'static [(&'static str, Bound, Bound)],
}

/// Coverage, depth, stencil, counts: identical bits.
pub const EXACT: Bound = Bound::new("exact", 0.0, 0.0, 0.0);

/// Vertices from the driver's own vertex stage: a few products and sums, in another order or fused.
pub const VERTEX: Bound = Bound::new("vertex", 2.0e-6, 10.0, 10.0);

/// Vertices that are swept down a ray, and values that they read from a shadow map drawn by the driver.
pub const SWEPT: Bound = Bound::new("swept-vertex", 5.0e-4, 300.0, 300.0);

/// Attributes interpolated by f32 planes; patterns computed from them switch at slightly different places.
pub const INTERPOLATED: Bound = Bound::new("interpolated", 1.0e-4, 200.0, 60.0);

/// Patterns of interpolated positions in pictures of few texels: where a pattern switches, the last place of a position decides.
pub const PATTERNED: Bound = Bound::new("patterned", 1.0e-4, 1000.0, 200.0);

/// Colours shaded from equal inputs: elementary functions differ in their last places.
pub const SHADED: Bound = Bound::new("shaded", 1.0e-4, 100.0, 20.0);

/// Values read from a shadow map of thousands of texels: the position between two texels is accurate to about 1e-4 of a texel.
pub const LOOKED_UP: Bound = Bound::new("looked-up", 5.0e-4, 100.0, 20.0);

/// Sums of blended contributions with equal inputs and equal coverage.
pub const ACCUMULATED: Bound = Bound::new("accumulated", 1.0e-5, 20.0, 5.0);

/// Counts of fragments that a shader's own comparisons accept: beams meet at edges, which rounding may move.
pub const COUNTED: Bound = Bound::new("counted", 0.0, 20.0, 20.0);

/// Results of following refracted rays through the picture: at jumps in depth, the last place of a direction decides which surface is hit.
pub const SEARCHED: Bound = Bound::new("searched", 1.0e-4, 12000.0, 800.0);

/// Colours shaded from the driver's own earlier results: shadow edges and seams move with the last places of positions.
pub const CHAINED: Bound = Bound::new("chained", 1.0e-4, 12000.0, 800.0);

/// As [`CHAINED`], for light that shadow maps let through; see [`LOOKED_UP`].
pub const CHAINED_LOOKED_UP: Bound = Bound::new("chained-looked-up", 5.0e-4, 12000.0, 800.0);

/// As [`SEARCHED`], from inputs that differ in their last places.
pub const CHAINED_SEARCHED: Bound = Bound::new("chained-searched", 1.0e-4, 20000.0, 1500.0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_fail_one_pixel_beyond() {
        assert!(EXACT.holds(1_000_000, 0, 0));
        assert!(!EXACT.holds(1_000_000, 1, 0));
        assert!(SHADED.holds(1_000_000, 100, 20));
        assert!(!SHADED.holds(1_000_000, 101, 0));
        assert!(!SHADED.holds(1_000_000, 21, 21));
    }
}
