//! The passes of the beams. Each run of slabs has two draws: one counts in the stencil, one adds light and resets the count [BO §3.2].

use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::beams::{Beam, LightBeams};
use crate::builder::state::{Sum, additive, clear};
use crate::builder::{CausticTargets, FrameBuilder, FrameLight, ViewOptions};
use crate::passes::fullscreen;
use nephroid_pipeline::frame::{BindEntry, ColorAttachment, DepthStencilAttachment, Draw, FrameIndex, Pass, TextureId};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::state::{
    ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, FrontFace, IndexFormat, PrimitiveState,
    StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor};
use nephroid_scene::Radiometry;

use super::cull::ClampedBeam;
use super::settings::{Gather, LightVolumes};
use super::shaders::{self, BeamSlot, BeamsUniform, RelightUniform};
use super::slices::{Slices, runs};

/// Stencil value outside of all beams, in the middle of the range so that counts can go up and down [decision E2].
pub const REFERENCE: u32 = 128;

/// Distance in bytes between the uniforms of consecutive beams.
const SLOT_BYTES: u32 = size_of::<BeamSlot>() as u32;

/// Beams per parallel task that makes draws.
const BEAMS_PER_TASK: usize = 1024;

/// Textures in which light is summed.
#[derive(Clone, Debug)]
pub struct Targets {
    /// Irradiance and optional layers.
    pub caustic: CausticTargets,
    /// Per-light sums: intensities (one texture), or vectors for red, green and blue light (three textures). Empty if irradiance is summed directly.
    pub sums: Vec<TextureId>,
}

/// How the technique views the scene.
#[must_use]
pub fn view(settings: &LightVolumes) -> ViewOptions {
    ViewOptions {
        eye_refraction: settings.eye_refraction,
        samples: settings.samples,
        surface_shadows: settings.shadows.samples_vertices(),
        underwater_shadows: settings.underwater_shadows,
        shadow_map_size: settings.shadow_map_size,
        stencil: true,
    }
}

/// Adds the textures that a gather method and the wanted layers need.
#[must_use]
pub fn targets(builder: &mut FrameBuilder<'_>, gather: Gather, layers: &[&str]) -> Targets {
    let sums: &[&str] = match gather {
        Gather::PerBeam => &[],
        Gather::FlatWater => &["intensity_sum"],
        Gather::Vector => &["vector_sum_red", "vector_sum_green", "vector_sum_blue"],
    };
    Targets {
        caustic: CausticTargets::new(builder, layers, "beam_count"),
        sums: sums.iter().map(|label| builder.target(label, TextureFormat::Rgba32Float)).collect(),
    }
}

/// Extinction coefficient with which beams are drawn, 1/m. The paper has no attenuation [decision E5].
pub fn sigma_t(settings: &LightVolumes, beams: &LightBeams) -> Vec3 {
    if settings.radiometry == Radiometry::Physical { beams.sigma_t } else { Vec3::ZERO }
}

/// The passes of one light.
pub struct LightPass<'a> {
    /// The technique's settings.
    pub settings: &'a LightVolumes,
    /// The light.
    pub light: &'a FrameLight,
    /// Its beams.
    pub beams: &'a LightBeams,
    /// The beams accepted by culling.
    pub accepted: &'a [ClampedBeam],
    /// Slicing planes, dummy vertices and indices.
    pub slices: &'a Slices,
    /// Whether the eye may be inside of a beam.
    pub eye_inside: bool,
    /// Whether the beams have passed the water's surface. If so, a shadow map decides which vertices are lit, and objects beyond the surface cast
    /// shadows.
    pub by_water: bool,
}

