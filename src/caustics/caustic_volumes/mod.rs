//! `caustic-volumes`: C. Sandberg, T. Falemo, *Real-Time Rendering of Water Caustics Using Programmable Graphics Hardware*,
//! Chalmers 2005 (SF05).
//!
//! The water surface is a mesh. Each of its triangles and the three refracted rays of its vertices bound a volume of light. Volumes are drawn
//! additively over the receivers and light those pixels whose receiver lies inside, by flux over cross-section. Cost depends on the
//! volumes' pixels, not on the receivers. Files: `hull` (the tight body), `needle` (sections narrower than a pixel), `shaders` (point in
//! volume, illumination), `frame` (the passes).
//!
//! Decisions where the paper leaves a choice, in full in `docs/techniques/caustic-volumes.md`:
//! - E1 two radiometries: `paper` has neither cosine, `physical` conserves flux;
//! - E2 the tight body is the convex hull of the six vertices;
//! - E3 for an eye under water, back faces are drawn with the reversed depth test;
//! - E4 I₀ is one number per light in `paper`, per triangle in `physical`;
//! - E5 behind a focus the cross-section has the opposite orientation: its inside is where all edge functions are negative;
//! - E6 shadows, above and under water, are options beyond the paper;
//! - E7 a section at a focus that is narrower than a pixel gives it its mean.

pub mod frame;
pub mod hull;
mod needle;
mod settings;
pub mod shaders;

pub use settings::{CausticVolumes, Faces};

use nephroid_image::metrics::bounds::{ACCUMULATED, COUNTED, OWN_BEAMS, PassBounds, VERTEX};
use nephroid_pipeline::Device;
use nephroid_scene::Scene;
use nephroid_scene::water::WaterSim;
use nephroid_scene::{Group, Part, Settings};

use super::beams::{self, Beam};
use super::builder::cut_level;
use super::{Builder, Feature, Layout, Receivers, RenderError, Technique, TechniqueFrame};
use crate::layout;
use shaders::VolumeUniform;

/// The technique, as a row of the table.
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
            textures: &[("volume_count", COUNTED, OWN_BEAMS), ("", ACCUMULATED, OWN_BEAMS)],
        }]
    }
    fn layouts(&self) -> Vec<Layout> {
        vec![layout!(VolumeUniform: shape, sigma_t)]
    }
    fn grid(&self, scene: &Scene) -> Option<(u32, u32)> {
        let grid = scene.techniques.get::<CausticVolumes>().grid;
        scene.water.as_ref().map(|water| grid.unwrap_or(water.grid))
    }
    fn memory(&self, scene: &Scene) -> Vec<Part> {
        let (columns, rows) = self.grid(scene).unwrap_or_default();
        // Beams of all lights are kept, and those of each are in a buffer.
        let bytes = beams::memory_bytes((columns, rows), scene.lights.len(), size_of::<Beam>() as u64);
        vec![Part { what: "beams", bytes, lower: "water.grid or caustic_volumes.grid".to_owned() }]
    }
    fn sketch(&self, scene: &mut Scene) {
        scene.techniques.edit::<CausticVolumes>().grid = Some((2, 2));
    }
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError> {
        let settings = scene.techniques.get::<CausticVolumes>();
        let receivers = Receivers::new(scene, cut_level(scene, settings.eye_refraction))?;
        Ok(Box::new(CausticVolumesBuilder { receivers, water: scene.water.as_ref().map(|w| w.simulator()) }))
    }
}

/// State kept between frames: the receivers and the simulation of the water.
struct CausticVolumesBuilder {
    receivers: Receivers,
    water: Option<WaterSim>,
}

impl Builder for CausticVolumesBuilder {
    fn frame(&mut self, scene: &Scene, _device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let settings = scene.techniques.get::<CausticVolumes>();
        let field = self.water.as_mut().zip(scene.water.as_ref()).map(|(sim, water)| {
            let (columns, rows) = settings.grid.unwrap_or(water.grid);
            sim.surface_with_grid(columns, rows, scene.time_s)
        });
        frame::build(scene, &self.receivers, field.as_ref(), layers, settings)
    }
}
