//! Light that met neither water nor glass nor a mirror: what arrives straight from the lights at a point, with the shadows of objects.
//!
//! Lights are points or parallel, so that one ray decides what a point receives of one light. The water's surface, mirrors and glass end such rays, as
//! every object does: what passes them is the caustic. Media on the way absorb by their exact optical depth.

use glam::Vec3;

use nephroid_math::optics::henyey_greenstein;
use nephroid_math::space::sin_cos_deg;
use nephroid_math::vector::v3;
use nephroid_scene::Light;
use nephroid_scene::geom::Ray;

use super::eye::{Seen, Stretch};
use super::media::{Place, even_transmittance};
use super::photon::lifted;
use super::random::Draws;
use super::tree::NONE;
use super::volume::{Media, View, passed};
use super::water::{Rays, WaterSurface};
use super::world::World;

/// Points on a straight part of a view ray at which the light of one lamp is taken, each in a part of its own.
const POINTS: u32 = 16;

/// Directions closer than this to a light's, as a share, count as the light itself when shadows are sought.
const NEARLY: f32 = 1.0 - 1.0e-5;

/// What light comes straight to a point.
pub(super) struct Direct<'a> {
    pub lights: &'a [Light],
    pub world: &'a World,
    pub water: Option<&'a WaterSurface>,
    pub media: Media<'a>,
    /// How far parallel light comes from, m.
    pub reach: f32,
}

impl Direct<'_> {
    /// Irradiance where a view ray ends, W/m²; `None` if that is not a diffuse surface.
    pub fn at_end(&self, view: &View) -> Option<Vec3> {
        let wet = view.stretches.last().is_some_and(|stretch| stretch.place == Place::Water);
        view.seen.filter(|seen| seen.diffuse).map(|seen| self.irradiance(&seen, wet))
    }

    /// An unbiased estimate of the light scattered once towards the eye along a view ray, W/(m² sr).
    pub fn along(&self, view: &View, draws: &mut Draws) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (stretch, passed) in view.stretches.iter().zip(passed(&view.stretches, self.media)) {
            let radiance = self.scattered(stretch, draws) * passed;
            sum = std::array::from_fn(|channel| sum[channel] + f64::from(radiance[channel]));
        }
        sum
    }

    /// Irradiance at a point of a surface, on the side of its normal, W/m².
    pub fn irradiance(&self, seen: &Seen, wet: bool) -> Vec3 {
        let from = lifted(seen.position, seen.normal);
        let mut sum = Vec3::ZERO;
        for light in self.lights {
            let cos = -seen.normal.dot(light.incident(seen.position).direction_ws);
            if cos > 0.0
                && let Some((_, irradiance)) = self.arriving(light, from, seen.triangle, wet)
            {
                sum += irradiance * cos;
            }
        }
        sum
    }

    /// Direction and irradiance across it of a light at a point; `None` in shadow.
    fn arriving(&self, light: &Light, p: Vec3, skip: u32, wet: bool) -> Option<(Vec3, Vec3)> {
        let incident = light.incident(p);
        if incident.irradiance == Vec3::ZERO {
            return None;
        }
        let back = -incident.direction_ws;
        let (distance, light_is_wet) = match *light {
            Light::Directional { .. } => (f32::INFINITY, false),
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                (position.distance(p), self.water.is_some_and(|water| water.holds(position)))
            }
        };
        // Water has no sides, but what is in water is not lit from outside except through its surface.
        if wet != light_is_wet {
            return None;
        }
        let side = if wet { -1.0 } else { 1.0 };
        let to_water = self
            .water
            .map_or(f32::INFINITY, |water| water.cross(Rays { origin: v3(p.x, p.y, p.z), direction: v3(back.x, back.y, back.z), side }).t);
        if to_water < distance || self.world.nearest(p, back, distance * NEARLY, skip).is_some() {
            return None;
        }
        let way = Ray { origin: p, direction: back };
        let passed = match (wet, self.media.smoke) {
            (true, _) => even_transmittance(self.media.medium.sigma_t(), distance.min(self.reach)),
            (false, Some(smoke)) => smoke.exact_transmittance(way, distance),
            _ => Vec3::ONE,
        };
        Some((incident.direction_ws, incident.irradiance * passed))
    }

    /// An unbiased estimate of the light scattered once towards the start of a straight part of a view ray, W/(m² sr).
    fn scattered(&self, stretch: &Stretch, draws: &mut Draws) -> Vec3 {
        let view = Ray { origin: stretch.origin, direction: stretch.direction };
        let wet = stretch.place == Place::Water;
        let Media { medium, smoke } = self.media;
        let (span, sigma_s, sigma_t, g) = match (stretch.place, smoke) {
            (Place::Water, _) if medium.sigma_s != Vec3::ZERO => {
                ((0.0, stretch.length.min(self.reach)), medium.sigma_s, medium.sigma_t(), medium.g)
            }
            (Place::Air, Some(smoke)) if smoke.scatters() => {
                let Some(span) = smoke.span(view, stretch.length) else { return Vec3::ZERO };
                (span, smoke.sigma_s, smoke.sigma_t, smoke.g)
            }
            _ => return Vec3::ZERO,
        };
        let mut sum = Vec3::ZERO;
        for light in self.lights {
            let Some(places) = Places::new(light, view, span) else { continue };
            for k in 0..POINTS {
                let (s, per_density) = places.at((k as f32 + draws.uniform()) / POINTS as f32);
                let p = view.at(s);
                let Some((direction, irradiance)) = self.arriving(light, p, NONE, wet) else { continue };
                let (density, column) = match smoke {
                    Some(smoke) if !wet => (smoke.density(p), smoke.column(view, 0.0, s)),
                    _ => (1.0, s),
                };
                let phase = henyey_greenstein(-view.direction.dot(direction), g);
                sum += irradiance * sigma_s * even_transmittance(sigma_t, column) * (density * phase * per_density / POINTS as f32);
            }
        }
        sum
    }
}

