//! Media: water, glass, and smoke of varying density.
//!
//! The transmittance of a homogeneous medium follows from Beer & Lambert's law. That of smoke is estimated without bias by ratio tracking [Novák,
//! Selle & Jarosz 2014]: steps are drawn as if the smoke had its greatest density `σ̄` everywhere, and at each step the estimate is multiplied by
//! `1 − σ_t(x)/σ̄`, the probability that the real smoke lets the light pass.

use glam::Vec3;

use nephroid_scene::geom::{Aabb, Ray};
use nephroid_scene::{DensityGrid, Medium, Smoke};

use super::random::Draws;

/// Smoke with its density sampled on a grid.
pub(super) struct SmokeBox {
    bounds: Aabb,
    grid: DensityGrid,
    scale: Vec3,
    /// Scattering coefficient at density 1, 1/m.
    pub sigma_s: Vec3,
    /// Extinction coefficient at density 1, 1/m.
    pub sigma_t: Vec3,
    /// Mean cosine of the phase function.
    pub g: f32,
    majorant: f32,
}

impl SmokeBox {
    /// Samples the density of a scene's smoke.
    pub fn new(smoke: &Smoke) -> Self {
        let grid = smoke.density_grid();
        let cells = Vec3::from_array(grid.corners.map(|c| (c - 1) as f32));
        let densest = grid.values.iter().copied().fold(0.0, f32::max);
        let sigma_t = smoke.sigma_a + smoke.sigma_s;
        Self {
            bounds: Aabb { min: smoke.min, max: smoke.max },
            scale: cells / (smoke.max - smoke.min),
            grid,
            sigma_s: smoke.sigma_s,
            sigma_t,
            g: smoke.g,
            majorant: sigma_t.max_element() * densest,
        }
    }

    /// Density at a point, linear between the corners of the grid; 0 outside of the box.
    pub fn density(&self, p: Vec3) -> f32 {
        if !self.bounds.contains(p) {
            return 0.0;
        }
        let corners = self.grid.corners;
        let last = Vec3::from_array(corners.map(|c| (c - 2) as f32));
        let at = (p - self.bounds.min) * self.scale;
        let cell = at.clamp(Vec3::ZERO, last).as_uvec3();
        let f = at - cell.as_vec3();
        let [x, y, z] = cell.to_array().map(|c| c as usize);
        let (row, plane) = (corners[0] as usize, corners[0] as usize * corners[1] as usize);
        let first = z * plane + y * row + x;
        let value = |dx: usize, dy: usize, dz: usize| self.grid.values[first + dz * plane + dy * row + dx];
        let along_x = |dy, dz| value(0, dy, dz) + (value(1, dy, dz) - value(0, dy, dz)) * f.x;
        let along_y = |dz| along_x(0, dz) + (along_x(1, dz) - along_x(0, dz)) * f.y;
        along_y(0) + (along_y(1) - along_y(0)) * f.z
    }

    /// An unbiased estimate of the transmittance over `0..length` of a ray, linear RGB.
    pub fn transmittance(&self, ray: Ray, length: f32, draws: &mut Draws) -> Vec3 {
        let mut estimate = Vec3::ONE;
        let Some((enter, leave)) = ray.meet_aabb(self.bounds) else { return estimate };
        let leave = leave.min(length);
        if self.majorant <= 0.0 {
            return estimate;
        }
        let mut t = enter;
        loop {
            // A number in (0, 1], so that its logarithm is finite.
            t -= libm::logf(1.0 - draws.uniform()) / self.majorant;
            if t >= leave {
                return estimate;
            }
            estimate *= Vec3::ONE - self.sigma_t * (self.density(ray.at(t)) / self.majorant);
        }
    }

