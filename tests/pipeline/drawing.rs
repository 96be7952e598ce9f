//! Draws: culling, topologies and restart, draw arguments, vertex attributes, targets, clears (`render_pipeline/{culling_tests,
//! primitive_topology,pipeline_output_targets}.spec.ts`, `rendering/{draw,basic}.spec.ts`, `render_pass/{clear_value,storeOp}.spec.ts`).

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{
    Face, FrontFace, IndexFormat, PixelRect, PrimitiveState, PrimitiveTopology, RasterRules, TextureFormat, VertexAttribute,
    VertexBufferLayout, VertexFormat, VertexStepMode, Viewport,
};
use nephroid_pipeline::{Bindings, Buffer, Draw, IndexBuffer, StreamOutTarget, VertexBuffer, f16_to_f32};

use super::passes::*;
use super::reference::{Fill, Fx, for_each_pixel};

const TOPOLOGIES: [PrimitiveTopology; 5] = [
    PrimitiveTopology::PointList,
    PrimitiveTopology::LineList,
    PrimitiveTopology::LineStrip,
    PrimitiveTopology::TriangleList,
    PrimitiveTopology::TriangleStrip,
];

#[test]
fn culling_by_facing_winding_and_topology() {
    let size = (8, 8);
    let format = TextureFormat::R32Float;
    // Counter-clockwise on the screen; and for strips a second triangle that continues it.
    let corners = [[-0.75, 0.75], [-0.75, -0.75], [0.75, 0.75], [0.75, -0.75]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [1.0; 4]));
    for topology in TOPOLOGIES {
        for front_face in [FrontFace::Ccw, FrontFace::Cw] {
            for cull_mode in [None, Some(Face::Front), Some(Face::Back)] {
                for turned in [false, true] {
                    let pipeline = pipeline(pull_program(FacingColor, Interpolation::Flat), |desc| {
                        desc.primitive = PrimitiveState { topology, front_face, cull_mode, ..PrimitiveState::default() };
                        desc.targets = vec![target(format)];
                    });
                    let mut vertices = corners[..if topology.is_strip() { 4 } else { 3 }].to_vec();
                    if turned {
                        vertices.swap(0, 1);
                        if vertices.len() == 4 {
                            vertices.swap(2, 3);
                        }
                    }
                    let mut canvas = Canvas::single(size, format);
                    let output = draw(&mut canvas, &pipeline, &vertices);
                    let triangles = matches!(topology, PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip);
                    let front = !triangles || (front_face == FrontFace::Ccw) != turned;
                    let culled = triangles && cull_mode == Some(if front { Face::Front } else { Face::Back });
                    let seen = canvas.channel(0, 0);
                    let what = format!("{topology:?} {front_face:?} {cull_mode:?} turned: {turned}");
                    let drawn: Vec<f32> = seen.into_iter().filter(|v| *v != 0.0).collect();
                    assert_eq!(drawn.is_empty(), culled, "{what}");
                    let color = if front { 1.0 } else { 2.0 };
                    assert!(drawn.iter().all(|v| *v == color), "{what}: front_facing of the fragments");
                    if triangles {
                        let count = if topology == PrimitiveTopology::TriangleStrip { 2 } else { 1 };
                        assert_eq!(output.statistics.primitives_culled, if culled { count } else { 0 }, "{what}");
                    }
                }
            }
        }
    }
}

/// 1 in front, 2 behind.
struct FacingColor;

impl FragmentShader for FacingColor {
    const PER_PRIMITIVE: bool = true;
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let color = L::splat(input.token, if input.front_facing { 1.0 } else { 2.0 });
        output.color[0] = v4(color, color, color, color);
    }
}

