//! Geometry stage, stream-out, occlusion counts and pipeline statistics.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Geometry, GeometryInput, GeometryOutput, GeometryShader, Interpolation, Program, Varying,
};
use nephroid_pipeline::state::{
    CompareFunction, Face, GeometryTopology, IndexFormat, PixelRect, PrimitiveState, PrimitiveTopology, TextureFormat,
};
use nephroid_pipeline::{Bindings, Buffer, Device, DeviceOptions, Draw, IndexBuffer, PipelineStatistics, StreamOutTarget};

use super::depth_stencil::depth_state;
use super::passes::*;
use super::reference::{Fill, for_each_pixel, snap};

/// A closure as a geometry shader.
struct Emit<F>(F);

impl<F: Fn(&GeometryInput<'_>, &mut GeometryOutput<'_>) + Send + Sync> GeometryShader for Emit<F> {
    fn geometry(&self, _: &Bindings<'_>, input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>) {
        (self.0)(input, output);
    }
}

fn with_geometry(
    output: GeometryTopology,
    max_vertices: usize,
    shader: impl Fn(&GeometryInput<'_>, &mut GeometryOutput<'_>) + Send + Sync + 'static,
) -> Program {
    let program = pull_program(FlatColor, Interpolation::Flat);
    let input_varyings = program.varyings.clone();
    Program { geometry: Some(Geometry { shader: std::sync::Arc::new(Emit(shader)), output, max_vertices, input_varyings }), ..program }
}

/// Streams a draw's primitives out on a device; data, written, needed.
fn stream(device: &Device, program: Program, topology: PrimitiveTopology, vertices: &[Vertex], capacity: usize) -> (Vec<f32>, u64, u64) {
    let pipeline = pipeline(program, |desc| {
        desc.primitive = PrimitiveState { topology, ..PrimitiveState::default() };
        desc.rasterizer_discard = true;
    });
    let vertices = Vertices::new(vertices);
    let entries = vertices.entries();
    let mut canvas = Canvas::new((1, 1), &[], None);
    canvas.stream_out = vec![StreamOutTarget { capacity, ..StreamOutTarget::default() }];
    let draw = Draw { stream_out: Some(0), ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, (1, 1)) };
    let output = canvas.run_on(device, vec![draw], None);
    let counts = output.stream_out[0];
    (canvas.stream_out[0].data.clone(), counts.primitives_written, counts.primitive_storage_needed)
}

fn numbered(count: usize) -> Vec<Vertex> {
    (0..count).map(|i| vertex([i as f32, 0.0, 0.5, 1.0], [i as f32, 0.0, 0.0, 0.0])).collect()
}

/// First varying of every streamed vertex.
fn ids(data: &[f32]) -> Vec<usize> {
    data.chunks_exact(8).map(|v| v[4] as usize).collect()
}

#[test]
fn stream_out_of_every_topology() {
    use PrimitiveTopology::*;
    let flat = |list: &[&[usize]]| list.concat();
    for (topology, expected) in [
        (PointList, flat(&[&[0], &[1], &[2], &[3], &[4], &[5], &[6]])),
        (LineList, flat(&[&[0, 1], &[2, 3], &[4, 5]])),
        (LineStrip, flat(&[&[0, 1], &[1, 2], &[2, 3], &[3, 4], &[4, 5], &[5, 6]])),
        (TriangleList, flat(&[&[0, 1, 2], &[3, 4, 5]])),
        (TriangleStrip, flat(&[&[0, 1, 2], &[1, 3, 2], &[2, 3, 4], &[3, 5, 4], &[4, 5, 6]])),
    ] {
        for device in [device(), scalar_device()] {
            let program = pull_program(FlatColor, Interpolation::Flat);
            let (data, written, needed) = stream(device, program, topology, &numbered(7), 10_000);
            assert_eq!(ids(&data), expected, "{topology:?}");
            assert_eq!(written, needed);
            // Positions come before varyings.
            assert!(data.chunks_exact(8).all(|v| v[0] == v[4] && v[2] == 0.5 && v[3] == 1.0));
        }
    }
}

