//! A frame is data: named resources and an ordered list of passes. Techniques build frames; executors run them.
//!
//! [`Frame`] describes textures, buffers, pipelines, bind groups and passes; nothing in it says where it runs. An [`Executor`] runs it;
//! [`CpuExecutor`] does so on `pipeline`. Everything done to a frame (rendering, capture, cross-checking, benchmarking) is done to this description,
//! so every technique gets it for nothing.

mod append;
pub mod cpu;
mod description;
mod memory;

pub use cpu::{CpuExecutor, Executor, FrameError, FrameObserver, FrameOutput, initial_textures, pipelines, run_frame_pass};
pub use description::{
    BindEntry, BindGroup, BindGroupId, BufferId, ColorTarget, DepthTarget, Frame, FrameBuffer, FrameDraw, FrameIndex, FramePass,
    FrameTexture, Initial, PipelineId, TextureId, View,
};
pub use memory::MemoryEstimate;
