//! `light-volumes` against analytic truth (T1, T3) and against itself (T13, T14).

use glam::Vec3;
use nephroid::caustics::light_volumes::{BeamCulling, BeamShadows, EnergyAt, Gather, LightVolumes};
use nephroid::caustics::{RenderOptions, Rendered, Renderer};
use nephroid::frame::{CpuExecutor, Executor, Frame};
use nephroid::pipeline::state::PixelRect;
use nephroid::pipeline::{Device, DeviceOptions, PassOutput};
use nephroid::scene::{Aim, Light, Medium, Scene};

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

/// Small pictures of scenes with walls, steps and columns, from above and from under water, and the four views of the paper's tables.
fn views() -> Vec<(&'static str, Scene)> {
    ["pool.ron", "columns.ron", "pots.ron", "bath.ron", "jetty.ron", "courtyard.ron", "lido.ron"]
        .into_iter()
        .map(|name| (name, with_coarse_parts(scene_of_size(name, (160, 96)))))
        .collect()
}

#[test]
fn culling_changes_no_picture() {
    let (mut hidden, mut in_shadow) = (0, 0);
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
            // With shadow culling, and leaves that are the same, the hierarchy changes nothing either.
            let both = LightVolumes { shadows: BeamShadows::Both, ..settings };
            let (shadowed, shadowed_drawn, ..) = of(&mut scene, LightVolumes { culling: BeamCulling::PerBeam, ..both });
            let (other, other_drawn, ..) = of(&mut scene, both);
            assert_eq!((&other, other_drawn), (&shadowed, shadowed_drawn), "{name}, paper: {paper}, shadow culling");
            in_shadow += u32::from(shadowed_drawn < drawn);
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
    assert!(in_shadow > 2, "{in_shadow} views had beams culled by their shadow");
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
    // Without a slab over the water, nothing is asked; under a slab over all of it nothing is drawn, and nothing lands.
    scene.objects.pop();
    let open = of(&mut scene, BeamShadows::Both, 0.98);
    assert_eq!(counter(&open, "beams_in_shadow"), 0);
    assert!(total(&open) > 1.2 * total(&unculled), "the slab cast no shadow");
    let mut closed = covered();
    let slab = closed.objects.last_mut().expect("the slab");
    slab.shape = nephroid::scene::Shape::Cuboid(nephroid::geom::shapes::Cuboid { size_m: Vec3::new(30.0, 0.05, 30.0) });
    slab.transform.translate.x = 0.0;
    for shadows in [BeamShadows::Vertices, BeamShadows::Both] {
        let dark = of(&mut closed, shadows, 0.98);
        assert_eq!(total(&dark), 0.0, "{shadows:?}: light under a closed roof");
        if shadows == BeamShadows::Both {
            // A query does not cover a leaf to its last pixel, so a few leaves are left to their vertices, which are dark.
            let (culled, all) = (counter(&dark, "beams_in_shadow"), counter(&dark, "beams"));
            assert!(culled * 100 > all * 95, "{culled} of {all} beams under a closed roof");
        }
    }
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
