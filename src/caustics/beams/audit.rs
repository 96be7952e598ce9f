//! The energy audit of beams.

use rayon::prelude::*;

use super::{Beam, LightBeams, SurfaceEnergy};

/// Energy of all beams by name, in watts summed over RGB.
///
/// With `water` for the generators, `water_incident = absorbed_before_surface + surface_reflected + surface_totally_reflected + surface_grazing +
/// water_entered`. At the height of the beams' bottom cap, for unblocked beams, `beams_carry = absorbed_above_bottom + reached_bottom`. In physical
/// radiometry `beams_carry = water_entered`. `bottom_y`: height of the bottom cap of each light's beams, in their space.
#[must_use]
pub fn audit(generators: &str, beams: &[LightBeams], bottom_y: impl Fn(&LightBeams) -> f32) -> Vec<(String, f64)> {
    let mut energy = SurfaceEnergy::default();
    let mut bottom = 0.0;
    let mut carried = 0.0;
    for light in beams {
        energy.add(&light.energy);
        let (bottom_y, sigma_t) = (bottom_y(light), light.sigma_t);
        let left = |beam: &Beam| {
            let length = [0, 1, 2].map(|i: usize| beam.depth(i, bottom_y) * beam.d[i].y).iter().sum::<f32>() / 3.0;
            sigma_t.to_array().map(|sigma| libm::exp(f64::from(-sigma * length.max(0.0))))
        };
        // Exponentials are computed in parallel and summed in the order of the beams: the same bits for any number of threads.
        let shares: Vec<[f64; 3]> = light.beams.par_iter().with_min_len(1024).map(left).collect();
        for (beam, left) in light.beams.iter().zip(shares) {
            for (flux, left) in beam.flux.to_array().into_iter().zip(left) {
                carried += f64::from(flux);
                bottom += f64::from(flux) * left;
            }
        }
    }
    let entry = |name: &str, watts| (name.to_owned(), watts);
    vec![
        entry(&format!("{generators}_incident"), energy.incident),
        entry("absorbed_before_surface", energy.absorbed),
        entry("surface_reflected", energy.reflected),
        entry("surface_totally_reflected", energy.totally_reflected),
        entry("surface_grazing", energy.grazing),
        entry(&format!("{generators}_entered"), energy.entered),
        entry("beams_carry", carried),
        entry("absorbed_above_bottom", carried - bottom),
        entry("reached_bottom", bottom),
    ]
}
