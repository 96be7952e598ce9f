//! The software GPU against every Vulkan adapter: the same frames in one run, warm, medians and ratios, whole and per pass.
//!
//! `cargo bench --features wgpu --bench drivers` prints Markdown tables; a further word names the rows that are wanted. A driver is given a frame whose
//! pipelines, textures and buffers are ready; its time is from submission to the end, in one submission for a whole frame and in one per pass for
//! passes. What WebGPU lacks is not in a driver's time: sprites and the geometry stage's hulls lie in a buffer as triangles. In the software
//! GPU's time it is.

mod shared;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use nephroid::caustics::splatting::{Splats, Splatting};
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::frame::{BindEntry, ColorAttachment, CpuExecutor, DepthStencilAttachment, Draw, Executor as _, Frame, Pass};
use nephroid::gpu::{Gpu, GpuFrame, Vertices, adapters};
use nephroid::pipeline::state::{
    ADDITIVE, Color, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, PrimitiveState, PrimitiveTopology,
    StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid::pipeline::{Buffer, Device, DeviceOptions, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid::scene::Scene;

use shared::{FRAMES, PAPER_FRAMES, PaperFrame, PassClock, SIZE, median, paper_scene, triangles, wanted};

/// Frames run before the ones that count.
const WARM_UP: usize = 3;
/// A frame that takes longer than this is measured fewer times, seconds.
const SLOW_SECONDS: f64 = 1.0;
const FEW_FRAMES: usize = 3;
/// Most memory that a frame may take, bytes.
const MEMORY: u64 = 8 << 30;

/// What the depth-stencil attachment does.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Add,
    AddDepth,
    Stencil,
}

/// Scenes and methods of `splatting` whose frames are measured: the diameters of splats are those of the paper, but for the last.
const SPLATTING_SCENES: [&str; 3] = ["ball", "glass", "knots"];
const SPLATTING_METHODS: [(&str, Splats, f32); 4] =
    [("fixed", Splats::Fixed, 7.0), ("A", Splats::Sizes, 7.0), ("B", Splats::Lens, 7.0), ("C", Splats::Differential, 3.0)];

/// A drawing of `count` primitives; `draws` of them in one pass.
fn microbenchmark(mode: Mode, topology: PrimitiveTopology, count: u32, pixels: f32, draws: u32) -> Frame {
    let corners = if topology == PrimitiveTopology::PointList { 1 } else { 3 };
    let positions = triangles(SIZE, count, pixels, corners);
    let face = StencilFaceState { pass_op: StencilOperation::IncrementWrap, ..StencilFaceState::IGNORE };
    let counts = StencilState { front: face, back: face, read_mask: 0xff, write_mask: 0xff };
    let depth_stencil = (mode != Mode::Add).then(|| DepthStencilState {
        format: TextureFormat::Depth32FloatStencil8,
        depth_write_enabled: Some(mode == Mode::AddDepth),
        depth_compare: Some(if mode == Mode::AddDepth { CompareFunction::LessEqual } else { CompareFunction::Always }),
        stencil: if mode == Mode::Stencil { counts } else { StencilState::default() },
        bias: DepthBiasState::default(),
    });
    let mut frame = Frame::default();
    let buffer = frame.buffer("positions", Arc::new(Buffer::from_slice(&positions)));
    let group = frame.bind_group(vec![BindEntry::Storage(buffer)]);
    let state = ColorTargetState { format: TextureFormat::R32Float, blend: Some(ADDITIVE), write_mask: ColorWrites::ALL };
    let (width, height) = SIZE;
    let mut pass = Pass { label: "bench".into(), ..Pass::default() };
    let colored = mode != Mode::Stencil;
    if colored {
        let view = frame.texture(TextureDescriptor::d2("color", width, height, TextureFormat::R32Float)).into();
        pass.color = vec![Some(ColorAttachment { view, load: LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 }) })];
    }
    pass.depth_stencil = depth_stencil.as_ref().map(|state| DepthStencilAttachment {
        view: frame.texture(TextureDescriptor::d2("depth", width, height, state.format)).into(),
        depth_load: LoadOp::Clear(1.0),
        stencil_load: LoadOp::Clear(0),
    });
    let pipeline = frame.pipeline(RenderPipelineDescriptor {
        primitive: PrimitiveState { topology, ..PrimitiveState::default() },
        depth_stencil,
        targets: if colored { vec![Some(state)] } else { Vec::new() },
        ..RenderPipelineDescriptor::new("bench", shared::program(colored))
    });
    let each = count * corners / draws;
    pass.draws = (0..draws).map(|d| Draw::new(pipeline, group, d * each..(d + 1) * each)).collect();
    frame.passes.push(pass);
    frame
}

