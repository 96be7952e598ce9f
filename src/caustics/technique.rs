//! The interface of techniques: all that the command line, the reports and the tests ask for.

use nephroid_pipeline::Device;
use nephroid_scene::{Part, Scene, Settings};

use super::bounds::PassBounds;
use super::features::Feature;
use super::layout::Layout;
use super::{RenderError, TechniqueFrame};

/// A technique: one row of [`TECHNIQUES`](super::TECHNIQUES).
pub trait Technique: Sync {
    /// The name in code, on the command line and in the documentation.
    fn name(&self) -> &'static str;
    /// A description in one line.
    fn summary(&self) -> &'static str;
    /// The paper that it implements.
    fn paper(&self) -> &'static str;
    /// Its settings at their defaults; their rows are the technique's table of settings.
    fn settings(&self) -> &'static dyn Settings;
    /// Whether it draws a kind of light that a scene contains.
    fn covers(&self, feature: Feature) -> bool;
    /// Bounds on the difference between a driver and the software GPU in its own passes.
    fn bounds(&self) -> &'static [PassBounds];
    /// The structs that its own programs share with their WGSL twins.
    fn layouts(&self) -> Vec<Layout>;
    /// Prepares data that frames share. Called on the device's threads.
    ///
    /// # Errors
    /// If a mesh cannot be made or loaded, or the technique refuses the scene.
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError>;

    /// The settings that tests and the cross-check run: the scene's own, and the paper's.
    fn variants(&self) -> Vec<Variant> {
        vec![Variant { name: "", settings: None }, Variant { name: "paper", settings: Some(self.settings().paper()) }]
    }

    /// Columns and rows of vertices of the water's mesh.
    fn grid(&self, scene: &Scene) -> Option<(u32, u32)> {
        scene.water.as_ref().map(|water| water.grid)
    }

    /// What frames take besides textures, meshes and the water's surface, by the numbers of vertices, beams and photons.
    fn memory(&self, _scene: &Scene) -> Vec<Part> {
        Vec::new()
    }

    /// Turns off what needs more than sizes of textures to be known: for the [account](super::account::account) of memory, which builds the frame of a scene without detail.
    fn sketch(&self, _scene: &mut Scene) {}

    /// Makes parts of a scene coarser that would take too long in a test, in addition to [`Settings::coarsen`].
    fn coarsen(&self, _scene: &mut Scene) {}
}

impl dyn Technique {
    /// The kinds of light that the scene contains and the technique does not draw.
    pub fn lacks(&self, scene: &Scene) -> Vec<Feature> {
        Feature::ALL.into_iter().filter(|feature| feature.is_asked_by(scene) && !self.covers(*feature)).collect()
    }
}

/// Builds the frames of one scene with one technique.
pub trait Builder: Send {
    /// Sets the clock (seconds) that times the parts of frame building. Without one, all times are zero.
    fn set_clock(&mut self, _clock: fn() -> f64) {}
    /// Builds the frame of a scene that differs from the prepared one at most in time, lights, camera and medium. Called on the device's threads.
    ///
    /// # Errors
    /// If the technique refuses the scene, or a query cannot run.
    fn frame(&mut self, scene: &Scene, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError>;
}

/// Named settings of a technique.
#[derive(Debug)]
pub struct Variant {
    /// The name; empty for the scene's own settings.
    pub name: &'static str,
    /// The settings; `None` for the scene's own.
    pub settings: Option<Box<dyn Settings>>,
}

impl Variant {
    /// Replaces a scene's settings by these, if there are any.
    pub fn apply(&self, scene: &mut Scene) {
        if let Some(settings) = &self.settings {
            scene.techniques.replace(settings.clone());
        }
    }

    /// Name of a technique with these settings, such as `paint:paper`.
    #[must_use]
    pub fn label(&self, technique: &dyn Technique) -> String {
        let colon = if self.name.is_empty() { "" } else { ":" };
        format!("{}{colon}{}", technique.name(), self.name)
    }
}
