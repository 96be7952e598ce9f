//! Random numbers as a function of (seed, stream, index): no state, no order, so threads and replays cannot change them.
//!
//! The generator is the three-word hash `pcg3d` of M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020, which is
//! Pareto-optimal in quality and speed in that study. It needs only 32-bit wrapping products, which WGSL has; Philox was rejected because WGSL lacks
//! 64-bit products. The upper bits have the best quality; [`unit_from_bits`] uses those.
//!
//! Convention: `seed` belongs to the run, `stream` to the purpose (photons, spray, spectrum...), `index` to the item.

/// Three hashed words of (seed, stream, index), each uniform over all of `u32`; neighbouring arguments give unrelated words.
#[inline]
#[must_use]
pub const fn rng3(seed: u32, stream: u32, index: u32) -> [u32; 3] {
    const MULTIPLIER: u32 = 1_664_525;
    const INCREMENT: u32 = 1_013_904_223;
    let mut x = index.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
    let mut y = stream.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
    let mut z = seed.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
    x = x.wrapping_add(y.wrapping_mul(z));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    x = x.wrapping_add(y.wrapping_mul(z));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    [x, y, z]
}

/// The first word of [`rng3`].
#[inline]
#[must_use]
pub const fn rng(seed: u32, stream: u32, index: u32) -> u32 {
    rng3(seed, stream, index)[0]
}

