//! Why a frame cannot run.

use crate::api::check::pass::PassError;
use crate::api::check::pipeline::PipelineError;
use crate::api::check::sampler::SamplerError;
use crate::api::texture_descriptor::TextureError;

/// Why a frame cannot run. Nothing has been drawn when one of these is returned by validation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A texture is not possible.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// A pipeline is not possible.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// A pass is not possible.
    #[error(transparent)]
    Pass(#[from] PassError),
    /// Another executor cannot run it, for the reason that it gives.
    #[error("{0}")]
    Backend(String),
    /// A bind group has an entry that is not possible.
    #[error("bind group {group}, binding {binding}: {problem}")]
    BindGroup {
        /// The bind group's number.
        group: usize,
        /// The binding number.
        binding: usize,
        /// What is wrong.
        problem: BindGroupProblem,
    },
    /// A pass refers to what is not there, or reads what it writes.
    #[error("pass `{pass}`: {problem}")]
    Reference {
        /// The pass's label.
        pass: String,
        /// What is wrong.
        problem: ReferenceProblem,
    },
    /// The frame needs more memory than it may use.
    #[error(
        "the frame needs {needed_mib} MiB and may use {limit_mib} MiB; the largest part is `{largest}` with {largest_mib} MiB: \
         lower the image size, the water grid or the shadow map size, or raise the limit"
    )]
    Memory {
        /// Needed, rounded up.
        needed_mib: u64,
        /// Allowed.
        limit_mib: u64,
        /// Name of the largest resource.
        largest: String,
        /// Its size, rounded up.
        largest_mib: u64,
    },
}

/// What is wrong with an entry of a bind group.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BindGroupProblem {
    /// The bind group ends before an entry that a program reads.
    #[error("the program reads it, and the bind group does not have it")]
    Missing,
    /// A buffer that is not there.
    #[error("names buffer {buffer}, which the frame does not have")]
    NoBuffer {
        /// The buffer's number.
        buffer: usize,
    },
    /// A texture that is not there.
    #[error("names texture {texture}, which the frame does not have")]
    NoTexture {
        /// The texture's number.
        texture: usize,
    },
    /// A sampler is not valid.
    #[error(transparent)]
    Sampler(SamplerError),
}

/// What a pass refers to in a way that is not possible.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceProblem {
    /// An attachment of a texture that is not there.
    #[error("attachment {attachment} names texture {texture}, which the frame does not have")]
    NoTexture {
        /// The attachment's number: colour attachments in order, then depth-stencil.
        attachment: usize,
        /// The texture's number.
        texture: usize,
    },
    /// An attachment that the texture does not have.
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
    /// Two attachments that are the same.
    #[error("texture `{texture}`, level {level}, layer {layer} is attached twice")]
    AttachedTwice {
        /// The texture's label.
        texture: String,
        /// Mip level.
        level: u32,
        /// Layer or slice.
        layer: u32,
    },
    /// A stream-out target of a buffer that is not there.
    #[error("stream-out target {target} names buffer {buffer}, which the frame does not have")]
    NoStreamOutBuffer {
        /// The target's number.
        target: usize,
        /// The buffer's number.
        buffer: usize,
    },
    /// Two stream-out targets that are the same.
    #[error("buffer `{buffer}` is streamed out to twice")]
    StreamedOutTwice {
        /// The buffer's label.
        buffer: String,
    },
    /// Draws write vertices of different sizes to one stream-out target.
    #[error("draws stream vertices of {first} and of {other} floats out to buffer `{buffer}`")]
    StreamOutVertices {
        /// The buffer's label.
        buffer: String,
        /// Floats of a vertex of the first draw.
        first: usize,
        /// Floats of a vertex of another draw.
        other: usize,
    },
    /// A pipeline that is not there.
    #[error("draw {draw} names pipeline {pipeline}, which the frame does not have")]
    NoPipeline {
        /// The draw's number.
        draw: usize,
        /// The pipeline's number.
        pipeline: usize,
    },
    /// A bind group that is not there.
    #[error("draw {draw} names bind group {bind_group}, which the frame does not have")]
    NoBindGroup {
        /// The draw's number.
        draw: usize,
        /// The bind group's number.
        bind_group: usize,
    },
    /// A stream-out target that the pass does not have.
    #[error("draw {draw} streams out to target {target} of {count}")]
    NoStreamOutTarget {
        /// The draw's number.
        draw: usize,
        /// The target's number.
        target: u32,
        /// Targets of the pass.
        count: usize,
    },
    /// Indices, and vertices whose number stream-out gives.
    #[error("draw {draw} has indices and takes its vertices from stream-out")]
    IndexedStreamOut {
        /// The draw's number.
        draw: usize,
    },
    /// A vertex or index buffer that is not there.
    #[error("draw {draw} names buffer {buffer}, which the frame does not have")]
    NoBuffer {
        /// The draw's number.
        draw: usize,
        /// The buffer's number.
        buffer: usize,
    },
    /// A draw fetches from a buffer that its pass writes.
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
    /// A shader reads a buffer that its pass writes.
    #[error("buffer `{buffer}` is read and streamed out to in the same pass")]
    ReadAndStreamedOut {
        /// The buffer's label.
        buffer: String,
    },
}
