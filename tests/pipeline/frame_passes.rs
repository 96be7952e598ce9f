//! Frames: passes that draw to mip levels, layers and faces of cubes and read the others meanwhile, and passes that draw what earlier ones
//! have streamed out.

use nephroid_pipeline::frame::{
    AttachmentView, BindEntry, CpuExecutor, Executor as _, Frame, FrameError, ReferenceProblem, Streamed, TextureId, TextureView,
};
use nephroid_pipeline::state::TextureFormat;
use nephroid_pipeline::{Device, DeviceOptions, Texture, TextureDescriptor, TextureError, TextureShape, TextureViewDescriptor};

use crate::frames::{self, CHAIN_SIDE, FACE_SIDE, STREAM_SIDE, STREAMED, Streams};

fn executor() -> CpuExecutor {
    CpuExecutor::new(Device::new(DeviceOptions { threads: Some(2), ..DeviceOptions::default() }).expect("threads start"), 1 << 30)
}

fn drawn(frame: &Frame, texture: TextureId) -> Texture {
    executor().run(frame, None).expect("the frame is valid").texture(texture).clone()
}

fn reference(pass: &str, problem: ReferenceProblem) -> FrameError {
    FrameError::Reference { pass: pass.to_owned(), problem }
}

fn refused(frame: &Frame) -> FrameError {
    executor().run(frame, None).expect_err("the frame is refused")
}

#[test]
fn levels_are_drawn_from_the_levels_above() {
    let (frame, texture) = frames::mip_chain();
    let chain = drawn(&frame, texture);
    for level in 0..chain.desc().mip_level_count {
        for (x, y) in (0..CHAIN_SIDE >> level).flat_map(|y| (0..CHAIN_SIDE >> level).map(move |x| (x, y))) {
            assert_eq!(chain.texel(level, 0, x, y), frames::chain_texel(level, x, y), "level {level}, ({x}, {y})");
        }
    }
}

#[test]
fn faces_of_a_cube_are_drawn_to_and_seen() {
    let (frame, picture) = frames::cube();
    let picture = drawn(&frame, picture);
    for (x, y) in (0..FACE_SIDE).flat_map(|y| (0..6 * FACE_SIDE).map(move |x| (x, y))) {
        let expected = [(x % FACE_SIDE) as f32, y as f32, (x / FACE_SIDE) as f32, 1.0];
        assert_eq!(picture.texel(0, 0, x, y), expected, "({x}, {y})");
    }
}

#[test]
fn one_layer_is_drawn_from_another() {
    let (frame, array) = frames::layers();
    let array = drawn(&frame, array);
    for (layer, number) in [2.0, 1.0, 2.0].into_iter().enumerate() {
        for (x, y) in (0..8).flat_map(|y| (0..8).map(move |x| (x, y))) {
            assert_eq!(array.texel(0, layer as u32, x, y), [x as f32, y as f32, number, 1.0], "layer {layer}, ({x}, {y})");
        }
    }
}

/// The number of lit pixels of a target, each of which must have the doubled colour.
fn lit(texture: &Texture) -> u32 {
    let texels = (0..STREAM_SIDE).flat_map(|y| (0..STREAM_SIDE).map(move |x| texture.texel(0, 0, x, y)));
    texels.filter(|texel| *texel != [-1.0; 4]).inspect(|texel| assert_eq!(*texel, [0.5, 1.0, 2.0, 4.0])).count() as u32
}

#[test]
fn what_was_streamed_out_draws_as_if_drawn_directly() {
    // A square of a quarter of the side, twice; the geometry shader doubles it.
    let square = (STREAM_SIDE / 4) * (STREAM_SIDE / 4);
    for (geometry, vertices, squares) in [(false, 12, 2), (true, 24, 4)] {
        let Streams { frame, buffer, drawn, direct } = frames::streams(24, geometry);
        let mut executor = executor();
        let output = executor.run(&frame, None).expect("the frame is valid");
        let written = output.contents.streamed[buffer.index()];
        assert_eq!(written, Streamed { bytes: vertices * STREAMED * 4, vertices: vertices as u32 });
        assert_eq!([0, 1].map(|pass: usize| output.passes[pass].stream_out[0].primitives_written), [vertices as u64 / 6; 2]);
        assert_eq!(lit(output.texture(drawn)), squares * square);
        assert_eq!(output.texture(drawn).surface(0, 0).planes, output.texture(direct).surface(0, 0).planes, "geometry: {geometry}");
    }
}

#[test]
fn a_full_buffer_takes_whole_primitives_and_counts_the_others() {
    // Room for a triangle and a half after the first two.
    let Streams { frame, buffer, drawn, .. } = frames::streams(10, false);
    let mut executor = executor();
    let output = executor.run(&frame, None).expect("the frame is valid");
    assert_eq!(output.contents.streamed[buffer.index()].vertices, 9);
    let second = output.passes[1].stream_out[0];
    assert_eq!((second.primitives_written, second.primitive_storage_needed), (1, 2));
    let side = STREAM_SIDE / 4;
    // Of the second square the triangle above the diagonal, which owns no pixel of the diagonal itself or all of it.
    let triangle = lit(output.texture(drawn)) - side * side;
    assert!([side * (side - 1) / 2, side * (side + 1) / 2].contains(&triangle), "{triangle}");
}