impl LightPass<'_> {
    /// Adds the light's passes to a frame.
    pub fn add(&self, builder: &mut FrameBuilder<'_>, targets: &Targets) {
        let settings = self.settings;
        let number = self.light.number;
        let sigma_t = sigma_t(settings, self.beams).extend(if self.by_water { 1.0 } else { 0.0 });
        let shadows = if self.by_water && builder.view.shadows(self.light.in_water).straight { 1.0 } else { 0.0 };
        let (level, slabs) = (self.slices.planes_y[0], self.slices.planes_y.len() - 1);
        let step = (level - self.slices.planes_y[slabs]) / slabs as f32;
        let planes = Vec4::new(level, step, slabs as f32, shadows);
        let uniform = builder
            .uniform(&format!("beams {number}"), &BeamsUniform { sigma_t, planes, space: Vec4::new(self.beams.side, 0.0, 0.0, 0.0) });
        // An empty buffer cannot be bound.
        let slots = Buffer::filled(self.accepted.len().max(1), |slots: &mut [BeamSlot]| {
            let filled = slots.par_iter_mut().zip(self.accepted).with_min_len(BEAMS_PER_TASK);
            filled.for_each(|(slot, accepted)| *slot = BeamSlot::new(*self.beam(accepted)));
        });
        let slots = builder.frame.buffer(format!("beam slots {number}"), Arc::new(slots));
        let vertices = builder.frame.buffer(format!("slices {number}"), self.slices.vertices.clone());
        let indices = builder.frame.buffer(format!("slice indices {number}"), self.slices.indices.clone());
        let bindings = builder.frame.bind_group(vec![
            BindEntry::Uniform(builder.camera_buffer, 0),
            BindEntry::Uniform(uniform, 0),
            BindEntry::Uniform(self.light.buffer, 0),
            BindEntry::Storage(vertices),
            BindEntry::DynamicUniform(slots),
            BindEntry::texture(self.light.straight_map),
            BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
            BindEntry::texture(builder.position),
            BindEntry::texture(builder.normal),
            BindEntry::texture(builder.visibility),
        ]);

        let (states, color) = self.attachments(targets);
        let masked = states.iter().map(|state| state.clone().map(|state| ColorTargetState { write_mask: ColorWrites::empty(), ..state }));
        // Turned over, bodies wind the other way.
        let front_face = if self.beams.side > 0.0 { FrontFace::Ccw } else { FrontFace::Cw };
        let primitive = PrimitiveState { unclipped_depth: true, front_face, ..PrimitiveState::default() };
        let program = shaders::beam_program(settings.radiometry, settings.gather, settings.energy);
        let count = builder.frame.pipeline(RenderPipelineDescriptor {
            primitive,
            depth_stencil: Some(stencil_state(builder.depth_format, self.eye_inside, true)),
            targets: masked.collect(),
            ..RenderPipelineDescriptor::new("light_volume_count", program.clone())
        });
        let energy = builder.frame.pipeline(RenderPipelineDescriptor {
            primitive,
            depth_stencil: Some(stencil_state(builder.depth_format, self.eye_inside, false)),
            targets: states,
            ..RenderPipelineDescriptor::new("light_volume_energy", program)
        });
        let draws_of = |(slot, &accepted): (usize, &ClampedBeam)| {
            let cuts = self.beam(&accepted).cuts();
            let ranges = runs(accepted.slabs).map(move |planes| self.slices.indices(cuts, planes));
            ranges.flat_map(move |range| {
                [count, energy].map(|pipeline| Draw {
                    dynamic_offset: slot as u32 * SLOT_BYTES,
                    index: Some(FrameIndex { buffer: indices, format: IndexFormat::Uint32 }),
                    stencil_reference: REFERENCE,
                    ..Draw::new(pipeline, bindings, range.clone())
                })
            })
        };
        let draws = self.accepted.par_iter().enumerate().with_min_len(BEAMS_PER_TASK).flat_map_iter(draws_of).collect();
        builder.frame.passes.push(Pass {
            label: format!("light_volumes {number}"),
            color,
            depth_stencil: Some(DepthStencilAttachment {
                view: builder.depth.into(),
                depth_load: LoadOp::Load,
                stencil_load: LoadOp::Clear(REFERENCE),
            }),
            draws,
            ..Pass::default()
        });
        if !targets.sums.is_empty() {
            self.relight(builder, targets);
        }
    }

    fn beam(&self, accepted: &ClampedBeam) -> &Beam {
        &self.beams.beams[self.beams.of_triangle[accepted.triangle as usize] as usize]
    }

    /// Pipeline targets and attachments of the beams. Intensities and vectors are summed per light; irradiance, direction and count are summed over
    /// all lights.
    fn attachments(&self, targets: &Targets) -> (Vec<Option<ColorTargetState>>, Vec<Option<ColorAttachment>>) {
        let per_light = |texture| Sum { texture, format: TextureFormat::Rgba32Float, clear: true };
        let mut sums: Vec<Option<Sum>> = match targets.sums.as_slice() {
            [] => vec![Some(targets.caustic.irradiance_sum(self.light))],
            textures => textures.iter().map(|&texture| Some(per_light(texture))).collect(),
        };
        sums.resize(3, None);
        sums.extend(targets.caustic.optional_sums(self.light));
        additive(&sums)
    }

    /// Converts the sums to irradiance.
    fn relight(&self, builder: &mut FrameBuilder<'_>, targets: &Targets) {
        let to_light = shaders::to_light(self.light.uniform.refracted.truncate(), self.settings.radiometry);
        let vectors = if targets.sums.len() > 1 { 1.0 } else { 0.0 };
        let uniform = builder.uniform(&format!("relight {}", self.light.number), &RelightUniform { to_light: to_light.extend(vectors) });
        let sum = |k: usize| BindEntry::texture(targets.sums[k.min(targets.sums.len() - 1)]);
        let bindings = builder.frame.bind_group(vec![
            BindEntry::Uniform(uniform, 0),
            BindEntry::texture(builder.normal),
            BindEntry::texture(builder.position),
            sum(0),
            sum(1),
            sum(2),
        ]);
        let (states, color) = additive(&[Some(targets.caustic.irradiance_sum(self.light))]);
        let pipeline = builder.frame.pipeline(RenderPipelineDescriptor {
            targets: states,
            ..RenderPipelineDescriptor::new("light_volume_relight", shaders::relight_program())
        });
        builder.frame.passes.push(Pass {
            label: format!("relight {}", self.light.number),
            color,
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
    }
}

/// A pass that only clears the irradiance: for scenes without a light or without generators.
pub fn clear_irradiance(builder: &mut FrameBuilder<'_>, targets: &Targets) {
    let color = vec![clear(targets.caustic.irradiance)];
    builder.frame.passes.push(Pass { label: "light_volumes".into(), color, ..Pass::default() });
}

/// Depth and stencil state of the beams' draws: of those that count (`counts`), or of those that add light.
///
/// Counting: front faces before the receiver count up, back faces before it count down. If the eye may be inside of a beam, front faces behind the
/// receiver count down and back faces behind it count up. Adding light: drawn where the count differs from the reference; the draw sets the count
/// back to the reference [decision E2].
#[must_use]
pub fn stencil_state(format: TextureFormat, eye_inside: bool, counts: bool) -> DepthStencilState {
    let (up, down) = (StencilOperation::IncrementWrap, StencilOperation::DecrementWrap);
    let face = |operation| {
        if counts {
            StencilFaceState { pass_op: operation, ..StencilFaceState::IGNORE }
        } else {
            StencilFaceState { compare: CompareFunction::NotEqual, pass_op: StencilOperation::Replace, ..StencilFaceState::IGNORE }
        }
    };
    let (front, back, compare) =
        if eye_inside { (face(down), face(up), CompareFunction::GreaterEqual) } else { (face(up), face(down), CompareFunction::Less) };
    DepthStencilState {
        format,
        depth_write_enabled: Some(false),
        depth_compare: Some(compare),
        stencil: StencilState { front, back, read_mask: 0xff, write_mask: 0xff },
        bias: DepthBiasState::default(),
    }
}
