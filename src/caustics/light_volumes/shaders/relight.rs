//! Conversion of summed intensities or vectors to irradiance.

use glam::Vec3;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v3, v4};
use nephroid_pipeline::Bindings;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader};
use nephroid_scene::Radiometry;

use super::RelightUniform;

/// `Σ I·(N·L)`, with L the direction towards the light behind still water, or `N·Σ I L`, per channel [BO §3.2].
pub struct Relight;

impl FragmentShader for Relight {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let light: &RelightUniform = bindings.uniform(0);
        let n: V3<L> = input.texel3_here(bindings.texture(1));
        let zero = n.x.like(0.0);
        let exists = input.texel_here(bindings.texture(2), 3).equals(zero.like(1.0));
        let first = input.texel3_here(bindings.texture(3));
        let irradiance = if light.to_light.w > 0.0 {
            let (green, blue) = (input.texel3_here(bindings.texture(4)), input.texel3_here(bindings.texture(5)));
            v3(n.dot(first), n.dot(green), n.dot(blue))
        } else {
            first * n.dot(V3::splat(input.token, light.to_light.truncate()))
        };
        let none = v3(zero, zero, zero);
        let lit = v3(Lanes::max(irradiance.x, zero), Lanes::max(irradiance.y, zero), Lanes::max(irradiance.z, zero));
        let lit = V3::select(exists, lit, none);
        output.color[0] = v4(lit.x, lit.y, lit.z, zero);
    }
}

/// Direction towards the light behind still water, see [`RelightUniform`].
#[must_use]
pub fn to_light(refracted: Vec3, radiometry: Radiometry) -> Vec3 {
    match radiometry {
        Radiometry::Paper => -refracted,
        Radiometry::Physical => -refracted / refracted.y.abs(),
    }
}
