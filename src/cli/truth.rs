//! The ground truth at the points that a technique's picture shows.

use anyhow::Context as _;
use glam::Vec3;

use crate::image::LayerSet;
use crate::metrics::{MetricError, Pair};
use crate::report::{Judged, Verdict, judge};
use crate::scene::Scene;
use crate::trace::{Measured, Points, TraceOptions, Tracer};

/// Layers that are compared, and layers that locate their points.
pub const LAYERS: [&str; 5] = ["caustic_irradiance", "direct", "position", "normal", "depth"];

/// The ground truth at the points of one technique's picture.
pub struct Truth {
    /// The points.
    pub points: Points,
    /// Irradiance there, W/m².
    pub irradiance: Measured,
    /// Irradiance straight from the lights, W/m².
    pub direct: Measured,
    /// Area that each pixel covers there, m².
    pub areas: Vec<f32>,
    /// Photons followed.
    pub photons: u64,
    /// Standard error over the mean.
    pub noise: f64,
}

impl Truth {
    /// Follows at least this many photons; `told` hears of those that are done.
    ///
    /// # Errors
    /// If the scene cannot be traced.
    pub fn new(scene: &Scene, points: Points, photons: u64, seed: u32, told: impl Fn(u64)) -> anyhow::Result<Self> {
        // Whoever asks has counted the memory of both.
        let options = TraceOptions { seed, points: Some(points.clone()), memory_limit_bytes: u64::MAX, ..TraceOptions::default() };
        let mut tracer = Tracer::new(scene, &options)?;
        while tracer.photons() < photons || tracer.batches() < 2 {
            tracer.run_batch();
            told(tracer.photons());
        }
        let irradiance = tracer.pixels().context("the ground truth has no pixels")?;
        let direct = tracer.direct().context("the ground truth has no pixels")?;
        let areas = tracer.pixel_areas().context("the ground truth has no pixels")?.iter().map(|&area| area as f32).collect();
        Ok(Self { points, irradiance, direct, areas, photons: tracer.photons(), noise: tracer.noise() })
    }

    /// Irradiance by pixel.
    pub fn reference(&self) -> Vec<[f32; 3]> {
        self.irradiance.mean.iter().map(|v| v.map(|c| c as f32)).collect()
    }

    /// The truth's own irradiance beside that of a technique.
    ///
    /// # Errors
    /// If the sizes differ.
    pub fn pair<'a>(&'a self, reference: &'a [[f32; 3]], test: &'a [[f32; 3]]) -> Result<Pair<'a>, MetricError> {
        Pair::with_mask(self.irradiance.columns, self.irradiance.rows, reference, test, self.irradiance.valid.as_deref())
    }

    /// All measures.
    pub fn judge(&self, pair: Pair<'_>) -> Vec<Verdict> {
        let variance: Vec<[f32; 3]> = self.irradiance.standard_error.iter().map(|v| v.map(|e| (e * e) as f32)).collect();
        judge(&Judged { pair, areas_m2: Some(&self.areas), variance: Some(&variance), display: false })
    }

    /// All measures of a technique's direct light, over the pixels whose caustic is judged. The truth has no noise.
    ///
    /// # Errors
    /// If the sizes differ.
    pub fn judge_direct(&self, test: &[[f32; 3]]) -> Result<Vec<Verdict>, MetricError> {
        let reference: Vec<[f32; 3]> = self.direct.mean.iter().map(|v| v.map(|c| c as f32)).collect();
        let pair = self.pair(&reference, test)?;
        Ok(judge(&Judged { pair, areas_m2: Some(&self.areas), variance: None, display: false }))
    }

    /// Distance in pixels between the point that a pixel shows and the point that the eye would see there.
    pub fn view_error_px(&self, seen: &[Option<Vec3>], pixel: usize) -> Option<f64> {
        let (shown, seen) = (self.points.positions[pixel]?, seen[pixel]?);
        let width = f64::from(self.areas[pixel]).sqrt();
        (width > 0.0).then(|| f64::from(shown.distance(seen)) / width)
    }
}

/// The points that a technique's picture shows; `None` without the layers that locate them.
pub fn points(layers: &LayerSet) -> Option<Points> {
    let (position, normal, depth) = (layers.get("position")?, layers.get("normal")?, layers.get("depth")?);
    let seen = depth.planes()[0].pixels().iter().map(|depth| depth.is_finite());
    Some(Points {
        columns: position.width(),
        rows: position.height(),
        positions: position.rgb().into_iter().zip(seen).map(|(p, seen)| seen.then(|| Vec3::from_array(p))).collect(),
        normals: normal.rgb().into_iter().map(|n| Vec3::from_array(n).normalize_or_zero()).collect(),
    })
}
