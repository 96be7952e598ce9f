//! A light's view, of any size: position, normal, material, refractive index and depth of the nearest surface along each of its rays [LD11 §4.1, the
//! light's geometry buffer; WD06 §3, Fig. 2; PP10 §3, step 2]; or of the farthest one, where light leaves a body that it has entered at the nearest
//! [Wyman 2005, *An Approximate Image-Space Approach for Interactive Refraction*, back faces].
//!
//! Targets. The colour targets are zero where the light meets no surface:
//!
//! | Target | Format | x, y, z | w |
//! |---|---|---|---|
//! | `position` | Rgba32Float | world space, m | 1 |
//! | `normal` | Rgba32Float | world space, unit, against the light | 1 + [`MaterialKind`] |
//! | `material` | Rgba32Float | albedo, reflectance of a mirror, or absorption of a refracting body, 1/m | refractive index behind the surface over the one in front of it; 0 for an opaque surface |
//! | `curvature` | R32Float, Rgba32Float if the vertices have shape operators | in x, what the vertices have in `normal_ws.w`, such as a mean curvature, 1/m, above 0 where the surface bulges towards the light; in y and z | and in w, the three [`forms`](super::shape_operator) of the shape operator by the view's axes, likewise |
//! | `depth` | Depth32Float | 0..=1, near to far, of the view's projection; where the light meets no surface, 1 for nearest surfaces, 0 for farthest | |
//!
//! If the light meets a surface from behind, it is inside of the body or under the water: the normal is turned, the index ratio inverted and the
//! curvature's sign changed. The caller chooses the surfaces: receivers, mirrors and glass, a water surface, together or in separate buffers. Faces are
//! drawn on both sides, but for [`Keep::NearestBack`]. With a [`Side`] only what is in the water is kept, or only what is out of it: light that has passed
//! the water's surface reaches what a roof over the water would hide. Not supported: surfaces between the nearest and the farthest.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, transform_point, v4};
use nephroid_pipeline::frame::{BindEntry, BindGroupId, BufferId, ColorAttachment, DepthStencilAttachment, Draw, Frame, Pass, TextureId};
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{
    Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, Face, PrimitiveState, StencilState,
    TextureFormat,
};
use nephroid_pipeline::{BindingKind, Bindings, Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::{Albedo, Material, PatternUniform};

use super::camera::CameraUniform;
use super::geometry_buffer::{MaterialKind, ReceiverVertex};
use super::light_view::LightView;
use super::shape_operator::{ShapeOperator, forms, view_axes};

/// Uniform of a surface: how it interacts with light.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceUniform {
    /// Albedo, reflectance of a mirror, or absorption of a refracting body, 1/m.
    pub pattern: PatternUniform,
    /// x: 1 + [`MaterialKind`]. y, z: refractive index of the inside, and its inverse; 0 and 0 for an opaque surface.
    pub optics: Vec4,
}

impl SurfaceUniform {
    fn new(albedo: &Albedo, kind: MaterialKind, [inside, outside]: [f32; 2]) -> Self {
        Self { pattern: albedo.into(), optics: Vec4::new(1.0 + kind as u8 as f32, inside, outside, 0.0) }
    }

    /// The boundary of a body of glass with this refractive index, above 0, and this absorption, 1/m.
    #[must_use]
    pub fn glass(ior: f32, absorption: Vec3) -> Self {
        Self::new(&Albedo::Solid(absorption), MaterialKind::Dielectric, [ior, 1.0 / ior])
    }

    /// The surface of water of this refractive index, above 0: a mesh whose normals point up.
    #[must_use]
    pub fn water(ior: f32) -> Self {
        Self::new(&Albedo::Solid(Vec3::ZERO), MaterialKind::Water, [ior, 1.0 / ior])
    }
}

impl From<&Material> for SurfaceUniform {
    fn from(material: &Material) -> Self {
        match material {
            Material::Diffuse { albedo } => Self::new(albedo, MaterialKind::Diffuse, [0.0; 2]),
            Material::Mirror { reflectance } => Self::new(&Albedo::Solid(*reflectance), MaterialKind::Mirror, [0.0; 2]),
            Material::Dielectric { ior, absorption, .. } => Self::glass(*ior, *absorption),
        }
    }
}

/// Triangles of one surface.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceDraw {
    /// Vertices as [`ReceiverVertex`], or of the same layout, such as [`super::water_surface::WaterVertex`].
    pub vertices: BufferId,
    /// 32-bit indices; `None` for vertices in order.
    pub indices: Option<BufferId>,
    /// Range of vertices, or of indices.
    pub range: Range<u32>,
    /// How the surface interacts with light.
    pub surface: SurfaceUniform,
    /// A [`ShapeOperator`] for each vertex. Either all draws of a light buffer have them, or none.
    pub operators: Option<BufferId>,
}

