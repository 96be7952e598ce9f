//! Counts that a technique needs while it builds a frame.
//!
//! The draws of a technique may depend on how many samples of a shape pass a depth test. The technique describes such queries as data
//! ([`OcclusionQueries`]) and never draws directly: [`ask`] runs the passes on the device that builds the frame, returns the counts, and appends
//! the same passes to the frame with cached output ([`Pass::cached`]). The software GPU returns the cached output; other executors and the
//! cross-check run the passes and count.

use nephroid_pipeline::frame::{
    BindGroupId, Contents, DepthStencilAttachment, Draw, Frame, FrameError, Pass, PipelineId, TextureId, check_references, pipelines,
    run_frame_pass,
};
use nephroid_pipeline::{Device, LoadOp, RenderPipeline};

/// Most queries of a pass: drivers count in colour targets, which have room for this many.
pub const QUERIES_PER_PASS: usize = 32;

/// Shapes to be tested against a depth buffer, as data.
pub struct OcclusionQueries {
    /// Resources of all passes, and the passes that fill the depth buffer. The ids in the other fields refer to this frame. Its rules are replaced by
    /// those of the frame that is being built.
    pub occluders: Frame,
    /// The depth buffer.
    pub depth: TextureId,
    /// Pipeline that draws a shape. It must neither write depth nor have a fragment shader that discards.
    pub pipeline: PipelineId,
    /// Bindings of that pipeline.
    pub bindings: BindGroupId,
    /// Vertices n of each shape: shape k has the vertices `k·n..(k+1)·n`.
    pub shape_vertices: u32,
}

/// Runs queries and records their passes.
pub struct Counter<'a> {
    device: &'a Device,
    queries: OcclusionQueries,
    pipelines: Vec<RenderPipeline>,
    contents: Contents,
}

/// Draws the occluders, calls `questions` to count samples of shapes, and appends all passes to `frame`, with the counts cached.
///
/// # Errors
/// If the passes are invalid or cannot run.
pub fn ask<R>(
    device: &Device,
    frame: &mut Frame,
    mut queries: OcclusionQueries,
    questions: impl FnOnce(&mut Counter<'_>) -> Result<R, FrameError>,
) -> Result<R, FrameError> {
    queries.occluders.rules = frame.rules;
    check_references(&queries.occluders)?;
    let mut contents = Contents::initial(&queries.occluders)?;
    let pipelines = pipelines(&queries.occluders)?;
    for pass in &queries.occluders.passes {
        run_frame_pass(device, &queries.occluders, &pipelines, pass, &mut contents, None)?;
    }
    let mut counter = Counter { device, queries, pipelines, contents };
    let answer = questions(&mut counter)?;
    frame.append(counter.queries.occluders);
    Ok(answer)
}

impl Counter<'_> {
    /// Number of samples of each shape that pass the depth test. The passes are named `LABEL part K`.
    ///
    /// # Errors
    /// If a pass cannot run.
    pub fn count(&mut self, label: &str, shapes: &[u32]) -> Result<Vec<u64>, FrameError> {
        let mut counts = Vec::with_capacity(shapes.len());
        for (part, shapes) in shapes.chunks(QUERIES_PER_PASS).enumerate() {
            let pass = self.queries.pass(format!("{label} part {part}"), shapes);
            let output = run_frame_pass(self.device, &self.queries.occluders, &self.pipelines, &pass, &mut self.contents, None)?;
            counts.extend_from_slice(&output.queries);
            self.queries.occluders.passes.push(Pass { cached: Some(output), ..pass });
        }
        Ok(counts)
    }
}

impl OcclusionQueries {
    /// A pass with one query for each shape.
    fn pass(&self, label: String, shapes: &[u32]) -> Pass {
        let draw = |(query, &shape): (usize, &u32)| Draw {
            query: Some(query as u32),
            ..Draw::new(self.pipeline, self.bindings, shape * self.shape_vertices..(shape + 1) * self.shape_vertices)
        };
        Pass {
            label,
            depth_stencil: Some(DepthStencilAttachment { view: self.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
            draws: shapes.iter().enumerate().map(draw).collect(),
            query_count: shapes.len(),
            ..Pass::default()
        }
    }
}
