//! Input that no sane program draws: nothing panics, nothing depends on the device, refused passes say why.

use nephroid_pipeline::shader::Interpolation;
use nephroid_pipeline::state::{CompareFunction, PixelRect, PrimitiveState, PrimitiveTopology, RasterRules, TextureFormat, Viewport};
use nephroid_pipeline::{
    BindingProblem, Bindings, ColorAttachment, Draw, DrawProblem, LoadOp, Pass, PassError, Texture, TextureDescriptor, run_pass,
};

use super::depth_stencil::depth_state;
use super::passes::*;

/// A number of any size, sign and kind.
fn wild(rng: &mut Rng) -> f32 {
    match rng.int(0..12) {
        0 => f32::from_bits(rng.next() as u32),
        1 => 0.0,
        2 => -0.0,
        3 => f32::INFINITY,
        4 => f32::NAN,
        5 => f32::MIN_POSITIVE * rng.f32(-1.0, 1.0),
        6 => f32::MAX * rng.f32(-1.0, 1.0),
        7 => [1.0, -1.0, 0.5, 2.0][rng.int(0..4) as usize],
        _ => libm::exp(rng.real(-30.0, 30.0)) as f32 * if rng.chance(2) { 1.0 } else { -1.0 },
    }
}

#[test]
fn wild_vertices_give_the_same_bytes_everywhere() {
    let size = (100, 60);
    let mut rng = Rng(1101);
    let mut total = 0;
    for round in 0..sized(300, 40) {
        // Half of the rounds without the values that drop a primitive at once.
        let tame = round % 2 == 0;
        let number = |rng: &mut Rng| loop {
            let v = wild(rng);
            if !tame || v.is_finite() {
                return v;
            }
        };
        let vertices: Vec<Vertex> = (0..300)
            .map(|_| {
                let position = [0; 4].map(|_| number(&mut rng));
                vertex(position, [rng.f32(0.0, 1.0); 4])
            })
            .collect();
        let viewports = [
            Viewport::full(100, 60),
            Viewport { x: -32768.0, y: -1000.0, width: 65000.0 / 2.0, height: 2000.0, min_depth: 0.0, max_depth: 1.0 },
            Viewport { x: 10.5, y: 7.25, width: 0.0, height: 30.1, min_depth: 0.5, max_depth: 0.5 },
            Viewport { x: 0.0, y: 0.0, width: 32767.0, height: 32767.0, min_depth: 0.0, max_depth: 1.0 },
        ];
        let viewport = viewports[round % 4];
        for rules in [RasterRules::REFERENCE, RasterRules::LAVAPIPE, RasterRules::LAVAPIPE_NO_FMA, RasterRules::SWIFTSHADER] {
            for topology in [PrimitiveTopology::TriangleList, PrimitiveTopology::LineList, PrimitiveTopology::PointList] {
                let pipeline = pipeline_with(pull_program(VaryingColor, Interpolation::Perspective), rules, |desc| {
                    desc.primitive = PrimitiveState { topology, unclipped_depth: round % 3 == 0, ..PrimitiveState::default() };
                    desc.targets = vec![target(TextureFormat::Rgba32Float)];
                    desc.depth_stencil = Some(depth_state(TextureFormat::Depth32Float, CompareFunction::LessEqual, true));
                    desc.line_width = [1.0, 1024.0][round % 2];
                });
                let buffer = Vertices::new(&vertices);
                let entries = buffer.entries();
                let mut bytes = Vec::new();
                for device in [device(), scalar_device()] {
                    let mut canvas = Canvas::new(size, &[Some(TextureFormat::Rgba32Float)], Some(TextureFormat::Depth32Float));
                    let draw = Draw { viewport, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..buffer.count, size) };
                    let output = canvas.run_on(device, vec![draw], None);
                    bytes.push((canvas.bytes(), output.statistics));
                    // Depth never leaves the viewport's range, nor is it ever not a number.
                    let (low, high) = (viewport.min_depth, viewport.max_depth);
                    let inside = |z: &f32| (low..=high).contains(z) || *z == 1.0;
                    assert!(canvas.depths().iter().all(inside), "{rules:?} {topology:?}, round {round}: depth outside the range");
                }
                assert!(bytes[0] == bytes[1], "{rules:?} {topology:?}, round {round}: bytes or counters differ");
                total += 1;
            }
        }
    }
    println!("wild vertices: {total} passes of 300 vertices");
}

