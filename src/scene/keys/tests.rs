use std::path::Path;

use super::*;
use crate::Medium;
use crate::settings::tests::{Brush, PAINT, Paint};

/// A scene that has everything that a key can change, seen by `camera`.
fn scene(camera: &str) -> Scene {
    let text = format!(
        "(camera: {camera}, lights: [Point(position: (0, 1, 0), intensity: (1, 1, 1)), \
         Directional(aim: Along(0, -1, 0), irradiance: (1, 1, 1))], environment: (sun_disc: ()), \
         water: (model: AxisCosine()))"
    );
    crate::parse(&text, "keys", Path::new(""), PAINT).unwrap()
}

fn perspective() -> Scene {
    scene("Perspective(position: (0, 2, 5), target: (0, 0, 0))")
}

fn orthographic() -> Scene {
    scene("Orthographic(position: (0, 5, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 2)")
}

/// For every key: a value other than the default as it is read back, one of the wrong kind, and one out of range.
const SAMPLES: &[(&str, &str, &str, Option<&str>)] = &[
    ("time_s", "1.5", "soon", Some("-1")),
    ("image.width", "640", "1e3", Some("0")),
    ("image.height", "480", "-1", Some("16385")),
    ("camera.position", "1,2,3", "1,2", Some("2e6,0,0")),
    ("camera.target", "0.5,0,0", "1,2,3,4", Some("0,0,1e7")),
    ("camera.up", "0,1,1", "up", Some("0,0,0")),
    ("camera.fov_deg", "30", "wide", Some("0.5")),
    ("camera.height_m", "3.5", "tall", Some("0")),
    ("camera.near_m", "0.25", "", Some("200")),
    ("camera.far_m", "50", "inf", Some("0.01")),
    ("sun.azimuth_deg", "45", "north", Some("400")),
    ("sun.elevation_deg", "60", "high", Some("91")),
    ("sun.irradiance", "900,850,800", "1,2,3,4", Some("-1")),
    ("environment.ambient_irradiance", "1,2,3", "NaN", Some("-1")),
    ("environment.zenith", "1,2,3", "blue", Some("1,-2,3")),
    ("environment.horizon", "1,2,3", "1;2;3", Some("1,2,-3")),
    ("environment.ground", "1,2,3", "", Some("1e13")),
    ("environment.sun_disc.angular_radius_deg", "2", "small", Some("0")),
    ("environment.sun_disc.radiance", "5,6,7", "1,,2", Some("-5")),
    ("water.grid", "96x128", "96", Some("1x96")),
    ("water.level_m", "-0.5", "low", Some("1e9")),
    ("water.ior", "1.5", "glass", Some("0.1")),
    ("water.scale", "0.5", "half", Some("-1")),
    ("medium.preset", "Pool", "Mud", None),
    ("medium.sigma_a", "0.1,0.2,0.3", "1,2", Some("-0.1")),
    ("medium.sigma_s", "0.1,0.2,0.3", "x", Some("0,0,1001")),
    ("medium.g", "0.5", "forward", Some("1")),
    ("tone.exposure_ev", "2", "bright", Some("41")),
    ("tone.shoulder", "0.5", "x", Some("1")),
    ("tone.white", "4", "x", Some("0.5")),
    ("tone.desaturation", "1", "x", Some("-1")),
    ("paint.radiometry", "paper", "metric", None),
    ("paint.brush", "roller", "broom", None),
    ("paint.grid", "64x32", "64", Some("64x1")),
    ("paint.depth_below_floor", "0.5", "deep", Some("-1")),
    ("paint.coats", "3", "1.5", Some("10")),
    ("paint.drops", "2x8", "4", Some("0x4")),
    ("paint.dries", "false", "maybe", None),
    ("paint.samples", "2", "1.5", Some("9")),
    ("trace.grid", "64x32", "64", Some("64x1")),
    ("trace.plane", "0,-1,0;2,0,0;0,0,3;64x32", "0,0,0;1,0,0", Some("0,0,0;1,0,0;2,0,0;4x4")),
    ("trace.max_events", "8", "many", Some("0")),
];

/// Every key of these tests.
fn all() -> Vec<Setting> {
    settings(PAINT.iter().copied())
}

/// The scene that has something for `key` to change.
fn scene_for(key: &str) -> Scene {
    if key == "camera.height_m" { orthographic() } else { perspective() }
}

#[test]
fn settings_all_have_a_sample() {
    let keys: Vec<&str> = all().iter().map(|setting| setting.key).collect();
    assert_eq!(keys, SAMPLES.iter().map(|sample| sample.0).collect::<Vec<_>>());
}

#[test]
fn settings_read_back_what_was_set_and_change_nothing_else() {
    for &(key, value, ..) in SAMPLES {
        let mut scene = scene_for(key);
        let before: Vec<_> = all().iter().map(|setting| setting.get(&scene)).collect();
        scene.set(key, value).unwrap();
        assert_eq!(scene.get(key).unwrap().as_deref(), Some(value), "{key}");
        for (setting, before) in all().iter().zip(before) {
            // The medium's name and its coefficients are two ways to say the same.
            if setting.key != key && !(setting.key.starts_with("medium.") && key.starts_with("medium.")) {
                assert_eq!(setting.get(&scene), before, "{key} changed {}", setting.key);
            }
        }
    }
}

