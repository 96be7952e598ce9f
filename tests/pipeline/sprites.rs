//! Points and lines: squares around the snapped centre, rectangles around the segment, both by the triangle's fill rule.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{LineCorners, PrimitiveState, PrimitiveTopology, RasterRules, TextureFormat, Viewport};
use nephroid_pipeline::{Bindings, Device, Draw};

use super::passes::*;
use super::reference::{Fill, Fx, for_each_pixel, snap, window};

/// [`Pull`] whose fourth number is the point's size.
pub struct SizedPull;

impl VertexShader for SizedPull {
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        Pull { scalars: 4 }.vertex(bindings, input, output);
        output.point_size = output.varyings[3];
    }
}

/// One, and the place in the sprite.
struct Coordinates;

impl FragmentShader for Coordinates {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let place = input.point_coord();
        let front = L::splat(input.token, if input.front_facing { 1.0 } else { 0.0 });
        output.color[0] = v4(L::splat(input.token, 1.0), place.x, place.y, front);
    }
}

fn points(device: &Device, size: (u32, u32), rules: RasterRules, vertices: &[Vertex], viewport: Viewport) -> Canvas {
    let program = Program { vertex: std::sync::Arc::new(SizedPull), ..pull_program(Coordinates, Interpolation::Flat) };
    let pipeline = pipeline_with(program, rules, |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() };
        desc.targets = vec![additive(TextureFormat::Rgba32Float)];
    });
    let vertices = Vertices::new(vertices);
    let entries = vertices.entries();
    let mut canvas = Canvas::single(size, TextureFormat::Rgba32Float);
    let draw = Draw { viewport, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, size) };
    canvas.run_on(device, vec![draw], None);
    canvas
}

#[test]
fn points_are_half_open_squares() {
    let size = (100, 60);
    let mut rng = Rng(801);
    let mut pixels = 0u64;
    for round in 0..sized(40, 8) {
        let vertices: Vec<Vertex> = (0..200)
            .map(|_| {
                let step = [1.0 / 4096.0, 0.5, 1.0 / 16.0, 1.0 / 512.0][rng.int(0..4) as usize];
                let p = [rng.real(-3.0, 103.0), rng.real(-3.0, 63.0)].map(|v| (v / step).floor() * step);
                let diameter = [1.0, 1.0, 2.0, 3.5, 0.25, 17.3][rng.int(0..6) as usize];
                vertex(clip_from_px(size, p, 0.5), [0.0, 0.0, 0.0, diameter])
            })
            .collect();
        let mut expected = vec![0.0f32; 6000];
        for v in &vertices {
            let centre = snap(size, [v[0], v[1], v[2], v[3]]);
            let half = (f64::from(v[7]) * 128.0).round_ties_even() as i64;
            for y in 0..60i64 {
                for x in 0..100i64 {
                    let inside = |axis: usize, c: i64| c * 256 + 128 >= centre[axis] - half && c * 256 + 128 < centre[axis] + half;
                    if inside(0, x) && inside(1, y) {
                        expected[(y * 100 + x) as usize] += 1.0;
                        pixels += 1;
                    }
                }
            }
        }
        let device = if round % 2 == 0 { device() } else { scalar_device() };
        let seen = points(device, size, RasterRules::REFERENCE, &vertices, Viewport::full(100, 60)).channel(0, 0);
        assert_eq!(first_difference(100, &expected, &seen), None, "round {round}");
    }
    println!("points: {} points, {pixels} pixels", sized(40, 8) * 200);
}

#[test]
fn points_at_integer_coordinates_go_up_and_left() {
    let size = (8, 8);
    let one = |x: f64, y: f64| {
        let v = vertex(clip_from_px(size, [x, y], 0.5), [0.0, 0.0, 0.0, 1.0]);
        let seen = points(device(), size, RasterRules::REFERENCE, &[v], Viewport::full(8, 8)).channel(0, 0);
        let hits: Vec<usize> = (0..64).filter(|at| seen[*at] != 0.0).collect();
        hits.into_iter().map(|at| (at % 8, at / 8)).collect::<Vec<_>>()
    };
    // The square [v − 1/2, v + 1/2) holds one centre: ceil(v) − 1.
    assert_eq!(one(3.0, 5.0), [(2, 4)]);
    assert_eq!(one(3.5, 5.5), [(3, 5)]);
    assert_eq!(one(3.01, 5.99), [(3, 5)]);
    assert_eq!(one(8.0, 8.0), [(7, 7)]);
    assert_eq!(one(0.0, 4.0), []);
}

