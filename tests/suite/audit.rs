//! The energy audit against closed forms and photons: each entry where it is large and known, and sums that close, and do not without any one of them.

use std::path::Path;

use nephroid::caustics::audit::{CLOSES_TO, ENTRIES, imbalance};
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::scene::{Radiometry, Scene};
use nephroid::trace::{TraceOptions, Tracer};

use crate::support::{path, scene_of_size};
use crate::waterside::edited;

/// Names and watts of an audit.
type Entries = Vec<(String, f64)>;

/// Irradiance of the light of the scenes below, W/m², summed over RGB.
const SENT: f64 = 6.0;

/// A light in a direction, a medium, water of 2 m x 2 m or none, objects, and settings of techniques.
fn scene(direction: &str, medium: &str, water: bool, objects: &str, techniques: &str) -> Scene {
    let water = if water { "water: (size_m: (2, 2), grid: (33, 33), model: Flat)," } else { "" };
    let text = format!(
        "Scene(image: (width: 24, height: 24),
        camera: Orthographic(position: (0, 0.9, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 3, near_m: 0.01, far_m: 20),
        lights: [Directional(aim: Along({direction}), irradiance: (1, 2, 3))], {water}
        environment: (zenith: (0, 0, 0), horizon: (0, 0, 0), ground: (0, 0, 0), ambient_irradiance: (0, 0, 0)),
        medium: {medium}, objects: [{objects}], techniques: ({techniques}))"
    );
    TECHNIQUES.parse(&text, "audit.ron", Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

/// A level diffuse sheet: sides and place, m.
fn sheet((width, depth): (f32, f32), (x, y, z): (f32, f32, f32)) -> String {
    format!("(shape: Grid(size_m: ({width}, {depth})), transform: (translate: ({x}, {y}, {z}))),")
}

/// A gray medium that absorbs.
fn absorbing(sigma: f64) -> String {
    format!("Custom(sigma_a: ({sigma}, {sigma}, {sigma}), sigma_s: (0, 0, 0))")
}

fn audited(scene: &Scene, technique: &str) -> Entries {
    let options = RenderOptions { technique: technique.into(), layers: Some(vec!["color".into()]), ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("a renderer").render(scene, None).expect("a picture").audit
}

fn watts(audit: &Entries, name: &str) -> f64 {
    audit.iter().find(|(known, _)| known == name).map_or(0.0, |(_, watts)| *watts)
}

/// Asserts that a technique's audit closes and has these watts, to a share of the light that comes in.
fn assert_audit(what: &str, scene: &Scene, technique: &str, expected: &[(&str, f64)], tolerance: f64) {
    let audit = audited(scene, technique);
    assert!(imbalance(&audit) < CLOSES_TO, "{what}, {technique}: off by {} {audit:?}", imbalance(&audit));
    for (name, expected) in expected {
        let seen = watts(&audit, name);
        assert!(
            (seen - expected).abs() < tolerance * watts(&audit, "light_in"),
            "{what}, {technique}: {name} {seen}, not {expected} {audit:?}"
        );
    }
}

/// Share of light that a surface of relative index n reflects.
fn fresnel(cos: f64, n: f64) -> f64 {
    let t = (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
    let (s, p) = ((cos - n * t) / (cos + n * t), (n * cos - t) / (n * cos + t));
    0.5 * (s * s + p * p)
}

/// Beams count exactly; photons as finely as the texels of their view.
const TECHNIQUE_AND_TOLERANCE: [(&str, f64); 3] = [("caustic-volumes", 2.0e-5), ("light-volumes", 2.0e-5), ("splatting", 1.0e-2)];

const DOWN: &str = "(0, -1, 0)";

#[test]
fn what_comes_in_is_reflected_by_fresnel_and_lands() {
    for angle in [0.0_f64, 40.0, 70.0] {
        let (sin, cos) = (libm::sin(angle.to_radians()), libm::cos(angle.to_radians()));
        let scene = scene(&format!("({sin}, {}, 0)", -cos), "Vacuum", true, &sheet((8.0, 8.0), (0.0, -1.0, 0.0)), "");
        let (light_in, reflected) = (4.0 * SENT * cos, 4.0 * SENT * cos * fresnel(cos, 1.333));
        for (technique, tolerance) in TECHNIQUE_AND_TOLERANCE {
            let expected = [("light_in", light_in), ("reflected", reflected), ("landed", light_in - reflected), ("missed", 0.0)];
            assert_audit("flat water", &scene, technique, &expected, tolerance);
        }
    }
}

#[test]
fn water_absorbs_before_and_behind_its_surface() {
    let scene_below = scene(DOWN, &absorbing(0.7), true, &sheet((8.0, 8.0), (0.0, -1.0, 0.0)), "");
    let through = 4.0 * SENT * (1.0 - fresnel(1.0, 1.333));
    let kept = libm::exp(-0.7);
    // Light that comes from below starts at the lowest thing, a metre below the surface.
    let ceiling = [sheet((8.0, 8.0), (0.0, 0.5, 0.0)), sheet((0.1, 0.1), (3.0, -1.0, 3.0))].concat();
    let scene_above = scene("(0, 1, 0)", &absorbing(0.7), true, &ceiling, "");
    for (technique, tolerance) in TECHNIQUE_AND_TOLERANCE {
        // Beams land where the shadow map says so, to a thousandth of its depth.
        let expected = [("absorbed_behind_surface", through * (1.0 - kept)), ("landed", through * kept)];
        assert_audit("a floor", &scene_below, technique, &expected, tolerance.max(1.0e-3));
        let expected = [("light_in", 4.0 * SENT), ("absorbed_before_surface", 4.0 * SENT * (1.0 - kept)), ("landed", through * kept)];
        assert_audit("a ceiling", &scene_above, technique, &expected, tolerance.max(1.0e-3));
    }
}

#[test]
fn light_from_the_water_is_reflected_totally() {
    let scene = scene("(0.9, 0.43589, 0)", "Vacuum", true, &sheet((8.0, 8.0), (0.0, 0.5, 0.0)), "");
    for technique in ["caustic-volumes", "light-volumes"] {
        let all = 4.0 * SENT * 0.43589;
        assert_audit("steep", &scene, technique, &[("light_in", all), ("totally_reflected", all), ("entered", 0.0)], 1.0e-5);
    }
}

#[test]
fn light_misses_beside_a_floor_and_lacks_behind_an_awning() {
    let half_floor = scene(DOWN, "Vacuum", true, &sheet((1.0, 8.0), (-0.5, -1.0, 0.0)), "");
    let awning = [sheet((8.0, 8.0), (0.0, -1.0, 0.0)), sheet((1.0, 8.0), (-0.5, 0.5, 0.0))].concat();
    let off = "splatting: (views: Fitted), light_volumes: (shadows: Vertices)";
    let awning_scene = scene(DOWN, "Vacuum", true, &awning, off);
    let through = 4.0 * SENT * (1.0 - fresnel(1.0, 1.333));
    for (technique, tolerance) in TECHNIQUE_AND_TOLERANCE {
        let half = [("missed", through / 2.0), ("landed", through / 2.0)];
        assert_audit("half a floor", &half_floor, technique, &half, tolerance.max(2.0e-3));
        // One row of vertices is in the shade or not: a thirty-second of the light. Photons start where light arrives.
        let shaded = if technique == "splatting" { ("light_in", 2.0 * SENT) } else { ("shaded", through / 2.0) };
        assert_audit("an awning", &awning_scene, technique, &[shaded, ("landed", through / 2.0)], 0.04);
    }
    // Beams that are culled because more than a tenth of their leaf is in the shade lose the light of the rest.
    let culled = scene(DOWN, "Vacuum", true, &awning, "light_volumes: (shadows: Both, least_shadow: 0.1)");
    let audit = audited(&culled, "light-volumes");
    let (shaded, culled, landed) = (watts(&audit, "shaded"), watts(&audit, "culled"), watts(&audit, "landed"));
    assert!(imbalance(&audit) < CLOSES_TO && culled > 0.0 && (shaded / through - 0.5).abs() < 0.04, "{audit:?}");
    assert!((culled + landed - through / 2.0).abs() < 0.04 * through, "{audit:?}");
}

#[test]
fn beams_end_at_negligible_light_or_pass_through_everything() {
    // Half of the light is left 0.99 m down, before the floor.
    let settings = "caustic_volumes: (negligible_light: 0.5)";
    let capped = scene(DOWN, &absorbing(0.7), true, &sheet((8.0, 8.0), (0.0, -1.5, 0.0)), settings);
    let through = 4.0 * SENT * (1.0 - fresnel(1.0, 1.333));
    let expected = [("clamped", through / 2.0), ("absorbed_behind_surface", through / 2.0), ("landed", 0.0)];
    assert_audit("a cap", &capped, "caustic-volumes", &expected, 1.0e-5);
    // The bottom is 4 % of the way below the floor.
    let settings = "caustic_volumes: (underwater_shadows: false), light_volumes: (underwater_shadows: false)";
    let open = scene(DOWN, &absorbing(0.7), true, &sheet((8.0, 8.0), (0.0, -1.0, 0.0)), settings);
    let kept = libm::exp(-0.7 * 1.04);
    for technique in ["caustic-volumes", "light-volumes"] {
        let expected = [("reached_bottom", through * kept), ("absorbed_behind_surface", through * (1.0 - kept))];
        assert_audit("no shadows", &open, technique, &expected, 1.0e-4);
    }
}

#[test]
fn the_papers_beams_carry_more_than_has_entered() {
    let mut scene = scene("(0.8660254, -0.5, 0)", "Vacuum", true, &sheet((12.0, 8.0), (0.0, -1.0, 0.0)), "");
    let passes = 1.0 - fresnel(0.5, 1.333);
    for technique in ["caustic-volumes", "light-volumes"] {
        scene.set(&format!("{}.radiometry", technique.replace('-', "_")), "paper").expect("a setting");
        let expected = [("entered", 2.0 * SENT * passes), ("carried", 4.0 * SENT * passes), ("landed", 4.0 * SENT * passes)];
        assert_audit("paper", &scene, technique, &expected, 1.0e-4);
    }
}

#[test]
fn mirrors_absorb_and_send_light_away() {
    let mirror = |angle: f32| {
        format!(
            "{} (shape: Grid(size_m: (0.5, 0.5)), transform: (translate: (0, 0.2, 0), rotate_deg: (0, 0, {angle})),
             material: Mirror(reflectance: (0.8, 0.8, 0.8))),",
            sheet((12.0, 8.0), (0.0, -1.0, 0.0))
        )
    };
    let lands = scene(DOWN, "Vacuum", false, &mirror(-60.0), "");
    let light_in = 0.25 * 0.5 * SENT;
    for (technique, tolerance) in [("light-volumes", 1.0e-4), ("splatting", 2.0e-2)] {
        let expected = [("light_in", light_in), ("absorbed_by_mirrors", 0.2 * light_in), ("landed", 0.8 * light_in), ("missed", 0.0)];
        assert_audit("a tilted mirror", &lands, technique, &expected, tolerance);
    }
    let exact = scene(DOWN, "Vacuum", false, &mirror(-60.0), "splatting: (intersection: Exact)");
    assert_audit("exact", &exact, "splatting", &[("absorbed_by_mirrors", 0.2 * light_in), ("landed", 0.8 * light_in)], 2.0e-2);
    for (angle, entry) in [(-30.0_f32, "goes_away"), (-45.01, "nearly_level")] {
        let up = scene(DOWN, "Vacuum", false, &mirror(angle), "");
        let light_in = 0.25 * libm::cos(f64::from(angle).to_radians()) * SENT;
        let expected = [("light_in", light_in), ("absorbed_by_mirrors", 0.2 * light_in), (entry, 0.8 * light_in), ("entered", 0.0)];
        assert_audit("a mirror", &up, "light-volumes", &expected, 1.0e-4);
    }
}

#[test]
fn glass_absorbs_reflects_and_keeps() {
    // A block of 1 m x 1 m, half a metre high: light that is reflected inside goes up and down between both faces.
    let block = |inside: &str, techniques: &str| {
        let block = "(shape: Cuboid(size_m: (1, 0.5, 1)), transform: (translate: (0, 0.3, 0)),
            material: Dielectric(ior: 1.5, absorption: (0.8, 0.8, 0.8))),";
        scene(DOWN, "Vacuum", false, &[&sheet((8.0, 8.0), (0.0, -1.0, 0.0)), block, inside].concat(), techniques)
    };
    let (r, k) = (fresnel(1.0, 1.5), libm::exp(-0.4));
    let (passes, bounce) = (1.0 - r, r * k);
    let absorbed = SENT * passes * (1.0 - k) / (1.0 - bounce);
    let landed = SENT * passes * passes * k / (1.0 - bounce * bounce);
    let up = SENT * (r + passes * passes * k * bounce / (1.0 - bounce * bounce));
    // What is weaker than a thousandth is not followed.
    let both = [("light_in", SENT), ("absorbed_in_glass", absorbed), ("landed", landed)];
    assert_audit("a block", &block("", ""), "light-volumes", &[&both[..], &[("goes_away", up)]].concat(), 0.02);
    let exact = block("", "splatting: (intersection: Exact)");
    assert_audit("a block, exact", &exact, "splatting", &[&both[..], &[("missed", up)]].concat(), 0.01);
    let once = [
        ("absorbed_in_glass", SENT * passes * (1.0 - k)),
        ("reflected", SENT * (r + passes * k * r)),
        ("landed", SENT * passes * passes * k),
    ];
    assert_audit("a block in pictures", &block("", "splatting: (intersection: Image)"), "splatting", &once, 0.02);
    // A sheet inside of the block holds all light that has entered: 0.2 m of glass are above it.
    let inside = sheet((2.0, 2.0), (0.0, 0.35, 0.0));
    let audit = audited(&block(&inside, ""), "light-volumes");
    let expected = SENT * passes;
    assert!(imbalance(&audit) < CLOSES_TO && (watts(&audit, "stays_in_glass") / expected - 1.0).abs() < 0.05, "{audit:?}");
}

/// Light that paths through mirrors and glass lose, and photons: all there is to lose somewhere, with a share that is known only roughly.
fn losing() -> Vec<(&'static str, Scene)> {
    let mut scenes = Vec::new();
    let wall = |x: f32, angle: f32, size: &str, reflectance: f32| {
        format!(
            "(shape: Grid(size_m: ({size})), transform: (translate: ({x}, 0.5, 0), rotate_deg: (0, 0, {angle})),
             material: Mirror(reflectance: ({reflectance}, {reflectance}, {reflectance}))),"
        )
    };
    // Two walls face each other, and light goes down between them in some eighteen steps.
    let floor = sheet((12.0, 8.0), (0.0, -6.0, 0.0));
    let shaft = [&floor[..], &wall(-0.1, 90.0, "10, 0.5", 0.95), &wall(0.1, 90.0, "10, 0.5", 0.95)].concat();
    scenes.push(("light-volumes", scene("(0.342, -0.9397, 0)", "Vacuum", false, &shaft, "light_volumes: (generator_edge: 0.01)")));
    let dim = [&floor[..], &wall(0.0, -60.0, "0.5, 0.5", 0.0005)].concat();
    scenes.push(("light-volumes", scene(DOWN, "Vacuum", false, &dim, "")));
    // Half of the light of a tilted mirror meets a second one.
    let second = "(shape: Grid(size_m: (3, 2)), transform: (translate: (1.5, 0.5, 1.01), rotate_deg: (0, 0, 90)),
        material: Mirror(reflectance: (0.9, 0.9, 0.9))),";
    let split = [&floor[..], &wall(0.0, -60.0, "0.5, 0.5", 0.9), second].concat();
    scenes.push(("light-volumes", scene(DOWN, "Vacuum", false, &split, "light_volumes: (generator_edge: 1)")));
    let mut wyman = scene_of_size("ball.ron", (24, 16));
    wyman.set("splatting.search", "wyman").expect("a setting");
    wyman.set("splatting.search_steps", "2").expect("a setting");
    scenes.push(("splatting", wyman));
    let mut other = scene_of_size("glass.ron", (24, 16));
    other.set("splatting.intersection", "exact").expect("a setting");
    other.set("splatting.photons", "128").expect("a setting");
    scenes.push(("splatting", other.clone()));
    other.set("splatting.radiometry", "paper").expect("a setting");
    scenes.push(("splatting", other));
    scenes.push(("light-volumes", scene_of_size("ball.ron", (24, 16))));
    // Steep waves in low light: some corners face away, and some rays go up.
    let waves = "model: Waves([(amplitude_m: 0.2, wavelength_m: 0.5, direction_deg: 0, motion: Steady)])";
    scenes.push((
        "caustic-volumes",
        edited(
            "lamp_under_water.ron",
            &[("model: Flat", waves), ("(0, -0.6, 0), intensity", "(-3, 0.3, 0), intensity"), ("grid: (33, 33)", "grid: (129, 3)")],
        ),
    ));
    scenes.push(("caustic-volumes", edited("lamp_below_ceiling.ron", &[])));
    scenes.push(("splatting", edited("lamp_below_ceiling.ron", &[])));
    scenes
}

