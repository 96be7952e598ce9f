//! `light-volumes` against light that was traced, and its beams of mirrors and glass against analytic truth (T7).

use glam::Vec3;
use nephroid::caustics::light_volumes::{BeamShadows, LightVolumes};
use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::geom::shapes::Cylinder;
use nephroid::image::Layer;
use nephroid::scene::{Material, Scene, Shape};
use nephroid::trace::{Points, TraceOptions, Tracer};

use crate::analytic::truths;
use crate::support::{scene_of_size as scene, sized, with_coarse_parts};

/// Draws what [`picture`] reads.
fn renderer(scene: &Scene) -> Renderer {
    let layers = ["caustic_irradiance", "position", "normal", "depth"].map(str::to_owned).to_vec();
    let options = RenderOptions { technique: "light-volumes".into(), layers: Some(layers), ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("device")
}

fn render(scene: &Scene) -> (Vec<f64>, Points) {
    picture(&mut renderer(scene), scene)
}

/// What a picture shows where: red caustic irradiance, and the points.
fn picture(renderer: &mut Renderer, scene: &Scene) -> (Vec<f64>, Points) {
    let rendered = renderer.render(scene, None).expect("frame").layers;
    let layer = |name: &str| rendered.get(name).expect("asked for");
    let at = |layer: &Layer, k: usize| Vec3::from_array([0, 1, 2].map(|c| layer.planes()[c].pixels()[k]));
    let (position, normal, depth) = (layer("position"), layer("normal"), layer("depth"));
    let count = depth.planes()[0].pixels().len();
    let exists = |k: usize| depth.planes()[0].pixels()[k].is_finite();
    let points = Points {
        columns: position.width(),
        rows: position.height(),
        positions: (0..count).map(|k| exists(k).then(|| at(position, k))).collect(),
        normals: (0..count).map(|k| at(normal, k).normalize_or_zero()).collect(),
    };
    (layer("caustic_irradiance").planes()[0].pixels().iter().map(|&v| f64::from(v)).collect(), points)
}

/// Red caustic irradiance by photons at these points; nothing where none can be measured.
fn traced(scene: &Scene, points: Points, photons: u64) -> Vec<Option<f64>> {
    let mut tracer = Tracer::new(scene, &TraceOptions { points: Some(points), ..TraceOptions::default() }).expect("can be traced");
    while tracer.photons() < photons {
        tracer.run_batch();
    }
    let measured = tracer.pixels().expect("points were asked for");
    let valid = |k: usize| measured.valid.as_ref().is_none_or(|valid| valid[k]);
    (0..measured.mean.len()).map(|k| valid(k).then(|| measured.mean[k][0])).collect()
}

/// Pairs of what was drawn and what was traced.
fn pairs<'a>(drawn: &'a [f64], traced: &'a [Option<f64>]) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    drawn.iter().zip(traced).filter_map(|(&drawn, &traced)| Some((drawn, traced?)))
}

fn energy_ratio(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (drawn, traced) = pairs.fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
    drawn / traced
}

/// Mean absolute error over the mean.
fn error(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (off, traced) = pairs.fold((0.0, 0.0), |sum, (drawn, traced)| (sum.0 + (drawn - traced).abs(), sum.1 + traced));
    off / traced
}

