//! `light-volumes`: J. Barczak, M. Olano, *Interactive Shadowed Caustics Using Hierarchical Light Volumes*, University of Maryland Baltimore
//! County (BO).
//!
//! Each triangle of the water mesh is swept down its refracted rays through fixed slicing planes. The faces of such a beam are counted in the
//! stencil, so that it differs from a reference exactly where a receiver lies inside; a second draw adds the beam's light there and resets
//! the count. Quadtrees over the water cull and clamp the beams, and occlusion queries against a shadow map cull those in shadow.
//! Files: `slices` (planes, vertices), `boxes`, `reach` (receivers), `hierarchy` (quadtrees, parent beams), `cull` (which beams, between which
//! planes), `shadow` (occlusion queries), `occlusion` (of receivers), `specular` (beams of mirrors and glass), `shaders` (programs), `frame` (passes).
//!
//! Decisions the paper leaves open, in full in `docs/techniques/light-volumes.md`:
//! - E1 two radiometries: `paper` has neither cosine, `physical` conserves flux;
//! - E2 counts go both ways from a reference in the middle, and wrap; bodies are closed; an eye under water counts what lies behind receivers;
//! - E3 light is computed at the receiver, or read from the first face in the order of the index buffer;
//! - E4 a cross-section counts as at least a ten-millionth of its generator;
//! - E5 `physical` has attenuation, `paper` has not;
//! - E6 vectors are clamped after the sum, irradiances beam by beam;
//! - E7 no more is asked below a node where no leaf can be shadowed enough;
//! - E8 what objects under water keep from others is an option beyond the paper;
//! - E9 a shadow's edge is interpolated over one cell of the mesh.

pub mod boxes;
pub mod cull;
mod error;
pub mod frame;
pub mod hierarchy;
pub mod occlusion;
pub mod reach;
mod settings;
pub mod shaders;
pub mod shadow;
pub mod slices;
pub mod specular;

pub use error::LightVolumesError;
pub use settings::{BeamCulling, BeamShadows, EnergyAt, Gather, LightVolumes};

use glam::Vec3;

use nephroid_image::metrics::bounds::{ACCUMULATED, CHAINED, CHAINED_LOOKED_UP, COUNTED, PassBounds, SWEPT};
use nephroid_pipeline::Device;
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::{HeightField, WaterSim};
use nephroid_scene::{Group, Material, Radiometry, Scene, Settings, Shape};

use super::beams::{self, LightBeams};
use super::stage::light::StageLight;
use super::stage::{self, Stage};
use super::{Builder, Feature, LayerSource, Layout, Receivers, RenderError, Resolve, Technique, TechniqueFrame};
use crate::layout;
use boxes::ReceiverBox;
use cull::{Counts, Scope};
use frame::LightPass;
use hierarchy::{Hierarchy, Span};
use reach::Reach;
use shaders::{BeamsUniform, RelightUniform};
use shadow::Shadowed;
use slices::{SliceVertex, Slices};
use specular::Specular;

/// Most beams of a light: each takes 256 bytes of uniforms and two draws at least. A mesh of 1025x1025 vertices has so many.
pub const MAX_BEAMS: u64 = 1 << 21;

/// The technique, as a line of the table.
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
        &[PassBounds {
            pass: "light_volumes",
            vertices: SWEPT,
            textures: &[("beam_count", COUNTED, CHAINED), ("", ACCUMULATED, CHAINED_LOOKED_UP)],
        }]
    }
    fn layouts(&self) -> Vec<Layout> {
        vec![layout!(BeamsUniform: sigma_t, planes), layout!(SliceVertex: plane_y, corner), layout!(RelightUniform: to_light)]
    }
    /// Mirrors and glass with fewer triangles, each of which is drawn by itself.
    fn coarsen(&self, scene: &mut Scene) {
        scene.techniques.edit::<LightVolumes>().generator_edge = 0.5;
        for object in scene.objects.iter_mut().filter(|object| !matches!(object.material, Material::Diffuse { .. })) {
            match &mut object.shape {
                Shape::UvSphere(sphere) => (sphere.slices, sphere.stacks) = (24, 12),
                Shape::TorusKnot(knot) => (knot.segments, knot.sides) = (96, 12),
                Shape::Cylinder(cylinder) => cylinder.slices = 48,
                _ => {}
            }
        }
    }
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError> {
        let settings = scene.techniques.get::<LightVolumes>();
        let receivers = Receivers::new(scene, stage::cut_level(scene, settings.eye_refraction))?;
        let water = scene.water.as_ref().map(|w| w.simulator());
        // Beams from above that meet water are not followed on, so where there is water, it alone makes beams.
        let specular = if water.is_none() { Specular::new(scene, settings.generator_edge)? } else { None };
        let level = match (&scene.water, &specular) {
            (Some(water), _) => Some(water.level_m),
            (None, Some(_)) => Some(f32::INFINITY),
            (None, None) => None,
        };
        let boxes = level.map_or_else(Vec::new, |level| boxes::boxes(&receivers, level));
        Ok(Box::new(Source { receivers, boxes, water, specular, kept: None, clock: || 0.0 }))
    }
}

