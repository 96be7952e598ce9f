//! Low passes: weights, responses to a texel of 1, constants and ramps, and sums written out in 64 bits.

use nephroid::frame::{Frame, TextureId};
use nephroid::pipeline::Texture;
use nephroid::pipeline::state::TextureFormat;

use nephroid::passes::filter::{Kernel, MAX_RADIUS_TX, separable};
use nephroid::passes::rotating_filter::{ANGLES, RotatingKernel, rotating};

use super::{texture_of, worst};
use crate::support::shared_passes::{noise, texture};

/// One step of the weights.
const STEP: f64 = 1.0 / (1 << 24) as f64;

/// A size of no round number: partial blocks and tiles at both edges.
const SIZE: (u32, u32) = (71, 67);

const FORMATS: [(TextureFormat, u32); 3] = [(TextureFormat::R32Float, 1), (TextureFormat::Rg32Float, 2), (TextureFormat::Rgba32Float, 4)];

fn kernels() -> Vec<Kernel> {
    let kernels = [
        Kernel::gaussian(0.4, 3),
        Kernel::gaussian(1.5, 5),
        Kernel::gaussian(10.0, MAX_RADIUS_TX),
        Kernel::mean(3),
        Kernel::mean(0),
        Kernel::from_weights(&[6.0, 4.0, 1.0]),
    ];
    kernels.into_iter().map(|kernel| kernel.expect("a kernel")).collect()
}

/// Runs a filter over a texture with these numbers.
fn filtered(format: TextureFormat, numbers: &[f32], filter: impl FnOnce(&mut Frame, TextureId) -> TextureId) -> Texture {
    let mut frame = Frame::default();
    let source = texture(&mut frame, "source", SIZE, format, numbers);
    let result = filter(&mut frame, source);
    texture_of(&frame, result)
}

/// A texel of 1 at a place in zeros, one channel.
fn impulse(x: u32, y: u32) -> Vec<f32> {
    let mut numbers = vec![0.0; (SIZE.0 * SIZE.1) as usize];
    numbers[(y * SIZE.0 + x) as usize] = 1.0;
    numbers
}

/// Sum of all texels of the first channel, in 64 bits.
fn total(texture: &Texture) -> f64 {
    texture.read_channel(0, 0, 0).into_iter().fold(0.0, |sum, texel| sum + f64::from(texel))
}

#[test]
fn weights_are_the_gaussians_and_add_up_to_one_exactly() {
    for (kernel, sigma) in kernels().iter().zip([0.4_f32, 1.5, 10.0]) {
        let radius = kernel.radius_tx() as i32;
        let exact = |i: i32| libm::exp(-0.5 * f64::from(i * i) / (f64::from(sigma) * f64::from(sigma)));
        let sum = (-radius..=radius).fold(0.0, |sum, i| sum + exact(i));
        for i in 1..=radius {
            let error = exact(i) / sum - f64::from(kernel.weight(i));
            assert!((0.0..STEP).contains(&error) && kernel.weight(i) == kernel.weight(-i), "σ {sigma}, tap {i}: {error}");
        }
        let centre = f64::from(kernel.weight(0)) - exact(0) / sum;
        assert!((-STEP..=2.0 * STEP * f64::from(radius)).contains(&centre), "σ {sigma}: {centre}");
    }
    for kernel in kernels() {
        let radius = kernel.radius_tx() as i32;
        let forward = (-radius..=radius).fold(0.0_f32, |sum, i| sum + kernel.weight(i));
        assert_eq!(forward, 1.0, "{kernel:?}");
        assert_eq!(kernel.weight(radius + 1), 0.0);
    }
    let binomial = Kernel::from_weights(&[6.0, 4.0, 1.0]).expect("a kernel");
    assert_eq!([0, 1, 2].map(|i| binomial.weight(i)), [6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0]);
}

#[test]
fn kernels_that_are_none_are_refused() {
    let none = [
        Kernel::gaussian(0.0, 2),
        Kernel::gaussian(-1.0, 2),
        Kernel::gaussian(f32::NAN, 2),
        Kernel::gaussian(1.0, MAX_RADIUS_TX + 1),
        Kernel::mean(MAX_RADIUS_TX + 1),
        Kernel::from_weights(&[]),
        Kernel::from_weights(&[0.0, 1.0]),
        Kernel::from_weights(&[1.0, -0.1]),
        Kernel::from_weights(&[1.0, f64::INFINITY]),
    ];
    assert!(none.iter().all(Option::is_none), "{none:?}");
}

