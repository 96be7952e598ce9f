//! Every attachment of every pass of every shipped scene and technique: the same bytes on 1, 2 and 7 threads and at every SIMD level, equal to the
//! committed hashes in `tests/data/hashes.txt`. Runs in debug and release, so both must agree with the file.
//!
//! Scenes are rendered at a quarter of their width and height, because an attachment is compared byte for byte and not looked at. A release
//! build renders them whole as well, as they are shipped, on the two devices that are least alike.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::frame::{FrameObserver, FramePass};
use nephroid::math::level::available_levels;
use nephroid::pipeline::shader::ShaderWidth;
use nephroid::pipeline::{DeviceOptions, Observer, PassOutput, Texture};
use nephroid::scene::water::{Water, WaterModel};
use nephroid::scene::{LightVolumes, Material, Scene, Shape};

const SCENES: [&str; 17] = [
    "pool.ron",
    "jetty.ron",
    "ring.ron",
    "ball.ron",
    "pots.ron",
    "columns.ron",
    "glass.ron",
    "analytic/flat_water.ron",
    "analytic/sine_water.ron",
    "analytic/crossed_sines.ron",
    "analytic/wedge.ron",
    "analytic/matched.ron",
    "analytic/slab.ron",
    "analytic/cap.ron",
    "analytic/glass_ball.ron",
    "analytic/mirror_ring.ron",
    "analytic/cardioid.ron",
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Techniques, and settings of theirs that draw otherwise.
const FRAMES: [&str; 3] = ["caustic-volumes", "light-volumes", "light-volumes:paper"];

fn small_scene(name: &str, frame: &str) -> Scene {
    let mut scene = nephroid::scene::load(&root().join("scenes").join(name)).expect("a shipped scene loads");
    scene.image.width = (scene.image.width / 4).max(64);
    scene.image.height = (scene.image.height / 4).max(64);
    scene.techniques.caustic_volumes.samples = 1;
    scene.techniques.caustic_volumes.shadow_map_size = 512;
    scene.techniques.caustic_volumes.grid = Some((33, 33));
    if frame.ends_with(":paper") {
        scene.techniques.light_volumes = LightVolumes::PAPER;
    }
    scene.techniques.light_volumes.samples = 1;
    scene.techniques.light_volumes.shadow_map_size = 512;
    scene.techniques.light_volumes.grid = Some((33, 33));
    with_few_beams(with_cheap_parts(scene), frame)
}

/// Sculptures and simulated water made coarser: making them again for every device takes longer than drawing them small.
fn with_cheap_parts(mut scene: Scene) -> Scene {
    for object in &mut scene.objects {
        if let Shape::Figure(figure) = &mut object.shape {
            figure.resolution = 32;
        }
    }
    if let Some(Water { model: WaterModel::PipeFluid(fluid), .. }) = &mut scene.water {
        fluid.cells = Some((48, 48));
    }
    scene
}

/// Mirrors and glass with fewer triangles, each of which `light-volumes` draws by itself.
fn with_few_beams(mut scene: Scene, frame: &str) -> Scene {
    if frame.starts_with("light-volumes") {
        scene.techniques.light_volumes.generator_edge = 0.5;
        for object in scene.objects.iter_mut().filter(|object| !matches!(object.material, Material::Diffuse { .. })) {
            match &mut object.shape {
                Shape::UvSphere(sphere) => (sphere.slices, sphere.stacks) = (24, 12),
                Shape::TorusKnot(knot) => (knot.segments, knot.sides) = (96, 12),
                Shape::Cylinder(cylinder) => cylinder.slices = 48,
                _ => {}
            }
        }
    }
    scene
}

/// Hashes every attachment after every pass.
#[derive(Default)]
struct Hasher {
    lines: Vec<(String, u64)>,
}

/// A hash by words of eight bytes, little-endian, the last one filled up with zeros; by bytes it would take a tenth of the test. Every step can be
/// undone, so one changed word always changes it, and the upper half is folded onto the lower, lest two changed signs cancel.
fn hash(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    let words = words.iter().copied().chain((!rest.is_empty()).then_some(last));
    words.fold(bytes.len() as u64, |hash, word| {
        let mixed = (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ mixed >> 32
    })
}

impl FrameObserver for Hasher {
    fn pass_begin(&mut self, _index: usize, _pass: &FramePass) -> Option<&mut dyn Observer> {
        None
    }
    fn pass_end(&mut self, _index: usize, pass: &FramePass, textures: &[Texture], _output: &PassOutput) {
        let views = pass.color.iter().flatten().map(|t| t.view).chain(pass.depth.iter().map(|t| t.view));
        for view in views {
            let texture = &textures[view.texture.index()];
            let hash = hash(&texture.read_bytes(view.level, view.layer));
            self.lines.push((format!("{}/{}", pass.label.replace(' ', "_"), texture.desc().label.replace(' ', "_")), hash));
        }
    }
}

fn hashes(scene: &Scene, frame: &str, device: DeviceOptions) -> Vec<(String, u64)> {
    let technique = frame.split(':').next().unwrap_or(frame).to_owned();
    let options = RenderOptions { technique, device, layers: Some(vec!["color".into()]), ..RenderOptions::default() };
    let mut hasher = Hasher::default();
    Renderer::new(scene, &options).expect("device").render(scene, Some(&mut hasher)).expect("frame");
    hasher.lines
}

#[test]
fn every_attachment_has_the_same_bytes_everywhere() {
    let mut text = String::new();
    for (name, frame) in SCENES.iter().flat_map(|name| FRAMES.map(|frame| (name, frame))) {
        let scene = small_scene(name, frame);
        let reference = hashes(&scene, frame, DeviceOptions { threads: Some(1), ..DeviceOptions::default() });
        for (attachment, hash) in &reference {
            writeln!(text, "{name} {frame} {attachment} {hash:016x}").expect("writing to a string");
        }
        for threads in [2, 7] {
            let other = hashes(&scene, frame, DeviceOptions { threads: Some(threads), ..DeviceOptions::default() });
            assert_eq!(other, reference, "{name}, {frame} on {threads} threads");
        }
        for (level_name, level) in available_levels() {
            let other = hashes(&scene, frame, DeviceOptions { level: Some(level), ..DeviceOptions::default() });
            assert_eq!(other, reference, "{name}, {frame} at level {level_name}");
        }
        let scalar = hashes(&scene, frame, DeviceOptions { width: ShaderWidth::One, ..DeviceOptions::default() });
        assert_eq!(scalar, reference, "{name}, {frame} with one lane");
        let waves = hashes(&scene, frame, DeviceOptions { bin_budget_bytes: 1, ..DeviceOptions::default() });
        assert_eq!(waves, reference, "{name}, {frame} in many waves");
    }
    compare_with_file(&root().join("tests/data/hashes.txt"), &text);
}

#[test]
#[cfg_attr(debug_assertions, ignore = "takes minutes in a debug build")]
fn whole_scenes_have_the_same_bytes_on_devices_least_alike() {
    let narrowest = available_levels()[0].1;
    for name in SCENES {
        for technique in TECHNIQUES.iter().map(|technique| technique.name()) {
            let scene = nephroid::scene::load(&root().join("scenes").join(name)).expect("a shipped scene loads");
            let scene = with_few_beams(scene, technique);
            let best = hashes(&scene, technique, DeviceOptions::default());
            let least = hashes(
                &scene,
                technique,
                DeviceOptions { threads: Some(7), level: Some(narrowest), width: ShaderWidth::One, bin_budget_bytes: 1 << 20 },
            );
            assert_eq!(best, least, "{name}, {technique}");
        }
    }
}

/// Fails if the file is missing or differs; `REPLACE=1` writes it.
fn compare_with_file(path: &Path, text: &str) {
    if std::env::var_os("REPLACE").is_some() {
        std::fs::write(path, text).expect("the hash file can be written");
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    for (seen, expected) in text.lines().zip(committed.lines()) {
        assert_eq!(seen, expected, "an attachment changed; if that is meant, run with REPLACE=1 and say so in the changelog");
    }
    assert_eq!(text.lines().count(), committed.lines().count(), "the list of attachments changed, or {} is missing", path.display());
}

#[test]
fn a_changed_attachment_changes_its_hash() {
    let mut scene = small_scene("analytic/flat_water.ron", FRAMES[0]);
    let before = hashes(&scene, FRAMES[0], DeviceOptions::default());
    scene.medium.sigma_a.x += 1.0e-4;
    let after = hashes(&scene, FRAMES[0], DeviceOptions::default());
    assert_ne!(before, after);
}
