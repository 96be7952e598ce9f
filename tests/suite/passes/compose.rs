//! Depth for smaller targets, and layers added up: identities, constants, ramps, and steps in depth that nothing crosses.

use glam::{Mat4, Vec3, Vec4};
use nephroid::frame::{Frame, TextureId};
use nephroid::math::space;
use nephroid::pipeline::state::TextureFormat;
use nephroid::pipeline::{Texture, TextureDescriptor};

use nephroid::passes::compose::{ByDepth, DistanceFromDepth, Layer, add};
use nephroid::passes::downsample;

use super::{texture_of, worst};
use crate::support::shared_passes::{noise, texture};

/// Size of the result: a multiple of four, but of no tile.
const SIZE: (u32, u32) = (88, 76);

fn result(size: (u32, u32)) -> TextureDescriptor {
    TextureDescriptor::d2("result", size.0, size.1, TextureFormat::Rgba32Float)
}

/// Four channels at each texel of a size.
fn texels<F: Fn(u32, u32) -> [f32; 4]>((width, height): (u32, u32), f: F) -> Vec<f32> {
    let f = &f;
    (0..height).flat_map(|y| (0..width).flat_map(move |x| f(x, y))).collect()
}

/// Adds a texture of distances at each texel of a size.
fn distances(frame: &mut Frame, label: &str, size: (u32, u32), f: impl Fn(u32, u32) -> f32) -> TextureId {
    let numbers: Vec<f32> = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).map(|(x, y)| f(x, y)).collect();
    texture(frame, label, size, TextureFormat::R32Float, &numbers)
}

/// One layer alone, brought up by distances to [`SIZE`].
fn brought_up(
    size: (u32, u32),
    layer: &[f32],
    layer_distance: impl Fn(u32, u32) -> f32,
    distance: impl Fn(u32, u32) -> f32,
    tolerance: f32,
) -> Texture {
    let mut frame = Frame::default();
    let layer = texture(&mut frame, "layer", size, TextureFormat::Rgba32Float, layer);
    let layer_depth = distances(&mut frame, "layer distance", size, layer_distance);
    let full_depth = distances(&mut frame, "distance", SIZE, distance);
    let by_depth = Some(ByDepth { layer_depth, full_depth, distance: DistanceFromDepth::IDENTITY, tolerance });
    let sum = add(&mut frame, result(SIZE), &[Layer { texture: layer, scale: Vec4::ONE, by_depth }]);
    texture_of(&frame, sum)
}

/// Distances without any order.
fn scattered(seed: u32) -> impl Fn(u32, u32) -> f32 {
    move |x, y| 1.0 + ((x * 7 + y * 13 + seed) % 11) as f32
}

#[test]
fn layers_are_added_with_their_factors() {
    let mut frame = Frame::default();
    let layer = |frame: &mut Frame, k: u32, scale: f32| {
        let numbers = texels(SIZE, |x, y| [(x * k) as f32, (y + k) as f32, 0.5, 1.0]);
        let texture = texture(frame, "layer", SIZE, TextureFormat::Rgba32Float, &numbers);
        Layer { texture, scale: Vec4::new(scale, scale, scale, 1.0), by_depth: None }
    };
    let layers = [(1, 1.0), (2, 0.5), (5, -3.0)].map(|(k, scale)| layer(&mut frame, k, scale));
    let sum = add(&mut frame, result(SIZE), &layers);
    let nothing = add(&mut frame, result(SIZE), &[]);
    let expected = |x: u32, y: u32| {
        let (x, y) = (f64::from(x), f64::from(y));
        [x + x - 15.0 * x, y + 1.0 + 0.5 * (y + 2.0) - 3.0 * (y + 5.0), -0.75, 3.0]
    };
    let all = || (0..SIZE.0, 0..SIZE.1);
    assert_eq!(worst(&texture_of(&frame, sum), all(), expected), 0.0);
    assert_eq!(worst(&texture_of(&frame, nothing), all(), |_, _| [0.0; 4]), 0.0);
    assert!(worst(&texture_of(&frame, sum), all(), |x, y| expected(x, y).map(|v| v * 1.001)) > 1.0e-3);
}

#[test]
fn a_layer_of_the_results_size_keeps_its_bits_whatever_the_depths_are() {
    let numbers = noise(21, (SIZE.0 * SIZE.1 * 4) as usize);
    for tolerance in [0.0, 0.1, 100.0] {
        let found = brought_up(SIZE, &numbers, scattered(3), scattered(8), tolerance);
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        assert!(found.read_bytes(0, 0) == bytes, "{tolerance}");
    }
}

