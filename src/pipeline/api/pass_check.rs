//! Whether a pass can run: everything a draw relies on is checked before the first one.

use rayon::prelude::*;

use crate::api::draw::{DRAWS_PER_TASK, Draw};
use crate::api::pass::Pass;
use crate::api::state::{MAX_COLOR_TARGETS, VertexStepMode};

/// What is wrong with a pass.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PassError {
    /// The attachments do not fit together.
    #[error("pass `{pass}`: {what}")]
    Attachments {
        /// The pass's label.
        pass: String,
        /// What is wrong.
        what: String,
    },
    /// A draw does not fit the pass or its pipeline.
    #[error("pass `{pass}`, draw {draw} (pipeline `{pipeline}`): {what}")]
    Draw {
        /// The pass's label.
        pass: String,
        /// The draw's number.
        draw: usize,
        /// Its pipeline's label.
        pipeline: String,
        /// What is wrong.
        what: String,
    },
}

impl Pass<'_> {
    /// Width and height of the attachments.
    fn size(&self) -> Option<(u32, u32)> {
        let color = self.color.iter().flatten().map(|a| a.view.size()).next();
        color.or_else(|| self.depth_stencil.as_ref().map(|a| a.view.size()))
    }

    /// Checks everything a draw relies on.
    pub(crate) fn validate(&self) -> Result<(u32, u32), PassError> {
        let attachments = |what: String| PassError::Attachments { pass: self.label.clone(), what };
        if self.color.len() > MAX_COLOR_TARGETS {
            return Err(attachments(format!("{} colour attachments; at most {MAX_COLOR_TARGETS}", self.color.len())));
        }
        let Some(size) = self.size() else {
            // Stream-out alone needs no attachment.
            if self.draws.iter().all(|d| d.pipeline.desc.rasterizer_discard) {
                return self.validate_draws((1, 1)).map(|()| (1, 1));
            }
            return Err(attachments("no attachment to draw to".into()));
        };
        let color = self.color.iter().flatten().map(|a| (&a.view, false));
        for (view, is_depth) in color.chain(self.depth_stencil.iter().map(|a| (&a.view, true))) {
            if view.size() != size {
                return Err(attachments(format!("attachments of {size:?} and {:?} pixels; all must have one size", view.size())));
            }
            if is_depth != (view.info().depth || view.info().stencil) {
                let kind = if is_depth { "the depth-stencil" } else { "a colour" };
                return Err(attachments(format!("{:?} cannot be {kind} attachment", view.format())));
            }
        }
        self.validate_draws(size).map(|()| size)
    }

    fn validate_draws(&self, size: (u32, u32)) -> Result<(), PassError> {
        let draws = self.draws.par_iter().enumerate().with_min_len(DRAWS_PER_TASK);
        let problem = draws.find_map_first(|(draw, of)| self.draw_problem(of, size).map(|what| (draw, what)));
        problem.map_or(Ok(()), |(draw, what)| {
            let pipeline = self.draws[draw].pipeline.desc.label.clone();
            Err(PassError::Draw { pass: self.label.clone(), draw, pipeline, what })
        })
    }

    fn draw_problem(&self, draw: &Draw<'_>, size: (u32, u32)) -> Option<String> {
        let desc = &draw.pipeline.desc;
        if let Some(what) = draw.bindings.mismatch(&desc.program.bindings) {
            return Some(what);
        }
        if !desc.rasterizer_discard {
            for slot in 0..self.color.len().max(desc.targets.len()) {
                let attached = self.color.get(slot).and_then(|a| a.as_ref()).map(|a| a.view.format());
                let expected = desc.targets.get(slot).and_then(|t| t.as_ref()).map(|t| t.format);
                if attached != expected {
                    return Some(format!("target {slot} is {attached:?}, the pipeline writes {expected:?}"));
                }
            }
            let attached = self.depth_stencil.as_ref().map(|a| a.view.format());
            let expected = desc.depth_stencil.as_ref().map(|d| d.format);
            if attached != expected {
                return Some(format!("depth-stencil attachment is {attached:?}, the pipeline expects {expected:?}"));
            }
        }
        let v = draw.viewport;
        let numbers = [v.x, v.y, v.width, v.height, v.min_depth, v.max_depth];
        if !numbers.iter().all(|n| n.is_finite()) || v.width < 0.0 || v.height < 0.0 || v.width > 32768.0 || v.height > 32768.0 {
            return Some(format!("viewport {v:?}: sizes must be in 0..=32768 and all numbers finite"));
        }
        if !(-32768.0..=32767.0).contains(&v.x) || !(-32768.0..=32767.0).contains(&v.y) {
            return Some(format!("viewport origin ({}, {}) is outside -32768..=32767", v.x, v.y));
        }
        if v.x + v.width > 32767.0 || v.y + v.height > 32767.0 {
            return Some(format!("viewport {v:?} reaches beyond 32767"));
        }
        if !(0.0..=1.0).contains(&v.min_depth) || !(0.0..=1.0).contains(&v.max_depth) || v.min_depth > v.max_depth {
            return Some(format!("viewport depth {}..{}: needs 0 <= min <= max <= 1", v.min_depth, v.max_depth));
        }
        let s = draw.scissor;
        if s.x0 > s.x1 || s.y0 > s.y1 || s.x1 > size.0 || s.y1 > size.1 {
            return Some(format!("scissor {s:?} is not inside the target of {size:?} pixels"));
        }
        if draw.elements.start > draw.elements.end || draw.instances.start > draw.instances.end {
            return Some("element or instance range ends before it starts".into());
        }
        if let Some(index) = &draw.index {
            if index.offset % index.format.byte_size() as usize != 0 || draw.elements.end as usize > index.len() {
                return Some(format!("indices {:?} of a buffer that holds {}", draw.elements, index.len()));
            }
            if desc.primitive.topology.is_strip() && desc.primitive.strip_index_format != Some(index.format) {
                return Some(format!("an indexed strip needs strip_index_format {:?}", index.format));
            }
        }
        if draw.vertex_buffers.len() < desc.vertex_buffers.len() {
            return Some(format!("{} vertex buffers bound, the pipeline reads {}", draw.vertex_buffers.len(), desc.vertex_buffers.len()));
        }
        for (slot, (layout, bound)) in desc.vertex_buffers.iter().zip(draw.vertex_buffers).enumerate() {
            let range = if layout.step_mode == VertexStepMode::Instance { &draw.instances } else { &draw.elements };
            if (layout.step_mode == VertexStepMode::Vertex && draw.index.is_some()) || range.is_empty() {
                continue; // Indices are bounds-checked as they are fetched.
            }
            let reach = layout.attributes.iter().map(|a| a.offset + a.format.size()).max().unwrap_or(0);
            let need = u64::from(range.end - 1) * layout.array_stride + reach + bound.offset as u64;
            if need > bound.buffer.len() as u64 {
                return Some(format!("vertex buffer {slot} has {} bytes, the draw reads {need}", bound.buffer.len()));
            }
        }
        if draw.query.is_some_and(|q| q as usize >= self.query_count) {
            return Some(format!("query {:?} of {}", draw.query, self.query_count));
        }
        if draw.stream_out.is_some_and(|t| t as usize >= self.stream_out.len()) {
            return Some(format!("stream-out target {:?} of {}", draw.stream_out, self.stream_out.len()));
        }
        None
    }
}
