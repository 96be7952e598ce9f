//! Gradient noise: Perlin's improved noise in two and three dimensions, with exact gradients, and its fractal sum.
//!
//! `n(p) = Σ_corners w(p − c) · (g_c · (p − c))`, `w` = product over the axes of the quintic fade
//! [Perlin, "Improving Noise", SIGGRAPH 2002]. Two details differ from that text. The lattice gradient `g_c` comes from an integer hash of
//! `(corner, seed)` instead of a 256-entry permutation, so the noise does not repeat and every seed gives a new field. The plane has sixteen
//! directions of its own instead of a slice of the space field, which is flat in places.
//!
//! Noise is zero at every lattice point, has continuous second derivatives, mean 0, and features about one unit wide. Coordinates are pure numbers:
//! divide metres by the wanted feature size first. Every integer coordinate has its own gradient up to ±2²³; beyond, `f32` has no fraction and the
//! noise is constant. NaN and infinite coordinates give NaN.

use super::lanes::Lanes;
use super::vector::V3;

/// The sixteen unit directions of the plane lattice, `(cos kπ/8, sin kπ/8)`.
const DIRECTIONS_2D: [[f32; 2]; 16] = {
    const A: f32 = 0.923_879_5;
    const B: f32 = 0.382_683_43;
    const C: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [A, B],
        [C, C],
        [B, A],
        [0.0, 1.0],
        [-B, A],
        [-C, C],
        [-A, B],
        [-1.0, 0.0],
        [-A, -B],
        [-C, -C],
        [-B, -A],
        [0.0, -1.0],
        [B, -A],
        [C, -C],
        [A, -B],
    ]
};

