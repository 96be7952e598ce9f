//! The builder of light-volumes frames, for one scene.

use glam::Vec3;

use nephroid_pipeline::Device;
use nephroid_scene::Scene;
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::{HeightField, WaterSim};

use crate::beams;
use crate::builder::{FrameBuilder, FrameLight, cut_level};
use crate::{Builder, Receivers, RenderError, TechniqueFrame};

use super::boxes::{self, ReceiverBox};
use super::columns::{ReceiverColumns, receiver_columns};
use super::counters::{Counters, Seconds, timed};
use super::cull::Culler;
use super::frame::{self, LightPass};
use super::generators::{GeneratedBeams, Generators, check_mesh};
use super::hierarchy::{Hierarchy, Span};
use super::occlusion;
use super::settings::{BeamCulling, LightVolumes};
use super::shadow::{self, ShadowQueries, Shadowed};
use super::slices::Slices;
use super::specular::Specular;

/// State kept between frames: receivers and their boxes, mirrors and glass, the water simulation, and a cache.
pub struct LightVolumesBuilder {
    receivers: Receivers,
    boxes: Vec<ReceiverBox>,
    water: Option<WaterSim>,
    specular: Option<Specular>,
    cache: Option<Cache>,
    clock: fn() -> f64,
}

/// Data that depends only on the settings and on the heights of the generators.
struct Cache {
    key: CacheKey,
    slices: Slices,
    columns: Vec<ReceiverColumns>,
    hierarchy: Hierarchy,
}

/// The inputs from which the [`Cache`] was made.
#[derive(Clone, Copy, PartialEq)]
struct CacheKey {
    level: f32,
    bottom_y: f32,
    planes: u32,
    grid: (u32, u32),
    buckets: (u32, u32),
    levels: u32,
}

impl LightVolumesBuilder {
    /// Loads the scene's meshes.
    ///
    /// # Errors
    /// If a mesh cannot be made or loaded, or mirrors and glass make too many generators.
    pub fn new(scene: &Scene, settings: &LightVolumes) -> Result<Self, RenderError> {
        let receivers = Receivers::new(scene, cut_level(scene, settings.eye_refraction))?;
        let water = scene.water.as_ref().map(|w| w.simulator());
        // Light of mirrors and glass is not followed through water, so a scene with water has no other generators.
        let specular = if water.is_none() { Specular::new(scene, settings.generator_edge)? } else { None };
        let level = match (&scene.water, &specular) {
            (Some(water), _) => Some(water.level_m),
            (None, Some(_)) => Some(f32::INFINITY),
            (None, None) => None,
        };
        let boxes = level.map_or_else(Vec::new, |level| boxes::boxes(&receivers, level));
        Ok(Self { receivers, boxes, water, specular, cache: None, clock: || 0.0 })
    }

