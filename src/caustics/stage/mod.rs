//! What the frames of all techniques have in common: the receivers as the camera sees them, each light's maps and direct light, and
//! the picture that is made of irradiances.
//!
//! [`Stage::new`] draws the receivers, [`Stage::light`] one light; what a technique adds up goes to [`Stage::finish`].

pub mod light;
pub mod state;

use std::sync::Arc;

use glam::{Mat4, Vec3, Vec4};

use crate::passes::camera::{CameraUniform, apparent_depth_ratio};
use crate::passes::environment::EnvironmentUniform;
use crate::passes::water_surface::WaterVertex;
use crate::passes::{fullscreen, geometry_buffer, shade, water_surface};
use nephroid_pipeline::frame::{BindEntry, BindGroupId, BufferId, DepthTarget, Frame, FrameDraw, FramePass, PipelineId, TextureId};
use nephroid_pipeline::shader::Program;
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, DepthStencilState, TextureFormat};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::water::HeightField;
use nephroid_scene::{Camera, EyeRefraction, Scene};

use super::{LayerSource, Receivers, Resolve};
use state::{clear, depth_state, target};

/// Pixels rendered beyond each edge of the picture when refracted rays may leave it, as a share of its larger side.
const SNELL_MARGIN: f32 = 0.06;

/// How a technique wants to see the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// How the eye sees through the water surface.
    pub eye_refraction: EyeRefraction,
    /// Samples along each side of a pixel.
    pub samples: u32,
    /// Whether objects above the water cut off light.
    pub surface_shadows: bool,
    /// Whether objects under water do.
    pub underwater_shadows: bool,
    /// Width and height of the shadow maps, texels.
    pub shadow_map_size: u32,
    /// Whether the depth attachment has a stencil.
    pub stencil: bool,
}

/// A frame in the making.
pub struct Stage {
    /// What is made.
    pub frame: Frame,
    /// Size of the targets, samples.
    pub size: (u32, u32),
    /// Samples beyond each edge of the picture.
    pub margin: u32,
    /// Samples along a pixel's side.
    pub samples: u32,
    /// The camera of the frame.
    pub camera: CameraUniform,
    /// The same, for shaders.
    pub camera_buffer: BufferId,
    /// World position, w > 0 where something was hit.
    pub position: TextureId,
    /// Normal.
    pub normal: TextureId,
    /// Albedo.
    pub albedo: TextureId,
    /// Depth of the receivers, and a stencil if the view asks for one.
    pub depth: TextureId,
    /// Its format.
    pub depth_format: TextureFormat,
    /// Direct irradiance.
    pub direct: TextureId,
    /// Visibility under water of the last light.
    pub visibility: TextureId,
    /// The picture.
    pub color: TextureId,
    vertices: BufferId,
    indices: BufferId,
}

/// The eye's side of the mean water plane and the apparent-depth ratio to go with it.
fn eye_and_ratio(scene: &Scene, eye_refraction: EyeRefraction) -> (bool, f32) {
    let Some(water) = &scene.water else { return (false, 1.0) };
    let under = eye_is_under_water(scene);
    if under || eye_refraction == EyeRefraction::VirtualPlane {
        return (under, 1.0);
    }
    let direction = match scene.camera {
        Camera::Orthographic { .. } => scene.camera.forward_ws(),
        Camera::Perspective { .. } => {
            let middle = (water.min_ws() + water.max_ws()) * 0.5;
            (Vec3::new(middle.x, water.level_m, middle.y) - scene.camera.position_ws()).normalize_or(Vec3::NEG_Y)
        }
    };
    (under, apparent_depth_ratio(direction, water.ior))
}

/// Whether the eye is in the body of water. A parallel camera stands for an eye far away: it is under water if it looks up from below.
#[must_use]
pub fn eye_is_under_water(scene: &Scene) -> bool {
    let Some(water) = &scene.water else { return false };
    let eye = scene.camera.position_ws();
    let (min, max) = (water.min_ws(), water.max_ws());
    eye.y < water.level_m && (min.x..=max.x).contains(&eye.x) && (min.y..=max.y).contains(&eye.z)
}

/// Level at which receivers are cut for this scene and this view, see [`Receivers::new`].
#[must_use]
pub fn cut_level(scene: &Scene, eye_refraction: EyeRefraction) -> Option<f32> {
    let (_, ratio) = eye_and_ratio(scene, eye_refraction);
    scene.water.as_ref().filter(|_| ratio != 1.0).map(|w| w.level_m)
}