#[test]
fn stream_out_stops_at_whole_primitives() {
    // 24 floats per triangle of three vertices.
    for (capacity, whole) in [(0, 0), (23, 0), (24, 1), (47, 1), (48, 2), (71, 2), (72, 3), (1000, 3)] {
        let program = pull_program(FlatColor, Interpolation::Flat);
        let (data, written, needed) = stream(device(), program, PrimitiveTopology::TriangleList, &numbered(9), capacity);
        assert_eq!((data.len(), written, needed), (whole as usize * 24, whole, 3), "capacity {capacity}");
    }
}

#[test]
fn stream_out_appends_and_stays_full() {
    let triangles = pipeline(pull_program(FlatColor, Interpolation::Flat), |desc| desc.rasterizer_discard = true);
    let points = pipeline(pull_program(FlatColor, Interpolation::Flat), |desc| {
        desc.rasterizer_discard = true;
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
    });
    let vertices = Vertices::new(&numbered(6));
    let entries = vertices.entries();
    let draw = |pipeline, elements| Draw { stream_out: Some(0), ..Draw::new(pipeline, Bindings::new(&entries, 0), elements, (1, 1)) };
    let mut canvas = Canvas::new((1, 1), &[], None);
    // Two points and one triangle fit; the second triangle does not, and after that the points would, but must not.
    canvas.stream_out = vec![StreamOutTarget { capacity: 16 + 24 + 16, ..StreamOutTarget::default() }];
    let output = canvas.run(vec![draw(&points, 0..2), draw(&triangles, 0..6), draw(&points, 3..5)]);
    assert_eq!(ids(&canvas.stream_out[0].data), [0, 1, 0, 1, 2]);
    assert_eq!((output.stream_out[0].primitives_written, output.stream_out[0].primitive_storage_needed), (3, 6));
    // A second pass appends behind what is there.
    let output = canvas.run(vec![draw(&points, 5..6)]);
    assert_eq!(ids(&canvas.stream_out[0].data), [0, 1, 0, 1, 2, 5]);
    assert_eq!((output.stream_out[0].primitives_written, output.stream_out[0].primitive_storage_needed), (1, 1));
}

#[test]
fn stream_out_keeps_order_across_chunks_and_instances() {
    let count = 70_001;
    let options = DeviceOptions { threads: Some(3), bin_budget_bytes: 1, ..DeviceOptions::default() };
    let tiny = Device::new(options).expect("threads start");
    for device in [device(), &tiny] {
        let program = pull_program(FlatColor, Interpolation::Flat);
        let (data, _, needed) = stream(device, program, PrimitiveTopology::LineStrip, &numbered(count), usize::MAX);
        assert_eq!(needed, count as u64 - 1);
        assert!(ids(&data).chunks_exact(2).enumerate().all(|(i, pair)| pair == [i, i + 1]));
    }
}

#[test]
fn geometry_changes_topology() {
    // Input topology to output topology; what is streamed, by the first varying of the vertices given.
    let all = |input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>| {
        for vertex in input.vertices {
            output.emit(vertex.position, 1.0, vertex.varyings);
        }
    };
    use GeometryTopology as G;
    use PrimitiveTopology as P;
    for (input, output, expected) in [
        (P::TriangleList, G::Points, vec![0, 1, 2, 3, 4, 5]),
        (P::TriangleList, G::LineStrip, vec![0, 1, 1, 2, 3, 4, 4, 5]),
        (P::TriangleList, G::TriangleStrip, vec![0, 1, 2, 3, 4, 5]),
        (P::TriangleStrip, G::LineStrip, vec![0, 1, 1, 2, 1, 3, 3, 2, 2, 3, 3, 4, 3, 5, 5, 4, 4, 5, 5, 6]),
        (P::LineStrip, G::Points, vec![0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6]),
        (P::LineStrip, G::LineStrip, vec![0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6]),
        (P::LineList, G::Points, vec![0, 1, 2, 3, 4, 5]),
        (P::PointList, G::Points, vec![0, 1, 2, 3, 4, 5, 6]),
        (P::PointList, G::LineStrip, vec![]),
        (P::LineList, G::TriangleStrip, vec![]),
    ] {
        for device in [device(), scalar_device()] {
            let (data, ..) = stream(device, with_geometry(output, 8, all), input, &numbered(7), 100_000);
            assert_eq!(ids(&data), expected, "{input:?} to {output:?}");
        }
    }
}