    /// Builds a frame.
    fn build(&mut self, scene: &Scene, settings: &LightVolumes, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        check_mesh(scene, settings)?;
        let Self { receivers, boxes, water, specular, cache, clock } = self;
        let (receivers, clock) = (&*receivers, *clock);
        let field = water.as_mut().zip(scene.water.as_ref()).map(|(sim, water)| {
            let (columns, rows) = settings.grid.unwrap_or(water.grid);
            sim.surface_with_grid(columns, rows, scene.time_s)
        });
        let field = field.as_ref();
        let generators = Generators { scene, settings, receivers, field, specular: specular.as_ref() };
        let mut builder = FrameBuilder::new(scene, receivers, field, &frame::view(settings));
        let targets = frame::targets(&mut builder, settings.gather, layers);
        let (mut counters, mut seconds) = (Counters::default(), Seconds::default());
        if generators.is_empty() || scene.lights.is_empty() {
            frame::clear_irradiance(&mut builder, &targets);
        }
        let clamp = settings.clamping && settings.culling != BeamCulling::Off;
        let mut visible = vec![true; boxes.len()];
        if settings.receiver_culling && clamp {
            visible = timed(clock, &mut seconds.queries, || occlusion::visible_boxes(device, &mut builder, boxes))?;
            counters.boxes_hidden = visible.iter().filter(|visible| !**visible).count() as u64;
        }
        let mut all_beams = Vec::new();
        let mut bottom_y = 0.0;
        builder.lights(|builder, light| {
            let generated = timed(clock, &mut seconds.beams, || generators.beams_of(light.number))?;
            let Some(generated) = generated else { return Ok(()) };
            let GeneratedBeams { beams, span, .. } = &generated;
            bottom_y = span.bottom_y;
            let cache = Cache::renew(cache, boxes, receivers, settings, &generated);
            if settings.culling == BeamCulling::Hierarchical || settings.shadows.culls_leaves() {
                timed(clock, &mut seconds.culling, || cache.hierarchy.update(beams, *span));
            }
            let cache = &*cache;
            let shadowed = match field {
                Some(field) => {
                    let water = WaterNodes { field, hierarchy: &cache.hierarchy, span: *span };
                    timed(clock, &mut seconds.queries, || water.shadowed(builder, light, settings, device))?
                }
                // The paths through mirrors and glass already determine which vertices are in shadow.
                None => Shadowed::default(),
            };
            let culler = Culler::new(&builder.camera, &cache.columns, &visible, &cache.slices, *span, clamp);
            let cull = || match settings.culling {
                BeamCulling::Off => culler.everything(beams, &shadowed.triangles),
                BeamCulling::PerBeam => culler.one_by_one(beams, &shadowed.triangles),
                BeamCulling::Hierarchical => culler.by_hierarchy(beams, &cache.hierarchy, &shadowed.triangles),
            };
            let (accepted, statistics) = timed(clock, &mut seconds.culling, cull);
            let pass = LightPass {
                settings,
                light,
                beams,
                accepted: &accepted,
                slices: &cache.slices,
                eye_inside: builder.camera.water.z > 0.0 || (field.is_none() && scene.camera.position_ws().y < span.top_y),
                in_water: field.is_some(),
            };
            timed(clock, &mut seconds.draws, || pass.add(builder, &targets));
            counters.add(beams, &shadowed, &statistics, &accepted);
            all_beams.push(generated.beams);
            Ok(())
        })?;
        let (name, sigma_t) = if field.is_some() { ("water", scene.medium.sigma_t()) } else { ("specular", Vec3::ZERO) };
        let mut audit = beams::audit(name, &all_beams, sigma_t, bottom_y);
        audit.push(("culled_in_shadow".to_owned(), counters.shadowed_w));
        Ok(TechniqueFrame {
            audit,
            seconds: seconds.named(),
            counters: counters.named(receivers, &all_beams),
            ..builder.finish(targets.caustic.contributions())
        })
    }
}

impl Builder for LightVolumesBuilder {
    fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    fn frame(&mut self, scene: &Scene, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let settings = *scene.techniques.get::<LightVolumes>();
        self.build(scene, &settings, device, layers)
    }
}

impl Cache {
    /// Returns the cache, made anew if its inputs have changed.
    fn renew<'a>(
        cache: &'a mut Option<Self>,
        boxes: &[ReceiverBox],
        receivers: &Receivers,
        settings: &LightVolumes,
        generated: &GeneratedBeams,
    ) -> &'a mut Self {
        let &GeneratedBeams { span, level, grid, buckets, levels, .. } = generated;
        let key = CacheKey { level, bottom_y: span.bottom_y, planes: settings.planes, grid, buckets, levels };
        let old = cache.take().filter(|cache| cache.key == key);
        cache.insert(old.unwrap_or_else(|| {
            let slices = Slices::new(level, span.bottom_y, settings.planes);
            let columns = receiver_columns(boxes, receivers, &slices, span);
            let hierarchy = Hierarchy::new(grid, buckets, levels);
            Self { key, slices, columns, hierarchy }
        }))
    }
}

/// The water surface, and its nodes fitted to one light's beams.
struct WaterNodes<'a> {
    field: &'a HeightField,
    hierarchy: &'a Hierarchy,
    span: Span,
}

impl WaterNodes<'_> {
    /// Shadow culling for one light, if it is enabled and an object could cast a shadow on the water.
    fn shadowed(
        &self,
        builder: &mut FrameBuilder<'_>,
        light: &FrameLight,
        settings: &LightVolumes,
        device: &Device,
    ) -> Result<Shadowed, RenderError> {
        let &Self { field, hierarchy, span } = self;
        let (scene, receivers) = (builder.scene, builder.receivers);
        let level = scene.water.as_ref().map_or(0.0, |w| w.level_m);
        let casters: Vec<_> = receivers.air_casters(&scene.lights[light.number], level).collect();
        let low = span.trough_y;
        let (first, last) = (field.position_ws(0, 0), field.position_ws(field.columns - 1, field.rows - 1));
        let water = Aabb::from_corners(Vec3::new(first.x, low, first.z), Vec3::new(last.x, low, last.z));
        if !settings.shadows.culls_leaves() || !shadow::can_shade(receivers, &casters, &light.uniform, water) {
            return Ok(Shadowed::default());
        }
        let map_size = settings.shadow_map_size;
        let queries =
            ShadowQueries { receivers, casters: &casters, field, hierarchy, light: &light.uniform, number: light.number, map_size };
        Ok(queries.ask(device, settings.least_shadow, &mut builder.frame)?)
    }
}
