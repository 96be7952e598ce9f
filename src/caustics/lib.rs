//! The techniques: each builds frames from a scene. One table, [`TECHNIQUES`], drives the command line, the reports and the tests.

pub mod beams;
pub mod builder;
pub mod caustic_volumes;
mod layers;
pub mod light_volumes;
pub mod passes;
pub mod readback;
mod receivers;

pub use receivers::{ReceiverGroup, Receivers};

use nephroid_image::LayerSet;
use nephroid_pipeline::frame::{CpuExecutor, Executor, Frame, FrameError, FrameObserver};
use nephroid_pipeline::{Device, DeviceError, DeviceOptions, PassOutput};
use nephroid_scene::{Scene, SceneError};

/// A technique: one line of [`TECHNIQUES`].
pub trait Technique: Sync {
    /// Name everywhere: code, command line, documentation.
    fn name(&self) -> &'static str;
    /// What it does, in one line.
    fn summary(&self) -> &'static str;
    /// The paper.
    fn paper(&self) -> &'static str;
    /// Prepares what does not change from frame to frame. Called on the device's threads.
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn FrameSource>, RenderError>;
}

/// Builds the frames of one scene with one technique.
pub trait FrameSource: Send {
    /// Gives it a clock, in seconds, to say with what parts of building a frame take; without one they take none.
    fn set_clock(&mut self, _clock: fn() -> f64) {}
    /// Builds the frame of a scene that differs from the prepared one at most in time, lights, camera and medium. Called on the device's threads.
    fn frame(&mut self, scene: &Scene, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError>;
}

/// A frame and how to read its results.
pub struct TechniqueFrame {
    /// The frame.
    pub frame: Frame,
    /// Where each layer comes from.
    pub layers: Vec<LayerSource>,
    /// Pixels beyond each edge of the picture, in samples.
    pub margin: u32,
    /// Samples along a pixel's side.
    pub samples: u32,
    /// Energy audit so far, in watts summed over RGB unless the name says otherwise.
    pub audit: Vec<(String, f64)>,
    /// Counters so far.
    pub counters: Vec<(String, u64)>,
    /// Seconds that parts of building the frame took, by the clock given: of this run on this machine, and no part of the result.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Where a layer comes from.
#[derive(Clone, Debug)]
pub struct LayerSource {
    /// Name of the layer.
    pub name: &'static str,
    /// The texture.
    pub texture: nephroid_pipeline::frame::TextureId,
    /// Channels of it.
    pub channels: usize,
    /// How samples become a pixel, and what else is done to them.
    pub read: LayerRead,
}

/// How samples become a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LayerRead {
    /// Their mean.
    Mean,
    /// Their sum.
    Sum,
    /// The sample next to the pixel's centre.
    Nearest,
    /// The mean vector, divided by its fourth channel: a mean weighted by it.
    WeightedMean,
    /// Distance of the nearest sample's position along the view axis, given as origin and direction; infinite where w = 0.
    Depth(glam::Vec3, glam::Vec3),
}

/// All techniques.
pub const TECHNIQUES: &[&dyn Technique] = &[&caustic_volumes::CausticVolumesTechnique, &light_volumes::LightVolumesTechnique];

/// Why a picture cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No technique of that name.
    #[error("there is no technique `{seen}`; there are: {known}")]
    UnknownTechnique {
        /// The name seen.
        seen: String,
        /// The names known.
        known: String,
    },
    /// No layer of that name.
    #[error("`{technique}` has no layer or attachment `{seen}`; there are: {known}")]
    UnknownLayer {
        /// The technique.
        technique: &'static str,
        /// The name seen.
        seen: String,
        /// The names known.
        known: String,
    },
    /// More beams than a technique can draw one by one.
    #[error(
        "light-volumes draws each beam by itself: a grid of {columns}x{rows} makes {triangles} of them, at most {limit} are allowed; lower `light_volumes.grid`"
    )]
    TooManyBeams {
        /// Columns of vertices of the water mesh.
        columns: u32,
        /// Rows of vertices.
        rows: u32,
        /// Its triangles.
        triangles: u64,
        /// Most there may be.
        limit: u64,
    },
    /// The same, of mirrors and glass.
    #[error("light-volumes draws each beam by itself: `{object}` makes more than {limit} of them; raise `light_volumes.generator_edge`")]
    TooManyGenerators {
        /// Name of the object.
        object: String,
        /// Most there may be.
        limit: u64,
    },
    /// A mesh of the scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The frame cannot run.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The threads cannot be started.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The result cannot be held as layers.
    #[error(transparent)]
    Layer(#[from] nephroid_image::LayerError),
}

/// How to render.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Name of the technique. Default: `caustic-volumes`.
    pub technique: String,
    /// Threads, level, bins. Default: the machine's.
    pub device: DeviceOptions,
    /// Most bytes that a frame may take. Default: 4 GiB.
    pub memory_limit_bytes: u64,
    /// Names of the layers wanted: standard ones, or `pass/attachment`; `None` for all standard ones. Default: `None`.
    pub layers: Option<Vec<String>>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { technique: TECHNIQUES[0].name().to_owned(), device: DeviceOptions::default(), memory_limit_bytes: 4 << 30, layers: None }
    }
}

