//! Primitives that WebGPU cannot draw, expanded to triangles, lines and points. The vertex and geometry stages run on the software GPU, sprites and
//! wide lines become triangles, and the driver pulls the vertices from a buffer.

use std::sync::Arc;

use nephroid_pipeline::frame::{Contents, Draw, Frame, FrameError, Pass, stream_draws, target_size};
use nephroid_pipeline::state::{PrimitiveTopology, Viewport};
use nephroid_pipeline::{Device, MAX_POINT_SIZE, PrimitiveClass, StreamOutTarget};

/// Vertices of a draw after the last stage before rasterization.
#[derive(Debug)]
pub(super) struct Pulled {
    /// Topology of the vertices: a list.
    pub topology: PrimitiveTopology,
    /// Whether each vertex ends with its position inside a sprite.
    pub point_coord: bool,
    /// Floats per vertex: clip position (4), varyings, position inside a sprite (2, if `point_coord`).
    pub stride: usize,
    /// The vertices.
    pub data: Vec<f32>,
}

/// Whether a draw cannot run on a driver unchanged: it has a geometry stage, draws points, or draws lines that are not one pixel wide.
pub(super) fn must_be_pulled(frame: &Frame, draw: &Draw) -> bool {
    let desc = &frame.pipelines[draw.pipeline.index()];
    let lines = matches!(desc.primitive.topology, PrimitiveTopology::LineList | PrimitiveTopology::LineStrip);
    // A vertex shader may set any point size, which WGSL cannot express.
    let points = desc.primitive.topology == PrimitiveTopology::PointList;
    desc.program.geometry.is_some() || points || (lines && desc.line_width != 1.0)
}

/// Whether two draws have the same vertices after the last stage before rasterization, because only state behind it differs. Draws that are equal but
/// for this are found; others may not be.
pub(super) fn same_vertices(frame: &Frame, a: &Draw, b: &Draw) -> bool {
    let [of_a, of_b] = [a, b].map(|draw| &frame.pipelines[draw.pipeline.index()]);
    Arc::ptr_eq(&of_a.program, &of_b.program)
        && of_a.primitive == of_b.primitive
        && of_a.line_width == of_b.line_width
        && of_a.vertex_buffers == of_b.vertex_buffers
        && (a.bind_group, a.dynamic_offset, a.index, a.base_vertex, a.streamed)
            == (b.bind_group, b.dynamic_offset, b.index, b.base_vertex, b.streamed)
        && (&a.vertices, &a.instances, &a.vertex_buffers, &a.viewport) == (&b.vertices, &b.instances, &b.vertex_buffers, &b.viewport)
}

/// The vertices of some draws of a pass after the last stage before rasterization.
pub(super) fn pull(device: &Device, frame: &Frame, pass: &Pass, draws: &[Draw], contents: &Contents) -> Result<Vec<Pulled>, FrameError> {
    let streams = stream_draws(device, frame, pass, draws, contents)?;
    Ok(draws.iter().zip(streams).map(|(draw, (class, stream))| expand(frame, pass, draw, class, stream)).collect())
}

