//! The keys of `--set KEY=VALUE`: one table, from which the command line, `nephroid list settings`, the docs and the tests are made.
//!
//! A key that names something the scene does not have (`water.grid` of a dry scene) reads as `None` and cannot be set. Setting is all or
//! nothing: the changed scene is validated as a whole, and a refused value leaves it as it was.

use glam::Vec3;

use super::camera::Camera;
use super::check::Invalid;
use super::description::Scene;
use super::environment::SunDisc;
use super::light::{Aim, Light};
use super::medium::Medium;
use super::names::nearest;
use super::settings::{BeamCulling, BeamShadows, EnergyAt, EyeRefraction, Faces, Gather, Radiometry};
use super::trace::MeasuringPlane;
use super::water::{AxisCosine, CircularCosine, OceanSettings, Water, WaterModel};

/// One key: what it means, and how to read and write it.
pub struct Setting {
    /// Its name, as in `--set KEY=VALUE`.
    pub key: &'static str,
    /// What it sets, in one sentence.
    pub doc: &'static str,
    /// The unit of its value; empty for pure numbers and names.
    pub unit: &'static str,
    /// The value of a scene file that does not mention it; `-` where the file must.
    pub default: &'static str,
    /// The values allowed.
    pub allowed: &'static str,
    /// The scene's value, written so that `set` reads it back; `None` where the scene has nothing of the kind.
    pub get: fn(&Scene) -> Option<String>,
    /// Writes a value into the scene, without checking its range.
    pub set: fn(&mut Scene, &str) -> Result<(), Refusal>,
}

/// Why a setter wrote nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The text is no value of the key's type.
    Unreadable,
    /// The scene has nothing that the key could change; the text says what is missing.
    Absent(&'static str),
}

/// Why a setting was refused; the scene is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// There is no such key.
    #[error("unknown setting `{key}`{}; `nephroid list settings` shows all {count}", .nearest.map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default())]
    UnknownKey {
        /// The key seen.
        key: String,
        /// The key that was perhaps meant.
        nearest: Option<&'static str>,
        /// How many keys there are.
        count: usize,
    },
    /// The value is of the wrong kind or outside of its range.
    #[error("setting `{key}`: found `{found}`, expected {allowed}")]
    Value {
        /// The key.
        key: &'static str,
        /// The value seen.
        found: String,
        /// The values allowed.
        allowed: String,
    },
    /// The value is allowed by itself, but not together with the rest of the scene.
    #[error("setting `{key}` to `{found}`: {conflict}")]
    Conflict {
        /// The key.
        key: &'static str,
        /// The value seen.
        found: String,
        /// Which value of the scene is no longer allowed.
        conflict: Invalid,
    },
    /// The scene has nothing that this key could change.
    #[error("setting `{key}`: the scene has no {missing}")]
    Absent {
        /// The key.
        key: &'static str,
        /// What is missing.
        missing: &'static str,
    },
    /// There is no `=` in `KEY=VALUE`.
    #[error("setting `{0}`: expected KEY=VALUE")]
    NoValue(String),
}

impl Scene {
    /// Sets `key` to `value`, both as on the command line; see [`SETTINGS`].
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SettingError> {
        let setting = find(key)?;
        let refused = |refusal| match refusal {
            Refusal::Unreadable => SettingError::Value { key: setting.key, found: value.to_owned(), allowed: setting.allowed.to_owned() },
            Refusal::Absent(missing) => SettingError::Absent { key: setting.key, missing },
        };
        let mut changed = self.clone();
        (setting.set)(&mut changed, value.trim()).map_err(refused)?;
        match changed.validate() {
            Ok(()) => {
                *self = changed;
                Ok(())
            }
            Err(conflict) => Err(SettingError::Conflict { key: setting.key, found: value.to_owned(), conflict }),
        }
    }

    /// Sets what `assignment`, such as `time_s=1.5`, says.
    pub fn set_assignment(&mut self, assignment: &str) -> Result<(), SettingError> {
        let (key, value) = assignment.split_once('=').ok_or_else(|| SettingError::NoValue(assignment.to_owned()))?;
        self.set(key.trim(), value)
    }

    /// The value of `key`, written so that [`Scene::set`] reads it back; `None` where the scene has nothing of the kind.
    pub fn get(&self, key: &str) -> Result<Option<String>, SettingError> {
        Ok((find(key)?.get)(self))
    }
}