#[test]
fn the_response_to_one_texel_is_the_weights_and_adds_up_to_one() {
    let (x0, y0) = (33, 35);
    let response =
        |kernel: &Kernel| filtered(TextureFormat::R32Float, &impulse(x0, y0), |frame, source| separable(frame, "low", source, kernel));
    let product = |kernel: &Kernel, x: u32, y: u32| {
        let [across, down] = [x as i32 - x0 as i32, y as i32 - y0 as i32].map(|offset| f64::from(kernel.weight(offset)));
        [across * down, 0.0, 0.0, 0.0]
    };
    for kernel in kernels() {
        let radius = f64::from(kernel.radius_tx());
        let found = response(&kernel);
        let error = worst(&found, (0..SIZE.0, 0..SIZE.1), |x, y| product(&kernel, x, y));
        assert!(error <= f64::from(kernel.weight(0)) * (radius + 1.0) * STEP, "{kernel:?}: {error}");
        let lost = (total(&found) - 1.0).abs();
        assert!(lost <= (radius + 2.0) * STEP, "{kernel:?}: {lost}");
        assert!(found.read_channel(0, 0, 0).iter().all(|texel| *texel >= 0.0), "{kernel:?}");
    }
    // The comparison notices a weight that is wrong by a thousandth.
    let kernel = Kernel::from_weights(&[6.0, 4.0, 1.0]).expect("a kernel");
    let wrong = Kernel::from_weights(&[6.0, 4.004, 1.0]).expect("a kernel");
    assert!(worst(&response(&wrong), (0..SIZE.0, 0..SIZE.1), |x, y| product(&kernel, x, y)) > 1.0e-5);
}

#[test]
fn one_pass_keeps_the_weights_bits() {
    let kernel = Kernel::gaussian(2.5, 7).expect("a kernel");
    let mut frame = Frame::default();
    let source = texture(&mut frame, "source", SIZE, TextureFormat::R32Float, &impulse(40, 20));
    separable(&mut frame, "low", source, &kernel);
    let across = texture_of(&frame, frame.texture_named("low across").expect("the pass across"));
    for x in 0..SIZE.0 {
        assert_eq!(across.surface(0, 0).get(x, 20, 0).to_bits(), kernel.weight(x as i32 - 40).to_bits(), "{x}");
    }
    assert_eq!(total(&across), 1.0);
}

/// Bright texels among dark ones and zeros, over twelve orders of magnitude.
#[test]
fn nothing_becomes_negative() {
    let numbers: Vec<f32> = noise(13, (SIZE.0 * SIZE.1) as usize)
        .into_iter()
        .map(|v| if v < 0.3 { 0.0 } else { libm::exp(f64::from(v) * 28.0 - 14.0) as f32 })
        .collect();
    let mut results: Vec<Texture> = kernels()
        .iter()
        .map(|kernel| filtered(TextureFormat::R32Float, &numbers, |frame, source| separable(frame, "low", source, kernel)))
        .collect();
    results
        .push(filtered(TextureFormat::R32Float, &numbers, |frame, source| rotating(frame, "turned", source, &RotatingKernel::default())));
    assert!(results.iter().all(|result| result.read_channel(0, 0, 0).iter().all(|texel| *texel >= 0.0)));
}

#[test]
fn constants_keep_their_bits_up_to_the_edges() {
    for (format, channels) in FORMATS {
        for value in [0.1_f32, 1.0e-30, -3.000_000_2e7] {
            let numbers = vec![value; (SIZE.0 * SIZE.1 * channels) as usize];
            let mut results: Vec<Texture> = kernels()
                .iter()
                .map(|kernel| filtered(format, &numbers, |frame, source| separable(frame, "low", source, kernel)))
                .collect();
            for kernel in [RotatingKernel::default(), RotatingKernel { radius_tx: 40.3, pairs: 7 }] {
                results.push(filtered(format, &numbers, |frame, source| rotating(frame, "turned", source, &kernel)));
            }
            for result in results {
                assert_eq!(result.desc().format, format);
                for channel in 0..channels as usize {
                    assert!(
                        result.read_channel(0, 0, channel).iter().all(|texel| texel.to_bits() == value.to_bits()),
                        "{format:?} {value}"
                    );
                }
            }
        }
    }
}