/// Where on a ray the light of a lamp is taken: evenly for parallel light; for light from a point, evenly in the angle at the point, which cancels the
/// growth of the light near it [Kulla & Fajardo 2012].
enum Places {
    Even {
        from: f32,
        length: f32,
    },
    /// Distance along the ray to the point nearest to the lamp; distance there; angles at both ends.
    Angle {
        foot: f32,
        height: f32,
        from: f32,
        angle: f32,
    },
}

impl Places {
    fn new(light: &Light, view: Ray, span: (f32, f32)) -> Option<Self> {
        let (position, (from, to)) = match *light {
            Light::Directional { .. } => return (span.0 < span.1).then_some(Self::Even { from: span.0, length: span.1 - span.0 }),
            Light::Point { position, .. } => (position, span),
            Light::Spot { position, direction, outer_deg, .. } => {
                (position, within_cone(view, position, direction.normalize(), sin_cos_deg(outer_deg).1 as f32, span)?)
            }
        };
        let offset = position - view.origin;
        let foot = offset.dot(view.direction);
        let height = (offset - view.direction * foot).length().max(1.0e-6 * offset.length());
        let angle = |s: f32| libm::atan2f(s - foot, height);
        let (first, last) = (angle(from), angle(to));
        (from < to && first < last).then_some(Self::Angle { foot, height, from: first, angle: last - first })
    }

    /// The place of a number in 0..1, and one over the density of places there.
    fn at(&self, u: f32) -> (f32, f32) {
        match *self {
            Self::Even { from, length } => (from + length * u, length),
            Self::Angle { foot, height, from, angle } => {
                let tan = libm::tanf(from + angle * u);
                (foot + height * tan, angle * height * (1.0 + tan * tan))
            }
        }
    }
}

/// The part of a range of a ray that contains all of it inside of a cone; `None` if there is nothing.
fn within_cone(view: Ray, apex: Vec3, axis: Vec3, cos: f32, (from, to): (f32, f32)) -> Option<(f32, f32)> {
    // |v| cos = v·axis for v = o + s d − apex, squared: a s² + 2 b s + c = 0.
    let (o, d) = ((view.origin - apex).as_dvec3(), view.direction.as_dvec3());
    let (axis, square) = (axis.as_dvec3(), f64::from(cos) * f64::from(cos));
    let (oa, da) = (o.dot(axis), d.dot(axis));
    let (a, b, c) = (da * da - square * d.length_squared(), oa * da - square * o.dot(d), oa * oa - square * o.length_squared());
    let root = (b * b - a * c).max(0.0).sqrt();
    let mut cuts = [f64::from(from), f64::from(to), f64::from(to), f64::from(to)];
    if a.abs() > 1.0e-12 {
        let roots = [(-b - root) / a, (-b + root) / a];
        (cuts[1], cuts[2]) = (roots[0].min(roots[1]), roots[0].max(roots[1]));
    } else if b != 0.0 {
        cuts[1] = -0.5 * c / b;
    }
    for cut in &mut cuts {
        *cut = cut.clamp(f64::from(from), f64::from(to).max(f64::from(from)));
    }
    let inside = |s: f64| {
        let v = o + d * s;
        v.dot(axis) >= f64::from(cos) * v.length()
    };
    let parts = cuts.windows(2).filter(|part| part[0] < part[1] && inside(0.5 * (part[0] + part[1])));
    let all = parts.fold((f64::INFINITY, f64::NEG_INFINITY), |all, part| (all.0.min(part[0]), all.1.max(part[1])));
    (all.0 < all.1).then_some((all.0 as f32, all.1 as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cones_are_cut_where_rays_enter_and_leave_them() {
        let view = Ray { origin: Vec3::new(0.0, 0.0, 0.0), direction: Vec3::X };
        let cos = sin_cos_deg(20.0).1 as f32;
        let half = libm::tanf(20.0_f32.to_radians()) * 1.5;
        let near = |found: Option<(f32, f32)>, from: f32, to: f32| {
            let (a, b) = found.expect("the ray is in the cone");
            assert!((a - from).abs() < 1e-5 && (b - to).abs() < 1e-5, "{a}..{b}, expected {from}..{to}");
        };
        let apex = Vec3::new(2.0, 1.5, 0.0);
        near(within_cone(view, apex, Vec3::NEG_Y, cos, (0.0, 9.0)), 2.0 - half, 2.0 + half);
        near(within_cone(view, apex, Vec3::NEG_Y, cos, (0.0, 2.0)), 2.0 - half, 2.0);
        // Up, the other half of the double cone is met: there is no light.
        assert_eq!(within_cone(view, apex, Vec3::Y, cos, (0.0, 9.0)), None);
        assert_eq!(within_cone(view, apex, Vec3::NEG_Y, cos, (4.0, 9.0)), None);
        // Along the axis, from the apex on.
        near(within_cone(view, Vec3::new(1.0, 0.0, 0.0), Vec3::X, cos, (0.0, 5.0)), 1.0, 5.0);
    }
}
