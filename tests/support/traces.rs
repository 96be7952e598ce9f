//! Runs of the ground truth.

use std::path::Path;

use nephroid::scene::{self, Scene};
use nephroid::trace::{TraceOptions, Tracer};

pub fn options(camera: bool, volume: bool) -> TraceOptions {
    TraceOptions { seed: 7, camera, volume, ..TraceOptions::default() }
}

/// Water waves over a floor, and above it a glass ball in smoke, all lit by a sun and a spot: every part of the tracer at once.
pub fn everything() -> Scene {
    let text = "(
        image: (width: 24, height: 16),
        camera: Perspective(position: (0, 2.5, 4), target: (0, 0, 0)),
        lights: [
            Directional(aim: Sun(elevation_deg: 50, azimuth_deg: 40), irradiance: (900, 850, 800)),
            Spot(position: (1.5, 3, 1), direction: (-1.5, -2.3, -1), intensity: (50, 80, 90)),
        ],
        water: (size_m: (3, 3), grid: (32, 32), model: AxisCosine(), abbe: 56),
        medium: Coastal,
        smoke: (min: (-1, 0.2, -1), max: (1, 1.6, 1), sigma_s: (0.4, 0.4, 0.4), g: 0.5, density: Noise(cells: (16, 16, 16))),
        objects: [
            (shape: Pool(size_m: (3, 3), depth_m: 1.2, far_depth_m: 1.2, deck_m: 0.5)),
            (shape: UvSphere(radius_m: 0.3), transform: (translate: (0, 0.7, 0)), material: Dielectric(abbe: 59, absorption: (1, 0.2, 0.1))),
            (shape: Cuboid(size_m: (0.4, 0.4, 0.02)), transform: (translate: (-0.8, 0.6, 0), rotate_deg: (0, 30, 0)), material: Mirror()),
        ],
        trace: (plane: (corner: (-1, -1.1, -1), u: (0, 0, 2), v: (2, 0, 0), texels: (16, 16))),
    )";
    scene::parse(text, "everything", Path::new(""), &[]).expect("the scene is valid")
}

/// The kept state after some batches, which holds every sum of the run.
pub fn run_on(threads: usize, scene: &Scene, options: &TraceOptions, batches: u64) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| {
        let mut tracer = Tracer::new(scene, options).expect("the scene can be traced");
        for _ in 0..batches {
            tracer.run_batch();
        }
        tracer.state()
    })
}
