//! Geometry shaders: 0..N primitives out per primitive in. They are scalar and see one primitive at a time.

use std::sync::Arc;

use crate::api::bindings::Bindings;
use crate::api::shader::clip_vertices::ClipVertices;
use crate::api::shader::varying::Varying;
use crate::api::state::GeometryTopology;

/// A vertex of a primitive that enters the geometry stage.
#[derive(Clone, Copy, Debug)]
pub struct StageVertex<'a> {
    /// Clip-space position.
    pub position: [f32; 4],
    /// Point size in pixels.
    pub point_size: f32,
    /// The vertex stage's scalars.
    pub varyings: &'a [f32],
}

/// The input of a geometry shader: one primitive.
pub struct GeometryInput<'a> {
    /// One, two or three vertices.
    pub vertices: &'a [StageVertex<'a>],
    /// `primitive_index`, from 0 in each instance.
    pub primitive_id: u32,
    /// `instance_index`.
    pub instance_index: u32,
}

/// Collects the vertices that a geometry shader emits.
pub struct GeometryOutput<'a> {
    pub(crate) vertices: &'a mut ClipVertices,
    pub(crate) varyings: &'a mut Vec<f32>,
    /// Lengths of the finished strips.
    pub(crate) strips: &'a mut Vec<u32>,
    pub(crate) strip_start: usize,
    pub(crate) scalars: usize,
    pub(crate) budget: usize,
}

impl GeometryOutput<'_> {
    /// Adds a vertex to the current strip. `varyings` are the scalars of [`Program::varyings`](crate::shader::Program::varyings). Vertices beyond `max_vertices` are ignored, as in
    /// every API.
    #[inline]
    pub fn emit(&mut self, position: [f32; 4], point_size: f32, varyings: &[f32]) {
        if self.budget == 0 {
            return;
        }
        self.budget -= 1;
        self.vertices.push(position, point_size);
        self.varyings.extend_from_slice(&varyings[..self.scalars]);
    }
    /// Ends the current strip.
    #[inline]
    pub fn end_primitive(&mut self) {
        let length = self.vertices.len() - self.strip_start;
        self.strip_start = self.vertices.len();
        self.strips.push(length as u32);
    }
}

/// A geometry shader: 0..N primitives out per primitive in.
pub trait GeometryShader: Send + Sync {
    /// Shades one primitive and emits its vertices to `output`.
    fn geometry(&self, bindings: &Bindings<'_>, input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>);
}

/// The geometry stage of a program.
#[derive(Clone)]
pub struct Geometry {
    /// The shader.
    pub shader: Arc<dyn GeometryShader>,
    /// Kind of the primitives it emits.
    pub output: GeometryTopology,
    /// Most vertices that it emits per input primitive.
    pub max_vertices: usize,
    /// Varyings from the vertex stage to the geometry stage; [`Program::varyings`](crate::shader::Program::varyings) go on from the geometry stage.
    pub input_varyings: Vec<Varying>,
}
