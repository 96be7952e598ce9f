//! Builds the frame: resources and passes in the order of [SF05 §3.5].

use std::sync::Arc;

use glam::{Mat4, Vec3, Vec4};

use crate::caustics::receivers::Receivers;
use crate::frame::{BindEntry, BindGroupId, BufferId, ColorTarget, DepthTarget, Frame, FrameDraw, FramePass, TextureId};
use crate::passes::camera::{CameraUniform, apparent_depth_ratio};
use crate::passes::environment::EnvironmentUniform;
use crate::passes::shadow_map::{LightUniform, refracted_under_flat_water};
use crate::passes::water_surface::WaterVertex;
use crate::passes::{fullscreen, geometry_buffer, light, shade, shadow_map, water_surface};
use crate::pipeline::sampler::Sampler;
use crate::pipeline::state::{
    BlendComponent, BlendFactor, BlendOperation, BlendState, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState,
    DepthStencilState, Face, PrimitiveState, PrimitiveTopology, StencilState, TextureFormat,
};
use crate::pipeline::{Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use crate::scene::water::HeightField;
use crate::scene::{Camera, CausticVolumes, EyeRefraction, Faces, Light, Scene};

use super::beams::LightBeams;
use super::shaders::{self, VolumeUniform};

/// Pixels rendered beyond each edge of the picture when refracted rays may leave it, as a share of its larger side.
const SNELL_MARGIN: f32 = 0.06;

/// How far beyond its edges the water is taken to reach, as a share of its larger side. Walls often stand exactly at the edge, and their
/// interpolated positions are a few units in the last place off.
const EXTENT_SLACK: f32 = 1.0e-4;

/// What a frame is built from.
pub struct Inputs<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its receivers.
    pub receivers: &'a Receivers,
    /// The water surface, if there is water.
    pub water: Option<&'a HeightField>,
    /// Per light of the scene, if there is water.
    pub beams: &'a [LightBeams],
    /// Whether the direction of caustic light is wanted.
    pub direction: bool,
    /// Whether the number of volumes per pixel is wanted.
    pub counts: bool,
}

/// A frame and where its results are.
pub struct Built {
    /// The frame.
    pub frame: Frame,
    /// Pixels beyond each edge of the picture, in samples.
    pub margin: u32,
    /// Samples along a pixel's side.
    pub samples: u32,
    /// The camera of the frame.
    pub camera: CameraUniform,
    /// Height of the volumes' bottom cap, m.
    pub bottom_y: f32,
    /// World position, w > 0 where something was hit.
    pub position: TextureId,
    /// Normal.
    pub normal: TextureId,
    /// Albedo.
    pub albedo: TextureId,
    /// Direct irradiance.
    pub direct: TextureId,
    /// Visibility under water of the last light.
    pub visibility: TextureId,
    /// Caustic irradiance.
    pub caustic: TextureId,
    /// Sum of irradiance times direction.
    pub direction: Option<TextureId>,
    /// Volumes per pixel.
    pub count: Option<TextureId>,
    /// The picture.
    pub color: TextureId,
}