    /// Integral of the density over a ray from `from` to `to`, m: exact, because the density along a ray is a cubic polynomial in each cell of the
    /// grid, which Simpson's rule integrates.
    pub fn column(&self, ray: Ray, from: f32, to: f32) -> f32 {
        let Some((enter, leave)) = self.span(ray, to) else { return 0.0 };
        let mut t = enter.max(from);
        // Along each axis: distance to the next plane between cells, and between planes.
        let (mut next, mut step) = ([f32::INFINITY; 3], [f32::INFINITY; 3]);
        for axis in 0..3 {
            let (size, along) = (1.0 / self.scale[axis], ray.direction[axis]);
            if along == 0.0 || self.grid.corners[axis] == 2 {
                continue;
            }
            step[axis] = size / along.abs();
            let at = (ray.origin[axis] + along * t - self.bounds.min[axis]) * self.scale[axis];
            let ahead = if along > 0.0 { at.floor() + 1.0 } else { at.ceil() - 1.0 };
            next[axis] = t + ((ahead - at) * size / along).max(0.0);
        }
        let (mut sum, mut before) = (0.0, self.density_near(ray.at(t)));
        while t < leave {
            let axis = if next[0] <= next[1] && next[0] <= next[2] {
                0
            } else if next[1] <= next[2] {
                1
            } else {
                2
            };
            let end = next[axis].min(leave);
            next[axis] += step[axis];
            let after = self.density_near(ray.at(end));
            sum += (end - t) * (before + 4.0 * self.density_near(ray.at(0.5 * (t + end))) + after) / 6.0;
            (t, before) = (end, after);
        }
        sum
    }

    /// The density at a point that is in the box but for rounding.
    pub fn density_near(&self, p: Vec3) -> f32 {
        self.density(p.clamp(self.bounds.min, self.bounds.max))
    }

    /// Transmittance over a part of a ray, linear RGB, exact.
    pub fn exact_transmittance(&self, ray: Ray, length: f32) -> Vec3 {
        even_transmittance(self.sigma_t, self.column(ray, 0.0, length))
    }

    /// Whether the density is not 1 everywhere in the box.
    pub fn is_uneven(&self) -> bool {
        self.grid.values.iter().any(|density| *density != 1.0)
    }

    /// Length of the shortest side of a cell, m.
    pub fn cell_size(&self) -> f32 {
        self.scale.recip().min_element()
    }

    /// The box that the smoke fills.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Whether the smoke scatters light in any channel.
    pub fn scatters(&self) -> bool {
        self.sigma_s != Vec3::ZERO && self.majorant > 0.0
    }

    /// The part of a ray inside the box, up to `length`.
    pub fn span(&self, ray: Ray, length: f32) -> Option<(f32, f32)> {
        let (enter, leave) = ray.meet_aabb(self.bounds)?;
        (enter < leave.min(length)).then_some((enter, leave.min(length)))
    }
}

/// The medium that a stretch of a path runs through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Air, with smoke if there is any.
    Air,
    /// Water.
    Water,
    /// Glass of the object with this number.
    Glass(u32),
}

/// Transmittance of a homogeneous medium, linear RGB. Over an infinite length it is 0, except in channels without extinction.
pub(super) fn even_transmittance(sigma_t: Vec3, length: f32) -> Vec3 {
    let share = |sigma: f32| if sigma == 0.0 { 1.0 } else { nephroid_math::optics::beer_lambert(sigma, length) };
    Vec3::new(share(sigma_t.x), share(sigma_t.y), share(sigma_t.z))
}

/// The share of the extinguished light that a medium scatters; the rest is absorbed.
pub(super) fn scattered_share(sigma_a: Vec3, sigma_s: Vec3) -> Vec3 {
    let total = sigma_a + sigma_s;
    Vec3::select(total.cmpgt(Vec3::ZERO), sigma_s / total, Vec3::ZERO)
}

/// [`scattered_share`] of the water's medium.
pub(super) fn water_share(medium: &Medium) -> Vec3 {
    scattered_share(medium.sigma_a, medium.sigma_s)
}

