//! The loop over lights: direct light and shadow maps of each light.

use std::ops::Range;
use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::RenderError;
use crate::beams::{BeamTally, LightBeams, window};
use crate::passes::shadow_map::{LightUniform, refracted_at_flat_water};
use crate::passes::{fullscreen, light, shadow_map};
use crate::receivers::ReceiverGroup;
use nephroid_pipeline::frame::{BindEntry, BindGroupId, BufferId, DepthStencilAttachment, Draw, Pass, TextureId};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::shader::Program;
use nephroid_pipeline::state::{ADDITIVE, CompareFunction, DepthBiasState, PixelRect, TextureFormat, Viewport};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::Light;
use nephroid_scene::water::HeightField;

use super::FrameBuilder;
use super::refine::{Refined, refined};
use super::shadow_view::ShadowView;
use super::state::{clear, clear_or_keep, depth_state, target};

/// A light of the frame.
pub struct FrameLight {
    /// The light's number in the scene.
    pub number: usize,
    /// Whether the light is in the water, so that its caustics are above it.
    pub in_water: bool,
    /// The light and its shadow maps, as a uniform.
    pub uniform: LightUniform,
    /// Buffer with the uniform.
    pub buffer: BufferId,
    /// Shadow map of straight rays; one texel of depth 1 if [`super::ViewOptions::surface_shadows`] is off.
    pub straight_map: TextureId,
    /// Shadow map through the surface; one texel of depth 1 if [`super::ViewOptions::underwater_shadows`] is off, or without water.
    pub refracted_map: TextureId,
}

/// Triangles that cast shadows.
#[derive(Clone)]
struct Casters {
    vertices: BufferId,
    /// 32-bit indices; `None` for vertices in order.
    indices: Option<BufferId>,
    range: Range<u32>,
}

/// A view that is drawn into a shadow map.
struct MapView {
    /// The light's uniform.
    light: BufferId,
    /// Its part of the map; `None` for all of it.
    part: Option<PixelRect>,
    casters: Vec<Casters>,
}

/// Receivers that a light shines on, and where its light is written.
#[derive(Clone, Copy)]
pub(super) struct Lit {
    /// World position.
    pub position: TextureId,
    /// Normal.
    pub normal: TextureId,
    /// Albedo, which tells whether they are under water.
    pub albedo: TextureId,
    /// Direct irradiance, summed over lights.
    pub direct: TextureId,
    /// Visibility through the water's surface, if it is wanted.
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

    /// What the audit counts of a light's beams through the water's surface, once the frame has run.
    #[must_use]
    pub fn beam_tally(&self, light: &FrameLight, beams: Arc<LightBeams>, sigma_t: Vec3, bottom_y: f32) -> BeamTally {
        let shadows = self.view.shadows(light.in_water);
        BeamTally {
            beams,
            light: light.uniform,
            straight: shadows.straight.then_some(light.straight_map),
            refracted: shadows.refracted.then_some(light.refracted_map),
            sigma_t,
            bottom_y,
            culled: Vec::new(),
        }
    }

    /// Draws the shadow maps of a light and its direct irradiance.
    fn light(&mut self, number: usize) -> FrameLight {
        let (scene, receivers, view) = (self.scene, self.receivers, self.view);
        let in_water = is_in_water(&scene.lights[number], self.water);
        let uniform = self.light_uniform(number, in_water);
        let buffer = self.uniform(&format!("light {number}"), &uniform);
        let trough = self.water.map_or(f32::NEG_INFINITY, |water| water.height_range_ws().0);
        let casters: Vec<_> = receivers.casters(&scene.lights[number], trough).collect();
        let shadows = view.shadows(in_water);
        let straight_map = self.straight_map(number, &uniform, buffer, if shadows.straight { &casters } else { &[] });
        let all: Vec<_> = receivers.groups.iter().filter(|g| !g.indices.is_empty()).collect();
        let beyond = if shadows.refracted && self.water.is_some() { &all[..] } else { &[] };
        let refracted_map = self.refracted_map(number, in_water, buffer, beyond);
        let lit = Lit {
            position: self.position,
            normal: self.normal,
            albedo: self.albedo,
            direct: self.direct,
            visibility: Some(self.visibility),
        };
        let light = FrameLight { number, in_water, uniform, buffer, straight_map, refracted_map };
        self.light_pass(format!("light {number}"), &light, refracted_map, lit);
        if let Some(lit) = self.lit_surroundings() {
            self.light_pass(format!("surroundings light {number}"), &light, refracted_map, lit);
        }
        light
    }

