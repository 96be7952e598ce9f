//! The shapes of objects: the procedural ones of [`shapes`](crate::geom::shapes), and mesh files.

use std::ops::RangeInclusive;
use std::path::{Path as FilePath, PathBuf};

use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::geom::Mesh;
use crate::geom::shapes::{
    Boulder, Capsule, Column, Cone, Cuboid, Cylinder, Figure, Grid, IcoSphere, Lathe, MAX_PROFILE_POINTS, Pool, Pot, ShapeError, Stairs,
    Terrain, Torus, TorusKnot, UvSphere,
};

use super::check::{At, Invalid};
use super::mesh_file::MESH_REACH;
use super::reach::{Reach, check_portable};

/// Extensions of the mesh files that can be read, in lower case.
pub const MESH_EXTENSIONS: [&str; 4] = ["ply", "obj", "gltf", "glb"];

/// The surface of an object, in object space: metres, y up, triangles counter-clockwise seen from outside.
///
/// Shapes that stand have their foot at y = 0, others their centre at the origin. In a file: `Torus(radius_m: 0.5)`; every field of the
/// procedural shapes has a default, so that `Torus()` is one, too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Shape {
    /// A box around the origin.
    Cuboid(Cuboid),
    /// A rectangle in the plane y = 0, facing up.
    Grid(Grid),
    /// A sphere cut along meridians and parallels, around the origin.
    UvSphere(UvSphere),
    /// A sphere of nearly equal triangles, around the origin.
    IcoSphere(IcoSphere),
    /// A cylinder that stands on y = 0.
    Cylinder(Cylinder),
    /// A cone or a frustum of one that stands on y = 0.
    Cone(Cone),
    /// A cylinder with hemispheres at its ends, around the origin.
    Capsule(Capsule),
    /// A lying ring around the origin.
    Torus(Torus),
    /// A tube along a torus knot around the origin.
    TorusKnot(TorusKnot),
    /// A vessel that stands on y = 0.
    Pot(Pot),
    /// A turned body around the y axis, at the heights of its profile.
    Lathe(Lathe),
    /// A fluted column with base and capital that stands on y = 0.
    Column(Column),
    /// A flight of steps that stands on y = 0.
    Stairs(Stairs),
    /// A pool: floor and walls seen from inside, and the deck around it at y = 0.
    Pool(Pool),
    /// Rippled sand around y = 0.
    Terrain(Terrain),
    /// A weathered stone around the origin.
    Boulder(Boulder),
    /// A sculpture that stands on y = 0.
    Figure(Figure),
    /// A mesh file: PLY (ASCII or binary), OBJ, glTF or GLB; a path relative to the scene file, with `/` between its parts, that leads below the
    /// folder of that file or below a folder beside it, as `../meshes/a.ply` does.
    Mesh(PathBuf),
}

/// Largest length of a procedural shape, m, as in the geometry.
const MAX_SHAPE_M: f32 = 10_000.0;

impl Shape {
    /// The mesh of a procedural shape, in object space; `None` for a mesh file, which [`Scene::mesh`](super::Scene::mesh) reads.
    #[must_use]
    pub fn build(&self) -> Option<Result<Mesh, ShapeError>> {
        Some(match self {
            Self::Cuboid(shape) => shape.mesh(),
            Self::Grid(shape) => shape.mesh(),
            Self::UvSphere(shape) => shape.mesh(),
            Self::IcoSphere(shape) => shape.mesh(),
            Self::Cylinder(shape) => shape.mesh(),
            Self::Cone(shape) => shape.mesh(),
            Self::Capsule(shape) => shape.mesh(),
            Self::Torus(shape) => shape.mesh(),
            Self::TorusKnot(shape) => shape.mesh(),
            Self::Pot(shape) => shape.mesh(),
            Self::Lathe(shape) => shape.mesh(),
            Self::Column(shape) => shape.mesh(),
            Self::Stairs(shape) => shape.mesh(),
            Self::Pool(shape) => shape.mesh(),
            Self::Terrain(shape) => shape.mesh(),
            Self::Boulder(shape) => shape.mesh(),
            Self::Figure(shape) => shape.mesh(),
            Self::Mesh(_) => return None,
        })
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        if let Self::Mesh(path) = self {
            return validate_mesh_path(path, &at.field("Mesh"));
        }
        let coarsest = self.coarsest(at)?;
        match coarsest.build() {
            Some(Err(error)) => at.field(error.field).refuse(error.seen, error.allowed),
            _ => Ok(()),
        }
    }

