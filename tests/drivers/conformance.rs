//! Driver conformance: the generators, the attribution of differences to rules, and the drivers that are installed here.
//!
//! Where there is no driver, the tests of drivers say so and pass: "not run" is not "passed", and what ran is in the test's output.
use nephroid::gpu::conformance::explain::{Explanation, chain};
use nephroid::gpu::conformance::image::{on_driver, on_software};
use nephroid::gpu::conformance::{CASES, Case, Expectation, Kind, SEED, Verdict, choose_rules, probes, run_case, shrink};
use nephroid::gpu::{Family, Gpu, adapters};
use nephroid::pipeline::state::{ClipVolume, F16Rounding, RasterRules};
use nephroid::pipeline::{Device, DeviceOptions, format_info};

fn device() -> Device {
    Device::new(DeviceOptions::default()).expect("the worker threads start")
}

fn case(name: &str) -> &'static Case {
    CASES.iter().find(|case| case.name == name).expect("the table has the case")
}

const PRESETS: [RasterRules; 4] = [RasterRules::REFERENCE, RasterRules::LAVAPIPE, RasterRules::LAVAPIPE_NO_FMA, RasterRules::SWIFTSHADER];

#[test]
fn cases_draw_more_than_a_million_triangles_and_have_names_of_their_own() {
    let mut triangles = 0;
    for (number, case) in CASES.iter().enumerate() {
        assert!(CASES[..number].iter().all(|other| other.name != case.name), "{}", case.name);
        if case.kind == Kind::Triangles {
            triangles += (0..case.drawings).map(|index| case.drawing(SEED, index).count()).sum::<usize>();
        }
    }
    assert!(triangles > 1_000_000, "{triangles}");
}

#[test]
fn cases_are_a_function_of_seed_and_number() {
    for case in CASES {
        // As bits: integers look like any float, not-a-number too.
        let bits = |(seed, index)| -> Vec<u32> {
            let vertices = case.drawing(seed, index).vertices;
            vertices.iter().flat_map(|v| v.position.into_iter().chain(v.color)).map(f32::to_bits).collect()
        };
        let [a, b, other_index, other_seed] = [(1, 0), (1, 0), (1, 1), (2, 0)].map(bits);
        assert!(!a.is_empty() && a == b, "{}", case.name);
        assert!(a != other_index && a != other_seed, "{}", case.name);
        let integers = case.drawing(1, 0).color.is_some_and(|(format, _)| format_info(format).is_some_and(|info| info.kind.is_integer()));
        let finite = |number: &[u32]| number.iter().all(|bits| f32::from_bits(*bits).is_finite());
        assert!(a.chunks_exact(8).all(|v| finite(&v[..4]) && (integers || finite(&v[4..]))), "{}", case.name);
    }
}

#[test]
fn cases_that_add_weights_stay_exact_in_f32() {
    for case in CASES.iter().filter(|case| ["coverage", "clipping", "points", "lines"].iter().any(|topic| case.name.starts_with(topic))) {
        let drawing = case.drawing(SEED, 0);
        let corners = drawing.corners();
        let weights: Vec<f32> = drawing.vertices.iter().step_by(corners).map(|v| v.color[0]).collect();
        assert!(weights.iter().all(|w| *w >= 1.0 && w.fract() == 0.0), "{}", case.name);
        // A line covers a pixel at most once, a fan of a clipped triangle too.
        assert!(weights.iter().map(|w| f64::from(*w)).sum::<f64>() < 16_777_216.0, "{}", case.name);
    }
}

#[test]
fn closed_meshes_leave_no_stencil_behind_unless_clipping_loses_slivers() {
    let device = device();
    // SwiftShader drops slivers that its clipping turns over, and so do we under its rules.
    for rules in &PRESETS[..3] {
        for index in 0..4 {
            let image = on_software(&device, &case("stencil: closed meshes").drawing(SEED, index), *rules).expect("the drawing is valid");
            let surface = image.surface(0);
            for y in 0..surface.height {
                for x in 0..surface.width {
                    assert_eq!(surface.stencil_at(x, y), 0, "{rules:?}, drawing {index} at ({x}, {y})");
                }
            }
        }
    }
}

