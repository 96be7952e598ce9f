//! Light on both sides of the water's surface: what is wet and what is dry, lamps in the water, against closed forms and traced light.

use std::path::Path;

use glam::{DVec3, Vec3};
use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::image::Layer;
use nephroid::scene::{Light, Scene};
use nephroid::trace::{Points, TraceOptions, Tracer};

use crate::support::path;

/// Text of a scene from `tests/data/waterside`.
pub fn text_of(name: &str) -> String {
    std::fs::read_to_string(path("tests/data/waterside").join(name)).expect("the scene is there")
}

/// A scene from `tests/data/waterside`, with some of its text replaced.
pub fn edited(name: &str, edits: &[(&str, &str)]) -> Scene {
    let mut text = text_of(name);
    for (old, new) in edits {
        assert!(text.contains(old), "{name} has no `{old}`");
        text = text.replace(old, new);
    }
    TECHNIQUES.parse(&text, name, Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

/// What a picture shows, pixel by pixel: red irradiance by direct light and by caustics, and where.
pub struct Seen {
    pub direct: Vec<f64>,
    pub caustic: Vec<f64>,
    points: Points,
}

impl Seen {
    pub fn of(scene: &Scene, technique: &str) -> Self {
        let layers = ["direct", "caustic_irradiance", "position", "normal", "depth"].map(str::to_owned).to_vec();
        let options = RenderOptions { technique: technique.into(), layers: Some(layers), ..RenderOptions::default() };
        let rendered = Renderer::new(scene, &options).expect("device").render(scene, None).expect("frame").layers;
        let layer = |name: &str| rendered.get(name).expect("asked for");
        let (position, normal, depth) = (layer("position"), layer("normal"), layer("depth"));
        let at = |layer: &Layer, k: usize| Vec3::from_array([0, 1, 2].map(|c| layer.planes()[c].pixels()[k]));
        let red = |name: &str| layer(name).planes()[0].pixels().iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
        let count = depth.planes()[0].pixels().len();
        let exists = |k: usize| depth.planes()[0].pixels()[k].is_finite();
        let points = Points {
            columns: position.width(),
            rows: position.height(),
            positions: (0..count).map(|k| exists(k).then(|| at(position, k))).collect(),
            normals: (0..count).map(|k| at(normal, k).normalize_or_zero()).collect(),
        };
        Self { direct: red("direct"), caustic: red("caustic_irradiance"), points }
    }

    /// Pixels with a surface: number, position, normal.
    fn surfaces(&self) -> impl Iterator<Item = (usize, Vec3, Vec3)> + '_ {
        self.points.positions.iter().enumerate().filter_map(|(k, p)| Some((k, (*p)?, self.points.normals[k])))
    }

    /// Caustic irradiance of the pixels where `of` holds, summed up, over that of photons at the same points.
    pub fn energy_ratio(&self, scene: &Scene, photons: u64, of: impl Fn(Vec3) -> bool) -> f64 {
        self.ratio(scene, photons, of, false)
    }

    /// The same in watts: each pixel counts by the area that it shows.
    pub fn energy_ratio_by_area(&self, scene: &Scene, photons: u64, of: impl Fn(Vec3) -> bool) -> f64 {
        self.ratio(scene, photons, of, true)
    }

    fn ratio(&self, scene: &Scene, photons: u64, of: impl Fn(Vec3) -> bool, by_area: bool) -> f64 {
        let mut points = self.points.clone();
        points.positions.iter_mut().for_each(|p| *p = p.filter(|p| of(*p)));
        let mut tracer = Tracer::new(scene, &TraceOptions { points: Some(points), ..TraceOptions::default() }).expect("can be traced");
        tracer.run(photons);
        let measured = tracer.pixels().expect("points were asked for");
        let valid = measured.valid.as_ref().expect("points have a mask");
        let areas = tracer.pixel_areas().expect("points were asked for");
        let (mut drawn, mut traced) = (0.0, 0.0);
        for (k, mean) in measured.mean.iter().enumerate().filter(|(k, _)| valid[*k]) {
            let weight = if by_area { areas[k] } else { 1.0 };
            drawn += self.caustic[k] * weight;
            traced += mean[0] * weight;
        }
        assert!(traced > 0.0, "no photon has landed");
        drawn / traced
    }
}

/// E·cos θ of a lamp of one colour at a point, and its cosine there; no shadow, no medium.
fn lamp(light: &Light, p: Vec3, n: Vec3) -> (f64, f64) {
    let (Light::Point { position, intensity } | Light::Spot { position, intensity, .. }) = *light else { panic!("a lamp") };
    let to: DVec3 = (p - position).as_dvec3();
    let cos = -(to / to.length()).dot(n.as_dvec3());
    (f64::from(intensity.x) * cos.max(0.0) / to.length_squared(), cos)
}

/// Replacements in the text of a scene.
type Edits<'a> = &'a [(&'a str, &'a str)];

#[test]
fn a_lamp_in_the_water_lights_what_is_there_by_the_inverse_square() {
    let waves = "model: Waves([(amplitude_m: 0.03, wavelength_m: 0.7, direction_deg: 20, motion: Steady)])";
    let higher: Edits<'_> = &[
        ("level_m: 0", "level_m: 5"),
        ("(0, -0.6, 0), intensity", "(0, 4.4, 0), intensity"),
        ("(0, -0.3, 1.2), target: (0, -1, 0)", "(0, 4.7, 1.2), target: (0, 4, 0)"),
        ("translate: (0, -1, 0)", "translate: (0, 4, 0)"),
    ];
    let variants: [(Edits<'_>, f64); 6] = [
        (&[], 0.0),
        (&[("medium: Vacuum", "medium: Custom(sigma_a: (0.7, 0.7, 0.7), sigma_s: (0, 0, 0))")], 0.7),
        (&[("model: Flat", waves)], 0.0),
        (&[("translate: (0, -1, 0)", "translate: (0, -1, 0), rotate_deg: (0, 0, 4)")], 0.0),
        (&[("Point(position: (0, -0.6, 0), ", "Spot(position: (0, -0.6, 0), direction: (0, -1, 0), inner_deg: 88, outer_deg: 89, ")], 0.0),
        (higher, 0.0),
    ];
    for (edits, sigma) in variants {
        let scene = edited("lamp_under_water.ron", edits);
        let (Light::Point { position, .. } | Light::Spot { position, .. }) = scene.lights[0] else { panic!("a lamp") };
        for technique in TECHNIQUES.names() {
            let seen = Seen::of(&scene, technique);
            let (mut brightest, mut compared) = (0.0_f64, 0);
            for (k, p, n) in seen.surfaces() {
                let (mut expected, cos) = lamp(&scene.lights[0], p, n);
                expected *= libm::exp(-sigma * f64::from(p.distance(position)));
                brightest = brightest.max(expected);
                // Light that is more oblique changes much within a pixel, and at the edge of the spot.
                if cos > 0.1 {
                    compared += 1;
                    let off = (seen.direct[k] - expected).abs();
                    assert!(off < 0.02 * expected, "{technique} {edits:?}: {} in place of {expected} at {p}", seen.direct[k]);
                }
            }
            let straight_below = 62.5 * libm::exp(-0.4 * sigma);
            assert!(compared > 1000 && (brightest / straight_below - 1.0).abs() < 0.02, "{technique} {edits:?}: {compared} {brightest}");
        }
    }
}

#[test]
fn a_lamp_in_the_water_casts_shadows_all_around() {
    // Four posts of 10 cm stand around the lamp, 50 cm away: behind them, and only there, the floor is dark.
    let posts: String = [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)]
        .map(|(x, z)| format!(", (shape: Cuboid(size_m: (0.1, 0.8, 0.1)), transform: (translate: ({x}, -0.6, {z})))"))
        .concat();
    let edits: Edits<'_> = &[
        ("))])", &format!(")){posts}])")),
        (
            "Perspective(position: (0, -0.3, 1.2), target: (0, -1, 0), fov_deg: 60)",
            "Orthographic(position: (0, 3, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 3)",
        ),
    ];
    let scene = edited("lamp_under_water.ron", edits);
    for technique in TECHNIQUES.names() {
        let seen = Seen::of(&scene, technique);
        let (mut dark, mut lit) = (0, 0);
        for (k, p, n) in seen.surfaces().filter(|(_, p, _)| p.y < -0.99) {
            let (x, z) = (p.x.abs().max(p.z.abs()), p.x.abs().min(p.z.abs()));
            // Across the axis the shadow is as wide as the post at its near side, 5 cm at 45 cm. Beyond 60 cm the floor is behind the post.
            let sideways = z / x * 0.45;
            let (expected, _) = lamp(&scene.lights[0], p, n);
            if x > 0.65 && sideways < 0.04 {
                dark += 1;
                assert_eq!(seen.direct[k], 0.0, "{technique}: light at {p}");
            } else if x < 0.4 || sideways > 0.06 {
                lit += 1;
                assert!((seen.direct[k] / expected - 1.0).abs() < 0.02, "{technique}: {} in place of {expected} at {p}", seen.direct[k]);
            }
        }
        assert!(dark > 200 && lit > 4000, "{technique}: {dark} {lit}");
    }
}

