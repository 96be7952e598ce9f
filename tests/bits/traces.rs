//! The ground truth: the same bits on any number of threads and at any level with code of its own, and the committed digests of whole runs.

use nephroid::math::level::wide_levels;
use nephroid::scene::Scene;
use nephroid::trace::{TraceOptions, Tracer};

use crate::support::traces::{everything, options, run_on};
use crate::support::{fnv1a, scene_of_size};

fn small(name: &str, width: u32, height: u32) -> Scene {
    scene_of_size(name, (width, height))
}

#[test]
fn traces_are_the_same_on_any_number_of_threads_at_any_level() {
    let scene = everything();
    let expected = run_on(1, &scene, &options(true, true), 1);
    for ((name, level), threads) in wide_levels().into_iter().zip([7, 2].into_iter().cycle()) {
        let options = TraceOptions { level, ..options(true, true) };
        assert!(run_on(threads, &scene, &options, 1) == expected, "level {name} on {threads} threads gives other bits");
    }
    let other = TraceOptions { seed: 8, ..options(true, true) };
    assert!(run_on(2, &scene, &other, 1) != expected, "another seed gives the same bits");
}

#[test]
fn traces_have_the_committed_digests() {
    let mut found = Vec::new();
    for (name, scene, volume) in [
        ("everything", everything(), true),
        ("sine_water", small("analytic/sine_water.ron", 32, 32), false),
        ("pool", small("pool.ron", 32, 18), false),
        ("glass", small("glass.ron", 32, 18), false),
    ] {
        let mut tracer = Tracer::new(&scene, &options(true, volume)).expect("the scene can be traced");
        tracer.run_batch();
        found.push((name, fnv1a(&tracer.state())));
    }
    assert_eq!(found, DIGESTS);
}

const DIGESTS: [(&str, u64); 4] = [
    ("everything", 9_696_349_309_423_121_515),
    ("sine_water", 11_917_607_565_046_104_215),
    ("pool", 916_007_413_025_725_406),
    ("glass", 3_385_349_540_259_507_426),
];
