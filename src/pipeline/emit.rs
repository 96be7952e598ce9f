//! The end of the geometry phase: assembled primitives become binned records, one at a time.
//!
//! Everything is handled here; small primitives take a shorter way (`small.rs`).

use nephroid_math::lanes::Lanes;

use super::bins::{Prepared, flag};
use super::chunk::ChunkOutput;
use super::clip::{clip_line, clip_triangle};
use super::depth_bias::{depth_bias, greatest_exponent};
use super::observer::{Observer, PrimitiveEvent, PrimitiveOutcome};
use super::outline::{Outline, outline};
use super::render_pipeline::{MAX_POINT_SIZE, RenderPipeline};
use super::setup::{ZPlane, depth_plane, double_area, edges, interpolation_planes, pixel_bounds};
use super::shader::{Interpolation, PrimitiveAttributes};
use super::state::{ClipArithmetic, ClipVolume, DepthPlane, Face, FrontFace, LineCorners, PixelRect};
use super::vertices::{ClipVertices, WindowVertices};
use super::viewport::{GUARD_PX, HALF, ONE, ViewTransform, WindowVertex, outside};

/// Turns assembled primitives into binned records.
pub(super) struct Emitter<'a> {
    pub draw: u32,
    pub instance: u32,
    pub pipeline: &'a RenderPipeline,
    pub view: ViewTransform,
    /// Pixels that the draw may change.
    pub scissor: PixelRect,
    /// Where the part's varyings start in the chunk's.
    pub varying_base: u32,
    pub clip: &'a ClipVertices,
    pub window: &'a WindowVertices,
    pub out: &'a mut ChunkOutput,
    pub observer: Option<&'a mut dyn Observer>,
}

/// A corner after clipping: where it is and where its varyings start.
#[derive(Clone, Copy)]
struct Corner {
    window: WindowVertex,
    varyings: u32,
    clip: [f32; 4],
}

