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
    /// Passes in their order.
    pub passes: Vec<PassCost>,
    /// Counters of the technique.
    pub counters: Vec<(String, u64)>,
}

/// Cost of a pass.
#[derive(Clone, Debug, Serialize)]
pub struct PassCost {
    /// The pass' label.
    pub label: String,
    /// Its time, s.
    pub seconds: f64,
    /// Number of fragments that passed in it.
    pub fragments: u64,
}

impl Cell {
    /// Time of a part of frame building; 0 if there is no such part.
    pub fn building(&self, name: &str) -> f64 {
        self.building_s.iter().find(|(part, _)| *part == name).map_or(0.0, |(_, seconds)| *seconds)
    }

    /// Time of the passes whose labels start with this.
    pub fn passes_s(&self, prefix: &str) -> f64 {
        self.passes_of(prefix).fold(0.0, |sum, pass| sum + pass.seconds)
    }

    /// Number of fragments that passed in the passes whose labels start with this.
    pub fn fragments(&self, prefix: &str) -> u64 {
        self.passes_of(prefix).map(|pass| pass.fragments).sum()
    }

    fn passes_of<'a>(&'a self, prefix: &'a str) -> impl Iterator<Item = &'a PassCost> {
        self.passes.iter().filter(move |pass| pass.label.starts_with(prefix))
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
pub fn measure(scene: &Scene, technique: &str, frames: u32) -> anyhow::Result<Cell> {
    let options = RenderOptions { technique: technique.to_owned(), ..RenderOptions::default() };
    let mut renderer = Renderer::new(scene, &options)?;
    renderer.set_clock(seconds);
    let mut runs: Vec<(f64, TechniqueFrame, Clock)> = Vec::new();
    for frame in 0..WARM_UP + frames {
        let mut clock = Clock::default();
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
    let pass = |(k, pass): (usize, &PassCost)| PassCost { seconds: of(&|run| run.2.passes[k].seconds), ..pass.clone() };
    Ok(Cell {
        frame_s: of(&|run| run.0),
        building_s: (0..built.seconds.len())
            .map(|k| (built.seconds[k].0, median(builds.iter().map(|parts| parts[k].1).collect())))
            .collect(),
        passes: clock.passes.iter().enumerate().map(pass).collect(),
        counters: built.counters.clone(),
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

/// Times passes.
#[derive(Default)]
struct Clock {
    begun: Option<Instant>,
    passes: Vec<PassCost>,
}

impl FrameObserver for Clock {
    fn pass_begin(&mut self, _index: usize, _pass: &Pass) -> Option<&mut dyn Observer> {
        self.begun = Some(Instant::now());
        None
    }
    fn pass_end(&mut self, _index: usize, pass: &Pass, _contents: &Contents, output: &PassOutput) {
        let seconds = self.begun.take().map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        self.passes.push(PassCost { label: pass.label.clone(), seconds, fragments: output.statistics.fragments_passed });
    }
}