    /// This shape at its coarsest, after checking the fields that say how fine it is.
    ///
    /// The ranges of all other fields are the geometry's business, and its own check is to build the mesh: at its coarsest that takes
    /// microseconds and finds the same errors. Only figures and columns, which take milliseconds at any fineness, are checked here and
    /// then stand in as a box; a test compares their ranges with the geometry's.
    fn coarsest(&self, at: &At<'_>) -> Result<Self, Invalid> {
        const AROUND: RangeInclusive<u32> = 3..=4096;
        let cells_at = at.field("cells");
        let cells = |cells: UVec2| {
            cells_at.index(0).count(cells.x, 1..=4096)?;
            cells_at.index(1).count(cells.y, 1..=4096)
        };
        let count = |field, value, range| at.field(field).count(value, range);
        Ok(match *self {
            Self::Grid(shape) => {
                cells(shape.cells)?;
                Self::Grid(Grid { cells: UVec2::ONE, ..shape })
            }
            Self::UvSphere(shape) => {
                count("slices", shape.slices, AROUND)?;
                count("stacks", shape.stacks, 2..=2048)?;
                Self::UvSphere(UvSphere { slices: 3, stacks: 2, ..shape })
            }
            Self::IcoSphere(shape) => {
                count("subdivisions", shape.subdivisions, 0..=9)?;
                Self::IcoSphere(IcoSphere { subdivisions: 0, ..shape })
            }
            Self::Cylinder(shape) => {
                count("slices", shape.slices, AROUND)?;
                Self::Cylinder(Cylinder { slices: 3, ..shape })
            }
            Self::Cone(shape) => {
                count("slices", shape.slices, AROUND)?;
                Self::Cone(Cone { slices: 3, ..shape })
            }
            Self::Capsule(shape) => {
                count("slices", shape.slices, AROUND)?;
                count("stacks", shape.stacks, 2..=1024)?;
                Self::Capsule(Capsule { slices: 3, stacks: 2, ..shape })
            }
            Self::Torus(shape) => {
                count("slices", shape.slices, AROUND)?;
                count("sides", shape.sides, AROUND)?;
                Self::Torus(Torus { slices: 3, sides: 3, ..shape })
            }
            Self::TorusKnot(shape) => {
                count("segments", shape.segments, 8..=16384)?;
                count("sides", shape.sides, 3..=1024)?;
                Self::TorusKnot(TorusKnot { segments: 8, sides: 3, ..shape })
            }
            Self::Pot(shape) => {
                count("slices", shape.slices, 8..=2048)?;
                Self::Pot(Pot { slices: 8, ..shape })
            }
            Self::Lathe(ref shape) => {
                at.field("profile").list(shape.profile.len(), 2..=MAX_PROFILE_POINTS)?;
                count("steps", shape.steps, 1..=64)?;
                count("slices", shape.slices, AROUND)?;
                Self::Lathe(Lathe { slices: 3, ..shape.clone() })
            }
            Self::Stairs(shape) => {
                count("steps", shape.steps, 1..=256)?;
                Self::Stairs(Stairs { steps: 1, ..shape })
            }
            Self::Terrain(shape) => {
                cells(shape.cells)?;
                Self::Terrain(Terrain { cells: UVec2::ONE, ..shape })
            }
            Self::Boulder(shape) => {
                count("subdivisions", shape.subdivisions, 0..=8)?;
                Self::Boulder(Boulder { subdivisions: 0, ..shape })
            }
            Self::Figure(Figure { kind: _, height_m, resolution }) => {
                count("resolution", resolution, 16..=256)?;
                at.field("height_m").above(height_m, 0.0, MAX_SHAPE_M, "m")?;
                Self::Cuboid(Cuboid::default())
            }
            Self::Column(Column { height_m, radius_m, flutes }) => {
                count("flutes", flutes, 8..=64)?;
                at.field("radius_m").above(radius_m, 0.0, MAX_SHAPE_M, "m")?;
                at.field("height_m").within(height_m, 4.0 * radius_m..=MAX_SHAPE_M, "m (at least 4 radius_m)")?;
                Self::Cuboid(Cuboid::default())
            }
            Self::Cuboid(_) | Self::Pool(_) | Self::Mesh(_) => self.clone(),
        })
    }

