//! Light that is folded along one axis: where it comes from, and how much of it lands where.

use super::{integrate, root};

/// A map of the line from where light enters to where it lands, as monotonic branches.
pub struct Sheets<M> {
    landing: M,
    /// Ends of the branches, ascending: the ends of the domain, and between them the points at which the map turns back.
    ends: Vec<f64>,
}

impl<M: Fn(f64) -> f64> Sheets<M> {
    /// The branches of `landing` over `low..high`. No two turning points may be closer than `(high − low)/samples`.
    pub fn new(low: f64, high: f64, samples: u32, landing: M) -> Self {
        let at = |i: u32| low + (high - low) * f64::from(i) / f64::from(samples);
        let mut ends = vec![low];
        for i in 1..samples {
            let (a, b, c) = (landing(at(i - 1)), landing(at(i)), landing(at(i + 1)));
            if (b > a) != (c > b) {
                ends.push(extremum(at(i - 1), at(i + 1), b > a, &landing));
            }
        }
        ends.push(high);
        Self { landing, ends }
    }

    /// The points at which the map turns back; light that enters there lands on a fold.
    pub fn turns(&self) -> &[f64] {
        &self.ends[1..self.ends.len() - 1]
    }

    /// All points whose light lands at `x`.
    pub fn preimages(&self, x: f64) -> Vec<f64> {
        let inside = |branch: &&[f64]| ((self.landing)(branch[0]) <= x) != ((self.landing)(branch[1]) <= x);
        self.ends.windows(2).filter(inside).map(|branch| root(branch[0], branch[1], |u| (self.landing)(u) - x)).collect()
    }

    /// The light that lands between `from` and `to`: `∫ flux(u) du` over all u with `from ≤ landing(u) ≤ to`.
    pub fn landed(&self, from: f64, to: f64, flux: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for branch in self.ends.windows(2) {
            let (start, end) = ((self.landing)(branch[0]), (self.landing)(branch[1]));
            let place = |x: f64| {
                if x <= start.min(end) {
                    if start < end { branch[0] } else { branch[1] }
                } else if x >= start.max(end) {
                    if start < end { branch[1] } else { branch[0] }
                } else {
                    root(branch[0], branch[1], |u| (self.landing)(u) - x)
                }
            };
            let (a, b) = (place(from), place(to));
            sum += integrate(a.min(b), a.max(b), 8, &flux);
        }
        sum
    }
}

/// The highest or lowest point of `f` between `low` and `high`, by golden section.
fn extremum(mut low: f64, mut high: f64, highest: bool, f: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..80 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if (f(a) > f(b)) == highest { high = b } else { low = a }
    }
    0.5 * (low + high)
}
