//! Dispersion: the refractive index of red, green and blue light.
//!
//! Cauchy's formula `n(λ) = A + B/λ²` passes through the index `n_d` at 587.56 nm; the Abbe number `V = (n_d − 1)/(n_F − n_C)` determines the spread,
//! with n_F at 486.13 nm and n_C at 656.28 nm. Red, green and blue are 650, 550 and 450 nm, as for the media.

use glam::Vec3;

use nephroid_scene::{Material, Scene};

/// Wavelengths of red, green and blue, μm.
const COLOURS_UM: [f64; 3] = [0.650, 0.550, 0.450];

/// Fraunhofer's lines F, d and C, μm.
const LINES_UM: [f64; 3] = [0.486_13, 0.587_56, 0.656_28];

/// Whether the colours are traced together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wavelengths {
    /// Without dispersion: each photon carries all three colours.
    Together,
    /// With dispersion: each photon carries one colour.
    Apart,
}

impl Wavelengths {
    /// `Apart` if a material of the scene has dispersion.
    pub fn of(scene: &Scene) -> Self {
        let glass = scene.objects.iter().any(|object| matches!(object.material, Material::Dielectric { abbe: Some(_), .. }));
        let water = scene.water.as_ref().is_some_and(|water| water.abbe.is_some());
        if glass || water { Self::Apart } else { Self::Together }
    }

    /// The parts of a batch: for each, the channels that its photons carry.
    pub fn parts(self) -> &'static [Vec3] {
        match self {
            Self::Together => &[Vec3::ONE],
            Self::Apart => &[Vec3::X, Vec3::Y, Vec3::Z],
        }
    }

    /// The colour of a part: 0, 1 or 2; `None` for all three.
    pub fn colour(self, part: u32) -> Option<usize> {
        (self == Self::Apart).then_some(part as usize)
    }
}

/// Refractive index of a material of index `n_d` and Abbe number `abbe` for a colour; `n_d` without dispersion.
pub(super) fn index_at(n_d: f32, abbe: Option<f32>, colour: Option<usize>) -> f32 {
    let (Some(abbe), Some(colour)) = (abbe, colour) else { return n_d };
    let per_square = |um: f64| 1.0 / (um * um);
    let [f, d, c] = LINES_UM.map(per_square);
    let b = (f64::from(n_d) - 1.0) / f64::from(abbe) / (f - c);
    (f64::from(n_d) + b * (per_square(COLOURS_UM[colour]) - d)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cauchy_gives_back_index_and_abbe_number() {
        let (n, v) = (1.5168_f64, 64.17_f64);
        let per_square = |um: f64| 1.0 / (um * um);
        let [f, d, c] = LINES_UM.map(per_square);
        let b = (n - 1.0) / v / (f - c);
        let at = |x: f64| n + b * (x - d);
        assert!(((n - 1.0) / (at(f) - at(c)) - v).abs() < 1e-9);
        // Crown glass BK7: 1.5145 at 650 nm, 1.5185 at 550 nm, 1.5253 at 450 nm; Cauchy's two terms are good to a few 1e-4.
        for (colour, expected) in [1.5145, 1.5185, 1.5253].into_iter().enumerate() {
            assert!((index_at(1.5168, Some(64.17), Some(colour)) - expected).abs() < 8e-4);
        }
    }

    #[test]
    fn without_an_abbe_number_nothing_is_spread() {
        assert_eq!(index_at(1.5, None, Some(2)), 1.5);
        assert_eq!(index_at(1.5, Some(50.0), None), 1.5);
    }
}
