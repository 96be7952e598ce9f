//! Passes on the software GPU alone: devices, small shaders, targets, and comparisons.

#![allow(dead_code, unused_imports, reason = "no test binary uses all of it")]

use std::sync::{Arc, OnceLock};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, ShaderWidth, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{ADDITIVE, Color, ColorTargetState, ColorWrites, RasterRules, TextureFormat};
use nephroid_pipeline::{
    Binding, BindingKind, Bindings, Buffer, ColorAttachment, DepthStencilAttachment, Device, DeviceOptions, Draw, LoadOp, Observer, Pass,
    PassOutput, RenderPipeline, RenderPipelineDescriptor, StreamOutTarget, Texture, TextureDescriptor, run_pass,
};

pub use super::numbers::{Rng, fnv1a, full, sized};

/// The device most tests share: two threads, the machine's best SIMD level.
pub fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| Device::new(DeviceOptions { threads: Some(2), ..DeviceOptions::default() }).expect("threads start"))
}

/// A device on one thread with scalar shaders at the scalar SIMD level: the definition.
pub fn scalar_device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let options = DeviceOptions {
            threads: Some(1),
            level: Some(nephroid_math::level::available_levels()[0].1),
            width: ShaderWidth::One,
            ..DeviceOptions::default()
        };
        Device::new(options).expect("threads start")
    })
}

/// A vertex as [`Pull`] reads it: clip position, then four numbers for the fragment stage.
pub type Vertex = [f32; 8];

/// A vertex with one number for the fragment stage.
pub fn vertex(position: [f32; 4], data: [f32; 4]) -> Vertex {
    let mut v = [0.0; 8];
    v[..4].copy_from_slice(&position);
    v[4..].copy_from_slice(&data);
    v
}

/// Vertex shader: reads [`Vertex`] number `vertex_index` from storage binding 0 and passes on its first `scalars` numbers.
pub struct Pull {
    pub scalars: usize,
}

impl VertexShader for Pull {
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let data: &[Vertex] = bindings.storage(0);
        let number = |c: usize| input.per_vertex(|i| data[i as usize][c]);
        output.position = v4(number(0), number(1), number(2), number(3));
        for scalar in 0..self.scalars {
            output.varyings[scalar] = number(4 + scalar);
        }
    }
}

/// Fragment shader: the provoking vertex's numbers, one colour per primitive.
pub struct FlatColor;

impl FragmentShader for FlatColor {
    const PER_PRIMITIVE: bool = true;
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let f = |scalar| L::splat(input.token, input.flat(scalar));
        output.color[0] = v4(f(0), f(1), f(2), f(3));
    }
}

/// Fragment shader: the interpolated numbers.
pub struct VaryingColor;

impl FragmentShader for VaryingColor {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = v4(input.varying(0), input.varying(1), input.varying(2), input.varying(3));
    }
}

/// Fragment shader: one everywhere.
pub struct Ones;

impl FragmentShader for Ones {
    const PER_PRIMITIVE: bool = true;
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let one = L::splat(input.token, 1.0);
        output.color[0] = v4(one, one, one, one);
    }
}

/// [`Pull`] with four scalars of this interpolation and a fragment shader.
pub fn pull_program(fragment: impl FragmentShader + 'static, interpolation: Interpolation) -> Program {
    Program {
        varyings: vec![Varying { name: "data", components: 4, interpolation }],
        bindings: vec![BindingKind::Storage(32)],
        ..Program::new("pull", Pull { scalars: 4 }, fragment)
    }
}

/// [`Pull`] without varyings.
pub fn plain_program(fragment: impl FragmentShader + 'static) -> Program {
    Program { bindings: vec![BindingKind::Storage(32)], ..Program::new("pull_plain", Pull { scalars: 0 }, fragment) }
}

/// [`Pull`] without a fragment stage.
pub fn depth_only_program() -> Program {
    Program { fragment: None, ..plain_program(Ones) }
}

/// A target without blending.
pub fn target(format: TextureFormat) -> Option<ColorTargetState> {
    Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL })
}