/// What stays from frame to frame: meshes, their boxes, mirrors and glass, and the water as it was.
struct Source {
    receivers: Receivers,
    boxes: Vec<ReceiverBox>,
    water: Option<WaterSim>,
    specular: Option<Specular>,
    kept: Option<Kept>,
    clock: fn() -> f64,
}

/// What depends on the settings alone.
struct Kept {
    key: (f32, f32, u32, (u32, u32), (u32, u32), u32),
    slices: Slices,
    reaches: Vec<Reach>,
    hierarchy: Hierarchy,
}

/// What came of the beams of all lights.
#[derive(Default)]
struct Tally {
    counts: Counts,
    draws: u64,
    queries: u64,
    leaves_culled: u64,
    beams_shadowed: u64,
    boxes_hidden: u64,
    shadowed_w: f64,
    seconds: Seconds,
}

/// What building the frame took: making beams, asking for shadows, culling with the upkeep of the hierarchy, and making draws.
#[derive(Default)]
struct Seconds {
    beams: f64,
    queries: f64,
    culling: f64,
    draws: f64,
}

/// Adds the time that something takes to a sum.
fn timed<R>(clock: fn() -> f64, sum: &mut f64, work: impl FnOnce() -> R) -> R {
    let start = clock();
    let result = work();
    *sum += clock() - start;
    result
}

impl Builder for Source {
    fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    fn frame(&mut self, scene: &Scene, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let settings = scene.techniques.get::<LightVolumes>();
        let clock = self.clock;
        let view = frame::view(settings);
        check_mesh(scene)?;
        let field = self.water.as_mut().zip(scene.water.as_ref()).map(|(sim, water)| {
            let (columns, rows) = settings.grid.unwrap_or(water.grid);
            sim.surface_with_grid(columns, rows, scene.time_s)
        });
        let mut stage = Stage::new(scene, &self.receivers, &view);
        let targets =
            frame::targets(&mut stage, settings.gather, layers.contains(&"caustic_direction"), layers.contains(&"fragment_count"));
        let mut tally = Tally::default();
        let mut all_beams = Vec::new();
        let mut bottom_y = 0.0;
        if (field.is_none() && self.specular.is_none()) || scene.lights.is_empty() {
            frame::nothing(&mut stage, &targets);
        }
        let mut visible = vec![true; self.boxes.len()];
        if settings.receiver_culling && settings.clamping && settings.culling != BeamCulling::Off {
            let queries = occlusion::Queries { scene, receivers: &self.receivers, boxes: &self.boxes };
            visible = timed(clock, &mut tally.seconds.queries, || queries.ask(device, &mut stage))?;
            tally.boxes_hidden = visible.iter().filter(|visible| !**visible).count() as u64;
        }
        for number in 0..scene.lights.len() {
            let light = stage.light(scene, &self.receivers, &view, number);
            let made = timed(clock, &mut tally.seconds.beams, || self.make_beams(scene, field.as_ref(), number))?;
            let Some(made) = made else { continue };
            let Made { beams, span, .. } = &made;
            let span = *span;
            bottom_y = span.bottom_y;
            let kept = Kept::renew(&mut self.kept, &self.boxes, &self.receivers, scene, &made);
            if settings.culling == BeamCulling::Hierarchical || settings.shadows.culls_leaves() {
                timed(clock, &mut tally.seconds.culling, || kept.hierarchy.update(beams, span));
            }
            let kept = &*kept;
            let shadowed = match &field {
                Some(field) => {
                    let water = Water { field, hierarchy: &kept.hierarchy, span };
                    timed(clock, &mut tally.seconds.queries, || ask(scene, &self.receivers, &water, (number, &light), device, &mut stage))?
                }
                // Rays have told which corners are in shadow.
                None => Shadowed::default(),
            };
            let scope = Scope::new(
                &stage.camera,
                &kept.reaches,
                &visible,
                &kept.slices,
                span,
                settings.clamping && settings.culling != BeamCulling::Off,
            );
            let cull = || match settings.culling {
                BeamCulling::Off => scope.everything(beams, &shadowed.triangles),
                BeamCulling::PerBeam => scope.one_by_one(beams, &shadowed.triangles),
                BeamCulling::Hierarchical => scope.by_hierarchy(beams, &kept.hierarchy, &shadowed.triangles),
            };
            let (drawn, counts) = timed(clock, &mut tally.seconds.culling, cull);
            let pass = LightPass {
                scene,
                number,
                light: &light,
                beams,
                drawn: &drawn,
                slices: &kept.slices,
                eye_inside: stage.camera.water.z > 0.0 || (field.is_none() && scene.camera.position_ws().y < span.top_y),
                in_water: field.is_some(),
            };
            timed(clock, &mut tally.seconds.draws, || pass.add(&mut stage, &targets));
            tally.add(beams, &shadowed, counts, &drawn);
            all_beams.push(made.beams);
        }
        stage.finish(scene, field.as_ref(), &view, targets.caustic);
        let mut layers = stage.layers(scene, targets.caustic);
        let source = |name, texture, channels, resolve| LayerSource { name, texture, channels, resolve };
        layers.extend(targets.direction.map(|texture| source("caustic_direction", texture, 3, Resolve::WeightedMean)));
        layers.extend(targets.count.map(|texture| source("fragment_count", texture, 1, Resolve::Sum)));
        let (generators, sigma_t) = if field.is_some() { ("water", scene.medium.sigma_t()) } else { ("specular", Vec3::ZERO) };
        let mut audit = beams::audit(generators, &all_beams, sigma_t, bottom_y);
        audit.push(("culled_in_shadow".to_owned(), tally.shadowed_w));
        Ok(TechniqueFrame {
            layers,
            margin: stage.margin,
            samples: stage.samples,
            audit,
            seconds: tally.seconds.named(),
            counters: tally.named(&self.receivers, &all_beams),
            frame: stage.frame,
        })
    }
}