/// Per-primitive shaders that read only the facing, through shortcut and queue, with and without varyings.
#[test]
fn facing_of_per_primitive_shaders() {
    for with_varyings in [false, true] {
        for format in [TextureFormat::R32Float, TextureFormat::Rgba8Unorm] {
            for blend in [false, true] {
                let program = if with_varyings { pull_program(FacingColor, Interpolation::Flat) } else { plain_program(FacingColor) };
                let pipeline = pipeline(program, |desc| desc.targets = vec![if blend { additive(format) } else { target(format) }]);
                let front = [[-1.0, 1.0], [-1.0, -3.0], [0.0, 1.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4]));
                let back = [[0.0, 1.0], [1.0, 1.0], [1.0, -3.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4]));
                let vertices: Vec<Vertex> = front.into_iter().chain(back).collect();
                for device in [device(), scalar_device()] {
                    let mut canvas = Canvas::single((8, 8), format);
                    draw_on(device, &mut canvas, &pipeline, &vertices);
                    let unorm = format == TextureFormat::Rgba8Unorm;
                    assert_eq!(canvas.pixel(0, 0, 1)[0], 1.0);
                    assert_eq!(canvas.pixel(0, 7, 1)[0], if unorm { 1.0 } else { 2.0 });
                }
            }
        }
    }
}

/// The suite's six vertices, moved to pixel centres.
const PLACES: [[f64; 2]; 6] = [[8.5, 24.5], [16.5, 8.5], [24.5, 24.5], [32.5, 8.5], [40.5, 24.5], [48.5, 8.5]];
const TOPOLOGY_SIZE: (u32, u32) = (56, 56);

/// Draws the six vertices; every fragment adds one.
fn draw_topology(topology: PrimitiveTopology, indices: Option<(&[u32], IndexFormat)>) -> Vec<f32> {
    let pipeline = pipeline(plain_program(Ones), |desc| {
        let strip_index_format = indices.map(|i| i.1).filter(|_| topology.is_strip());
        desc.primitive = PrimitiveState { topology, strip_index_format, ..PrimitiveState::default() };
        desc.targets = vec![additive(TextureFormat::R32Float)];
    });
    let vertices = Vertices::new(&PLACES.map(|p| vertex(clip_from_px(TOPOLOGY_SIZE, p, 0.5), [0.0; 4])));
    let entries = vertices.entries();
    let mut canvas = Canvas::single(TOPOLOGY_SIZE, TextureFormat::R32Float);
    let bindings = Bindings::new(&entries, 0);
    match indices {
        None => canvas.run(vec![Draw::new(&pipeline, bindings, 0..6, TOPOLOGY_SIZE)]),
        Some((indices, format)) => {
            let buffer = match format {
                IndexFormat::Uint32 => Buffer::from_slice(indices),
                IndexFormat::Uint16 => Buffer::from_slice(&indices.iter().map(|i| *i as u16).collect::<Vec<_>>()),
            };
            let index = Some(IndexBuffer { buffer: &buffer, format, offset: 0 });
            canvas.run(vec![Draw { index, ..Draw::new(&pipeline, bindings, 0..indices.len() as u32, TOPOLOGY_SIZE) }])
        }
    };
    canvas.channel(0, 0)
}

fn expected_triangles(list: &[[usize; 3]]) -> Vec<f32> {
    let mut image = vec![0.0; 56 * 56];
    for triangle in list {
        let snapped: [Fx; 3] = triangle.map(|i| PLACES[i].map(|v| (v * 256.0) as i64));
        for_each_pixel(snapped, TOPOLOGY_SIZE, Fill::TopLeft, |x, y| image[y * 56 + x] += 1.0);
    }
    image
}

#[test]
fn topologies_without_indices() {
    use PrimitiveTopology::*;
    let triangles: [(_, &[_]); 2] =
        [(TriangleList, &[[0, 1, 2], [3, 4, 5]]), (TriangleStrip, &[[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]])];
    for (topology, list) in triangles {
        assert_eq!(first_difference(56, &expected_triangles(list), &draw_topology(topology, None)), None, "{topology:?}");
    }
    let points = draw_topology(PointList, None);
    assert_eq!(points.iter().sum::<f32>(), 6.0);
    for [x, y] in PLACES {
        assert_eq!(points[y as usize * 56 + x as usize], 1.0, "point at ({x}, {y})");
    }
    // A segment's middle is drawn exactly when the topology has the segment.
    let list = draw_topology(LineList, None);
    let strip = draw_topology(LineStrip, None);
    for i in 0..5 {
        let middle = [0, 1].map(|axis: usize| (PLACES[i][axis] + PLACES[i + 1][axis]) * 0.5);
        let at = middle[1] as usize * 56 + middle[0] as usize;
        assert_eq!(list[at] > 0.0, i % 2 == 0, "list, segment {i}");
        assert!(strip[at] > 0.0, "strip, segment {i}");
    }
    let three = draw_topology(LineList, Some((&[0, 1, 2, 3, 4, 5], IndexFormat::Uint32)));
    assert_eq!(first_difference(56, &list, &three), None, "the same list by index");
}

