//! Any bytes given to the PLY reader make a valid mesh or an error, without a panic and without memory out of proportion.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nephroid_scene::mesh_file::{MeshLimits, ply};

const LIMITS: MeshLimits = MeshLimits { max_vertices: 100_000, max_triangles: 100_000, max_file_bytes: 1 << 20 };

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = ply::from_bytes(Path::new("fuzz.ply"), bytes, &LIMITS) {
        assert_eq!(mesh.validate(), Ok(()));
    }
});
