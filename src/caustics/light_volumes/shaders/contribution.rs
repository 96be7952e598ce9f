//! The contribution of a beam to the targets.

use crate::light_volumes::Gather;
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, V4, v4};
use nephroid_pipeline::Bindings;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput};

use super::BeamsUniform;

/// Light of one beam at a pixel.
pub struct BeamContribution<L> {
    /// Irradiance of a level surface (physical), or I_sp (paper), W/m².
    pub intensity: V3<L>,
    /// Direction of travel, per metre of depth, in the space of the beams.
    pub ray: V3<L>,
}

impl<L: Lanes> BeamContribution<L> {
    /// Writes the contribution to the targets; zeros where there is no receiver.
    #[inline(always)]
    pub fn write(self, paper: bool, gather: Gather, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let zero = self.ray.x.like(0.0);
        let exists = input.texel_here(bindings.texture(7), 3).equals(zero.like(1.0));
        let beams: &BeamsUniform = bindings.uniform(1);
        let ray = beams.turned(self.ray);
        let visible = if beams.sigma_t.w > 0.0 { input.texel_here(bindings.texture(9), 0) } else { zero.like(1.0) };
        let visible = L::select(exists, visible, zero);
        let intensity = self.intensity * visible;
        // Direction towards the light: a unit vector in paper radiometry, per unit of height in physical radiometry, because the section is level
        // [decision E1].
        let unit = -ray.normalize();
        let to_light = if paper { unit } else { -ray };
        let cos = Lanes::max(input.texel3_here(bindings.texture(8)).dot(to_light), zero);
        let irradiance = intensity * cos;
        output.color[0] = match gather {
            Gather::PerBeam => v4(irradiance.x, irradiance.y, irradiance.z, zero),
            Gather::FlatWater => v4(intensity.x, intensity.y, intensity.z, zero),
            Gather::Vector => vector(to_light, intensity.x),
        };
        output.color[1] = vector(to_light, intensity.y);
        output.color[2] = vector(to_light, intensity.z);
        let total = irradiance.x + irradiance.y + irradiance.z;
        output.color[3] = v4(unit.x * total, unit.y * total, unit.z * total, total);
        output.color[4] = v4(L::select(exists, zero.like(1.0), zero), zero, zero, zero);
    }
}

#[inline(always)]
fn vector<L: Lanes>(direction: V3<L>, length: L) -> V4<L> {
    v4(direction.x * length, direction.y * length, direction.z * length, length.like(0.0))
}
