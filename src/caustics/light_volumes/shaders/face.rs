//! Light computed at the vertices of a beam's faces and interpolated over the faces [BO §3.2].

use crate::beams::Beam;
use crate::beams::geometry::double_area;
use crate::light_volumes::Gather;
use crate::passes::camera::CameraUniform;
use nephroid_math::lanes::Lanes;
use nephroid_math::optics::beer_lambert_rgb;
use nephroid_math::vector::{V3, v3};
use nephroid_pipeline::Bindings;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, VertexInput, VertexOutput, VertexShader};

use super::BeamsUniform;
use super::contribution::BeamContribution;
use super::lit::lit;
use super::section::section_vertex;

/// Computes intensity and ray at each vertex of a beam's faces.
pub struct VertexAtFace;

impl VertexShader for VertexAtFace {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let camera: &CameraUniform = bindings.uniform(0);
        let beams: &BeamsUniform = bindings.uniform(1);
        let beam: &Beam = bindings.uniform(4);
        let vertex = section_vertex(bindings, input);
        output.position = camera.project(beams.turned(vertex.position));
        let area = double_area(&beam.section(vertex.position.y)).abs() * 0.5;
        let zero = vertex.depth.like(0.0);
        let lit = lit(bindings);
        let second = vertex.number.equals(zero.like(1.0));
        let third = vertex.number.equals(zero.like(2.0));
        let lit = L::select(third, zero.like(lit[2]), L::select(second, zero.like(lit[1]), zero.like(lit[0])));
        // I_sp = I_s·T·A_s/A_p at the vertex [BO §3.1].
        let scale = lit * vertex.ray[3] / beam.lit_area(area);
        let flux = V3::splat(input.token, beam.flux.truncate());
        let intensity = flux.hadamard(beer_lambert_rgb(beams.sigma_t.truncate(), vertex.depth * vertex.ray[1])) * scale;
        output.set3(0, intensity);
        output.set3(3, v3(vertex.ray[0], zero.like(-1.0), vertex.ray[2]));
    }
}

/// Adds the interpolated light of the face to the targets.
pub struct FragmentAtFace {
    /// Whether the paper's radiometry is used.
    pub paper: bool,
    /// The quantity that is summed.
    pub gather: Gather,
}

impl FragmentShader for FragmentAtFace {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let contribution = BeamContribution { intensity: input.varying3(0), ray: input.varying3(3) };
        contribution.write(self.paper, self.gather, bindings, input, output);
    }
}