#[test]
fn topologies_with_restart() {
    use PrimitiveTopology::*;
    for (format, restart) in [(IndexFormat::Uint16, 0xffff), (IndexFormat::Uint32, u32::MAX)] {
        type Case<'a> = (&'a [u32], &'a [[usize; 3]]);
        let cases: [Case<'_>; 6] = [
            (&[0, 1, 2, 3, 4, 5], &[[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]]),
            (&[0, 1, 2, 3, restart, 4, 5], &[[0, 1, 2], [1, 2, 3]]),
            (&[0, 1, 2, restart, 3, 4, 5], &[[0, 1, 2], [3, 4, 5]]),
            (&[restart, restart, 1, 2, 3, restart], &[[1, 2, 3]]),
            (&[0, 1, restart, 2, 3, restart, 4, 5], &[]),
            (&[5, 4, 3, restart, 0, 1, 2, 3], &[[5, 4, 3], [0, 1, 2], [1, 2, 3]]),
        ];
        for (indices, list) in cases {
            let seen = draw_topology(TriangleStrip, Some((indices, format)));
            assert_eq!(first_difference(56, &expected_triangles(list), &seen), None, "{indices:?} of {format:?}");
        }
        // Lines: the same segments as a list.
        let segments: [(&[u32], &[u32]); 3] = [
            (&[0, 1, 2, 3, restart, 4, 5], &[0, 1, 1, 2, 2, 3, 4, 5]),
            (&[0, restart, 1, 2, restart, 5], &[1, 2]),
            (&[3, 4, 5], &[3, 4, 4, 5]),
        ];
        for (indices, list) in segments {
            let expected = draw_topology(LineList, Some((list, format)));
            let seen = draw_topology(LineStrip, Some((indices, format)));
            assert_eq!(first_difference(56, &expected, &seen), None, "{indices:?} of {format:?}");
        }
    }
    // In lists the restart value is an index like any other: 0xffff is a vertex far out of the buffer for a shader that checks.
    let wrong = draw_topology(TriangleStrip, Some((&[0, 1, 2, 3, 4, 5], IndexFormat::Uint16)));
    assert!(first_difference(56, &expected_triangles(&[[0, 1, 2], [1, 2, 3]]), &wrong).is_some(), "two missing triangles went unnoticed");
}

/// Odd triangles of a strip keep the strip's winding, and restarts start over.
#[test]
fn strip_winding_is_alternating() {
    let pipeline = pipeline(plain_program(Ones), |desc| {
        desc.primitive = PrimitiveState {
            topology: PrimitiveTopology::TriangleStrip,
            strip_index_format: Some(IndexFormat::Uint16),
            cull_mode: Some(Face::Back),
            front_face: FrontFace::Cw,
            ..PrimitiveState::default()
        };
        desc.targets = vec![additive(TextureFormat::R32Float)];
    });
    let vertices = Vertices::new(&PLACES.map(|p| vertex(clip_from_px(TOPOLOGY_SIZE, p, 0.5), [0.0; 4])));
    let entries = vertices.entries();
    // 0 1 2 is clockwise on the screen, 1 2 3 as given is not.
    for (indices, list) in [
        (vec![0u16, 1, 2, 3, 4, 5], vec![[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]]),
        (vec![0, 1, 2, 0xffff, 1, 2, 3, 4], vec![[0, 1, 2]]),
        (vec![0, 1, 0xffff, 2, 3, 4], vec![[2, 3, 4]]),
    ] {
        let buffer = Buffer::from_slice(&indices);
        let index = Some(IndexBuffer { buffer: &buffer, format: IndexFormat::Uint16, offset: 0 });
        let mut canvas = Canvas::single(TOPOLOGY_SIZE, TextureFormat::R32Float);
        canvas.run(vec![Draw { index, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..indices.len() as u32, TOPOLOGY_SIZE) }]);
        assert_eq!(first_difference(56, &expected_triangles(&list), &canvas.channel(0, 0)), None, "{indices:?}");
    }
}

/// Vertex and instance index as varyings; positions spread over a 6x6 grid.
struct Indices;