#[test]
fn sums_close_and_do_not_without_any_entry() {
    let mut unseen: Vec<&str> = ENTRIES.iter().map(|row| row.1).collect();
    let mut check = |what: &str, audit: &Entries| {
        assert!(imbalance(audit) < CLOSES_TO, "{what}: off by {} {audit:?}", imbalance(audit));
        let light_in = watts(audit, "light_in");
        assert!(light_in > 0.0, "{what}");
        for (k, (name, light)) in audit.iter().enumerate() {
            assert!(*light >= 0.0, "{what}: {name} {light}");
            if *light < 1.0e-4 * light_in {
                continue;
            }
            let (mut without, mut twice) = (audit.clone(), audit.clone());
            (without[k].1, twice[k].1) = (0.0, 2.0 * light);
            assert!(imbalance(&without) > 2.0 * CLOSES_TO && imbalance(&twice) > 2.0 * CLOSES_TO, "{what}: {name}");
            unseen.retain(|known| known != name);
        }
    };
    for (technique, scene) in losing() {
        check(technique, &audited(&scene, technique));
    }
    for name in ["pool.ron", "ring.ron", "ball.ron", "sinking_lamp.ron"] {
        for technique in TECHNIQUES.names() {
            for radiometry in ["physical", "paper"] {
                let mut scene = early(scene_of_size(name, (24, 16)));
                scene.set(&format!("{}.radiometry", technique.replace('-', "_")), radiometry).expect("a setting");
                let audit = audited(&scene, technique);
                // Water alone makes caustics here.
                if scene.water.is_some() || technique != "caustic-volumes" {
                    check(&format!("{name}, {technique}, {radiometry}"), &audit);
                } else {
                    assert!(audit.is_empty(), "{name}: {audit:?}");
                }
            }
        }
    }
    // Those have tests of their own, where they are known.
    let elsewhere = ["culled", "clamped", "reached_bottom", "nearly_level", "absorbed_in_glass", "stays_in_glass"];
    unseen.retain(|name| !elsewhere.contains(name));
    assert_eq!(unseen, Vec::<&str>::new(), "entries that no scene here has");
}

