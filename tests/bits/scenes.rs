//! Every attachment of every pass of every shipped scene, technique and variant: the same bytes on devices that differ, and those of the
//! committed hashes.
//!
//! Scenes are rendered at a quarter of their width and height, because an attachment is compared byte for byte and not looked at. At full
//! size they are rendered as they are shipped as well, on the two devices that are least alike.
//!
//! A frame is built once and run on every device. Building may ask a device too (for counts of samples), so it is built a second time on
//! the device that is least like the first.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use nephroid::caustics::{RenderOptions, Renderer, TECHNIQUES, Technique, Variant};
use nephroid::frame::{Contents, CpuExecutor, Executor, Frame, FrameObserver, Pass};
use nephroid::math::level::wide_levels;
use nephroid::pipeline::shader::ShaderWidth;
use nephroid::pipeline::{Device, DeviceOptions, Observer, PassOutput};
use nephroid::scene::Scene;

use crate::devices;
use crate::support::numbers::hash_words;
use crate::support::{self, shipped_scenes, with_coarse_parts};

/// Scenes that techniques of the tests' own are drawn in, which are there to show that the tests see them, and further variants of the library's: the
/// scenes differ in what all variants share.
const FEW: [&str; 2] = ["analytic/flat_water.ron", "ring.ron"];

/// Most memory that a frame may take, bytes.
const MEMORY_LIMIT: u64 = 4 << 30;

/// A technique in one of its variants.
struct Run {
    technique: &'static dyn Technique,
    variant: Variant,
}

impl Run {
    fn label(&self) -> String {
        self.variant.label(self.technique)
    }

    /// A shipped scene in a size for tests.
    fn small_scene(&self, name: &str) -> Scene {
        let mut scene = support::scene(name);
        scene.image.width = (scene.image.width / 4).max(64);
        scene.image.height = (scene.image.height / 4).max(64);
        self.variant.apply(&mut scene);
        scene.techniques.coarsen();
        let mut scene = with_coarse_parts(scene);
        self.technique.coarsen(&mut scene);
        scene
    }
}

/// Hashes every attachment after every pass.
#[derive(Default)]
struct Hasher {
    lines: Vec<(String, u64)>,
}