impl SmokeBox {
    /// [`scattered_share`] of the smoke.
    pub fn share(&self) -> Vec3 {
        scattered_share(self.sigma_t - self.sigma_s, self.sigma_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Purpose;
    use nephroid_scene::Density;

    fn smoke(density: Density) -> SmokeBox {
        SmokeBox::new(&Smoke {
            min: Vec3::ZERO,
            max: Vec3::splat(2.0),
            sigma_a: Vec3::new(0.1, 0.2, 0.3),
            sigma_s: Vec3::new(0.5, 0.4, 0.6),
            g: 0.0,
            density,
        })
    }

    const RAY: Ray = Ray { origin: Vec3::new(-1.0, 0.7, 1.1), direction: Vec3::X };

    /// Mean of many estimates, and its standard error.
    fn estimate(smoke: &SmokeBox, length: f32) -> (f64, f64) {
        let count = 40_000;
        let (mut sum, mut squares) = (0.0_f64, 0.0_f64);
        for k in 0..count {
            let value = f64::from(smoke.transmittance(RAY, length, &mut Draws::new(3, Purpose::Photon, 0, k)).x);
            sum += value;
            squares += value * value;
        }
        let mean = sum / f64::from(count);
        (mean, ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt())
    }

    #[test]
    fn ratio_tracking_agrees_with_beer_and_lambert_in_even_smoke() {
        let (mean, error) = estimate(&smoke(Density::Uniform), 10.0);
        let truth = libm::exp(-0.6 * 2.0);
        assert!((mean - truth).abs() < 4.0 * error, "{mean} ± {error}, expected {truth}");
        assert!((mean - libm::exp(-0.6 * 1.9)).abs() > 4.0 * error, "the check is too coarse");
        // From outside to the middle.
        let (mean, error) = estimate(&smoke(Density::Uniform), 2.0);
        assert!((mean - libm::exp(-0.6)).abs() < 4.0 * error);
    }

    #[test]
    fn ratio_tracking_agrees_with_quadrature_in_uneven_smoke() {
        let smoke = smoke(Density::Noise { scale_m: 0.7, octaves: 3, threshold: -0.3, cells: (16, 16, 16), seed: 4 });
        let (mean, error) = estimate(&smoke, 10.0);
        let steps = 20_000;
        let depth: f64 = (0..steps)
            .map(|k| f64::from(smoke.density(RAY.at(1.0 + 2.0 * (k as f32 + 0.5) / steps as f32))) * 2.0 / f64::from(steps) * 0.6)
            .sum();
        assert!(depth > 0.05, "the ray meets no smoke");
        assert!((mean - libm::exp(-depth)).abs() < 4.0 * error, "{mean} ± {error}, expected {}", libm::exp(-depth));
    }

    #[test]
    fn columns_are_exact_from_anywhere_to_anywhere() {
        let even = smoke(Density::Uniform);
        assert!((even.column(RAY, 0.0, 10.0) - 2.0).abs() < 1e-6 && (even.column(RAY, 1.5, 2.0) - 0.5).abs() < 1e-6);
        assert_eq!(even.column(RAY, 0.0, 0.9), 0.0);
        let uneven = smoke(Density::Noise { scale_m: 0.7, octaves: 3, threshold: -0.3, cells: (16, 12, 20), seed: 4 });
        let slanted = Ray { origin: Vec3::new(-1.0, 2.3, 0.4), direction: Vec3::new(0.8, -0.48, 0.36) };
        for (ray, from, to) in [(RAY, 0.0, 10.0), (slanted, 0.0, 9.0), (slanted, 1.7, 2.6)] {
            let steps = 40_000;
            let step = (to - from) / steps as f32;
            let sum: f64 = (0..steps).map(|k| f64::from(uneven.density(ray.at(from + step * (k as f32 + 0.5)))) * f64::from(step)).sum();
            let found = f64::from(uneven.column(ray, from, to));
            assert!(sum > 0.02 && (found - sum).abs() < 1e-3 * sum, "{found}, by steps {sum}");
        }
    }

    #[test]
    fn even_media_over_endless_ways_let_nothing_pass_unless_they_are_nothing() {
        assert_eq!(even_transmittance(Vec3::new(0.0, 1.0, 2.0), f32::INFINITY), Vec3::new(1.0, 0.0, 0.0));
    }
}
