//! Numbers: spaces, fixed point, SIMD lanes, deterministic elementary functions, random numbers, optics.

pub mod lanes;
pub mod noise;
pub mod vector;
