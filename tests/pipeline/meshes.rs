//! Meshes with shared edges cover every pixel of their union exactly once, whatever their winding, place, clipping and the device.
//!
//! Each mesh is drawn in shuffled order with every triangle's corners rotated and, half of the time, turned over; the target adds one per
//! fragment. 1.2 million triangles in release, 110 thousand in debug.

use nephroid_pipeline::shader::{Interpolation, ShaderWidth};
use nephroid_pipeline::state::{PrimitiveState, TextureFormat};
use nephroid_pipeline::{Device, DeviceOptions};

use super::passes::*;

type Triangle = [[f32; 4]; 3];

/// Every device that the meshes take in turn.
fn devices() -> Vec<Device> {
    let levels = nephroid_math::level::available_levels();
    let mut devices = Vec::new();
    for (i, (_, level)) in levels.iter().enumerate() {
        let width = if i % 2 == 0 { ShaderWidth::Sixteen } else { ShaderWidth::One };
        let bin_budget_bytes = if i % 2 == 0 { 256 << 20 } else { 1 };
        let options = DeviceOptions { threads: Some(1 + i % 2), level: Some(*level), width, bin_budget_bytes };
        devices.push(Device::new(options).expect("threads start"));
    }
    devices
}

/// Two triangles per cell of a `columns` by `rows` grid of vertices, cut along a random diagonal.
fn grid_triangles(rng: &mut Rng, columns: usize, rows: usize, place: &[[f32; 4]]) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let at = |di: usize, dj: usize| place[(j + dj) * columns + i + di];
            let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
            triangles.extend(if rng.chance(2) { [[a, b, c], [b, d, c]] } else { [[a, b, d], [a, d, c]] });
        }
    }
    triangles
}

/// Shuffles the order, rotates corners, turns half of them over.
fn scramble(rng: &mut Rng, triangles: &mut [Triangle]) {
    rng.shuffle(triangles);
    for triangle in triangles {
        triangle.rotate_left(rng.int(0..3) as usize);
        if rng.chance(2) {
            triangle.swap(1, 2);
        }
    }
}

/// A grid over the whole target and a bit more; interior vertices jittered and put on a sub-pixel grid of `step` with an `offset`.
fn jittered_grid(rng: &mut Rng, size: (u32, u32), step: f64, offset: f64) -> Vec<Triangle> {
    let most = (size.0.min(size.1) as i64 / 2).clamp(3, 40);
    let (columns, rows) = (rng.int(2..most) as usize, rng.int(2..most) as usize);
    let margin = [rng.real(1.0, 30.0), rng.real(1.0, 30.0)];
    let cell = [(f64::from(size.0) + 2.0 * margin[0]) / (columns - 1) as f64, (f64::from(size.1) + 2.0 * margin[1]) / (rows - 1) as f64];
    let mut place = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let border = i == 0 || j == 0 || i == columns - 1 || j == rows - 1;
            let jitter = |rng: &mut Rng| if border { 0.0 } else { rng.real(-0.24, 0.24) };
            let p = [(i as f64 + jitter(rng)) * cell[0] - margin[0], (j as f64 + jitter(rng)) * cell[1] - margin[1]];
            // A step wider than a quarter cell could fold the mesh.
            let step = if cell[0].min(cell[1]) < 4.0 * step { 1.0 / 256.0 } else { step };
            let p = p.map(|v| (v / step).floor() * step + offset);
            place.push(clip_from_px(size, p, 0.5));
        }
    }
    grid_triangles(rng, columns, rows, &place)
}