#[test]
fn what_a_trough_leaves_dry_is_lit_as_dry_things_are() {
    let circles = "CircularCosine(center_m: (0.3, 0.1), amplitude_m: 0.02, wavelength_m: 0.8)";
    let variants: [Edits<'_>; 5] = [
        &[],
        &[("direction_deg: 20", "direction_deg: 100"), ("amplitude_m: 0.02", "amplitude_m: 0.04")],
        &[("rotate_deg: (5, 0, 0)", "rotate_deg: (0, 0, -8)")],
        &[("Waves([(amplitude_m: 0.02, wavelength_m: 0.9, direction_deg: 20, motion: Steady)])", circles)],
        &[("size_m: (8, 8), grid", "level_m: 0.05, size_m: (8, 8), grid")],
    ];
    for edits in variants {
        let scene = edited("beach_waves.ron", edits);
        let water = scene.water.as_ref().expect("water");
        let surface = |p: Vec3| water.height_normal(p.x, p.z, scene.time_s).expect("a formula").0;
        for technique in TECHNIQUES.names() {
            let seen = Seen::of(&scene, technique);
            let (mut dry, mut low, mut wet, mut light) = (0, 0, 0, 0.0);
            for (k, p, n) in seen.surfaces() {
                let above = p.y - surface(p);
                // Around the line between wet and dry a pixel has both.
                if above > 0.002 {
                    let expected = f64::from(-scene.lights[0].incident(p).direction_ws.dot(n)).max(0.0);
                    assert!(
                        (seen.direct[k] - expected).abs() < 1e-4,
                        "{technique} {edits:?}: {} in place of {expected} at {p}",
                        seen.direct[k]
                    );
                    assert_eq!(seen.caustic[k], 0.0, "{technique} {edits:?}: caustics on dry sand at {p}");
                    dry += 1;
                    low += u32::from(p.y < water.level_m);
                } else if above < -0.002 {
                    assert_eq!(seen.direct[k], 0.0, "{technique} {edits:?}: direct light under water at {p}");
                    wet += 1;
                    light += seen.caustic[k];
                }
            }
            assert!(dry > 5000 && low > 300 && wet > 5000, "{technique} {edits:?}: {dry} {low} {wet}");
            // What enters is 0.98 of E cos; waves spread it.
            assert!((light / f64::from(wet) - 0.85).abs() < 0.06, "{technique} {edits:?}: {}", light / f64::from(wet));
        }
    }
}

