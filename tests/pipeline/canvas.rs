//! The front door: [`Canvas`] and the helpers that its programs use, and how long the examples may be.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use nephroid_pipeline::prelude::*;
use nephroid_pipeline::{CanvasError, TextureError};

use super::passes::device;

/// A triangle that covers all pixels, at this depth and of this colour, as [`Program::vertex_color`] reads it.
fn cover(depth: f32, color: [f32; 4]) -> Buffer {
    Buffer::from_slice(&[[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| [[x, y, depth, 1.0], color]))
}

/// A pipeline of [`Program::vertex_color`], edited.
fn pipeline(canvas: &Canvas<'_>, edit: impl FnOnce(&mut RenderPipelineDescriptor)) -> RenderPipeline {
    let pipeline = canvas.pipeline(Program::vertex_color(), |desc| {
        desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x4; 2])];
        edit(desc);
    });
    pipeline.expect("the test's pipeline is valid")
}

/// Draws the triangles of these buffers, one after the other, each with an occlusion query.
fn draw(canvas: &mut Canvas<'_>, pipeline: &RenderPipeline, buffers: &[Buffer]) -> PassOutput {
    let bound: Vec<[VertexBuffer<'_>; 1]> = buffers.iter().map(|buffer| [VertexBuffer { buffer, offset: 0 }]).collect();
    let draws = (0..).zip(&bound).map(|(query, vertex_buffers)| Draw {
        vertex_buffers,
        query: Some(query),
        stencil_reference: 7,
        ..Draw::new(pipeline, Bindings::default(), 0..3, canvas.size())
    });
    let draws = draws.collect();
    canvas.draw(draws).expect("the test's pass is valid")
}

#[test]
fn a_new_canvas_is_zero_and_far() {
    let color = [TextureFormat::Rgba32Float, TextureFormat::R8Unorm];
    let canvas = Canvas::new(device(), (70, 3), &color, Some(TextureFormat::Depth32FloatStencil8)).expect("valid");
    assert_eq!(canvas.size(), (70, 3));
    for (x, y) in [(0, 0), (69, 2), (64, 1)] {
        assert_eq!(canvas.pixel(0, x, y), [0.0; 4]);
        assert_eq!(canvas.pixel(1, x, y), [0.0, 0.0, 0.0, 1.0], "missing alpha is 1");
        assert_eq!((canvas.depth(x, y), canvas.stencil(x, y)), (1.0, 0));
    }
    assert_eq!(canvas.bytes(0), vec![0; 70 * 3 * 16]);
    assert_eq!(canvas.bytes(1), vec![0; 70 * 3]);
}

#[test]
fn clears_fill_what_they_name_and_keep_the_rest() {
    let color = [TextureFormat::Rgba8Unorm, TextureFormat::R32Uint];
    let mut canvas = Canvas::new(device(), (65, 2), &color, Some(TextureFormat::Depth24PlusStencil8)).expect("valid");
    canvas.clear_color(0, Color { r: 1.0, g: 0.2, b: 0.0, a: 0.6 }).expect("cleared");
    canvas.clear_depth_stencil(0.25, 0x1ff).expect("cleared");
    assert_eq!(canvas.bytes(0)[64 * 4..65 * 4], [255, 51, 0, 153]);
    assert_eq!(canvas.bytes(1), vec![0; 65 * 2 * 4], "the other target is kept");
    canvas.clear_color(1, Color { r: 3.0e9, g: 0.0, b: 0.0, a: 0.0 }).expect("cleared");
    assert_eq!(canvas.bytes(1)[..4], 3_000_000_000u32.to_le_bytes(), "integers are integers");
    assert_eq!(canvas.pixel(0, 64, 1), [1.0, 0.2, 0.0, 0.6], "and so is the first target");
    // The low eight bits of a stencil value count; a quarter of 2^24 − 1 is no integer.
    assert_eq!(canvas.stencil(64, 1), 0xff);
    assert!((canvas.depth(64, 1) - 0.25).abs() < 1.0e-7);
}

#[test]
fn passes_go_on_from_what_is_there() {
    let mut canvas = Canvas::new(device(), (8, 8), &[TextureFormat::Rgba32Float], None).expect("valid");
    let add = pipeline(&canvas, |desc| desc.targets[0].as_mut().expect("a target").blend = Some(ADDITIVE));
    for pass in 1..=3u8 {
        let output = draw(&mut canvas, &add, &[cover(0.0, [1.0, 2.0, 3.0, 4.0]), cover(0.0, [1.0, 0.0, 0.0, 0.0])]);
        let times = f32::from(pass);
        assert_eq!(canvas.pixel(0, 3, 6), [2.0 * times, 2.0 * times, 3.0 * times, 4.0 * times]);
        assert_eq!(output.queries, [64, 64]);
        assert_eq!(output.statistics.fragments_passed, 128);
    }
}

#[test]
fn a_pipeline_of_the_canvas_replaces_colour_and_tests_depth() {
    let mut canvas = Canvas::new(device(), (8, 8), &[TextureFormat::Rgba32Float], Some(TextureFormat::Depth32Float)).expect("valid");
    let opaque = pipeline(&canvas, |_| {});
    let output = draw(&mut canvas, &opaque, &[cover(0.5, [1.0, 0.0, 0.0, 0.5]), cover(0.5, [0.0; 4]), cover(0.25, [0.0, 1.0, 0.0, 0.25])]);
    assert_eq!(output.queries, [64, 0, 64], "equal depth fails, less passes");
    assert_eq!((canvas.pixel(0, 0, 0), canvas.depth(0, 0)), ([0.0, 1.0, 0.0, 0.25], 0.25));
    // `edit` has the last word.
    let always = pipeline(&canvas, |desc| desc.depth_stencil = Some(depth_test(TextureFormat::Depth32Float, CompareFunction::Always)));
    draw(&mut canvas, &always, &[cover(0.75, [1.0; 4])]);
    assert_eq!((canvas.pixel(0, 7, 7), canvas.depth(7, 7)), ([1.0; 4], 0.75));
}

#[test]
fn a_stencil_without_depth() {
    let mut canvas = Canvas::new(device(), (8, 8), &[], Some(TextureFormat::Stencil8)).expect("valid");
    let replace = StencilFaceState { pass_op: StencilOperation::Replace, ..StencilFaceState::IGNORE };
    let pipeline = pipeline(&canvas, |desc| {
        let state = desc.depth_stencil.as_mut().expect("the canvas has a stencil");
        state.stencil = StencilState { front: replace, back: replace, read_mask: 0xff, write_mask: 0xff };
    });
    draw(&mut canvas, &pipeline, &[cover(0.5, [0.0; 4])]);
    assert_eq!(canvas.stencil(5, 5), 7);
}

#[test]
fn what_does_not_fit_is_refused() {
    let refused = |size, color: &[TextureFormat], depth| Canvas::new(device(), size, color, depth).err();
    assert!(matches!(refused((0, 4), &[TextureFormat::R8Unorm], None), Some(CanvasError::Texture(TextureError::Size { .. }))));
    assert!(matches!(refused((4, 4), &[TextureFormat::Bc1RgbaUnorm], None), Some(CanvasError::Texture(TextureError::Format { .. }))));
    assert!(matches!(refused((4, 4), &[TextureFormat::Depth32Float], None), Some(CanvasError::Pass(_))));
    assert!(matches!(refused((4, 4), &[], Some(TextureFormat::R8Unorm)), Some(CanvasError::Pass(_))));
    // A pipeline of other targets is refused, and nothing is drawn.
    let mut canvas = Canvas::new(device(), (8, 8), &[TextureFormat::R8Unorm], None).expect("valid");
    let other = Canvas::new(device(), (8, 8), &[TextureFormat::R16Float], None).expect("valid");
    let pipeline = pipeline(&other, |_| {});
    let buffer = cover(0.0, [1.0; 4]);
    let vertex_buffers = &[VertexBuffer { buffer: &buffer, offset: 0 }];
    let result = canvas.draw(vec![Draw { vertex_buffers, ..Draw::new(&pipeline, Bindings::default(), 0..3, (8, 8)) }]);
    assert!(result.is_err());
    assert_eq!(canvas.bytes(0), vec![0; 64]);
}

#[test]
fn pictures_have_display_codes() {
    let color = [TextureFormat::R8Unorm, TextureFormat::Rgba8UnormSrgb, TextureFormat::Rgba32Float];
    let mut canvas = Canvas::new(device(), (2, 1), &color, None).expect("valid");
    // 0.5 is code 128 as it is, and 188 by the sRGB curve [IEC 61966-2-1]; beyond 1 and below 0 nothing is brighter or darker.
    for target in 0..3 {
        canvas.clear_color(target, Color { r: 0.5, g: -1.0, b: 7.0, a: 0.0 }).expect("cleared");
    }
    let picture = |pixel: [u8; 3]| [&b"P6\n2 1\n255\n"[..], &pixel, &pixel].concat();
    assert_eq!(canvas.ppm(0), picture([128; 3]), "one channel is grey");
    assert_eq!(canvas.ppm(1), picture([188, 0, 255]));
    assert_eq!(canvas.ppm(2), picture([188, 0, 255]));
}

#[test]
#[should_panic(expected = "pixel (8, 0) of 8x8")]
fn a_pixel_beyond_the_edge_is_no_pixel() {
    let _ = Canvas::new(device(), (8, 8), &[TextureFormat::R8Unorm], None).expect("valid").pixel(0, 8, 0);
}

#[test]
fn packed_layouts_have_no_gaps() {
    let layout = VertexBufferLayout::packed(&[VertexFormat::Float32x3, VertexFormat::Unorm8x4, VertexFormat::Float32x2]);
    assert_eq!((layout.array_stride, layout.step_mode), (24, VertexStepMode::Vertex));
    let places: Vec<_> = layout.attributes.iter().map(|a| (a.shader_location, a.offset, a.format)).collect();
    assert_eq!(places, [(0, 0, VertexFormat::Float32x3), (1, 12, VertexFormat::Unorm8x4), (2, 16, VertexFormat::Float32x2)]);
}

#[test]
fn mipmapped_textures_have_every_level() {
    let texture = Texture::mipmapped("ramp", (8, 2), TextureFormat::R32Float, |x, y| [(10 * y + x) as f32, 0.0, 0.0, 0.0]).expect("valid");
    assert_eq!(texture.desc().mip_level_count, 4);
    assert_eq!(texture.read_channel(0, 0, 0)[8..], [10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0]);
    // The mean of columns 0..8 is 3.5, of rows 0 and 10 it is 5.
    assert_eq!(texture.read_channel(3, 0, 0), [8.5]);
}

/// Colours are interpolated in perspective: at the middle of the screen between w = 1 and w = 3, three quarters of the near vertex's are left.
#[test]
fn vertex_colors_are_in_perspective() {
    let mut canvas = Canvas::new(device(), (64, 1), &[TextureFormat::Rgba32Float], None).expect("valid");
    let program = Arc::new(Program::vertex_color());
    let pipeline = canvas
        .pipeline(program, |desc| desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x4; 2])])
        .expect("valid");
    let corner = |x: f32, y: f32, w: f32, color: f32| [[x * w, y * w, 0.0, w], [color; 4]];
    let (near, far) = ([-1.0, 1.0].map(|y| corner(-1.0, y, 1.0, 0.0)), [-1.0, 1.0].map(|y| corner(1.0, y, 3.0, 1.0)));
    let strip = Buffer::from_slice(&[near[0], far[0], near[1], far[0], far[1], near[1]]);
    let vertex_buffers = &[VertexBuffer { buffer: &strip, offset: 0 }];
    canvas.draw(vec![Draw { vertex_buffers, ..Draw::new(&pipeline, Bindings::default(), 0..6, (64, 1)) }]).expect("valid");
    for x in 0..64 {
        // Place s from the left edge: (s/3) / ((1 − s)/1 + s/3).
        let s = (x as f32 + 0.5) / 64.0;
        let expected = (s / 3.0) / (1.0 - s + s / 3.0);
        let seen = canvas.pixel(0, x, 0)[3];
        assert!((seen - expected).abs() < 1.0e-5, "{seen} at {x}, expected {expected}");
        assert!((seen - s).abs() > 1.0e-3, "linear on the screen would be told apart");
    }
}

