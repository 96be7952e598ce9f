//! FLIP agrees with NVIDIA's own program, in the mean and pixel by pixel.
//!
//! The pairs of pictures are made here; what NVIDIA's program says of them is in `tests/suite/flip_data/nvidia.txt`, whose header tells how it was
//! measured. With the variable `NEPHROID_FLIP_PAIRS` set to a folder, the pairs are written there for `tests/suite/flip_data/measure.py`, and if the script
//! has left its whole maps beside them, every pixel is compared.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use nephroid::math::rng::{normal_pair, uniform, uniform3};
use nephroid::metrics::{DEFAULT_PIXELS_PER_DEGREE, Exposures, Flip, MetricError, Pair, flip_hdr, flip_ldr, pixels_per_degree};

/// Largest difference allowed, of a mean and of a pixel. Seen: 5e-8 and 8e-6.
const TOLERANCE: f64 = 1.0e-5;

/// Names the folder to exchange pairs and maps with `measure.py`.
const FOLDER_VARIABLE: &str = "NEPHROID_FLIP_PAIRS";

type Pixels = Vec<[f32; 3]>;

/// Two pictures to compare.
struct Case {
    name: &'static str,
    is_hdr: bool,
    width: u32,
    height: u32,
    pixels_per_degree: f32,
    reference: Pixels,
    test: Pixels,
}

impl Case {
    fn ldr(name: &'static str, (width, height): (u32, u32), reference: Pixels, test: Pixels) -> Self {
        Self { name, is_hdr: false, width, height, pixels_per_degree: DEFAULT_PIXELS_PER_DEGREE, reference, test }
    }

    fn hdr(name: &'static str, size: (u32, u32), reference: Pixels, test: Pixels) -> Self {
        Self { is_hdr: true, ..Self::ldr(name, size, reference, test) }
    }

    fn flip_of(&self, reference: &[[f32; 3]], test: &[[f32; 3]]) -> Flip {
        let pair = Pair::new(self.width, self.height, reference, test).expect("a valid pair");
        let flip = match self.is_hdr {
            true => flip_hdr(&pair, self.pixels_per_degree, &Exposures::of(&pair).expect("a reference that is not black")),
            false => flip_ldr(&pair, self.pixels_per_degree),
        };
        flip.expect("a map")
    }

    fn flip(&self) -> Flip {
        self.flip_of(&self.reference, &self.test)
    }
}

/// A picture of `f(x, y)`, row by row.
fn picture((width, height): (u32, u32), mut f: impl FnMut(u32, u32) -> [f32; 3]) -> Pixels {
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| f(x, y)).collect()
}

/// The pixel at a place, or the nearest one inside.
fn at(pixels: &[[f32; 3]], (width, height): (u32, u32), x: i64, y: i64) -> [f32; 3] {
    let (x, y) = (x.clamp(0, i64::from(width) - 1), y.clamp(0, i64::from(height) - 1));
    pixels[(y * i64::from(width) + x) as usize]
}

/// Mean of the 3x3 pixels around each pixel.
fn blurred(pixels: &[[f32; 3]], size: (u32, u32)) -> Pixels {
    picture(size, |x, y| {
        let around = |i: i64| at(pixels, size, i64::from(x) + i % 3 - 1, i64::from(y) + i / 3 - 1);
        [0, 1, 2].map(|channel| (0..9).map(|i| around(i)[channel]).sum::<f32>() / 9.0)
    })
}

/// Strokes like those of letters: cells of 7x9 pixels, of whose inner 5x7 pixels every other one, by chance, is dark.
fn text(size: (u32, u32)) -> Pixels {
    picture(size, |x, y| {
        let (column, row) = (x / 7 + 100 * (y / 9), (x % 7) + 7 * (y % 9));
        let is_ink = (x % 7 < 5) && (y % 9 < 7) && uniform(11, column, row) < 0.5;
        if is_ink { [0.02, 0.02, 0.03] } else { [0.9, 0.88, 0.8] }
    })
}

