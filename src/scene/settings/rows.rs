//! A group of settings as a table of rows, from which everything else about them follows: see [`settings!`](macro@crate::settings).

use std::any::Any;
use std::fmt;

use super::field::{Bounded, Field, Limits};
use crate::check::{At, Invalid};

/// One setting of a technique.
#[derive(Debug)]
pub struct Row {
    /// The field's name, such as `samples`.
    pub name: &'static str,
    /// Its key, as in `--set KEY=VALUE`, such as `paint.samples`.
    pub key: &'static str,
    /// The lines of its documentation; [`Row::doc`] has them trimmed.
    pub lines: &'static str,
    /// The unit of its value; empty for pure numbers and names.
    pub unit: &'static str,
    /// What the paper says in words, in place of its value; may be empty.
    pub said: &'static str,
    /// What the technique's page adds in its table; may be empty.
    pub note: &'static str,
    /// The range of its value.
    pub limits: fn() -> Limits,
    /// The value, in settings of the row's own group.
    pub field: fn(&dyn Any) -> Option<&dyn Field>,
    /// The value, to be changed.
    pub field_mut: fn(&mut dyn Any) -> Option<&mut dyn Field>,
}

impl Row {
    /// What it sets, in one sentence.
    #[must_use]
    pub const fn doc(&self) -> &'static str {
        self.lines.trim_ascii()
    }
}

/// Values for every row of a table, made by [`settings!`](macro@crate::settings).
pub trait Settings: Any + fmt::Debug + Send + Sync {
    /// Name of the group in scene files and before each key, such as `paint`.
    fn key(&self) -> &'static str;
    /// Name of the struct.
    fn type_name(&self) -> &'static str;
    /// The table.
    fn rows(&self) -> &'static [Row];
    /// The default of every row.
    fn defaults(&self) -> &'static dyn Settings;
    /// The paper's value in every row.
    fn paper(&self) -> Box<dyn Settings>;
    /// A copy.
    fn boxed(&self) -> Box<dyn Settings>;
    /// Takes the values that make a frame cheap enough for a test, in rows that have one.
    fn coarsen(&mut self);
}

/// Settings of a type that is known.
pub trait Group: Settings + Clone + PartialEq + Sized {
    /// The default of every row.
    const DEFAULTS: &'static Self;
}

impl dyn Settings {
    /// Checks every value and returns the first that is not allowed.
    pub(crate) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        let at = at.field(self.key());
        for row in self.rows() {
            if let Some(field) = (row.field)(self) {
                field.check((row.limits)(), row.unit, &at.field(row.name))?;
            }
        }
        Ok(())
    }
}

impl Clone for Box<dyn Settings> {
    fn clone(&self) -> Self {
        self.boxed()
    }
}

impl PartialEq for dyn Settings {
    /// The same group with the same values.
    fn eq(&self, other: &Self) -> bool {
        let value = |settings: &Self, row: &Row| (row.field)(settings).map(|field| field.plain());
        self.key() == other.key()
            && self.type_name() == other.type_name()
            && self.rows().iter().all(|row| value(self, row) == value(other, row))
    }
}

/// The range of a row, for [`settings!`](macro@crate::settings).
#[must_use]
pub fn limits<T: Bounded>(range: std::ops::RangeInclusive<T::Bound>) -> Limits {
    T::limits(range)
}

