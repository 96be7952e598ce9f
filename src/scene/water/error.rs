//! The one error of water descriptions: a field out of its range.

use std::fmt::{Debug, Display};

/// A field of a water description whose value is not allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("water: {field} is {value}; allowed: {allowed}")]
pub struct WaterError {
    /// Path of the field from the water description, as written in a scene file: `model.waves[2].wavelength_m`.
    pub field: String,
    /// The value seen.
    pub value: String,
    /// The values allowed, with their unit.
    pub allowed: &'static str,
}

/// `Ok` if `valid`, else the error that names `field`, its `value` and what is `allowed`.
pub(super) fn require(valid: bool, field: impl Display, value: impl Debug, allowed: &'static str) -> Result<(), WaterError> {
    if valid { Ok(()) } else { Err(WaterError { field: field.to_string(), value: format!("{value:?}"), allowed }) }
}

/// True for every number in `low..=high`, and so for no NaN.
pub(super) fn within(value: f32, low: f32, high: f32) -> bool {
    (low..=high).contains(&value)
}
