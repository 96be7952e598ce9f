//! What the cross-check allows for: outliers must have a cause that is tested, and what they add up to is bounded; and frames of many draws.

use std::sync::Arc;

use glam::Vec2;
use nephroid::caustics::beams::Beam;
use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::frame::{DepthStencilAttachment, Draw, Frame};
use nephroid::gpu::Family;
use nephroid::gpu::conformance::program::Vertex;
use nephroid::gpu::crosscheck::{AttachmentReport, Bound, DRIFT, Mode, PassBounds, crosscheck};
use nephroid::pipeline::state::{CompareFunction, DepthBiasState, DepthStencilState, StencilState, TextureFormat, Viewport};
use nephroid::pipeline::{Buffer, LoadOp, Surface, TextureDescriptor};

use super::crosscheck::{SIZE, compare, compare_as, device, frame, gpus};
use crate::support::scene_of_size;

/// A triangle of half a pixel, whose left edge is some units of the vertex grid to the right of a pixel's centre, and the driver's side is moved left.
#[test]
fn what_is_within_a_unit_of_its_place_is_explained_and_no_more() {
    for gpu in gpus() {
        let unit = 1.0 / f32::from(1_u16 << gpu.adapter().family().candidates()[0].1.subpixel_bits);
        for (units, moved) in [(1.0, 1), (3.0, 0)] {
            let mut good = frame();
            good.passes.truncate(1);
            good.passes[0].draws.truncate(1);
            let (left, top) = (20.5 + units * unit, 20.25);
            let corners = [[left, top], [left, top + 0.5], [left + 0.5, top]];
            let vertex = |[x, y]: [f32; 2]| {
                let size = SIZE as f32;
                Vertex { position: [x / size * 2.0 - 1.0, 1.0 - y / size * 2.0, 0.5, 1.0], color: [1.0; 4] }
            };
            good.passes[0].draws[0].vertices = 0..3;
            good.buffers[1].data = Arc::new(Buffer::from_slice(&corners.map(vertex)));
            let mut bad = good.clone();
            bad.passes[0].draws[0].viewport = Some(Viewport { x: -units * unit, ..Viewport::full(SIZE, SIZE) });
            let (report, _) = compare(&gpu, &good, &bad, Mode::Resynchronised);
            let d = &report.attachments[0].difference;
            assert_eq!((d.outliers, d.at_edges, d.moved, d.unexplained()), (1, 0, moved, 1 - moved), "{}, {units}", gpu.adapter().title());
            // An explained pixel counts all the same.
            assert!(!report.agrees() && d.light > 0.0, "{d:?}");
        }
    }
}

/// Any number of pixels of any error, and no more than a ten-thousandth of the light.
const MANY: Bound = Bound::new("many", 1.0e-4, [1.0e6, 1.0e6], 2.0, 1.0e-4);
/// Any number of pixels of any error, and all of the light.
const ANY: Bound = Bound::new("any", 1.0e-4, [1.0e6, 1.0e6], 2.0, 1.0e6);

/// A draw that adds a tenth too much, where the number of pixels is not bounded.
#[test]
fn a_fault_is_found_by_its_size_alone() {
    for gpu in gpus() {
        let good = frame();
        let mut bad = good.clone();
        let mut vertices: Vec<Vertex> = bytemuck::cast_slice(good.buffers[1].data.bytes()).to_vec();
        vertices.iter_mut().for_each(|vertex| vertex.color = vertex.color.map(|c| c * 1.1));
        bad.buffers[1].data = Arc::new(Buffer::from_slice(&vertices));
        let rules = gpu.adapter().family().candidates()[0].1;
        let [on_cpu, on_gpu] = [&good, &bad].map(|frame| Frame { rules, ..frame.clone() });
        let reported = |bounds: &'static [PassBounds]| {
            let report = crosscheck(&gpu, &device(), &on_cpu, &on_gpu, Mode::FreeRunning, bounds, |_, _| {}).expect("the frame runs");
            report.attachments[0].clone()
        };
        let by_light = reported(&[PassBounds { pass: "", vertices: ANY, textures: &[("", MANY, MANY)] }]);
        assert!(!by_light.within && !by_light.bound.holds(&by_light.difference.measured()), "{by_light:?}");
        // Where nothing else is bounded, it is the drift of the frame.
        let by_drift = reported(&[PassBounds { pass: "", vertices: ANY, textures: &[("", ANY, ANY)] }]);
        assert!(by_drift.bound.holds(&by_drift.difference.measured()) && by_drift.drift > DRIFT && !by_drift.within, "{by_drift:?}");
    }
}

