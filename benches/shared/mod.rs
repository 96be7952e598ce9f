//! What both benchmarks measure: triangles at random places, the paper's frames, medians.

use std::sync::Arc;
use std::time::Instant;

use nephroid::caustics::caustic_volumes::{CausticVolumes, Faces};
use nephroid::frame::{Contents, FrameObserver, Pass};
use nephroid::math::lanes::Lanes;
use nephroid::math::rng::uniform3;
use nephroid::math::vector::v4;
use nephroid::pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program, VertexInput, VertexOutput, VertexShader};
use nephroid::pipeline::{BindingKind, Bindings, Observer, PassOutput};
use nephroid::scene::Scene;

pub const SIZE: (u32, u32) = (1024, 768);
pub const FRAMES: usize = 12;

struct Clip;
impl VertexShader for Clip {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let vertices: &[[f32; 4]] = bindings.storage(0);
        output.position = input.per_vertex4(|i| vertices[i as usize]);
        output.point_size = output.position.x.like(3.0);
    }
}

struct Constant;
impl FragmentShader for Constant {
    const PER_PRIMITIVE: bool = true;
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let c = L::splat(input.token, 1.0 / 256.0);
        output.color[0] = v4(c, c, c, c);
    }
}

const TWIN: &str = "
@group(0) @binding(0) var<storage, read> positions: array<vec4<f32>>;

@vertex
fn vs(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return positions[index];
}

@fragment
fn fs() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0 / 256.0);
}
";

/// Positions from a buffer, points of three pixels, one colour.
pub fn program(fragment: bool) -> Arc<Program> {
    let mut program = Program { bindings: vec![BindingKind::Storage(16)], wgsl: Some(TWIN), ..Program::new("bench", Clip, Constant) };
    if !fragment {
        program.fragment = None;
    }
    Arc::new(program)
}

/// Clip positions of triangles of about `pixels` pixels at random places and depths, or of points.
pub fn triangles(size: (u32, u32), count: u32, pixels: f32, corners: u32) -> Vec<[f32; 4]> {
    let side = (pixels * 4.0 / 3.0_f32.sqrt()).sqrt();
    let mut data = Vec::with_capacity((count * corners) as usize);
    for i in 0..count {
        let [x, y, z] = uniform3(1, 0, i);
        let (cx, cy) = (x * size.0 as f32, y * size.1 as f32);
        for [dx, dy] in [[-0.5, 0.29], [0.5, 0.29], [0.0, -0.58]].iter().take(corners as usize) {
            let (px, py) = (cx + dx * side, cy + dy * side);
            data.push([px / size.0 as f32 * 2.0 - 1.0, 1.0 - py / size.1 as f32 * 2.0, z, 1.0_f32]);
        }
    }
    data
}

pub fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Whether the command line asks for a benchmark: it names a part of it, or nothing.
pub fn wanted(name: &str) -> bool {
    let mut filters = std::env::args().skip(1).filter(|a| !a.starts_with('-')).peekable();
    filters.peek().is_none() || filters.any(|f| name.contains(&f))
}

/// Seconds per pass of a frame, in order.
#[derive(Default)]
pub struct PassClock {
    begun: Option<Instant>,
    pub seconds: Vec<(String, f64)>,
}

impl FrameObserver for PassClock {
    fn pass_begin(&mut self, _index: usize, _pass: &Pass) -> Option<&mut dyn Observer> {
        self.begun = Some(Instant::now());
        None
    }
    fn pass_end(&mut self, _index: usize, pass: &Pass, _contents: &Contents, _output: &PassOutput) {
        let seconds = self.begun.map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        self.seconds.push((pass.label.clone(), seconds));
    }
}

/// A frame of the paper and what its authors measured on their fastest machine.
pub struct PaperFrame {
    pub name: &'static str,
    pub scene: &'static str,
    /// Objects of the scene that are kept.
    pub objects: usize,
    pub grid: u32,
    pub size: u32,
    pub paper: &'static str,
}

pub const PAPER_FRAMES: [PaperFrame; 5] = [
    PaperFrame { name: "figure 4: empty pool", scene: "scenes/pots.ron", objects: 1, grid: 64, size: 512, paper: "31 ms" },
    PaperFrame { name: "the same pool", scene: "scenes/pots.ron", objects: 1, grid: 128, size: 1024, paper: "not given" },
    PaperFrame { name: "figure 7: pots", scene: "scenes/pots.ron", objects: usize::MAX, grid: 128, size: 512, paper: "not given" },
    PaperFrame { name: "figure 3: columns", scene: "scenes/columns.ron", objects: usize::MAX, grid: 128, size: 512, paper: "116 ms" },
    PaperFrame { name: "figure 3: columns", scene: "scenes/columns.ron", objects: usize::MAX, grid: 128, size: 1024, paper: "333 ms" },
];

/// A shipped scene with the paper's settings. Which faces are drawn changes the cost and not the picture; the paper draws those in front.
pub fn paper_scene(path: &str, grid: u32, size: u32) -> Scene {
    let mut scene = nephroid::caustics::TECHNIQUES.load(std::path::Path::new(path)).expect("a shipped scene");
    scene.image.width = size;
    scene.image.height = size;
    *scene.techniques.edit::<CausticVolumes>() =
        CausticVolumes { grid: Some((grid + 1, grid + 1)), faces: Faces::Back, ..CausticVolumes::PAPER };
    scene
}
