//! Positions of the bright lines of a caustic.
//!
//! [`find`] marks the ridges of a picture to a fraction of a pixel, and [`distance`] measures distances between two such sets. Both use luminance
//! only. How bright the ridges are is left to other measures.

mod distance;
mod find;
#[cfg(test)]
mod tests;

pub use distance::{RidgeError, ridge_error};
pub use find::RidgeSettings;