#[test]
fn a_ring_makes_half_of_a_nephroid() {
    const SIDE: u32 = 240;
    // Blocks of 6 x 6 pixels, 6 cm wide.
    const BLOCK: u32 = 6;
    let truth = truths::ring::Nephroid { elevation: std::f64::consts::FRAC_PI_4, height: 0.8, reflectance: 1.0 };
    let mut scene = scene("analytic/mirror_ring.ron", (SIDE, SIDE));
    // Many planes: the walls of a ring are upright, and what is swept from them changes quickly. Many samples: at a fold, light is in few places.
    scene.techniques.edit::<LightVolumes>().planes = 33;
    scene.techniques.edit::<LightVolumes>().samples = 8;
    // Normals are smooth, and the chords of so many sides are a ten-thousandth off.
    scene.objects[0].shape = Shape::Cylinder(Cylinder { radius_m: 1.0, height_m: 0.8, slices: 256, open: true });
    let at = |column: u32, row: u32| (row * SIDE + column) as usize;
    // Half a pixel beyond the outer centres.
    let half = 0.5 * 2.4 / f64::from(SIDE);
    let (drawn, points) = render(&scene);
    let rectangle = |column: u32, row: u32| {
        let (a, b) = (points.positions[at(column, row)]?, points.positions[at(column + BLOCK - 1, row + BLOCK - 1)]?);
        Some(([f64::from(a.x) - half, f64::from(b.x) + half], [f64::from(a.z) - half, f64::from(b.z) + half]))
    };
    // Light that was reflected twice arrives farther out.
    let near = |(x, z): &([f64; 2], [f64; 2])| x.iter().all(|x| z.iter().all(|z| (x * x + z * z).sqrt() < 0.85));
    let blocks = (0..SIDE * SIDE / BLOCK / BLOCK).map(|k| (k % (SIDE / BLOCK) * BLOCK, k / (SIDE / BLOCK) * BLOCK));
    let mut pairs = [Vec::new(), Vec::new()];
    for (column, row) in blocks {
        let Some((x, z)) = rectangle(column, row).filter(near) else { continue };
        let pixels = (0..BLOCK * BLOCK).map(|k| drawn[at(column + k % BLOCK, row + k / BLOCK)]);
        let mean = pixels.sum::<f64>() / f64::from(BLOCK * BLOCK);
        pairs[0].push((mean, truth.mean(x, z)));
        // A wall a twentieth lower: the comparison can fail.
        pairs[1].push((mean, truths::ring::Nephroid { height: 0.76, ..truth }.mean(x, z)));
    }
    let [(ratio, off), (_, off_lower)] = pairs.map(|pairs| (energy_ratio(pairs.iter().copied()), error(pairs.into_iter())));
    println!("energy ratio {ratio}, error {off}; of a lower wall {off_lower}");
    assert!((ratio - 1.0).abs() < 0.01 && off < 0.03 && off_lower > 2.0 * off, "{ratio} {off} {off_lower}");
}

#[test]
fn glass_gathers_the_light_that_photons_gather() {
    let mut scene = scene("ball.ron", (320, 180));
    scene.techniques.edit::<LightVolumes>().samples = 8;
    scene.techniques.edit::<LightVolumes>().shadow_map_size = 512;
    let (drawn, points) = render(&scene);
    let truth = traced(&scene, points, 4_000_000);
    let (ratio, off) = (energy_ratio(pairs(&drawn, &truth)), error(pairs(&drawn, &truth)));
    // Of other glass, light gathers elsewhere.
    scene.objects[1].material = Material::Dielectric { ior: 1.6, abbe: None, absorption: Vec3::ZERO };
    scene.techniques.edit::<LightVolumes>().samples = 2;
    let (other, _) = render(&scene);
    let off_other = error(pairs(&other, &truth));
    println!("energy ratio {ratio}, error {off}; of other glass {off_other}");
    assert!((ratio - 1.0).abs() < 0.02 && off < 0.15 && off_other > 2.0 * off, "{ratio} {off} {off_other}");
}