/// The streamed vertices of a draw as a list that WebGPU can draw.
fn expand(frame: &Frame, pass: &Pass, draw: &Draw, class: PrimitiveClass, stream: StreamOutTarget) -> Pulled {
    let desc = &frame.pipelines[draw.pipeline.index()];
    let floats = frame.stream_floats(draw.pipeline);
    let size = target_size(frame, pass);
    let viewport = draw.viewport.unwrap_or_else(|| Viewport::full(size.0, size.1));
    let per_pixel = [2.0 / viewport.width, 2.0 / viewport.height];
    let uses_point_coord = desc.program.wgsl.is_some_and(|source| source.contains("point_coord"));
    let as_they_are = |topology| Pulled { topology, point_coord: false, stride: floats, data: Vec::new() };
    match class {
        PrimitiveClass::Triangles => Pulled { data: stream.data, ..as_they_are(PrimitiveTopology::TriangleList) },
        PrimitiveClass::Points if !uses_point_coord && stream.point_sizes.iter().all(|&s| s == 1.0) => {
            Pulled { data: stream.data, ..as_they_are(PrimitiveTopology::PointList) }
        }
        PrimitiveClass::Points => {
            let mut sprites = Pulled {
                point_coord: uses_point_coord,
                stride: floats + if uses_point_coord { 2 } else { 0 },
                ..as_they_are(PrimitiveTopology::TriangleList)
            };
            for (vertex, &size) in stream.data.chunks_exact(floats).zip(&stream.point_sizes) {
                let [z, w] = [vertex[2], vertex[3]];
                let outside = z < 0.0 || z > w;
                if w > 0.0 && (!outside || desc.primitive.unclipped_depth) {
                    sprites.sprite(vertex, size, per_pixel);
                }
            }
            sprites
        }
        PrimitiveClass::Lines if desc.line_width == 1.0 => Pulled { data: stream.data, ..as_they_are(PrimitiveTopology::LineList) },
        PrimitiveClass::Lines => {
            let mut bands = as_they_are(PrimitiveTopology::TriangleList);
            for line in stream.data.chunks_exact(2 * floats) {
                let (a, b) = line.split_at(floats);
                if let Some((a, b)) = in_front_of_the_eye(a, b) {
                    bands.band(&a, &b, desc.line_width, per_pixel);
                }
            }
            bands
        }
    }
}

impl Pulled {
    /// Appends two triangles that cover the square of a sprite. The edge's length is rounded as the software GPU rounds it.
    fn sprite(&mut self, vertex: &[f32], size: f32, per_pixel: [f32; 2]) {
        let half = (size.clamp(1.0 / 128.0, MAX_POINT_SIZE) * 128.0).round_ties_even() / 256.0;
        let w = vertex[3];
        for corner in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let [right, down] = corner.map(|c: f32| (c * 2.0 - 1.0) * half);
            self.data.extend([vertex[0] + right * per_pixel[0] * w, vertex[1] - down * per_pixel[1] * w, vertex[2], w]);
            self.data.extend(&vertex[4..]);
            if self.point_coord {
                self.data.extend(corner);
            }
        }
    }

    /// Appends two triangles that cover the rectangle around a line.
    fn band(&mut self, a: &[f32], b: &[f32], width: f32, per_pixel: [f32; 2]) {
        let place = |v: &[f32]| [0, 1].map(|axis| f64::from(v[axis]) / f64::from(v[3]) / f64::from(per_pixel[axis]));
        let (p, q) = (place(a), place(b));
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        let length = (dx * dx + dy * dy).sqrt();
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let offset = [-dy, dx].map(|d| d / length * f64::from(width) * 0.5);
        // Both triangles start at `a`, which has the line's flat varyings.
        for (end, sign) in [(a, 1.0), (a, -1.0), (b, 1.0), (a, -1.0), (b, -1.0), (b, 1.0)] {
            let moved = [0, 1].map(|axis| end[axis] + (sign * offset[axis]) as f32 * per_pixel[axis] * end[3]);
            self.data.extend([moved[0], moved[1], end[2], end[3]]);
            self.data.extend(&end[4..]);
        }
    }
}

/// The part of a line with z >= 0, where w is positive, too; `None` if there is no such part.
fn in_front_of_the_eye(a: &[f32], b: &[f32]) -> Option<(Vec<f32>, Vec<f32>)> {
    let cut = |inside: &[f32], outside: &[f32]| -> Vec<f32> {
        let t = inside[2] / (inside[2] - outside[2]);
        inside.iter().zip(outside).map(|(i, o)| i + t * (o - i)).collect()
    };
    let (front_a, front_b) = (a[2] >= 0.0, b[2] >= 0.0);
    let ends = match (front_a, front_b) {
        (false, false) => return None,
        (true, true) => (a.to_vec(), b.to_vec()),
        (true, false) => (a.to_vec(), cut(a, b)),
        (false, true) => (cut(b, a), b.to_vec()),
    };
    (ends.0[3] > 0.0 && ends.1[3] > 0.0).then_some(ends)
}