#[test]
fn chains_lead_from_the_reference_to_each_preset() {
    for rules in PRESETS {
        let steps = chain(&rules);
        assert_eq!(steps.last().map_or(RasterRules::REFERENCE, |step| step.rules), rules);
    }
    assert!(chain(&RasterRules::REFERENCE).is_empty());
}

#[test]
fn explain_puts_a_planted_rule_change_down_to_that_rule() {
    let device = device();
    let planted = [
        ("clip volume", "clipping: borders", RasterRules { clip_volume: ClipVolume::Frustum, ..RasterRules::REFERENCE }),
        ("f16 rounding", "blending: rgba16float, sum", RasterRules { f16_rounding: F16Rounding::TowardZero, ..RasterRules::REFERENCE }),
        ("depth plane", "depth: depth32float", RasterRules { depth_plane: RasterRules::LAVAPIPE.depth_plane, ..RasterRules::REFERENCE }),
        ("sub-pixel bits and viewport arithmetic", "coverage: uniform", RasterRules { subpixel_bits: 4, ..RasterRules::REFERENCE }),
    ];
    for (rule, name, rules) in planted {
        // The "driver" follows all of a driver's rules, or the planted one alone: either way the chain must find the rule.
        let drawing = case(name).drawing(SEED, 0);
        let stand_in = on_software(&device, &drawing, rules).expect("the drawing is valid");
        let mut explanation = Explanation::default();
        explanation.add(&device, &drawing, &chain(&rules), &stand_in, &stand_in, 0.0).expect("the drawing is valid");
        assert!(explanation.differing > 0 && explanation.unexplained == 0, "{rule}: {explanation:?}");
        assert_eq!(explanation.by_rule.iter().map(|count| (count.rule, count.pixels)).collect::<Vec<_>>(), [(rule, explanation.differing)]);
    }
}

#[test]
fn explain_leaves_what_no_rule_explains() {
    let device = device();
    let drawing = case("coverage: uniform").drawing(SEED, 0);
    let preset = on_software(&device, &drawing, RasterRules::LAVAPIPE).expect("the drawing is valid");
    let stand_in = on_software(&device, &drawing, RasterRules::SWIFTSHADER).expect("the drawing is valid");
    let mut explanation = Explanation::default();
    let steps = chain(&RasterRules::LAVAPIPE);
    explanation.add(&device, &drawing, &steps, &preset, &stand_in, 0.0).expect("the drawing is valid");
    assert!(explanation.differing > 0 && explanation.unexplained == explanation.differing, "{explanation:?}");
}

#[test]
fn shrink_finds_the_one_or_two_that_matter() {
    let search = |needed: &[usize]| {
        let all_in = |subset: &[usize]| Ok::<bool, ()>(needed.iter().all(|n| subset.contains(n)));
        shrink(2000, 500, all_in).expect("the question does not fail")
    };
    assert_eq!(search(&[1234]), [1234]);
    assert_eq!(search(&[3, 1999]), [3, 1999]);
}

/// Runs a check on every driver here; says so if there is none.
fn on_drivers(check: impl Fn(&Gpu, &Device)) {
    let all = adapters();
    if all.is_empty() {
        assert!(std::env::var_os("NEPHROID_REQUIRE_ADAPTER").is_none(), "an adapter is required, and there is none");
        eprintln!("not run: there is no Vulkan adapter");
    }
    let device = device();
    for adapter in all {
        let gpu = Gpu::open(adapter).expect("the driver opens");
        check(&gpu, &device);
    }
}