    /// An upper bound of the number of triangles of a valid procedural shape; 0 for a mesh file, which states its own.
    #[must_use]
    pub fn triangle_bound(&self) -> u64 {
        let product = |a: u32, b: u32| u64::from(a) * u64::from(b);
        match *self {
            Self::Cuboid(_) => 12,
            Self::Grid(Grid { cells, .. }) | Self::Terrain(Terrain { cells, .. }) => 2 * product(cells.x, cells.y),
            Self::UvSphere(UvSphere { slices, stacks, .. }) => 2 * product(slices, stacks),
            Self::IcoSphere(IcoSphere { subdivisions, .. }) | Self::Boulder(Boulder { subdivisions, .. }) => {
                20 << (2 * subdivisions.min(16))
            }
            Self::Cylinder(Cylinder { slices, .. }) | Self::Cone(Cone { slices, .. }) => product(slices, 4),
            Self::Capsule(Capsule { slices, stacks, .. }) => 4 * product(slices, stacks + 1),
            Self::Torus(Torus { slices, sides, .. }) => 2 * product(slices, sides),
            Self::TorusKnot(TorusKnot { segments, sides, .. }) => 2 * product(segments, sides),
            Self::Pot(Pot { slices, .. }) => product(slices, 512) + 65536,
            Self::Lathe(Lathe { ref profile, steps, slices }) => 2 * product(slices, steps) * profile.len() as u64,
            Self::Column(Column { flutes, .. }) => product(flutes, 4096) + 65536,
            Self::Stairs(Stairs { steps, .. }) => product(steps, 256) + 256,
            Self::Pool(_) => 1024,
            // A surface through a lattice of r cells of height crosses some r² of them per side; figures are up to three heights wide.
            Self::Figure(Figure { resolution, .. }) => 64 * product(resolution, resolution),
            Self::Mesh(_) => 0,
        }
    }
}

impl Shape {
    /// About how many triangles a procedural shape has: the bound, or the share of it that sculptures and turned vessels come to.
    #[must_use]
    pub fn triangle_estimate(&self) -> u64 {
        let bound = self.triangle_bound();
        match self {
            Self::Figure(_) => bound / 3,
            Self::Pot(_) | Self::Column(_) => bound / 2,
            _ => bound,
        }
    }
}

