//! Calibration probes: minimal drawings that each test one property of a rasterizer.

use serde::Serialize;

use super::drawing::Drawing;
use super::image::{Image, on_driver, on_software};
use super::primitives::{Crossing, RandomNumbers, crossing, push_flat, push_weighted, to_clip};
use super::program::Vertex;
use crate::{Gpu, GpuError};
use nephroid_pipeline::Device;
use nephroid_pipeline::shader::Interpolation;
use nephroid_pipeline::state::{
    ClipVolume, Color, CompareFunction, DepthBiasState, DepthStencilState, PrimitiveTopology, RasterRules, StencilState, TextureFormat,
    Viewport,
};

/// A probe and its results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Probe {
    /// Number of the probe, from 1.
    pub number: u32,
    /// The property that it tests.
    pub name: &'static str,
    /// Result of the driver.
    pub driver: String,
    /// Result of the software GPU under `REFERENCE`.
    pub reference: String,
}

/// The rasterizer that is probed.
struct Asked<'a> {
    /// The driver; `None` for the software GPU.
    gpu: Option<&'a Gpu>,
    device: &'a Device,
    rules: RasterRules,
}

type Question = (&'static str, fn(&Asked<'_>) -> Result<String, GpuError>);

const QUESTIONS: [Question; 12] = [
    ("edges through pixel centres", edges_through_centres),
    ("sub-pixel bits and ties", snapping),
    ("a point at integer coordinates", integer_point),
    ("ends of a line between pixel centres", line_ends),
    ("rounding and overflow of rgba16float", half_floats),
    ("denormal numbers added in r32float", denormals),
    ("unit of depth bias in depth32float", bias_unit),
    ("a fractional viewport", fractional_viewport),
    ("rounding of depth16unorm", depth16),
    ("fragments counted with a depth test", counted),
    ("one corner far outside", far_corner),
    ("planes of attributes", interpolation),
];

/// Runs all probes on a driver and on the software GPU.
///
/// # Errors
/// If the driver cannot draw a probe.
pub fn probes(gpu: &Gpu, device: &Device, rules: &RasterRules) -> Result<Vec<Probe>, GpuError> {
    let driver = Asked { gpu: Some(gpu), device, rules: *rules };
    let reference = Asked { gpu: None, device, rules: RasterRules::REFERENCE };
    let ask = |(i, (name, question)): (usize, &Question)| {
        Ok(Probe { number: i as u32 + 1, name, driver: question(&driver)?, reference: question(&reference)? })
    };
    QUESTIONS.iter().enumerate().map(ask).collect()
}

impl Asked<'_> {
    fn draw(&self, drawing: &Drawing) -> Result<Image, GpuError> {
        match self.gpu {
            Some(gpu) => on_driver(gpu, self.device, drawing, self.rules),
            None => Ok(on_software(self.device, drawing, self.rules)?),
        }
    }
}

const SMALL: (u32, u32) = (8, 8);

/// Two triangles over a rectangle in pixels: x0, y0, x1, y1.
fn rectangle(size: (u32, u32), [x0, y0, x1, y1]: [f32; 4], depth: f32, color: [f32; 4]) -> Vec<Vertex> {
    let corners = [[x0, y0], [x0, y1], [x1, y0], [x1, y0], [x0, y1], [x1, y1]];
    let mut vertices = Vec::new();
    push_flat(&mut vertices, &corners.map(|at| to_clip(size, at, depth, 1.0)), color);
    vertices
}

const WHITE: [f32; 4] = [1.0; 4];
const EVERYWHERE: [f32; 4] = [0.0, 0.0, 8.0, 8.0];

/// First and last column and row of the drawn pixels.
fn extent(image: &Image) -> Option<[u32; 4]> {
    let surface = image.surface(0);
    let lit = |x: &u32, y: &u32| surface.get(*x, *y, 0) != 0.0;
    let all: Vec<(u32, u32)> =
        (0..surface.height).flat_map(|y| (0..surface.width).map(move |x| (x, y))).filter(|(x, y)| lit(x, y)).collect();
    let columns = || all.iter().map(|p| p.0);
    let rows = || all.iter().map(|p| p.1);
    Some([columns().min()?, rows().min()?, columns().max()?, rows().max()?])
}

