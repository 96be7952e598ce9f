//! The renderer: frames of one scene by one technique.

use nephroid_image::LayerSet;
use nephroid_pipeline::frame::{CpuExecutor, Executor, FrameObserver};
use nephroid_pipeline::{Device, DeviceOptions, PassOutput};
use nephroid_scene::{Object, Scene};

use super::account::account;
use super::technique::{Builder, Technique};
use super::{RenderError, TECHNIQUES, TechniqueFrame, Techniques, layers, tally};

/// Options of rendering.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Name of the technique. Default: the first of [`TECHNIQUES`].
    pub technique: String,
    /// The techniques to choose from. Default: [`TECHNIQUES`].
    pub techniques: Techniques,
    /// Threads, SIMD level and bin budget. Default: the machine's threads and level.
    pub device: DeviceOptions,
    /// Largest memory of a frame, bytes. Default: 4 GiB.
    pub memory_limit_bytes: u64,
    /// Names of the wanted layers: standard layers, or `pass/attachment`; `None` for all standard layers. Default: `None`.
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

/// The results of one frame.
#[derive(Debug)]
pub struct Rendered {
    /// The wanted layers.
    pub layers: LayerSet,
    /// Counters: those of frame building, then those of the passes in order.
    pub counters: Vec<(String, u64)>,
    /// Energy audit, in watts summed over RGB and lights: names of [`crate::audit::ENTRIES`].
    pub audit: Vec<(String, f64)>,
    /// Label and output of each pass.
    pub passes: Vec<(String, PassOutput)>,
}

/// Renders frames of one scene with one technique. Data that frames share is kept. A scene far from the origin is drawn at the origin
/// ([`Scene::settled`]); the layer `position` is where the scene is.
pub struct Renderer {
    technique: &'static dyn Technique,
    executor: Box<dyn Executor>,
    builder: Box<dyn Builder>,
    layers: Option<Vec<String>>,
    /// The objects that the builder was prepared for.
    objects: Vec<Object>,
}

impl Renderer {
    /// Loads the scene's meshes and starts worker threads.
    ///
    /// # Errors
    /// If the technique is unknown, the frame would take more memory than its limit, a mesh cannot be loaded, the technique refuses the scene, or the threads
    /// cannot be started.
    pub fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, RenderError> {
        // Under a tight memory limit, leave room for the resources: bins work in waves and need little.
        let mut device = options.device;
        device.bin_budget_bytes = device.bin_budget_bytes.min((options.memory_limit_bytes / 4) as usize);
        let executor = CpuExecutor::new(Device::new(device)?, options.memory_limit_bytes);
        Self::with_executor(scene, options, Box::new(executor))
    }

    /// Loads the scene's meshes. Frames run on `executor`; the device options in `options` are ignored.
    ///
    /// # Errors
    /// If the technique is unknown, the frame would take more memory than its limit, a mesh cannot be loaded, or the technique refuses the scene.
    pub fn with_executor(scene: &Scene, options: &RenderOptions, executor: Box<dyn Executor>) -> Result<Self, RenderError> {
        let technique = options.techniques.find(&options.technique)?;
        let scene = scene.settled()?;
        let layers: Vec<&str> = match &options.layers {
            Some(names) => names.iter().map(String::as_str).collect(),
            None => nephroid_image::STANDARD_LAYERS.iter().map(|l| l.name).collect(),
        };
        account(technique, &scene, executor.device(), &layers).check(options.memory_limit_bytes)?;
        let builder = executor.device().install(|| technique.prepare(&scene))?;
        Ok(Self { technique, executor, builder, layers: options.layers.clone(), objects: scene.objects.clone() })
    }

    /// Sets the clock (seconds) that times frame building, see [`TechniqueFrame::seconds`].
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.builder.set_clock(clock);
    }

    /// Names of the wanted layers.
    fn wanted(&self) -> Vec<&str> {
        match &self.layers {
            Some(names) => names.iter().map(String::as_str).collect(),
            None => nephroid_image::STANDARD_LAYERS.iter().map(|l| l.name).collect(),
        }
    }

    fn built(&mut self, scene: &Scene, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let scene = &*scene.settled()?;
        if self.objects != scene.objects {
            let technique = self.technique;
            self.builder = self.executor.device().install(|| technique.prepare(scene))?;
            self.objects.clone_from(&scene.objects);
        }
        let (builder, device) = (&mut self.builder, self.executor.device());
        device.install(|| builder.frame(scene, device, layers))
    }

    /// Builds the frame of a scene without running it. The scene may differ from the loaded one in time, lights, camera, medium,
    /// and places of objects, for which all meshes are loaded again.
    ///
    /// # Errors
    /// If the technique cannot build the frame.
    pub fn build(&mut self, scene: &Scene) -> Result<TechniqueFrame, RenderError> {
        let wanted: Vec<String> = self.wanted().iter().map(|s| (*s).to_owned()).collect();
        let wanted: Vec<&str> = wanted.iter().map(String::as_str).collect();
        self.built(scene, &wanted)
    }

    /// Renders a picture and its layers.
    ///
    /// # Errors
    /// If the frame cannot be built or run, or if it lacks a wanted layer.
    pub fn render(&mut self, scene: &Scene, observer: Option<&mut dyn FrameObserver>) -> Result<Rendered, RenderError> {
        let built = self.build(scene)?;
        self.check_layers(&built)?;
        let output = self.executor.run(&built.frame, observer)?;
        let names = self.layers.as_deref();
        let mut layers = output.device.install(|| layers::extract(&built, &output, names))?;
        layers.move_positions((scene.settled()?.origin - scene.origin).to_array());
        let (tallied, audited) = output.device.install(|| tally::count(&built.tallies, &output));
        let mut counters = built.counters;
        counters.extend(tallied);
        let mut passes = Vec::with_capacity(output.passes.len());
        for (pass, result) in built.frame.passes.iter().zip(output.passes) {
            counters.extend(result.statistics.named().iter().filter(|c| c.1 > 0).map(|c| (format!("{}/{}", pass.label, c.0), c.1)));
            passes.push((pass.label.clone(), result));
        }
        let mut audit = built.audit;
        audit.merge(&audited);
        Ok(Rendered { layers, counters, audit: audit.named(), passes })
    }

    /// Runs a frame without reading results back, to measure its cost. Returns the frame.
    ///
    /// # Errors
    /// If the frame cannot be built or run.
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
