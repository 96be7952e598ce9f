//! The shapes of objects: procedural meshes and mesh files.

use std::path::{Component, Path as FilePath, PathBuf};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};

/// Extensions of the mesh files that can be read, in lower case.
pub const MESH_EXTENSIONS: [&str; 4] = ["ply", "obj", "gltf", "glb"];

/// The surface of an object, in object space: y up, triangles counter-clockwise seen from outside.
///
/// Things that stand have their foot at y = 0; things that float have their centre at the origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Shape {
    /// A box around the origin.
    Box {
        /// Width, height and depth, m.
        size_m: Vec3,
    },
    /// A horizontal rectangle around the origin, facing up.
    Plane {
        /// Width along x and depth along z, m.
        size_m: Vec2,
        /// Cells along x and z, each from 1 to 2048. Default: (1, 1)
        #[serde(default = "one_cell")]
        cells: (u32, u32),
    },
    /// A sphere around the origin.
    Sphere {
        /// Radius, m.
        radius_m: f32,
        /// Segments around the equator, from 3 to 4096. Default: 64
        #[serde(default = "segments")]
        segments: u32,
    },
    /// A closed upright cylinder that stands on the origin.
    Cylinder {
        /// Radius, m.
        radius_m: f32,
        /// Height, m.
        height_m: f32,
        /// Segments around the axis, from 3 to 4096. Default: 64
        #[serde(default = "segments")]
        segments: u32,
    },
    /// A lying ring around the origin.
    Torus {
        /// Radius of the ring's centre line, m; not below `tube_radius_m`.
        radius_m: f32,
        /// Radius of the tube, m.
        tube_radius_m: f32,
        /// Segments along the ring, from 3 to 4096. Default: 96
        #[serde(default = "ring_segments")]
        segments: u32,
        /// Segments around the tube, from 3 to 1024. Default: 32
        #[serde(default = "tube_segments")]
        tube_segments: u32,
    },
    /// A tube along a (p, q) torus knot around the origin.
    TorusKnot {
        /// Turns around the y axis, from 1 to 16. Default: 2
        #[serde(default = "knot_p")]
        p: u32,
        /// Turns around the ring, from 1 to 16, without a common divisor with `p`. Default: 3
        #[serde(default = "knot_q")]
        q: u32,
        /// Radius of the ring that the knot winds around, m.
        radius_m: f32,
        /// Radius of the tube, m.
        tube_radius_m: f32,
        /// Segments along the knot, from 3 to 4096. Default: 512
        #[serde(default = "knot_segments")]
        segments: u32,
        /// Segments around the tube, from 3 to 1024. Default: 32
        #[serde(default = "tube_segments")]
        tube_segments: u32,
    },
    /// A pot turned on a wheel, standing on the origin, hollow, with a wall.
    Pot {
        /// Its outline.
        profile: PotProfile,
        /// Height, m.
        height_m: f32,
        /// Segments around the axis, from 3 to 4096. Default: 64
        #[serde(default = "segments")]
        segments: u32,
    },
    /// A fluted column with base and capital, standing on the origin.
    Column {
        /// Height with base and capital, m.
        height_m: f32,
        /// Radius of the shaft at its foot, m.
        radius_m: f32,
        /// Number of flutes, from 0 to 64. Default: 20
        #[serde(default = "flutes")]
        flutes: u32,
    },
    /// Straight steps that rise along −z, foot at the origin.
    Steps {
        /// Number of steps, from 1 to 256.
        count: u32,
        /// Width along x, m.
        width_m: f32,
        /// Height of one step, m.
        rise_m: f32,
        /// Depth of one step, m.
        run_m: f32,
    },
    /// The inside of a rectangular basin: floor at y = −`depth_m`, walls up to `rim_m` above y = 0, and a flat rim around them.
    Pool {
        /// Inner width along x and length along z, m.
        size_m: Vec2,
        /// Depth of the floor below y = 0, m.
        depth_m: f32,
        /// Height of the rim above y = 0, m, from 0 to 100. Default: 0.15
        #[serde(default = "rim_m")]
        rim_m: f32,
        /// Width of the rim, m. Default: 0.4
        #[serde(default = "rim_width_m")]
        rim_width_m: f32,
    },
    /// Rolling ground around the origin: a grid whose heights are fractal noise.
    Terrain {
        /// Width along x and depth along z, m.
        size_m: Vec2,
        /// Largest height above and depth below y = 0, m, from 0 to 1e4. Default: 0.1
        #[serde(default = "terrain_height_m")]
        height_m: f32,
        /// Size of its largest features, m. Default: 1
        #[serde(default = "terrain_feature_m")]
        feature_m: f32,
        /// Cells along x and z, each from 1 to 2048. Default: (128, 128)
        #[serde(default = "terrain_cells")]
        cells: (u32, u32),
        /// Which of the random grounds. Default: 0
        #[serde(default)]
        seed: u32,
    },
    /// A smooth figure of merged spheres that stands on the origin.
    Statue {
        /// Height, m.
        height_m: f32,
        /// Cells of the surface along its height, from 8 to 256. Default: 96
        #[serde(default = "statue_detail")]
        detail: u32,
    },
    /// A rough stone around the origin.
    Boulder {
        /// Mean radius, m.
        radius_m: f32,
        /// Strength of its bumps relative to the radius, from 0 to 0.5. Default: 0.25
        #[serde(default = "roughness")]
        roughness: f32,
        /// Times the icosahedron is subdivided, from 0 to 7. Default: 5
        #[serde(default = "subdivisions")]
        subdivisions: u32,
        /// Which of the random stones. Default: 0
        #[serde(default)]
        seed: u32,
    },
    /// A mesh file: PLY (ASCII or binary), OBJ, glTF or GLB; a path relative to the scene file, with `/` between its parts.
    Mesh(PathBuf),
}