/// A sliver whose area vanishes in f32, though not on the grid that its vertices snap to: llvmpipe's depth is not a number.
#[test]
fn slivers_without_an_area_have_the_same_depth() {
    for gpu in gpus() {
        let mut frame = frame();
        frame.passes.truncate(1);
        frame.passes[0].draws.truncate(1);
        let size = 512;
        let color = frame.texture(TextureDescriptor::d2("large color", size, size, TextureFormat::Rgba32Float));
        let depth = frame.texture(TextureDescriptor::d2("large depth", size, size, TextureFormat::Depth32Float));
        frame.passes[0].color[0].as_mut().expect("a target").view = color.into();
        frame.passes[0].depth_stencil =
            Some(DepthStencilAttachment { view: depth.into(), depth_load: LoadOp::Clear(0.5), stencil_load: LoadOp::Load });
        frame.pipelines[0].depth_stencil = Some(DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Always),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        });
        let corners = [
            [-0.122_876_76, 0.773_774, 0.241_052_61],
            [-0.219_000_35, 0.644_166_3, 0.249_263_14],
            [-0.184_081_99, 0.691_248_3, 0.249_263_14],
        ];
        let vertices = corners.map(|[x, y, z]: [f32; 3]| Vertex { position: [x, y, z, 1.0], color: [1.0; 4] });
        frame.buffers[1].data = Arc::new(Buffer::from_slice(&vertices));
        frame.passes[0].draws[0].vertices = 0..3;
        for mode in [Mode::FreeRunning, Mode::Resynchronised] {
            let mut seen = Vec::new();
            let rules = gpu.adapter().family().candidates()[0].1;
            let frame = Frame { rules, ..frame.clone() };
            let watch = |attachment: &AttachmentReport, [_, actual]: [&Surface; 2]| {
                if attachment.texture == "large depth" {
                    seen = (0..size * size).map(|i| actual.get(i % size, i / size, 0)).filter(|&z| z != 0.5).collect();
                }
            };
            let report = crosscheck(&gpu, &device(), &frame, &frame, mode, &[], watch).expect("the frame runs");
            assert!(report.attachments.iter().all(|a| a.difference.differing == 0), "{}: {report:?}", gpu.adapter().title());
            if gpu.adapter().family() == Family::Lavapipe {
                assert_eq!(seen, [1.0], "{}", gpu.adapter().title());
            }
        }
    }
}

