//! Which pixels are in a beam of `light-volumes` (T12): its stencil against four other ways to tell, on slicing planes and between them, with walls cut in every
//! way, of beams that keep their orientation, turn over, or cross themselves.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec4};
use nephroid::caustics::beams::Beam;
use nephroid::caustics::light_volumes::frame::{REFERENCE, stencil_state};
use nephroid::caustics::light_volumes::shaders::{BeamSlot, BeamsUniform, beam_program};
use nephroid::caustics::light_volumes::slices::Slices;
use nephroid::caustics::light_volumes::{EnergyAt, Gather};
use nephroid::frame::{BindEntry, CpuExecutor, DepthStencilAttachment, Draw, Executor, Frame, Pass};
use nephroid::math::rng::uniform3;
use nephroid::passes::camera::CameraUniform;
use nephroid::passes::shadow_map::LightUniform;
use nephroid::pipeline::sampler::Sampler;
use nephroid::pipeline::state::{CompareFunction, PixelRect, PrimitiveState, TextureFormat, Viewport};
use nephroid::pipeline::{Buffer, Device, DeviceOptions, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid::scene::Radiometry;

use crate::support::sized;

/// Beams of the test of insides, each in a picture of its own.
const CELLS: u32 = 40;
const CELL_PX: u32 = 24;
/// Height of the lowest of five planes, m; the first is at 0.
const BOTTOM_Y: f32 = -4.0;

/// A random beam with a level top, within ±1 at a height of −2 m: some keep their orientation, some turn over, most of them on the way.
fn random_beam(seed: u32) -> Beam {
    let mut beam = Beam::default();
    for i in 0..3 {
        let [x, z, _] = uniform3(12, 3 * seed + i as u32, 0).map(|u| (u - 0.5) * 1.2);
        let [dx, dz, _] = uniform3(12, 3 * seed + i as u32, 1).map(|u| (u - 0.5) * 0.8);
        beam.g[i] = Vec4::new(x, 0.0, z, 1.0);
        beam.d[i] = Vec4::new(dx, (1.0 + dx * dx + dz * dz).sqrt(), dz, 1.0);
    }
    // Anticlockwise seen from above.
    if beam.section_area(0.0) > 0.0 {
        beam.g.swap(1, 2);
        beam.d.swap(1, 2);
    }
    beam.flux = Vec4::splat(1.0);
    beam
}

/// Cross-section of a beam at a height, x and z.
fn section_at(beam: &Beam, y: f32) -> [Vec2; 3] {
    beam.section(y).map(|at| Vec2::new(at.x, at.y))
}

/// The stencil of many beams over a level receiver, with walls cut as `cuts` says.
fn stencil_of(beams: &[Beam], receiver_y: f32, cuts: usize, executor: &mut CpuExecutor) -> Vec<Vec<bool>> {
    let size = CELLS * CELL_PX;
    let mut frame = Frame::default();
    let depth = frame.texture(TextureDescriptor::d2("depth", size, size, TextureFormat::Depth32FloatStencil8));
    // Straight down: x to the right, z down, depth 0 at y = 1 and 1 at y = −5.
    let clip_from_world =
        Mat4::from_cols(Vec4::X, Vec4::new(0.0, 0.0, -1.0 / 6.0, 0.0), Vec4::new(0.0, -1.0, 0.0, 0.0), Vec4::new(0.0, 0.0, 1.0 / 6.0, 1.0));
    let camera = CameraUniform {
        clip_from_world,
        world_from_clip: clip_from_world.inverse(),
        eye_ws: Vec4::new(0.0, -1.0, 0.0, 0.0),
        size_px: Vec4::ONE,
        water: Vec4::new(0.0, 1.0, 0.0, 0.0),
        extent: Vec4::ZERO,
        grid: Vec4::ZERO,
        level: Vec4::ZERO,
    };
    let slices = Slices::new(0.0, BOTTOM_Y, 5);
    let slots: Vec<BeamSlot> = beams.iter().map(|beam| BeamSlot::new(*beam)).collect();
    let buffer = |frame: &mut Frame, label: &str, data: Buffer| frame.buffer(label, Arc::new(data));
    let one = frame.texture(TextureDescriptor::d2("unused", 1, 1, TextureFormat::R32Float));
    let map = frame.texture(TextureDescriptor::d2("unused map", 1, 1, TextureFormat::Depth32Float));
    let entries = vec![
        BindEntry::Uniform(buffer(&mut frame, "camera", Buffer::from_value(&camera)), 0),
        BindEntry::Uniform(
            buffer(&mut frame, "beams", Buffer::from_value(&BeamsUniform { sigma_t: Vec4::ZERO, planes: Vec4::ZERO, space: Vec4::X })),
            0,
        ),
        BindEntry::Uniform(buffer(&mut frame, "light", Buffer::from_value(&<LightUniform as bytemuck::Zeroable>::zeroed())), 0),
        BindEntry::Storage(frame.buffer("slices", slices.vertices.clone())),
        BindEntry::DynamicUniform(buffer(&mut frame, "slots", Buffer::from_slice(&slots))),
        BindEntry::texture(map),
        BindEntry::Sampler(Sampler::comparison(CompareFunction::LessEqual)),
        BindEntry::texture(one),
        BindEntry::texture(one),
        BindEntry::texture(one),
    ];
    let bindings = frame.bind_group(entries);
    let indices = frame.buffer("indices", slices.indices.clone());
    let pipeline = frame.pipeline(RenderPipelineDescriptor {
        primitive: PrimitiveState { unclipped_depth: true, ..PrimitiveState::default() },
        depth_stencil: Some(stencil_state(TextureFormat::Depth32FloatStencil8, false, true)),
        ..RenderPipelineDescriptor::new("count", beam_program(Radiometry::Physical, Gather::PerBeam, EnergyAt::Receiver))
    });
    let draws = (0..beams.len() as u32).map(|k| {
        let (x, y) = (k % CELLS * CELL_PX, k / CELLS * CELL_PX);
        let viewport = Viewport { x: x as f32, y: y as f32, width: CELL_PX as f32, height: CELL_PX as f32, min_depth: 0.0, max_depth: 1.0 };
        Draw {
            dynamic_offset: k * size_of::<BeamSlot>() as u32,
            viewport: Some(viewport),
            scissor: Some(PixelRect { x0: x, y0: y, x1: x + CELL_PX, y1: y + CELL_PX }),
            stencil_reference: REFERENCE,
            ..Draw::new(pipeline, bindings, slices.indices(cuts, 0..4))
        }
        .indexed(indices)
    });
    let draws = draws.collect();
    let receiver = (1.0 - receiver_y) / 6.0;
    let depth_target =
        DepthStencilAttachment { view: depth.into(), depth_load: LoadOp::Clear(receiver), stencil_load: LoadOp::Clear(REFERENCE) };
    frame.passes.push(Pass { label: "count".into(), depth_stencil: Some(depth_target), draws, ..Pass::default() });
    let output = executor.run(&frame, None).expect("the frame runs");
    let surface = output.texture(depth).surface(0, 0);
    (0..beams.len() as u32)
        .map(|k| {
            let (x, y) = (k % CELLS * CELL_PX, k / CELLS * CELL_PX);
            (0..CELL_PX * CELL_PX).map(|p| surface.stencil_at(x + p % CELL_PX, y + p / CELL_PX) != REFERENCE as u8).collect()
        })
        .collect()
}

fn cross(a: Vec2, b: Vec2) -> f32 {
    a.perp_dot(b)
}

/// Inside the triangle of the section: on one side of all edges, whichever it is.
fn inside_edges(section: [Vec2; 3], p: Vec2) -> bool {
    let sides = [0, 1, 2].map(|i: usize| cross(section[(i + 1) % 3] - section[i], p - section[i]));
    sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0)
}

