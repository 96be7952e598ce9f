//! Blending in primitive order: f32 sums are the sequential ones, bit for bit, whatever the device and the wave.

use nephroid_pipeline::shader::{Interpolation, ShaderWidth};
use nephroid_pipeline::state::{F16Rounding, RasterRules, TextureFormat};
use nephroid_pipeline::{Device, DeviceOptions, f16_to_f32, f32_to_f16, format_info};

use super::passes::*;
use super::reference::{Fill, for_each_pixel, snap};

struct Case {
    size: (u32, u32),
    triangles: Vec<([[f32; 4]; 3], [f32; 4])>,
}

impl Case {
    /// Overlapping triangles with colours of many magnitudes and both signs, so that every sum depends on its order.
    fn random(rng: &mut Rng, size: (u32, u32), count: usize) -> Self {
        let triangles = (0..count).map(|_| {
            let reach = [4.0, 30.0, 200.0][rng.int(0..3) as usize];
            let centre = [rng.real(0.0, f64::from(size.0)), rng.real(0.0, f64::from(size.1))];
            let corners = [(); 3].map(|()| {
                let p = centre.map(|c| c + rng.real(-reach, reach));
                clip_from_px(size, p, 0.5)
            });
            let color = [0; 4].map(|_| rng.f32(-1.0, 1.0) * [1.0 / 256.0, 1.0 / 16.0, 1.0, 7.0, 32.0][rng.int(0..5) as usize]);
            (corners, color)
        });
        Self { size, triangles: triangles.collect() }
    }

    /// Sequential sums, rounded to the format after every fragment.
    fn expected(&self, channels: usize, round: impl Fn(f32) -> f32) -> (Vec<Vec<u32>>, u64) {
        let mut planes = vec![vec![0.0f32; (self.size.0 * self.size.1) as usize]; channels];
        let mut fragments = 0;
        for (corners, color) in &self.triangles {
            for_each_pixel(corners.map(|c| snap(self.size, c)), self.size, Fill::TopLeft, |x, y| {
                for (plane, value) in planes.iter_mut().zip(color) {
                    let texel = &mut plane[y * self.size.0 as usize + x];
                    *texel = round(*texel + value);
                }
                fragments += 1;
            });
        }
        (planes.into_iter().map(|plane| plane.into_iter().map(f32::to_bits).collect()).collect(), fragments)
    }

    fn render(&self, device: &Device, format: TextureFormat, rules: RasterRules, general: bool) -> Vec<Vec<u32>> {
        let program = if general { pull_program(VaryingColor, Interpolation::Flat) } else { pull_program(FlatColor, Interpolation::Flat) };
        let pipeline = pipeline_with(program, rules, |desc| desc.targets = vec![additive(format)]);
        let vertices: Vec<Vertex> = self.triangles.iter().flat_map(|(corners, color)| corners.map(|c| vertex(c, *color))).collect();
        let mut canvas = Canvas::single(self.size, format);
        draw_on(device, &mut canvas, &pipeline, &vertices);
        let channels = format_info(format).expect("a supported format").channels;
        (0..channels).map(|c| canvas.channel(0, c).into_iter().map(f32::to_bits).collect()).collect()
    }
}

fn devices() -> Vec<Device> {
    let options = [
        DeviceOptions { threads: Some(2), ..DeviceOptions::default() },
        DeviceOptions { threads: Some(3), bin_budget_bytes: 1, ..DeviceOptions::default() },
        DeviceOptions { threads: Some(1), width: ShaderWidth::One, ..DeviceOptions::default() },
    ];
    options.map(|options| Device::new(options).expect("threads start")).into()
}

#[test]
fn additive_f32_is_the_sequential_sum() {
    let mut rng = Rng(301);
    let (mut triangles, mut fragments) = (0, 0);
    for round in 0..sized(4, 2) {
        let case = Case::random(&mut rng, [(100, 60), (320, 240)][round % 2], sized(12_000, 3_000));
        for (format, channels) in [(TextureFormat::R32Float, 1), (TextureFormat::Rg32Float, 2), (TextureFormat::Rgba32Float, 4)] {
            let (expected, count) = case.expected(channels, |sum| sum);
            for (i, device) in devices().iter().enumerate() {
                for general in [false, true] {
                    let seen = case.render(device, format, RasterRules::REFERENCE, general);
                    for (channel, (expected, seen)) in expected.iter().zip(&seen).enumerate() {
                        let difference = first_difference(case.size.0, expected, seen);
                        assert_eq!(difference, None, "{format:?}, channel {channel}, device {i}, general path: {general}");
                    }
                }
            }
            triangles += case.triangles.len();
            fragments += count;
        }
    }
    println!("sequential sums: {triangles} triangles, {fragments} fragments per device and path");
}

#[test]
fn additive_f16_rounds_after_every_fragment() {
    let case = Case::random(&mut Rng(302), (100, 60), 3_000);
    let mut seen_both = Vec::new();
    for rounding in [F16Rounding::NearestEven, F16Rounding::TowardZero] {
        let rules = RasterRules { f16_rounding: rounding, ..RasterRules::REFERENCE };
        let (expected, _) = case.expected(4, |sum| f16_to_f32(f32_to_f16(sum, rounding)));
        let seen = case.render(device(), TextureFormat::Rgba16Float, rules, true);
        assert_eq!(expected, seen, "{rounding:?}");
        seen_both.push(seen);
    }
    assert_ne!(seen_both[0], seen_both[1], "the two roundings must be told apart");
}

#[test]
fn order_check_notices_two_swapped_triangles() {
    let mut case = Case::random(&mut Rng(303), (100, 60), 2_000);
    let seen = case.render(device(), TextureFormat::Rgba32Float, RasterRules::REFERENCE, false);
    case.triangles.reverse();
    assert_ne!(case.expected(4, |sum| sum).0, seen, "sums in reverse order must differ");
}
