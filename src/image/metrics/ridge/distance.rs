//! Distances between two sets of ridge points.

use rayon::prelude::*;

use super::find::{RidgePoint, RidgeSettings, ridge_points};
use crate::metrics::pair::{MetricError, Pair, Which};
use crate::metrics::quantile::quantile;

/// Length by which a ridge extends from each of its points, in pixels: half the diagonal of a pixel, so that neighbours on a slanted ridge meet.
const HALF_LENGTH_PX: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Largest distance of a ridge from the row of pixels that holds its point: half a pixel plus the half-length.
const REACH_PX: f64 = 0.5 + HALF_LENGTH_PX;

/// Distances between the ridges of two pictures, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RidgeError {
    /// Mean distance from each ridge point of either picture to the nearest ridge of the other.
    pub mean_px: f64,
    /// The 95 % quantile of these distances.
    pub p95_px: f64,
    /// Mean over the points of the reference alone: large if the test lacks ridges of the reference.
    pub missing_px: f64,
    /// Mean over the points of the test alone: large if the test has ridges that the reference lacks.
    pub spurious_px: f64,
    /// Number of ridge points of the reference, at least 1.
    pub reference_count: usize,
    /// Number of ridge points of the test, at least 1.
    pub test_count: usize,
}

/// Distances between the bright ridges of the test and those of the reference.
///
/// Ridge points are found to a fraction of a pixel by [`RidgeSettings`], in each picture separately, so a constant factor between the pictures
/// changes nothing. A ridge is the union of short segments, one through each point along the ridge's direction; the distance from a point to a ridge
/// is exact and unbounded. Both directions are measured: from points of the test to the reference, and back. A ridge that is moved sideways by `d`
/// has the error `d`, one that is moved lengthwise has none, and a missing ridge counts with the distance to the nearest other one. Values may have
/// any unit. A strip of four times [`RidgeSettings::sigma_px`] along the borders of the picture and of the mask has no ridges.
///
/// # Errors
/// If a setting is out of range, or a picture has no ridge.
pub fn ridge_error(pair: &Pair, settings: &RidgeSettings) -> Result<RidgeError, MetricError> {
    settings.check()?;
    let points = |which| match ridge_points(pair, which, settings) {
        points if points.is_empty() => Err(MetricError::NoRidge { picture: which }),
        points => Ok(points),
    };
    let (reference, test) = (points(Which::Reference)?, points(Which::Test)?);
    let missing = Ridges::new(&test, pair.height()).distances(&reference);
    let spurious = Ridges::new(&reference, pair.height()).distances(&test);
    let (missing_px, spurious_px) = (mean(&missing), mean(&spurious));
    let mut all = missing;
    all.extend(spurious);
    let mean_px = mean(&all);
    let p95_px = quantile(&mut all, 0.95).unwrap_or(mean_px);
    Ok(RidgeError { mean_px, p95_px, missing_px, spurious_px, reference_count: reference.len(), test_count: test.len() })
}

/// Mean in index order.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Ridge points by the row of pixels that holds them, for nearest-neighbour queries.
struct Ridges<'a> {
    points: &'a [RidgePoint],
    /// Index of the first point of each row, followed by the number of points.
    starts: Vec<usize>,
}

impl<'a> Ridges<'a> {
    /// `points` are in row-major order of their pixels.
    fn new(points: &'a [RidgePoint], height: u32) -> Self {
        let starts = (0..=height).map(|row| points.partition_point(|point| point.row < row)).collect();
        Self { points, starts }
    }

    /// Distance from each of `points` to the nearest ridge of this set.
    fn distances(&self, points: &[RidgePoint]) -> Vec<f64> {
        points.par_iter().map(|point| self.distance(point.position)).collect()
    }

    /// Distance from a point to the nearest ridge. Rows are searched from the nearest outwards, and each row from the nearest column outwards, until
    /// no ridge can be nearer than the nearest found.
    fn distance(&self, from: [f64; 2]) -> f64 {
        let row_count = self.starts.len() - 1;
        let middle = (from[1] + 0.5).floor().clamp(0.0, (row_count - 1) as f64) as usize;
        let mut best = f64::INFINITY;
        for step in 0..row_count {
            if step as f64 - 0.5 - REACH_PX > best {
                break;
            }
            if step <= middle {
                self.search_row(middle - step, from, &mut best);
            }
            if step > 0 && middle + step < row_count {
                self.search_row(middle + step, from, &mut best);
            }
        }
        best
    }

    fn search_row(&self, row: usize, from: [f64; 2], best: &mut f64) {
        let points = &self.points[self.starts[row]..self.starts[row + 1]];
        // Each pixel has at most one point, inside the pixel, so x ascends along the list.
        let split = points.partition_point(|point| point.position[0] < from[0]);
        let mut visit = |point: &RidgePoint| {
            if (point.position[0] - from[0]).abs() - HALF_LENGTH_PX > *best {
                return false;
            }
            *best = best.min(distance_to_piece(from, point));
            true
        };
        let _ = points[..split].iter().rev().all(&mut visit);
        let _ = points[split..].iter().all(&mut visit);
    }
}

/// Distance from a point to the segment of ridge through `piece`.
fn distance_to_piece(from: [f64; 2], piece: &RidgePoint) -> f64 {
    let [dx, dy] = [from[0] - piece.position[0], from[1] - piece.position[1]];
    let along = (dx * piece.along[0] + dy * piece.along[1]).clamp(-HALF_LENGTH_PX, HALF_LENGTH_PX);
    let (x, y) = (dx - along * piece.along[0], dy - along * piece.along[1]);
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_math::rng::uniform3;

    #[test]
    fn the_search_finds_what_trying_all_finds() {
        let point = |seed: u32, index: u32| {
            let [x, y, angle] = uniform3(seed, 0, index).map(f64::from);
            let (sine, cosine) = libm::sincos(6.3 * angle);
            RidgePoint { position: [40.0 * x - 0.5, 30.0 * y - 0.5], along: [cosine, sine], row: (30.0 * y) as u32 }
        };
        let pixel = |point: &RidgePoint| (point.row, (point.position[0] + 0.5) as u32);
        for count in [1, 5, 60] {
            let mut points: Vec<RidgePoint> = (0..count).map(|index| point(1, index)).collect();
            points.sort_by_key(pixel);
            points.dedup_by_key(|point| pixel(point));
            let ridges = Ridges::new(&points, 30);
            for index in 0..300 {
                let from = point(2, index).position;
                let expected = points.iter().map(|piece| distance_to_piece(from, piece)).fold(f64::INFINITY, f64::min);
                assert_eq!(ridges.distance(from), expected, "{count} points, query {index}");
            }
        }
    }
}