fn edges_through_centres(asked: &Asked<'_>) -> Result<String, GpuError> {
    let drawing = Drawing::adding(SMALL, rectangle(SMALL, [1.5, 1.5, 5.5, 5.5], 0.5, WHITE));
    let Some([x0, y0, x1, y1]) = extent(&asked.draw(&drawing)?) else { return Ok("nothing drawn".to_owned()) };
    let owned = [("left", x0 == 1), ("top", y0 == 1), ("right", x1 == 5), ("bottom", y1 == 5)];
    let owned: Vec<&str> = owned.iter().filter(|(_, is_owned)| *is_owned).map(|(side, _)| *side).collect();
    Ok(format!("{} edges own their pixels", if owned.is_empty() { "no".to_owned() } else { owned.join(" and ") }))
}

fn snapping(asked: &Asked<'_>) -> Result<String, GpuError> {
    // In each row, the left edge lies a little further to the right of a pixel centre.
    let size = (64, 512);
    let rows = (0..512).map(|k| k as f32);
    let vertices = rows.flat_map(|k| rectangle(size, [32.5 + k / 4096.0, k, 40.0, k + 1.0], 0.5, WHITE)).collect();
    let image = asked.draw(&Drawing::adding(size, vertices))?;
    let Some(last) = (0..512).rev().find(|&row| image.surface(0).get(32, row, 0) != 0.0) else {
        return Ok("not found".to_owned());
    };
    let ties_stay = last.is_power_of_two();
    let half_step = if ties_stay { last } else { last + 1 };
    if !half_step.is_power_of_two() {
        return Ok(format!("a centre is left at {last}/4096 pixel"));
    }
    let bits = 11 - half_step.ilog2();
    // An edge from one and a half steps right of a centre to one step left of it; the centre is half-way.
    let step = 2.0 * half_step as f32 / 4096.0;
    let slanted = [[32.5 + 1.5 * step, 8.5], [32.5 - step, 24.5], [48.0, 8.5]];
    let second = [[48.0, 8.5], [32.5 - step, 24.5], [48.0, 24.5]];
    let mut vertices = Vec::new();
    push_flat(&mut vertices, &[slanted, second].concat().into_iter().map(|at| to_clip((64, 64), at, 0.5, 1.0)).collect::<Vec<_>>(), WHITE);
    let odd_goes_up = asked.draw(&Drawing::adding((64, 64), vertices))?.surface(0).get(32, 16, 0) == 0.0;
    let ties = match (ties_stay, odd_goes_up) {
        (true, true) => "to even",
        (true, false) => "down",
        (false, true) => "up",
        (false, false) => "to odd",
    };
    Ok(format!("{bits} bits, ties {ties}"))
}

fn integer_point(asked: &Asked<'_>) -> Result<String, GpuError> {
    let mut vertices = Vec::new();
    push_flat(&mut vertices, &[to_clip(SMALL, [4.0, 4.0], 0.5, 1.0)], WHITE);
    let drawing = Drawing { topology: PrimitiveTopology::PointList, ..Drawing::adding(SMALL, vertices) };
    let Some([x, y, ..]) = extent(&asked.draw(&drawing)?) else { return Ok("no pixel".to_owned()) };
    Ok(format!("the pixel {} and {}", if x == 3 { "left" } else { "right" }, if y == 3 { "above" } else { "below" }))
}

fn line_ends(asked: &Asked<'_>) -> Result<String, GpuError> {
    let mut ways = Vec::new();
    for (from, to) in [(2.5, 6.5), (6.5, 2.5)] {
        let mut vertices = Vec::new();
        push_flat(&mut vertices, &[from, to].map(|x| to_clip(SMALL, [x, 4.5], 0.5, 1.0)), WHITE);
        let drawing = Drawing { topology: PrimitiveTopology::LineList, ..Drawing::adding(SMALL, vertices) };
        let columns = extent(&asked.draw(&drawing)?).map(|[x0, _, x1, _]| (x0 == 2, x1 == 6));
        ways.push(match columns {
            Some((true, false)) => "the left end's pixel, not the right end's",
            Some((false, true)) => "the right end's pixel, not the left end's",
            Some((true, true)) => "both ends' pixels",
            _ => "neither end's pixel",
        });
    }
    Ok(if ways[0] == ways[1] { format!("{}, both ways", ways[0]) } else { format!("{}; backwards: {}", ways[0], ways[1]) })
}

