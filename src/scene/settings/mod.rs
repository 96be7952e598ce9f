//! Settings of techniques, which this crate does not know: a technique states a table of rows ([`settings!`](macro@crate::settings)), and a scene that
//! is read for it has its values ([`TechniqueSettings`]).

mod choice;
mod field;
mod rows;
mod shared;
mod techniques;

pub use choice::Choice;
pub use field::{Allowed, Bounded, Field, Limits, Plain};
pub use rows::{Group, Row, Settings, limits};
pub use shared::{EyeRefraction, MAX_GRID, Radiometry};
pub use techniques::TechniqueSettings;

#[cfg(test)]
pub(crate) mod tests;