impl VertexShader for Indices {
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let zero = L::splat(input.token, 0.0);
        output.position = v4(zero, zero, zero, zero + 1.0);
        output.varyings[0] = input.per_vertex(|i| i as f32);
        output.varyings[1] = L::splat(input.token, input.instance_index as f32);
    }
}

#[test]
fn draw_arguments() {
    let program = Program {
        fragment: None,
        varyings: vec![Varying { name: "indices", components: 2, interpolation: Interpolation::Flat }],
        ..Program::new("indices", Indices, Ones)
    };
    let pipeline = pipeline(program, |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
        desc.rasterizer_discard = true;
    });
    let index_values: Vec<u32> = (0..40).map(|i| (i * 7) % 40).collect();
    let index32 = Buffer::from_slice(&index_values);
    let index16 = Buffer::from_slice(&index_values.iter().map(|i| *i as u16).collect::<Vec<_>>());
    for first in [0u32, 3] {
        for count in [0u32, 3, 6, 20] {
            for first_instance in [0u32, 2] {
                for instance_count in [0u32, 1, 4] {
                    for base_vertex in [0i32, 9, -2] {
                        for indexed in [None, Some(IndexFormat::Uint16), Some(IndexFormat::Uint32)] {
                            for offset_indices in [0usize, 3] {
                                let mut expected = Vec::new();
                                for instance in first_instance..first_instance + instance_count {
                                    for element in first..first + count {
                                        let vertex = match indexed {
                                            None => i64::from(element),
                                            Some(_) => i64::from(index_values[element as usize + offset_indices]) + i64::from(base_vertex),
                                        };
                                        expected.push((vertex as u32 as f32, instance as f32));
                                    }
                                }
                                let index = indexed.map(|format| {
                                    let buffer = if format == IndexFormat::Uint16 { &index16 } else { &index32 };
                                    IndexBuffer { buffer, format, offset: offset_indices * format.byte_size() as usize }
                                });
                                let mut canvas = Canvas::new((1, 1), &[], None);
                                canvas.stream_out = vec![StreamOutTarget { capacity: 10_000, ..StreamOutTarget::default() }];
                                let draw = Draw {
                                    index,
                                    base_vertex,
                                    instances: first_instance..first_instance + instance_count,
                                    stream_out: Some(0),
                                    ..Draw::new(&pipeline, Bindings::new(&[], 0), first..first + count, (1, 1))
                                };
                                canvas.run(vec![draw]);
                                let seen: Vec<(f32, f32)> = canvas.stream_out[0].data.chunks_exact(6).map(|v| (v[4], v[5])).collect();
                                assert_eq!(seen, expected, "first {first}, count {count}, base {base_vertex}, {indexed:?}");
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Passes every attribute on as four varyings.
struct Attributes {
    count: usize,
}

impl VertexShader for Attributes {
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let zero = L::splat(input.token, 0.0);
        output.position = v4(zero, zero, zero, zero + 1.0);
        for location in 0..self.count {
            let a = input.attribute(location);
            for (c, value) in [a.x, a.y, a.z, a.w].into_iter().enumerate() {
                output.varyings[location * 4 + c] = value;
            }
        }
    }
}

/// Streams the attributes of a draw out: per vertex, four bit patterns per location.
fn fetch(layouts: Vec<VertexBufferLayout>, buffers: &[(&Buffer, usize)], locations: usize, edit: impl Fn(&mut Draw<'_>)) -> Vec<Vec<u32>> {
    let program = Program {
        fragment: None,
        varyings: (0..locations).map(|_| Varying { name: "a", components: 4, interpolation: Interpolation::Flat }).collect(),
        ..Program::new("attributes", Attributes { count: locations }, Ones)
    };
    let pipeline = pipeline(program, |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
        desc.rasterizer_discard = true;
        desc.vertex_buffers = layouts;
    });
    let mut seen = Vec::new();
    for device in [device(), scalar_device()] {
        let bound: Vec<VertexBuffer<'_>> = buffers.iter().map(|&(buffer, offset)| VertexBuffer { buffer, offset }).collect();
        let mut canvas = Canvas::new((1, 1), &[], None);
        canvas.stream_out = vec![StreamOutTarget { capacity: 1 << 20, ..StreamOutTarget::default() }];
        let mut draw = Draw { vertex_buffers: &bound, stream_out: Some(0), ..Draw::new(&pipeline, Bindings::new(&[], 0), 0..1, (1, 1)) };
        edit(&mut draw);
        canvas.run_on(device, vec![draw], None);
        let rows: Vec<Vec<u32>> =
            canvas.stream_out[0].data.chunks_exact(4 + 4 * locations).map(|v| v[4..].iter().map(|x| x.to_bits()).collect()).collect();
        seen.push(rows);
    }
    assert_eq!(seen[0], seen[1], "both widths fetch alike");
    seen.swap_remove(0)
}

fn layout(stride: u64, step_mode: VertexStepMode, attributes: &[(VertexFormat, u64, u32)]) -> VertexBufferLayout {
    let attributes = attributes.iter().map(|&(format, offset, shader_location)| VertexAttribute { format, offset, shader_location });
    VertexBufferLayout { array_stride: stride, step_mode, attributes: attributes.collect() }
}

#[test]
fn vertex_formats() {
    use VertexFormat::*;
    let f = |v: [f32; 4]| v.map(f32::to_bits);
    let u = |v: [u32; 4]| v;
    let i = |v: [i32; 4]| v.map(|x| x as u32);
    // Bytes of the buffer, little endian: 80 ff 7f 01, 00 40 cd bc, then 32-bit patterns.
    let bytes: [u8; 32] = [
        0x80, 0xff, 0x7f, 0x01, 0x00, 0x40, 0xcd, 0xbc, 0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x20, 0xc1, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 0, 0,
        0, 0, 0, 0, 0x04, 0xc0,
    ];
    let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let u32_at = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let half = |at: usize| f16_to_f32(u16_at(at));
    let un8 = |b: u8| f32::from(b) / 255.0;
    let sn8 = |b: u8| (f32::from(b as i8) / 127.0).max(-1.0);
    let un16 = |at: usize| f32::from(u16_at(at)) / 65535.0;
    let sn16 = |at: usize| (f32::from(u16_at(at) as i16) / 32767.0).max(-1.0);
    let ten = u32_at(0);
    let table: Vec<(VertexFormat, u64, [u32; 4])> = vec![
        (Uint8, 0, u([0x80, 0, 0, 1])),
        (Uint8x2, 0, u([0x80, 0xff, 0, 1])),
        (Uint8x4, 0, u([0x80, 0xff, 0x7f, 1])),
        (Sint8, 0, i([-128, 0, 0, 1])),
        (Sint8x2, 0, i([-128, -1, 0, 1])),
        (Sint8x4, 0, i([-128, -1, 127, 1])),
        (Unorm8, 0, f([un8(0x80), 0.0, 0.0, 1.0])),
        (Unorm8x2, 0, f([un8(0x80), 1.0, 0.0, 1.0])),
        (Unorm8x4, 0, f([un8(0x80), 1.0, un8(0x7f), un8(1)])),
        (Snorm8, 0, f([-1.0, 0.0, 0.0, 1.0])),
        (Snorm8x2, 0, f([-1.0, sn8(0xff), 0.0, 1.0])),
        (Snorm8x4, 0, f([-1.0, sn8(0xff), 1.0, sn8(1)])),
        (Uint16, 0, u([0xff80, 0, 0, 1])),
        (Uint16x2, 0, u([0xff80, 0x017f, 0, 1])),
        (Uint16x4, 0, u([0xff80, 0x017f, 0x4000, 0xbccd])),
        (Sint16, 0, i([-128, 0, 0, 1])),
        (Sint16x2, 0, i([-128, 0x17f, 0, 1])),
        (Sint16x4, 0, i([-128, 0x17f, 0x4000, 0xbccd - 0x10000])),
        (Unorm16, 0, f([un16(0), 0.0, 0.0, 1.0])),
        (Unorm16x2, 0, f([un16(0), un16(2), 0.0, 1.0])),
        (Unorm16x4, 0, f([un16(0), un16(2), un16(4), un16(6)])),
        (Snorm16, 0, f([sn16(0), 0.0, 0.0, 1.0])),
        (Snorm16x2, 0, f([sn16(0), sn16(2), 0.0, 1.0])),
        (Snorm16x4, 0, f([sn16(0), sn16(2), sn16(4), sn16(6)])),
        // 0x4000 is 2, 0xbccd is −1.2001953125.
        (Float16, 4, f([2.0, 0.0, 0.0, 1.0])),
        (Float16x2, 4, f([2.0, -1.200_195_3, 0.0, 1.0])),
        (Float16x4, 4, f([2.0, -1.200_195_3, half(8), half(10)])),
        (Float32, 8, f([1.0, 0.0, 0.0, 1.0])),
        (Float32x2, 8, f([1.0, -10.0, 0.0, 1.0])),
        (Float32x3, 8, f([1.0, -10.0, 0.0, 1.0])),
        (Float32x4, 8, f([1.0, -10.0, 0.0, 1.875])),
        (Uint32, 8, u([0x3f80_0000, 0, 0, 1])),
        (Uint32x2, 8, u([0x3f80_0000, 0xc120_0000, 0, 1])),
        (Uint32x3, 8, u([0x3f80_0000, 0xc120_0000, 0, 1])),
        (Uint32x4, 8, u([0x3f80_0000, 0xc120_0000, 0, 0x3ff0_0000])),
        (Sint32, 8, u([0x3f80_0000, 0, 0, 1])),
        (Sint32x2, 8, u([0x3f80_0000, 0xc120_0000, 0, 1])),
        (Sint32x3, 8, u([0x3f80_0000, 0xc120_0000, 0, 1])),
        (Sint32x4, 8, u([0x3f80_0000, 0xc120_0000, 0, 0x3ff0_0000])),
        (Float64, 16, f([1.0, 0.0, 0.0, 1.0])),
        (Float64x2, 16, f([1.0, -2.5, 0.0, 1.0])),
        (
            Unorm10_10_10_2,
            0,
            f([0, 10, 20]
                .map(|s: u32| (ten >> s & 1023) as f32 / 1023.0)
                .into_iter()
                .chain([(ten >> 30) as f32 / 3.0])
                .collect::<Vec<_>>()
                .try_into()
                .unwrap_or([0.0; 4])),
        ),
        (Unorm8x4Bgra, 0, f([un8(0x7f), 1.0, un8(0x80), un8(1)])),
    ];
    let buffer = Buffer::from_slice(&bytes);
    for (format, offset, expected) in table {
        let seen = fetch(vec![layout(0, VertexStepMode::Vertex, &[(format, offset, 0)])], &[(&buffer, 0)], 1, |_| ());
        assert_eq!(seen, [expected.to_vec()], "{format:?}: got {:?}", seen[0].iter().map(|b| f32::from_bits(*b)).collect::<Vec<_>>());
    }
}

#[test]
fn vertex_attributes_strides_steps_and_offsets() {
    use VertexFormat::{Float32, Uint32};
    // 40 vertices of 12 bytes in one buffer, 5 instances of 8 bytes in the other.
    let per_vertex: Vec<u32> = (0..120).collect();
    let per_instance: Vec<u32> = (0..10).map(|i| 1000 + i).collect();
    let (a, b) = (Buffer::from_slice(&per_vertex), Buffer::from_slice(&per_instance));
    let layouts = || {
        vec![layout(12, VertexStepMode::Vertex, &[(Uint32, 4, 2), (Float32, 8, 0)]), layout(8, VertexStepMode::Instance, &[(Uint32, 0, 1)])]
    };
    let seen = fetch(layouts(), &[(&a, 12), (&b, 8)], 3, |draw| {
        draw.vertices = 2..39;
        draw.instances = 1..4;
    });
    let mut expected = Vec::new();
    for instance in 1..4u32 {
        for vertex in 2..39u32 {
            let word = |offset: u32| (12 + vertex * 12 + offset) / 4;
            expected.push([word(8), 1000 + (8 + instance * 8) / 4, word(4)]);
        }
    }
    let firsts: Vec<[u32; 3]> = seen.iter().map(|row| [row[0], row[4], row[8]]).collect();
    assert_eq!(firsts, expected);
    // Beyond the buffer an indexed draw reads zeros.
    let indices = Buffer::from_slice(&[38u32, 39, 40, u32::MAX - 1]);
    let seen = fetch(vec![layout(12, VertexStepMode::Vertex, &[(Uint32, 4, 0)])], &[(&a, 0)], 1, |draw| {
        // The buffer outlives the draw: it is leaked by the test's scope.
        draw.vertices = 0..4;
        draw.index = Some(IndexBuffer { buffer: Box::leak(Box::new(indices.clone())), format: IndexFormat::Uint32, offset: 0 });
    });
    assert_eq!(seen, [[115, 0, 0, 1], [118, 0, 0, 1], [0; 4], [0; 4]]);
}

/// A colour of its own for every target.
struct ManyTargets;

impl FragmentShader for ManyTargets {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        for (i, color) in output.color.iter_mut().enumerate() {
            let v = |c: usize| L::splat(input.token, (i * 4 + c + 1) as f32 / 64.0);
            *color = v4(v(0), v(1), v(2), v(3));
        }
    }
}

#[test]
fn targets_many_sparse_and_of_all_formats() {
    use TextureFormat::*;
    let formats = [R32Float, Rg32Float, Rgba32Float, Rgba16Float, R16Float, Rg16Float, Rgba8Unorm, Rg8Unorm];
    for holes in 0u32..256 {
        let targets: Vec<Option<TextureFormat>> =
            (0..8).map(|i| if holes >> i & 1 == 0 { Some(formats[(i + holes as usize) % 8]) } else { None }).collect();
        if targets.iter().all(Option::is_none) {
            continue;
        }
        let pipeline = pipeline(plain_program(ManyTargets), |desc| {
            desc.targets = targets.iter().map(|t| t.and_then(target)).collect();
        });
        let mut canvas = Canvas::new((5, 5), &targets, None);
        let triangle = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4]));
        draw(&mut canvas, &pipeline, &triangle);
        for (i, format) in targets.iter().enumerate() {
            let Some(format) = format else { continue };
            let channels = nephroid_pipeline::format_info(*format).expect("supported").channels;
            for (c, value) in canvas.pixel(i, 4, 4)[..channels].iter().enumerate() {
                let expected = (i * 4 + c + 1) as f32 / 64.0;
                let tolerance = if matches!(format, Rgba8Unorm | Rg8Unorm) { 0.51 / 255.0 } else { 0.0 };
                assert!((value - expected).abs() <= tolerance, "target {i} of {format:?}, channel {c}: {value}, expected {expected}");
            }
        }
    }
}

#[test]
fn integer_targets_keep_every_bit() {
    /// Writes the pixel's number plus a bit pattern.
    struct Ids;
    impl FragmentShader for Ids {
        fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
            let x = input.position.x - 0.5;
            let id = x.map(|x| f32::from_bits(PATTERNS[x as usize % PATTERNS.len()]));
            output.color[0] = v4(id, id, id, id);
        }
    }
    // Denormals, infinities and both kinds of not-a-number among them.
    const PATTERNS: [u32; 8] = [0, 1, 0x007f_ffff, 0x7f80_0000, 0x7f80_0001, 0xffc0_0000, 0xffff_ffff, 0x8000_0000];
    let pipeline = pipeline(plain_program(Ids), |desc| desc.targets = vec![target(TextureFormat::R32Uint)]);
    let triangle = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4]));
    for device in [device(), scalar_device()] {
        let mut canvas = Canvas::single((8, 2), TextureFormat::R32Uint);
        canvas.clear = [4_000_000_000.0, 0.0, 0.0, 0.0];
        draw_on(device, &mut canvas, &pipeline, &triangle);
        let bytes = canvas.bytes();
        let seen: Vec<u32> = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        assert_eq!(seen, [PATTERNS, PATTERNS].concat());
        canvas.run_on(device, Vec::new(), None);
        assert!(canvas.bytes().chunks_exact(4).all(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) == 4_000_000_000), "cleared");
    }
}

