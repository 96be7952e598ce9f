//! Random numbers of the tracer.
//!
//! Every random decision belongs to a sequence: that of one photon from its start to its end, or that of one view ray in one batch. A decision takes
//! the next number of its sequence and advances the sequence ([`Draws::uniform`]), so no two decisions share a number, whatever the order of
//! interactions on a path. This is the only file of the tracer that calls the generator.
//!
//! The sequence and the count of draws are the 96 bits of the generator's input, which it maps one to one to 96 bits of output.

use nephroid_math::rng::{rng3, unit_from_bits};

/// The owner of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Purpose {
    /// A photon of a batch, by number: interactions with surfaces and the transmittance of smoke.
    Photon = 0xf2e5_0000,
    /// A pixel, by index: the place in the pixel through which the view ray of a batch goes.
    View = 0x7ac4_0000,
    /// A pixel, by index: the points on its view ray at which directly scattered light is taken.
    Direct = 0x5b9e_0000,
}

/// Spreads the numbers of batches, so that the counts of draws never reach another batch.
const BATCH_STEP: u32 = 0x9e37_79b9;

/// Random numbers of a batch for the photons that start in one cell of the lights, out of 2³².
#[inline(always)]
pub(super) fn start_bits(seed: u32, batch: u32, cell: u32) -> [u32; 3] {
    const STREAM_START: u32 = 0x5eed_0000;
    rng3(seed, batch ^ STREAM_START, cell)
}

/// A sequence of random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Draws {
    key: [u32; 3],
    drawn: u32,
}

impl Draws {
    /// The sequence of an item in a batch.
    #[inline(always)]
    pub fn new(seed: u32, purpose: Purpose, batch: u32, item: u32) -> Self {
        Self { key: [seed ^ purpose as u32, batch.wrapping_mul(BATCH_STEP), item], drawn: 0 }
    }

    /// A separate sequence for work beside the path, such as a measurement, which then does not change the numbers of the path. It depends on the
    /// count of draws so far.
    pub fn aside(&self) -> Self {
        let [a, b, c] = self.key;
        Self { key: rng3(!a, b ^ self.drawn, c), drawn: 0 }
    }

    /// The next 32 bits.
    #[inline(always)]
    fn bits(&mut self) -> u32 {
        self.drawn += 1;
        let [a, b, c] = self.key;
        rng3(a, b ^ self.drawn, c)[0]
    }

    /// The next number, uniform in `[0, 1)`.
    #[inline(always)]
    pub fn uniform(&mut self) -> f32 {
        unit_from_bits(self.bits())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// χ² of how often a pair of numbers falls into each of 16x16 cells: 255 ± 22.6 if the two are uniform and independent.
    fn chi_square(pairs: impl Iterator<Item = [f32; 2]>) -> f64 {
        let (mut cells, mut count) = ([0_u32; 256], 0_u32);
        for [a, b] in pairs {
            cells[(a * 16.0) as usize * 16 + (b * 16.0) as usize] += 1;
            count += 1;
        }
        let expected = f64::from(count) / 256.0;
        cells.iter().map(|&c| (f64::from(c) - expected) * (f64::from(c) - expected) / expected).sum()
    }

    #[track_caller]
    fn independent(what: &str, pairs: impl Iterator<Item = [f32; 2]>) {
        let chi2 = chi_square(pairs);
        assert!((160.0..370.0).contains(&chi2), "{what}: χ² = {chi2}");
    }

    const ITEMS: u32 = 200_000;

    fn photon(number: u32) -> Draws {
        Draws::new(1, Purpose::Photon, 0, number)
    }

    fn nth(mut draws: Draws, n: u32) -> f32 {
        for _ in 0..n {
            draws.uniform();
        }
        draws.uniform()
    }

    #[test]
    fn successive_numbers_of_a_photon_are_independent() {
        for apart in [1, 2, 3, 7] {
            for first in [0, 1, 5] {
                let pairs = (0..ITEMS).map(|k| [nth(photon(k), first), nth(photon(k), first + apart)]);
                independent(&format!("numbers {first} and {}", first + apart), pairs);
            }
        }
        assert!(chi_square((0..ITEMS).map(|k| [nth(photon(k), 1); 2])) > 1e5, "the check does not notice one number for two");
    }

    #[test]
    fn sequences_of_neighbours_are_independent() {
        independent("photons", (0..ITEMS).map(|k| [nth(photon(k), 1), nth(photon(k + 1), 1)]));
        independent("batches", (0..ITEMS).map(|k| [nth(photon(k), 1), nth(Draws::new(1, Purpose::Photon, 1, k), 1)]));
        independent("seeds", (0..ITEMS).map(|k| [nth(photon(k), 1), nth(Draws::new(2, Purpose::Photon, 0, k), 1)]));
        independent("purposes", (0..ITEMS).map(|k| [nth(photon(k), 1), nth(Draws::new(1, Purpose::View, 0, k), 1)]));
        // A photon of one seed must not be another photon of the next.
        independent("seeds and photons", (0..ITEMS).map(|k| [nth(photon(k ^ 1), 1), nth(Draws::new(0, Purpose::Photon, 0, k), 1)]));
    }

    #[test]
    fn what_is_drawn_aside_is_independent_and_changes_nothing() {
        independent("aside", (0..ITEMS).map(|k| [nth(photon(k), 0), nth(photon(k).aside(), 0)]));
        let later = |k| {
            let mut draws = photon(k);
            draws.uniform();
            draws
        };
        independent("aside of later", (0..ITEMS).map(|k| [nth(photon(k).aside(), 0), nth(later(k).aside(), 0)]));
        let mut draws = photon(3);
        let before = draws;
        draws.aside().uniform();
        assert_eq!(draws, before);
        assert_ne!(draws.uniform(), draws.uniform());
    }

    #[test]
    fn different_names_have_different_keys() {
        let mut keys = BTreeSet::new();
        for seed in 0..3 {
            for purpose in [Purpose::Photon, Purpose::View, Purpose::Direct] {
                for batch in [0, 1, 2, 3, 4, 1 << 31, u32::MAX] {
                    for item in [0, 1, 2, 5, 1 << 24, (1 << 31) - 1] {
                        assert!(keys.insert(Draws::new(seed, purpose, batch, item).key), "{seed} {purpose:?} {batch} {item}");
                    }
                }
            }
        }
    }
}
