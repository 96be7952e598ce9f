//! The vertex stage alone: the vertices that both sides stream out are compared one by one.

use serde::Serialize;

use super::bounds::{Bound, ReportedBound};
use super::compare::{raise_scales, relative, ulps};
use nephroid_image::metrics::bounds::Measured;

/// Comparison of the vertices of a pass's draws of one pipeline.
#[derive(Clone, Debug, Serialize)]
pub struct VertexReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Label of the pass.
    pub pass: String,
    /// Label of the pipeline.
    pub pipeline: String,
    /// Draws compared. One that has the vertices of the draw before it is not compared again.
    pub draws: u64,
    /// Vertices compared; each counts as often as a primitive uses it.
    pub vertices: u64,
    /// Vertices with any differing bit.
    pub differing: u64,
    /// Vertices beyond the tolerance.
    pub outliers: u64,
    /// Greatest difference in units in the last place.
    pub max_ulp: u64,
    /// Greatest relative error; its scale is the mean magnitude of each component, see [`super::compare()`].
    pub max_relative: f64,
    /// Number of the draw with the greatest relative error, if any vertex differs.
    pub worst_draw: Option<usize>,
    /// The bound.
    #[serde(with = "ReportedBound")]
    pub bound: Bound,
    /// Whether all vertices are within the bound.
    pub within: bool,
}

impl VertexReport {
    /// A report of nothing. `pass` gives the number and label of the pass.
    #[must_use]
    pub fn new((pass_index, pass): (usize, &str), pipeline: &str, bound: Bound) -> Self {
        Self {
            pass_index,
            pass: pass.to_owned(),
            pipeline: pipeline.to_owned(),
            draws: 0,
            vertices: 0,
            differing: 0,
            outliers: 0,
            max_ulp: 0,
            max_relative: 0.0,
            worst_draw: None,
            bound,
            within: true,
        }
    }

    /// Compares streams of draws, whose vertices have vectors of these numbers of components. The scale of an error is that of all these draws. Streams of
    /// different lengths are beyond every bound.
    pub fn compare<'s>(&mut self, vectors: &[usize], draws: impl Iterator<Item = (usize, &'s [f32], &'s [f32])> + Clone) {
        let stride: usize = vectors.iter().sum();
        let mut scales = vec![0.0; stride];
        let mut vertices = 0_u64;
        for vertex in draws.clone().flat_map(|(_, expected, _)| expected.chunks_exact(stride)) {
            vertices += 1;
            for (scale, v) in scales.iter_mut().zip(vertex).filter(|(_, v)| v.is_finite()) {
                *scale += f64::from(v.abs());
            }
        }
        scales.iter_mut().for_each(|scale| *scale /= vertices.max(1) as f64);
        let mut rest = &mut scales[..];
        for &components in vectors {
            let (vector, others) = std::mem::take(&mut rest).split_at_mut(components);
            raise_scales(vector);
            rest = others;
        }
        self.vertices += vertices;
        for (number, expected, actual) in draws {
            self.draws += 1;
            self.within &= expected.len() == actual.len();
            for (e, a) in expected.chunks_exact(stride).zip(actual.chunks_exact(stride)) {
                let mut error = 0.0_f64;
                let mut distance = 0;
                for ((e, a), scale) in e.iter().zip(a).zip(&scales) {
                    error = error.max(relative(*e, *a, *scale));
                    distance = distance.max(ulps(*e, *a));
                }
                self.differing += u64::from(distance > 0);
                self.outliers += u64::from(error > self.bound.tolerance);
                self.max_ulp = self.max_ulp.max(distance);
                if error > self.max_relative {
                    (self.max_relative, self.worst_draw) = (error, Some(number));
                }
            }
        }
    }

    /// Holds the counts of all draws against the bound.
    pub fn judge(&mut self) {
        let (pixels, outliers) = (self.vertices, self.outliers);
        self.within &= self.bound.holds(&Measured { pixels, outliers, unexplained: outliers, worst: self.max_relative, light: 0.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_image::metrics::bounds::VERTEX;

    fn compared(vectors: &[usize], draws: &[(&[f32], &[f32])]) -> VertexReport {
        let mut report = VertexReport::new((0, "p"), "pipeline", VERTEX);
        report.compare(vectors, draws.iter().enumerate().map(|(number, (expected, actual))| (number, *expected, *actual)));
        report.judge();
        report
    }

    #[test]
    fn a_wrong_component_or_a_missing_vertex_is_seen() {
        let good: Vec<f32> = (0..50).map(|k| k as f32).collect();
        assert!(compared(&[4, 1], &[(&good, &good)]).within);
        let mut last_place = good.clone();
        last_place[7] = f32::from_bits(last_place[7].to_bits() + 1);
        let report = compared(&[4, 1], &[(&good, &good), (&good, &last_place)]);
        assert!(report.within && report.differing == 1 && report.max_ulp == 1 && report.outliers == 0);
        assert_eq!((report.draws, report.vertices, report.worst_draw), (2, 20, Some(1)));
        let mut wrong = good.clone();
        wrong[7] += 1.0;
        let report = compared(&[4, 1], &[(&good, &wrong)]);
        assert!(!report.within && report.outliers == 1);
        assert!(!compared(&[4, 1], &[(&good, &good[..45])]).within);
    }
    /// A part of a vector that is nothing but rounding errors is held against the vector; a vector of its own is not.
    #[test]
    fn rounding_errors_are_held_against_their_own_vector() {
        let with = |small: f32| [1.0, small, 1.0, 1.0].repeat(4);
        let report = |vectors: &[usize]| compared(vectors, &[(&with(1.0e-10), &with(-1.0e-10))]);
        assert!(report(&[4]).within);
        assert!(!report(&[1, 1, 2]).within);
    }
}
