//! Energy of a picture relative to a reference.

use super::pair::{MetricError, Pair};

/// Energy of the test relative to that of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyRatio {
    /// Energy of the reference per channel, in the pictures' unit times m2: watts for an irradiance.
    pub reference: [f64; 3],
    /// Energy of the test per channel, in the same unit.
    pub test: [f64; 3],
    /// Ratio per channel; `None` if the reference's energy is 0.
    pub channels: [Option<f64>; 3],
    /// Ratio of the sums over all channels; 1 if energy is conserved.
    pub total: f64,
}

/// `ΣE_test·dA / ΣE_ref·dA` over the pixels that count, per channel and over all channels.
///
/// `areas_m2` is the area of the surface that each pixel shows, row-major, at least 0; entries of pixels that do not count are ignored. A picture of
/// a receiver seen from straight above has equal areas; in perspective, farther pixels have larger areas.
///
/// # Errors
/// If there is not one area per pixel, an area is negative or not finite, or the reference sums to 0.
pub fn energy_ratio(pair: &Pair, areas_m2: &[f32]) -> Result<EnergyRatio, MetricError> {
    pair.check_count("list of areas", areas_m2.len())?;
    let (mut reference, mut test) = ([0.0; 3], [0.0; 3]);
    for (index, (r, x)) in pair.indices().zip(pair.pixels()) {
        let area_m2 = areas_m2[index];
        if !(area_m2 >= 0.0 && area_m2.is_finite()) {
            let (x, y) = pair.position(index);
            let allowed = "it must be at least 0 and finite";
            return Err(MetricError::BadValue { list: "list of areas", x, y, channel: 0, value: area_m2, allowed });
        }
        for channel in 0..3 {
            reference[channel] += f64::from(r[channel]) * f64::from(area_m2);
            test[channel] += f64::from(x[channel]) * f64::from(area_m2);
        }
    }
    let sum: f64 = reference.iter().sum();
    if sum == 0.0 {
        return Err(MetricError::NoEnergy { sum });
    }
    let channels = [0, 1, 2].map(|channel| (reference[channel] != 0.0).then(|| test[channel] / reference[channel]));
    Ok(EnergyRatio { reference, test, channels, total: test.iter().sum::<f64>() / sum })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_weigh_the_pixels() {
        let reference = [[1.0, 2.0, 0.0], [3.0, 0.0, 0.0]];
        let test = [[2.0, 2.0, 1.0], [3.0, 0.0, 0.0]];
        let ratio = energy_ratio(&Pair::new(2, 1, &reference, &test).unwrap(), &[0.5, 2.0]).unwrap();
        assert_eq!((ratio.reference, ratio.test), ([6.5, 1.0, 0.0], [7.0, 1.0, 0.5]));
        assert_eq!(ratio.channels, [Some(7.0 / 6.5), Some(1.0), None]);
        assert_eq!(ratio.total, 8.5 / 7.5);
    }

    #[test]
    fn moving_light_keeps_the_ratio_and_losing_it_does_not() {
        let reference = [[4.0; 3], [1.0; 3]];
        let (moved, lost) = ([[1.0; 3], [4.0; 3]], [[4.0; 3], [0.9; 3]]);
        let total = |test, areas: [f32; 2]| energy_ratio(&Pair::new(2, 1, &reference, test).unwrap(), &areas).unwrap().total;
        assert_eq!(total(&moved, [1.0; 2]), 1.0);
        assert!((total(&lost, [1.0; 2]) - 0.98).abs() < 1.0e-7);
        assert_ne!(total(&moved, [1.0, 2.0]), 1.0);
    }

    #[test]
    fn what_cannot_be_divided_is_refused() {
        let black = [[0.0; 3]; 2];
        let grey = [[1.0; 3]; 2];
        assert_eq!(energy_ratio(&Pair::new(2, 1, &black, &grey).unwrap(), &[1.0; 2]), Err(MetricError::NoEnergy { sum: 0.0 }));
        let pair = Pair::new(2, 1, &grey, &grey).unwrap();
        assert_eq!(energy_ratio(&pair, &[1.0]), Err(MetricError::WrongCount { list: "list of areas", width: 2, height: 1, found: 1 }));
        for area in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(energy_ratio(&pair, &[1.0, area]), Err(MetricError::BadValue { x: 1, y: 0, .. })));
        }
    }
}