#[test]
fn clear_and_load() {
    use TextureFormat::*;
    let clear = [0.25, 0.5, 0.75, 1.0];
    for format in [R8Unorm, Rg8Unorm, Rgba8Unorm, Rgba8UnormSrgb, R16Float, Rg16Float, Rgba16Float, R32Float, Rg32Float, Rgba32Float] {
        let mut canvas = Canvas::single((70, 3), format);
        canvas.clear = clear;
        canvas.run(Vec::new());
        let channels = nephroid_pipeline::format_info(format).expect("supported").channels;
        let seen = canvas.pixel(0, 69, 2);
        for c in 0..channels {
            assert!((f64::from(seen[c]) - clear[c]).abs() < 0.005, "{format:?}: {seen:?}");
        }
        // Values outside of the format's range.
        canvas.clear = [-1.0, 2.0, f64::from(f32::MAX), -0.5];
        canvas.run(Vec::new());
        if matches!(format, R8Unorm | Rg8Unorm | Rgba8Unorm | Rgba8UnormSrgb) {
            assert_eq!(canvas.pixel(0, 0, 0)[..channels], [0.0, 1.0, 1.0, 0.0][..channels], "{format:?}");
        }
        let before = canvas.bytes();
        canvas.load = true;
        canvas.run(Vec::new());
        assert_eq!(canvas.bytes(), before, "{format:?}: loaded and stored again");
    }
    for (format, tolerance) in [(Depth16Unorm, 1.0e-5), (Depth24Plus, 1.0e-7), (Depth32Float, 0.0)] {
        for depth in [0.0, 0.3, 1.0] {
            let mut canvas = Canvas::new((70, 3), &[], Some(format));
            canvas.clear_depth = depth;
            canvas.run(Vec::new());
            assert!((canvas.depths()[209] - depth).abs() <= tolerance, "{format:?}");
        }
    }
}

