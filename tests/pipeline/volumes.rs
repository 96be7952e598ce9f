//! Closed volumes in the stencil: nothing outside, integer counts inside, also across the borders of view and guard band.

use nephroid_pipeline::state::{
    CompareFunction, DepthBiasState, DepthStencilState, RasterRules, StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid_pipeline::{Device, PassOutput};

use super::passes::*;
use super::reference::{Fill, Fx, for_each_pixel, snap};

/// An icosahedron's faces, each cut into `4^levels`, corners on the unit sphere; outward is counter-clockwise.
pub fn icosphere(levels: u32) -> Vec<[glam::DVec3; 3]> {
    let g = (1.0 + 5.0f64.sqrt()) / 2.0;
    let corners: Vec<glam::DVec3> = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .into_iter()
    .map(|c| glam::DVec3::from(c).normalize())
    .collect();
    // The faces are the triples of corners that are all neighbours.
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let near = |i: usize, j: usize| corners[i].distance(corners[j]) < 1.1;
                if near(a, b) && near(b, c) && near(c, a) {
                    let (p, q, r) = (corners[a], corners[b], corners[c]);
                    let outward = (q - p).cross(r - p).dot(p) > 0.0;
                    faces.push(if outward { [p, q, r] } else { [p, r, q] });
                }
            }
        }
    }
    for _ in 0..levels {
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    faces
}

/// A torus of `around` by `across` quads, radii 1 and 0.4; outward is counter-clockwise.
pub fn torus(around: usize, across: usize) -> Vec<[glam::DVec3; 3]> {
    let point = |i: usize, j: usize| {
        let turn = |k: usize, n: usize| (k % n) as f64 / n as f64 * std::f64::consts::TAU;
        let (a, b) = (turn(i, around), turn(j, across));
        let r = 1.0 + 0.4 * libm::cos(b);
        glam::DVec3::new(r * libm::cos(a), r * libm::sin(a), 0.4 * libm::sin(b))
    };
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let [p, q, r, s] = [point(i, j), point(i + 1, j), point(i, j + 1), point(i + 1, j + 1)];
            triangles.extend([[p, q, r], [q, s, r]]);
        }
    }
    triangles
}

/// A volume's triangles in clip space.
type Volume = Vec<[[f32; 4]; 3]>;

fn place(shape: &[[glam::DVec3; 3]], scale: f64, turn: glam::DQuat, at: glam::DVec3, project: impl Fn(glam::DVec3) -> [f32; 4]) -> Volume {
    shape.iter().map(|t| t.map(|p| project(turn * p * scale + at))).collect()
}

fn random_turn(rng: &mut Rng) -> glam::DQuat {
    let q = [0; 4].map(|_| rng.real(-1.0, 1.0));
    glam::DQuat::from_array(q).normalize()
}

/// Pinhole at the origin, looking along −z, near 0.1, far 100.
fn perspective(p: glam::DVec3) -> [f32; 4] {
    let (near, far) = (0.1, 100.0);
    [p.x * 1.5, p.y * 1.5, far / (near - far) * p.z + far * near / (near - far), -p.z].map(|c| c as f32)
}

fn face(operation: StencilOperation) -> StencilFaceState {
    StencilFaceState {
        compare: CompareFunction::Always,
        fail_op: StencilOperation::Keep,
        depth_fail_op: StencilOperation::Keep,
        pass_op: operation,
    }
}

fn stencil_state(format: TextureFormat, front: StencilOperation, back: StencilOperation, compare: CompareFunction) -> DepthStencilState {
    DepthStencilState {
        format,
        depth_write_enabled: Some(false),
        depth_compare: Some(compare),
        stencil: StencilState { front: face(front), back: face(back), read_mask: 0xff, write_mask: 0xff },
        bias: DepthBiasState::default(),
    }
}

struct Count {
    format: TextureFormat,
    front: StencilOperation,
    back: StencilOperation,
    compare: CompareFunction,
    clear_depth: f32,
    rules: RasterRules,
}

