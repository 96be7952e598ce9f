//! What the ground truth costs: photons per second, and how the error of `caustic-volumes` falls with its grid.
//!
//! `cargo bench --bench trace` prints Markdown tables, `cargo bench --bench trace -- glass` only the rows that the name contains. Rates are medians of
//! runs of about a second, without what is done once per scene. `cargo bench --bench trace -- curve` measures the curve of docs/ground-truth.md
//! and writes its plot to `out/`; it takes some minutes and is left out unless it is asked for.

#[allow(dead_code, reason = "the other benchmarks use the rest")]
mod shared;

use std::path::Path;
use std::time::Instant;

use glam::Vec3;
use nephroid::caustics::caustic_volumes::CausticVolumes;
use nephroid::caustics::{RenderOptions, Renderer};
use nephroid::geom::shapes::UvSphere;
use nephroid::metrics::{Pair, PowerLaw, energy_ratio, mae};
use nephroid::report::{Plot, Scale, Series};
use nephroid::scene::{Camera, Material, MeasuringPlane, Scene, Shape};
use nephroid::trace::{Points, TraceOptions, Tracer};

use shared::{median, wanted};

/// Runs of which the median is taken.
const RUNS: usize = 5;

fn load(path: &str) -> Scene {
    nephroid::caustics::TECHNIQUES.load(Path::new(path)).expect("a shipped scene")
}

/// A level plane that measures, facing up.
fn level(y: f32, half: f32, texels: u32) -> MeasuringPlane {
    MeasuringPlane { corner: Vec3::new(-half, y, -half), u: Vec3::Z * (2.0 * half), v: Vec3::X * (2.0 * half), texels: (texels, texels) }
}

/// The knot of glass as one colour, or a ball of as many triangles.
fn glass(ball: bool) -> Scene {
    let mut scene = load("scenes/glass.ron");
    scene.objects[1].material = Material::Dielectric { ior: 1.52, abbe: None, absorption: Vec3::ZERO };
    if ball {
        scene.objects[1].shape = Shape::UvSphere(UvSphere { radius_m: 0.35, slices: 318, stacks: 158 });
    }
    scene.trace.plane = Some(level(0.0, 2.0, 512));
    scene
}

fn rate(name: &str, mut scene: Scene, camera: bool) {
    if !wanted(name) {
        return;
    }
    if camera {
        scene.trace.plane = None;
    }
    let start = Instant::now();
    let mut tracer = Tracer::new(&scene, &TraceOptions { camera, ..TraceOptions::default() }).expect("a shipped scene can be traced");
    let set_up = start.elapsed().as_secs_f64();
    tracer.run_batch();
    let rates = (0..RUNS)
        .map(|_| {
            let (start, before) = (Instant::now(), tracer.photons());
            while start.elapsed().as_secs_f64() < 1.0 {
                tracer.run_batch();
            }
            (tracer.photons() - before) as f64 / start.elapsed().as_secs_f64()
        })
        .collect();
    let audit = tracer.audit();
    println!("| {name} | {:.1} M/s | {:.2} | {:.1} s |", median(rates) * 1.0e-6, audit.events as f64 / audit.photons as f64, set_up);
}

/// A ball of glass in smoke, lit by a spot.
const BALL_IN_SMOKE: &str = "(
    image: (width: 320, height: 240),
    camera: Perspective(position: (0, 0.9, 3.2), target: (0, 0.6, 0), fov_deg: 40),
    lights: [Spot(position: (-1.2, 2.6, 0.4), direction: (1.2, -1.9, -0.4), intensity: (60, 60, 60), inner_deg: 10, outer_deg: 14)],
    smoke: (min: (-1.2, 0.01, -1), max: (1.2, 1.6, 1), sigma_s: (0.3, 0.3, 0.3), g: 0.3),
    objects: [
        (shape: Grid(size_m: (4, 4))),
        (shape: UvSphere(radius_m: 0.25, slices: 128, stacks: 64), transform: (translate: (0, 0.7, 0)), material: Dielectric(ior: 1.5)),
    ],
)";

/// The pool from its own camera or to a diver.
fn pool_with_godrays(fov_of_diver: Option<&str>) -> Scene {
    let mut scene = load("scenes/pool.ron");
    let mut set = |key: &str, value: &str| scene.set(key, value).expect("the setting exists");
    set("image.width", "320");
    set("image.height", "180");
    if let Some(fov) = fov_of_diver {
        set("camera.position", "2.6,-0.5,1.4");
        set("camera.target", "-1,-0.9,-0.5");
        set("camera.fov_deg", fov);
    }
    scene
}

