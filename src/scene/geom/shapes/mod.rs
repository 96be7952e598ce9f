//! Procedural shapes: solids and grounds that need no file.
//!
//! Each shape is a plain struct whose fields have defaults, and each builds one [`Mesh`]. The same rules hold for all:
//!
//! - metres; a shape that stands has its base at `y = 0` and its axis on `x = z = 0`, any other is centred on the origin;
//! - solids are closed manifolds (several, where parts are stuck into each other), their triangles face out;
//! - texture coordinates are metres along the surface, as nearly as the shape lets them be, and never mirrored;
//! - the same fields give the same bits on every machine.
//!
//! `lathe`, `sweep`, `extrude` and `isosurface` (of a `field`) are the four ways in which solids are made; the other files hold the shapes.

mod boulder;
mod column;
mod extrude;
mod field;
mod figure;
mod isosurface;
mod lathe;
mod planar;
mod pool;
mod pottery;
mod round;
mod sphere;
mod stairs;
mod sweep;
mod terrain;

use std::{fmt::Display, ops::RangeInclusive};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Mesh;

pub use boulder::Boulder;
pub use column::Column;
pub use figure::{Figure, FigureKind};
pub use lathe::{Lathe, MAX_PROFILE_POINTS};
pub use planar::{Cuboid, Grid};
pub use pool::Pool;
pub use pottery::{Pot, PotKind};
pub use round::{Capsule, Cone, Cylinder, Torus, TorusKnot};
pub use sphere::{IcoSphere, UvSphere};
pub use stairs::Stairs;
pub use terrain::Terrain;

/// Lengths above this many metres are refused: `f32` would not resolve a millimetre.
const MAX_LENGTH_M: f32 = 10_000.0;

/// A field of a shape has a value it cannot be built with.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{shape}: {field} is {seen}: must be {allowed}")]
pub struct ShapeError {
    /// Name of the shape.
    pub shape: &'static str,
    /// Name of the field.
    pub field: &'static str,
    /// Its value.
    pub seen: String,
    /// What it may be.
    pub allowed: String,
}

/// Any of the shapes, as a scene file names them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// A box.
    Cuboid(Cuboid),
    /// A flat rectangle.
    Grid(Grid),
    /// A sphere cut along meridians and parallels.
    UvSphere(UvSphere),
    /// A sphere of nearly equal triangles.
    IcoSphere(IcoSphere),
    /// A cylinder.
    Cylinder(Cylinder),
    /// A cone or a frustum of one.
    Cone(Cone),
    /// A cylinder with hemispheres at its ends.
    Capsule(Capsule),
    /// A ring.
    Torus(Torus),
    /// A tube along a torus knot.
    TorusKnot(TorusKnot),
    /// A vessel.
    Pot(Pot),
    /// A turned body.
    Lathe(Lathe),
    /// A fluted column with base and capital.
    Column(Column),
    /// A flight of steps.
    Stairs(Stairs),
    /// A pool: floor and walls seen from inside, and the deck around it.
    Pool(Pool),
    /// Rippled sand.
    Terrain(Terrain),
    /// A weathered stone.
    Boulder(Boulder),
    /// An abstract sculpture.
    Figure(Figure),
}

impl Shape {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        match self {
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
        }
    }

    /// Every shape with its default fields, in the order of the variants.
    #[must_use]
    pub fn catalogue() -> Vec<Self> {
        vec![
            Self::Cuboid(Cuboid::default()),
            Self::Grid(Grid::default()),
            Self::UvSphere(UvSphere::default()),
            Self::IcoSphere(IcoSphere::default()),
            Self::Cylinder(Cylinder::default()),
            Self::Cone(Cone::default()),
            Self::Capsule(Capsule::default()),
            Self::Torus(Torus::default()),
            Self::TorusKnot(TorusKnot::default()),
            Self::Pot(Pot::default()),
            Self::Lathe(Lathe::default()),
            Self::Column(Column::default()),
            Self::Stairs(Stairs::default()),
            Self::Pool(Pool::default()),
            Self::Terrain(Terrain::default()),
            Self::Boulder(Boulder::default()),
            Self::Figure(Figure::default()),
        ]
    }
}

/// Range checks of one shape's fields, with the shape's name for the message.
#[derive(Clone, Copy)]
struct Check(&'static str);

impl Check {
    fn fail(self, field: &'static str, seen: impl Display, allowed: impl Display) -> Result<(), ShapeError> {
        Err(ShapeError { shape: self.0, field, seen: seen.to_string(), allowed: allowed.to_string() })
    }

    /// A length above zero.
    fn length(self, field: &'static str, seen: f32) -> Result<(), ShapeError> {
        if seen > 0.0 && seen <= MAX_LENGTH_M {
            Ok(())
        } else {
            self.fail(field, seen, format_args!("above 0 and at most {MAX_LENGTH_M} (metres)"))
        }
    }

    /// A number in a range, ends included.
    fn number(self, field: &'static str, seen: f32, allowed: RangeInclusive<f32>) -> Result<(), ShapeError> {
        if allowed.contains(&seen) { Ok(()) } else { self.fail(field, seen, format_args!("{} to {}", allowed.start(), allowed.end())) }
    }

    /// A count in a range, ends included.
    fn count(self, field: &'static str, seen: u32, allowed: RangeInclusive<u32>) -> Result<(), ShapeError> {
        if allowed.contains(&seen) { Ok(()) } else { self.fail(field, seen, format_args!("{} to {}", allowed.start(), allowed.end())) }
    }
}

/// `(cos, sin)` of `count + 1` equal steps around a circle; the last equals the first to the last bit, so that seams close.
fn circle(count: u32) -> Vec<glam::Vec2> {
    let at = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i % count) / f64::from(count);
        glam::Vec2::new(libm::cos(angle) as f32, libm::sin(angle) as f32)
    };
    (0..=count).map(at).collect()
}

#[cfg(test)]
mod tests;