impl Count {
    fn of(front: StencilOperation, back: StencilOperation) -> Self {
        Self {
            format: TextureFormat::Depth32FloatStencil8,
            front,
            back,
            compare: CompareFunction::Always,
            clear_depth: 1.0,
            rules: RasterRules::REFERENCE,
        }
    }

    fn render(&self, device: &Device, size: (u32, u32), volumes: &[Volume]) -> (Vec<u8>, PassOutput) {
        let pipeline = pipeline_with(depth_only_program(), self.rules, |desc| {
            desc.depth_stencil = Some(stencil_state(self.format, self.front, self.back, self.compare));
        });
        let mut canvas = Canvas::new(size, &[], Some(self.format));
        canvas.clear_depth = self.clear_depth;
        let vertices: Vec<Vertex> = volumes.iter().flatten().flatten().map(|&p| vertex(p, [0.0; 4])).collect();
        let output = draw_on(device, &mut canvas, &pipeline, &vertices);
        (canvas.stencils(), output)
    }
}

const WRAP: (StencilOperation, StencilOperation) = (StencilOperation::IncrementWrap, StencilOperation::DecrementWrap);

fn assert_all_zero(stencil: &[u8], size: (u32, u32), what: &str) {
    if let Some((x, y, _, s)) = first_difference(size.0, &vec![0; stencil.len()], stencil) {
        panic!("{what}: stencil {s} at pixel ({x}, {y}), closed volumes must leave 0");
    }
}

/// Random closed shapes; `scale` and `spread` decide how many cross the borders of the view.
fn random_volumes(rng: &mut Rng, count: usize, depth: (f64, f64), scale: (f64, f64), spread: f64) -> Vec<Volume> {
    let shapes = [icosphere(1), icosphere(2), icosphere(3), torus(24, 10)];
    (0..count)
        .map(|_| {
            let scale = rng.real(scale.0, scale.1);
            let z = -rng.real(depth.0 + 1.5 * scale, depth.1);
            let at = glam::DVec3::new(rng.real(-spread, spread) * z, rng.real(-spread, spread) * z, z);
            place(&shapes[rng.int(0..4) as usize], scale, random_turn(rng), at, perspective)
        })
        .collect()
}

#[test]
fn closed_volumes_leave_the_stencil_as_it_was() {
    let mut rng = Rng(101);
    let (mut triangles, mut pixels) = (0, 0);
    let formats = [TextureFormat::Depth32FloatStencil8, TextureFormat::Depth24PlusStencil8, TextureFormat::Stencil8];
    for round in 0..sized(120, 12) {
        let size = [(64, 64), (100, 60), (1024, 768)][if round % 6 == 5 { 2 } else { round % 2 }];
        let volumes = random_volumes(&mut rng, 30, (0.2, 40.0), (0.1, 4.0), 0.9);
        let device = if round % 2 == 0 { device() } else { scalar_device() };
        for rules in [RasterRules::REFERENCE, RasterRules::LAVAPIPE, RasterRules::SWIFTSHADER] {
            let count = Count { format: formats[round % 3], rules, ..Count::of(WRAP.0, WRAP.1) };
            let (stencil, output) = count.render(device, size, &volumes);
            assert!(output.statistics.fragments_passed > 0, "something must have been drawn");
            assert_all_zero(&stencil, size, &format!("round {round}, {rules:?}"));
        }
        triangles += volumes.iter().map(Vec::len).sum::<usize>();
        pixels += (size.0 * size.1) as usize;
    }
    println!("closed volumes: {triangles} triangles, {pixels} pixels");
}