/// The value of one pixel of a target of this format after a colour is written to it.
fn written(asked: &Asked<'_>, format: TextureFormat, color: [f32; 4]) -> Result<[f32; 4], GpuError> {
    let drawing = Drawing { color: Some((format, None)), ..Drawing::adding(SMALL, rectangle(SMALL, EVERYWHERE, 0.5, color)) };
    let image = asked.draw(&drawing)?;
    Ok([0, 1, 2, 3].map(|channel| image.surface(0).get(3, 3, channel)))
}

fn half_floats(asked: &Asked<'_>) -> Result<String, GpuError> {
    let step = 1.0 / 1024.0;
    let [below, up, tie, odd] =
        written(asked, TextureFormat::Rgba16Float, [1.0 - 0.1 * step, 1.0 + 0.75 * step, 1.0 + 0.5 * step, 1.0 + 1.5 * step])?;
    let rounding = match (below == 1.0, up > 1.0, tie > 1.0, odd > 1.0 + step) {
        (_, false, ..) => "toward zero",
        (true, true, false, true) => "nearest, ties to even",
        (true, true, true, true) => "nearest, ties up",
        _ => "another way",
    };
    let [edge, far, negative, _] = written(asked, TextureFormat::Rgba16Float, [65520.0, 1.0e6, -1.0e6, 0.0])?;
    Ok(format!("{rounding}; 65520, 1e6 and -1e6 become {edge}, {far} and {negative}"))
}

fn denormals(asked: &Asked<'_>) -> Result<String, GpuError> {
    let tiny = 1.0e-40_f32;
    let drawing = Drawing {
        clear: Color { r: tiny.into(), g: 0.0, b: 0.0, a: 0.0 },
        ..Drawing::adding(SMALL, rectangle(SMALL, EVERYWHERE, 0.5, [tiny, 0.0, 0.0, 0.0]))
    };
    let sum = asked.draw(&drawing)?.surface(0).get(3, 3, 0);
    Ok(if sum == tiny + tiny { "kept".to_owned() } else { format!("1e-40 + 1e-40 = {sum:e}") })
}

fn depth_state(format: TextureFormat, bias: DepthBiasState) -> DepthStencilState {
    DepthStencilState {
        format,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::Less),
        stencil: StencilState::default(),
        bias,
    }
}

fn bias_unit(asked: &Asked<'_>) -> Result<String, GpuError> {
    const UNITS: i32 = 1 << 20;
    let triangle = |first: f32, others: f32| {
        let mut vertices = Vec::new();
        push_flat(&mut vertices, &[[0.0, -0.9, first, 1.0], [-0.9, 0.9, others, 1.0], [0.9, 0.9, others, 1.0]], WHITE);
        vertices
    };
    let unit = |vertices: Vec<Vertex>| -> Result<i32, GpuError> {
        let mut depths = [0.0; 2];
        for (depth, constant) in depths.iter_mut().zip([0, UNITS]) {
            let bias = DepthBiasState { constant, slope_scale: 0.0, clamp: 0.0 };
            let state = depth_state(TextureFormat::Depth32Float, bias);
            let drawing = Drawing { depth_stencil: Some(state), color: None, ..Drawing::adding((64, 64), vertices.clone()) };
            *depth = f64::from(asked.draw(&drawing)?.surface(0).get(32, 32, 0));
        }
        Ok(libm::round(libm::log2((depths[1] - depths[0]) / f64::from(UNITS))) as i32)
    };
    let (flat, tilted) = (unit(triangle(0.25, 0.25))?, unit(triangle(0.45, 0.85))?);
    Ok(format!("at depth 0.25: 2^{flat}; from 0.45 to 0.85: 2^{tilted}"))
}

fn fractional_viewport(asked: &Asked<'_>) -> Result<String, GpuError> {
    let viewport = Viewport { x: 1.75, y: 1.75, width: 3.5, height: 3.5, min_depth: 0.0, max_depth: 1.0 };
    let drawing = Drawing { viewport: Some(viewport), ..Drawing::adding(SMALL, rectangle(SMALL, EVERYWHERE, 0.5, WHITE)) };
    Ok(match extent(&asked.draw(&drawing)?) {
        Some([2, 2, 4, 4]) => "taken as it is".to_owned(),
        Some([x0, y0, x1, y1]) => format!("columns {x0} to {x1}, rows {y0} to {y1}, not 2 to 4"),
        None => "nothing drawn".to_owned(),
    })
}