/// A path that means the same on every machine, within the scene's reach, ending in a known extension. Where links on it lead is seen when the
/// file is read.
fn validate_mesh_path(path: &FilePath, at: &At<'_>) -> Result<(), Invalid> {
    let shown = format!("\"{}\"", path.display());
    let named = |check: fn(&str) -> Result<(), &'static str>| path.to_str().is_some_and(|name| check(name).is_ok());
    at.require(named(check_portable), &shown, "a path relative to the scene file, its parts separated by `/`")?;
    at.require(named(|name| Reach::Beside.check(name)), &shown, &format!("a path {MESH_REACH}"))?;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
    at.require(
        MESH_EXTENSIONS.contains(&extension.as_str()),
        &shown,
        &format!("a file whose name ends in one of: .{}", MESH_EXTENSIONS.join(", .")),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every procedural shape at its defaults.
    fn all() -> Vec<Shape> {
        vec![
            Shape::Cuboid(Cuboid::default()),
            Shape::Grid(Grid::default()),
            Shape::UvSphere(UvSphere::default()),
            Shape::IcoSphere(IcoSphere::default()),
            Shape::Cylinder(Cylinder::default()),
            Shape::Cone(Cone::default()),
            Shape::Capsule(Capsule::default()),
            Shape::Torus(Torus::default()),
            Shape::TorusKnot(TorusKnot::default()),
            Shape::Pot(Pot::default()),
            Shape::Lathe(Lathe::default()),
            Shape::Column(Column::default()),
            Shape::Stairs(Stairs::default()),
            Shape::Pool(Pool::default()),
            Shape::Terrain(Terrain::default()),
            Shape::Boulder(Boulder::default()),
            Shape::Figure(Figure::default()),
        ]
    }

    #[test]
    fn every_shape_is_valid_by_default_and_within_its_triangle_bound() {
        assert_eq!(all().len(), crate::geom::shapes::Shape::catalogue().len(), "a shape of the geometry is missing here");
        for shape in all() {
            assert_eq!(shape.validate(&At::ROOT), Ok(()), "{shape:?}");
            let count = shape.build().unwrap().unwrap().triangle_count() as u64;
            assert!(count > 0 && count <= shape.triangle_bound(), "{shape:?} has {count} of {}", shape.triangle_bound());
        }
    }

    #[test]
    fn figures_and_columns_have_the_ranges_of_the_geometry() {
        let figure = |height_m, resolution| Shape::Figure(Figure { height_m, resolution, ..Figure::default() });
        let column = |height_m, radius_m, flutes| Shape::Column(Column { height_m, radius_m, flutes });
        for (shape, valid) in [
            (figure(10_000.0, 16), true),
            (figure(10_001.0, 16), false),
            (figure(0.0, 16), false),
            (figure(1.0, 15), false),
            (figure(1.0, 257), false),
            (column(4.0, 1.0, 8), true),
            (column(3.999, 1.0, 8), false),
            (column(10_000.0, 1.0, 64), true),
            (column(10_001.0, 1.0, 64), false),
            (column(3.0, 0.0, 20), false),
            (column(3.0, 0.2, 7), false),
            (column(3.0, 0.2, 65), false),
        ] {
            assert_eq!(shape.validate(&At::ROOT).is_ok(), valid, "{shape:?}");
            assert_eq!(shape.build().unwrap().is_ok(), valid, "{shape:?} in the geometry");
        }
    }

    #[test]
    fn every_shape_is_checked_without_building_it_in_full() {
        for (text, field, found) in [
            ("Cuboid(size_m: (1, NaN, 1))", "size_m", "NaN"),
            ("Grid(cells: (4096, 4097))", "cells[1]", "4097"),
            ("UvSphere(slices: 4096, stacks: 2048, radius_m: -1)", "radius_m", "-1"),
            ("UvSphere(stacks: 1)", "stacks", "1"),
            ("IcoSphere(subdivisions: 10)", "subdivisions", "10"),
            ("Cylinder(slices: 4096, height_m: 0)", "height_m", "0"),
            ("Cone(top_radius_m: -0.5)", "top_radius_m", "-0.5"),
            ("Capsule(length_m: inf)", "length_m", "inf"),
            ("Torus(slices: 4096, sides: 4096, tube_radius_m: 2)", "tube_radius_m", "2"),
            ("TorusKnot(segments: 16384, sides: 1024, p: 2, q: 4)", "q", "4"),
            ("Pot(slices: 2048, thickness: 1)", "thickness", "1"),
            ("Lathe(profile: [(0, 0)])", "profile", "1 elements"),
            ("Lathe(profile: [(0, 0), (-1, 1)])", "profile", "(-1, 1) at point 1"),
            ("Lathe(slices: 4096, steps: 65)", "steps", "65"),
            ("Column(flutes: 65)", "flutes", "65"),
            ("Stairs(steps: 257)", "steps", "257"),
            ("Pool(depth_m: 1e30)", "depth_m", "1000000000000000000000000000000"),
            ("Terrain(cells: (4096, 4096), dune_length_m: 0)", "dune_length_m", "0"),
            ("Boulder(subdivisions: 8, roughness: 0.6)", "roughness", "0.6"),
            ("Figure(resolution: 256, height_m: -2)", "height_m", "-2"),
            ("Mesh(\"a.stl\")", "Mesh", "\"a.stl\""),
            ("Mesh(\"/a.ply\")", "Mesh", "\"/a.ply\""),
            ("Mesh(\"C:a.ply\")", "Mesh", "\"C:a.ply\""),
            ("Mesh(\"\")", "Mesh", "\"\""),
        ] {
            let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES);
            let shape: Shape = options.from_str(text).unwrap();
            let invalid = shape.validate(&At::ROOT).unwrap_err();
            assert_eq!((invalid.path.to_string().as_str(), invalid.found.as_str()), (field, found), "{text}: {invalid}");
        }
        assert_eq!(Shape::Mesh("../meshes/a.GLB".into()).validate(&At::ROOT), Ok(()));
    }
}