#[test]
fn geometry_amplifies_and_cuts() {
    // Strips of 5, 2, 0, 1 and 3 vertices from each point; the limit of 10 cuts the last one short.
    let shader = |input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>| {
        let mut next = 0;
        for length in [5, 2, 0, 1, 3] {
            for _ in 0..length {
                output.emit([0.0, 0.0, 0.0, 1.0], 1.0, &[(input.primitive_id * 100 + next) as f32, input.instance_index as f32, 0.0, 0.0]);
                next += 1;
            }
            output.end_primitive();
        }
    };
    let (data, written, _) =
        stream(device(), with_geometry(GeometryTopology::TriangleStrip, 11, shader), PrimitiveTopology::PointList, &numbered(3), 100_000);
    let of = |i: usize| [0, 1, 2, 1, 3, 2, 2, 3, 4, 8, 9, 10].map(|v| v + 100 * i);
    assert_eq!(ids(&data), [of(0), of(1), of(2)].concat());
    assert_eq!(written, 12);
    let (data, ..) =
        stream(device(), with_geometry(GeometryTopology::TriangleStrip, 10, shader), PrimitiveTopology::PointList, &numbered(1), 100_000);
    assert_eq!(ids(&data), of(0)[..9], "the eleventh vertex is ignored, and two do not make a triangle");
    let (data, ..) =
        stream(device(), with_geometry(GeometryTopology::LineStrip, 11, shader), PrimitiveTopology::PointList, &numbered(1), 100_000);
    assert_eq!(ids(&data), [0, 1, 1, 2, 2, 3, 3, 4, 5, 6, 8, 9, 9, 10]);
}

/// The primitive index.
struct Index;

impl FragmentShader for Index {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let v = |x: f32| L::splat(input.token, x);
        output.color[0] = v4(v(input.primitive_id as f32), v(input.flat(0)), v(1.0), v(0.0));
    }
}

/// Points blown up to squares of 4x4 pixels by the geometry stage: 400 over many chunks, each square its own number.
#[test]
fn geometry_squares_are_rasterized() {
    let size = (100, 64);
    let shader = |input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>| {
        let v = &input.vertices[0];
        for (dx, dy) in [(0.0, 0.0), (0.0, 4.0), (4.0, 0.0), (4.0, 4.0)] {
            let [x, y, z, w] = v.position;
            output.emit([x + dx * 2.0 / 100.0, y - dy * 2.0 / 64.0, z, w], 1.0, v.varyings);
        }
    };
    let program = Program {
        fragment: Some(std::sync::Arc::new(Index)),
        // A high limit makes few primitives per chunk.
        ..with_geometry(GeometryTopology::TriangleStrip, 64, shader)
    };
    let vertices: Vec<Vertex> = (0..400)
        .map(|i| vertex(clip_from_px(size, [f64::from(i % 25) * 4.0, f64::from(i / 25) * 4.0], 0.5), [i as f32, 0.0, 0.0, 0.0]))
        .collect();
    for device in [device(), scalar_device()] {
        let pipeline = pipeline(program.clone(), |desc| {
            desc.primitive =
                PrimitiveState { topology: PrimitiveTopology::PointList, cull_mode: Some(Face::Back), ..PrimitiveState::default() };
            desc.targets = vec![additive(TextureFormat::Rgba32Float)];
        });
        let mut canvas = Canvas::single(size, TextureFormat::Rgba32Float);
        let output = draw_on(device, &mut canvas, &pipeline, &vertices);
        assert_eq!(output.statistics.geometry_shader_invocations, 400);
        assert_eq!(output.statistics.geometry_shader_primitives, 800);
        for y in 0..64 {
            for x in 0..100 {
                let number = (y / 4 * 25 + x / 4) as f32;
                assert_eq!(canvas.pixel(0, x, y), [number, number, 1.0, 0.0], "({x}, {y})");
            }
        }
    }
}

