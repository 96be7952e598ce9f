//! Frames that use what a pass may draw to and read beside plain images: mip levels, layers, faces of cubes, streams of vertices. Their
//! arithmetic is exact in f32, so that the software GPU, the expected values and any driver must agree to the bit.

#![allow(dead_code, reason = "no test binary uses all of it")]

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v3, v4};
use nephroid_pipeline::frame::{
    AttachmentView, BindEntry, BindGroupId, BufferId, ColorAttachment, Draw, Frame, Pass, StreamOut, TextureId, TextureView,
};
use nephroid_pipeline::sampler::{Sampler, load, sample_cube};
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Geometry, GeometryInput, GeometryOutput, GeometryShader, Interpolation, Program,
    Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{
    Color, ColorTargetState, ColorWrites, GeometryTopology, PixelRect, TextureFormat, VertexAttribute, VertexBufferLayout, VertexFormat,
    VertexStepMode,
};
use nephroid_pipeline::{
    BindingKind, Bindings, Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor, TextureShape, TextureViewDescriptor,
};

const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// One triangle over the whole target.
struct Fullscreen;

impl VertexShader for Fullscreen {
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let x = input.per_vertex(|i| if i == 1 { 3.0 } else { -1.0 });
        let y = input.per_vertex(|i| if i == 2 { 3.0 } else { -1.0 });
        output.position = v4(x, y, x.like(0.0), x.like(1.0));
    }
}

fn target() -> Option<ColorTargetState> {
    Some(ColorTargetState { format: FORMAT, blend: None, write_mask: ColorWrites::ALL })
}

fn cleared(view: impl Into<AttachmentView>) -> Option<ColorAttachment> {
    Some(ColorAttachment { view: view.into(), load: LoadOp::Clear(Color { r: -1.0, g: -1.0, b: -1.0, a: -1.0 }) })
}

/// A pass that draws a triangle over all of a surface.
fn fullscreen_pass(frame: &mut Frame, label: String, program: Program, entries: Vec<BindEntry>, view: AttachmentView) {
    let name = program.name;
    let pipeline =
        frame.pipeline(RenderPipelineDescriptor { targets: vec![target()], ..RenderPipelineDescriptor::new(name, Arc::new(program)) });
    let group = frame.bind_group(entries);
    frame.passes.push(Pass { label, color: vec![cleared(view)], draws: vec![Draw::new(pipeline, group, 0..3)], ..Pass::default() });
}

/// Writes `(x, y, number, 1)` with whole pixel coordinates.
struct Coordinates;

impl FragmentShader for Coordinates {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let number: &[f32; 4] = bindings.uniform(0);
        let one = L::splat(input.token, 1.0);
        output.color[0] = v4(input.position.x - 0.5, input.position.y - 0.5, one * number[0], one);
    }
}

fn coordinates_program() -> Program {
    Program {
        bindings: vec![BindingKind::Uniform(16)],
        wgsl: Some(COORDINATES_WGSL),
        ..Program::new("coordinates", Fullscreen, Coordinates)
    }
}

const COORDINATES_WGSL: &str = "
@group(0) @binding(0) var<uniform> number: vec4<f32>;
@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
@fragment fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(position.xy - 0.5, number.x, 1.0);
}
";

/// The mean of the 2x2 texels above each pixel.
struct Halve;

impl FragmentShader for Halve {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let above = bindings.texture(0);
        let (x, y) = ((input.position.x - 0.5) * 2.0, (input.position.y - 0.5) * 2.0);
        let texel = |dx: f32, dy: f32| load(above, x + dx, y + dy, 0, 0);
        let sum: V4<L> = (texel(0.0, 0.0) + texel(1.0, 0.0)) + (texel(0.0, 1.0) + texel(1.0, 1.0));
        output.color[0] = sum * L::splat(input.token, 0.25);
    }
}

