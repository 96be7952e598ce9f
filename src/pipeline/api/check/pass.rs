//! Whether a pass can run: attachments and every draw are checked before the first draw.

use rayon::prelude::*;

use crate::api::check::attachment::{self, AttachmentProblem};
use crate::api::check::draw::{self, DrawProblem};
use crate::api::draw::DRAWS_PER_TASK;
use crate::api::pass::Pass;

/// A pass that cannot run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PassError {
    /// The attachments do not fit together.
    #[error("pass `{pass}`: {problem}")]
    Attachments {
        /// The pass's label.
        pass: String,
        /// What is wrong.
        problem: AttachmentProblem,
    },
    /// A draw does not fit the pass or its pipeline.
    #[error("pass `{pass}`, draw {draw} (pipeline `{pipeline}`): {problem}")]
    Draw {
        /// The pass's label.
        pass: String,
        /// The draw's number.
        draw: usize,
        /// Its pipeline's label.
        pipeline: String,
        /// What is wrong.
        problem: DrawProblem,
    },
}

impl Pass<'_> {
    /// Checks everything a draw relies on, and gives width and height of the attachments; 1 and 1 without any.
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
