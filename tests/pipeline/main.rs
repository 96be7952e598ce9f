//! Tests of the software GPU as a whole: vectors from the WebGPU conformance suite, properties on random triangles against independent
//! rasterizers, closed volumes in the stencil, driver presets, and fast paths against the general path.
//!
//! Every comparison helper has a test in which it must fail (`negative.rs`, or beside the helper).

#[path = "../support/frames.rs"]
mod frames;
#[path = "../support/numbers.rs"]
mod numbers;
#[path = "../support/passes.rs"]
mod passes;

mod blending;
mod canvas;
mod coverage;
mod depth_stencil;
mod drawing;
mod fast_paths;
mod formats;
mod fragments;
mod frame_passes;
mod levels;
mod merging;
mod meshes;
mod not_a_number;
mod order;
mod presets;
mod reference;
mod repetition;
mod robust;
mod rooms;
mod splats;
mod sprites;
mod stages;
mod textures;
mod validation;
mod volumes;
