//! The same scene elsewhere and at another scale: the same picture, with the light of photons.

use std::path::Path;

use glam::Vec3;
use nephroid::caustics::TECHNIQUES;
use nephroid::scene::Scene;

use crate::support::path;
use crate::waterside::{Seen, edited, text_of};

/// The text of a scene with all lengths and places times a number, and the intensity of lamps times its square, so that it looks the same.
fn scaled(text: &str, scale: f64) -> String {
    let factor = |key: &str| match key {
        _ if key.ends_with("_m") => Some(scale),
        "position" | "target" | "translate" => Some(scale),
        "intensity" => Some(scale * scale),
        _ => None,
    };
    let text: String = text.lines().map(|line| line.split("//").next().unwrap_or_default()).flat_map(|line| [line, "\n"]).collect();
    let (mut out, mut rest) = (String::new(), text.as_str());
    while let Some(colon) = rest.find(':') {
        let (before, after) = rest.split_at(colon + 1);
        out.push_str(before);
        let key = before.trim_end_matches(':').rsplit(|c: char| !c.is_ascii_alphanumeric() && c != '_').next().unwrap_or_default();
        // The value: up to the end of its parentheses, or of the number.
        let mut depth = 0;
        let end = after
            .find(|c: char| {
                depth += i32::from(c == '(' || c == '[') - i32::from(c == ')' || c == ']');
                depth < 0 || depth == 0 && (c == ',' || c == '\n')
            })
            .unwrap_or(after.len());
        let Some(factor) = factor(key) else {
            rest = after;
            continue;
        };
        let mut number = String::new();
        for c in after[..end].chars().chain([' ']) {
            if c.is_ascii_digit() || "+-.e".contains(c) {
                number.push(c);
            } else {
                if !number.is_empty() {
                    let value: f64 = number.parse().unwrap_or_else(|_| panic!("{key}: {number}"));
                    out.push_str(&format!("{:e}", value * factor));
                    number.clear();
                }
                out.push(c);
            }
        }
        rest = &after[end..];
    }
    out + rest
}

