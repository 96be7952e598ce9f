//! Sizes of tests, repeatable numbers, and hashes: nothing that depends on the code under test.

#![allow(dead_code, reason = "no test binary uses all of it")]

use std::ops::Range;
use std::sync::OnceLock;

/// Whether the variable `NEPHROID_FULL` asks for tests at full size, as `.ci/run full` does.
pub fn full() -> bool {
    static FULL: OnceLock<bool> = OnceLock::new();
    *FULL.get_or_init(|| std::env::var_os("NEPHROID_FULL").is_some())
}

/// A size of a test: `full` if [`full()`], else `short`, which is enough to tell right from wrong.
pub fn sized<T>(full_size: T, short: T) -> T {
    if full() { full_size } else { short }
}

/// splitmix64: a few lines, no dependence on the code under test.
#[derive(Clone, Debug)]
pub struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// Integer in `0..bound`.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }
    /// Integer in `low..high`.
    pub fn int(&mut self, range: Range<i64>) -> i64 {
        range.start + (self.next() % (range.end - range.start) as u64) as i64
    }
    /// Number in `low..high`.
    pub fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }
    pub fn f32(&mut self, low: f32, high: f32) -> f32 {
        self.real(f64::from(low), f64::from(high)) as f32
    }
    pub fn chance(&mut self, one_in: u64) -> bool {
        self.next().is_multiple_of(one_in)
    }
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.int(0..i as i64 + 1) as usize);
        }
    }
}

/// FNV-1a, 64 bits.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// A hash by words of eight bytes, little-endian, the last one filled up with zeros, for attachments: eight times as fast as [`fnv1a`].
/// Every step can be undone, so one changed word always changes it, and the upper half is folded onto the lower, lest two changed signs cancel.
pub fn hash_words(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    let words = words.iter().copied().chain((!rest.is_empty()).then_some(last));
    words.fold(bytes.len() as u64, |hash, word| {
        let mixed = (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ mixed >> 32
    })
}

#[test]
fn fnv1a_known_values() {
    assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
    assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
    assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
}

#[test]
fn hashes_see_one_changed_bit_anywhere() {
    let bytes: Vec<u8> = (0..1003_u32).map(|i| (i * 7) as u8).collect();
    for at in [0, 1, 500, 999, 1000, 1002] {
        let mut other = bytes.clone();
        other[at] ^= 0x80;
        assert_ne!(fnv1a(&bytes), fnv1a(&other), "byte {at}");
        assert_ne!(hash_words(&bytes), hash_words(&other), "byte {at}");
    }
}