/// Four channels of noise at a texel, the nearest one inside beyond an edge.
fn at(numbers: &[f32], x: i64, y: i64) -> [f64; 4] {
    let (x, y) = (x.clamp(0, i64::from(SIZE.0) - 1) as usize, y.clamp(0, i64::from(SIZE.1) - 1) as usize);
    std::array::from_fn(|channel| f64::from(numbers[(y * SIZE.0 as usize + x) * 4 + channel]))
}

#[test]
fn both_passes_are_the_convolution_in_two_dimensions() {
    let numbers = noise(11, (SIZE.0 * SIZE.1 * 4) as usize);
    let convolved = |kernel: &Kernel, x: u32, y: u32| {
        let radius = kernel.radius_tx() as i32;
        let mut sum = [0.0; 4];
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let weight = f64::from(kernel.weight(dx)) * f64::from(kernel.weight(dy));
                let texel = at(&numbers, i64::from(x) + i64::from(dx), i64::from(y) + i64::from(dy));
                for (sum, texel) in sum.iter_mut().zip(texel) {
                    *sum += weight * texel;
                }
            }
        }
        sum
    };
    for kernel in kernels().iter().filter(|kernel| kernel.radius_tx() < 10) {
        let found = filtered(TextureFormat::Rgba32Float, &numbers, |frame, source| separable(frame, "low", source, kernel));
        let error = worst(&found, (0..SIZE.0, 0..SIZE.1), |x, y| convolved(kernel, x, y));
        // Two passes of R + 1 sums of numbers up to 1, each rounded to half a step.
        assert!(error <= 2.0 * f64::from(kernel.radius_tx() + 2) * STEP, "{kernel:?}: {error}");
    }
    let found = filtered(TextureFormat::Rgba32Float, &numbers, |frame, source| {
        separable(frame, "low", source, &Kernel::gaussian(1.5, 5).expect("a kernel"))
    });
    let wider = Kernel::gaussian(1.51, 5).expect("a kernel");
    assert!(worst(&found, (0..SIZE.0, 0..SIZE.1), |x, y| convolved(&wider, x, y)) > 1.0e-4);
}

/// The rotating low pass as the documentation has it, in 64 bits.
fn turned(numbers: &[f32], kernel: &RotatingKernel, angles: [u32; 16], x: u32, y: u32) -> [f64; 4] {
    let angle = f64::from(angles[(y % 4 * 4 + x % 4) as usize]) * std::f64::consts::PI / 16.0;
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let mut sum = [0.0; 4];
    for k in 0..kernel.pairs {
        let radius = f64::from(kernel.radius_tx) * ((f64::from(k) + 0.5) / f64::from(kernel.pairs)).sqrt();
        let at_angle = f64::from(k) * golden * std::f64::consts::PI + angle;
        for sign in [1.0, -1.0] {
            let place = [libm::cos(at_angle), libm::sin(at_angle)].map(|part| sign * radius * part);
            let (px, py) = (f64::from(x) + place[0], f64::from(y) + place[1]);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (column, row) = (px.floor() as i64 + dx, py.floor() as i64 + dy);
                let weight = (1.0 - (px - column as f64).abs()) * (1.0 - (py - row as f64).abs());
                for (sum, texel) in sum.iter_mut().zip(at(numbers, column, row)) {
                    *sum += weight * texel / f64::from(2 * kernel.pairs);
                }
            }
        }
    }
    sum
}