fn depth16(asked: &Asked<'_>) -> Result<String, GpuError> {
    let numbers = [100.25, 100.5, 101.5, 100.75];
    let rectangles = numbers.iter().zip(0u8..).map(|(n, k)| {
        let left = f32::from(k) * 2.0;
        rectangle(SMALL, [left, 0.0, left + 2.0, 8.0], n / 65535.0, WHITE)
    });
    let state = depth_state(TextureFormat::Depth16Unorm, DepthBiasState::default());
    let drawing = Drawing { depth_stencil: Some(state), color: None, ..Drawing::adding(SMALL, rectangles.flatten().collect()) };
    let image = asked.draw(&drawing)?;
    let stored: Vec<String> = (0..4).map(|k| image.surface(0).get(2 * k, 4, 0).to_string()).collect();
    Ok(format!("{numbers:?} become [{}]", stored.join(", ")))
}

fn counted(asked: &Asked<'_>) -> Result<String, GpuError> {
    // 25 pixels in front, then 49 pixels behind, of which 25 are hidden.
    let mut vertices = rectangle(SMALL, [0.0, 0.0, 5.0, 5.0], 0.25, WHITE);
    vertices.extend(rectangle(SMALL, [0.0, 0.0, 7.0, 7.0], 0.5, WHITE));
    let state = depth_state(TextureFormat::Depth32Float, DepthBiasState::default());
    let drawing = Drawing { depth_stencil: Some(state), query: true, ..Drawing::adding(SMALL, vertices) };
    let count = asked.draw(&drawing)?.count.unwrap_or(0);
    let how = if asked.gpu.is_some() { ", by an additive target (WebGPU's queries only tell none from some)" } else { "" };
    Ok(format!("{count} of 49{how}"))
}

fn far_corner(asked: &Asked<'_>) -> Result<String, GpuError> {
    let mut source = RandomNumbers::new(11, 0);
    let mut vertices = Vec::new();
    for _ in 0..1000 {
        let mut corners = crossing(Crossing::Sides(0.9), &mut source);
        let [far, ..] = crossing(Crossing::Sides(50.0), &mut source);
        corners[0] = far;
        push_weighted(&mut vertices, &mut source, &corners);
    }
    let drawing = Drawing::adding((64, 64), vertices);
    let image = asked.draw(&drawing)?;
    let mut differing = [0; 2];
    for (count, clip_volume) in differing.iter_mut().zip([ClipVolume::Frustum, ClipVolume::GuardBand]) {
        let rules = RasterRules { clip_volume, ..asked.rules };
        *count = on_software(asked.device, &drawing, rules)?.differing(&image, 0.0).len();
    }
    Ok(match differing {
        [0, band] => format!("cut at the frustum; of 4096 pixels, {band} would differ with a guard band"),
        [frustum, 0] => format!("guard band; of 4096 pixels, {frustum} would differ if cut at the frustum"),
        [frustum, band] => format!("of 4096 pixels {frustum} differ from cutting at the frustum, {band} from a guard band"),
    })
}

fn interpolation(asked: &Asked<'_>) -> Result<String, GpuError> {
    let size = (64, 64);
    let off = 0.49 / f32::from(1u16 << asked.rules.subpixel_bits);
    let corners = [([10.0, 10.0], 1.0), ([14.0, 10.0], 2.0), ([10.0, 14.0], 1.0)];
    let vertices = corners.map(|(at, value): ([f32; 2], f32)| {
        let position = to_clip(size, at.map(|v| v + off), 0.5, 1.0);
        Vertex { position, color: [value, 0.0, 0.0, 0.0] }
    });
    let drawing = Drawing { interpolation: Interpolation::Linear, ..Drawing::adding(size, vertices.to_vec()) };
    let value = f64::from(asked.draw(&drawing)?.surface(0).get(11, 11, 0));
    let snapped = 1.0 + 1.5 / 4.0;
    let unsnapped = 1.0 + (1.5 - f64::from(off)) / 4.0;
    let (to_snapped, to_unsnapped) = ((value - snapped).abs(), (value - unsnapped).abs());
    Ok(format!("through {} corners", if to_snapped < to_unsnapped { "snapped" } else { "unsnapped" }))
}
