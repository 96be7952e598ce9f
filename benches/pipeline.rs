//! What the pipeline and the technique cost: medians of many frames in one run, with threads and SIMD level.
//!
//! `cargo bench` prints a Markdown table. Pixels are counted as rasterized, before the depth test.

use std::sync::Arc;
use std::time::Instant;

use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::math::lanes::Lanes;
use nephroid::math::level::level_name;
use nephroid::math::rng::uniform3;
use nephroid::math::vector::v4;
use nephroid::pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program, VertexInput, VertexOutput, VertexShader};
use nephroid::pipeline::state::{
    BlendComponent, BlendFactor, BlendOperation, BlendState, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState,
    DepthStencilState, PrimitiveState, PrimitiveTopology, RasterRules, StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid::pipeline::{
    Binding, BindingKind, Bindings, Buffer, ColorAttachment, DepthStencilAttachment, Device, DeviceOptions, Draw, LoadOp, Pass,
    RenderPipeline, RenderPipelineDescriptor, Texture, TextureDescriptor, run_pass,
};

const SIZE: (u32, u32) = (1024, 768);
const FRAMES: usize = 12;

struct Clip;
impl VertexShader for Clip {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let vertices: &[[f32; 4]] = bindings.storage(0);
        let axis = |a: usize| input.per_vertex(|i| vertices[i as usize][a]);
        output.position = v4(axis(0), axis(1), axis(2), axis(3));
        output.point_size = output.position.x.like(3.0);
    }
}

struct Constant;
impl FragmentShader for Constant {
    const PER_PRIMITIVE: bool = true;
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let c = L::splat(input.token, 1.0 / 256.0);
        output.color[0] = v4(c, c, c, c);
    }
}

/// Triangles of about `pixels` pixels at random places and depths, or points.
fn vertices(count: u32, pixels: f32, corners: u32) -> Buffer {
    let side = (pixels * 4.0 / 3.0_f32.sqrt()).sqrt();
    let mut data = Vec::with_capacity((count * corners) as usize);
    for i in 0..count {
        let [x, y, z] = uniform3(1, 0, i);
        let (cx, cy) = (x * SIZE.0 as f32, y * SIZE.1 as f32);
        for [dx, dy] in [[-0.5, 0.29], [0.5, 0.29], [0.0, -0.58]].iter().take(corners as usize) {
            let (px, py) = (cx + dx * side, cy + dy * side);
            data.push([px / SIZE.0 as f32 * 2.0 - 1.0, 1.0 - py / SIZE.1 as f32 * 2.0, z, 1.0_f32]);
        }
    }
    Buffer::from_slice(&data)
}

struct Bench {
    device: Device,
    color: Texture,
    depth: Texture,
}

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Add,
    AddDepth,
    Stencil,
}

fn pipeline(mode: Mode, topology: PrimitiveTopology) -> RenderPipeline {
    let program = Program { bindings: vec![BindingKind::Storage(16)], ..Program::new("bench", Clip, Constant) };
    let program = if mode == Mode::Stencil { Program { fragment: None, ..program } } else { program };
    let add = BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Add };
    let face = StencilFaceState { pass_op: StencilOperation::IncrementWrap, ..StencilFaceState::IGNORE };
    let stencil = if mode == Mode::Stencil {
        StencilState { front: face, back: face, read_mask: 0xff, write_mask: 0xff }
    } else {
        StencilState::default()
    };
    let desc = RenderPipelineDescriptor {
        primitive: PrimitiveState { topology, ..PrimitiveState::default() },
        depth_stencil: Some(DepthStencilState {
            format: TextureFormat::Depth32FloatStencil8,
            depth_write_enabled: Some(mode == Mode::AddDepth),
            depth_compare: Some(if mode == Mode::AddDepth { CompareFunction::LessEqual } else { CompareFunction::Always }),
            stencil,
            bias: DepthBiasState::default(),
        }),
        targets: vec![Some(ColorTargetState {
            format: TextureFormat::R32Float,
            blend: Some(BlendState { color: add, alpha: add }),
            write_mask: if mode == Mode::Stencil { ColorWrites::empty() } else { ColorWrites::ALL },
        })],
        ..RenderPipelineDescriptor::new("bench", Arc::new(program))
    };
    let desc = if mode == Mode::Stencil { RenderPipelineDescriptor { targets: Vec::new(), ..desc } } else { desc };
    RenderPipeline::new(desc, RasterRules::REFERENCE).expect("the pipeline is valid")
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

impl Bench {
    fn new() -> Self {
        let texture = |format| Texture::new(TextureDescriptor::d2("bench", SIZE.0, SIZE.1, format)).expect("a texture");
        Self {
            device: Device::new(DeviceOptions::default()).expect("threads"),
            color: texture(TextureFormat::R32Float),
            depth: texture(TextureFormat::Depth32FloatStencil8),
        }
    }

