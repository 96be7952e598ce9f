//! The cross-check itself: frames that agree, and faults that are planted on one side and must be found in the right pass.
//!
//! Runs on every Vulkan adapter there is. Without one it says that it did not run, unless NEPHROID_REQUIRE_ADAPTER is set: then it fails.

use std::sync::Arc;

use nephroid::caustics::builder::{Contributions, FrameBuilder, ViewOptions};
use nephroid::caustics::light_volumes::LightVolumes;
use nephroid::caustics::{Receivers, RenderOptions, Renderer, TECHNIQUES};
use nephroid::frame::{BindEntry, ColorAttachment, DepthStencilAttachment, Draw, Executor as _, Frame, FrameError, Pass};
use nephroid::frame::{Contents, stream_draw};
use nephroid::geom::shapes::{Cylinder, UvSphere};
use nephroid::gpu::conformance::program::{Vertex, program};
use nephroid::gpu::crosscheck::{Located, Mode, Report, crosscheck, locate, side_by_side};
use nephroid::gpu::{Gpu, GpuError, GpuExecutor, GpuFrame, adapters, find_adapter};
use nephroid::math::rng::uniform3;
use nephroid::passes::camera::CameraUniform;
use nephroid::pipeline::shader::Interpolation;
use nephroid::pipeline::state::{
    ADDITIVE, BlendComponent, BlendFactor, BlendOperation, BlendState, Color, ColorTargetState, ColorWrites, CompareFunction,
    DepthBiasState, DepthStencilState, IndexFormat, PrimitiveState, PrimitiveTopology, StencilFaceState, StencilOperation, StencilState,
    TextureFormat, Viewport,
};
use nephroid::pipeline::{Buffer, Device, DeviceOptions, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid::scene::{EyeRefraction, Shape};

use crate::support::{self, scene_of_size, techniques};

/// Side of the targets, pixels.
pub const SIZE: u32 = 64;

/// Every adapter here, opened.
pub fn gpus() -> Vec<Gpu> {
    let gpus: Vec<Gpu> = adapters().into_iter().map(|adapter| Gpu::open(adapter).expect("the adapter opens")).collect();
    if gpus.is_empty() {
        assert!(std::env::var_os("NEPHROID_REQUIRE_ADAPTER").is_none(), "an adapter is required, and there is none");
        eprintln!("not run: there is no Vulkan adapter");
    }
    gpus
}

pub fn device() -> Device {
    Device::new(DeviceOptions::default()).expect("threads start")
}

/// Triangles between points of the half-pixel grid: their edges run through pixel centres.
fn grid_triangles(stream: u32, count: u32) -> Vec<Vertex> {
    (0..count * 3)
        .map(|i| {
            let [x, y, z] = uniform3(7, stream, i);
            let on_grid = |v: f32| (v * 2.0 * SIZE as f32).floor() / SIZE as f32 - 1.0;
            // Weights of a quarter add up exactly.
            let alpha = ((z * 4.0).floor() + 1.0) / 4.0;
            Vertex { position: [on_grid(x), on_grid(y), 0.5, 1.0], color: [1.0, 0.5, 0.25, alpha] }
        })
        .collect()
}

const OVER: BlendState = {
    let over =
        BlendComponent { src_factor: BlendFactor::SrcAlpha, dst_factor: BlendFactor::OneMinusSrcAlpha, operation: BlendOperation::Add };
    BlendState { color: over, alpha: over }
};

/// Four passes with two draws each: `coverage` adds, `stencil` counts front minus back, `blend` mixes, `viewport` draws to a part of its target.
pub fn frame() -> Frame {
    let mut frame = Frame::default();
    let settings = frame.buffer("settings", Arc::new(Buffer::from_slice(&[1.0_f32, 0.0, 0.0, 0.0])));
    for (number, label) in ["coverage", "stencil", "blend", "viewport"].into_iter().enumerate() {
        let blend = if label == "blend" { OVER } else { ADDITIVE };
        let state = ColorTargetState { format: TextureFormat::Rgba32Float, blend: Some(blend), write_mask: ColorWrites::ALL };
        let color = frame.texture(TextureDescriptor::d2(format!("{label} color"), SIZE, SIZE, TextureFormat::Rgba32Float));
        let face = |pass_op| StencilFaceState { pass_op, ..StencilFaceState::IGNORE };
        let depth_stencil = (label == "stencil").then(|| DepthStencilState {
            format: TextureFormat::Depth32FloatStencil8,
            depth_write_enabled: Some(false),
            depth_compare: Some(CompareFunction::Always),
            stencil: StencilState {
                front: face(StencilOperation::IncrementWrap),
                back: face(StencilOperation::DecrementWrap),
                read_mask: 0xff,
                write_mask: 0xff,
            },
            bias: DepthBiasState::default(),
        });
        let depth = depth_stencil.as_ref().map(|state| DepthStencilAttachment {
            view: frame.texture(TextureDescriptor::d2("counts", SIZE, SIZE, state.format)).into(),
            depth_load: LoadOp::Clear(1.0),
            stencil_load: LoadOp::Clear(0),
        });
        let pipeline = frame.pipeline(RenderPipelineDescriptor {
            targets: vec![Some(state)],
            depth_stencil,
            ..RenderPipelineDescriptor::new(label, program(Interpolation::Flat))
        });
        let mut draws = Vec::new();
        for draw in 0..2 {
            let vertices = grid_triangles(number as u32 * 2 + draw, 40);
            let buffer = frame.buffer(format!("{label} {draw}"), Arc::new(Buffer::from_slice(&vertices)));
            let group = frame.bind_group(vec![BindEntry::Storage(buffer), BindEntry::Uniform(settings, 0)]);
            let viewport = Viewport { x: 8.0, y: 8.0, width: 32.0, height: 32.0, min_depth: 0.0, max_depth: 1.0 };
            draws
                .push(Draw { viewport: (label == "viewport").then_some(viewport), ..Draw::new(pipeline, group, 0..vertices.len() as u32) });
        }
        let load = LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 });
        frame.passes.push(Pass {
            label: label.into(),
            color: vec![Some(ColorAttachment { view: color.into(), load })],
            depth_stencil: depth,
            draws,
            ..Pass::default()
        });
    }
    frame
}

