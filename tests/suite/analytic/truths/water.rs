//! Vertical light through steady sine waves.

use std::f64::consts::TAU;

use super::optics::{refraction_angle, transmittance};
use super::sheets::Sheets;

/// The surface `y = a cos kx` of water, lit from straight above.
#[derive(Clone, Copy)]
pub struct Sine {
    /// Amplitude a, m.
    pub amplitude: f64,
    /// Wave number k, rad/m.
    pub wave_number: f64,
    /// Refractive index of the water.
    pub ior: f64,
}

/// How far, per metre of depth, vertical light is turned aside by a surface of this steepness: `tan(β − θt)`, `tan β = s`, `sin θt = sin β / n`, by the
/// difference formulas of sine and cosine.
fn aside(steepness: f64, ior: f64) -> f64 {
    let cosine = 1.0 / (1.0 + steepness * steepness).sqrt();
    let sine = steepness * cosine;
    let sine_inside = sine / ior;
    let cosine_inside = (1.0 - sine_inside * sine_inside).sqrt();
    (sine * cosine_inside - cosine * sine_inside) / (cosine * cosine_inside + sine * sine_inside)
}

impl Sine {
    /// The wave of `scenes/analytic/sine_water.ron`.
    pub const SHIPPED: Self = Self { amplitude: 0.02, wave_number: TAU, ior: 1.333 };

    /// `h = a cos kx`.
    pub fn height(&self, x: f64) -> f64 {
        self.amplitude * libm::cos(self.wave_number * x)
    }

    /// `h′ = −a k sin kx`.
    pub fn slope(&self, x: f64) -> f64 {
        -self.amplitude * self.wave_number * libm::sin(self.wave_number * x)
    }

    /// Depth below the crest of the first focus, `f = n/((n − 1) a k²)`.
    pub fn focus_depth(&self) -> f64 {
        self.ior / ((self.ior - 1.0) * self.amplitude * self.wave_number * self.wave_number)
    }

    /// Height of a level `depth` below the crest.
    pub fn level(&self, depth: f64) -> f64 {
        self.amplitude - depth
    }

    /// Where light that enters at `x` crosses the level y: `X = x + (h − y) tan(β − θt)`, `tan β = h′`, `sin θt = sin β / n`.
    ///
    /// The surface's normal leans by β against the slope, the refracted ray by θt to it, so that it leans by β − θt up the slope.
    pub fn landing(&self, x: f64, y: f64) -> f64 {
        x + (self.height(x) - y) * aside(self.slope(x), self.ior)
    }

    /// `dX/dx = 1 + h′ tan δ + (h − y) (1 − cos β / (n cos θt)) h″ / ((1 + h′²) cos² δ)`, with `δ = β − θt`.
    pub fn stretch(&self, x: f64, y: f64) -> f64 {
        let slope = self.slope(x);
        let lean = libm::atan(slope);
        let inside = refraction_angle(lean, self.ior).expect("light comes from the thinner side");
        let turn = lean - inside;
        let bend = -self.wave_number * self.wave_number * self.height(x);
        let turn_per_lean = 1.0 - libm::cos(lean) / (self.ior * libm::cos(inside));
        let cosine = libm::cos(turn);
        1.0 + slope * libm::tan(turn) + (self.height(x) - y) * turn_per_lean * bend / ((1.0 + slope * slope) * cosine * cosine)
    }

    /// Flux that enters per level area, `T(β)`: level area meets vertical light square on.
    pub fn entering(&self, x: f64) -> f64 {
        transmittance(libm::atan(self.slope(x)).abs(), self.ior)
    }

    fn sheets(&self, around: f64, y: f64) -> Sheets<impl Fn(f64) -> f64> {
        let wave = *self;
        let reach = 0.01 + (self.amplitude - y) * aside(self.amplitude * self.wave_number, self.ior);
        Sheets::new(around - reach, around + reach, 2000, move |x| wave.landing(x, y))
    }

    /// T4: irradiance of a level receiver at (x, y), `Σ T(x₀)/|dX/dx₀|` over all `x₀` with `X(x₀) = x`.
    pub fn irradiance(&self, x: f64, y: f64) -> f64 {
        self.sheets(x, y).preimages(x).into_iter().map(|from| self.entering(from) / self.stretch(from, y).abs()).sum()
    }

    /// Number of sheets of light that cross at (x, y).
    pub fn sheet_count(&self, x: f64, y: f64) -> usize {
        self.sheets(x, y).preimages(x).len()
    }

    /// Mean of [`Self::irradiance`] from `from` to `to` on the level y; finite at folds.
    pub fn mean(&self, from: f64, to: f64, y: f64) -> f64 {
        let wide = 0.5 * (to - from);
        let reach = wide + 0.01 + (self.amplitude - y) * aside(self.amplitude * self.wave_number, self.ior);
        let middle = 0.5 * (from + to);
        let sheets = Sheets::new(middle - reach, middle + reach, 4000, |x| self.landing(x, y));
        sheets.landed(from, to, |x| self.entering(x)) / (to - from)
    }

    /// Right end of the bright band about `x = 0` on a level behind the focus: where the two folds that meet in the cusp are.
    pub fn fold(&self, y: f64) -> Option<f64> {
        let quarter = 0.25 * TAU / self.wave_number;
        let sheets = Sheets::new(-quarter, quarter, 4000, |x| self.landing(x, y));
        sheets.turns().iter().map(|&x| self.landing(x, y)).max_by(f64::total_cmp)
    }

