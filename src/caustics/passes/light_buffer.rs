//! What a light sees, of any size: position, normal, material, refractive index and depth of the nearest surface along each of its rays
//! [LD11 §4.1, the light's geometry buffer; WD06 §3, Fig. 2; PP10 §3, step 2], or of the farthest one, where light leaves a body
//! that it has entered at the nearest [Wyman 2005, *An Approximate Image-Space Approach for Interactive Refraction*, back faces].
//!
//! Targets; those of colour are all zeros where the light meets nothing:
//!
//! | Target | Format | x, y, z | w |
//! |---|---|---|---|
//! | `position` | Rgba32Float | world space, m | 1 |
//! | `normal` | Rgba32Float | world space, unit, against the light | 1 + [`MaterialKind`] |
//! | `material` | Rgba32Float | albedo, reflectance of a mirror, or 1 for what refracts | refractive index beyond the surface over the one before it; 0 for what lets no light through |
//! | `depth` | Depth32Float | 0..=1, near to far, that of the view's projection; where the light meets nothing, 1 for nearest surfaces, 0 for farthest | |
//!
//! A surface that is met from behind has its normal turned and its index inverted: the light is inside of the body, or under the water.
//! What is drawn is the caller's choice: receivers, mirrors and glass, a water surface, together or in buffers of their own. Faces on both sides are
//! drawn. Not here: surfaces between the nearest and the farthest.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::space::{look_to, orthographic, perspective};
use nephroid_math::vector::{V3, transform_point, v4};
use nephroid_pipeline::frame::{BindEntry, BindGroupId, BufferId, ColorAttachment, DepthStencilAttachment, Draw, Frame, Pass, TextureId};
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{
    Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, StencilState, TextureFormat,
};
use nephroid_pipeline::{BindingKind, Bindings, Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::{Albedo, Material, PatternUniform};

use super::geometry_buffer::{MaterialKind, ReceiverVertex};
use super::shadow_map::LightUniform;

/// The part of space that a light at a point looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pyramid {
    /// The light's place, m.
    pub position_ws: Vec3,
    /// Middle of the view, of any length above 0.
    pub axis_ws: Vec3,
    /// Upwards in the view, not along the axis.
    pub up_ws: Vec3,
    /// Vertical opening angle, in `(0, π)`.
    pub fov_y_rad: f32,
    /// Width over height, above 0.
    pub aspect: f32,
    /// Distance of the near plane along the axis, m, above 0.
    pub near_m: f32,
    /// Distance of the far plane, m, above that; may be infinite.
    pub far_m: f32,
}

/// A light's projection.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightView {
    /// Clip space from world space.
    pub clip_from_world: Mat4,
    /// Position, m, w = 1; for parallel light the unit vector along which it travels, w = 0.
    pub position_ws: Vec4,
}

impl LightView {
    /// Parallel light: the box `min_ls..max_ls` of light space, m, in which the light looks along −z from the origin of world space, `up_ws` upwards.
    ///
    /// `None` where the direction is along `up_ws`, or the box is empty.
    #[must_use]
    pub fn parallel(direction_ws: Vec3, up_ws: Vec3, min_ls: Vec3, max_ls: Vec3) -> Option<Self> {
        let clip_from_world = orthographic(min_ls, max_ls)? * look_to(Vec3::ZERO, direction_ws, up_ws)?;
        Some(Self { clip_from_world, position_ws: direction_ws.normalize().extend(0.0) })
    }

    /// Light from a point. `None` where the axis is along `up_ws`, or the pyramid is empty.
    #[must_use]
    pub fn point(p: &Pyramid) -> Option<Self> {
        let clip_from_view = perspective(p.fov_y_rad, p.aspect, p.near_m, p.far_m)?;
        let clip_from_world = clip_from_view * look_to(p.position_ws, p.axis_ws, p.up_ws)?;
        Some(Self { clip_from_world, position_ws: p.position_ws.extend(1.0) })
    }