/// [`compare_as`] with the bounds of shared passes alone.
pub fn compare(gpu: &Gpu, on_cpu: &Frame, on_gpu: &Frame, mode: Mode) -> (Report, Option<Located>) {
    compare_as("", gpu, on_cpu, on_gpu, mode)
}

/// Compares, and if something differs finds out where it starts.
pub fn compare_as(technique: &str, gpu: &Gpu, on_cpu: &Frame, on_gpu: &Frame, mode: Mode) -> (Report, Option<Located>) {
    let device = device();
    let rules = gpu.adapter().family().candidates()[0].1;
    let [on_cpu, on_gpu] = [on_cpu, on_gpu].map(|frame| Frame { rules, ..frame.clone() });
    let report = crosscheck(gpu, &device, &on_cpu, &on_gpu, mode, &techniques().bounds(technique), |_, _| {}).expect("the frame runs");
    let failure = report.first_failure();
    let located = failure.and_then(|f| locate(gpu, &device, &on_cpu, &on_gpu, mode, f).expect("the frame runs again"));
    (report, located)
}

#[test]
fn the_same_frame_agrees_to_the_last_bit() {
    for gpu in gpus() {
        for mode in [Mode::FreeRunning, Mode::Resynchronised] {
            let frame = frame();
            let (report, located) = compare(&gpu, &frame, &frame, mode);
            assert!(report.agrees() && located.is_none(), "{}: {report:?}", gpu.adapter().title());
            assert!(report.attachments.iter().all(|a| a.difference.differing == 0), "{}: {report:?}", gpu.adapter().title());
        }
    }
}

/// Plants a fault on the driver's side of the second draw of a pass and returns where it was found.
fn planted(gpu: &Gpu, mode: Mode, plant: impl Fn(&mut Frame)) -> Located {
    let good = frame();
    let mut bad = good.clone();
    plant(&mut bad);
    let (report, located) = compare(gpu, &good, &bad, mode);
    assert!(!report.agrees(), "{}: the fault went unseen", gpu.adapter().title());
    located.expect("a place")
}

