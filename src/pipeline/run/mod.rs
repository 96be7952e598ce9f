//! Runs passes: devices, and the order of all work in a pass (`pass.rs`).

pub(crate) mod buffer_pool;
pub(crate) mod clear;
pub(crate) mod device;
pub(crate) mod pass;