#[test]
fn closed_volumes_beyond_the_guard_band() {
    let mut rng = Rng(102);
    for round in 0..sized(300, 60) {
        let size = [(64, 64), (100, 60)][round % 2];
        let shapes = [icosphere(1), icosphere(2), torus(24, 10)];
        // Orthographic, in pixels: volumes far larger than what coordinates can hold.
        let volumes: Vec<Volume> = (0..10)
            .map(|_| {
                let scale = libm::exp(rng.real(3.0, 20.0));
                let at = glam::DVec3::new(rng.real(-1.0, 1.0), rng.real(-1.0, 1.0), 0.0) * scale;
                let project = |p: glam::DVec3| {
                    let z = (0.5 + 0.2 * p.z / scale) as f32;
                    clip_from_px(size, [p.x, p.y], z)
                };
                place(&shapes[round % 3], scale, random_turn(&mut rng), at, project)
            })
            .collect();
        let (stencil, _) = Count::of(WRAP.0, WRAP.1).render(device(), size, &volumes);
        assert_all_zero(&stencil, size, &format!("round {round}"));
    }
}

/// Layers counted by the brute-force rasterizer: front facing, back facing.
fn layers(size: (u32, u32), volumes: &[Volume]) -> (Vec<u32>, Vec<u32>) {
    let mut front = vec![0; (size.0 * size.1) as usize];
    let mut back = front.clone();
    for triangle in volumes.iter().flatten() {
        let [a, b, c]: [Fx; 3] = triangle.map(|p| snap(size, p));
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        // y points down, so counter-clockwise is negative.
        let image = if area < 0 { &mut front } else { &mut back };
        for_each_pixel([a, b, c], size, Fill::TopLeft, |x, y| image[y * size.0 as usize + x] += 1);
    }
    (front, back)
}

#[test]
fn stencil_counts_equal_integer_counts() {
    use StencilOperation::*;
    let mut rng = Rng(103);
    let mut deepest = 0;
    for round in 0..sized(8, 3) {
        let size = [(64, 64), (100, 60)][round % 2];
        // Near the axis and large: up to several hundred layers.
        let volumes = random_volumes(&mut rng, 500, (8.0, 30.0), (1.0, 3.0), 0.06);
        let (front, back) = layers(size, &volumes);
        deepest = deepest.max(*front.iter().max().unwrap_or(&0));
        type Expect = fn(u32, u32) -> u8;
        let table: [(StencilOperation, StencilOperation, Expect); 6] = [
            (IncrementWrap, DecrementWrap, |f, b| f.wrapping_sub(b) as u8),
            (IncrementWrap, Keep, |f, _| f as u8),
            (Keep, IncrementWrap, |_, b| b as u8),
            (IncrementWrap, IncrementWrap, |f, b| (f + b) as u8),
            (IncrementClamp, Keep, |f, _| f.min(255) as u8),
            (DecrementWrap, DecrementWrap, |f, b| 0u8.wrapping_sub((f + b) as u8)),
        ];
        for (front_op, back_op, expect) in table {
            let expected: Vec<u8> = front.iter().zip(&back).map(|(f, b)| expect(*f, *b)).collect();
            for device in [device(), scalar_device()] {
                let (seen, _) = Count::of(front_op, back_op).render(device, size, &volumes);
                assert_eq!(first_difference(size.0, &expected, &seen), None, "{front_op:?} in front, {back_op:?} behind, round {round}");
            }
        }
    }
    println!("stencil counts: up to {deepest} layers");
    assert!(deepest > 255, "the counts must wrap past 255, saw {deepest}");
}

