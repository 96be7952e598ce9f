//! Where the light of beams ends behind the water's surface.
//!
//! A beam is drawn through everything, and a shadow map decides at each pixel whether its light has come so far. The audit asks the same maps, once per beam:
//! the map of straight rays, how much of its light objects before the water keep away; and the map through the surface, where its middle ray meets the first
//! receiver. The search is a fixed point, `t ← t + (map's depth − depth)`; where that does not settle, as at an object's edge, the ray is walked in
//! [`STEPS`] steps and the step that ends behind a receiver is halved, which always ends.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use nephroid_math::float::exp;
use nephroid_math::vector::{V3, v3};
use nephroid_pipeline::frame::{FrameOutput, TextureId};
use nephroid_pipeline::sampler::{Sampler, sample_compare};
use nephroid_pipeline::state::CompareFunction;
use nephroid_pipeline::{Surface, Texture, TextureView};

use super::{Beam, LightBeams};
use crate::audit::{Audit, Entry};
use crate::passes::shadow_map::LightUniform;

/// Rounds of the fixed point.
const ROUNDS: usize = 4;

/// Steps of the walk along a ray for which these do not suffice. An object that is narrower than a step can be missed.
const STEPS: usize = 32;

/// Halvings of such a step.
const HALVINGS: usize = 8;

/// Distance from a receiver that counts as none, as a share of the depth of the map.
const CLOSE: f32 = 1.0e-3;

/// The beams of a light through the water's surface.
#[derive(Clone, Debug)]
pub struct BeamTally {
    /// The beams.
    pub beams: Arc<LightBeams>,
    /// The light.
    pub light: LightUniform,
    /// The map of straight rays; `None` if objects before the water keep nothing away.
    pub straight: Option<TextureId>,
    /// The map through the surface; `None` if beams pass through everything.
    pub refracted: Option<TextureId>,
    /// Extinction coefficient along the beams as they are drawn, 1/m.
    pub sigma_t: Vec3,
    /// Height at which beams end, in their space, m.
    pub bottom_y: f32,
    /// By beam, whether it was culled as shaded; empty if none was.
    pub culled: Vec<bool>,
}

/// Where a beam ends.
enum End {
    /// On a receiver, at a distance below its generator, m.
    Lands(f32),
    /// Nowhere.
    Misses,
}

/// Beams of a task. It does not depend on the number of threads.
const PART: usize = 1024;

impl BeamTally {
    /// The light of all beams by its end.
    #[must_use]
    pub fn audit(&self, output: &FrameOutput<'_>) -> Audit {
        let behind = if self.refracted.is_some() {
            &[Entry::AbsorbedBehind, Entry::Clamped, Entry::Missed, Entry::Landed][..]
        } else {
            &[Entry::AbsorbedBehind, Entry::ReachedBottom]
        };
        let mut entries = [&[Entry::Carried], behind].concat();
        entries.extend(self.straight.map(|_| Entry::Shaded));
        entries.extend((!self.culled.is_empty()).then_some(Entry::Culled));
        let start = Audit::of(&entries);
        let of = |texture: Option<TextureId>| texture.map(|id| output.texture(id));
        let maps =
            Maps { straight: of(self.straight).map(Texture::view), refracted: of(self.refracted).map(|texture| texture.surface(0, 0)) };
        let part = |(number, beams): (usize, &[Beam])| {
            let mut audit = start.clone();
            for (k, beam) in beams.iter().enumerate() {
                self.count(beam, self.culled.get(number * PART + k) == Some(&true), &maps, &mut audit);
            }
            audit
        };
        let parts: Vec<Audit> = self.beams.beams.par_chunks(PART).enumerate().map(part).collect();
        parts.iter().fold(start.clone(), |mut all, part| {
            all.merge(part);
            all
        })
    }