/// Three rings of light on a dim floor, up to 80 times as bright, as water throws them.
fn caustic((width, height): (u32, u32), phase: f64) -> Pixels {
    picture((width, height), |x, y| {
        let (u, v) = (f64::from(x) / f64::from(width), f64::from(y) / f64::from(height));
        let mut light = 0.05 + 0.02 * u;
        for ring in 0..3 {
            let (cx, cy) = (0.2 + 0.3 * f64::from(ring), 0.5 + 0.2 * libm::sin(2.0 * f64::from(ring) + phase));
            let distance = ((u - cx) * (u - cx) + (v - cy) * (v - cy)).sqrt() - 0.22;
            light += 0.03 / (0.007 + distance.abs()) - if distance > 0.0 { 0.02 / (0.007 + distance) } else { 0.0 };
        }
        [light, 0.9 * light, 0.7 * light].map(|value| value as f32)
    })
}

/// Ten pairs of pictures, and one of them once more on a coarser display.
fn cases() -> Vec<Case> {
    let gradient_size = (120, 67);
    let gradient = picture(gradient_size, |x, y| [x as f32 / 119.0, y as f32 / 66.0, (x + y) as f32 / 185.0]);
    let steeper = gradient.iter().map(|p| p.map(|value| libm::powf(value, 1.1))).collect();

    let text_size = (96, 64);
    let shifted = picture(text_size, |x, y| at(&text(text_size), text_size, i64::from(x) - 1, i64::from(y)));

    let noise_size = (80, 60);
    let noise = picture(noise_size, |x, y| uniform3(5, 0, y * 80 + x));
    let grainy = (0..).zip(&noise).map(|(i, p)| p.map(|value| (value + 0.1 * normal_pair(5, 1, i)[0]).clamp(0.0, 1.0))).collect();

    let waves_size = (101, 53);
    let waves = picture(waves_size, |x, y| {
        let wave = |f: f64| (0.5 + 0.45 * libm::sin(f * f64::from(x) + 0.013 * f64::from(x * y))) as f32;
        [wave(0.3), wave(0.5), wave(0.9)]
    });

    let grey_size = (64, 64);
    let grey = picture(grey_size, |_, _| [0.5; 3]);
    let mut dot = grey.clone();
    dot[32 * 64 + 20] = [1.0, 0.1, 0.1];

    let patch_size = (90, 60);
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| bit as f32);
    let patches = picture(patch_size, |x, y| corner((x / 15 + 6 * (y / 20)) % 8));
    let turned = picture(patch_size, |x, y| corner((x / 15 + 6 * (y / 20) + 1 + x / 45) % 8));

    let caustic_size = (128, 72);
    let sharp = caustic(caustic_size, 0.0);
    let soft = blurred(&sharp, caustic_size);

    let sparse_size = (75, 51);
    let sparse = picture(sparse_size, |x, y| {
        let u = uniform(21, y, x);
        if u < 0.35 { [0.0; 3] } else { [40.0 * u * u, 3.0 * u, 0.02 * u] }
    });
    let dimmed = sparse.iter().map(|p| [p[0] * 0.8, p[1], if p[1] == 0.0 { 0.5 } else { p[2] }]).collect();

    let tiny = picture((16, 9), |x, y| uniform3(31, y, x));
    let tiny_test = picture((16, 9), |x, y| uniform3(32, y, x));

    let photon_size = (97, 61);
    let photons = (0..).zip(caustic(photon_size, 1.0)).map(|(i, p)| p.map(|v| v * (1.0 + 0.3 * normal_pair(8, 0, i)[0]).max(0.0)));

    let mut cases = vec![
        Case::ldr("gradient", gradient_size, gradient, steeper),
        Case::ldr("text_shifted", text_size, text(text_size), shifted),
        Case::ldr("noise", noise_size, noise, grainy),
        Case::ldr("waves_blurred", waves_size, waves.clone(), blurred(&waves, waves_size)),
        Case::ldr("one_pixel", grey_size, grey, dot),
        Case::ldr("saturated", patch_size, patches, turned),
        Case::ldr("tiny", (16, 9), tiny, tiny_test),
        Case::hdr("caustic_blurred", caustic_size, sharp.clone(), soft.clone()),
        Case::hdr("sparse_with_zeros", sparse_size, sparse, dimmed),
        Case::hdr("photon_noise", photon_size, caustic(photon_size, 1.0), photons.collect()),
    ];
    cases.push(Case { pixels_per_degree: 30.0, ..Case::hdr("caustic_coarse", caustic_size, sharp, soft) });
    cases
}

/// What NVIDIA's program said of one case.
struct Measured {
    name: String,
    mean: f64,
    /// Column, row, value.
    pixels: Vec<(u32, u32, f64)>,
}

