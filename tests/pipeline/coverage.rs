//! Coverage of single triangles against the brute-force rasterizer, pixel by pixel.
//!
//! Every triangle adds an integer weight of its own, so that a missing pixel of one cannot be paid by a surplus pixel of another. 1.1 million
//! triangles in release, 90 thousand in debug.

use nephroid_pipeline::shader::{Interpolation, ShaderWidth};
use nephroid_pipeline::state::{RasterRules, TextureFormat};
use nephroid_pipeline::{Device, DeviceOptions};

use super::passes::*;
use super::reference::{Fill, Fx, for_each_pixel, snap};

/// The kinds of triangle: sizes, tie classes and shapes that drivers were found to disagree on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Uniform,
    UpTo8Pixels,
    UpTo1Pixel,
    Sliver,
    HalfPixelGrid,
    /// Odd multiples of 1/512 pixel: halfway between two sub-pixels.
    SnapTies,
    /// Sides through pixel centres.
    AxisAligned,
    SixteenthGrid,
    /// Odd multiples of 1/32 pixel.
    CoarseTies,
    /// One or more vertices far outside the target, inside the guard band.
    FarOutside,
    /// Wide enough for the list that all tiles share.
    Large,
    /// Perspective: w from e^-3 to e^5.
    VaryingW,
}

const CLASSES: [Class; 12] = [
    Class::Uniform,
    Class::UpTo8Pixels,
    Class::UpTo1Pixel,
    Class::Sliver,
    Class::HalfPixelGrid,
    Class::SnapTies,
    Class::AxisAligned,
    Class::SixteenthGrid,
    Class::CoarseTies,
    Class::FarOutside,
    Class::Large,
    Class::VaryingW,
];

fn random_triangle(rng: &mut Rng, class: Class, size: (u32, u32)) -> [[f32; 4]; 3] {
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let anywhere = |rng: &mut Rng| [rng.real(0.0, width), rng.real(0.0, height)];
    let around = |rng: &mut Rng, c: [f64; 2], r: f64| [c[0] + rng.real(-r, r), c[1] + rng.real(-r, r)];
    let gridded = |p: [f64; 2], step: f64, offset: f64| p.map(|v| (v / step).floor() * step + offset);
    let centre = anywhere(rng);
    let px: [[f64; 2]; 3] = match class {
        Class::Uniform | Class::VaryingW => [centre, anywhere(rng), anywhere(rng)],
        Class::UpTo8Pixels => [centre, around(rng, centre, 4.0), around(rng, centre, 4.0)],
        Class::UpTo1Pixel => [centre, around(rng, centre, 0.75), around(rng, centre, 0.75)],
        Class::Sliver => {
            let end = anywhere(rng);
            let t = rng.real(0.0, 1.0);
            let middle = [0, 1].map(|i: usize| centre[i] + (end[i] - centre[i]) * t);
            [centre, end, around(rng, middle, 0.02)]
        }
        Class::HalfPixelGrid => [(); 3].map(|()| gridded(around(rng, centre, 8.0), 0.5, 0.0)),
        Class::SnapTies => [(); 3].map(|()| gridded(around(rng, centre, 3.0), 1.0 / 256.0, 1.0 / 512.0)),
        Class::AxisAligned => {
            let corner = gridded(centre, 1.0, 0.5);
            let (dx, dy) = (rng.int(-9..10) as f64, rng.int(-9..10) as f64);
            [corner, [corner[0] + dx, corner[1]], [corner[0], corner[1] + dy]]
        }
        Class::SixteenthGrid => [(); 3].map(|()| gridded(around(rng, centre, 12.0), 1.0 / 16.0, 0.0)),
        Class::CoarseTies => [(); 3].map(|()| gridded(around(rng, centre, 6.0), 1.0 / 16.0, 1.0 / 32.0)),
        Class::FarOutside => {
            let reach = [100.0, 1000.0, 16_000.0][rng.int(0..3) as usize];
            [around(rng, centre, reach), around(rng, centre, reach), around(rng, centre, 40.0)]
        }
        Class::Large => [(); 3].map(|()| [rng.real(-0.5, 1.5) * width, rng.real(-0.5, 1.5) * height]),
    };
    px.map(|p| {
        let clip = clip_from_px(size, p, 0.5);
        if class == Class::VaryingW {
            let w = libm::exp(rng.real(-3.0, 5.0)) as f32;
            clip.map(|c| c * w)
        } else {
            clip
        }
    })
}

struct Batch {
    triangles: Vec<[[f32; 4]; 3]>,
    weights: Vec<f32>,
}

impl Batch {
    fn random(rng: &mut Rng, class: Class, size: (u32, u32), count: usize) -> Self {
        let triangles = (0..count).map(|_| random_triangle(rng, class, size)).collect();
        let weights = (0..count).map(|_| rng.int(1..256) as f32).collect();
        Self { triangles, weights }
    }

    fn vertices(&self) -> Vec<Vertex> {
        let weighted = self.triangles.iter().zip(&self.weights);
        weighted.flat_map(|(triangle, &weight)| triangle.map(|position| vertex(position, [weight, 0.0, 0.0, 0.0]))).collect()
    }

