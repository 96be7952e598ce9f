//! When a measurement with an error agrees with a truth.

/// Chance that a whole family of true comparisons is refused.
pub const FAMILY_ERROR: f64 = 1.0e-4;

/// Relative difference that is put down to rounding in 32 bits and to triangles in place of curved surfaces.
pub const ROUNDING: f64 = 2.0e-4;

/// A value seen, its error, and what it should be.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Where it was seen.
    pub place: String,
    /// Mean that was measured.
    pub mean: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// What the closed form says.
    pub truth: f64,
}

/// How many standard errors one of `count` independent comparisons may be off, if the family of them is to be refused with the chance
/// [`FAMILY_ERROR`] (Šidák: each with `1 − (1 − α)^(1/count)`, in both directions) and errors come from `batches` independent batches.
///
/// For one comparison and many batches 3.9; for a hundred 4.9. The error of the error is Student's t, here by the expansion of Fisher
/// and Cornish in the inverse of the degrees of freedom.
pub fn bound(count: usize, batches: u64) -> f64 {
    let each = -libm::expm1(libm::log1p(-FAMILY_ERROR) / count.max(1) as f64);
    let (mut low, mut high) = (0.0, 30.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if libm::erfc(middle / std::f64::consts::SQRT_2) > each { low = middle } else { high = middle }
    }
    let (z, free) = (0.5 * (low + high), (batches.max(2) - 1) as f64);
    let z2 = z * z;
    z + z * (z2 + 1.0) / (4.0 * free)
        + z * ((5.0 * z2 + 16.0) * z2 + 3.0) / (96.0 * free * free)
        + z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / (384.0 * free * free * free)
}

/// Whether all comparisons are within the bound, [`ROUNDING`] aside; if not, the worst is told.
pub fn judge(comparisons: &[Comparison], batches: u64) -> Result<(), String> {
    let bound = bound(comparisons.len(), batches);
    let excess = |c: &Comparison| {
        let off = (c.mean - c.truth).abs() - ROUNDING * c.truth.abs();
        // What is no number is off by any measure; `max` would let it pass.
        if off.is_nan() || c.standard_error.is_nan() {
            f64::INFINITY
        } else if off <= 0.0 {
            0.0
        } else {
            off / c.standard_error
        }
    };
    let wrong: Vec<&Comparison> = comparisons.iter().filter(|c| excess(c) > bound).collect();
    let Some(worst) = wrong.iter().max_by(|a, b| excess(a).total_cmp(&excess(b))) else { return Ok(()) };
    Err(format!(
        "{} of {} are off by more than {bound:.2} standard errors; the worst, {}: {} ± {}, truth {} ({:.1} standard errors, {:+.3} %)",
        wrong.len(),
        comparisons.len(),
        worst.place,
        worst.mean,
        worst.standard_error,
        worst.truth,
        excess(worst),
        100.0 * (worst.mean / worst.truth - 1.0),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comparison(mean: f64, standard_error: f64) -> Comparison {
        Comparison { place: "here".into(), mean, standard_error, truth: 1.0 }
    }

    #[test]
    fn bound_grows_with_the_family_and_with_few_batches() {
        let many = u64::MAX;
        assert!((bound(1, many) - 3.8906).abs() < 1e-3, "{}", bound(1, many));
        assert!((bound(100, many) - 4.8916).abs() < 2e-3, "{}", bound(100, many));
        // Student's t with 31 degrees of freedom: 4.4814 for 1e-4 in both directions.
        assert!((bound(1, 32) - 4.48).abs() < 0.02, "{}", bound(1, 32));
    }

    #[test]
    fn judge_refuses_what_is_off_and_what_is_no_number() {
        let good: Vec<Comparison> = (0..100).map(|i| comparison(1.0 + 0.001 * (f64::from(i % 7) - 3.0), 0.001)).collect();
        assert_eq!(judge(&good, 100), Ok(()));
        for bad in [comparison(1.01, 0.001), comparison(0.99, 0.001), comparison(f64::NAN, 0.001), comparison(1.0, f64::NAN)] {
            let mut all = good.clone();
            all.push(bad);
            assert!(judge(&all, 100).unwrap_err().starts_with("1 of 101"), "{:?}", all[100]);
        }
        // Nothing but rounding, and no noise at all.
        assert_eq!(judge(&[comparison(1.0001, 1e-9)], 100), Ok(()));
        assert!(judge(&[comparison(1.0004, 1e-9)], 100).is_err());
        assert_eq!(judge(&[comparison(1.0, 0.0)], 100), Ok(()));
    }
}
