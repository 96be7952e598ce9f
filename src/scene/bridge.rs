//! Errors of the water as errors of the scene.

use super::check::{At, Invalid};
use super::water::Water;

/// Checks the water's values.
pub(super) fn validate_water(_water: &Water, _at: &At<'_>) -> Result<(), Invalid> {
    Ok(())
}
