//! Vertex shaders: their inputs and outputs.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, V4, v4};

use crate::api::bindings::Bindings;
use crate::api::state::MAX_VARYINGS;

/// The vertices of one call.
pub struct VertexInput<'a, L: Lanes> {
    /// Needed to make lanes from constants.
    pub token: L::Token,
    /// `@builtin(vertex_index)` of each lane, base vertex added.
    pub vertex_index: &'a [u32],
    /// `@builtin(instance_index)`, the same for all lanes.
    pub instance_index: u32,
    /// Vertex attributes by shader location; missing components are 0, 0, 0, 1. Integers come as bit patterns.
    pub attributes: &'a [V4<L>],
}

impl<L: Lanes> VertexInput<'_, L> {
    /// The attribute at a shader location.
    #[inline(always)]
    #[must_use]
    pub fn attribute(&self, location: usize) -> V4<L> {
        self.attributes[location]
    }
    /// Reads one number per lane, chosen by the lane's vertex index.
    #[inline(always)]
    pub fn per_vertex(&self, mut f: impl FnMut(u32) -> f32) -> L {
        L::from_fn(self.token, |i| f(self.vertex_index[i]))
    }
    /// Reads four numbers per lane, chosen by the lane's vertex index.
    #[inline(always)]
    pub fn per_vertex4(&self, mut f: impl FnMut(u32) -> [f32; 4]) -> V4<L> {
        let mut lanes = [[0.0; 16]; 4];
        for (lane, &index) in self.vertex_index.iter().enumerate().take(L::LEN) {
            let [x, y, z, w] = f(index);
            lanes[0][lane] = x;
            lanes[1][lane] = y;
            lanes[2][lane] = z;
            lanes[3][lane] = w;
        }
        let [x, y, z, w] = &lanes;
        v4(L::load(self.token, x), L::load(self.token, y), L::load(self.token, z), L::load(self.token, w))
    }
}

/// The output of a vertex shader for the vertices of one call.
pub struct VertexOutput<L: Lanes> {
    /// `@builtin(position)`: clip space, before the divide.
    pub position: V4<L>,
    /// Edge of a point sprite in pixels. Default: 1.
    pub point_size: L,
    /// The varyings' scalars in the program's order.
    pub varyings: [L; MAX_VARYINGS],
}

impl<L: Lanes> VertexOutput<L> {
    /// Writes three scalars, from number `at` on.
    #[inline(always)]
    pub fn set3(&mut self, at: usize, v: V3<L>) {
        self.varyings[at] = v.x;
        self.varyings[at + 1] = v.y;
        self.varyings[at + 2] = v.z;
    }
}

/// A vertex shader, generic over the number of lanes.
///
/// Mark the method `#[inline(always)]`, and the generic functions it calls. Code that is not inlined into the batch loop is compiled without the
/// level's instructions: each operation becomes a call. The result is the same, only slower.
pub trait VertexShader: Send + Sync {
    /// Shades the vertices of one call.
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>);
}