const HALVE_WGSL: &str = "
@group(0) @binding(0) var above: texture_2d<f32>;
@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
@fragment fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = 2 * vec2<i32>(position.xy);
    let sum = (textureLoad(above, at, 0) + textureLoad(above, at + vec2<i32>(1, 0), 0))
        + (textureLoad(above, at + vec2<i32>(0, 1), 0) + textureLoad(above, at + vec2<i32>(1, 1), 0));
    return sum * 0.25;
}
";

/// Side of level 0 of [`mip_chain`].
pub const CHAIN_SIDE: u32 = 64;

/// A texture whose levels are drawn one from the other: level 0 holds `(x, y, 3, 1)`, each lower level the mean of 2x2 texels of the one above.
pub fn mip_chain() -> (Frame, TextureId) {
    let mut frame = Frame::default();
    let levels = CHAIN_SIDE.ilog2() + 1;
    let texture =
        frame.texture(TextureDescriptor { mip_level_count: levels, ..TextureDescriptor::d2("chain", CHAIN_SIDE, CHAIN_SIDE, FORMAT) });
    let number = frame.buffer("number", Arc::new(Buffer::from_value(&[3.0_f32, 0.0, 0.0, 0.0])));
    let entries = vec![BindEntry::Uniform(number, 0)];
    fullscreen_pass(&mut frame, "level 0".into(), coordinates_program(), entries, texture.into());
    for level in 1..levels {
        let above = TextureView { texture, range: TextureViewDescriptor::level(level - 1) };
        let program = Program { bindings: vec![BindingKind::Texture], wgsl: Some(HALVE_WGSL), ..Program::new("halve", Fullscreen, Halve) };
        let view = AttachmentView { texture, level, layer: 0 };
        fullscreen_pass(&mut frame, format!("level {level}"), program, vec![BindEntry::texture(above)], view);
    }
    (frame, texture)
}

/// What a level of [`mip_chain`] holds at a pixel: the mean of the coordinates of its square.
pub fn chain_texel(level: u32, x: u32, y: u32) -> [f32; 4] {
    let mean = |at: u32| (at << level) as f32 + ((1_u32 << level) - 1) as f32 * 0.5;
    [mean(x), mean(y), 3.0, 1.0]
}

/// Where a face of a cube lies: its centre, and the directions of rising column and row.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Face {
    centre: [f32; 4],
    right: [f32; 4],
    down: [f32; 4],
    /// First column of the picture that shows the face.
    first: [f32; 4],
    padding: [[f32; 4]; 12],
}

/// Sides of the faces of [`cube`].
pub const FACE_SIDE: u32 = 4;

/// By face, +X −X +Y −Y +Z −Z: centre, right and down [WebGPU, cube map face selection].
const FACES: [[[f32; 3]; 3]; 6] = [
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]],
    [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
    [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
];

/// Samples a cube in the direction of each pixel of a face.
struct SampleFace;

impl FragmentShader for SampleFace {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let face: &Face = bindings.uniform(0);
        let scale = 2.0 / FACE_SIDE as f32;
        let u = (input.position.x - face.first[0]) * scale - 1.0;
        let v = input.position.y * scale - 1.0;
        let axis = |i: usize| u * face.right[i] + v * face.down[i] + face.centre[i];
        let direction = v3(axis(0), axis(1), axis(2));
        output.color[0] = sample_cube(bindings.texture(1), &bindings.sampler(2), direction, u.like(0.0));
    }
}

const SAMPLE_FACE_WGSL: &str = "
struct Face { centre: vec4<f32>, right: vec4<f32>, down: vec4<f32>, first: vec4<f32> }
@group(0) @binding(0) var<uniform> face: Face;
@group(0) @binding(1) var cube: texture_cube<f32>;
@group(0) @binding(2) var nearest: sampler;
@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
@fragment fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let u = (position.x - face.first.x) * 0.5 - 1.0;
    let v = position.y * 0.5 - 1.0;
    let direction = face.right.xyz * u + face.down.xyz * v + face.centre.xyz;
    return textureSampleLevel(cube, nearest, direction, 0.0);
}
";

