//! A wind sea: thousands of waves of random phase, summed by a Fourier transform (G. A. Mastin et al., "Fourier Synthesis of Ocean Scenes", 1987;
//! J. Tessendorf, "Simulating Ocean Water", 2001).
//!
//! On a periodic patch of side `L` with wave vectors `k = 2π(m, n)/L`, `h(x, t) = Σ_k ĥ(k, t)·e^{ik·x}` and `ĥ(k, t) = h₀(k)·e^{−iω(k)t} + h₀*(−k)·e^{iω(k)t}`, so that each `h₀(k)` is
//! a wave that travels along `+k` and the sum is real. `h₀` is complex normal with `⟨|h₀(k)|²⟩ = ½·Ψ(k)·(2π/L)²`: the variance of the surface is the integral of its
//! [`Spectrum`] over the wave numbers that the patch resolves. Slopes come from the transform of `ik·ĥ`, not from differences.
//!
//! Dispersion is `ω = √(g·k·tanh(k·d))`. There is no horizontal displacement ("choppiness"): it would move the vertices off the even grid that the techniques need.
//!
//! Between the points of the transform, height and slope are interpolated by cubic convolution (R. Keys, 1981), exact on the points. A surface grid coarser than the
//! transform skips waves it cannot show; it does not average them.

mod fft;
mod spectrum;
#[cfg(test)]
mod tests;

use glam::Vec2;
use serde::{Deserialize, Serialize};

pub use spectrum::Spectrum;

use self::fft::{Complex, Fft};
use super::error::{WaterError, require, within};
use super::height_field::{HeightField, Layout};
use super::waves::dispersion;
use nephroid_math::rng::normal_pair;
use spectrum::Sea;

/// Most points of the transform along one side.
const MAX_RESOLUTION: u32 = 2048;

/// A wind sea; see the [module](self) for the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OceanSettings {
    /// Side of the patch that repeats, in metres; one corner is the world origin. 0.1..=1e5. Default: 20
    pub patch_m: f32,
    /// Points of the transform along each side: a power of two, 4..=2048. Default: 256
    pub resolution: u32,
    /// How the energy is spread over the lengths of waves. Default: Phillips()
    pub spectrum: Spectrum,
    /// Wind speed 10 m above the water, in m/s. 0.1..=100. Default: 4
    pub wind_speed_m_per_s: f32,
    /// Direction the wind blows *to*, in degrees from +x towards +z. Any finite number. Default: 30
    pub wind_direction_deg: f32,
    /// Spreading exponent `s`: energy goes as `cos^{2s}(θ/2)` with the angle from the wind; 0 is all around, large is narrow. 0..=100. Default: 4
    pub spreading: f32,
    /// Depth in metres; `None` is deep water. Slows long waves, and limits the energy of JONSWAP (TMA). Above 0, at most 1e5. Default: None
    pub depth_m: Option<f32>,
    /// Waves much shorter than this, in metres, are suppressed, by `e^{−(k·shortest/2π)²}`. 0..=1e5. Default: 0
    pub shortest_wave_m: f32,
    /// Factor on all heights. 0..=1000. Default: 1
    pub scale: f32,
    /// Seconds after which the motion repeats: frequencies are rounded down to multiples of `2π/loop`; `None` never repeats. 0.1..=1e5. Default: None
    pub loop_s: Option<f32>,
    /// Which sea: every seed is another one. Raising the resolution keeps the waves and adds shorter ones. Default: 1
    pub seed: u32,
}

impl Default for OceanSettings {
    fn default() -> Self {
        Self {
            patch_m: 20.0,
            resolution: 256,
            spectrum: Spectrum::default(),
            wind_speed_m_per_s: 4.0,
            wind_direction_deg: 30.0,
            spreading: 4.0,
            depth_m: None,
            shortest_wave_m: 0.0,
            scale: 1.0,
            loop_s: None,
            seed: 1,
        }
    }
}