/// Median seconds of a whole frame, and of each of its passes.
struct Timed {
    whole: f64,
    passes: Vec<f64>,
}

/// Medians over frames, given each frame's seconds and those of its passes.
fn medians(frames: Vec<(f64, Vec<f64>)>) -> Timed {
    let pass = |k: usize| median(frames.iter().map(|(_, passes)| passes[k]).collect());
    Timed { whole: median(frames.iter().map(|f| f.0).collect()), passes: (0..frames[0].1.len()).map(pass).collect() }
}

fn time_software(frame: &Frame) -> Timed {
    let device = Device::new(DeviceOptions::default()).expect("threads start");
    let mut executor = CpuExecutor::new(device, MEMORY);
    let run = || {
        let mut clock = PassClock::default();
        executor.run(frame, Some(&mut clock)).expect("the frame runs");
        let start = Instant::now();
        executor.run(frame, None).expect("the frame runs");
        (start.elapsed().as_secs_f64(), clock.seconds.into_iter().map(|p| p.1).collect())
    };
    take_frames(run)
}

/// Runs frames and takes medians; of frames that take seconds, [`FEW_FRAMES`] after one warm one.
fn take_frames(mut run: impl FnMut() -> (f64, Vec<f64>)) -> Timed {
    let first = run();
    if first.0 > SLOW_SECONDS {
        return medians((0..FEW_FRAMES).map(|_| run()).collect());
    }
    let frames: Vec<_> = (0..FRAMES + WARM_UP).map(|_| run()).collect();
    medians(frames[WARM_UP..].to_vec())
}

fn time_driver(gpu: &Gpu, frame: &Frame) -> Timed {
    let device = Device::new(DeviceOptions::default()).expect("threads start");
    // The stages that the software GPU runs read what it drew itself.
    let mut executor = CpuExecutor::new(Device::new(DeviceOptions::default()).expect("threads start"), MEMORY);
    let contents = executor.run(frame, None).expect("the frame runs").contents.clone();
    let mut on_gpu = GpuFrame::new(gpu, frame).expect("the driver holds the frame");
    let ready = |(index, pass): (usize, &Pass)| {
        on_gpu.prepare(index, 0..pass.draws.len(), Vertices::Shaded, &device, &contents).expect("the driver can draw it")
    };
    let passes: Vec<_> = frame.passes.iter().enumerate().map(ready).collect();
    let run = || {
        let mut seconds = Vec::new();
        for pass in &passes {
            let start = Instant::now();
            on_gpu.run([pass]).expect("the driver draws");
            seconds.push(start.elapsed().as_secs_f64());
        }
        let start = Instant::now();
        on_gpu.run(&passes).expect("the driver draws");
        (start.elapsed().as_secs_f64(), seconds)
    };
    take_frames(run)
}

/// One line: milliseconds of the software GPU, and of each driver with the ratio to it.
fn row(name: &str, software: f64, drivers: impl Iterator<Item = f64>) {
    print!("| {name} | {:.1} ms |", software * 1.0e3);
    for seconds in drivers {
        print!(" {:.1} ms | {:.1}x |", seconds * 1.0e3, seconds / software);
    }
    println!();
}

fn header(what: &str, gpus: &[Gpu]) {
    print!("\n| {what} | nephroid |");
    gpus.iter().for_each(|gpu| print!(" {} | ratio |", gpu.adapter().name()));
    println!("\n|---|---|{}", "---|---|".repeat(gpus.len()));
}