/// Directions from the centre of a cube to its edges [Perlin 2002], four of them doubled to make the count a power of two.
const DIRECTIONS_3D: [[f32; 3]; 16] = [
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [-1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [-1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, -1.0, 1.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, -1.0],
    [1.0, 1.0, 0.0],
    [0.0, -1.0, 1.0],
    [-1.0, 1.0, 0.0],
    [0.0, -1.0, -1.0],
];

/// Noise with unit directions in the plane reaches ±1/√2 (at the centre of a cell); this factor brings it to ±1.
const SCALE_2D: f32 = std::f32::consts::SQRT_2;

/// Largest cell that lanes distinguish from its neighbours: conversions of greater numbers differ between machines.
const MOST_CELL: f32 = 1.0e9;

/// A bijective mix of 32 bits in which every input bit reaches every output bit (the finaliser of MurmurHash3).
#[inline]
fn mix(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Hash of one more lattice coordinate, combined with `h`. The odd constant separates runs of small integers.
#[inline]
fn fold(h: u32, coordinate: i32) -> u32 {
    mix(h.wrapping_add(coordinate as u32).wrapping_mul(0x9e37_79b1))
}

/// Lattice cell and position in it, `x = cell + fraction`, `fraction` in `0..1`.
#[inline]
fn split(x: f32) -> (i32, f32) {
    let cell = x.floor();
    (cell as i32, x - cell)
}

/// `6t⁵ − 15t⁴ + 10t³` and its derivative `30t²(t − 1)²` [Perlin 2002].
#[inline]
fn fade(t: f32) -> (f32, f32) {
    let value = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let slope = 30.0 * t * t * (t * (t - 2.0) + 1.0);
    (value, slope)
}

#[inline]
fn direction2(seed: u32, x: i32, y: i32) -> [f32; 2] {
    // The top bits of a multiplicative mix have the best quality.
    DIRECTIONS_2D[(fold(fold(mix(seed), x), y) >> 28) as usize]
}

#[inline]
fn direction3(seed: u32, x: i32, y: i32, z: i32) -> [f32; 3] {
    DIRECTIONS_3D[(fold(fold(fold(mix(seed), x), y), z) >> 28) as usize]
}

/// Improved Perlin noise in the plane, in −1..=1.
#[must_use]
pub fn perlin2(x: f32, y: f32, seed: u32) -> f32 {
    perlin2_gradient(x, y, seed).0
}

/// [`perlin2`] and its exact gradient `(∂n/∂x, ∂n/∂y)`.
///
/// With `u, v` the fades and `a, b, c, d` the four corner ramps `g · (p − corner)`:
/// `n = a + u(b − a) + v(c − a) + uv(a − b − c + d)`; the gradient is its derivative by the product rule.
#[must_use]
pub fn perlin2_gradient(x: f32, y: f32, seed: u32) -> (f32, [f32; 2]) {
    let (ix, fx) = split(x);
    let (iy, fy) = split(y);
    let (jx, jy) = (ix.wrapping_add(1), iy.wrapping_add(1));
    let g = [direction2(seed, ix, iy), direction2(seed, jx, iy), direction2(seed, ix, jy), direction2(seed, jx, jy)];
    let ramp = |g: [f32; 2], dx: f32, dy: f32| g[0] * dx + g[1] * dy;
    let (a, b) = (ramp(g[0], fx, fy), ramp(g[1], fx - 1.0, fy));
    let (c, d) = (ramp(g[2], fx, fy - 1.0), ramp(g[3], fx - 1.0, fy - 1.0));
    let (u, du) = fade(fx);
    let (v, dv) = fade(fy);

    let (k_u, k_v, k_uv) = (b - a, c - a, a - b - c + d);
    let value = a + u * k_u + v * k_v + u * v * k_uv;
    let blend = |i: usize| g[0][i] + u * (g[1][i] - g[0][i]) + v * (g[2][i] - g[0][i]) + u * v * (g[0][i] - g[1][i] - g[2][i] + g[3][i]);
    let gradient = [blend(0) + du * (k_u + v * k_uv), blend(1) + dv * (k_v + u * k_uv)];
    (value * SCALE_2D, gradient.map(|d| d * SCALE_2D))
}

/// Improved Perlin noise in space, in −1.04..=1.04.
#[must_use]
pub fn perlin3(x: f32, y: f32, z: f32, seed: u32) -> f32 {
    perlin3_gradient(x, y, z, seed).0
}

/// [`perlin3`] and its exact gradient.
///
/// The trilinear form of [`perlin2_gradient`], with eight corner ramps.
#[must_use]
pub fn perlin3_gradient(x: f32, y: f32, z: f32, seed: u32) -> (f32, [f32; 3]) {
    let (ix, fx) = split(x);
    let (iy, fy) = split(y);
    let (iz, fz) = split(z);
    // Components of the corners' directions, an array for each axis.
    let (mut gx, mut gy, mut gz, mut ramp) = ([0.0_f32; 8], [0.0_f32; 8], [0.0_f32; 8], [0.0_f32; 8]);
    for corner in 0..8 {
        let (cx, cy, cz) = (corner & 1, (corner >> 1) & 1, corner >> 2);
        let direction = direction3(seed, ix.wrapping_add(cx as i32), iy.wrapping_add(cy as i32), iz.wrapping_add(cz as i32));
        [gx[corner], gy[corner], gz[corner]] = direction;
        ramp[corner] = direction[0] * (fx - cx as f32) + direction[1] * (fy - cy as f32) + direction[2] * (fz - cz as f32);
    }
    let (u, du) = fade(fx);
    let (v, dv) = fade(fy);
    let (w, dw) = fade(fz);

    let k = trilinear_coefficients(ramp);
    let gradient = [
        trilinear(gx, u, v, w) + du * (k[1] + v * k[4] + w * k[6] + v * w * k[7]),
        trilinear(gy, u, v, w) + dv * (k[2] + u * k[4] + w * k[5] + w * u * k[7]),
        trilinear(gz, u, v, w) + dw * (k[3] + v * k[5] + u * k[6] + u * v * k[7]),
    ];
    (trilinear(ramp, u, v, w), gradient)
}

/// Lattice cells of many numbers and positions inside them, as from [`split`], as far as cells can be distinguished.
#[inline(always)]
fn split_lanes<L: Lanes>(x: L) -> ([u32; 16], [f32; 16]) {
    let cell = x.floor();
    (Lanes::clamp(cell, -MOST_CELL, MOST_CELL).to_i32().map(|cell| cell as u32), (x - cell).to_array())
}

/// [`fold`] of many hashes and coordinates, where `step` is added to each coordinate.
#[inline(always)]
fn fold_many<const N: usize>(hashes: &[u32; N], coordinates: &[u32; N], step: u32) -> [u32; N] {
    let mut folded = [0; N];
    for i in 0..N {
        folded[i] = fold(hashes[i], coordinates[i].wrapping_add(step) as i32);
    }
    folded
}

/// [`perlin3`] of many points without gradients, in short loops that the compiler vectorizes. The same bits.
#[inline(always)]
fn perlin3_lanes<L: Lanes, const N: usize>(p: V3<L>, seed: u32) -> L {
    let first = |(cells, fractions): ([u32; 16], [f32; 16])| -> ([u32; N], [f32; N]) {
        (std::array::from_fn(|i| cells[i]), std::array::from_fn(|i| fractions[i]))
    };
    let ((ix, fx), (iy, fy), (iz, fz)) = (first(split_lanes(p.x)), first(split_lanes(p.y)), first(split_lanes(p.z)));
    let start = [mix(seed); N];
    let mut c = [[0.0_f32; N]; 8];
    for cx in 0..2_u32 {
        let at_x = fold_many(&start, &ix, cx);
        for cy in 0..2_u32 {
            let at_y = fold_many(&at_x, &iy, cy);
            for cz in 0..2_u32 {
                let bits = fold_many(&at_y, &iz, cz);
                let ramps = &mut c[(cx + 2 * cy + 4 * cz) as usize];
                for i in 0..N {
                    ramps[i] = ramp3(bits[i] >> 28, fx[i] - cx as f32, fy[i] - cy as f32, fz[i] - cz as f32);
                }
            }
        }
    }
    let mut value = [0.0; N];
    for i in 0..N {
        value[i] = trilinear(std::array::from_fn(|k| c[k][i]), fade(fx[i]).0, fade(fy[i]).0, fade(fz[i]).0);
    }
    L::load(p.x.token(), &value)
}

/// The product of a vector with `DIRECTIONS_3D[bits]`, which sums two of its components. The components are chosen by masks: a table lookup would be
/// a load per lane, and an `if` a jump.
#[inline(always)]
fn ramp3(bits: u32, x: f32, y: f32, z: f32) -> f32 {
    let choose = |yes: bool, a: u32, b: u32| b ^ ((a ^ b) & u32::from(yes).wrapping_neg());
    let (x, y, z) = (x.to_bits(), y.to_bits(), z.to_bits());
    let first = choose(bits < 8, x, y);
    let second = choose(bits < 4, y, choose(bits & 13 == 12, x, z));
    f32::from_bits(first ^ (bits << 31)) + f32::from_bits(second ^ (bits >> 1 << 31))
}

/// Coefficients of the trilinear polynomial in (u, v, w) with these values at the corners of the unit cube.
#[inline(always)]
fn trilinear_coefficients(c: [f32; 8]) -> [f32; 8] {
    [
        c[0],
        c[1] - c[0],
        c[2] - c[0],
        c[4] - c[0],
        c[0] - c[1] - c[2] + c[3],
        c[0] - c[2] - c[4] + c[6],
        c[0] - c[1] - c[4] + c[5],
        c[1] + c[2] + c[4] + c[7] - c[0] - c[3] - c[5] - c[6],
    ]
}

#[inline(always)]
fn trilinear(c: [f32; 8], u: f32, v: f32, w: f32) -> f32 {
    let k = trilinear_coefficients(c);
    k[0] + u * k[1] + v * k[2] + w * k[3] + u * v * k[4] + v * w * k[5] + w * u * k[6] + u * v * w * k[7]
}

/// How the octaves of fractal noise are summed.
///
/// `f(p) = Σ_i gainⁱ · n_i(lacunarityⁱ · p) / Σ_i gainⁱ`. Each octave has a seed of its own, so the range is that of one octave, and no lattice point
/// is a zero of all octaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fbm {
    /// Number of octaves; 0 gives 0 everywhere, more than 32 is cut to 32. Default: 5.
    pub octaves: u32,
    /// Frequency ratio of neighbouring octaves. Default: 2.
    pub lacunarity: f32,
    /// Amplitude ratio of neighbouring octaves, ≥ 0. Default: 0.5.
    pub gain: f32,
}

impl Default for Fbm {
    fn default() -> Self {
        Self { octaves: 5, lacunarity: 2.0, gain: 0.5 }
    }
}

impl Fbm {
    /// Amplitude, frequency and seed of each octave, amplitudes summing to 1.
    fn terms(self, seed: u32) -> impl Iterator<Item = (f32, f32, u32)> {
        let octaves = self.octaves.min(32);
        let step = move |(amplitude, frequency): (f32, f32)| (amplitude * self.gain, frequency * self.lacunarity);
        let amplitude_sum = (0..octaves).fold((0.0, (1.0, 1.0)), |(sum, term), _| (sum + term.0, step(term))).0;
        let scale = if amplitude_sum > 0.0 { 1.0 / amplitude_sum } else { 0.0 };
        (0..octaves).scan((1.0, 1.0), move |term, octave| {
            let (amplitude, frequency) = *term;
            *term = step(*term);
            Some((amplitude * scale, frequency, fold(seed, octave as i32)))
        })
    }

    /// Bound on the steepness of the sum relative to one octave of noise: Σ amplitude · frequency.
    #[must_use]
    pub fn slope_factor(self) -> f64 {
        self.terms(0).fold(0.0, |sum, (amplitude, frequency, _)| sum + f64::from(amplitude) * f64::from(frequency))
    }

    /// Fractal noise in the plane, in −1..=1.
    #[must_use]
    pub fn at2(self, x: f32, y: f32, seed: u32) -> f32 {
        self.at2_gradient(x, y, seed).0
    }

    /// [`Self::at2`] and its exact gradient.
    #[must_use]
    pub fn at2_gradient(self, x: f32, y: f32, seed: u32) -> (f32, [f32; 2]) {
        self.terms(seed).fold((0.0, [0.0; 2]), |(value, gradient), (amplitude, frequency, seed)| {
            let (n, d) = perlin2_gradient(x * frequency, y * frequency, seed);
            let slope = amplitude * frequency;
            (value + amplitude * n, [gradient[0] + slope * d[0], gradient[1] + slope * d[1]])
        })
    }

    /// Fractal noise in space, in −1.04..=1.04.
    #[must_use]
    pub fn at3(self, x: f32, y: f32, z: f32, seed: u32) -> f32 {
        self.at3_gradient(x, y, z, seed).0
    }

    /// [`Self::at3`] of many points, with the same bits.
    #[inline(always)]
    #[must_use]
    pub fn at3_lanes<L: Lanes>(self, p: V3<L>, seed: u32) -> L {
        let mut sum = p.x.like(0.0);
        for (amplitude, frequency, seed) in self.terms(seed) {
            let at = p * p.x.like(frequency);
            let noise = if L::LEN == 1 { perlin3_lanes::<L, 1>(at, seed) } else { perlin3_lanes::<L, 16>(at, seed) };
            sum = sum + noise * amplitude;
        }
        sum
    }

    /// [`Self::at3`] and its exact gradient.
    #[must_use]
    pub fn at3_gradient(self, x: f32, y: f32, z: f32, seed: u32) -> (f32, [f32; 3]) {
        self.terms(seed).fold((0.0, [0.0; 3]), |(value, gradient), (amplitude, frequency, seed)| {
            let (n, d) = perlin3_gradient(x * frequency, y * frequency, z * frequency, seed);
            let slope = amplitude * frequency;
            (value + amplitude * n, std::array::from_fn(|i| gradient[i] + slope * d[i]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evenly spread points that are no lattice points: multiples of irrational steps.
    fn points(count: u32) -> impl Iterator<Item = (f32, f32, f32)> {
        (0..count).map(|i| {
            let i = i as f32;
            (i * 0.754_877_7 - 300.0, i * 0.569_840_3 - 200.0, i * 0.411_2 - 100.0)
        })
    }

    #[test]
    fn many_points_have_the_bits_of_one() {
        let fbm = Fbm::default();
        for (x, y, z) in points(20_000) {
            let lanes = fbm.at3_lanes(crate::vector::v3(x, y, z), 5);
            assert_eq!(lanes.to_bits(), fbm.at3(x, y, z, 5).to_bits(), "{x} {y} {z}");
        }
    }

    #[test]
    fn lattice_points_are_zero() {
        for i in -5..5 {
            for j in -5..5 {
                assert_eq!(perlin2(i as f32, j as f32, 7), 0.0);
                assert_eq!(perlin3(i as f32, j as f32, (i * j) as f32, 7), 0.0);
            }
        }
    }

    #[test]
    fn values_fill_their_range_and_stay_inside() {
        let (mut low, mut high, mut sum) = (0.0_f32, 0.0_f32, 0.0_f64);
        let (mut low3, mut high3) = (0.0_f32, 0.0_f32);
        for (x, y, z) in points(200_000) {
            let n = perlin2(x, y, 1);
            (low, high, sum) = (low.min(n), high.max(n), sum + f64::from(n));
            let n = perlin3(x, y, z, 1);
            (low3, high3) = (low3.min(n), high3.max(n));
        }
        assert!((-1.0..-0.8).contains(&low) && (0.8..=1.0).contains(&high), "{low} {high}");
        assert!((-1.04..-0.7).contains(&low3) && (0.7..=1.04).contains(&high3), "{low3} {high3}");
        assert!((sum / 200_000.0).abs() < 0.01, "mean {}", sum / 200_000.0);
    }

    #[test]
    fn gradient_is_the_derivative() {
        // Central differences in f32: the step balances h² against rounding, hence the bound.
        const H: f32 = 1.0 / 256.0;
        for (x, y, z) in points(2_000) {
            let (x, y, z) = (x * 0.05, y * 0.05, z * 0.05);
            let g = perlin2_gradient(x, y, 3).1;
            let dx = (perlin2(x + H, y, 3) - perlin2(x - H, y, 3)) / (2.0 * H);
            let dy = (perlin2(x, y + H, 3) - perlin2(x, y - H, 3)) / (2.0 * H);
            assert!((g[0] - dx).abs() < 2e-3 && (g[1] - dy).abs() < 2e-3, "({x}, {y}): {g:?} against {dx}, {dy}");

            let g = perlin3_gradient(x, y, z, 3).1;
            let dx = (perlin3(x + H, y, z, 3) - perlin3(x - H, y, z, 3)) / (2.0 * H);
            let dy = (perlin3(x, y + H, z, 3) - perlin3(x, y - H, z, 3)) / (2.0 * H);
            let dz = (perlin3(x, y, z + H, 3) - perlin3(x, y, z - H, 3)) / (2.0 * H);
            assert!(
                (g[0] - dx).abs() < 2e-3 && (g[1] - dy).abs() < 2e-3 && (g[2] - dz).abs() < 2e-3,
                "({x}, {y}, {z}): {g:?} against {dx}, {dy}, {dz}"
            );
        }
    }

    #[test]
    fn fractal_gradient_is_the_derivative() {
        const H: f32 = 1.0 / 512.0;
        let fbm = Fbm { octaves: 4, lacunarity: 1.9, gain: 0.55 };
        for (x, y, z) in points(500) {
            let (x, y, z) = (x * 0.02, y * 0.02, z * 0.02);
            let g = fbm.at2_gradient(x, y, 9).1;
            let dx = (fbm.at2(x + H, y, 9) - fbm.at2(x - H, y, 9)) / (2.0 * H);
            assert!((g[0] - dx).abs() < 5e-3, "({x}, {y}): {} against {dx}", g[0]);
            let g = fbm.at3_gradient(x, y, z, 9).1;
            let dz = (fbm.at3(x, y, z + H, 9) - fbm.at3(x, y, z - H, 9)) / (2.0 * H);
            assert!((g[2] - dz).abs() < 5e-3, "({x}, {y}, {z}): {} against {dz}", g[2]);
        }
    }

    #[test]
    fn seeds_are_unrelated_fields() {
        let (mut product, mut square) = (0.0_f64, 0.0_f64);
        for (x, y, _) in points(50_000) {
            let (a, b) = (f64::from(perlin2(x, y, 1)), f64::from(perlin2(x, y, 2)));
            product += a * b;
            square += a * a;
        }
        assert!((product / square).abs() < 0.03, "correlation {}", product / square);
    }

    #[test]
    fn neighbouring_lattice_gradients_are_unrelated() {
        let mut product = 0.0_f64;
        for i in 0..200 {
            for j in 0..200 {
                let (a, b) = (direction2(5, i, j), direction2(5, i + 1, j));
                product += f64::from(a[0] * b[0] + a[1] * b[1]);
            }
        }
        // Standard deviation of the mean of 40,000 products of variance 1/2 is 0.0035.
        assert!((product / 40_000.0).abs() < 0.014, "mean product {}", product / 40_000.0);
    }

    #[test]
    fn odd_coordinates_do_not_panic() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(perlin2(x, 0.3, 0).is_nan());
            assert!(perlin3(0.3, x, 0.3, 0).is_nan());
        }
        for x in [f32::MAX, f32::MIN, 1e10, -1e10, f32::MIN_POSITIVE] {
            assert!(perlin2(x, 0.3, 0).is_finite());
            assert!(perlin3(0.3, 0.3, x, 0).is_finite());
        }
        assert_eq!(Fbm { octaves: 0, ..Fbm::default() }.at2(0.3, 0.4, 0), 0.0);
    }

    /// The same bits on any machine: a few values as they were when the field was defined.
    #[test]
    fn field_is_pinned() {
        let bits = [perlin2(0.3, 7.7, 1), perlin2(-3.25, 100.5, 42), perlin3(0.3, 7.7, -2.2, 1), Fbm::default().at2(0.3, 0.4, 5)]
            .map(f32::to_bits);
        assert_eq!(bits, [3_183_467_898, 3_201_163_991, 1_049_864_170, 1_042_935_312]);
    }
}
