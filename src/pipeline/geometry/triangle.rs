//! Setup of triangles of any size, one at a time: clip, cull, set up.

use crate::api::observer::PrimitiveOutcome;
use crate::api::rules::{ClipArithmetic, ClipVolume, DepthPlane};
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::api::state::{FrontFace, PixelRect};
use crate::geometry::clip::clip_triangle;
use crate::geometry::emitter::Emitter;
use crate::geometry::setup::{depth_plane, double_area, edges, interpolation_planes, pixel_bounds};
use crate::primitive::corner::Corner;
use crate::primitive::planes::ZPlane;
use crate::primitive::tile_primitive::{SetupPrimitive, flag};
use crate::primitive::window::outside;
use crate::vendor::outline::{Outline, outline};
use crate::vendor::swiftshader::winds_counter_clockwise;

impl Emitter<'_> {
    /// Sets up a triangle of any size. This is the definition; `small.rs` gives the same bits.
    #[inline(never)]
    pub fn triangle(&mut self, vertices: [u32; 3], id: u32) {
        let codes = vertices.map(|v| self.outcode(v));
        self.out.statistics.clipper_invocations += 1;
        let any = codes[0] | codes[1] | codes[2];
        if any & outside::NAN != 0 || codes[0] & codes[1] & codes[2] & outside::FRUSTUM != 0 {
            self.report(id, None, PrimitiveOutcome::Rejected);
        } else if any & self.view.clip_mask() == 0 {
            self.out.statistics.clipper_primitives_out += 1;
            self.unclipped_triangle(vertices, id);
        } else {
            self.clipped_triangle(vertices, id);
        }
    }

    pub fn unclipped_triangle(&mut self, [a, b, c]: [u32; 3], id: u32) {
        let corners = [self.corner(a), self.corner(b), self.corner(c)];
        self.window_triangle(&corners, &corners, id, false);
    }

    /// Clips a triangle, interpolates the varyings of new corners, and sets up the polygon's triangles.
    fn clipped_triangle(&mut self, vertices: [u32; 3], id: u32) {
        let triangle = vertices.map(|v| self.clip.get(v as usize));
        let (polygon, count) = clip_triangle(&self.view, self.depth_clip(), triangle);
        // Coordinates near the greatest f32 overflow during clipping.
        if count < 3 || polygon[..count].iter().any(|v| !is_finite(v.position)) {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        let corners: Vec<Corner> = polygon[..count]
            .iter()
            .map(|v| {
                let original = v.original.map(|i| vertices[usize::from(i)]);
                let window = original.map_or_else(|| self.view.clipped_vertex(v.position), |i| self.window.get(i as usize));
                Corner { window, varyings: self.mixed_varyings(vertices, v.weights), clip: v.position }
            })
            .collect();
        if self.view.rules.clip_arithmetic == ClipArithmetic::OntoPlane {
            let uncut = vertices.map(|v| self.corner(v));
            let counter_clockwise = winds_counter_clockwise(&uncut);
            let snapped: Vec<[i32; 2]> = corners.iter().map(|c| [c.window.fx, c.window.fy]).collect();
            if let Outline::Rows(rows) = outline(&snapped, counter_clockwise, self.scissor) {
                return self.outlined_triangle(&uncut, &rows, counter_clockwise, id);
            }
        }
        let pieces = if self.view.rules.clip_volume == ClipVolume::GuardBand {
            ears(&corners)
        } else {
            (1..count - 1).map(|k| [0, k, k + 1]).collect()
        };
        for piece in pieces {
            self.out.statistics.clipper_primitives_out += 1;
            let piece = piece.map(|k| corners[k]);
            // SwiftShader computes planes from the corners before clipping, wherever they lie.
            let uncut = self.view.rules.depth_plane == DepthPlane::SwiftShader;
            let planes = if uncut { vertices.map(|v| self.corner(v)) } else { piece };
            self.window_triangle(&piece, &planes, id, true);
        }
    }

    /// Sets up the rows of pixels of a clipped triangle. The planes go through the corners `planes`.
    fn outlined_triangle(&mut self, planes: &[Corner; 3], rows: &[PixelRect], counter_clockwise: bool, id: u32) {
        let front = counter_clockwise == (self.pipeline.desc.primitive.front_face == FrontFace::Ccw);
        if self.is_culled(front) {
            return self.report(id, None, PrimitiveOutcome::Culled);
        }
        if rows.is_empty() {
            return self.report(id, None, PrimitiveOutcome::NoSamples);
        }
        self.out.statistics.clipper_primitives_out += 1;
        self.report(id, None, PrimitiveOutcome::Rasterized { clipped: true, front_facing: front });
        let at = planes.each_ref().map(|c| &c.window);
        let area = double_area(at);
        let mut z = ZPlane::default();
        if self.needs_depth() {
            (z, _) = depth_plane(self.pipeline, at, area, || planes.map(|c| c.clip));
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            let weights = interpolation_planes(self.pipeline.rules.setup_from, at, area);
            let varyings = planes.map(|c| c.varyings);
            self.out.attributes.push(PrimitiveAttributes { varyings, primitive_id: id, front_facing: front, ..weights });
        }
        let flags = flag::ACCEPT | flag::RECT | flag::CLAMP_Z | if front { 0 } else { flag::BACK };
        for row in rows {
            self.insert(SetupPrimitive { z, bounds: (*row).into(), draw: self.draw, attributes, flags, ..SetupPrimitive::default() });
        }
    }

    /// Sets up a triangle. Depth and attributes are interpolated from the corners `planes`: the triangle itself, or the one that it is a piece of.
    fn window_triangle(&mut self, corners: &[Corner; 3], planes: &[Corner; 3], id: u32, clipped: bool) {
        let [w0, w1, w2] = [&corners[0].window, &corners[1].window, &corners[2].window];
        let area = double_area([w0, w1, w2]);
        let at = || Some([[w0.fx, w0.fy], [w1.fx, w1.fy], [w2.fx, w2.fy]]);
        if area == 0 {
            return self.report(id, at(), PrimitiveOutcome::ZeroArea);
        }
        let state = &self.pipeline.desc.primitive;
        let front = (area < 0) == (state.front_face == FrontFace::Ccw);
        if self.is_culled(front) {
            return self.report(id, at(), PrimitiveOutcome::Culled);
        }
        let min = (w0.fx.min(w1.fx).min(w2.fx), w0.fy.min(w1.fy).min(w2.fy));
        let max = (w0.fx.max(w1.fx).max(w2.fx), w0.fy.max(w1.fy).max(w2.fy));
        let Some(bounds) = pixel_bounds(min, max, self.scissor) else {
            return self.report(id, at(), PrimitiveOutcome::NoSamples);
        };
        if self.observer.is_some() {
            self.report(id, at(), PrimitiveOutcome::Rasterized { clipped, front_facing: front });
        }
        let mut flags = if front { 0 } else { flag::BACK };
        // The scissor cuts the triangle's bounds, so coverage must be masked.
        if pixel_bounds(min, max, PixelRect { x0: 0, y0: 0, x1: 1 << 20, y1: 1 << 20 }) != Some(bounds) || min.0 < 0 || min.1 < 0 {
            flags |= flag::RECT;
        }
        let mut z = ZPlane::default();
        if self.needs_depth() {
            let depths = [w0.z, w1.z, w2.z];
            let at = [&planes[0].window, &planes[1].window, &planes[2].window];
            let bias;
            (z, bias) = depth_plane(self.pipeline, at, double_area(at), || planes.map(|c| c.clip));
            let pixels = ((max.0 - min.0) + (max.1 - min.1)) as f32 / 256.0 + z.anchor_slack();
            // The plane of a clipped triangle may have any value at corners that were cut off.
            let uncut = clipped && self.pipeline.rules.depth_plane == DepthPlane::SwiftShader;
            if uncut || z.may_leave(self.view.depth_range, depths, bias, pixels) {
                flags |= flag::CLAMP_Z;
            }
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            let at = [&planes[0].window, &planes[1].window, &planes[2].window];
            let weights = interpolation_planes(self.pipeline.rules.setup_from, at, double_area(at));
            self.out.attributes.push(PrimitiveAttributes {
                varyings: planes.map(|c| c.varyings),
                primitive_id: id,
                front_facing: front,
                ..weights
            });
        }
        let clockwise = if area > 0 { [w0, w1, w2] } else { [w0, w2, w1] };
        self.insert(SetupPrimitive { edges: edges(clockwise), z, bounds: bounds.into(), draw: self.draw, attributes, sequence: 0, flags });
    }
}