#[test]
fn settings_set_to_what_they_read_change_nothing() {
    for camera in [perspective(), orthographic()] {
        for setting in all() {
            let mut scene = camera.clone();
            let Some(value) = setting.get(&scene) else { continue };
            scene.set(setting.key, &value).unwrap();
            assert_eq!(setting.get(&scene).as_ref(), Some(&value), "{}", setting.key);
            if !setting.key.starts_with("sun.") {
                assert_eq!(scene, camera, "{}", setting.key);
            }
        }
    }
}

#[test]
fn settings_refuse_bad_values_and_leave_the_scene_alone() {
    for &(key, _, unreadable, out_of_range) in SAMPLES {
        let mut scene = scene_for(key);
        let before = scene.clone();
        let error = scene.set(key, unreadable).unwrap_err();
        assert!(matches!(&error, SettingError::Value { found, .. } if found == unreadable), "{error}");
        let allowed = all().iter().find(|setting| setting.key == key).unwrap().allowed.clone();
        assert!(error.to_string().contains(&*allowed), "{error}");
        if let Some(value) = out_of_range {
            let error = scene.set(key, value).unwrap_err();
            assert!(matches!(error, SettingError::Conflict { .. }), "{key}: {error}");
        }
        assert_eq!(scene, before, "{key}");
    }
}

#[test]
fn settings_name_their_default() {
    for setting in all().iter().filter(|setting| setting.default != "-") {
        let text =
            "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), environment: (sun_disc: ()), water: (model: AxisCosine()))";
        let scene = crate::parse(text, "defaults", Path::new(""), PAINT).unwrap();
        assert_eq!(setting.get(&scene).as_deref(), Some(&*setting.default), "{}", setting.key);
    }
}

#[test]
fn settings_are_documented() {
    for setting in all() {
        assert!(setting.doc.ends_with('.') && setting.doc.starts_with(char::is_uppercase), "{}", setting.key);
        assert!(!setting.allowed.is_empty() && !setting.default.is_empty(), "{}", setting.key);
    }
}

#[test]
fn set_tells_what_is_missing() {
    let mut dry = perspective();
    dry.water = None;
    dry.lights.clear();
    dry.environment.sun_disc = None;
    let message = |scene: &mut Scene, key: &str, value: &str| scene.set(key, value).unwrap_err().to_string();
    assert_eq!(message(&mut dry, "water.grid", "8x8"), "setting `water.grid`: the scene has no water");
    assert_eq!(message(&mut dry, "sun.elevation_deg", "8"), "setting `sun.elevation_deg`: the scene has no directional light");
    assert_eq!(
        message(&mut dry, "environment.sun_disc.radiance", "8"),
        "setting `environment.sun_disc.radiance`: the scene has no sun disc"
    );
    assert_eq!(message(&mut dry, "camera.height_m", "8"), "setting `camera.height_m`: the scene has no orthographic camera");
    assert_eq!(message(&mut orthographic(), "camera.fov_deg", "8"), "setting `camera.fov_deg`: the scene has no perspective camera");
    assert_eq!(dry.get("water.grid"), Ok(None));
}

#[test]
fn set_suggests_the_key_that_was_meant() {
    let nearest = |key: &str| match perspective().set(key, "1") {
        Err(SettingError::UnknownKey { nearest, .. }) => nearest,
        other => panic!("{other:?}"),
    };
    assert_eq!(nearest("camera.fov"), Some("camera.fov_deg"));
    assert_eq!(nearest("times"), Some("time_s"));
    assert_eq!(nearest("radiometry"), Some("paint.radiometry"));
    assert_eq!(nearest("exposure_ev"), Some("tone.exposure_ev"));
    assert_eq!(nearest("xyzzy"), None);
    let count = all().len();
    assert_eq!(
        perspective().set("image.widht", "1").unwrap_err().to_string(),
        format!("unknown setting `image.widht` (did you mean `image.width`?); `nephroid list settings` shows all {count}")
    );
}

#[test]
fn set_reads_assignments_in_the_spellings_of_the_command_line() {
    let mut scene = perspective();
    for assignment in ["paint.brush=ROLLER", "paint.brush=Flat-Brush", "time_s = 1.5 ", "medium.preset=coastal", "sun.irradiance=7"] {
        scene.set_assignment(assignment).unwrap();
    }
    assert_eq!(scene.techniques.get::<Paint>().brush, Brush::FlatBrush);
    assert_eq!((scene.time_s, scene.medium), (1.5, Medium::COASTAL));
    assert_eq!(scene.get("sun.irradiance").unwrap().unwrap(), "7,7,7");
    scene.set_assignment("paint.grid=none").unwrap();
    assert_eq!(scene.techniques.get::<Paint>().grid, None);
    assert_eq!(scene.set_assignment("time_s"), Err(SettingError::NoValue("time_s".to_owned())));
}
