//! Attachments of a pass: whether they fit together.

use crate::api::check::color_target::is_color_renderable;
use crate::api::pass::Pass;
use crate::api::state::{LoadOp, MAX_COLOR_TARGETS, TextureFormat};

/// Why the attachments of a pass are refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AttachmentProblem {
    /// Too many colour attachments.
    #[error("{count} colour attachments; at most {MAX_COLOR_TARGETS}")]
    Count {
        /// The attachments seen.
        count: usize,
    },
    /// No attachment, although a draw rasterizes.
    #[error("no attachment to draw to")]
    None,
    /// Attachments of different sizes.
    #[error("attachments of {first:?} and {other:?} pixels; all must have one size")]
    Size {
        /// Width and height of the first attachment.
        first: (u32, u32),
        /// Width and height of another.
        other: (u32, u32),
    },
    /// A depth or stencil format, or a format that cannot be rendered to, as a colour attachment.
    #[error("{format:?} cannot be a colour attachment")]
    NotColor {
        /// The format seen.
        format: TextureFormat,
    },
    /// A format with neither depth nor stencil as the depth-stencil attachment.
    #[error("{format:?} cannot be the depth-stencil attachment")]
    NotDepthStencil {
        /// The format seen.
        format: TextureFormat,
    },
    /// Depth is cleared to a value outside of 0..=1.
    #[error("depth is cleared to {depth}; allowed: 0..=1")]
    ClearDepth {
        /// The depth seen.
        depth: f32,
    },
}

/// Width and height of the attachments, if there are any.
pub(crate) fn size(pass: &Pass<'_>) -> Option<(u32, u32)> {
    let color = pass.color.iter().flatten().map(|a| a.view.size()).next();
    color.or_else(|| pass.depth_stencil.as_ref().map(|a| a.view.size()))
}

/// Why the attachments of a pass are refused, or `None`. `first` is the size that all must have.
pub(crate) fn problem(pass: &Pass<'_>, first: Option<(u32, u32)>) -> Option<AttachmentProblem> {
    if pass.color.len() > MAX_COLOR_TARGETS {
        return Some(AttachmentProblem::Count { count: pass.color.len() });
    }
    let Some(first) = first else {
        // A pass that only streams out needs no attachment.
        let discards = pass.draws.iter().all(|draw| draw.pipeline.desc.rasterizer_discard);
        return (!discards).then_some(AttachmentProblem::None);
    };
    let colors = pass.color.iter().flatten().map(|a| &a.view);
    let other_size = |other: (u32, u32)| (other != first).then_some(AttachmentProblem::Size { first, other });
    let color = colors.into_iter().find_map(|view| {
        let format = view.format();
        other_size(view.size()).or_else(|| (!is_color_renderable(format)).then_some(AttachmentProblem::NotColor { format }))
    });
    color.or_else(|| {
        let attachment = pass.depth_stencil.as_ref()?;
        let (view, info) = (&attachment.view, attachment.view.info());
        let clears = match attachment.depth_load {
            LoadOp::Clear(depth) if info.depth && !(0.0..=1.0).contains(&depth) => Some(AttachmentProblem::ClearDepth { depth }),
            _ => None,
        };
        let format = (!info.depth && !info.stencil).then(|| AttachmentProblem::NotDepthStencil { format: view.format() });
        other_size(view.size()).or(format).or(clears)
    })
}
