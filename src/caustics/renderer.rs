//! Renders frames of one scene with one technique.

use nephroid_image::LayerSet;
use nephroid_pipeline::frame::{CpuExecutor, Executor, FrameObserver};
use nephroid_pipeline::{Device, DeviceOptions, PassOutput};
use nephroid_scene::Scene;

use super::technique::{Builder, Technique};
use super::{RenderError, TECHNIQUES, TechniqueFrame, Techniques, layers};

/// How to render.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Name of the technique. Default: the first of [`TECHNIQUES`].
    pub technique: String,
    /// The techniques to choose from. Default: [`TECHNIQUES`].
    pub techniques: Techniques,
    /// Threads, level, bins. Default: the machine's.
    pub device: DeviceOptions,
    /// Most bytes that a frame may take. Default: 4 GiB.
    pub memory_limit_bytes: u64,
    /// Names of the layers wanted: standard ones, or `pass/attachment`; `None` for all standard ones. Default: `None`.
    pub layers: Option<Vec<String>>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            technique: TECHNIQUES[0].name().to_owned(),
            techniques: TECHNIQUES,
            device: DeviceOptions::default(),
            memory_limit_bytes: 4 << 30,
            layers: None,
        }
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
    builder: Box<dyn Builder>,
    layers: Option<Vec<String>>,
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
        let technique = options.techniques.find(&options.technique)?;
        let builder = executor.device().install(|| technique.prepare(scene))?;
        Ok(Self { technique, executor, builder, layers: options.layers.clone() })
    }

    /// Gives the technique a clock, in seconds: see [`TechniqueFrame::seconds`].
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.builder.set_clock(clock);
    }

    /// Names of the layers that are wanted.
    fn wanted(&self) -> Vec<&str> {
        match &self.layers {
            Some(names) => names.iter().map(String::as_str).collect(),
            None => nephroid_image::STANDARD_LAYERS.iter().map(|l| l.name).collect(),
        }
    }

    fn built(&mut self, scene: &Scene, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let (builder, device) = (&mut self.builder, self.executor.device());
        device.install(|| builder.frame(scene, device, layers))
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