#[test]
fn light_from_the_water_makes_caustics_above_it() {
    let variants: [(&str, Edits<'_>); 4] = [
        ("a lamp", &[]),
        ("a spot", &[("Point(position", "Spot(direction: (0.1, 1, 0), inner_deg: 30, outer_deg: 40, position")]),
        (
            "higher, in clear water",
            &[("level_m: 0", "level_m: -0.2"), ("medium: Custom(sigma_a: (0.4, 0.1, 0.05), sigma_s: (0, 0, 0))", "medium: Vacuum")],
        ),
        (
            "parallel light",
            &[
                ("Point(position: (0.1, -0.4, 0.05), intensity", "Directional(aim: Along((0.2, 1, 0.1)), irradiance"),
                ("size_m: (4, 4)), transform: (translate: (0, -1, 0))", "size_m: (0.3, 0.3)), transform: (translate: (0, -1, 0))"),
            ],
        ),
    ];
    for (name, edits) in variants {
        let scene = edited("lamp_below_ceiling.ron", edits);
        for technique in TECHNIQUES.names() {
            let ratio = Seen::of(&scene, technique).energy_ratio(&scene, 4 << 20, |p| p.y > 0.1);
            assert!((ratio - 1.0).abs() < 0.01, "{name}, {technique}: {ratio}");
        }
    }
}

#[test]
fn a_lamp_that_sinks_through_the_surface_has_the_light_of_photons() {
    // Through the surface within a few centimetres: what is on its other side gets all its light by caustics. Both sides have the same floor and camera,
    // so that the floor is the pool's while the lamp is above, and a ceiling while it is below.
    let moving = "motion: [(of: LightPosition(0), course: Keys([(0, (0.1, 0.5, 0.05)), (1, (0.1, -0.5, 0.05))]))],";
    for (time_s, height) in [(0.0, 0.5), (0.4, 0.1), (0.47, 0.03), (0.53, -0.03), (0.6, -0.1), (1.0, -0.5_f32)] {
        let (eye, floor) = if height > 0.0 { (1.55, -1) } else { (0.5, 1) };
        let scene = edited(
            "lamp_under_water.ron",
            &[
                ("image: (width: 96, height: 96),", &format!("image: (width: 128, height: 128), {moving}")),
                (
                    "Perspective(position: (0, -0.3, 1.2), target: (0, -1, 0), fov_deg: 60)",
                    &format!(
                        "Orthographic(position: (0, {eye}, 0), target: (0, {floor}, 0), up: (0, 0, -1), height_m: 4, near_m: 0.1, far_m: 10)"
                    ),
                ),
                (
                    "size_m: (8, 8), level_m: 0, ior: 1.333, grid: (33, 33), model: Flat",
                    "size_m: (4, 4), grid: (129, 129), model: Waves([(amplitude_m: 0.01, wavelength_m: 0.5, direction_deg: 20, motion: Steady)])",
                ),
                (
                    "size_m: (8, 8)), transform: (translate: (0, -1, 0))",
                    &format!("size_m: (4, 4)), transform: (translate: (0, {floor}, 0))"),
                ),
            ],
        );
        let now = scene.at(time_s).expect("a moment of the motion");
        let Light::Point { position, .. } = now.lights[0] else { panic!("a lamp") };
        assert!((position - Vec3::new(0.1, height, 0.05)).length() < 1e-6, "{position} at {time_s} s");
        for technique in TECHNIQUES.names() {
            let seen = Seen::of(&now, technique);
            let ratio = seen.energy_ratio(&now, 4 << 20, |_| true);
            assert!((ratio - 1.0).abs() < 0.01, "{technique} with the lamp at {height} m: {ratio}");
            assert!(seen.surfaces().all(|(k, _, _)| seen.direct[k] == 0.0), "{technique}: direct light through the surface");
        }
    }
}

#[test]
fn a_wall_close_behind_a_mirror_keeps_its_light() {
    let variants: [Edits<'_>; 4] = [
        &[],
        &[("-0.00511", "-0.00601")],
        &[("size_m: (16, 16)", "size_m: (200, 200)")],
        &[("(0.00002, 0.5, 0.5)), transform: (translate: (0, 0.6, 0))", "(0.00002, 0.5, 0.5)), transform: (translate: (0, 0.7, 0))")],
    ];
    for edits in variants {
        let scene = edited("wall_behind_mirror.ron", edits);
        for technique in ["light-volumes", "splatting"] {
            let ratio = Seen::of(&scene, technique).energy_ratio(&scene, 1 << 20, |_| true);
            assert!((ratio - 1.0).abs() < 0.01, "{technique} {edits:?}: {ratio}");
        }
    }
}

/// Replacements that leave water of 2 m x 2 m on a floor that goes on beside it, seen from straight above.
const SMALL: Edits<'_> = &[
    ("size_m: (8, 8), level_m: 0", "size_m: (2, 2), level_m: 0"),
    (
        "Perspective(position: (0, -0.3, 1.2), target: (0, -1, 0), fov_deg: 60)",
        "Orthographic(position: (0, 3, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 5)",
    ),
];