impl Stage {
    /// Starts a frame with what the camera sees of the receivers.
    pub fn new(scene: &Scene, receivers: &Receivers, view: &View) -> Self {
        let (under, ratio) = eye_and_ratio(scene, view.eye_refraction);
        let samples = view.samples;
        let (width, height) = (scene.image.width * samples, scene.image.height * samples);
        let margin = if ratio != 1.0 { (width.max(height) as f32 * SNELL_MARGIN).ceil() as u32 } else { 0 };
        let size = (width + 2 * margin, height + 2 * margin);
        let camera = camera_uniform(scene, (width, height), size, under, ratio);
        let depth_format = if view.stencil { TextureFormat::Depth32FloatStencil8 } else { TextureFormat::Depth32Float };
        let mut frame = Frame::default();
        let mut target = |label: &str, format| frame.texture(TextureDescriptor::d2(label, size.0, size.1, format));
        let position = target("position", TextureFormat::Rgba32Float);
        let normal = target("normal", TextureFormat::Rgba32Float);
        let albedo = target("albedo", TextureFormat::Rgba32Float);
        let depth = target("depth", depth_format);
        let direct = target("direct", TextureFormat::Rgba32Float);
        let visibility = target("visibility", TextureFormat::R32Float);
        let color = target("color", TextureFormat::Rgba32Float);
        let camera_buffer = frame.buffer("camera", Arc::new(Buffer::from_value(&camera)));
        let vertices = frame.buffer("receivers", receivers.vertices.clone());
        let indices = frame.buffer("receiver indices", receivers.indices.clone());
        let mut stage = Self {
            frame,
            size,
            margin,
            samples,
            camera,
            camera_buffer,
            position,
            normal,
            albedo,
            depth,
            depth_format,
            direct,
            visibility,
            color,
            vertices,
            indices,
        };
        let draws = stage.geometry_draws(receivers);
        stage.frame.passes.push(FramePass {
            label: "geometry_buffer".into(),
            color: vec![clear(position), clear(normal), clear(albedo)],
            depth: Some(DepthTarget { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load }),
            draws,
            ..FramePass::default()
        });
        stage
    }

    /// A texture of the targets' size.
    pub fn target(&mut self, label: &str, format: TextureFormat) -> TextureId {
        self.frame.texture(TextureDescriptor::d2(label, self.size.0, self.size.1, format))
    }

    /// A buffer of one struct.
    pub fn uniform<T: bytemuck::NoUninit>(&mut self, label: &str, value: &T) -> BufferId {
        self.frame.buffer(label, Arc::new(Buffer::from_value(value)))
    }

    /// A pipeline for a pass over every pixel.
    pub fn fullscreen(
        &mut self,
        label: &str,
        program: Arc<Program>,
        formats: &[TextureFormat],
        depth_stencil: Option<DepthStencilState>,
    ) -> PipelineId {
        let targets = formats.iter().map(|&format| target(format, None)).collect();
        self.frame.pipeline(RenderPipelineDescriptor { targets, depth_stencil, ..RenderPipelineDescriptor::new(label, program) })
    }

    /// Light from receivers, and the water surface in front of them.
    pub fn finish(&mut self, scene: &Scene, water: Option<&HeightField>, view: &View, caustic: TextureId) {
        let radiance = self.target("radiance", TextureFormat::Rgba32Float);
        let environment = self.uniform("environment", &environment_uniform(scene));
        let shading = self.frame.bind_group(vec![
            BindEntry::Uniform(self.camera_buffer, 0),
            BindEntry::Uniform(environment, 0),
            BindEntry::Texture(self.position),
            BindEntry::Texture(self.normal),
            BindEntry::Texture(self.albedo),
            BindEntry::Texture(self.direct),
            BindEntry::Texture(caustic),
        ]);
        let pipeline = self.fullscreen("shade", shade::program(), &[TextureFormat::Rgba32Float], None);
        self.frame.passes.push(FramePass {
            label: "shade".into(),
            color: vec![clear(radiance)],
            draws: vec![FrameDraw::new(pipeline, shading, fullscreen::VERTICES)],
            ..FramePass::default()
        });
        self.picture(water, view, environment, radiance);
    }

