//! The keys of what every scene has: one row each.

use std::borrow::Cow;

use super::value::Value;
use super::{Place, Refusal, Setting};
use crate::camera::Camera;
use crate::description::Scene;
use crate::environment::SunDisc;
use crate::light::{Aim, Light};
use crate::medium::Medium;
use crate::water::{AxisCosine, CircularCosine, OceanSettings, Water, WaterModel};

fn write_to<T: Value>(target: &mut T, text: &str) -> Result<(), Refusal> {
    *target = T::read(text).ok_or(Refusal::Unreadable)?;
    Ok(())
}

/// A setting whose value is always there: `$place` is where, in terms of the scene `$scene`.
macro_rules! field {
    ($key:literal, $unit:literal, $default:literal, $allowed:literal, $doc:literal, |$scene:ident| $place:expr) => {
        Setting {
            key: $key,
            doc: $doc,
            unit: $unit,
            default: Cow::Borrowed($default),
            allowed: Cow::Borrowed($allowed),
            place: Place::Scene { get: |$scene| Some(Value::write(&$place)), set: |$scene, text| write_to(&mut $place, text) },
        }
    };
}

/// A setting that only some variants of an enum have: `$pattern` binds what `$place` is made of, `$missing` says what others lack.
macro_rules! part {
    (
        $key:literal, $unit:literal, $default:literal, $allowed:literal, $doc:literal, $missing:expr,
        |$scene:ident| $whole:expr, $pattern:pat => $place:expr
    ) => {
        Setting {
            key: $key,
            doc: $doc,
            unit: $unit,
            default: Cow::Borrowed($default),
            allowed: Cow::Borrowed($allowed),
            place: Place::Scene {
                get: |$scene| match &$whole {
                    $pattern => Some(Value::write(&$place)),
                    #[allow(unreachable_patterns, reason = "some fields are in every variant")]
                    _ => None,
                },
                set: |$scene, text| match &mut $whole {
                    $pattern => write_to(&mut $place, text),
                    #[allow(unreachable_patterns, reason = "some fields are in every variant")]
                    _ => Err(Refusal::Absent($missing)),
                },
            },
        }
    };
}

const NO_SUN: &str = "directional light";

/// The first directional light, to be changed.
fn sun_mut(scene: &mut Scene) -> Option<&mut Light> {
    scene.lights.iter_mut().find(|light| light.is_directional())
}

fn sun_aim(scene: &Scene) -> Option<Aim> {
    match scene.sun() {
        Some((_, Light::Directional { aim, .. })) => Some(*aim),
        _ => None,
    }
}

/// Changes azimuth or elevation of the sun; a direction given as a vector becomes a pair of angles.
fn set_sun_angle(scene: &mut Scene, text: &str, change: fn(&mut f32, &mut f32, f32)) -> Result<(), Refusal> {
    let value = f32::read(text).ok_or(Refusal::Unreadable)?;
    let Some(Light::Directional { aim, .. }) = sun_mut(scene) else { return Err(Refusal::Absent(NO_SUN)) };
    let (mut azimuth_deg, mut elevation_deg) = aim.angles_deg();
    change(&mut azimuth_deg, &mut elevation_deg, value);
    *aim = Aim::Sun { azimuth_deg, elevation_deg };
    Ok(())
}

const PERSPECTIVE: &str = "perspective camera";
const ORTHOGRAPHIC: &str = "orthographic camera";
const WATER: &str = "water";
const SUN_DISC: &str = "sun disc";

