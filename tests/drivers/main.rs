//! Frames on every Vulkan driver there is: the cross-check, and conformance. Needs the feature `wgpu`.

#[path = "../support/mod.rs"]
mod support;

mod conformance;
mod crosscheck;
mod passes;
