//! What a technique is: all that the command line, the reports and the tests ask of one.

use nephroid_pipeline::Device;
use nephroid_scene::{Scene, Settings};

use super::bounds::PassBounds;
use super::features::Feature;
use super::layout::Layout;
use super::{RenderError, TechniqueFrame};

/// A technique: one line of [`TECHNIQUES`](super::TECHNIQUES).
pub trait Technique: Sync {
    /// Name everywhere: code, command line, documentation.
    fn name(&self) -> &'static str;
    /// What it does, in one line.
    fn summary(&self) -> &'static str;
    /// The paper.
    fn paper(&self) -> &'static str;
    /// The defaults of its settings, and with them their table.
    fn settings(&self) -> &'static dyn Settings;
    /// Whether it draws what a scene asks for.
    fn covers(&self, feature: Feature) -> bool;
    /// How far a driver may be from the software GPU in its own passes.
    fn bounds(&self) -> &'static [PassBounds];
    /// The structs that its own programs share with their WGSL twins.
    fn layouts(&self) -> Vec<Layout>;
    /// Prepares what does not change from frame to frame. Called on the device's threads.
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError>;

    /// Settings that tests and the cross-check run: the scene's own, and the paper's.
    fn variants(&self) -> Vec<Variant> {
        vec![Variant { name: "", settings: None }, Variant { name: "paper", settings: Some(self.settings().paper()) }]
    }

    /// Makes those parts of a scene coarser for which it would draw more than a test has time for, beyond what
    /// [`Settings::coarsen`] does.
    fn coarsen(&self, _scene: &mut Scene) {}
}

impl dyn Technique {
    /// What the scene asks for and the technique does not draw.
    pub fn lacks(&self, scene: &Scene) -> Vec<Feature> {
        Feature::ALL.into_iter().filter(|feature| feature.is_asked_by(scene) && !self.covers(*feature)).collect()
    }
}

/// Builds the frames of one scene with one technique.
pub trait Builder: Send {
    /// Sets the clock (seconds) that times the parts of building a frame; without one all times are zero.
    fn set_clock(&mut self, _clock: fn() -> f64) {}
    /// Builds the frame of a scene that differs from the prepared one at most in time, lights, camera and medium. Called on the device's threads.
    fn frame(&mut self, scene: &Scene, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError>;
}

/// Settings of a technique under a name.
#[derive(Debug)]
pub struct Variant {
    /// The name; empty for the scene's own settings.
    pub name: &'static str,
    /// The settings; none for those that the scene has.
    pub settings: Option<Box<dyn Settings>>,
}

impl Variant {
    /// Gives a scene these settings.
    pub fn apply(&self, scene: &mut Scene) {
        if let Some(settings) = &self.settings {
            scene.techniques.replace(settings.clone());
        }
    }

    /// Name of a technique in these settings, such as `paint:paper`.
    #[must_use]
    pub fn label(&self, technique: &dyn Technique) -> String {
        let colon = if self.name.is_empty() { "" } else { ":" };
        format!("{}{colon}{}", technique.name(), self.name)
    }
}
