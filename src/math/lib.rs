//! Numbers: spaces, fixed point, SIMD lanes, deterministic elementary functions, random numbers, optics.

pub mod float;
pub mod lanes;
pub mod level;
pub mod noise;
pub mod optics;
pub mod rng;
pub mod space;
pub mod vector;
