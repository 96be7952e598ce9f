//! The types that settings of techniques have: for each, its values as text and in scene files, and its range.

use std::fmt;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize, Serializer};

use super::choice::{self, Choice, on_command_line};
use crate::check::{At, Invalid};
use crate::keys::value::Value;
use crate::text::read::{self, Error};

/// The range of a setting, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limits {
    /// Every value of the type.
    None,
    /// Of a whole number, or of each of a pair.
    Count(u32, u32),
    /// Of a number.
    Number(f32, f32),
}

/// A type that can have a range.
pub trait Bounded {
    /// What the range is made of.
    type Bound;
    /// The range as data.
    fn limits(range: RangeInclusive<Self::Bound>) -> Limits;
}

macro_rules! bounded {
    ($($type:ty, $bound:ty, $limits:ident);+) => {
        $(impl Bounded for $type {
            type Bound = $bound;
            fn limits(range: RangeInclusive<$bound>) -> Limits {
                Limits::$limits(*range.start(), *range.end())
            }
        })+
    };
}

bounded!(u32, u32, Count; f32, f32, Number; (u32, u32), u32, Count; Option<(u32, u32)>, u32, Count);

/// The values that a setting can have. Prints as the sentence that help and errors show.
#[derive(Clone, Debug, PartialEq)]
pub enum Allowed {
    /// Yes or no.
    Truth,
    /// One of these names, as the command line spells them.
    Names(Vec<String>),
    /// A whole number from the first to the second.
    Count(u32, u32),
    /// A number from the first to the second.
    Number(f32, f32),
    /// Columns and rows, each from the first to the second.
    Pair(u32, u32),
    /// The same, or nothing.
    PairOrNone(u32, u32),
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truth => f.write_str("true or false"),
            Self::Names(names) => write!(f, "one of {}", names.join(", ")),
            Self::Count(low, high) => write!(f, "a whole number from {low} to {high}"),
            Self::Number(low, high) => write!(f, "a number from {} to {}", short(*low), short(*high)),
            Self::Pair(low, high) => write!(f, "COLUMNSxROWS, each from {low} to {high}"),
            Self::PairOrNone(low, high) => write!(f, "none, or COLUMNSxROWS with each from {low} to {high}"),
        }
    }
}

/// A number without a row of zeros.
fn short(value: f32) -> String {
    if value.abs() >= 1.0e5 { format!("{value:e}") } else { value.to_string() }
}

/// A value as scene files have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plain {
    /// Yes or no.
    Truth(bool),
    /// A whole number.
    Count(u32),
    /// A number.
    Number(f32),
    /// Two whole numbers.
    Pair((u32, u32)),
    /// The same, or nothing.
    PairOrNone(Option<(u32, u32)>),
    /// A name.
    Name(&'static str),
}

impl Serialize for Plain {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Truth(value) => value.serialize(serializer),
            Self::Count(value) => value.serialize(serializer),
            Self::Number(value) => value.serialize(serializer),
            Self::Pair(value) => value.serialize(serializer),
            Self::PairOrNone(value) => value.serialize(serializer),
            Self::Name(name) => serializer.serialize_unit_variant("Choice", 0, name),
        }
    }
}

/// The value of one setting, of any type.
pub trait Field {
    /// The value as scene files have it.
    fn plain(&self) -> Plain;
    /// The value as the command line has it.
    fn text(&self) -> String;
    /// Takes a value from the command line; `false`, and nothing is changed, if the text is not of this type.
    fn set_text(&mut self, text: &str) -> bool;
    /// Takes a value from a scene file.
    fn read(&mut self, value: read::Value<'_>) -> Result<(), Error>;
    /// Checks the value against a range; `at` is where it stands.
    fn check(&self, limits: Limits, unit: &str, at: &At<'_>) -> Result<(), Invalid>;
    /// The values allowed within a range.
    fn allowed(&self, limits: Limits) -> Allowed;
}

/// What all fields do the same way.
macro_rules! as_text {
    () => {
        fn text(&self) -> String {
            Value::write(self)
        }
        fn set_text(&mut self, text: &str) -> bool {
            Value::read(text).map(|value| *self = value).is_some()
        }
    };
}

/// The same for types that `serde` knows.
macro_rules! by_serde {
    ($plain:ident) => {
        as_text!();
        fn plain(&self) -> Plain {
            Plain::$plain(*self)
        }
        fn read(&mut self, value: read::Value<'_>) -> Result<(), Error> {
            *self = Deserialize::deserialize(value)?;
            Ok(())
        }
    };
}

impl Field for bool {
    by_serde!(Truth);
    fn check(&self, _: Limits, _: &str, _: &At<'_>) -> Result<(), Invalid> {
        Ok(())
    }
    fn allowed(&self, _: Limits) -> Allowed {
        Allowed::Truth
    }
}

impl Field for u32 {
    by_serde!(Count);
    fn check(&self, limits: Limits, _: &str, at: &At<'_>) -> Result<(), Invalid> {
        let (low, high) = counts(limits);
        at.count(*self, low..=high)
    }
    fn allowed(&self, limits: Limits) -> Allowed {
        let (low, high) = counts(limits);
        Allowed::Count(low, high)
    }
}

impl Field for f32 {
    by_serde!(Number);
    fn check(&self, limits: Limits, unit: &str, at: &At<'_>) -> Result<(), Invalid> {
        let (low, high) = numbers(limits);
        at.within(*self, low..=high, unit)
    }
    fn allowed(&self, limits: Limits) -> Allowed {
        let (low, high) = numbers(limits);
        Allowed::Number(low, high)
    }
}

impl Field for (u32, u32) {
    by_serde!(Pair);
    fn check(&self, limits: Limits, _: &str, at: &At<'_>) -> Result<(), Invalid> {
        let (low, high) = counts(limits);
        at.index(0).count(self.0, low..=high)?;
        at.index(1).count(self.1, low..=high)
    }
    fn allowed(&self, limits: Limits) -> Allowed {
        let (low, high) = counts(limits);
        Allowed::Pair(low, high)
    }
}

impl Field for Option<(u32, u32)> {
    by_serde!(PairOrNone);
    fn check(&self, limits: Limits, unit: &str, at: &At<'_>) -> Result<(), Invalid> {
        self.map_or(Ok(()), |pair| pair.check(limits, unit, at))
    }
    fn allowed(&self, limits: Limits) -> Allowed {
        let (low, high) = counts(limits);
        Allowed::PairOrNone(low, high)
    }
}

impl<C: Choice> Field for C {
    as_text!();
    fn plain(&self) -> Plain {
        Plain::Name(choice::name(*self))
    }
    fn read(&mut self, value: read::Value<'_>) -> Result<(), Error> {
        let place = value.one_of(C::NAMES)?;
        if let Some(choice) = C::ALL.get(place) {
            *self = *choice;
        }
        Ok(())
    }
    fn check(&self, _: Limits, _: &str, _: &At<'_>) -> Result<(), Invalid> {
        Ok(())
    }
    fn allowed(&self, _: Limits) -> Allowed {
        Allowed::Names(C::NAMES.iter().map(|name| on_command_line(name)).collect())
    }
}

fn counts(limits: Limits) -> (u32, u32) {
    if let Limits::Count(low, high) = limits { (low, high) } else { (0, u32::MAX) }
}

fn numbers(limits: Limits) -> (f32, f32) {
    if let Limits::Number(low, high) = limits { (low, high) } else { (f32::MIN, f32::MAX) }
}
