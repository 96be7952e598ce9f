//! Errors of frames.

use crate::api::check::pass::PassError;
use crate::api::check::pipeline::PipelineError;
use crate::api::check::sampler::SamplerError;
use crate::api::texture_descriptor::TextureError;

/// Why a frame cannot run. When validation returns such an error, nothing has been drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A texture is refused.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// A pipeline is refused.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// A pass is refused.
    #[error(transparent)]
    Pass(#[from] PassError),
    /// An executor other than the CPU's cannot run the frame, for the reason that it gives.
    #[error("{0}")]
    Backend(String),
    /// An entry of a bind group is refused.
    #[error("bind group {group}, binding {binding}: {problem}")]
    BindGroup {
        /// The bind group's number.
        group: usize,
        /// The binding number.
        binding: usize,
        /// The cause.
        problem: BindGroupProblem,
    },
    /// A pass refers to a resource that does not exist, or reads what it writes.
    #[error("pass `{pass}`: {problem}")]
    Reference {
        /// The pass's label.
        pass: String,
        /// The cause.
        problem: ReferenceProblem,
    },
    /// The frame needs more memory than its limit.
    #[error(
        "the frame needs {needed_mib} MiB and may use {limit_mib} MiB; the largest part is `{largest}` with {largest_mib} MiB: \
         lower the image size, the water grid or the shadow map size, or raise the limit"
    )]
    Memory {
        /// MiB needed, rounded up.
        needed_mib: u64,
        /// MiB allowed.
        limit_mib: u64,
        /// Name of the largest texture or buffer.
        largest: String,
        /// MiB of that resource, rounded up.
        largest_mib: u64,
    },
}

/// Why an entry of a bind group is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BindGroupProblem {
    /// The program reads a binding that the bind group does not have.
    #[error("the program reads it, and the bind group does not have it")]
    Missing,
    /// A buffer that the frame does not have.
    #[error("names buffer {buffer}, which the frame does not have")]
    NoBuffer {
        /// The buffer's number.
        buffer: usize,
    },
    /// A texture that the frame does not have.
    #[error("names texture {texture}, which the frame does not have")]
    NoTexture {
        /// The texture's number.
        texture: usize,
    },
    /// A sampler is not valid.
    #[error(transparent)]
    Sampler(SamplerError),
}

/// Why the references of a pass are refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceProblem {
    /// An attachment names a texture that the frame does not have.
    #[error("attachment {attachment} names texture {texture}, which the frame does not have")]
    NoTexture {
        /// The attachment's number: colour attachments in order, then depth-stencil.
        attachment: usize,
        /// The texture's number.
        texture: usize,
    },
    /// An attachment names a level or layer that its texture does not have.
    #[error("attachment {attachment} is level {level} layer {layer} of `{texture}`, which does not exist")]
    NoSurface {
        /// The attachment's number.
        attachment: usize,
        /// The texture's label.
        texture: String,
        /// Mip level.
        level: u32,
        /// Layer or slice.
        layer: u32,
    },
    /// Two attachments are the same surface.
    #[error("texture `{texture}`, level {level}, layer {layer} is attached twice")]
    AttachedTwice {
        /// The texture's label.
        texture: String,
        /// Mip level.
        level: u32,
        /// Layer or slice.
        layer: u32,
    },
    /// A stream-out target names a buffer that the frame does not have.
    #[error("stream-out target {target} names buffer {buffer}, which the frame does not have")]
    NoStreamOutBuffer {
        /// The target's number.
        target: usize,
        /// The buffer's number.
        buffer: usize,
    },
    /// Two stream-out targets are the same buffer.
    #[error("buffer `{buffer}` is streamed out to twice")]
    StreamedOutTwice {
        /// The buffer's label.
        buffer: String,
    },
    /// Draws stream vertices of different sizes out to one target.
    #[error("draws stream vertices of {first} and of {other} floats out to buffer `{buffer}`")]
    StreamOutVertices {
        /// The buffer's label.
        buffer: String,
        /// Floats of a vertex of the first draw.
        first: usize,
        /// Floats of a vertex of another draw.
        other: usize,
    },
    /// A draw names a pipeline that the frame does not have.
    #[error("draw {draw} names pipeline {pipeline}, which the frame does not have")]
    NoPipeline {
        /// The draw's number.
        draw: usize,
        /// The pipeline's number.
        pipeline: usize,
    },
    /// A draw names a bind group that the frame does not have.
    #[error("draw {draw} names bind group {bind_group}, which the frame does not have")]
    NoBindGroup {
        /// The draw's number.
        draw: usize,
        /// The bind group's number.
        bind_group: usize,
    },
    /// A draw names a stream-out target that the pass does not have.
    #[error("draw {draw} streams out to target {target} of {count}")]
    NoStreamOutTarget {
        /// The draw's number.
        draw: usize,
        /// The target's number.
        target: u32,
        /// Targets of the pass.
        count: usize,
    },
    /// A draw has indices and also takes its vertex count from stream-out.
    #[error("draw {draw} has indices and takes its vertices from stream-out")]
    IndexedStreamOut {
        /// The draw's number.
        draw: usize,
    },
    /// A draw names a vertex or index buffer that the frame does not have.
    #[error("draw {draw} names buffer {buffer}, which the frame does not have")]
    NoBuffer {
        /// The draw's number.
        draw: usize,
        /// The buffer's number.
        buffer: usize,
    },
    /// A draw reads vertices or indices from a buffer that its pass streams out to.
    #[error("draw {draw} reads buffer `{buffer}`, to which the pass streams out")]
    DrawReadsStreamOut {
        /// The draw's number.
        draw: usize,
        /// The buffer's label.
        buffer: String,
    },
    /// A shader reads a texture that its pass draws to.
    #[error("texture `{texture}` is read and drawn to in the same pass")]
    ReadAndDrawnTo {
        /// The texture's label.
        texture: String,
    },
    /// A shader reads a buffer that its pass streams out to.
    #[error("buffer `{buffer}` is read and streamed out to in the same pass")]
    ReadAndStreamedOut {
        /// The buffer's label.
        buffer: String,
    },
}
