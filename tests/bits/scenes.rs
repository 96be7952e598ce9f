//! Every attachment of every pass of every shipped scene and technique, in both radiometries: the same bytes on devices that differ, and those
//! of the committed hashes.
//!
//! Scenes are rendered at a quarter of their width and height, because an attachment is compared byte for byte and not looked at. At full
//! size they are rendered as they are shipped as well, on the two devices that are least alike.
//!
//! A frame is built once and run on every device. Building asks a device too (`light-volumes` counts samples), so it is built a second time on
//! the device that is least like the first.

use std::fmt::Write as _;
use std::path::PathBuf;

use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES};
use nephroid::frame::{Contents, CpuExecutor, Executor, Frame, FrameObserver, FramePass};
use nephroid::math::level::wide_levels;
use nephroid::pipeline::shader::ShaderWidth;
use nephroid::pipeline::{Device, DeviceOptions, Observer, PassOutput};
use nephroid::scene::{CausticVolumes, LightVolumes, Material, Scene, Shape};

use crate::devices;
use crate::support::numbers::hash_words;
use crate::support::{self, shipped_scenes, with_coarse_parts};

/// Techniques, each as it is and as its paper has it.
const FRAMES: [&str; 4] = ["caustic-volumes", "caustic-volumes:paper", "light-volumes", "light-volumes:paper"];

/// Most memory that a frame may take, bytes.
const MEMORY_LIMIT: u64 = 4 << 30;