/// Outlines of [`Shape::Pot`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PotProfile {
    /// Tall, with a narrow foot and neck.
    Amphora,
    /// Low and open.
    Bowl,
    /// Round, with a wide mouth.
    Jar,
    /// Slender, with a flared lip.
    Vase,
}

fn one_cell() -> (u32, u32) {
    (1, 1)
}

fn segments() -> u32 {
    64
}

fn ring_segments() -> u32 {
    96
}

fn tube_segments() -> u32 {
    32
}

fn knot_p() -> u32 {
    2
}

fn knot_q() -> u32 {
    3
}

fn knot_segments() -> u32 {
    512
}

fn flutes() -> u32 {
    20
}

fn rim_m() -> f32 {
    0.15
}

fn rim_width_m() -> f32 {
    0.4
}

fn terrain_height_m() -> f32 {
    0.1
}

fn terrain_feature_m() -> f32 {
    1.0
}

fn terrain_cells() -> (u32, u32) {
    (128, 128)
}

fn statue_detail() -> u32 {
    96
}

fn roughness() -> f32 {
    0.25
}

fn subdivisions() -> u32 {
    5
}

/// Segments of one turn around a body of revolution.
const SEGMENTS: std::ops::RangeInclusive<u32> = 3..=4096;

/// Segments around a tube.
const TUBE_SEGMENTS: std::ops::RangeInclusive<u32> = 3..=1024;

/// Cells along one side of a grid.
const CELLS: std::ops::RangeInclusive<u32> = 1..=2048;

