//! Pictures as data, and their two file formats.
//!
//! In: float layers with the renderer's names. Out: an 8-bit PNG to look at and a multi-layer EXR to measure.
//!
//! - [`Image`] is a rectangle of pixels of any type with a checked size, row-major, top row first.
//! - [`Layer`] is one to four float planes under a name; [`LayerSet`] is the result of a render. [`STANDARD_LAYERS`] lists the names.
//! - [`tone`] turns linear radiance into display codes; [`png`] and [`openexr`] encode and decode; [`mod@file`] reads and writes whole files.
//!
//! Everything here is a pure function of its arguments, except [`mod@file`], which uses the file system. The same layers give the same bytes on any
//! machine and on any number of threads: files contain no time, no machine name, and nothing in the order of an unordered map. Not here: the pixel
//! formats of the software GPU (they belong to its textures).

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