/// Depth-passing layers in front of a constant depth count the volumes that contain the point there.
#[test]
fn stencil_count_is_point_in_volume() {
    let mut rng = Rng(104);
    let size = (100, 60);
    let (mut sure, mut inside_any) = (0, 0);
    for round in 0..sized(40, 8) {
        let depth_z = -rng.real(6.0, 20.0);
        let clear_depth = {
            let p = perspective(glam::DVec3::new(0.0, 0.0, depth_z));
            p[2] / p[3]
        };
        // Convex volumes in world space, so that inside is a list of half-spaces.
        let shape = icosphere(1);
        let worlds: Vec<Vec<[glam::DVec3; 3]>> = (0..12)
            .map(|_| {
                let scale = rng.real(0.5, 4.0);
                let z = depth_z + rng.real(-4.0, 4.0);
                let z = z.min(-0.3 - 1.1 * scale);
                let at = glam::DVec3::new(rng.real(-0.8, 0.8) * z, rng.real(-0.5, 0.5) * z, z);
                let turn = random_turn(&mut rng);
                shape.iter().map(|t| t.map(|p| turn * p * scale + at)).collect()
            })
            .collect();
        let volumes: Vec<Volume> = worlds.iter().map(|w| w.iter().map(|t| t.map(perspective)).collect()).collect();
        // Both ways of counting: the layers in front of the surface, and those behind it.
        let z_pass = Count { compare: CompareFunction::Less, clear_depth, ..Count::of(WRAP.0, WRAP.1) };
        let z_fail = Count { compare: CompareFunction::GreaterEqual, clear_depth, ..Count::of(WRAP.1, WRAP.0) };
        let seen = z_pass.render(device(), size, &volumes).0;
        assert_eq!(seen, z_fail.render(device(), size, &volumes).0, "counting in front and behind must agree, round {round}");
        for (at, &count) in seen.iter().enumerate() {
            let (x, y) = (at as u32 % size.0, at as u32 / size.0);
            let ndc = [(f64::from(x) + 0.5) / 50.0 - 1.0, 1.0 - (f64::from(y) + 0.5) / 30.0];
            let point = glam::DVec3::new(ndc[0] / 1.5, ndc[1] / 1.5, -1.0) * -depth_z;
            // Greatest signed distance to a volume's faces: negative inside.
            let distance = |world: &Vec<[glam::DVec3; 3]>| {
                let face = |t: &[glam::DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).normalize().dot(point - t[0]);
                world.iter().map(face).fold(f64::NEG_INFINITY, f64::max)
            };
            let distances: Vec<f64> = worlds.iter().map(distance).collect();
            // A vertex moves by half a sub-pixel, depth by a rounding.
            if distances.iter().any(|d| d.abs() < 0.02) {
                continue;
            }
            let expected = distances.iter().filter(|d| **d < 0.0).count();
            assert_eq!(usize::from(count), expected, "round {round}, pixel ({x}, {y})");
            sure += 1;
            inside_any += usize::from(expected > 0);
        }
    }
    println!("point in volume: {sure} pixels, {inside_any} of them inside something");
    assert!(inside_any * 10 > sure, "too few pixels inside anything");
}

#[test]
fn count_check_notices_swapped_faces() {
    use StencilOperation::*;
    let size = (64, 64);
    let volume = place(&icosphere(2), 1.0, glam::DQuat::IDENTITY, glam::DVec3::new(0.0, 0.0, -3.0), perspective);
    // A third of the faces, so that the layers in front and behind differ.
    let half: Volume = volume.into_iter().enumerate().filter(|(i, _)| i % 3 == 0).map(|(_, t)| t).collect();
    let (front, _) = layers(size, std::slice::from_ref(&half));
    let expected: Vec<u8> = front.iter().map(|f| *f as u8).collect();
    let right = Count::of(IncrementWrap, Keep).render(device(), size, std::slice::from_ref(&half)).0;
    let swapped = Count::of(Keep, IncrementWrap).render(device(), size, &[half]).0;
    assert_eq!(first_difference(size.0, &expected, &right), None);
    assert!(first_difference(size.0, &expected, &swapped).is_some(), "swapped stencil faces went unnoticed");
}

#[test]
#[should_panic(expected = "closed volumes must leave 0")]
fn zero_check_notices_an_open_volume() {
    let mut volume = place(&icosphere(2), 1.0, glam::DQuat::IDENTITY, glam::DVec3::new(0.0, 0.0, -3.0), perspective);
    volume.remove(100);
    assert_all_zero(&Count::of(WRAP.0, WRAP.1).render(device(), (64, 64), &[volume]).0, (64, 64), "one face short");
}