#[test]
fn a_frame_may_be_run_again() {
    let Streams { frame, drawn, .. } = frames::streams(24, true);
    let mut executor = executor();
    let first = executor.run(&frame, None).expect("the frame is valid").texture(drawn).clone();
    assert_eq!(executor.run(&frame, None).expect("the frame is valid").texture(drawn), &first, "streams start anew");
}

#[test]
fn frames_that_read_what_they_write_are_refused() {
    let (mut frame, texture) = frames::mip_chain();
    // Level 1 is drawn from all levels.
    frame.bind_groups[1].entries = vec![BindEntry::texture(texture)];
    assert_eq!(refused(&frame), reference("level 1", ReferenceProblem::ReadAndDrawnTo { texture: "chain".into() }));

    let (mut frame, array) = frames::layers();
    let twice = frame.passes[0].color[0];
    frame.passes[0].color.push(twice);
    let twice = ReferenceProblem::AttachedTwice { texture: "array".into(), level: 0, layer: 0 };
    assert_eq!(refused(&frame), reference("layer 0", twice));
    frame.passes[0].color.truncate(1);
    if let Some(target) = &mut frame.passes[0].color[0] {
        target.view = AttachmentView { texture: array, level: 1, layer: 0 };
    }
    let missing = ReferenceProblem::NoSurface { attachment: 0, texture: "array".into(), level: 1, layer: 0 };
    assert_eq!(refused(&frame), reference("layer 0", missing));

    let mut streams = frames::streams(24, false);
    streams.frame.passes[2].stream_out = streams.frame.passes[0].stream_out.clone();
    assert_eq!(refused(&streams.frame), reference("draw", ReferenceProblem::DrawReadsStreamOut { draw: 0, buffer: "stream".into() }));
}

#[test]
fn stream_out_that_does_not_fit_is_refused() {
    let mut streams = frames::streams(24, false);
    streams.frame.passes[0].draws[0].stream_out = Some(1);
    assert_eq!(refused(&streams.frame), reference("stream", ReferenceProblem::NoStreamOutTarget { draw: 0, target: 1, count: 1 }));
    let mut streams = frames::streams(24, false);
    let target = streams.frame.passes[0].stream_out[0];
    streams.frame.passes[0].stream_out.push(target);
    let error = refused(&streams.frame);
    assert_eq!(error, reference("stream", ReferenceProblem::StreamedOutTwice { buffer: "stream".into() }));
    assert_eq!(error.to_string(), "pass `stream`: buffer `stream` is streamed out to twice");
}

#[test]
fn views_are_held_to_their_texture() {
    let texture = Texture::new(TextureDescriptor {
        depth_or_layers: 6,
        mip_level_count: 3,
        ..TextureDescriptor::d2("t", 4, 4, TextureFormat::R32Float)
    });
    let mut texture = texture.expect("possible");
    let cube = TextureViewDescriptor { shape: Some(TextureShape::Cube), ..TextureViewDescriptor::default() };
    let lower = TextureViewDescriptor { base_mip_level: 1, base_array_layer: 4, ..TextureViewDescriptor::default() };
    assert_eq!(texture.view_of(&cube).map(|view| view.shape()), Ok(TextureShape::Cube));
    let view = texture.view_of(&lower).expect("it exists");
    assert_eq!((view.mip_level_count(), view.level_size(0), view.level_size(1)), (2, (2, 2, 2), (1, 1, 2)));
    let wrong = [
        TextureViewDescriptor { base_mip_level: 3, ..TextureViewDescriptor::default() },
        TextureViewDescriptor { mip_level_count: Some(4), ..TextureViewDescriptor::default() },
        TextureViewDescriptor { mip_level_count: Some(0), ..TextureViewDescriptor::default() },
        TextureViewDescriptor { base_array_layer: 2, array_layer_count: Some(5), ..TextureViewDescriptor::default() },
        TextureViewDescriptor { array_layer_count: Some(5), shape: Some(TextureShape::Cube), ..TextureViewDescriptor::default() },
        TextureViewDescriptor { shape: Some(TextureShape::D3), ..TextureViewDescriptor::default() },
    ];
    for view in wrong {
        assert!(matches!(texture.view_of(&view), Err(TextureError::View { .. })), "{view:?}");
    }
    assert!(matches!(texture.split(&[(0, 6)]), Err(TextureError::NoSurface { level: 0, layer: 6, .. })));
    assert!(matches!(texture.split(&[(0, 5), (0, 5)]), Err(TextureError::AttachedTwice { level: 0, layer: 5, .. })));
    let (attached, rest) = texture.split(&[(1, 5), (0, 2)]).expect("they exist");
    assert_eq!([attached[0].size(), attached[1].size()], [(2, 2), (4, 4)]);
    assert!(matches!(rest.view(&TextureViewDescriptor::default()), Err(TextureError::DrawnTo { level: 0, layer: 2, .. })));
    assert!(rest.view(&TextureViewDescriptor::level(2)).is_ok());
}

/// A view that a frame cannot give is an error of the frame, not of the pass that would use it.
#[test]
fn a_frames_views_are_checked_before_anything_is_drawn() {
    let (mut frame, texture) = frames::mip_chain();
    let range = TextureViewDescriptor { base_mip_level: 7, ..TextureViewDescriptor::default() };
    frame.bind_groups[1].entries = vec![BindEntry::texture(TextureView { texture, range })];
    assert!(matches!(refused(&frame), FrameError::Texture(TextureError::View { levels: 7, .. })));
}
