//! Numbers: spaces, fixed point, SIMD lanes, deterministic elementary functions, random numbers, optics.

pub mod float;
pub mod lanes;
pub mod level;
pub mod noise;
#[cfg(feature = "glam")]
pub mod optics;
pub mod rng;
#[cfg(feature = "glam")]
pub mod space;
pub mod vector;