fn main() {
    let gpus: Vec<Gpu> = adapters().into_iter().map(|a| Gpu::open(a).expect("the adapter opens")).collect();
    if gpus.is_empty() {
        println!("not run: there is no Vulkan adapter");
        return;
    }
    let threads = Device::new(DeviceOptions::default()).expect("threads start").threads();
    println!(
        "{threads} threads, medians of {FRAMES} frames after {WARM_UP} ({FEW_FRAMES} where one takes over {SLOW_SECONDS} s); micro-benchmarks at {}x{}",
        SIZE.0, SIZE.1
    );
    gpus.iter().for_each(|gpu| println!("- {}", gpu.adapter().title()));
    let (list, points) = (PrimitiveTopology::TriangleList, PrimitiveTopology::PointList);
    header("what", &gpus);
    for (name, mode, topology, count, pixels, draws) in [
        ("additive f32 fill, 2,000-pixel triangles", Mode::Add, list, 20_000, 2000.0, 1),
        ("the same with depth test and write", Mode::AddDepth, list, 20_000, 2000.0, 1),
        ("stencil increments", Mode::Stencil, list, 20_000, 2000.0, 1),
        ("8-pixel triangles, depth test and write, additive f32", Mode::AddDepth, list, 300_000, 8.0, 1),
        ("3x3 splats, one channel", Mode::Add, points, 1_000_000, 9.0, 1),
        ("80,000 beams x 2 stencil draws of 8 triangles", Mode::Stencil, list, 80_000 * 2 * 8, 60.0, 160_000),
    ] {
        if wanted(name) {
            let frame = microbenchmark(mode, topology, count, pixels, draws);
            let software = time_software(&frame).whole;
            row(name, software, gpus.iter().map(|gpu| time_driver(gpu, &frame).whole));
        }
    }
    for PaperFrame { name, scene, objects, grid, size, paper } in PAPER_FRAMES {
        let name = format!("{name}, {grid}x{grid} grid, {size}x{size} pixels");
        if !wanted(&format!("frame {name}")) {
            continue;
        }
        let mut scene = paper_scene(scene, grid, size);
        scene.objects.truncate(objects);
        scene.time_s = 1.0;
        whole_frame(&name, &format!("the paper's GPU: {paper}"), &scene, &RenderOptions::default(), &gpus);
    }
    for (scene, (method, splats, splat_size)) in
        SPLATTING_SCENES.into_iter().flat_map(|scene| SPLATTING_METHODS.map(|method| (scene, method)))
    {
        let name = format!("splatting, {scene}, {method}, 512x512 photons, 512x512 pixels");
        if !wanted(&format!("frame {name}")) {
            continue;
        }
        let mut scene = TECHNIQUES.load(Path::new(&format!("scenes/{scene}.ron"))).expect("a shipped scene");
        (scene.image.width, scene.image.height) = (512, 512);
        *scene.techniques.edit::<Splatting>() = Splatting { splats, splat_size, ..Splatting::default() };
        let options = RenderOptions { technique: "splatting".into(), ..RenderOptions::default() };
        whole_frame(&name, "mirrors or glass, everything drawn again", &scene, &options, &gpus);
    }
}

/// A table of a whole frame and each of its passes.
fn whole_frame(name: &str, note: &str, scene: &Scene, options: &RenderOptions, gpus: &[Gpu]) {
    let mut renderer = Renderer::new(scene, options).expect("a renderer");
    let frame = Arc::new(renderer.build(scene).expect("a frame").frame);
    let software = time_software(&frame);
    let drivers: Vec<Timed> = gpus.iter().map(|gpu| time_driver(gpu, &frame)).collect();
    header(name, gpus);
    row(&format!("whole frame ({note})"), software.whole, drivers.iter().map(|d| d.whole));
    for (k, pass) in frame.passes.iter().enumerate() {
        row(&format!("pass `{}`", pass.label), software.passes[k], drivers.iter().map(|d| d.passes[k]));
    }
}