/// Inside by barycentric coordinates.
fn inside_weights(section: [Vec2; 3], p: Vec2) -> bool {
    let whole = cross(section[1] - section[0], section[2] - section[0]);
    let b = cross(p - section[0], section[2] - section[0]) / whole;
    let c = cross(section[1] - section[0], p - section[0]) / whole;
    b > 0.0 && c > 0.0 && b + c < 1.0
}

/// Inside by how often, and which way, a line from above passes the top and the ruled walls on its way to the receiver.
///
/// At depth t below the surface, edge i of the section is from `g_i + t d_i` to the next; the line is on it where a quadratic in t is 0 and the
/// place on the edge is between its ends.
fn inside_walls(beam: &Beam, p: Vec2, depth: f32) -> bool {
    let at = |i: usize, t: f64| {
        let (g, d) = (beam.g[i], beam.d[i]);
        (f64::from(g.x) + t * f64::from(d.x), f64::from(g.z) + t * f64::from(d.z))
    };
    let (px, pz) = (f64::from(p.x), f64::from(p.y));
    let mut winding = 0;
    let top = [0, 1, 2].map(|i: usize| Vec2::new(beam.g[i].x, beam.g[i].z));
    if inside_edges(top, p) {
        winding += 1;
    }
    for i in 0..3 {
        let j = (i + 1) % 3;
        // The edge function at three depths gives its quadratic.
        let side = |t: f64| {
            let ((ax, az), (bx, bz)) = (at(i, t), at(j, t));
            (bx - ax) * (pz - az) - (bz - az) * (px - ax)
        };
        let (c, at_one, at_minus) = (side(0.0), side(1.0), side(-1.0));
        let a = 0.5 * (at_one + at_minus) - c;
        let b = 0.5 * (at_one - at_minus);
        let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
        let q = -0.5 * (b + if b < 0.0 { -root } else { root });
        let roots = if b * b < 4.0 * a * c { [f64::NAN; 2] } else { [q / a, c / q] };
        for t in roots {
            if !(t > 0.0 && t < f64::from(depth)) {
                continue;
            }
            let ((ax, az), (bx, bz)) = (at(i, t), at(j, t));
            let along = (px - ax) * (bx - ax) + (pz - az) * (bz - az);
            let length = (bx - ax) * (bx - ax) + (bz - az) * (bz - az);
            if along > 0.0 && along < length {
                // Which way the edge passes over the point, going down.
                let slope = 2.0 * a * t + b;
                winding += if slope < 0.0 { 1 } else { -1 };
            }
        }
    }
    winding != 0
}

