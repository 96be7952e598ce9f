//! Errors of the water as errors of the scene.

use super::check::{At, Invalid};
use super::text::{Path, Step};
use super::water::{Water, WaterError};

/// Checks the water, and that its surface exists at `time_s`.
pub(super) fn validate_water(water: &Water, time_s: f32, root: &At<'_>) -> Result<(), Invalid> {
    water.validate().map_err(|error| invalid(error, root.field("water").path()))?;
    water.validate_time(time_s).map_err(|error| invalid(WaterError { field: "time_s".to_owned(), ..error }, root.path()))
}

/// A water error, whose path starts at the water, as an error of the scene.
///
/// The path may end in a remark after a colon, and names the only argument of `Waves([...])`, which has no name in the file.
fn invalid(error: WaterError, mut path: Path) -> Invalid {
    let (field, remark) = error.field.split_once(':').unwrap_or((&error.field, ""));
    for part in field.split('.') {
        let (name, mut indices) = part.split_once('[').unwrap_or((part, ""));
        if name != "waves" {
            path.0.push(Step::Name(name.to_owned()));
        }
        while let Some((index, rest)) = indices.split_once(']') {
            path.0.extend(index.parse().ok().map(Step::Index));
            indices = rest.trim_start_matches('[');
        }
    }
    let found = if remark.is_empty() { error.value } else { format!("{}, {}", error.value, remark.trim()) };
    Invalid { path, found, expected: error.allowed.to_owned() }
}