    /// Unit vector along which light travels when it gets to a point.
    #[inline(always)]
    fn direction_at<L: Lanes>(&self, p_ws: V3<L>) -> V3<L> {
        let light = V3::splat(p_ws.x.token(), self.position_ws.truncate());
        if self.position_ws.w == 0.0 { light } else { (p_ws - light).normalize() }
    }
}

/// The view of the shadow map through air.
impl From<&LightUniform> for LightView {
    fn from(light: &LightUniform) -> Self {
        Self { clip_from_world: light.clip_from_world, position_ws: light.position_ws }
    }
}

/// What a surface does with light.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceUniform {
    /// Albedo, or reflectance of a mirror.
    pub pattern: PatternUniform,
    /// 1 + [`MaterialKind`]; refractive index of the inside, and its inverse, or 0 and 0 for what lets no light through; unused.
    pub optics: Vec4,
}

impl SurfaceUniform {
    fn new(albedo: &Albedo, kind: MaterialKind, [inside, outside]: [f32; 2]) -> Self {
        Self { pattern: albedo.into(), optics: Vec4::new(1.0 + kind as u8 as f32, inside, outside, 0.0) }
    }

    /// The boundary of a body of this refractive index, above 0: of glass, or, with a mesh whose normals point up, of water.
    #[must_use]
    pub fn refracting(ior: f32) -> Self {
        Self::new(&Albedo::Solid(Vec3::ONE), MaterialKind::Dielectric, [ior, 1.0 / ior])
    }
}

impl From<&Material> for SurfaceUniform {
    fn from(material: &Material) -> Self {
        match material {
            Material::Diffuse { albedo } => Self::new(albedo, MaterialKind::Diffuse, [0.0; 2]),
            Material::Mirror { reflectance } => Self::new(&Albedo::Solid(*reflectance), MaterialKind::Mirror, [0.0; 2]),
            Material::Dielectric { ior, .. } => Self::refracting(*ior),
        }
    }
}

/// Triangles of one surface.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceDraw {
    /// [`ReceiverVertex`], or what is laid out like it, as [`super::water_surface::WaterVertex`] is.
    pub vertices: BufferId,
    /// 32-bit indices; `None` to draw the vertices in order.
    pub indices: Option<BufferId>,
    /// Vertices, or places in the index buffer.
    pub range: Range<u32>,
    /// What the surface does with light.
    pub surface: SurfaceUniform,
}

/// Which of the surfaces along a ray of light is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The first one that light meets.
    Nearest,
    /// The last one before the far plane: of one closed body, where light has passed all of it.
    Farthest,
}

/// The textures of a light buffer, see the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightBuffer {
    /// Position.
    pub position: TextureId,
    /// Normal and kind.
    pub normal: TextureId,
    /// Albedo and relative refractive index.
    pub material: TextureId,
    /// Depth.
    pub depth: TextureId,
}

/// Bindings: view, vertices, surface.
pub const BINDINGS: [BindingKind; 3] = [
    BindingKind::Uniform(size_of::<LightView>()),
    BindingKind::Storage(size_of::<ReceiverVertex>()),
    BindingKind::Uniform(size_of::<SurfaceUniform>()),
];

/// The program.
#[must_use]
pub fn program() -> Arc<Program> {
    let varying = |name| Varying { name, components: 3, interpolation: Interpolation::Perspective };
    Arc::new(Program {
        varyings: vec![varying("position_ws"), varying("normal_ws")],
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("../../scene/pattern.wgsl"),
            include_str!("receiver_vertex.wgsl"),
            include_str!("light_buffer.wgsl")
        )),
        ..Program::new("light_buffer", Vertex, Fragment)
    })
}

struct Vertex;

