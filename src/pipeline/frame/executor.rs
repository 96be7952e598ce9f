//! Executors: what runs frames, what watches them, and what they leave behind.

use crate::api::observer::Observer;
use crate::api::pass::PassOutput;
use crate::api::texture::Texture;
use crate::frame::contents::Contents;
use crate::frame::description::{Frame, Pass, TextureId};
use crate::frame::error::FrameError;
use crate::run::device::Device;

/// Sees every pass of a frame, and through [`Observer`] every stage of it.
pub trait FrameObserver: Send {
    /// A pass is about to run. Return an observer to see inside of it.
    fn pass_begin(&mut self, index: usize, pass: &Pass) -> Option<&mut dyn Observer>;
    /// A pass has run; `contents` are as it left them.
    fn pass_end(&mut self, _index: usize, _pass: &Pass, _contents: &Contents, _output: &PassOutput) {}
}

/// What a frame left behind.
#[derive(Debug)]
pub struct FrameOutput<'a> {
    /// The device of the executor, for work on the textures.
    pub device: &'a Device,
    /// What the frame's textures and buffers hold.
    pub contents: &'a Contents,
    /// By pass number.
    pub passes: Vec<PassOutput>,
}

impl FrameOutput<'_> {
    /// A texture.
    #[must_use]
    pub fn texture(&self, id: TextureId) -> &Texture {
        self.contents.texture(id)
    }
}

/// Something that runs frames.
pub trait Executor: Send {
    /// Runs a frame from its initial contents to its last pass.
    ///
    /// # Errors
    /// If the frame is not valid, too large, or asks for what the executor does not have; nothing has been drawn then.
    fn run(&mut self, frame: &Frame, observer: Option<&mut dyn FrameObserver>) -> Result<FrameOutput<'_>, FrameError>;
    /// The software GPU: all of a CPU executor, elsewhere what runs the stages that the driver lacks.
    fn device(&self) -> &Device;
}