/// A light's beams.
struct Made {
    beams: LightBeams,
    span: Span,
    /// Mean height of the surface that makes them, m.
    level: f32,
    /// Columns and rows of vertices of the mesh that has two triangles for each cell.
    grid: (u32, u32),
    buckets: (u32, u32),
    levels: u32,
}

impl Source {
    /// The beams of a light, from the water or from mirrors and glass; `None` if the scene has neither.
    fn make_beams(&self, scene: &Scene, field: Option<&HeightField>, number: usize) -> Result<Option<Made>, RenderError> {
        let settings = scene.techniques.get::<LightVolumes>();
        let light = &scene.lights[number];
        if let (Some(field), Some(water)) = (field, &scene.water) {
            let count = match settings.radiometry {
                Radiometry::Physical => beams::Count::Conserved,
                Radiometry::Paper => beams::Count::OwnTransmittance,
            };
            let beams = beams::light_beams(field, light, water.ior, count);
            let heights = field.heights_ws.iter().fold((water.level_m, water.level_m), |(low, high), &y| (low.min(y), high.max(y)));
            let span = span(scene, &self.receivers, heights);
            let (grid, buckets, levels) = ((field.columns, field.rows), settings.buckets, settings.levels);
            return Ok(Some(Made { beams, span, level: water.level_m, grid, buckets, levels }));
        }
        let Some(specular) = &self.specular else { return Ok(None) };
        let beams = specular.beams(light, settings.radiometry)?;
        let heights = beams.beams.iter().flat_map(|beam| beam.g.map(|g| g.y));
        let heights = heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
        let span = span(scene, &self.receivers, if beams.beams.is_empty() { (0.0, 0.0) } else { heights });
        // One row of cells: a tree over a curve that fills space, cut in two where a quadtree is cut in four.
        let grid = (specular::cells(&beams) + 1, 2);
        let buckets = (settings.buckets.0 * settings.buckets.1, 1);
        Ok(Some(Made { beams, span, level: span.top_y, grid, buckets, levels: 2 * settings.levels }))
    }
}

impl Kept {
    /// What is there already, if it fits, or made anew.
    fn renew<'a>(kept: &'a mut Option<Self>, boxes: &[ReceiverBox], receivers: &Receivers, scene: &Scene, made: &Made) -> &'a mut Self {
        let settings = scene.techniques.get::<LightVolumes>();
        let key = (made.level, made.span.bottom_y, settings.planes, made.grid, made.buckets, made.levels);
        let old = kept.take().filter(|kept| kept.key == key);
        kept.insert(old.unwrap_or_else(|| {
            let slices = Slices::new(made.level, made.span.bottom_y, settings.planes);
            let reaches = reach::reaches(boxes, receivers, &slices, made.span);
            let hierarchy = Hierarchy::new(made.grid, made.buckets, made.levels);
            Self { key, slices, reaches, hierarchy }
        }))
    }
}