/// Whether a point is in the water's rectangle, and whether it is as near to its edge as a pixel.
fn place(p: Vec3) -> (bool, bool) {
    let far = p.x.abs().max(p.z.abs());
    (far < 1.0, (far - 1.0).abs() < 0.06)
}

#[test]
fn dry_ground_beside_the_water_below_a_lamp_in_it_is_lit_straight() {
    let waves = "model: Waves([(amplitude_m: 0.03, wavelength_m: 0.7, direction_deg: 20, motion: Steady)])";
    let variants: [(&str, Edits<'_>, f64); 7] = [
        ("a lamp", &[], 0.0),
        ("in water that absorbs", &[("medium: Vacuum", "medium: Custom(sigma_a: (0.7, 0.7, 0.7), sigma_s: (0, 0, 0))")], 0.7),
        ("under waves", &[("model: Flat", waves)], 0.0),
        (
            "a spot",
            &[("Point(position: (0, -0.6, 0), ", "Spot(position: (0, -0.6, 0), direction: (0, -1, 0), inner_deg: 88, outer_deg: 89, ")],
            0.0,
        ),
        ("off the middle", &[("(0, -0.6, 0), intensity", "(0.7, -0.3, -0.4), intensity")], 0.0),
        ("a floor that leans", &[("translate: (0, -1, 0)", "translate: (0, -1, 0), rotate_deg: (0, 0, 10)")], 0.0),
        // From 1.2 m beside the middle on the ground is above the water's level; light gets there through the surface, or past the water's edge.
        ("ground that rises above the water", &[("translate: (0, -1, 0)", "translate: (0, -1.2, 0), rotate_deg: (0, 0, 45)")], 0.0),
    ];
    for (name, edits, sigma) in variants {
        let scene = edited("lamp_under_water.ron", &[SMALL, edits].concat());
        let (Light::Point { position, .. } | Light::Spot { position, .. }) = scene.lights[0] else { panic!("a lamp") };
        for technique in TECHNIQUES.names() {
            let seen = Seen::of(&scene, technique);
            let (mut beside, mut above, mut wet) = (0, 0, 0);
            for (k, p, n) in seen.surfaces() {
                let (inside, at_edge) = place(p);
                let (mut expected, cos) = lamp(&scene.lights[0], p, n);
                expected *= libm::exp(-sigma * f64::from(p.distance(position)));
                // Where light that gets above the level is at the level: in the rectangle it has gone through the surface.
                let crosses = position + (p - position) * (-position.y / (p.y - position.y));
                if at_edge || cos < 0.1 || p.y > -0.05 && place(crosses).1 || inside && p.y > -0.05 {
                    continue;
                }
                if p.y > 0.05 && place(crosses).0 {
                    expected = 0.0;
                    above += 1;
                } else if inside {
                    wet += 1;
                } else {
                    beside += 1;
                    // A splat on ground above the level is some texels wide, and reaches a little below it.
                    if p.y < -0.4 {
                        assert_eq!(seen.caustic[k], 0.0, "{technique}, {name}: caustics at {p}");
                    }
                }
                let off = (seen.direct[k] - expected).abs();
                assert!(off < 0.02 * expected.max(1e-6), "{technique}, {name}: {} in place of {expected} at {p}", seen.direct[k]);
            }
            assert!(beside > 1000 && wet > 500, "{technique}, {name}: {beside} {above} {wet}");
            assert!((above > 100) == name.starts_with("ground that rises"), "{technique}, {name}: {above}");
        }
    }
}

#[test]
fn a_post_beside_the_water_is_shade_for_a_lamp_in_it() {
    // A post stands on the dry floor half a metre beside the water: behind it, and only there, it is dark.
    let post = ", (shape: Cuboid(size_m: (0.1, 0.9, 0.3)), transform: (translate: (1.5, -0.55, 0)))";
    let scene = edited("lamp_under_water.ron", &[SMALL, &[("))])", &format!(")){post}])")), ("height_m: 5", "height_m: 6")]].concat());
    for technique in TECHNIQUES.names() {
        let seen = Seen::of(&scene, technique);
        let (mut dark, mut lit) = (0, 0);
        for (k, p, n) in seen.surfaces().filter(|(_, p, _)| p.y < -0.99 && !place(*p).1) {
            // As seen from the lamp the post is 0.3 m wide at 1.45 m, and higher than the lamp.
            let sideways = p.z.abs() / p.x * 1.45;
            let (expected, _) = lamp(&scene.lights[0], p, n);
            if p.x > 1.65 && sideways < 0.12 {
                dark += 1;
                assert_eq!(seen.direct[k], 0.0, "{technique}: light at {p}");
            } else if p.x < 1.35 || sideways > 0.2 {
                lit += 1;
                assert!((seen.direct[k] / expected - 1.0).abs() < 0.02, "{technique}: {} in place of {expected} at {p}", seen.direct[k]);
            }
        }
        assert!(dark > 50 && lit > 3000, "{technique}: {dark} {lit}");
    }
}

/// What photons bring to dry ground beside the water is the light that the surface reflects: that of a lamp mirrored at it, by Fresnel's law.
#[test]
fn photons_beside_the_water_are_those_that_its_surface_reflects() {
    for edits in [&[][..], &[("(0, -0.6, 0), intensity", "(0.3, -0.4, 0.2), intensity")]] {
        let scene = edited("lamp_under_water.ron", &[SMALL, edits].concat());
        let Light::Point { position, intensity } = scene.lights[0] else { panic!("a lamp") };
        let mut points = Seen::of(&scene, "splatting").points;
        points.positions.iter_mut().for_each(|p| *p = p.filter(|p| !place(*p).0 && !place(*p).1));
        let mut tracer =
            Tracer::new(&scene, &TraceOptions { points: Some(points.clone()), ..TraceOptions::default() }).expect("can be traced");
        tracer.run(8 << 20);
        let measured = tracer.pixels().expect("points were asked for");
        let valid = measured.valid.as_ref().expect("points have a mask");
        let mirrored = DVec3::new(f64::from(position.x), -f64::from(position.y), f64::from(position.z));
        let reflected = |p: Vec3| {
            let to = p.as_dvec3() - mirrored;
            let at = mirrored + to * (mirrored.y / -to.y);
            let cos = -to.y / to.length();
            let sin = libm::sqrt(1.0 - cos * cos) * 1.333;
            let reflectance = if sin >= 1.0 {
                1.0
            } else {
                let t = libm::sqrt(1.0 - sin * sin);
                let (s, p) = ((1.333 * cos - t) / (1.333 * cos + t), (1.333 * t - cos) / (1.333 * t + cos));
                0.5 * (s * s + p * p)
            };
            let inside = at.x.abs().max(at.z.abs()) < 1.0;
            if inside { reflectance * f64::from(intensity.x) * cos / to.length_squared() } else { 0.0 }
        };
        let (mut traced, mut expected, mut compared) = (0.0, 0.0, 0);
        for (k, p) in points.positions.iter().enumerate() {
            if let (Some(p), true) = (p, valid[k]) {
                traced += measured.mean[k][0];
                expected += reflected(*p);
                compared += 1;
            }
        }
        assert!(compared > 2000 && expected > 0.0 && (traced / expected - 1.0).abs() < 0.01, "{compared}: {traced} {expected}");
    }
}
