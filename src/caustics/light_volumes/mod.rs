//! `light-volumes`: J. Barczak, M. Olano, *Interactive Shadowed Caustics Using Hierarchical Light Volumes*, University of Maryland Baltimore
//! County (BO).
//!
//! Each triangle of the water mesh is swept down its refracted rays through fixed slicing planes. The faces of such a beam are counted in the
//! stencil, which then differs from a reference exactly where a receiver lies inside of the beam. A second draw adds the beam's light there and
//! resets the count. Quadtrees over the water cull and clamp the beams, and occlusion queries against a shadow map cull those in shadow.
//!
//! | File | What |
//! |---|---|
//! | `builder` | builds frames: the order of all steps below |
//! | `generators`, `specular` | beams of the water, of mirrors and glass |
//! | `slices` | slicing planes and dummy vertices |
//! | `boxes`, `columns` | receivers that beams are clamped to |
//! | `hierarchy`, `cull` | quadtrees and parent beams; which beams are drawn, between which planes |
//! | `shadow`, `occlusion` | occlusion queries: beams in shadow, receivers that others hide |
//! | `frame`, `shaders` | passes and programs |
//! | `counters` | counters and times |
//!
//! Decisions where the paper leaves a choice, in full in `docs/techniques/light-volumes.md`:
//! - E1 two radiometries: `paper` has neither cosine, `physical` conserves flux;
//! - E2 counts go both ways from a reference in the middle, and wrap; bodies are closed; for an eye under water, faces behind receivers count;
//! - E3 light is computed at the receiver, or read from the first face in the order of the index buffer;
//! - E4 a cross-section counts as at least a ten-millionth of its generator;
//! - E5 `physical` has attenuation, `paper` has none;
//! - E6 vectors are clamped after the sum, irradiances beam by beam;
//! - E7 nodes are not queried below a node where no leaf can be in shadow enough;
//! - E7 below a node where no leaf can reach the shadow ratio for culling, no node is queried;
//! - E9 a shadow's edge is interpolated over one cell of the mesh.

pub mod boxes;
mod builder;
pub mod columns;
mod counters;
pub mod cull;
mod error;
pub mod frame;
mod generators;
pub mod hierarchy;
pub mod occlusion;
mod settings;
pub mod shaders;
pub mod shadow;
pub mod slices;
pub mod specular;

pub use error::LightVolumesError;
pub use settings::{BeamCulling, BeamShadows, EnergyAt, Gather, LightVolumes};

use nephroid_image::metrics::bounds::{ACCUMULATED, COUNTED, OWN_BEAMS, PassBounds, SHADED, SWEPT, VERTEX};
use nephroid_scene::{Group, Material, Part, Scene, Settings, Shape};

use super::account::DRAW_BYTES;
use super::beams::{self, Beam};
use super::{Builder, Feature, Layout, RenderError, Technique};
use crate::layout;
use builder::LightVolumesBuilder;
use shaders::{BeamSlot, BeamsUniform, RelightUniform};
use slices::SliceVertex;

/// Most beams of a light. Each takes 256 bytes of uniforms and at least two draws. A mesh of 1025x1025 vertices makes this many.
pub const MAX_BEAMS: u64 = 1 << 21;

/// Triangles of a mirror or a body of glass, over the square of its size in edges; and beams of each triangle: the estimates of an account.
const GENERATORS_PER_EDGE: u64 = 8;
const BEAMS_PER_GENERATOR: u64 = 5;

/// The technique, as a row of the table.
pub const TECHNIQUE: &dyn Technique = &LightVolumesTechnique;

struct LightVolumesTechnique;

