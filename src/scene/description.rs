//! A whole scene, as plain data.

use glam::DVec3;
use serde::de::{Error, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::bridge;
use super::camera::Camera;
use super::check::{At, Invalid};
use super::environment::Environment;
use super::light::{Light, MAX_LIGHTS};
use super::medium::Medium;
use super::motion::{MAX_MOTIONS, Motion};
use super::object::Object;
use super::scene_file::SceneFile;
use super::settings::TechniqueSettings;
use super::smoke::Smoke;
use super::tone::ToneSettings;
use super::trace::TraceSettings;
use super::water::Water;

/// Most objects in one scene.
pub const MAX_OBJECTS: usize = 4096;

/// Most triangles of all procedural shapes of one scene together: some 2 GiB of vertices and indices.
pub const MAX_TRIANGLES: u64 = 1 << 25;

/// Largest width and height of an image, pixels.
pub const MAX_IMAGE_PX: u32 = 16384;

/// Largest time, s: a day, past which steps of a frame would no longer be exact in `f32`.
pub const MAX_TIME_S: f32 = 86400.0;

/// Everything a picture is made from. Read from a file by [`load`](super::load()), it is valid; a program that builds or changes one calls
/// [`Scene::validate`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// What the scene shows, in one line. Default: empty
    #[serde(default)]
    pub title: String,
    /// Size of the picture. Default: 1280 x 720
    #[serde(default)]
    pub image: Image,
    /// The eye.
    pub camera: Camera,
    /// Sources of light, at most 16. Default: none
    #[serde(default)]
    pub lights: Vec<Light>,
    /// Sky, ground and ambient light. Default: all its defaults
    #[serde(default)]
    pub environment: Environment,
    /// The body of water. Default: None, a dry scene
    #[serde(default)]
    pub water: Option<Water>,
    /// What the water is made of. Default: Clear
    #[serde(default)]
    pub medium: Medium,
    /// A box of smoke in the air. Default: None
    #[serde(default)]
    pub smoke: Option<Smoke>,
    /// What stands in the world, at most 4096 objects. Default: nothing
    #[serde(default, deserialize_with = "at_most_max_objects")]
    pub objects: Vec<Object>,
    /// What moves, at most 64 values. Default: nothing
    #[serde(default)]
    pub motion: Vec<Motion>,
    /// Exposure and tone curve. Default: all its defaults
    #[serde(default)]
    pub tone: ToneSettings,
    /// The moment shown, s since the water was started, from 0 to 86400. Default: 0
    #[serde(default)]
    pub time_s: f32,
    /// Settings of the techniques. [`load`](super::load()) reads them with the tables it is given; `serde` alone leaves the defaults.
    /// Default: all their defaults
    #[serde(default, deserialize_with = "read_later")]
    pub techniques: TechniqueSettings,
    /// Settings of the ground truth. Default: all their defaults
    #[serde(default)]
    pub trace: TraceSettings,
    /// Where the scene was read from; not part of the file. Default: nowhere
    #[serde(skip)]
    pub source: SceneFile,
    /// Where the origin of all coordinates is in those of the file, m; not part of the file. [`Scene::recentred`] sets it. Default: 0
    #[serde(skip)]
    pub origin: DVec3,
}

/// Size of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Image {
    /// Width in pixels, from 1 to 16384. Default: 1280
    pub width: u32,
    /// Height in pixels, from 1 to 16384. Default: 720
    pub height: u32,
}

impl Default for Image {
    fn default() -> Self {
        Self { width: 1280, height: 720 }
    }
}

impl Image {
    /// Width over height.
    #[must_use]
    pub fn aspect(&self) -> f32 {
        self.width as f32 / self.height as f32
    }

    fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("width").count(self.width, 1..=MAX_IMAGE_PX)?;
        at.field("height").count(self.height, 1..=MAX_IMAGE_PX)
    }
}

impl Scene {
    /// Checks every value and returns the first that is not allowed.
    pub fn validate(&self) -> Result<(), Invalid> {
        let at = At::ROOT;
        self.image.validate(&at.field("image"))?;
        self.camera.validate(&at.field("camera"))?;
        let lights = at.field("lights");
        lights.list(self.lights.len(), 0..=MAX_LIGHTS)?;
        for (index, light) in self.lights.iter().enumerate() {
            light.validate(&lights.index(index))?;
        }
        self.environment.validate(&at.field("environment"))?;
        at.field("time_s").within(self.time_s, 0.0..=MAX_TIME_S, "s")?;
        if let Some(water) = &self.water {
            bridge::validate_water(water, self.time_s, &at)?;
        }
        self.medium.validate(&at.field("medium"))?;
        if let Some(smoke) = &self.smoke {
            smoke.validate(&at.field("smoke"))?;
        }
        let objects = at.field("objects");
        objects.list(self.objects.len(), 0..=MAX_OBJECTS)?;
        let mut triangles = 0;
        for (index, object) in self.objects.iter().enumerate() {
            object.validate(&objects.index(index))?;
            triangles += object.shape.triangle_bound();
            let at = objects.index(index);
            at.field("shape").require(
                triangles <= MAX_TRIANGLES,
                format!("a shape that brings the scene to {triangles} triangles"),
                &format!("at most {MAX_TRIANGLES} triangles in all procedural shapes"),
            )?;
        }
        let motions = at.field("motion");
        motions.list(self.motion.len(), 0..=MAX_MOTIONS)?;
        for (index, motion) in self.motion.iter().enumerate() {
            motion.validate(self, &motions.index(index))?;
        }
        self.tone.validate(&at.field("tone"))?;
        self.techniques.validate(&at.field("techniques"))?;
        self.trace.validate(&at.field("trace"))?;
        Ok(())
    }

    /// The first directional light and its index, which the settings called `sun` change.
    #[must_use]
    pub fn sun(&self) -> Option<(usize, &Light)> {
        self.lights.iter().enumerate().find(|(_, light)| light.is_directional())
    }
}

/// Ignores the settings of techniques: this type does not know which techniques exist.
fn read_later<'de, D: Deserializer<'de>>(deserializer: D) -> Result<TechniqueSettings, D::Error> {
    IgnoredAny::deserialize(deserializer).map(|_| TechniqueSettings::default())
}

/// Reads a list of objects. Stops at the first object beyond the limit, so that a crafted file cannot fill the memory.
fn at_most_max_objects<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Object>, D::Error> {
    struct Bounded;

    impl<'de> Visitor<'de> for Bounded {
        type Value = Vec<Object>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "a list of at most {MAX_OBJECTS} objects")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Self::Value, A::Error> {
            let mut objects = Vec::new();
            while let Some(object) = elements.next_element()? {
                if objects.len() == MAX_OBJECTS {
                    return Err(A::Error::invalid_length(MAX_OBJECTS + 1, &self));
                }
                objects.push(object);
            }
            Ok(objects)
        }
    }

    deserializer.deserialize_seq(Bounded)
}