/// Draws `(x, y, face, 1)` to the six faces of a cube, then shows them side by side, seen from the cube's middle. The picture's texture.
pub fn cube() -> (Frame, TextureId) {
    let mut frame = Frame::default();
    let cube = frame.texture(TextureDescriptor {
        depth_or_layers: 6,
        shape: TextureShape::Cube,
        ..TextureDescriptor::d2("cube", FACE_SIDE, FACE_SIDE, FORMAT)
    });
    for face in 0..6 {
        let number = frame.buffer(format!("number {face}"), Arc::new(Buffer::from_value(&[face as f32, 0.0, 0.0, 0.0])));
        let view = AttachmentView { texture: cube, level: 0, layer: face };
        fullscreen_pass(&mut frame, format!("face {face}"), coordinates_program(), vec![BindEntry::Uniform(number, 0)], view);
    }
    let picture = frame.texture(TextureDescriptor::d2("picture", 6 * FACE_SIDE, FACE_SIDE, FORMAT));
    let four = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
    let faces: Vec<Face> = (0..6)
        .map(|number| {
            let [centre, right, down] = FACES[number].map(four);
            let first = [(number as u32 * FACE_SIDE) as f32, 0.0, 0.0, 0.0];
            Face { centre, right, down, first, padding: [[0.0; 4]; 12] }
        })
        .collect();
    let faces = frame.buffer("faces", Arc::new(Buffer::from_slice(&faces)));
    let entries = vec![BindEntry::DynamicUniform(faces), BindEntry::texture(cube), BindEntry::Sampler(Sampler::default())];
    let program = Program {
        bindings: vec![BindingKind::DynamicUniform(64), BindingKind::Texture, BindingKind::Sampler],
        wgsl: Some(SAMPLE_FACE_WGSL),
        ..Program::new("sample_face", Fullscreen, SampleFace)
    };
    fullscreen_pass(&mut frame, "picture".into(), program, entries, picture.into());
    let Some(pass) = frame.passes.last_mut() else { unreachable!("it was just added") };
    let draw = pass.draws[0].clone();
    pass.draws = (0..6)
        .map(|face| Draw {
            dynamic_offset: face * size_of::<Face>() as u32,
            scissor: Some(PixelRect { x0: face * FACE_SIDE, y0: 0, x1: (face + 1) * FACE_SIDE, y1: FACE_SIDE }),
            ..draw.clone()
        })
        .collect();
    (frame, picture)
}

/// Draws `(x, y, layer, 1)` to the layers of an array, then copies layer 2 into layer 0 of the same texture. The array.
pub fn layers() -> (Frame, TextureId) {
    let mut frame = Frame::default();
    let array = frame.texture(TextureDescriptor { depth_or_layers: 3, ..TextureDescriptor::d2("array", 8, 8, FORMAT) });
    for layer in 0..3 {
        let number = frame.buffer(format!("number {layer}"), Arc::new(Buffer::from_value(&[layer as f32, 0.0, 0.0, 0.0])));
        let view = AttachmentView { texture: array, level: 0, layer };
        fullscreen_pass(&mut frame, format!("layer {layer}"), coordinates_program(), vec![BindEntry::Uniform(number, 0)], view);
    }
    let last = TextureView { texture: array, range: TextureViewDescriptor::layer(2) };
    let program = Program { bindings: vec![BindingKind::Texture], wgsl: Some(COPY_WGSL), ..Program::new("copy", Fullscreen, Copy) };
    fullscreen_pass(&mut frame, "copy".into(), program, vec![BindEntry::texture(last)], array.into());
    (frame, array)
}

/// The texel at the pixel's own place.
struct Copy;

impl FragmentShader for Copy {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = load(bindings.texture(0), input.position.x - 0.5, input.position.y - 0.5, 0, 0);
    }
}