#[test]
fn the_rotating_low_pass_is_the_mean_over_its_taps() {
    let numbers = noise(12, (SIZE.0 * SIZE.1 * 4) as usize);
    let all = || (0..SIZE.0, 0..SIZE.1);
    for kernel in [RotatingKernel::default(), RotatingKernel { radius_tx: 5.7, pairs: 5 }, RotatingKernel { radius_tx: 1.0, pairs: 16 }] {
        let found = filtered(TextureFormat::Rgba32Float, &numbers, |frame, source| rotating(frame, "turned", source, &kernel));
        // Places are known to some 1e-6 texels, and neighbours differ by up to 1.
        let error = worst(&found, all(), |x, y| turned(&numbers, &kernel, ANGLES, x, y));
        assert!(error < 1.0e-5, "{kernel:?}: {error}");
        let mut swapped = ANGLES;
        swapped.swap(0, 1);
        assert!(worst(&found, all(), |x, y| turned(&numbers, &kernel, swapped, x, y)) > 1.0e-3, "{kernel:?}");
    }
}

#[test]
fn angles_and_taps_cover_the_disc_evenly() {
    let mut sorted = ANGLES;
    sorted.sort_unstable();
    assert_eq!(sorted, std::array::from_fn(|k| k as u32));
    for pairs in 1..=16 {
        let kernel = RotatingKernel { radius_tx: 4.0, pairs };
        let taps = kernel.taps_tx();
        assert_eq!(taps.len(), pairs as usize);
        let squares: Vec<f64> = taps.iter().map(|[x, y]| f64::from(*x) * f64::from(*x) + f64::from(*y) * f64::from(*y)).collect();
        let mean = squares.iter().fold(0.0, |sum, square| sum + square) / f64::from(pairs);
        assert!((mean - 0.5 * 16.0).abs() < 1.0e-5, "{pairs} pairs: {mean}");
        // Each tap in the middle of its ring of equal area.
        for (k, square) in squares.iter().enumerate() {
            let (inner, outer) = (16.0 * k as f64 / f64::from(pairs), 16.0 * (k + 1) as f64 / f64::from(pairs));
            assert!((square - 0.5 * (inner + outer)).abs() < 1.0e-5, "{pairs} pairs, tap {k}");
        }
    }
    assert_eq!(RotatingKernel { radius_tx: 1.0, pairs: 99 }.taps_tx().len(), 16);
}

#[test]
fn a_ramp_stays_as_it_is_wherever_the_taps_stay_inside() {
    let ramp = |x: u32, y: u32| [f64::from(x), 0.25 * f64::from(y), f64::from(x) - 2.0 * f64::from(y), 1.0];
    let numbers: Vec<f32> = (0..SIZE.1).flat_map(|y| (0..SIZE.0).flat_map(move |x| ramp(x, y).map(|v| v as f32))).collect();
    let inside = || (6..SIZE.0 - 6, 6..SIZE.1 - 6);
    let kernel = RotatingKernel { radius_tx: 4.9, pairs: 8 };
    let found = filtered(TextureFormat::Rgba32Float, &numbers, |frame, source| rotating(frame, "turned", source, &kernel));
    assert!(worst(&found, inside(), ramp) < 1.0e-4);
    assert!(worst(&found, (0..SIZE.0, 0..SIZE.1), ramp) > 0.1, "edges are repeated");
    let smooth = Kernel::gaussian(1.5, 5).expect("a kernel");
    let found = filtered(TextureFormat::Rgba32Float, &numbers, |frame, source| separable(frame, "low", source, &smooth));
    assert!(worst(&found, inside(), ramp) < 1.0e-4);
}

/// A texel of 1 at each of the 16 places of the pattern, far from each other: together the texels around them are 16.
#[test]
fn over_all_angles_light_is_conserved() {
    let mut numbers = vec![0.0; (SIZE.0 * SIZE.1) as usize];
    for k in 0..16 {
        let (x, y) = (6 + (k % 4) * 17, 6 + (k / 4) * 17);
        numbers[(y * SIZE.0 + x) as usize] = 1.0;
    }
    let sum = |kernel| total(&filtered(TextureFormat::R32Float, &numbers, |frame, source| rotating(frame, "turned", source, &kernel)));
    let conserved = sum(RotatingKernel::default());
    assert!((conserved - 16.0).abs() < 1.0e-5, "{conserved}");
    // A single texel's light depends on which neighbours' taps meet it.
    let alone = total(&filtered(TextureFormat::R32Float, &impulse(33, 33), |frame, source| {
        rotating(frame, "turned", source, &RotatingKernel::default())
    }));
    assert!((alone - 1.0).abs() > 1.0e-3 && (alone - 1.0).abs() < 0.5, "{alone}");
}
