//! `light-volumes` against analytic truth (T1, T3), against itself (T13, T14), and its stencil against other ways to tell what is in a beam (T12).

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use nephroid::caustics::beams::Beam;
use nephroid::caustics::light_volumes::frame::{REFERENCE, stencil_state};
use nephroid::caustics::light_volumes::shaders::{BeamSlot, BeamsUniform, beam_program};
use nephroid::caustics::light_volumes::slices::Slices;
use nephroid::caustics::light_volumes::{BeamCulling, BeamShadows, EnergyAt, Gather, LightVolumes};
use nephroid::caustics::{RenderOptions, Rendered, Renderer};
use nephroid::frame::{BindEntry, CpuExecutor, DepthStencilAttachment, Draw, Executor, Frame, Pass};
use nephroid::math::rng::uniform3;
use nephroid::passes::camera::CameraUniform;
use nephroid::passes::shadow_map::LightUniform;
use nephroid::pipeline::sampler::Sampler;
use nephroid::pipeline::state::{CompareFunction, PixelRect, PrimitiveState, TextureFormat, Viewport};
use nephroid::pipeline::{Buffer, Device, DeviceOptions, LoadOp, PassOutput, RenderPipelineDescriptor, TextureDescriptor};
use nephroid::scene::{Aim, Light, Medium, Radiometry, Scene};

use crate::analytic::truths::optics;
use crate::analytic::truths::water::Crossed;
use crate::support::{scene, scene_of_size, sized, with_coarse_parts};

const ANGLES_DEG: [f32; 5] = [0.0, 30.0, 45.0, 60.0, 75.0];

/// Largest relative error where light is even.
const EVEN: f64 = 1.0e-4;

