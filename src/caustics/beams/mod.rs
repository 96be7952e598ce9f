//! Generators and their refracted rays: one beam per triangle of the water mesh and light [SF05 §3.2, BO §3.2].
//!
//! `refract` makes beams, `window` finds the part of the surface where a lamp in the water needs them, `geometry` (with its WGSL twin) computes their
//! cross-sections, `landing` counts where their light ends.
//!
//! Beams go down. Those of a light in the water go up, and are computed upside down: mirrored at the plane y = 0, see [`LightBeams::side`].

pub mod geometry;
mod landing;
mod refract;
mod window;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

pub use geometry::comes_first;
pub use landing::BeamTally;
pub use refract::Interface;
pub use window::window;

use crate::audit::Audit;

/// Value of [`LightBeams::of_triangle`] for a triangle without a beam.
pub const NONE: u32 = u32::MAX;

/// Memory of the beams of a water mesh, bytes: those of all lights, with `extra` bytes more for each. Making those of the last light takes no more than what
/// is made after them.
#[must_use]
pub fn memory_bytes((columns, rows): (u32, u32), lights: usize, extra: u64) -> u64 {
    let (vertices, lights) = (u64::from(columns) * u64::from(rows), lights as u64);
    let of_triangle = size_of::<Beam>() as u64 + size_of::<u32>() as u64 + extra;
    let kept = 2 * of_triangle + size_of::<[Vec4; 2]>() as u64;
    vertices * lights * kept
}

/// Flux of a beam from the light at its generator. E⊥ is the irradiance on a surface perpendicular to the light, T the transmittance of the surface,
/// ω the light's direction, n and A normal and area of the triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FluxModel {
    /// `E⊥·|ω·n|·A·T`, with E⊥ and T the means of the vertices: conserves energy.
    Conserved,
    /// `E⊥·T·A`, with T that of the mean surface: no cosine [SF05 §3.4].
    FlatTransmittance,
    /// `E⊥·T·A`, with T the mean of the vertices: no cosine [BO §3.1].
    OwnTransmittance,
}

/// A beam, or caustic volume: the light that passes through one triangle of the water mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Beam {
    /// Generator triangle, metres. w is 1 if the edge i → i+1 starts at the end that both of its beams evaluate it from (see [`comes_first`]),
    /// otherwise −1.
    pub g: [Vec4; 3],
    /// Refracted rays per metre of depth: x, length of the ray, z; w is the vertex's transmittance over the mean of the three.
    pub d: [Vec4; 3],
    /// Flux by [`FluxModel`], W, linear RGB; w is the generator's area, m².
    pub flux: Vec4,
}

/// A light's beams through a water surface.
#[derive(Clone, Debug)]
pub struct LightBeams {
    /// In the order of the mesh's triangles, without those that carry no light.
    pub beams: Vec<Beam>,
    /// Per triangle of the mesh, the number of its beam; [`NONE`] for triangles that carry no light.
    pub of_triangle: Vec<u32>,
    /// Per vertex of a water mesh, its position (m) and its refracted ray per metre of depth, as in [`Beam`]; both are NaN where there is no
    /// ray. Empty for beams of other generators.
    pub vertex_rays: Vec<[Vec4; 2]>,
    /// Per beam of mirrors and glass, the height below which it lights nothing, m; empty for beams of water, which shadow maps end.
    pub ends_y: Vec<f32>,
    /// 1, or −1 if the beams are upside down: y is minus the world's.
    pub side: f32,
    /// Extinction coefficient along the beams, 1/m, linear RGB.
    pub sigma_t: Vec3,
    /// Energy up to where beams start.
    pub energy: Audit,
    /// Number of triangles without a beam.
    pub dark: u64,
}

impl Default for LightBeams {
    /// No beams, the right way up.
    fn default() -> Self {
        let (beams, of_triangle, vertex_rays, ends_y) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { beams, of_triangle, vertex_rays, ends_y, side: 1.0, sigma_t: Vec3::ZERO, energy: Audit::default(), dark: 0 }
    }
}
