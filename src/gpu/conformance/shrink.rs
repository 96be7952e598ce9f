//! Reduces a drawing that differs to a minimal one.

use std::fmt;

use serde::Serialize;

use super::drawing::Drawing;
use super::image::{Image, Place};

/// Finds a minimal list of primitives that still differs, by repeated halving (Zeller and Hildebrandt 2002). `differs` is called with subsets, at
/// most `budget` times.
///
/// # Errors
/// The first error of `differs`.
pub fn shrink<E>(count: usize, mut budget: usize, mut differs: impl FnMut(&[usize]) -> Result<bool, E>) -> Result<Vec<usize>, E> {
    let mut left: Vec<usize> = (0..count).collect();
    let mut parts = 2;
    while left.len() > 1 && budget > 0 {
        let size = left.len().div_ceil(parts);
        let chunks: Vec<Vec<usize>> = left.chunks(size).map(<[usize]>::to_vec).collect();
        let others = |skip: usize| chunks.iter().enumerate().filter(|(i, _)| *i != skip).flat_map(|(_, c)| c.iter().copied()).collect();
        let complements: Vec<Vec<usize>> = if parts > 2 { (0..chunks.len()).map(others).collect() } else { Vec::new() };
        let mut smaller = None;
        for (number, subset) in chunks.iter().chain(&complements).enumerate() {
            if budget == 0 {
                break;
            }
            budget -= 1;
            if differs(subset)? {
                smaller = Some((subset.clone(), number < chunks.len()));
                break;
            }
        }
        match smaller {
            Some((subset, is_chunk)) => {
                left = subset;
                parts = if is_chunk { 2 } else { (parts - 1).max(2) };
            }
            None if size == 1 => break,
            None => parts = (parts * 2).min(left.len()),
        }
    }
    Ok(left)
}

/// A difference that can be reproduced by hand.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproducer {
    /// Target width and height.
    pub size: (u32, u32),
    /// Number of the drawing in its case.
    pub drawing: u32,
    /// State of the drawing, in words.
    pub state: String,
    /// Clip position and colour of each vertex.
    pub vertices: Vec<([f32; 4], [f32; 4])>,
    /// Name of the attachment.
    pub attachment: String,
    /// Column and row of the pixel.
    pub pixel: (u32, u32),
    /// Values of the software GPU at the pixel.
    pub expected: Vec<f64>,
    /// Values of the driver at the pixel.
    pub actual: Vec<f64>,
}

impl Reproducer {
    /// Describes the first differing pixel of a drawing.
    #[must_use]
    pub fn new(index: u32, drawing: &Drawing, place: Place, expected: &Image, actual: &Image) -> Self {
        let attachment = expected.attachments.get(place.attachment).map_or("count".to_owned(), |texture| texture.desc().label.clone());
        Self {
            size: drawing.size,
            drawing: index,
            state: state(drawing),
            vertices: drawing.vertices.iter().map(|v| (v.position, v.color)).collect(),
            attachment,
            pixel: (place.x, place.y),
            expected: expected.values(place),
            actual: actual.values(place),
        }
    }
}

/// The relevant state of a drawing, in words.
fn state(drawing: &Drawing) -> String {
    let mut parts = vec![format!("{:?}", drawing.topology)];
    if let Some((format, blend)) = &drawing.color {
        parts.push(format!("color {format:?}"));
        if let Some(blend) = blend {
            for (name, c) in [("color", blend.color), ("alpha", blend.alpha)] {
                parts.push(format!("{name} {:?}(src·{:?}, dst·{:?})", c.operation, c.src_factor, c.dst_factor));
            }
            parts.push(format!("constant {:?}", drawing.blend_constant));
        }
        let c = drawing.clear;
        parts.push(format!("cleared to [{}, {}, {}, {}]", c.r, c.g, c.b, c.a));
    }
    if let Some(depth) = &drawing.depth_stencil {
        parts.push(format!("{:?}, compare {:?}, cleared to {}", depth.format, depth.depth_compare, drawing.clear_depth));
        if depth.bias.is_enabled() {
            parts.push(format!("{:?}", depth.bias));
        }
        if depth.stencil.is_enabled() {
            parts.push(format!("{:?}, reference {}", depth.stencil, drawing.stencil_reference));
        }
    }
    if drawing.line_width != 1.0 {
        parts.push(format!("line width {}", drawing.line_width));
    }
    if drawing.point_size != 1.0 {
        parts.push(format!("point size {}", drawing.point_size));
    }
    parts.join("; ")
}

impl fmt::Display for Reproducer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}x{}; {}", self.size.0, self.size.1, self.state)?;
        for (position, color) in &self.vertices {
            let bits = position.map(|v| format!("{:08x}", v.to_bits())).join(" ");
            writeln!(f, "position {bits} = {position:?}, color {color:?}")?;
        }
        let (x, y) = self.pixel;
        writeln!(f, "{} at ({x}, {y}): software GPU {:?}, driver {:?}", self.attachment, self.expected, self.actual)
    }
}
