//! Rules of draws.

use nephroid_pipeline::state::{
    CompareFunction, IndexFormat, PixelRect, PrimitiveTopology, TextureFormat, VertexAttribute, VertexBufferLayout, VertexFormat,
    VertexStepMode, Viewport,
};
use nephroid_pipeline::{
    BindingProblem, Bindings, Buffer, ColorAttachment, Draw, DrawProblem, IndexBuffer, LoadOp, Pass, PassError, RenderPipeline,
    StreamOutTarget, Texture, TextureDescriptor, VertexBuffer, run_pass,
};

use super::{Row, rule};
use crate::depth_stencil::depth_state;
use crate::passes::{Ones, Vertices, device, pipeline, plain_program, target, vertex};

const SIZE: (u32, u32) = (8, 8);

/// One draw over a target of rgba8unorm, in a pass with one query and one stream-out target.
pub fn drawn(draw: Draw<'_>) -> Result<(), DrawProblem> {
    let mut texture = Texture::new(TextureDescriptor::d2("test", SIZE.0, SIZE.1, TextureFormat::Rgba8Unorm)).expect("a valid texture");
    let mut pass = Pass {
        color: vec![Some(ColorAttachment { view: texture.view_mut(), load: LoadOp::Load })],
        draws: vec![draw],
        query_count: 1,
        stream_out: vec![StreamOutTarget { capacity: 64, ..StreamOutTarget::default() }],
        ..Pass::default()
    };
    match run_pass(device(), &mut pass, None) {
        Ok(_) => Ok(()),
        Err(PassError::Draw { draw: 0, problem, .. }) => Err(problem),
        Err(other) => panic!("not about the draw: {other}"),
    }
}

/// A pipeline for [`drawn`], edited.
pub fn drawable(edit: impl FnOnce(&mut nephroid_pipeline::RenderPipelineDescriptor)) -> RenderPipeline {
    pipeline(plain_program(Ones), |desc| {
        desc.targets = vec![target(TextureFormat::Rgba8Unorm)];
        edit(desc);
    })
}

/// Rules of what a draw states itself.
pub fn draws() -> Vec<Row> {
    use TextureFormat::{Depth32Float, R32Float, Rgba8Unorm};
    let vertices = Vertices::new(&[vertex([0.0; 4], [0.0; 4]); 3]);
    let entries = vertices.entries();
    let plain = drawable(|_| ());
    let other = drawable(|desc| desc.targets = vec![target(R32Float)]);
    let deep = drawable(|desc| desc.depth_stencil = Some(depth_state(Depth32Float, CompareFunction::Less, true)));
    let of = |pipeline| Draw::new(pipeline, Bindings::new(&entries, 0), 0..3, SIZE);
    let good = || of(&plain);
    let viewport = |edit: fn(&mut Viewport)| {
        let mut viewport = Viewport::full(SIZE.0, SIZE.1);
        edit(&mut viewport);
        drawn(Draw { viewport, ..good() })
    };
    let scissor = |x0, x1| drawn(Draw { scissor: PixelRect { x0, y0: 0, x1, y1: 8 }, ..good() });
    // A range that ends before it starts is the point of the rule.
    let instances = |start, end| drawn(Draw { instances: std::ops::Range { start, end }, ..good() });
    vec![
        rule!("draw-bindings": drawn(Draw { bindings: Bindings::new(&[], 0), ..good() })
            => DrawProblem::Binding(BindingProblem::Count { given: 0, expected: 1 }), drawn(good())),
        rule!("draw-color-target": drawn(of(&other))
            => DrawProblem::ColorAttachment { target: 0, attached: Some(Rgba8Unorm), expected: Some(R32Float) }, drawn(good())),
        rule!("draw-depth-stencil": drawn(of(&deep)) => DrawProblem::DepthStencil { attached: None, expected: Some(Depth32Float) },
            drawn(good())),
        rule!("viewport-size": viewport(|v| v.width = -1.0) => DrawProblem::ViewportSize { .. }, viewport(|v| v.width = 0.0)),
        rule!("viewport-finite": viewport(|v| v.x = f32::NAN) => DrawProblem::ViewportSize { .. }, viewport(|v| v.x = 0.5)),
        rule!("viewport-origin": viewport(|v| v.y = -32769.0) => DrawProblem::ViewportOrigin { y: -32769.0, .. },
            viewport(|v| v.y = -32768.0)),
        rule!("viewport-end": viewport(|v| v.x = 32760.0) => DrawProblem::ViewportEnd { .. }, viewport(|v| v.x = 32759.0)),
        rule!("viewport-depth": viewport(|v| (v.min_depth, v.max_depth) = (0.6, 0.5))
            => DrawProblem::ViewportDepth { min_depth: 0.6, max_depth: 0.5 }, viewport(|v| (v.min_depth, v.max_depth) = (0.5, 0.5))),
        rule!("viewport-depth-range": viewport(|v| v.max_depth = 1.5) => DrawProblem::ViewportDepth { max_depth: 1.5, .. },
            viewport(|v| v.max_depth = 1.0)),
        rule!("scissor": scissor(0, 9) => DrawProblem::Scissor { size: (8, 8), .. }, scissor(8, 8)),
        rule!("scissor-order": scissor(5, 4) => DrawProblem::Scissor { .. }, scissor(4, 5)),
        rule!("draw-range": instances(2, 1) => DrawProblem::Range { .. }, instances(1, 1)),
        rule!("query": drawn(Draw { query: Some(1), ..good() }) => DrawProblem::Query { query: 1, count: 1 },
            drawn(Draw { query: Some(0), ..good() })),
        rule!("stream-out-target": drawn(Draw { stream_out: Some(1), ..good() }) => DrawProblem::StreamOut { target: 1, count: 1 },
            drawn(Draw { stream_out: Some(0), ..good() })),
    ]
}