#[test]
fn not_a_number_drops_the_primitive() {
    let pipeline = pipeline(plain_program(Ones), |desc| desc.targets = vec![additive(TextureFormat::R32Float)]);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for component in 0..4 {
            for corner in 0..3 {
                let mut triangle = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4]));
                triangle[corner][component] = bad;
                let mut canvas = Canvas::single((8, 8), TextureFormat::R32Float);
                let output = draw(&mut canvas, &pipeline, &triangle);
                assert_eq!(output.statistics.fragments_passed, 0, "{bad} as component {component} of corner {corner}");
                assert_eq!(output.statistics.primitives_rejected, 1);
            }
        }
    }
}

#[test]
fn empty_draws_do_nothing() {
    let pipeline = pipeline(plain_program(Ones), |desc| desc.targets = vec![additive(TextureFormat::R32Float)]);
    let vertices = Vertices::new(&[vertex([0.0; 4], [0.0; 4])]);
    let entries = vertices.entries();
    let draw = |elements, instances| Draw { instances, ..Draw::new(&pipeline, Bindings::new(&entries, 0), elements, (8, 8)) };
    let mut canvas = Canvas::single((8, 8), TextureFormat::R32Float);
    let output = canvas.run(vec![draw(0..0, 0..1), draw(0..2, 0..u32::MAX), draw(0..1, 5..5), draw(7..9, 0..1)]);
    assert_eq!(output.statistics, Default::default());
    assert_eq!(output.waves, 1, "a pass that draws nothing still clears");
}

#[test]
fn refused_passes_say_why_and_draw_nothing() {
    let pipeline = pipeline(plain_program(Ones), |desc| desc.targets = vec![target(TextureFormat::R32Float)]);
    let vertices = Vertices::new(&[vertex([0.0; 4], [0.0; 4])]);
    let entries = vertices.entries();
    let good = || Draw::new(&pipeline, Bindings::new(&entries, 0), 0..1, (8, 8));
    let viewport = |edit: fn(&mut Viewport)| {
        let mut v = Viewport::full(8, 8);
        edit(&mut v);
        v
    };
    type Expected = fn(&DrawProblem) -> bool;
    let table: Vec<(Draw<'_>, Expected)> = vec![
        (Draw { scissor: PixelRect::full(9, 8), ..good() }, |p| matches!(p, DrawProblem::Scissor { size: (8, 8), .. })),
        (Draw { viewport: viewport(|v| v.width = f32::NAN), ..good() }, |p| matches!(p, DrawProblem::ViewportSize { .. })),
        (Draw { query: Some(0), ..good() }, |p| *p == DrawProblem::Query { query: 0, count: 0 }),
        (Draw { stream_out: Some(0), ..good() }, |p| *p == DrawProblem::StreamOut { target: 0, count: 0 }),
        (Draw { bindings: Bindings::new(&[], 0), ..good() }, |p| {
            *p == DrawProblem::Binding(BindingProblem::Count { given: 0, expected: 1 })
        }),
    ];
    let mut texture = Texture::new(TextureDescriptor::d2("t", 8, 8, TextureFormat::R32Float)).expect("valid");
    let before = texture.clone();
    for (draw, expected) in table {
        let load = LoadOp::Clear(nephroid_pipeline::state::Color::WHITE);
        let mut pass = Pass {
            label: "refused".into(),
            color: vec![Some(ColorAttachment { view: texture.view_mut(), load })],
            draws: vec![good(), draw],
            ..Pass::default()
        };
        match run_pass(device(), &mut pass, None) {
            Err(PassError::Draw { draw: 1, problem, .. }) => assert!(expected(&problem), "{problem:?}"),
            other => panic!("a refused draw gave {other:?}"),
        }
    }
    assert_eq!(texture, before, "a refused pass must not even clear");
}