#[test]
fn what_lands_is_what_photons_land() {
    // Beams leave out corners that take different ways, and of long paths in glass the end.
    let left_out = ["split_paths", "too_many_events", "too_weak", "wrong_side"];
    for (name, techniques) in [
        ("pool.ron", &[("caustic-volumes", 0.01), ("light-volumes", 0.01), ("splatting", 0.02)][..]),
        ("ring.ron", &[("light-volumes", 0.015), ("splatting", 0.02)]),
        ("ball.ron", &[("light-volumes", 0.01)]),
    ] {
        let scene = early(scene_of_size(name, (32, 18)));
        let mut tracer = Tracer::new(&scene, &TraceOptions::default()).expect("can be traced");
        tracer.run(1 << 18);
        let traced = tracer.audit().watts(tracer.batches()).into_iter().find(|(name, _)| *name == "landed").expect("an entry").1;
        for (technique, tolerance) in techniques {
            let audit = audited(&scene, technique);
            let landed = watts(&audit, "landed");
            let most = landed + left_out.map(|name| watts(&audit, name)).iter().sum::<f64>();
            let holds = (landed * (1.0 - tolerance)..most * (1.0 + tolerance)).contains(&traced) && most < 1.05 * landed;
            assert!(holds, "{name}, {technique}: {landed} to {most} W, {traced} W of photons");
        }
    }
}

