//! The exponent at which an error decreases.

/// A fitted power law `y = factor·x^exponent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Value at `x = 1`.
    pub factor: f64,
    /// Slope on logarithmic axes: −2 for an error that falls to a quarter when `x` doubles.
    pub exponent: f64,
}

impl PowerLaw {
    /// Least-squares line through `(ln x, ln y)`.
    ///
    /// Points with a coordinate that is not above 0 or not finite have no logarithm and are left out. `None` if fewer than two distinct x remain.
    #[must_use]
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let is_good = |value: f64| value > 0.0 && value.is_finite();
        let logs: Vec<(f64, f64)> =
            points.iter().filter(|(x, y)| is_good(*x) && is_good(*y)).map(|&(x, y)| (libm::log(x), libm::log(y))).collect();
        let count = logs.len() as f64;
        let (mut mean_x, mut mean_y) = (0.0, 0.0);
        for (x, y) in &logs {
            mean_x += x / count;
            mean_y += y / count;
        }
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y) in &logs {
            xx += (x - mean_x) * (x - mean_x);
            xy += (x - mean_x) * (y - mean_y);
        }
        let spread = logs.iter().any(|(x, _)| *x != logs[0].0);
        spread.then(|| {
            let exponent = xy / xx;
            Self { factor: libm::exp(mean_y - exponent * mean_x), exponent }
        })
    }

    /// The law at `x`, above 0.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.factor * libm::pow(x, self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_is_found_again() {
        let points: Vec<(f64, f64)> = [8.0, 16.0, 64.0, 100.0].iter().map(|&x| (x, 3.0 * libm::pow(x, -1.75))).collect();
        let law = PowerLaw::fit(&points).unwrap();
        assert!((law.exponent + 1.75).abs() < 1.0e-12 && (law.factor - 3.0).abs() < 1.0e-11);
        assert!((law.at(16.0) - points[1].1).abs() < 1.0e-13);
    }

    #[test]
    fn points_without_a_logarithm_are_left_out() {
        let law = PowerLaw::fit(&[(1.0, 2.0), (2.0, 4.0), (0.0, 9.0), (3.0, -1.0), (f64::NAN, 1.0), (4.0, f64::INFINITY)]).unwrap();
        assert!((law.exponent - 1.0).abs() < 1.0e-12);
        for too_few in [&[][..], &[(1.0, 2.0)], &[(1.0, 2.0), (1.0, 3.0)], &[(1.0, 2.0), (2.0, 0.0)]] {
            assert_eq!(PowerLaw::fit(too_few), None);
        }
    }
}