    /// Adds the light of a beam.
    fn count(&self, beam: &Beam, culled: bool, maps: &Maps<'_>, audit: &mut Audit) {
        let flux = beam.flux.truncate();
        let watts = |light: Vec3| light.as_dvec3().element_sum();
        audit.add(Entry::Carried, watts(flux));
        let mut lit = 1.0;
        if let Some(map) = &maps.straight {
            lit = self.lit(beam, map);
            audit.add(Entry::Shaded, watts(flux * (1.0 - lit)));
        }
        let flux = flux * lit;
        if culled {
            audit.add(Entry::Culled, watts(flux));
            return;
        }
        if flux == Vec3::ZERO {
            return;
        }
        let middle = MiddleRay::of(beam, self.beams.side);
        let bottom = middle.start.y * self.beams.side - self.bottom_y;
        let (length, end) = match maps.refracted.map(|map| self.end(&middle, map, bottom)) {
            None => (bottom, Entry::ReachedBottom),
            Some(End::Misses) => (bottom, Entry::Missed),
            Some(End::Lands(at)) if at > bottom => (bottom, Entry::Clamped),
            Some(End::Lands(at)) => (at, Entry::Landed),
        };
        let path = self.sigma_t * (length.max(0.0) * middle.length);
        let kept = Vec3::from_array(path.to_array().map(|path| if path == 0.0 { 1.0 } else { exp(-path) }));
        audit.add(Entry::AbsorbedBehind, watts(flux * (Vec3::ONE - kept)));
        audit.add(end, watts(flux * kept));
    }

    /// Share of a beam's light that objects before the water let through: the mean of its corners, as the techniques interpolate it.
    fn lit(&self, beam: &Beam, map: &TextureView<'_>) -> f32 {
        let sampler = Sampler::comparison(CompareFunction::LessEqual);
        let corner = |g: &Vec4| {
            let (uv, depth, inside) = self.light.on_straight_map(v3(g.x, g.y * self.beams.side, g.z));
            if inside { sample_compare(map, &sampler, uv, 0, depth) } else { 1.0 }
        };
        beam.g.iter().map(corner).sum::<f32>() / 3.0
    }

    /// Where a ray meets the first receiver. `bottom`: distance below its start at which the beam ends, m.
    fn end(&self, ray: &MiddleRay, map: &Surface, bottom: f32) -> End {
        let close = CLOSE * self.light.refracted.w;
        // Distance along the ray, per metre of depth, from the receiver in the map at a distance; below 0 before it.
        let gap = |at: f32| {
            let (uv, depth) = self.light.on_refracted_map(ray.at(at));
            let texel = |share: f32, size: u32| ((share * size as f32).max(0.0) as u32).min(size - 1);
            let first = map.get(texel(uv.x, map.width), texel(uv.y, map.height), 0);
            // 1 is a texel without a receiver.
            (first < 1.0).then_some((depth - first) * self.light.refracted.w)
        };
        let mut at = 0.0_f32;
        for _ in 0..ROUNDS {
            match gap(at) {
                Some(gap) if gap.abs() < close => return End::Lands(at),
                Some(gap) => at = (at - gap).max(0.0),
                None => break,
            }
        }
        // To the deepest place that the map can hold.
        let end = self.light.refracted.w.max(bottom);
        let step = end / STEPS as f32;
        let behind = |at: f32| gap(at).is_some_and(|gap| gap >= 0.0);
        let Some(number) = (1..=STEPS).find(|&k| behind(step * k as f32)) else { return End::Misses };
        let (mut low, mut high) = (step * (number - 1) as f32, step * number as f32);
        for _ in 0..HALVINGS {
            let middle = (low + high) * 0.5;
            if behind(middle) { high = middle } else { low = middle }
        }
        End::Lands(high)
    }
}

/// The maps of a light.
struct Maps<'a> {
    straight: Option<TextureView<'a>>,
    refracted: Option<&'a Surface>,
}

/// The ray through the middle of a beam, in the world.
struct MiddleRay {
    start: Vec3,
    /// Per metre of depth.
    step: Vec3,
    /// Length per metre of depth.
    length: f32,
}

impl MiddleRay {
    fn of(beam: &Beam, side: f32) -> Self {
        let mean = |of: fn(&Beam, usize) -> Vec4| (of(beam, 0) + of(beam, 1) + of(beam, 2)) / 3.0;
        let (g, d) = (mean(|beam, i| beam.g[i]), mean(|beam, i| beam.d[i]));
        Self { start: Vec3::new(g.x, g.y * side, g.z), step: Vec3::new(d.x, -side, d.z), length: d.y }
    }

    fn at(&self, depth: f32) -> V3<f32> {
        let p = self.start + self.step * depth;
        v3(p.x, p.y, p.z)
    }
}