#[test]
fn constants_keep_their_bits_at_any_size_and_depth() {
    let constant = [0.1_f32, 3.000_000_2e7, -1.0e-30, 1.0 / 3.0];
    // A third of the size is in no step of binary fractions.
    for size in [(44, 38), (22, 19), (29, 25), (1, 1)] {
        for tolerance in [0.0, 0.3, 100.0] {
            let found = brought_up(size, &texels(size, |_, _| constant), scattered(1), scattered(5), tolerance);
            for (channel, value) in constant.into_iter().enumerate() {
                assert!(found.read_channel(0, 0, channel).iter().all(|texel| texel.to_bits() == value.to_bits()), "{size:?} {tolerance}");
            }
        }
    }
}

#[test]
fn ramps_come_up_as_they_are_on_one_surface() {
    let ramp = |x: f64, y: f64| [x, y, x - 2.0 * y, 0.25 * x + 3.0];
    for factor in [2, 4] {
        let size = (SIZE.0 / factor, SIZE.1 / factor);
        // The ramp at the middle of each texel's part of the picture; all of it in binary fractions.
        let middle = |i: u32| (f64::from(i) + 0.5) * f64::from(factor) - 0.5;
        let numbers = texels(size, |x, y| ramp(middle(x), middle(y)).map(|v| v as f32));
        // A floor that runs away from the eye, by less than the tolerance from texel to texel.
        let away = |x: f32| 4.0 + 0.01 * x;
        let found = brought_up(size, &numbers, |x, _| away(middle(x) as f32), |x, _| away(x as f32), 0.05);
        let expected = |x: u32, y: u32| ramp(f64::from(x), f64::from(y));
        let inside = || (factor..SIZE.0 - factor, factor..SIZE.1 - factor);
        assert_eq!(worst(&found, inside(), expected), 0.0, "1/{factor}");
        assert!(worst(&found, (0..SIZE.0, 0..SIZE.1), expected) > 0.1, "the outermost half texel is a constant");
        // With no tolerance it is the nearest in depth, and the ramp has steps.
        let steps = brought_up(size, &numbers, |x, _| away(middle(x) as f32), |x, _| away(x as f32), 0.0);
        assert!(worst(&steps, inside(), expected) > 0.1, "1/{factor}");
    }
}

/// A step in depth at column or row `edge`: 2 m before it, 10 m after.
fn step(edge: u32, across: bool) -> impl Fn(u32, u32) -> f32 {
    move |x, y| if (if across { x } else { y }) < edge { 2.0 } else { 10.0 }
}

/// Brings a layer up across a step, by depth made smaller by the pass. The layer has each side's own number.
fn across_a_step(factor: u32, edge: u32, across: bool, tolerance: f32) -> f64 {
    let view = (0.5, 20.0);
    let (near, far) = view;
    let mut frame = Frame::default();
    let size = (SIZE.0 / factor, SIZE.1 / factor);
    // As `math::space::perspective` writes it.
    let depth = |distance: f32| far * (distance - near) / (distance * (far - near));
    let side = step(edge, across);
    let full_depth = distances(&mut frame, "depth", SIZE, |x, y| depth(side(x, y)));
    let layer_depth = downsample::depth(&mut frame, "small depth", full_depth, size);
    let numbers = texels(size, |x, y| {
        let here = side(x * factor + factor / 2, y * factor + factor / 2);
        [if here < 5.0 { 1.0 } else { 1000.0 }, 0.0, 0.0, 1.0]
    });
    let layer = texture(&mut frame, "layer", size, TextureFormat::Rgba32Float, &numbers);
    let by_depth = Some(ByDepth { layer_depth, full_depth, distance: DistanceFromDepth::perspective(near, far), tolerance });
    let sum = add(&mut frame, result(SIZE), &[Layer { texture: layer, scale: Vec4::ONE, by_depth }]);
    let expected = |x: u32, y: u32| [if side(x, y) < 5.0 { 1.0 } else { 1000.0 }, 0.0, 0.0, 1.0];
    worst(&texture_of(&frame, sum), (0..SIZE.0, 0..SIZE.1), expected)
}