    /// Adds a light's direct irradiance on receivers.
    fn light_pass(&mut self, label: String, light: &FrameLight, refracted_map: TextureId, lit: Lit) {
        let bindings = self.frame.bind_group(vec![
            BindEntry::Uniform(light.buffer, 0),
            BindEntry::texture(lit.position),
            BindEntry::texture(lit.normal),
            BindEntry::texture(lit.albedo),
            BindEntry::texture(light.straight_map),
            BindEntry::texture(refracted_map),
            BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
            BindEntry::Uniform(self.camera_buffer, 0),
            BindEntry::texture(self.heights),
        ]);
        let mut targets = vec![target(TextureFormat::Rgba32Float, Some(ADDITIVE))];
        let mut color = vec![clear_or_keep(lit.direct, light.is_first())];
        if let Some(visibility) = lit.visibility {
            targets.push(target(TextureFormat::R32Float, None));
            color.push(clear(visibility));
        }
        let program = light::program(self.view.shadows(light.in_water));
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor { targets, ..RenderPipelineDescriptor::new("light", program) });
        let draws = vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)];
        self.frame.passes.push(Pass { label, color, draws, ..Pass::default() });
    }

    /// Draws the map of straight rays: one view, or the six faces of a cube. Without casters it is one texel of depth 1.
    fn straight_map(&mut self, number: usize, uniform: &LightUniform, light: BufferId, groups: &[&ReceiverGroup]) -> TextureId {
        let (label, program) = (format!("shadow_map_straight {number}"), shadow_map::straight_program());
        let casters = self.casters(groups);
        let (face, side) = (uniform.cube.w as u32, self.view.shadow_map_size);
        if casters.is_empty() {
            return self.shadow_map(label, program, (1, 1), &[]);
        }
        if face == 0 {
            return self.shadow_map(label, program, (side, side), &[MapView { light, part: None, casters }]);
        }
        let mut faces = Vec::with_capacity(6);
        for (column, row) in (0..6).map(|k| (k % 3, k / 3)) {
            let light = self.uniform(&format!("light {number} face {column} {row}"), &uniform.with_face(column, row));
            let part = PixelRect::at([column as u32 * face, row as u32 * face], face, face);
            faces.push(MapView { light, part: Some(part), casters: casters.clone() });
        }
        self.shadow_map(label, program, (3 * face, 2 * face), &faces)
    }

    /// Draws the map through the surface; without casters one texel of depth 1. In it a lamp bends straight edges.
    fn refracted_map(&mut self, number: usize, in_water: bool, light: BufferId, groups: &[&ReceiverGroup]) -> TextureId {
        let (label, program) = (format!("shadow_map_refracted {number}"), shadow_map::refracted_program());
        if groups.is_empty() {
            return self.shadow_map(label, program, (1, 1), &[]);
        }
        let casters = match self.scene.lights[number] {
            Light::Directional { .. } => self.casters(groups),
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                let Refined { whole, parts } =
                    refined(self.receivers, groups, position, self.water.filter(|_| in_water).map(|water| water.height_range_ws().0));
                let mut casters = Vec::new();
                if !whole.is_empty() {
                    let range = 0..whole.len() as u32;
                    let indices = self.frame.buffer(format!("casters {number}"), Arc::new(Buffer::from_slice(&whole)));
                    casters.push(Casters { vertices: self.vertices, indices: Some(indices), range });
                }
                if !parts.is_empty() {
                    let range = 0..parts.len() as u32;
                    let vertices = self.frame.buffer(format!("caster parts {number}"), Arc::new(Buffer::from_slice(&parts)));
                    casters.push(Casters { vertices, indices: None, range });
                }
                casters
            }
        };
        let side = self.view.shadow_map_size;
        self.shadow_map(label, program, (side, side), &[MapView { light, part: None, casters }])
    }

    /// Groups of receivers as a map draws them.
    fn casters(&self, groups: &[&ReceiverGroup]) -> Vec<Casters> {
        let casters =
            |group: &&ReceiverGroup| Casters { vertices: self.vertices, indices: Some(self.indices), range: group.indices.clone() };
        groups.iter().map(casters).collect()
    }

    /// Adds a depth texture, and a pass of the same name that draws views into it.
    fn shadow_map(&mut self, label: String, program: Arc<Program>, size: (u32, u32), views: &[MapView]) -> TextureId {
        let texture = self.frame.texture(TextureDescriptor::d2(label.clone(), size.0, size.1, TextureFormat::Depth32Float));
        let bias = DepthBiasState { constant: 64, slope_scale: 2.5, clamp: 0.0 };
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: Some(depth_state(TextureFormat::Depth32Float, CompareFunction::Less, true, bias)),
            ..RenderPipelineDescriptor::new(label.clone(), program)
        });
        let mut draws = Vec::new();
        for MapView { light, part, casters } in views {
            let mut bound: Option<(BufferId, BindGroupId)> = None;
            for Casters { vertices, indices, range } in casters {
                let bindings = match bound {
                    Some((known, bindings)) if known == *vertices => bindings,
                    _ => self.frame.bind_group(vec![BindEntry::Uniform(*light, 0), BindEntry::Storage(*vertices)]),
                };
                bound = Some((*vertices, bindings));
                let draw = Draw { viewport: part.map(Viewport::of), scissor: *part, ..Draw::new(pipeline, bindings, range.clone()) };
                draws.push(match indices {
                    Some(indices) => draw.indexed(*indices),
                    None => draw,
                });
            }
        }
        let depth = Some(DepthStencilAttachment { view: texture.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        self.frame.passes.push(Pass { label, depth_stencil: depth, draws, ..Pass::default() });
        texture
    }

    /// The uniform of a light.
    fn light_uniform(&self, number: usize, in_water: bool) -> LightUniform {
        let Self { scene, receivers, .. } = *self;
        let light = &scene.lights[number];
        let water = scene.water.as_ref();
        let level = water.map_or(0.0, |w| w.level_m);
        let ior = water.map_or(1.0, |w| w.ior);
        let (trough, crest) = self.water.map_or((level, level), HeightField::height_range_ws);
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
        let refracted = refracted_at_flat_water(light.incident(bounds.center()).direction_ws, ior);
        let min = water.map_or(bounds.min, |w| Vec3::new(w.min_ws().x, level, w.min_ws().y));
        let max = water.map_or(bounds.max, |w| Vec3::new(w.max_ws().x, level, w.max_ws().y));
        // A lamp in the water shines through a small part of the surface.
        let part = if in_water { self.water.and_then(|field| window(field, light, ior)) } else { None };
        let [min, max] = part.map_or([min, max], |part| part.corners_ws().map(|p| Vec3::new(p.x, level, p.y)));
        // On the light's side the surface reaches this far from its mean level, and what is beyond it this far to the other side.
        let (rise, depth) = if in_water { (level - trough, bounds.max.y - level) } else { (crest - level, level - bounds.min.y) };
        let least = (bounds.size().max_element() * LEAST_DEPTH).max(f32::MIN_POSITIVE);
        // The map of directions has distances.
        let depth = if in_water && position_ws.w != 0.0 { bounds.size().length() } else { rise.max(0.0) + depth.max(least) };
        let depth = depth.max(least) * 1.01;
        let own = if in_water { scene.medium.sigma_t() } else { Vec3::ZERO };
        let start = bounds.corners().iter().fold(f32::INFINITY, |start, corner| start.min(corner.dot(position_ws.truncate())));
        let view = ShadowView::of(light, bounds);
        LightUniform {
            clip_from_world: view.clip_from_world(),
            position_ws,
            intensity: intensity.extend(inner),
            spot,
            water: Vec4::new(if in_water { -1.0 } else { 1.0 }, level, if in_water { 1.0 / ior } else { ior }, rise.max(0.0)),
            entry: Vec4::new(min.x, min.z, (max.x - min.x).max(least), (max.z - min.z).max(least)),
            refracted: refracted.extend(depth),
            own: own.extend(if position_ws.w == 0.0 { start } else { 0.0 }),
            cube: view.cube(self.view.shadow_map_size),
        }
    }
}

/// Least depth of the map through the surface, as a share of the scene's size.
const LEAST_DEPTH: f32 = 1.0e-4;

/// Whether a light shines from within the water: a lamp below the surface, or parallel light from below.
#[must_use]
pub fn is_in_water(light: &Light, surface: Option<&HeightField>) -> bool {
    let Some(surface) = surface else { return false };
    match *light {
        Light::Directional { .. } => light.incident(Vec3::ZERO).direction_ws.y > 0.0,
        Light::Point { position, .. } | Light::Spot { position, .. } => surface.is_above(position),
    }
}