const COPY_WGSL: &str = "
@group(0) @binding(0) var source: texture_2d<f32>;
@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
@fragment fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return textureLoad(source, vec2<i32>(position.xy), 0);
}
";

/// A vertex as streamed out: clip position, then the colour.
pub type StreamedVertex = [f32; 8];

/// Floats of [`StreamedVertex`].
pub const STREAMED: usize = 8;

/// Sides of the targets of [`streams`], pixels.
pub const STREAM_SIDE: u32 = 32;

/// Pulls a vertex from storage, moves it right by `shift` and doubles its colour.
struct Shifted;

impl VertexShader for Shifted {
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let vertices: &[StreamedVertex] = bindings.storage(0);
        let shift: &[f32; 4] = bindings.uniform(1);
        let number = |c: usize| input.per_vertex(|i| vertices[i as usize][c]);
        output.position = v4(number(0) + shift[0], number(1), number(2), number(3));
        for scalar in 0..4 {
            output.varyings[scalar] = number(4 + scalar) * 2.0;
        }
    }
}

const SHIFTED_WGSL: &str = "
struct Vertex { position: vec4<f32>, color: vec4<f32> }
struct Out { @builtin(position) position: vec4<f32>, @location(0) color: vec4<f32> }
@group(0) @binding(0) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(1) var<uniform> shift: vec4<f32>;
@vertex fn vs(@builtin(vertex_index) i: u32) -> Out {
    let v = vertices[i];
    return Out(vec4<f32>(v.position.x + shift.x, v.position.yzw), v.color * 2.0);
}
@fragment fn fs(in: Out) -> @location(0) vec4<f32> { return in.color; }
";

/// Hands vertex attributes on: position at location 0, colour at location 1.
struct Attributes;

impl VertexShader for Attributes {
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        output.position = input.attribute(0);
        let color = input.attribute(1);
        for (scalar, value) in [color.x, color.y, color.z, color.w].into_iter().enumerate() {
            output.varyings[scalar] = value;
        }
    }
}

const ATTRIBUTES_WGSL: &str = "
struct Out { @builtin(position) position: vec4<f32>, @location(0) color: vec4<f32> }
@vertex fn vs(@location(0) position: vec4<f32>, @location(1) color: vec4<f32>) -> Out { return Out(position, color); }
@fragment fn fs(in: Out) -> @location(0) vec4<f32> { return in.color; }
";

/// The interpolated colour.
struct Interpolated;

impl FragmentShader for Interpolated {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = v4(input.varying(0), input.varying(1), input.varying(2), input.varying(3));
    }
}

/// Emits each triangle, and once more below itself.
struct Twice;

impl GeometryShader for Twice {
    fn geometry(&self, _: &Bindings<'_>, input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>) {
        for down in [0.0, 0.5] {
            for vertex in input.vertices {
                let [x, y, z, w] = vertex.position;
                output.emit([x, y - down, z, w], 1.0, vertex.varyings);
            }
            output.end_primitive();
        }
    }
}

fn color() -> Vec<Varying> {
    vec![Varying { name: "color", components: 4, interpolation: Interpolation::Perspective }]
}

fn shifted_program() -> Program {
    Program {
        varyings: color(),
        bindings: vec![BindingKind::Storage(32), BindingKind::Uniform(16)],
        wgsl: Some(SHIFTED_WGSL),
        ..Program::new("shifted", Shifted, Interpolated)
    }
}

/// What [`streams`] is made of.
pub struct Streams {
    /// The frame: passes `stream`, `append`, `draw`, `direct`.
    pub frame: Frame,
    /// Where passes stream out to.
    pub buffer: BufferId,
    /// Drawn from the stream.
    pub drawn: TextureId,
    /// Drawn directly.
    pub direct: TextureId,
}