/// Distance to the nearest edge line of a section, in pixels.
fn edge_distance_px(section: [Vec2; 3], p: Vec2) -> f32 {
    let distance = |i: usize| {
        let (a, b) = (section[i], section[(i + 1) % 3]);
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        (a + (b - a) * t).distance(p)
    };
    distance(0).min(distance(1)).min(distance(2)) * CELL_PX as f32 * 0.5
}

/// Outline of the body with cut walls at a height between two slicing planes: its corners are on the rays, and between two of them is the point where the
/// height meets the diagonal of their wall.
fn outline(beam: &Beam, y: f32, cuts: usize) -> [Vec2; 6] {
    let (top, bottom) = (y.ceil(), y.ceil() - 1.0);
    let down = top - y;
    let (above, here, below) = (section_at(beam, top), section_at(beam, y), section_at(beam, bottom));
    std::array::from_fn(|k| {
        let (i, j) = (k / 2, (k / 2 + 1) % 3);
        let (start, end) = if cuts >> i & 1 == 1 { (above[i], below[j]) } else { (above[j], below[i]) };
        if k % 2 == 0 { here[i] } else { start + (end - start) * down }
    })
}

/// How often an outline goes around a point, and its distance from the outline, px.
fn winding(outline: &[Vec2], p: Vec2) -> (i32, f32) {
    let (mut winding, mut nearest) = (0, f32::INFINITY);
    for (k, &a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        let t = ((p - a).dot(b - a) / (b - a).length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        nearest = nearest.min((a + (b - a) * t).distance(p));
        if (a.y > p.y) != (b.y > p.y) {
            let left = cross(b - a, p - a);
            winding += if b.y > a.y && left > 0.0 {
                1
            } else if b.y < a.y && left < 0.0 {
                -1
            } else {
                0
            };
        }
    }
    (winding, nearest * CELL_PX as f32 * 0.5)
}

/// Farthest distance between a cut wall and the ruled one within a slab of a metre, px: half-way along the diagonal, at half the height.
fn off_the_ruled_wall_px(beam: &Beam) -> f32 {
    let apart = |i: usize, j: usize| Vec2::new(beam.d[i].x - beam.d[j].x, beam.d[i].z - beam.d[j].z).length();
    apart(0, 1).max(apart(1, 2)).max(apart(2, 0)) * 0.25 * CELL_PX as f32 * 0.5
}

/// Where pixel `pixel` of a beam's picture is, x and z.
fn place_of(pixel: u32) -> Vec2 {
    let place = |i: u32| (i as f32 + 0.5) / CELL_PX as f32 * 2.0 - 1.0;
    Vec2::new(place(pixel % CELL_PX), place(pixel / CELL_PX))
}

/// Numbers of beams in all, turned over, and with lobes of both orientations; of pixels inside, outside, and inside only a metre higher.
#[derive(Default)]
struct Told {
    beams: usize,
    turned: usize,
    crossed: usize,
    inside: usize,
    outside: usize,
    fooled: usize,
}

/// Compares the stencil of beams with the other tests.
fn compare(beams: &[Beam], receiver_y: f32, cuts: usize, executor: &mut CpuExecutor) -> Told {
    let mut told = Told { beams: beams.len(), ..Told::default() };
    for (beam, stencil) in beams.iter().zip(stencil_of(beams, receiver_y, cuts, executor)) {
        let section = section_at(beam, receiver_y);
        let outline = outline(beam, receiver_y, cuts);
        told.turned += usize::from(beam.section_area(receiver_y) > 0.0);
        let near_wall = if receiver_y == receiver_y.round() { 0.0 } else { off_the_ruled_wall_px(beam) };
        let mut lobes = [false; 2];
        for (pixel, &seen) in (0..).zip(&stencil) {
            let p = place_of(pixel);
            let (around, distance) = winding(&outline, p);
            // Corners are snapped to 1/256 of a pixel.
            if distance < 0.1 {
                continue;
            }
            assert_eq!(seen, around != 0, "{beam:?}, cuts {cuts:b}, at {p} and {receiver_y}: the outline goes around {around} times");
            lobes[0] |= around > 0;
            lobes[1] |= around < 0;
            if edge_distance_px(section, p) < 1.0 + near_wall {
                continue;
            }
            let others = [inside_edges(section, p), inside_weights(section, p), inside_walls(beam, p, -receiver_y)];
            assert_eq!(others, [seen; 3], "{beam:?} at {p} and {receiver_y}: the stencil says {seen}, the others {others:?}");
            *(if seen { &mut told.inside } else { &mut told.outside }) += 1;
            // A metre higher it is another section: the comparison can fail.
            told.fooled += usize::from(inside_edges(section_at(beam, receiver_y + 1.0), p) != seen);
        }
        told.crossed += usize::from(lobes == [true; 2]);
    }
    told
}

#[test]
fn the_stencil_agrees_with_four_other_tests_of_what_is_inside() {
    let per_round = CELLS * CELLS;
    let mut executor = CpuExecutor::new(Device::new(DeviceOptions::default()).expect("threads"), 1 << 30);
    // On planes and between them, and all ways to cut the walls of a triangle.
    for (k, &y) in [-2.0, -2.5, -1.3, -3.75].iter().enumerate() {
        for cuts in 1..=6 {
            for round in 0..sized(10, 1) {
                let first = ((6 * k as u32 + cuts as u32) * 10 + round) * per_round;
                let beams: Vec<Beam> = (first..first + per_round).map(random_beam).collect();
                let told = compare(&beams, y, cuts, &mut executor);
                assert!(told.turned > told.beams / 40 && told.turned < told.beams, "{y}, {cuts}: {} turned over", told.turned);
                let Told { beams, inside, outside, fooled, .. } = told;
                assert!(inside > beams / 4 && outside > beams && fooled > beams / 4, "{y}, {cuts}: {inside} {outside} {fooled}");
            }
        }
    }
}

#[test]
fn the_stencil_counts_both_lobes_of_beams_that_cross_themselves() {
    let mut executor = CpuExecutor::new(Device::new(DeviceOptions::default()).expect("threads"), 1 << 30);
    // Turned over within the slab of the receiver: there cut walls pass through each other.
    let y = -2.5;
    let turns = |beam: &Beam| beam.section_area(y + 0.3) * beam.section_area(y - 0.3) < 0.0;
    let beams: Vec<Beam> = (0..).map(|seed| random_beam(1_000_000 + seed)).filter(turns).take((CELLS * CELLS) as usize).collect();
    for cuts in 1..=6 {
        let told = compare(&beams, y, cuts, &mut executor);
        assert!(told.crossed > 20, "{cuts}: {} of {} beams have lobes of both orientations", told.crossed, told.beams);
    }
}