/// A fan around a random point of the target; its rim surrounds the target. Slivers near the centre.
fn fan(rng: &mut Rng, size: (u32, u32), far: f64) -> Vec<Triangle> {
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let step = [1.0 / 256.0, 0.5, 1.0][rng.int(0..3) as usize];
    let centre = [rng.real(0.0, width), rng.real(0.0, height)].map(|v| (v / step).floor() * step);
    let count = rng.int(6..400) as usize;
    let radius = (width + height) * far;
    let rim: Vec<[f32; 4]> = (0..count)
        .map(|k| {
            let angle = (k as f64 + rng.real(-0.3, 0.3)) / count as f64 * std::f64::consts::TAU;
            let p = [centre[0] + radius * libm::cos(angle), centre[1] + radius * libm::sin(angle)];
            clip_from_px(size, p, 0.5)
        })
        .collect();
    let middle = clip_from_px(size, centre, 0.5);
    (0..count).map(|k| [middle, rim[k], rim[(k + 1) % count]]).collect()
}

/// A grid that reaches `reach` pixels to all sides: most triangles cross the guard band.
fn beyond_guard_band(rng: &mut Rng, size: (u32, u32), reach: f64) -> Vec<Triangle> {
    let (columns, rows) = (rng.int(3..9) as usize, rng.int(3..9) as usize);
    let mut place = Vec::new();
    let line = |i: usize, count: usize, size: f64, rng: &mut Rng| match i {
        0 => -reach * rng.real(0.5, 1.0),
        _ if i == count - 1 => reach * rng.real(0.5, 1.0),
        _ => size * (i as f64 - 0.5 + rng.real(-0.2, 0.2)) / (count - 2) as f64,
    };
    for j in 0..rows {
        for i in 0..columns {
            let p = [line(i, columns, f64::from(size.0), rng), line(j, rows, f64::from(size.1), rng)];
            // A mesh stays a mesh if each vertex has a w of its own.
            let w = libm::exp(rng.real(-3.0, 3.0)) as f32;
            place.push(clip_from_px(size, p, 0.5).map(|c| c * w));
        }
    }
    grid_triangles(rng, columns, rows, &place)
}

/// Clip positions of points of a plane seen in perspective: pinhole at the origin looking along −z, near 0.1, far 100.
fn perspective(p: [f64; 3]) -> [f32; 4] {
    let (near, far) = (0.1, 100.0);
    let z = far / (near - far) * p[2] + far * near / (near - far);
    [p[0] * 1.3, p[1] * 1.3, z, -p[2]].map(|c| c as f32)
}

fn render(device: &Device, triangles: &[Triangle], size: (u32, u32), general: bool) -> Vec<f32> {
    let format = TextureFormat::R32Float;
    let program = if general { pull_program(VaryingColor, Interpolation::Linear) } else { plain_program(Ones) };
    let pipeline = pipeline(program, |desc| desc.targets = vec![additive(format)]);
    let vertices: Vec<Vertex> = triangles.iter().flatten().map(|&p| vertex(p, [1.0; 4])).collect();
    let mut canvas = Canvas::single(size, format);
    draw_on(device, &mut canvas, &pipeline, &vertices);
    canvas.channel(0, 0)
}

/// Panics unless every pixel was covered exactly once.
fn assert_once(seen: &[f32], size: (u32, u32), what: &str) {
    let ones = vec![1.0; seen.len()];
    if let Some((x, y, _, s)) = first_difference(size.0, &ones, seen) {
        let count = difference_count(&ones, seen);
        panic!("{what}: pixel ({x}, {y}) was covered {s} times; {count} pixels are wrong");
    }
}

const SIZES: [(u32, u32); 3] = [(64, 64), (100, 60), (1024, 768)];

/// Draws meshes until the wanted number of triangles is reached, mostly on the smaller targets.
fn check_meshes(seed: u64, triangles: usize, mut make: impl FnMut(&mut Rng, (u32, u32)) -> Vec<Triangle>, what: &str) {
    let devices = devices();
    let mut rng = Rng(seed);
    let (mut done, mut meshes, mut pixels) = (0, 0, 0);
    while done < triangles {
        let size = SIZES[if meshes % 24 == 23 { 2 } else { meshes % 2 }];
        let mut mesh = make(&mut rng, size);
        scramble(&mut rng, &mut mesh);
        let seen = render(&devices[meshes % devices.len()], &mesh, size, meshes % 3 == 2);
        assert_once(&seen, size, &format!("{what}, mesh {meshes} of {} triangles at {size:?}", mesh.len()));
        done += mesh.len();
        meshes += 1;
        pixels += seen.len();
    }
    println!("{what}: {meshes} meshes, {done} triangles, {pixels} pixels");
}