fn small_scene(name: &str, frame: &str) -> Scene {
    let mut scene = support::scene(name);
    scene.image.width = (scene.image.width / 4).max(64);
    scene.image.height = (scene.image.height / 4).max(64);
    if frame.ends_with(":paper") {
        scene.techniques.caustic_volumes = CausticVolumes::PAPER;
        scene.techniques.light_volumes = LightVolumes::PAPER;
    }
    scene.techniques.caustic_volumes.samples = 1;
    scene.techniques.caustic_volumes.shadow_map_size = 512;
    scene.techniques.caustic_volumes.grid = Some((33, 33));
    scene.techniques.light_volumes.samples = 1;
    scene.techniques.light_volumes.shadow_map_size = 512;
    scene.techniques.light_volumes.grid = Some((33, 33));
    with_few_beams(with_coarse_parts(scene), frame)
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

impl FrameObserver for Hasher {
    fn pass_begin(&mut self, _index: usize, _pass: &FramePass) -> Option<&mut dyn Observer> {
        None
    }
    fn pass_end(&mut self, _index: usize, pass: &FramePass, contents: &Contents, _output: &PassOutput) {
        let views = pass.color.iter().flatten().map(|t| t.view).chain(pass.depth.iter().map(|t| t.view));
        for view in views {
            let texture = contents.texture(view.texture);
            let hash = hash_words(&texture.read_bytes(view.level, view.layer));
            self.lines.push((format!("{}/{}", pass.label.replace(' ', "_"), texture.desc().label.replace(' ', "_")), hash));
        }
    }
}

/// Runs a frame; name and hash of every attachment of every pass.
fn hashes(executor: &mut CpuExecutor, frame: &Frame) -> Vec<(String, u64)> {
    let mut hasher = Hasher::default();
    executor.run(frame, Some(&mut hasher)).expect("the frame is valid");
    hasher.lines
}

/// A scene's frame, built on a device of these options.
fn build(scene: &Scene, frame: &str, device: DeviceOptions) -> Frame {
    let technique = frame.split(':').next().unwrap_or(frame).to_owned();
    let options = RenderOptions { technique, device, layers: Some(vec!["color".into()]), ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("device").build(scene).expect("frame").frame
}

/// The device that is least like the reference: many threads, the lowest level, one lane, small bins.
fn least_alike() -> DeviceOptions {
    DeviceOptions { threads: Some(7), level: Some(wide_levels()[0].1), width: ShaderWidth::One, bin_budget_bytes: 1 << 20 }
}

fn executor(device: Device) -> CpuExecutor {
    CpuExecutor::new(device, MEMORY_LIMIT)
}

fn named_frames() -> Vec<(String, &'static str)> {
    shipped_scenes().into_iter().flat_map(|name| FRAMES.map(|frame| (name.clone(), frame))).collect()
}

/// The hashes of a run, a line each, as they are committed.
fn lines(name: &str, frame: &str, hashes: &[(String, u64)]) -> String {
    hashes.iter().fold(String::new(), |mut text, (attachment, hash)| {
        writeln!(text, "{name} {frame} {attachment} {hash:016x}").expect("writing to a string");
        text
    })
}

fn hash_file() -> PathBuf {
    support::path("tests/bits/hashes.txt")
}

/// All threads of the machine at its best level, against the file. `REPLACE=1` writes the file.
#[test]
fn scenes_have_the_committed_hashes() {
    let mut executor = executor(Device::new(DeviceOptions::default()).expect("threads start"));
    let of = |(name, frame): (String, &str)| {
        let built = build(&small_scene(&name, frame), frame, DeviceOptions::default());
        lines(&name, frame, &hashes(&mut executor, &built))
    };
    let text: String = named_frames().into_iter().map(of).collect();
    if std::env::var_os("REPLACE").is_some() {
        std::fs::write(hash_file(), &text).expect("the hash file can be written");
    }
    let committed = std::fs::read_to_string(hash_file()).unwrap_or_default();
    for (seen, expected) in text.lines().zip(committed.lines()) {
        assert_eq!(seen, expected, "an attachment changed; if that is meant, run with REPLACE=1 and say so in the changelog");
    }
    assert_eq!(text.lines().count(), committed.lines().count(), "the list of attachments changed, or the file is missing");
}

/// One frame, built on one thread, on devices that differ; and once more built and run on the device that is least like them.
#[test]
fn scenes_have_the_same_bytes_on_devices_that_differ() {
    let committed = std::fs::read_to_string(hash_file()).expect("the hash file is there");
    let mut others: Vec<_> = devices::others().into_iter().map(|(name, device)| (name, executor(device))).collect();
    // The device least alike has the lowest level.
    others.pop();
    let mut least = executor(Device::new(least_alike()).expect("threads start"));
    for (name, frame) in named_frames() {
        let scene = small_scene(&name, frame);
        let start = format!("{name} {frame} ");
        let expected: String = committed.split_inclusive('\n').filter(|line| line.starts_with(&start)).collect();
        let built = build(&scene, frame, DeviceOptions { threads: Some(1), ..DeviceOptions::default() });
        for (device, executor) in &mut others {
            assert_eq!(lines(&name, frame, &hashes(executor, &built)), expected, "{device}");
        }
        let again = build(&scene, frame, least_alike());
        assert_eq!(lines(&name, frame, &hashes(&mut least, &again)), expected, "built and run on the device least alike");
    }
}

#[test]
fn whole_scenes_have_the_same_bytes_on_devices_least_alike() {
    if !support::full() {
        println!("not run: at full size only");
        return;
    }
    for name in shipped_scenes() {
        for technique in TECHNIQUES.iter().map(|technique| technique.name()) {
            let scene = with_few_beams(support::scene(&name), technique);
            let of = |options: DeviceOptions| {
                let device = Device::new(options).expect("threads start");
                hashes(&mut executor(device), &build(&scene, technique, options))
            };
            assert_eq!(of(DeviceOptions::default()), of(least_alike()), "{name}, {technique}");
        }
    }
}

#[test]
fn a_changed_attachment_changes_its_hash() {
    let mut scene = small_scene("analytic/flat_water.ron", FRAMES[0]);
    let mut executor = executor(Device::new(DeviceOptions::default()).expect("threads start"));
    let mut of = |scene: &Scene| hashes(&mut executor, &build(scene, FRAMES[0], DeviceOptions::default()));
    let before = of(&scene);
    scene.medium.sigma_a.x += 1.0e-4;
    assert_ne!(before, of(&scene));
}
