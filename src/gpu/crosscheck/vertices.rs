//! The vertex stage alone: the vertices that both sides stream out are compared one by one.

use serde::Serialize;

use super::bounds::{Bound, ReportedBound};
use super::compare::{raise_scales, relative, ulps};

/// Comparison of the vertices of one draw.
#[derive(Clone, Debug, Serialize)]
pub struct VertexReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Label of the pass.
    pub pass: String,
    /// Number of the draw.
    pub draw: usize,
    /// Number of vertices compared; each counts as often as a primitive uses it.
    pub vertices: u64,
    /// Vertices with any differing bit.
    pub differing: u64,
    /// Vertices beyond the tolerance.
    pub outliers: u64,
    /// Greatest difference in units in the last place.
    pub max_ulp: u64,
    /// Greatest relative error; its scale is the mean magnitude of each component, see [`super::compare()`].
    pub max_relative: f64,
    /// The bound.
    #[serde(with = "ReportedBound")]
    pub bound: Bound,
    /// Whether all vertices are within the bound.
    pub within: bool,
}

impl VertexReport {
    /// Compares two streams whose vertices have vectors of these numbers of components. `draw` gives the number and label of the pass and the number of
    /// the draw. Streams of different lengths are beyond every bound.
    #[must_use]
    pub fn new((pass_index, pass, draw): (usize, &str, usize), bound: Bound, vectors: &[usize], expected: &[f32], actual: &[f32]) -> Self {
        let stride: usize = vectors.iter().sum();
        let vertices = (expected.len() / stride) as u64;
        let mut report = Self {
            pass_index,
            pass: pass.to_owned(),
            draw,
            vertices,
            differing: 0,
            outliers: 0,
            max_ulp: 0,
            max_relative: 0.0,
            bound,
            within: expected.len() == actual.len(),
        };
        let mut scales = vec![0.0; stride];
        for vertex in expected.chunks_exact(stride) {
            for (scale, v) in scales.iter_mut().zip(vertex).filter(|(_, v)| v.is_finite()) {
                *scale += f64::from(v.abs()) / vertices as f64;
            }
        }
        let mut rest = &mut scales[..];
        for &components in vectors {
            let (vector, others) = std::mem::take(&mut rest).split_at_mut(components);
            raise_scales(vector);
            rest = others;
        }
        for (e, a) in expected.chunks_exact(stride).zip(actual.chunks_exact(stride)) {
            let mut error = 0.0_f64;
            let mut distance = 0;
            for ((e, a), scale) in e.iter().zip(a).zip(&scales) {
                error = error.max(relative(*e, *a, *scale));
                distance = distance.max(ulps(*e, *a));
            }
            report.differing += u64::from(distance > 0);
            report.outliers += u64::from(error > report.bound.tolerance);
            report.max_ulp = report.max_ulp.max(distance);
            report.max_relative = report.max_relative.max(error);
        }
        report.within &= report.bound.holds(vertices, report.outliers, report.outliers);
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_image::metrics::bounds::VERTEX;

    #[test]
    fn a_wrong_component_or_a_missing_vertex_is_seen() {
        let good: Vec<f32> = (0..50).map(|k| k as f32).collect();
        assert!(VertexReport::new((0, "p", 0), VERTEX, &[4, 1], &good, &good).within);
        let mut last_place = good.clone();
        last_place[7] = f32::from_bits(last_place[7].to_bits() + 1);
        let report = VertexReport::new((0, "p", 0), VERTEX, &[4, 1], &good, &last_place);
        assert!(report.within && report.differing == 1 && report.max_ulp == 1 && report.outliers == 0);
        let mut wrong = good.clone();
        wrong[7] += 1.0;
        let report = VertexReport::new((0, "p", 0), VERTEX, &[4, 1], &good, &wrong);
        assert!(!report.within && report.outliers == 1);
        assert!(!VertexReport::new((0, "p", 0), VERTEX, &[4, 1], &good, &good[..45]).within);
    }
    /// A part of a vector that is nothing but rounding errors is held against the vector; a vector of its own is not.
    #[test]
    fn rounding_errors_are_held_against_their_own_vector() {
        let with = |small: f32| [1.0, small, 1.0, 1.0].repeat(4);
        let report = |vectors: &[usize]| VertexReport::new((0, "p", 0), VERTEX, vectors, &with(1.0e-10), &with(-1.0e-10));
        assert!(report(&[4]).within);
        assert!(!report(&[1, 1, 2]).within);
    }
}
