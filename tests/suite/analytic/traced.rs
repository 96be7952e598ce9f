//! Measurements by the tracer of the crate, made until they are precise enough.

use glam::Vec3;
use nephroid::scene::{MeasuringPlane, Scene};
use nephroid::trace::{Measured, TraceOptions, Tracer};

use super::verdict::{Comparison, judge};
use crate::support::{self, sized};

/// Largest relative standard error at a place that is compared with a truth.
pub fn noise() -> f64 {
    sized(0.005, 0.01)
}

/// [`noise`] where one per cent would hide a wrong truth.
pub fn fine() -> f64 {
    sized(0.005, 0.0075)
}

/// Batches that are made at least; how well the error itself is known from so few is part of the bound.
fn least_batches() -> u64 {
    sized(16, 12)
}

/// Least relative error: light that is even has almost no noise, and sums in 32 bits are not that exact.
const ROUNDING: f64 = 1.0e-4;

/// Photons after which a test fails that is still too noisy.
const MOST_PHOTONS: u64 = 1 << 26;

/// A texel, or pixel, and its truth.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// Column of the texel.
    pub column: u32,
    /// Row of the texel.
    pub row: u32,
    /// Truth, by channel.
    pub truth: [f64; 3],
}

impl Probe {
    /// A probe where light is white.
    pub fn white(column: u32, row: u32, truth: f64) -> Self {
        Self { column, row, truth: [truth; 3] }
    }
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensor {
    /// Irradiance over the texels of the scene's plane.
    Plane,
    /// Irradiance at what the camera shows.
    Pixels,
    /// Radiance scattered towards the camera.
    Volume,
}

/// What a run has seen at its probes.
pub struct Seen {
    /// One for each probe, or, where channels differ, three.
    pub comparisons: Vec<Comparison>,
    /// Batches of the run.
    pub batches: u64,
}

impl Seen {
    /// Fails the test unless all probes agree with their truths, within a bound for the whole family of them.
    #[track_caller]
    pub fn agrees(&self) {
        if let Err(message) = judge(&self.comparisons, self.batches) {
            panic!("{message}");
        }
    }

    /// Fails the test if the probes agree with `wrong` truths, given place by place in the order of the probes.
    #[track_caller]
    pub fn refuses(&self, what: &str, wrong: impl Fn(usize, f64) -> f64) {
        let changed = self.comparisons.iter().enumerate();
        let changed: Vec<Comparison> = changed.map(|(i, c)| Comparison { truth: wrong(i, c.truth), ..c.clone() }).collect();
        assert!(judge(&changed, self.batches).is_err(), "the comparison does not notice {what}");
    }
}

/// A scene of `scenes/analytic`.
pub fn scene(name: &str) -> Scene {
    support::scene(&format!("analytic/{name}"))
}

/// Sets a key as on the command line.
#[track_caller]
pub fn set(scene: &mut Scene, key: &str, value: impl ToString) {
    scene.set(key, &value.to_string()).unwrap_or_else(|error| panic!("{error}"));
}

/// A level plane that measures what comes from above: columns from `x0` to `x1`, rows from `z1` down to `z0`.
pub fn level_plane(y: f64, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2], texels: (u32, u32)) -> MeasuringPlane {
    MeasuringPlane {
        corner: Vec3::new(x0 as f32, y as f32, z1 as f32),
        u: Vec3::new((x1 - x0) as f32, 0.0, 0.0),
        v: Vec3::new(0.0, 0.0, (z0 - z1) as f32),
        texels,
    }
}

/// Corners `[x0, x1]` and `[z0, z1]` of a texel of a [`level_plane`].
pub fn texel(plane: &MeasuringPlane, column: u32, row: u32) -> ([f64; 2], [f64; 2]) {
    let (columns, rows) = plane.texels;
    let x = |i: u32| f64::from(plane.corner.x) + f64::from(plane.u.x) * f64::from(i) / f64::from(columns);
    let z = |i: u32| f64::from(plane.corner.z) + f64::from(plane.v.z) * f64::from(i) / f64::from(rows);
    ([x(column), x(column + 1)], [z(row + 1), z(row)])
}

/// Traces until each probe is as precise as [`noise`] asks.
#[track_caller]
pub fn measure(scene: &Scene, sensor: Sensor, probes: &[Probe]) -> Seen {
    measure_to(noise(), scene, sensor, probes)
}

/// [`measure`] with a noise goal of its own.
#[track_caller]
pub fn measure_to(noise: f64, scene: &Scene, sensor: Sensor, probes: &[Probe]) -> Seen {
    assert!(!probes.is_empty() && probes.iter().all(|p| p.truth.iter().all(|&t| t > 0.0)), "nothing to measure");
    let options = TraceOptions { seed: 1, camera: sensor == Sensor::Pixels, volume: sensor == Sensor::Volume, ..TraceOptions::default() };
    let mut tracer = Tracer::new(scene, &options).unwrap_or_else(|error| panic!("{error}"));
    let mut more = least_batches() * tracer.batch_photons();
    loop {
        tracer.run(more);
        let measured = match sensor {
            Sensor::Plane => tracer.plane(),
            Sensor::Pixels => tracer.pixels(),
            Sensor::Volume => tracer.volume(),
        };
        let measured: Measured = measured.expect("asked for");
        let comparisons = compare(&measured, probes);
        assert!(comparisons.iter().any(|c| c.mean > 0.0), "no light arrives anywhere: {:?}", tracer.audit());
        // A texel that nothing has reached has no error yet, either.
        let noise_at = |c: &Comparison| if c.mean > 0.0 { c.standard_error / c.truth } else { f64::INFINITY };
        let noisiest = comparisons.iter().map(noise_at).fold(0.0, f64::max);
        if noisiest <= noise {
            return Seen { comparisons, batches: tracer.batches() };
        }
        // Noise falls as the root of the photons. The noise is an estimate itself: a tenth more, and never more than twice as many.
        more = (tracer.photons() as f64 * (1.1 * (noisiest / noise) * (noisiest / noise) - 1.0).min(1.0)) as u64;
        assert!(
            tracer.photons() < MOST_PHOTONS,
            "{} photons leave a standard error of {:.2} % at the darkest place, more than {:.2} %",
            tracer.photons(),
            100.0 * noisiest,
            100.0 * noise,
        );
    }
}

/// Channels of white light are seen by the same photons, so that one of them is compared.
fn compare(measured: &Measured, probes: &[Probe]) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for probe in probes {
        let (mean, error) = (measured.mean(probe.column, probe.row), measured.standard_error(probe.column, probe.row));
        let white = probe.truth[0] == probe.truth[1] && probe.truth[1] == probe.truth[2];
        for channel in 0..if white { 1 } else { 3 } {
            comparisons.push(Comparison {
                place: format!("column {}, row {}, channel {channel}", probe.column, probe.row),
                mean: mean[channel],
                standard_error: error[channel].max(ROUNDING * probe.truth[channel]),
                truth: probe.truth[channel],
            });
        }
    }
    comparisons
}

/// Probes for all texels of a level plane, from a truth for a texel's corners, as far as that is at least `least`.
pub fn probes(plane: &MeasuringPlane, least: f64, truth: impl Fn([f64; 2], [f64; 2]) -> f64) -> Vec<Probe> {
    let (columns, rows) = plane.texels;
    let all = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let probes = all.map(|(column, row)| {
        let (x, z) = texel(plane, column, row);
        Probe::white(column, row, truth(x, z))
    });
    probes.filter(|probe| probe.truth[0] >= least).collect()
}
