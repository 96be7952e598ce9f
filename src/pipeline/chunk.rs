//! The geometry phase: one chunk of primitives from index fetch to bins. Chunks are independent and run in parallel.

use super::assemble::Assembly;
use super::bindings::Bindings;
use super::bins::{Bins, Prepared, flag};
use super::clip::{clip_line, clip_triangle};
use super::fetch::fetch_attributes;
use super::observer::{Observer, PrimitiveEvent, PrimitiveOutcome};
use super::pass::Draw;
use super::render_pipeline::{MAX_POINT_SIZE, PrimitiveClass, RenderPipeline};
use super::setup::{ZPlane, depth_plane, double_area, edges, interpolation_planes, max_slope, pixel_bounds};
use super::shader::{Execution, GeometryInput, GeometryOutput, Interpolation, PrimitiveAttributes, StageVertex, VertexBatch};
use super::state::{ClipVolume, Face, FrontFace, GeometryTopology, LineCorners, PixelRect};
use super::statistics::PipelineStatistics;
use super::viewport::{HALF, ONE, ViewTransform, WindowVertex, outside};

/// A run of primitives of one instance of one draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub draw: u32,
    pub instance: u32,
    pub first: u32,
    pub count: u32,
}

/// What the geometry phase needs to know of the pass.
pub(super) struct ChunkContext<'a> {
    pub draws: &'a [Draw<'a>],
    pub assemblies: &'a [Assembly],
    pub execution: Execution,
    pub target: PixelRect,
    pub tiles_x: usize,
    pub tile_count: usize,
}

/// What a chunk hands to the tiles, and its own scratch. Kept between frames, because fresh pages are dear.
#[derive(Default)]
pub(super) struct ChunkOutput {
    pub bins: Bins,
    pub attributes: Vec<PrimitiveAttributes>,
    pub varyings: Vec<f32>,
    pub statistics: PipelineStatistics,
    /// Streamed primitives in order: the draw, then its vertices as floats.
    pub stream: Vec<(u32, Vec<f32>)>,
    sequence: u32,
    scratch: Scratch,
}

impl ChunkOutput {
    /// Bytes that stay until the tiles have run.
    pub fn bytes(&self) -> usize {
        self.bins.bytes() + self.attributes.len() * size_of::<PrimitiveAttributes>() + self.varyings.len() * 4
    }
}

/// Vertices of one part on their way through the stages.
#[derive(Default)]
struct Scratch {
    vertex_index: Vec<u32>,
    primitives: Vec<[u32; 3]>,
    attributes: Vec<f32>,
    positions: Vec<[f32; 4]>,
    point_sizes: Vec<f32>,
    varyings: Vec<f32>,
    emitted: Vec<([f32; 4], f32)>,
    emitted_varyings: Vec<f32>,
    strips: Vec<u32>,
    emitted_from: Vec<u32>,
    outcodes: Vec<u8>,
    window: Vec<WindowVertex>,
    /// Index to vertex of the part: direct-mapped, (index, slot).
    cache: Vec<(u32, u32)>,
}

/// Entries of the vertex cache. Two indices that collide are shaded twice; the result is the same.
const CACHE: usize = 4096;

/// Runs a chunk.
pub(super) fn process_chunk(context: &ChunkContext<'_>, parts: &[Part], out: &mut ChunkOutput, mut observer: Option<&mut dyn Observer>) {
    out.bins.reset(context.tiles_x, context.tile_count);
    out.attributes.clear();
    out.varyings.clear();
    out.stream.clear();
    out.statistics = PipelineStatistics::default();
    out.sequence = 0;
    let mut scratch = std::mem::take(&mut out.scratch);
    for part in parts {
        process_part(context, part, out, &mut scratch, &mut observer);
    }
    out.scratch = scratch;
}

