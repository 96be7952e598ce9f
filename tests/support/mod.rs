//! What tests of several topics share: files of the project, sizes, repeatable numbers, hashes, the program itself.
//!
//! [`passes`] draws with the software GPU alone and is shared with that crate's own tests.

#![allow(dead_code, unused_imports, reason = "no test binary uses all of it")]

pub mod numbers;
pub mod passes;
pub mod program;
pub mod shared_passes;
pub mod traces;

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use nephroid::caustics::{TECHNIQUES, Technique, Techniques, Variant};
use nephroid::scene::water::{Water, WaterModel};
use nephroid::scene::{Scene, Shape};

pub use numbers::{Rng, fnv1a, full, sized};

nephroid::caustics::techniques! {
    /// Techniques of the tests' own: each a folder here and a line of this table.
    pub const OWN = [
        twofold,
    ];
}

/// The techniques of the library, and then those of the tests.
pub fn techniques() -> Techniques {
    static ALL: LazyLock<Vec<&'static dyn Technique>> = LazyLock::new(|| TECHNIQUES.iter().chain(OWN.iter()).copied().collect());
    Techniques(&ALL)
}

/// The folder of a technique that is the tests' own; in it is what the repository has elsewhere for the library's.
pub fn own_folder(technique: &dyn Technique) -> Option<PathBuf> {
    Some(path("tests/support").join(technique.settings().key())).filter(|folder| folder.is_dir())
}

/// Every variant of every technique.
pub fn variants() -> Vec<(&'static dyn Technique, Variant)> {
    techniques().iter().flat_map(|&technique| technique.variants().into_iter().map(move |variant| (technique, variant))).collect()
}

/// A path of the project, given from its root.
pub fn path(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// A shipped scene, by its path below `scenes`.
pub fn scene(name: &str) -> Scene {
    techniques().load(&path("scenes").join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// A shipped scene with another size of its picture, in pixels.
pub fn scene_of_size(name: &str, (width, height): (u32, u32)) -> Scene {
    let mut scene = scene(name);
    (scene.image.width, scene.image.height) = (width, height);
    scene
}

/// A scene with coarser sculptures and coarser simulated water: making them whole takes longer than drawing them small.
pub fn with_coarse_parts(mut scene: Scene) -> Scene {
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

/// All shipped scenes, by their paths below `scenes`, sorted.
pub fn shipped_scenes() -> Vec<String> {
    let root = path("scenes");
    let mut names: Vec<String> = [root.clone(), root.join("analytic")]
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).expect("the folder is readable"))
        .map(|entry| entry.expect("the entry is readable").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "ron"))
        .map(|path| path.strip_prefix(&root).expect("below the folder").to_str().expect("names are text").replace('\\', "/"))
        .collect();
    names.sort();
    names
}