#[test]
fn scissor_and_viewport_bound_what_is_drawn() {
    let size = (150, 90);
    let lines = pipeline(plain_program(Ones), |desc| {
        desc.targets = vec![additive(TextureFormat::R32Float)];
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::LineStrip, ..PrimitiveState::default() };
        desc.line_width = 3.0;
    });
    // Far beyond the viewport on all sides, but not beyond the guard band.
    let vertices = Vertices::new(&[[-5.0, -5.0], [15.0, -5.0], [-5.0, 15.0]].map(|[x, y]: [f32; 2]| vertex([x, y, 0.5, 1.0], [0.0; 4])));
    let entries = vertices.entries();
    let mut rng = Rng(501);
    for _ in 0..60 {
        let rect = |rng: &mut Rng| {
            let (x0, y0) = (rng.int(0..150) as u32, rng.int(0..90) as u32);
            PixelRect { x0, y0, x1: rng.int(i64::from(x0)..151) as u32, y1: rng.int(i64::from(y0)..91) as u32 }
        };
        let (scissor, view) = (rect(&mut rng), rect(&mut rng));
        let viewport = Viewport {
            x: view.x0 as f32,
            y: view.y0 as f32,
            width: (view.x1 - view.x0) as f32,
            height: (view.y1 - view.y0) as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        for rules in [RasterRules::REFERENCE, RasterRules::LAVAPIPE] {
            let pipeline = pipeline_with(plain_program(Ones), rules, |desc| desc.targets = vec![additive(TextureFormat::R32Float)]);
            let mut canvas = Canvas::single(size, TextureFormat::R32Float);
            canvas.run(vec![Draw { scissor, viewport, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, size) }]);
            let seen = canvas.channel(0, 0);
            let inside = |r: PixelRect, x: u32, y: u32| x >= r.x0 && x < r.x1 && y >= r.y0 && y < r.y1;
            let expected: Vec<f32> = (0..size.0 * size.1)
                .map(|at| {
                    let (x, y) = (at % size.0, at / size.0);
                    if inside(scissor, x, y) && inside(view, x, y) { 1.0 } else { 0.0 }
                })
                .collect();
            assert_eq!(first_difference(size.0, &expected, &seen), None, "scissor {scissor:?}, viewport {view:?}, {rules:?}");
        }
        // Lines of a mesh that leaves the viewport stay inside as well.
        let mut canvas = Canvas::single(size, TextureFormat::R32Float);
        canvas.run(vec![Draw { scissor, viewport, ..Draw::new(&lines, Bindings::new(&entries, 0), 0..3, size) }]);
        for (at, value) in canvas.channel(0, 0).iter().enumerate() {
            let (x, y) = (at as u32 % size.0, at as u32 / size.0);
            let inside = |r: PixelRect| x >= r.x0 && x < r.x1 && y >= r.y0 && y < r.y1;
            assert!(*value == 0.0 || (inside(scissor) && inside(view)), "a line left scissor or viewport at ({x}, {y})");
        }
    }
}
