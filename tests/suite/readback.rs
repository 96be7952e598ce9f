//! Counts that are asked for while a frame is built, and frames behind frames.

use std::sync::Arc;

use glam::{Mat4, Vec4};
use nephroid::caustics::readback::{self, OcclusionQueries, QUERIES_PER_PASS};
use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::frame::{BindEntry, CpuExecutor, DepthStencilAttachment, Draw, Executor, Frame, FrameError, Pass};
use nephroid::passes::geometry_buffer::ReceiverVertex;
use nephroid::passes::shadow_map::{LightUniform, straight_program};
use nephroid::pipeline::state::{CompareFunction, DepthBiasState, DepthStencilState, StencilState, TextureFormat};
use nephroid::pipeline::{Buffer, Device, DeviceOptions, LoadOp, RenderPipelineDescriptor, TextureDescriptor};

use crate::support::scene_of_size;

/// Side of the depth buffer, pixels.
const SIZE: u32 = 64;

fn device() -> Device {
    Device::new(DeviceOptions::default()).expect("threads start")
}

/// A rectangle of pixels at a depth, as two triangles in clip space.
fn rectangle([x0, y0, x1, y1]: [u32; 4], z: f32) -> [ReceiverVertex; 6] {
    let at = |x: u32, y: u32| {
        let ndc = |v: u32| v as f32 / SIZE as f32 * 2.0 - 1.0;
        ReceiverVertex { position_ws: Vec4::new(ndc(x), -ndc(y), z, 1.0), normal_ws: Vec4::Y }
    };
    let [a, b, c, d] = [at(x0, y0), at(x0, y1), at(x1, y1), at(x1, y0)];
    [a, b, c, a, c, d]
}

/// An occluder over the left half at depth 1/2, and shapes that are tested against it.
fn queries(shapes: &[[ReceiverVertex; 6]]) -> OcclusionQueries {
    let mut frame = Frame::default();
    let depth = frame.texture(TextureDescriptor::d2("depth", SIZE, SIZE, TextureFormat::Depth32Float));
    let light = LightUniform { clip_from_world: Mat4::IDENTITY, ..bytemuck::Zeroable::zeroed() };
    let light = frame.buffer("light", Arc::new(Buffer::from_value(&light)));
    let mut bind = |label: &str, vertices: &[ReceiverVertex]| {
        let vertices = frame.buffer(label, Arc::new(Buffer::from_slice(vertices)));
        frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(vertices)])
    };
    let (occluder, bindings) = (bind("occluder", &rectangle([0, 0, SIZE / 2, SIZE], 0.5)), bind("shapes", &shapes.concat()));
    let mut pipeline = |label: &str, compare, write| {
        frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: Some(DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(write),
                depth_compare: Some(compare),
                stencil: StencilState::default(),
                bias: DepthBiasState::default(),
            }),
            ..RenderPipelineDescriptor::new(label, straight_program())
        })
    };
    let (fill, test) = (pipeline("fill", CompareFunction::Less, true), pipeline("test", CompareFunction::Less, false));
    frame.passes.push(Pass {
        label: "occluder".into(),
        depth_stencil: Some(DepthStencilAttachment { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load }),
        draws: vec![Draw::new(fill, occluder, 0..6)],
        ..Pass::default()
    });
    OcclusionQueries { occluders: frame, depth, pipeline: test, bindings, shape_vertices: 6 }
}

#[test]
fn counts_are_the_pixels_before_the_occluder_whichever_shapes_are_asked_for() {
    // In front of everything; behind the occluder in its left half; wholly behind it.
    let shapes = [rectangle([24, 8, 40, 24], 0.25), rectangle([24, 8, 40, 24], 0.75), rectangle([8, 8, 24, 24], 0.75)];
    let mut frame = Frame::default();
    let counts = readback::ask(&device(), &mut frame, queries(&shapes), |counter| {
        Ok([counter.count("all", &[0, 1, 2])?, counter.count("some", &[2, 0])?, counter.count("none", &[])?])
    });
    assert_eq!(counts.expect("the queries run"), [vec![256, 128, 0], vec![0, 256], vec![]]);
    let labels: Vec<&str> = frame.passes.iter().map(|pass| pass.label.as_str()).collect();
    assert_eq!(labels, ["occluder", "all part 0", "some part 0"]);
    let cached = |k: usize| frame.passes[k].cached.as_ref().map(|output| output.queries.clone());
    assert_eq!([cached(0), cached(1), cached(2)], [None, Some(vec![256, 128, 0]), Some(vec![0, 256])]);
}

