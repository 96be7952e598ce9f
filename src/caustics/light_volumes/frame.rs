//! The passes of the beams: two draws for each run of slabs, one that counts and one that adds light and resets the count [BO §3.2].

use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::beams::LightBeams;
use crate::passes::fullscreen;
use crate::stage::light::StageLight;
use crate::stage::state::{clear, clear_or_keep, target};
use crate::stage::{Stage, View};
use nephroid_pipeline::frame::{BindEntry, DepthTarget, FrameDraw, FrameIndex, FramePass, TextureId};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::state::{
    ADDITIVE, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, IndexFormat, PrimitiveState,
    StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor};
use nephroid_scene::{Radiometry, Scene};

use super::cull::Drawn;
use super::settings::{Gather, LightVolumes};
use super::shaders::{self, BeamSlot, BeamsUniform, RelightUniform};
use super::slices::{Slices, runs};

/// The stencil where no beam is, in the middle so that counts can go both ways [decision E2].
pub const REFERENCE: u32 = 128;

/// Bytes from one beam's uniforms to the next.
const SLOT_BYTES: u32 = size_of::<BeamSlot>() as u32;

/// Beams that one task makes draws of.
const BEAMS_PER_TASK: usize = 1024;

/// What light is added up in.
#[derive(Clone, Debug)]
pub struct Targets {
    /// Irradiance.
    pub caustic: TextureId,
    /// Sums of intensities (one), or of vectors by red, green and blue light (three); none where irradiance is added up itself.
    pub sums: Vec<TextureId>,
    /// Sum of irradiance times direction.
    pub direction: Option<TextureId>,
    /// Beams per pixel.
    pub count: Option<TextureId>,
}

/// How the technique sees the scene.
#[must_use]
pub fn view(settings: &LightVolumes) -> View {
    View {
        eye_refraction: settings.eye_refraction,
        samples: settings.samples,
        surface_shadows: settings.shadows.samples_vertices(),
        underwater_shadows: settings.underwater_shadows,
        shadow_map_size: settings.shadow_map_size,
        stencil: true,
    }
}

/// Makes the targets that a way of gathering needs.
#[must_use]
pub fn targets(stage: &mut Stage, gather: Gather, direction: bool, count: bool) -> Targets {
    let sums: &[&str] = match gather {
        Gather::PerBeam => &[],
        Gather::FlatWater => &["intensity_sum"],
        Gather::Vector => &["vector_sum_red", "vector_sum_green", "vector_sum_blue"],
    };
    Targets {
        caustic: stage.target("caustic_irradiance", TextureFormat::Rgba32Float),
        sums: sums.iter().map(|label| stage.target(label, TextureFormat::Rgba32Float)).collect(),
        direction: direction.then(|| stage.target("caustic_direction_sum", TextureFormat::Rgba32Float)),
        count: count.then(|| stage.target("beam_count", TextureFormat::R32Float)),
    }
}

/// A light's beams.
pub struct LightPass<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The light's number.
    pub number: usize,
    /// What it is in the frame.
    pub light: &'a StageLight,
    /// Its beams.
    pub beams: &'a LightBeams,
    /// Those that are drawn.
    pub drawn: &'a [Drawn],
    /// Planes, vertices and indices.
    pub slices: &'a Slices,
    /// Whether the eye may be inside of a beam.
    pub eye_inside: bool,
    /// Whether the beams are in water: then the medium weakens them, maps tell which corners are lit, and what is under water hides things from others.
    pub in_water: bool,
}

