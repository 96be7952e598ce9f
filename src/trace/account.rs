//! Memory of a run, known before anything is made.

use glam::Vec3;

use nephroid_scene::water::WaterModel;
use nephroid_scene::{Account, Density, Scene, Smoke};

use super::tracer::TraceOptions;
use super::volume::MOST_VALUES;

/// The program itself, and what its threads take.
const PROGRAM_BYTES: u64 = 24 << 20;

/// Bytes of a triangle: in its mesh, in the world with the normals of its corners, and in two trees while they are made.
const TRIANGLE_BYTES: u64 = 24 + 48 + 36 + 160;

/// Bytes of a vertex of a water surface that has no formula: height and normal, and its height again.
const WATER_VERTEX_BYTES: u64 = 20;

/// Bytes of a pixel: what it shows, the boxes of its footprint and their tree, sums of the run and of the batch, light straight from the lights, results,
/// layers and the file.
const PIXEL_BYTES: u64 = 1000;

/// Bytes of a pixel's sums alone, and of a texel of the measuring plane: with results, layers and the file.
const TEXEL_BYTES: u64 = 160;

/// Bytes of a pixel if scattered light is measured: two pictures of sums, the sums of a round, and where its views end.
const VIEW_BYTES: u64 = 2 * TEXEL_BYTES + 200;

/// Bytes of a pixel whose views go on behind the water's surface, a quarter of which may be cut.
const TUBE_BYTES: u64 = 5 * 330;

/// Bytes of the beams of a round.
const BEAMS_BYTES: u64 = 48 << 20;

/// The memory of a run.
#[must_use]
pub fn account(scene: &Scene, options: &TraceOptions) -> Account {
    let mut account = Account::default();
    account.add("the program", PROGRAM_BYTES, "");
    let triangles: u64 = (0..scene.objects.len()).map(|object| scene.triangle_estimate(object)).sum();
    account.add("meshes", triangles * TRIANGLE_BYTES, "the detail of the objects");
    if let Some(water) = &scene.water {
        let (columns, rows) = match (scene.trace.grid, &water.model) {
            (Some(grid), _) => grid,
            (None, WaterModel::PipeFluid(fluid)) => {
                let (columns, rows) = fluid.cell_counts(water);
                (2 * columns + 1, 2 * rows + 1)
            }
            (None, WaterModel::FftOcean(_)) => (4095, 4095),
            (None, _) => (0, 0),
        };
        account.add("the water's surface", u64::from(columns) * u64::from(rows) * WATER_VERTEX_BYTES, "trace.grid");
    }
    let picture = u64::from(scene.image.width) * u64::from(scene.image.height);
    let shown = match &options.points {
        Some(points) => points.positions.len() as u64,
        None if options.camera => picture,
        None => 0,
    };
    account.add("pixels", shown * PIXEL_BYTES, "image.width or image.height");
    if options.volume {
        let refracted = scene.water.is_some() && (scene.medium.sigma_s != Vec3::ZERO || scene.smoke.is_some());
        let per_pixel = VIEW_BYTES + if refracted { TUBE_BYTES } else { 0 };
        account.add("light in media", picture * per_pixel + BEAMS_BYTES, "image.width or image.height");
        if let Some(Smoke { density: Density::Noise { cells: (x, y, z), .. }, .. }) = scene.smoke {
            // Views pass through no more half cells than along all three sides.
            let values = picture * 2 * (u64::from(x) + u64::from(y) + u64::from(z));
            account.add(
                "smoke on the way to the eye",
                4 * values.min(MOST_VALUES),
                "the cells of smoke.density, image.width or image.height",
            );
        }
    }
    if let Some(plane) = &scene.trace.plane {
        account.add(
            "the measuring plane",
            u64::from(plane.texels.0) * u64::from(plane.texels.1) * TEXEL_BYTES,
            "the texels of trace.plane",
        );
    }
    account
}