fn renderer(scene: &Scene, layers: &[&str]) -> Renderer {
    let layers = Some(layers.iter().map(|&name| name.to_owned()).collect());
    let options = RenderOptions { technique: "light-volumes".into(), layers, ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("device")
}

fn render(scene: &Scene, layers: &[&str]) -> Rendered {
    renderer(scene, layers).render(scene, None).expect("frame")
}

/// Red caustic irradiance, rows top down.
fn irradiance(scene: &Scene) -> Vec<f64> {
    let rendered = render(scene, &["caustic_irradiance"]);
    let layer = rendered.layers.get("caustic_irradiance").expect("asked for");
    layer.planes()[0].pixels().iter().map(|&value| f64::from(value)).collect()
}

fn counter(rendered: &Rendered, name: &str) -> u64 {
    rendered.counters.iter().find(|(counter, _)| counter == name).unwrap_or_else(|| panic!("no counter {name}")).1
}

fn flat_water(angle_deg: f32, settings: LightVolumes, medium: Medium) -> Scene {
    let mut scene = scene("analytic/flat_water.ron");
    (scene.image.width, scene.image.height) = (64, 64);
    scene.lights = vec![Light::Directional { aim: Aim::Sun { azimuth_deg: 30.0, elevation_deg: 90.0 - angle_deg }, irradiance: Vec3::ONE }];
    scene.medium = medium;
    *scene.techniques.edit::<LightVolumes>() = settings;
    scene
}

fn worst(values: &[f64], truth: f64) -> f64 {
    values.iter().map(|v| (v / truth - 1.0).abs()).fold(0.0, f64::max)
}

const WAYS: [(Gather, EnergyAt); 6] = [
    (Gather::PerBeam, EnergyAt::Receiver),
    (Gather::PerBeam, EnergyAt::Face),
    (Gather::FlatWater, EnergyAt::Receiver),
    (Gather::FlatWater, EnergyAt::Face),
    (Gather::Vector, EnergyAt::Receiver),
    (Gather::Vector, EnergyAt::Face),
];

#[test]
fn flat_water_lights_every_texel_by_t1_however_light_is_gathered() {
    let medium = Medium { sigma_a: Vec3::new(0.3, 0.1, 0.0), sigma_s: Vec3::new(0.1, 0.0, 0.0), g: 0.0 };
    for angle in ANGLES_DEG {
        let radians = f64::from(angle).to_radians();
        for (gather, energy) in WAYS {
            let settings = LightVolumes { gather, energy, ..LightVolumes::default() };
            let truth = optics::still_water(radians, 1.333, 0.0, 1.0);
            let values = irradiance(&flat_water(angle, settings, Medium::VACUUM));
            assert!(worst(&values, truth) < EVEN, "{angle} degrees, {gather:?}, {energy:?}: {:e}", worst(&values, truth));
            // The comparison can fail: a half per cent is seen.
            assert!(worst(&values, truth * 1.005) > EVEN);
            if energy == EnergyAt::Receiver {
                let values = irradiance(&flat_water(angle, settings, medium));
                let truth = optics::still_water(radians, 1.333, 0.4, 1.0);
                assert!(worst(&values, truth) < EVEN, "{angle} degrees, {gather:?}, in water: {:e}", worst(&values, truth));
            }
        }
    }
}

#[test]
fn the_papers_form_is_off_by_the_ratio_of_the_cosines() {
    for (angle, predicted) in ANGLES_DEG.into_iter().zip([1.000, 1.070, 1.199, 1.520, 2.663]) {
        let cos_i = libm::cos(f64::from(angle).to_radians());
        let sin_t = libm::sin(f64::from(angle).to_radians()) / 1.333;
        let ratio = (1.0 - sin_t * sin_t).sqrt() / cos_i;
        assert!((ratio - predicted).abs() < 1.0e-3, "{angle}: {ratio}");
        for gather in [Gather::FlatWater, Gather::Vector] {
            let paper = irradiance(&flat_water(angle, LightVolumes { gather, ..LightVolumes::PAPER }, Medium::VACUUM));
            let truth = optics::still_water(f64::from(angle).to_radians(), 1.333, 0.0, 1.0);
            assert!(worst(&paper, truth * ratio) < EVEN, "{angle} degrees, {gather:?}: {:e}", worst(&paper, truth * ratio));
        }
    }
}

#[test]
fn crossed_waves_conserve_energy() {
    // Two whole periods, before the focus and behind it, where beams turn over.
    let crossed = Crossed::SHIPPED;
    for (depth, size, bound) in [(0.75, 512, 2.0e-3), (1.5, sized(2999, 1999), 1.0e-2)] {
        let mut scene = scene("analytic/crossed_sines.ron");
        (scene.image.width, scene.image.height) = (size, size);
        *scene.techniques.edit::<LightVolumes>() = LightVolumes { grid: Some((257, 257)), ..LightVolumes::default() };
        scene.objects[0].transform.translate.y = crossed.level(depth * crossed.wave.focus_depth()) as f32;
        let values = irradiance(&scene);
        let ratio = values.iter().sum::<f64>() / values.len() as f64 / crossed.mean_of_period();
        println!("at {depth} f, landed over entered: {ratio}");
        assert!((ratio - 1.0).abs() < bound, "at {depth} f: {ratio}");
    }
}

/// Small pictures of scenes with walls, steps and columns, from above and from under water.
fn views() -> Vec<(&'static str, Scene)> {
    ["pool.ron", "columns.ron", "pots.ron"].into_iter().map(|name| (name, with_coarse_parts(scene_of_size(name, (160, 96))))).collect()
}

#[test]
fn culling_changes_no_picture() {
    let mut hidden = 0;
    for (name, mut scene) in views() {
        for paper in [false, true] {
            // Shadow culling is by leaves, and so depends on how the water is cut; it has a test of its own.
            let (grid, shadows) = (Some((33, 29)), BeamShadows::Vertices);
            let base = if paper { LightVolumes::PAPER } else { LightVolumes::default() };
            let settings = LightVolumes { grid, shadows, ..base };
            *scene.techniques.edit::<LightVolumes>() = settings;
            // Meshes and water are made once; only how beams are culled differs from frame to frame.
            let mut renderer = renderer(&scene, &["color", "caustic_irradiance"]);
            let mut of = |scene: &mut Scene, settings| {
                *scene.techniques.edit::<LightVolumes>() = settings;
                let rendered = renderer.render(scene, None).expect("frame");
                (
                    rendered.layers.clone(),
                    counter(&rendered, "beams_drawn"),
                    counter(&rendered, "beam_tests") + counter(&rendered, "node_tests"),
                    rendered.counters.iter().find(|(counter, _)| counter == "boxes_hidden").map_or(0, |(_, count)| *count),
                )
            };
            let (picture, drawn, tests, _) = of(&mut scene, LightVolumes { culling: BeamCulling::PerBeam, ..settings });
            for (buckets, levels) in [((4, 4), 3), ((1, 1), 0), ((3, 5), 8)] {
                let (other, other_drawn, other_tests, _) = of(&mut scene, LightVolumes { buckets, levels, ..settings });
                assert_eq!((&other, other_drawn), (&picture, drawn), "{name}, paper: {paper}, {buckets:?} buckets, {levels} levels");
                assert!(levels == 0 || other_tests < tests, "{name}: {other_tests} tests in place of {tests}");
            }
            // Nor is anything lost with receivers that the eye does not see.
            let visible = of(&mut scene, LightVolumes { receiver_culling: true, ..settings });
            assert_eq!(visible.0, picture, "{name}, visible receivers");
            hidden += visible.3;
            // Whole beams show the same light at receivers; faces, of which there are others then, do not.
            if !paper {
                let (whole, ..) = of(&mut scene, LightVolumes { culling: BeamCulling::Off, ..settings });
                assert_eq!(whole, picture, "{name}, whole beams");
                scene.techniques.edit::<LightVolumes>().depth_below_floor += 0.5;
                let deeper = *scene.techniques.get::<LightVolumes>();
                assert_ne!(of(&mut scene, deeper).0, picture, "the comparison cannot fail");
            }
        }
    }
    assert!(hidden > 0, "no receiver was hidden");
}

#[test]
fn more_beams_than_can_be_drawn_are_refused_before_they_are_made() {
    let mut scene = scene("pots.ron");
    scene.techniques.edit::<LightVolumes>().grid = Some((1026, 1025));
    let options = RenderOptions { technique: "light-volumes".into(), ..RenderOptions::default() };
    let error = Renderer::new(&scene, &options).expect("device").render(&scene, None).expect_err("too many");
    let text = error.to_string();
    assert!(text.contains("1026x1025 makes 2099200") && text.contains("2097152") && text.contains("light_volumes.grid"), "{text}");
}

/// A slab over half of the water of the pool of pots.
fn covered() -> Scene {
    let mut scene = scene("pots.ron");
    (scene.image.width, scene.image.height) = (160, 160);
    let mut slab = scene.objects[0].clone();
    slab.name = "slab".into();
    slab.shape = nephroid::scene::Shape::Cuboid(nephroid::geom::shapes::Cuboid { size_m: Vec3::new(2.1, 0.05, 6.0) });
    slab.transform.translate = Vec3::new(-1.05, 0.4, 0.0);
    scene.objects.push(slab);
    scene
}

#[test]
fn shadow_culling_takes_what_is_in_shadow_and_nothing_at_a_hundred_per_cent() {
    let mut scene = covered();
    let of = |scene: &mut Scene, shadows, least_shadow| {
        let settings = LightVolumes { shadows, least_shadow, grid: Some((65, 65)), ..LightVolumes::default() };
        *scene.techniques.edit::<LightVolumes>() = settings;
        render(scene, &["caustic_irradiance"])
    };
    let unculled = of(&mut scene, BeamShadows::Vertices, 0.65);
    let total = |rendered: &Rendered| {
        let layer = rendered.layers.get("caustic_irradiance").expect("asked for");
        layer.planes().iter().flat_map(|plane| plane.pixels()).map(|&v| f64::from(v)).sum::<f64>()
    };
    let mut before = u64::MAX;
    for least in [0.3, 0.65, 0.9, 0.98, 1.0] {
        let culled = of(&mut scene, BeamShadows::Both, least);
        let beams = counter(&culled, "beams_in_shadow");
        println!("S_min {least}: {beams} beams culled by {} queries", counter(&culled, "shadow_queries"));
        assert!(beams <= before, "S_min {least}: {beams} after {before}");
        before = beams;
        if least == 1.0 {
            assert_eq!(culled.layers, unculled.layers, "S_min of 100 % is no culling");
            assert_eq!(beams, 0);
        } else if least == 0.98 {
            // What is culled is all in shadow: the same light, with a third of the beams gone.
            assert!(beams > counter(&culled, "beams") / 4, "{beams}");
            assert!((total(&culled) / total(&unculled) - 1.0).abs() < 2.0e-3, "{} in place of {}", total(&culled), total(&unculled));
        }
    }
    // Without a slab over the water, nothing is asked.
    scene.objects.pop();
    let open = of(&mut scene, BeamShadows::Both, 0.98);
    assert_eq!(counter(&open, "beams_in_shadow"), 0);
    assert!(total(&open) > 1.2 * total(&unculled), "the slab cast no shadow");
}

#[test]
fn cached_answers_are_those_of_passes_that_run_again() {
    let mut scene = covered();
    *scene.techniques.edit::<LightVolumes>() = LightVolumes { grid: Some((33, 33)), receiver_culling: true, ..LightVolumes::default() };
    let options = RenderOptions { technique: "light-volumes".into(), ..RenderOptions::default() };
    let built = Renderer::new(&scene, &options).and_then(|mut renderer| renderer.build(&scene)).expect("the scene builds");
    let mut frame = built.frame;
    let run = |frame: &Frame| {
        let mut executor = CpuExecutor::new(Device::new(DeviceOptions::default()).expect("threads start"), 1 << 30);
        let output = executor.run(frame, None).expect("the frame runs");
        (output.contents.textures.clone(), output.passes.into_iter().map(|pass| PassOutput { waves: 0, ..pass }).collect::<Vec<_>>())
    };
    let cached = run(&frame);
    let asked: Vec<usize> = (0..frame.passes.len()).filter(|&k| frame.passes[k].cached.is_some()).collect();
    assert!(asked.len() > 2, "both kinds of queries are cached: {asked:?}");
    frame.passes.iter_mut().for_each(|pass| pass.cached = None);
    assert!(run(&frame) == cached, "an answer or an attachment differs");
    // Queries that are drawn elsewhere have other answers.
    let moved = asked.iter().rev().find(|&&k| cached.1[k].queries.iter().any(|&count| count > 0)).expect("something is in shadow");
    frame.passes[*moved].draws.iter_mut().for_each(|draw| draw.scissor = Some(PixelRect { x0: 0, y0: 0, x1: 1, y1: 1 }));
    assert!(run(&frame).1 != cached.1, "queries over one pixel went unnoticed");
}

/// Beams of the test of insides, each in a picture of its own.
const CELLS: u32 = 40;
const CELL_PX: u32 = 24;
/// Heights of the planes, m, and which of them holds the receiver.
const BOTTOM_Y: f32 = -4.0;
const RECEIVER_Y: f32 = -2.0;

/// A random beam with a level top, within ±1 at the receiver: some keep their orientation, some turn over, most of them on the way.
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

/// The stencil of many beams over a level receiver.
fn stencil_of(beams: &[Beam], executor: &mut CpuExecutor) -> Vec<Vec<bool>> {
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
            ..Draw::new(pipeline, bindings, slices.indices(0b011, 0..4))
        }
        .indexed(indices)
    });
    let draws = draws.collect();
    let receiver = (1.0 - RECEIVER_Y) / 6.0;
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

