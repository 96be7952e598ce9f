//! Memory that a computation takes, known before anything large is made.

use std::fmt::Write as _;

/// What takes memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub what: &'static str,
    /// How much, at the time when most is taken.
    pub bytes: u64,
    /// What can be lowered; empty for what is always taken.
    pub lower: String,
}

/// All that takes memory.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Account {
    /// The parts.
    pub parts: Vec<Part>,
}

/// More memory than is allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this takes about {needed_mib} MiB, more than the limit of {limit_mib} MiB; the most of it: {largest}")]
pub struct OverLimit {
    /// What it takes, MiB.
    pub needed_mib: u64,
    /// What it may take, MiB.
    pub limit_mib: u64,
    /// The largest parts, and what to lower.
    pub largest: String,
}

impl Account {
    /// Adds a part.
    pub fn add(&mut self, what: &'static str, bytes: u64, lower: &str) {
        self.parts.push(Part { what, bytes, lower: lower.to_owned() });
    }

    /// All of it, bytes.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.parts.iter().fold(0, |sum, part| sum.saturating_add(part.bytes))
    }

    /// Refuses more than a limit.
    ///
    /// # Errors
    /// With the largest parts and what to lower.
    pub fn check(&self, limit_bytes: u64) -> Result<(), OverLimit> {
        if self.total() <= limit_bytes {
            return Ok(());
        }
        let mut parts: Vec<&Part> = self.parts.iter().filter(|part| !part.lower.is_empty()).collect();
        parts.sort_by_key(|part| std::cmp::Reverse(part.bytes));
        let mut largest = String::new();
        for part in parts.iter().take(2) {
            let _ = write!(
                largest,
                "{}{} {} MiB (lower {})",
                if largest.is_empty() { "" } else { ", " },
                part.what,
                part.bytes >> 20,
                part.lower
            );
        }
        Err(OverLimit { needed_mib: self.total().div_ceil(1 << 20), limit_mib: limit_bytes >> 20, largest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_over_the_limit_is_refused_with_its_largest_parts() {
        let mut account = Account::default();
        account.add("the program", 400 << 20, "");
        account.add("meshes", 10 << 20, "their detail");
        account.add("photons", 100 << 20, "their number");
        account.add("beams", 50 << 20, "the grid");
        assert_eq!((account.total(), account.check(560 << 20)), (560 << 20, Ok(())));
        let refused = account.check((560 << 20) - 1).expect_err("over the limit").to_string();
        assert!(refused.contains("about 560 MiB, more than the limit of 559 MiB"), "{refused}");
        assert!(refused.ends_with("photons 100 MiB (lower their number), beams 50 MiB (lower the grid)"), "{refused}");
        account.add("endless", u64::MAX, "");
        assert_eq!(account.total(), u64::MAX);
    }
}