/// Reads `nvidia.txt`: a line `case NAME MEAN`, then lines `X Y VALUE`.
fn measured() -> Vec<Measured> {
    let mut all: Vec<Measured> = Vec::new();
    for line in include_str!("flip_data/nvidia.txt").lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["case", name, mean] => all.push(Measured { name: name.to_owned(), mean: mean.parse().expect("a mean"), pixels: Vec::new() }),
            [x, y, value] => {
                let pixel = (x.parse().expect("a column"), y.parse().expect("a row"), value.parse().expect("a value"));
                all.last_mut().expect("a case comes first").pixels.push(pixel);
            }
            _ => panic!("`{line}` is neither a case nor a pixel"),
        }
    }
    all
}

/// Largest difference between a map and what was measured, of the mean and of a pixel.
fn differences(flip: &Flip, measured: &Measured) -> (f64, f64) {
    let pixel = |&(x, y, value): &(u32, u32, f64)| (f64::from(*flip.map.get(x, y).expect("a pixel of the map")) - value).abs();
    ((flip.mean - measured.mean).abs(), measured.pixels.iter().map(pixel).fold(0.0, f64::max))
}

#[test]
fn means_and_pixels_are_those_of_nvidias_program() {
    exchange();
    let (cases, measured) = (cases(), measured());
    assert_eq!(cases.iter().map(|case| case.name).collect::<Vec<_>>(), measured.iter().map(|one| one.name.as_str()).collect::<Vec<_>>());
    for (case, expected) in cases.iter().zip(&measured) {
        assert!(expected.pixels.len() >= 48, "{}: {} pixels", case.name, expected.pixels.len());
        let (mean, pixel) = differences(&case.flip(), expected);
        println!("{:20} mean {mean:.1e}, pixels {pixel:.1e}", case.name);
        assert!(mean <= TOLERANCE && pixel <= TOLERANCE, "{}: the mean is off by {mean:e}, a pixel by {pixel:e}", case.name);
    }
}

#[test]
fn the_comparison_sees_what_it_should() {
    for (case, expected) in cases().iter().zip(&measured()) {
        let swapped: Pixels = case.test.iter().map(|p| [p[1], p[0], p[2]]).collect();
        let off: Pixels = case.test.iter().map(|p| [p[0], p[1], 0.98 * p[2] + 0.005]).collect();
        let mut moved = case.test.clone();
        // A pixel of the table trades places with one far away.
        let (x, y, _) = expected.pixels[0];
        let here = (y * case.width + x) as usize;
        let there = (0..moved.len()).find(|&i| (0..3).any(|c| (moved[i][c] - moved[here][c]).abs() > 0.05)).expect("another colour");
        moved.swap(here, there);
        for (change, test) in [("swapped channels", swapped), ("a channel off", off), ("a pixel moved", moved)] {
            let (mean, pixel) = differences(&case.flip_of(&case.reference, &test), expected);
            assert!(mean > TOLERANCE || pixel > TOLERANCE, "{}: {change} went unseen ({mean:e}, {pixel:e})", case.name);
        }
    }
}

#[test]
fn maps_are_the_same_on_any_number_of_threads_and_in_either_order() {
    for case in cases() {
        let on = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(|| case.flip());
        let one = on(1);
        assert!(one == on(2) && one == on(7), "{}", case.name);
        if !case.is_hdr {
            assert_eq!(one, case.flip_of(&case.test, &case.reference), "{}", case.name);
        }
        let same = case.flip_of(&case.reference, &case.reference);
        assert!(same.mean == 0.0 && same.map.pixels().iter().all(|&value| value == 0.0), "{}", case.name);
    }
}

#[test]
fn the_unit_of_a_high_dynamic_range_does_not_matter() {
    for case in cases().iter().filter(|case| case.is_hdr) {
        let scaled = |pixels: &Pixels| -> Pixels { pixels.iter().map(|p| p.map(|value| 1024.0 * value)).collect() };
        let (mean, scaled_mean) = (case.flip().mean, case.flip_of(&scaled(&case.reference), &scaled(&case.test)).mean);
        assert!((mean - scaled_mean).abs() < 1.0e-5, "{}: {mean} and {scaled_mean}", case.name);
    }
}