fn random_triangles(rng: &mut Rng, size: (u32, u32), count: usize) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let z = rng.f32(0.0, 1.0);
        for _ in 0..3 {
            let p = [rng.real(-20.0, f64::from(size.0) + 20.0), rng.real(-20.0, f64::from(size.1) + 20.0)];
            vertices.push(vertex(clip_from_px(size, p, z), [1.0; 4]));
        }
    }
    vertices
}

#[test]
fn occlusion_counts_are_exact() {
    let size = (100, 60);
    let mut rng = Rng(901);
    let format = TextureFormat::Depth32FloatStencil8;
    let depth = |compare, write| pipeline(depth_only_program(), |desc| desc.depth_stencil = Some(depth_state(format, compare, write)));
    let (always, less) = (depth(CompareFunction::Always, false), depth(CompareFunction::Less, false));
    let mut write = depth_state(format, CompareFunction::Always, false);
    write.stencil.front.compare = CompareFunction::Equal;
    write.stencil.back.compare = CompareFunction::Equal;
    write.stencil.read_mask = 0xff;
    let stencil = pipeline(depth_only_program(), |desc| desc.depth_stencil = Some(write));
    for round in 0..sized(20, 4) {
        let buffers: Vec<(Vec<Vertex>, Vertices)> = (0..4)
            .map(|_| {
                let vertices = random_triangles(&mut rng, size, 50);
                let buffer = Vertices::new(&vertices);
                (vertices, buffer)
            })
            .collect();
        let entries: Vec<_> = buffers.iter().map(|b| b.1.entries()).collect();
        let scissor =
            PixelRect { x0: rng.int(0..40) as u32, y0: rng.int(0..30) as u32, x1: rng.int(50..101) as u32, y1: rng.int(30..61) as u32 };
        let count = |vertices: &[Vertex], rect: PixelRect, nearer_than: f32| {
            let mut sum = 0;
            for triangle in vertices.chunks_exact(3) {
                let corners = [0, 1, 2].map(|i: usize| [triangle[i][0], triangle[i][1], triangle[i][2], triangle[i][3]]);
                if corners[0][2] >= nearer_than {
                    continue;
                }
                for_each_pixel(corners.map(|c| snap(size, c)), size, Fill::TopLeft, |x, y| {
                    let (x, y) = (x as u32, y as u32);
                    sum += u64::from(x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1);
                });
            }
            sum
        };
        let whole = PixelRect::full(100, 60);
        let draw =
            |i: usize, pipeline, query: Option<u32>| Draw { query, ..Draw::new(pipeline, Bindings::new(&entries[i], 0), 0..150, size) };
        let draws = vec![
            draw(0, &always, Some(2)),
            Draw { scissor, ..draw(1, &always, Some(0)) },
            draw(2, &less, Some(1)),
            draw(3, &always, None),
            draw(3, &always, Some(2)),
            Draw { stencil_reference: 9, ..draw(0, &stencil, Some(3)) },
            Draw { stencil_reference: 5, ..draw(1, &stencil, Some(4)) },
        ];
        let expected = [
            count(&buffers[1].0, scissor, 2.0),
            count(&buffers[2].0, whole, 0.5),
            count(&buffers[0].0, whole, 2.0) + count(&buffers[3].0, whole, 2.0),
            0,
            count(&buffers[1].0, whole, 2.0),
            0,
        ];
        for device in [device(), scalar_device()] {
            let mut canvas = Canvas::new(size, &[], Some(format));
            canvas.queries = 6;
            canvas.clear_depth = 0.5;
            canvas.clear_stencil = 5;
            let output = canvas.run_on(device, draws.clone(), None);
            assert_eq!(output.queries, expected, "round {round}");
        }
        assert_ne!(expected[0], expected[1], "the counts must differ, or a swap would go unnoticed");
    }
}