impl VertexShader for Vertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let view: &LightView = bindings.uniform(0);
        let vertices: &[ReceiverVertex] = bindings.storage(1);
        let position = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.position_ws.to_array())).xyz();
        let normal = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.normal_ws.to_array())).xyz();
        output.position = transform_point(&view.clip_from_world, position);
        output.set3(0, position);
        output.set3(3, normal);
    }
}

struct Fragment;

impl FragmentShader for Fragment {
    const MERGES_FRAGMENTS: bool = true;

    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let view: &LightView = bindings.uniform(0);
        let surface: &SurfaceUniform = bindings.uniform(2);
        let position: V3<L> = input.varying3(0);
        let normal = input.varying3(3).normalize();
        let (zero, one) = (position.x.like(0.0), position.x.like(1.0));
        let from_behind = normal.dot(view.direction_at(position)).gt(zero);
        let normal = V3::select(from_behind, -normal, normal);
        let albedo = surface.pattern.at(position, normal);
        let index = L::select(from_behind, one.like(surface.optics.z), one.like(surface.optics.y));
        output.color[0] = v4(position.x, position.y, position.z, one);
        output.color[1] = v4(normal.x, normal.y, normal.z, one.like(surface.optics.x));
        output.color[2] = v4(albedo.x, albedo.y, albedo.z, index);
    }
}

/// Adds a pass of this name and its targets `{label} position`, `{label} normal`, `{label} material` and `{label} depth`, texels by `size`.
///
/// Of surfaces at the same depth the first one drawn is kept.
pub fn add(frame: &mut Frame, label: &str, view: &LightView, size: (u32, u32), keep: Keep, draws: &[SurfaceDraw]) -> LightBuffer {
    let (compare, clear_depth) = match keep {
        Keep::Nearest => (CompareFunction::Less, 1.0),
        Keep::Farthest => (CompareFunction::Greater, 0.0),
    };
    let mut target = |part: &str, format| frame.texture(TextureDescriptor::d2(format!("{label} {part}"), size.0, size.1, format));
    let format = TextureFormat::Rgba32Float;
    let buffer = LightBuffer {
        position: target("position", format),
        normal: target("normal", format),
        material: target("material", format),
        depth: target("depth", TextureFormat::Depth32Float),
    };
    let state = Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL });
    let pipeline = frame.pipeline(RenderPipelineDescriptor {
        targets: vec![state.clone(), state.clone(), state],
        depth_stencil: Some(DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(compare),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        }),
        ..RenderPipelineDescriptor::new(label, program())
    });
    let view = frame.buffer(label, Arc::new(Buffer::from_value(view)));
    let mut made: Vec<(&SurfaceDraw, BindGroupId)> = Vec::new();
    let mut frame_draws = Vec::with_capacity(draws.len());
    for draw in draws {
        let known = made.iter().find(|(other, _)| other.vertices == draw.vertices && other.surface == draw.surface);
        let bindings = known.map_or_else(
            || {
                let surface = frame.buffer(format!("{label} surface {}", made.len()), Arc::new(Buffer::from_value(&draw.surface)));
                frame.bind_group(vec![BindEntry::Uniform(view, 0), BindEntry::Storage(draw.vertices), BindEntry::Uniform(surface, 0)])
            },
            |(_, bindings)| *bindings,
        );
        if known.is_none() {
            made.push((draw, bindings));
        }
        let plain = Draw::new(pipeline, bindings, draw.range.clone());
        frame_draws.push(match draw.indices {
            Some(indices) => plain.indexed(indices),
            None => plain,
        });
    }
    let load = LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 });
    let targets = [buffer.position, buffer.normal, buffer.material];
    frame.passes.push(Pass {
        label: label.to_owned(),
        color: targets.map(|texture| Some(ColorAttachment { view: texture.into(), load })).to_vec(),
        depth_stencil: Some(DepthStencilAttachment {
            view: buffer.depth.into(),
            depth_load: LoadOp::Clear(clear_depth),
            stencil_load: LoadOp::Load,
        }),
        draws: frame_draws,
        ..Pass::default()
    });
    buffer
}
