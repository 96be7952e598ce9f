//! From the caustic map to pixels: the map is projected onto the scene like a shadow map, with a compare of depths [WD06 §3, Fig. 3].
//!
//! A texel holds the flux Φ of the area that it covers. On a receiver with the normal n, in light from the direction l of the map's rays, a texel whose
//! area across the ray is A covers `A/|n·l|`, so that
//!
//! `E = Φ·|n·l|/A`
//!
//! The cosine is that of the map's ray, not that of the photon's, whichever way the photon came (decision E7).

use std::sync::Arc;

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V3, V4, v3, v4};
use nephroid_pipeline::sampler::load;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings};

use crate::passes::fullscreen::FullscreenVertex;
use crate::passes::light_view::TexelView;

/// Farthest distance of a pixel's receiver from the plane of the receiver in the map, in texels of the map.
const OFF_TX: f32 = 3.0;

/// Receivers that the map lights. Its light crosses the water's surface, if there is one, and cannot land on the side that it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lit {
    /// All: there is no water.
    All = 0,
    /// Those under water.
    UnderWater = 1,
    /// Those that are dry.
    Dry = 2,
}

/// Bindings: map's view; pixels' position, normal; map's receivers' position, normal; the map; pixels' albedo.
pub const BINDINGS: [BindingKind; 7] = [
    BindingKind::Uniform(size_of::<TexelView>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// The program.
#[must_use]
pub fn program(lit: Lit) -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("../passes/fullscreen.wgsl"),
            include_str!("../passes/light_view.wgsl"),
            include_str!("gather.wgsl")
        )),
        wgsl_constants: vec![("lit", f64::from(lit as u8))],
        ..Program::new("gather", FullscreenVertex, Fragment { lit })
    })
}

struct Fragment {
    lit: Lit,
}

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let map: &TexelView = bindings.uniform(0);
        let position = bindings.texture(1);
        let p: V3<L> = input.texel3_here(position);
        let n = input.texel3_here(bindings.texture(2));
        let (zero, one) = (p.x.like(0.0), p.x.like(1.0));
        let mut diffuse = input.texel_here(position, 3).equals(one);
        if self.lit != Lit::All {
            let wet = input.texel_here(bindings.texture(6), 3).gt(zero);
            diffuse = diffuse & if self.lit == Lit::UnderWater { wet } else { !wet };
        }
        let cos = -n.dot(map.view.direction_at(p));
        let at = map.texel_at(p);
        let area = map.area_at(p);
        let off = area.sqrt() * OFF_TX;
        let (x, y) = ((at.x - 0.5).floor(), (at.y - 0.5).floor());
        let (right, down) = (at.x - 0.5 - x, at.y - 0.5 - y);
        let mut taps = [(v4(zero, zero, zero, zero), x, y, zero); 4];
        let mut light = zero;
        for (tap, (dx, dy)) in taps.iter_mut().zip([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]) {
            let weight = (if dx > 0.0 { right } else { one - right }) * (if dy > 0.0 { down } else { one - down });
            *tap = (load(bindings.texture(5), x + dx, y + dy, 0, 0), x + dx, y + dy, weight);
            light = light + tap.0.x + tap.0.y + tap.0.z;
        }
        // Most of a picture is dark: where all of a block is, the receivers are not asked for.
        output.color[0] = v4(zero, zero, zero, zero);
        let may_be_lit = diffuse & cos.gt(zero) & !light.le(zero);
        if !may_be_lit.any() {
            return;
        }
        let mut sum = v3(zero, zero, zero);
        let mut weights = zero;
        for (flux, x, y, weight) in taps {
            let there: V4<L> = load(bindings.texture(3), x, y, 0, 0);
            let normal = load(bindings.texture(4), x, y, 0, 0).xyz();
            let same = there.w.gt(zero) & (p - there.xyz()).dot(normal).abs().le(off);
            let weight = L::select(same, weight, zero);
            sum = sum + flux.xyz() * weight;
            weights = weights + weight;
        }
        let lit = may_be_lit & weights.gt(zero);
        let scale = L::select(lit, cos / (area * weights), zero);
        let irradiance = V3::select(lit, sum * scale, v3(zero, zero, zero));
        output.color[0] = v4(irradiance.x, irradiance.y, irradiance.z, zero);
    }
}