/// Two triangles in the upper left quarter of the target, streamed out, and streamed out once more, shifted by half of the target; drawn from
/// the stream into one target, and directly into another. `room`: vertices that the buffer has room for. `geometry`: whether a geometry
/// shader doubles the triangles of both.
pub fn streams(room: usize, geometry: bool) -> Streams {
    let mut frame = Frame::default();
    let square = [[-1.0, 1.0], [-0.5, 1.0], [-1.0, 0.5], [-0.5, 1.0], [-0.5, 0.5], [-1.0, 0.5_f32]];
    let vertices: Vec<StreamedVertex> = square.map(|[x, y]| [x, y, 0.5, 1.0, 0.25, 0.5, 1.0, 2.0]).to_vec();
    let vertices = frame.buffer("vertices", Arc::new(Buffer::from_slice(&vertices)));
    let buffer = frame.buffer("stream", Arc::new(Buffer::from_slice(&vec![0.0_f32; room * STREAMED])));
    let stage = |program: Program| match geometry {
        true => Program {
            geometry: Some(Geometry {
                shader: Arc::new(Twice),
                output: GeometryTopology::TriangleStrip,
                max_vertices: 6,
                input_varyings: color(),
            }),
            wgsl: Some(FRAGMENT_WGSL),
            ..program
        },
        false => program,
    };
    let shifts = [0.0, 1.0].map(|shift: f32| frame.buffer(format!("shift {shift}"), Arc::new(Buffer::from_value(&[shift, 0.0, 0.0, 0.0]))));
    let groups: [BindGroupId; 2] = shifts.map(|shift| frame.bind_group(vec![BindEntry::Storage(vertices), BindEntry::Uniform(shift, 0)]));
    let streaming = frame.pipeline(RenderPipelineDescriptor {
        rasterizer_discard: true,
        ..RenderPipelineDescriptor::new("stream", Arc::new(stage(shifted_program())))
    });
    for (label, append, group) in [("stream", false, groups[0]), ("append", true, groups[1])] {
        frame.passes.push(Pass {
            label: label.into(),
            draws: vec![Draw { stream_out: Some(0), ..Draw::new(streaming, group, 0..6) }],
            stream_out: vec![StreamOut { buffer, append }],
            ..Pass::default()
        });
    }
    let [drawn, direct] = ["drawn", "direct"].map(|name| frame.texture(TextureDescriptor::d2(name, STREAM_SIDE, STREAM_SIDE, FORMAT)));
    let attribute =
        |location: u32| VertexAttribute { format: VertexFormat::Float32x4, offset: u64::from(location) * 16, shader_location: location };
    let from_stream = frame.pipeline(RenderPipelineDescriptor {
        targets: vec![target()],
        vertex_buffers: vec![VertexBufferLayout {
            array_stride: 4 * STREAMED as u64,
            step_mode: VertexStepMode::Vertex,
            attributes: vec![attribute(0), attribute(1)],
        }],
        ..RenderPipelineDescriptor::new(
            "from_stream",
            Arc::new(Program { varyings: color(), wgsl: Some(ATTRIBUTES_WGSL), ..Program::new("attributes", Attributes, Interpolated) }),
        )
    });
    let nothing = frame.bind_group(Vec::new());
    let draw = Draw { vertex_buffers: vec![(buffer, 0)], streamed: Some(buffer), ..Draw::new(from_stream, nothing, 0..u32::MAX) };
    frame.passes.push(Pass { label: "draw".into(), color: vec![cleared(drawn)], draws: vec![draw], ..Pass::default() });
    let plain = frame.pipeline(RenderPipelineDescriptor {
        targets: vec![target()],
        ..RenderPipelineDescriptor::new("direct", Arc::new(stage(shifted_program())))
    });
    let draws = groups.map(|group| Draw::new(plain, group, 0..6)).to_vec();
    frame.passes.push(Pass { label: "direct".into(), color: vec![cleared(direct)], draws, ..Pass::default() });
    Streams { frame, buffer, drawn, direct }
}

const FRAGMENT_WGSL: &str = "
@fragment fn fs(@location(0) color: vec4<f32>) -> @location(0) vec4<f32> { return color; }
";
