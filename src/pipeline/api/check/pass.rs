//! Passes: attachments and every draw are checked before the first draw.

use rayon::prelude::*;

use crate::api::check::attachment::{self, AttachmentProblem};
use crate::api::check::draw::{self, DrawProblem};
use crate::api::draw::DRAWS_PER_TASK;
use crate::api::pass::Pass;

/// Why a pass is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PassError {
    /// The attachments are refused.
    #[error("pass `{pass}`: {problem}")]
    Attachments {
        /// The pass's label.
        pass: String,
        /// The cause.
        problem: AttachmentProblem,
    },
    /// A draw is refused.
    #[error("pass `{pass}`, draw {draw} (pipeline `{pipeline}`): {problem}")]
    Draw {
        /// The pass's label.
        pass: String,
        /// The draw's number in the pass.
        draw: usize,
        /// The label of the draw's pipeline.
        pipeline: String,
        /// The cause.
        problem: DrawProblem,
    },
}

impl Pass<'_> {
    /// Checks the attachments and every draw. Returns width and height of the attachments, pixels; (1, 1) without attachments.
    ///
    /// # Errors
    /// With the first cause found, in the order of the draws.
    pub(crate) fn validate(&self) -> Result<(u32, u32), PassError> {
        let size = attachment::size(self);
        if let Some(problem) = attachment::problem(self, size) {
            return Err(PassError::Attachments { pass: self.label.clone(), problem });
        }
        let size = size.unwrap_or((1, 1));
        let draws = self.draws.par_iter().enumerate().with_min_len(DRAWS_PER_TASK);
        let refused = draws.find_map_first(|(number, of)| draw::problem(self, of, size).map(|problem| (number, problem)));
        refused.map_or(Ok(size), |(draw, problem)| {
            let pipeline = self.draws[draw].pipeline.desc.label.clone();
            Err(PassError::Draw { pass: self.label.clone(), draw, pipeline, problem })
        })
    }
}
