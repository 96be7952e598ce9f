//! A weathered stone.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{
    Check, ShapeError,
    sphere::{unit_icosphere, wrap_uvs},
};
use nephroid_math::noise;

use crate::geom::Mesh;

/// A stone: a sphere cut by soft planes and roughened by fractal noise, centred on the origin.
///
/// Every direction from the centre meets the surface once, at `r(n) = R · s · c(n) · (1 + roughness · f(n))`, with `c` a smooth minimum of
/// 1 and the planes and `s` the stretch of the body along the axes; so the mesh is closed and never crosses itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Boulder {
    /// `R`, radius before cutting in metres, above 0. Default: 0.5.
    pub radius_m: f32,
    /// Stretch along the axes, 0.1 to 10 each. Default: (1.15, 0.8, 1).
    pub stretch: Vec3,
    /// Depth of the noise as a fraction of the radius, 0 to 0.5. Default: 0.14.
    pub roughness: f32,
    /// How often the triangles of an icosahedron are cut into four, 0 to 8. Default: 5.
    pub subdivisions: u32,
    /// Number that chooses planes and noise. Default: 1.
    pub seed: u32,
}

impl Default for Boulder {
    fn default() -> Self {
        Self { radius_m: 0.5, stretch: Vec3::new(1.15, 0.8, 1.0), roughness: 0.14, subdivisions: 5, seed: 1 }
    }
}

/// Number of planes that cut the sphere.
const FACETS: u32 = 9;

impl Boulder {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Boulder");
        check.length("radius_m", self.radius_m)?;
        self.stretch.to_array().into_iter().try_for_each(|s| check.number("stretch", s, 0.1..=10.0))?;
        check.number("roughness", self.roughness, 0.0..=0.5)?;
        check.count("subdivisions", self.subdivisions, 0..=8)?;

        let planes: Vec<(Vec3, f32)> = (0..FACETS).map(|i| self.plane(i)).collect();
        let rough = noise::Fbm { octaves: 6, lacunarity: 2.03, gain: 0.47 };
        let mut mesh = unit_icosphere(self.subdivisions);
        for p in &mut mesh.positions {
            let n = *p;
            let q = n * 1.6;
            let bumps = rough.at3(q.x, q.y, q.z, self.seed);
            let cut = planes.iter().fold(1.0, |r, &(normal, distance)| {
                // The plane is met only by directions on its side.
                let cos = normal.dot(n);
                if cos > 0.05 { smooth_min(r, distance / cos, 0.06) } else { r }
            });
            *p = n * self.stretch * (self.radius_m * cut * (1.0 + self.roughness * bumps));
        }
        mesh.smooth_normals();
        wrap_uvs(&mut mesh, self.radius_m, &|p| p.y);
        Ok(mesh)
    }

    /// Unit normal and distance of a cutting plane: spread over the sphere (spherical Fibonacci), then displaced.
    fn plane(&self, i: u32) -> (Vec3, f32) {
        let random = |k: u32| noise::perlin2(i as f32 * 1.37 + 0.5, k as f32 * 2.71 + 0.5, self.seed ^ 0x00b0_17de);
        let y = 1.0 - 2.0 * (i as f32 + 0.5) / FACETS as f32 + 0.25 * random(0);
        let y = y.clamp(-1.0, 1.0);
        let r = (1.0 - y * y).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(i as f32 * 2.399_963 + 3.0 * random(1));
        (Vec3::new(r * cos, y, r * sin), 0.80 + 0.14 * random(2))
    }
}

/// The lesser of two numbers, rounded where they are closer than `k`; never above either.
fn smooth_min(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}