/// A finished picture.
#[derive(Debug)]
pub struct Rendered {
    /// The layers asked for.
    pub layers: LayerSet,
    /// What was counted, in the order of the frame.
    pub counters: Vec<(String, u64)>,
    /// Where the light went, in watts summed over RGB.
    pub audit: Vec<(String, f64)>,
    /// Per pass: its label and what it counted.
    pub passes: Vec<(String, PassOutput)>,
}

/// Renders frames of one scene. Keeps what does not change between them.
pub struct Renderer {
    technique: &'static dyn Technique,
    executor: Box<dyn Executor>,
    source: Box<dyn FrameSource>,
    layers: Option<Vec<String>>,
}

/// Finds a technique by name.
pub fn technique(name: &str) -> Result<&'static dyn Technique, RenderError> {
    let known = || TECHNIQUES.iter().map(|t| t.name()).collect::<Vec<_>>().join(", ");
    let found = TECHNIQUES.iter().find(|t| t.name() == name).copied();
    found.ok_or_else(|| RenderError::UnknownTechnique { seen: name.to_owned(), known: known() })
}

impl Renderer {
    /// Loads meshes and starts threads.
    pub fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, RenderError> {
        // Leave room for the resources under a tight limit: bins work in waves and need little.
        let mut device = options.device;
        device.bin_budget_bytes = device.bin_budget_bytes.min((options.memory_limit_bytes / 4) as usize);
        let executor = CpuExecutor::new(Device::new(device)?, options.memory_limit_bytes);
        Self::with_executor(scene, options, Box::new(executor))
    }

    /// Loads meshes; frames run on the executor, whose device and memory limit are used instead of those of the options.
    pub fn with_executor(scene: &Scene, options: &RenderOptions, executor: Box<dyn Executor>) -> Result<Self, RenderError> {
        let technique = technique(&options.technique)?;
        let source = executor.device().install(|| technique.prepare(scene))?;
        Ok(Self { technique, executor, source, layers: options.layers.clone() })
    }

    /// Gives the technique a clock, in seconds: see [`TechniqueFrame::seconds`].
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.source.set_clock(clock);
    }

    /// Names of the layers that are wanted.
    fn wanted(&self) -> Vec<&str> {
        match &self.layers {
            Some(names) => names.iter().map(String::as_str).collect(),
            None => nephroid_image::STANDARD_LAYERS.iter().map(|l| l.name).collect(),
        }
    }

    fn built(&mut self, scene: &Scene, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let (source, device) = (&mut self.source, self.executor.device());
        device.install(|| source.frame(scene, device, layers))
    }

    /// Builds the frame of a scene without running it.
    pub fn build(&mut self, scene: &Scene) -> Result<TechniqueFrame, RenderError> {
        let wanted: Vec<String> = self.wanted().iter().map(|s| (*s).to_owned()).collect();
        let wanted: Vec<&str> = wanted.iter().map(String::as_str).collect();
        self.built(scene, &wanted)
    }

    /// Renders a picture and its layers.
    pub fn render(&mut self, scene: &Scene, observer: Option<&mut dyn FrameObserver>) -> Result<Rendered, RenderError> {
        let built = self.build(scene)?;
        self.check_layers(&built)?;
        let output = self.executor.run(&built.frame, observer)?;
        let names = self.layers.as_deref();
        let layers = output.device.install(|| layers::extract(&built, &output, names))?;
        let mut counters = built.counters;
        let mut passes = Vec::with_capacity(output.passes.len());
        for (pass, result) in built.frame.passes.iter().zip(output.passes) {
            counters.extend(result.statistics.named().iter().filter(|c| c.1 > 0).map(|c| (format!("{}/{}", pass.label, c.0), c.1)));
            passes.push((pass.label.clone(), result));
        }
        Ok(Rendered { layers, counters, audit: built.audit, passes })
    }

    /// Runs the frame without reading anything back: what a frame costs. Returns what was run.
    pub fn run(&mut self, scene: &Scene, observer: Option<&mut dyn FrameObserver>) -> Result<TechniqueFrame, RenderError> {
        let built = self.built(scene, &["color"])?;
        self.executor.run(&built.frame, observer)?;
        Ok(built)
    }

    fn check_layers(&self, built: &TechniqueFrame) -> Result<(), RenderError> {
        for seen in self.layers.iter().flatten() {
            let standard = built.layers.iter().any(|l| l.name == *seen);
            if !standard && layers::attachment(&built.frame, seen).is_none() {
                let mut known: Vec<String> = built.layers.iter().map(|l| l.name.to_owned()).collect();
                known.extend(layers::attachment_names(&built.frame));
                return Err(RenderError::UnknownLayer { technique: self.technique.name(), seen: seen.clone(), known: known.join(", ") });
            }
        }
        Ok(())
    }
}