/// A target that adds.
pub fn additive(format: TextureFormat) -> Option<ColorTargetState> {
    Some(ColorTargetState { format, blend: Some(ADDITIVE), write_mask: ColorWrites::ALL })
}

/// A pipeline from a program, edited, under some rules.
pub fn pipeline_with(program: Program, rules: RasterRules, edit: impl FnOnce(&mut RenderPipelineDescriptor)) -> RenderPipeline {
    let mut desc = RenderPipelineDescriptor::new(program.name, Arc::new(program));
    edit(&mut desc);
    RenderPipeline::new(desc, rules).expect("the test's pipeline is valid")
}

/// A pipeline under the reference rules.
pub fn pipeline(program: Program, edit: impl FnOnce(&mut RenderPipelineDescriptor)) -> RenderPipeline {
    pipeline_with(program, RasterRules::REFERENCE, edit)
}

/// Attachments of a pass and what they are cleared to.
#[derive(Clone)]
pub struct Canvas {
    pub size: (u32, u32),
    pub color: Vec<Option<Texture>>,
    pub depth: Option<Texture>,
    pub clear: [f64; 4],
    pub clear_depth: f32,
    pub clear_stencil: u32,
    /// Keep what is there instead of clearing.
    pub load: bool,
    pub queries: usize,
    pub stream_out: Vec<StreamOutTarget>,
}

impl Canvas {
    pub fn new(size: (u32, u32), color: &[Option<TextureFormat>], depth: Option<TextureFormat>) -> Self {
        let texture = |format| Texture::new(TextureDescriptor::d2("target", size.0, size.1, format)).expect("a valid target");
        Self {
            size,
            color: color.iter().map(|format| format.map(texture)).collect(),
            depth: depth.map(texture),
            clear: [0.0; 4],
            clear_depth: 1.0,
            clear_stencil: 0,
            load: false,
            queries: 0,
            stream_out: Vec::new(),
        }
    }

    /// One colour target, nothing else.
    pub fn single(size: (u32, u32), format: TextureFormat) -> Self {
        Self::new(size, &[Some(format)], None)
    }

    /// Runs draws on a device; panics if the pass is refused.
    pub fn run_on(&mut self, device: &Device, draws: Vec<Draw<'_>>, observer: Option<&mut dyn Observer>) -> PassOutput {
        let [r, g, b, a] = self.clear;
        let color_load = if self.load { LoadOp::Load } else { LoadOp::Clear(Color { r, g, b, a }) };
        let depth_load = if self.load { LoadOp::Load } else { LoadOp::Clear(self.clear_depth) };
        let stencil_load = if self.load { LoadOp::Load } else { LoadOp::Clear(self.clear_stencil) };
        let color = self
            .color
            .iter_mut()
            .map(|texture| texture.as_mut().map(|texture| ColorAttachment { view: texture.view_mut(), load: color_load }));
        let mut pass = Pass {
            label: "test".into(),
            color: color.collect(),
            depth_stencil: self.depth.as_mut().map(|texture| DepthStencilAttachment { view: texture.view_mut(), depth_load, stencil_load }),
            draws,
            query_count: self.queries,
            stream_out: std::mem::take(&mut self.stream_out),
        };
        let output = run_pass(device, &mut pass, observer);
        self.stream_out = pass.stream_out;
        output.expect("the test's pass is valid")
    }

    /// Runs draws on the shared device.
    pub fn run(&mut self, draws: Vec<Draw<'_>>) -> PassOutput {
        self.run_on(device(), draws, None)
    }

    /// One channel of a colour target, rows top down.
    pub fn channel(&self, target: usize, channel: usize) -> Vec<f32> {
        self.color[target].as_ref().expect("the target exists").read_channel(0, 0, channel)
    }

    /// All channels of a pixel of a colour target.
    pub fn pixel(&self, target: usize, x: u32, y: u32) -> [f32; 4] {
        let texture = self.color[target].as_ref().expect("the target exists");
        let surface = texture.surface(0, 0);
        std::array::from_fn(|c| if c < surface.channels { surface.get(x, y, c) } else { 0.0 })
    }