/// The eye's side of the mean water plane and the apparent-depth ratio to go with it.
fn eye_and_ratio(scene: &Scene, settings: &CausticVolumes) -> (bool, f32) {
    let Some(water) = &scene.water else { return (false, 1.0) };
    let under = eye_is_under_water(scene);
    if under || settings.eye_refraction == EyeRefraction::VirtualPlane {
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

/// Level at which receivers are cut for this scene and these settings, see [`Receivers::new`].
#[must_use]
pub fn cut_level(scene: &Scene, settings: &CausticVolumes) -> Option<f32> {
    let (_, ratio) = eye_and_ratio(scene, settings);
    scene.water.as_ref().filter(|_| ratio != 1.0).map(|w| w.level_m)
}

/// Builds the frame.
#[must_use]
pub fn build(inputs: &Inputs<'_>) -> Built {
    let scene = inputs.scene;
    let settings = &scene.techniques.caustic_volumes;
    let (under, ratio) = eye_and_ratio(scene, settings);
    let samples = settings.samples;
    let (width, height) = (scene.image.width * samples, scene.image.height * samples);
    let margin = if ratio != 1.0 { (width.max(height) as f32 * SNELL_MARGIN).ceil() as u32 } else { 0 };
    let size = (width + 2 * margin, height + 2 * margin);
    let camera = camera_uniform(scene, (width, height), size, under, ratio);
    let bottom_y = bottom_of_volumes(inputs, settings);
    let mut b = Builder { frame: Frame::default(), size };

    let position = b.target("position", TextureFormat::Rgba32Float);
    let normal = b.target("normal", TextureFormat::Rgba32Float);
    let albedo = b.target("albedo", TextureFormat::Rgba32Float);
    let depth = b.target("depth", TextureFormat::Depth32Float);
    let direct = b.target("direct", TextureFormat::Rgba32Float);
    let visibility = b.target("visibility", TextureFormat::R32Float);
    let caustic = b.target("caustic_irradiance", TextureFormat::Rgba32Float);
    let direction = inputs.direction.then(|| b.target("caustic_direction_sum", TextureFormat::Rgba32Float));
    let count = inputs.counts.then(|| b.target("volume_count", TextureFormat::R32Float));
    let radiance = b.target("radiance", TextureFormat::Rgba32Float);
    let color = b.target("color", TextureFormat::Rgba32Float);

    let camera_buffer = b.uniform("camera", &camera);
    let environment = b.uniform("environment", &environment_uniform(scene));
    let vertices = b.frame.buffer("receivers", inputs.receivers.vertices.clone());
    let indices = b.frame.buffer("receiver indices", inputs.receivers.indices.clone());

    // First pass: world positions of all receivers.
    let draws = geometry_draws(&mut b, inputs.receivers, camera_buffer, vertices, indices);
    b.frame.passes.push(FramePass {
        label: "geometry_buffer".into(),
        color: vec![clear(position), clear(normal), clear(albedo)],
        depth: Some(DepthTarget { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load }),
        draws,
        query_count: 0,
    });

    // Second pass, per light: what it reaches directly, and its volumes.
    for (number, source) in scene.lights.iter().enumerate() {
        let uniform = light_uniform(scene, source, inputs);
        let light_buffer = b.uniform(&format!("light {number}"), &uniform);
        let maps = shadow_maps(&mut b, settings, inputs, number, light_buffer, vertices, indices);
        let first = number == 0;
        light_pass(&mut b, settings, &maps, (camera_buffer, light_buffer), (position, normal), (direct, visibility), number);
        let targets = VolumeTargets { caustic, direction, count, depth, first };
        let sources = VolumeSources { camera: camera_buffer, light: light_buffer, position, normal, visibility, air_map: maps.air };
        if let Some(beams) = inputs.beams.get(number) {
            volume_pass(&mut b, inputs, beams, &targets, &sources, (bottom_y, slack_per_w(scene, &camera, height + 2 * margin)), number);
        }
    }

    // Light from receivers, and the third pass: the water surface in front of them.
    let shading = b.frame.bind_group(vec![
        BindEntry::Uniform(camera_buffer, 0),
        BindEntry::Uniform(environment, 0),
        BindEntry::Texture(position),
        BindEntry::Texture(normal),
        BindEntry::Texture(albedo),
        BindEntry::Texture(direct),
        BindEntry::Texture(caustic),
    ]);
    let pipeline = b.fullscreen("shade", shade::program(), &[TextureFormat::Rgba32Float], None);
    b.frame.passes.push(FramePass {
        label: "shade".into(),
        color: vec![clear(radiance)],
        draws: vec![FrameDraw::new(pipeline, shading, fullscreen::VERTICES)],
        ..FramePass::default()
    });
    picture_pass(&mut b, inputs, settings, (camera_buffer, environment), (position, radiance), (color, depth));
    Built {
        frame: b.frame,
        margin,
        samples,
        camera,
        bottom_y,
        position,
        normal,
        albedo,
        direct,
        visibility,
        caustic,
        direction,
        count,
        color,
    }
}

fn clear(texture: TextureId) -> Option<ColorTarget> {
    Some(ColorTarget { view: texture.into(), load: LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 }) })
}