#[test]
fn only_pixels_that_count_are_measured() {
    let mut case = cases().swap_remove(0);
    let (near, far) = (40 * 120 + 10, 40 * 120 + 110);
    case.test = case.reference.clone();
    (case.test[near], case.test[far]) = ([1.0, 0.0, 1.0], [f32::NAN; 3]);
    let mask: Vec<bool> = (0..case.test.len()).map(|index| index % 120 < 60).collect();
    let pair = Pair::with_mask(case.width, case.height, &case.reference, &case.test, Some(&mask)).expect("a valid pair");
    let flip = flip_ldr(&pair, DEFAULT_PIXELS_PER_DEGREE).expect("a map");
    assert!(flip.map.pixels()[near] > 0.1 && flip.map.pixels()[far] == 0.0);
    let sum: f64 = flip.map.pixels().iter().copied().map(f64::from).sum();
    assert!((flip.mean - sum / pair.count() as f64).abs() < 1.0e-9);
    assert_eq!(flip.quantile(&pair, 1.0), Some(f64::from(flip.map.pixels().iter().copied().fold(0.0, f32::max))));
}

#[test]
fn bad_input_is_refused() {
    let (grey, black) = (vec![[0.5; 3]; 64], vec![[0.0; 3]; 64]);
    let pair = Pair::new(8, 8, &grey, &grey).expect("a valid pair");
    let good = Exposures::of(&pair).expect("a grey reference");
    assert_eq!(good.count, 2);
    for pixels_per_degree in [0.0, -67.0, f32::NAN, 1.0e6] {
        assert!(matches!(flip_ldr(&pair, pixels_per_degree), Err(MetricError::BadParameter { .. })));
        assert!(matches!(flip_hdr(&pair, pixels_per_degree, &good), Err(MetricError::BadParameter { .. })));
    }
    for exposures in [
        Exposures { start: f32::NAN, ..good },
        Exposures { stop: good.start - 1.0, ..good },
        Exposures { stop: 127.0, ..good },
        Exposures { count: 1, ..good },
        Exposures { count: 1001, ..good },
    ] {
        assert!(matches!(flip_hdr(&pair, 67.0, &exposures), Err(MetricError::BadParameter { .. })), "{exposures:?}");
    }
    let dark = Pair::new(8, 8, &black, &grey).expect("a valid pair");
    assert_eq!(Exposures::of(&dark), Err(MetricError::NoExposures { median: 0.0, largest: 0.0 }));
    let mut negative = grey.clone();
    negative[9][2] = -1.0e-6;
    let pair = Pair::new(8, 8, &grey, &negative).expect("a valid pair");
    assert!(matches!(flip_hdr(&pair, 67.0, &good), Err(MetricError::BadValue { list: "test", x: 1, y: 1, channel: 2, .. })));
}

#[test]
fn the_default_display_is_that_of_the_authors() {
    assert!((pixels_per_degree(0.7, 3840.0, 0.7) - DEFAULT_PIXELS_PER_DEGREE).abs() < 1.0e-4);
}

/// Writes the pairs, and compares with whole maps, if a folder is named.
fn exchange() {
    let Some(folder) = std::env::var_os(FOLDER_VARIABLE).map(PathBuf::from) else {
        return;
    };
    let write = |name: String, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("the folder can be written to");
    let mut list = String::new();
    for case in cases() {
        let kind = if case.is_hdr { "HDR" } else { "LDR" };
        writeln!(list, "{} {kind} {} {} {}", case.name, case.width, case.height, case.pixels_per_degree).expect("writing to a string");
        for (which, pixels) in [("reference", &case.reference), ("test", &case.test)] {
            let bytes: Vec<u8> = pixels.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
            write(format!("{}.{which}.f32", case.name), &bytes);
        }
        compare_map(&case, &folder.join(format!("{}.map.f32", case.name)));
    }
    write("pairs.txt".to_owned(), list.as_bytes());
}

/// Compares every pixel with a map that `measure.py` left, if it did.
fn compare_map(case: &Case, path: &Path) {
    let Ok(bytes) = fs::read(path) else {
        return;
    };
    let expected: Vec<f32> = bytes.as_chunks().0.iter().map(|chunk| f32::from_le_bytes(*chunk)).collect();
    let flip = case.flip();
    assert_eq!(expected.len(), flip.map.pixels().len(), "{}", case.name);
    let worst = flip.map.pixels().iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    println!("{:20} of all {} pixels: {worst:.1e}", case.name, expected.len());
    assert!(f64::from(worst) <= TOLERANCE, "{}: a pixel is off by {worst:e}", case.name);
}