/// A frame with more draws than go to a driver at once, which alternate between two pipelines and depend on those before them; each draw has uniforms of
/// its own. The last of them are those of a beam in the middle of the picture.
fn frame_of_many_draws() -> Frame {
    let mut scene = scene_of_size("analytic/sine_water.ron", (SIZE, SIZE));
    scene.set("light_volumes.grid", "129x129").expect("a grid");
    scene.set("light_volumes.shadow_map_size", "64").expect("a small map");
    let options = RenderOptions { technique: "light-volumes".into(), ..RenderOptions::default() };
    let mut frame = Renderer::new(&scene, &options).expect("a renderer").build(&scene).expect("a frame").frame;
    let pass = frame.passes.iter_mut().find(|pass| pass.label == "light_volumes 0").expect("a pass");
    let draws = &mut pass.draws;
    // Two draws for each beam. Of every sixteenth beam, the one that holds a pixel's middle most deeply comes last: the ramp's height there is −5.0498625 m less z.
    const EVERY: usize = 16;
    let slots = frame.buffers.iter().find(|b| b.label == "beam slots 0").expect("the beams").data.bytes();
    let depth = |draw: &Draw| {
        let at = draw.dynamic_offset as usize;
        let beam: Beam = bytemuck::pod_read_unaligned(&slots[at..at + size_of::<Beam>()]);
        let middle = |pixel: u32| (pixel as f32 + 0.5) * (2.0 / SIZE as f32) - 1.0;
        let inside = |pixel: u32| {
            let (x, z) = (middle(pixel % SIZE), middle(pixel / SIZE));
            let section = beam.section(-5.049_862_5 - z).map(|at| Vec2::new(at.x, at.y));
            let turn = (section[1] - section[0]).perp_dot(section[2] - section[0]).signum();
            let distance = |k: usize| {
                let (from, to) = (section[k], section[(k + 1) % 3]);
                (to - from).normalize_or_zero().perp_dot(Vec2::new(x, z) - from) * turn
            };
            distance(0).min(distance(1)).min(distance(2))
        };
        (0..SIZE * SIZE).map(inside).fold(f32::NEG_INFINITY, f32::max)
    };
    let depths: Vec<f32> = draws.iter().step_by(2 * EVERY).map(depth).collect();
    let deepest = (0..depths.len()).max_by(|&a, &b| depths[a].total_cmp(&depths[b])).expect("a beam");
    draws.rotate_left(2 * EVERY * deepest + 2);
    frame
}

#[test]
fn frames_of_many_draws_are_compared_to_the_last_draw() {
    for gpu in gpus() {
        let title = gpu.adapter().title();
        let good = frame_of_many_draws();
        let draws = &good.passes.iter().find(|pass| pass.label == "light_volumes 0").expect("a pass").draws;
        assert!(draws.len() > 2 * 4096 && draws[0].pipeline != draws[1].pipeline, "{} draws", draws.len());
        for mode in [Mode::FreeRunning, Mode::Resynchronised] {
            let (report, located) = compare_as("light-volumes", &gpu, &good, &good, mode);
            assert!(report.agrees(), "{title}, {mode:?}: {located:?}");
            let compared: u64 = report.vertices.iter().filter(|v| v.pass == "light_volumes 0").map(|v| v.draws).sum();
            assert_eq!(compared, if mode == Mode::FreeRunning { draws.len() as u64 / 2 } else { 0 });
        }
        // Half as much light again in the beam of the last draws: its vertices are where they were, and carry more light.
        let last = draws[draws.len() - 1].dynamic_offset as usize;
        let mut bad = good.clone();
        let slots = bad.buffers.iter_mut().find(|b| b.label == "beam slots 0").expect("the beams");
        let mut bytes = slots.data.bytes().to_vec();
        let beam: &mut Beam = bytemuck::from_bytes_mut(&mut bytes[last..last + size_of::<Beam>()]);
        beam.flux *= 1.5;
        slots.data = Arc::new(Buffer::from_slice(&bytes));
        let (_, located) = compare_as("light-volumes", &gpu, &good, &bad, Mode::FreeRunning);
        let located = located.expect("a place");
        assert_eq!(located.pass, "light_volumes 0", "{title}: {located:?}");
        assert_eq!(located.draw.expect("a draw").0, draws.len() - 1, "{title}");
        // Its first ray leans: that moves vertices, too.
        let slots = bad.buffers.iter_mut().find(|b| b.label == "beam slots 0").expect("the beams");
        let beam: &mut Beam = bytemuck::from_bytes_mut(&mut bytes[last..last + size_of::<Beam>()]);
        beam.d[0].x += 0.5;
        slots.data = Arc::new(Buffer::from_slice(&bytes));
        let (report, _) = compare_as("light-volumes", &gpu, &good, &bad, Mode::FreeRunning);
        let wrong = report.vertices.iter().find(|v| !v.within).expect("wrong vertices");
        assert_eq!((wrong.pass.as_str(), wrong.worst_draw), ("light_volumes 0", Some(draws.len() - 2)), "{title}: {wrong:?}");
    }
}
