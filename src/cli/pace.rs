//! Time limits of work that comes in batches.

use std::time::Duration;

/// How far a limit may be exceeded by what cannot be cut, such as the last part of a batch.
const SLACK: f64 = 1.04;

/// Batches without which the noise is not known.
const LEAST_BATCHES: u64 = 2;

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Another batch.
    Batch,
    /// Nothing: there is no time for another.
    Enough,
    /// Nothing, and there are too few batches.
    TooShort,
}

/// Decides when to stop. Times are measured from the start of the program, by whatever clock the caller has.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    limit: Option<f64>,
}

impl Pace {
    /// Keeps `limit_s`, of which `reserve_s` are for what follows the batches: at most half.
    pub fn new(limit_s: Option<f64>, reserve_s: f64) -> Self {
        Self { limit: limit_s.map(|limit| limit - reserve_s.min(0.5 * limit)) }
    }

    /// What to do at a time, after `batches`, if the last one took `last`: no batch is begun that would not be finished.
    pub fn next(&self, elapsed: Duration, batches: u64, last: Duration) -> Next {
        let Some(limit) = self.limit else { return Next::Batch };
        let elapsed = elapsed.as_secs_f64();
        if batches < LEAST_BATCHES {
            return if elapsed < limit { Next::Batch } else { Next::TooShort };
        }
        if elapsed + last.as_secs_f64() <= SLACK * limit { Next::Batch } else { Next::Enough }
    }

    /// Whether a batch that is under way must be given up.
    pub fn is_over(&self, elapsed: Duration) -> bool {
        self.limit.is_some_and(|limit| elapsed.as_secs_f64() > SLACK * limit)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// Runs batches by a clock of its own; each takes `batch_s`, in parts of `part_s` that cannot be cut. Returns the end and the number of batches.
    fn simulate(limit_s: f64, reserve_s: f64, batch_s: impl Fn(u64) -> f64, part_s: f64) -> (f64, u64, Next) {
        let pace = Pace::new(Some(limit_s), reserve_s);
        let clock = Cell::new(0.0);
        let now = || Duration::from_secs_f64(clock.get());
        let (mut batches, mut last) = (0, Duration::ZERO);
        loop {
            let next = pace.next(now(), batches, last);
            if next != Next::Batch {
                return (clock.get() + reserve_s, batches, next);
            }
            let (start, end) = (now(), clock.get() + batch_s(batches));
            while clock.get() < end && !pace.is_over(now()) {
                clock.set((clock.get() + part_s).min(end));
            }
            if clock.get() >= end {
                batches += 1;
                last = now() - start;
            }
        }
    }

    #[test]
    fn limits_are_kept_within_a_tenth_whatever_a_batch_takes() {
        for limit in [1.0, 3.0, 60.0, 3600.0] {
            for batch in [0.001, 0.01, 0.1, 0.24, 0.33, 0.44] {
                let (end, batches, next) = simulate(limit, 0.1 * limit, |_| batch * limit, 0.03 * limit);
                assert_eq!(next, Next::Enough, "limit {limit}, batches of {batch} of it");
                assert!(end <= 1.1 * limit && batches >= 2, "limit {limit}, batches of {batch} of it: {end} s, {batches} batches");
                // No more is left than a batch would take.
                assert!(end + batch * limit >= 0.9 * limit, "limit {limit}, batches of {batch} of it: {end} s");
            }
            // Two batches that do not fit are told, in time; so is one.
            for batch in [0.6, 2.0, 1000.0] {
                let (end, batches, next) = simulate(limit, 0.0, |_| batch * limit, 0.03 * limit);
                assert!(end <= 1.1 * limit && next == Next::TooShort && batches < 2, "{end} s, {batches} batches, {next:?}");
            }
            // A batch that takes far longer than those before it is given up.
            let (end, batches, next) = simulate(limit, 0.0, |batch| if batch == 4 { 50.0 * limit } else { 0.1 * limit }, 0.03 * limit);
            assert!(end <= 1.1 * limit && (batches, next) == (4, Next::Enough), "{end} s, {batches} batches, {next:?}");
        }
    }

    #[test]
    fn without_a_limit_there_is_always_another() {
        let pace = Pace::new(None, 1.0);
        assert_eq!(pace.next(Duration::from_secs(1 << 30), 5, Duration::from_secs(9)), Next::Batch);
        assert!(!pace.is_over(Duration::MAX));
    }
}
