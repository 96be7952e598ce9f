//! A frame is data: named resources and an ordered list of passes. Techniques build frames; executors run them.
//!
//! [`Frame`] describes textures, buffers, pipelines, bind groups and passes, independent of where it runs. An [`Executor`] runs it; [`CpuExecutor`]
//! does so on the software GPU. Rendering, capture, cross-check and benchmarks all take this description, so every technique has all of them without
//! code of its own.

mod append;
pub(crate) mod check;
pub(crate) mod contents;
mod cpu;
pub(crate) mod description;
pub(crate) mod error;
pub(crate) mod executor;
mod memory;
pub(crate) mod resolve;

pub use check::{check_memory, check_references};
pub use contents::{Contents, Streamed, cleared_first};
pub use cpu::CpuExecutor;
pub use description::{
    AttachmentView, BindEntry, BindGroup, BindGroupId, BufferId, ColorAttachment, DepthStencilAttachment, Draw, Frame, FrameBuffer,
    FrameIndex, FrameTexture, Initial, Pass, PipelineId, StreamOut, TextureId, TextureView,
};
pub use error::{BindGroupProblem, FrameError, ReferenceProblem};
pub use executor::{Executor, FrameObserver, FrameOutput};
pub use memory::MemoryEstimate;
pub use resolve::{pipelines, run_frame_pass, stream_draw, stream_draws, target_size};
