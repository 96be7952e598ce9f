//! `caustic-volumes`: C. Sandberg, T. Falemo, *Real-Time Rendering of Water Caustics Using Programmable Graphics Hardware*,
//! Chalmers 2005 (SF05).
//!
//! The water surface is a mesh; each of its triangles and the three refracted rays of its corners bound a volume of light. Drawn additively over
//! the receivers, a volume lights those pixels whose receiver lies inside it, by flux over cross-section. Cost depends on the
//! volumes' pixels, not on the receivers. Files: `hull` (the tight body), `shaders` (point in volume,
//! illumination), `frame` (the passes).
//!
//! Decisions the paper leaves open, in full in `docs/techniques/caustic-volumes.md`:
//! - E1 two radiometries: `paper` has neither cosine, `physical` conserves flux;
//! - E2 the tight body is the convex hull of the six corners;
//! - E3 an eye under water draws back faces with the depth test turned round;
//! - E4 I₀ is one number per light in `paper`, per triangle in `physical`;
//! - E5 a cross-section that is turned over behind a focus is inside where all edges are negative;
//! - E6 shadows, above and under water, are options beyond the paper.

pub mod frame;
pub mod hull;
mod settings;
pub mod shaders;

pub use settings::{CausticVolumes, Faces};

use nephroid_image::metrics::bounds::{ACCUMULATED, CHAINED, CHAINED_LOOKED_UP, COUNTED, PassBounds, VERTEX};
use nephroid_pipeline::Device;
use nephroid_scene::water::WaterSim;
use nephroid_scene::{Group, Radiometry, Scene, Settings};

use super::{Builder, Feature, LayerSource, Layout, Receivers, RenderError, Resolve, Technique, TechniqueFrame, beams, stage};
use crate::layout;
use shaders::VolumeUniform;

/// The technique, as a line of the table.
pub const TECHNIQUE: &dyn Technique = &CausticVolumesTechnique;

struct CausticVolumesTechnique;

impl Technique for CausticVolumesTechnique {
    fn name(&self) -> &'static str {
        "caustic-volumes"
    }
    fn summary(&self) -> &'static str {
        "one volume of light per triangle of the water mesh, drawn additively over the receivers"
    }
    fn paper(&self) -> &'static str {
        "Sandberg & Falemo 2005, Real-Time Rendering of Water Caustics Using Programmable Graphics Hardware"
    }
    fn settings(&self) -> &'static dyn Settings {
        CausticVolumes::DEFAULTS
    }
    fn covers(&self, feature: Feature) -> bool {
        feature == Feature::WaterCaustics
    }
    fn bounds(&self) -> &'static [PassBounds] {
        &[PassBounds {
            pass: "caustic_volumes",
            vertices: VERTEX,
            textures: &[("volume_count", COUNTED, CHAINED), ("", ACCUMULATED, CHAINED_LOOKED_UP)],
        }]
    }
    fn layouts(&self) -> Vec<Layout> {
        vec![layout!(VolumeUniform: shape, sigma_t)]
    }
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError> {
        let settings = scene.techniques.get::<CausticVolumes>();
        let receivers = Receivers::new(scene, stage::cut_level(scene, settings.eye_refraction))?;
        Ok(Box::new(Source { receivers, water: scene.water.as_ref().map(|w| w.simulator()) }))
    }
}

/// What stays from frame to frame: meshes, and the water as it was.
struct Source {
    receivers: Receivers,
    water: Option<WaterSim>,
}

impl Builder for Source {
    fn frame(&mut self, scene: &Scene, _device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let settings = scene.techniques.get::<CausticVolumes>();
        let field = self.water.as_mut().zip(scene.water.as_ref()).map(|(sim, water)| {
            let (columns, rows) = settings.grid.unwrap_or(water.grid);
            sim.surface_with_grid(columns, rows, scene.time_s)
        });
        let ior = scene.water.as_ref().map_or(1.0, |w| w.ior);
        let count = match settings.radiometry {
            Radiometry::Physical => beams::Count::Conserved,
            Radiometry::Paper => beams::Count::FlatTransmittance,
        };
        let beams: Vec<_> = match &field {
            Some(field) => scene.lights.iter().map(|light| beams::light_beams(field, light, ior, count)).collect(),
            None => Vec::new(),
        };
        let built = frame::build(&frame::Inputs {
            scene,
            receivers: &self.receivers,
            water: field.as_ref(),
            beams: &beams,
            direction: layers.contains(&"caustic_direction"),
            counts: layers.contains(&"fragment_count"),
        });
        let frame::Built { stage, bottom_y, targets } = built;
        let mut layers = stage.layers(scene, targets.caustic);
        let source = |name, texture, channels, resolve| LayerSource { name, texture, channels, resolve };
        layers.extend(targets.direction.map(|texture| source("caustic_direction", texture, 3, Resolve::WeightedMean)));
        layers.extend(targets.count.map(|texture| source("fragment_count", texture, 1, Resolve::Sum)));
        Ok(TechniqueFrame {
            layers,
            margin: stage.margin,
            samples: stage.samples,
            seconds: Vec::new(),
            audit: beams::audit("water", &beams, scene.medium.sigma_t(), bottom_y),
            counters: counters(&self.receivers, &beams),
            frame: stage.frame,
        })
    }
}

fn counters(receivers: &Receivers, beams: &[beams::LightBeams]) -> Vec<(String, u64)> {
    let entry = |name: &str, count| (name.to_owned(), count);
    vec![
        entry("receiver_triangles", receivers.triangles),
        entry("beams", beams.iter().map(|l| l.beams.len() as u64).sum()),
        entry("beams_dark", beams.iter().map(|l| l.dark).sum()),
    ]
}
