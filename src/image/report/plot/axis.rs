//! One axis: its range, its ticks, and the position of a value.

use crate::report::number::{number, power_of_ten};

/// Kind of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps are equal differences.
    Linear,
    /// Equal steps are equal ratios; values are above 0.
    Log,
}

/// A tick of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// The value.
    pub value: f64,
    /// The label, if any: a base and an exponent, which may be empty.
    pub label: Option<(String, String)>,
}

/// A range and its ticks.
pub(super) struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
    /// Ticks in ascending order.
    pub ticks: Vec<Tick>,
}

/// A logarithmic axis whose ends have at most this ratio has labels at 1, 2 and 5 of each decade; otherwise only at decades.
const FEW_DECADES: f64 = 2000.0;

impl Axis {
    /// An axis that contains all values with a margin. `values` must be valid for the scale and not empty.
    pub(super) fn new(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        match scale {
            Scale::Linear => Self::linear(low, high),
            Scale::Log => Self::log(low, high),
        }
    }

    /// A range from one tick to another.
    fn linear(low: f64, high: f64) -> Self {
        let span = if high > low { high - low } else { low.abs().max(1.0) };
        let step = [1.0, 2.0, 2.5, 5.0, 10.0].map(|part| part * power_of_ten(libm::floor(libm::log10(span / 5.0)) as i32));
        let step = step.into_iter().find(|step| span / step <= 6.0).unwrap_or(span);
        let (first, last) = ((low / step + 1.0e-9).floor(), (high / step - 1.0e-9).ceil().max((low / step + 1.0e-9).floor() + 1.0));
        let decimals = (2 - libm::floor(libm::log10(step)) as i32).max(1) as usize;
        let tick = |index: i32| {
            let value = (first + f64::from(index)) * step;
            Tick { value, label: Some((plain(value, step, decimals), String::new())) }
        };
        let ticks = (0..=(last - first) as i32).map(tick).collect();
        Self { scale: Scale::Linear, low: first * step, high: last * step, ticks }
    }

    /// A range that exceeds the values by a twentieth at either end.
    fn log(low: f64, high: f64) -> Self {
        let pad = libm::pow(high / low, 0.05).max(1.25);
        let (low, high) = (low / pad, high * pad);
        let decades = (libm::floor(libm::log10(low)) as i32)..=(libm::ceil(libm::log10(high)) as i32);
        let is_few = high / low <= FEW_DECADES;
        let every = ((libm::log10(high / low) / 8.0).ceil() as i32).max(1);
        let mut ticks = Vec::new();
        for decade in decades {
            for digit in 1..10 {
                let value = f64::from(digit) * power_of_ten(decade);
                let label = match digit {
                    1 if !is_few && decade.rem_euclid(every) == 0 => Some(("10".to_owned(), decade.to_string())),
                    1 | 2 | 5 if is_few => Some((number(value, 1), String::new())),
                    _ => None,
                };
                if (low..=high).contains(&value) {
                    ticks.push(Tick { value, label });
                }
            }
        }
        Self { scale: Scale::Log, low, high, ticks }
    }

    /// Position of a value: 0 at the low end, 1 at the high end.
    pub(super) fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => libm::log(value / self.low) / libm::log(self.high / self.low),
        }
    }
}

/// A multiple of a step, with as many decimals as the step needs and at most `decimals`.
fn plain(value: f64, step: f64, decimals: usize) -> String {
    if !(1.0e-4..1.0e6).contains(&step) {
        return number(value, 3);
    }
    let is_exact = |decimals: usize| {
        let rounded: f64 = format!("{step:.decimals$}").parse().unwrap_or(f64::NAN);
        (rounded - step).abs() < 1.0e-9 * step
    };
    let needed = (0..decimals).find(|&decimals| is_exact(decimals)).unwrap_or(decimals);
    let text = format!("{value:.needed$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { "0".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().filter_map(|tick| tick.label.clone()).map(|(base, exponent)| base + &exponent).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_hold_the_values() {
        let axis = Axis::new(Scale::Linear, [0.13, 0.97].into_iter());
        assert_eq!(labels(&axis), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        let axis = Axis::new(Scale::Linear, [-3.0, 17.0].into_iter());
        assert_eq!(labels(&axis), ["-5", "0", "5", "10", "15", "20"]);
        assert_eq!((axis.place(-5.0), axis.place(20.0)), (0.0, 1.0));
        let axis = Axis::new(Scale::Linear, [7.0].into_iter());
        assert!(axis.ticks.len() >= 2 && (0.0..=1.0).contains(&axis.place(7.0)), "{:?}", axis.ticks);
    }

    #[test]
    fn logarithmic_ticks_depend_on_the_range() {
        let axis = Axis::new(Scale::Log, [16.0, 512.0].into_iter());
        assert_eq!(labels(&axis), ["20", "50", "100", "200", "500"]);
        let axis = Axis::new(Scale::Log, [2.0e-6, 0.5].into_iter());
        assert_eq!(labels(&axis), ["10-5", "10-4", "10-3", "10-2", "10-1"]);
        let (low, high) = (axis.place(2.0e-6), axis.place(0.5));
        assert!(low > 0.0 && high < 1.0 && (low + high - 1.0).abs() < 1.0e-9);
        assert!((axis.place(1.0e-3) - axis.place(1.0e-4) - axis.place(1.0e-4) + axis.place(1.0e-5)).abs() < 1.0e-12);
    }
}
