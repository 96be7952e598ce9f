//! Setup of lines with width, one at a time.

use crate::api::observer::PrimitiveOutcome;
use crate::api::rules::{LineCorners, ViewportArithmetic};
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::geometry::clip::clip_line;
use crate::geometry::emitter::Emitter;
use crate::geometry::setup::{depth_plane, double_area, edges, interpolation_planes, pixel_bounds};
use crate::geometry::triangle::is_finite;
use crate::primitive::corner::Corner;
use crate::primitive::planes::ZPlane;
use crate::primitive::tile_primitive::{SetupPrimitive, flag};
use crate::primitive::window::{HALF, ONE, WindowVertex, outside};

impl Emitter<'_> {
    /// Sets up a line as two triangles: the rectangle of the line's width around the segment, with snapped corners [Vulkan spec, strict lines].
    pub fn line(&mut self, vertices: [u32; 2], id: u32) {
        let codes = vertices.map(|v| self.outcode(v));
        self.out.statistics.clipper_invocations += 1;
        let any = codes[0] | codes[1];
        if any & outside::NAN != 0 || codes[0] & codes[1] & outside::FRUSTUM != 0 {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        let ends = if any & self.view.clip_mask() == 0 {
            vertices.map(|v| self.corner(v))
        } else {
            let clipped = clip_line(&self.view, self.depth_clip(), vertices.map(|v| self.clip.get(v as usize)));
            let Some(clipped) = clipped.filter(|ends| ends.iter().all(|v| is_finite(v.position))) else {
                return self.report(id, None, PrimitiveOutcome::Rejected);
            };
            clipped.map(|v| match v.original {
                Some(i) => self.corner(vertices[usize::from(i)]),
                None => Corner {
                    window: self.view.clipped_vertex(v.position),
                    varyings: self.mixed_varyings([vertices[0], vertices[1], vertices[1]], v.weights),
                    clip: v.position,
                },
            })
        };
        self.out.statistics.clipper_primitives_out += 1;
        let position = |w: &WindowVertex| match self.pipeline.rules.line_corners {
            LineCorners::UnsnappedEnds => [f64::from(w.x), f64::from(w.y)],
            LineCorners::SnappedEnds => [f64::from(w.fx) / 256.0, f64::from(w.fy) / 256.0],
        };
        let (p, q) = (position(&ends[0].window), position(&ends[1].window));
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        let length = (dx * dx + dy * dy).sqrt();
        // A NaN length has no direction, either.
        if length.is_nan() || length <= 0.0 {
            return self.report(id, None, PrimitiveOutcome::ZeroArea);
        }
        let half_width = f64::from(self.pipeline.desc.line_width) * 0.5;
        let offset = [-dy / length * half_width, dx / length * half_width];
        let units = f64::from(1u32 << self.pipeline.rules.subpixel_bits);
        let coarse = ONE >> self.pipeline.rules.subpixel_bits;
        let corner = |end: &Corner, sign: f64| {
            let at = position(&end.window);
            let place = [0, 1].map(|axis| at[axis] + sign * offset[axis]);
            let snap = |v: f64| {
                if self.pipeline.rules.viewport == ViewportArithmetic::Prescaled {
                    ((v - 0.5) * units).round_ties_even() as i32 * coarse + HALF
                } else {
                    (v * units).round_ties_even() as i32 * coarse
                }
            };
            let window = WindowVertex { fx: snap(place[0]), fy: snap(place[1]), x: place[0] as f32, y: place[1] as f32, ..end.window };
            Corner { window, ..*end }
        };
        let quad = [corner(&ends[0], 1.0), corner(&ends[0], -1.0), corner(&ends[1], 1.0), corner(&ends[1], -1.0)];
        self.line_half([quad[0], quad[1], quad[2]], id);
        self.line_half([quad[1], quad[3], quad[2]], id);
    }

    /// Sets up one triangle of a line. It is always front-facing and never culled.
    fn line_half(&mut self, corners: [Corner; 3], id: u32) {
        let [w0, w1, w2] = [&corners[0].window, &corners[1].window, &corners[2].window];
        let area = double_area([w0, w1, w2]);
        let at = || Some([[w0.fx, w0.fy], [w1.fx, w1.fy], [w2.fx, w2.fy]]);
        if area == 0 {
            return self.report(id, at(), PrimitiveOutcome::ZeroArea);
        }
        let min = (w0.fx.min(w1.fx).min(w2.fx), w0.fy.min(w1.fy).min(w2.fy));
        let max = (w0.fx.max(w1.fx).max(w2.fx), w0.fy.max(w1.fy).max(w2.fy));
        let Some(bounds) = pixel_bounds(min, max, self.scissor) else {
            return self.report(id, at(), PrimitiveOutcome::NoSamples);
        };
        if self.observer.is_some() {
            self.report(id, at(), PrimitiveOutcome::Rasterized { clipped: false, front_facing: true });
        }
        let mut z = ZPlane::default();
        if self.needs_depth() {
            (z, _) = depth_plane(self.pipeline, [w0, w1, w2], area, || corners.map(|c| c.clip));
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            let planes = interpolation_planes(self.pipeline.rules.setup_from, [w0, w1, w2], area);
            let varyings = corners.map(|c| c.varyings);
            self.out.attributes.push(PrimitiveAttributes { varyings, primitive_id: id, front_facing: true, ..planes });
        }
        let clockwise = if area > 0 { [w0, w1, w2] } else { [w0, w2, w1] };
        let flags = flag::CLAMP_Z | flag::RECT;
        self.insert(SetupPrimitive { edges: edges(clockwise), z, bounds: bounds.into(), draw: self.draw, attributes, sequence: 0, flags });
    }
}
