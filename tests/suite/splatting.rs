//! `splatting` against analytic truths, its own sums, and bad input.

use nephroid::caustics::audit::{CLOSES_TO, imbalance};
use nephroid::caustics::splatting::{Blend, CurvatureFrom, Gather, Intersection, Lens, Search, Splats, Splatting, Views};
use nephroid::caustics::{RenderOptions, Rendered, Renderer};
use nephroid::geom::shapes::{Cylinder, IcoSphere};
use nephroid::scene::{Aim, Camera, Light, Material, Radiometry, Scene, Shape};

use crate::analytic::truths;
use crate::analytic::truths::sphere::{Ball, Rings};
use crate::support::{scene_of_size as scene, sized};

/// Renders the named layers.
pub fn render(scene: &Scene, layers: &[&str]) -> Rendered {
    let layers = Some(layers.iter().map(|name| (*name).to_owned()).collect());
    let options = RenderOptions { technique: "splatting".into(), layers, ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("a renderer").render(scene, None).expect("a picture")
}

/// The scene's settings of the technique, to be changed.
pub fn settings(scene: &mut Scene) -> &mut Splatting {
    scene.techniques.edit::<Splatting>()
}

/// Red caustic irradiance by pixel.
fn irradiance(scene: &Scene) -> Vec<f64> {
    let rendered = render(scene, &["caustic_irradiance"]);
    rendered.layers.get("caustic_irradiance").expect("asked for").planes()[0].pixels().iter().map(|&v| f64::from(v)).collect()
}

fn audit(rendered: &Rendered, name: &str) -> f64 {
    rendered.audit.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no entry {name}")).1
}

fn counter(rendered: &Rendered, name: &str) -> u64 {
    rendered.counters.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no counter {name}")).1
}

/// Mean, and standard deviation over the mean.
fn mean_and_noise(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64;
    (mean, variance.sqrt() / mean)
}

/// T1: E = E⊥ cos θ T(θ) everywhere. The default has no noise at all where light is not bent; splats of one size have.
#[test]
fn still_water_lights_its_floor_evenly() {
    for (elevation, expected) in [(90.0, 0.979_627), (60.0, 0.847_461), (30.0, 0.470_155), (15.0, 0.203_852)] {
        let mut scene = scene("analytic/flat_water.ron", (48, 48));
        scene.lights[0] = Light::Directional { aim: Aim::Sun { azimuth_deg: 30.0, elevation_deg: elevation }, irradiance: glam::Vec3::ONE };
        (settings(&mut scene).photons, settings(&mut scene).map_size) = (80, 256);
        let (mean, noise) = mean_and_noise(&irradiance(&scene));
        assert!((mean / expected - 1.0).abs() < 1.0e-3 && noise < 2.0e-3, "{elevation}: {mean} {expected}, {noise}");
        for intersection in [Intersection::Exact, Intersection::Image] {
            settings(&mut scene).intersection = intersection;
            settings(&mut scene).splats = Splats::Fixed;
            settings(&mut scene).splat_size = 2.0;
            let (mean, noise) = mean_and_noise(&irradiance(&scene));
            assert!((mean / expected - 1.0).abs() < 5.0e-3 && noise > 0.01, "{elevation}: {mean} {expected}, {noise}");
        }
        // Other water is noticed.
        settings(&mut scene).splats = Splats::Differential;
        scene.water.as_mut().expect("water").ior = 1.4;
        let (other, _) = mean_and_noise(&irradiance(&scene));
        assert!((other / expected - 1.0).abs() > 1.0e-3, "{elevation}: {other}");
    }
}

/// T15: glass that does not bend light leaves it where it was.
#[test]
fn equal_indices_leave_one_evenly_lit_floor() {
    let mut scene = scene("analytic/matched.ron", (96, 96));
    scene.water = None;
    (settings(&mut scene).photons, settings(&mut scene).map_size) = (256, 256);
    let whole = |scene: &Scene| {
        let rendered = render(scene, &["caustic_irradiance", "direct", "position"]);
        let layer = |name: &str, c: usize| rendered.layers.get(name).expect("asked for").planes()[c].pixels().to_vec();
        let on_floor: Vec<bool> = layer("position", 1).iter().map(|y| (y + 1.5).abs() < 1.0e-3).collect();
        let pairs = layer("caustic_irradiance", 0).into_iter().zip(layer("direct", 0)).zip(on_floor);
        pairs.filter(|(_, floor)| *floor).map(|(pair, _)| pair).collect::<Vec<_>>()
    };
    // The sine of 60 degrees.
    let expected = 0.75_f32.sqrt();
    for splats in [Splats::Differential, Splats::Lens, Splats::Fixed] {
        settings(&mut scene).splats = splats;
        let pixels = whole(&scene);
        // Where the body hides the floor from the light, but for the rim, all of it arrives nevertheless.
        let inside = pixels.iter().filter(|(_, direct)| *direct == 0.0).map(|(caustic, _)| caustic / expected).collect::<Vec<_>>();
        let right = inside.iter().filter(|e| (*e - 1.0).abs() < 0.02).count();
        assert!(inside.len() > 300 && right * 100 > inside.len() * 80, "{splats:?}: {right} of {}", inside.len());
    }
    // Glass is not like that.
    scene.objects[0].material = Material::Dielectric { ior: 1.5, abbe: None, absorption: glam::Vec3::ZERO };
    let inside: Vec<f32> = whole(&scene).iter().filter(|(_, direct)| *direct == 0.0).map(|(caustic, _)| caustic / expected).collect();
    assert!(inside.iter().filter(|e| (*e - 1.0).abs() < 0.02).count() * 10 < inside.len());
}

/// T6: a ball of glass over a floor behind its focus, the light that passes straight through.
#[test]
fn a_ball_of_glass_makes_its_rings_of_light() {
    const SIDE: u32 = 64;
    let mut scene = scene("analytic/glass_ball.ron", (SIDE, SIDE));
    // Between the ball and the floor.
    scene.camera = Camera::Orthographic {
        position: glam::Vec3::new(0.0, -1.05, 0.0),
        target: glam::Vec3::new(0.0, -2.0, 0.0),
        up: glam::Vec3::NEG_Z,
        height_m: 1.6,
        near_m: 0.01,
        far_m: 2.0,
    };
    scene.objects[0].shape = Shape::IcoSphere(IcoSphere { radius_m: 1.0, subdivisions: 5 });
    (settings(&mut scene).photons, settings(&mut scene).map_size) = (384, 1024);
    settings(&mut scene).samples = 2;
    let straight = |ior: f64, x: f64, z: f64| Ball { ior, behind_center: 1.8 }.irradiance((x * x + z * z).sqrt(), 1..2);
    let error_of = |drawn: &[f64], ior: f64| {
        let at = |i: u32| (f64::from(i) + 0.5) * 1.6 / f64::from(SIDE) - 0.8;
        let (mut off, mut all) = (0.0, 0.0);
        for k in (0..SIDE * SIDE).step_by(7) {
            let (x, z) = (at(k % SIDE), at(k / SIDE));
            let r = (x * x + z * z).sqrt();
            if (0.08..0.75).contains(&r) {
                let truth = straight(ior, x, z);
                off += (drawn[k as usize] - truth).abs();
                all += truth;
            }
        }
        off / all
    };
    for (splats, bound) in [(Splats::Differential, 0.012), (Splats::Lens, 0.03), (Splats::Fixed, 0.04), (Splats::Sizes, 0.05)] {
        (settings(&mut scene).splats, settings(&mut scene).splat_size) = (splats, if splats == Splats::Differential { 3.0 } else { 7.0 });
        let drawn = irradiance(&scene);
        let (off, off_other) = (error_of(&drawn, 1.5), error_of(&drawn, 1.53));
        println!("{splats:?}: error {off}; of other glass {off_other}");
        assert!(off < bound && off_other > 1.5 * off, "{splats:?}: {off} {off_other}");
    }
    // Both curvatures of each face say what the neighbours of a photon say.
    (settings(&mut scene).splats, settings(&mut scene).splat_size, settings(&mut scene).curvature) =
        (Splats::Lens, 3.0, CurvatureFrom::Both);
    let off = error_of(&irradiance(&scene), 1.5);
    assert!(off < 0.012, "{off}");
    settings(&mut scene).curvature = CurvatureFrom::Mesh;
    // The paper's searches find the same, and so does a gathering in the picture.
    (settings(&mut scene).splats, settings(&mut scene).splat_size) = (Splats::Differential, 3.0);
    for (search, gather) in [(Search::Wyman, Gather::Light), (Search::Shah, Gather::Light), (Search::Bracketed, Gather::Eye)] {
        (settings(&mut scene).search, settings(&mut scene).gather) = (search, gather);
        let off = error_of(&irradiance(&scene), 1.5);
        assert!(off < 0.012, "{search:?} {gather:?}: {off}");
    }
    // All of the light, that which is reflected inside too, on a square: 0.3 % more than straight through.
    settings(&mut scene).gather = Gather::Light;
    settings(&mut scene).intersection = Intersection::Exact;
    let (mean, _) = mean_and_noise(&irradiance(&scene));
    let truth = Ball { ior: 1.5, behind_center: 1.8 }.mean([-0.8, 0.8], [-0.8, 0.8]);
    assert!((mean / truth - 1.0).abs() < 4.0e-3, "{mean} {truth}");
}

/// T7: half of a nephroid in a mirror ring, whichever way photons and receivers are found.
#[test]
fn a_ring_makes_half_of_a_nephroid() {
    const SIDE: u32 = 120;
    const BLOCK: u32 = 6;
    let truth = truths::ring::Nephroid { elevation: std::f64::consts::FRAC_PI_4, height: 0.8, reflectance: 1.0 };
    let mut scene = scene("analytic/mirror_ring.ron", (SIDE, SIDE));
    scene.objects[0].shape = Shape::Cylinder(Cylinder { radius_m: 1.0, height_m: 0.8, slices: 256, open: true });
    (settings(&mut scene).photons, settings(&mut scene).map_size, settings(&mut scene).samples) = (sized(512, 300), 512, 2);
    let at = |i: u32| f64::from(i) * 2.4 / f64::from(SIDE) - 1.2;
    let error_of = |drawn: &[f64], truth: &truths::ring::Nephroid| {
        let (mut drawn_sum, mut off, mut all) = (0.0, 0.0, 0.0);
        for k in 0..SIDE * SIDE / BLOCK / BLOCK {
            let (column, row) = (k % (SIDE / BLOCK) * BLOCK, k / (SIDE / BLOCK) * BLOCK);
            let (x, z) = ([at(column), at(column + BLOCK)], [at(row), at(row + BLOCK)]);
            // Light that was reflected twice arrives farther out.
            if x.iter().all(|x| z.iter().all(|z| (x * x + z * z).sqrt() < 0.85)) {
                let pixels = (0..BLOCK * BLOCK).map(|p| drawn[((row + p / BLOCK) * SIDE + column + p % BLOCK) as usize]);
                let (mean, expected) = (pixels.sum::<f64>() / f64::from(BLOCK * BLOCK), truth.mean(x, z));
                off += (mean - expected).abs();
                all += expected;
                drawn_sum += mean;
            }
        }
        (drawn_sum / all, off / all)
    };
    let lower = truths::ring::Nephroid { height: 0.76, ..truth };
    let variants = [
        (Search::Bracketed, Intersection::Image, Gather::Light),
        (Search::Bracketed, Intersection::Image, Gather::Eye),
        (Search::Bracketed, Intersection::Exact, Gather::Light),
    ];
    for (search, intersection, gather) in variants {
        let of = settings(&mut scene);
        (of.search, of.intersection, of.gather) = (search, intersection, gather);
        let drawn = irradiance(&scene);
        let ((ratio, off), (_, off_lower)) = (error_of(&drawn, &truth), error_of(&drawn, &lower));
        println!("{search:?} {intersection:?} {gather:?}: energy ratio {ratio}, error {off}; of a lower wall {off_lower}");
        assert!((ratio - 1.0).abs() < 0.01 && off < 0.03 && off_lower > 2.0 * off, "{search:?}: {ratio} {off} {off_lower}");
    }
}

/// T3: what photons carry is what the map holds, whatever the splats, to 1e-5.
#[test]
fn splats_bring_the_whole_flux_of_their_photons() {
    let mut scene = scene("ball.ron", (16, 16));
    scene.objects.truncate(2);
    (settings(&mut scene).photons, settings(&mut scene).map_size) = (96, 128);
    let map_sums = |rendered: &Rendered, layer: &str| -> Vec<f64> {
        let planes = rendered.layers.get(&layer.replace(' ', "_")).expect("asked for").planes();
        planes.iter().map(|plane| plane.pixels().iter().map(|&v| f64::from(v)).sum()).collect()
    };
    for intersection in [Intersection::Image, Intersection::Exact] {
        settings(&mut scene).intersection = intersection;
        for (splats, layer) in [
            (Splats::Fixed, "splats 0/caustic_map 0"),
            (Splats::Lens, "splats 0/caustic_map 0"),
            (Splats::Differential, "splats 0/caustic_map 0"),
            (Splats::Sizes, "splats 0/map_flux 0"),
            (Splats::Pyramid, "splats 0 level 0/map_pyramid 0"),
        ] {
            for size in [1.0, 2.7, 7.0] {
                (settings(&mut scene).splats, settings(&mut scene).splat_size) = (splats, size);
                let sums = |radiometry| {
                    let mut scene = scene.clone();
                    settings(&mut scene).radiometry = radiometry;
                    let rendered = render(&scene, &[layer]);
                    (map_sums(&rendered, layer), audit(&rendered, "landed"), counter(&rendered, "photons_landed") as f64)
                };
                let (sums, landed, count) = sums(Radiometry::Physical);
                // Each channel of the sizes holds all flux; else the first three do together, and the fourth counts.
                let wholes = if splats == Splats::Sizes {
                    sums.iter().map(|sum| sum / landed).collect()
                } else {
                    vec![sums[..3].iter().sum::<f64>() / landed, sums[3] / count]
                };
                // Some of all light lands so near to the edge of the map that its splats are cut.
                let bound = if intersection == Intersection::Exact { 2.0e-3 } else { 1.0e-5 };
                for whole in wholes {
                    assert!((whole - 1.0).abs() < bound, "{intersection:?} {splats:?} {size}: {whole}");
                }
            }
        }
    }
    // Shares by the integral, as the paper has them, do not add up.
    (settings(&mut scene).splats, settings(&mut scene).radiometry) = (Splats::Fixed, Radiometry::Paper);
    settings(&mut scene).splat_size = 2.0;
    let rendered = render(&scene, &["splats 0/caustic_map 0"]);
    let whole = map_sums(&rendered, "splats 0/caustic_map 0")[..3].iter().sum::<f64>() / audit(&rendered, "landed");
    assert!((whole - 1.0).abs() > 1.0e-3, "{whole}");
}

/// The search in pictures against the triangles: the same light at the same places, where both follow the same paths.
#[test]
fn image_space_finds_what_the_triangles_say() {
    let mut scene = scene("ball.ron", (48, 32));
    scene.objects.truncate(2);
    let of = settings(&mut scene);
    (of.photons, of.map_size, of.radiometry) = (400, 512, Radiometry::Paper);
    let map = |scene: &Scene| {
        let rendered = render(scene, &["splats 0/caustic_map 0"]);
        let plane = rendered.layers.get("splats_0/caustic_map_0").expect("asked for").planes()[0].clone();
        plane.pixels().iter().map(|&v| f64::from(v)).collect::<Vec<_>>()
    };
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / b.iter().sum::<f64>();
    let image = map(&scene);
    settings(&mut scene).intersection = Intersection::Exact;
    let exact = map(&scene);
    let ratio = image.iter().sum::<f64>() / exact.iter().sum::<f64>();
    settings(&mut scene).intersection = Intersection::Image;
    settings(&mut scene).exit_steps = 0;
    let straight = map(&scene);
    let (with, without) = (off(&image, &exact), off(&straight, &exact));
    println!("energy {ratio}; differs by {with}, without steps in glass by {without}");
    assert!((ratio - 1.0).abs() < 0.01 && with < 0.05 && without > 3.0 * with, "{ratio} {with} {without}");
}

#[test]
fn every_choice_is_drawn_and_counts_its_photons() {
    let mut scene = scene("ball.ron", (40, 24));
    (settings(&mut scene).photons, settings(&mut scene).map_size) = (64, 128);
    let base = Splatting { intersection: Intersection::Image, ..*settings(&mut scene) };
    let changes: Vec<Splatting> = vec![
        base,
        Splatting { splats: Splats::Lens, lens: Lens::Thin, ..base },
        Splatting { splats: Splats::Lens, curvature: CurvatureFrom::Normals, ..base },
        Splatting { splats: Splats::Lens, curvature: CurvatureFrom::Both, ..base },
        Splatting { splats: Splats::Sizes, blend: Blend::Linear, ..base },
        Splatting { splats: Splats::Pyramid, ..base },
        Splatting { views: Views::Scene, photons: 512, map_size: 512, ..base },
        Splatting { smooth_exits: false, exit_steps: 0, ..base },
        Splatting { intersection: Intersection::Exact, gather: Gather::Eye, ..base },
    ];
    let mut pictures = Vec::new();
    for with in changes {
        *settings(&mut scene) = with;
        let rendered = render(&scene, &["caustic_irradiance"]);
        let pixels = rendered.layers.get("caustic_irradiance").expect("asked for").planes()[0].pixels().to_vec();
        assert!(pixels.iter().all(|e| e.is_finite()) && pixels.iter().any(|e| *e > 100.0), "{with:?}");
        let (arrived, landed) = (audit(&rendered, "light_in"), audit(&rendered, "landed"));
        assert!(landed > 0.4 * arrived && landed <= arrived, "{with:?}: {landed} of {arrived}");
        pictures.push(pixels);
    }
    for (i, picture) in pictures.iter().enumerate() {
        assert!(pictures[..i].iter().all(|other| other != picture), "choice {i} changes nothing");
    }
}

#[test]
fn a_light_without_a_view_is_refused_and_a_scene_without_glass_is_dark() {
    let mut inside = scene("ball.ron", (16, 16));
    inside.lights[0] = Light::Point { position: glam::Vec3::new(0.0, 0.3, 0.0), intensity: glam::Vec3::ONE };
    let options = RenderOptions { technique: "splatting".into(), ..RenderOptions::default() };
    let refused = Renderer::new(&inside, &options).expect("a renderer").render(&inside, None).expect_err("the light is inside");
    assert!(refused.to_string().contains("light 0 is inside of the box around mirrors, glass or water"), "{refused}");

    let mut plain = scene("ball.ron", (16, 16));
    plain.objects.remove(1);
    let rendered = render(&plain, &["caustic_irradiance"]);
    assert_eq!(counter(&rendered, "lights_without_caustics"), 1);
    assert!(rendered.layers.get("caustic_irradiance").expect("asked for").planes()[0].pixels().iter().all(|&e| e == 0.0));

    let mut through_water = scene("pool.ron", (16, 16));
    settings(&mut through_water).gather = Gather::Eye;
    let refused = Renderer::new(&through_water, &options).expect("a renderer").render(&through_water, None).expect_err("refused");
    assert!(refused.to_string().contains("eye_refraction"), "{refused}");

    (settings(&mut plain).intersection, settings(&mut plain).photons) = (Intersection::Exact, 2049);
    let refused = Renderer::new(&plain, &options).expect("a renderer").render(&plain, None).expect_err("refused");
    assert!(refused.to_string().contains("2049") && refused.to_string().contains("2048"), "{refused}");
    for (key, value) in
        [("splatting.photons", "0"), ("splatting.photons", "4097"), ("splatting.map_size", "8193"), ("splatting.frames", "0")]
    {
        assert!(plain.set(key, value).is_err() || plain.validate().is_err(), "{key}={value}");
    }
}

/// Rays that leave the scene have no length, but their light is a number: all fates together have what the surface lets through.
#[test]
fn light_that_leaves_the_scene_is_counted_in_watts() {
    let mut scene = scene("analytic/sine_water.ron", (16, 16));
    (settings(&mut scene).photons, settings(&mut scene).map_size) = (64, 128);
    // The water has two rows of vertices, both beside the ramp.
    let rendered = render(&scene, &["caustic_irradiance"]);
    assert_eq!(counter(&rendered, "lights_without_caustics"), 0);
    let ends = ["landed", "missed", "not_found", "totally_reflected"].map(|end| audit(&rendered, end));
    let (sum, light_in) = (ends.iter().sum::<f64>(), audit(&rendered, "light_in"));
    assert!(counter(&rendered, "photons_missed") + counter(&rendered, "photons_not_found") > 0, "{:?}", rendered.counters);
    // Clear water, light from above: Fresnel's law lets some 98 % through.
    assert!((0.97..0.99).contains(&(sum / light_in)), "{sum} of {light_in}, {:?}", rendered.audit);
}

/// Where the light of exact photons ends adds up to what arrived, and a ball around a ball of the same glass is one ball.
#[test]
fn exact_photons_account_for_their_light_in_bodies_within_bodies() {
    const RADIUS_M: f32 = 0.3;
    let mut one = scene("ball.ron", (24, 16));
    one.objects.truncate(2);
    let of = settings(&mut one);
    (of.photons, of.map_size, of.intersection) = (96, 128, Intersection::Exact);
    one.objects[1].shape = Shape::IcoSphere(IcoSphere { radius_m: RADIUS_M, subdivisions: 5 });
    let clear = |ior| Material::Dielectric { ior, abbe: None, absorption: glam::Vec3::ZERO };
    one.objects[1].material = clear(1.5);
    let mut two = one.clone();
    let mut inner = two.objects[1].clone();
    inner.name = "inner".into();
    inner.shape = Shape::IcoSphere(IcoSphere { radius_m: 0.6 * RADIUS_M, subdivisions: 4 });
    two.objects.push(inner);
    let mut three = two.clone();
    three.objects[2].material = clear(1.3);
    let [one, two, three] = [one, two, three].map(|scene| render(&scene, &["caustic_irradiance"]));
    for rendered in [&one, &two, &three] {
        let light_in = audit(rendered, "light_in");
        let dropped: f64 = ["too_many_events", "too_weak", "wrong_side", "stays_in_glass"].map(|end| audit(rendered, end)).iter().sum();
        let off = imbalance(&rendered.audit);
        assert!(off < CLOSES_TO && dropped < 3.0e-3 * light_in, "{off} {:?}", rendered.audit);
    }
    let red = |rendered: &Rendered| rendered.layers.get("caustic_irradiance").expect("asked for").planes()[0].pixels().to_vec();
    let [one, two, three] = [one, two, three].map(|rendered| red(&rendered));
    let off = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.iter().sum::<f32>();
    assert!(off(&one, &two) < 0.02 && off(&one, &three) > 0.2, "{} {}", off(&one, &two), off(&one, &three));
}

/// The mean of maps with shifted grids has less noise and the same light; in a sequence of frames it is what a single frame has.
#[test]
fn maps_of_several_frames_are_smoother_and_do_not_depend_on_what_was_drawn_before() {
    let mut still = scene("analytic/flat_water.ron", (48, 48));
    let of = settings(&mut still);
    (of.photons, of.map_size, of.splats, of.splat_size) = (80, 256, Splats::Fixed, 1.6);
    let (mean, noise) = mean_and_noise(&irradiance(&still));
    settings(&mut still).frames = 4;
    // There is no water before it was started.
    still.time_s = 1.0;
    let (mean_of_four, noise_of_four) = mean_and_noise(&irradiance(&still));
    assert!((mean_of_four / mean - 1.0).abs() < 5.0e-3 && noise_of_four < 0.6 * noise, "{mean} {mean_of_four}, {noise} {noise_of_four}");

    let mut moving = scene("analytic/sine_water.ron", (32, 32));
    let of = settings(&mut moving);
    (of.photons, of.map_size, of.frames, of.frame_s) = (48, 96, 3, 0.25);
    moving.water.as_mut().expect("water").grid = (33, 33);
    let options =
        RenderOptions { technique: "splatting".into(), layers: Some(vec!["caustic_irradiance".into()]), ..RenderOptions::default() };
    let red = |rendered: Rendered| rendered.layers.get("caustic_irradiance").expect("asked for").planes()[0].pixels().to_vec();
    let mut renderer = Renderer::new(&moving, &options).expect("a renderer");
    for time in [0.0, 0.25, 0.5, 0.75, 0.6] {
        moving.time_s = time;
        let in_sequence = red(renderer.render(&moving, None).expect("a picture"));
        let alone = red(Renderer::new(&moving, &options).expect("a renderer").render(&moving, None).expect("a picture"));
        assert!(in_sequence == alone, "at {time} s");
    }
}
