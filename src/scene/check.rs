//! Range checks on the values of a scene: each knows the path of its value and the values allowed, and stops at the first breach.

use std::fmt::Display;
use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};

use super::text::{Path, Step};

/// Largest magnitude of a coordinate or length, in metres: squares and volumes of such numbers are still finite in `f32`.
pub const MAX_LENGTH_M: f32 = 1.0e6;

/// Largest irradiance, radiance or intensity; sunlight is 1e3 W/m² and the sun's disc 1e7 W/(m² sr).
pub const MAX_LIGHT: f32 = 1.0e12;

/// A value of a scene outside the values allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: found {found}, expected {expected}")]
pub struct Invalid {
    /// Which value, such as `lights[1].irradiance[0]`.
    pub path: Path,
    /// The value seen.
    pub found: String,
    /// The values allowed.
    pub expected: String,
}

/// The path of the value being checked, as a list linked from the inside out: it costs nothing until a check fails.
#[derive(Clone, Copy)]
pub struct At<'a> {
    parent: Option<&'a At<'a>>,
    step: Link,
}

#[derive(Clone, Copy)]
enum Link {
    Root,
    Name(&'static str),
    Index(usize),
}

impl<'a> At<'a> {
    /// The scene itself.
    pub const ROOT: At<'static> = At { parent: None, step: Link::Root };

    /// The field `name` of this value.
    #[must_use]
    pub fn field(&'a self, name: &'static str) -> At<'a> {
        At { parent: Some(self), step: Link::Name(name) }
    }

    /// Element `index` of this list, tuple or vector.
    #[must_use]
    pub fn index(&'a self, index: usize) -> At<'a> {
        At { parent: Some(self), step: Link::Index(index) }
    }

    /// The path from the scene to here.
    #[must_use]
    pub fn path(&self) -> Path {
        let mut steps = Vec::new();
        let mut link = Some(self);
        while let Some(at) = link {
            match at.step {
                Link::Root => {}
                Link::Name(name) => steps.push(Step::Name(name.to_owned())),
                Link::Index(index) => steps.push(Step::Index(index)),
            }
            link = at.parent;
        }
        steps.reverse();
        Path(steps)
    }

    /// The error that this value is `found` where it should be `expected`.
    pub fn refuse<T>(&self, found: impl Display, expected: impl Into<String>) -> Result<T, Invalid> {
        Err(Invalid { path: self.path(), found: found.to_string(), expected: expected.into() })
    }

    /// `ok`, or the error that this value is `found` where it should be `expected`.
    pub fn require(&self, ok: bool, found: impl Display, expected: &str) -> Result<(), Invalid> {
        if ok { Ok(()) } else { self.refuse(found, expected) }
    }

    /// A number within `range`, both ends included; NaN is outside of every range.
    pub fn within(&self, value: f32, range: RangeInclusive<f32>, unit: &str) -> Result<(), Invalid> {
        if range.contains(&value) {
            return Ok(());
        }
        let space = if unit.is_empty() { "" } else { " " };
        self.refuse(value, format!("a number from {} to {}{space}{unit}", range.start(), range.end()))
    }

    /// A number above `low` and at most `high`.
    pub fn above(&self, value: f32, low: f32, high: f32, unit: &str) -> Result<(), Invalid> {
        if value > low && value <= high {
            return Ok(());
        }
        let space = if unit.is_empty() { "" } else { " " };
        self.refuse(value, format!("a number above {low}, at most {high}{space}{unit}"))
    }

    /// A length in metres above 0, at most [`MAX_LENGTH_M`].
    pub fn length_m(&self, value: f32) -> Result<(), Invalid> {
        self.above(value, 0.0, MAX_LENGTH_M, "m")
    }

    /// A coordinate in metres of magnitude at most [`MAX_LENGTH_M`].
    pub fn coordinate_m(&self, value: f32) -> Result<(), Invalid> {
        self.within(value, -MAX_LENGTH_M..=MAX_LENGTH_M, "m")
    }

    /// A whole number within `range`.
    pub fn count(&self, value: u32, range: RangeInclusive<u32>) -> Result<(), Invalid> {
        if range.contains(&value) {
            return Ok(());
        }
        self.refuse(value, format!("a whole number from {} to {}", range.start(), range.end()))
    }

    /// The length of a list within `range`.
    pub fn list(&self, length: usize, range: RangeInclusive<usize>) -> Result<(), Invalid> {
        if range.contains(&length) {
            return Ok(());
        }
        self.refuse(format!("{length} elements"), format!("from {} to {} elements", range.start(), range.end()))
    }

    /// A point whose three coordinates are [`At::coordinate_m`].
    pub fn point(&self, value: Vec3) -> Result<(), Invalid> {
        value.to_array().iter().enumerate().try_for_each(|(i, &c)| self.index(i).coordinate_m(c))
    }

    /// Two lengths above 0.
    pub fn extent2(&self, value: Vec2) -> Result<(), Invalid> {
        value.to_array().iter().enumerate().try_for_each(|(i, &c)| self.index(i).length_m(c))
    }

    /// A direction: finite and long enough that it can be normalised (it need not be of unit length).
    pub fn direction(&self, value: Vec3) -> Result<(), Invalid> {
        self.point(value)?;
        let length = value.length();
        let ok = (1.0e-6..=MAX_LENGTH_M).contains(&length);
        self.require(ok, format!("({}, {}, {})", value.x, value.y, value.z), "a direction whose length is from 1e-6 to 1e6")
    }

    /// Red, green and blue of a light: each from 0 to [`MAX_LIGHT`].
    pub fn light(&self, value: Vec3, unit: &str) -> Result<(), Invalid> {
        value.to_array().iter().enumerate().try_for_each(|(i, &c)| self.index(i).within(c, 0.0..=MAX_LIGHT, unit))
    }

    /// Red, green and blue of a reflectance: each from 0 to 1.
    pub fn reflectance(&self, value: Vec3) -> Result<(), Invalid> {
        value.to_array().iter().enumerate().try_for_each(|(i, &c)| self.index(i).within(c, 0.0..=1.0, ""))
    }

    /// Red, green and blue of a coefficient of a medium: each from 0 to 1000 1/m.
    pub fn coefficient(&self, value: Vec3) -> Result<(), Invalid> {
        value.to_array().iter().enumerate().try_for_each(|(i, &c)| self.index(i).within(c, 0.0..=1000.0, "1/m"))
    }
}
