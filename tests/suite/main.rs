//! Everything that is neither bits nor drivers: files, scenes, pictures, the program, the ground truth and the techniques against what is known.

#[path = "../support/mod.rs"]
mod support;

mod analytic;
mod audit;
mod caustic_volumes;
mod caustic_volumes_analytic;
mod cli;
mod direct;
mod docs_paths;
mod energy;
mod flip;
mod frame_builder;
mod images;
mod layering;
mod light_volumes;
mod light_volumes_insides;
mod light_volumes_truth;
mod memory;
mod mesh_files;
mod passes;
mod pictures;
mod places;
mod readback;
mod render_cli;
mod scene_files;
mod seam;
mod seen_in_glass;
mod settings;
mod shadow_edges;
mod splatting;
mod splatting_claims;
mod through_the_surface;
mod trace;
mod trace_cli;
mod waterside;
mod wgsl;