fn parse(text: &str, name: &str) -> Scene {
    TECHNIQUES.parse(text, name, Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

/// Greatest and mean difference of the light of two pictures, as a share of the mean light of the first one.
fn difference(a: &Seen, b: &Seen) -> (f64, f64) {
    let sums = a.direct.iter().zip(&a.caustic).map(|(d, c)| d + c).zip(b.direct.iter().zip(&b.caustic).map(|(d, c)| d + c));
    let (mut light, mut off, mut most) = (0.0, 0.0, 0.0_f64);
    for (a, b) in sums {
        light += a;
        off += (a - b).abs();
        most = most.max((a - b).abs());
    }
    (most / (light / a.direct.len() as f64), off / light)
}

#[test]
fn the_same_picture_far_from_the_origin() {
    // At 100 km coordinates are multiples of 1/128 m: what is to be the same is at such places.
    const POST: (f64, f64, f64) = (0.3125, -0.75, 0.0);
    let post = |(x, y, z): (f64, f64, f64)| format!("({}, {}, {})", POST.0 + x, POST.1 + y, POST.2 + z);
    let here = edited("at_origin.ron", &[("(0.3,-0.8,0)", &post((0.0, 0.0, 0.0)))]);
    let places = [(20_000.0, 0.0, 10_000.0), (100_000.0, 0.0, -40_000.0), (-3_000.0, 800.0, 50.0), (0.0, -20_000.0, 0.0), (64.0, 8.0, 1e5)];
    for technique in TECHNIQUES.names() {
        let at_origin = Seen::of(&here, technique);
        for (x, y, z) in places {
            let moved = |a: f64, b: f64, c: f64| format!("({}, {}, {})", a + x, b + y, c + z);
            let there = edited(
                "at_origin.ron",
                &[
                    ("(0, 3, 0), target: (0, 0, 0)", &format!("{}, target: {}", moved(0.0, 3.0, 0.0), moved(0.0, 0.0, 0.0))),
                    ("center_m: (0,0)", &format!("center_m: ({x}, {z}), level_m: {y}")),
                    ("(0,-1,0)", &moved(0.0, -1.0, 0.0)),
                    ("(0.3,-0.8,0)", &post((x, y, z))),
                ],
            );
            let (most, mean) = difference(&at_origin, &Seen::of(&there, technique));
            // A photon of `splatting` may find another texel of the background.
            let same = if technique == "splatting" { 1e-4 } else { 1e-5 };
            assert!(mean < same, "{technique} at {x} {y} {z}: {mean:e}, at most {most:e}");
        }
    }
    // The handed scene, against photons.
    let far = edited("far_from_origin.ron", &[]);
    for technique in TECHNIQUES.names() {
        let ratio = Seen::of(&far, technique).energy_ratio(&far, 4 << 20, |_| true);
        assert!((ratio - 1.0).abs() < 0.01, "{technique}: {ratio}");
    }
}

#[test]
fn the_same_picture_at_every_scale() {
    let text = text_of("at_origin.ron");
    let lamp = text.replace("lights: [", "lights: [Point(position: (0.3, 1, 0.2), intensity: (1, 1, 1)), ");
    let sunken = text.replace("lights: [", "lights: [Point(position: (-0.2, -0.5, 0.2), intensity: (1, 1, 1)), ");
    let glass = std::fs::read_to_string(path("scenes/ball.ron")).expect("a shipped scene");
    for (name, text) in [("sun", &text), ("lamp", &lamp), ("lamp in the water", &sunken), ("glass", &glass)] {
        for technique in TECHNIQUES.names() {
            let of = |scale: f64| {
                let mut scene = parse(&scaled(text, scale), name);
                (scene.image.width, scene.image.height) = (128, 80);
                Seen::of(&scene, technique)
            };
            let as_it_is = of(1.0);
            for scale in [0.1, 0.01, 0.001, 1000.0] {
                let (most, mean) = difference(&as_it_is, &of(scale));
                // Photons and beams beside an edge of glass may take another way.
                let same = match (name, technique) {
                    (_, "caustic-volumes") | ("sun" | "lamp" | "lamp in the water", "light-volumes") => 1e-5,
                    // Exact photons meet up to 64 surfaces: near an edge of one of them the last place decides.
                    ("glass", "splatting") => 6e-3,
                    ("glass", _) => 2e-3,
                    _ => 1e-4,
                };
                assert!(mean < same, "{name}, {technique} at 1:{}: {mean:e}, at most {most:e}", 1.0 / scale);
            }
        }
    }
}

/// A pool with bodies, rain and shadows, moved and made small.
#[test]
fn the_pool_elsewhere_has_the_light_of_photons() {
    let text = std::fs::read_to_string(path("scenes/pool.ron")).expect("a shipped scene");
    let far = |scene: &mut Scene, by: Vec3| {
        let nephroid::scene::Camera::Perspective { position, target, .. } = &mut scene.camera else { panic!("a perspective") };
        *position += by;
        *target += by;
        let water = scene.water.as_mut().expect("water");
        water.center_m += Vec3::new(by.x, by.z, 0.0).truncate();
        water.level_m += by.y;
        scene.objects.iter_mut().for_each(|object| object.transform.translate += by);
    };
    // Far away and small at once: relative to its size, 100 m are to this pool what 100 km are to that of the file.
    let mut scene = parse(&scaled(&text, 0.001), "pool");
    far(&mut scene, Vec3::new(100.0, 0.0, 0.0));
    // Focal lines are as thin as a pixel: in a smaller picture the ratio has noise of a percent.
    (scene.image.width, scene.image.height) = (640, 360);
    for technique in TECHNIQUES.names() {
        let ratio = Seen::of(&scene, technique).energy_ratio(&scene, 4 << 20, |_| true);
        // Photons of `splatting` that the search in image space does not find again are lost.
        let within = if technique == "splatting" { 0.015 } else { 0.01 };
        assert!((ratio - 1.0).abs() < within, "{technique}: {ratio}");
    }
}
