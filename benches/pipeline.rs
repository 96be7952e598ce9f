//! What the pipeline and the technique cost: medians of many frames in one run, with threads and SIMD level.
//!
//! `cargo bench` prints Markdown tables, `cargo bench -- splats` only the rows that name contains. Pixels are counted as rasterized, before the depth test.

mod shared;
#[path = "pipeline/splats.rs"]
mod splats;

use std::time::Instant;

use glam::{UVec2, Vec2, Vec3};
use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::geom::shapes::Terrain;
use nephroid::math::level::level_name;
use nephroid::pipeline::state::{
    ADDITIVE, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, PrimitiveState, PrimitiveTopology,
    RasterRules, StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid::pipeline::{
    Binding, Bindings, Buffer, ColorAttachment, DepthStencilAttachment, Device, DeviceOptions, Draw, LoadOp, Pass, RenderPipeline,
    RenderPipelineDescriptor, Texture, TextureDescriptor, run_pass,
};
use nephroid::scene::{Aim, Light, Scene, Shape};

use shared::{FRAMES, PAPER_FRAMES, PaperFrame, PassClock, SIZE, median, paper_scene, wanted};

/// [`triangles`] as a buffer, or points.
fn vertices(count: u32, pixels: f32, corners: u32) -> Buffer {
    Buffer::from_slice(&shared::triangles(SIZE, count, pixels, corners))
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
    let program = shared::program(mode != Mode::Stencil);
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
            blend: Some(ADDITIVE),
            write_mask: if mode == Mode::Stencil { ColorWrites::empty() } else { ColorWrites::ALL },
        })],
        ..RenderPipelineDescriptor::new("bench", program)
    };
    let desc = if mode == Mode::Stencil { RenderPipelineDescriptor { targets: Vec::new(), ..desc } } else { desc };
    RenderPipeline::new(desc, RasterRules::REFERENCE).expect("the pipeline is valid")
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
    fn time(&mut self, mode: Mode, topology: PrimitiveTopology, buffer: &Buffer, draws: u32, vertices: u32) -> f64 {
        let pipeline = pipeline(mode, topology);
        let entries = [Binding::Storage(buffer)];
        let mut times = Vec::new();
        for _ in 0..FRAMES {
            let clear = Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 };
            let start = Instant::now();
            let mut pass = Pass {
                label: "bench".into(),
                depth_stencil: Some(DepthStencilAttachment {
                    view: self.depth.view_mut(),
                    depth_load: LoadOp::Clear(1.0),
                    stencil_load: LoadOp::Clear(0),
                }),
                draws: (0..draws)
                    .map(|d| Draw::new(&pipeline, Bindings::new(&entries, 0), d * vertices..(d + 1) * vertices, SIZE))
                    .collect(),
                ..Pass::default()
            };
            if mode != Mode::Stencil {
                pass.color = vec![Some(ColorAttachment { view: self.color.view_mut(), load: LoadOp::Clear(clear) })];
            }
            run_pass(&self.device, &mut pass, None).expect("the pass is valid");
            times.push(start.elapsed().as_secs_f64());
        }
        median(times)
    }
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
    splats::splats();
    paper_frames();
    receivers();
}
