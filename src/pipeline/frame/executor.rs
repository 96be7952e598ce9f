//! Executors: the interface of what runs frames, of observers, and of results.

use crate::api::observer::Observer;
use crate::api::pass::PassOutput;
use crate::api::texture::Texture;
use crate::frame::contents::Contents;
use crate::frame::description::{Frame, Pass, TextureId};
use crate::frame::error::FrameError;
use crate::run::device::Device;

/// Observes a frame: every pass, and through [`Observer`] every stage of a pass.
pub trait FrameObserver: Send {
    /// A pass is about to run. To observe its stages, return an observer.
    fn pass_begin(&mut self, index: usize, pass: &Pass) -> Option<&mut dyn Observer>;
    /// A pass has run. `contents` are the frame's textures and buffers after it.
    fn pass_end(&mut self, _index: usize, _pass: &Pass, _contents: &Contents, _output: &PassOutput) {}
}

/// Results of a frame.
#[derive(Debug)]
pub struct FrameOutput<'a> {
    /// The device of the executor, for further work on the textures.
    pub device: &'a Device,
    /// Contents of the frame's textures and buffers after the last pass.
    pub contents: &'a Contents,
    /// Output of each pass, by pass number.
    pub passes: Vec<PassOutput>,
}

impl FrameOutput<'_> {
    /// The contents of a texture.
    #[must_use]
    pub fn texture(&self, id: TextureId) -> &Texture {
        self.contents.texture(id)
    }
}

/// Runs frames.
pub trait Executor: Send {
    /// Runs a frame from its initial contents to its last pass.
    ///
    /// # Errors
    /// If the frame is not valid, exceeds the memory limit, or needs a feature that the executor lacks. Nothing has been drawn then.
    fn run(&mut self, frame: &Frame, observer: Option<&mut dyn FrameObserver>) -> Result<FrameOutput<'_>, FrameError>;
    /// The software GPU of the executor. It runs all of a frame in the CPU executor; elsewhere it runs the stages that the driver lacks.
    fn device(&self) -> &Device;
}