#[test]
fn nothing_crosses_a_step_in_depth() {
    for factor in [2, 4] {
        for edge in 16..25 {
            for across in [true, false] {
                assert_eq!(across_a_step(factor, edge, across, 0.1), 0.0, "1/{factor}, edge at {edge}, {across}");
            }
        }
        // All texels count as one surface: light bleeds.
        assert!(across_a_step(factor, 20, true, 100.0) > 100.0);
    }
}

#[test]
fn smaller_depth_is_that_of_the_middle() {
    for size in [SIZE, (44, 38), (22, 19), (29, 25), (1, 1)] {
        let mut frame = Frame::default();
        let depth = |x: u32, y: u32| (x * 3 + y * 5) as f32 / 1024.0;
        let full = distances(&mut frame, "depth", SIZE, depth);
        let small = downsample::depth(&mut frame, "small", full, size);
        let found = texture_of(&frame, small);
        assert_eq!(found.desc().format, TextureFormat::Depth32Float);
        let middle = |i: u32, full: u32, small: u32| ((2 * i + 1) * full) / (2 * small);
        let expected = |x: u32, y: u32| [f64::from(depth(middle(x, SIZE.0, size.0), middle(y, SIZE.1, size.1))), 0.0, 0.0, 0.0];
        assert_eq!(worst(&found, (0..size.0, 0..size.1), expected), 0.0, "{size:?}");
        if size.0 > 1 {
            assert!(worst(&found, (0..size.0, 0..size.1), |x, y| expected(x + 1, y)) > 0.0, "{size:?}");
        }
    }
}

#[test]
fn distances_are_those_that_projections_were_made_of() {
    let apply = |d: DistanceFromDepth, depth: f64| {
        let [n, m] = [d.numerator, d.denominator].map(|v| v.as_dvec2());
        (n.x + n.y * depth) / (m.x + m.y * depth)
    };
    let depth_at = |matrix: Mat4, distance: f32| {
        let clip = matrix * Vec3::new(0.0, 0.0, -distance).extend(1.0);
        f64::from(clip.z) / f64::from(clip.w)
    };
    let parallel = space::orthographic(Vec3::new(-1.0, -1.0, -8.0), Vec3::new(1.0, 1.0, -0.5)).expect("a box");
    for distance in [0.5_f32, 0.75, 2.0, 7.9] {
        let near_and_far =
            [(8.0, space::perspective(1.0, 1.0, 0.5, 8.0)), (f32::INFINITY, space::perspective(1.0, 1.0, 0.5, f32::INFINITY))];
        for (far, matrix) in near_and_far {
            let found = apply(DistanceFromDepth::perspective(0.5, far), depth_at(matrix.expect("a pyramid"), distance));
            assert!((found / f64::from(distance) - 1.0).abs() < 1.0e-5, "{far}: {found} for {distance}");
        }
        let found = apply(DistanceFromDepth::orthographic(0.5, 8.0), depth_at(parallel, distance));
        assert!((found / f64::from(distance) - 1.0).abs() < 1.0e-5, "{found} for {distance}");
        let identity = apply(DistanceFromDepth::IDENTITY, f64::from(distance));
        assert_eq!(identity, f64::from(distance));
    }
}

/// Depth 1 of an endless view is at no distance that is a number; it counts as one surface, far from all others.
#[test]
fn the_sky_is_one_surface() {
    let mut frame = Frame::default();
    let size = (SIZE.0 / 2, SIZE.1 / 2);
    let sky = |x: u32| if x < 30 { 1.0 } else { 0.9 };
    let full_depth = distances(&mut frame, "depth", SIZE, |x, _| sky(x));
    let layer_depth = downsample::depth(&mut frame, "small depth", full_depth, size);
    let numbers = texels(size, |x, _| [if sky(2 * x + 1) == 1.0 { x as f32 } else { f32::INFINITY }, 0.0, 0.0, 0.0]);
    let layer = texture(&mut frame, "layer", size, TextureFormat::Rgba32Float, &numbers);
    let distance = DistanceFromDepth::perspective(0.5, f32::INFINITY);
    let by_depth = Some(ByDepth { layer_depth, full_depth, distance, tolerance: 0.1 });
    let sum = add(&mut frame, result(SIZE), &[Layer { texture: layer, scale: Vec4::ONE, by_depth }]);
    let found = texture_of(&frame, sum);
    // A ramp of half a texel per pixel, in spite of what lies beyond the step.
    assert_eq!(worst(&found, (1..29, 1..SIZE.1), |x, _| [0.5 * f64::from(x) - 0.25, 0.0, 0.0, 0.0]), 0.0);
}
