//! The loop over lights: direct light and shadow maps of each light.

use std::sync::Arc;

use glam::{Mat4, Vec3, Vec4};

use crate::passes::shadow_map::{LightUniform, refracted_under_flat_water};
use crate::passes::{fullscreen, light, shadow_map};
use crate::receivers::ReceiverGroup;
use crate::{Receivers, RenderError};
use nephroid_pipeline::frame::{BindEntry, BufferId, DepthStencilAttachment, Draw, Pass, TextureId};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::shader::Program;
use nephroid_pipeline::state::{ADDITIVE, CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::geom::Aabb;
use nephroid_scene::{Light, Scene};

use super::FrameBuilder;
use super::state::{clear, clear_or_keep, depth_state, target};

/// A light of the frame.
pub struct FrameLight {
    /// The light's number in the scene.
    pub number: usize,
    /// The light and its shadow maps, as a uniform.
    pub uniform: LightUniform,
    /// Buffer with the uniform.
    pub buffer: BufferId,
    /// Shadow map through air; one texel of depth 1 if [`super::ViewOptions::surface_shadows`] is off.
    pub air_map: TextureId,
}

/// Receivers that a light shines on, and where its light is written.
#[derive(Clone, Copy)]
pub(super) struct Lit {
    /// Uniform buffer of the camera that sees them.
    pub camera: BufferId,
    /// World position.
    pub position: TextureId,
    /// Normal.
    pub normal: TextureId,
    /// Direct irradiance, summed over lights.
    pub direct: TextureId,
    /// Visibility under water, if it is wanted.
    pub visibility: Option<TextureId>,
}

impl FrameLight {
    /// Whether this is the first light, so that its passes clear the sums over lights.
    #[must_use]
    pub fn is_first(&self) -> bool {
        self.number == 0
    }
}

impl FrameBuilder<'_> {
    /// For each light in turn: draws its shadow maps and its direct light, then lets `technique` add passes of its own. Until the next light is
    /// drawn, the texture [`FrameBuilder::visibility`] belongs to this light.
    ///
    /// # Errors
    /// The first error of `technique`.
    pub fn lights(&mut self, mut technique: impl FnMut(&mut Self, &FrameLight) -> Result<(), RenderError>) -> Result<(), RenderError> {
        for number in 0..self.scene.lights.len() {
            let light = self.light(number);
            technique(self, &light)?;
        }
        Ok(())
    }

    /// Draws the shadow maps of a light and its direct irradiance.
    fn light(&mut self, number: usize) -> FrameLight {
        let (scene, receivers, view) = (self.scene, self.receivers, self.view);
        let uniform = light_uniform(scene, &scene.lights[number], receivers);
        let buffer = self.uniform(&format!("light {number}"), &uniform);
        let wet = scene.water.is_some();
        let size = view.shadow_map_size;
        let level = scene.water.as_ref().map_or(0.0, |w| w.level_m);
        let casters: Vec<_> = receivers.air_casters(&scene.lights[number], level).collect();
        let air = (view.surface_shadows.then_some(size), casters.as_slice());
        let air_map = self.map(format!("shadow_map_air {number}"), shadow_map::air_program, buffer, air);
        let all: Vec<_> = receivers.groups.iter().filter(|g| !g.indices.is_empty()).collect();
        let under = ((view.underwater_shadows && wet).then_some(size), all.as_slice());
        let water_map = self.map(format!("shadow_map_water {number}"), shadow_map::water_program, buffer, under);
        let lit = Lit {
            camera: self.camera_buffer,
            position: self.position,
            normal: self.normal,
            direct: self.direct,
            visibility: Some(self.visibility),
        };
        let light = FrameLight { number, uniform, buffer, air_map };
        self.light_pass(format!("light {number}"), &light, water_map, lit);
        if let Some(lit) = self.lit_surroundings() {
            self.light_pass(format!("surroundings light {number}"), &light, water_map, lit);
        }
        light
    }

    /// Adds a light's direct irradiance on receivers.
    fn light_pass(&mut self, label: String, light: &FrameLight, water_map: TextureId, lit: Lit) {
        let bindings = self.frame.bind_group(vec![
            BindEntry::Uniform(lit.camera, 0),
            BindEntry::Uniform(light.buffer, 0),
            BindEntry::texture(lit.position),
            BindEntry::texture(lit.normal),
            BindEntry::texture(light.air_map),
            BindEntry::texture(water_map),
            BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
        ]);
        let mut targets = vec![target(TextureFormat::Rgba32Float, Some(ADDITIVE))];
        let mut color = vec![clear_or_keep(lit.direct, light.is_first())];
        if let Some(visibility) = lit.visibility {
            targets.push(target(TextureFormat::R32Float, None));
            color.push(clear(visibility));
        }
        let program = light::program(self.view.surface_shadows, self.view.underwater_shadows);
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor { targets, ..RenderPipelineDescriptor::new("light", program) });
        let draws = vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)];
        self.frame.passes.push(Pass { label, color, draws, ..Pass::default() });
    }

    /// Draws a shadow map of `size` texels along a side with the given casters; without a size, one texel of depth 1.
    fn map(
        &mut self,
        label: String,
        program: fn() -> Arc<Program>,
        light: BufferId,
        (size, casters): (Option<u32>, &[&ReceiverGroup]),
    ) -> TextureId {
        let side = size.unwrap_or(1);
        let texture = self.frame.texture(TextureDescriptor::d2(label.clone(), side, side, TextureFormat::Depth32Float));
        let bias = DepthBiasState { constant: 64, slope_scale: 2.5, clamp: 0.0 };
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: Some(depth_state(TextureFormat::Depth32Float, CompareFunction::Less, true, bias)),
            ..RenderPipelineDescriptor::new(label.clone(), program())
        });
        let mut draws = Vec::new();
        if size.is_some() {
            let bindings = self.frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(self.vertices)]);
            draws.extend(casters.iter().map(|g| Draw::new(pipeline, bindings, g.indices.clone()).indexed(self.indices)));
        }
        let depth = Some(DepthStencilAttachment { view: texture.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        self.frame.passes.push(Pass { label, depth_stencil: depth, draws, ..Pass::default() });
        texture
    }
}