    /// Median seconds of a pass.
    fn time(&mut self, mode: Mode, topology: PrimitiveTopology, buffer: &Buffer, draws: u32, elements: u32) -> f64 {
        let pipeline = pipeline(mode, topology);
        let entries = [Binding::Storage(buffer)];
        let mut times = Vec::new();
        for _ in 0..FRAMES {
            let clear = Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 };
            let start = Instant::now();
            let mut pass = Pass {
                label: "bench".into(),
                depth_stencil: Some(DepthStencilAttachment {
                    surface: self.depth.surface_mut(0, 0),
                    format: TextureFormat::Depth32FloatStencil8,
                    depth_load: LoadOp::Clear(1.0),
                    stencil_load: LoadOp::Clear(0),
                }),
                draws: (0..draws)
                    .map(|d| Draw::new(&pipeline, Bindings::new(&entries, 0), d * elements..(d + 1) * elements, SIZE))
                    .collect(),
                ..Pass::default()
            };
            if mode != Mode::Stencil {
                pass.color = vec![Some(ColorAttachment {
                    surface: self.color.surface_mut(0, 0),
                    format: TextureFormat::R32Float,
                    load: LoadOp::Clear(clear),
                })];
            }
            run_pass(&self.device, &mut pass, None).expect("the pass is valid");
            times.push(start.elapsed().as_secs_f64());
        }
        median(times)
    }
}

fn row(name: &str, figure: String, seconds: f64) {
    println!("| {name} | {figure} | {:.2} ms |", seconds * 1.0e3);
}

fn microbenchmarks() {
    let mut bench = Bench::new();
    let level = level_name(bench.device.execution().level);
    println!("{} threads, {level}, {}x{}, medians of {FRAMES} frames\n", bench.device.threads(), SIZE.0, SIZE.1);
    println!("| what | rate | frame |\n|---|---|---|");
    let large = vertices(20_000, 2000.0, 3);
    for (name, mode) in [
        ("additive f32 fill", Mode::Add),
        ("additive f32 fill, depth test and write", Mode::AddDepth),
        ("stencil increments", Mode::Stencil),
    ] {
        let seconds = bench.time(mode, PrimitiveTopology::TriangleList, &large, 1, 60_000);
        row(name, format!("{:.2} Gpix/s", 20_000.0 * 2000.0 / seconds / 1.0e9), seconds);
    }
    let small = vertices(300_000, 8.0, 3);
    let seconds = bench.time(Mode::AddDepth, PrimitiveTopology::TriangleList, &small, 1, 900_000);
    row("8-pixel triangles, depth test and write, additive f32", format!("{:.1} Mtri/s", 0.3 / seconds), seconds);
    let points = vertices(1_000_000, 9.0, 1);
    let seconds = bench.time(Mode::Add, PrimitiveTopology::PointList, &points, 1, 1_000_000);
    row("3x3 splats, one channel", format!("{:.1} M/s", 1.0 / seconds), seconds);
    let beams = vertices(80_000 * 2 * 8, 60.0, 3);
    let seconds = bench.time(Mode::Stencil, PrimitiveTopology::TriangleList, &beams, 160_000, 24);
    row("80,000 beams x 2 stencil draws of 8 triangles", format!("{:.2} M draws/s", 0.16 / seconds), seconds);
}

/// One frame of the paper: everything rebuilt, light and fluid moving.
fn paper_frames() {
    println!("\n| frame (moving light and fluid, everything rebuilt) | median |\n|---|---|");
    for (grid, size) in [(65, 512), (129, 1024)] {
        let mut scene = nephroid::scene::load(std::path::Path::new("scenes/pots.ron")).expect("a shipped scene");
        scene.image.width = size;
        scene.image.height = size;
        scene.techniques.caustic_volumes =
            nephroid::scene::CausticVolumes { grid: Some((grid, grid)), ..nephroid::scene::CausticVolumes::PAPER };
        let mut renderer = Renderer::new(&scene, &RenderOptions::default()).expect("a renderer");
        let mut times = Vec::new();
        for frame in 0..FRAMES + 4 {
            scene.time_s = 1.0 + frame as f32 / 30.0;
            let start = Instant::now();
            renderer.run(&scene).expect("a frame");
            times.push(start.elapsed().as_secs_f64());
        }
        println!("| {0}x{0} grid, {size}x{size} pixels | {1:.1} ms |", grid - 1, median(times.split_off(4)) * 1.0e3);
    }
}

fn main() {
    microbenchmarks();
    paper_frames();
}