impl FrameObserver for Hasher {
    fn pass_begin(&mut self, _index: usize, _pass: &Pass) -> Option<&mut dyn Observer> {
        None
    }
    fn pass_end(&mut self, _index: usize, pass: &Pass, contents: &Contents, _output: &PassOutput) {
        let views = pass.color.iter().flatten().map(|t| t.view).chain(pass.depth_stencil.iter().map(|t| t.view));
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
fn build(scene: &Scene, technique: &dyn Technique, device: DeviceOptions) -> Frame {
    let (technique, techniques) = (technique.name().to_owned(), support::techniques());
    let options = RenderOptions { technique, techniques, device, layers: Some(vec!["color".into()]), ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("device").build(scene).expect("frame").frame
}

/// The device that is least like the reference: many threads, the lowest level, one lane, small bins.
fn least_alike() -> DeviceOptions {
    DeviceOptions { threads: Some(7), level: Some(wide_levels()[0].1), width: ShaderWidth::One, bin_budget_bytes: 1 << 20 }
}

fn executor(device: Device) -> CpuExecutor {
    CpuExecutor::new(device, MEMORY_LIMIT)
}

/// Every scene in every variant of every technique.
fn runs() -> Vec<(String, Run)> {
    let of_scene = |name: String| {
        let runs = support::variants().into_iter().map(|(technique, variant)| Run { technique, variant });
        let everywhere = |run: &Run| support::own_folder(run.technique).is_none() && ["", "paper"].contains(&run.variant.name);
        let runs = runs.filter(|run| everywhere(run) || FEW.contains(&name.as_str()));
        runs.map(|run| (name.clone(), run)).collect::<Vec<_>>()
    };
    shipped_scenes().into_iter().flat_map(of_scene).collect()
}

/// The hashes of a run, a line each, as they are committed.
fn lines(name: &str, frame: &str, hashes: &[(String, u64)]) -> String {
    hashes.iter().fold(String::new(), |mut text, (attachment, hash)| {
        writeln!(text, "{name} {frame} {attachment} {hash:016x}").expect("writing to a string");
        text
    })
}

/// The file with a technique's hashes.
fn hash_file(technique: &dyn Technique) -> PathBuf {
    support::own_folder(technique).unwrap_or_else(|| support::path("tests/bits")).join("hashes.txt")
}

/// All threads of the machine at its best level, against the files. `REPLACE=1` writes them.
#[test]
fn scenes_have_the_committed_hashes() {
    let mut executor = executor(Device::new(DeviceOptions::default()).expect("threads start"));
    let mut texts: BTreeMap<PathBuf, String> = BTreeMap::new();
    for (name, run) in runs() {
        let built = build(&run.small_scene(&name), run.technique, DeviceOptions::default());
        let text = lines(&name, &run.label(), &hashes(&mut executor, &built));
        texts.entry(hash_file(run.technique)).or_default().push_str(&text);
    }
    for (file, text) in texts {
        if std::env::var_os("REPLACE").is_some() {
            std::fs::write(&file, &text).expect("the hash file can be written");
        }
        let committed = std::fs::read_to_string(&file).unwrap_or_default();
        for (seen, expected) in text.lines().zip(committed.lines()) {
            assert_eq!(seen, expected, "an attachment changed; if that is meant, run with REPLACE=1 and say so in the changelog");
        }
        let file = file.display();
        assert_eq!(text.lines().count(), committed.lines().count(), "the list of attachments changed, or {file} is missing");
    }
}

/// One frame, built on one thread, on devices that differ; and once more built and run on the device that is least like them.
#[test]
fn scenes_have_the_same_bytes_on_devices_that_differ() {
    let mut others: Vec<_> = devices::others().into_iter().map(|(name, device)| (name, executor(device))).collect();
    // The device least alike has the lowest level.
    others.pop();
    let mut least = executor(Device::new(least_alike()).expect("threads start"));
    for (name, run) in runs() {
        let (scene, label) = (run.small_scene(&name), run.label());
        let committed = std::fs::read_to_string(hash_file(run.technique)).expect("the hash file is there");
        let start = format!("{name} {label} ");
        let expected: String = committed.split_inclusive('\n').filter(|line| line.starts_with(&start)).collect();
        let built = build(&scene, run.technique, DeviceOptions { threads: Some(1), ..DeviceOptions::default() });
        for (device, executor) in &mut others {
            assert_eq!(lines(&name, &label, &hashes(executor, &built)), expected, "{device}");
        }
        let again = build(&scene, run.technique, least_alike());
        assert_eq!(lines(&name, &label, &hashes(&mut least, &again)), expected, "built and run on the device least alike");
    }
}

#[test]
fn whole_scenes_have_the_same_bytes_on_devices_least_alike() {
    if !support::full() {
        println!("not run: at full size only");
        return;
    }
    for name in shipped_scenes() {
        for &technique in TECHNIQUES.iter() {
            let mut scene = support::scene(&name);
            technique.coarsen(&mut scene);
            let of = |options: DeviceOptions| {
                let device = Device::new(options).expect("threads start");
                hashes(&mut executor(device), &build(&scene, technique, options))
            };
            assert_eq!(of(DeviceOptions::default()), of(least_alike()), "{name}, {}", technique.name());
        }
    }
}

#[test]
fn a_changed_attachment_changes_its_hash() {
    let run = Run { technique: TECHNIQUES[0], variant: TECHNIQUES[0].variants().remove(0) };
    let mut scene = run.small_scene("analytic/flat_water.ron");
    let mut executor = executor(Device::new(DeviceOptions::default()).expect("threads start"));
    let mut of = |scene: &Scene| hashes(&mut executor, &build(scene, run.technique, DeviceOptions::default()));
    let before = of(&scene);
    scene.medium.sigma_a.x += 1.0e-4;
    assert_ne!(before, of(&scene));
}