/// Declares the settings of a technique: one row for each, and nothing besides.
///
/// ```
/// use nephroid_scene::{EyeRefraction, settings};
///
/// settings! {
///     /// Settings of the technique `paint`.
///     pub struct Paint("paint") {
///         shared eye_refraction;
///         /// Thickness of the coat.
///         thickness_m: f32 = 0.001, in 0.0..=0.1, unit "m", paper 0.002;
///         shared samples;
///     }
/// }
/// assert_eq!((Paint::default().thickness_m, Paint::PAPER.thickness_m, Paint::PAPER.samples), (0.001, 0.002, 1));
/// ```
///
/// A row is `NAME: TYPE = DEFAULT`, then what it has of, in this order: `in RANGE`, `unit "UNIT"`, `paper VALUE` where the paper's value is
/// another, `said "TEXT"` for what the paper says in words, `note "TEXT"` for the technique's page, and `coarse VALUE` for tests. Types are
/// `bool`, `u32`, `f32`, `(u32, u32)`, `Option<(u32, u32)>` and what [`choices!`](crate::choices) makes; numbers need a range. Rows that many
/// techniques have are `shared NAME`, then `paper`, `said` and `note`: see [`shared_row!`](crate::shared_row).
///
/// From the rows follow the struct with documented fields, `Default`, `PAPER`, and [`Settings`]: keys, validation, reading and writing.
#[macro_export]
macro_rules! settings {
    (@or $default:expr) => { $default };
    (@or $default:expr, $other:expr) => { $other };
    (@range $type:ty) => { $crate::Limits::None };
    (@range $type:ty, $range:expr) => { $crate::limits::<$type>($range) };

    // Shared rows are put in; all others are taken as they are.
    (@rows $head:tt {$($done:tt)*} {shared $name:ident $(, paper $paper:expr)? $(, said $said:literal)? $(, note $note:literal)? ; $($rest:tt)*}) => {
        $crate::shared_row!($name { $head {$($done)*} {$($rest)*} } {$(paper $paper)?} {$(, said $said)? $(, note $note)?});
    };
    (@rows $head:tt {$($done:tt)*} {
        $(#[doc = $doc:literal])+ $name:ident : $type:ty = $default:expr $(, in $range:expr)? $(, unit $unit:literal)? $(, paper $paper:expr)?
        $(, said $said:literal)? $(, note $note:literal)? $(, coarse $coarse:expr)? ; $($rest:tt)*
    }) => {
        $crate::settings!(@rows $head {
            $($done)*
            {
                $(#[doc = $doc])+ $name: ($type) = ($default) {$(, $range)?} {$($unit)?} {$(, $paper)?} {$($said)?} {$($note)?} {$($coarse)?}
            }
        } {$($rest)*});
    };
    (@rows {$($head:tt)*} {$($done:tt)*} {}) => {
        $crate::settings!(@made {$($head)*} $($done)*);
    };

    (@made {$(#[$meta:meta])* $vis:vis struct $group:ident ($key:literal)} $({
        $(#[doc = $doc:literal])+ $name:ident : ($type:ty) = ($default:expr) {$(, $range:expr)?} {$($unit:literal)?} {$(, $paper:expr)?}
        {$($said:literal)?} {$($note:literal)?} {$($coarse:expr)?}
    })+) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct $group {
            $(
                $(#[doc = $doc])+
                ///
                #[doc = concat!(
                    "Default: `", stringify!($default), "`" $(, " ", $unit)? $(, "; range: `", stringify!($range), "`")?
                    $(, "; the paper: `", stringify!($paper), "`")? $(, "; the paper: ", $said)?, "."
                )]
                pub $name: $type,
            )+
        }

        impl $group {
            /// The technique as its paper has it.
            pub const PAPER: Self = Self { $($name: $crate::settings!(@or $default $(, $paper)?)),+ };
        }

        impl Default for $group {
            fn default() -> Self {
                *<Self as $crate::Group>::DEFAULTS
            }
        }

        impl $crate::Group for $group {
            const DEFAULTS: &'static Self = &Self { $($name: $default),+ };
        }

        impl $crate::Settings for $group {
            fn key(&self) -> &'static str {
                $key
            }
            fn type_name(&self) -> &'static str {
                stringify!($group)
            }
            fn rows(&self) -> &'static [$crate::Row] {
                const ROWS: &[$crate::Row] = &[$($crate::Row {
                    name: stringify!($name),
                    key: concat!($key, ".", stringify!($name)),
                    lines: concat!($($doc),+),
                    unit: concat!($($unit)?),
                    said: concat!($($said)?),
                    note: concat!($($note)?),
                    limits: || $crate::settings!(@range $type $(, $range)?),
                    field: |any| any.downcast_ref::<$group>().map(|group| &group.$name as &dyn $crate::Field),
                    field_mut: |any| any.downcast_mut::<$group>().map(|group| &mut group.$name as &mut dyn $crate::Field),
                }),+];
                ROWS
            }
            fn defaults(&self) -> &'static dyn $crate::Settings {
                <Self as $crate::Group>::DEFAULTS
            }
            fn paper(&self) -> Box<dyn $crate::Settings> {
                Box::new(Self::PAPER)
            }
            fn boxed(&self) -> Box<dyn $crate::Settings> {
                Box::new(*self)
            }
            fn coarsen(&mut self) {
                $($(self.$name = $coarse;)?)+
            }
        }
    };

    ($(#[$meta:meta])* $vis:vis struct $group:ident ($key:literal) {$($rows:tt)+}) => {
        $crate::settings!(@rows {$(#[$meta])* $vis struct $group ($key)} {} {$($rows)+});
    };
}
