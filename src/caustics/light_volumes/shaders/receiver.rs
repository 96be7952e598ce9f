//! Light computed at the height of the receiver that a pixel shows.

use crate::beams::Beam;
use crate::beams::geometry::double_area;
use crate::light_volumes::Gather;
use crate::passes::camera::CameraUniform;
use nephroid_math::lanes::Lanes;
use nephroid_math::optics::beer_lambert_rgb;
use nephroid_math::vector::{V3, v2, v3};
use nephroid_pipeline::Bindings;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, VertexInput, VertexOutput, VertexShader};

use super::BeamsUniform;
use super::contribution::BeamContribution;
use super::lit::{drawn_area, lit};
use super::section::section_vertex;

/// Passes on the share of light that reaches each vertex of the generator.
pub struct VertexAtReceiver;

impl VertexShader for VertexAtReceiver {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let beams: &BeamsUniform = bindings.uniform(1);
        output.position = camera.project(beams.turned(section_vertex(bindings, input).position));
        let lit = lit(bindings);
        let token = input.token;
        output.set3(0, v3(L::splat(token, lit[0]), L::splat(token, lit[1]), L::splat(token, lit[2])));
    }
}

/// Computes the light in the section at the receiver's height.
pub struct FragmentAtReceiver {
    /// Whether the paper's radiometry is used.
    pub paper: bool,
    /// The quantity that is summed.
    pub gather: Gather,
}

impl FragmentShader for FragmentAtReceiver {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let beams: &BeamsUniform = bindings.uniform(1);
        let beam: &Beam = bindings.uniform(4);
        let lit = input.flat_varyings();
        let p: V3<L> = beams.turned(input.texel3_here(bindings.texture(7)));
        let zero = p.x.like(0.0);
        let corners = beam.section(p.y);
        let double_area = double_area(&corners);
        let area = drawn_area(beams, beam, p.y, &corners, double_area);
        // Barycentric weights, clamped: the stencil decides which pixels are inside, and walls cut into triangles deviate slightly from the section.
        let at = v2(p.x, p.z);
        let inverse = zero.like(1.0) / double_area;
        let mut weights = [zero; 3];
        for (i, weight) in weights.iter_mut().enumerate() {
            let (a, b) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
            *weight = Lanes::clamp((b - a).perp_dot(at - a) * inverse, 0.0, 1.0);
        }
        let sum = zero.like(1.0) / Lanes::max(weights[0] + weights[1] + weights[2], zero.like(1.0e-6));
        let [b0, b1, b2] = [weights[0] * sum, weights[1] * sum, weights[2] * sum];
        let ray = beam.ray([b0, b1, b2]);
        let travelled = beam.path_length([b0, b1, b2], p.y);
        let share = b0 * (lit[0] * beam.d[0].w) + b1 * (lit[1] * beam.d[1].w) + b2 * (lit[2] * beam.d[2].w);
        let flux = V3::splat(input.token, beam.flux.truncate());
        let left = beer_lambert_rgb(beams.sigma_t.truncate(), Lanes::max(travelled, zero));
        let contribution = BeamContribution { intensity: flux.hadamard(left) * (share / beam.lit_area(area)), ray };
        contribution.write(self.paper, self.gather, bindings, input, output);
    }
}