#[test]
fn matrices_are_columns() {
    let matrix = [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, 12.0], [13.0, 14.0, 15.0, 16.0]];
    assert_eq!(v4(1.0f32, 10.0, 100.0, 1000.0).transformed(&matrix), v4(13951.0, 15062.0, 16173.0, 17284.0));
    assert_eq!(V4::<f32>::from_array((), [1.0, 2.0, 3.0, 4.0]), v4(1.0, 2.0, 3.0, 4.0));
}

/// What an example may be long: what a reader takes in at once.
#[test]
fn examples_are_short_and_all_are_named() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut names: Vec<String> = Vec::new();
    for entry in fs::read_dir(root.join("docs/examples")).expect("the folder is there") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            let lines = fs::read_to_string(&path).expect("readable").lines().count();
            assert!(lines <= 60, "{} has {lines} lines", path.display());
            names.push(path.file_stem().expect("named").to_string_lossy().into_owned());
        }
    }
    assert_eq!(names.len(), 5, "{names:?}");
    // Whoever reads the manifest, the page or the script of the continuous integration meets all of them.
    for file in ["src/pipeline/Cargo.toml", "docs/examples.md"] {
        let text = fs::read_to_string(root.join(file)).expect("readable");
        for name in &names {
            assert!(
                text.contains(&format!("docs/examples/{name}.rs")) || text.contains(&format!("examples/{name}.rs")),
                "{file}: no {name}"
            );
        }
    }
}