#[test]
fn statistics_say_what_became_of_primitives() {
    let size = (64, 64);
    let at = |points: [[f64; 2]; 3], z: f32| points.map(|p| vertex(clip_from_px(size, p, z), [1.0; 4]));
    let mut vertices = Vec::new();
    // Counter-clockwise on the screen, y down.
    let front = [[4.0, 4.0], [4.0, 20.0], [20.0, 4.0]];
    let back = [front[0], front[2], front[1]];
    vertices.extend(at(front, 0.5)); // drawn
    vertices.extend(at(back, 0.5)); // culled
    vertices.extend(at(front.map(|[x, y]| [x - 100.0, y]), 0.5)); // left of the view
    vertices.extend(at(front, 1.5)); // beyond the far plane
    vertices.extend(at([[4.0, 4.0], [8.0, 8.0], [16.0, 16.0]], 0.5)); // no area
    vertices.extend(at([[4.6, 4.6], [4.6, 4.9], [4.9, 4.6]], 0.5)); // between pixel centres
    vertices.extend(at(front.map(|[x, y]| [x - 10.0, y]), 0.5)); // crosses the left border: the guard band leaves it whole
    let mut near = at(front, 0.5);
    near[0][2] = -0.5; // one corner behind the near plane: two triangles
    vertices.extend(near);
    let mut nan = at(front, 0.5);
    nan[1][0] = f32::NAN;
    vertices.extend(nan);
    let mut infinite = at(front, 0.5);
    infinite[1][1] = f32::INFINITY;
    vertices.extend(infinite);
    let mut passed = 0;
    let mut clipped = 0;
    for_each_pixel(front.map(|p| p.map(|v| (v * 256.0) as i64)), size, Fill::TopLeft, |_, _| passed += 1);
    for_each_pixel(front.map(|[x, y]| [x - 10.0, y].map(|v| (v * 256.0) as i64)), size, Fill::TopLeft, |_, _| passed += 1);
    // Depth runs from −0.5 at the corner to 0.5 on the hypotenuse: the half beyond the middle is left.
    let middle = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|i: usize| (a[i] + b[i]) / 2.0);
    let quad = [middle(front[0], front[1]), front[1], front[2], middle(front[2], front[0])];
    for triangle in [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]] {
        for_each_pixel(triangle.map(|p| p.map(|v| (v * 256.0) as i64)), size, Fill::TopLeft, |_, _| clipped += 1);
    }
    for device in [device(), scalar_device()] {
        for general in [false, true] {
            let program = if general { pull_program(VaryingColor, Interpolation::Linear) } else { plain_program(Ones) };
            let pipeline = pipeline(program, |desc| {
                desc.targets = vec![additive(TextureFormat::R32Float)];
                desc.primitive = PrimitiveState { cull_mode: Some(Face::Back), ..PrimitiveState::default() };
            });
            let mut canvas = Canvas::single(size, TextureFormat::R32Float);
            let seen = draw_on(device, &mut canvas, &pipeline, &vertices).statistics;
            let expected = PipelineStatistics {
                vertex_shader_invocations: 30,
                geometry_shader_invocations: 0,
                geometry_shader_primitives: 0,
                clipper_invocations: 10,
                clipper_primitives_out: 7,
                fragment_shader_invocations: passed + clipped,
                primitives_rejected: 4,
                primitives_culled: 1,
                primitives_zero_area: 1,
                primitives_without_samples: 1,
                fragments_passed: passed + clipped,
            };
            assert_eq!(seen, expected, "general path: {general}");
        }
    }
}