#[test]
fn shadows_are_where_photons_leave_them() {
    let mut scene = scene("jetty.ron", (192, 144));
    scene.techniques.edit::<LightVolumes>().samples = 3;
    let (drawn, points) = render(&scene);
    let truth = traced(&scene, points, sized(3_000_000, 1_500_000));
    let lit = pairs(&drawn, &truth).map(|pair| pair.1).sum::<f64>() / truth.iter().flatten().count() as f64;
    let agreement = |drawn: &[f64]| {
        let dark = |value: f64| value < 0.1 * lit;
        let (same, all) = pairs(drawn, &truth).fold((0, 0), |(same, all), (a, b)| (same + u32::from(dark(a) == dark(b)), all + 1));
        f64::from(same) / f64::from(all)
    };
    let (ratio, with) = (energy_ratio(pairs(&drawn, &truth)), agreement(&drawn));
    let rest = |scene: &mut Scene, shadows| {
        scene.techniques.edit::<LightVolumes>().shadows = shadows;
        render(scene).0
    };
    let culled = agreement(&rest(&mut scene, BeamShadows::Culling));
    let without = agreement(&rest(&mut scene, BeamShadows::Off));
    println!("energy ratio {ratio}; pixels in shadow, or not, as traced: {with}, by culling alone {culled}, without shadows {without}");
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    assert!(with > 0.95 && culled > without + 0.1 && without < 0.5, "{with} {culled} {without}");
}

/// Means over blocks of 4x4 pixels of which half can be measured: light at a focus is in few places, and single pixels tell more of where their
/// samples happen to lie than of the mesh.
fn blocks(drawn: &[f64], traced: &[Option<f64>], (columns, rows): (u32, u32)) -> (Vec<f64>, Vec<Option<f64>>) {
    const BLOCK: u32 = 4;
    let block = |number: u32| {
        let (x, y) = (number % (columns / BLOCK) * BLOCK, number / (columns / BLOCK) * BLOCK);
        let inside = (0..BLOCK * BLOCK).map(|k| ((y + k / BLOCK) * columns + x + k % BLOCK) as usize);
        let measured: Vec<(f64, f64)> = inside.filter_map(|k| Some((drawn[k], traced[k]?))).collect();
        let sum = measured.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        let count = measured.len() as f64;
        (2 * measured.len() >= (BLOCK * BLOCK) as usize).then(|| (sum.0 / count, Some(sum.1 / count)))
    };
    (0..columns / BLOCK * (rows / BLOCK)).filter_map(block).unzip()
}

/// Mean of the squared error over the square of the truth and a tenth of its mean.
fn relative_error(drawn: &[f64], traced: &[Option<f64>]) -> f64 {
    let mean = traced.iter().flatten().sum::<f64>() / traced.len() as f64;
    let off = pairs(drawn, traced).map(|(drawn, traced)| (drawn - traced) / (traced + 0.1 * mean));
    off.map(|off| off * off).sum::<f64>() / drawn.len() as f64
}

#[test]
fn errors_fall_with_the_mesh_on_every_scene_with_water() {
    let size = (128, 96);
    for name in ["pool.ron", "columns.ron", "pots.ron", "bath.ron", "jetty.ron", "courtyard.ron", "lido.ron"] {
        let mut scene = with_coarse_parts(scene(name, size));
        scene.techniques.edit::<LightVolumes>().samples = sized(4, 3);
        let mut errors = Vec::new();
        let mut truth = None;
        let mut renderer = renderer(&scene);
        for mesh in [33, 65, 129] {
            scene.techniques.edit::<LightVolumes>().grid = Some((mesh, mesh));
            let (drawn, points) = picture(&mut renderer, &scene);
            let truth = truth.get_or_insert_with(|| traced(&scene, points, sized(4_000_000, 1_000_000)));
            let (drawn, truth) = blocks(&drawn, truth, size);
            errors.push(relative_error(&drawn, &truth));
        }
        // The waves of another moment are no better for a fine mesh.
        scene.time_s += 0.7;
        let (later, truth) = blocks(&picture(&mut renderer, &scene).0, truth.as_deref().unwrap_or_default(), size);
        let other = relative_error(&later, &truth);
        println!("{name}: relMSE {errors:?}, of another moment {other}");
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]) && other > 4.0 * errors[2], "{name}: {errors:?}, {other}");
    }
}
