//! Memory that a picture takes, known before anything large is made.
//!
//! The textures and small buffers of a frame follow from a sketch of it: the technique's own frame, of the scene with its water on a grid of two by two and
//! with one small thing in place of each object. Meshes, beams and photons are counted by their numbers and the sizes of their records.

use glam::Vec3;

use nephroid_pipeline::Device;
use nephroid_pipeline::frame::Frame;
use nephroid_scene::geom::shapes::Cuboid;
use nephroid_scene::water::WaterModel;
use nephroid_scene::{Account, Scene, Shape, Transform};

use super::{RenderError, Technique};

/// Bytes of a draw: in the frame, and in the executor's list.
pub const DRAW_BYTES: u64 = 512;

/// The program itself, its threads' stacks, and what every picture takes.
const PROGRAM_BYTES: u64 = 24 << 20;

/// Bytes of a triangle of an object: its indices, in the mesh and in a buffer, and about half a vertex, in both; and once more while it is made.
const TRIANGLE_BYTES: u64 = 2 * 12 + (24 + 32) / 2 + 12 + 24 / 2;

/// Bytes of a vertex of the water: height and normal, position while buffers are made, vertex and two triangles in buffers, heights as a texture.
const WATER_VERTEX_BYTES: u64 = 16 + 12 + 32 + 24 + 24 + 8;

/// Bytes of textures per pixel, where no sketch says how many there are: one sample per pixel, with glass.
const PICTURE_BYTES: u64 = 320;

/// Channels of all layers of a picture, and what a file of them takes: they are encoded while the file before is written.
const LAYER_CHANNELS: u64 = 25;

/// The memory of a picture of a scene.
#[must_use]
pub fn account(technique: &'static dyn Technique, scene: &Scene, device: &Device, layers: &[&str]) -> Account {
    let mut account = Account::default();
    account.add("the program", PROGRAM_BYTES + 2 * device.wave_bytes() as u64, "");
    let triangles: u64 = (0..scene.objects.len()).map(|object| scene.triangle_estimate(object)).sum();
    account.add("meshes", triangles * TRIANGLE_BYTES, "the detail of the objects");
    let grid = technique.grid(scene).map_or(0, |(columns, rows)| u64::from(columns) * u64::from(rows));
    account.add("the water's mesh", grid * WATER_VERTEX_BYTES, &format!("water.grid or {}.grid", technique.settings().key()));
    account.parts.extend(technique.memory(scene));
    let pixels = u64::from(scene.image.width) * u64::from(scene.image.height);
    // A technique may refuse the sketch where it does not refuse the scene.
    let textures = sketch(technique, scene, device, layers).map_or(pixels * PICTURE_BYTES, |frame| frame.memory().resources());
    account.add("textures", textures, "image.width, image.height, samples, or the sizes of maps");
    let channels = if layers.len() == 1 { 3 } else { LAYER_CHANNELS };
    account.add("layers and files", pixels * channels * 4 * 3 / 2, "image.width, image.height, or the layers");
    account
}

/// The frame of a scene whose meshes are as small as can be: blocks that stand in the water and out of it, so that there is every map that the scene could need.
fn sketch(technique: &'static dyn Technique, scene: &Scene, device: &Device, layers: &[&str]) -> Result<Frame, RenderError> {
    let mut small = scene.clone();
    let level = scene.water.as_ref().map_or(0.0, |water| water.level_m);
    for object in &mut small.objects {
        object.shape = Shape::Cuboid(Cuboid::default());
        object.transform = Transform { translate: Vec3::Y * level, ..Transform::default() };
    }
    small.objects.dedup_by(|a, b| std::mem::discriminant(&a.material) == std::mem::discriminant(&b.material));
    if let Some(water) = &mut small.water {
        (water.model, water.grid) = (WaterModel::Flat, (2, 2));
    }
    technique.sketch(&mut small);
    device.install(|| Ok(technique.prepare(&small)?.frame(&small, device, layers)?.frame))
}
