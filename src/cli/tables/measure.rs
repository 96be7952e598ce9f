//! Measures the cost of frames of one scene.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use anyhow::ensure;
use serde::Serialize;

use crate::caustics::{RenderOptions, Renderer, TechniqueFrame};
use crate::frame::{Contents, FrameObserver, Pass};
use crate::pipeline::{Buffer, Observer, PassOutput};
use crate::scene::Scene;

/// Frames rendered before those that count.
const WARM_UP: u32 = 1;

/// Frames built for each frame that is run: parts of building take about a millisecond and are compared by tenths of it.
const BUILDS: u32 = 4;

/// Results of a measurement. Times are medians, s.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// Time of a whole frame of a still scene: what depends on the water is computed again, but the water takes no step.
    pub frame_s: f64,
    /// Time of a whole frame of an animation: the water's step, its mesh and its upload are in it. `None` for scenes without water.
    pub moving_frame_s: Option<f64>,
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

/// Time from one frame of an animation to the next, s: that of `render --frames`.
const STEP_S: f32 = 1.0 / 24.0;

/// Measures frames of an unchanged scene on all cores, and then frames of an animation if it has water.
///
/// # Errors
/// If a frame cannot be built or run, or the water of an animation stands still.
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
    let moving_frame_s = if scene.water.is_some() { Some(moving(&mut renderer, scene, frames)?) } else { None };
    let (_, built, clock) = &runs[0];
    let of = |time: &dyn Fn(&(f64, TechniqueFrame, Clock)) -> f64| median(runs.iter().map(time).collect());
    let pass = |(k, pass): (usize, &PassCost)| PassCost { seconds: of(&|run| run.2.passes[k].seconds), ..pass.clone() };
    Ok(Cell {
        frame_s: of(&|run| run.0),
        moving_frame_s,
        building_s: (0..built.seconds.len())
            .map(|k| (built.seconds[k].0, median(builds.iter().map(|parts| parts[k].1).collect())))
            .collect(),
        passes: clock.passes.iter().enumerate().map(pass).collect(),
        counters: built.counters.clone(),
    })
}

/// Time of a frame of an animation that starts at the scene's moment, s.
fn moving(renderer: &mut Renderer, scene: &Scene, frames: u32) -> anyhow::Result<f64> {
    let mut before: Option<Arc<Buffer>> = None;
    let mut times = Vec::new();
    for frame in 0..WARM_UP + frames {
        let start = Instant::now();
        let now = scene.at(scene.time_s + frame as f32 * STEP_S)?;
        let built = renderer.run(&now, None)?;
        if frame >= WARM_UP {
            times.push(start.elapsed().as_secs_f64());
        }
        let surface = built.frame.buffers.iter().find(|buffer| buffer.label == SURFACE).map(|buffer| buffer.data.clone());
        ensure!(surface.is_some() && surface != before, "the water of {} stands still at {} s", scene.title, now.time_s);
        before = surface;
    }
    Ok(median(times))
}

/// Label of the buffer with the vertices of the water's surface.
const SURFACE: &str = "water surface";

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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::caustics::TECHNIQUES;

    use super::*;

    fn water(model: &str) -> Scene {
        let text = format!(
            "Scene(title: \"a tank\", image: (width: 8, height: 8), time_s: 1,
            camera: Orthographic(position: (0, 1, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 1),
            lights: [Directional(aim: Along((0, -1, 0)), irradiance: (1, 1, 1))],
            water: (size_m: (1, 1), grid: (9, 9), model: {model}),
            objects: [(shape: Grid(size_m: (1, 1)), transform: (translate: (0, -0.5, 0)))])"
        );
        TECHNIQUES.parse(&text, "tank.ron", Path::new("")).unwrap()
    }

    #[test]
    fn the_water_of_whole_frames_moves() {
        let waves = "Waves([(amplitude_m: 0.01, wavelength_m: 0.5, direction_deg: 20)])";
        let fluid = "PipeFluid(cells: (16, 16), depth_m: 0.3, rain: (rate_per_s: 20, radius_m: 0.1, fall_height_m: 0.1, seed: 1))";
        for model in [waves, fluid] {
            for technique in TECHNIQUES.names() {
                let cell = measure(&water(model), technique, 2).unwrap();
                assert!(cell.moving_frame_s.is_some_and(|seconds| seconds > 0.0), "{technique}, {model}");
            }
        }
        let still = "Waves([(amplitude_m: 0.01, wavelength_m: 0.5, direction_deg: 20, motion: Steady)])";
        for model in ["Flat", still] {
            let refused = measure(&water(model), "caustic-volumes", 1).unwrap_err().to_string();
            assert_eq!(refused, "the water of a tank stands still at 1.0416666 s", "{model}");
        }
    }
}