    /// A draw per object: one pipeline, and a bind group for each material.
    fn geometry_draws(&mut self, receivers: &Receivers) -> Vec<FrameDraw> {
        let format = TextureFormat::Rgba32Float;
        let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
            targets: vec![target(format, None), target(format, None), target(format, None)],
            depth_stencil: Some(depth_state(self.depth_format, CompareFunction::Less, true, DepthBiasState::default())),
            ..RenderPipelineDescriptor::new("geometry_buffer", geometry_buffer::program())
        });
        let mut draws = Vec::with_capacity(receivers.groups.len());
        let mut made: Vec<(&nephroid_scene::Material, BindGroupId)> = Vec::new();
        for group in receivers.groups.iter().filter(|g| !g.elements.is_empty()) {
            let bindings = match made.iter().find(|(material, _)| **material == group.material) {
                Some((_, bindings)) => *bindings,
                None => {
                    let material =
                        self.uniform(&format!("material {}", made.len()), &geometry_buffer::MaterialUniform::from(&group.material));
                    let entries =
                        vec![BindEntry::Uniform(self.camera_buffer, 0), BindEntry::Storage(self.vertices), BindEntry::Uniform(material, 0)];
                    let bindings = self.frame.bind_group(entries);
                    made.push((&group.material, bindings));
                    bindings
                }
            };
            draws.push(FrameDraw::new(pipeline, bindings, group.elements.clone()).indexed(self.indices));
        }
        draws
    }

    /// Sky and receivers, then the water surface, tested against the receivers' depth.
    fn picture(&mut self, water: Option<&HeightField>, view: &View, environment: BufferId, radiance: TextureId) {
        let mut entries = vec![
            BindEntry::Uniform(self.camera_buffer, 0),
            BindEntry::Uniform(environment, 0),
            BindEntry::Texture(self.position),
            BindEntry::Texture(radiance),
        ];
        let background = self.frame.bind_group(entries.clone());
        let untested = depth_state(self.depth_format, CompareFunction::Always, false, DepthBiasState::default());
        let pipeline = self.fullscreen("background", water_surface::background_program(), &[TextureFormat::Rgba32Float], Some(untested));
        let mut draws = vec![FrameDraw::new(pipeline, background, fullscreen::VERTICES)];
        if let Some(field) = water {
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
            let surface = self.frame.bind_group(entries);
            let snell = view.eye_refraction == EyeRefraction::Snell;
            let pipeline = self.frame.pipeline(RenderPipelineDescriptor {
                targets: vec![target(TextureFormat::Rgba32Float, None)],
                depth_stencil: Some(depth_state(self.depth_format, CompareFunction::LessEqual, true, DepthBiasState::default())),
                ..RenderPipelineDescriptor::new("water_surface", water_surface::surface_program(snell))
            });
            draws.push(FrameDraw::new(pipeline, surface, 0..count).indexed(indices));
        }
        self.frame.passes.push(FramePass {
            label: "picture".into(),
            color: vec![clear(self.color)],
            depth: Some(DepthTarget { view: self.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
            draws,
            ..FramePass::default()
        });
    }

    /// The layers that every technique has: of the camera's view of the receivers, and of the light.
    #[must_use]
    pub fn layers(&self, scene: &Scene, caustic: TextureId) -> Vec<LayerSource> {
        let axis = scene.camera.forward_ws();
        let source = |name, texture, channels, resolve| LayerSource { name, texture, channels, resolve };
        vec![
            source("color", self.color, 3, Resolve::Mean),
            source("depth", self.position, 1, Resolve::Depth(scene.camera.position_ws(), axis)),
            source("normal", self.normal, 3, Resolve::Nearest),
            source("position", self.position, 3, Resolve::Nearest),
            source("albedo", self.albedo, 3, Resolve::Mean),
            source("direct", self.direct, 3, Resolve::Mean),
            source("caustic_irradiance", caustic, 3, Resolve::Mean),
            source("shadow", self.visibility, 1, Resolve::Mean),
        ]
    }
}

fn camera_uniform(scene: &Scene, inner: (u32, u32), size: (u32, u32), under: bool, ratio: f32) -> CameraUniform {
    let aspect = inner.0 as f32 / inner.1 as f32;
    let shrink = Vec3::new(inner.0 as f32 / size.0 as f32, inner.1 as f32 / size.1 as f32, 1.0);
    let clip_from_world = Mat4::from_scale(shrink) * scene.camera.clip_from_world(aspect);
    let eye_ws = match scene.camera {
        Camera::Perspective { position, .. } => position.extend(1.0),
        Camera::Orthographic { .. } => scene.camera.forward_ws().extend(0.0),
    };
    let (level, extent, exists) = scene.water.as_ref().map_or((0.0, Vec4::ZERO, 0.0), |w| {
        let (min, max) = w.extent_ws();
        (w.level_m, Vec4::new(min.x, min.y, max.x, max.y), 1.0)
    });
    CameraUniform {
        clip_from_world,
        world_from_clip: clip_from_world.inverse(),
        eye_ws,
        size_px: Vec4::new(size.0 as f32, size.1 as f32, 1.0 / size.0 as f32, 1.0 / size.1 as f32),
        water: Vec4::new(level, ratio, if under { 1.0 } else { 0.0 }, exists),
        extent,
    }
}

fn environment_uniform(scene: &Scene) -> EnvironmentUniform {
    let ior = scene.water.as_ref().map_or(1.0, |w| w.ior);
    let on_water = scene.water.as_ref().map_or(Vec3::ZERO, |water| {
        let middle = (water.min_ws() + water.max_ws()) * 0.5;
        let at = Vec3::new(middle.x, water.level_m, middle.y);
        scene.lights.iter().map(|l| l.incident(at)).map(|i| i.irradiance * (-i.direction_ws.y).max(0.0)).sum()
    });
    EnvironmentUniform::new(&scene.environment, &scene.lights, &scene.medium, ior, on_water)
}