#[test]
fn mesh_grids_any_place() {
    let make = |rng: &mut Rng, size| jittered_grid(rng, size, 1.0 / 4096.0, 0.0);
    check_meshes(11, sized(300_000, 20_000), make, "jittered grid");
}

#[test]
fn mesh_grids_on_tie_classes() {
    for (i, (step, offset)) in
        [(0.5, 0.0), (1.0, 0.5), (1.0 / 16.0, 0.0), (1.0 / 256.0, 1.0 / 512.0), (1.0 / 16.0, 1.0 / 32.0)].into_iter().enumerate()
    {
        let make = |rng: &mut Rng, size| jittered_grid(rng, size, step, offset);
        check_meshes(20 + i as u64, sized(80_000, 6_000), make, &format!("grid on 1/{} + {offset}", 1.0 / step));
    }
}

#[test]
fn mesh_fans() {
    check_meshes(31, sized(250_000, 20_000), |rng, size| fan(rng, size, 2.0), "fan");
    check_meshes(32, sized(100_000, 8_000), |rng, size| fan(rng, size, 10.0), "wide fan");
}

#[test]
fn mesh_beyond_guard_band() {
    for (i, reach) in [1.0e5, 1.0e6, 1.0e8].into_iter().enumerate() {
        let make = |rng: &mut Rng, size| beyond_guard_band(rng, size, reach);
        check_meshes(41 + i as u64, sized(60_000, 8_000), make, &format!("grid to {reach} pixels"));
    }
}

/// A `count` by `count` grid of plane coordinates to ± `extent`, denser in the middle, jittered as far as no cell folds over.
fn warped_grid(rng: &mut Rng, count: usize, extent: f64) -> Vec<[f64; 2]> {
    let mut most = 0.2;
    loop {
        let mut points = Vec::new();
        for j in 0..count {
            for i in 0..count {
                let along = |k: usize, rng: &mut Rng| {
                    let jitter = if k == 0 || k == count - 1 { 0.0 } else { rng.real(-most, most) };
                    let t = (k as f64 + jitter) / (count - 1) as f64 * 2.0 - 1.0;
                    t * t * t * extent
                };
                points.push([along(i, rng), along(j, rng)]);
            }
        }
        let turns_left = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
        let whole = (0..count - 1).all(|j| {
            (0..count - 1).all(|i| {
                let at = |di: usize, dj: usize| points[(j + dj) * count + i + di];
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                // Whichever diagonal is cut.
                turns_left(a, b, c) && turns_left(b, d, c) && turns_left(a, b, d) && turns_left(a, d, c)
            })
        });
        if whole {
            return points;
        }
        most *= 0.5;
    }
}