impl OceanSettings {
    pub(super) fn validate(&self) -> Result<(), WaterError> {
        require(within(self.patch_m, 0.1, 1e5), "model.patch_m", self.patch_m, "0.1 ..= 100000 m")?;
        let valid = self.resolution.is_power_of_two() && (4..=MAX_RESOLUTION).contains(&self.resolution);
        require(valid, "model.resolution", self.resolution, "a power of two, 4 ..= 2048")?;
        self.spectrum.validate()?;
        require(within(self.wind_speed_m_per_s, 0.1, 100.0), "model.wind_speed_m_per_s", self.wind_speed_m_per_s, "0.1 ..= 100 m/s")?;
        let direction = self.wind_direction_deg;
        require(direction.is_finite(), "model.wind_direction_deg", direction, "a finite number of degrees")?;
        require(within(self.spreading, 0.0, 100.0), "model.spreading", self.spreading, "0 ..= 100")?;
        let valid = self.depth_m.is_none_or(|depth| depth > 0.0 && depth <= 1e5);
        require(valid, "model.depth_m", self.depth_m, "None, or above 0 and at most 100000 m")?;
        require(within(self.shortest_wave_m, 0.0, 1e5), "model.shortest_wave_m", self.shortest_wave_m, "0 ..= 100000 m")?;
        require(within(self.scale, 0.0, 1e3), "model.scale", self.scale, "0 ..= 1000")?;
        let valid = self.loop_s.is_none_or(|period| within(period, 0.1, 1e5));
        require(valid, "model.loop_s", self.loop_s, "None, or 0.1 ..= 100000 s")
    }

    /// Variance of the height in m² that the surface has on average: the sum of the spectrum over the waves of the patch.
    #[must_use]
    pub fn expected_variance_m2(&self) -> f64 {
        Modes::new(self).map(|mode| mode.energy_m2).sum()
    }
}

/// One wave of the patch.
#[derive(Clone, Copy, Debug)]
struct Mode {
    /// Signed frequencies along x and z, `k = 2π(m, n)/L`.
    m: i32,
    n: i32,
    /// Wave vector in rad/m.
    k: [f64; 2],
    /// Variance `Ψ(k)·(2π/L)²` in m²; zero for the mean and for the highest frequency, which has no partner to make the sum real.
    energy_m2: f64,
}

/// All waves of a patch, in the order of the transform: row by row (n), frequencies 0, 1, ..., −2, −1.
struct Modes {
    sea: Sea,
    size: i32,
    next: i32,
}

impl Modes {
    fn new(settings: &OceanSettings) -> Self {
        // A size that is no power of two did not pass validation.
        let size = settings.resolution.clamp(4, MAX_RESOLUTION).next_power_of_two();
        Self { sea: Sea::new(settings), size: size as i32, next: 0 }
    }
}

impl Iterator for Modes {
    type Item = Mode;

    fn next(&mut self) -> Option<Mode> {
        let (size, i) = (self.size, self.next);
        if i == size * size {
            return None;
        }
        self.next += 1;
        let signed = |index: i32| if index < size / 2 { index } else { index - size };
        let (m, n) = (signed(i % size), signed(i / size));
        let k = [f64::from(m) * self.sea.k_step, f64::from(n) * self.sea.k_step];
        let skipped = (m == 0 && n == 0) || m == -size / 2 || n == -size / 2;
        let energy_m2 = if skipped { 0.0 } else { self.sea.density_m4(k) * self.sea.k_step * self.sea.k_step };
        Some(Mode { m, n, k, energy_m2 })
    }
}

/// A wind sea in motion: what stays the same over time, and room for a transform.
#[derive(Clone, Debug)]
pub struct FftOcean {
    size: usize,
    patch_m: f64,
    fft: Fft,
    waves: Vec<Wave>,
    /// Heights above the mean level in the real part after a transform, row by row.
    heights: Vec<Complex>,
    /// Slopes along x and z as real and imaginary part after a transform.
    slopes: Vec<Complex>,
}

#[derive(Clone, Copy, Debug)]
struct Wave {
    /// `h₀(k)` and `h₀*(−k)`, in metres.
    forth: Complex,
    back: Complex,
    k: [f64; 2],
    omega: f64,
}

impl FftOcean {
    /// Stream of the random numbers of wave phases.
    const STREAM: u32 = 0x6f63_6561;

