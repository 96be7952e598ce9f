//! How far one version of an attachment may be from another. Every bound has a name, and the name says what it allows for.

/// What an attachment must keep to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Name in reports.
    pub name: &'static str,
    /// Relative error up to which a pixel is in order; 0 for bit equality.
    pub tolerance: f64,
    /// Pixels per million that may be beyond it.
    pub outliers_ppm: f64,
    /// Pixels per million of these that need not lie at an edge.
    pub unexplained_ppm: f64,
}

impl Bound {
    /// A bound by its name, tolerance, and pixels per million beyond it: all, and off edges.
    #[must_use]
    pub const fn new(name: &'static str, tolerance: f64, outliers_ppm: f64, unexplained_ppm: f64) -> Self {
        Self { name, tolerance, outliers_ppm, unexplained_ppm }
    }

    /// Whether so many pixels of `pixels` are within the bound.
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
    /// Of its vertices, where the driver computes them itself.
    pub vertices: Bound,
    /// Of the textures drawn to, by name, empty for all others: from equal inputs, and from what the driver itself drew before.
    pub textures: &'static [(&'static str, Bound, Bound)],
}

/// Coverage, depth, stencil, counts: the same bits.
pub const EXACT: Bound = Bound::new("exact", 0.0, 0.0, 0.0);

/// Vertices as the driver's own vertex stage makes them: a few products and sums, in another order or fused.
pub const VERTEX: Bound = Bound::new("vertex", 2.0e-6, 10.0, 10.0);

/// Vertices that are swept down a ray, and what they look up in a shadow map that the driver drew itself.
pub const SWEPT: Bound = Bound::new("swept-vertex", 5.0e-4, 300.0, 300.0);

/// Interpolated attributes, from f32 planes; patterns that follow from them switch at other last places.
pub const INTERPOLATED: Bound = Bound::new("interpolated", 1.0e-4, 200.0, 60.0);

/// Shaded from equal inputs: elementary functions differ in their last places.
pub const SHADED: Bound = Bound::new("shaded", 1.0e-4, 100.0, 20.0);

/// Looked up in a shadow map of thousands of texels: the place between two of them is known to some 1e-4 of a texel.
pub const LOOKED_UP: Bound = Bound::new("looked-up", 5.0e-4, 100.0, 20.0);

/// Sums of blended contributions with equal inputs and equal coverage.
pub const ACCUMULATED: Bound = Bound::new("accumulated", 1.0e-5, 20.0, 5.0);

/// Counts of fragments that a shader's own comparisons let through: beams meet in edges that rounding may move.
pub const COUNTED: Bound = Bound::new("counted", 0.0, 20.0, 20.0);

/// What follows refracted rays through the picture: where depth jumps, the last place of a direction decides what is hit.
pub const SEARCHED: Bound = Bound::new("searched", 1.0e-4, 12000.0, 800.0);

/// Shaded from what the driver itself drew before: shadow edges and seams move with the last places of positions.
pub const CHAINED: Bound = Bound::new("chained", 1.0e-4, 12000.0, 800.0);

/// The same of light that shadow maps let through, see [`LOOKED_UP`].
pub const CHAINED_LOOKED_UP: Bound = Bound::new("chained-looked-up", 5.0e-4, 12000.0, 800.0);

/// The searched picture of inputs that differ in their last places.
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