/// Gives the second draw of a pass a pipeline of its own, changed.
fn change_pipeline(frame: &mut Frame, pass: usize, change: impl Fn(&mut RenderPipelineDescriptor)) {
    let mut desc = frame.pipelines[frame.passes[pass].draws[1].pipeline.index()].clone();
    change(&mut desc);
    frame.passes[pass].draws[1].pipeline = frame.pipeline(desc);
}

#[test]
fn planted_faults_are_traced_to_their_pass_and_draw() {
    for gpu in gpus() {
        for mode in [Mode::FreeRunning, Mode::Resynchronised] {
            // Moved right and down by less than any pixel centre is from an edge it is not on: centres on left and top edges fall out, those on
            // right and bottom edges come in. For triangles on the grid that is the bottom-right fill rule.
            let fill_rule = planted(&gpu, mode, |f| {
                let shift = Viewport { x: 1.0 / 16.0, y: 1.0 / 16.0, ..Viewport::full(SIZE, SIZE) };
                f.passes[0].draws[1].viewport = Some(shift);
            });
            let stencil_face = planted(&gpu, mode, |f| {
                change_pipeline(f, 1, |desc| {
                    if let Some(state) = &mut desc.depth_stencil {
                        std::mem::swap(&mut state.stencil.front, &mut state.stencil.back);
                    }
                });
            });
            let blend_factor = planted(&gpu, mode, |f| {
                change_pipeline(f, 2, |desc| {
                    if let Some(blend) = desc.targets[0].as_mut().and_then(|t| t.blend.as_mut()) {
                        blend.color.dst_factor = BlendFactor::One;
                    }
                });
            });
            let viewport = planted(&gpu, mode, |f| {
                if let Some(viewport) = &mut f.passes[3].draws[1].viewport {
                    viewport.x += 1.0;
                }
            });
            for (located, pass) in [(fill_rule, "coverage"), (stencil_face, "stencil"), (blend_factor, "blend"), (viewport, "viewport")] {
                assert_eq!(located.pass, pass, "{located:?}");
                assert_eq!(located.draw.as_ref().map(|d| d.0), Some(1), "{located:?}");
                assert!(located.primitive.is_some_and(|p| p < 40), "{located:?}");
                assert_eq!(located.vertices.len(), 3, "{located:?}");
                assert!(located.pixel.expected != located.pixel.actual);
            }
        }
    }
}

/// The smallest scene at a small size, under an adapter's rules.
fn scene_frame(size: u32) -> Frame {
    let mut scene = scene_of_size("analytic/sine_water.ron", (size, size));
    scene.set(&format!("{}.shadow_map_size", TECHNIQUES[0].settings().key()), "128").expect("a small map");
    let mut renderer = Renderer::new(&scene, &RenderOptions::default()).expect("a renderer");
    renderer.build(&scene).expect("a frame").frame
}

#[test]
fn every_technique_agrees_in_every_variant() {
    for gpu in gpus() {
        for (technique, variant) in support::variants() {
            let mut scene = scene_of_size("analytic/sine_water.ron", (64, 64));
            variant.apply(&mut scene);
            scene.techniques.coarsen();
            technique.coarsen(&mut scene);
            // There are techniques that draw each triangle of the water by itself.
            let grid = format!("{}.grid", technique.settings().key());
            if scene.get(&grid).is_ok() {
                scene.set(&grid, "9x9").expect("a small grid");
            }
            let options = RenderOptions { technique: technique.name().to_owned(), techniques: techniques(), ..RenderOptions::default() };
            let frame = Renderer::new(&scene, &options).expect("a renderer").build(&scene).expect("a frame").frame;
            for mode in [Mode::FreeRunning, Mode::Resynchronised] {
                let (report, located) = compare_as(technique.name(), &gpu, &frame, &frame, mode);
                let title = gpu.adapter().title();
                assert!(report.agrees(), "{title}, {}, {mode:?}: {located:?} {report:?}", variant.label(technique));
            }
        }
    }
}

