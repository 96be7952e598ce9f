//! Rippled sand.

use glam::{UVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Check, ShapeError, planar::height_grid};
use nephroid_math::noise;

use crate::geom::Mesh;

/// A sandy floor: dunes of fractal noise, and ripples whose crests wander, fork and fade.
///
/// `h(p) = D f(p / L) + R w(φ(p)) m(p)` with `f` fractal noise, `φ = 2π d · p / λ + warp noise` the phase of the ripples, `w` a wave with
/// sharp crests and flat troughs, and `m` a slow noise that lets patches fade. Centred on the origin, about `y = 0`, facing up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Terrain {
    /// Lengths along x and z in metres, above 0. Default: (8, 8).
    pub size_m: Vec2,
    /// Number of cells along x and z, 1 to 4096. Default: (320, 320).
    pub cells: UVec2,
    /// `D`, height of the dunes above and below the mean in metres, 0 to 100. Default: 0.25.
    pub dune_height_m: f32,
    /// `L`, breadth of the dunes in metres, above 0. Default: 3.
    pub dune_length_m: f32,
    /// `R`, height of the ripples from trough to crest in metres, 0 to 10. Default: 0.03.
    pub ripple_height_m: f32,
    /// `λ`, distance between crests in metres, above 0. Default: 0.25.
    pub ripple_length_m: f32,
    /// Direction across the crests (x, z), not zero. Default: (1, 0.35).
    pub ripple_direction: Vec2,
    /// Number that chooses the noise. Default: 1.
    pub seed: u32,
}

impl Default for Terrain {
    fn default() -> Self {
        Self {
            size_m: Vec2::splat(8.0),
            cells: UVec2::splat(320),
            dune_height_m: 0.25,
            dune_length_m: 3.0,
            ripple_height_m: 0.03,
            ripple_length_m: 0.25,
            ripple_direction: Vec2::new(1.0, 0.35),
            seed: 1,
        }
    }
}

impl Terrain {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Terrain");
        self.size_m.to_array().into_iter().try_for_each(|side| check.length("size_m", side))?;
        self.cells.to_array().into_iter().try_for_each(|count| check.count("cells", count, 1..=4096))?;
        check.number("dune_height_m", self.dune_height_m, 0.0..=100.0)?;
        check.length("dune_length_m", self.dune_length_m)?;
        check.number("ripple_height_m", self.ripple_height_m, 0.0..=10.0)?;
        check.length("ripple_length_m", self.ripple_length_m)?;
        if self.ripple_direction.try_normalize().is_none() {
            check.fail("ripple_direction", self.ripple_direction, "finite and not zero")?;
        }
        Ok(height_grid(self.size_m, self.cells, |xz| {
            let (y, slope) = self.height(xz);
            (y, Vec3::new(-slope.x, 1.0, -slope.y).normalize())
        }))
    }

    /// Height in metres at `(x, z)`, and its gradient.
    #[must_use]
    pub fn height(&self, xz: Vec2) -> (f32, Vec2) {
        let dunes = noise::Fbm { octaves: 4, lacunarity: 2.1, gain: 0.4 };
        let at = |scale_m: f32, seed: u32| {
            let p = xz / scale_m;
            let (value, gradient) = noise::perlin2_gradient(p.x, p.y, self.seed.wrapping_add(seed));
            (value, Vec2::from(gradient) / scale_m)
        };
        let p = xz / self.dune_length_m;
        let (dune, dune_slope) = dunes.at2_gradient(p.x, p.y, self.seed);
        let dune_slope = Vec2::from(dune_slope) / self.dune_length_m;

        // Two sizes of wandering: whole crests bend, and neighbours close up and part.
        let direction = self.ripple_direction.normalize_or(Vec2::X);
        let wave_number = std::f32::consts::TAU / self.ripple_length_m;
        let (bend, bend_slope) = at(self.ripple_length_m * 7.0, 101);
        let (fork, fork_slope) = at(self.ripple_length_m * 2.5, 102);
        let phase = wave_number * direction.dot(xz) + 9.0 * bend + 2.2 * fork;
        let phase_slope = direction * wave_number + bend_slope * 9.0 + fork_slope * 2.2;
        let (sin, cos) = libm::sincosf(phase);
        // cos φ + cos²φ / 4, from −3/4 to 5/4: crests sharper than troughs. Halved to a height of 1.
        let wave = (cos + 0.25 * cos * cos) * 0.5;
        let wave_slope = phase_slope * (-sin * (1.0 + 0.5 * cos) * 0.5);

        let (patch, patch_slope) = at(self.ripple_length_m * 9.0, 103);
        let (fade, fade_slope) = (0.65 + 0.35 * patch, patch_slope * 0.35);
        let height = self.dune_height_m * dune + self.ripple_height_m * wave * fade;
        let slope = dune_slope * self.dune_height_m + (wave_slope * fade + fade_slope * wave) * self.ripple_height_m;
        (height, slope)
    }
}