fn process_part(
    context: &ChunkContext<'_>,
    part: &Part,
    out: &mut ChunkOutput,
    scratch: &mut Scratch,
    observer: &mut Option<&mut dyn Observer>,
) {
    let draw = &context.draws[part.draw as usize];
    let pipeline = draw.pipeline;
    let assembly = &context.assemblies[part.draw as usize];
    gather_vertices(draw, assembly, part, scratch);
    shade_vertices(context, draw, part, scratch, &mut out.statistics);
    if let Some(observer) = observer.as_deref_mut() {
        let s = &*scratch;
        observer.vertices(part.draw, part.instance, &s.vertex_index, &s.positions, &s.varyings, pipeline.vertex_scalars);
    }
    let has_ids = pipeline.desc.program.geometry.is_some();
    if has_ids {
        run_geometry_stage(draw, part, scratch, &mut out.statistics, observer);
    }
    if draw.stream_out.is_some() {
        stream_out(pipeline, part.draw, scratch, out);
    }
    if pipeline.desc.rasterizer_discard {
        return;
    }
    let view = ViewTransform::new(&draw.viewport, pipeline.rules, pipeline.desc.primitive.unclipped_depth);
    scratch.outcodes.clear();
    scratch.window.clear();
    for position in &scratch.positions {
        scratch.outcodes.push(view.outcode(*position));
        scratch.window.push(view.window_vertex(*position, false));
    }
    let scalars = pipeline.interpolation.len();
    let varying_base = out.varyings.len() as u32;
    if pipeline.fragment.attributes {
        out.varyings.extend_from_slice(&scratch.varyings);
    }
    let mut emitter = Emitter {
        draw: part.draw,
        instance: part.instance,
        pipeline,
        view,
        scissor: draw.scissor.intersect(context.target).intersect(view.pixels()),
        depth_clip: !pipeline.desc.primitive.unclipped_depth,
        scalars,
        varying_base,
        positions: &scratch.positions,
        window: &scratch.window,
        out,
        observer: observer.as_deref_mut().map(|o| o as &mut dyn Observer),
    };
    for (i, primitive) in scratch.primitives.iter().enumerate() {
        let id = if has_ids { scratch.emitted_from[i] } else { part.first + i as u32 };
        match pipeline.rasterized {
            PrimitiveClass::Triangles => emitter.triangle(*primitive, primitive.map(|v| scratch.outcodes[v as usize]), id),
            PrimitiveClass::Lines => {
                emitter.line([primitive[0], primitive[1]], [0, 1].map(|k| scratch.outcodes[primitive[k] as usize]), id)
            }
            PrimitiveClass::Points => {
                let v = primitive[0] as usize;
                emitter.point(primitive[0], scratch.outcodes[v], scratch.point_sizes[v], id);
            }
        }
    }
}

/// Lists the vertices that the part's primitives use, each once, and the primitives in terms of that list.
fn gather_vertices(draw: &Draw<'_>, assembly: &Assembly, part: &Part, scratch: &mut Scratch) {
    scratch.vertex_index.clear();
    scratch.primitives.clear();
    let first_element = draw.elements.start;
    let ids = part.first..part.first + part.count;
    match (&draw.index, assembly) {
        (None, Assembly::Regular { topology, .. }) => {
            // Elements are consecutive: no cache needed.
            let start = assembly.elements(part.first)[0];
            let last = assembly.elements(part.first + part.count - 1);
            let per_primitive = super::assemble::vertices_per_primitive(*topology);
            let end = last[..per_primitive].iter().max().map_or(start, |e| e + 1);
            scratch.vertex_index.extend((start..end).map(|e| first_element + e));
            scratch.primitives.extend(ids.map(|id| assembly.elements(id).map(|e| e.wrapping_sub(start))));
            if per_primitive == 2 {
                scratch.primitives.iter_mut().for_each(|p| p[2] = p[1]);
            }
        }
        _ => {
            scratch.cache.clear();
            scratch.cache.resize(CACHE, (0, u32::MAX));
            let per_primitive = super::assemble::vertices_per_primitive(draw.pipeline.desc.primitive.topology);
            for id in ids {
                let elements = assembly.elements(id);
                let mut primitive = [0; 3];
                for corner in 0..per_primitive {
                    let element = first_element + elements[corner];
                    let vertex = match &draw.index {
                        Some(index) => index.get(element as usize).wrapping_add_signed(draw.base_vertex),
                        None => element,
                    };
                    let entry = &mut scratch.cache[vertex as usize % CACHE];
                    if entry.1 == u32::MAX || entry.0 != vertex {
                        *entry = (vertex, scratch.vertex_index.len() as u32);
                        scratch.vertex_index.push(vertex);
                    }
                    primitive[corner] = entry.1;
                }
                for corner in per_primitive..3 {
                    primitive[corner] = primitive[per_primitive - 1];
                }
                scratch.primitives.push(primitive);
            }
        }
    }
}