#[test]
fn point_coordinates() {
    let size = (40, 40);
    let v = vertex(clip_from_px(size, [20.25, 19.5], 0.5), [0.0, 0.0, 0.0, 10.0]);
    for device in [device(), scalar_device()] {
        let canvas = points(device, size, RasterRules::REFERENCE, &[v], Viewport::full(40, 40));
        let mut count = 0;
        for y in 0..40 {
            for x in 0..40 {
                let [drawn, u, v, front] = canvas.pixel(0, x, y);
                if drawn != 0.0 {
                    count += 1;
                    assert_eq!(front, 1.0, "points face the viewer");
                    let expected = [(f64::from(x) + 0.5 - 15.25) / 10.0, (f64::from(y) + 0.5 - 14.5) / 10.0];
                    assert!(
                        (f64::from(u) - expected[0]).abs() < 1.0e-6 && (f64::from(v) - expected[1]).abs() < 1.0e-6,
                        "({x}, {y}): {u}, {v}"
                    );
                }
            }
        }
        assert_eq!(count, 100);
    }
}

#[test]
fn point_sizes_out_of_range_and_depth_limits() {
    let size = (64, 64);
    let count = |diameter: f32, z: f32| {
        let v = vertex(clip_from_px(size, [32.5, 32.5], z), [0.0, 0.0, 0.0, diameter]);
        points(device(), size, RasterRules::REFERENCE, &[v], Viewport::full(64, 64)).channel(0, 0).iter().sum::<f32>()
    };
    assert_eq!(count(5.0, 0.5), 25.0);
    assert_eq!(count(0.0, 0.5), 1.0, "the least size is one sub-pixel unit, around the centre");
    assert_eq!(count(f32::NAN, 0.5), 1.0);
    assert_eq!(count(f32::INFINITY, 0.5), 4096.0, "the greatest size covers all");
    assert_eq!(count(5.0, -0.1), 0.0, "in front of the near plane");
    assert_eq!(count(5.0, 1.1), 0.0, "beyond the far plane");
}

/// The rectangle rule in f64: corners half a width to either side of the ends, then snapped.
fn line_triangles(size: (u32, u32), ends: [[f32; 4]; 2], width: f64, corners: LineCorners) -> Vec<[Fx; 3]> {
    let [p, q] = ends.map(|c| match corners {
        LineCorners::UnsnappedEnds => window(size, c).map(f64::from),
        LineCorners::SnappedEnds => snap(size, c).map(|v| v as f64 / 256.0),
    });
    let d = [q[0] - p[0], q[1] - p[1]];
    let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
    let side = [-d[1] / length * width * 0.5, d[0] / length * width * 0.5];
    let corner = |at: [f64; 2], sign: f64| -> Fx { [0, 1].map(|i: usize| ((at[i] + sign * side[i]) * 256.0).round_ties_even() as i64) };
    let (a, b, c, d) = (corner(p, 1.0), corner(p, -1.0), corner(q, 1.0), corner(q, -1.0));
    vec![[a, b, c], [b, d, c]]
}

fn line_image(size: (u32, u32), rules: RasterRules, width: f32, vertices: &[Vertex]) -> Vec<f32> {
    let pipeline = pipeline_with(plain_program(Ones), rules, |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::LineList, ..PrimitiveState::default() };
        desc.targets = vec![additive(TextureFormat::R32Float)];
        desc.line_width = width;
    });
    let mut canvas = Canvas::single(size, TextureFormat::R32Float);
    draw(&mut canvas, &pipeline, vertices);
    canvas.channel(0, 0)
}