#[test]
fn beams_of_mirrors_and_glass_agree() {
    let shapes = [
        ("ring.ron", Shape::Cylinder(Cylinder { radius_m: 0.5, height_m: 0.21, slices: 24, open: true })),
        ("ball.ron", Shape::UvSphere(UvSphere { radius_m: 0.3, slices: 16, stacks: 8 })),
    ];
    for gpu in gpus() {
        for (name, shape) in &shapes {
            let mut scene = scene_of_size(name, (128, 72));
            scene.objects[1].shape = shape.clone();
            let settings = scene.techniques.edit::<LightVolumes>();
            *settings = LightVolumes { generator_edge: 1.0, shadow_map_size: 256, receiver_culling: true, ..LightVolumes::default() };
            let options = RenderOptions { technique: "light-volumes".into(), ..RenderOptions::default() };
            let frame = Renderer::new(&scene, &options).expect("a renderer").build(&scene).expect("a frame").frame;
            let (report, located) = compare(&gpu, &frame, &frame, Mode::Resynchronised);
            assert!(report.agrees(), "{}, {name}: {located:?}", gpu.adapter().title());
        }
    }
}

/// A dry scene's frame with in-scattered radiance that differs from texel to texel, times a scale.
fn frame_with_radiance(scale: f32) -> Frame {
    let mut scene = scene_of_size("analytic/sine_water.ron", (SIZE, SIZE));
    scene.water = None;
    let receivers = Receivers::new(&scene, None).expect("the scene's meshes");
    let view = ViewOptions {
        eye_refraction: EyeRefraction::VirtualPlane,
        samples: 1,
        surface_shadows: false,
        underwater_shadows: false,
        shadow_map_size: 16,
        stencil: false,
    };
    let mut builder = FrameBuilder::new(&scene, &receivers, None, &view);
    builder.lights(|_, _| Ok(())).expect("no pass is added");
    let irradiance = builder.target("irradiance", TextureFormat::Rgba32Float);
    let radiance: Vec<u8> =
        (0..SIZE * SIZE).flat_map(|i| uniform3(9, 0, i).into_iter().chain([1.0])).flat_map(|v| (v * scale).to_le_bytes()).collect();
    let radiance =
        builder.frame.texture_with(TextureDescriptor::d2("radiance of air", SIZE, SIZE, TextureFormat::Rgba32Float), vec![radiance.into()]);
    builder.finish(Contributions { in_scattered: Some(radiance), ..Contributions::new(irradiance) }).frame
}

#[test]
fn in_scattered_radiance_is_added_alike() {
    for gpu in gpus() {
        let frame = frame_with_radiance(1.0);
        let (report, located) = compare(&gpu, &frame, &frame, Mode::Resynchronised);
        assert!(report.agrees(), "{}: {located:?}", gpu.adapter().title());
        // A hundredth more of it on one side is found.
        let (_, located) = compare(&gpu, &frame, &frame_with_radiance(1.01), Mode::Resynchronised);
        assert_eq!(located.expect("a place").pass, "picture", "{}", gpu.adapter().title());
    }
}

#[test]
fn a_transposed_uniform_is_found_in_the_first_pass_that_reads_it() {
    for gpu in gpus() {
        let good = scene_frame(64);
        let (report, _) = compare(&gpu, &good, &good, Mode::FreeRunning);
        assert!(report.agrees(), "{}: {report:?}", gpu.adapter().title());
        let mut bad = good.clone();
        let camera = bad.buffers.iter_mut().find(|b| b.label == "camera").expect("a camera");
        let mut uniform: CameraUniform = *bytemuck::from_bytes(camera.data.bytes());
        uniform.clip_from_world = uniform.clip_from_world.transpose();
        camera.data = Arc::new(Buffer::from_value(&uniform));
        let (report, located) = compare(&gpu, &good, &bad, Mode::FreeRunning);
        assert_eq!(located.expect("a place").pass, "geometry_buffer");
        // The vertex stage by itself shows it too.
        let wrong = report.vertices.iter().find(|v| !v.within).expect("wrong vertices");
        assert_eq!(wrong.pass, "geometry_buffer", "{wrong:?}");
    }
}

