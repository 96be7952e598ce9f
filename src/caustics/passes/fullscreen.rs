//! A pass over every pixel: one triangle that covers the target.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::Bindings;
use nephroid_pipeline::shader::{VertexInput, VertexOutput, VertexShader};

/// Vertices of the triangle.
pub const VERTICES: std::ops::Range<u32> = 0..3;

/// Vertex shader of the triangle (−1, −1), (3, −1), (−1, 3) at depth 0.
pub struct FullscreenVertex;

impl VertexShader for FullscreenVertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let x = input.per_vertex(|i| if i == 1 { 3.0 } else { -1.0 });
        let y = input.per_vertex(|i| if i == 2 { 3.0 } else { -1.0 });
        output.position = v4(x, y, x.like(0.0), x.like(1.0));
    }
}