/// Refuses a mesh of more beams than there may be, before anything is made of it.
fn check_mesh(scene: &Scene) -> Result<(), RenderError> {
    let Some(water) = &scene.water else { return Ok(()) };
    let (columns, rows) = scene.techniques.get::<LightVolumes>().grid.unwrap_or(water.grid);
    let triangles = 2 * (u64::from(columns) - 1) * (u64::from(rows) - 1);
    if triangles > MAX_BEAMS {
        return Err(LightVolumesError::TooManyBeams { columns, rows, triangles, limit: MAX_BEAMS }.into());
    }
    Ok(())
}

/// Heights between which the beams are, from the least and the greatest of what makes them.
fn span(scene: &Scene, receivers: &Receivers, (low, high): (f32, f32)) -> Span {
    let settings = scene.techniques.get::<LightVolumes>();
    let floor = if receivers.bounds.is_empty() { low } else { receivers.bounds.min.y.min(low) };
    // A body needs some height, even where there is nothing below.
    let bottom_y = floor - settings.depth_below_floor_m.max(1.0e-3 * (1.0 + high.abs()));
    Span { top_y: high, trough_y: low, bottom_y }
}

/// The surface, and its nodes as one light's beams have them.
struct Water<'a> {
    field: &'a HeightField,
    hierarchy: &'a Hierarchy,
    span: Span,
}

/// Shadow culling of one light, if it is wanted and something could cast a shadow.
fn ask(
    scene: &Scene,
    receivers: &Receivers,
    &Water { field, hierarchy, span }: &Water<'_>,
    (number, light): (usize, &StageLight),
    device: &Device,
    stage: &mut Stage,
) -> Result<Shadowed, RenderError> {
    let settings = scene.techniques.get::<LightVolumes>();
    let level = scene.water.as_ref().map_or(0.0, |w| w.level_m);
    let casters: Vec<_> = receivers.air_casters(&scene.lights[number], level).collect();
    let light = &light.uniform;
    let low = span.trough_y;
    let (first, last) = (field.position_ws(0, 0), field.position_ws(field.columns - 1, field.rows - 1));
    let water = Aabb::from_corners(Vec3::new(first.x, low, first.z), Vec3::new(last.x, low, last.z));
    if !settings.shadows.culls_leaves() || !shadow::can_shade(receivers, &casters, light, water) {
        return Ok(Shadowed::default());
    }
    let map_size = settings.shadow_map_size;
    let queries = shadow::Queries { receivers, casters: &casters, field, hierarchy, light, number, map_size };
    queries.ask(device, settings.least_shadow, &mut stage.frame)
}

impl Seconds {
    fn named(&self) -> Vec<(&'static str, f64)> {
        vec![("beams", self.beams), ("queries", self.queries), ("culling", self.culling), ("draws", self.draws)]
    }
}

impl Tally {
    fn add(&mut self, beams: &LightBeams, shadowed: &Shadowed, counts: Counts, drawn: &[cull::Drawn]) {
        self.counts.add(&counts);
        self.draws += drawn.iter().map(|d| 2 * slices::runs(d.slabs).count() as u64).sum::<u64>();
        self.queries += shadowed.queries();
        self.leaves_culled += shadowed.leaves;
        for (triangle, _) in shadowed.triangles.iter().enumerate().filter(|(_, culled)| **culled) {
            let beam = beams.of_triangle[triangle];
            if beam != beams::NONE {
                self.beams_shadowed += 1;
                self.shadowed_w += beams.beams[beam as usize].flux.truncate().as_dvec3().element_sum();
            }
        }
    }

    fn named(&self, receivers: &Receivers, beams: &[LightBeams]) -> Vec<(String, u64)> {
        let Counts { out_of_view, missed, clamped, drawn, beam_tests, node_tests } = self.counts;
        [
            ("receiver_triangles", receivers.triangles),
            ("beams", beams.iter().map(|l| l.beams.len() as u64).sum()),
            ("beams_dark", beams.iter().map(|l| l.dark).sum()),
            ("beams_in_shadow", self.beams_shadowed),
            ("beams_out_of_view", out_of_view),
            ("beams_that_miss", missed),
            ("beams_clamped", clamped),
            ("beams_drawn", drawn),
            ("beam_draws", self.draws),
            ("beam_tests", beam_tests),
            ("node_tests", node_tests),
            ("shadow_queries", self.queries),
            ("leaves_culled", self.leaves_culled),
            ("boxes_hidden", self.boxes_hidden),
        ]
        .map(|(name, count)| (name.to_owned(), count))
        .to_vec()
    }
}