impl LightPass<'_> {
    fn settings(&self) -> &LightVolumes {
        self.scene.techniques.get::<LightVolumes>()
    }

    /// Adds the passes to a frame.
    pub fn add(&self, stage: &mut Stage, targets: &Targets) {
        let settings = self.settings();
        let number = self.number;
        // The paper has no attenuation [decision E5].
        let weakened = self.in_water && settings.radiometry == Radiometry::Physical;
        let sigma_t = if weakened { self.scene.medium.sigma_t() } else { Vec3::ZERO };
        let sigma_t = sigma_t.extend(if self.in_water { 1.0 } else { 0.0 });
        let shadows = if self.in_water && settings.shadows.samples_vertices() { 1.0 } else { 0.0 };
        let (level, slabs) = (self.slices.planes_y[0], self.slices.planes_y.len() - 1);
        let step = (level - self.slices.planes_y[slabs]) / slabs as f32;
        let planes = Vec4::new(level, step, slabs as f32, shadows);
        let uniform = stage.uniform(&format!("beams {number}"), &BeamsUniform { sigma_t, planes });
        let slot = |drawn: &Drawn| BeamSlot::new(self.beams.beams[self.beams.of_triangle[drawn.triangle as usize] as usize]);
        // A buffer of nothing cannot be bound.
        let slots = Buffer::filled(self.drawn.len().max(1), |slots: &mut [BeamSlot]| {
            slots.par_iter_mut().zip(self.drawn).with_min_len(BEAMS_PER_TASK).for_each(|(to, drawn)| *to = slot(drawn));
        });
        let slots = stage.frame.buffer(format!("beam slots {number}"), Arc::new(slots));
        let vertices = stage.frame.buffer(format!("slices {number}"), self.slices.vertices.clone());
        let indices = stage.frame.buffer(format!("slice indices {number}"), self.slices.indices.clone());
        let bindings = stage.frame.bind_group(vec![
            BindEntry::Uniform(stage.camera_buffer, 0),
            BindEntry::Uniform(uniform, 0),
            BindEntry::Uniform(self.light.buffer, 0),
            BindEntry::Storage(vertices),
            BindEntry::DynamicUniform(slots),
            BindEntry::Texture(self.light.air_map),
            BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
            BindEntry::Texture(stage.position),
            BindEntry::Texture(stage.normal),
            BindEntry::Texture(stage.visibility),
        ]);

        let (states, color) = self.attachments(targets);
        let masked = states.iter().map(|state| state.clone().map(|state| ColorTargetState { write_mask: ColorWrites::empty(), ..state }));
        let primitive = PrimitiveState { unclipped_depth: true, ..PrimitiveState::default() };
        let program = shaders::beam_program(settings.radiometry, settings.gather, settings.energy);
        let count = stage.frame.pipeline(RenderPipelineDescriptor {
            primitive,
            depth_stencil: Some(stencil_state(stage.depth_format, self.eye_inside, true)),
            targets: masked.collect(),
            ..RenderPipelineDescriptor::new("light_volume_count", program.clone())
        });
        let energy = stage.frame.pipeline(RenderPipelineDescriptor {
            primitive,
            depth_stencil: Some(stencil_state(stage.depth_format, self.eye_inside, false)),
            targets: states,
            ..RenderPipelineDescriptor::new("light_volume_energy", program)
        });
        let draws_of = |(slot, &drawn): (usize, &Drawn)| {
            let cuts = self.beams.beams[self.beams.of_triangle[drawn.triangle as usize] as usize].cuts();
            let elements = runs(drawn.slabs).map(move |planes| self.slices.elements(cuts, planes));
            elements.flat_map(move |elements| {
                [count, energy].map(|pipeline| FrameDraw {
                    dynamic_offset: slot as u32 * SLOT_BYTES,
                    index: Some(FrameIndex { buffer: indices, format: IndexFormat::Uint32 }),
                    stencil_reference: REFERENCE,
                    ..FrameDraw::new(pipeline, bindings, elements.clone())
                })
            })
        };
        let draws = self.drawn.par_iter().enumerate().with_min_len(BEAMS_PER_TASK).flat_map_iter(draws_of).collect();
        stage.frame.passes.push(FramePass {
            label: format!("light_volumes {number}"),
            color,
            depth: Some(DepthTarget { view: stage.depth.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Clear(REFERENCE) }),
            draws,
            ..FramePass::default()
        });
        if !targets.sums.is_empty() {
            self.relight(stage, targets);
        }
    }

    /// States of the colour targets, and how each starts.
    fn attachments(&self, targets: &Targets) -> (Vec<Option<ColorTargetState>>, Vec<Option<nephroid_pipeline::frame::ColorTarget>>) {
        let first = self.number == 0;
        // Sums are of one light; irradiance, direction and count of all.
        let mut slots: Vec<Option<(TextureId, bool, TextureFormat)>> = match targets.sums.as_slice() {
            [] => vec![Some((targets.caustic, first, TextureFormat::Rgba32Float))],
            sums => sums.iter().map(|&sum| Some((sum, true, TextureFormat::Rgba32Float))).collect(),
        };
        slots.resize(3, None);
        slots.push(targets.direction.map(|t| (t, first, TextureFormat::Rgba32Float)));
        slots.push(targets.count.map(|t| (t, first, TextureFormat::R32Float)));
        while slots.last().is_some_and(Option::is_none) {
            slots.pop();
        }
        let states = slots.iter().map(|slot| slot.and_then(|(.., format)| target(format, Some(ADDITIVE)))).collect();
        (states, slots.iter().map(|slot| slot.and_then(|(texture, first, _)| clear_or_keep(texture, first))).collect())
    }

    /// From sums to irradiance.
    fn relight(&self, stage: &mut Stage, targets: &Targets) {
        let radiometry = self.settings().radiometry;
        let to_light = shaders::to_light(self.light.uniform.refracted.truncate(), radiometry);
        let vectors = if targets.sums.len() > 1 { 1.0 } else { 0.0 };
        let uniform = stage.uniform(&format!("relight {}", self.number), &RelightUniform { to_light: to_light.extend(vectors) });
        let sum = |k: usize| BindEntry::Texture(targets.sums[k.min(targets.sums.len() - 1)]);
        let bindings = stage.frame.bind_group(vec![
            BindEntry::Uniform(uniform, 0),
            BindEntry::Texture(stage.normal),
            BindEntry::Texture(stage.position),
            sum(0),
            sum(1),
            sum(2),
        ]);
        let pipeline = stage.frame.pipeline(RenderPipelineDescriptor {
            targets: vec![target(TextureFormat::Rgba32Float, Some(ADDITIVE))],
            ..RenderPipelineDescriptor::new("light_volume_relight", shaders::relight_program())
        });
        stage.frame.passes.push(FramePass {
            label: format!("relight {}", self.number),
            color: vec![clear_or_keep(targets.caustic, self.number == 0)],
            draws: vec![FrameDraw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..FramePass::default()
        });
    }
}

/// A pass that only clears the irradiance: for scenes without a light or water.
pub fn nothing(stage: &mut Stage, targets: &Targets) {
    stage.frame.passes.push(FramePass { label: "light_volumes".into(), color: vec![clear(targets.caustic)], ..FramePass::default() });
}

/// The state of beams' draws, for those that count and those that add light.
///
/// Counting: fronts up, backs down, where they lie before the receiver; for an eye that may be inside of a beam, the other way around where they lie
/// behind it. Drawing: where the count is not the reference, and it is put back [decision E2].
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