fn keep(texture: TextureId) -> Option<ColorTarget> {
    Some(ColorTarget { view: texture.into(), load: LoadOp::Load })
}

fn clear_or_keep(texture: TextureId, first: bool) -> Option<ColorTarget> {
    if first { clear(texture) } else { keep(texture) }
}

const ADDITIVE: BlendState = {
    let add = BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Add };
    BlendState { color: add, alpha: add }
};

fn target(format: TextureFormat, blend: Option<BlendState>) -> Option<ColorTargetState> {
    Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })
}

fn depth_state(compare: CompareFunction, write: bool, bias: DepthBiasState) -> DepthStencilState {
    DepthStencilState {
        format: TextureFormat::Depth32Float,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: StencilState::default(),
        bias,
    }
}

/// A frame in the making.
struct Builder {
    frame: Frame,
    size: (u32, u32),
}

impl Builder {
    fn target(&mut self, label: &str, format: TextureFormat) -> TextureId {
        self.frame.texture(TextureDescriptor::d2(label, self.size.0, self.size.1, format))
    }
    fn uniform<T: bytemuck::NoUninit>(&mut self, label: &str, value: &T) -> BufferId {
        self.frame.buffer(label, Arc::new(Buffer::from_value(value)))
    }
    /// A pipeline for a pass over every pixel.
    fn fullscreen(
        &mut self,
        label: &str,
        program: Arc<crate::pipeline::shader::Program>,
        formats: &[TextureFormat],
        depth_stencil: Option<DepthStencilState>,
    ) -> crate::frame::PipelineId {
        let targets = formats.iter().map(|&format| target(format, None)).collect();
        self.frame.pipeline(RenderPipelineDescriptor { targets, depth_stencil, ..RenderPipelineDescriptor::new(label, program) })
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
        let (min, max) = (w.min_ws(), w.max_ws());
        let slack = glam::Vec2::splat((max - min).max_element() * EXTENT_SLACK);
        let (min, max) = (min - slack, max + slack);
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

/// Slack of the volumes in metres per unit of clip w: a sixteenth of a pixel.
fn slack_per_w(scene: &Scene, camera: &CameraUniform, height_px: u32) -> f32 {
    let up = scene.camera.view_from_world().inverse().transform_vector3(Vec3::Y);
    // Clip units per metre along the picture's vertical.
    let per_metre = (camera.clip_from_world * up.extend(0.0)).y.abs();
    2.0 / (per_metre * height_px as f32) / 16.0
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

fn light_uniform(scene: &Scene, light: &Light, inputs: &Inputs<'_>) -> LightUniform {
    let water = scene.water.as_ref();
    let level = water.map_or(0.0, |w| w.level_m);
    let ior = water.map_or(1.0, |w| w.ior);
    let mut bounds = inputs.receivers.bounds;
    if let Some(w) = water {
        bounds = bounds.including(Vec3::new(w.min_ws().x, level, w.min_ws().y)).including(Vec3::new(w.max_ws().x, level, w.max_ws().y));
    }
    let (position_ws, intensity, spot, inner) = match *light {
        Light::Directional { irradiance, .. } => {
            (light.incident(Vec3::ZERO).direction_ws.extend(0.0), irradiance, Vec4::new(0.0, 0.0, 0.0, -2.0), 0.0)
        }
        Light::Point { position, intensity } => (position.extend(1.0), intensity, Vec4::new(0.0, 0.0, 0.0, -2.0), 0.0),
        Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
            let cos = |deg| crate::math::space::sin_cos_deg(deg).1 as f32;
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

/// The light's view of everything: parallel for parallel light, otherwise from its place towards the middle.
fn light_matrix(light: &Light, bounds: crate::geom::Aabb) -> Mat4 {
    let centre = bounds.center();
    let radius = (bounds.size().length() * 0.5).max(1.0e-3);
    let incident = light.incident(centre);
    let side = |direction: Vec3| if direction.y.abs() > 0.99 { Vec3::X } else { Vec3::Y };
    match *light {
        Light::Directional { .. } => {
            let direction = incident.direction_ws;
            let view = crate::math::space::look_to(centre - direction * (2.0 * radius), direction, side(direction)).unwrap_or_default();
            let half = Vec3::new(radius, radius, 0.0);
            let min = Vec3::new(-half.x, -half.y, -3.0 * radius);
            let max = Vec3::new(half.x, half.y, -radius);
            crate::math::space::orthographic(min, max).unwrap_or_default() * view
        }
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let to = centre - position;
            let distance = to.length().max(1.0e-3);
            let direction = to / distance;
            let view = crate::math::space::look_to(position, direction, side(direction)).unwrap_or_default();
            // Wide enough for the sphere around everything, at most 160 degrees.
            let half_angle = if distance > radius { libm::asin(f64::from(radius / distance)) as f32 } else { 1.4 };
            let near = (distance - radius).max(distance * 1.0e-2);
            let projection = crate::math::space::perspective((2.0 * half_angle).clamp(0.02, 2.8), 1.0, near, distance + radius);
            projection.unwrap_or_default() * view
        }
    }
}

/// Lowest point that volumes reach: just below the lowest receiver, or where the light has become negligible.
fn bottom_of_volumes(inputs: &Inputs<'_>, settings: &CausticVolumes) -> f32 {
    let Some(water) = &inputs.scene.water else { return 0.0 };
    let floor = inputs.receivers.bounds.min.y.min(water.level_m) - settings.depth_below_floor_m;
    let clearest = inputs.scene.medium.sigma_t().min_element();
    if clearest > 0.0 && settings.negligible_light > 0.0 {
        let reach = -libm::logf(settings.negligible_light) / clearest;
        floor.max(water.level_m - reach)
    } else {
        floor
    }
}

/// A draw per object: one pipeline, and a bind group for each material.
fn geometry_draws(b: &mut Builder, receivers: &Receivers, camera: BufferId, vertices: BufferId, indices: BufferId) -> Vec<FrameDraw> {
    let format = TextureFormat::Rgba32Float;
    let pipeline = b.frame.pipeline(RenderPipelineDescriptor {
        targets: vec![target(format, None), target(format, None), target(format, None)],
        depth_stencil: Some(depth_state(CompareFunction::Less, true, DepthBiasState::default())),
        ..RenderPipelineDescriptor::new("geometry_buffer", geometry_buffer::program())
    });
    let mut draws = Vec::with_capacity(receivers.groups.len());
    let mut made: Vec<(&crate::scene::Material, BindGroupId)> = Vec::new();
    for group in receivers.groups.iter().filter(|g| !g.elements.is_empty()) {
        let bindings = match made.iter().find(|(material, _)| **material == group.material) {
            Some((_, bindings)) => *bindings,
            None => {
                let material = b.uniform(&format!("material {}", made.len()), &geometry_buffer::MaterialUniform::from(&group.material));
                let entries = vec![BindEntry::Uniform(camera, 0), BindEntry::Storage(vertices), BindEntry::Uniform(material, 0)];
                let bindings = b.frame.bind_group(entries);
                made.push((&group.material, bindings));
                bindings
            }
        };
        draws.push(FrameDraw::new(pipeline, bindings, group.elements.clone()).indexed(indices));
    }
    draws
}

struct Maps {
    air: TextureId,
    water: TextureId,
}

/// Both maps of a light; a texel of depth 1 where one is switched off.
fn shadow_maps(
    b: &mut Builder,
    settings: &CausticVolumes,
    inputs: &Inputs<'_>,
    number: usize,
    light: BufferId,
    vertices: BufferId,
    indices: BufferId,
) -> Maps {
    let bindings = b.frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(vertices)]);
    let mut map = |label: String, on: bool, program: fn() -> Arc<crate::pipeline::shader::Program>| {
        let size = if on { settings.shadow_map_size } else { 1 };
        let texture = b.frame.texture(TextureDescriptor::d2(label.clone(), size, size, TextureFormat::Depth32Float));
        let bias = DepthBiasState { constant: 64, slope_scale: 2.5, clamp: 0.0 };
        let pipeline = b.frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: Some(depth_state(CompareFunction::Less, true, bias)),
            ..RenderPipelineDescriptor::new(label.clone(), program())
        });
        let draws = if on {
            let groups = inputs.receivers.groups.iter().filter(|g| !g.elements.is_empty());
            groups.map(|g| FrameDraw::new(pipeline, bindings, g.elements.clone()).indexed(indices)).collect()
        } else {
            Vec::new()
        };
        let depth = Some(DepthTarget { view: texture.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        b.frame.passes.push(FramePass { label, depth, draws, ..FramePass::default() });
        texture
    };
    let wet = inputs.water.is_some();
    Maps {
        air: map(format!("shadow_map_air {number}"), settings.surface_shadows, shadow_map::air_program),
        water: map(format!("shadow_map_water {number}"), settings.underwater_shadows && wet, shadow_map::water_program),
    }
}

fn light_pass(
    b: &mut Builder,
    settings: &CausticVolumes,
    maps: &Maps,
    (camera, light_buffer): (BufferId, BufferId),
    (position, normal): (TextureId, TextureId),
    (direct, visibility): (TextureId, TextureId),
    number: usize,
) {
    let bindings = b.frame.bind_group(vec![
        BindEntry::Uniform(camera, 0),
        BindEntry::Uniform(light_buffer, 0),
        BindEntry::Texture(position),
        BindEntry::Texture(normal),
        BindEntry::Texture(maps.air),
        BindEntry::Texture(maps.water),
        BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
    ]);
    let pipeline = b.frame.pipeline(RenderPipelineDescriptor {
        targets: vec![target(TextureFormat::Rgba32Float, Some(ADDITIVE)), target(TextureFormat::R32Float, None)],
        ..RenderPipelineDescriptor::new("light", light::program(settings.surface_shadows, settings.underwater_shadows))
    });
    b.frame.passes.push(FramePass {
        label: format!("light {number}"),
        color: vec![clear_or_keep(direct, number == 0), clear(visibility)],
        draws: vec![FrameDraw::new(pipeline, bindings, fullscreen::VERTICES)],
        ..FramePass::default()
    });
}

struct VolumeTargets {
    caustic: TextureId,
    direction: Option<TextureId>,
    count: Option<TextureId>,
    depth: TextureId,
    first: bool,
}

struct VolumeSources {
    camera: BufferId,
    light: BufferId,
    position: TextureId,
    normal: TextureId,
    visibility: TextureId,
    air_map: TextureId,
}

/// The volumes of one light: additive, one side of each body, no depth write.
#[allow(clippy::too_many_arguments, reason = "the pass reads this many things; they come from different places")]
fn volume_pass(
    b: &mut Builder,
    inputs: &Inputs<'_>,
    beams: &LightBeams,
    targets: &VolumeTargets,
    sources: &VolumeSources,
    (bottom_y, slack): (f32, f32),
    number: usize,
) {
    let settings = &inputs.scene.techniques.caustic_volumes;
    let shadows = if settings.surface_shadows { 1.0 } else { 0.0 };
    // Front faces pass wherever the receiver lies behind the volume, which from above is all along its length; back faces almost only inside it.
    let back = settings.faces != Faces::Front;
    let wanted = if back { -1.0 } else { 1.0 };
    let uniform = VolumeUniform { shape: Vec4::new(bottom_y, slack, shadows, wanted), sigma_t: inputs.scene.medium.sigma_t().extend(0.0) };
    let uniform = b.uniform(&format!("volumes {number}"), &uniform);
    let dark = [super::beams::Beam::default()];
    let data = if beams.beams.is_empty() { &dark[..] } else { &beams.beams[..] };
    let storage = b.frame.buffer(format!("beams {number}"), Arc::new(Buffer::from_slice(data)));
    let bindings = b.frame.bind_group(vec![
        BindEntry::Uniform(sources.camera, 0),
        BindEntry::Uniform(uniform, 0),
        BindEntry::Uniform(sources.light, 0),
        BindEntry::Storage(storage),
        BindEntry::Texture(sources.position),
        BindEntry::Texture(sources.normal),
        BindEntry::Texture(sources.visibility),
        BindEntry::Texture(sources.air_map),
        BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
    ]);
    // Front faces must lie before the receiver; back faces behind it, which holds for an eye inside as well [decision E3].
    let (cull, compare) = if back { (Face::Front, CompareFunction::GreaterEqual) } else { (Face::Back, CompareFunction::LessEqual) };
    let slot = |texture: Option<TextureId>, format| texture.and_then(|_| target(format, Some(ADDITIVE)));
    let mut states = vec![
        target(TextureFormat::Rgba32Float, Some(ADDITIVE)),
        slot(targets.direction, TextureFormat::Rgba32Float),
        slot(targets.count, TextureFormat::R32Float),
    ];
    let mut color = vec![
        clear_or_keep(targets.caustic, targets.first),
        targets.direction.and_then(|t| clear_or_keep(t, targets.first)),
        targets.count.and_then(|t| clear_or_keep(t, targets.first)),
    ];
    while states.last().is_some_and(Option::is_none) {
        states.pop();
        color.pop();
    }
    let pipeline = b.frame.pipeline(RenderPipelineDescriptor {
        primitive: PrimitiveState {
            topology: PrimitiveTopology::PointList,
            cull_mode: Some(cull),
            unclipped_depth: true,
            ..PrimitiveState::default()
        },
        depth_stencil: Some(depth_state(compare, false, DepthBiasState::default())),
        targets: states,
        ..RenderPipelineDescriptor::new("caustic_volumes", shaders::program(settings.radiometry))
    });
    b.frame.passes.push(FramePass {
        label: format!("caustic_volumes {number}"),
        color,
        depth: Some(DepthTarget { view: targets.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
        draws: vec![FrameDraw::new(pipeline, bindings, 0..beams.beams.len() as u32)],
        query_count: 0,
    });
}

/// Sky and receivers, then the water surface, tested against the receivers' depth.
fn picture_pass(
    b: &mut Builder,
    inputs: &Inputs<'_>,
    settings: &CausticVolumes,
    (camera, environment): (BufferId, BufferId),
    (position, radiance): (TextureId, TextureId),
    (color, depth): (TextureId, TextureId),
) {
    let mut entries =
        vec![BindEntry::Uniform(camera, 0), BindEntry::Uniform(environment, 0), BindEntry::Texture(position), BindEntry::Texture(radiance)];
    let background = b.frame.bind_group(entries.clone());
    let untested = depth_state(CompareFunction::Always, false, DepthBiasState::default());
    let pipeline = b.fullscreen("background", water_surface::background_program(), &[TextureFormat::Rgba32Float], Some(untested));
    let mut draws = vec![FrameDraw::new(pipeline, background, fullscreen::VERTICES)];
    if let Some(field) = inputs.water {
        let vertices: Vec<WaterVertex> = field
            .positions_ws()
            .iter()
            .zip(&field.normals_ws)
            .map(|(p, n)| WaterVertex { position_ws: p.extend(1.0), normal_ws: n.extend(0.0) })
            .collect();
        let indices = field.triangle_indices();
        let vertices = b.frame.buffer("water surface", Arc::new(Buffer::from_slice(&vertices)));
        let count = indices.len() as u32;
        let indices = b.frame.buffer("water surface indices", Arc::new(Buffer::from_slice(&indices)));
        entries.push(BindEntry::Storage(vertices));
        let surface = b.frame.bind_group(entries);
        let snell = settings.eye_refraction == EyeRefraction::Snell;
        let pipeline = b.frame.pipeline(RenderPipelineDescriptor {
            targets: vec![target(TextureFormat::Rgba32Float, None)],
            depth_stencil: Some(depth_state(CompareFunction::LessEqual, true, DepthBiasState::default())),
            ..RenderPipelineDescriptor::new("water_surface", water_surface::surface_program(snell))
        });
        draws.push(FrameDraw::new(pipeline, surface, 0..count).indexed(indices));
    }
    b.frame.passes.push(FramePass {
        label: "picture".into(),
        color: vec![clear(color)],
        depth: Some(DepthTarget { view: depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
        draws,
        query_count: 0,
    });
}
