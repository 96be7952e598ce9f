//! Frames that draw to mip levels, layers and faces of cubes, and that stream out what later passes draw: the same bits on every driver, in
//! both modes of the cross-check. Their arithmetic is exact, so no bound is needed.

use nephroid::frame::{Executor as _, Frame};
use nephroid::gpu::GpuExecutor;
use nephroid::gpu::crosscheck::{Mode, crosscheck};
use nephroid::pipeline::Surface;

use crate::crosscheck::{device, gpus};
use crate::frame_library as frames;

/// The numbers of a surface; what its tiles hold beyond its edges does not count.
fn bits(surface: &Surface) -> Vec<u32> {
    let texels = (0..surface.height).flat_map(|y| (0..surface.width).map(move |x| (x, y)));
    texels.flat_map(|(x, y)| (0..surface.channels).map(move |channel| surface.get(x, y, channel).to_bits())).collect()
}

/// Every frame of the library, by name.
fn all() -> Vec<(&'static str, Frame)> {
    vec![
        ("mip chain", frames::mip_chain().0),
        ("cube", frames::cube().0),
        ("layers", frames::layers().0),
        ("streams", frames::streams(24, false).frame),
        ("streams of a geometry shader", frames::streams(24, true).frame),
        ("a full stream", frames::streams(10, false).frame),
    ]
}

#[test]
fn levels_layers_faces_and_streams_have_the_same_bits() {
    let device = device();
    for gpu in gpus() {
        for (name, frame) in all() {
            for mode in [Mode::FreeRunning, Mode::Resynchronised] {
                let title = format!("{}, {name}, {mode:?}", gpu.adapter().title());
                let report = crosscheck(&gpu, &device, &frame, &frame, mode, &[], |attachment, [expected, actual]| {
                    assert!(bits(expected) == bits(actual), "{title}: {}/{}", attachment.pass, attachment.texture);
                });
                let report = report.unwrap_or_else(|error| panic!("{title}: {error}"));
                assert!(report.agrees(), "{title}: {report:?}");
                assert!(report.vertices.iter().all(|vertices| vertices.differing == 0), "{title}: {:?}", report.vertices);
            }
        }
    }
}

/// A stream of another length, or a face drawn elsewhere, is found.
#[test]
fn a_shorter_stream_and_a_swapped_face_are_found() {
    let device = device();
    for gpu in gpus() {
        let whole = frames::streams(24, false).frame;
        let mut cut = whole.clone();
        cut.passes[1].draws[0].vertices = 0..3;
        let report = crosscheck(&gpu, &device, &whole, &cut, Mode::FreeRunning, &[], |_, _| {}).expect("both run");
        assert!(!report.streams.is_empty() && !report.agrees(), "{report:?}");
        let faces = frames::cube().0;
        let mut swapped = faces.clone();
        let target = &mut swapped.passes[2].color[0];
        target.as_mut().expect("it has a target").view.layer = 3;
        let report = crosscheck(&gpu, &device, &faces, &swapped, Mode::FreeRunning, &[], |_, _| {}).expect("both run");
        assert!(!report.agrees(), "{report:?}");
    }
}

/// The executor leaves the same textures and streams as the software GPU does.
#[test]
fn an_executor_streams_out_as_well() {
    for gpu in gpus() {
        let streams = frames::streams(24, false);
        let mut executor = GpuExecutor::new(gpu, device(), 1 << 30);
        let output = executor.run(&streams.frame, None).expect("the driver runs it");
        assert_eq!(output.contents.streamed[streams.buffer.index()].vertices, 12);
        let [drawn, direct] = [streams.drawn, streams.direct].map(|id| bits(output.texture(id).surface(0, 0)));
        assert_eq!(drawn, direct);
    }
}
