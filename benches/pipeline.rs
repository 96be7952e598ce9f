//! What the pipeline and the technique cost: medians of many frames in one run, with threads and SIMD level.
//!
//! `cargo bench` prints Markdown tables, `cargo bench -- splats` only the rows that name contains. Pixels are counted as rasterized, before the depth test.

use std::sync::Arc;
use std::time::Instant;

use glam::{UVec2, Vec2, Vec3};
use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::frame::{FrameObserver, FramePass};
use nephroid::geom::shapes::Terrain;
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
    Binding, BindingKind, Bindings, Buffer, ColorAttachment, DepthStencilAttachment, Device, DeviceOptions, Draw, LoadOp, Observer, Pass,
    PassOutput, RenderPipeline, RenderPipelineDescriptor, Texture, TextureDescriptor, run_pass,
};
use nephroid::scene::{Aim, CausticVolumes, Faces, Light, Scene, Shape};

const SIZE: (u32, u32) = (1024, 768);
const FRAMES: usize = 12;

struct Clip;
impl VertexShader for Clip {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let vertices: &[[f32; 4]] = bindings.storage(0);
        output.position = input.per_vertex4(|i| vertices[i as usize]);
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

/// Whether the command line asks for a benchmark: it names a part of it, or nothing.
fn wanted(name: &str) -> bool {
    let mut filters = std::env::args().skip(1).filter(|a| !a.starts_with('-')).peekable();
    filters.peek().is_none() || filters.any(|f| name.contains(&f))
}

fn microbenchmarks() {
    let mut bench = Bench::new();
    let level = level_name(bench.device.execution().level);
    println!("{} threads, {level}, {}x{}, medians of {FRAMES} frames\n", bench.device.threads(), SIZE.0, SIZE.1);
    println!("| what | rate | frame |\n|---|---|---|");
    let mut row = |name: &str, work: f64, unit: &str, input: &dyn Fn() -> Buffer, mode, topology, draws, elements| {
        if wanted(name) {
            let seconds = bench.time(mode, topology, &input(), draws, elements);
            println!("| {name} | {:.2} {unit} | {:.2} ms |", work / seconds, seconds * 1.0e3);
        }
    };
    let (triangles, points) = (PrimitiveTopology::TriangleList, PrimitiveTopology::PointList);
    for (name, mode) in [
        ("additive f32 fill", Mode::Add),
        ("additive f32 fill, depth test and write", Mode::AddDepth),
        ("stencil increments", Mode::Stencil),
    ] {
        row(name, 0.04, "Gpix/s", &|| vertices(20_000, 2000.0, 3), mode, triangles, 1, 60_000);
    }
    let name = "8-pixel triangles, depth test and write, additive f32";
    row(name, 0.3, "Mtri/s", &|| vertices(300_000, 8.0, 3), Mode::AddDepth, triangles, 1, 900_000);
    row("3x3 splats, one channel", 1.0, "M/s", &|| vertices(1_000_000, 9.0, 1), Mode::Add, points, 1, 1_000_000);
    let name = "80,000 beams x 2 stencil draws of 8 triangles";
    row(name, 0.16, "M draws/s", &|| vertices(80_000 * 2 * 8, 60.0, 3), Mode::Stencil, triangles, 160_000, 24);
}

/// Seconds per pass of a frame, in order.
#[derive(Default)]
struct PassClock {
    begun: Option<Instant>,
    seconds: Vec<(String, f64)>,
}

impl FrameObserver for PassClock {
    fn pass_begin(&mut self, _index: usize, _pass: &FramePass) -> Option<&mut dyn Observer> {
        self.begun = Some(Instant::now());
        None
    }
    fn pass_end(&mut self, _index: usize, pass: &FramePass, _textures: &[Texture], _output: &PassOutput) {
        let seconds = self.begun.map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        self.seconds.push((pass.label.clone(), seconds));
    }
}

/// A frame of the paper and what its authors measured on their fastest machine.
struct PaperFrame {
    name: &'static str,
    scene: &'static str,
    /// Objects of the scene that are kept.
    objects: usize,
    grid: u32,
    size: u32,
    paper: &'static str,
}

const PAPER_FRAMES: [PaperFrame; 5] = [
    PaperFrame { name: "figure 4: empty pool", scene: "scenes/pots.ron", objects: 1, grid: 64, size: 512, paper: "31 ms" },
    PaperFrame { name: "the same pool", scene: "scenes/pots.ron", objects: 1, grid: 128, size: 1024, paper: "not given" },
    PaperFrame { name: "figure 7: pots", scene: "scenes/pots.ron", objects: usize::MAX, grid: 128, size: 512, paper: "not given" },
    PaperFrame { name: "figure 3: columns", scene: "scenes/columns.ron", objects: usize::MAX, grid: 128, size: 512, paper: "116 ms" },
    PaperFrame { name: "figure 3: columns", scene: "scenes/columns.ron", objects: usize::MAX, grid: 128, size: 1024, paper: "333 ms" },
];

/// Median seconds of a technique's frames and of each of their passes, light and fluid moving.
fn time_frames(mut scene: Scene) -> (f64, Vec<(String, f64)>) {
    let mut renderer = Renderer::new(&scene, &RenderOptions::default()).expect("a renderer");
    let mut frames = Vec::new();
    let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
    for frame in 0..FRAMES + 4 {
        scene.time_s = 1.0 + frame as f32 / 30.0;
        scene.lights[0] = sun_at(scene.lights[0], frame);
        let mut clock = PassClock::default();
        let start = Instant::now();
        renderer.run(&scene, Some(&mut clock)).expect("a frame");
        if frame < 4 {
            continue;
        }
        frames.push(start.elapsed().as_secs_f64());
        passes.resize_with(clock.seconds.len(), Default::default);
        for (pass, (label, seconds)) in passes.iter_mut().zip(clock.seconds) {
            pass.0 = label;
            pass.1.push(seconds);
        }
    }
    (median(frames), passes.into_iter().map(|(label, seconds)| (label, median(seconds))).collect())
}

/// A shipped scene with the paper's settings. Which faces are drawn changes the cost and not the picture; the paper draws those in front.
fn paper_scene(path: &str, grid: u32, size: u32) -> Scene {
    let mut scene = nephroid::scene::load(std::path::Path::new(path)).expect("a shipped scene");
    scene.image.width = size;
    scene.image.height = size;
    scene.techniques.caustic_volumes = CausticVolumes { grid: Some((grid + 1, grid + 1)), faces: Faces::Back, ..CausticVolumes::PAPER };
    scene
}

/// Whole frames with everything rebuilt [SF05 §4]; then where their time goes.
fn paper_frames() {
    for PaperFrame { name, scene, objects, grid, size, paper } in PAPER_FRAMES {
        let name = format!("{name}, {grid}x{grid} grid, {size}x{size} pixels");
        if !wanted(&format!("frame {name}")) {
            continue;
        }
        let mut scene = paper_scene(scene, grid, size);
        scene.objects.truncate(objects);
        let (total, passes) = time_frames(scene);
        println!("\n| {name} | median |\n|---|---|");
        println!("| whole frame (the paper's GPU: {paper}) | {:.2} ms |", total * 1.0e3);
        for (label, seconds) in &passes {
            println!("| pass `{label}` | {:.2} ms |", seconds * 1.0e3);
        }
        let in_passes: f64 = passes.iter().map(|p| p.1).sum();
        println!("| fluid, refraction, building the frame | {:.2} ms |", (total - in_passes) * 1.0e3);
    }
}

/// The paper's claim: the cost does not depend on the receivers, but for drawing them once.
fn receivers() {
    if !wanted("receivers") {
        return;
    }
    println!("\n| receiver triangles | whole frame | drawing them once | the rest |\n|---|---|---|---|");
    for cells in [71, 224, 707] {
        let mut scene = paper_scene("scenes/pots.ron", 64, 512);
        scene.objects.truncate(1);
        scene.objects[0].shape =
            Shape::Terrain(Terrain { size_m: Vec2::splat(4.2), cells: UVec2::splat(cells), dune_height_m: 0.2, ..Terrain::default() });
        scene.objects[0].transform.translate = Vec3::new(0.0, -1.3, 0.0);
        let (total, passes) = time_frames(scene);
        let once: f64 = passes.iter().filter(|p| p.0 == "geometry_buffer").map(|p| p.1).sum();
        let ms = [total, once, total - once].map(|s| s * 1.0e3);
        println!("| {} | {:.2} ms | {:.2} ms | {:.2} ms |", 2 * cells * cells, ms[0], ms[1], ms[2]);
    }
}

/// The light of a frame: the sun moves by a degree.
fn sun_at(mut light: Light, frame: usize) -> Light {
    if let Light::Directional { aim: Aim::Sun { azimuth_deg, .. }, .. } = &mut light {
        *azimuth_deg = 60.0 + frame as f32;
    }
    light
}

fn main() {
    microbenchmarks();
    paper_frames();
    receivers();
}
