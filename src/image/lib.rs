//! Pictures as data, and the two files they go to.
//!
//! In: float layers named as the renderer names them. Out: an 8-bit PNG to look at and a multi-layer EXR to measure.
//!
//! - [`Image`] is one checked rectangle of anything, row-major, top row first.
//! - [`Layer`] is one to four float planes under a name; [`LayerSet`] is what a render returns. [`STANDARD_LAYERS`] lists the names.
//! - [`tone`] turns linear radiance into display codes; [`png`] and [`openexr`] encode and decode; [`mod@file`] reads and writes whole files.
//!
//! Everything here is a pure function of its arguments, except [`mod@file`], which touches the file system. The same layers give the same
//! bytes on any machine and on any number of threads: no time, no name of the machine, no unordered map goes into a file.
//! What it does not do: pixel formats of the software GPU (they belong to its textures) and comparing images (metrics).

pub mod file;
pub mod layer;
pub mod metrics;
pub mod openexr;
mod pixels;
pub mod png;
pub mod report;
pub mod tone;

pub use file::{FileError, Kind, Picture, read, write_atomically};
pub use layer::{Layer, LayerError, LayerSet, STANDARD_LAYERS, StandardLayer};
pub use pixels::{Image, SizeError};
pub use tone::ToneMap;
