//! From irradiance to the picture: receivers, sky, the water surface in front of them, and light scattered along the way.

use std::sync::Arc;

use crate::audit::Audit;
use crate::passes::environment::EnvironmentUniform;
use crate::passes::water_surface::{self, WaterVertex};
use crate::passes::{fullscreen, in_scattering, shade};
use crate::{LayerSource, LightMask, Resolve, Tally, TechniqueFrame};
use glam::Vec3;
use nephroid_pipeline::frame::{BindEntry, BufferId, DepthStencilAttachment, Draw, Pass, TextureId};
use nephroid_pipeline::state::{ADDITIVE, CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor};
use nephroid_scene::water::HeightField;
use nephroid_scene::{EyeRefraction, Scene};

use super::FrameBuilder;
use super::geometry::GeometryTargets;
use super::state::{clear, depth_state, target};

/// What a technique adds to the picture. All textures have the size of the builder's targets.
#[derive(Clone, Debug)]
pub struct Contributions {
    /// Caustic irradiance at the surface that each sample shows, W/m², linear RGB: layer `caustic_irradiance`.
    pub irradiance: TextureId,
    /// Caustic light that the medium scatters towards the eye, integrated along the eye's path, W/(m² sr), linear RGB: layer `godrays`. It is added
    /// after surface radiance has been attenuated, so it must be attenuated already. The water's mean in-scattering without caustics
    /// (`EnvironmentUniform::inscatter`) remains in the picture.
    pub in_scattered: Option<TextureId>,
    /// The technique's own layers.
    pub layers: Vec<LayerSource>,
}

/// Receivers and the irradiance on them, and where their radiance is written.
pub(super) struct Shaded {
    /// Uniform buffer of the camera that sees them.
    pub camera: BufferId,
    /// Position, normal and albedo.
    pub geometry: GeometryTargets,
    /// Direct irradiance.
    pub direct: TextureId,
    /// Caustic irradiance.
    pub caustic: TextureId,
    /// The radiance.
    pub radiance: TextureId,
}

impl Contributions {
    /// Contributions of irradiance only.
    #[must_use]
    pub fn new(irradiance: TextureId) -> Self {
        Self { irradiance, in_scattered: None, layers: Vec::new() }
    }
}

