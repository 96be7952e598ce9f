//! Numbers as text for readers.

/// A number with `digits` significant digits: plain from 0.001 to a million, otherwise with an exponent, as in `1.23e-5`.
///
/// Zero is `0`; infinities and NaN are `inf`, `-inf` and `nan`. `digits` is at least 1.
#[must_use]
pub fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() { "nan".to_owned() } else { if value > 0.0 { "inf" } else { "-inf" }.to_owned() };
    }
    // Rounding may carry into the next decade, so the exponent is taken from the rounded text.
    let scientific = format!("{value:.*e}", digits.max(1) - 1);
    let (_, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..6).contains(&exponent) {
        let decimals = (digits.max(1) as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        scientific
    }
}

/// A number with at most `digits` significant digits and without trailing zeros.
pub(super) fn short(value: f64, digits: usize) -> String {
    let text = number(value, digits);
    let (mantissa, exponent) = text.split_once('e').map_or((text.as_str(), String::new()), |(m, e)| (m, format!("e{e}")));
    let trimmed = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    format!("{trimmed}{exponent}")
}

/// Numbers whose relative difference is at most this are taken as equal: sums of channels are rounded.
pub(super) const ROUNDING: f64 = 1.0e-9;

/// A round number that is at least `value`, which is above 0: 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6 or 8 times a power of ten.
pub(super) fn round_up(value: f64) -> f64 {
    let scientific = format!("{value:e}");
    let exponent = scientific.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    let power = power_of_ten(exponent);
    let steps = [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.iter().map(|step| step * power).find(|round| *round >= value * (1.0 - ROUNDING)).unwrap_or(10.0 * power)
}

/// `10^exponent`, rounded as a literal would be.
pub(super) fn power_of_ten(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_asked_for() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1.00"),
            (0.99999, "1.00"),
            (-12.345, "-12.3"),
            (1234.5, "1234"),
            (0.001, "0.00100"),
            (0.00012345, "1.23e-4"),
            (9.994e5, "999400"),
            (9.999e5, "1.00e6"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
            (f64::NAN, "nan"),
        ] {
            assert_eq!(number(value, 3), text, "{value}");
        }
        assert_eq!([number(2.5, 1), number(31.0, 0)], ["2", "31"]);
    }

    #[test]
    fn short_numbers_end_in_no_zero() {
        for (value, text) in [(0.4, "0.4"), (1.25, "1.25"), (100.0, "100"), (2.0e-5, "2e-5"), (1.5e7, "1.5e7"), (0.0, "0")] {
            assert_eq!(short(value, 3), text);
        }
    }

    #[test]
    fn rounding_up_is_to_the_next_step() {
        for (value, round) in [(1.0, 1.0), (1.01, 1.2), (0.0231, 0.025), (8.1, 10.0), (720.0, 800.0), (1.3e-9, 1.5e-9)] {
            assert!((round_up(value) / round - 1.0).abs() < 1.0e-12, "{value}: {}", round_up(value));
        }
    }
}