/// A word as a number in `[0, 1)`: its upper 24 bits, so that every result is exact and 1 is never reached.
#[inline]
#[must_use]
pub const fn unit_from_bits(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A number uniform in `[0, 1)`.
#[inline]
#[must_use]
pub const fn uniform(seed: u32, stream: u32, index: u32) -> f32 {
    unit_from_bits(rng(seed, stream, index))
}

/// Three independent numbers uniform in `[0, 1)`.
#[inline]
#[must_use]
pub fn uniform3(seed: u32, stream: u32, index: u32) -> [f32; 3] {
    rng3(seed, stream, index).map(unit_from_bits)
}

/// Two independent numbers of the standard normal distribution (mean 0, variance 1), by the method of Box & Muller (1958).
///
/// `√(−2 ln u)·(cos 2πv, sin 2πv)`, evaluated in 64 bits with `libm`. `u` is taken at the middle of its 2⁻³² cell, so it is never zero and the
/// magnitude never exceeds 6.8.
#[must_use]
pub fn normal_pair(seed: u32, stream: u32, index: u32) -> [f32; 2] {
    let [a, b, _] = rng3(seed, stream, index);
    let u = (f64::from(a) + 0.5) / 4_294_967_296.0;
    let v = f64::from(b) / 4_294_967_296.0;
    let radius = (-2.0 * libm::log(u)).sqrt();
    let (sine, cosine) = libm::sincos(std::f64::consts::TAU * v);
    [(radius * cosine) as f32, (radius * sine) as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE_COUNT: u32 = 200_000;

    #[test]
    fn rng_is_pinned() {
        // Computed with 64-bit integers and explicit remainders, independently of the code above.
        assert_eq!(rng3(0, 0, 0), PINNED_ZERO);
        assert_eq!(rng3(7, 3, 123_456_789), PINNED_OTHER);
    }

    const PINNED_ZERO: [u32; 3] = [2_611_992_518, 2_833_812_075, 1_058_359_340];
    const PINNED_OTHER: [u32; 3] = [3_378_847_699, 1_272_169_346, 2_894_884_687];

    #[test]
    fn rng_bits_are_balanced_and_avalanche() {
        // Flipping one input bit flips each output bit with probability 1/2: over n trials the count is n/2 ± 5·√n/2.
        let trials = 4_000_u32;
        let bound = 5.0 * 0.5 * f64::from(trials).sqrt();
        for flipped in (0..96_u32).filter(|bit| bit % 32 < 24) {
            let mut counts = [0_u32; 96];
            for i in 0..trials {
                let input = [i.wrapping_mul(2_654_435_761), i ^ 0x5bd1_e995, i];
                let mut other = input;
                other[flipped as usize / 32] ^= 1 << (flipped % 32);
                let (a, b) = (rng3(input[0], input[1], input[2]), rng3(other[0], other[1], other[2]));
                for bit in 0..96 {
                    counts[bit] += (a[bit / 32] ^ b[bit / 32]) >> (bit % 32) & 1;
                }
            }
            // A product carries upwards only: the low output bits, and the few highest input bits, are weak in any hash of this kind.
            for bit in (0..96).filter(|bit| bit % 32 >= 24) {
                let off = (f64::from(counts[bit]) - f64::from(trials) / 2.0).abs();
                assert!(off < bound, "input bit {flipped}, output bit {bit}: {} flips in {trials}", counts[bit]);
            }
        }
    }

    #[test]
    fn uniform_fills_the_unit_interval_evenly() {
        // χ² over 256 cells: mean 255, standard deviation √510 ≈ 22.6.
        for stream in [0, 1, 77] {
            let mut cells = [0_u32; 256];
            for i in 0..SAMPLE_COUNT {
                let x = uniform(1, stream, i);
                assert!((0.0..1.0).contains(&x));
                cells[(x * 256.0) as usize] += 1;
            }
            let expected = f64::from(SAMPLE_COUNT) / 256.0;
            let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected) * (f64::from(c) - expected) / expected).sum();
            assert!((160.0..370.0).contains(&chi2), "stream {stream}: χ² = {chi2}");
        }
        assert!(unit_from_bits(u32::MAX) < 1.0);
    }

    #[test]
    fn streams_seeds_and_neighbours_are_uncorrelated() {
        let correlation = |f: &dyn Fn(u32) -> (f32, f32)| {
            let sum: f64 = (0..SAMPLE_COUNT).map(f).map(|(a, b)| (f64::from(a) - 0.5) * (f64::from(b) - 0.5)).sum();
            12.0 * sum / f64::from(SAMPLE_COUNT)
        };
        let bound = 5.0 / f64::from(SAMPLE_COUNT).sqrt();
        assert!(correlation(&|i| (uniform(1, 0, i), uniform(1, 0, i + 1))).abs() < bound);
        assert!(correlation(&|i| (uniform(1, 0, i), uniform(1, 1, i))).abs() < bound);
        assert!(correlation(&|i| (uniform(1, 0, i), uniform(2, 0, i))).abs() < bound);
        assert!(correlation(&|i| (uniform3(1, 0, i)[0], uniform3(1, 0, i)[1])).abs() < bound);
        assert!(correlation(&|i| (uniform3(1, 0, i)[1], uniform3(1, 0, i)[2])).abs() < bound);
    }

    #[test]
    fn normal_pair_has_the_moments_of_a_normal_distribution() {
        let mut sums = [0.0_f64; 4];
        let mut product = 0.0;
        for i in 0..SAMPLE_COUNT {
            let [x, y] = normal_pair(5, 9, i).map(f64::from);
            product += x * y;
            for v in [x, y] {
                sums[0] += v;
                sums[1] += v * v;
                sums[2] += v * v * v;
                sums[3] += v * v * v * v;
            }
        }
        // Bounds: five standard errors of each moment, √(1, 2, 15, 96 over the number of samples).
        let count = 2.0 * f64::from(SAMPLE_COUNT);
        for (sum, (mean, variance)) in sums.iter().zip([(0.0, 1.0), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0_f64)]) {
            let error = (sum / count - mean).abs();
            assert!(error < 5.0 * (variance / count).sqrt(), "moment {mean}: off by {error}");
        }
        assert!((product / f64::from(SAMPLE_COUNT)).abs() < 5.0 / f64::from(SAMPLE_COUNT).sqrt());
    }
}