impl Shape {
    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        let cells = |(x, z): (u32, u32)| {
            let at = at.field("cells");
            at.index(0).count(x, CELLS)?;
            at.index(1).count(z, CELLS)
        };
        match self {
            Self::Box { size_m } => at.field("size_m").extent(*size_m),
            Self::Plane { size_m, cells: count } => {
                at.field("size_m").extent2(*size_m)?;
                cells(*count)
            }
            Self::Sphere { radius_m, segments } => {
                at.field("radius_m").length_m(*radius_m)?;
                at.field("segments").count(*segments, SEGMENTS)
            }
            Self::Cylinder { radius_m, height_m, segments } => {
                at.field("radius_m").length_m(*radius_m)?;
                at.field("height_m").length_m(*height_m)?;
                at.field("segments").count(*segments, SEGMENTS)
            }
            Self::Torus { radius_m, tube_radius_m, segments, tube_segments } => {
                at.field("radius_m").length_m(*radius_m)?;
                at.field("tube_radius_m").above(*tube_radius_m, 0.0, *radius_m, "m (radius_m)")?;
                at.field("segments").count(*segments, SEGMENTS)?;
                at.field("tube_segments").count(*tube_segments, TUBE_SEGMENTS)
            }
            Self::TorusKnot { p, q, radius_m, tube_radius_m, segments, tube_segments } => {
                at.field("p").count(*p, 1..=16)?;
                at.field("q").count(*q, 1..=16)?;
                let coprime = (2..=16).all(|divisor| p % divisor != 0 || q % divisor != 0);
                at.field("q").require(coprime, q, &format!("a number without a common divisor with p = {p}"))?;
                at.field("radius_m").length_m(*radius_m)?;
                at.field("tube_radius_m").above(*tube_radius_m, 0.0, *radius_m, "m (radius_m)")?;
                at.field("segments").count(*segments, SEGMENTS)?;
                at.field("tube_segments").count(*tube_segments, TUBE_SEGMENTS)
            }
            Self::Pot { profile: _, height_m, segments } => {
                at.field("height_m").length_m(*height_m)?;
                at.field("segments").count(*segments, SEGMENTS)
            }
            Self::Column { height_m, radius_m, flutes } => {
                at.field("height_m").length_m(*height_m)?;
                at.field("radius_m").length_m(*radius_m)?;
                at.field("flutes").count(*flutes, 0..=64)
            }
            Self::Steps { count, width_m, rise_m, run_m } => {
                at.field("count").count(*count, 1..=256)?;
                at.field("width_m").length_m(*width_m)?;
                at.field("rise_m").length_m(*rise_m)?;
                at.field("run_m").length_m(*run_m)
            }
            Self::Pool { size_m, depth_m, rim_m, rim_width_m } => {
                at.field("size_m").extent2(*size_m)?;
                at.field("depth_m").length_m(*depth_m)?;
                at.field("rim_m").within(*rim_m, 0.0..=100.0, "m")?;
                at.field("rim_width_m").length_m(*rim_width_m)
            }
            Self::Terrain { size_m, height_m, feature_m, cells: count, seed: _ } => {
                at.field("size_m").extent2(*size_m)?;
                at.field("height_m").within(*height_m, 0.0..=1.0e4, "m")?;
                at.field("feature_m").length_m(*feature_m)?;
                cells(*count)
            }
            Self::Statue { height_m, detail } => {
                at.field("height_m").length_m(*height_m)?;
                at.field("detail").count(*detail, 8..=256)
            }
            Self::Boulder { radius_m, roughness, subdivisions, seed: _ } => {
                at.field("radius_m").length_m(*radius_m)?;
                at.field("roughness").within(*roughness, 0.0..=0.5, "")?;
                at.field("subdivisions").count(*subdivisions, 0..=7)
            }
            Self::Mesh(path) => validate_mesh_path(path, &at.field("Mesh")),
        }
    }
}

/// A path that means the same on every machine: relative, without a drive or a root, ending in a known extension.
fn validate_mesh_path(path: &FilePath, at: &At<'_>) -> Result<(), Invalid> {
    let shown = format!("\"{}\"", path.display());
    let relative = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir | Component::ParentDir));
    let portable = !shown.contains(['\\', '\0', ':']);
    at.require(relative && portable, &shown, "a path relative to the scene file, its parts separated by `/`")?;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
    at.require(
        MESH_EXTENSIONS.contains(&extension.as_str()),
        &shown,
        &format!("a file whose name ends in one of: .{}", MESH_EXTENSIONS.join(", .")),
    )
}
