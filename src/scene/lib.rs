//! Scene descriptions: what there is to see, as plain data read from RON files.
//!
//! A [`Scene`] holds camera, lights, environment, water, medium, objects, tone and the settings of the techniques; [`load()`] reads and
//! validates one, [`Scene::set`] changes one value by its command-line key. No technique is known here: each states its settings as a table of
//! rows ([`settings!`](macro@settings)), and whoever reads a scene names the tables that it may use. Every field is documented with its unit and default; unknown
//! fields are errors; an error names file, line, column, the value seen and the values allowed. Lengths are in metres, times in seconds, y
//! is up, colours are linear RGB.
//!
//! Nothing here draws: frames are built from scenes by the techniques.

mod account;
mod bridge;
mod camera;
mod check;
mod description;
mod environment;
pub mod geom;
mod keys;
mod light;
mod load;
mod material;
mod medium;
mod mesh;
pub mod mesh_file;
mod motion;
mod names;
mod object;
mod pattern;
mod reach;
mod recentre;
mod scene_file;
mod settings;
mod shape;
mod smoke;
pub mod text;
mod tone;
mod trace;
pub mod water;

pub use account::{Account, OverLimit, Part};
pub use camera::Camera;
pub use check::{Invalid, MAX_LENGTH_M, MAX_LIGHT};
pub use description::{Image, MAX_IMAGE_PX, MAX_OBJECTS, MAX_TIME_S, MAX_TRIANGLES, Scene};
pub use environment::{Environment, SunDisc};
pub use keys::{Refusal, Setting, SettingError, settings};
pub use light::{Aim, Incident, Light, MAX_LIGHTS, spot_falloff};
pub use load::{MAX_FILE_BYTES, SceneError, load, parse, parse_bytes};
pub use material::{Albedo, MAX_TILE_COLOURS, Material};
pub use medium::Medium;
pub use mesh::{ObjectError, PlacedMesh};
pub use motion::{Course, MAX_MOTIONS, Motion, Moving};
pub use names::nearest;
pub use object::{Object, Transform};
pub use pattern::PatternUniform;
pub use scene_file::SceneFile;
pub use settings::{
    Allowed, Bounded, Choice, EyeRefraction, Field, Group, Limits, MAX_GRID, Plain, Radiometry, Row, Settings, TechniqueSettings, limits,
};
pub use shape::{MESH_EXTENSIONS, Shape};
pub use smoke::{Density, DensityGrid, MAX_SMOKE_CELLS, Smoke};
pub use tone::ToneSettings;
pub use trace::{MAX_PLANE_TEXELS, MeasuringPlane, TraceSettings};
