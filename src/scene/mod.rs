//! What is rendered: descriptions read from scene files, validated once.

pub mod water;