impl Emitter<'_> {
    pub fn report(&mut self, id: u32, corners: Option<[[i32; 2]; 3]>, outcome: PrimitiveOutcome) {
        let statistics = &mut self.out.statistics;
        match outcome {
            PrimitiveOutcome::Rejected => statistics.primitives_rejected += 1,
            PrimitiveOutcome::Culled => statistics.primitives_culled += 1,
            PrimitiveOutcome::ZeroArea => statistics.primitives_zero_area += 1,
            PrimitiveOutcome::NoSamples => statistics.primitives_without_samples += 1,
            PrimitiveOutcome::Rasterized { .. } => {}
        }
        if let Some(observer) = self.observer.as_deref_mut() {
            let event = PrimitiveEvent { draw: self.draw, instance: self.instance, primitive_id: id, corners_fx: corners, outcome };
            observer.primitive(event);
        }
    }

    #[inline(always)]
    pub fn varyings_of(&self, vertex: u32) -> u32 {
        self.varying_base + vertex * self.pipeline.interpolation.len() as u32
    }

    fn corner(&self, vertex: u32) -> Corner {
        let v = vertex as usize;
        Corner { window: self.window.get(v), varyings: self.varyings_of(vertex), clip: self.clip.get(v) }
    }

    fn outcode(&self, vertex: u32) -> u8 {
        self.window.outcode(vertex as usize)
    }

    /// A triangle of any size: the definition that `small.rs` follows.
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

    /// Clips, gives every new corner its varyings, and draws the polygon as a fan.
    fn clipped_triangle(&mut self, vertices: [u32; 3], id: u32) {
        let triangle = vertices.map(|v| self.clip.get(v as usize));
        let (polygon, count) = clip_triangle(&self.view, self.depth_clip(), triangle);
        // Coordinates near the greatest f32 overflow on the way.
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
            // SwiftShader lays its planes through the corners before clipping, wherever those are.
            let uncut = self.view.rules.depth_plane == DepthPlane::SwiftShader;
            let planes = if uncut { vertices.map(|v| self.corner(v)) } else { piece };
            self.window_triangle(&piece, &planes, id, true);
        }
    }

    /// Rows of pixels of a triangle whose planes go through these corners.
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
            self.insert(Prepared { z, bounds: (*row).into(), draw: self.draw, attributes, flags, ..Prepared::default() });
        }
    }

    fn is_culled(&self, front: bool) -> bool {
        match self.pipeline.desc.primitive.cull_mode {
            Some(Face::Front) => front,
            Some(Face::Back) => !front,
            None => false,
        }
    }

    /// Appends the varyings of a vertex that clipping made; flat ones stay the provoking vertex's.
    fn mixed_varyings(&mut self, vertices: [u32; 3], weights: [f32; 3]) -> u32 {
        if !self.pipeline.fragment.attributes {
            return 0;
        }
        let start = self.out.varyings.len() as u32;
        let bases = vertices.map(|v| self.varyings_of(v) as usize);
        for (k, mode) in self.pipeline.interpolation.iter().enumerate() {
            let f = bases.map(|base| self.out.varyings[base + k]);
            let mixed = match mode {
                Interpolation::Flat => f[0],
                _ => weights[0] * f[0] + weights[1] * f[1] + weights[2] * f[2],
            };
            self.out.varyings.push(mixed);
        }
        start
    }

    /// A triangle with what it is interpolated from: depth and attributes at the corners `planes`, itself or what it is a piece of.
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
        // The scissor cuts inside the triangle's own bounds: coverage must be masked.
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
            // The plane of a triangle that was cut may be anything where the corners are that are gone.
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
        self.insert(Prepared { edges: edges(clockwise), z, bounds: bounds.into(), draw: self.draw, attributes, sequence: 0, flags });
    }

    fn depth_clip(&self) -> bool {
        !self.pipeline.desc.primitive.unclipped_depth
    }

    fn insert(&mut self, mut primitive: Prepared) {
        primitive.sequence = self.out.sequence;
        self.out.sequence += 1;
        primitive.flags |= (u32::from(primitive.z.sixteenths[0]) | u32::from(primitive.z.sixteenths[1]) << 4) << flag::SIXTEENTHS;
        primitive.flags |= u32::from(primitive.z.bias_exponent) << flag::BIAS_EXPONENT;
        self.out.bins.insert(&primitive);
    }

    pub fn needs_depth(&self) -> bool {
        self.pipeline.depth.tests_depth() || self.pipeline.fragment.attributes || self.observer.is_some()
    }

    /// The bias of a triangle of this slope whose depths at the vertices are `z`.
    pub fn depth_bias(&self, slope: f32, z: [f32; 3]) -> f32 {
        depth_bias(self.pipeline, slope, greatest_exponent(z))
    }

    /// A point sprite: the square of its size around the snapped centre, by the triangle's fill rule [D3D11.3 §3.4.6].
    pub fn point(&mut self, vertex: u32, id: u32) {
        let (code, size) = (self.outcode(vertex), self.clip.point_size(vertex as usize));
        self.out.statistics.clipper_invocations += 1;
        // Sprites are clipped by their centre, against depth alone.
        if code & (outside::NAN | self.view.point_clip_mask()) != 0 {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        self.out.statistics.clipper_primitives_out += 1;
        let corner = self.corner(vertex);
        let w = corner.window;
        let half = half_size(size) as i32;
        let at = Some([[w.fx, w.fy]; 3]);
        let Some(bounds) = pixel_bounds_half_open((w.fx - half, w.fy - half), (w.fx + half, w.fy + half), self.scissor) else {
            return self.report(id, at, PrimitiveOutcome::NoSamples);
        };
        if self.observer.is_some() {
            self.report(id, at, PrimitiveOutcome::Rasterized { clipped: false, front_facing: true });
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            self.push_sprite(vertex, half, id);
        }
        self.insert(Prepared {
            z: ZPlane::flat(w.z),
            bounds: bounds.into(),
            draw: self.draw,
            attributes,
            flags: flag::ACCEPT | flag::RECT | flag::CLAMP_Z,
            ..Prepared::default()
        });
    }

    /// Interpolation data of a sprite that reaches `half` (1/256 pixel) around its centre.
    #[inline(always)]
    pub fn push_sprite(&mut self, vertex: u32, half: i32, id: u32) {
        let w = self.window.get(vertex as usize);
        let per_pixel = ONE as f32 / (2 * half) as f32;
        let (column, row) = (w.fx >> 8, w.fy >> 8);
        let start = |pixel: i32, centre: i32| ((pixel << 8) + HALF - (centre - half)) as f32 / (2 * half) as f32;
        self.out.attributes.push(PrimitiveAttributes {
            anchor: [column as f32, row as f32],
            l1: [start(column, w.fx), per_pixel, 0.0],
            l2: [start(row, w.fy), 0.0, per_pixel],
            inv_w: [w.inv_w; 3],
            varyings: [self.varyings_of(vertex); 3],
            primitive_id: id,
            front_facing: true,
            is_point: true,
        });
    }

    /// A line: the rectangle of its width around the segment, corners snapped, as two triangles [Vulkan spec, strict lines].
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
        // Not-a-number has no direction either.
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
                if self.pipeline.rules.viewport == super::state::ViewportArithmetic::Prescaled {
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

    /// One triangle of a line: like any other, but always in front and never culled.
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
        self.insert(Prepared { edges: edges(clockwise), z, bounds: bounds.into(), draw: self.draw, attributes, sequence: 0, flags });
    }
}

