//! The program of all conformance drawings: vertices come unchanged from a storage buffer.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::TextureFormat;
use nephroid_pipeline::{BindingKind, Bindings, ChannelKind, format_info};

/// A vertex of a conformance primitive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Clip space.
    pub position: [f32; 4],
    /// Output of the fragment stage.
    pub color: [f32; 4],
}

/// Bindings: vertices, point size in pixels in x.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Storage(size_of::<Vertex>()), BindingKind::Uniform(16)];

/// Type of the fragment stage's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The colour.
    Float,
    /// The colour's bit patterns as unsigned integers.
    Uint,
    /// The colour's bit patterns as signed integers.
    Sint,
}

impl Output {
    /// The type that targets of this format take.
    #[must_use]
    pub fn of(format: TextureFormat) -> Self {
        match format_info(format).map(|info| info.kind) {
            Some(ChannelKind::Uint(_)) => Self::Uint,
            Some(ChannelKind::Sint(_)) => Self::Sint,
            _ => Self::Float,
        }
    }
}

macro_rules! twin {
    ($interpolate:literal) => {
        twin!($interpolate, "vec4<f32>", "in.color")
    };
    ($interpolate:literal, $output:literal, $value:literal) => {
        concat!(
            "
struct Vertex {
    position: vec4<f32>,
    color: vec4<f32>,
}

@group(0) @binding(0) var<storage, read> vertices: array<Vertex>;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) ",
            $interpolate,
            " color: vec4<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    let vertex = vertices[index];
    return Varyings(vertex.position, vertex.color);
}

@fragment
fn fs(in: Varyings) -> @location(0) ",
            $output,
            " {
    return ",
            $value,
            ";
}
"
        )
    };
}

/// The program for float targets, with this interpolation of colours.
#[must_use]
pub fn program(interpolation: Interpolation) -> Arc<Program> {
    let (name, wgsl) = match interpolation {
        Interpolation::Flat => ("conformance_flat", twin!("@interpolate(flat)")),
        Interpolation::Linear => ("conformance_linear", twin!("@interpolate(linear)")),
        Interpolation::Perspective => ("conformance_perspective", twin!("@interpolate(perspective)")),
    };
    let varyings = vec![Varying { name: "color", components: 4, interpolation }];
    let wgsl = Some(wgsl);
    Arc::new(match interpolation {
        Interpolation::Flat => Program { varyings, wgsl, bindings: BINDINGS.to_vec(), ..Program::new(name, Pull, FlatColor) },
        _ => Program { varyings, wgsl, bindings: BINDINGS.to_vec(), ..Program::new(name, Pull, MixedColor) },
    })
}

/// The program for targets of a type. Integers are flat.
#[must_use]
pub fn program_for(interpolation: Interpolation, output: Output) -> Arc<Program> {
    let (name, wgsl) = match output {
        Output::Float => return program(interpolation),
        Output::Uint => ("conformance_uint", twin!("@interpolate(flat)", "vec4<u32>", "bitcast<vec4<u32>>(in.color)")),
        Output::Sint => ("conformance_sint", twin!("@interpolate(flat)", "vec4<i32>", "bitcast<vec4<i32>>(in.color)")),
    };
    let varyings = vec![Varying { name: "color", components: 4, interpolation: Interpolation::Flat }];
    Arc::new(Program { varyings, wgsl: Some(wgsl), bindings: BINDINGS.to_vec(), ..Program::new(name, Pull, FlatColor) })
}

struct Pull;

impl VertexShader for Pull {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let vertices: &[Vertex] = bindings.storage(0);
        let of = |i: u32| vertices.get(i as usize).copied().unwrap_or_default();
        output.position = input.per_vertex4(|i| of(i).position);
        let color = input.per_vertex4(|i| of(i).color);
        for (slot, value) in output.varyings.iter_mut().zip([color.x, color.y, color.z, color.w]) {
            *slot = value;
        }
        let settings: &[f32; 4] = bindings.uniform(1);
        output.point_size = L::splat(input.token, settings[0]);
    }
}

/// Fragment shader with one colour per primitive.
struct FlatColor;

impl FragmentShader for FlatColor {
    const PER_PRIMITIVE: bool = true;
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let [r, g, b, a] = [0, 1, 2, 3].map(|k| L::splat(input.token, input.flat(k)));
        output.color[0] = v4(r, g, b, a);
    }
}

/// Fragment shader with the interpolated colour.
struct MixedColor;

impl FragmentShader for MixedColor {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = v4(input.varying(0), input.varying(1), input.varying(2), input.varying(3));
    }
}