pub(crate) fn is_finite(position: [f32; 4]) -> bool {
    position.iter().all(|c| c.is_finite())
}

/// Cuts a clipped polygon into triangles with its own winding, ear by ear.
///
/// The polygon is convex before its corners are snapped. Snapping may dent it by a unit, at an edge that reaches to the guard band; a fan would then
/// reverse a triangle and cover its pixels twice. The ears of the snapped outline cover the polygon exactly once.
fn ears(corners: &[Corner]) -> Vec<[usize; 3]> {
    let area = |a: usize, b: usize, c: usize| double_area([&corners[a].window, &corners[b].window, &corners[c].window]);
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let sign = (1..corners.len() - 1).map(|k| area(0, k, k + 1)).sum::<i64>().signum();
    let mut pieces = Vec::with_capacity(corners.len() - 2);
    while left.len() > 3 {
        let count = left.len();
        let neighbours = |k: usize| (left[(k + count - 1) % count], left[k], left[(k + 1) % count]);
        let is_ear = |k: &usize| {
            let (a, b, c) = neighbours(*k);
            let inside = |q: usize| area(a, b, q) * sign > 0 && area(b, c, q) * sign > 0 && area(c, a, q) * sign >= 0;
            area(a, b, c) * sign >= 0 && !left.iter().any(|&q| q != a && q != b && q != c && inside(q))
        };
        // A self-intersecting outline may have no ear; then the first corner is cut.
        let k = (0..count).find(is_ear).unwrap_or(0);
        let (a, b, c) = neighbours(k);
        pieces.push([a, b, c]);
        left.remove(k);
    }
    pieces.push([left[0], left[1], left[2]]);
    pieces
}
