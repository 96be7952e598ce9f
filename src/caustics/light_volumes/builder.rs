//! The builder of light-volumes frames, for one scene.

use std::sync::Arc;

use glam::Vec3;

use nephroid_pipeline::Device;
use nephroid_scene::Scene;
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::{HeightField, WaterSim};

use crate::audit::Audit;
use crate::beams::{BeamTally, LightBeams};
use crate::builder::{FrameBuilder, FrameLight, cut_level};
use crate::{Builder, Receivers, RenderError, Tally, TechniqueFrame};

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
    /// Receivers below the generators.
    below: Below,
    /// As `below`, upside down: receivers above the water. Made for the first light in the water.
    above: Option<(Receivers, Below)>,
    water: Option<WaterSim>,
    specular: Option<Specular>,
    clock: fn() -> f64,
}

/// The receivers that beams of one side can reach.
struct Below {
    /// Height below which boxes hold all receivers, m.
    top_y: f32,
    boxes: Vec<ReceiverBox>,
    cache: Option<Cache>,
}

impl Below {
    const NOTHING: Self = Self { top_y: f32::NEG_INFINITY, boxes: Vec::new(), cache: None };

    /// Makes boxes of all receivers below the generators' greatest height, unless they are there. Waves that rise later find room.
    fn reach(&mut self, receivers: &Receivers, level_y: f32, top_y: f32) {
        if top_y > self.top_y {
            let top_y = if top_y > level_y { top_y + (top_y - level_y) * 0.5 } else { top_y };
            *self = Self { top_y, boxes: boxes::boxes(receivers, top_y), cache: None };
        }
    }
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
        Ok(Self { receivers, below: Below::NOTHING, above: None, water, specular, clock: || 0.0 })
    }

    /// Builds a frame.
    fn build(&mut self, scene: &Scene, settings: &LightVolumes, device: &Device, layers: &[&str]) -> Result<TechniqueFrame, RenderError> {
        check_mesh(scene, settings)?;
        let Self { receivers, below, above, water, specular, clock } = self;
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
        match (field, &scene.water) {
            (Some(field), Some(water)) => below.reach(receivers, water.level_m, field.height_range_ws().1.max(water.level_m)),
            _ if !generators.is_empty() => below.reach(receivers, f32::INFINITY, f32::INFINITY),
            _ => {}
        }
        let mut visible = vec![true; below.boxes.len()];
        if settings.receiver_culling && clamp {
            visible = timed(clock, &mut seconds.queries, || occlusion::visible_boxes(device, &mut builder, &below.boxes))?;
            counters.boxes_hidden = visible.iter().filter(|visible| !**visible).count() as u64;
        }
        let mut all_beams: Vec<Arc<LightBeams>> = Vec::new();
        let (mut audit, mut tallies) = (Audit::default(), Vec::new());
        builder.lights(|builder, light| {
            let generated = timed(clock, &mut seconds.beams, || generators.beams_of(light))?;
            let Some(generated) = generated else { return Ok(()) };
            let GeneratedBeams { beams, span, .. } = &generated;
            let up = beams.side < 0.0;
            let (receivers, Below { boxes, cache, .. }) = if up {
                let (receivers, above) = above.get_or_insert_with(|| (receivers.upside_down(), Below::NOTHING));
                above.reach(receivers, generated.level, span.top_y);
                (&*receivers, above)
            } else {
                (receivers, &mut *below)
            };
            let seen = if up { vec![true; boxes.len()] } else { visible.clone() };
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
            let culler = Culler::new((&builder.camera, beams.side), &cache.columns, &seen, &cache.slices, *span, clamp);
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
                eye_inside: up || builder.camera.water.z > 0.0 || (field.is_none() && scene.camera.position_ws().y < span.top_y),
                by_water: field.is_some(),
            };
            timed(clock, &mut seconds.draws, || pass.add(builder, &targets));
            counters.add(beams, &shadowed, &statistics, &accepted);
            audit.merge(&beams.energy);
            if field.is_some() {
                let (sigma_t, bottom_y) = (frame::sigma_t(settings, beams), span.bottom_y);
                let tally = builder.beam_tally(light, beams.clone(), sigma_t, bottom_y);
                tallies.push(Tally::Beams(Box::new(BeamTally { culled: shadowed.beams(beams), ..tally })));
            }
            all_beams.push(generated.beams);
            Ok(())
        })?;
        let mut frame = builder.finish(targets.caustic.contributions());
        frame.tallies.extend(tallies);
        Ok(TechniqueFrame { audit, seconds: seconds.named(), counters: counters.named(receivers, &all_beams), ..frame })
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
        let low = span.trough_y;
        let casters: Vec<_> = receivers.casters(&scene.lights[light.number], low).collect();
        let (first, last) = (field.position_ws(0, 0), field.position_ws(field.columns - 1, field.rows - 1));
        let water = Aabb::from_corners(Vec3::new(first.x, low, first.z), Vec3::new(last.x, low, last.z));
        // The queries' map is one view, above the water.
        let one_view = light.uniform.cube.w == 0.0 && !light.in_water;
        if !settings.shadows.culls_leaves() || !one_view || !shadow::can_shade(receivers, &casters, &light.uniform, water) {
            return Ok(Shadowed::default());
        }
        let map_size = settings.shadow_map_size;
        let queries =
            ShadowQueries { receivers, casters: &casters, field, hierarchy, light: &light.uniform, number: light.number, map_size };
        Ok(queries.ask(device, settings.least_shadow, &mut builder.frame)?)
    }
}