    /// Draws the waves.
    #[must_use]
    pub fn new(settings: &OceanSettings) -> Self {
        let modes: Vec<Mode> = Modes::new(settings).collect();
        let size = settings.resolution.clamp(4, MAX_RESOLUTION).next_power_of_two() as usize;
        let depth_m = settings.depth_m.map(f64::from);
        let amplitude = |mode: &Mode| {
            // The random index names the wave, not its place in memory: it is the same at every resolution.
            let index = (mode.n as u32 & 0xffff) << 16 | (mode.m as u32 & 0xffff);
            let [re, im] = normal_pair(settings.seed, Self::STREAM, index).map(f64::from);
            // ⟨|h₀|²⟩ = ½ energy, shared by two parts of variance 1.
            let scale = f64::from(settings.scale) * (0.25 * mode.energy_m2).sqrt();
            Complex { re: re * scale, im: im * scale }
        };
        let opposite = |i: usize| (size - i / size) % size * size + (size - i % size) % size;
        let waves = modes.iter().enumerate().map(|(i, mode)| {
            let wave_number = (mode.k[0] * mode.k[0] + mode.k[1] * mode.k[1]).sqrt();
            let mut omega = dispersion(wave_number, depth_m);
            if let Some(period) = settings.loop_s {
                let base = std::f64::consts::TAU / f64::from(period);
                omega = (omega / base).floor() * base;
            }
            let forth = amplitude(mode);
            let back = amplitude(&modes[opposite(i)]);
            Wave { forth, back: Complex { re: back.re, im: -back.im }, k: mode.k, omega }
        });
        let waves: Vec<Wave> = waves.collect();
        let zeros = vec![Complex::default(); waves.len()];
        Self { size, patch_m: f64::from(settings.patch_m), fft: Fft::new(size), waves, heights: zeros.clone(), slopes: zeros }
    }

    /// Computes heights and slopes on the points of the transform.
    fn transform(&mut self, time_s: f64) {
        for (wave, (height, slope)) in self.waves.iter().zip(self.heights.iter_mut().zip(&mut self.slopes)) {
            let (s, c) = libm::sincos(wave.omega * time_s);
            let h = Complex {
                re: wave.forth.re * c + wave.forth.im * s + wave.back.re * c - wave.back.im * s,
                im: wave.forth.im * c - wave.forth.re * s + wave.back.im * c + wave.back.re * s,
            };
            *height = h;
            // Two real fields for one transform: the slopes' spectra are i·k_x·ĥ and i·k_z·ĥ, and (i·k_x + i·(i·k_z))·ĥ = (−k_z + i·k_x)·ĥ.
            *slope = Complex { re: -wave.k[1] * h.re - wave.k[0] * h.im, im: wave.k[0] * h.re - wave.k[1] * h.im };
        }
        self.fft.inverse_2d(&mut self.heights);
        self.fft.inverse_2d(&mut self.slopes);
    }

    /// The surface at a time on a grid of vertices.
    pub(super) fn sample(&mut self, layout: &Layout, level_m: f32, time_s: f64) -> HeightField {
        self.transform(time_s);
        let taps_x: Vec<Taps> = (0..layout.columns).map(|column| self.taps(layout.x_ws(column))).collect();
        let taps_z: Vec<Taps> = (0..layout.rows).map(|row| self.taps(layout.z_ws(row))).collect();
        layout.sample(|column, row| {
            let (x, z) = (&taps_x[column as usize], &taps_z[row as usize]);
            let (mut height, mut slope_x, mut slope_z) = (0.0, 0.0, 0.0);
            for (j, weight_z) in z.indices.iter().zip(z.weights) {
                for (i, weight_x) in x.indices.iter().zip(x.weights) {
                    let (point, weight) = (j * self.size + i, weight_z * weight_x);
                    height += weight * self.heights[point].re;
                    slope_x += weight * self.slopes[point].re;
                    slope_z += weight * self.slopes[point].im;
                }
            }
            ((f64::from(level_m) + height) as f32, Vec2::new(slope_x as f32, slope_z as f32))
        })
    }

    /// Cubic convolution at a world coordinate, on the periodic points.
    fn taps(&self, position_m: f32) -> Taps {
        let size = self.size as f64;
        let patches = f64::from(position_m) / self.patch_m;
        let u = (patches - patches.floor()) * size;
        let first = u.floor();
        let f = u - first;
        let (f2, f3) = (f * f, f * f * f);
        let at = |offset: usize| (first as usize + offset + self.size - 1) % self.size;
        Taps {
            indices: [at(0), at(1), at(2), at(3)],
            weights: [0.5 * (2.0 * f2 - f3 - f), 0.5 * (3.0 * f3 - 5.0 * f2 + 2.0), 0.5 * (4.0 * f2 - 3.0 * f3 + f), 0.5 * (f3 - f2)],
        }
    }
}

/// Four neighbouring points and their weights.
struct Taps {
    indices: [usize; 4],
    weights: [f64; 4],
}