/// Six queries in one pass, with depth that lets some fragments through: exact on both sides, and noticed if they are not.
#[test]
fn occlusion_queries_are_counted_exactly() {
    for gpu in gpus() {
        let mut frame = frame();
        frame.passes.truncate(1);
        let depth = frame.texture(TextureDescriptor::d2("depth", SIZE, SIZE, TextureFormat::Depth32Float));
        frame.passes[0].depth_stencil =
            Some(DepthStencilAttachment { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        let depth_state = DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Less),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        };
        frame.pipelines[0].depth_stencil = Some(depth_state);
        let draw = frame.passes[0].draws[0].clone();
        frame.passes[0].query_count = 6;
        frame.passes[0].draws = (0..6).map(|q| Draw { query: Some(q), vertices: q * 12..(q + 1) * 12, ..draw.clone() }).collect();
        let (report, _) = compare(&gpu, &frame, &frame, Mode::FreeRunning);
        assert!(report.agrees(), "{}: {report:?}", gpu.adapter().title());
        let mut bad = frame.clone();
        bad.passes[0].draws[4].query = Some(1);
        let (report, _) = compare(&gpu, &frame, &bad, Mode::FreeRunning);
        assert_eq!(report.queries.iter().map(|q| q.query).collect::<Vec<_>>(), [1, 4], "{}", gpu.adapter().title());
    }
}

/// Every topology, with indices, a base vertex and restart: the driver's vertex stage, in the order of the primitives.
#[test]
fn stream_out_by_compute_is_that_of_the_software_gpu() {
    for gpu in gpus() {
        let device = device();
        for topology in [
            PrimitiveTopology::PointList,
            PrimitiveTopology::LineList,
            PrimitiveTopology::LineStrip,
            PrimitiveTopology::TriangleList,
            PrimitiveTopology::TriangleStrip,
        ] {
            let mut frame = frame();
            let strip_index_format = topology.is_strip().then_some(IndexFormat::Uint32);
            frame.pipelines[0].primitive = PrimitiveState { topology, strip_index_format, ..PrimitiveState::default() };
            let restart = if topology.is_strip() { u32::MAX } else { 3 };
            let indices = frame.buffer("indices", Arc::new(Buffer::from_slice(&[7, 1, 4, 2, restart, 9, 8, 3, 0, 5, 6, 2_u32])));
            let draw = Draw { vertices: 0..12, base_vertex: 11, ..frame.passes[0].draws[0].clone() }.indexed(indices);
            frame.passes[0].draws = vec![draw];
            let contents = Contents::initial(&frame).expect("possible textures");
            let (_, expected) = stream_draw(&device, &frame, &frame.passes[0], &frame.passes[0].draws[0], &contents).expect("it streams");
            let mut on_gpu = GpuFrame::new(&gpu, &frame).expect("the driver holds the frame");
            let actual = on_gpu.stream_out(0, 0, &device, &contents).expect("it streams");
            assert!(!actual.is_empty() && actual == expected.data, "{}, {topology:?}", gpu.adapter().title());
        }
    }
}

#[test]
fn whole_frames_run_as_on_any_executor() {
    for gpu in gpus() {
        let frame = scene_frame(48);
        let title = gpu.adapter().title();
        let mut executor = GpuExecutor::new(gpu, device(), 1 << 30);
        let output = executor.run(&frame, None).expect("the frame runs");
        let color = frame.texture_named("color").expect("a picture");
        let texels = output.texture(color).read_channel(0, 0, 0);
        assert!(texels.iter().all(|t| t.is_finite()) && texels.iter().any(|&t| t > 0.0), "{title}");
        assert_eq!(output.passes.len(), frame.passes.len());
        let gpu = Gpu::open(adapters().into_iter().find(|a| a.title() == title).expect("it was there")).expect("the adapter opens");
        let refused = GpuExecutor::new(gpu, device(), 1 << 20).run(&frame, None).err();
        assert!(matches!(refused, Some(FrameError::Memory { .. })), "{title}: {refused:?}");
    }
}