/// Keys of what is seen and how it is lit, in the order in which they are listed.
pub(super) const SCENE: &[Setting] = &[
    field!("time_s", "s", "0", "a number from 0 to 86400", "The moment shown, since the water was started.", |scene| scene.time_s),
    field!("image.width", "px", "1280", "a whole number from 1 to 16384", "Width of the picture.", |scene| scene.image.width),
    field!("image.height", "px", "720", "a whole number from 1 to 16384", "Height of the picture.", |scene| scene.image.height),
    part!("camera.position", "m", "-", "x,y,z, each from -1e6 to 1e6", "Where the eye is, in world space.", "camera",
        |scene| scene.camera, Camera::Perspective { position, .. } | Camera::Orthographic { position, .. } => *position),
    part!("camera.target", "m", "-", "x,y,z, each from -1e6 to 1e6", "The point the eye looks at, in world space.", "camera",
        |scene| scene.camera, Camera::Perspective { target, .. } | Camera::Orthographic { target, .. } => *target),
    part!("camera.up", "", "0,1,0", "x,y,z, not along the view", "Which way is up in the picture.", "camera",
        |scene| scene.camera, Camera::Perspective { up, .. } | Camera::Orthographic { up, .. } => *up),
    part!("camera.fov_deg", "degrees", "45", "a number from 1 to 170", "Vertical angle of view of a perspective camera.", PERSPECTIVE,
        |scene| scene.camera, Camera::Perspective { fov_deg, .. } => *fov_deg),
    part!("camera.height_m", "m", "-", "a number above 0, at most 1e6", "Height of the picture of an orthographic camera.", ORTHOGRAPHIC,
        |scene| scene.camera, Camera::Orthographic { height_m, .. } => *height_m),
    part!("camera.near_m", "m", "0.1", "a number from 0.0001 to 1e6, below camera.far_m", "Distance of the near plane.", "camera",
        |scene| scene.camera, Camera::Perspective { near_m, .. } | Camera::Orthographic { near_m, .. } => *near_m),
    part!("camera.far_m", "m", "100", "a number above camera.near_m, at most 1e6", "Distance of the far plane.", "camera",
        |scene| scene.camera, Camera::Perspective { far_m, .. } | Camera::Orthographic { far_m, .. } => *far_m),
    Setting {
        key: "sun.azimuth_deg",
        doc: "Compass direction of the first directional light: 0 stands at +x, 90 at +z.",
        unit: "degrees",
        default: Cow::Borrowed("-"),
        allowed: Cow::Borrowed("a number from -360 to 360"),
        place: Place::Scene {
            get: |scene| sun_aim(scene).map(|aim| aim.angles_deg().0.write()),
            set: |scene, text| set_sun_angle(scene, text, |azimuth, _, value| *azimuth = value),
        },
    },
    Setting {
        key: "sun.elevation_deg",
        doc: "Height of the first directional light over the horizon.",
        unit: "degrees",
        default: Cow::Borrowed("-"),
        allowed: Cow::Borrowed("a number from -90 to 90"),
        place: Place::Scene {
            get: |scene| sun_aim(scene).map(|aim| aim.angles_deg().1.write()),
            set: |scene, text| set_sun_angle(scene, text, |_, elevation, value| *elevation = value),
        },
    },
    Setting {
        key: "sun.irradiance",
        doc: "Irradiance of the first directional light on a surface perpendicular to it.",
        unit: "W/m²",
        default: Cow::Borrowed("-"),
        allowed: Cow::Borrowed("r,g,b or one number, each from 0 to 1e12"),
        place: Place::Scene {
            get: |scene| match scene.sun() {
                Some((_, Light::Directional { irradiance, .. })) => Some(irradiance.write()),
                _ => None,
            },
            set: |scene, text| match sun_mut(scene) {
                Some(Light::Directional { irradiance, .. }) => write_to(irradiance, text),
                _ => Err(Refusal::Absent(NO_SUN)),
            },
        },
    },
    field!(
        "environment.ambient_irradiance",
        "W/m²",
        "60,75,90",
        "r,g,b or one number, each from 0 to 1e12",
        "Irradiance that reaches every receiver from no direction in particular.",
        |scene| scene.environment.ambient_irradiance
    ),
    field!(
        "environment.zenith",
        "W/(m² sr)",
        "20,36,70",
        "r,g,b or one number, each from 0 to 1e12",
        "Radiance of the sky straight up.",
        |scene| scene.environment.zenith
    ),
    field!(
        "environment.horizon",
        "W/(m² sr)",
        "70,82,95",
        "r,g,b or one number, each from 0 to 1e12",
        "Radiance of the sky just above the horizon.",
        |scene| scene.environment.horizon
    ),
    field!(
        "environment.ground",
        "W/(m² sr)",
        "24,22,19",
        "r,g,b or one number, each from 0 to 1e12",
        "Radiance from below the horizon.",
        |scene| scene.environment.ground
    ),
    part!("environment.sun_disc.angular_radius_deg", "degrees", "0.2665", "a number from 0.01 to 45",
        "Half the angle that the sun's disc fills.", SUN_DISC,
        |scene| scene.environment.sun_disc, Some(SunDisc { angular_radius_deg, .. }) => *angular_radius_deg),
    part!("environment.sun_disc.radiance", "W/(m² sr)", "20000,19000,17000", "r,g,b or one number, each from 0 to 1e12",
        "Radiance of the sun's disc.", SUN_DISC,
        |scene| scene.environment.sun_disc, Some(SunDisc { radiance, .. }) => *radiance),
    part!("water.grid", "vertices", "64x64", "COLUMNSxROWS, each from 2 to 4096", "Vertices of the water's grid along x and z.", WATER,
        |scene| scene.water, Some(Water { grid, .. }) => *grid),
    part!("water.level_m", "m", "0", "a number from -1e6 to 1e6", "Height of the still water.", WATER,
        |scene| scene.water, Some(Water { level_m, .. }) => *level_m),
    part!("water.ior", "", "1.333", "a number from 0.25 to 4", "Refractive index of the water, relative to the air.", WATER,
        |scene| scene.water, Some(Water { ior, .. }) => *ior),
    part!("water.scale", "", "1", "a number from 0 to 100", "Factor on the waves of the models that have one.",
        "water of the models CircularCosine, AxisCosine or FftOcean",
        |scene| scene.water, Some(Water {
            model: WaterModel::CircularCosine(CircularCosine { scale, .. })
                | WaterModel::AxisCosine(AxisCosine { scale, .. })
                | WaterModel::FftOcean(OceanSettings { scale, .. }),
            ..
        }) => *scale),
    Setting {
        key: "medium.preset",
        doc: "The whole medium by name; reads as nothing for a medium that is none of these.",
        unit: "",
        default: Cow::Borrowed("Clear"),
        allowed: Cow::Borrowed("one of Vacuum, Clear, Pool, Coastal"),
        place: Place::Scene {
            get: |scene| scene.medium.preset().map(str::to_owned),
            set: |scene, text| {
                let named = Medium::PRESETS.iter().find(|(name, _)| name.eq_ignore_ascii_case(text));
                scene.medium = named.ok_or(Refusal::Unreadable)?.1;
                Ok(())
            },
        },
    },
    field!(
        "medium.sigma_a",
        "1/m",
        "0.34,0.0565,0.00922",
        "r,g,b or one number, each from 0 to 1000",
        "Absorption coefficient of the water.",
        |scene| scene.medium.sigma_a
    ),
    field!(
        "medium.sigma_s",
        "1/m",
        "0.001,0.0019,0.0045",
        "r,g,b or one number, each from 0 to 1000",
        "Scattering coefficient of the water.",
        |scene| scene.medium.sigma_s
    ),
    field!("medium.g", "", "0", "a number above -1 and below 1", "Mean cosine of the phase function of the water.", |scene| scene.medium.g),
    field!("tone.exposure_ev", "stops", "-8", "a number from -40 to 40", "Exposure of the picture.", |scene| scene.tone.exposure_ev),
    field!("tone.shoulder", "", "0.3", "a number from 0 to 0.99", "Brightest exposed value that is shown unchanged.", |scene| scene
        .tone
        .shoulder),
    field!("tone.white", "", "16", "a number from 1 to 1e6", "Exposed value that becomes white.", |scene| scene.tone.white),
    field!("tone.desaturation", "", "0.15", "a number from 0 to 10", "How fast compressed highlights lose saturation.", |scene| scene
        .tone
        .desaturation),
];

/// Keys of the ground truth.
pub(super) const TRACE: &[Setting] = &[
    field!(
        "trace.grid",
        "vertices",
        "none",
        "none, or COLUMNSxROWS with each from 2 to 4096",
        "Water mesh that the ground truth's light meets, in place of the exact surface.",
        |scene| scene.trace.grid
    ),
    Setting {
        key: "trace.plane",
        doc: "A rectangle over which the ground truth measures irradiance: its corner, its two sides, and the texels along each.",
        unit: "m, m, m, texels",
        default: Cow::Borrowed("none"),
        allowed: Cow::Borrowed("none, or x,y,z;x,y,z;x,y,z;COLUMNSxROWS with each count from 1 to 8192"),
        place: Place::Scene { get: |scene| Some(scene.trace.plane.write()), set: |scene, text| write_to(&mut scene.trace.plane, text) },
    },
    field!(
        "trace.max_events",
        "",
        "1024",
        "a whole number from 1 to 65536",
        "Most surfaces that one photon of the ground truth may meet.",
        |scene| scene.trace.max_events
    ),
];