impl Technique for LightVolumesTechnique {
    fn name(&self) -> &'static str {
        "light-volumes"
    }
    fn summary(&self) -> &'static str {
        "beams of light counted in the stencil one by one, culled and clamped down quadtrees over the water"
    }
    fn paper(&self) -> &'static str {
        "Barczak & Olano, Interactive Shadowed Caustics Using Hierarchical Light Volumes"
    }
    fn settings(&self) -> &'static dyn Settings {
        LightVolumes::DEFAULTS
    }
    fn covers(&self, feature: Feature) -> bool {
        matches!(feature, Feature::WaterCaustics | Feature::SpecularCaustics)
    }
    fn bounds(&self) -> &'static [PassBounds] {
        &[
            PassBounds {
                pass: "light_volumes",
                vertices: SWEPT,
                textures: &[("beam_count", COUNTED, OWN_BEAMS), ("", ACCUMULATED, OWN_BEAMS)],
            },
            PassBounds { pass: "relight", vertices: VERTEX, textures: &[("", SHADED, SHADED)] },
        ]
    }
    fn layouts(&self) -> Vec<Layout> {
        vec![layout!(BeamsUniform: sigma_t, planes, space), layout!(SliceVertex: plane_y, corner), layout!(RelightUniform: to_light)]
    }
    /// Reduces the triangles of mirrors and glass, because each of them makes a beam that is drawn separately.
    fn coarsen(&self, scene: &mut Scene) {
        scene.techniques.edit::<LightVolumes>().generator_edge = 0.5;
        for object in scene.objects.iter_mut().filter(|object| !matches!(object.material, Material::Diffuse { .. })) {
            match &mut object.shape {
                Shape::UvSphere(sphere) => (sphere.slices, sphere.stacks) = (24, 12),
                Shape::TorusKnot(knot) => (knot.segments, knot.sides) = (96, 12),
                Shape::Cylinder(cylinder) => cylinder.slices = 48,
                Shape::Lathe(lathe) => (lathe.steps, lathe.slices) = (1, 32),
                Shape::Figure(figure) => figure.resolution = 24,
                _ => {}
            }
        }
    }
    fn grid(&self, scene: &Scene) -> Option<(u32, u32)> {
        let grid = scene.techniques.get::<LightVolumes>().grid;
        scene.water.as_ref().map(|water| grid.unwrap_or(water.grid))
    }
    fn memory(&self, scene: &Scene) -> Vec<Part> {
        let settings = scene.techniques.get::<LightVolumes>();
        // Each beam has a slot, an entry in the list of accepted ones, and at least two draws.
        let extra = (size_of::<BeamSlot>() + size_of::<cull::ClampedBeam>()) as u64 + 2 * DRAW_BYTES;
        if let Some(grid) = self.grid(scene) {
            let bytes = beams::memory_bytes(grid, scene.lights.len(), extra);
            return vec![Part { what: "beams", bytes, lower: "water.grid or light_volumes.grid".to_owned() }];
        }
        let side = (1.0 / f64::from(settings.generator_edge)).ceil() as u64;
        let cut = GENERATORS_PER_EDGE * side * side * BEAMS_PER_GENERATOR;
        let specular = (0..scene.objects.len()).filter(|&object| !matches!(scene.objects[object].material, Material::Diffuse { .. }));
        let beams: u64 = specular.map(|object| cut.max(scene.triangle_estimate(object)).min(MAX_BEAMS)).sum();
        let bytes = beams * scene.lights.len() as u64 * (extra + DRAW_BYTES / 2 + size_of::<Beam>() as u64);
        vec![Part { what: "beams", bytes, lower: "the number of mirrors and glass; raise light_volumes.generator_edge".to_owned() }]
    }
    fn sketch(&self, scene: &mut Scene) {
        let settings = scene.techniques.edit::<LightVolumes>();
        (settings.grid, settings.receiver_culling, settings.shadows) = (Some((2, 2)), false, BeamShadows::Off);
        settings.generator_edge = 1.0;
    }
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError> {
        Ok(Box::new(LightVolumesBuilder::new(scene, scene.techniques.get::<LightVolumes>())?))
    }
}