fn shade_vertices(context: &ChunkContext<'_>, draw: &Draw<'_>, part: &Part, scratch: &mut Scratch, statistics: &mut PipelineStatistics) {
    let pipeline = draw.pipeline;
    let count = scratch.vertex_index.len();
    fetch_attributes(
        &pipeline.desc.vertex_buffers,
        draw.vertex_buffers,
        pipeline.locations,
        &scratch.vertex_index,
        part.instance,
        &mut scratch.attributes,
    );
    scratch.positions.resize(count, [0.0; 4]);
    scratch.point_sizes.resize(count, 1.0);
    scratch.varyings.resize(count * pipeline.vertex_scalars, 0.0);
    let mut batch = VertexBatch {
        vertex_index: &scratch.vertex_index,
        instance_index: part.instance,
        attributes: &scratch.attributes,
        locations: pipeline.locations,
        scalars: pipeline.vertex_scalars,
        positions: &mut scratch.positions,
        point_sizes: &mut scratch.point_sizes,
        varyings: &mut scratch.varyings,
    };
    pipeline.desc.program.vertex.run(context.execution, &draw.bindings, &mut batch);
    statistics.vertex_shader_invocations += count as u64;
}

/// Replaces the part's vertices and primitives by what the geometry shader makes of them.
fn run_geometry_stage(
    draw: &Draw<'_>,
    part: &Part,
    scratch: &mut Scratch,
    statistics: &mut PipelineStatistics,
    observer: &mut Option<&mut dyn Observer>,
) {
    let pipeline = draw.pipeline;
    let Some(geometry) = &pipeline.desc.program.geometry else { return };
    let per_primitive = super::assemble::vertices_per_primitive(pipeline.desc.primitive.topology);
    let bindings: &Bindings<'_> = &draw.bindings;
    scratch.emitted.clear();
    scratch.emitted_varyings.clear();
    scratch.emitted_from.clear();
    let inputs = std::mem::take(&mut scratch.primitives);
    let mut outputs = Vec::with_capacity(inputs.len());
    for (i, primitive) in inputs.iter().enumerate() {
        let vertices = primitive.map(|v| {
            let v = v as usize;
            StageVertex {
                position: scratch.positions[v],
                point_size: scratch.point_sizes[v],
                varyings: &scratch.varyings[v * pipeline.vertex_scalars..(v + 1) * pipeline.vertex_scalars],
            }
        });
        let primitive_id = part.first + i as u32;
        let input = GeometryInput { vertices: &vertices[..per_primitive], primitive_id, instance_index: part.instance };
        scratch.strips.clear();
        let first = scratch.emitted.len();
        let mut output = GeometryOutput {
            vertices: &mut scratch.emitted,
            varyings: &mut scratch.emitted_varyings,
            strips: &mut scratch.strips,
            strip_start: first,
            scalars: pipeline.interpolation.len(),
            budget: geometry.max_vertices,
        };
        geometry.shader.geometry(bindings, &input, &mut output);
        output.end_primitive();
        let mut start = first as u32;
        for &length in &scratch.strips {
            match geometry.output {
                GeometryTopology::Points => outputs.extend((start..start + length).map(|v| [v; 3])),
                GeometryTopology::LineStrip => outputs.extend((1..length).map(|k| [start + k - 1, start + k, start + k])),
                GeometryTopology::TriangleStrip => outputs.extend((2..length).map(|k| {
                    let v = start + k - 2;
                    if k & 1 == 0 { [v, v + 1, v + 2] } else { [v, v + 2, v + 1] }
                })),
            }
            start += length;
        }
        scratch.emitted_from.resize(outputs.len(), primitive_id);
        if let Some(observer) = observer.as_deref_mut() {
            let positions: Vec<_> = scratch.emitted[first..].iter().map(|v| v.0).collect();
            observer.geometry(part.draw, primitive_id, &positions, &scratch.strips);
        }
    }
    statistics.geometry_shader_invocations += inputs.len() as u64;
    statistics.geometry_shader_primitives += outputs.len() as u64;
    scratch.primitives = outputs;
    scratch.positions.clear();
    scratch.point_sizes.clear();
    scratch.positions.extend(scratch.emitted.iter().map(|v| v.0));
    scratch.point_sizes.extend(scratch.emitted.iter().map(|v| v.1));
    std::mem::swap(&mut scratch.varyings, &mut scratch.emitted_varyings);
}

