//! Whether the bright lines of a caustic lie where they should.
//!
//! [`find`] marks where a picture has ridges, to a fraction of a pixel, and [`distance`] measures how far two such sets lie apart. Both look at
//! luminance only; neither cares how bright the ridges are, which is for the other metrics to say.

mod distance;
mod find;
#[cfg(test)]
mod tests;

pub use distance::{RidgeError, ridge_error};
pub use find::RidgeSettings;
