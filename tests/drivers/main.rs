//! Frames on every Vulkan driver there is: the cross-check, and conformance. Needs the feature `wgpu`.

#[path = "../support/frames.rs"]
mod frame_library;
#[path = "../support/mod.rs"]
mod support;

mod allowed;
mod conformance;
mod crosscheck;
mod formats;
mod frames;
mod passes;