    /// The factor C of the law of the fold: inside the bright band, at the distance d from the fold, the two sheets that meet there bring
    /// `C d^(−1/2)`, `C = T √(2/|X″|)`.
    ///
    /// Near the fold `d = ½ |X″| (x₀ − x_f)²`, so that each of the two has `|dX/dx₀| = √(2 |X″| d)`.
    pub fn fold_strength(&self, y: f64) -> Option<f64> {
        let quarter = 0.25 * TAU / self.wave_number;
        let sheets = Sheets::new(-quarter, quarter, 4000, |x| self.landing(x, y));
        let at = *sheets.turns().iter().max_by(|&&a, &&b| self.landing(a, y).total_cmp(&self.landing(b, y)))?;
        let step = 1.0e-5;
        let second = (self.stretch(at + step, y) - self.stretch(at - step, y)) / (2.0 * step);
        Some(self.entering(at) * (2.0 / second.abs()).sqrt())
    }
}

/// The surface `y = a (cos kx + cos kz)` of water, lit from straight above; its crests are 2a above the level.
#[derive(Clone, Copy)]
pub struct Crossed {
    /// The two waves.
    pub wave: Sine,
}

impl Crossed {
    /// The waves of `scenes/analytic/crossed_sines.ron`.
    pub const SHIPPED: Self = Self { wave: Sine { amplitude: 0.04, wave_number: TAU, ior: 1.333 } };

    /// Height of a level `depth` below the crests.
    pub fn level(&self, depth: f64) -> f64 {
        2.0 * self.wave.amplitude - depth
    }

    fn gradient(&self, x: f64, z: f64) -> [f64; 2] {
        [self.wave.slope(x), self.wave.slope(z)]
    }

    /// Where light that enters at (x, z) crosses the level y: turned up the slope by `(h − y) tan(β − θt)`, `tan β = |∇h|`.
    pub fn landing(&self, x: f64, z: f64, y: f64) -> [f64; 2] {
        let g = self.gradient(x, z);
        let steepness = (g[0] * g[0] + g[1] * g[1]).sqrt();
        if steepness == 0.0 {
            return [x, z];
        }
        let reach = (self.wave.height(x) + self.wave.height(z) - y) * aside(steepness, self.wave.ior) / steepness;
        [x + reach * g[0], z + reach * g[1]]
    }

    /// Flux that enters per level area.
    pub fn entering(&self, x: f64, z: f64) -> f64 {
        let g = self.gradient(x, z);
        transmittance(libm::atan((g[0] * g[0] + g[1] * g[1]).sqrt()), self.wave.ior)
    }

    /// The four derivatives of [`Self::landing`], by central differences of fourth order.
    fn stretch(&self, x: f64, z: f64, y: f64) -> [[f64; 2]; 2] {
        let step = 1.0e-3 / self.wave.wave_number;
        let along = |dx: f64, dz: f64| -> [f64; 2] {
            let at = |k: f64| self.landing(x + k * dx * step, z + k * dz * step, y);
            let (a, b, c, d) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
            std::array::from_fn(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * step))
        };
        [along(1.0, 0.0), along(0.0, 1.0)]
    }

    /// Irradiance of a level receiver at (x, z) on a level before the first focus, where one ray reaches each point:
    /// `E = T(x₀, z₀) / |∂(X, Z)/∂(x₀, z₀)|`.
    pub fn irradiance(&self, x: f64, z: f64, y: f64) -> f64 {
        let (mut from_x, mut from_z) = (x, z);
        for _ in 0..200 {
            let at = self.landing(from_x, from_z, y);
            let (dx, dz) = (at[0] - x, at[1] - z);
            if dx.abs() + dz.abs() < 1.0e-13 {
                break;
            }
            let [[a, c], [b, d]] = self.stretch(from_x, from_z, y);
            let det = a * d - b * c;
            from_x -= (d * dx - b * dz) / det;
            from_z -= (a * dz - c * dx) / det;
        }
        let at = self.landing(from_x, from_z, y);
        assert!((at[0] - x).abs() + (at[1] - z).abs() < 1.0e-9, "no ray found to ({x}, {z})");
        let [[a, c], [b, d]] = self.stretch(from_x, from_z, y);
        self.entering(from_x, from_z) / (a * d - b * c).abs()
    }

    /// Irradiance under a crest before the first focus: `E = T(0) / (1 − d/f)²`. The ray there goes straight down, and both curvatures
    /// are those of one wave, so that each axis shrinks by `1 − d/f`.
    pub fn under_crest(&self, depth: f64) -> f64 {
        let shrink = 1.0 - depth / self.wave.focus_depth();
        transmittance(0.0, self.wave.ior) / (shrink * shrink)
    }

    /// Mean of [`Self::irradiance`] over a square texel around (x, z).
    pub fn mean(&self, x: f64, z: f64, side: f64, y: f64) -> f64 {
        let half = 0.5 * side;
        let row = |z: f64| super::integrate(x - half, x + half, 1, |x| self.irradiance(x, z, y));
        super::integrate(z - half, z + half, 1, row) / (side * side)
    }

    /// Mean over a whole period on any level, before or behind a focus: what enters through a period lands on a period, so it is the mean
    /// of T over the surface (T3).
    pub fn mean_of_period(&self) -> f64 {
        let half = 0.5 * TAU / self.wave.wave_number;
        let row = |z: f64| super::integrate(0.0, half, 8, |x| self.entering(x, z));
        super::integrate(0.0, half, 8, row) / (half * half)
    }
}