impl FrameBuilder<'_> {
    /// Adds the passes `shade` and `picture`, and names the layers. Audit, counters and times are left empty, and tallies have what the
    /// builder's own passes mark.
    #[must_use]
    pub fn finish(mut self, contributions: Contributions) -> TechniqueFrame {
        let environment = self.uniform("environment", &environment_uniform(self.scene));
        let shaded = self.shade(environment, contributions.irradiance);
        let radiance = self.glass(environment, shaded);
        self.picture(environment, radiance, contributions.in_scattered);
        TechniqueFrame {
            light_mask: self.light_mask(&contributions),
            layers: self.layers(contributions),
            margin: self.margin,
            samples: self.view.samples,
            audit: Audit::default(),
            counters: Vec::new(),
            tallies: self.searched(radiance != shaded, radiance),
            seconds: Vec::new(),
            frame: self.frame,
        }
    }

    /// Pictures whose samples are marked where the search for what they show has not converged.
    fn searched(&self, glass: bool, radiance: TextureId) -> Vec<Tally> {
        let water = self.water.is_some() && self.view.eye_refraction == EyeRefraction::Snell && self.camera.water.z == 0.0;
        let searched = [(glass, radiance), (water, self.color)].into_iter().filter(|(searches, _)| *searches);
        searched.map(|(_, texture)| Tally::Marked(texture, "eye_searches_unconverged")).collect()
    }

    /// Converts irradiance to the radiance of the receiver that each sample shows.
    fn shade(&mut self, environment: BufferId, caustic: TextureId) -> TextureId {
        let radiance = self.target("radiance", TextureFormat::Rgba32Float);
        let geometry = self.geometry_targets();
        self.shade_pass("shade", environment, &Shaded { camera: self.camera_buffer, geometry, direct: self.direct, caustic, radiance });
        radiance
    }

    /// Adds a pass that converts irradiance to radiance.
    pub(super) fn shade_pass(&mut self, label: &str, environment: BufferId, shaded: &Shaded) {
        let bindings = self.frame.bind_group(vec![
            BindEntry::Uniform(shaded.camera, 0),
            BindEntry::Uniform(environment, 0),
            BindEntry::texture(shaded.geometry.position),
            BindEntry::texture(shaded.geometry.albedo),
            BindEntry::texture(shaded.direct),
            BindEntry::texture(shaded.caustic),
        ]);
        let pipeline = self.fullscreen("shade", shade::program(), &[TextureFormat::Rgba32Float], None);
        self.frame.passes.push(Pass {
            label: label.into(),
            color: vec![clear(shaded.radiance)],
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
    }

    /// The nearest surfaces: the receivers, or the mirrors and glass before them.
    fn front(&self) -> GeometryTargets {
        self.specular.as_ref().map_or_else(|| self.geometry_targets(), |specular| specular.front)
    }

    /// Sky and receivers, the water surface tested against the receivers' depth, and in-scattered radiance added over everything.
    fn picture(&mut self, environment: BufferId, radiance: TextureId, in_scattered: Option<TextureId>) {
        let front = self.front();
        let entries = vec![
            BindEntry::Uniform(self.camera_buffer, 0),
            BindEntry::Uniform(environment, 0),
            BindEntry::texture(front.position),
            BindEntry::texture(radiance),
        ];
        let mut draws = vec![self.background_draw(entries.clone())];
        draws.extend(self.water.map(|water| self.water_draw(water, entries)));
        draws.extend(in_scattered.map(|texture| self.in_scattering_draw(texture)));
        self.frame.passes.push(Pass {
            label: "picture".into(),
            color: vec![clear(self.color)],
            depth_stencil: Some(DepthStencilAttachment { view: front.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
            draws,
            ..Pass::default()
        });
    }

    fn background_draw(&mut self, entries: Vec<BindEntry>) -> Draw {
        let bindings = self.frame.bind_group(entries);
        let untested = depth_state(self.depth_format, CompareFunction::Always, false, DepthBiasState::default());
        let pipeline = self.fullscreen("background", water_surface::background_program(), &[TextureFormat::Rgba32Float], Some(untested));
        Draw::new(pipeline, bindings, fullscreen::VERTICES)
    }

    fn water_draw(&mut self, field: &HeightField, mut entries: Vec<BindEntry>) -> Draw {
        let vertices: Vec<WaterVertex> = field
            .positions_ws()
            .iter()
            .zip(&field.normals_ws)
            .map(|(p, n)| WaterVertex { position_ws: p.extend(1.0), normal_ws: n.extend(0.0) })
            .collect();
        let indices = field.triangle_indices();
        let vertices = self.frame.buffer("water surface", Arc::new(Buffer::from_slice(&vertices)));
        let count = indices.len() as u32;
        let indices = self.frame.buffer("water surface indices", Arc::new(Buffer::from_slice(&indices)));
        entries.push(BindEntry::Storage(vertices));
        entries.push(BindEntry::texture(self.front().albedo));
        let bindings = self.frame.bind_group(entries);
        let snell = self.view.eye_refraction == EyeRefraction::Snell;
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            targets: vec![target(TextureFormat::Rgba32Float, None)],
            depth_stencil: Some(depth_state(self.depth_format, CompareFunction::LessEqual, true, DepthBiasState::default())),
            ..RenderPipelineDescriptor::new("water_surface", water_surface::surface_program(snell))
        });
        Draw::new(pipeline, bindings, 0..count).indexed(indices)
    }

    fn in_scattering_draw(&mut self, in_scattered: TextureId) -> Draw {
        let bindings = self.frame.bind_group(vec![BindEntry::texture(in_scattered)]);
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            targets: vec![target(TextureFormat::Rgba32Float, Some(ADDITIVE))],
            depth_stencil: Some(depth_state(self.depth_format, CompareFunction::Always, false, DepthBiasState::default())),
            ..RenderPipelineDescriptor::new("in_scattering", in_scattering::program())
        });
        Draw::new(pipeline, bindings, fullscreen::VERTICES)
    }

    /// Mirrors and glass reflect and transmit light, but no light lands on them.
    fn light_mask(&self, contributions: &Contributions) -> Option<LightMask> {
        let kinds = self.specular.as_ref()?.front.position;
        let own = contributions.layers.iter().map(|layer| layer.name);
        Some(LightMask { kinds, layers: ["direct", "caustic_irradiance", "shadow"].into_iter().chain(own).collect() })
    }

    /// The layers that every technique has, those of the contributions, and the technique's own layers.
    fn layers(&self, contributions: Contributions) -> Vec<LayerSource> {
        let (axis, front) = (self.scene.camera.forward_ws(), self.front());
        let source = |name, texture, channels, resolve| LayerSource { name, texture, channels, resolve };
        let mut layers = vec![
            source("color", self.color, 3, Resolve::Mean),
            source("depth", front.position, 1, Resolve::Depth(self.scene.camera.position_ws(), axis)),
            source("normal", front.normal, 3, Resolve::Nearest),
            source("position", front.position, 3, Resolve::Nearest),
            source("albedo", front.albedo, 3, Resolve::Mean),
            source("direct", self.direct, 3, Resolve::Mean),
            source("caustic_irradiance", contributions.irradiance, 3, Resolve::Mean),
            source("shadow", self.visibility, 1, Resolve::Mean),
        ];
        layers.extend(contributions.in_scattered.map(|texture| source("godrays", texture, 3, Resolve::Mean)));
        layers.extend(contributions.layers);
        layers
    }
}

/// Sky, medium, and the light that the water scatters.
fn environment_uniform(scene: &Scene) -> EnvironmentUniform {
    let ior = scene.water.as_ref().map_or(1.0, |w| w.ior);
    let on_water = scene.water.as_ref().map_or(Vec3::ZERO, |water| {
        let middle = (water.min_ws() + water.max_ws()) * 0.5;
        let at = Vec3::new(middle.x, water.level_m, middle.y);
        scene.lights.iter().map(|l| l.incident(at)).map(|i| i.irradiance * (-i.direction_ws.y).max(0.0)).sum()
    });
    EnvironmentUniform::new(&scene.environment, &scene.lights, &scene.medium, ior, on_water)
}
