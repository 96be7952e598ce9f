//! Quantiles of a list.

/// The value below which the share `q` of a list lies, `q` in `0..=1`; sorts the list. `None` if it is empty or `q` is out of range.
///
/// The value is interpolated between entries: with `p = q·(n − 1)`, it lies at the fraction `p − ⌊p⌋` from the entry of rank `⌊p⌋` to the next. So
/// `q = 0` gives the least entry, 0.5 the median and 1 the greatest. NaN sorts above all numbers.
#[must_use]
pub fn quantile(values: &mut [f64], q: f64) -> Option<f64> {
    if values.is_empty() || !(0.0..=1.0).contains(&q) {
        return None;
    }
    values.sort_unstable_by(f64::total_cmp);
    let position = q * (values.len() - 1) as f64;
    let (rank, fraction) = (position as usize, position - position.floor());
    let low = values[rank];
    Some(if fraction > 0.0 { low + fraction * (values[rank + 1] - low) } else { low })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate_between_ranks() {
        let mut values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!([0.0, 0.5, 1.0, 0.25].map(|q| quantile(&mut values, q)), [Some(1.0), Some(2.5), Some(4.0), Some(1.75)]);
        assert_eq!(quantile(&mut [7.0], 0.995), Some(7.0));
    }

    #[test]
    fn nothing_has_no_quantile() {
        assert_eq!(quantile(&mut [], 0.5), None);
        assert_eq!([-0.1, 1.1, f64::NAN].map(|q| quantile(&mut [1.0], q)), [None; 3]);
        assert!(quantile(&mut [f64::NAN, 1.0], 1.0).unwrap().is_nan());
    }
}