/// A wall through the view, tilted so that part of the mesh is behind the eye and beyond the far plane: pixels whose ray meets the wall well
/// between the planes are covered once, no pixel twice.
#[test]
fn mesh_crossing_near_and_far() {
    let devices = devices();
    let mut rng = Rng(51);
    let wanted = sized(150_000, 15_000);
    let (mut done, mut meshes, mut certain) = (0, 0, 0);
    while done < wanted {
        let size = SIZES[if meshes % 24 == 23 { 2 } else { meshes % 2 }];
        // The plane n·p = d; two directions that span it.
        let normal = glam::DVec3::new(rng.real(-1.0, 1.0), rng.real(-1.0, 1.0), rng.real(-0.6, 0.6)).normalize();
        let distance = rng.real(0.05, 3.0);
        let (u, v) = normal.any_orthonormal_pair();
        let count = rng.int(3..24) as usize;
        let extent = 400.0;
        let points = warped_grid(&mut rng, count, extent);
        let place: Vec<[f32; 4]> = points
            .iter()
            .map(|[a, b]| {
                let p = normal * distance + u * *a + v * *b;
                perspective([p.x, p.y, p.z])
            })
            .collect();
        let mut mesh = grid_triangles(&mut rng, count, count, &place);
        scramble(&mut rng, &mut mesh);
        let seen = render(&devices[meshes % devices.len()], &mesh, size, meshes % 3 == 2);
        for (at, &times) in seen.iter().enumerate() {
            let (x, y) = (at % size.0 as usize, at / size.0 as usize);
            let ray = glam::DVec3::new(
                ((x as f64 + 0.5) / f64::from(size.0) * 2.0 - 1.0) / 1.3,
                (1.0 - (y as f64 + 0.5) / f64::from(size.1) * 2.0) / 1.3,
                -1.0,
            );
            let t = distance / normal.dot(ray);
            assert!(
                times == 0.0 || times == 1.0,
                "mesh {meshes} at {size:?}: pixel ({x}, {y}) was covered {times} times; depth {t}, facing {}",
                normal.dot(ray.normalize())
            );
            if t > 0.12 && t < 80.0 {
                certain += 1;
                assert_eq!(times, 1.0, "mesh {meshes} at {size:?}: a hole at pixel ({x}, {y}), depth {t}");
            } else if !(0.09..101.0).contains(&t) {
                assert_eq!(times, 0.0, "mesh {meshes} at {size:?}: pixel ({x}, {y}) is outside the depth range, {t}");
            }
        }
        done += mesh.len();
        meshes += 1;
    }
    println!("near and far: {meshes} meshes, {done} triangles, {certain} pixels that must be covered once");
}

/// Culling each facing in turn covers the union once between the two.
#[test]
fn mesh_facings_share_the_pixels() {
    use nephroid_pipeline::state::Face;
    let mut rng = Rng(61);
    for round in 0..sized(60, 10) {
        let size = SIZES[round % 2];
        let mut mesh = if round % 3 == 0 { beyond_guard_band(&mut rng, size, 1.0e5) } else { jittered_grid(&mut rng, size, 0.5, 0.0) };
        scramble(&mut rng, &mut mesh);
        let vertices: Vec<Vertex> = mesh.iter().flatten().map(|&p| vertex(p, [1.0; 4])).collect();
        let mut canvas = Canvas::single(size, TextureFormat::R32Float);
        for face in [Face::Front, Face::Back] {
            let pipeline = pipeline(plain_program(Ones), |desc| {
                desc.targets = vec![additive(TextureFormat::R32Float)];
                desc.primitive = PrimitiveState { cull_mode: Some(face), ..PrimitiveState::default() };
            });
            draw(&mut canvas, &pipeline, &vertices);
            canvas.load = true;
        }
        assert_once(&canvas.channel(0, 0), size, &format!("facings, mesh {round}"));
    }
}

#[test]
#[should_panic(expected = "pixel (")]
fn once_notices_a_missing_triangle() {
    let mut mesh = jittered_grid(&mut Rng(71), (64, 64), 0.5, 0.0);
    mesh.remove(mesh.len() / 2);
    assert_once(&render(device(), &mesh, (64, 64), false), (64, 64), "one triangle short");
}

#[test]
#[should_panic(expected = "was covered 2 times")]
fn once_notices_a_doubled_triangle() {
    let mut mesh = vec![[[-1.0, -1.0, 0.0, 1.0], [3.0, -1.0, 0.0, 1.0], [-1.0, 3.0, 0.0, 1.0]]; 2];
    mesh[1][2][1] = -0.5;
    assert_once(&render(device(), &mesh, (64, 64), false), (64, 64), "overlap");
}