#[test]
fn many_queries_are_split_into_passes_and_run_again_with_the_same_counts() {
    // Shape k covers k + 1 pixels of the open right half.
    let shapes: Vec<_> = (0..70).map(|k| rectangle([32 + k % 16, 0, 33 + k % 16, k + 1 - k / 60 * 10], 0.75)).collect();
    let heights: Vec<u64> = (0..70_u64).map(|k| k + 1 - k / 60 * 10).collect();
    let numbers: Vec<u32> = (0..70).collect();
    // A frame that has resources of its own already.
    let scene = scene_of_size("analytic/flat_water.ron", (16, 16));
    let mut frame = Renderer::new(&scene, &RenderOptions::default()).and_then(|mut r| r.build(&scene)).expect("a frame").frame;
    let before = frame.passes.len();
    let counts = readback::ask(&device(), &mut frame, queries(&shapes), |counter| counter.count("columns", &numbers));
    assert_eq!(counts.expect("the queries run"), heights);
    assert_eq!(frame.passes.len(), before + 1 + 70_usize.div_ceil(QUERIES_PER_PASS));
    // Without the cached answers, the passes count the same.
    frame.passes.iter_mut().for_each(|pass| pass.cached = None);
    let mut executor = CpuExecutor::new(device(), 1 << 30);
    let output = executor.run(&frame, None).expect("the frame runs");
    let counted: Vec<u64> = output.passes[before + 1..].iter().flat_map(|pass| pass.queries.clone()).collect();
    assert_eq!(counted, heights);
}

#[test]
fn errors_end_the_queries_and_leave_the_frame_as_it_was() {
    let mut frame = Frame::default();
    let failed = readback::ask(&device(), &mut frame, queries(&[]), |_| Err::<(), _>(FrameError::Backend("asked too much".into())));
    assert!(matches!(failed, Err(FrameError::Backend(_))) && frame.passes.is_empty() && frame.textures.is_empty());
    let mut broken = queries(&[rectangle([0, 0, 1, 1], 0.0)]);
    broken.occluders.passes[0].draws[0].bind_group = nephroid::frame::BindGroupId::at(9);
    let failed = readback::ask(&device(), &mut frame, broken, |_| Ok(()));
    assert!(matches!(failed, Err(FrameError::Reference { .. })) && frame.passes.is_empty());
}

#[test]
fn an_appended_frame_draws_as_it_does_alone() {
    let scene = scene_of_size("pots.ron", (32, 24));
    let build = |technique: &str| {
        let options = RenderOptions { technique: technique.into(), ..RenderOptions::default() };
        Renderer::new(&scene, &options).and_then(|mut renderer| renderer.build(&scene)).expect("a frame").frame
    };
    let [first, second] = [build("caustic-volumes"), build("light-volumes")];
    let bytes = |frame: &Frame| {
        let output = CpuExecutor::new(device(), 1 << 30).run(frame, None).expect("the frame runs").contents.textures.clone();
        output.iter().map(|texture| texture.read_bytes(0, 0)).collect::<Vec<_>>()
    };
    let mut both = first.clone();
    both.append(second.clone());
    let (alone, together) = ([bytes(&first), bytes(&second)].concat(), bytes(&both));
    assert!(together == alone, "an attachment differs");
    // The other way around, attachments come in another order.
    let mut swapped = second;
    swapped.append(first);
    assert!(bytes(&swapped) != alone, "the comparison cannot fail");
}