/// The uniform of a light.
fn light_uniform(scene: &Scene, light: &Light, receivers: &Receivers) -> LightUniform {
    let water = scene.water.as_ref();
    let level = water.map_or(0.0, |w| w.level_m);
    let ior = water.map_or(1.0, |w| w.ior);
    let mut bounds = receivers.bounds;
    if let Some(w) = water {
        bounds = bounds.including(Vec3::new(w.min_ws().x, level, w.min_ws().y)).including(Vec3::new(w.max_ws().x, level, w.max_ws().y));
    }
    let (position_ws, intensity, spot, inner) = match *light {
        Light::Directional { irradiance, .. } => {
            (light.incident(Vec3::ZERO).direction_ws.extend(0.0), irradiance, Vec4::new(0.0, 0.0, 0.0, -2.0), 0.0)
        }
        Light::Point { position, intensity } => (position.extend(1.0), intensity, Vec4::new(0.0, 0.0, 0.0, -2.0), 0.0),
        Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
            let cos = |deg| nephroid_math::space::sin_cos_deg(deg).1 as f32;
            (position.extend(1.0), intensity, direction.normalize().extend(cos(outer_deg)), cos(inner_deg))
        }
    };
    let refracted = refracted_under_flat_water(light.incident(bounds.center()).direction_ws, ior);
    let min = water.map_or(bounds.min, |w| Vec3::new(w.min_ws().x, level, w.min_ws().y));
    let max = water.map_or(bounds.max, |w| Vec3::new(w.max_ws().x, level, w.max_ws().y));
    let depth = (level - bounds.min.y).max(1.0e-3) * 1.01;
    LightUniform {
        clip_from_world: light_matrix(light, bounds),
        position_ws,
        intensity: intensity.extend(0.0),
        spot,
        water: Vec4::new(inner, level, ior, depth),
        entry: Vec4::new(min.x, min.z, (max.x - min.x).max(1.0e-3), (max.z - min.z).max(1.0e-3)),
        refracted: refracted.extend(0.0),
    }
}

/// Clip space of the light's map through air, around `bounds`: orthographic for directional light, otherwise a perspective from the light's position
/// towards the centre of `bounds`.
fn light_matrix(light: &Light, bounds: Aabb) -> Mat4 {
    let centre = bounds.center();
    let radius = (bounds.size().length() * 0.5).max(1.0e-3);
    let incident = light.incident(centre);
    let side = |direction: Vec3| if direction.y.abs() > 0.99 { Vec3::X } else { Vec3::Y };
    match *light {
        Light::Directional { .. } => {
            let direction = incident.direction_ws;
            let view = nephroid_math::space::look_to(centre - direction * (2.0 * radius), direction, side(direction)).unwrap_or_default();
            let half = Vec3::new(radius, radius, 0.0);
            let min = Vec3::new(-half.x, -half.y, -3.0 * radius);
            let max = Vec3::new(half.x, half.y, -radius);
            nephroid_math::space::orthographic(min, max).unwrap_or_default() * view
        }
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let to = centre - position;
            let distance = to.length().max(1.0e-3);
            let direction = to / distance;
            let view = nephroid_math::space::look_to(position, direction, side(direction)).unwrap_or_default();
            // Wide enough for the bounding sphere of everything, at most 160 degrees.
            let half_angle = if distance > radius { libm::asin(f64::from(radius / distance)) as f32 } else { 1.4 };
            let near = (distance - radius).max(distance * 1.0e-2);
            let projection = nephroid_math::space::perspective((2.0 * half_angle).clamp(0.02, 2.8), 1.0, near, distance + radius);
            projection.unwrap_or_default() * view
        }
    }
}