#[test]
fn statistics_count_indexed_vertices_once() {
    let pipeline = pipeline(plain_program(Ones), |desc| desc.targets = vec![additive(TextureFormat::R32Float)]);
    let vertices = Vertices::new(&random_triangles(&mut Rng(902), (64, 64), 2));
    let entries = vertices.entries();
    let indices = Buffer::from_slice(&[0u16, 1, 2, 2, 1, 3, 0, 3, 1, 5, 5, 5]);
    let index = Some(IndexBuffer { buffer: &indices, format: IndexFormat::Uint16, offset: 0 });
    let mut canvas = Canvas::single((64, 64), TextureFormat::R32Float);
    let draw = Draw { index, instances: 0..3, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..12, (64, 64)) };
    let output = canvas.run(vec![draw]);
    assert_eq!(output.statistics.vertex_shader_invocations, 15);
    assert_eq!(output.statistics.clipper_invocations, 12);
    assert_eq!(output.statistics.primitives_zero_area, 3);
}

/// Vertices are shaded once in each chunk, so that their number tells where chunks are cut: by the draws alone, even where those are long.
#[test]
fn statistics_of_long_draws_do_not_depend_on_threads() {
    let pipeline = pipeline(plain_program(Ones), |desc| desc.targets = vec![additive(TextureFormat::R32Float)]);
    let vertices = Vertices::new(&random_triangles(&mut Rng(903), (64, 64), 100));
    let entries = vertices.entries();
    // 40 000 triangles: more than the least for a chunk, fewer than the most.
    let indices: Vec<u32> = (0..120_000).map(|i| i * 7 % 300).collect();
    let indices = Buffer::from_slice(&indices);
    let index = Some(IndexBuffer { buffer: &indices, format: IndexFormat::Uint32, offset: 0 });
    let seen = [1, 2, 7].map(|threads| {
        let device = Device::new(DeviceOptions { threads: Some(threads), ..DeviceOptions::default() }).expect("threads start");
        let mut canvas = Canvas::single((64, 64), TextureFormat::R32Float);
        let draw = Draw { index, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..120_000, (64, 64)) };
        canvas.run_on(&device, vec![draw], None).statistics
    });
    assert!(seen[0].vertex_shader_invocations > 300, "one chunk holds the draw: {:?}", seen[0]);
    assert_eq!(seen[1], seen[0]);
    assert_eq!(seen[2], seen[0]);
}

/// Extra outputs of a program are dropped, and varyings of the geometry stage are its own.
#[test]
fn geometry_output_has_its_own_varyings() {
    let shader = |input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>| {
        assert_eq!(input.vertices[0].varyings.len(), 4);
        output.emit([0.0, 0.0, 0.5, 1.0], 8.0, &[input.vertices[0].varyings[0] * 2.0]);
    };
    let base = with_geometry(GeometryTopology::Points, 1, shader);
    let program = Program {
        varyings: vec![Varying { name: "twice", components: 1, interpolation: Interpolation::Flat }],
        fragment: Some(std::sync::Arc::new(Index)),
        ..base
    };
    let pipeline = pipeline(program, |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
        desc.targets = vec![target(TextureFormat::Rgba32Float)];
    });
    let mut canvas = Canvas::single((16, 16), TextureFormat::Rgba32Float);
    draw(&mut canvas, &pipeline, &[vertex([0.0; 4], [21.0, 0.0, 0.0, 0.0])]);
    assert_eq!(canvas.pixel(0, 8, 8), [0.0, 42.0, 1.0, 0.0]);
    assert_eq!(canvas.channel(0, 2).iter().sum::<f32>(), 64.0, "the geometry stage's point size");
}
