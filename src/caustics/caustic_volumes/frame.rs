//! Builds the frame: resources and passes in the order of [SF05 §3.5].

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::audit::Audit;
use crate::beams::{Beam, FluxModel, Interface, LightBeams};
use crate::builder::state::{additive, depth_state};
use crate::builder::{CausticTargets, FrameBuilder, FrameLight, ViewOptions};
use crate::receivers::Receivers;
use crate::{RenderError, Tally, TechniqueFrame};
use nephroid_pipeline::frame::{BindEntry, DepthStencilAttachment, Draw, Pass};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, Face, PrimitiveState, PrimitiveTopology};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor};
use nephroid_scene::Radiometry;
use nephroid_scene::Scene;
use nephroid_scene::water::HeightField;

use super::settings::{CausticVolumes, Faces};
use super::shaders::{self, VolumeUniform};

/// How the technique views the scene.
#[must_use]
pub fn view(settings: &CausticVolumes) -> ViewOptions {
    ViewOptions {
        eye_refraction: settings.eye_refraction,
        samples: settings.samples,
        surface_shadows: settings.surface_shadows,
        underwater_shadows: settings.underwater_shadows,
        shadow_map_size: settings.shadow_map_size,
        stencil: false,
    }
}

/// Builds the frame: positions of all receivers; direct light and volumes of each light; the picture.
///
/// # Errors
/// With an error of the loop over lights. The passes of this technique raise none.
pub fn build(
    scene: &Scene,
    receivers: &Receivers,
    water: Option<&HeightField>,
    layers: &[&str],
    settings: &CausticVolumes,
) -> Result<TechniqueFrame, RenderError> {
    let mut builder = FrameBuilder::new(scene, receivers, water, &view(settings));
    let targets = CausticTargets::new(&mut builder, layers, "volume_count");
    let flux_model = match settings.radiometry {
        Radiometry::Physical => FluxModel::Conserved,
        Radiometry::Paper => FluxModel::FlatTransmittance,
    };
    let (mut audit, mut tallies) = (Audit::default(), Vec::new());
    let mut all_beams: Vec<Arc<LightBeams>> = Vec::new();
    builder.lights(|builder, light| {
        if let Some(field) = water {
            let beams = Arc::new(Interface::new(field, &scene.lights[light.number], &light.uniform, &scene.medium).beams(flux_model));
            let bottom_y = bottom_of_volumes(scene, receivers, settings, &beams);
            volume_pass(builder, &beams, &targets, light, bottom_y, settings);
            audit.merge(&beams.energy);
            tallies.push(Tally::Beams(Box::new(builder.beam_tally(light, beams.clone(), beams.sigma_t, bottom_y))));
            all_beams.push(beams);
        }
        Ok(())
    })?;
    let mut frame = builder.finish(targets.contributions());
    frame.tallies.extend(tallies);
    Ok(TechniqueFrame { audit, counters: counters(receivers, &all_beams), ..frame })
}

fn counters(receivers: &Receivers, beams: &[Arc<LightBeams>]) -> Vec<(String, u64)> {
    let entry = |name: &str, count| (name.to_owned(), count);
    let beams = [entry("beams", beams.iter().map(|l| l.beams.len() as u64).sum()), entry("beams_dark", beams.iter().map(|l| l.dark).sum())];
    [receivers.counters(), beams.into()].concat()
}

/// Slack of the volumes in metres per unit of clip w: the size of a sixteenth of a pixel.
fn slack_per_w(builder: &FrameBuilder<'_>) -> f32 {
    let up = builder.scene.camera.view_from_world().inverse().transform_vector3(Vec3::Y);
    // Clip units per metre along the vertical of the picture.
    let per_metre = (builder.camera.clip_from_world * up.extend(0.0)).y.abs();
    2.0 / (per_metre * builder.size.1 as f32) / 16.0
}

/// Height of the volumes' bottom cap, in the space of the beams: just below the lowest receiver, or where the light has become negligible.
fn bottom_of_volumes(scene: &Scene, receivers: &Receivers, settings: &CausticVolumes, beams: &LightBeams) -> f32 {
    let Some(water) = &scene.water else { return 0.0 };
    let level = water.level_m * beams.side;
    let lowest = if beams.side > 0.0 { receivers.bounds.min.y } else { -receivers.bounds.max.y };
    let floor = lowest.min(level);
    let floor = floor - (level - floor) * settings.depth_below_floor;
    let clearest = beams.sigma_t.min_element();
    if clearest > 0.0 && settings.negligible_light > 0.0 {
        let reach = -libm::logf(settings.negligible_light) / clearest;
        floor.max(level - reach)
    } else {
        floor
    }
}

/// Adds the volumes of one light: additive, one side of each hull, without depth writes.
fn volume_pass(
    builder: &mut FrameBuilder<'_>,
    beams: &LightBeams,
    targets: &CausticTargets,
    light: &FrameLight,
    bottom_y: f32,
    settings: &CausticVolumes,
) {
    let number = light.number;
    let slack = slack_per_w(builder);
    let shadows = if builder.view.shadows(light.in_water).straight { 1.0 } else { 0.0 };
    // For an eye above water, a front face passes the depth test wherever the receiver lies behind it, along the whole volume. A back face passes
    // almost only where the receiver lies inside the volume.
    let back = settings.faces != Faces::Front;
    let wanted = if back { -1.0 } else { 1.0 };
    let uniform = VolumeUniform { shape: Vec4::new(bottom_y, slack, shadows, wanted), sigma_t: beams.sigma_t.extend(beams.side) };
    let uniform = builder.uniform(&format!("volumes {number}"), &uniform);
    // An empty buffer cannot be bound.
    let dark = [Beam::default()];
    let data = if beams.beams.is_empty() { &dark[..] } else { &beams.beams[..] };
    let storage = builder.frame.buffer(format!("beams {number}"), Arc::new(Buffer::from_slice(data)));
    let bindings = builder.frame.bind_group(vec![
        BindEntry::Uniform(builder.camera_buffer, 0),
        BindEntry::Uniform(uniform, 0),
        BindEntry::Uniform(light.buffer, 0),
        BindEntry::Storage(storage),
        BindEntry::texture(builder.position),
        BindEntry::texture(builder.normal),
        BindEntry::texture(builder.visibility),
        BindEntry::texture(light.straight_map),
        BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
    ]);
    // Front faces must lie before the receiver. Back faces must lie behind it, which also works for an eye inside of the volume [decision E3].
    let (cull, compare) = if back { (Face::Front, CompareFunction::GreaterEqual) } else { (Face::Back, CompareFunction::LessEqual) };
    let [direction, count] = targets.optional_sums(light);
    let (states, color) = additive(&[Some(targets.irradiance_sum(light)), direction, count]);
    let pipeline = builder.frame.pipeline(RenderPipelineDescriptor {
        primitive: PrimitiveState {
            topology: PrimitiveTopology::PointList,
            cull_mode: Some(cull),
            unclipped_depth: true,
            ..PrimitiveState::default()
        },
        depth_stencil: Some(depth_state(builder.depth_format, compare, false, DepthBiasState::default())),
        targets: states,
        ..RenderPipelineDescriptor::new("caustic_volumes", shaders::program(settings.radiometry))
    });
    builder.frame.passes.push(Pass {
        label: format!("caustic_volumes {number}"),
        color,
        depth_stencil: Some(DepthStencilAttachment { view: builder.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
        draws: vec![Draw::new(pipeline, bindings, 0..beams.beams.len() as u32)],
        ..Pass::default()
    });
}