    /// Depth of every pixel in 0..=1, rows top down.
    pub fn depths(&self) -> Vec<f32> {
        let texture = self.depth.as_ref().expect("there is depth");
        (0..self.size.1).flat_map(|y| (0..self.size.0).map(move |x| texture.texel(0, 0, x, y)[0])).collect()
    }

    /// Stencil of every pixel, rows top down.
    pub fn stencils(&self) -> Vec<u8> {
        let surface = self.depth.as_ref().expect("there is a stencil").surface(0, 0);
        (0..self.size.1).flat_map(|y| (0..self.size.0).map(move |x| surface.stencil_at(x, y))).collect()
    }

    /// The bytes of every attachment: what must not depend on how a pass was run.
    pub fn bytes(&self) -> Vec<u8> {
        let textures = self.color.iter().flatten().chain(&self.depth);
        let mut bytes: Vec<u8> = textures.flat_map(|texture| texture.read_bytes(0, 0)).collect();
        for target in &self.stream_out {
            bytes.extend(target.data.iter().flat_map(|number| number.to_le_bytes()));
        }
        bytes
    }
}

/// A buffer of vertices and its binding.
pub struct Vertices {
    pub count: u32,
    buffer: Buffer,
}

impl Vertices {
    pub fn new(vertices: &[Vertex]) -> Self {
        Self { count: vertices.len() as u32, buffer: Buffer::from_slice(vertices) }
    }
    /// The entries for [`Bindings::new`].
    pub fn entries(&self) -> [Binding<'_>; 1] {
        [Binding::Storage(&self.buffer)]
    }
}

/// Draws vertices with one pipeline into a canvas, on a device.
pub fn draw_on(device: &Device, canvas: &mut Canvas, pipeline: &RenderPipeline, vertices: &[Vertex]) -> PassOutput {
    let vertices = Vertices::new(vertices);
    let entries = vertices.entries();
    let draw = Draw::new(pipeline, Bindings::new(&entries, 0), 0..vertices.count, canvas.size);
    canvas.run_on(device, vec![draw], None)
}

/// Draws vertices with one pipeline into a canvas.
pub fn draw(canvas: &mut Canvas, pipeline: &RenderPipeline, vertices: &[Vertex]) -> PassOutput {
    draw_on(device(), canvas, pipeline, vertices)
}

/// First place where two images differ, with both values, or `None`. Not-a-number differs from everything, itself too.
pub fn first_difference<T: PartialEq + Copy>(width: u32, a: &[T], b: &[T]) -> Option<(usize, usize, T, T)> {
    assert_eq!(a.len(), b.len(), "images of different sizes are not compared");
    let at = a.iter().zip(b).position(|(a, b)| a != b)?;
    Some((at % width as usize, at / width as usize, a[at], b[at]))
}

/// Pixels in which two images differ.
pub fn difference_count<T: PartialEq>(a: &[T], b: &[T]) -> usize {
    assert_eq!(a.len(), b.len(), "images of different sizes are not compared");
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

/// Clip position (w = 1) of a point in pixels of a target, z given.
pub fn clip_from_px(size: (u32, u32), [x, y]: [f64; 2], z: f32) -> [f32; 4] {
    let (half_width, half_height) = (f64::from(size.0) * 0.5, f64::from(size.1) * 0.5);
    [((x - half_width) / half_width) as f32, ((half_height - y) / half_height) as f32, z, 1.0]
}

#[test]
fn difference_helpers_see_one_moved_pixel() {
    let mut a = vec![0.0f32; 64];
    a[10] = 1.0;
    let mut b = a.clone();
    assert_eq!(first_difference(8, &a, &b), None);
    b.swap(10, 11);
    assert_eq!(first_difference(8, &a, &b), Some((2, 1, 1.0, 0.0)));
    assert_eq!(difference_count(&a, &b), 2);
    b[10] = f32::NAN;
    assert!(first_difference(8, &b, &b).is_some(), "not-a-number must never compare as equal");
}
