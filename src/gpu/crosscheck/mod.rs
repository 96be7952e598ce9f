//! The cross-check: runs one frame on the software GPU and on a driver, and compares every attachment after every pass.
//!
//! In the *free-running* mode, the driver reads its own results of earlier passes, and shades vertices: the whole frame is checked. The software GPU
//! draws each pass twice, from its own earlier results and from the driver's. Held against the second, the driver's picture shows what this pass adds;
//! against the first, how far the whole has drifted. In the *resynchronised* mode, the driver starts every pass from the software GPU's attachments
//! and draws the software GPU's vertices: a difference is then caused by that pass alone, after its vertex stage. Every attachment has a named
//! [`Bound`]. The first attachment beyond its bound is traced to a draw, a primitive and a pixel ([`locate()`]).

mod bounds;
mod compare;
mod light;
mod locate;
mod pair;
mod picture;
mod vertices;

use serde::Serialize;

pub use bounds::{Bound, DRIFT, EXACT, PassBounds, bound_of, vertex_bound_of};
pub use compare::{Comparison, Difference, Pixel, compare, relative, ulps};
pub use light::drift;
pub use locate::{Located, locate};
pub use picture::{plain_tone, side_by_side};
pub use vertices::VertexReport;

use super::{Gpu, GpuError};
use nephroid_pipeline::Device;
use nephroid_pipeline::frame::{AttachmentView, Frame, Pass};
use nephroid_pipeline::state::TextureFormat;
use pair::{Pair, surface};

/// The state from which the driver starts each pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Its own results of earlier passes.
    FreeRunning,
    /// The software GPU's attachments and vertices.
    Resynchronised,
}

/// Comparison of one attachment after one pass.
#[derive(Clone, Debug, Serialize)]
pub struct AttachmentReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Label of the pass.
    pub pass: String,
    /// Label of the texture.
    pub texture: String,
    /// Format of the texture.
    pub format: TextureFormat,
    /// The bound.
    #[serde(with = "bounds::ReportedBound")]
    pub bound: Bound,
    /// The difference between the two versions.
    pub difference: Difference,
    /// Share of the light in which the driver's picture differs from the one that the software GPU draws from its own earlier results.
    pub drift: f64,
    /// Whether the difference is within the bound, and the drift within [`DRIFT`].
    pub within: bool,
    #[serde(skip)]
    pub(crate) view: AttachmentView,
}

/// An occlusion query whose counts differ; they must be equal.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct QueryReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Number of the query.
    pub query: usize,
    /// Number of fragments that passed on the software GPU.
    pub expected: u64,
    /// Number of fragments that passed on the driver.
    pub actual: u64,
}

/// A stream-out buffer whose numbers of vertices differ.
#[derive(Clone, Debug, Serialize)]
pub struct StreamReport {
    /// Number of the pass.
    pub pass_index: usize,
    /// Label of the buffer.
    pub buffer: String,
    /// Vertices written by the software GPU.
    pub expected: u32,
    /// Vertices written by the driver.
    pub actual: u32,
}

/// Results of the cross-check of one frame.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The mode of the cross-check.
    pub mode: Mode,
    /// Attachments by pass, then by number.
    pub attachments: Vec<AttachmentReport>,
    /// In the free-running mode: the vertex stage of every draw whose vertices a driver can stream out.
    pub vertices: Vec<VertexReport>,
    /// Occlusion queries whose counts differ.
    pub queries: Vec<QueryReport>,
    /// Stream-out buffers with different numbers of vertices.
    pub streams: Vec<StreamReport>,
}

impl Report {
    /// Whether all attachments and vertices are within their bounds, and all counts are equal.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.first_failure().is_none() && self.queries.is_empty() && self.streams.is_empty() && self.vertices.iter().all(|v| v.within)
    }

    /// The first attachment beyond its bound.
    #[must_use]
    pub fn first_failure(&self) -> Option<&AttachmentReport> {
        self.attachments.iter().find(|a| !a.within)
    }
}

/// Runs a frame on both sides and compares every attachment after every pass. `bounds` are those of the frame's passes. `watch` is called with both
/// versions of each attachment.
///
/// `on_cpu` and `on_gpu` are the same frame, except where a test has planted a difference; their textures and passes correspond.
///
/// # Errors
/// If the frame is not valid, or the driver lacks a feature or fails.
pub fn crosscheck(
    gpu: &Gpu,
    device: &Device,
    on_cpu: &Frame,
    on_gpu: &Frame,
    mode: Mode,
    bounds: &[PassBounds],
    mut watch: impl FnMut(&AttachmentReport, [&nephroid_pipeline::Surface; 2]),
) -> Result<Report, GpuError> {
    let mut pair = Pair::new(gpu, device, on_cpu, on_gpu, mode)?;
    let mut report = Report { mode, attachments: Vec::new(), vertices: Vec::new(), queries: Vec::new(), streams: Vec::new() };
    for (index, pass) in on_cpu.passes.iter().enumerate() {
        report.vertices.extend(pair.vertices(index, bounds)?);
        let [expected, actual] = pair.run(index)?;
        let queries = expected.into_iter().zip(actual).enumerate().filter(|(_, (e, a))| e != a);
        report.queries.extend(queries.map(|(query, (expected, actual))| QueryReport { pass_index: index, query, expected, actual }));
        report.streams.extend(pair.streams(index));
        for (attachment, surfaces) in attachments(&mut pair, gpu, index, pass, bounds)?.into_iter().zip(pass.attachments()) {
            watch(&attachment, pair.surfaces(surfaces));
            report.attachments.push(attachment);
        }
        pair.settle(index)?;
    }
    Ok(report)
}

/// Compares the attachments of a pass that has run.
fn attachments(
    pair: &mut Pair<'_>,
    gpu: &Gpu,
    index: usize,
    pass: &Pass,
    bounds: &[PassBounds],
) -> Result<Vec<AttachmentReport>, GpuError> {
    let mut compared = Vec::new();
    for view in pass.attachments() {
        let texture = pair.chain.texture(view.texture);
        let bound = bound_of(bounds, gpu.adapter().family(), pair.mode, &pass.label, &texture.desc().label, texture.info());
        let [expected, actual] = pair.surfaces(view);
        compared.push((view, bound, compare(texture.info(), expected, actual, bound.tolerance)));
    }
    if compared.iter().any(|(.., comparison)| !comparison.open.is_empty()) {
        pair.moved(index, |contents| compared.iter_mut().for_each(|(view, _, comparison)| comparison.widen(surface(contents, *view))))?;
    }
    let report = |(view, bound, mut comparison): (AttachmentView, Bound, Comparison)| {
        comparison.close_moved(pair.surfaces(view)[1]);
        let texture = pair.chain.texture(view.texture);
        let drift = drift(texture.info(), surface(&pair.chain, view), surface(&pair.actual, view));
        let difference = comparison.difference;
        let within = bound.holds(&difference.measured()) && drift <= DRIFT;
        AttachmentReport {
            pass_index: index,
            pass: pass.label.clone(),
            texture: texture.desc().label.clone(),
            format: texture.desc().format,
            bound,
            difference,
            drift,
            within,
            view,
        }
    };
    Ok(compared.into_iter().map(report).collect())
}