/// The setting called `key`; `-` and `_` are the same.
fn find(key: &str) -> Result<&'static Setting, SettingError> {
    let wanted = key.replace('-', "_");
    let keys = || SETTINGS.iter().map(|setting| setting.key);
    let only_longer = || {
        let mut longer = keys().filter(|key| !wanted.is_empty() && key.starts_with(&wanted));
        longer.next().filter(|_| longer.next().is_none())
    };
    // A key without its group, `radiometry` or `exposure_ev`, is the likeliest slip after one of the fingers.
    let by_last_part = || {
        let last_part = |key: &'static str| key.rsplit('.').next().unwrap_or(key);
        let meant = nearest(wanted.rsplit('.').next().unwrap_or(&wanted), keys().map(last_part))?;
        keys().find(|key| last_part(key) == meant)
    };
    SETTINGS.iter().find(|setting| setting.key == wanted).ok_or_else(|| SettingError::UnknownKey {
        key: key.to_owned(),
        nearest: only_longer().or_else(|| nearest(&wanted, keys())).or_else(by_last_part),
        count: SETTINGS.len(),
    })
}

/// A kind of value that can be read from and written to the command line.
trait Value: Sized {
    fn read(text: &str) -> Option<Self>;
    fn write(&self) -> String;
}

impl Value for f32 {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok().filter(|value: &f32| value.is_finite())
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

impl Value for u32 {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok()
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

impl Value for bool {
    fn read(text: &str) -> Option<Self> {
        match text {
            "true" | "on" | "yes" => Some(true),
            "false" | "off" | "no" => Some(false),
            _ => None,
        }
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

impl Value for Vec3 {
    /// `r,g,b`, or one number for all three.
    fn read(text: &str) -> Option<Self> {
        let numbers: Option<Vec<f32>> = text.split(',').map(|part| f32::read(part.trim())).collect();
        match *numbers?.as_slice() {
            [all] => Some(Vec3::splat(all)),
            [x, y, z] => Some(Vec3::new(x, y, z)),
            _ => None,
        }
    }

    fn write(&self) -> String {
        format!("{},{},{}", self.x, self.y, self.z)
    }
}

impl Value for (u32, u32) {
    /// `128x64`.
    fn read(text: &str) -> Option<Self> {
        let (first, second) = text.split_once('x')?;
        Some((first.trim().parse().ok()?, second.trim().parse().ok()?))
    }

    fn write(&self) -> String {
        format!("{}x{}", self.0, self.1)
    }
}

impl Value for Option<(u32, u32)> {
    /// `none` or `128x64`.
    fn read(text: &str) -> Option<Self> {
        if text.eq_ignore_ascii_case("none") { Some(None) } else { Value::read(text).map(Some) }
    }

    fn write(&self) -> String {
        self.map_or_else(|| "none".to_owned(), |size| size.write())
    }
}

impl Value for Option<MeasuringPlane> {
    /// `none` or `0,0,0;1,0,0;0,0,1;64x32`: corner, u, v and texels.
    fn read(text: &str) -> Option<Self> {
        if text.eq_ignore_ascii_case("none") {
            return Some(None);
        }
        let parts: Vec<&str> = text.split(';').map(str::trim).collect();
        let [corner, u, v, texels] = *parts.as_slice() else { return None };
        Some(Some(MeasuringPlane { corner: Value::read(corner)?, u: Value::read(u)?, v: Value::read(v)?, texels: Value::read(texels)? }))
    }

    fn write(&self) -> String {
        self.map_or_else(|| "none".to_owned(), |p| format!("{};{};{};{}", p.corner.write(), p.u.write(), p.v.write(), p.texels.write()))
    }
}

/// Values that are one of a few names, in any case, with or without `-` and `_`.
macro_rules! named_values {
    ($type:ty: $($name:literal = $value:expr),+ $(,)?) => {
        impl Value for $type {
            fn read(text: &str) -> Option<Self> {
                let text: String = text.chars().filter(|c| !matches!(c, '-' | '_')).collect();
                $(if text.eq_ignore_ascii_case(&$name.replace('_', "")) { return Some($value); })+
                None
            }

            fn write(&self) -> String {
                $(if *self == $value { return $name.to_owned(); })+
                String::new()
            }
        }
    };
}

named_values!(Radiometry: "paper" = Radiometry::Paper, "physical" = Radiometry::Physical);
named_values!(EyeRefraction: "virtual_plane" = EyeRefraction::VirtualPlane, "snell" = EyeRefraction::Snell);
named_values!(Faces: "front" = Faces::Front, "back" = Faces::Back);
named_values!(Gather: "flat_water" = Gather::FlatWater, "vector" = Gather::Vector, "per_beam" = Gather::PerBeam);
named_values!(EnergyAt: "face" = EnergyAt::Face, "receiver" = EnergyAt::Receiver);
named_values!(BeamCulling: "off" = BeamCulling::Off, "per_beam" = BeamCulling::PerBeam, "hierarchical" = BeamCulling::Hierarchical);
named_values!(
    BeamShadows: "off" = BeamShadows::Off, "vertices" = BeamShadows::Vertices, "culling" = BeamShadows::Culling, "both" = BeamShadows::Both
);

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
            default: $default,
            allowed: $allowed,
            get: |$scene| Some(Value::write(&$place)),
            set: |$scene, text| write_to(&mut $place, text),
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
            default: $default,
            allowed: $allowed,
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

/// Every key of `--set`, in the order in which they are listed.
pub const SETTINGS: &[Setting] = &[
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
        default: "-",
        allowed: "a number from -360 to 360",
        get: |scene| sun_aim(scene).map(|aim| aim.angles_deg().0.write()),
        set: |scene, text| set_sun_angle(scene, text, |azimuth, _, value| *azimuth = value),
    },
    Setting {
        key: "sun.elevation_deg",
        doc: "Height of the first directional light over the horizon.",
        unit: "degrees",
        default: "-",
        allowed: "a number from -90 to 90",
        get: |scene| sun_aim(scene).map(|aim| aim.angles_deg().1.write()),
        set: |scene, text| set_sun_angle(scene, text, |_, elevation, value| *elevation = value),
    },
    Setting {
        key: "sun.irradiance",
        doc: "Irradiance of the first directional light on a surface perpendicular to it.",
        unit: "W/m²",
        default: "-",
        allowed: "r,g,b or one number, each from 0 to 1e12",
        get: |scene| match scene.sun() {
            Some((_, Light::Directional { irradiance, .. })) => Some(irradiance.write()),
            _ => None,
        },
        set: |scene, text| match sun_mut(scene) {
            Some(Light::Directional { irradiance, .. }) => write_to(irradiance, text),
            _ => Err(Refusal::Absent(NO_SUN)),
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
        default: "Clear",
        allowed: "one of Vacuum, Clear, Pool, Coastal",
        get: |scene| scene.medium.preset().map(str::to_owned),
        set: |scene, text| {
            let named = Medium::PRESETS.iter().find(|(name, _)| name.eq_ignore_ascii_case(text));
            scene.medium = named.ok_or(Refusal::Unreadable)?.1;
            Ok(())
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
    field!(
        "caustic_volumes.radiometry",
        "",
        "physical",
        "one of paper, physical",
        "Whether light is counted as the paper prints it, or so that none is made or lost.",
        |scene| scene.techniques.caustic_volumes.radiometry
    ),
    field!(
        "caustic_volumes.grid",
        "vertices",
        "none",
        "none, or COLUMNSxROWS with each from 2 to 4096",
        "Grid of the water mesh that makes the volumes, in place of the water's own.",
        |scene| scene.techniques.caustic_volumes.grid
    ),
    field!(
        "caustic_volumes.depth_below_floor_m",
        "m",
        "0.05",
        "a number from 0 to 1e6",
        "How far the volumes reach below the lowest receiver.",
        |scene| scene.techniques.caustic_volumes.depth_below_floor_m
    ),
    field!(
        "caustic_volumes.negligible_light",
        "",
        "0.001",
        "a number from 0 to 0.5",
        "Share of the light, after absorption, below which a volume is cut off.",
        |scene| scene.techniques.caustic_volumes.negligible_light
    ),
    field!(
        "caustic_volumes.eye_refraction",
        "",
        "snell",
        "one of virtual_plane, snell",
        "How the eye sees through the water surface.",
        |scene| scene.techniques.caustic_volumes.eye_refraction
    ),
    field!(
        "caustic_volumes.underwater_shadows",
        "",
        "true",
        "true or false",
        "Whether objects under water cut off the light behind them.",
        |scene| scene.techniques.caustic_volumes.underwater_shadows
    ),
    field!(
        "caustic_volumes.surface_shadows",
        "",
        "true",
        "true or false",
        "Whether objects above the water cut off the light before it enters.",
        |scene| scene.techniques.caustic_volumes.surface_shadows
    ),
    field!(
        "caustic_volumes.shadow_map_size",
        "texels",
        "2048",
        "a whole number from 16 to 16384",
        "Width and height of the shadow maps.",
        |scene| scene.techniques.caustic_volumes.shadow_map_size
    ),
    field!("caustic_volumes.faces", "", "back", "one of front, back", "Which faces of the volumes are rasterized.", |scene| scene
        .techniques
        .caustic_volumes
        .faces),
    field!("caustic_volumes.samples", "", "1", "a whole number from 1 to 8", "Samples along each side of a pixel.", |scene| scene
        .techniques
        .caustic_volumes
        .samples),
    field!(
        "light_volumes.radiometry",
        "",
        "physical",
        "one of paper, physical",
        "Whether light is counted as the paper prints it, or so that none is made or lost.",
        |scene| scene.techniques.light_volumes.radiometry
    ),
    field!(
        "light_volumes.gather",
        "",
        "per_beam",
        "one of flat_water, vector, per_beam",
        "How the light of many beams is added up at a receiver.",
        |scene| scene.techniques.light_volumes.gather
    ),
    field!("light_volumes.energy", "", "receiver", "one of face, receiver", "Where the light of a beam is computed.", |scene| scene
        .techniques
        .light_volumes
        .energy),
    field!(
        "light_volumes.grid",
        "vertices",
        "none",
        "none, or COLUMNSxROWS with each from 2 to 4096",
        "Grid of the water mesh that makes the beams, in place of the water's own.",
        |scene| scene.techniques.light_volumes.grid
    ),
    field!(
        "light_volumes.generator_edge",
        "",
        "0.02",
        "a number from 0.001 to 1",
        "Longest edge of the triangles of mirrors and glass that make beams, as a share of the object's size.",
        |scene| scene.techniques.light_volumes.generator_edge
    ),
    field!("light_volumes.planes", "", "9", "a whole number from 2 to 64", "Slicing planes, the surface among them.", |scene| scene
        .techniques
        .light_volumes
        .planes),
    field!(
        "light_volumes.depth_below_floor_m",
        "m",
        "0.05",
        "a number from 0 to 1e6",
        "How far the lowest slicing plane lies below the lowest receiver.",
        |scene| scene.techniques.light_volumes.depth_below_floor_m
    ),
    field!(
        "light_volumes.culling",
        "",
        "hierarchical",
        "one of off, per_beam, hierarchical",
        "How beams that need not be drawn are found.",
        |scene| scene.techniques.light_volumes.culling
    ),
    field!(
        "light_volumes.clamping",
        "",
        "true",
        "true or false",
        "Whether beams are drawn only where the boxes of receivers are.",
        |scene| scene.techniques.light_volumes.clamping
    ),
    field!(
        "light_volumes.receiver_culling",
        "",
        "false",
        "true or false",
        "Whether receivers that others hide from the eye are left out of clamping.",
        |scene| scene.techniques.light_volumes.receiver_culling
    ),
    field!("light_volumes.buckets", "quadtrees", "4x4", "COLUMNSxROWS, each from 1 to 64", "Quadtrees along x and z.", |scene| scene
        .techniques
        .light_volumes
        .buckets),
    field!("light_volumes.levels", "", "3", "a whole number from 0 to 8", "How often each quadtree is cut.", |scene| scene
        .techniques
        .light_volumes
        .levels),
    field!(
        "light_volumes.shadows",
        "",
        "both",
        "one of off, vertices, culling, both",
        "How objects above the water cut off beams.",
        |scene| scene.techniques.light_volumes.shadows
    ),
    field!(
        "light_volumes.least_shadow",
        "",
        "0.98",
        "a number from 0 to 1",
        "Share of a leaf that must be in shadow for it to be culled.",
        |scene| scene.techniques.light_volumes.least_shadow
    ),
    field!(
        "light_volumes.eye_refraction",
        "",
        "snell",
        "one of virtual_plane, snell",
        "How the eye sees through the water surface.",
        |scene| scene.techniques.light_volumes.eye_refraction
    ),
    field!(
        "light_volumes.underwater_shadows",
        "",
        "true",
        "true or false",
        "Whether objects under water cut off the light behind them.",
        |scene| scene.techniques.light_volumes.underwater_shadows
    ),
    field!(
        "light_volumes.shadow_map_size",
        "texels",
        "2048",
        "a whole number from 16 to 16384",
        "Width and height of the shadow maps.",
        |scene| scene.techniques.light_volumes.shadow_map_size
    ),
    field!("light_volumes.samples", "", "1", "a whole number from 1 to 8", "Samples along each side of a pixel.", |scene| scene
        .techniques
        .light_volumes
        .samples),
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
        default: "none",
        allowed: "none, or x,y,z;x,y,z;x,y,z;COLUMNSxROWS with each count from 1 to 8192",
        get: |scene| Some(scene.trace.plane.write()),
        set: |scene, text| write_to(&mut scene.trace.plane, text),
    },
    Setting {
        key: "trace.beam_width_m",
        doc: "Width over which the ground truth spreads the light of one photon's path across the view.",
        unit: "m",
        default: "none",
        allowed: "none, or a number above 0, at most 1000",
        get: |scene| Some(scene.trace.beam_width_m.map_or_else(|| "none".to_owned(), |width| width.write())),
        set: |scene, text| {
            let none = text.eq_ignore_ascii_case("none");
            scene.trace.beam_width_m = if none { None } else { Some(f32::read(text).ok_or(Refusal::Unreadable)?) };
            Ok(())
        },
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

#[cfg(test)]
#[path = "keys_tests.rs"]
mod tests;
