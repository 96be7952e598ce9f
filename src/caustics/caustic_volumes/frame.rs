//! Builds the frame: resources and passes in the order of [SF05 §3.5].

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::beams::{Beam, LightBeams};
use crate::receivers::Receivers;
use crate::stage::light::StageLight;
use crate::stage::state::{clear_or_keep, depth_state, target};
use crate::stage::{Stage, View};
use nephroid_pipeline::frame::{BindEntry, DepthTarget, FrameDraw, FramePass, TextureId};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::state::{ADDITIVE, CompareFunction, DepthBiasState, Face, PrimitiveState, PrimitiveTopology, TextureFormat};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor};
use nephroid_scene::Scene;
use nephroid_scene::water::HeightField;

use super::settings::{CausticVolumes, Faces};
use super::shaders::{self, VolumeUniform};

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
    /// The frame, with what all techniques have in it.
    pub stage: Stage,
    /// Height of the volumes' bottom cap, m.
    pub bottom_y: f32,
    /// What the volumes are added up in.
    pub targets: VolumeTargets,
}

/// What the volumes are added up in.
#[derive(Clone, Copy, Debug)]
pub struct VolumeTargets {
    /// Caustic irradiance.
    pub caustic: TextureId,
    /// Sum of irradiance times direction.
    pub direction: Option<TextureId>,
    /// Volumes per pixel.
    pub count: Option<TextureId>,
}

/// How the technique sees the scene.
#[must_use]
pub fn view(settings: &CausticVolumes) -> View {
    View {
        eye_refraction: settings.eye_refraction,
        samples: settings.samples,
        surface_shadows: settings.surface_shadows,
        underwater_shadows: settings.underwater_shadows,
        shadow_map_size: settings.shadow_map_size,
        stencil: false,
    }
}

/// Builds the frame: world positions of all receivers; per light what it reaches directly, and its volumes; the picture.
#[must_use]
pub fn build(inputs: &Inputs<'_>) -> Built {
    let scene = inputs.scene;
    let settings = scene.techniques.get::<CausticVolumes>();
    let view = view(settings);
    let mut stage = Stage::new(scene, inputs.receivers, &view);
    let bottom_y = bottom_of_volumes(scene, inputs.receivers, settings);
    let targets = VolumeTargets {
        caustic: stage.target("caustic_irradiance", TextureFormat::Rgba32Float),
        direction: inputs.direction.then(|| stage.target("caustic_direction_sum", TextureFormat::Rgba32Float)),
        count: inputs.counts.then(|| stage.target("volume_count", TextureFormat::R32Float)),
    };
    for number in 0..scene.lights.len() {
        let light = stage.light(scene, inputs.receivers, &view, number);
        if let Some(beams) = inputs.beams.get(number) {
            volume_pass(&mut stage, scene, beams, &targets, &light, bottom_y, number);
        }
    }
    stage.finish(scene, inputs.water, &view, targets.caustic);
    Built { stage, bottom_y, targets }
}

/// Slack of the volumes in metres per unit of clip w: a sixteenth of a pixel.
fn slack_per_w(scene: &Scene, stage: &Stage) -> f32 {
    let up = scene.camera.view_from_world().inverse().transform_vector3(Vec3::Y);
    // Clip units per metre along the picture's vertical.
    let per_metre = (stage.camera.clip_from_world * up.extend(0.0)).y.abs();
    2.0 / (per_metre * stage.size.1 as f32) / 16.0
}

/// Lowest point that volumes reach: just below the lowest receiver, or where the light has become negligible.
fn bottom_of_volumes(scene: &Scene, receivers: &Receivers, settings: &CausticVolumes) -> f32 {
    let Some(water) = &scene.water else { return 0.0 };
    let floor = receivers.bounds.min.y.min(water.level_m) - settings.depth_below_floor_m;
    let clearest = scene.medium.sigma_t().min_element();
    if clearest > 0.0 && settings.negligible_light > 0.0 {
        let reach = -libm::logf(settings.negligible_light) / clearest;
        floor.max(water.level_m - reach)
    } else {
        floor
    }
}

/// The volumes of one light: additive, one side of each body, no depth write.
fn volume_pass(
    stage: &mut Stage,
    scene: &Scene,
    beams: &LightBeams,
    targets: &VolumeTargets,
    light: &StageLight,
    bottom_y: f32,
    number: usize,
) {
    let slack = slack_per_w(scene, stage);
    let settings = scene.techniques.get::<CausticVolumes>();
    let shadows = if settings.surface_shadows { 1.0 } else { 0.0 };
    // Front faces pass wherever the receiver lies behind the volume, which from above is all along its length; back faces almost only inside it.
    let back = settings.faces != Faces::Front;
    let wanted = if back { -1.0 } else { 1.0 };
    let uniform = VolumeUniform { shape: Vec4::new(bottom_y, slack, shadows, wanted), sigma_t: scene.medium.sigma_t().extend(0.0) };
    let uniform = stage.uniform(&format!("volumes {number}"), &uniform);
    let dark = [Beam::default()];
    let data = if beams.beams.is_empty() { &dark[..] } else { &beams.beams[..] };
    let storage = stage.frame.buffer(format!("beams {number}"), Arc::new(Buffer::from_slice(data)));
    let bindings = stage.frame.bind_group(vec![
        BindEntry::Uniform(stage.camera_buffer, 0),
        BindEntry::Uniform(uniform, 0),
        BindEntry::Uniform(light.buffer, 0),
        BindEntry::Storage(storage),
        BindEntry::Texture(stage.position),
        BindEntry::Texture(stage.normal),
        BindEntry::Texture(stage.visibility),
        BindEntry::Texture(light.air_map),
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
        clear_or_keep(targets.caustic, number == 0),
        targets.direction.and_then(|t| clear_or_keep(t, number == 0)),
        targets.count.and_then(|t| clear_or_keep(t, number == 0)),
    ];
    while states.last().is_some_and(Option::is_none) {
        states.pop();
        color.pop();
    }
    let pipeline = stage.frame.pipeline(RenderPipelineDescriptor {
        primitive: PrimitiveState {
            topology: PrimitiveTopology::PointList,
            cull_mode: Some(cull),
            unclipped_depth: true,
            ..PrimitiveState::default()
        },
        depth_stencil: Some(depth_state(stage.depth_format, compare, false, DepthBiasState::default())),
        targets: states,
        ..RenderPipelineDescriptor::new("caustic_volumes", shaders::program(settings.radiometry))
    });
    stage.frame.passes.push(FramePass {
        label: format!("caustic_volumes {number}"),
        color,
        depth: Some(DepthTarget { view: stage.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
        draws: vec![FrameDraw::new(pipeline, bindings, 0..beams.beams.len() as u32)],
        ..FramePass::default()
    });
}