/// Appends the part's primitives as position and varyings per vertex.
fn stream_out(pipeline: &RenderPipeline, draw: u32, scratch: &Scratch, out: &mut ChunkOutput) {
    let scalars = pipeline.interpolation.len();
    let corners = match pipeline.rasterized {
        PrimitiveClass::Points => 1,
        PrimitiveClass::Lines => 2,
        PrimitiveClass::Triangles => 3,
    };
    let mut data = Vec::with_capacity(scratch.primitives.len() * corners * (4 + scalars));
    for primitive in &scratch.primitives {
        for &vertex in &primitive[..corners] {
            let v = vertex as usize;
            data.extend_from_slice(&scratch.positions[v]);
            data.extend_from_slice(&scratch.varyings[v * scalars..(v + 1) * scalars]);
        }
    }
    out.stream.push((draw, data));
}

/// Turns assembled primitives into binned records.
struct Emitter<'a> {
    draw: u32,
    instance: u32,
    pipeline: &'a RenderPipeline,
    view: ViewTransform,
    scissor: PixelRect,
    depth_clip: bool,
    scalars: usize,
    varying_base: u32,
    positions: &'a [[f32; 4]],
    window: &'a [WindowVertex],
    out: &'a mut ChunkOutput,
    observer: Option<&'a mut dyn Observer>,
}

/// A corner after clipping: where it is and where its varyings start.
#[derive(Clone, Copy)]
struct Corner {
    window: WindowVertex,
    varyings: u32,
    clip: [f32; 4],
}