#[test]
fn lines_are_rectangles() {
    let size = (100, 60);
    let mut rng = Rng(802);
    let mut drawn = 0.0f64;
    for corners in [LineCorners::UnsnappedEnds, LineCorners::SnappedEnds] {
        let rules = RasterRules { line_corners: corners, ..RasterRules::REFERENCE };
        for width in [1.0f32, 1.0, 2.5, 8.0] {
            for round in 0..sized(10, 2) {
                let vertices: Vec<Vertex> = (0..400)
                    .map(|_| {
                        let step = [1.0 / 4096.0, 0.5, 1.0 / 16.0][rng.int(0..3) as usize];
                        let p = [rng.real(1.0, 99.0), rng.real(1.0, 59.0)].map(|v| (v / step).floor() * step);
                        vertex(clip_from_px(size, p, 0.5), [0.0; 4])
                    })
                    .collect();
                let mut expected = vec![0.0f32; 6000];
                for pair in vertices.chunks_exact(2) {
                    let ends = [pair[0], pair[1]].map(|v| [v[0], v[1], v[2], v[3]]);
                    for triangle in line_triangles(size, ends, f64::from(width), corners) {
                        for_each_pixel(triangle, size, Fill::TopLeft, |x, y| expected[y * 100 + x] += 1.0);
                    }
                }
                let seen = line_image(size, rules, width, &vertices);
                assert_eq!(first_difference(100, &expected, &seen), None, "{corners:?}, width {width}, round {round}");
                drawn += seen.iter().map(|v| f64::from(*v)).sum::<f64>();
            }
        }
    }
    println!("lines: {drawn} fragments compared");
}

#[test]
fn lines_along_the_axes() {
    let size = (16, 16);
    let line = |p: [f64; 2], q: [f64; 2]| -> Vec<(usize, usize)> {
        let image = line_image(size, RasterRules::REFERENCE, 1.0, &[p, q].map(|p| vertex(clip_from_px(size, p, 0.5), [0.0; 4])));
        (0..256).filter(|at| image[*at] > 0.0).map(|at| (at % 16, at / 16)).collect()
    };
    let row: Vec<_> = (2..10).map(|x| (x, 3)).collect();
    assert_eq!(line([2.5, 3.5], [10.5, 3.5]), row);
    assert_eq!(line([10.5, 3.5], [2.5, 3.5]), row, "direction does not matter");
    let column: Vec<_> = (2..10).map(|y| (3, y)).collect();
    assert_eq!(line([3.5, 2.5], [3.5, 10.5]), column);
    assert_eq!(line([3.5, 2.5], [3.5, 2.5]), [], "no length, no rectangle");
}

/// Colours run along a line; ends clipped by the near plane keep their values.
#[test]
fn lines_interpolate_along() {
    let size = (32, 8);
    let pipeline = pipeline(pull_program(VaryingColor, Interpolation::Perspective), |desc| {
        desc.primitive = PrimitiveState { topology: PrimitiveTopology::LineList, ..PrimitiveState::default() };
        desc.targets = vec![target(TextureFormat::Rgba32Float)];
        desc.line_width = 4.0;
    });
    // From z = −1 outside to z = 1; the near plane is at pixel 16.
    let end = |x: f64, z: f32, value: f32| vertex(clip_from_px(size, [x, 4.0], z), [value, 1.0, value * value, 0.0]);
    let mut canvas = Canvas::single(size, TextureFormat::Rgba32Float);
    draw(&mut canvas, &pipeline, &[end(0.0, -1.0, 0.0), end(32.0, 1.0, 1.0)]);
    for x in 0..32 {
        let [value, one, ..] = canvas.pixel(0, x, 4);
        if x < 16 {
            assert_eq!(one, 0.0, "clipped at column {x}");
        } else {
            assert_eq!(one, 1.0, "column {x}");
            assert!((value - (x as f32 + 0.5) / 32.0).abs() < 1.0e-5, "column {x}: {value}");
        }
    }
}

#[test]
fn line_check_notices_a_wider_line() {
    let size = (100, 60);
    let vertices = [[10.3, 7.7], [80.1, 41.9]].map(|p| vertex(clip_from_px(size, p, 0.5), [0.0; 4]));
    let ends = vertices.map(|v| [v[0], v[1], v[2], v[3]]);
    let mut expected = vec![0.0f32; 6000];
    for triangle in line_triangles(size, ends, 1.2, LineCorners::UnsnappedEnds) {
        for_each_pixel(triangle, size, Fill::TopLeft, |x, y| expected[y * 100 + x] += 1.0);
    }
    let seen = line_image(size, RasterRules::REFERENCE, 1.0, &vertices);
    assert!(first_difference(100, &expected, &seen).is_some(), "a fifth of a pixel went unnoticed");
}
