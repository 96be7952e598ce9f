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
    /// Pixels per million that may be beyond the tolerance for no cause that is tested.
    pub unexplained_ppm: f64,
    /// Largest relative error of such a pixel.
    pub worst: f64,
    /// Largest share of the light in which the pixels beyond the tolerance may differ.
    pub light: f64,
}

/// What a comparison found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels beyond the tolerance.
    pub outliers: u64,
    /// Outliers without a cause that is tested.
    pub unexplained: u64,
    /// Largest relative error of an unexplained pixel.
    pub worst: f64,
    /// Sum of the outliers' absolute differences over the sum of all magnitudes.
    pub light: f64,
}

impl Bound {
    /// A bound with its name, its tolerance, pixels per million beyond it (in all, and unexplained), the worst unexplained pixel, and the share of the light.
    #[must_use]
    pub const fn new(name: &'static str, tolerance: f64, [outliers_ppm, unexplained_ppm]: [f64; 2], worst: f64, light: f64) -> Self {
        Self { name, tolerance, outliers_ppm, unexplained_ppm, worst, light }
    }

    /// Whether what was found is within the bound.
    #[must_use]
    pub fn holds(&self, found: &Measured) -> bool {
        let per_million = found.pixels as f64 / 1.0e6;
        found.outliers as f64 <= self.outliers_ppm * per_million
            && found.unexplained as f64 <= self.unexplained_ppm * per_million
            && (found.unexplained == 0 || found.worst <= self.worst)
            && found.light <= self.light
    }
}

/// The bounds of one kind of pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassBounds {
    /// Start of the pass's label.
    pub pass: &'static str,
    /// Bound on the vertices, if the driver computes them.
    pub vertices: Bound,
    /// Bounds on the textures drawn to, by name without the number of a light (empty for all others): with equal vertices, and with vertices of the driver's
    /// own. What a pass starts from is equal in both cases.
    pub textures: &'static [(&'static str, Bound, Bound)],
}

/// A worst pixel of any size: it shows another surface. Where this is allowed, the share of the light bounds the sizes.
pub const ANOTHER_SURFACE: f64 = 2.0;

/// Coverage, depth, stencil, counts: identical bits.
pub const EXACT: Bound = Bound::new("exact", 0.0, [0.0, 0.0], 0.0, 0.0);

/// Vertices from the driver's own vertex stage: a few products and sums, in another order or fused.
pub const VERTEX: Bound = Bound::new("vertex", 2.0e-6, [10.0, 10.0], 1.0e-4, 0.0);

/// Vertices that are swept down a ray, and values that they read from a shadow map.
pub const SWEPT: Bound = Bound::new("swept-vertex", 5.0e-4, [300.0, 300.0], 1.0e-2, 0.0);

/// Attributes interpolated by f32 planes; patterns computed from them switch at slightly different places.
pub const INTERPOLATED: Bound = Bound::new("interpolated", 1.0e-4, [200.0, 20.0], 0.1, 1.0e-4);

/// Patterns of interpolated positions in pictures of few texels: where a pattern switches, the last place of a position decides.
pub const PATTERNED: Bound = Bound::new("patterned", 1.0e-4, [1000.0, 50.0], ANOTHER_SURFACE, 5.0e-4);

/// Colours shaded from equal inputs: elementary functions differ in their last places.
pub const SHADED: Bound = Bound::new("shaded", 1.0e-4, [100.0, 20.0], 1.0e-2, 1.0e-5);

/// Values read from a shadow map of thousands of texels: the position between two texels is accurate to about 1e-4 of a texel.
pub const LOOKED_UP: Bound = Bound::new("looked-up", 5.0e-4, [100.0, 20.0], 0.1, 1.0e-4);

/// Sums of blended contributions with equal inputs and equal coverage.
pub const ACCUMULATED: Bound = Bound::new("accumulated", 1.0e-5, [20.0, 5.0], 1.0e-2, 1.0e-5);

/// Counts of fragments that a shader's own comparisons accept: beams meet at edges, which rounding may move.
pub const COUNTED: Bound = Bound::new("counted", 0.0, [20.0, 20.0], ANOTHER_SURFACE, 1.0e-4);

/// Results of following refracted rays through the picture: at jumps in depth, the last place of a direction decides which surface is hit. Near grazing and total
/// reflection a direction has fewer exact places: that is what is left.
pub const SEARCHED: Bound = Bound::new("searched", 1.0e-4, [12000.0, 300.0], 0.5, 1.0e-4);

/// Light of beams whose vertices are the driver's own: their edges move.
pub const OWN_BEAMS: Bound = Bound::new("own-beams", 5.0e-4, [4000.0, 100.0], ANOTHER_SURFACE, 5.0e-3);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_fail_one_pixel_beyond() {
        let found = |outliers, unexplained| Measured { pixels: 1_000_000, outliers, unexplained, ..Measured::default() };
        assert!(EXACT.holds(&found(0, 0)));
        assert!(!EXACT.holds(&found(1, 0)));
        assert!(SHADED.holds(&found(100, 20)));
        assert!(!SHADED.holds(&found(101, 0)));
        assert!(!SHADED.holds(&found(21, 21)));
    }

    #[test]
    fn bounds_fail_where_sizes_are_beyond() {
        let found = Measured { pixels: 1_000_000, outliers: 50, unexplained: 1, worst: SHADED.worst, light: SHADED.light };
        assert!(SHADED.holds(&found));
        assert!(!SHADED.holds(&Measured { worst: SHADED.worst * 1.01, ..found }));
        // What is explained is bounded by the light alone.
        assert!(SHADED.holds(&Measured { worst: 0.0, unexplained: 0, ..found }));
        assert!(!SHADED.holds(&Measured { light: SHADED.light * 1.01, unexplained: 0, ..found }));
        assert!(!SEARCHED.holds(&Measured { light: f64::NAN, ..found }));
        assert!(!SEARCHED.holds(&Measured { worst: f64::INFINITY, ..found }));
    }
}
