//! The programs of the beams: swept through the slicing planes, counted in the stencil, then drawn with their light [BO §3.2].
//!
//! A vertex shader makes the vertices of every beam from one array of dummy vertices; the beam is a uniform. The draw that counts and the draw that
//! adds light run the same program, so their vertices have the same bits on any driver. The draw that counts masks all colours.
//!
//! | File, with its twin in WGSL | What |
//! |---|---|
//! | `section` | vertices of a beam's sections on the slicing planes |
//! | `lit` | light at the generator, and the area that the light is spread over |
//! | `face`, `receiver` | light computed at the faces of a beam, or at the height of the receiver |
//! | `contribution` | contribution of a beam to the targets |
//! | `relight` | conversion of summed intensities or vectors to irradiance |

mod contribution;
mod face;
mod lit;
mod receiver;
mod relight;
mod section;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use crate::beams::Beam;
use crate::passes::camera::CameraUniform;
use crate::passes::fullscreen::FullscreenVertex;
use crate::passes::shadow_map::LightUniform;
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v3};
use nephroid_pipeline::BindingKind;
use nephroid_pipeline::shader::{Interpolation, Program, Varying};
use nephroid_scene::Radiometry;

use super::settings::{EnergyAt, Gather};
use super::slices::SliceVertex;
use face::{FragmentAtFace, VertexAtFace};
use receiver::{FragmentAtReceiver, VertexAtReceiver};
use relight::Relight;

pub use relight::to_light;

/// Uniforms that all beams of a light share.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BeamsUniform {
    /// Extinction coefficient, 1/m; 0 in paper radiometry. w is 1 if objects under water cast shadows.
    pub sigma_t: Vec4,
    /// x: mean level of the generators, m. y: distance between planes, m. z: number of slabs. w: 1 if vertices are looked up in the shadow map.
    pub planes: Vec4,
    /// x: 1, or −1 if the beams are upside down ([`crate::beams::LightBeams::side`]). The rest is unused.
    pub space: Vec4,
}

impl BeamsUniform {
    /// A point or vector of the beams' space in the world, or the other way round.
    #[inline(always)]
    pub fn turned<L: Lanes>(&self, v: V3<L>) -> V3<L> {
        v3(v.x, v.y * self.space.x, v.z)
    }
}

/// A beam's uniforms. The offsets of dynamic uniforms are multiples of 256 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BeamSlot {
    /// The beam.
    pub beam: Beam,
    padding: [Vec4; 9],
}

impl BeamSlot {
    /// The slot of a beam.
    #[must_use]
    pub fn new(beam: Beam) -> Self {
        Self { beam, padding: [Vec4::ZERO; 9] }
    }
}

/// Uniforms of a `relight` pass.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RelightUniform {
    /// Direction towards the light under still water: a unit vector (paper), or per unit of height (physical). w: 1 if vectors are summed, 0 if
    /// intensities are.
    pub to_light: Vec4,
}

/// Bindings of the beams' programs: camera, beams, light, slices, the beam, shadow map, comparison sampler, position, normal, visibility.
pub const BINDINGS: [BindingKind; 10] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Uniform(size_of::<BeamsUniform>()),
    BindingKind::Uniform(size_of::<LightUniform>()),
    BindingKind::Storage(size_of::<SliceVertex>()),
    BindingKind::DynamicUniform(size_of::<Beam>()),
    BindingKind::DepthTexture,
    BindingKind::ComparisonSampler,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// Bindings of the relighting program: light, normal, position, three sums.
pub const RELIGHT_BINDINGS: [BindingKind; 6] = [
    BindingKind::Uniform(size_of::<RelightUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// The program that counts beams and draws their light.
///
/// Targets: irradiance; or the sum of intensities; or the sums of vectors for red, green and blue light (three targets). Then the sum of irradiance
/// times direction, and the number of beams.
#[must_use]
pub fn beam_program(radiometry: Radiometry, gather: Gather, energy: EnergyAt) -> Arc<Program> {
    let varying = |name, interpolation| Varying { name, components: 3, interpolation };
    let paper = radiometry == Radiometry::Paper;
    let flag = |on| f64::from(u8::from(on));
    let constants = vec![("paper", flag(paper)), ("gather", f64::from(gather as u8))];
    let shared = BINDINGS.to_vec();
    Arc::new(match energy {
        EnergyAt::Face => Program {
            bindings: shared,
            varyings: vec![varying("intensity", Interpolation::Perspective), varying("ray", Interpolation::Perspective)],
            wgsl: Some(concat!(
                include_str!("../../../math/optics.wgsl"),
                include_str!("../../passes/camera.wgsl"),
                include_str!("../../passes/shadow_map.wgsl"),
                include_str!("../../beams/geometry.wgsl"),
                include_str!("section.wgsl"),
                include_str!("lit.wgsl"),
                include_str!("contribution.wgsl"),
                include_str!("face.wgsl")
            )),
            wgsl_constants: constants,
            ..Program::new("light_volume_face", VertexAtFace, FragmentAtFace { paper, gather })
        },
        EnergyAt::Receiver => Program {
            bindings: shared,
            varyings: vec![varying("lit", Interpolation::Flat)],
            wgsl: Some(concat!(
                include_str!("../../../math/optics.wgsl"),
                include_str!("../../passes/camera.wgsl"),
                include_str!("../../passes/shadow_map.wgsl"),
                include_str!("../../beams/geometry.wgsl"),
                include_str!("section.wgsl"),
                include_str!("lit.wgsl"),
                include_str!("contribution.wgsl"),
                include_str!("receiver.wgsl")
            )),
            wgsl_constants: constants,
            ..Program::new("light_volume_receiver", VertexAtReceiver, FragmentAtReceiver { paper, gather })
        },
    })
}

/// The program that converts summed intensities or vectors to irradiance.
#[must_use]
pub fn relight_program() -> Arc<Program> {
    Arc::new(Program {
        bindings: RELIGHT_BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("../../passes/fullscreen.wgsl"), include_str!("relight.wgsl"))),
        ..Program::new("light_volume_relight", FullscreenVertex, Relight)
    })
}