#[test]
fn drivers_conform_in_a_small_share_of_every_case() {
    on_drivers(|gpu, device| {
        let rules = choose_rules(gpu, device).expect("the driver draws");
        for case in CASES {
            let report = run_case(gpu, device, &rules.1, case, 0.03).expect("the driver draws");
            // Nobody has measured other adapters yet.
            if gpu.adapter().family() != Family::Other {
                assert!(report.passes(), "{}, {}: {report:#?}", gpu.adapter().title(), rules.0);
            }
        }
    });
}

#[test]
fn drivers_differ_from_rules_that_are_not_theirs_and_the_reproducer_shows_it() {
    on_drivers(|gpu, device| {
        let (name, rules) = choose_rules(gpu, device).expect("the driver draws");
        let bits = if rules.subpixel_bits == 8 { 4 } else { 8 };
        let wrong = RasterRules { subpixel_bits: bits, ..rules };
        let uniform = case("coverage: uniform");
        let report = run_case(gpu, device, &wrong, uniform, 0.001).expect("the driver draws");
        assert!(report.differing > 0 && report.verdict == Verdict::Unexpected && !report.passes(), "{name}: {report:#?}");
        let reproducer = report.reproducer.expect("a difference has a reproducer");
        assert_eq!(reproducer.vertices.len(), 3, "one triangle is enough:\n{reproducer}");
        // Drawn alone, it still differs under the wrong rules and is identical under the right ones.
        let mut drawing = uniform.drawing(SEED, reproducer.drawing);
        drawing.vertices.retain(|v| reproducer.vertices.iter().any(|(position, color)| *position == v.position && *color == v.color));
        let actual = on_driver(gpu, device, &drawing, rules).expect("the driver draws");
        for (rules, is_right) in [(wrong, false), (rules, true)] {
            let expected = on_software(device, &drawing, rules).expect("the drawing is valid");
            assert_eq!(expected.differing(&actual, 0.0).is_empty(), is_right);
        }
    });
}

/// A known difference explains as many pixels as were measured, not any number.
#[test]
fn a_known_difference_does_not_excuse_every_pixel() {
    on_drivers(|gpu, device| {
        let (_, rules) = choose_rules(gpu, device).expect("the driver draws");
        let wrong = RasterRules { subpixel_bits: if rules.subpixel_bits == 8 { 4 } else { 8 }, ..rules };
        let lines = case("lines: anywhere");
        if matches!(lines.expected(gpu.adapter().family()), Expectation::Differs(..)) {
            let report = run_case(gpu, device, &wrong, lines, 0.1).expect("the driver draws");
            assert_eq!(report.verdict, Verdict::Unexpected, "{}: {report:#?}", gpu.adapter().title());
        }
    });
}

#[test]
fn drivers_answer_twelve_probes() {
    on_drivers(|gpu, device| {
        let (_, rules) = choose_rules(gpu, device).expect("the driver draws");
        let answers = probes(gpu, device, &rules).expect("the driver draws");
        assert_eq!(answers.iter().map(|probe| probe.number).collect::<Vec<_>>(), (1..=12).collect::<Vec<_>>());
        assert_eq!(answers[0].driver, "left and top edges own their pixels");
        assert_eq!(answers[1].reference, "8 bits, ties to even");
        let bits = rules.subpixel_bits;
        if gpu.adapter().family() != Family::Other {
            assert_eq!(answers[1].driver, format!("{bits} bits, ties to even"));
        }
    });
}

#[test]
fn expectations_with_a_bound_name_it() {
    for case in CASES {
        for expectation in [case.lavapipe, case.swiftshader] {
            match expectation {
                Expectation::Exact => {}
                Expectation::Within(bound, name) => assert!(bound > 0.0 && !name.is_empty(), "{}", case.name),
                Expectation::Differs(reason, each) => {
                    assert!(reason.len() > 20 && each > 0.0 && each < 30.0, "{}", case.name);
                }
            }
        }
    }
}