    /// What the brute-force rasterizer says; and the number of covered pixels.
    fn expected(&self, size: (u32, u32), fill: Fill) -> (Vec<f32>, u64) {
        let mut image = vec![0.0; (size.0 * size.1) as usize];
        let mut covered = 0;
        for (triangle, weight) in self.triangles.iter().zip(&self.weights) {
            let snapped: [Fx; 3] = triangle.map(|v| snap(size, v));
            for_each_pixel(snapped, size, fill, |x, y| {
                image[y * size.0 as usize + x] += weight;
                covered += 1;
            });
        }
        (image, covered)
    }

    fn render(&self, device: &Device, size: (u32, u32), general: bool) -> (Vec<f32>, u64) {
        let format = TextureFormat::R32Float;
        let program = if general { pull_program(VaryingColor, Interpolation::Flat) } else { pull_program(FlatColor, Interpolation::Flat) };
        let pipeline = pipeline_with(program, RasterRules::REFERENCE, |desc| desc.targets = vec![additive(format)]);
        let mut canvas = Canvas::single(size, format);
        let output = draw_on(device, &mut canvas, &pipeline, &self.vertices());
        (canvas.channel(0, 0), output.statistics.fragments_passed)
    }

    /// Panics with the first triangle that differs.
    fn blame(&self, device: &Device, size: (u32, u32), general: bool, what: &str) -> ! {
        for (triangle, weight) in self.triangles.iter().zip(&self.weights) {
            let one = Self { triangles: vec![*triangle], weights: vec![*weight] };
            let (expected, seen) = (one.expected(size, Fill::TopLeft).0, one.render(device, size, general).0);
            if let Some((x, y, e, s)) = first_difference(size.0, &expected, &seen) {
                let snapped = triangle.map(|v| snap(size, v));
                panic!("{what}: triangle {triangle:?}, snapped {snapped:?}, pixel ({x}, {y}): expected {e}, got {s} (weight {weight})");
            }
        }
        panic!("{what}: the batch differs although every triangle alone is right");
    }

    fn check(&self, device: &Device, size: (u32, u32), general: bool, what: &str) -> u64 {
        let (expected, covered) = self.expected(size, Fill::TopLeft);
        let (seen, passed) = self.render(device, size, general);
        if first_difference(size.0, &expected, &seen).is_some() {
            self.blame(device, size, general, what);
        }
        assert_eq!(covered, passed, "{what}: fragments counted");
        covered
    }
}

fn check_size(size: (u32, u32), per_class: usize, batch: usize, seed: u64) {
    let mut rng = Rng(seed);
    let (mut triangles, mut pixels) = (0, 0);
    for class in CLASSES {
        for round in 0..per_class.div_ceil(batch) {
            let batch = Batch::random(&mut rng, class, size, batch);
            let general = round % 4 == 3;
            pixels += batch.check(device(), size, general, &format!("{class:?} at {size:?}, general path: {general}"));
            triangles += batch.triangles.len();
        }
    }
    println!("coverage {size:?}: {triangles} triangles, {pixels} covered pixels compared");
}

#[test]
fn coverage_64x64() {
    check_size((64, 64), sized(60_000, 4_000), 2_000, 1);
}

#[test]
fn coverage_100x60() {
    check_size((100, 60), sized(28_000, 2_000), 2_000, 2);
}

#[test]
fn coverage_1024x768() {
    check_size((1024, 768), sized(1_500, 150), 150, 3);
}

#[test]
fn coverage_3x5_and_65x1() {
    check_size((3, 5), sized(2_000, 500), 500, 4);
    check_size((65, 1), sized(2_000, 500), 500, 5);
}

#[test]
fn coverage_at_every_level_and_width() {
    let count = sized(1_000, 200);
    for (name, level) in nephroid_math::level::available_levels() {
        for width in [ShaderWidth::One, ShaderWidth::Sixteen] {
            let options = DeviceOptions { threads: Some(1), level: Some(level), width, ..DeviceOptions::default() };
            let device = Device::new(options).expect("threads start");
            let mut rng = Rng(6);
            for class in CLASSES {
                for general in [false, true] {
                    let batch = Batch::random(&mut rng, class, (100, 60), count);
                    batch.check(&device, (100, 60), general, &format!("{class:?} at {name}, {width:?}, general path: {general}"));
                }
            }
        }
    }
}

#[test]
fn comparison_tells_a_wrong_fill_rule_apart() {
    let size = (64, 64);
    let mut rng = Rng(7);
    for class in [Class::HalfPixelGrid, Class::AxisAligned] {
        let batch = Batch::random(&mut rng, class, size, 200);
        let wrong = batch.expected(size, Fill::BottomRight).0;
        let seen = batch.render(device(), size, false).0;
        assert!(first_difference(size.0, &wrong, &seen).is_some(), "{class:?}: the planted fill rule went unnoticed");
    }
}

#[test]
fn comparison_tells_a_moved_vertex_apart() {
    let size = (64, 64);
    let mut batch = Batch::random(&mut Rng(8), Class::Uniform, size, 50);
    let seen = batch.render(device(), size, false).0;
    batch.triangles[17][1][0] += 2.0 / 64.0;
    assert!(first_difference(size.0, &batch.expected(size, Fill::TopLeft).0, &seen).is_some(), "a vertex moved by a pixel went unnoticed");
}
