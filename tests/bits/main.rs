//! The same input gives the same bytes: on any number of threads, at every SIMD level, in every profile, on every machine.
//!
//! - `passes`: synthetic passes with everything in them. `scenes`: every attachment of every pass of every shipped scene and technique.
//!   `traces`: the ground truth. `pictures`: display codes.
//! - The tests named `committed` hold one run of each against hashes in this folder. They are what `.ci/run` runs in the profiles `dev` and
//!   `release` as well: `cargo test --profile dev --test bits committed`.

#[path = "../support/mod.rs"]
mod support;

mod devices;
mod passes;
mod scenes;
mod traces;
