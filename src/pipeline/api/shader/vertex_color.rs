//! A program for tests of the other stages: each vertex has a clip position and a colour.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;

use crate::api::bindings::Bindings;
use crate::api::shader::fragment::{FragmentInput, FragmentOutput, FragmentShader};
use crate::api::shader::program::Program;
use crate::api::shader::varying::Varying;
use crate::api::shader::vertex::{VertexInput, VertexOutput, VertexShader};

/// Both shaders of [`Program::vertex_color`].
struct VertexColor;

impl VertexShader for VertexColor {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        output.position = input.attribute(0);
        let color = input.attribute(1);
        output.set3(0, color.xyz());
        output.varyings[3] = color.w;
    }
}

impl FragmentShader for VertexColor {
    const MERGES_FRAGMENTS: bool = true;
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = v4(input.varying(0), input.varying(1), input.varying(2), input.varying(3));
    }
}

impl Program {
    /// Attribute 0 is the position in clip space. Attribute 1 is the colour, which is interpolated in perspective and written to target 0. Attributes
    /// of fewer than four components are completed with 0, 0, 0, 1.
    #[must_use]
    pub fn vertex_color() -> Self {
        Self { varyings: vec![Varying::perspective("color", 4)], ..Self::new("vertex_color", VertexColor, VertexColor) }
    }
}