/// What light in media costs: seconds of a batch, its noise, and the seconds that a noise of 1 % takes.
fn media(name: &str, scene: &Scene) {
    if !wanted(name) {
        return;
    }
    let options = TraceOptions { volume: true, ..TraceOptions::default() };
    let mut tracer = Tracer::new(scene, &options).expect("the scene can be traced");
    let start = Instant::now();
    while tracer.batches() < 4 || start.elapsed().as_secs_f64() < 10.0 {
        tracer.run_batch();
    }
    let (seconds, batches) = (start.elapsed().as_secs_f64(), tracer.batches() as f64);
    let noise = tracer.noises().into_iter().find(|(layer, _)| *layer == "godrays").map_or(f64::INFINITY, |(_, noise)| noise);
    let one_percent = seconds * (noise / 0.01) * (noise / 0.01);
    println!("| {name} | {:.2} s | {:.2} % | {one_percent:.1} s |", seconds / batches, noise * batches.sqrt() * 100.0);
}

fn main() {
    if std::env::args().any(|argument| argument == "curve") {
        curve();
        return;
    }
    println!("{} threads, median of {RUNS} runs of a second\n", rayon::current_num_threads());
    println!("| photons through | rate | surfaces met per photon | set up |\n|---|---|---|---|");
    let sine = || {
        let mut scene = load("scenes/analytic/sine_water.ron");
        scene.trace.plane = Some(level(-3.0, 1.0, 512));
        scene
    };
    rate("sine_water, exact surface, onto a plane", sine(), false);
    rate("sine_water, exact surface, onto 512x512 pixels", sine(), true);
    let mut meshed = sine();
    meshed.trace.grid = Some((2049, 2));
    rate("sine_water, mesh of 2049x2, onto a plane", meshed, false);
    let pool = |grid: Option<(u32, u32)>| {
        let mut scene = load("scenes/pool.ron");
        scene.trace.plane = Some(level(-1.3, 2.2, 512));
        scene.trace.grid = grid;
        scene
    };
    rate("pool, its grid of 256x160, onto a plane", pool(Some((256, 160))), false);
    rate("pool, its grid of 256x160, onto 1280x720 pixels", pool(Some((256, 160))), true);
    rate("pool, exact surface, onto a plane", pool(None), false);
    rate("glass ball of 99,852 triangles, onto a plane", glass(true), false);
    rate("glass knot of 98,304 triangles, onto a plane", glass(false), false);
    println!("\n| light in media | batch | noise of a batch | time for a noise of 1 % |\n|---|---|---|---|");
    media("media: pool from its deck, 320x180 pixels", &pool_with_godrays(None));
    media("media: pool to a diver, 60°, 320x180 pixels", &pool_with_godrays(Some("60")));
    media("media: pool to a diver, 13.5°, 320x180 pixels", &pool_with_godrays(Some("13.5")));
    let ball = nephroid::scene::parse(BALL_IN_SMOKE, "ball in smoke", Path::new(""), &[]).expect("the scene is valid");
    media("media: ball of glass in smoke, 320x240 pixels", &ball);
    let cloud = BALL_IN_SMOKE
        .replace("g: 0.3)", "g: 0.3, density: Noise(scale_m: 0.5, octaves: 3, threshold: -0.3, cells: (32, 24, 32), seed: 2))");
    let cloud = nephroid::scene::parse(&cloud, "ball in a cloud", Path::new(""), &[]).expect("the scene is valid");
    media("media: ball of glass in a cloud, 320x240 pixels", &cloud);
}

/// Grids of the curve: columns, with rows in proportion.
const GRIDS: [u32; 6] = [16, 32, 64, 128, 256, 512];