/// The surface that is kept of those along a ray of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The first surface that the light meets.
    Nearest,
    /// The last surface before the far plane; for one closed body, where light leaves it for the last time.
    Farthest,
    /// The first surface that the light meets from behind, by the order of its triangles' corners: where it leaves the first closed body.
    NearestBack,
}

/// The side of the water's surface on which surfaces are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// Uniform of a camera in this scene, which knows the water's extent.
    pub camera: BufferId,
    /// Heights of the water's surface.
    pub heights: TextureId,
    /// Whether what is kept is in the water, or out of it.
    pub wet: bool,
}

/// Which surfaces a light buffer keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Of those along a ray of light.
    pub along: Keep,
    /// On one side of the water's surface; `None` for both. With a side, shape operators are left out.
    pub side: Option<Side>,
}

impl From<Keep> for Kept {
    fn from(along: Keep) -> Self {
        Self { along, side: None }
    }
}

/// The textures of a light buffer, described in the module's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightBuffer {
    /// World position.
    pub position: TextureId,
    /// Normal and kind.
    pub normal: TextureId,
    /// Albedo and relative refractive index.
    pub material: TextureId,
    /// Curvature.
    pub curvature: TextureId,
    /// Depth.
    pub depth: TextureId,
}

/// Bindings: view, vertices, surface; and shape operators, where vertices have them.
pub const BINDINGS: [BindingKind; 4] = [
    BindingKind::Uniform(size_of::<LightView>()),
    BindingKind::Storage(size_of::<ReceiverVertex>()),
    BindingKind::Uniform(size_of::<SurfaceUniform>()),
    BindingKind::Storage(size_of::<ShapeOperator>()),
];

/// Bindings for one side of the water's surface: view, vertices, surface, camera, heights of the water's surface.
pub const ONE_SIDE_BINDINGS: [BindingKind; 5] =
    [BINDINGS[0], BINDINGS[1], BINDINGS[2], BindingKind::Uniform(size_of::<CameraUniform>()), BindingKind::Texture];

/// The WGSL sources that all programs share, and their own.
macro_rules! sources {
    ($($own:literal),+) => {
        concat!(
            include_str!("../../scene/pattern.wgsl"),
            include_str!("receiver_vertex.wgsl"),
            include_str!("light_view.wgsl"),
            include_str!("light_buffer.wgsl"),
            $(include_str!($own)),+
        )
    };
}

/// The program; `bent`: for vertices with shape operators.
#[must_use]
pub fn program(bent: bool) -> Arc<Program> {
    let varying = |name, components| Varying { name, components, interpolation: Interpolation::Perspective };
    let varyings = vec![varying("position_ws", 3), varying("normal_ws", 4)];
    if bent {
        return Arc::new(Program {
            varyings: varyings.into_iter().chain([varying("forms", 3)]).collect(),
            bindings: BINDINGS.to_vec(),
            wgsl: Some(sources!("shape_operator.wgsl", "light_buffer_bent.wgsl")),
            ..Program::new("bent_light_buffer", Vertex::<true>, Fragment::<true>)
        });
    }
    Arc::new(Program {
        varyings,
        bindings: BINDINGS[..3].to_vec(),
        wgsl: Some(sources!("light_buffer_plain.wgsl", "light_buffer_both_sides.wgsl")),
        ..Program::new("light_buffer", Vertex::<false>, Fragment::<false>)
    })
}

/// The program for surfaces on one side of the water's surface.
#[must_use]
pub fn one_side_program(wet: bool) -> Arc<Program> {
    Arc::new(Program {
        bindings: ONE_SIDE_BINDINGS.to_vec(),
        may_discard: true,
        wgsl: Some(sources!("camera.wgsl", "under_water.wgsl", "light_buffer_plain.wgsl", "light_buffer_one_side.wgsl")),
        wgsl_constants: vec![("wet", f64::from(u8::from(wet)))],
        varyings: program(false).varyings.clone(),
        ..Program::new("one_side_light_buffer", Vertex::<false>, OneSide { wet })
    })
}

struct Vertex<const BENT: bool>;

