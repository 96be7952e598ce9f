//! All the light of every shipped scene, as shipped, with the technique that `render` takes for it, against photons.

use nephroid::caustics::TECHNIQUES;
use nephroid::scene::Scene;

use crate::support::{full, scene, shipped_scenes};
use crate::waterside::Seen;

/// Scenes without light that a technique could be judged by: in the slab nothing but the medium is lit; the matched body is glass in water, which no technique
/// draws light through, as it says.
const DARK: [&str; 2] = ["analytic/slab.ron", "analytic/matched.ron"];

/// The scenes of every run: shadows of roofs and boards over water, a lamp, glass with many ways through it, a mirror that shades itself.
const SHORT: [&str; 6] = ["lido.ron", "jetty.ron", "sinking_lamp.ron", "figure.ron", "bowl.ron", "courtyard.ron"];

/// Light drawn over light traced, where the scene's technique draws.
fn ratio(scene: &mut Scene, name: &str, size: (u32, u32), photons: u64) -> f64 {
    (scene.image.width, scene.image.height) = size;
    let technique = TECHNIQUES.for_scene(scene).expect("a technique").name();
    // What the water's surface reflects no technique draws: it lights walls above the surface.
    let highest = scene.water.as_ref().filter(|_| name == "sinking_lamp.ron").map_or(f32::INFINITY, |water| water.level_m);
    let settled = scene.settled().expect("a scene that can be computed with").into_owned();
    Seen::of(&settled, technique).energy_ratio_by_area(&settled, photons, |p| p.y < highest)
}

#[test]
fn every_scene_as_shipped_has_the_light_of_photons() {
    // At the full size a pixel's sample is fine enough for one per cent; a quarter of the pixels has twice the sampling error.
    let (size, photons, bound) = if full() { ((640, 360), 20 << 20, 0.01) } else { ((320, 180), 2 << 20, 0.02) };
    let names: Vec<String> = if full() { shipped_scenes() } else { SHORT.map(str::to_owned).to_vec() };
    for name in names.iter().filter(|name| !DARK.contains(&name.as_str())) {
        let ratio = ratio(&mut scene(name), name, size, photons);
        println!("{name}: {ratio:.4}");
        assert!((ratio - 1.0).abs() < bound, "{name}: {ratio}");
    }
}