#[test]
fn the_stencil_agrees_with_three_other_tests_of_what_is_inside() {
    let rounds: u32 = sized(63, 4);
    let per_round = CELLS * CELLS;
    let mut executor = CpuExecutor::new(Device::new(DeviceOptions::default()).expect("threads"), 1 << 30);
    let (mut turned, mut inside, mut outside, mut fooled) = (0, 0, 0, 0);
    for round in 0..rounds {
        let beams: Vec<Beam> = (0..per_round).map(|k| random_beam(round * per_round + k)).collect();
        for (beam, stencil) in beams.iter().zip(stencil_of(&beams, &mut executor)) {
            let section = section_at(beam, RECEIVER_Y);
            turned += usize::from(beam.section_area(RECEIVER_Y) > 0.0);
            for (pixel, &seen) in stencil.iter().enumerate() {
                let place = |i: u32| (i as f32 + 0.5) / CELL_PX as f32 * 2.0 - 1.0;
                let p = Vec2::new(place(pixel as u32 % CELL_PX), place(pixel as u32 / CELL_PX));
                if edge_distance_px(section, p) < 1.0 {
                    continue;
                }
                let others = [inside_edges(section, p), inside_weights(section, p), inside_walls(beam, p, -RECEIVER_Y)];
                assert_eq!(others, [seen; 3], "{beam:?} at {p}: the stencil says {seen}, the others {others:?}");
                *(if seen { &mut inside } else { &mut outside }) += 1;
                // A plane higher it is another section: the comparison can fail.
                fooled += usize::from(inside_edges(section_at(beam, RECEIVER_Y + 1.0), p) != seen);
            }
        }
    }
    let beams = (rounds * per_round) as usize;
    println!("{beams} beams, {turned} of them turned over; {inside} pixels inside, {outside} outside");
    assert!(turned > beams / 20 && turned < beams && inside > 10 * beams && fooled > beams);
}