#[test]
fn pictures_show_both_versions_and_the_error() {
    use nephroid::pipeline::{Texture, format_info};
    let format = TextureFormat::R32Float;
    let a = Texture::new(TextureDescriptor::d2("a", 16, 8, format)).expect("a texture");
    let mut b = a.clone();
    b.set_texel(0, 0, 3, 2, [1.0, 0.0, 0.0, 0.0]);
    let info = format_info(format).expect("a format");
    let surfaces = [a.surface(0, 0), b.surface(0, 0)];
    let difference = nephroid::gpu::crosscheck::compare(info, surfaces[0], surfaces[1], 0.0).difference;
    let layer = side_by_side(info, surfaces, &difference, 0.0).expect("a picture");
    assert_eq!((layer.width(), layer.height()), (3 * 16 + 8, 8));
    let red = |x: u32, y: u32| *layer.planes()[0].get(x, y).expect("inside");
    assert_eq!((red(3, 2), red(20 + 3, 2), red(40 + 3, 2)), (0.0, 1.0, 1.0));
    assert_eq!(red(40 + 9, 2), 0.0);
}

#[test]
fn unknown_adapters_and_missing_twins_are_told() {
    for gpu in gpus() {
        let error = find_adapter(Some("no such adapter")).expect_err("no such adapter").to_string();
        assert!(error.contains("no such adapter") && error.contains(gpu.adapter().name()), "{error}");
        let mut frame = frame();
        let mut without = (*program(Interpolation::Flat)).clone();
        without.wgsl = None;
        frame.pipelines[0].program = Arc::new(without);
        let report = crosscheck(&gpu, &device(), &frame, &frame, Mode::FreeRunning, &[], |_, _| {});
        assert!(matches!(report, Err(GpuError::Twin { .. })), "{report:?}");
    }
}

#[test]
fn a_missing_feature_is_named_with_the_adapters_that_have_it() {
    for gpu in gpus() {
        let mut frame = frame();
        change_pipeline(&mut frame, 2, |desc| {
            if let Some(blend) = desc.targets[0].as_mut().and_then(|t| t.blend.as_mut()) {
                blend.color.dst_factor = BlendFactor::OneMinusSrc1;
            }
        });
        let feature = "DUAL_SOURCE_BLENDING";
        if !gpu.adapter().line().missing.contains(&feature) {
            eprintln!("not run: {} lacks nothing that could be asked for", gpu.adapter().title());
            continue;
        }
        let error = crosscheck(&gpu, &device(), &frame, &frame, Mode::FreeRunning, &[], |_, _| {}).expect_err("it is missing").to_string();
        let others: Vec<_> = adapters().into_iter().filter(|a| !a.line().missing.contains(&feature)).collect();
        assert!(error.contains(feature) && error.contains(gpu.adapter().name()), "{error}");
        assert!(others.iter().all(|a| error.contains(a.name())), "{error}");
    }
}

/// A draw that WebGPU has no primitive for: lines of eight pixels and sprites, expanded.
#[test]
fn wide_lines_and_sprites_cover_what_they_should() {
    for gpu in gpus() {
        for (topology, line_width, size) in [(PrimitiveTopology::LineList, 8.0, 1.0), (PrimitiveTopology::PointList, 1.0, 9.0)] {
            let mut frame = frame();
            frame.passes.truncate(1);
            frame.passes[0].draws.truncate(1);
            frame.passes[0].draws[0].vertices = 0..40;
            frame.pipelines[0].primitive = PrimitiveState { topology, ..PrimitiveState::default() };
            frame.pipelines[0].line_width = line_width;
            frame.buffers[0].data = Arc::new(Buffer::from_slice(&[size, 0.0, 0.0, 0.0_f32]));
            let (report, located) = compare(&gpu, &frame, &frame, Mode::FreeRunning);
            // Corners are rounded on the way through clip space: a pixel here and there along the edges.
            let d = &report.attachments[0].difference;
            assert!(d.differing * 50 < d.pixels, "{}, {topology:?}: {report:?} {located:?}", gpu.adapter().title());
        }
    }
}
