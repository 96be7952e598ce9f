//! Draws the cases on a driver and on the software GPU, and compares the images.

use super::cases::{CASES, Case, Expectation, FEW};
use super::explain::{Explanation, Step, chain};
use super::image::{Image, on_driver, on_software};
use super::probes::probes;
use super::report::{CaseReport, Report, Verdict};
use super::shrink::{Reproducer, shrink};
use crate::crosscheck::compare;
use crate::{Gpu, GpuError};
use nephroid_pipeline::state::RasterRules;
use nephroid_pipeline::{ChannelKind, Device, Surface};

/// Seed of all conformance drawings.
pub const SEED: u32 = 1;
/// Most drawings that the search for a minimal reproducer may make.
const SHRINK_BUDGET: usize = 200;

/// Runs all cases and probes. `share`, above 0 and at most 1, is the share of each case's drawings that is drawn.
///
/// # Errors
/// If the driver cannot draw a case.
pub fn run(gpu: &Gpu, device: &Device, rules: (&'static str, RasterRules), share: f64) -> Result<Report, GpuError> {
    let cases = CASES.iter().map(|case| run_case(gpu, device, &rules.1, case, share)).collect::<Result<_, _>>()?;
    Ok(Report { adapter: gpu.adapter().line(), rules: rules.0, share, cases, probes: probes(gpu, device, &rules.1)? })
}

/// Runs one case.
///
/// # Errors
/// If the driver cannot draw it.
pub fn run_case(gpu: &Gpu, device: &Device, rules: &RasterRules, case: &Case, share: f64) -> Result<CaseReport, GpuError> {
    let expectation = case.expected(gpu.adapter().family());
    let tolerance = if let Expectation::Within(bound, _) = expectation { bound } else { 0.0 };
    let steps = chain(rules);
    let mut report = CaseReport::new(case, expectation);
    for index in 0..case.drawings_of(share) {
        let drawing = case.drawing(SEED, index);
        let actual = on_driver(gpu, device, &drawing, *rules)?;
        let expected = on_software(device, &drawing, *rules)?;
        report.primitives += drawing.count() as u64;
        add_difference(&mut report, &expected, &actual, tolerance);
        let explained = Drawn { device, drawing: &drawing, steps: &steps, expected: &expected, actual: &actual };
        explained.explain(&mut report.reference, tolerance)?;
        if report.outliers > 0 && report.reproducer.is_none() {
            let least = shrink(drawing.count(), SHRINK_BUDGET, |subset| -> Result<bool, GpuError> {
                let part = drawing.only(subset);
                let actual = on_driver(gpu, device, &part, *rules)?;
                Ok(!on_software(device, &part, *rules)?.differing(&actual, tolerance).is_empty())
            })?;
            let part = drawing.only(&least);
            let (expected, actual) = (on_software(device, &part, *rules)?, on_driver(gpu, device, &part, *rules)?);
            let place = expected.differing(&actual, tolerance).first().copied();
            report.reproducer = place.map(|place| Reproducer::new(index, &part, place, &expected, &actual));
        }
    }
    report.verdict = match expectation {
        _ if report.differing == 0 => Verdict::Identical,
        Expectation::Within(..) if report.outliers == 0 => Verdict::Within,
        Expectation::Differs(_, each) if report.differing <= FEW.max((report.primitives as f64 * each) as u64) => Verdict::Differs,
        _ => Verdict::Unexpected,
    };
    Ok(report)
}

/// A drawing with its two images.
struct Drawn<'a> {
    device: &'a Device,
    drawing: &'a super::drawing::Drawing,
    steps: &'a [Step],
    expected: &'a Image,
    actual: &'a Image,
}

impl Drawn<'_> {
    fn explain(&self, into: &mut Explanation, tolerance: f64) -> Result<(), GpuError> {
        Ok(into.add(self.device, self.drawing, self.steps, self.expected, self.actual, tolerance)?)
    }
}

/// Counts pixels that differ, and measures by how much.
fn add_difference(report: &mut CaseReport, expected: &Image, actual: &Image, tolerance: f64) {
    for (number, texture) in expected.attachments.iter().enumerate() {
        let (e, a) = (expected.surface(number), actual.surface(number));
        report.pixels += u64::from(e.width) * u64::from(e.height);
        if !texture.info().kind.is_integer() && e == a {
            continue;
        }
        let difference = compare(texture.info(), e, a, 0.0).difference;
        report.differing += difference.differing;
        // The unit of 8-bit colours is a step of 1/255.
        let max_ulp = if texture.info().kind == ChannelKind::Unorm8 { greatest_step(e, a) } else { difference.max_ulp };
        report.max_ulp = report.max_ulp.max(max_ulp);
        report.max_relative = report.max_relative.max(difference.worst.map_or(0.0, |pixel| pixel.error));
    }
    if expected.count != actual.count {
        report.differing += 1;
    }
    report.outliers += expected.differing(actual, tolerance).len() as u64;
}

/// Greatest difference of two 8-bit surfaces in steps of 1/255.
fn greatest_step(a: &Surface, b: &Surface) -> u64 {
    let numbers = |s: &Surface| -> Vec<f32> {
        let pixels = (0..s.height).flat_map(|y| (0..s.width).map(move |x| (x, y)));
        pixels.flat_map(|(x, y)| (0..s.channels).map(move |c| s.get(x, y, c))).collect()
    };
    let steps = numbers(a).into_iter().zip(numbers(b)).map(|(a, b)| ((a - b).abs() * 255.0).round() as u64);
    steps.max().unwrap_or(0)
}

/// The rules that an adapter follows, among those of its rasterizer: the first under which a few drawings of coverage and depth are identical,
/// otherwise those with the fewest differing pixels.
///
/// # Errors
/// If the driver cannot draw them.
pub fn choose_rules(gpu: &Gpu, device: &Device) -> Result<(&'static str, RasterRules), GpuError> {
    let candidates = gpu.adapter().family().candidates();
    let asked = ["coverage: uniform", "clipping: borders", "depth: depth32float"];
    let mut best = (candidates[0], u64::MAX);
    for candidate in candidates {
        let mut differing = 0;
        for case in CASES.iter().filter(|case| asked.contains(&case.name)) {
            // At the size of the second drawing, a fused viewport makes a difference.
            for index in 0..2 {
                let drawing = case.drawing(SEED, index);
                let expected = on_software(device, &drawing, candidate.1)?;
                differing += expected.differing(&on_driver(gpu, device, &drawing, candidate.1)?, 0.0).len() as u64;
            }
        }
        if differing < best.1 {
            best = (*candidate, differing);
        }
        if differing == 0 {
            break;
        }
    }
    Ok(best.0)
}