/// Rules of index and vertex buffers.
pub fn vertices() -> Vec<Row> {
    let vertices = Vertices::new(&[vertex([0.0; 4], [0.0; 4]); 3]);
    let entries = vertices.entries();
    let (plain, strip) = (
        drawable(|_| ()),
        drawable(|desc| {
            desc.primitive.topology = PrimitiveTopology::TriangleStrip;
            desc.primitive.strip_index_format = Some(IndexFormat::Uint32);
        }),
    );
    let layout = |step_mode| VertexBufferLayout {
        array_stride: 8,
        step_mode,
        attributes: vec![VertexAttribute { format: VertexFormat::Float32x2, offset: 0, shader_location: 0 }],
    };
    let per_vertex = drawable(|desc| desc.vertex_buffers = vec![layout(VertexStepMode::Vertex)]);
    let per_instance = drawable(|desc| desc.vertex_buffers = vec![layout(VertexStepMode::Instance)]);
    let of = |pipeline| Draw::new(pipeline, Bindings::new(&entries, 0), 0..3, SIZE);
    let indices = Buffer::from_slice(&[0u32; 4]);
    let indexed = |pipeline, format, offset, elements| {
        drawn(Draw { index: Some(IndexBuffer { buffer: &indices, format, offset }), vertices: elements, ..of(pipeline) })
    };
    let (long, short) = (Buffer::from_slice(&[0.0f32; 6]), Buffer::from_slice(&[0.0f32; 5]));
    let fetched = |pipeline, buffer, offset, instances| {
        let bound = [VertexBuffer { buffer, offset }];
        drawn(Draw { vertex_buffers: &bound, instances, ..of(pipeline) })
    };
    vec![
        rule!("index-offset": indexed(&plain, IndexFormat::Uint32, 2, 0..3)
            => DrawProblem::IndexOffset { offset: 2, format: IndexFormat::Uint32 }, indexed(&plain, IndexFormat::Uint16, 2, 0..3)),
        rule!("index-range": indexed(&plain, IndexFormat::Uint32, 4, 1..4) => DrawProblem::IndexRange { count: 3, .. },
            indexed(&plain, IndexFormat::Uint32, 4, 0..3)),
        rule!("strip-indices": indexed(&strip, IndexFormat::Uint16, 0, 0..3)
            => DrawProblem::StripIndexFormat { bound: IndexFormat::Uint16, pipeline: Some(IndexFormat::Uint32) },
            indexed(&strip, IndexFormat::Uint32, 0, 0..3)),
        rule!("vertex-buffer-bound": drawn(of(&per_vertex)) => DrawProblem::VertexBufferCount { bound: 0, expected: 1 },
            fetched(&per_vertex, &long, 0, 0..1)),
        rule!("vertex-buffer-offset": fetched(&per_instance, &long, 2, 0..1) => DrawProblem::VertexBufferOffset { slot: 0, offset: 2 },
            fetched(&per_instance, &long, 4, 0..1)),
        rule!("vertex-buffer-size": fetched(&per_vertex, &short, 0, 0..1)
            => DrawProblem::VertexBufferSize { slot: 0, bytes: 20, expected: 24 }, fetched(&per_vertex, &long, 0, 0..1)),
        rule!("instance-buffer-size": fetched(&per_instance, &short, 8, 1..2)
            => DrawProblem::VertexBufferSize { slot: 0, bytes: 20, expected: 24 }, fetched(&per_instance, &long, 8, 1..2)),
    ]
}