/// Error of `caustic-volumes` over its grid: crossed waves before their focus, and the pool with an eye under water.
fn curve() {
    let mut series = Vec::new();
    println!("| scene | grid | mean absolute error | energy ratio |\n|---|---|---|---|");
    for (name, scene, photons, resolved) in
        [("crossed waves, before their focus", crossed(), 400_000_000, 0..4), ("pool", diver(), 1_500_000_000, 2..5)]
    {
        let (points, truth, areas) = truth(&scene, photons);
        let mask = truth.valid.clone().expect("pixels are valid or not");
        let reference: Vec<[f32; 3]> = truth.mean.iter().map(|v| v.map(|c| c as f32)).collect();
        let mean = reference.iter().zip(&mask).filter(|(_, valid)| **valid).map(|(v, _)| f64::from(v[1])).sum::<f64>()
            / mask.iter().filter(|valid| **valid).count() as f64;
        let noise = truth.standard_error.iter().zip(&mask).filter(|(_, valid)| **valid).map(|(e, _)| e[1]).sum::<f64>()
            / mask.iter().filter(|valid| **valid).count() as f64
            / mean;
        let mut errors = Vec::new();
        // The exponent is that of the grids which resolve the waves and are not yet finer than the picture.
        for columns in GRIDS {
            let mut scene = scene.clone();
            let water = scene.water.as_ref().expect("there is water");
            let rows = (columns as f32 * water.size_m.y / water.size_m.x).round() as u32;
            scene.techniques.edit::<CausticVolumes>().grid = Some((columns + 1, rows + 1));
            let layers = render(&scene);
            assert_eq!(points_of(&layers).positions, points.positions, "the view depends on the grid");
            let layer = layers.get("caustic_irradiance").expect("the layer was asked for");
            let test: Vec<[f32; 3]> = (0..reference.len()).map(|k| [0, 1, 2].map(|c: usize| layer.planes()[c].pixels()[k])).collect();
            let pair = Pair::with_mask(truth.columns, truth.rows, &reference, &test, Some(&mask)).expect("pictures of one size");
            let error = mae(&pair) / mean;
            let ratio = energy_ratio(&pair, &areas).expect("there is light").total;
            println!("| {name} | {columns} x {rows} | {error:.4} | {ratio:.4} |");
            errors.push((f64::from(columns), error));
        }
        let fit = PowerLaw::fit(&errors[resolved.clone()]).expect("errors are above 0");
        println!("\n{name}: error falls as grid^{:.2} over {:?}; mean noise of the truth {noise:.4}\n", fit.exponent, &GRIDS[resolved]);
        series.push((format!("{name} (exponent {:.2})", fit.exponent), errors));
    }
    let series: Vec<Series<'_>> = series.iter().map(|(name, points)| Series { name, points, is_fitted: false }).collect();
    let plot = Plot {
        title: "caustic-volumes: error over the grid",
        x_label: "columns of the water's grid",
        y_label: "mean absolute error / mean irradiance",
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: &series,
        width: 800,
        height: 560,
    };
    std::fs::create_dir_all("out").expect("the folder can be made");
    std::fs::write("out/convergence.png", plot.png().expect("the plot can be drawn")).expect("the file can be written");
}

/// Smooth light: a level floor at a third of the first focus, seen from straight above through water that bends nothing for the eye.
fn crossed() -> Scene {
    let mut scene = load("scenes/analytic/crossed_sines.ron");
    (scene.image.width, scene.image.height) = (160, 160);
    scene.techniques.edit::<CausticVolumes>().samples = 4;
    under_water(&mut scene);
    scene
}

/// The pool's floor as a camera under water sees it: no eye path is bent, so that light alone is compared.
fn diver() -> Scene {
    let mut scene = load("scenes/pool.ron");
    (scene.image.width, scene.image.height) = (320, 200);
    scene.techniques.edit::<CausticVolumes>().samples = 8;
    under_water(&mut scene);
    scene
}

/// Looks down from just below the waves.
fn under_water(scene: &mut Scene) {
    let water = scene.water.as_ref().expect("there is water");
    let depth = water.level_m - 0.15;
    let height = water.size_m.y * 0.8;
    let center = Vec3::new(water.center_m.x, depth, water.center_m.y);
    let height_m = height.min(water.size_m.x * 0.8 * scene.image.height as f32 / scene.image.width as f32);
    scene.camera =
        Camera::Orthographic { position: center, target: center - Vec3::Y, up: Vec3::NEG_Z, height_m, near_m: 0.001, far_m: 50.0 };
}

fn render(scene: &Scene) -> nephroid::image::LayerSet {
    let layers = ["caustic_irradiance", "position", "normal", "depth"].map(str::to_owned).to_vec();
    let options = RenderOptions { layers: Some(layers), ..RenderOptions::default() };
    Renderer::new(scene, &options).expect("a renderer").render(scene, None).expect("a picture").layers
}

fn points_of(layers: &nephroid::image::LayerSet) -> Points {
    let at = |name: &str, k: usize| {
        let layer = layers.get(name).expect("the layer was asked for");
        Vec3::from_array([0, 1, 2].map(|c: usize| layer.planes()[c.min(layer.channel_count() - 1)].pixels()[k]))
    };
    let (columns, rows) = (layers.get("position").map_or(0, |l| l.width()), layers.get("position").map_or(0, |l| l.height()));
    let count = (columns * rows) as usize;
    Points {
        columns,
        rows,
        positions: (0..count).map(|k| at("depth", k).x.is_finite().then(|| at("position", k))).collect(),
        normals: (0..count).map(|k| at("normal", k).normalize_or_zero()).collect(),
    }
}

fn truth(scene: &Scene, photons: u64) -> (Points, nephroid::trace::Measured, Vec<f32>) {
    let points = points_of(&render(scene));
    let options = TraceOptions { points: Some(points.clone()), ..TraceOptions::default() };
    let mut tracer = Tracer::new(scene, &options).expect("a shipped scene can be traced");
    tracer.run(photons);
    let areas = tracer.pixel_areas().expect("there are pixels").iter().map(|&area| area as f32).collect();
    (points, tracer.pixels().expect("there are pixels"), areas)
}
