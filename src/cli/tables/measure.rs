//! Measures the cost of frames of one scene.

use std::sync::OnceLock;
use std::time::Instant;

use serde::Serialize;

use crate::caustics::{RenderOptions, Renderer, TechniqueFrame};
use crate::frame::{Contents, FrameObserver, Pass};
use crate::pipeline::{Observer, PassOutput};
use crate::scene::Scene;

/// Frames rendered before those that count.
const WARM_UP: u32 = 1;

/// Frames built for each frame that is run: parts of building take about a millisecond and are compared by tenths of it.
const BUILDS: u32 = 4;

/// Results of a measurement. Times are medians, s.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// Time of a whole frame.
    pub frame_s: f64,
    /// Times of the parts of frame building, by name; measured on frames that are built and not run.
    pub building_s: Vec<(&'static str, f64)>,
    /// Time of the passes whose labels start with the requested prefix.
    pub passes_s: f64,
    /// Counters of the technique.
    pub counters: Vec<(String, u64)>,
    /// Number of fragments that passed in those passes.
    pub fragments: u64,
}

impl Cell {
    /// Time of a part of frame building; 0 if there is no such part.
    pub fn building(&self, name: &str) -> f64 {
        self.building_s.iter().find(|(part, _)| *part == name).map_or(0.0, |(_, seconds)| *seconds)
    }

    /// Value of a counter; 0 if there is no such counter.
    pub fn counter(&self, name: &str) -> u64 {
        self.counters.iter().find(|(counter, _)| counter == name).map_or(0, |(_, count)| *count)
    }
}

/// Measures frames of an unchanged scene on all cores.
///
/// # Errors
/// If a frame cannot be built or run.
pub fn measure(scene: &Scene, technique: &str, frames: u32, passes: &'static str) -> anyhow::Result<Cell> {
    let options = RenderOptions { technique: technique.to_owned(), ..RenderOptions::default() };
    let mut renderer = Renderer::new(scene, &options)?;
    renderer.set_clock(seconds);
    let mut runs: Vec<(f64, TechniqueFrame, Clock)> = Vec::new();
    for frame in 0..WARM_UP + frames {
        let mut clock = Clock { prefix: passes, begun: None, seconds: 0.0, fragments: 0 };
        let start = Instant::now();
        let mut built = renderer.run(scene, Some(&mut clock))?;
        let seconds = start.elapsed().as_secs_f64();
        // The frame is large and no longer needed.
        built.frame = crate::frame::Frame::default();
        if frame >= WARM_UP {
            runs.push((seconds, built, clock));
        }
    }
    let mut builds = Vec::new();
    for _ in 0..BUILDS * frames {
        builds.push(renderer.build(scene)?.seconds);
    }
    let (_, built, clock) = &runs[0];
    let of = |time: &dyn Fn(&(f64, TechniqueFrame, Clock)) -> f64| median(runs.iter().map(time).collect());
    Ok(Cell {
        frame_s: of(&|run| run.0),
        building_s: (0..built.seconds.len())
            .map(|k| (built.seconds[k].0, median(builds.iter().map(|parts| parts[k].1).collect())))
            .collect(),
        passes_s: of(&|run| run.2.seconds),
        counters: built.counters.clone(),
        fragments: clock.fragments,
    })
}

/// Seconds since the first call.
fn seconds() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Sums time and fragments of some passes.
struct Clock {
    prefix: &'static str,
    begun: Option<Instant>,
    seconds: f64,
    fragments: u64,
}

impl FrameObserver for Clock {
    fn pass_begin(&mut self, _index: usize, pass: &Pass) -> Option<&mut dyn Observer> {
        self.begun = pass.label.starts_with(self.prefix).then(Instant::now);
        None
    }
    fn pass_end(&mut self, _index: usize, _pass: &Pass, _contents: &Contents, output: &PassOutput) {
        if let Some(begun) = self.begun.take() {
            self.seconds += begun.elapsed().as_secs_f64();
            self.fragments += output.statistics.fragments_passed;
        }
    }
}