impl ZPlane {
    /// How far the anchor may be from the vertices it was made from: nothing, unless it is the target's origin.
    pub fn anchor_slack(&self) -> f32 {
        if self.at_origin { 32768.0 } else { 2.0 }
    }
}

/// Half the edge of a sprite in 1/256 pixel, a whole number; not-a-number becomes the least size.
#[inline(always)]
pub(super) fn half_size<L: Lanes>(size: L) -> L {
    let size = L::select(size.equals(size), size, size.like(0.0));
    (Lanes::clamp(size, 1.0 / 128.0, MAX_POINT_SIZE) * HALF as f32).round_ties_even()
}

/// Whether a triangle is counter-clockwise on the screen before it is clipped, as SwiftShader finds out: from the sign of its snapped area
/// in f32, turned over for each corner behind the eye.
fn winds_counter_clockwise(corners: &[Corner; 3]) -> bool {
    let sixteenths = |fx: i32, pixels: f32| {
        // Far outside only the unsnapped position is known.
        if pixels.abs() < GUARD_PX { ((fx - HALF) >> 4) as f32 } else { ((pixels - 0.5) * 16.0).round_ties_even() }
    };
    let [[x0, y0], [x1, y1], [x2, y2]] = corners.map(|c| [sixteenths(c.window.fx, c.window.x), sixteenths(c.window.fy, c.window.y)]);
    let area = (y0 - y2) * x1 + (y2 - y1) * x0 + (y1 - y0) * x2;
    let turned = corners.iter().filter(|c| c.clip[3].is_sign_negative()).count() % 2 == 1;
    if turned { area < 0.0 } else { area > 0.0 }
}

fn is_finite(position: [f32; 4]) -> bool {
    position.iter().all(|c| c.is_finite())
}

/// [`pixel_bounds`] of a rectangle that does not own its right and lower edges.
fn pixel_bounds_half_open(min: (i32, i32), max: (i32, i32), scissor: PixelRect) -> Option<PixelRect> {
    pixel_bounds(min, (max.0 - 1, max.1 - 1), scissor)
}

/// Cuts a clipped polygon into triangles that all wind like it, by cutting off ears.
///
/// The polygon is convex before its corners are snapped and may be dented by a unit after, over an edge that reaches to the guard band: a fan
/// would then turn a triangle inside out and cover its pixels again. Ears of the snapped outline tile it exactly.
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
        // An outline that crosses itself has no ear left; what remains is cut anyhow.
        let k = (0..count).find(is_ear).unwrap_or(0);
        let (a, b, c) = neighbours(k);
        pieces.push([a, b, c]);
        left.remove(k);
    }
    pieces.push([left[0], left[1], left[2]]);
    pieces
}