impl Emitter<'_> {
    fn report(&mut self, id: u32, corners: Option<[[i32; 2]; 3]>, outcome: PrimitiveOutcome) {
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

    fn varyings_of(&self, vertex: u32) -> u32 {
        self.varying_base + vertex * self.scalars as u32
    }

    fn corner(&self, vertex: u32) -> Corner {
        let v = vertex as usize;
        Corner { window: self.window[v], varyings: self.varyings_of(vertex), clip: self.positions[v] }
    }

    #[inline(always)]
    fn triangle(&mut self, vertices: [u32; 3], codes: [u8; 3], id: u32) {
        self.out.statistics.clipper_invocations += 1;
        let any = codes[0] | codes[1] | codes[2];
        if any & outside::NAN != 0 || codes[0] & codes[1] & codes[2] & outside::FRUSTUM != 0 {
            self.report(id, None, PrimitiveOutcome::Rejected);
        } else if any & self.view.clip_mask() == 0 {
            self.out.statistics.clipper_primitives_out += 1;
            self.window_triangle(vertices.map(|v| self.corner(v)), id, false);
        } else {
            self.clipped_triangle(vertices, id);
        }
    }

    /// Clips, gives every new corner its varyings, and draws the polygon as a fan.
    fn clipped_triangle(&mut self, vertices: [u32; 3], id: u32) {
        let triangle = vertices.map(|v| self.positions[v as usize]);
        let (polygon, count) = clip_triangle(&self.view, self.depth_clip, triangle);
        // Coordinates near the greatest f32 overflow on the way.
        if count < 3 || polygon[..count].iter().any(|v| !is_finite(v.position)) {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        let corners: Vec<Corner> = polygon[..count]
            .iter()
            .map(|v| {
                let original = v.original.map(|i| vertices[usize::from(i)]);
                let window = original.map_or_else(|| self.view.window_vertex(v.position, true), |i| self.window[i as usize]);
                Corner { window, varyings: self.mixed_varyings(vertices, v.weights), clip: v.position }
            })
            .collect();
        let pieces = if self.view.rules.clip_volume == ClipVolume::GuardBand {
            ears(&corners)
        } else {
            (1..count - 1).map(|k| [0, k, k + 1]).collect()
        };
        for piece in pieces {
            self.out.statistics.clipper_primitives_out += 1;
            self.window_triangle(piece.map(|k| corners[k]), id, true);
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

    #[inline(always)]
    fn window_triangle(&mut self, corners: [Corner; 3], id: u32, clipped: bool) {
        let [w0, w1, w2] = [&corners[0].window, &corners[1].window, &corners[2].window];
        let area = double_area([w0, w1, w2]);
        let at = || Some([[w0.fx, w0.fy], [w1.fx, w1.fy], [w2.fx, w2.fy]]);
        if area == 0 {
            return self.report(id, at(), PrimitiveOutcome::ZeroArea);
        }
        let state = &self.pipeline.desc.primitive;
        let front = (area < 0) == (state.front_face == FrontFace::Ccw);
        let culled = match state.cull_mode {
            Some(Face::Front) => front,
            Some(Face::Back) => !front,
            None => false,
        };
        if culled {
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
            z = depth_plane(self.pipeline.rules.depth_plane, [w0, w1, w2], area, || corners.map(|c| c.clip));
            let bias = self.depth_bias(&z, [w0.z, w1.z, w2.z]);
            z.base += bias;
            let pixels = ((max.0 - min.0) + (max.1 - min.1)) as f32 / 256.0 + z.anchor_slack();
            if z.may_leave(self.view.depth_range, [w0.z, w1.z, w2.z], bias, pixels) {
                flags |= flag::CLAMP_Z;
            }
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            let planes = interpolation_planes(self.pipeline.rules.setup_from, [w0, w1, w2], area);
            self.out.attributes.push(PrimitiveAttributes {
                varyings: corners.map(|c| c.varyings),
                primitive_id: id,
                front_facing: front,
                ..planes
            });
        }
        let clockwise = if area > 0 { [w0, w1, w2] } else { [w0, w2, w1] };
        self.insert(Prepared { edges: edges(clockwise), z, bounds: bounds.into(), draw: self.draw, attributes, sequence: 0, flags });
    }

    fn insert(&mut self, mut primitive: Prepared) {
        primitive.sequence = self.out.sequence;
        self.out.sequence += 1;
        primitive.flags |= (u32::from(primitive.z.sixteenths[0]) | u32::from(primitive.z.sixteenths[1]) << 4) << flag::SIXTEENTHS;
        self.out.bins.insert(&primitive);
    }

    fn needs_depth(&self) -> bool {
        self.pipeline.depth.tests_depth() || self.pipeline.fragment.attributes || self.observer.is_some()
    }

    /// `constant·r + slope_scale·max_slope`, clamped [D3D11.3 §15.10]; `r` is the depth format's smallest step, or for floats the unit in
    /// the last place of the triangle's greatest depth.
    fn depth_bias(&self, plane: &ZPlane, z: [f32; 3]) -> f32 {
        let Some(state) = &self.pipeline.desc.depth_stencil else { return 0.0 };
        if !state.bias.is_enabled() {
            return 0.0;
        }
        let step = match self.pipeline.depth.kind {
            Some(super::format::ChannelKind::UnormDepth(bits)) => 1.0 / ((1u32 << bits) - 1) as f32,
            _ => {
                let greatest = z[0].abs().max(z[1].abs()).max(z[2].abs());
                let exponent = (greatest.to_bits() >> 23) as i32 - 127;
                crate::math::lanes::Lanes::exp2_int((exponent - 23).max(-126) as f32)
            }
        };
        let bias = state.bias.constant as f32 * step + state.bias.slope_scale * max_slope(plane);
        let clamp = state.bias.clamp;
        if clamp > 0.0 {
            bias.min(clamp)
        } else if clamp < 0.0 {
            bias.max(clamp)
        } else {
            bias
        }
    }

    /// A point sprite: the square of its size around the snapped centre, by the triangle's fill rule [D3D11.3 §3.4.6].
    fn point(&mut self, vertex: u32, code: u8, size: f32, id: u32) {
        self.out.statistics.clipper_invocations += 1;
        // Sprites are clipped by their centre against depth, and against the sides where the rules have no guard band.
        if code & (outside::NAN | self.view.clip_mask()) != 0 {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        self.out.statistics.clipper_primitives_out += 1;
        let corner = self.corner(vertex);
        let w = corner.window;
        // Not-a-number becomes the least size.
        let half = (if size.is_nan() { 0.0 } else { size }.clamp(1.0 / 128.0, MAX_POINT_SIZE) * HALF as f32).round_ties_even() as i32;
        let at = Some([[w.fx, w.fy]; 3]);
        let Some(bounds) = pixel_bounds_half_open((w.fx - half, w.fy - half), (w.fx + half, w.fy + half), self.scissor) else {
            return self.report(id, at, PrimitiveOutcome::NoSamples);
        };
        if self.observer.is_some() {
            self.report(id, at, PrimitiveOutcome::Rasterized { clipped: false, front_facing: true });
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            let per_pixel = ONE as f32 / (2 * half) as f32;
            let anchor = [w.fx >> 8, w.fy >> 8];
            let start = [0, 1].map(|axis| {
                let left = if axis == 0 { w.fx } else { w.fy } - half;
                ((anchor[axis] << 8) + HALF - left) as f32 / (2 * half) as f32
            });
            self.out.attributes.push(PrimitiveAttributes {
                anchor: [anchor[0] as f32, anchor[1] as f32],
                l1: [start[0], per_pixel, 0.0],
                l2: [start[1], 0.0, per_pixel],
                inv_w: [w.inv_w; 3],
                varyings: [corner.varyings; 3],
                primitive_id: id,
                front_facing: true,
                is_point: true,
            });
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

    /// A line: the rectangle of its width around the segment, corners snapped, as two triangles [Vulkan spec, strict lines].
    fn line(&mut self, vertices: [u32; 2], codes: [u8; 2], id: u32) {
        self.out.statistics.clipper_invocations += 1;
        let any = codes[0] | codes[1];
        if any & outside::NAN != 0 || codes[0] & codes[1] & outside::FRUSTUM != 0 {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        let ends = if any & self.view.clip_mask() == 0 {
            vertices.map(|v| self.corner(v))
        } else {
            let clipped = clip_line(&self.view, self.depth_clip, vertices.map(|v| self.positions[v as usize]));
            let Some(clipped) = clipped.filter(|ends| ends.iter().all(|v| is_finite(v.position))) else {
                return self.report(id, None, PrimitiveOutcome::Rejected);
            };
            clipped.map(|v| match v.original {
                Some(i) => self.corner(vertices[usize::from(i)]),
                None => Corner {
                    window: self.view.window_vertex(v.position, true),
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
            z = depth_plane(self.pipeline.rules.depth_plane, [w0, w1, w2], area, || corners.map(|c| c.clip));
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
    fn anchor_slack(&self) -> f32 {
        if self.anchor == [0, 0] { 32768.0 } else { 2.0 }
    }
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
