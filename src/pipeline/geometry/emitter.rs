//! The end of the geometry phase: from assembled primitives to binned set-up primitives.
//!
//! `triangle.rs`, `point.rs` and `line.rs` set up one primitive at a time and define the result. `small_triangles.rs` and `small_points.rs` set up
//! sixteen small ones at a time, with the same bits.

use crate::api::observer::{Observer, PrimitiveEvent, PrimitiveOutcome};
use crate::api::render_pipeline::RenderPipeline;
use crate::api::shader::clip_vertices::ClipVertices;
use crate::api::shader::varying::Interpolation;
use crate::api::state::{Face, PixelRect};
use crate::geometry::chunk_output::ChunkOutput;
use crate::geometry::depth_bias::{depth_bias, greatest_exponent};
use crate::geometry::viewport::ViewTransform;
use crate::geometry::window_vertices::WindowVertices;
use crate::primitive::corner::Corner;
use crate::primitive::tile_primitive::{SetupPrimitive, flag};

/// Turns assembled primitives into binned tile primitives.
pub(crate) struct Emitter<'a> {
    pub draw: u32,
    pub instance: u32,
    pub pipeline: &'a RenderPipeline,
    pub view: ViewTransform,
    /// Pixels that the draw may change.
    pub scissor: PixelRect,
    /// Index of the part's first varying among the chunk's.
    pub varying_base: u32,
    pub clip: &'a ClipVertices,
    pub window: &'a WindowVertices,
    pub out: &'a mut ChunkOutput,
    pub observer: Option<&'a mut dyn Observer>,
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

    pub fn corner(&self, vertex: u32) -> Corner {
        let v = vertex as usize;
        Corner { window: self.window.get(v), varyings: self.varyings_of(vertex), clip: self.clip.get(v) }
    }

    pub fn outcode(&self, vertex: u32) -> u8 {
        self.window.outcode(vertex as usize)
    }

    pub fn is_culled(&self, front: bool) -> bool {
        match self.pipeline.desc.primitive.cull_mode {
            Some(Face::Front) => front,
            Some(Face::Back) => !front,
            None => false,
        }
    }

    /// Appends the varyings of a vertex that clipping made: the weighted mean of the primitive's vertices, or for flat varyings the provoking
    /// vertex's.
    pub fn mixed_varyings(&mut self, vertices: [u32; 3], weights: [f32; 3]) -> u32 {
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

    pub fn depth_clip(&self) -> bool {
        !self.pipeline.desc.primitive.unclipped_depth
    }

    pub fn insert(&mut self, mut primitive: SetupPrimitive) {
        primitive.sequence = self.out.sequence;
        self.out.sequence += 1;
        primitive.flags |= (u32::from(primitive.z.sixteenths[0]) | u32::from(primitive.z.sixteenths[1]) << 4) << flag::SIXTEENTHS;
        primitive.flags |= u32::from(primitive.z.bias_exponent) << flag::BIAS_EXPONENT;
        self.out.bins.insert(&primitive);
    }

    pub fn needs_depth(&self) -> bool {
        self.pipeline.depth.tests_depth() || self.pipeline.fragment.attributes || self.observer.is_some()
    }

    /// Depth bias of a triangle with this slope and with depths `z` at its vertices.
    pub fn depth_bias(&self, slope: f32, z: [f32; 3]) -> f32 {
        depth_bias(self.pipeline, slope, greatest_exponent(z))
    }
}