/// A scene at a moment that a simulation of its water reaches soon.
fn early(mut scene: Scene) -> Scene {
    scene.time_s = scene.time_s.min(0.5);
    scene
}

#[test]
fn searches_of_the_eye_that_find_nothing_are_counted() {
    let counted = |objects: &str, technique: &str| {
        let scene = scene(DOWN, "Vacuum", true, objects, "");
        let options = RenderOptions { technique: technique.into(), layers: Some(vec!["color".into()]), ..RenderOptions::default() };
        let rendered = Renderer::new(&scene, &options).expect("a renderer").render(&scene, None).expect("a picture");
        let counter = rendered.counters.iter().find(|(name, _)| name == "eye_searches_unconverged");
        counter.expect("the counter is there").1
    };
    for technique in TECHNIQUES.names() {
        assert_eq!(counted(&sheet((8.0, 8.0), (0.0, -1.0, 0.0)), technique), 0, "{technique}");
        // The water covers 16 of 24 pixels in both directions, and half of it has no floor.
        let without = counted(&sheet((4.0, 8.0), (-2.0, -1.0, 0.0)), technique);
        assert!((120..=136).contains(&without), "{technique}: {without}");
    }
}

#[test]
fn radiometry_changes_what_is_carried_and_nothing_that_comes_in() {
    let mut scene = scene("(0.6, -0.8, 0)", "Vacuum", true, &sheet((8.0, 8.0), (0.0, -1.0, 0.0)), "");
    for technique in TECHNIQUES.names() {
        let key = format!("{}.radiometry", technique.replace('-', "_"));
        let [physical, paper] = [Radiometry::Physical, Radiometry::Paper].map(|radiometry| {
            scene.set(&key, if radiometry == Radiometry::Paper { "paper" } else { "physical" }).expect("a setting");
            audited(&scene, technique)
        });
        assert!((watts(&physical, "light_in") / watts(&paper, "light_in") - 1.0).abs() < 1e-9, "{technique}");
        assert!(watts(&paper, "landed") > watts(&physical, "landed"), "{technique}");
    }
}

#[test]
fn the_documentation_has_every_entry() {
    let page = std::fs::read_to_string(path("docs/passes.md")).expect("the page is there");
    for (_, name, _, meaning) in ENTRIES {
        let row = page.lines().find(|line| line.starts_with(&format!("| `{name}` |")));
        assert!(row.is_some_and(|row| row.contains(&format!("| {meaning} |"))), "{name}: {row:?}");
    }
}
