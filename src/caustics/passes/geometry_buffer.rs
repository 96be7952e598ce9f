//! The nearest receiver of each pixel: world position, normal and albedo [SF05 §3.5, first pass].
//!
//! Targets: `position` (x, y, z in metres, w = 1 + [`MaterialKind`], 0 where there is nothing), `normal` (unit, turned towards the eye; w = refractive index
//! of glass, otherwise 1), `albedo` (reflectance of a mirror; white for glass; w = 1 under water, otherwise 0).
//!
//! Which points are under water is decided here alone, by the surface above each point; all later passes read it.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v4};
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};
use nephroid_scene::{Albedo, Material, PatternUniform};

use super::camera::CameraUniform;

/// A receiver's vertex in world space.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ReceiverVertex {
    /// Position, m; w = 1.
    pub position_ws: Vec4,
    /// Unit normal; w = 0.
    pub normal_ws: Vec4,
}

/// Kind of a pixel's surface, stored as `position.w − 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialKind {
    /// Lambertian: the only kind that receives caustics.
    Diffuse = 0,
    /// Mirror.
    Mirror = 1,
    /// Glass.
    Dielectric = 2,
    /// The surface of the water, in light buffers.
    Water = 3,
}

/// Uniform of a receiver's material.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MaterialUniform {
    /// Albedo, or reflectance of a mirror.
    pub pattern: PatternUniform,
    /// x: 1 + [`MaterialKind`]. y: refractive index of glass, otherwise 1. The rest is unused.
    pub kind: Vec4,
}

impl MaterialUniform {
    fn new(albedo: &Albedo, kind: MaterialKind, ior: f32) -> Self {
        Self { pattern: albedo.into(), kind: Vec4::new(1.0 + kind as u8 as f32, ior, 0.0, 0.0) }
    }

    /// A back face of glass, which has the absorption coefficient of the inside (1/m) for its albedo.
    #[must_use]
    pub fn inside_of_glass(ior: f32, absorption: Vec3) -> Self {
        Self::new(&Albedo::Solid(absorption), MaterialKind::Dielectric, ior)
    }
}

impl From<&Material> for MaterialUniform {
    fn from(material: &Material) -> Self {
        match material {
            Material::Diffuse { albedo } => Self::new(albedo, MaterialKind::Diffuse, 1.0),
            Material::Mirror { reflectance } => Self::new(&Albedo::Solid(*reflectance), MaterialKind::Mirror, 1.0),
            Material::Dielectric { ior, .. } => Self::new(&Albedo::Solid(Vec3::ONE), MaterialKind::Dielectric, *ior),
        }
    }
}

/// Bindings of the pass: camera, vertices, material, heights of the water's surface.
pub const BINDINGS: [BindingKind; 4] = [
    BindingKind::Uniform(size_of::<CameraUniform>()),
    BindingKind::Storage(size_of::<ReceiverVertex>()),
    BindingKind::Uniform(size_of::<MaterialUniform>()),
    BindingKind::Texture,
];

/// The program.
#[must_use]
pub fn program() -> Arc<Program> {
    let varying = |name| Varying { name, components: 3, interpolation: Interpolation::Perspective };
    Arc::new(Program {
        varyings: vec![varying("position_ws"), varying("normal_ws")],
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("camera.wgsl"),
            include_str!("under_water.wgsl"),
            include_str!("../../scene/pattern.wgsl"),
            include_str!("receiver_vertex.wgsl"),
            include_str!("geometry_buffer.wgsl")
        )),
        ..Program::new("geometry_buffer", Vertex, Fragment)
    })
}

struct Vertex;

impl VertexShader for Vertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let vertices: &[ReceiverVertex] = bindings.storage(1);
        let position = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.position_ws.to_array())).xyz();
        let normal = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.normal_ws.to_array())).xyz();
        output.position = camera.project(position);
        output.set3(0, position);
        output.set3(3, normal);
    }
}

struct Fragment;

impl FragmentShader for Fragment {
    const MERGES_FRAGMENTS: bool = true;

    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let material: &MaterialUniform = bindings.uniform(2);
        let position: V3<L> = input.varying3(0);
        let normal = input.varying3(3).normalize();
        // Open surfaces receive light on both sides, so the normal is turned towards the eye.
        let away = normal.dot(camera.view_direction(position)).gt(position.x.like(0.0));
        let normal = V3::select(away, -normal, normal);
        let albedo = material.pattern.at(position, normal);
        let one = position.x.like(1.0);
        output.color[0] = v4(position.x, position.y, position.z, one.like(material.kind.x));
        output.color[1] = v4(normal.x, normal.y, normal.z, one.like(material.kind.y));
        let wet = L::select(camera.under_water(bindings.texture(3), position), one, one.like(0.0));
        output.color[2] = v4(albedo.x, albedo.y, albedo.z, wet);
    }
}