impl<const BENT: bool> VertexShader for Vertex<BENT> {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let view: &LightView = bindings.uniform(0);
        let vertices: &[ReceiverVertex] = bindings.storage(1);
        let position = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.position_ws.to_array())).xyz();
        let normal = input.per_vertex4(|i| vertices.get(i as usize).map_or([0.0; 4], |v| v.normal_ws.to_array()));
        output.position = transform_point(&view.clip_from_world, position);
        output.set3(0, position);
        output.set3(3, normal.xyz());
        output.varyings[6] = normal.w;
        if BENT {
            let operators: &[ShapeOperator] = bindings.storage(3);
            let diagonal = input.per_vertex4(|i| operators.get(i as usize).map_or([0.0; 4], |v| v.diagonal.to_array())).xyz();
            let beside = input.per_vertex4(|i| operators.get(i as usize).map_or([0.0; 4], |v| v.beside.to_array())).xyz();
            output.set3(7, forms(view_axes(&view.clip_from_world), diagonal, beside));
        }
    }
}

struct Fragment<const BENT: bool>;

impl<const BENT: bool> FragmentShader for Fragment<BENT> {
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
        let sign = L::select(from_behind, -one, one);
        output.color[3] = v4(input.varying(6) * sign, zero, zero, zero);
        if BENT {
            let forms = input.varying3(7) * sign;
            output.color[3] = v4(input.varying(6) * sign, forms.x, forms.y, forms.z);
        }
    }
}

struct OneSide {
    wet: bool,
}

impl FragmentShader for OneSide {
    const MERGES_FRAGMENTS: bool = true;

    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(3);
        let position: V3<L> = input.varying3(0);
        let wet = camera.under_water(bindings.texture(4), position) | camera.is_beside_and_lower(position);
        output.keep = if self.wet { wet } else { !wet };
        Fragment::<false>.fragment(bindings, input, output);
    }
}

/// Adds a pass named `label` and its targets `{label} position`, `{label} normal`, `{label} material`, `{label} curvature` and `{label} depth`, of `size` texels.
///
/// Of surfaces at equal depth, the first one drawn is kept.
pub fn add(
    frame: &mut Frame,
    label: &str,
    view: &LightView,
    size: (u32, u32),
    kept: impl Into<Kept>,
    draws: &[SurfaceDraw],
) -> LightBuffer {
    let Kept { along, side } = kept.into();
    let (compare, clear_depth, cull_mode) = match along {
        Keep::Nearest => (CompareFunction::Less, 1.0, None),
        Keep::Farthest => (CompareFunction::Greater, 0.0, None),
        Keep::NearestBack => (CompareFunction::Less, 1.0, Some(Face::Front)),
    };
    let bent = side.is_none() && draws.iter().any(|draw| draw.operators.is_some());
    let bends = if bent { TextureFormat::Rgba32Float } else { TextureFormat::R32Float };
    let mut target = |part: &str, format| frame.texture(TextureDescriptor::d2(format!("{label} {part}"), size.0, size.1, format));
    let format = TextureFormat::Rgba32Float;
    let buffer = LightBuffer {
        position: target("position", format),
        normal: target("normal", format),
        material: target("material", format),
        curvature: target("curvature", bends),
        depth: target("depth", TextureFormat::Depth32Float),
    };
    let state = |format| Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL });
    let pipeline = frame.pipeline(RenderPipelineDescriptor {
        primitive: PrimitiveState { cull_mode, ..PrimitiveState::default() },
        targets: vec![state(format), state(format), state(format), state(bends)],
        depth_stencil: Some(DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(compare),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        }),
        ..RenderPipelineDescriptor::new(label, side.map_or_else(|| program(bent), |side| one_side_program(side.wet)))
    });
    let view = frame.buffer(label, Arc::new(Buffer::from_value(view)));
    let mut made: Vec<(&SurfaceDraw, BindGroupId)> = Vec::new();
    let mut frame_draws = Vec::with_capacity(draws.len());
    for draw in draws {
        let known = made
            .iter()
            .find(|(other, _)| other.vertices == draw.vertices && other.surface == draw.surface && other.operators == draw.operators);
        let bindings = known.map_or_else(
            || {
                let surface = frame.buffer(format!("{label} surface {}", made.len()), Arc::new(Buffer::from_value(&draw.surface)));
                let entries = [BindEntry::Uniform(view, 0), BindEntry::Storage(draw.vertices), BindEntry::Uniform(surface, 0)];
                let of_side = side.map(|side| [BindEntry::Uniform(side.camera, 0), BindEntry::texture(side.heights)]);
                let operators = draw.operators.filter(|_| side.is_none()).map(BindEntry::Storage);
                frame.bind_group(entries.into_iter().chain(operators).chain(of_side.into_iter().flatten()).collect())
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
    let targets = [buffer.position, buffer.normal, buffer.material, buffer.curvature];
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
